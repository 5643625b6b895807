// What every page needs: the data, numbers as text, elements, colours.  Texts only ever enter as text.

/** The data of this page, from its JSON block. */
export const data = JSON.parse(document.getElementById("data").textContent);

/** A flat typed array of what pack.py has packed; `nan` where there was no number. */
export function unpack(packed) {
  const text = atob(packed.data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  if (packed.type === "f8") return new Float64Array(bytes.buffer);
  if (packed.type === "f4") return new Float32Array(bytes.buffer);
  const { scale, offset } = packed;
  return Float64Array.from(new Int16Array(bytes.buffer), (n) => (n === -32768 ? NaN : offset + scale * n));
}

/** A number with so many significant digits, as short as it can be written. */
export function format(x, digits = 4) {
  if (x === null || x === undefined || Number.isNaN(x)) return "–";
  if (!Number.isFinite(x)) return x > 0 ? "∞" : "−∞";
  return String(Number.isSafeInteger(x) ? x : Number(x.toPrecision(digits))).replace("-", "−");
}

/** An element with attributes and children; strings become text, `on...` listeners. */
export function element(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

/** The same in SVG. */
export function drawn(name, attributes = {}, ...children) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

function filled(node, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (value === true) node.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(key, value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

/** The element with this id, which the template has. */
export function byId(id) {
  return document.getElementById(id);
}

/** A section with its heading, among the charts of the page. */
export function figure(title, ...more) {
  const box = element("section", { class: "figure" }, element("h2", {}, title), ...more);
  byId("charts").append(box);
  return box;
}

/** Row of the rising `times` that is nearest to t. */
export function nearest(times, t) {
  const i = before(times, t);
  return i + 1 < times.length && times[i + 1] - t < t - times[i] ? i + 1 : i;
}

/** Last row of the rising `times` that is not after t; 0 before all. */
export function before(times, t) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** [row, share of the next one] at t, for interpolation; stays within the ends. */
export function between(times, t) {
  const i = Math.min(before(times, t), Math.max(times.length - 2, 0));
  if (times.length < 2) return [0, 0];
  const share = (t - times[i]) / (times[i + 1] - times[i]);
  return [i, Math.min(Math.max(share, 0), 1)];
}

/** Round numbers from low to high, about so many. */
export function ticks(low, high, about = 5) {
  const step = niceStep((high - low) / about);
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n <= high / step + 1e-9; n++) found.push(n * step);
  return found;
}

/** 1, 2 or 5 times a power of ten, at least x. */
export function niceStep(x) {
  if (!(x > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(x));
  return [1, 2, 5, 10].map((m) => m * power).find((step) => step >= x * (1 - 1e-9));
}

/** Least and largest finite number of arrays; null if there is none. */
export function range(...arrays) {
  let low = Infinity;
  let high = -Infinity;
  for (const values of arrays)
    for (const x of values) {
      if (x < low) low = x;
      if (x > high) high = x;
    }
  return low <= high ? [low, high] : null;
}

/** Value of a custom property of the style sheet, as [r, g, b] from 0 to 1; the property is #rrggbb. */
export function rgb(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
}

/** The colour at a share from 0 to 1 of the scale for tensions, --scale-0 to --scale-4 of the style sheet. */
export function scaleOfTension() {
  const stops = [0, 1, 2, 3, 4].map((i) => rgb(`--scale-${i}`));
  return (share) => {
    const x = Math.min(Math.max(share, 0), 1) * 4;
    const i = Math.min(Math.floor(x), 3);
    return stops[i].map((c, k) => c + (x - i) * (stops[i + 1][k] - c));
  };
}

/** Say what happens when the colours change: the system's or the button's. */
export function onTheme(tell) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", tell);
  document.addEventListener("theme", tell);
}

/** What every page does: a button that goes through automatic, light and dark; paper is light, and nothing is folded. */
export function dress() {
  const names = ["auto", "light", "dark"];
  const button = byId("theme");
  let now = 0;
  const wear = (name) => {
    document.documentElement.dataset.theme = name;
    document.dispatchEvent(new Event("theme"));
  };
  button.addEventListener("click", () => {
    now = (now + 1) % names.length;
    button.textContent = `Colours: ${names[now]}`;
    wear(names[now]);
  });
  window.addEventListener("beforeprint", () => {
    for (const details of document.querySelectorAll("#scene details")) details.open = true;
    wear("light");
  });
  window.addEventListener("afterprint", () => wear(names[now]));
}
