"""Whole studies: every method in both worlds, pairs, determinism, workers that die, full disks."""

import errno
import json
import os
from collections import defaultdict
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from app.core import METHODS
from app.simulate import pool, store, study
from app.simulate.errors import SimulateError
from app.simulate.plan import assign, make_study
from app.simulate.study import run_study
from app.simulate.table import COLUMNS
from app.simulate.trial import Runner

EVERY = ",".join([*METHODS, "blend:distance-gate", "blend:probability-gate"])


def test_every_method_in_the_kinematic_world():
    """A small study: everyone who knows the goal gets there."""
    rows = run_study(make_study(methods=EVERY, trials=3, seed=5), workers=1).rows
    assert len(rows) == 3 * 7
    assert {row["method"] for row in rows} == set(EVERY.split(","))
    for row in rows:
        assert row["success"], row
        assert 0.5 < row["time_s"] < 30.0
        assert 0.0 < row["input_s"] < row["time_s"]
        assert -1.0 <= row["felt_control"] <= 1.0
    direct = [row for row in rows if row["method"] == "direct"]
    assert all(row["felt_control"] > 0.98 and row["wrong_way_m"] < 0.01 for row in direct)


def test_styles_differ_only_where_the_robot_acts():
    """Without assistance those who let it work, or fight it, do as those who just go on."""

    def time_s(users: str, method: str) -> float:
        plan = make_study(methods=method, users=users, trials=6, seed=21)
        return sum(row["time_s"] for row in run_study(plan, workers=1).rows)

    plain, lazy, fight = (time_s(users, "direct") for users in ("continue", "lazy", "fight"))
    assert lazy == pytest.approx(plain, rel=0.1)
    assert fight == pytest.approx(plain, rel=0.1)
    assert time_s("lazy", "policy") > 1.2 * time_s("continue", "policy")


def test_every_method_in_the_physics_world():
    """The same users and measures with arm, contacts and lifted objects."""
    rows = run_study(make_study(methods=EVERY, trials=1, seed=5, world="physics"), workers=1).rows
    assert [row["method"] for row in rows] == EVERY.split(",")
    for row in rows:
        assert row["world"] == "physics"
        assert row["outcome"] in ("grasped", "knocked_over"), row
        assert 0.5 < row["time_s"] < 30.0
    assert rows[0]["success"]
    assert sum(row["success"] for row in rows) >= 3


def test_every_model_can_do_a_trial():
    """Whoever the population sends; who wants the unmodelled has no right goal to infer."""
    seen = set()
    for users in ("paper-like", "maxent", "edge-cases"):
        for row in run_study(
            make_study(methods="policy", users=users, trials=18, seed=2), workers=1
        ).rows:
            seen.add(row["user_model"])
            assert row["outcome"] in ("grasped", "timeout", "closed_on_nothing", "wrong_object")
            assert (row["log_loss"] is None) == (row["user_model"] == "unmodelled")
            if row["user_model"] == "unmodelled":
                assert row["inferred_goal"] != row["object"]
    assert {"continue", "lazy", "maxent", "idle", "unmodelled", "changes-mind"} <= seen


