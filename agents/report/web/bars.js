/** Each joint's power at the slider's time: a table whose cells hold bars. */

import { meanAt } from "./data.js";
import { quantity } from "./format.js";
import { limits, makeScale } from "./scale.js";
import { html } from "./svg.js";

export class JointBars {
  /** `onJoint(number)` is called when a joint is chosen; 0 means all. */
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
      return html("th", { scope: "col", class: slot }, title);
    });
    const caption = html("caption", {}, "Electrical power of each joint [W]; bars grow with the logarithm beyond 1 W");
    this.table = html("table", {}, caption, html("thead", {}, html("tr", {}, ...head)), body);
    host.append(this.table);
  }

  /** Lets the longest bar of the runs from `since` on fill its cell. */
  show(runs, since) {
    const powers = runs.flatMap((run) => (run ? [...run.totalPower].filter((_, k) => run.time[k] > since) : []));
    const parts = runs.flatMap((run) => (run ? [...run.power].filter((_, k) => Math.floor(k / run.nJoints) * run.period > since) : []));
    this.scale = makeScale("signed", limits("signed", [...powers, ...parts]), [0, 100]);
    this.table.style.setProperty("--zero", `${this.scale(0)}%`);
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
        const [zero, end] = run ? [this.scale(0), this.scale(power)] : [0, 0];
        bar.style.left = `${Math.min(zero, end)}%`;
        bar.style.width = `${Math.abs(end - zero)}%`;
      });
    });
  }
}

/** Electrical power [W] of a joint, or of all (0), at a time. */
export function powerAt(run, joint, time) {
  return joint ? meanAt(run, run.power, time, run.nJoints, joint - 1) : meanAt(run, run.totalPower, time);
}
