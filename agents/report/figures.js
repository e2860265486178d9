/** The paper's figures 1 to 25: three cases each, drawn when they come into view, driven by the slider. */

import { TimeChart, axes, style } from "./chart.js";
import { column, load, report, runKey, valueAt } from "./data.js";
import { quantity } from "./format.js";
import { makeScale } from "./scale.js";
import { setTime, state, whenTimeChanges } from "./state.js";
import { html, pathOf, svg, whenSized } from "./svg.js";

const CASES = [2, 1, 0];
// Where curves coincide the lower one still shows at the edges of the upper.
const WIDTHS = { 2: 4, 1: 2.6, 0: 1.3 };
const PLANE_MARGIN = { left: 40, right: 8, top: 8, bottom: 24 };

export async function startFigures() {
  const keys = CASES.map((elbows) => runKey("pd_paper", elbows, "paper"));
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
    const chosen = cases.filter((run) => shown.has(run.elbows));
    panels.forEach((panel) => panel.show(chosen, since));
  };
  refresh();
  whenTimeChanges((time) => panels.forEach((panel) => panel.moveTo(time)));
  for (const box of document.querySelectorAll("input[name=case]")) {
    box.addEventListener("change", () => {
      shown[box.checked ? "add" : "delete"](Number(box.value));
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
          label: report.elbows[run.elbows].split(" ")[0],
          name: report.elbows[run.elbows],
          colour: `var(--elbows-${run.elbows})`,
          width: WIDTHS[run.elbows],
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

/** The hand in a plane beside the target, at equal scales, one panel per case. */
function planePanel(figure, { number, title, axes: plane }) {
  figure.append(html("figcaption", {}, html("strong", {}, `Fig. ${number}: ${title} [m]`)));
  const row = html("div", { class: "row" });
  figure.append(row);
  const names = plane.map((axis) => "xyz"[axis]);
  const parts = CASES.map((elbows) => {
    const caption = html("p", { style: `--mark: var(--elbows-${elbows})` }, html("span", {}, report.elbows[elbows]));
    const plot = html("div", { class: "plot" });
    const host = html("div", { class: "case" }, caption, plot);
    row.append(host);
    const part = { elbows, host, run: null, since: 0 };
    const draw = (width, height) => {
      const { run, since } = part;
      if (!run) return;
      const first = Math.round(since / run.period);
      const [horizontal, vertical] = plane.map((axis) => column(run.hand, 3, axis).subarray(first));
      const [u, v] = plane.map((axis) => column(run.target, 3, axis));
      const [x, y] = equalScales([...horizontal, ...u], [...vertical, ...v], width, height);
      const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${title}, ${report.elbows[elbows]}: ${names.join(" against ")} from ${since} s on` });
      root.append(...axes(x, y, { left: PLANE_MARGIN.left, right: width - PLANE_MARGIN.right, top: PLANE_MARGIN.top, bottom: height - PLANE_MARGIN.bottom }, names[0]));
      root.append(svg("text", { class: "tick", x: 6, y: 14 }, names[1]));
      root.append(svg("path", { class: "curve", d: pathOf(Array.from(horizontal, x), Array.from(vertical, y)), style: style(`var(--elbows-${elbows})`, 2) }));
      root.append(svg("path", { class: "curve", d: pathOf(Array.from(u, x), Array.from(v, y)), style: style("var(--target)", 1) }));
      part.dot = svg("circle", { class: "hand", r: 4.5, style: `fill: var(--elbows-${elbows})` });
      part.place = (time) => {
        part.dot.setAttribute("cx", x(valueAt(run, run.hand, time, 3, plane[0])));
        part.dot.setAttribute("cy", y(valueAt(run, run.hand, time, 3, plane[1])));
        part.dot.toggleAttribute("hidden", time < since);
      };
      root.append(part.dot);
      plot.replaceChildren(root);
      part.place(state.time);
    };
    part.redraw = whenSized(plot, draw);
    return part;
  });
  return {
    moveTo: (time) => parts.forEach((part) => part.place && part.place(time)),
    show(runs, since) {
      for (const part of parts) {
        part.run = runs.find((run) => run.elbows === part.elbows) || null;
        part.since = since;
        part.host.hidden = !part.run;
        part.redraw();
      }
    },
  };
}

/** Two scales with as many pixels to the metre, which hold all values. */
function equalScales(us, vs, width, height) {
  const spans = [us, vs].map((values) => values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]));
  const room = [width - PLANE_MARGIN.left - PLANE_MARGIN.right, height - PLANE_MARGIN.top - PLANE_MARGIN.bottom];
  const metre = Math.max(...spans.map(([low, high], k) => (1.1 * (high - low)) / room[k]));
  const [across, up] = spans.map(([low, high], k) => [(low + high - metre * room[k]) / 2, (low + high + metre * room[k]) / 2]);
  return [
    makeScale("linear", across, [PLANE_MARGIN.left, width - PLANE_MARGIN.right]),
    makeScale("linear", up, [height - PLANE_MARGIN.bottom, PLANE_MARGIN.top]),
  ];
}
