"""What a participant's page is told of the step it shows; never which method is which."""

from typing import Any

from app.study.items import AnyItem, Likert, Preference, Survey, key_of
from app.study.plan import Step, Task
from app.study.protocol import State, can_return, is_last_chance, page_name
from app.study.schema import Study
from app.study.server.host import Host, here
from app.study.server.spec import condition_of
from app.study.store import Person

PHASES = (
    ("consent",),
    ("background",),
    ("device",),
    ("instructions", "training"),
    ("trial", "switch"),
    ("survey",),
    ("debrief", "done"),
)
Message = dict[str, Any]


def visitor_state(host: Host, *, asked_code: bool) -> Message:
    """For somebody who has not consented yet."""
    study = host.store.study
    consent = study.consent
    return {
        **_common(host),
        "step": "consent",
        "page": "",
        "at": 0,
        "paused": host.paused,
        "code": study.arrival.require == "code" and not asked_code,
        "consent": consent.model_dump(),
    }


def withdrawn_state(host: Host, reason: str = "withdrawn") -> Message:
    """After leaving, or where an answer rules out taking part."""
    return {**_common(host), "step": "withdrawn", "page": reason, "at": -1}


def page_state(host: Host, person: Person) -> Message:
    """For a participant."""
    study, state = host.store.study, person.state
    step = state.step
    message = {
        **_common(host),
        "participant": person.id,
        "step": step.kind,
        "page": step.page,
        "leave": here(step),
        "at": state.at,
        "fast": person.consent.fast,
        "labels": list(state.plan.labels),
        "progress": _progress(study, state),
        "back": can_return(state),
    }
    if step.kind == "background":
        items = [_item(item, item.id) for item in study.background]
        message["form"] = _form(host, person, "About you", "", [{"items": items}])
    elif step.kind == "device":
        message["device"] = study.device.model_dump()
        message["input"] = _wanted_device(study, state)
    elif step.kind == "instructions":
        message["paragraphs"] = _instructions(study, step)
    elif step.kind == "switch":
        place = int(step.page)
        message["labels_switch"] = [state.plan.labels[place - 1], state.plan.labels[place]]
    elif step.kind == "survey":
        survey = next(s for s in study.surveys if s.id == step.page)
        sections = _sections(survey, state.plan.labels)
        message["form"] = _form(host, person, survey.title, survey.lead, sections)
    elif step.kind == "debrief":
        message["paragraphs"] = list(study.debrief)
    task = state.task
    if task is not None and state.is_open:
        message["trial"] = _trial(host, person, task)
    elif step.page == "extra":
        message["extra"] = {"left": state.plan.max_extra - state.extras}
    return message


def _common(host: Host) -> Message:
    study = host.store.study
    return {
        "title": study.title,
        "theme": study.theme,
        "test": host.store.test,
        "rotation": study.rotation,
    }


def _progress(study: Study, state: State) -> list[int]:
    kinds = {step.kind for step in state.plan.steps}
    phases = [phase for phase in PHASES if kinds & set(phase)]
    now = next((i for i, phase in enumerate(phases) if state.step.kind in phase), len(phases) - 1)
    if state.step.kind == "instructions" and state.step.page == "recorded":
        now += 1
    return [now, len(phases)]


def _instructions(study: Study, step: Step) -> list[str]:
    if step.page == "start":
        return list(study.instructions)
    each = study.trials.repetitions
    times = "once" if each == 1 else f"{each} times"
    first = (
        f"You will finish all trials with one {study.label} before it switches to the other; you "
        "will be told when it does."
        if len(study.conditions) > 1
        else "All of them are with the same control."
    )
    return [
        f"That was the practice. From now on the trials count: each object {times}.",
        first,
        "A trial begins when the countdown is over. Please stay on this page until it is finished: "
        "a trial that is interrupted is repeated.",
    ]


def _trial(host: Host, person: Person, task: Task) -> Message:
    state, study = person.state, host.store.study
    condition = condition_of(study, task)
    running = state.running
    before = [a.outcome for a in state.attempts if a.started.index == state.at and a.outcome]
    return {
        "session": host.session(person.id).id,
        "part": task.part,
        "label": task.label,
        "target": task.target,
        "number": task.number,
        "of": task.of,
        "attempt": state.next_attempt if running is None else running.started.attempt,
        "log": running.started.trial if running is not None else 0,
        "again": before[-1] if before else "",
        "last": is_last_chance(state),
        "countdown_s": 1.0 if person.consent.fast else study.trials.countdown_s,
        "free_s": study.training.free_s,
        "display": condition.display if condition else "nothing",
        "device": condition.device if condition else "any",
    }


def _wanted_device(study: Study, state: State) -> str:
    wanted = {c.device for c in study.conditions} - {"any"}
    return wanted.pop() if len(wanted) == 1 else "any"


def _form(host: Host, person: Person, title: str, lead: str, sections: list[Message]) -> Message:
    page = page_name(person.state.step)
    draft = person.state.drafts.get(page, {})
    return {
        "page": page,
        "title": title,
        "lead": lead,
        "sections": sections,
        "values": {**draft, **host.texts(person, page)},
    }


def _sections(survey: Survey, labels: tuple[str, ...]) -> list[Message]:
    shown: list[Message] = []
    for section in survey.sections:
        for label in labels if section.per == "method" else ("",):
            items = [_item(i, key_of(section, i, label), labels) for i in section.items]
            shown.append({"title": label or section.title, "label": label, "items": items})
    return shown


def _item(item: AnyItem, key: str, labels: tuple[str, ...] = ()) -> Message:
    message: Message = {
        "key": key,
        "id": item.id,
        "kind": item.kind,
        "text": item.text,
        "required": item.required,
    }
    if isinstance(item, Likert):
        message |= {"points": item.points, "ends": [item.low, item.middle, item.high]}
    elif isinstance(item, Preference):
        message |= {"points": item.points, "ends": [labels[0], item.middle, labels[1]]}
    elif item.kind == "choice":
        message["options"] = [{"value": v, "text": t} for v, t in item.options.items()]
    elif item.kind == "number":
        message |= {"low": item.low, "high": item.high, "unit": item.unit}
    else:
        message["max_length"] = item.max_length
    return message
