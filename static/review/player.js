/** Where in the trial we are, and the clock that moves us on. */

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

/**
 * Events: `moved` (the step changed), `played` (playing or not, or at what speed).
 */
export class Player extends EventTarget {
  constructor() {
    super();
    this.steps = 0;
    this.dt = 0.01;
    this.startStep = 0;
    this.position = 0;
    this.playing = false;
    this.speed = 1;
    this.last = 0;
  }

  /** @param {{n_steps: number, control_dt_s: number, start_step: number}} meta */
  load(meta) {
    this.pause();
    this.steps = meta.n_steps;
    this.dt = meta.control_dt_s;
    this.startStep = meta.start_step;
    this.position = 0;
  }

  get step() {
    return Math.max(0, Math.min(this.steps - 1, Math.round(this.position)));
  }

  get seconds() {
    return this.secondsOf(this.step);
  }

  /** Time of a step since the start signal [s]. */
  secondsOf(step) {
    return (step - this.startStep) * this.dt;
  }

  stepOf(seconds) {
    return Math.round(seconds / this.dt) + this.startStep;
  }

  /** @param {number} step clamped to the trial */
  seek(step) {
    const before = this.step;
    this.position = Math.max(0, Math.min(this.steps - 1, step));
    if (this.step !== before || !this.playing) this.dispatchEvent(new Event("moved"));
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (!this.steps) return;
    if (this.step >= this.steps - 1) this.seek(0);
    this.playing = true;
    this.last = performance.now();
    this.dispatchEvent(new Event("played"));
    requestAnimationFrame((now) => this.#tick(now));
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.dispatchEvent(new Event("played"));
  }

  setSpeed(speed) {
    this.speed = speed;
    this.dispatchEvent(new Event("played"));
  }

  #tick(now) {
    if (!this.playing) return;
    // A tab that slept goes on where it was, it does not jump.
    const passed = Math.min(0.25, Math.max(0, (now - this.last) / 1000));
    this.last = now;
    this.seek(this.position + (passed * this.speed) / this.dt);
    if (this.step >= this.steps - 1) this.pause();
    else requestAnimationFrame((next) => this.#tick(next));
  }
}
