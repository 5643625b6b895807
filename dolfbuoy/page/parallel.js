// Parallel axes: a column per varied key and main result, a line per case.

import { drawn, element, format, range, ticks } from "./core.js";

/** More lines than this are not drawn: every second, third, ... case. */
const MOST = 1200;

export class ParallelAxes {
  /** axes: [{name, values: [of each case: a number or a text]}]; chosen(case). */
  constructor(host, axes, label, chosen) {
    Object.assign(this, { host, axes: axes.map(scaled), chosen, current: null, height: 330 });
    this.svg = drawn("svg", { role: "img", "aria-label": label, class: "chart parallel" });
    this.tip = element("p", { class: "note", role: "status" });
    const every = Math.ceil(axes[0].values.length / MOST);
    const thinned = every > 1 ? `Of ${axes[0].values.length} cases one in ${every} has a line; the table has all.` : "";
    host.append(this.svg, this.tip, element("p", { class: "note" }, thinned));
    this.svg.addEventListener("click", (event) => this.pick(event));
    this.svg.addEventListener("pointermove", (event) => this.hover(event));
    new ResizeObserver(() => this.draw()).observe(host);
  }

  x(i) {
    return 60 + (i * (this.width - 130)) / Math.max(this.axes.length - 1, 1);
  }

  y(share) {
    return this.height - 34 - share * (this.height - 74);
  }

  draw() {
    this.width = Math.max(this.host.clientWidth, 110 * this.axes.length);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    this.svg.style.minWidth = `${this.width}px`;
    const count = this.axes[0].shares.length;
    const every = Math.ceil(count / MOST);
    this.lines = new Map();
    const group = drawn("g", { class: count > 60 ? "many" : "few" });
    for (let k = 0; k < count; k += every) {
      const d = this.path(k);
      if (!d) continue;
      const line = drawn("path", { d, class: "case" });
      this.lines.set(k, line);
      group.append(line);
    }
    this.top = drawn("path", { class: "case current" });
    this.svg.replaceChildren(group, ...this.axes.flatMap((axis, i) => this.axis(axis, i)), this.top);
    this.mark(this.current);
  }

  path(k) {
    const shares = this.axes.map((axis) => axis.shares[k]);
    if (shares.some((share) => !Number.isFinite(share))) return null;
    return `M${shares.map((share, i) => `${this.x(i).toFixed(1)} ${this.y(share).toFixed(1)}`).join("L")}`;
  }

  axis(axis, i) {
    const x = this.x(i);
    const parts = [drawn("path", { d: `M${x} ${this.y(0)}V${this.y(1)}`, class: "axis" })];
    for (const { share, text } of axis.marks) {
      parts.push(drawn("path", { d: `M${x - 3} ${this.y(share)}h6`, class: "axis" }));
      parts.push(drawn("text", { x: x + 7, y: this.y(share) + 4, class: "halo" }, text));
    }
    const lift = i % 2 ? 26 : 12; // names of neighbours do not meet
    const [at, anchor] = i === 0 ? [4, "start"] : i === this.axes.length - 1 ? [this.width - 4, "end"] : [x, "middle"];
    parts.push(drawn("text", { x: at, y: lift, "text-anchor": anchor, class: "name" }, axis.name));
    return parts;
  }

  /** The case whose line is nearest to the pointer, within some pixels. */
  near(event) {
    const box = this.svg.getBoundingClientRect();
    const at = [((event.clientX - box.left) / box.width) * this.width, ((event.clientY - box.top) / box.height) * this.height];
    const gap = (this.width - 130) / Math.max(this.axes.length - 1, 1);
    const i = Math.min(Math.max(Math.floor((at[0] - 60) / gap), 0), Math.max(this.axes.length - 2, 0));
    const u = Math.min(Math.max((at[0] - this.x(i)) / gap, 0), 1);
    let [best, distance] = [null, 12];
    for (const k of this.lines.keys()) {
      const [a, b] = [this.axes[i].shares[k], this.axes[Math.min(i + 1, this.axes.length - 1)].shares[k]];
      const away = Math.abs(this.y(a + u * (b - a)) - at[1]);
      if (away < distance) [best, distance] = [k, away];
    }
    return best;
  }

  pick(event) {
    const k = this.near(event);
    if (k !== null) this.chosen(k);
  }

  hover(event) {
    const k = this.near(event);
    this.svg.style.cursor = k === null ? "default" : "pointer";
    if (this.over !== undefined) this.lines.get(this.over)?.classList.remove("over");
    this.over = k ?? undefined;
    this.lines.get(k)?.classList.add("over");
    this.tip.textContent = k === null ? "" : `case ${k + 1}: ${this.axes.map((axis) => `${axis.name} ${asText(axis.values[k])}`).join(", ")}`;
  }

  mark(k) {
    this.current = k;
    this.top.setAttribute("d", (k !== null && this.path(k)) || "M0 0");
  }
}

function asText(value) {
  return typeof value === "number" ? format(value) : value;
}

/** An axis with the share of its height of every value, and its marks; words are spread evenly. */
function scaled({ name, values }) {
  const numbers = values.every((value) => typeof value === "number");
  if (!numbers) {
    const words = [...new Set(values.map(String))];
    const share = (word) => (words.length > 1 ? words.indexOf(String(word)) / (words.length - 1) : 0.5);
    return { name, values, shares: values.map(share), marks: words.slice(0, 24).map((text) => ({ share: share(text), text })) };
  }
  const [low, high] = range(values) ?? [0, 1];
  const share = (x) => (high > low ? (x - low) / (high - low) : 0.5);
  const few = [...new Set(values.filter(Number.isFinite))];
  const marks = few.length <= 8 ? few : [low, ...ticks(low, high, 5).filter((x) => share(x) > 0.06 && share(x) < 0.94), high];
  return { name, values, shares: values.map(share), marks: marks.map((x) => ({ share: share(x), text: format(x) })) };
}
