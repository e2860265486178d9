/** Elements, and the paths that curves are drawn with. */

const NAMESPACE = "http://www.w3.org/2000/svg";

export function svg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(NAMESPACE, tag), attributes, children);
}

export function html(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** The path through points in pixels; points that a tenth of a pixel does not tell apart are left out. */
export function pathOf(xs, ys) {
  let text = "";
  let last = "";
  for (let k = 0; k < xs.length; k++) {
    const point = `${xs[k].toFixed(1)} ${ys[k].toFixed(1)}`;
    if (point !== last) text += `${text ? "L" : "M"}${point}`;
    last = point;
  }
  return text;
}

/** Matplotlib's markers as paths about the origin, some 5 pixels in size. */
export const MARKERS = {
  o: "M5 0A5 5 0 1 1-5 0A5 5 0 1 1 5 0Z",
  s: "M-4.5-4.5H4.5V4.5H-4.5Z",
  D: "M0-6L6 0L0 6L-6 0Z",
  v: "M-5.5-4.5H5.5L0 5.5Z",
  "^": "M-5.5 4.5H5.5L0-5.5Z",
  P: "M-2-6H2V-2H6V2H2V6H-2V2H-6V-2H-2Z",
  X: "M-5.5-3L-3-5.5L0-2.5L3-5.5L5.5-3L2.5 0L5.5 3L3 5.5L0 2.5L-3 5.5L-5.5 3L-2.5 0Z",
  h: "M0-6L5.2-3V3L0 6L-5.2 3V-3Z",
  d: "M0-6.5L4 0L0 6.5L-4 0Z",
  ">": "M-4.5-5.5V5.5L5.5 0Z",
  "<": "M4.5-5.5V5.5L-5.5 0Z",
  p: "M0-6L5.7-1.9L3.5 4.9H-3.5L-5.7-1.9Z",
  H: "M-6 0L-3-5.2H3L6 0L3 5.2H-3Z",
  8: "M-2.3-5.6H2.3L5.6-2.3V2.3L2.3 5.6H-2.3L-5.6 2.3V-2.3Z",
  1: "M-.9.5V6H.9V.5L5.6-2.2L4.8-3.8L0-1L-4.8-3.8L-5.6-2.2Z",
  2: "M-.9-.5V-6H.9V-.5L5.6 2.2L4.8 3.8L0 1L-4.8 3.8L-5.6 2.2Z",
  3: "M-.5-.9H-6V.9H-.5L2.2 5.6L3.8 4.8L1 0L3.8-4.8L2.2-5.6Z",
  4: "M.5-.9H6V.9H.5L-2.2 5.6L-3.8 4.8L-1 0L-3.8-4.8L-2.2-5.6Z",
  "+": "M-.9-6H.9V-.9H6V.9H.9V6H-.9V.9H-6V-.9H-.9Z",
  ".": "M3 0A3 3 0 1 1-3 0A3 3 0 1 1 3 0Z",
  "*": "M0-7.5L1.8-2.4L7.1-2.3L2.9.9L4.4 6.1L0 3L-4.4 6.1L-2.9.9L-7.1-2.3L-1.8-2.4Z",
};

/**
 * Draws what is in view: `draw(width, height)` is called when an element comes into view and when its size changes.
 *
 * Gives `seen()`, and `redraw()` for when the content has changed.
 */
export function whenSeen(element, draw) {
  let seen = false;
  let drawn = "";
  const redraw = () => {
    drawn = "";
    update();
  };
  const update = () => {
    const size = [element.clientWidth, element.clientHeight];
    if (!seen || !size[0] || size.join() === drawn) return;
    drawn = size.join();
    draw(...size);
  };
  new ResizeObserver(update).observe(element);
  const watch = (entries) => {
    seen = entries[entries.length - 1].isIntersecting;
    redraw();
  };
  new IntersectionObserver(watch, { rootMargin: "200px" }).observe(element);
  return { redraw, seen: () => seen };
}
