"""What the page is told of a trial beside its curves."""

from typing import Any

import msgspec

from app.core import METHODS, settings_to_dict
from app.review.moments import find_marks
from app.review.replay import Replay
from app.session.hello import PAGE_HUES


def about(replay: Replay, trial_id: str) -> dict[str, Any]:
    """Header, summary, marks, objects and settings of a trial, as JSON values."""
    header, summary = replay.header, replay.log.summary
    marks = [msgspec.to_builtins(mark) for mark in find_marks(replay)]
    objects = [
        {"name": item.name, "colour": PAGE_HUES[item.colour], "kind": item.kind}
        for item in replay.scene.objects
    ]
    return {
        "id": trial_id,
        "study": header.study,
        "participant": header.participant,
        "session": header.session,
        "trial": header.trial,
        "instructed_goal": header.instructed_goal,
        "method": header.method,
        "shown_as": header.shown_as,
        "seed": header.seed,
        "versions": msgspec.json.decode(header.versions_json),
        "control_dt_s": header.control_dt_s,
        "start_step": replay.start_step,
        "physical": replay.physical,
        "goals": header.goal_names,
        "scene": {"name": header.scene, "objects": objects},
        "summary": msgspec.to_builtins(summary) if summary is not None else None,
        "marks": marks,
        "methods": list(METHODS),
        "settings": settings_to_dict(replay.settings(replay.start_step)),
    }
