// The page of work-precision: a chart of error over time per quantity, and the table of all cases.

import { Chart } from "./charts.js";
import { byId, data, drawn, element, figure, format, range, dress } from "./core.js";
import { SortedTable } from "./table.js";

const MARKS = {
  "backward-euler": "M-4 -4H4V4H-4Z",
  bdf2: "M-4.6 0A4.6 4.6 0 1 0 4.6 0A4.6 4.6 0 1 0 -4.6 0Z",
  "generalized-alpha": "M0 -5L5 4H-5Z",
};
const STAR = "M0 -9L2.4 -2.9L8.6 -2.8L3.8 1.2L5.3 7.3L0 3.9L-5.3 7.3L-3.8 1.2L-8.6 -2.8L-2.4 -2.9Z";

function start() {
  dress();
  const pairs = [...new Set(data.rows.map((row) => row.pair))];
  const rows = data.rows.map((row, i) => ({ ...row, number: i + 1, settings: settings(row), style: pairs.indexOf(row.pair) % 6 }));
  const marks = [];
  for (const quantity of data.quantities) makeChart(quantity, rows, marks, (row) => table.choose(row));
  makeLegend(pairs, rows);
  const columns = [{ key: "settings", name: "settings" }, { key: "wall", name: "time [s]", text: (x) => format(x, 3) }, { key: "steps", name: "steps" }];
  for (const { key, name } of data.quantities)
    columns.push({ key: `bound_${key}`, name: `error of ${name}`, text: (x, row) => error(x, row[`resolved_${key}`]) });
  columns.push({ key: "unknowns", name: "unknowns" }, { key: "reason", name: "failed", text: (x) => x ?? "" });
  const table = new SortedTable(byId("table"), columns, rows, (row) => {
    for (const mark of marks) mark.node.classList.toggle("current", mark.row === row);
  });
}

function settings(row) {
  const size = row.tolerance === null ? `dt ${format(row.step)} s` : `tolerance ${format(row.tolerance, 2)}`;
  return `${row.own ? "★ " : ""}${row.cells ? `${row.pair}, ${row.cells} elements, ` : ""}${row.scheme}, ${size}`;
}

function error(value, resolved) {
  if (value === null || value === undefined) return "–";
  return `${resolved ? "" : "< "}${format(100 * value, 2)} %`;
}

function makeChart({ key, name, front }, rows, marks, choose) {
  const done = rows.filter((row) => typeof row[`bound_${key}`] === "number" && row[`bound_${key}`] > 0);
  if (!done.length) return;
  const best = front.map((i) => rows[i]);
  const curve = { name: "Pareto front", x: best.map((r) => r.wall), y: best.map((r) => 100 * r[`bound_${key}`]), style: "front" };
  const wide = (values) => {
    const [low, high] = range(values);
    return [low / 1.4, high * 1.4];
  };
  const bounds = { xRange: wide(done.map((r) => r.wall)), yRange: wide(done.map((r) => 100 * r[`bound_${key}`])) };
  const title = `Error of ${name}`;
  const box = figure(title);
  const tip = element("p", { class: "note", role: "status" }, "A mark says what it is; a click finds it in the table.");
  const extra = (chart, body) => {
    for (const row of done) body.append(markOf(chart, row, key, marks, choose, tip));
  };
  const label = `${title} over time of the loop, ${done.length} cases, from ${error(Math.min(...done.map((r) => r[`bound_${key}`])), true)} on`;
  const names = { xName: "time of the stepping loop [s]", yName: "rms error / range [%]" };
  new Chart(box, { label, curves: [curve], ...names, ...bounds, xLog: true, yLog: true, height: 280, legend: false, extra });
  box.append(tip);
}

function markOf(chart, row, key, marks, choose, tip) {
  const at = `translate(${chart.x(row.wall)} ${chart.y(100 * row[`bound_${key}`])})`;
  const text = `${row.settings}: ${error(row[`bound_${key}`], row[`resolved_${key}`])} in ${format(row.wall, 3)} s`;
  const kind = `mark s${row.style}${row.tolerance === null ? "" : " hollow"}${row[`resolved_${key}`] ? "" : " open"}`;
  const node = drawn("g", { transform: at, class: kind, tabindex: 0, role: "button", "aria-label": text }, drawn("path", { d: MARKS[row.scheme] }));
  if (row.own) node.append(drawn("path", { d: STAR, class: "star" }));
  for (const event of ["pointerenter", "focus"]) node.addEventListener(event, () => (tip.textContent = text));
  node.addEventListener("click", () => choose(row));
  node.addEventListener("keydown", (event) => ["Enter", " "].includes(event.key) && (event.preventDefault(), choose(row)));
  marks.push({ node, row });
  return node;
}

function makeLegend(pairs, rows) {
  const sample = (kind, d, text) =>
    element("li", {}, drawn("svg", { viewBox: "-10 -10 20 20", class: "symbol", "aria-hidden": "true" }, drawn("g", { class: kind }, drawn("path", { d }))), text);
  const found = pairs.map((pair, i) => sample(`mark s${i % 6}`, MARKS.bdf2, pair));
  for (const scheme of new Set(rows.map((row) => row.scheme))) found.push(sample("mark s5", MARKS[scheme], scheme));
  found.push(sample("mark s5 hollow", MARKS.bdf2, "hollow: adaptive steps"), sample("mark s5 open", MARKS.bdf2, "faint: the reference is not fine enough to tell"));
  found.push(sample("star", STAR, "the scene's own settings"), sample("front", "M-10 0H10", "Pareto front: nothing is faster and better"));
  figure("Key", element("ul", { class: "symbols" }, ...found));
}

start();
