/** The paper's figures 1 to 25: three cases each, drawn when they come into view, driven by the slider. */

import { TimeChart, axes, style } from "./chart.js";
import { bearingNames, column, load, report, runKey, valueAt } from "./data.js";
import { makeScale } from "./scale.js";
import { setTime, state, whenTimeChanges } from "./state.js";
import { html, pathOf, svg, whenSeen } from "./svg.js";

const CASES = ["2", "1", "0"];
// Where curves coincide the lower one still shows at the edges of the upper.
const WIDTHS = { 2: 4, 1: 2.6, 0: 1.3 };
const PLANE_MARGIN = { left: 40, right: 8, top: 8, bottom: 24 };

export async function startFigures() {
  const keys = CASES.map((bearing) => runKey("pd_paper", bearing, "paper"));
  const host = document.getElementById("panels");
  if (!keys.every((key) => key in report.runs)) {
    host.append("The figures need the paper's three cases; not all of their runs are in this file.");
    return;
  }
  const cases = await Promise.all(keys.map(load));
  const shown = new Set(CASES);
  let since = 0;
  const panels = report.panels.map((panel) => {
    const figure = html("figure", { class: panel.kind, id: `figure-${panel.number}` });
    host.append(figure);
    return (panel.kind === "plane" ? planePanel : coursePanel)(figure, panel);
  });
  const refresh = () => {
    const chosen = cases.filter((run) => shown.has(run.bearing));
    panels.forEach((panel) => panel.show(chosen, since));
  };
  refresh();
  whenTimeChanges((time) => panels.forEach((panel) => panel.moveTo(time)));
  for (const box of document.querySelectorAll("input[name=case]")) {
    box.addEventListener("change", () => {
      shown[box.checked ? "add" : "delete"](box.value);
      refresh();
    });
  }
  document.getElementById("figures-late").addEventListener("change", ({ target }) => {
    since = target.checked ? report.settled : 0;
    refresh();
  });
}

/** Work or energy against time; counted from `since` on. */
function coursePanel(figure, { number, title, kind, joint }) {
  const chart = new TimeChart(figure, { title: `Fig. ${number}: ${title}`, unit: "J", onTime: setTime });
  return {
    moveTo: (time) => chart.moveTo(time),
    show(runs, since) {
      const curves = runs.map((run) => {
        const whole = course(run, kind, joint);
        const before = valueAt(run, whole, since);
        return {
          label: bearingNames.get(run.bearing).split(" ")[0],
          name: bearingNames.get(run.bearing),
          colour: `var(--bearing-${run.bearing})`,
          width: WIDTHS[run.bearing],
          time: run.time,
          values: whole.map((joules) => joules - before),
          at: (time) => valueAt(run, whole, Math.max(time, since)) - before,
        };
      });
      chart.show(curves, [since, report.duration]);
    },
  };
}

/** Work or energy [J] against time of a joint or, without one, of all. */
function course(run, kind, joint) {
  if (kind === "energy") return joint ? column(run.jointEnergy, run.nJoints, joint - 1) : run.energy;
  if (joint) return column(run.work, run.nJoints, joint - 1);
  return Float64Array.from(run.time, (_, k) => run.work.subarray(k * run.nJoints, (k + 1) * run.nJoints).reduce((sum, one) => sum + one, 0));
}

/** The hand in a plane beside the target, one panel per case, all at the same equal scales. */
function planePanel(figure, { number, title, axes: plane }) {
  figure.append(html("figcaption", {}, html("strong", {}, `Fig. ${number}: ${title} [m]`)));
  const row = html("div", { class: "row" });
  figure.append(row);
  const parts = CASES.map((bearing) => new PlanePart(row, bearing, title, plane));
  return {
    moveTo: (time) => parts.forEach((part) => part.moveTo(time)),
    show: (runs, since) => parts.forEach((part) => part.show(runs, since)),
  };
}

