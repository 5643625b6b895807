// The page of a run: the replay and the charts that go with it.

import { Chart } from "./charts.js";
import { byId, data, drawn, element, figure, format, nearest, onTheme, range, scaleOfTension, dress, unpack } from "./core.js";
import { Recorded } from "./motion.js";
import { Player } from "./player.js";
import { viewerOrNone } from "./viewer.js";

const times = unpack(data.time);
/** Lines or buoys of which all charts are shown at once. */
const MOST_PARTS = 3;

function start() {
  dress();
  const player = makePlayer();
  const panels = makePanels(player);
  makeEnvelopes(player);
  makeTracks(player);
  makeSpectra();
  player.refresh();
  chooseWindows(player, panels);
  for (const button of document.querySelectorAll("[data-t]"))
    button.addEventListener("click", () => show(player, { ...button.dataset, t: Number(button.dataset.t) }));
  if (data.moments.length) show(player, data.moments[0]);
  else player.go(times[0]);
  forPaper(player, panels);
}

/** A moment: its time, and the line or buoy whose it is. */
function show(player, { t, kind, part }) {
  const select = byId(`of-${kind}`).querySelector("select");
  if (select.value !== part) {
    select.value = part;
    select.dispatchEvent(new Event("change"));
  }
  player.go(t);
}

/** The viewer with its legend; without WebGL the charts are all there is. */
function makePlayer() {
  const viewer = viewerOrNone(data.view, data.view.lines?.scale ?? [0, 1]);
  makeLegend();
  return new Player(viewer, new Recorded(data.view, times), times);
}

function makeLegend() {
  const host = byId("legend");
  const scale = data.view.lines?.scale;
  if (scale) {
    const bar = drawn("svg", { viewBox: "0 0 120 10", class: "bar", "aria-hidden": "true" });
    const paint = () => {
      const color = scaleOfTension();
      const pieces = Array.from({ length: 30 }, (_, i) => {
        const rgb = color(i / 29).map((c) => Math.round(255 * c));
        const half = 1 + (3.5 * i) / 29;
        return drawn("rect", { x: 4 * i, width: 4.2, y: 5 - half, height: 2 * half, fill: `rgb(${rgb})` });
      });
      bar.replaceChildren(...pieces);
    };
    paint();
    onTheme(paint);
    const factor = scale[1] >= 1000 ? 1e-3 : 1;
    const least = Math.abs(scale[0]) < 2e-3 * scale[1] ? 0 : scale[0];
    const [low, high, largest] = [least, scale[1], data.view.lines.largest].map((x) => format(x * factor, 3));
    const above = largest === high ? "" : `, in any step ${largest} at most`;
    host.append(element("div", { class: "tension" }, low, bar, `${high} ${factor < 1 ? "kN" : "N"} tension${above}`));
  }
  const keys = { pulls: "force of a line on a buoy", holds: "force that holds a line", outside: "wind, external force" };
  for (const kind of new Set(data.view.forces.map((force) => force.kind)))
    host.append(element("span", { class: `arrow ${kind}` }, `${kind === "outside" ? "↠" : "→"} ${keys[kind]}`));
  host.append(element("span", { id: "force-size" }), element("span", { id: "grid-size" }));
}

/** A chart over time for every panel; those of one line and one buoy are shown. */
function makePanels(player) {
  const host = byId("panels");
  const chosen = { line: null, buoy: null };
  const whole = (v) => (Math.abs(v) < 1e-9 ? 0 : v); // rounding is not drawn
  const made = data.panels.map((panel) => {
    const curves = panel.curves.map((curve, i) => ({
      name: curve.name,
      x: times,
      exact: unpack(curve.values).map(whole),
      y: unpack(curve.values).map((v) => whole(v) * panel.factor),
      bars: curve.bars.map(({ t, value, bar }) => ({ x: t, y: value * panel.factor, bar: bar * panel.factor })),
      style: `c${i}`,
    }));
    const box = element("div", { class: "panel" });
    host.append(box);
    const label = `${[panel.part, panel.title].filter(Boolean).join(": ")} over time [${panel.unit}]: ${curves.map(described).join("; ")}`;
    const yName = `${panel.part ? `${panel.part}: ` : ""}${panel.title} [${panel.unit}]`;
    const options = { label, curves, xName: "time [s]", yName, height: 150 };
    return { ...panel, box, chart: new Chart(box, { ...options, onPick: (t) => player.go(t) }), curves };
  });
  const refresh = () => {
    for (const one of made) one.box.hidden = one.part !== (chosen[one.kind] ?? one.part);
    hideOthers(chosen);
  };
  player.refresh = refresh;
  for (const kind of ["line", "buoy"]) {
    const parts = [...new Set(made.filter((one) => one.kind === kind).map((one) => one.part))];
    chosen[kind] = choice(byId(`of-${kind}`), parts, (part) => ((chosen[kind] = part), refresh()));
  }
  refresh();
  player.heard.push((t) => made.forEach((one) => point(one, t)));
  return made;
}

