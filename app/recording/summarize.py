"""What is known of a trial without its summary: built from its steps, one after another."""

from app.recording.schema import StepRecord, TrialHeader, TrialSummary

_BEFORE_CLOSING = ("ready", "running")


class SummaryBuilder:
    """Keeps what a summary needs of the steps seen so far."""

    def __init__(self, header: TrialHeader) -> None:
        self._header = header
        self._last: StepRecord | None = None
        self._grasping: StepRecord | None = None
        self.steps = 0
        self.late_steps = 0

    def add(self, step: StepRecord) -> None:
        """Take one more step into account."""
        self.steps += 1
        # Late as a trial's own summary counts it: by more than half a period.
        self.late_steps += step.lateness_s > self._header.control_dt_s / 2
        if step.phase in _BEFORE_CLOSING or self._grasping is None:
            self._grasping = step
        self._last = step

    def interrupted(self) -> TrialSummary:
        """Summary of a trial whose process ended before it could write one.

        The outcome is "interrupted", unless the steps already hold it.
        """
        last, grasping = self._last, self._grasping
        if last is None or grasping is None:
            return TrialSummary(
                outcome="interrupted",
                duration_s=0.0,
                input_s=0.0,
                inferred_goal="",
                steps=0,
                late_steps=0,
                ended_wall_s=self._header.started_wall_s,
                recovered=True,
            )
        leading = max(range(len(last.belief)), key=last.belief.__getitem__, default=None)
        return TrialSummary(
            outcome="interrupted" if last.outcome == "running" else last.outcome,
            duration_s=max(0.0, grasping.time_s),
            input_s=grasping.input_s,
            inferred_goal="" if leading is None else self._header.goal_names[leading],
            steps=self.steps,
            late_steps=self.late_steps,
            ended_wall_s=last.wall_s,
            recovered=True,
        )
