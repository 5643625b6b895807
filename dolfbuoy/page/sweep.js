// The page of a sweep: parallel axes, the table of cases, and the case that is chosen.

import { byId, data, element, format, dress, unpack } from "./core.js";
import { ParallelAxes } from "./parallel.js";
import { SortedTable, cellOf } from "./table.js";

const NAMES = { minimum: "least", maximum: "largest", mean: "mean", standard_deviation: "deviation", dominant_period: "period [s]", lasting_maximum: "for 1 s" };

function start() {
  dress();
  for (const quantity of data.quantities)
    for (const [name, packed] of Object.entries(quantity.statistics)) quantity.statistics[name] = unpack(packed);
  const main = data.main.map((name) => data.quantities.find((quantity) => quantity.name === name));
  const columns = [{ key: "number", name: "case" }, ...data.varied.map(({ key }) => ({ key, name: key }))];
  columns.push(...main.map((q) => ({ key: q.name, name: `largest ${spoken(q.name)} [${q.unit}]` })));
  const lives = data.lives && unpack(data.lives);
  if (lives) columns.push({ key: "life", name: "shortest life [years]" });
  columns.push({ key: "status", name: "status" });
  const rows = data.status.map((status, k) => {
    const row = { number: k + 1, status };
    for (const { key, values } of data.varied) row[key] = values[k];
    for (const q of main) row[q.name] = q.statistics.maximum[k];
    if (lives) row.life = lives[k];
    return row;
  });
  const axes = [...data.varied.map(({ key, values }) => ({ name: key, values }))];
  axes.push(...main.map((q) => ({ name: `largest ${spoken(q.name)} [${q.unit}]`, values: [...q.statistics.maximum] })));
  const label = `Parallel axes of ${rows.length} cases: ${axes.map((axis) => axis.name).join(", ")}`;
  const parallel = new ParallelAxes(byId("axes"), axes, label, (k) => table.choose(rows[k]));
  const table = new SortedTable(byId("table"), columns, rows, (row) => {
    parallel.mark(row.number - 1);
    open(row.number - 1);
  });
}

function spoken(name) {
  return name.replaceAll("_", " ").replace("buoy position z", "height of C");
}

/** The page of a case, in a window of its own, if it was kept; all its numbers, and how to run it. */
function open(k) {
  const replay = data.records[k] && `${data.records[k]}/page.html`;
  if (replay) window.open(replay, "dolfbuoy-case");
  const kept = Object.keys(NAMES).filter((name) => data.quantities.some((q) => q.statistics[name]));
  const names = ["quantity", "unit", ...kept.map((name) => NAMES[name])];
  const head = element("tr", {}, ...names.map((name) => element("th", { scope: "col" }, name)));
  const lines = data.quantities.map((q) =>
    element(
      "tr",
      { title: q.text },
      element("th", { scope: "row" }, spoken(q.name)),
      cellOf(q.unit),
      ...kept.map((name) => cellOf(q.statistics[name] ? format(q.statistics[name][k]) : "")),
    ),
  );
  byId("chosen").replaceChildren(
    element("p", {}, element("strong", {}, `Case ${k + 1}: `), data.varied.map(({ key, values }) => `${key} = ${values[k]}`).join(", ")),
    element("p", {}, `Status: ${data.status[k]}`),
    replay ? element("p", {}, element("a", { href: replay, target: "dolfbuoy-case" }, "Replay and all of this case")) : "",
    ...howToRun(k),
    element("div", { class: "scroll" }, element("table", {}, element("thead", {}, head), element("tbody", {}, ...lines))),
  );
}

/** The command that runs a case alone, and a button that copies it. */
function howToRun(k) {
  const changes = data.varied.map(({ key, values }) => `--set ${quoted(`${key}=${asToml(values[k])}`)}`);
  const command = `dolfbuoy run ${data.source || "scene.toml"} ${changes.join(" ")} --out case-${k + 1}`;
  const where = data.source ? "from where the sweep was started" : data.scene ? "with the scene below saved as scene.toml" : "";
  const text = element("pre", { tabindex: 0 }, command);
  const copy = element("button", { type: "button", class: "quiet" }, "Copy");
  copy.addEventListener("click", async () => {
    getSelection().selectAllChildren(text); // where nothing may be copied, the keys for it do
    const copied = navigator.clipboard?.writeText(command) ?? Promise.reject();
    copy.textContent = await copied.then(() => "Copied", () => "Selected");
  });
  return [element("p", {}, `This case alone${where && `, ${where}`}: `, copy), text];
}

function asToml(value) {
  return typeof value === "string" && !/^[[{]/.test(value) ? JSON.stringify(value) : String(value);
}

/** For a shell. */
function quoted(text) {
  return /^[\w.=,+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
}

start();
