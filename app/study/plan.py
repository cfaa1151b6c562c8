"""What one participant goes through, as a list of steps: a pure function of cell, slot and seed."""

import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from app.study.orders import ORDERS, object_order
from app.study.schema import Study

StepKind = Literal[
    "consent",
    "background",
    "device",
    "instructions",
    "training",
    "trial",
    "switch",
    "survey",
    "debrief",
    "done",
    "withdrawn",
]
Part = Literal["free", "training", "recorded"]
FREE_LABEL = "practice"


@dataclass(frozen=True)
class Task:
    """One trial of the protocol, however often it is attempted.

    Attributes:
        part: free: direct teleoperation without objects.
        place: Which method, as the participant meets them, from 0; −1: none.
        label: What the participant sees of the method.
        condition: Its name in the study file; empty: none. Never sent to a browser.
        target: The instructed object; empty: none.
        seed: Draws the layout of the first attempt; each further one adds 1.
        number: Of the method's trials in this part, from 1.
        of: How many there are.
    """

    part: Part
    place: int
    label: str
    condition: str
    target: str
    seed: int
    number: int = 1
    of: int = 1


@dataclass(frozen=True)
class Step:
    """One step; `page` tells which of several of a kind."""

    kind: StepKind
    page: str = ""
    task: Task | None = None


@dataclass(frozen=True)
class Plan:
    """The steps of one participant.

    Attributes:
        order: Names of the conditions as the participant meets them.
        labels: What they are shown as.
        steps: From consent to done.
        extra: Training trials on offer, one a method.
        max_extra: How many of them may be taken.
    """

    order: tuple[str, ...]
    labels: tuple[str, ...]
    steps: tuple[Step, ...]
    extra: tuple[Task, ...]
    max_extra: int

    def label_of(self, condition: str) -> str:
        """What a condition is shown as."""
        return self.labels[self.order.index(condition)]


def cells(study: Study) -> list[tuple[str, ...]]:
    """Orders of the conditions, one a cell."""
    names = [condition.name for condition in study.conditions]
    return [tuple(names[i] for i in row) for row in ORDERS[study.order](len(names))]


def make_plan(
    study: Study, objects: Sequence[str], cell: int, slot: int, *, fast: bool = False
) -> Plan:
    """The plan of a participant.

    Args:
        study: The study.
        objects: Names of the scene's objects.
        cell: Row of `cells`.
        slot: Place within the cell.
        fast: One training trial a method and nothing optional (test runs).
    """
    order, labels = cells(study)[cell], study.labels
    rng = random.Random(f"{study.seed}/{cell}/{slot}/seeds")

    def task(part: Part, place: int, target: str, number: int, of: int, seed: int) -> Task:
        return Task(part, place, labels[place], order[place], target, seed, number, of)

    steps = [Step("consent")]
    if study.background:
        steps.append(Step("background"))
    steps += [Step("device"), Step("instructions", "start")]
    training = study.training
    if training.free_s > 0 and not fast:
        free = Task("free", -1, FREE_LABEL, "", "", rng.randrange(2**31))
        steps.append(Step("training", "free", free))
    for place in range(len(order)):
        names = rng.sample(list(objects), len(objects))
        names = names if training.each_object and not fast else names[:1]
        for number, target in enumerate(names, start=1):
            seed = rng.randrange(2**31)
            steps.append(
                Step("training", "", task("training", place, target, number, len(names), seed))
            )
    if training.extra and not fast:
        steps.append(Step("training", "extra"))
    steps.append(Step("instructions", "recorded"))
    recorded: list[tuple[str, int]] = []
    for block in range(study.trials.repetitions):
        for target in object_order(objects, study.seed, cell, slot, block):
            recorded.append((target, rng.randrange(2**31)))
    for place in range(len(order)):
        if place:
            steps.append(Step("switch", str(place)))
        for number, (target, seed) in enumerate(recorded, start=1):
            done = task("recorded", place, target, number, len(recorded), seed)
            steps.append(Step("trial", "", done))
    steps += [Step("survey", survey.id) for survey in study.surveys]
    steps += [Step("debrief"), Step("done")]
    extra = tuple(
        task("training", place, rng.choice(list(objects)), 1, 1, rng.randrange(2**31))
        for place in range(len(order))
    )
    return Plan(order, labels, tuple(steps), extra, training.extra if not fast else 0)


def expected_minutes(study: Study, n_objects: int) -> float:
    """Expected duration of a participation [min]."""
    n = len(study.conditions)
    trials = n * n_objects * study.trials.repetitions
    practice = n * (n_objects if study.training.each_object else 1)
    reading_s = 180.0 + 20.0 * len(study.background)
    items = sum(
        len(section.items) * (n if section.per == "method" else 1)
        for survey in study.surveys
        for section in survey.sections
    )
    seconds = reading_s + 10.0 * items + study.training.free_s
    return (seconds + (trials + practice) * study.trials.expected_s) / 60.0