/** Of very many lines or buoys the lower charts too show the chosen one only. */
function hideOthers(chosen) {
  for (const kind of ["line", "buoy"]) {
    const boxes = [...document.querySelectorAll(`.figure[data-kind=${kind}]`)];
    const parts = new Set(boxes.map((box) => box.dataset.part));
    for (const box of boxes) box.hidden = parts.size > MOST_PARTS && box.dataset.part !== chosen[kind];
  }
}

function described({ name, y, bars }) {
  const [low, high] = range(y) ?? [NaN, NaN];
  const known = bars.map((one) => `${format(one.y)} ± ${format(one.bar, 2)}`);
  return `${name} from ${format(low)} to ${format(high)}${known.length ? ` (with error bars: ${known.join(", ")})` : ""}`;
}

/** The cursor of a panel, and beside the names of its curves the recorded values. */
function point({ chart, curves, factor }, t) {
  const row = nearest(times, t);
  chart.point(t);
  chart.say(curves.map((curve) => format(curve.exact[row] * factor)));
}

/** Options of a select, hidden if there is nothing to choose; returns the first. */
function choice(label, names, tell) {
  const select = label.querySelector("select");
  for (const name of names) select.append(element("option", { value: name }, name));
  label.hidden = names.length < 2;
  select.addEventListener("change", () => tell(select.value));
  return names[0] ?? null;
}

/** How much of the time is seen: all of it, or some periods around the replay. */
function chooseWindows(player, panels) {
  const select = byId("window");
  const span = times[times.length - 1] - times[0];
  const period = data.period ?? span / 12;
  const lengths = [12, 4].map((n) => n * period).filter((length) => length < 0.8 * span);
  select.append(element("option", { value: "0" }, "whole run"));
  for (const length of lengths) {
    const text = data.period ? `${Math.round(length / period)} periods` : `${format(length, 2)} s`;
    select.append(element("option", { value: length }, text));
  }
  if (span > 30 * period && lengths.length) select.value = lengths[0];
  select.addEventListener("change", () => move(player.t));
  const move = (t) => {
    const length = Number(select.value) || span;
    const first = Math.min(Math.max(t - length / 2, times[0]), times[times.length - 1] - length);
    for (const { chart, box } of panels)
      if (!box.hidden && (chart.window[0] !== first || chart.window[1] !== first + length)) chart.show(first, first + length);
  };
  for (const label of ["of-line", "of-buoy"]) byId(label).querySelector("select").addEventListener("change", () => move(player.t));
  player.heard.push(move);
}

/** Tension along every line: its range behind the ramp, and the present one. */
function makeEnvelopes(player) {
  data.envelopes.forEach((envelope) => {
    const cable = data.view.lines.cables.find((one) => one.name === envelope.part) ?? data.view.lines.cables[0];
    const [x, low, mean, high] = ["s", "low", "mean", "high"].map((key) => unpack(envelope[key]));
    const scaled = (values) => Float64Array.from(values, (v) => v * envelope.factor);
    const now = { name: "now", x, y: scaled(mean), style: "now" };
    const curves = [
      { name: "least to largest", x, area: [scaled(low), scaled(high)] },
      { name: "mean", x, y: scaled(mean), style: "c0" },
      now,
    ];
    const title = envelope.part ? `Tension along ${envelope.part}` : "Tension along the line";
    const label = `${title} [${envelope.unit}], from ${format(range(curves[1].y)[0])} to ${format(range(curves[0].area[1])[1])}`;
    const all = range(low, high, ...player.source.tensionsOf(cable)).map((v) => v * envelope.factor);
    const room = 0.05 * (all[1] - all[0]) || 1;
    const names = { xName: "arc length s [m]", yName: `tension [${envelope.unit}]`, yRange: [all[0] - room, all[1] + room] };
    const box = figure(title);
    const chart = new Chart(box, { label, curves, ...names, height: 230 });
    box.dataset.kind = "line";
    box.dataset.part = envelope.part;
    const text = `Range of all steps from ${format(envelope.from)} to ${format(envelope.to)} s, mean of ${envelope.instants} instants`;
    box.append(element("p", { class: "note" }, `${text}; the line now is the nearest of them.`));
    player.heard.push((t) => {
      const frame = player.source.frame(t);
      if (frame.t === now.t) return;
      Object.assign(now, { t: frame.t, y: scaled(frame.tension.slice(...cable.cell)) });
      chart.draw();
      chart.say(["", "", `at ${format(frame.t)} s`]);
    });
  });
}

