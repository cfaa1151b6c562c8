"""Synthetic study folders with known effects, for tests and for looking at the report."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from app.core.measures import MEASURE_NAMES
from app.recording.container import TrialEncoder
from app.recording.entry import index_of
from app.recording.schema import StepRecord, TrialHeader, TrialSummary

OBJECTS = ("block", "canteen", "glass")
TRIAL_COLUMNS = (
    *("study", "participant_id", "session", "trial", "attempt", "part", "method", "shown_as"),
    *("method_position", "object", "cell", "seed", "scene", "world", "outcome", "success"),
    *("counted", *MEASURE_NAMES, "inferred_goal", "round_trip_ms", "late_share", "blurs", "drops"),
    *("device", "user_model", "options", "file"),
)
DT = 0.05


def make_study(
    folder: Path,
    *,
    n: int = 12,
    methods: tuple[str, ...] = ("blend", "policy"),
    objects: tuple[str, ...] = OBJECTS,
    seed: int = 1,
    failures: bool = True,
    survey: bool = True,
    logs: int = 0,
) -> Path:
    """Write a study of n participants in which each further method is faster than the one before.

    Args:
        folder: Where to.
        n: Participants.
        methods: In the order of their speed, slowest first.
        objects: Their names.
        seed: Of all that is random.
        failures: Whether about a tenth of the trials fails first and is repeated.
        survey: Whether a survey table is written.
        logs: For how many participants logs are written.
    """
    rng = np.random.default_rng(seed)
    data = folder / "data"
    data.mkdir(parents=True, exist_ok=True)
    trials: list[dict[str, Any]] = []
    people: list[dict[str, Any]] = []
    answers: list[dict[str, Any]] = []
    for i in range(n):
        who = f"p{i + 1:04d}"
        skill = float(rng.lognormal(0.0, 0.2))
        taste = float(rng.normal(0.0, 1.0))
        order = list(methods) if i % 2 == 0 else list(methods)[::-1]
        people.append(
            {
                "participant_id": who,
                "cell": i % 2,
                "order": " ".join(order),
                "status": "completed",
                "excluded_by": "",
                "gender": str(rng.choice(["female", "male"])),
                "experience": str(rng.choice(["none", "some", "much"])),
                "prior_exposure": "no",
                "device": str(rng.choice(["pointer", "gamepad"])),
                "consent_version": "1",
            }
        )
        things = list(rng.permutation(objects))
        number = 0
        for position, method in enumerate(order):
            for nth, thing in enumerate(things):
                attempt = 1
                while True:
                    number += 1
                    failed = failures and attempt == 1 and rng.random() < 0.1
                    row = make_row(
                        rng, who, methods.index(method), method, str(thing), skill, nth, failed
                    )
                    row |= {"trial": number, "attempt": attempt, "method_position": position + 1}
                    row |= {"shown_as": f"method{position + 1}", "device": people[-1]["device"]}
                    if i < logs:
                        row["file"] = write_log(folder, row, rng)
                    trials.append(row)
                    if not failed:
                        break
                    attempt += 1
        answers += make_answers(rng, who, methods, taste)
    write_csv(data / "study-demo_participants_data.csv", people, tuple(people[0]) if people else ())
    write_csv(data / "study-demo_trials_data.csv", trials, TRIAL_COLUMNS)
    if survey:
        names = ("participant_id", "survey", "shown_as", "method", "item", "value")
        write_csv(data / "study-demo_survey_data.csv", answers, names)
    (folder / "dataset_description.json").write_text(json.dumps({"name": "Synthetic study"}))
    return folder


def make_row(
    rng: np.random.Generator,
    who: str,
    rank: int,
    method: str,
    thing: str,
    skill: float,
    nth: int,
    failed: bool,
) -> dict[str, Any]:
    """One trial: 13 s for the slowest method, a third less with each further one."""
    time = 13.0 * 0.68**rank * skill * float(rng.lognormal(0.0, 0.22)) * (1 - 0.05 * nth)
    time *= {"block": 0.9, "canteen": 1.1}.get(thing, 1.0)
    effort = time * (0.30 - 0.04 * rank) * float(rng.lognormal(0.0, 0.15))
    right = time * float(rng.uniform(0.1, 0.5))
    return {
        "study": "demo-study",
        "participant_id": who,
        "session": 1,
        "part": "recorded",
        "method": method,
        "object": thing,
        "cell": 0,
        "seed": int(rng.integers(10**6)),
        "scene": "default",
        "world": "physics",
        "outcome": "knocked_over" if failed else "grasped",
        "success": not failed,
        "counted": not failed,
        "time_s": time,
        "input_s": effort,
        "felt_control": 0.98 - 0.05 * rank + 0.01 * float(rng.normal()),
        "opposed": 0.05 + 0.06 * rank + 0.01 * float(rng.random()),
        "idle_motion": 0.05 + 0.18 * rank + 0.02 * float(rng.random()),
        "wrong_way_m": 0.002 + 0.01 * rank * float(rng.random()),
        "cancel_s": float(rng.uniform(0.1, 0.6)) if rng.random() < 0.5 else "",
        "correct_s": right,
        "wrong_confident_s": float(rng.exponential(0.2)),
        "log_loss": float(rng.uniform(0.2, 0.7)),
        "brier": float(rng.uniform(0.1, 0.5)),
        "inferred_goal": thing,
        "round_trip_ms": float(rng.gamma(4.0, 8.0)),
        "late_share": float(rng.exponential(0.002)),
        "blurs": int(rng.random() < 0.03),
        "drops": 0,
        "user_model": "",
        "options": "",
        "file": "",
    }


def make_answers(
    rng: np.random.Generator, who: str, methods: tuple[str, ...], taste: float
) -> list[dict[str, Any]]:
    """The paper's survey; `like` and `prefer` follow one taste per person."""
    rows = []
    for rank, method in enumerate(methods):
        for item, mean in (("control", 5.6 - 1.2 * rank), ("wanted", 5.0), ("quickly", 4 + rank)):
            value = int(np.clip(round(mean + float(rng.normal())), 1, 7))
            rows.append(_answer(who, f"method{rank + 1}", method, item, value))
        like = int(np.clip(round(4.6 + (taste if rank else -taste)), 1, 7))
        rows.append(_answer(who, f"method{rank + 1}", method, "like", like))
    prefer = int(np.clip(round(3.4 + 1.6 * taste), 1, 7))
    return [*rows, _answer(who, "", "", "prefer", prefer)]


