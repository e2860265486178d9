/** Energy against error: the optimal front as a line, every run as a point that the replay shows when it is chosen. */

import { axes } from "./chart.js";
import { bearingNames, report } from "./data.js";
import { quantity } from "./format.js";
import { limits, makeScale } from "./scale.js";
import { choose, state, whenRunsChange } from "./state.js";
import { MARKERS, html, pathOf, svg, whenSeen } from "./svg.js";

const PARETO_MARGIN = { left: 46, right: 12, top: 10, bottom: 40 };

/** Points {key, controller, bearing, error [mm], energy [J]} of a regime, out of the benchmark's table or the runs. */
function pointsOf(regime) {
  const { start } = report.regimes[regime];
  const rows = document.querySelectorAll(`#benchmark-table tr:not([data-set=shifted])[data-regime="${regime}"]`);
  const figures = new Map([...rows].map((row) => [`${row.dataset.controller}-${row.dataset.bearing}`, row.dataset]));
  return Object.entries(report.runs)
    .filter(([, run]) => run.start === start)
    .map(([key, { controller, bearing, figures: own }]) => {
      const row = figures.get(`${controller}-${bearing}`);
      const error = row ? Number(row.error) : own[regime].error_mean;
      const energy = row ? Number(row.energy) : own[regime].electrical_energy;
      return { key, controller, bearing, error, energy };
    });
}

export function startPareto() {
  const host = document.getElementById("pareto");
  const said = document.getElementById("pareto-said");
  let regime = "A";
  const panels = [...bearingNames].map(([bearing, title]) => {
    const plot = html("div", { class: "plot", role: "group", "aria-label": `Runs with ${title}; arrow keys move between them` });
    host.append(html("figure", {}, html("figcaption", {}, html("strong", {}, title)), plot));
    return { plot, picture: whenSeen(plot, (width, height) => draw(bearing, plot, width, height)) };
  });

  function draw(bearing, plot, width, height) {
    const points = pointsOf(regime);
    const front = report.front.filter((one) => one.start === report.regimes[regime].start && regime !== "B");
    const all = [...points, ...front];
    const x = makeScale("log", limits("log", all.map(({ error }) => error)), [PARETO_MARGIN.left, width - PARETO_MARGIN.right]);
    const y = makeScale("log", limits("log", all.map(({ energy }) => energy)), [height - PARETO_MARGIN.bottom, PARETO_MARGIN.top]);
    const root = svg("svg", { viewBox: `0 0 ${width} ${height}` });
    const frame = { left: PARETO_MARGIN.left, right: width - PARETO_MARGIN.right, top: PARETO_MARGIN.top, bottom: height - PARETO_MARGIN.bottom };
    root.append(svg("g", { "aria-hidden": "true" }, ...axes(x, y, frame, "")));
    root.append(svg("text", { class: "tick", x: (frame.left + frame.right) / 2, y: height - 6, "text-anchor": "middle" }, "mean error [mm]"));
    root.append(svg("text", { class: "tick", x: frame.left + 4, y: frame.top + 10 }, "energy [J]"));
    const line = front.filter((one) => one.bearing === bearing).sort((a, b) => a.error - b.error);
    const [xs, ys] = [line.map(({ error }) => x(error)), line.map(({ energy }) => y(energy))];
    root.append(svg("path", { class: "curve front", d: pathOf(xs, ys) }));
    line.forEach((one, k) => root.append(svg("circle", { class: "front", cx: xs[k], cy: ys[k], r: 3 }, svg("title", {}, `optimum, energy weight ${one.weight}: ${quantity(one.energy)} J, ${quantity(one.error)} mm`))));
    const here = points.filter((point) => point.bearing === bearing).sort((a, b) => a.error - b.error);
    root.append(...here.map((point) => mark(point, x, y)));
    plot.replaceChildren(root);
    reflect();
  }

  function mark({ key, controller, error, energy }, x, y) {
    const { name, marker } = report.controllers[controller];
    const words = `${name}: ${quantity(energy)} J, ${quantity(error)} mm`;
    const shape = svg("path", { d: MARKERS[marker], style: `fill: var(--controller-${controller}, var(--ink))` });
    const point = svg("g", { class: "point", role: "button", tabindex: "-1", "aria-label": words, "data-run": key, transform: `translate(${x(error).toFixed(1)} ${y(energy).toFixed(1)})` }, svg("circle", { class: "reach", r: 12 }), shape);
    for (const event of ["pointerenter", "focus"]) point.addEventListener(event, () => (said.textContent = words));
    return point;
  }

  /** Marks the shown runs; in each panel one point can be reached with Tab. */
  function reflect() {
    for (const { plot } of panels) {
      const points = [...plot.querySelectorAll(".point")];
      for (const point of points) {
        point.setAttribute("aria-pressed", String(state.keys.includes(point.dataset.run)));
        point.setAttribute("tabindex", "-1");
      }
      const first = points.find((point) => point.getAttribute("aria-pressed") === "true") || points[0];
      if (first) first.setAttribute("tabindex", "0");
    }
  }

  host.addEventListener("click", (event) => {
    const point = event.target.closest(".point");
    if (point) choose(point.dataset.run, event.shiftKey ? state.keys[0] : null);
  });
  host.addEventListener("keydown", (event) => {
    const point = event.target.closest(".point");
    if (!point) return;
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      choose(point.dataset.run, event.shiftKey ? state.keys[0] : null);
    }
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const points = [...point.parentNode.querySelectorAll(".point")];
    const next = points[(points.indexOf(point) + step + points.length) % points.length];
    points.forEach((one) => one.setAttribute("tabindex", one === next ? "0" : "-1"));
    next.focus();
  });
  for (const radio of document.querySelectorAll("input[name=regime]")) {
    radio.addEventListener("change", () => {
      regime = radio.value;
      panels.forEach(({ picture }) => picture.redraw());
    });
  }
  whenRunsChange(reflect);
  legend(document.getElementById("pareto-legend"));
}

function legend(host) {
  for (const [controller, { name, marker }] of Object.entries(report.controllers)) {
    const shape = svg("path", { d: MARKERS[marker], style: `fill: var(--controller-${controller}, var(--ink))` });
    const picture = svg("svg", { class: "point", viewBox: "-8 -8 16 16", width: 16, height: 16, "aria-hidden": "true" }, shape);
    host.append(html("li", {}, picture, name));
  }
  const line = svg("svg", { viewBox: "0 0 22 16", width: 22, height: 16, "aria-hidden": "true" }, svg("path", { class: "curve front", d: "M1 8H21" }), svg("circle", { class: "front", cx: 11, cy: 8, r: 3 }));
  if (report.front.length) host.append(html("li", {}, line, "optimal front"));
}
