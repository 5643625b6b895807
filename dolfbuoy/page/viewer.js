// The picture in space: lines by their tension, hulls, water, bed, anchors, forces, and a camera that may follow.

import { Camera } from "./camera.js";
import { byId, drawn, element, format, niceStep, onTheme, rgb, scaleOfTension } from "./core.js";
import { Painter } from "./gl.js";
import { Waves, squares, surface } from "./sea.js";
import { ball, block, box, cone, grid, hull, placed, plus, sidesOf, turned, unit, upright } from "./shapes.js";

/** A Viewer in the stage of the page; null, with a note, where there is no WebGL. */
export function viewerOrNone(view, tensions) {
  const there = { names: view.labels.length, forces: view.forces.length, water: view.sea, bed: view.sea };
  for (const [name, any] of Object.entries(there)) document.querySelector(`[data-show=${name}]`).parentElement.hidden = !any;
  document.querySelector("[data-look=buoy]").hidden = !view.buoys.length;
  const stage = document.querySelector(".stage");
  try {
    return new Viewer(stage, view, tensions);
  } catch (error) {
    stage.classList.add("empty");
    for (const views of document.querySelectorAll(".views")) views.hidden = true;
    say(`The picture in space needs WebGL 2, which this browser does not have here (${error.message}). All else of the page works without it.`);
    return null;
  }
}

/** A sentence in the place of the picture; none takes it away. */
function say(sentence = "") {
  const without = document.querySelector(".without");
  without.textContent = sentence;
  without.hidden = !sentence;
}

/** Mesh, colour and size [pixels] of a mark by its kind (frame.py). */
const MARKS = {
  fixed: ["block", "anchor", 11],
  prescribed: ["ball", "anchor", 3],
  free: ["ball", "anchor", 3],
  joint: ["ball", "ink", 2.2],
  clump: ["ball", "ink", 3.5],
  float: ["ball", "hull", 3.5],
  winch: ["ball", "force-outside", 5],
};

/** Shows the states of a source (motion.js) in a canvas.
 *
 * view: of the data, see view.py.  tensions: [least, largest] of the colours [N].
 */
export class Viewer {
  constructor(stage, view, tensions) {
    this.canvas = stage.querySelector("canvas");
    Object.assign(this, { stage, view, tensions, shown: { water: true, bed: true, forces: true, names: true }, follow: -1 });
    this.painter = new Painter(this.canvas);
    this.camera = new Camera(this.canvas, () => this.redraw());
    this.waves = view.sea?.waves ? new Waves(view.sea.waves) : null;
    this.n = squares(this.waves);
    this.keepMeshes();
    this.readColors();
    onTheme(() => (this.readColors(), this.paint())); // at once: paper does not wait for a frame,
    window.addEventListener("beforeprint", () => this.canvas.toDataURL()); // and gets what was read last
    this.labels = this.makeLabels();
    this.look("whole");
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
    this.survive();
  }