def test_pairs_share_everything_but_the_method():
    """Scene, goal, user and parameters; every user does every object once."""
    plan = make_study(methods="direct,blend,policy", trials=6, seed=9)
    rows = run_study(plan, workers=1).rows
    pairs: dict[Any, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        pairs[row["participant_id"], row["trial"]].append(row)
    assert len(pairs) == 6
    for trials in pairs.values():
        assert [row["method_position"] for row in trials] == [1, 2, 3]
        for key in ("object", "seed", "user_model", "options"):
            assert len({row[key] for row in trials}) == 1, key
    for user in ("user-0001", "user-0002"):
        objects = {row["object"] for row in rows if row["participant_id"] == user}
        assert objects == set(plan.scene.object_names)


def test_a_user_is_the_same_in_all_trials_and_another_with_another_seed():
    """Parameters are drawn once per user."""
    plan = make_study(methods="policy", trials=9, seed=4)
    people = [assign(plan, i) for i in range(9)]
    assert people[0].parameters == people[2].parameters != people[3].parameters
    assert len({p.layout_seed for p in people}) == 9
    other = assign(make_study(methods="policy", trials=9, seed=5), 0)
    assert other.parameters != people[0].parameters


@pytest.mark.parametrize("world", ["kinematic", "physics"])
def test_the_number_of_workers_changes_nothing(tmp_path: Path, world: str):
    """Bit for bit, rows and files."""
    trials = 5
    methods = "blend,yielding" if world == "kinematic" else "yielding"
    plan = make_study(methods=methods, trials=trials, seed=7, world=world)
    alone = run_study(plan, workers=1, out=tmp_path / "one")
    shared = run_study(plan, workers=2, out=tmp_path / "two")
    assert alone.complete and alone.rows == shared.rows
    for name in ("trials.parquet", "calibration.csv", "config.json"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_a_method_is_not_influenced_by_those_beside_it():
    """The physics world is really reset between trials."""
    both = make_study(methods="blend,policy", trials=1, seed=3, world="physics")
    alone = make_study(methods="policy", trials=1, seed=3, world="physics")
    second = Runner(both).run(0)[1]
    (only,) = Runner(alone).run(0)
    assert {**second, "method_position": 1} == only


def _die_once(flag: str) -> None:
    """Stands in for a worker that is killed."""
    if not os.path.exists(flag):
        Path(flag).touch()
        os._exit(9)


def _fragile_chunk(indices: tuple[int, ...]) -> pool.Done:
    _die_once(os.environ["HINDSIGHT_TEST_FLAG"])
    return pool._run_chunk(indices)


def _deadly_chunk(indices: tuple[int, ...]) -> pool.Done:
    os._exit(9)


@pytest.mark.slow
def test_trials_of_a_dead_worker_are_run_again_and_counted_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """One worker dies in the middle; nothing is lost or doubled."""
    plan = make_study(methods="policy", trials=10, seed=1)
    expected = run_study(plan, workers=1).rows
    monkeypatch.setattr(pool, "_START_METHOD", "spawn")  # so that workers see this environment
    monkeypatch.setenv("HINDSIGHT_TEST_FLAG", str(tmp_path / "died"))
    monkeypatch.setattr(pool, "_work", _fragile_chunk)
    run = run_study(plan, workers=2)
    assert (tmp_path / "died").exists()
    assert run.complete and run.rows == expected


@pytest.mark.slow
def test_workers_that_always_die_end_the_study_with_a_reason(monkeypatch: pytest.MonkeyPatch):
    """Instead of trying for ever."""
    monkeypatch.setattr(pool, "_work", _deadly_chunk)
    with pytest.raises(SimulateError, match=r"workers died 3 times .* trials 0, 1.*--workers"):
        run_study(make_study(methods="policy", trials=6), workers=2)


def test_an_interrupt_keeps_what_is_done_and_the_next_run_continues(tmp_path: Path):
    """Ctrl-C after two trials, then the same command again: as if nothing had happened."""
    plan = make_study(methods="blend,policy", trials=5, seed=8)

    def interrupt(done: int, of: int, left_s: float) -> None:
        if done == 2:
            raise KeyboardInterrupt

    cut = run_study(plan, workers=1, out=tmp_path / "run", progress=interrupt)
    assert not cut.complete and len(cut.rows) == 4
    assert pq.read_table(tmp_path / "run" / "trials.parquet").num_rows == 4
    whole = run_study(plan, workers=1, out=tmp_path / "run")
    assert whole.complete
    assert whole.rows == run_study(plan, workers=1, out=tmp_path / "fresh").rows
    assert not (tmp_path / "run" / "parts").exists()
    for name in ("trials.parquet", "calibration.csv"):
        first, second = tmp_path / "run" / name, tmp_path / "fresh" / name
        assert first.read_bytes() == second.read_bytes()


def test_a_full_disk_keeps_finished_trials(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """What was written stays readable, the reason is told, and the run can be continued."""
    plan = make_study(methods="policy", trials=4, seed=8)
    real, written = store._write, []

    def write(path: Path, data: bytes) -> None:
        if len(written) == 3:  # the configuration and two parts
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(path, data)
        written.append(path)

    monkeypatch.setattr(study, "WRITE_EVERY_S", 0.0)
    monkeypatch.setattr(store, "_write", write)
    run = run_study(plan, workers=1, out=tmp_path / "run")
    assert "No space left" in run.problem and "continues" in run.problem
    assert len(run.rows) == 3 and not run.complete
    kept = sorted((tmp_path / "run" / "parts").iterdir())
    assert [pq.read_table(path).num_rows for path in kept] == [1, 1]

    monkeypatch.setattr(store, "_write", real)
    assert run_study(plan, workers=1, out=tmp_path / "run").complete
    assert pq.read_table(tmp_path / "run" / "trials.parquet").num_rows == 4


def test_a_folder_holds_one_study(tmp_path: Path):
    """Another study, or foreign files, are not written over."""
    run_study(make_study(methods="policy", trials=1), workers=1, out=tmp_path / "run")
    with pytest.raises(SimulateError, match="holds another study"):
        run_study(make_study(methods="policy", trials=1, seed=2), workers=1, out=tmp_path / "run")
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "mine.txt").write_text("precious")
    with pytest.raises(SimulateError, match="no simulated run"):
        run_study(make_study(methods="policy", trials=1), workers=1, out=tmp_path / "notes")


def test_rows_have_the_columns_of_the_trials_table(tmp_path: Path):
    """As docs/data.md names them, in its order, and the configuration beside."""
    plan = make_study(methods="policy@gain=0.5", trials=1, seed=8)
    run_study(plan, workers=1, out=tmp_path)
    table = pq.read_table(tmp_path / "trials.parquet")
    assert table.column_names == COLUMNS.names
    row = table.to_pylist()[0]
    options = json.loads(row["options"])
    assert options["gain"] == 0.5 and 0.2 <= options["user.delay_s"] <= 0.3
    config = json.loads((tmp_path / "config.json").read_text())["study"]
    assert config["seed"] == 8 and config["methods"]["policy@gain=0.5"]["gain"] == 0.5


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"world": "real"}, "valid: kinematic, physics"),
        ({"trials": 0}, "trials is 0; valid: 1 to"),
        ({"seed": -1}, "seed is -1; valid: 0 to"),
    ],
)
def test_impossible_studies_are_refused(changes: dict[str, Any], said: str):
    """Before anything is run."""
    with pytest.raises(SimulateError, match=said):
        make_study(**{"methods": "policy", **changes})
