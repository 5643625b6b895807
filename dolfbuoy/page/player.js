// Playing a source of states: time, speed, slider, keys and views; who else follows the time is told of it.

import { byId, element, format } from "./core.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];

/** Drives a Viewer, or none where there is no WebGL.
 *
 * source: at(t), start, end.  heard: functions of t.  times: instants for steps by one.  loop: go on from the start.
 */
export class Player {
  constructor(viewer, source, times, loop = false) {
    Object.assign(this, { viewer, source, times, loop, heard: [], playing: false, speed: 1, t: source.start });
    this.slider = byId("time");
    this.slider.min = source.start;
    this.slider.max = source.end;
    this.slider.addEventListener("input", () => this.go(Number(this.slider.value)));
    byId("play").addEventListener("click", () => this.toggle());
    this.makeSpeeds();
    this.listenToViews();
    this.markView();
    document.addEventListener("keydown", (event) => this.key(event));
  }

  makeSpeeds() {
    const select = byId("speed");
    for (const speed of SPEEDS) select.append(element("option", { value: speed, selected: speed === 1 }, `${format(speed)} ×`));
    select.addEventListener("change", () => (this.speed = Number(select.value)));
  }

  listenToViews() {
    for (const button of document.querySelectorAll("[data-look]"))
      button.addEventListener("click", () => this.look(button.dataset.look));
    for (const box of document.querySelectorAll("[data-show]"))
      box.addEventListener("change", () => {
        if (!this.viewer) return;
        this.viewer.shown[box.dataset.show] = box.checked;
        this.viewer.redraw();
      });
  }

  look(name) {
    this.viewer?.look(name);
    this.markView();
  }

  markView() {
    for (const button of document.querySelectorAll("[data-look]"))
      button.setAttribute("aria-pressed", button.dataset.look === this.viewer?.looking);
  }

  /** Another source, from its start. */
  change(source) {
    Object.assign(this, { source });
    this.slider.min = source.start;
    this.slider.max = source.end;
    this.go(source.start);
  }

  toggle() {
    this.playing = !this.playing;
    byId("play").textContent = this.playing ? "Pause" : "Play";
    if (!this.playing) return;
    if (this.t >= this.source.end) this.t = this.source.start;
    this.last = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    let t = this.t + this.speed * Math.min(Math.max(now - this.last, 0) / 1000, 0.25);
    this.last = now;
    if (t >= this.source.end) {
      if (this.loop) t = this.source.start + ((t - this.source.start) % (this.source.end - this.source.start));
      else {
        t = this.source.end;
        this.toggle();
      }
    }
    this.go(t);
    if (this.playing) requestAnimationFrame((then) => this.tick(then));
  }

  /** Show the time t. */
  go(t) {
    this.t = Math.min(Math.max(t, this.source.start), this.source.end);
    this.slider.value = this.t;
    const text = `t = ${this.t.toFixed(2)} s`;
    this.slider.setAttribute("aria-valuetext", text);
    byId("clock").textContent = text;
    this.state = this.source.at(this.t);
    this.viewer?.show(this.state);
    for (const tell of this.heard) tell(this.t, this.state);
  }

  /** To the next of the instants, forwards or backwards. */
  step(way) {
    const { times, t } = this;
    const least = 1e-9 * (this.source.end - this.source.start);
    const next = way > 0 ? times.find((x) => x > t + least) : times.findLast((x) => x < t - least);
    if (next !== undefined) this.go(next);
  }

  key(event) {
    const inField = event.target.closest("select, textarea, pre, summary");
    if (inField || event.ctrlKey || event.metaKey || event.altKey) return;
    const onSlider = event.target === this.slider;
    const onButton = event.target.closest("button, input[type=checkbox]");
    const does = this.globalKeys()[event.key] ?? (event.target === this.viewer?.canvas ? this.canvasKeys()[event.key] : null);
    if (!does || (onButton && event.key === " ") || (onSlider && ["Home", "End"].includes(event.key))) return;
    event.preventDefault();
    does();
  }

  globalKeys() {
    const looks = ["whole", "buoy", "side", "above"];
    const keys = Object.fromEntries(looks.map((name, i) => [String(i + 1), () => this.look(name)]));
    return {
      ...keys,
      " ": () => this.toggle(),
      ",": () => this.step(-1),
      ".": () => this.step(1),
      f: () => this.followNext(),
      Home: () => this.go(this.source.start),
      End: () => this.go(this.source.end),
    };
  }

  canvasKeys() {
    const { camera } = this.viewer;
    return {
      ArrowLeft: () => camera.turn(0.1, 0),
      ArrowRight: () => camera.turn(-0.1, 0),
      ArrowUp: () => camera.turn(0, 0.1),
      ArrowDown: () => camera.turn(0, -0.1),
      "+": () => camera.zoom(0.85),
      "=": () => camera.zoom(0.85),
      "-": () => camera.zoom(1 / 0.85),
    };
  }

  followNext() {
    const count = this.viewer?.view.buoys.length;
    if (!count) return;
    this.viewer.follow = (this.viewer.follow + 1) % count;
    this.look("buoy");
  }
}
