"""The store of sessions as other rooms use it: folders, trial numbers, lists of trials."""

from app.recording.entry import TrialEntry
from app.recording.folders import (
    append_event,
    open_session,
    read_events,
    read_session,
    session_folder,
    update_session,
    validate_name,
)
from app.recording.listing import entry_of, format_trials, list_trials, trials_to_json
from app.recording.numbering import reserve_trial

__all__ = [
    "TrialEntry",
    "append_event",
    "entry_of",
    "format_trials",
    "list_trials",
    "open_session",
    "read_events",
    "read_session",
    "reserve_trial",
    "session_folder",
    "trials_to_json",
    "update_session",
    "validate_name",
]
