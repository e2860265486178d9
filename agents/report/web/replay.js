/** The replay: choosing runs, the slider and what it drives. */

import { JointBars, powerAt } from "./bars.js";
import { TimeChart } from "./chart.js";
import { bearingNames, column, report, runKey, runName, valueAt } from "./data.js";
import { quantity, seconds } from "./format.js";
import { Scene } from "./scene.js";
import { choose, colours, setSince, setTime, state, whenRunsChange, whenTimeChanges } from "./state.js";
import { html, svg } from "./svg.js";

const SLOTS = ["a", "b"];
const DASHES = ["", "7 4"];
const element = (id) => document.getElementById(id);

const PRESETS = [
  ["Bracing: two elbows against none", ["pd_paper", 2], ["pd_paper", 0]],
  ["Learning: the PD against PPO", ["pd", 2], ["ppo", 2]],
  ["The bound: PPO against the optimum", ["ppo", 2], ["lqr", 2]],
  ["Held back by 24 V: no limit against 24 V", ["pd_paper", 2], ["pd", 2]],
];

/** Quantities of the table under the slider: name, unit and value of a run at a time. */
const QUANTITIES = {
  energy: ["energy used", "J", (run, time) => valueAt(run, run.energy, time) - valueAt(run, run.energy, state.since)],
  power: ["power", "W", (run, time) => powerAt(run, 0, time)],
  error: ["hand error", "mm", (run, time) => valueAt(run, run.error, time)],
  height: ["height error", "mm", (run, time) => valueAt(run, run.height, time)],
};

export function startReplay() {
  const scene = new Scene(element("scene"));
  const charts = makeCharts();
  const bars = new JointBars(element("joints"), firstRun().nJoints, (joint) => {
    charts.joint = joint;
    showRuns();
  });
  const selects = connectSelects();
  connectTransport();
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => scene.look(button.dataset.view));
  }

  function showRuns() {
    const paints = colours(state.keys);
    SLOTS.forEach((slot, k) => document.documentElement.style.setProperty(`--${slot}`, paints[k]));
    document.body.classList.toggle("alone", !state.runs[1]);
    selects.reflect();
    charts.show(paints);
    bars.choose(charts.joint);
    bars.show(state.runs, state.since);
    scene.show(state.runs);
    showNumbers();
    element("scene").setAttribute("aria-label", `The arm in three dimensions: ${names().join(" and ")}. Arrow keys turn the view, plus and minus zoom.`);
  }
  whenRunsChange(showRuns);
  whenTimeChanges((time, settled) => {
    scene.moveTo(time);
    bars.moveTo(state.runs, time);
    charts.moveTo(time);
    showTime(time, settled);
  });
}

function firstRun() {
  const [, , shape] = Object.values(report.runs)[0].fields.find(([name]) => name === "power");
  return { nJoints: shape[1] };
}

function names() {
  return state.keys.filter(Boolean).map(runName);
}

function makeCharts() {
  const make = (id, options) => new TimeChart(element(id), { ...options, onTime: setTime });
  const pulls = (y, left, right, bottom) => {
    const zero = Math.min(y(0), bottom);
    return [svg("rect", { class: "pulls", x: left, width: right - left, y: zero, height: bottom - zero })];
  };
  const list = {
    energy: make("chart-energy", { title: "Energy used", unit: "J" }),
    error: make("chart-error", { title: "Hand error", unit: "mm", kind: "log" }),
    power: make("chart-power", { title: "Power, all joints", unit: "W", kind: "signed" }),
    force: make("chart-force", { title: "Force of the table (shaded: it pulls)", unit: "N", zones: pulls, empty: "no elbow is held on the table" }),
  };
  return {
    joint: 0,
    moveTo: (time) => Object.values(list).forEach((chart) => chart.moveTo(time)),
    show(paints) {
      const range = [state.since, report.duration];
      const curves = (values, at) => state.runs.flatMap((run, k) => {
        return run ? [curve(run, k, paints, values(run), (time) => at(run, time))] : [];
      });
      list.energy.show(curves((run) => run.energy.map((joules) => joules - valueAt(run, run.energy, state.since)), QUANTITIES.energy[2]), range);
      list.error.show(curves((run) => run.error, QUANTITIES.error[2]), range);
      list.power.rename(this.joint ? `Power, joint ${this.joint}` : "Power, all joints");
      list.power.show(curves((run) => powerCourse(run, this.joint), (run, time) => powerAt(run, this.joint, time)), range);
      list.force.show(state.runs.flatMap((run, k) => (run ? forceCurves(run, k, paints) : [])), range);
    },
  };
}

function curve(run, slot, paints, values, at, label = SLOTS[slot].toUpperCase()) {
  return { label, name: runName(run.key), colour: paints[slot], dash: DASHES[slot], width: slot ? 1.8 : 2.4, time: run.time, values, at };
}

function powerCourse(run, joint) {
  return joint ? column(run.power, run.nJoints, joint - 1) : run.totalPower;
}

function forceCurves(run, slot, paints) {
  const width = run.elbowJoints.length;
  return run.elbowJoints.map((joint, k) => {
    const at = (time) => valueAt(run, run.force, time, width, k);
    const drawn = curve(run, slot, paints, column(run.force, width, k), at, `${SLOTS[slot].toUpperCase()}, joint ${joint}`);
    return { ...drawn, name: `${drawn.name}, joint ${joint}`, width: k ? 1.2 : 2.4 };
  });
}

