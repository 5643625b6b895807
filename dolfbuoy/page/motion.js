// Where everything is at a time: of a recorded run between its instants, of a natural mode at its phase.

import { between, nearest, unpack } from "./core.js";
import { plus, turned, turnOf, unit } from "./shapes.js";

/** A run: lines between frames by cubics from positions and velocities, buoys between the rows of the series. */
export class Recorded {
  constructor(view, times) {
    Object.assign(this, { view, times, start: times[0], end: times[times.length - 1] });
    if (view.lines) {
      for (const name of ["time", "position", "velocity", "tension"])
        this[name] = view.lines[name] && unpack(view.lines[name]);
      this.frames = this.time;
      this.nodes = this.position.length / this.frames.length;
      this.cells = this.tension.length / this.frames.length;
    }
    this.bodies = view.buoys.map((buoy) => ({ position: unpack(buoy.position), orientation: unpack(buoy.orientation) }));
    for (const { ends } of view.devices) for (const end of ends) if (end.path) end.path = unpack(end.path);
    for (const vessel of view.vessels) if (vessel.path) vessel.path = unpack(vessel.path);
    this.forces = view.forces.map((force) => ({ ...force, values: unpack(force.values), path: force.path && unpack(force.path) }));
    this.tide = view.sea?.tide && unpack(view.sea.tide);
  }

  /** {nodes, tension, buoys: [{at, R}], forces: [{at, force, kind}]}. */
  at(t) {
    const buoys = this.bodies.map((body) => this.pose(body, t));
    const state = { t, buoys, ...(this.view.lines ? this.lines(t) : { nodes: [], tension: [] }) };
    for (const held of this.view.lines?.held ?? []) this.pull(state, held, buoys[held.buoy]);
    state.forces = this.forces.map((force) => this.force(force, t, state));
    state.devices = devicesAt(this.view, state, (path) => this.mixed(path, 3, t));
    state.vessels = this.view.vessels.map(({ path, at }) => (path ? this.mixed(path, 24, t) : at));
    state.level = this.tide ? this.mixed(this.tide, 1, t)[0] : 0;
    return state;
  }

  /** The recorded tensions that are nearest to t, and their time. */
  frame(t) {
    const row = nearest(this.frames, t);
    return { t: this.frames[row], tension: this.tension.slice(row * this.cells, (row + 1) * this.cells) };
  }

  /** All recorded tensions of a line, frame by frame. */
  tensionsOf({ cell }) {
    return Array.from(this.frames, (_, row) => this.tension.subarray(row * this.cells + cell[0], row * this.cells + cell[1]));
  }

  pose({ position, orientation }, t) {
    return { at: this.mixed(position, 3, t), R: turnOf(unit(this.mixed(orientation, 4, t))) };
  }

  /** So many numbers of each row of the series, between its rows. */
  mixed(values, width, t) {
    const [i, share] = between(this.times, t);
    const next = Math.min(i + 1, values.length / width - 1);
    return Array.from({ length: width }, (_, k) => values[i * width + k] * (1 - share) + values[next * width + k] * share);
  }

  lines(t) {
    const { frames, nodes, cells } = this;
    const [i, u] = between(frames, t);
    const next = Math.min(i + 1, frames.length - 1);
    const [a, b] = [i * nodes, next * nodes];
    const found = new Float64Array(nodes);
    const span = frames[next] - frames[i];
    const slope = this.velocity ? span * u * (1 - u) : 0;
    const smooth = this.velocity ? u * u * (3 - 2 * u) : u;
    for (let k = 0; k < nodes; k++) {
      found[k] = this.position[a + k] * (1 - smooth) + this.position[b + k] * smooth;
      if (slope) found[k] += slope * ((1 - u) * this.velocity[a + k] - u * this.velocity[b + k]);
    }
    const tension = new Float64Array(cells);
    for (let k = 0; k < cells; k++) tension[k] = this.tension[i * cells + k] * (1 - u) + this.tension[next * cells + k] * u;
    return { nodes: found, tension };
  }

  /** Bring the end of a line to its place on a buoy, and the nodes before it by less and less. */
  pull({ nodes }, { node, place }, { at, R }) {
    const goal = plus(at, turned(R, place));
    const gap = goal.map((x, i) => x - nodes[3 * node + i]);
    const [first, last] = this.view.lines.cables.find((cable) => node < cable.node[1]).node;
    for (let k = first; k < last; k++) {
      const share = 1 - Math.abs(k - node) / Math.max(last - 1 - first, 1);
      for (let i = 0; i < 3; i++) nodes[3 * k + i] += share * gap[i];
    }
  }

  force({ kind, values, path, ...where }, t, state) {
    return { kind, at: path ? this.mixed(path, 3, t) : placeOf(where, state), force: this.mixed(values, 3, t) };
  }
}

/** A place on a buoy, or at a node. */
function placeOf({ node, buoy, place }, { nodes, buoys }) {
  if (buoy !== undefined) return plus(buoys[buoy].at, turned(buoys[buoy].R, place));
  return [0, 1, 2].map((k) => nodes[3 * node + k]);
}

/** Both ends of every take-off; now: the present place on a path. */
function devicesAt(view, state, now) {
  const end = (one) => (one.path ? now(one.path) : (one.at ?? placeOf(one, state)));
  return view.devices.map(({ ends }) => ends.map(end));
}

/** A natural mode: the rest position, and the real part of its shape times exp(i phase), enlarged. */
export class Mode {
  constructor(view, shape) {
    const period = shape.period ?? 4;
    Object.assign(this, { view, period, factor: shape.factor, start: 0, end: period });
    this.rest = view.rest && unpack(view.rest);
    this.parts = shape.position && unpack(shape.position);
    this.tensions = shape.tension && unpack(shape.tension);
    this.motions = shape.buoys.map(unpack); // six numbers of each part
  }

  at(t) {
    const phase = (2 * Math.PI * t) / this.period;
    const [c, s] = [this.factor * Math.cos(phase), this.factor * -Math.sin(phase)];
    const moved = (values, size, k) => c * values[k] + s * values[size + k];
    const nodes = this.rest ? Float64Array.from(this.rest, (x, k) => x + moved(this.parts, this.rest.length, k)) : [];
    const cells = this.tensions ? this.tensions.length / 2 : 0;
    const tension = Float64Array.from({ length: cells }, (_, k) => moved(this.tensions, cells, k));
    const buoys = this.view.buoys.map((buoy, b) => {
      const motion = [0, 1, 2, 3, 4, 5].map((k) => moved(this.motions[b], 6, k));
      return { at: plus(buoy.rest, motion.slice(0, 3)), R: product(aroundVector(motion.slice(3)), turnOf(buoy.turn)) };
    });
    const state = { t, nodes, tension, buoys, forces: [] };
    return { ...state, devices: devicesAt(this.view, state), vessels: this.view.vessels.map(({ at }) => at) };
  }
}

function product(A, B) {
  return A.map((row) => [0, 1, 2].map((j) => row.reduce((sum, x, k) => sum + x * B[k][j], 0)));
}

function aroundVector(turn) {
  const angle = Math.hypot(...turn);
  const share = angle ? Math.sin(angle / 2) / angle : 0;
  return turnOf([Math.cos(angle / 2), ...turn.map((x) => x * share)]);
}
