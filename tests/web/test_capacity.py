"""How many sessions a machine bears: by cores, by memory, or as measured there."""

from pathlib import Path

import pytest

from app.bench import capacity as bench
from app.web import capacity
from app.web.capacity import keep_measured, read_measured, rule, usable_cores
from app.web.config import ServerConfig

GIB = 2**30


@pytest.mark.parametrize(
    ("cores", "memory", "sessions"),
    [
        (1.0, 64 * GIB, 2),
        (2.0, 64 * GIB, 4),
        (8.0, 64 * GIB, 16),
        (0.5, 64 * GIB, 1),
        (0.1, 64 * GIB, 1),
        (16.0, 2 * GIB, 4),
        (2.0, GIB // 2, 1),
    ],
)
def test_the_rule_goes_by_cores_and_memory(cores: float, memory: int, sessions: int) -> None:
    """At least one session; the lesser of the two counts."""
    assert rule(cores, memory).sessions == sessions


def test_a_container_counts_the_cores_it_was_granted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Not those of the machine; "max" means no limit."""
    quota = tmp_path / "cpu.max"
    monkeypatch.setattr(capacity, "_CGROUP_QUOTA", quota)
    free = usable_cores()
    quota.write_text("max 100000\n")
    assert usable_cores() == free
    quota.write_text("50000 100000\n")
    assert usable_cores() == 0.5


def test_what_was_measured_holds_for_this_machine_only(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A cache folder that came along from another machine does not count, nor does nonsense."""
    path = tmp_path / "folder" / "capacity.json"
    assert read_measured(path) is None
    keep_measured(7, path)
    assert read_measured(path) == 7
    monkeypatch.setattr(capacity, "machine", lambda: "another one")
    assert read_measured(path) is None
    monkeypatch.undo()
    for text in ("", "[]", '{"sessions": 7}', "null", path.read_text().replace("7", "0", 1)):
        path.write_text(text)
        assert read_measured(path) is None


def test_a_server_offers_what_was_measured_unless_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """`--capacity` wins over the measurement, the measurement over the rule."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    by_rule = ServerConfig().max_workers
    assert by_rule >= 1
    keep_measured(by_rule + 3)
    assert ServerConfig().max_workers == by_rule + 3
    assert ServerConfig(capacity=2).max_workers == 2


@pytest.mark.parametrize(("foreign", "kept"), [(0.0, 3), (0.05, 3), (0.9, None)])
def test_what_other_programs_have_spoiled_is_not_kept(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    foreign: float,
    kept: int | None,
) -> None:
    """A busy machine bears less than it could: it is said, and servers go on by the rule."""

    def load(sessions: int, seconds: float) -> bench.Load:
        return bench.Load(sessions, 1.0, 100, 0, 0, 0.1, 1.0, 20.0, 1.0, 50.0, foreign=foreign)

    monkeypatch.setattr(bench, "measure_load", load)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    figures = bench.bench_capacity((1, 3), 1.0, keep=True)
    assert figures["3 sessions"]["others"] == foreign
    assert read_measured() == kept
    assert ("0.90 cores meanwhile" in capsys.readouterr().err) is (kept is None)
