/** Between steps of a trial, rows of its thinned curves, and the step that counts as zero. */

/** The row of thinned curves that belongs to a step. */
export function rowOf(trial, step) {
  const { stride, first, n } = trial.meta;
  return Math.max(0, Math.min(n - 1, Math.round((step - first) / stride)));
}

/** The step at which a trial's own clock stands at zero: its start, or the event it is aligned by. */
export function originOf(trial, by) {
  const mark = by.startsWith("event:") ? trial.meta.marks.find(({ label }) => `event:${label}` === by) : null;
  return mark ? mark.step : trial.meta.start_step;
}
