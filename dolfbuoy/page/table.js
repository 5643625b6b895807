// A table that is sorted by a click on a heading; a row can be chosen by mouse or keyboard.

import { element, format } from "./core.js";

/** How many rows are shown at first, and with every "more". */
const PIECE = 200;

/** columns: [{key, name, text(value)}]; rows: objects; chosen(row): told of the row that was chosen. */
export class SortedTable {
  constructor(host, columns, rows, chosen) {
    Object.assign(this, { columns, rows: [...rows], chosen, limit: PIECE, falling: false, current: null });
    this.heads = columns.map((column) => {
      const button = element("button", { type: "button", class: "sort", onclick: () => this.sort(column) }, column.name);
      return element("th", { scope: "col", "aria-sort": "none" }, button);
    });
    this.body = element("tbody");
    this.more = element("button", { type: "button", onclick: () => ((this.limit += 5 * PIECE), this.fill()) });
    const table = element("table", { class: "sorted" }, element("thead", {}, element("tr", {}, ...this.heads)), this.body);
    host.append(element("div", { class: "scroll" }, table), this.more);
    this.fill();
  }

  sort(column) {
    this.falling = this.by === column ? !this.falling : false;
    this.by = column;
    const way = this.falling ? -1 : 1;
    const last = (x) => x === null || x === undefined || Number.isNaN(x);
    this.rows.sort((a, b) => {
      const [x, y] = [a[column.key], b[column.key]];
      if (last(x) || last(y)) return last(x) - last(y);
      return way * (typeof x === "number" && typeof y === "number" ? x - y : String(x).localeCompare(String(y)));
    });
    this.heads.forEach((head, i) => {
      const order = this.falling ? "descending" : "ascending";
      head.setAttribute("aria-sort", this.columns[i] === column ? order : "none");
    });
    this.fill();
  }

  fill() {
    this.body.replaceChildren(...this.rows.slice(0, this.limit).map((row) => this.line(row)));
    this.more.hidden = this.rows.length <= this.limit;
    this.more.textContent = `Show more (${this.rows.length - this.limit} are left)`;
    this.mark();
  }

  line(row) {
    const cells = this.columns.map(({ key, text }) => (text ?? shown)(row[key], row));
    const choose = () => this.choose(row);
    const first = element("th", { scope: "row" }, element("button", { type: "button", class: "row", onclick: choose }, cells[0]));
    const line = element("tr", { onclick: choose }, first, ...cells.slice(1).map(cellOf));
    line.row = row;
    return line;
  }

  /** Make this row the current one, and say so. */
  choose(row) {
    if (this.current === row) return;
    this.current = row;
    this.mark();
    this.chosen(row);
  }

  mark() {
    for (const line of this.body.children) {
      const is = line.row === this.current;
      line.classList.toggle("current", is);
      line.querySelector("button").setAttribute("aria-pressed", is);
    }
  }
}

/** A cell; numbers are not broken into lines. */
export function cellOf(text) {
  return element("td", { class: /^[<−\d]/.test(text) && "n" }, text);
}

function shown(value) {
  return typeof value === "number" ? format(value) : (value ?? "–");
}
