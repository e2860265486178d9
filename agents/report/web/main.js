/** Starts the page: every part connects itself, then the first two runs are shown. */

import { report, runKey } from "./data.js";
import { startFigures } from "./figures.js";
import { startPareto } from "./pareto.js";
import { startReplay } from "./replay.js";
import { choose, setTime } from "./state.js";
import { startTable } from "./table.js";

startReplay();
startPareto();
startTable();
startFigures();

const [first, second] = [2, 0].map((elbows) => runKey("pd_paper", elbows, "paper"));
const keys = Object.keys(report.runs);
choose(first in report.runs ? first : keys[0], second in report.runs ? second : null).then(() => {
  setTime(report.settled);
  document.documentElement.dataset.ready = "true";
});
