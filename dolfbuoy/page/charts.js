// Charts as SVG: their colours are the style sheet's, so that they follow light, dark and paper.

import { before, drawn, element, format, range, ticks } from "./core.js";

const MARGIN = { left: 52, right: 14, top: 8 };
/** A longer name of the abscissa stands below its numbers, not beside them. */
const SHORT = 14;

/** A chart in `host`.
 *
 * options: {label (for those who do not see it), curves: [{name, x, y, style (a class c0 ... c5), area: [low, high],
 * bars: [{x, y, bar}] (error bars of points)}], xName, yName, height, xRange, yRange, yLog, xLog, equal, legend, onPick(x)}.
 * Its window in x can be moved, a cursor shown, and marks drawn by `extra(chart)` in its coordinates.
 */
export class Chart {
  constructor(host, options) {
    Object.assign(this, { height: 170, legend: true, xLog: false, yLog: false }, options);
    this.host = host;
    this.bottom = this.xName.length > SHORT ? 40 : 24;
    this.values = [];
    this.window = this.xRange ?? range(...this.curves.map((c) => c.x)) ?? [0, 1];
    this.whole = this.yRange ?? this.rangeOfValues();
    this.makeHead();
    this.svg = drawn("svg", { role: "img", "aria-label": this.label, class: "chart" });
    host.append(this.svg);
    if (this.onPick) this.listen();
    new ResizeObserver(() => this.draw()).observe(host);
    this.draw();
  }

  rangeOfValues() {
    const ends = (c) => (c.bars ?? []).flatMap(({ y, bar }) => [y - bar, y + bar]);
    const [low, high] = range(...this.curves.flatMap((c) => [c.y ?? [], ...(c.area ?? []), ends(c)])) ?? [0, 1];
    if (this.yLog) return [low, high];
    const still = high - low <= 1e-9 * Math.max(1, Math.abs(high));
    const room = still ? Math.max(0.05 * Math.abs(high), 1e-3) : Math.max(0.05 * (high - low), 1e-6 * Math.abs(high));
    return [low - room, high + room];
  }

  makeHead() {
    const head = element("div", { class: "head" }, element("span", { class: "yname" }, this.yName));
    for (const curve of this.legend ? this.curves : []) {
      const value = element("output", {});
      const sample = drawn("svg", { class: "sample", "aria-hidden": "true", viewBox: "0 0 26 8" });
      sample.append(curve.y ? drawn("path", { d: "M0 4H26", class: curve.style }) : drawn("rect", { width: 26, height: 8, class: "area" }));
      head.append(element("span", { class: "key" }, sample, element("span", {}, curve.name), value));
      this.values.push(value);
    }
    if (this.curves.some((curve) => curve.bars?.length)) {
      const sample = drawn("svg", { class: "sample", "aria-hidden": "true", viewBox: "0 0 26 8" });
      sample.append(drawn("path", { d: "M8 0.7h10m-5 0V7.3m-5 0h10", class: "errorbar" }));
      head.append(element("span", { class: "key" }, sample, element("span", {}, "error bar")));
    }
    this.host.append(head);
  }

  /** Texts behind the names of the curves. */
  say(texts) {
    texts.forEach((text, i) => (this.values[i].textContent = text));
  }

  /** What of x is shown. */
  show(low, high) {
    this.window = [low, high];
    this.draw();
  }

  /** A line at x. */
  point(x) {
    this.cursorAt = x;
    this.moveCursor();
  }

  x(value) {
    const [low, high] = this.xLog ? this.window.map(Math.log10) : this.window;
    const share = ((this.xLog ? Math.log10(value) : value) - low) / (high - low || 1);
    return MARGIN.left + share * this.inner;
  }

  y(value) {
    const [low, high] = this.yLog ? this.whole.map(Math.log10) : this.whole;
    const share = ((this.yLog ? Math.log10(Math.max(value, 1e-300)) : value) - low) / (high - low || 1);
    return this.size - this.bottom - share * (this.size - MARGIN.top - this.bottom);
  }

  draw() {
    this.width = Math.max(this.host.clientWidth, 200);
    this.inner = this.width - MARGIN.left - MARGIN.right;
    this.size = this.height;
    if (this.equal) this.fitEqual();
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.size}`);
    this.cursor = drawn("path", { class: "cursor" });
    const id = (this.clip ??= `clip-${Math.random().toString(36).slice(2)}`);
    const box = { x: MARGIN.left, y: MARGIN.top, width: this.inner, height: this.size - MARGIN.top - this.bottom };
    const body = drawn("g", { "clip-path": `url(#${id})` });
    for (const curve of this.curves) body.append(...this.marks(curve));
    this.svg.replaceChildren(drawn("clipPath", { id }, drawn("rect", box)), ...this.axes(), body, this.cursor);
    this.extra?.(this, body);
    this.moveCursor();
  }

  /** One scale for both axes: the height follows from the width, within bounds. */
  fitEqual() {
    const [x0, x1] = this.wanted ?? (this.wanted = [...this.window]);
    const [y0, y1] = this.wantedY ?? (this.wantedY = [...this.whole]);
    const inner = this.height - MARGIN.top - this.bottom;
    const scale = Math.max((x1 - x0) / this.inner, (y1 - y0) / inner);
    const [x, y] = [(x0 + x1) / 2, (y0 + y1) / 2];
    this.window = [x - (scale * this.inner) / 2, x + (scale * this.inner) / 2];
    this.whole = [y - (scale * inner) / 2, y + (scale * inner) / 2];
  }

