// A camera that goes round a point: drag turns, two fingers or the right button push, the wheel comes nearer.

const FIELD = (32 * Math.PI) / 180; // of view, upright
const HIGHEST = 1.5; // elevation [rad], short of straight down

export class Camera {
  constructor(canvas, changed) {
    Object.assign(this, { canvas, changed, azimuth: -1.05, elevation: 0.28, distance: 10, target: [0, 0, 0] });
    this.fingers = new Map();
    this.listen();
  }

  /** See a box (low, high corner) from a direction [rad]. */
  frame([low, high], azimuth, elevation) {
    this.target = low.map((a, i) => (a + high[i]) / 2);
    Object.assign(this, { azimuth, elevation });
    const { right, up } = this.axes();
    const half = low.map((a, i) => (high[i] - a) / 2);
    const reach = (axis) => half.reduce((sum, h, i) => sum + h * Math.abs(axis[i]), 0);
    const aspect = this.canvas.clientWidth / this.canvas.clientHeight || 1.5;
    this.distance = (1.12 * Math.max(reach(up), reach(right) / aspect)) / Math.tan(FIELD / 2) + 0.5 * Math.hypot(...half);
    this.changed();
  }

  /** Unit vectors: towards the viewer, to the right, and up in the picture. */
  axes() {
    const [c, s] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [ce, se] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    return { back: [c * ce, s * ce, se], right: [-s, c, 0], up: [-c * se, -s * se, ce] };
  }

  get position() {
    const { back } = this.axes();
    return this.target.map((x, i) => x + this.distance * back[i]);
  }

  /** Column by column: from the world to clip space. */
  matrix(aspect) {
    const { back, right, up } = this.axes();
    const eye = this.position;
    const f = 1 / Math.tan(FIELD / 2);
    const [near, far] = [0.02 * this.distance, 40 * this.distance];
    const dot = (a) => -a.reduce((sum, x, i) => sum + x * eye[i], 0);
    const rows = [
      [...right.map((x) => (x * f) / aspect), (dot(right) * f) / aspect],
      [...up.map((x) => x * f), dot(up) * f],
      [...back, dot(back)].map((x) => (x * (far + near)) / (near - far)),
      [...back.map((x) => -x), -dot(back)],
    ];
    rows[2][3] += (2 * far * near) / (near - far);
    const columns = new Float32Array(16);
    rows.forEach((row, i) => row.forEach((x, j) => (columns[4 * j + i] = x)));
    return columns;
  }

  turn(dx, dy) {
    this.azimuth -= dx;
    this.elevation = Math.min(Math.max(this.elevation + dy, -HIGHEST), HIGHEST);
    this.changed();
  }

  push(dx, dy) {
    const { right, up } = this.axes();
    const scale = (2 * this.distance * Math.tan(FIELD / 2)) / this.canvas.clientHeight;
    this.target = this.target.map((x, i) => x + scale * (dy * up[i] - dx * right[i]));
    this.changed();
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.5), 1e5);
    this.changed();
  }

  listen() {
    const { canvas, fingers } = this;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, event);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => fingers.delete(e.pointerId));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.rolled(event), { passive: false });
  }

  moved(event) {
    const last = this.fingers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last.clientX, event.clientY - last.clientY];
    const others = [...this.fingers.values()].filter((finger) => finger.pointerId !== event.pointerId);
    this.fingers.set(event.pointerId, event);
    if (others.length) {
      const gap = (finger) => Math.hypot(finger.clientX - others[0].clientX, finger.clientY - others[0].clientY);
      this.zoom(gap(last) / Math.max(gap(event), 1));
      this.push(dx / 2, dy / 2);
    } else if (event.buttons === 2 || event.shiftKey) this.push(dx, dy);
    else this.turn(0.008 * dx, 0.008 * dy);
  }

  rolled(event) {
    if (document.activeElement !== this.canvas && !event.ctrlKey) return; // else the page could not be scrolled past it
    event.preventDefault();
    this.zoom(1.0015 ** event.deltaY);
  }
}
