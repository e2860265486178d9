/** How numbers are written: a real minus sign, and as many digits as a reader can use. */

export function quantity(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  const digits = size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : 3;
  return minus(value.toFixed(digits));
}

export function short(value) {
  const size = Math.abs(value);
  if (size >= 1e6) return `${minus(String(Number((value / 1e6).toPrecision(3))))} M`;
  if (size >= 1e4) return `${minus(String(Number((value / 1e3).toPrecision(3))))} k`;
  return minus(String(Number(value.toPrecision(3))));
}

export function seconds(time) {
  return `${time.toFixed(2)} s`;
}

function minus(text) {
  return text.replace(/^-(?=.*[1-9])/, "−").replace(/^-/, "");
}
