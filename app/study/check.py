"""`hindsight study check`: what a study file amounts to, before anybody takes part."""

from app.robot.scene_file import load_scene
from app.study.items import survey_items
from app.study.plan import cells, expected_minutes, make_plan
from app.study.schema import Study


def check(study: Study) -> str:
    """Conditions, order table, trials and expected duration per participant, as text."""
    objects = load_scene(study.scene).object_names
    rows = cells(study)
    plan = make_plan(study, objects, 0, 0)
    tasks = [step.task for step in plan.steps if step.task is not None]
    recorded = sum(task.part == "recorded" for task in tasks)
    training = sum(task.part == "training" for task in tasks)
    lines = [f"{study.name}: {study.title} (version {study.version})", ""]
    lines += ["Conditions"]
    for condition in study.conditions:
        settings = ", ".join(f"{k}={v}" for k, v in condition.settings.items())
        extras = [f"shows {condition.display}"]
        if condition.input_delay_ms:
            extras.append(f"input {condition.input_delay_ms:g} ms late")
        if condition.device != "any":
            extras.append(f"with {condition.device}")
        head = f"  {condition.name}: {condition.method}" + (f" ({settings})" if settings else "")
        lines.append(f"{head}, {', '.join(extras)}")
    lines += ["", f"Orders ({study.order} counterbalancing, {len(rows)} cells)"]
    for i, row in enumerate(rows, start=1):
        shown = ", ".join(f"{study.labels[k]} = {name}" for k, name in enumerate(row))
        lines.append(f"  cell {i}: {shown}")
    lines += [
        "",
        f"Objects: {', '.join(objects)}; in random order, blocked within each cell, the same for "
        "every method",
        f"Trials per participant: {recorded} recorded, {training} training"
        + (f", up to {plan.max_extra} more on request" if plan.max_extra else ""),
        f"A failed trial is repeated, up to {study.trials.attempts} attempts of at most "
        f"{study.trials.time_limit_s:g} s",
    ]
    for survey in study.surveys:
        lines.append(f"Survey {survey.id}: {len(survey_items(survey, study.labels))} answers")
    minutes = expected_minutes(study, len(objects))
    lines.append(f"Expected duration: {minutes:.0f} min per participant")
    share, rest = divmod(study.participants, len(rows))
    lines.append(
        f"Participants wanted: {study.participants}, {share} a cell"
        + (f"; {rest} cells get one more: choose a multiple of {len(rows)}" if rest else "")
    )
    if not study.completion.code:
        lines.append("Completion code: one of each participant's own")
    return "\n".join(lines)
