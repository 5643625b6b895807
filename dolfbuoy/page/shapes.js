// Meshes: hulls of revolution, balls, anchors, heads of arrows, and the grid of water and bed.

/** A closed hull from its outline [[height over C, radius], ...], keel first, with a flat shading at its edges. */
export function hull(outline, around = 40) {
  const points = [[outline[0][0], 0], ...outline, [outline[outline.length - 1][0], 0]];
  const made = { places: [], normals: [], triangles: [] };
  for (let i = 0; i + 1 < points.length; i++) {
    const [[z0, r0], [z1, r1]] = [points[i], points[i + 1]];
    const length = Math.hypot(z1 - z0, r1 - r0);
    if (length === 0) continue;
    const [nr, nz] = [(z1 - z0) / length, (r0 - r1) / length];
    const first = made.places.length / 3;
    for (let j = 0; j <= around; j++) {
      const [c, s] = [Math.cos((2 * Math.PI * j) / around), Math.sin((2 * Math.PI * j) / around)];
      made.places.push(r0 * c, r0 * s, z0, r1 * c, r1 * s, z1);
      made.normals.push(nr * c, nr * s, nz, nr * c, nr * s, nz);
      const k = first + 2 * j;
      if (j < around) made.triangles.push(k, k + 2, k + 3, k, k + 3, k + 1);
    }
  }
  return made;
}

/** A ball of radius 1. */
export function ball(rows = 10) {
  const outline = [];
  for (let i = 0; i <= rows; i++) outline.push([-Math.cos((Math.PI * i) / rows), Math.sin((Math.PI * i) / rows)]);
  return hull(outline, 16);
}

/** A cone of height and radius 1, its tip at the origin, pointing up. */
export function cone() {
  return hull([[-1, 1], [0, 0]], 20);
}

/** A block around the origin, one wide, half in the ground. */
export function block() {
  return hull([[-0.4, 0.8], [0.45, 0.5]], 4);
}

/** Sides of a box by its corners, x before y before z. */
const SIDES = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];

/** A box whose corners, 24 numbers in a row, are set later by `sidesOf`. */
export function box() {
  const triangles = SIDES.flatMap((_, k) => [0, 1, 2, 0, 2, 3].map((i) => 4 * k + i));
  return { places: new Float32Array(72), normals: new Float32Array(72), triangles };
}

/** Places and normals of a box. */
export function sidesOf(corners) {
  const corner = (k) => corners.slice(3 * k, 3 * k + 3);
  const found = { places: [], normals: [] };
  for (const side of SIDES) {
    const [a, b, , d] = side.map(corner);
    const [u, v] = [b.map((x, i) => x - a[i]), d.map((x, i) => x - a[i])];
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (const k of side) {
      found.places.push(...corner(k));
      found.normals.push(...normal);
    }
  }
  return { places: new Float32Array(found.places), normals: new Float32Array(found.normals) };
}

/** n x n squares; their places are set later. */
export function grid(n) {
  const triangles = [];
  for (let i = 0; i < n; i++)
    for (let j = 0; j < n; j++) {
      const k = i * (n + 1) + j;
      triangles.push(k, k + n + 1, k + n + 2, k, k + n + 2, k + 1);
    }
  const zeros = new Float32Array(3 * (n + 1) * (n + 1));
  return { places: zeros, normals: zeros, triangles };
}

/** Matrix, column by column, of a turn R (rows), a size and a place. */
export function placed(at, size = 1, R = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]) {
  const m = new Float32Array(16);
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 3; j++) m[4 * j + i] = size * R[i][j];
    m[12 + i] = at[i];
  }
  m[15] = 1;
  return m;
}

/** A turn whose third axis is this unit vector. */
export function upright(axis) {
  const help = Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
  const x = unit(cross(help, axis));
  const y = cross(axis, x);
  return [0, 1, 2].map((i) => [x[i], y[i], axis[i]]);
}

/** Body to world of a unit quaternion (scalar first). */
export function turnOf([a, b, c, d]) {
  return [
    [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
    [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
    [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
  ];
}

export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function unit(a) {
  const size = Math.hypot(...a) || 1;
  return a.map((x) => x / size);
}

/** R x. */
export function turned(R, x) {
  return R.map((row) => row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
}

export function plus(a, b, factor = 1) {
  return a.map((x, i) => x + factor * b[i]);
}
