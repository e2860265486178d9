/** State of the page: two runs, a time and the start of the energy count; listeners are called on changes. */

import { load, report } from "./data.js";

export const state = { keys: [null, null], runs: [null, null], time: 0, since: 0 };

const onRuns = [];
const onTime = [];

export function whenRunsChange(listener) {
  onRuns.push(listener);
}

export function whenTimeChanges(listener) {
  onTime.push(listener);
}

/** Sets the time [s]; `settled` is false while it only passes by. */
export function setTime(time, settled = true) {
  state.time = Math.min(Math.max(time, state.since), report.duration);
  for (const listener of onTime) listener(state.time, settled);
}

/** Shows a run and, beside it, another or none. */
export async function choose(first, second) {
  const keys = [first, second === first ? null : second];
  state.keys = keys;
  const runs = await Promise.all(keys.map((key) => key && load(key)));
  // A later choice may have overtaken this one.
  if (state.keys !== keys) return;
  state.runs = runs;
  for (const listener of onRuns) listener(state);
  setTime(state.time);
}

/** Counts energy and shows time from here on [s]. */
export function setSince(since) {
  state.since = since;
  for (const listener of onRuns) listener(state);
  setTime(state.time);
}

/** CSS colours of the two runs: by controller where those differ, else by what the arm leans on. */
export function colours([first, second]) {
  const [one, other] = [first, second].map((key) => key && report.runs[key]);
  if (other && one.controller === other.controller && one.bearing !== other.bearing) {
    return [one, other].map(({ bearing }) => `var(--bearing-${bearing})`);
  }
  const of = ({ controller }) => `var(--controller-${controller}, var(--ink))`;
  if (other && one.controller === other.controller) return [of(one), "var(--quiet)"];
  return [of(one), other ? of(other) : "var(--quiet)"];
}
