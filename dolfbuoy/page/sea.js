// The water surface: a sum of waves a cos(kx x + ky y - w t + phase), as the record's scene has it.

import { unpack } from "./core.js";

/** A sea from {amplitude, kx, ky, omega, phase, ramp}. */
export class Waves {
  constructor(packed) {
    for (const name of ["amplitude", "kx", "ky", "omega", "phase"]) this[name] = unpack(packed[name]);
    this.ramp = packed.ramp;
    this.count = this.amplitude.length;
  }

  grown(t) {
    return t < this.ramp ? 0.5 * (1 - Math.cos((Math.PI * t) / this.ramp)) : 1;
  }

  /** Heights at all pairs of xs and ys, row by row of xs: cos(A + B) from the tables of A and B. */
  heights(t, xs, ys) {
    const { count } = this;
    const tables = [xs, ys].map((places) => [new Float64Array(places.length * count), new Float64Array(places.length * count)]);
    for (let n = 0; n < count; n++) {
      const phase = this.phase[n] - this.omega[n] * t;
      xs.forEach((x, i) => {
        tables[0][0][i * count + n] = Math.cos(this.kx[n] * x + phase);
        tables[0][1][i * count + n] = Math.sin(this.kx[n] * x + phase);
      });
      ys.forEach((y, j) => {
        tables[1][0][j * count + n] = this.amplitude[n] * Math.cos(this.ky[n] * y);
        tables[1][1][j * count + n] = this.amplitude[n] * Math.sin(this.ky[n] * y);
      });
    }
    return this.summed(tables, xs.length, ys.length, this.grown(t));
  }

  summed([[xc, xs], [yc, ys]], rows, columns, factor) {
    const { count } = this;
    const heights = new Float64Array(rows * columns);
    for (let i = 0; i < rows; i++)
      for (let j = 0; j < columns; j++) {
        let sum = 0;
        for (let n = 0, a = i * count, b = j * count; n < count; n++, a++, b++) sum += xc[a] * yc[b] - xs[a] * ys[b];
        heights[i * columns + j] = factor * sum;
      }
    return heights;
  }
}

/** Squares on a side of the water that is drawn: fewer where many waves are summed. */
export function squares(waves) {
  return Math.round(Math.min(Math.max(Math.sqrt(2.5e6 / (waves?.count ?? 1)), 28), 90));
}

/** Places and normals of a square of water (n + 1 points a side) around a point; without waves it is flat, at a level. */
export function surface(waves, t, [x0, y0], reach, n, level) {
  const step = (2 * reach) / n;
  const xs = Float64Array.from({ length: n + 1 }, (_, i) => x0 - reach + i * step);
  const ys = Float64Array.from({ length: n + 1 }, (_, j) => y0 - reach + j * step);
  const z = waves ? waves.heights(t, xs, ys) : new Float64Array((n + 1) ** 2);
  const places = new Float32Array(3 * z.length);
  const normals = new Float32Array(3 * z.length);
  const at = (i, j) => z[Math.min(Math.max(i, 0), n) * (n + 1) + Math.min(Math.max(j, 0), n)];
  for (let i = 0; i <= n; i++)
    for (let j = 0; j <= n; j++) {
      const k = 3 * (i * (n + 1) + j);
      places.set([xs[i], ys[j], level + z[k / 3]], k);
      normals.set([at(i - 1, j) - at(i + 1, j), at(i, j - 1) - at(i, j + 1), 2 * step], k);
    }
  return { places, normals };
}
