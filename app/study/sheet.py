"""The run sheet of lab mode: one page for the experimenter beside the participant."""

import html

from app.robot.scene_file import load_scene
from app.study.plan import expected_minutes, make_plan
from app.study.schema import Study

_STYLE = (
    "body{font:13px/1.45 sans-serif;max-width:180mm;margin:10mm auto;color:#111}"
    "h1{font-size:18px;margin:0 0 2mm}h2{font-size:14px;margin:4mm 0 1mm}"
    "li{margin:.6mm 0}.b{display:inline-block;width:4mm;height:4mm;border:1px solid #111;"
    "margin-right:2mm;vertical-align:-.6mm}.f{border-bottom:1px solid #111;display:inline-block;"
    "min-width:45mm}@page{size:A4;margin:10mm}"
)


def run_sheet(study: Study) -> str:
    """An HTML page to print, one for each participant; it names no method."""
    objects = load_scene(study.scene).object_names
    plan = make_plan(study, objects, 0, 0)
    tasks = [step.task for step in plan.steps if step.task is not None]
    recorded = sum(task.part == "recorded" for task in tasks)
    training = sum(task.part == "training" for task in tasks)
    before = [
        "One machine, full screen, other programs closed, notifications off",
        "Server started with this study; the page shows the consent form "
        "(after an earlier participant: open /?next)",
        "Gamepad plugged in, if it is to be used; a chair at arm's length",
    ]
    say = [
        "The page explains everything; please read it. I answer questions between trials only.",
        f"You will use {len(study.conditions)} ways of control, called {', '.join(study.labels)}.",
        "You finish all trials with one before it switches. Please do not talk during a trial.",
        "You may stop at any time by “Leave the study”.",
    ]
    course = [
        "Consent, questions, device check (help where something is marked)",
        f"Practice: {training} trials"
        + (f", up to {plan.max_extra} more if wanted" if plan.max_extra else ""),
        f"Recorded: {recorded} trials, one announced switch; failed ones are repeated by the page",
        *(f"Survey: {survey.title}" for survey in study.surveys),
        "Debriefing; write down nothing but the pseudonym; hand over the withdrawal code",
    ]
    after = [
        "Page shows “Everything is saved”",
        "Desk: participant completed, no trial marked interrupted without a reason",
        "Notes into the desk, not onto this sheet",
    ]
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Run sheet</title>'
        f"<style>{_STYLE}</style><h1>{html.escape(study.title)}: run sheet</h1>"
        f"<p>About {expected_minutes(study, len(objects)):.0f} minutes. "
        'Pseudonym <span class="f">&nbsp;</span> Date <span class="f">&nbsp;</span></p>'
        + _list("Before", before)
        + _list("Say", say, boxes=False)
        + _list("Course", course)
        + _list("After", after)
        + "<h2>If something goes wrong</h2><p>Reload the page: it goes on where it was, and the "
        "running trial is repeated. Restart the server: the same. Anything odd: a note in the "
        "desk, then “redo” for that trial.</p></html>"
    )


def _list(title: str, entries: list[str], *, boxes: bool = True) -> str:
    box = '<span class="b"></span>' if boxes else ""
    lines = "".join(f"<li>{box}{html.escape(entry)}</li>" for entry in entries)
    style = ' style="list-style:none;padding:0"' if boxes else ""
    return f"<h2>{html.escape(title)}</h2><ul{style}>{lines}</ul>"
