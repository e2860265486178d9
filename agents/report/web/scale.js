/** Scales of axes: linear, logarithmic, and "signed", which is linear to 1 and logarithmic beyond, on both sides. */

const WARPS = {
  linear: (value) => value,
  log: (value) => Math.log10(Math.max(value, 1e-12)),
  signed: (value) => Math.asinh(value),
};

/** A function from values to pixels, with its ticks. */
export function makeScale(kind, [low, high], [from, to]) {
  const warp = WARPS[kind];
  const bottom = warp(low);
  const span = warp(high) - bottom || 1;
  const place = (value) => from + ((warp(value) - bottom) / span) * (to - from);
  place.ticks = TICKS[kind](low, high, Math.abs(to - from)).filter((tick) => tick >= low && tick <= high);
  return place;
}

/** Limits around all values, a little wider than they are. */
export function limits(kind, values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low && (kind !== "log" || value > 0)) low = value;
    if (value > high) high = value;
  }
  if (!(low <= high)) return kind === "log" ? [0.1, 10] : [0, 1];
  if (kind === "log") return [low / 1.3, high * 1.3];
  if (kind === "signed") return [low < 0 ? low * 1.3 - 0.05 : 0, Math.max(high, 0) * 1.3 + 0.05];
  const margin = 0.05 * (high - low) || 0.5;
  return [low === 0 ? 0 : low - margin, high + margin];
}

const TICKS = {
  linear(low, high, length) {
    const rough = (high - low) / Math.max(2, length / 34);
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
    const ticks = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high; k++) ticks.push(k * step);
    return ticks;
  },
  log(low, high, length) {
    const decades = Math.log10(high / low);
    const factors = length / decades > 110 ? [1, 2, 5] : length / decades > 70 ? [1, 3] : [1];
    const ticks = [];
    for (let k = Math.floor(Math.log10(low)); k <= Math.log10(high); k++) {
      for (const factor of factors) ticks.push(Number(`${factor}e${k}`));
    }
    return ticks;
  },
  signed(low, high, length) {
    const largest = Math.ceil(Math.log10(Math.max(high, -low, 1)));
    const room = length / ((high > 1 ? largest : 1) + (low < -1 ? largest : 1));
    const step = room > 22 ? 1 : room > 12 ? 2 : 3;
    const ticks = [0];
    // 1 is close to 0.
    const first = room > 34 ? 0 : step;
    for (let k = first; k <= largest; k += step) ticks.push(10 ** k, -(10 ** k));
    return ticks;
  },
};