  axes() {
    const parts = [];
    const bottom = this.size - this.bottom;
    for (const value of this.ticksOf(this.whole, this.yLog, Math.max(3, this.size / 45))) {
      const y = this.y(value);
      parts.push(drawn("path", { d: `M${MARGIN.left} ${y}H${this.width - MARGIN.right}`, class: "grid" }));
      parts.push(drawn("text", { x: MARGIN.left - 6, y: y + 4, "text-anchor": "end" }, tickText(value, this.yLog)));
    }
    for (const value of this.ticksOf(this.window, this.xLog, Math.max(3, this.width / 90))) {
      const x = this.x(value);
      parts.push(drawn("path", { d: `M${x} ${bottom}v4`, class: "axis" }));
      if (this.bottom > 24 || x < this.width - MARGIN.right - 6 * this.xName.length - 12)
        parts.push(drawn("text", { x, y: bottom + 16, "text-anchor": "middle" }, tickText(value, this.xLog)));
    }
    parts.push(drawn("path", { d: `M${MARGIN.left} ${bottom}H${this.width - MARGIN.right}`, class: "axis" }));
    const place = { x: this.width - MARGIN.right, y: this.size - 8, "text-anchor": "end" };
    parts.push(drawn("text", { ...place, class: "name" }, this.xName));
    return parts;
  }

  ticksOf([low, high], log, about) {
    if (!log) return ticks(low, high, about);
    const [from, to] = [Math.log10(low), Math.log10(high)];
    const step = Math.max(1, Math.round((to - from) / about));
    const within = to - from < 2.2 ? [1, 2, 5] : [1];
    const found = [];
    for (let n = Math.floor(from); n <= to + 1e-9; n += step) found.push(...within.map((m) => m * 10 ** n));
    return found.filter((x) => x >= low * (1 - 1e-9) && x <= high * (1 + 1e-9));
  }

  marks(curve) {
    const found = [];
    if (curve.area) found.push(drawn("path", { d: this.areaPath(curve), class: "area" }));
    if (curve.y) found.push(drawn("path", { d: this.path(curve.x, curve.y), class: `curve ${curve.style}` }));
    for (const one of curve.bars ?? []) found.push(drawn("path", { d: this.errorBar(one), class: "errorbar" }));
    return found;
  }

  errorBar({ x, y, bar }) {
    const [at, low, high] = [this.x(x), this.y(y - bar), this.y(y + bar)].map((v) => v.toFixed(1));
    return `M${at - 5} ${high}h10m-5 0V${low}m-5 0h10`;
  }

  areaPath({ x, area: [low, high] }) {
    const up = Array.from(x, (v, i) => `${this.x(v).toFixed(1)} ${this.y(high[i]).toFixed(1)}`);
    const down = Array.from(x, (v, i) => `${this.x(v).toFixed(1)} ${this.y(low[i]).toFixed(1)}`).reverse();
    return `M${up.join("L")}L${down.join("L")}Z`;
  }

  /** Of a rising x the least and largest y in each half pixel; else point by point. */
  path(x, y) {
    const rising = !this.equal;
    const from = rising && !this.xLog ? before(x, this.window[0]) : 0;
    const to = rising && !this.xLog ? Math.min(before(x, this.window[1]) + 2, x.length) : x.length;
    const step = Math.max(1, Math.floor((to - from) / (rising ? 2 * this.inner : 12000)));
    const pieces = [];
    let pen = "M";
    const add = (i) => {
      if (Number.isNaN(y[i])) pen = "M";
      else {
        pieces.push(`${pen}${this.x(x[i]).toFixed(1)} ${this.y(y[i]).toFixed(1)}`);
        pen = "L";
      }
    };
    for (let i = from; i < to; i += step) {
      if (step === 1 || !rising) add(i);
      else for (const j of extremes(y, i, Math.min(i + step, to))) add(j);
    }
    return pieces.join("") || "M0 0";
  }

  moveCursor() {
    if (this.cursorAt === undefined) return;
    const x = Math.min(Math.max(this.x(this.cursorAt), MARGIN.left), this.width - MARGIN.right);
    this.cursor.setAttribute("d", `M${x} ${MARGIN.top}V${this.size - this.bottom}`);
  }

  listen() {
    const pick = (event) => {
      const box = this.svg.getBoundingClientRect();
      const at = ((event.clientX - box.left) / box.width) * this.width;
      const share = Math.min(Math.max((at - MARGIN.left) / this.inner, 0), 1);
      this.onPick(this.window[0] + share * (this.window[1] - this.window[0]));
    };
    this.svg.classList.add("scrubs");
    this.svg.addEventListener("pointerdown", (event) => {
      this.svg.setPointerCapture(event.pointerId);
      pick(event);
    });
    this.svg.addEventListener("pointermove", (event) => event.buttons && pick(event));
  }
}

/** Rows of the least and largest number among some, in their order. */
function extremes(y, from, to) {
  let low = from;
  let high = from;
  for (let i = from; i < to; i++) {
    if (y[i] < y[low]) low = i;
    if (y[i] > y[high]) high = i;
  }
  return low < high ? [low, high] : low > high ? [high, low] : [low];
}

function tickText(value, log) {
  if (!log || (value >= 0.001 && value < 10000)) return format(value, 6);
  const power = Math.round(Math.log10(value));
  return `10${[...String(power)].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("")}`;
}