  /** The graphics may be taken away, and come back empty. */
  survive() {
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // or it would not come back
      this.lost = true;
      say("The machine has taken its graphics away. The picture is drawn again as soon as they are back; all else goes on.");
    });
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.painter = new Painter(this.canvas);
      this.keepMeshes();
      this.lost = false;
      say();
      this.redraw();
    });
  }

  keepMeshes() {
    const keep = (mesh, moving) => this.painter.keep(mesh, moving);
    this.meshes = { ball: keep(ball()), cone: keep(cone()), block: keep(block()), water: keep(grid(this.n), true) };
    this.meshes.bed = keep(grid(1), true);
    this.boxes = this.view.vessels.map(() => keep(box(), true));
    this.hulls = this.view.buoys.map((buoy) => buoy.outline && keep(hull(buoy.outline)));
  }

  readColors() {
    const names = ["hull", "water", "bed", "anchor", "ink", "force-holds", "force-pulls", "force-outside"];
    this.colors = Object.fromEntries(names.map((name) => [name, rgb(`--${name}`)]));
    this.scale = scaleOfTension();
  }

  makeLabels() {
    const host = this.stage.querySelector(".labels");
    return this.view.labels.map((label) => {
      const shown = element("span", {}, label.text);
      host.append(shown);
      return { ...label, shown };
    });
  }

  /** One of the views: whole, buoy, side, above. */
  look(name) {
    const direction = (this.view.direction * Math.PI) / 180;
    this.looking = name;
    if (name === "buoy" && this.view.buoys.length) {
      this.follow = Math.max(this.follow, 0);
      const size = this.view.buoys[this.follow].size;
      const at = this.state?.buoys[this.follow].at ?? this.view.buoys[this.follow].start;
      const half = [1.5 * size, 1.5 * size, 1.1 * size];
      this.camera.frame([plus(at, half, -1), plus(at, half)], this.aside(direction), 0.16);
    } else {
      this.follow = -1;
      const [azimuth, height] = { side: [this.aside(direction), 0.02], above: [-Math.PI / 2, 1.5] }[name] ?? [-1.0, 0.26];
      this.camera.frame(this.view.box, azimuth, height);
    }
    this.lookAtBuoy();
  }

  /** Azimuth from which a plane of that heading is seen broadside, x to the right. */
  aside(direction) {
    const azimuth = direction - Math.PI / 2;
    return Math.sin(azimuth) > 0 ? azimuth + Math.PI : azimuth;
  }

  lookAtBuoy() {
    if (this.follow < 0 || !this.state) return;
    this.camera.target = this.state.buoys[this.follow].at.slice();
  }

  show(state) {
    const last = this.state;
    this.state = state;
    if (this.follow >= 0 && last) {
      const moved = state.buoys[this.follow].at.map((x, i) => x - last.buoys[this.follow].at[i]);
      this.camera.target = plus(this.camera.target, moved);
    }
    this.redraw();
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.paint();
    });
  }

  paint() {
    if (this.lost || !this.state) return;
    const { painter, state, shown } = this;
    painter.begin(this.camera);
    this.drawBuoys();
    this.drawVessels();
    this.drawEnds();
    const segments = [];
    this.addLines(segments);
    if (shown.forces) this.addForces(segments);
    painter.drawSegments(segments);
    this.drawBed(); // after what may lie in it, which shines through
    if (shown.water && this.view.sea) this.drawWater();
    this.placeLabels();
    this.drawAxes();
    this.canvas.dataset.t = state.t;
  }

  /** How far water and bed are drawn: around what is looked at, no farther than is needed. */
  reach() {
    const [low, high] = this.view.box;
    const whole = 0.85 * Math.hypot(high[0] - low[0], high[1] - low[1]) + 0.2 * (high[2] - low[2]);
    return Math.max(Math.min(1.5 * this.camera.distance, 1.6 * whole), 2);
  }

  middle() {
    const [low, high] = this.view.box;
    const { target } = this.camera;
    return this.follow >= 0 ? target : target.map((x, i) => Math.min(Math.max(x, low[i]), high[i]));
  }

  drawWater() {
    const [middle, reach] = [this.middle(), this.reach()];
    const { places, normals } = surface(this.waves, this.state.t, middle, reach, this.n, this.state.level ?? 0);
    this.painter.change(this.meshes.water, places, normals);
    const how = { color: this.colors.water, alpha: 0.4, kind: 2, middle, reach, cell: niceStep(reach / 25) };
    this.painter.draw(this.meshes.water, how);
  }

  drawBed() {
    const { sea } = this.view;
    if (!sea || !this.shown.bed) return;
    const [middle, reach] = [this.middle(), this.reach()];
    const places = [];
    for (const i of [-1, 1])
      for (const j of [-1, 1]) {
        const [x, y] = [middle[0] + i * reach, middle[1] + j * reach];
        places.push(x, y, sea.slope[0] * x + sea.slope[1] * y - sea.depth);
      }
    const normal = [-sea.slope[0], -sea.slope[1], 1];
    this.painter.change(this.meshes.bed, new Float32Array(places), new Float32Array([normal, normal, normal, normal].flat()));
    this.cell = niceStep(reach / 12);
    const how = { color: this.colors.bed, alpha: 0.78, kind: 1, middle, reach, cell: this.cell };
    this.painter.draw(this.meshes.bed, how);
    const legend = byId("grid-size");
    if (legend) legend.textContent = `grid of the bed ${format(this.cell)} m`;
  }

  drawBuoys() {
    this.view.buoys.forEach((buoy, b) => {
      const { at, R } = this.state.buoys[b];
      if (this.hulls[b]) this.painter.draw(this.hulls[b], { color: this.colors.hull, model: placed(at, 1, R) });
      else this.painter.draw(this.meshes.ball, { color: this.colors.hull, model: placed(at, 0.3 * buoy.size) });
      for (const z of buoy.masses) {
        const place = plus(at, turned(R, [0, 0, z]));
        this.painter.draw(this.meshes.ball, { color: this.colors.ink, model: placed(place, 0.035 * buoy.size) });
      }
    });
  }

  drawVessels() {
    this.state.vessels.forEach((corners, k) => {
      const { places, normals } = sidesOf(corners);
      this.painter.change(this.boxes[k], places, normals);
      this.painter.draw(this.boxes[k], { color: this.colors.anchor });
    });
  }

  /** Size of a thing that should be seen from any distance [m]. */
  mark(at, pixels) {
    const away = Math.hypot(...this.camera.position.map((x, i) => x - at[i]));
    return (pixels * away) / this.canvas.clientHeight;
  }

  drawEnds() {
    for (const { node, kind } of this.view.lines?.ends ?? []) {
      const at = this.node(node);
      const [mesh, color, size] = MARKS[kind];
      this.painter.draw(this.meshes[mesh], { color: this.colors[color], model: placed(at, this.mark(at, size)) });
    }
  }

  node(k) {
    return [0, 1, 2].map((i) => this.state.nodes[3 * k + i]);
  }

  /** Colour and width say the tension: what is pulled harder stands out more.  Elements that have parted are left out. */
  addLines(segments) {
    const [low, high] = this.tensions;
    for (const { node, cell, per } of this.view.lines?.cables ?? []) {
      for (let k = node[0]; k + 1 < node[1]; k++) {
        const number = cell[0] + Math.floor((k - node[0]) / per);
        if (this.state.t >= this.view.lines.parted[number]) continue;
        const tension = this.state.tension[number];
        const share = (tension - low) / (high - low || 1);
        const [color, width] = [this.scale(share), 2 + 3 * Math.min(Math.max(share, 0), 1)];
        segments.push(...this.node(k), ...this.node(k + 1), ...color, ...color, width, width);
      }
    }
    for (const [from, to] of this.state.devices) {
      const color = this.colors["force-holds"];
      const [near, far] = [0.35, 0.65].map((share) => from.map((x, i) => x + share * (to[i] - x)));
      segments.push(...from, ...to, ...color, ...color, 1.6, 1.6, ...near, ...far, ...color, ...color, 7, 7);
    }
    for (const [b, buoy] of this.view.buoys.entries()) {
      if (!buoy.mast) continue;
      const { at, R } = this.state.buoys[b];
      const ends = buoy.mast.map((z) => plus(at, turned(R, [0, 0, z])));
      segments.push(...ends[0], ...ends[1], ...this.colors.ink, ...this.colors.ink, 1.6, 1.6);
    }
  }

  /** Arrows whose length is to one scale; those too short to be seen are left out. */
  addForces(segments) {
    const largest = this.view.largestForce;
    if (!largest) return;
    const full = 0.22 * this.camera.distance * (this.follow >= 0 ? 0.8 : 0.6);
    this.newtons = niceStep(largest / full);
    for (const { at, force, kind } of this.state.forces) {
      const size = Math.hypot(...force);
      const length = size / this.newtons;
      if (length < this.mark(at, 6)) continue;
      const [axis, color] = [unit(force), this.colors[`force-${kind}`]];
      const [tip, head] = [plus(at, axis, length), Math.min(this.mark(at, 11), 0.6 * length)];
      segments.push(...at, ...plus(tip, axis, -head), ...color, ...color, 2, 2);
      const R = upright(axis).map((row) => [0.36 * row[0], 0.36 * row[1], row[2]]);
      const tips = kind === "outside" ? [tip, plus(tip, axis, -0.8 * head)] : [tip]; // told apart without colour too
      for (const place of tips) this.painter.draw(this.meshes.cone, { color, model: placed(place, head, R) });
    }
    const legend = byId("force-size");
    if (legend) legend.textContent = `1 m of arrow ${format(this.newtons >= 1000 ? this.newtons / 1000 : this.newtons)} ${this.newtons >= 1000 ? "kN" : "N"}`;
  }

  placeLabels() {
    for (const { shown, node, buoy, device, vessel } of this.labels) {
      const place = vessel === undefined ? this.placeOfLabel(node, buoy, device) : this.state.vessels[vessel].slice(21);
      const pixel = this.shown.names && this.painter.project(place);
      shown.hidden = !pixel;
      if (pixel) Object.assign(shown.style, { left: `${100 * pixel[0]}%`, top: `${100 * pixel[1]}%` });
    }
  }

  placeOfLabel(node, buoy, device) {
    if (buoy !== undefined) return this.state.buoys[buoy].at;
    if (device === undefined) return this.node(node);
    const [from, to] = this.state.devices[device];
    return from.map((x, i) => (x + to[i]) / 2);
  }

  /** Which way x, y and z point, in the corner. */
  drawAxes() {
    const host = this.stage.querySelector(".axes");
    const { right, up } = this.camera.axes();
    host.replaceChildren(
      ...["x", "y", "z"].flatMap((name, i) => {
        const [x, y] = [32 + 22 * right[i], 32 - 22 * up[i]];
        const letter = drawn("text", { x: 32 + 29 * right[i], y: 36 - 29 * up[i], "text-anchor": "middle" }, name);
        return [drawn("path", { d: `M32 32L${x} ${y}` }), letter];
      }),
    );
  }
}
