// The page of natural modes: a table, the chosen shape in motion, and how far every node of the lines goes.

import { Chart } from "./charts.js";
import { byId, data, element, figure, format, range, dress, unpack } from "./core.js";
import { Mode } from "./motion.js";
import { Player } from "./player.js";
import { SortedTable } from "./table.js";
import { viewerOrNone } from "./viewer.js";

function start() {
  dress();
  const viewer = viewerOrNone(data.view, [-1, 1]);
  const player = new Player(viewer, new Mode(data.view, data.modes[0]), [], true);
  const columns = [
    { key: "number", name: "#" },
    { key: "name", name: "what moves" },
    { key: "period", name: "period [s]", text: (x, mode) => mode.text || format(x, 5) },
    { key: "omega", name: "ω [rad/s]", text: (x) => format(x, 5) },
    { key: "damping_ratio", name: "damping ratio" },
    { key: "residual", name: "residual", text: (x) => format(x, 1) },
  ];
  const rows = data.modes.map((mode, i) => ({ ...mode, number: i + 1 }));
  const table = new SortedTable(byId("table"), columns, rows, (mode) => show(mode, viewer, player));
  table.choose(rows.find((row) => !row.text) ?? rows[0]);
}

function show(mode, viewer, player) {
  if (viewer && mode.scale) viewer.tensions = [-mode.scale.size || -1, mode.scale.size || 1];
  const text = mode.text || `period ${format(mode.period)} s, damping ratio ${format(mode.damping_ratio, 3)}`;
  byId("legend").replaceChildren(
    element("strong", {}, `${mode.number}: ${mode.name}`),
    element("span", {}, text),
    element("span", {}, `${format(mode.factor, 3)} times the shape of modes.nc`),
    element("span", {}, mode.scale?.size > 1e-6 ? `thick: the tension grows, up to ${mode.scale.text}` : ""),
    element("span", { id: "grid-size" }),
  );
  player.change(new Mode(data.view, mode));
  drawShape(mode);
}

/** Largest displacement of the nodes along every line. */
function drawShape(mode) {
  byId("charts").replaceChildren();
  if (!mode.position) return;
  const [s, parts] = [unpack(data.view.lines.s), unpack(mode.position)];
  const half = parts.length / 2;
  const most = range(parts.map(Math.abs))[1];
  const yRange = [0, Math.max(1.05 * most, 1e-3)];
  for (const cable of data.view.lines.cables) {
    const nodes = Array.from({ length: cable.node[1] - cable.node[0] }, (_, i) => cable.node[0] + i);
    const x = nodes.map((k) => s[k]);
    const curves = ["x", "y", "z"].map((name, i) => ({
      name,
      x,
      y: nodes.map((k) => Math.hypot(parts[3 * k + i], parts[half + 3 * k + i])),
      style: `c${i}`,
    }));
    const title = `Displacement along ${data.view.lines.cables.length > 1 ? cable.name : "the line"}`;
    const largest = format(range(...curves.map((c) => c.y))?.[1]);
    const label = `${title} of mode ${mode.number}, at most ${largest}`;
    new Chart(figure(title), { label, curves, xName: "arc length s [m]", yName: "amplitude, largest motion = 1 [m]", yRange, height: 210 });
  }
}

start();