/** The table under the slider: a row per quantity, a column per run. */
function showNumbers() {
  const joints = [...new Set(state.runs.flatMap((run) => (run ? run.elbowJoints : [])))].sort();
  const rows = Object.entries(QUANTITIES).map(([name, [title, unit]]) => [name, `${title} [${unit}]`]);
  for (const joint of joints) rows.push([`force-${joint}`, `table on joint ${joint} [N]`]);
  element("numbers-body").replaceChildren(
    ...rows.map(([name, title]) => {
      const cells = SLOTS.map((slot) => html("td", { class: `slot-${slot}`, "data-quantity": name, "data-slot": slot }));
      return html("tr", {}, html("th", { scope: "row" }, title), ...cells);
    }),
  );
  SLOTS.forEach((slot, k) => {
    element(`name-${slot}`).textContent = state.keys[k] ? `${slot.toUpperCase()}: ${runName(state.keys[k])}` : "";
  });
}

function numberOf(run, name, time) {
  if (name in QUANTITIES) return QUANTITIES[name][2](run, time);
  const place = run.elbowJoints.indexOf(Number(name.split("-")[1]));
  return place < 0 ? null : valueAt(run, run.force, time, run.elbowJoints.length, place);
}

let announcing = 0;

function showTime(time, settled) {
  const slider = element("time");
  slider.min = state.since;
  slider.value = time;
  slider.setAttribute("aria-valuetext", seconds(time));
  element("clock").textContent = seconds(time);
  for (const cell of document.querySelectorAll("#numbers-body td")) {
    const run = state.runs[SLOTS.indexOf(cell.dataset.slot)];
    cell.textContent = run ? quantity(numberOf(run, cell.dataset.quantity, time)) : "";
  }
  clearTimeout(announcing);
  if (settled) announcing = setTimeout(announce, 500);
}

function announce() {
  const spoken = state.runs.filter(Boolean).map((run) => {
    const [joules, , millimetres] = Object.values(QUANTITIES).map(([, , value]) => quantity(value(run, state.time)));
    return `${runName(run.key)}: ${joules} joules used, hand error ${millimetres} millimetres`;
  });
  element("announcement").textContent = `At ${seconds(state.time)}. ${spoken.join(". ")}.`;
}

/** The selects of controller, elbows or table, and start, and the presets. */
function connectSelects() {
  const options = (entries) => entries.map(([value, text]) => html("option", { value }, text));
  const exists = (controller, bearing) => runKey(controller, bearing, element("start").value) in report.runs;
  const controllers = Object.entries(report.controllers).map(([key, { name }]) => [key, name]);
  SLOTS.forEach((slot, k) => {
    element(`controller-${slot}`).append(...options(k ? [["", "none"], ...controllers] : controllers));
    element(`bearing-${slot}`).append(...options([...bearingNames]));
  });
  const chosen = (slot) => {
    const controller = element(`controller-${slot}`).value;
    if (!controller) return null;
    const wanted = element(`bearing-${slot}`).value;
    const bearing = [wanted, ...bearingNames.keys()].find((one) => exists(controller, one));
    return bearing === undefined ? null : runKey(controller, bearing, element("start").value);
  };
  for (const select of document.querySelectorAll("#choice select")) {
    select.addEventListener("change", () => choose(chosen("a"), chosen("b")));
  }
  for (const [text, ...pair] of PRESETS) {
    const keys = pair.map((names) => runKey(...names, "paper"));
    if (!keys.every((key) => key in report.runs)) continue;
    const button = html("button", { type: "button", "data-pair": keys.join() }, text);
    button.addEventListener("click", () => choose(...keys));
    element("presets").append(button);
  }
  return {
    reflect() {
      element("start").value = report.runs[state.keys[0]].start;
      SLOTS.forEach((slot, k) => {
        const run = state.keys[k] && report.runs[state.keys[k]];
        element(`controller-${slot}`).value = run ? run.controller : "";
        element(`bearing-${slot}`).disabled = !run;
        if (!run) return;
        element(`bearing-${slot}`).value = run.bearing;
        for (const option of element(`bearing-${slot}`).options) option.disabled = !exists(run.controller, option.value);
      });
      for (const button of element("presets").children) {
        button.setAttribute("aria-pressed", String(button.dataset.pair === state.keys.join()));
      }
    },
  };
}

/** The slider, playing and from when on to count. */
function connectTransport() {
  const [slider, play] = [element("time"), element("play")];
  slider.max = report.duration;
  slider.addEventListener("input", () => setTime(Number(slider.value)));
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  let frame = 0;
  const stop = () => {
    cancelAnimationFrame(frame);
    clearTimeout(frame);
    frame = 0;
    play.textContent = "Play";
    setTime(state.time);
  };
  const run = (before) => (now) => {
    const time = state.time + Number(element("speed").value) * Math.min(0.5, (now - before) / 1000);
    setTime(time, false);
    if (time >= report.duration) stop();
    else frame = still.matches ? setTimeout(() => run(now)(performance.now()), 500) : requestAnimationFrame(run(now));
  };
  play.addEventListener("click", () => {
    if (frame) return stop();
    if (state.time >= report.duration) setTime(state.since);
    play.textContent = "Pause";
    frame = requestAnimationFrame(run(performance.now()));
  });
  for (const radio of document.querySelectorAll("input[name=since]")) {
    radio.addEventListener("change", () => setSince(Number(radio.value)));
  }
}