/** Where the centres of mass go, seen from above. */
function makeTracks(player) {
  if (!data.view.buoys.length) return;
  const curves = data.view.buoys.map((buoy, i) => {
    const { position } = player.source.bodies[i];
    const column = (k) => Float64Array.from(times, (_, row) => position[3 * row + k]);
    return { name: buoy.name, x: column(0), y: column(1), style: `c${i % 6} thin` };
  });
  const box = figure("Track from above");
  const bounds = { xRange: padded(curves.map((c) => c.x)), yRange: padded(curves.map((c) => c.y)) };
  const spans = [bounds.xRange, bounds.yRange].map(([low, high]) => `${format(low, 3)} to ${format(high, 3)} m`);
  const label = `Horizontal track of the buoys, within x from ${spans[0]}, y from ${spans[1]}`;
  const dots = curves.map(() => drawn("circle", { r: 4.5, class: "here" }));
  let row = 0;
  const place = (chart) =>
    dots.forEach((dot, i) => {
      dot.setAttribute("cx", chart.x(curves[i].x[row]));
      dot.setAttribute("cy", chart.y(curves[i].y[row]));
    });
  const extra = (chart, body) => {
    for (const [x, y] of data.anchors) body.append(drawn("rect", { x: chart.x(x) - 4, y: chart.y(y) - 4, width: 8, height: 8, class: "anchor" }));
    body.append(...dots);
    place(chart);
    drawHeadings(chart);
  };
  const names = { xName: "x [m]", yName: "y [m]", height: 300, equal: true, legend: curves.length > 1 };
  const chart = new Chart(box, { label, curves, ...bounds, ...names, extra });
  player.heard.push((t) => {
    row = nearest(times, t);
    place(chart);
  });
}

/** The range of arrays with some room. */
function padded(arrays) {
  const [low, high] = range(...arrays);
  const room = 0.08 * (high - low) + 0.02;
  return [low - room, high + room];
}

/** Arrows in the corner: where waves, current, wind and force go. */
function drawHeadings(chart) {
  data.headings.forEach(([name, [x, y]], i) => {
    const [cx, cy] = [chart.width - 40, 36 + 42 * i];
    const [dx, dy] = [13 * x, -13 * y];
    const head = `M${cx + dx} ${cy + dy}l${-0.5 * dx - 0.35 * dy} ${-0.5 * dy + 0.35 * dx}M${cx + dx} ${cy + dy}l${-0.5 * dx + 0.35 * dy} ${-0.5 * dy - 0.35 * dx}`;
    chart.svg.append(
      drawn("path", { d: `M${cx - dx} ${cy - dy}L${cx + dx} ${cy + dy}${head}`, class: "heading" }),
      drawn("text", { x: cx - 19, y: cy + 4, "text-anchor": "end" }, name),
    );
  });
}

function makeSpectra() {
  for (const spectrum of data.spectra) {
    const x = unpack(spectrum.frequency);
    const curves = spectrum.curves.map((curve, i) => ({ name: curve.name, x, y: unpack(curve.values), style: `c${i}` }));
    const kind = spectrum.title === "tension" ? "line" : "buoy";
    const title = `Spectrum of ${spectrum.part ? `${spectrum.part}: ` : ""}${spectrum.title}`;
    const unit = `${spectrum.unit}²/Hz`;
    const extra = (chart, body) => {
      if (!spectrum.drive) return;
      const at = chart.x(spectrum.drive);
      body.append(drawn("path", { d: `M${at} 0V${chart.size}`, class: "drive" }), drawn("text", { x: at + 4, y: 18 }, `drive ${format(spectrum.drive, 3)} Hz`));
    };
    const names = { xName: "frequency [Hz]", yName: `density [${unit}]`, yLog: true, yRange: [spectrum.low, spectrum.high] };
    const box = figure(title);
    Object.assign(box.dataset, { kind, part: spectrum.part });
    new Chart(box, { label: `${title} [${unit}]`, curves, ...names, height: 210, extra });
  }
}

/** On paper the whole run is seen, and every line and buoy unless they are many. */
function forPaper(player, panels) {
  const count = (kind) => new Set(panels.filter((one) => one.kind === kind).map((one) => one.part)).size;
  window.addEventListener("beforeprint", () => {
    byId("window").value = "0";
    for (const { box, kind } of panels) box.hidden &&= count(kind) > MOST_PARTS;
    player.go(player.t);
    for (const { chart } of panels) chart.draw();
  });
  window.addEventListener("afterprint", player.refresh);
}

start();