def _answer(who: str, shown: str, method: str, item: str, value: int) -> dict[str, Any]:
    return {
        "participant_id": who,
        "survey": "paper",
        "shown_as": shown,
        "method": method,
        "item": item,
        "value": value,
    }


def write_csv(path: Path, rows: list[dict[str, Any]], columns: tuple[str, ...]) -> None:
    """Rows as CSV, with the columns in order."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)


def write_log(folder: Path, row: dict[str, Any], rng: np.random.Generator) -> str:
    """A whole MCAP log of the row: pushes along x, y, then z, belief growing to the goal."""
    header = make_header(row)
    encoder = TrialEncoder()
    encoder.add("trial", header, 10**18, 0)
    steps = make_steps(row, header, rng)
    for step in steps:
        encoder.add("step", step, round(step.wall_s * 1e9), step.step)
    last = steps[-1]
    summary = TrialSummary(
        outcome=row["outcome"],
        duration_s=row["time_s"],
        input_s=last.input_s,
        inferred_goal=row["object"],
        steps=len(steps),
        late_steps=0,
        ended_wall_s=last.wall_s,
    )
    encoder.add("summary", summary, round(last.wall_s * 1e9), 0)
    encoder.finish(index_of(header, summary))
    name = f"data/raw/subject-{row['participant_id']}/session-1/trial-{row['trial']:03d}.mcap"
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(bytes(encoder.buffer.waiting))
    return name


def make_header(row: dict[str, Any]) -> TrialHeader:
    """The header of a row's log."""
    return TrialHeader(
        study=row["study"],
        participant=row["participant_id"],
        session="1",
        trial=row["trial"],
        attempt=row["attempt"],
        instructed_goal=row["object"],
        method=row["method"],
        shown_as=row.get("shown_as", ""),
        seed=row["seed"],
        scene="default",
        scene_json="{}",
        config_json="{}",
        config_hash="0",
        model_hash="0",
        versions_json="{}",
        started_wall_s=1e9,
        control_dt_s=DT,
        physics_dt_s=0.01,
        goal_names=list(OBJECTS),
        object_names=list(OBJECTS),
        joint_names=[],
        target_offsets=[0, 1, 2, 3],
        target_positions_m=[0.0] * 9,
        target_quaternions=[1.0, 0.0, 0.0, 0.0] * 3,
        start_state=[],
    )


def make_steps(
    row: dict[str, Any], header: TrialHeader, rng: np.random.Generator
) -> list[StepRecord]:
    """Steps over the row's time, then ten of closing."""
    n = max(4, round(row["time_s"] / DT))
    assist = 0.06 if row["method"] != "blend" else 0.02
    records, total = [], 0.0
    for k in range(n + 10):
        share = min(1.0, k / n)
        running = k < n
        axis = min(2, int(3 * share))
        norm = float(0.3 + 0.1 * np.sin(9 * share)) if running and rng.random() < 0.8 else 0.0
        total += norm * DT
        direct, added = [0.0] * 6, [0.0] * 6
        direct[axis] = 0.2 * norm
        added[axis] = float(assist * (1.4 * share - 0.3))
        added[2] -= 0.02 * share
        p = 1 / 3 + 0.6 * share
        belief = [(1 - p) / 2] * 3
        belief[header.goal_names.index(row["object"])] = p
        records.append(
            StepRecord(
                step=k,
                time_s=k * DT,
                monotonic_s=k * DT,
                wall_s=1e9 + k * DT,
                phase="running" if running else "closing",
                outcome="running" if running else row["outcome"],
                sequence=k,
                client_time_ms=1000 * k * DT,
                device=row.get("device") or "pointer",
                axes=[0.0] * 4,
                buttons=0,
                mode="translate",
                dead_zone=0.1,
                view_yaw_rad=0.0,
                input_norm=norm,
                input_s=total,
                method=row["method"],
                enabled=True,
                settings_id=0,
                direct_twist=direct,
                assistance_twist=added,
                known_goal_assistance_twist=[1.3 * a for a in added],
                executed_twist=[a + b for a, b in zip(direct, added, strict=True)],
                belief=belief,
                values=[0.0] * 3,
                q_values=[0.0] * 3,
                best_targets=[0, 1, 2],
                hand_position_m=[0.0] * 3,
                hand_quaternion=[1.0, 0.0, 0.0, 0.0],
                joint_positions_rad=[],
                joint_velocities_rad_s=[],
                finger_positions_m=[],
                ctrl=[],
                object_poses=[],
                lateness_s=0.0,
                round_trip_ms=float(row["round_trip_ms"]),
            )
        )
    return records
