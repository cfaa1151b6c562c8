/** Curves of several trials over one axis: time, time around an event, or distance to the goal. */

import { originOf } from "./steps.js";

const POINTS = 1200;

/** The running minimum of a trial's distance to its instructed goal, which can be looked up. */
export function distanceTable(trial) {
  const values = Float32Array.from(trial.arrays[`distance.${trial.meta.instructed_goal}`]);
  for (let i = 1; i < values.length; i += 1) values[i] = Math.min(values[i], values[i - 1]);
  return {
    values,
    at: (row) => values[row],
    /** First row that is as near as this; the last one where the trial never came so near. */
    firstWithin(distance) {
      let [low, high] = [0, values.length - 1];
      while (low < high) {
        const middle = (low + high) >> 1;
        if (values[middle] <= distance) high = middle;
        else low = middle + 1;
      }
      return low;
    },
  };
}

/**
 * What the plots show of several trials.
 * @returns {{x: Float64Array, panels: any[], arrays: Record<string, (number|null)[]>, unit: string}}
 */
export function comparisonOf(trials, tables, by) {
  const distance = by === "distance";
  const rowsOf = distance ? overDistance(trials, tables) : overTime(trials, by);
  const arrays = {};
  const quantities = [
    ["input", "Input", "of full stick", ({ arrays: a }, i) => a.input_norm[i]],
    ["assistance", "Assistance", "m/s", ({ arrays: a }, i) => Math.hypot(a["assistance.0"][i], a["assistance.1"][i], a["assistance.2"][i])],
    ["belief", "Belief in the instructed goal", "", ({ arrays: a, meta }, i) => a[`belief.${meta.instructed_goal}`][i]],
    ["distance", "Distance to the instructed goal", "m", ({ arrays: a, meta }, i) => a[`distance.${meta.instructed_goal}`][i]],
    ["height", "Height over the table", "m", ({ arrays: a }, i) => a.height[i]],
  ];
  const panels = quantities.map(([key, title, unit, read]) => ({
    key: `compare-${key}`,
    title,
    unit,
    curves: trials.map((trial, k) => {
      const array = `${key}:${k}`;
      arrays[array] = Array.from(rowsOf.rows[k], (row) => (row < 0 ? null : read(trial, row)));
      return { array, name: `${k + 1}. ${trial.meta.participant} ${trial.meta.trial}, ${trial.meta.method}`, role: `trial:${k}` };
    }),
  }));
  return { x: rowsOf.x, panels, arrays, unit: distance ? "m to the goal" : "s", distance };
}

function overTime(trials, by) {
  const spans = trials.map(({ meta }) => [-originOf({ meta }, by) * meta.control_dt_s, (meta.n_steps - 1 - originOf({ meta }, by)) * meta.control_dt_s]);
  const [low, high] = [Math.min(...spans.map(([a]) => a)), Math.max(...spans.map(([, b]) => b))];
  const x = Float64Array.from({ length: POINTS }, (_, i) => low + ((high - low) * i) / (POINTS - 1));
  const rows = trials.map((trial) => Int32Array.from(x, (seconds) => {
    const step = originOf(trial, by) + seconds / trial.meta.control_dt_s;
    return step < -0.5 || step > trial.meta.n_steps - 0.5 ? -1 : Math.min(trial.meta.n - 1, Math.round(step / trial.meta.stride));
  }));
  return { x, rows };
}

/** From far to near, so that time still runs to the right: the axis is minus the distance. */
function overDistance(trials, tables) {
  const far = Math.max(...tables.map(({ values }) => values[0]));
  const near = Math.min(...tables.map(({ values }) => values.at(-1)));
  const x = Float64Array.from({ length: POINTS }, (_, i) => -(far - ((far - near) * i) / (POINTS - 1)));
  const rows = trials.map((_, k) => Int32Array.from(x, (negative) => {
    const { values } = tables[k];
    return -negative > values[0] + 1e-6 || -negative < values.at(-1) - 1e-6 ? -1 : tables[k].firstWithin(-negative);
  }));
  return { x, rows };
}
