/** Each joint's power at the slider's time: a table whose cells hold bars. */

import { quantity } from "./format.js";
import { meanAt } from "./data.js";
import { html } from "./svg.js";

/** A bar's length for a power [W], as a share of half the cell: linear to 1 W, logarithmic beyond, 10 kW at the end. */
function share(power) {
  return Math.min(1, Math.asinh(Math.abs(power)) / Math.asinh(1e4));
}

export class JointBars {
  /** `onJoint(number)` is called when a joint is chosen; 0 stands for all. */
  constructor(host, nJoints, onJoint) {
    this.rows = [];
    const body = html("tbody");
    for (let joint = 0; joint <= nJoints; joint++) {
      const name = joint ? `joint ${joint}` : "all joints";
      const button = html("button", { type: "button", "aria-pressed": "false" }, name);
      button.addEventListener("click", () => onJoint(joint));
      const cells = ["a", "b"].map((slot) => ({
        bar: html("span", { class: `bar bar-${slot}` }),
        number: html("td", { class: `slot-${slot}`, "data-joint": joint, "data-slot": slot }),
      }));
      const bars = html("td", { class: "bars", "aria-hidden": "true" }, ...cells.map(({ bar }) => bar));
      body.append(html("tr", {}, html("th", { scope: "row" }, button), bars, ...cells.map(({ number }) => number)));
      this.rows.push({ button, cells });
    }
    const head = ["joint", "power", "A", "B"].map((title) => {
      const slot = title.length === 1 ? `slot-${title.toLowerCase()}` : null;
      return html("th", { scope: "col", class: slot }, title.length === 1 ? `${title} [W]` : title);
    });
    const caption = html("caption", {}, "Electrical power of each joint (bars: logarithmic beyond 1 W)");
    host.append(html("table", {}, caption, html("thead", {}, html("tr", {}, ...head)), body));
  }

  choose(joint) {
    this.rows.forEach(({ button }, k) => button.setAttribute("aria-pressed", String(k === joint)));
  }

  moveTo(runs, time) {
    this.rows.forEach(({ cells }, joint) => {
      cells.forEach(({ bar, number }, slot) => {
        const run = runs[slot];
        const power = run && powerAt(run, joint, time);
        number.textContent = run ? quantity(power) : "";
        bar.style.width = run ? `${50 * share(power)}%` : "0";
        bar.style.left = power < 0 ? `${50 - 50 * share(power)}%` : "50%";
      });
    });
  }
}

/** Electrical power [W] of a joint, or of all (0), at a time. */
export function powerAt(run, joint, time) {
  return joint ? meanAt(run, run.power, time, run.nJoints, joint - 1) : meanAt(run, run.totalPower, time);
}
