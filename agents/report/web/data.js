/** The page's data, and its runs, unpacked when they are first shown. */

export const report = JSON.parse(document.getElementById("report-data").textContent);

const ARRAYS = { f4: Float32Array, i2: Int16Array };
const unpacked = new Map();

/** A run by its key, as a promise. */
export function load(key) {
  if (!unpacked.has(key)) unpacked.set(key, unpack(key));
  return unpacked.get(key);
}

/** What an arm leans on: "2" is "two elbows". */
export const bearingNames = new Map(report.bearings);

/** "PPO, 24 V, two elbows". */
export function runName(key) {
  const { controller, bearing } = report.runs[key];
  return `${report.controllers[controller].name}, ${bearingNames.get(bearing)}`;
}

export function runKey(controller, bearing, start) {
  return `${controller}-${bearing}-${start}`;
}

async function unpack(key) {
  const packed = report.runs[key];
  const bytes = Uint8Array.from(atob(packed.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const run = { key, ...packed };
  let offset = 0;
  for (const [name, kind, shape] of packed.fields) {
    const size = shape.reduce((product, length) => product * length, 1);
    run[name] = new ARRAYS[kind](buffer, offset, size);
    offset += run[name].byteLength;
    run.instants = shape[0];
    if (name === "power") run.nJoints = shape[1];
  }
  return withCourses(run);
}

/** Adds what the plots show: time [s], energy [J] and power [W] of all joints, error and height error [mm]. */
function withCourses(run) {
  const { instants, nJoints, period, power, hand, target } = run;
  run.time = Float64Array.from({ length: instants }, (_, k) => k * period);
  run.jointEnergy = new Float64Array(instants * nJoints);
  for (const name of ["energy", "totalPower", "error", "height"]) run[name] = new Float64Array(instants);
  for (let k = 0; k < instants; k++) {
    for (let joint = 0; joint < nJoints; joint++) {
      const here = k * nJoints + joint;
      run.jointEnergy[here] = (k ? run.jointEnergy[here - nJoints] : 0) + power[here] * period;
      run.energy[k] += run.jointEnergy[here];
      run.totalPower[k] += power[here];
    }
    const [x, y, z] = [0, 1, 2].map((axis) => hand[3 * k + axis] - target[3 * k + axis]);
    run.error[k] = 1000 * Math.hypot(x, y, z);
    run.height[k] = 1000 * z;
  }
  return run;
}

/** One column of a series with several, as an array of its own. */
export function column(series, width, index) {
  return Float64Array.from({ length: series.length / width }, (_, k) => series[k * width + index]);
}

/** A series' value between its instants at a time [s]. */
export function valueAt(run, series, time, width = 1, index = 0) {
  const place = Math.min(Math.max(time / run.period, 0), run.instants - 1);
  const before = Math.min(Math.floor(place + 1e-6), run.instants - 2);
  const share = Math.max(0, place - before);
  const first = series[before * width + index];
  return first + (series[(before + 1) * width + index] - first) * share;
}

/** A mean over the period in which a time [s] lies, or that ends there. */
export function meanAt(run, series, time, width = 1, index = 0) {
  const k = Math.min(Math.max(Math.ceil(time / run.period - 1e-6), 0), run.instants - 1);
  return series[k * width + index];
}
