/** Curves against time that follow the slider, and set it when they are dragged. */

import { quantity, seconds, short } from "./format.js";
import { limits, makeScale } from "./scale.js";
import { html, pathOf, svg, whenSeen } from "./svg.js";

const CHART_MARGIN = { left: 46, right: 10, top: 8, bottom: 24 };

/**
 * A chart in a figure element: `figure > figcaption + div.plot`.
 *
 * `show(curves, range)` draws curves {label, colour, dash, width, time, values} over a range of times [s];
 * `moveTo(time)` moves the line that marks the time and writes the curves' values there into the caption.
 */
export class TimeChart {
  constructor(figure, { title, unit, kind = "linear", onTime, zones = null, empty = "" }) {
    Object.assign(this, { figure, title, unit, kind, onTime, zones, empty, curves: [], range: [0, 1], time: 0 });
    this.now = html("span", { class: "now" });
    this.plot = html("div", { class: "plot" });
    this.heading = html("strong", {}, `${title} [${unit}]`);
    figure.append(html("figcaption", {}, this.heading, this.now), this.plot);
    this.picture = whenSeen(this.plot, (width, height) => this.draw(width, height));
    this.listen();
  }

  show(curves, range) {
    this.curves = curves;
    this.range = range;
    this.picture.redraw();
  }

  rename(title) {
    this.title = title;
    this.heading.textContent = `${title} [${this.unit}]`;
  }

  draw(width, height) {
    const right = width - CHART_MARGIN.right;
    const bottom = height - CHART_MARGIN.bottom;
    const [from, to] = this.range;
    const values = this.curves.flatMap(({ time, values }) => [...values].filter((_, k) => time[k] >= from - 1e-9));
    this.x = makeScale("linear", this.range, [CHART_MARGIN.left, right]);
    const y = makeScale(this.kind, limits(this.kind, values), [bottom, CHART_MARGIN.top]);
    const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": this.summary() });
    if (this.zones) root.append(...this.zones(y, CHART_MARGIN.left, right, bottom));
    root.append(...axes(this.x, y, { left: CHART_MARGIN.left, right, bottom, top: CHART_MARGIN.top }));
    for (const { colour, dash, width: thickness, time, values: course } of this.curves) {
      const start = Math.max(0, time.findIndex((t) => t >= from - 1e-9));
      const xs = Array.from(time.subarray(start), this.x);
      const d = pathOf(xs, Array.from(course.subarray(start), y));
      root.append(svg("path", { class: "curve", d, style: style(colour, thickness, dash) }));
    }
    if (!this.curves.length) root.append(svg("text", { class: "tick", x: width / 2, y: height / 2, "text-anchor": "middle" }, this.empty));
    this.cursor = svg("line", { class: "cursor", y1: CHART_MARGIN.top, y2: bottom });
    root.append(this.cursor);
    this.plot.replaceChildren(root);
    this.moveTo(this.time);
  }

  moveTo(time, hovered = false) {
    if (!hovered) this.time = time;
    if (!this.picture.seen() || !this.cursor) return;
    const x = this.x(Math.min(Math.max(time, this.range[0]), this.range[1])).toFixed(1);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    const parts = this.curves.map(({ label, colour, at }) => {
      return html("span", { style: `--mark: ${colour}` }, `${label} ${quantity(at(time))}`);
    });
    this.now.replaceChildren(...(hovered ? [html("em", {}, seconds(time)), ...parts] : parts));
  }

  summary() {
    const ends = this.curves.map(({ name, at }) => `${name} ${quantity(at(this.range[1]))} ${this.unit}`);
    return `${this.title}, from ${this.range[0]} to ${this.range[1]} s. At the end: ${ends.join("; ")}.`;
  }

  listen() {
    const timeOf = (event) => {
      const [from, to] = this.range;
      const [left, right] = [this.x(from), this.x(to)];
      const place = (event.clientX - this.plot.getBoundingClientRect().left - left) / (right - left);
      return from + Math.min(Math.max(place, 0), 1) * (to - from);
    };
    this.plot.addEventListener("pointerdown", (event) => {
      this.plot.setPointerCapture(event.pointerId);
      this.onTime(timeOf(event));
    });
    this.plot.addEventListener("pointermove", (event) => {
      if (this.plot.hasPointerCapture(event.pointerId)) this.onTime(timeOf(event));
      else if (event.pointerType === "mouse" && this.x) this.moveTo(timeOf(event), true);
    });
    this.plot.addEventListener("pointerleave", () => this.moveTo(this.time));
  }
}

export function style(colour, width = 2, dash = "") {
  return `stroke: ${colour}; stroke-width: ${width}${dash ? `; stroke-dasharray: ${dash}` : ""}`;
}

/** Grid lines and tick labels, with the horizontal axis' unit at its end. */
export function axes(x, y, { left, right, top, bottom }, unit = "s") {
  const parts = [];
  for (const tick of y.ticks) {
    const at = y(tick);
    parts.push(svg("line", { class: tick === 0 ? "zero" : "grid", x1: left, x2: right, y1: at, y2: at }));
    parts.push(svg("text", { class: "tick", x: left - 6, y: at + 4, "text-anchor": "end" }, short(tick)));
  }
  for (const tick of x.ticks) {
    const at = x(tick);
    parts.push(svg("line", { class: "grid", x1: at, x2: at, y1: top, y2: bottom }));
    const last = tick === x.ticks[x.ticks.length - 1];
    const label = last && unit ? `${short(tick)} ${unit}` : short(tick);
    const anchor = at > right - 12 ? "end" : "middle";
    parts.push(svg("text", { class: "tick", x: anchor === "end" ? right + 8 : at, y: bottom + 16, "text-anchor": anchor }, label));
  }
  return parts;
}
