/** The arms in three dimensions: table, shadows, target, the hand's path, links and the table's forces. */

import { Camera, VIEWS } from "./camera.js";
import { report, valueAt } from "./data.js";
import { quantity } from "./format.js";

const METRES_PER_NEWTON = 0.03;
const LONGEST_ARROW = 0.55;
/** Radius of the links at the base and at the hand [m]. */
const THICKNESS = [0.05, 0.02];
/** In pixels: close by, the path matters more than the links. */
const THICKEST = 24;
const WIDEST_DOT = 6;

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.camera = new Camera(VIEWS.arm);
    this.runs = [];
    this.time = 0;
    this.colours = {};
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.readColours());
    this.listen();
  }

  show(runs) {
    this.runs = runs.filter(Boolean);
    this.readColours();
  }

  moveTo(time) {
    this.time = time;
    this.draw();
  }

  readColours() {
    const computed = getComputedStyle(this.canvas);
    for (const name of ["panel", "ink", "quiet", "table", "line", "target", "pull", "push", "a", "b"]) {
      this.colours[name] = computed.getPropertyValue(`--${name}`).trim();
    }
    this.draw();
  }

  draw() {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (!width || !this.runs.length) return;
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== wide || this.canvas.height !== high) Object.assign(this.canvas, { width: wide, height: high });
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.context.clearRect(0, 0, width, height);
    this.context.lineCap = this.context.lineJoin = "round";
    const chains = this.runs.map((run) => chain(run, this.time));
    if (this.camera.follows) {
      const hand = chains[0][chains[0].length - 1];
      this.camera.azimuth = (Math.atan2(hand[1], hand[0]) * 180) / Math.PI - 90;
    }
    this.project = this.camera.projection(width, height);
    this.drawTable();
    chains.forEach((points) => this.drawShadow(points));
    this.drawTarget();
    this.runs.forEach((run, slot) => this.drawPath(run, this.slotColour(slot)));
    const farFirst = chains.map((points, slot) => [this.depthOf(points), slot]).sort(([a], [b]) => b - a);
    for (const [, slot] of farFirst) this.drawArm(this.runs[slot], chains[slot], this.slotColour(slot));
    this.drawForces(chains);
  }

  slotColour(slot) {
    return this.colours[slot ? "b" : "a"];
  }

  depthOf(points) {
    const seen = this.project(points[points.length - 1]);
    return seen ? seen[2] : 0;
  }

  /** A line through points of the world; the parts behind the camera are left out. */
  line(points, colour, width, { dash = [], alpha = 1, close = false, fill = null } = {}) {
    const { context } = this;
    context.beginPath();
    let drawing = false;
    for (const point of points) {
      const seen = this.project(point);
      if (seen) context[drawing ? "lineTo" : "moveTo"](seen[0], seen[1]);
      drawing = Boolean(seen);
    }
    if (close) context.closePath();
    context.globalAlpha = alpha;
    if (fill) Object.assign(context, { fillStyle: fill }).fill();
    context.setLineDash(dash);
    Object.assign(context, { strokeStyle: colour, lineWidth: width }).stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  drawTable() {
    const [low, high, step] = [-0.5, 2.5, 0.5];
    const corners = [[low, low, 0], [high, low, 0], [high, high, 0], [low, high, 0]];
    this.line(corners, this.colours.line, 1, { close: true, fill: this.colours.table });
    for (let at = low; at <= high + 1e-9; at += step) {
      this.line([[at, low, 0], [at, high, 0]], this.colours.line, 1);
      this.line([[low, at, 0], [high, at, 0]], this.colours.line, 1);
    }
  }

  drawShadow(points) {
    const ground = points.map(([x, y]) => [x, y, 0]);
    const middle = this.project(ground[Math.floor(ground.length / 2)]);
    if (middle) this.line(ground, this.colours.quiet, Math.max(3, 0.07 * middle[3]), { alpha: 0.22 });
  }

  drawTarget() {
    const { target, instants } = this.runs[0];
    const points = Array.from({ length: instants }, (_, k) => [...target.subarray(3 * k, 3 * k + 3)]);
    this.line(points, this.colours.target, 1.6, { dash: [5, 4] });
    const now = this.project(vector(this.runs[0], target, this.time));
    if (now) this.dot(now, 5, null, this.colours.target);
  }

  drawPath(run, colour) {
    const last = Math.floor(this.time / run.period + 1e-6);
    const points = [];
    for (let k = 0; k <= last; k++) points.push([...run.hand.subarray(3 * k, 3 * k + 3)]);
    points.push(vector(run, run.hand, this.time));
    this.line(points, colour, 2.2, { alpha: 0.8 });
  }

  drawArm(run, points, colour) {
    const seen = points.map(this.project);
    const links = [];
    for (let k = 1; k < points.length; k++) {
      if (seen[k - 1] && seen[k]) links.push([seen[k - 1], seen[k], k]);
    }
    links.sort((a, b) => b[0][2] + b[1][2] - a[0][2] - a[1][2]);
    const { context, colours } = this;
    for (const [from, to, k] of links) {
      const share = k / (points.length - 1);
      const radius = THICKNESS[0] + (THICKNESS[1] - THICKNESS[0]) * share;
      const width = Math.min(THICKEST, Math.max(3, radius * (from[3] + to[3])));
      for (const [stroke, extra] of [[colours.panel, 3], [colour, 0]]) {
        context.beginPath();
        context.moveTo(from[0], from[1]);
        context.lineTo(to[0], to[1]);
        Object.assign(context, { strokeStyle: stroke, lineWidth: width + extra }).stroke();
      }
    }
    seen.slice(1, -1).forEach((point, k) => point && this.dot(point, Math.min(WIDEST_DOT, Math.max(2, (0.018 - 0.001 * k) * point[3])), colours.panel, colour));
    const hand = seen[seen.length - 1];
    if (hand) this.dot(hand, Math.min(WIDEST_DOT, Math.max(3.5, 0.02 * hand[3])), colour, colours.ink);
  }

  /** The table's force on every elbow, and under the arrows what they come to. */
  drawForces(chains) {
    const words = new Map();
    this.runs.forEach((run, slot) => {
      run.elbowJoints.forEach((joint, k) => {
        const force = valueAt(run, run.force, this.time, run.elbowJoints.length, k);
        const end = this.drawForce(chains[slot][joint - 1], force);
        if (!end) return;
        const said = words.get(joint) || { x: end[0], y: end[1], parts: [] };
        const name = this.runs.length > 1 ? `${"AB"[slot]} ` : "";
        said.parts.push(`${name}${force < 0 ? "↓" : "↑"} ${quantity(Math.abs(force))} N`);
        words.set(joint, { ...said, y: Math.max(said.y, end[1]) });
      });
    });
    for (const [joint, { x, y, parts }] of words) {
      [`joint ${joint}`, ...parts].forEach((line, row) => this.label(line, x, y + 18 + 15 * row));
    }
  }

  /** An arrow under the elbow: toward it where the table pushes, away from it where it pulls; gives its lower end. */
  drawForce(point, force) {
    const { context, colours } = this;
    const below = [point[0], point[1], point[2] - Math.min(LONGEST_ARROW, 0.08 + METRES_PER_NEWTON * Math.abs(force))];
    const [elbow, tail] = [this.project(point), this.project(below)];
    if (!elbow || !tail) return null;
    const colour = force < 0 ? colours.pull : colours.push;
    this.line([point, below], colour, 3.5);
    this.dot(elbow, Math.min(2 * WIDEST_DOT, Math.max(5, 0.035 * elbow[3])), colour, colours.panel);
    const [tip, back] = force < 0 ? [tail[1] + 5, -11] : [elbow[1] + 8, 11];
    context.beginPath();
    context.moveTo(elbow[0], tip);
    context.lineTo(elbow[0] - 6.5, tip + back);
    context.lineTo(elbow[0] + 6.5, tip + back);
    Object.assign(context, { fillStyle: colour }).fill();
    return [tail[0], Math.max(tail[1], tip)];
  }

  label(text, x, y) {
    const { context, colours } = this;
    Object.assign(context, { font: "600 12px system-ui, sans-serif", textAlign: "center", lineWidth: 4, strokeStyle: colours.panel });
    context.strokeText(text, x, y);
    context.fillStyle = colours.ink;
    context.fillText(text, x, y);
  }

  dot([x, y], radius, fill, stroke) {
    const { context } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    if (fill) Object.assign(context, { fillStyle: fill }).fill();
    Object.assign(context, { strokeStyle: stroke, lineWidth: 1.5 }).stroke();
  }

  /** Dragging and the arrow keys turn the view, the wheel with Ctrl and + and - zoom. */
  listen() {
    const { canvas, camera } = this;
    const change = (action) => {
      action();
      this.draw();
    };
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (canvas.hasPointerCapture(event.pointerId)) change(() => camera.turn(-0.4 * event.movementX, 0.3 * event.movementY));
    });
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      change(() => camera.zoom(Math.exp(0.002 * event.deltaY)));
    }, { passive: false });
    const keys = {
      ArrowLeft: () => camera.turn(-6, 0),
      ArrowRight: () => camera.turn(6, 0),
      ArrowUp: () => camera.turn(0, 4),
      ArrowDown: () => camera.turn(0, -4),
      "+": () => camera.zoom(0.87),
      "-": () => camera.zoom(1.15),
    };
    canvas.addEventListener("keydown", (event) => {
      if (!(event.key in keys)) return;
      event.preventDefault();
      change(keys[event.key]);
    });
  }

  look(view) {
    this.camera.take(VIEWS[view]);
    this.draw();
  }
}

/** The joints and, last, the hand [m] at a time. */
function chain(run, time) {
  const width = 3 * run.nJoints;
  const points = [];
  for (let joint = 0; joint < run.nJoints; joint++) {
    points.push([0, 1, 2].map((axis) => report.lengthUnit * valueAt(run, run.joints, time, width, 3 * joint + axis)));
  }
  points.push(vector(run, run.hand, time));
  return points;
}

function vector(run, series, time) {
  return [0, 1, 2].map((axis) => valueAt(run, series, time, 3, axis));
}
