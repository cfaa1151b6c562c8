"""`hindsight review` beyond its own machine: never without a password, and with the study's own."""

from pathlib import Path

import pytest

from app.cli import main
from app.review.secret import Password, desk_password, write_password
from app.study.server.password import ENVIRONMENT, check_password, set_password

PROXY = ["--behind-tls-proxy", "https://lab.example.org"]


def test_beyond_this_machine_only_behind_proxy_and_password(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """Neither an open port nor a proxy without a password; each refusal says what to do."""
    assert main(["review", str(tmp_path), "--host", "0.0.0.0", "--port", "0"]) == 2
    assert "--behind-tls-proxy" in capsys.readouterr().err
    assert main(["review", str(tmp_path), "--port", "0", *PROXY]) == 2
    said = capsys.readouterr().err
    assert "hindsight study password" in said and "--set-password" in said
    empty = tmp_path / "empty"
    empty.write_text("no hash\n")
    asked = ["review", str(tmp_path), "--port", "0", *PROXY, "--password-file", str(empty)]
    assert main(asked) == 2
    assert "holds no password hash" in capsys.readouterr().err


def test_the_desks_password_opens_the_review(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """It is found from the folder of sessions and from each study in it, and nowhere else."""
    sessions, study = tmp_path / "sessions", tmp_path / "sessions" / "pilot" / "data"
    study.mkdir(parents=True)
    assert desk_password(study) is None
    monkeypatch.setenv(ENVIRONMENT, "correct horse battery")
    set_password(sessions)
    kept = desk_password(study)
    assert kept is not None and kept == desk_password(sessions)
    assert Password(kept).matches("correct horse battery")
    assert not Password(kept).matches("correct horse batterie")
    assert desk_password(tmp_path) is None


def test_both_programs_keep_the_same_line(tmp_path: Path):
    """A password file of the review opens the desk as well."""
    write_password(tmp_path / "secret", "correct horse battery")
    assert check_password("correct horse battery", (tmp_path / "secret").read_text())