class PlanePart {
  constructor(row, bearing, title, plane) {
    Object.assign(this, { bearing, title, plane, run: null });
    this.names = plane.map((axis) => "xyz"[axis]);
    this.plot = html("div", { class: "plot" });
    const caption = html("p", { style: `--mark: var(--bearing-${bearing})` }, html("span", {}, bearingNames.get(bearing)));
    this.host = html("div", { class: "case" }, caption, this.plot);
    row.append(this.host);
    this.picture = whenSeen(this.plot, (width, height) => this.draw(width, height));
    this.plot.addEventListener("pointerdown", (event) => this.jump(event));
  }

  /** Shows its case of the runs from `since` on, at scales that hold all of them. */
  show(runs, since) {
    this.run = runs.find((run) => run.bearing === this.bearing) || null;
    this.since = since;
    const late = (run, axis) => column(run.hand, 3, axis).subarray(Math.round(since / run.period));
    this.spans = this.plane.map((axis) => extent(runs.flatMap((run) => [...late(run, axis), ...column(run.target, 3, axis)])));
    this.host.hidden = !this.run;
    this.picture.redraw();
  }

  draw(width, height) {
    const { run, plane, names, since, bearing } = this;
    if (!run) return;
    [this.x, this.y] = equalScales(this.spans, width, height);
    const label = `${this.title}, ${bearingNames.get(bearing)}: ${names.join(" against ")} from ${since} s on`;
    const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
    const frame = { left: PLANE_MARGIN.left, right: width - PLANE_MARGIN.right, top: PLANE_MARGIN.top, bottom: height - PLANE_MARGIN.bottom };
    root.append(...axes(this.x, this.y, frame, names[0]));
    root.append(svg("text", { class: "tick", x: 6, y: 14 }, names[1]));
    for (const [series, from, paint] of [[run.hand, since, style(`var(--bearing-${bearing})`, 2)], [run.target, 0, style("var(--target)", 1)]]) {
      const [us, vs] = plane.map((axis) => column(series, 3, axis).subarray(Math.round(from / run.period)));
      root.append(svg("path", { class: "curve", d: pathOf(Array.from(us, this.x), Array.from(vs, this.y)), style: paint }));
    }
    this.dot = svg("circle", { class: "hand", r: 4.5, style: `fill: var(--bearing-${bearing})` });
    root.append(this.dot);
    this.plot.replaceChildren(root);
    this.moveTo(state.time);
  }

  place(time) {
    const [u, v] = this.plane.map((axis) => valueAt(this.run, this.run.hand, time, 3, axis));
    return [this.x(u), this.y(v)];
  }

  moveTo(time) {
    if (!this.run || !this.dot || !this.picture.seen()) return;
    const [x, y] = this.place(time);
    this.dot.setAttribute("cx", x.toFixed(1));
    this.dot.setAttribute("cy", y.toFixed(1));
    this.dot.toggleAttribute("hidden", time < this.since);
  }

  /** Sets the time at which the hand was nearest to where the plot is pressed. */
  jump(event) {
    if (!this.run || !this.x) return;
    const { left, top } = this.plot.getBoundingClientRect();
    const away = (time) => {
      const [x, y] = this.place(time);
      return Math.hypot(x - (event.clientX - left), y - (event.clientY - top));
    };
    const times = [...this.run.time].filter((time) => time >= this.since - 1e-9);
    setTime(times.reduce((best, time) => (away(time) < away(best) ? time : best)));
  }
}

function extent(values) {
  return values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
}

/** Two scales with as many pixels to the metre, which hold two spans. */
function equalScales(spans, width, height) {
  const room = [width - PLANE_MARGIN.left - PLANE_MARGIN.right, height - PLANE_MARGIN.top - PLANE_MARGIN.bottom];
  const metre = Math.max(...spans.map(([low, high], k) => (1.1 * (high - low)) / room[k]));
  const [across, up] = spans.map(([low, high], k) => [(low + high - metre * room[k]) / 2, (low + high + metre * room[k]) / 2]);
  return [
    makeScale("linear", across, [PLANE_MARGIN.left, width - PLANE_MARGIN.right]),
    makeScale("linear", up, [height - PLANE_MARGIN.bottom, PLANE_MARGIN.top]),
  ];
}
