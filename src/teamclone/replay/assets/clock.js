// Time: which frame is shown, and how it goes on.

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const FRAMES_A_SECOND = 10;

export class Clock {
  constructor(frames) {
    this.last = frames - 1;
    this.now = 0;
    this.speed = 1;
    this.direction = 1;
    this.playing = false;
    this.onChange = () => {};
  }

  /** The frame at which the picture is, or which it just left. */
  get frame() {
    return Math.min(this.last, Math.floor(this.now + 1e-6));
  }

  /** Go on by milliseconds of real time. */
  advance(milliseconds) {
    if (!this.playing) return;
    const to = this.now + (this.direction * this.speed * FRAMES_A_SECOND * milliseconds) / 1000;
    this.now = Math.max(0, Math.min(this.last, to));
    if (to < 0 || to > this.last) this.pause();
  }

  seek(frame) {
    this.now = Math.max(0, Math.min(this.last, frame));
    this.onChange();
  }

  /** Stop and go by whole frames. */
  step(by) {
    this.playing = false;
    this.seek((by < 0 ? Math.ceil(this.now - 1e-6) : this.frame) + by);
  }

  play(direction = 1) {
    this.direction = direction;
    if (direction > 0 && this.now >= this.last) this.now = 0;
    this.playing = true;
    this.onChange();
  }

  pause() {
    this.playing = false;
    this.onChange();
  }

  toggle(direction = 1) {
    if (this.playing && this.direction === direction) this.pause();
    else this.play(direction);
  }

  faster(by) {
    const at = SPEEDS.reduce((best, speed, i) =>
      Math.abs(speed - this.speed) < Math.abs(SPEEDS[best] - this.speed) ? i : best, 0);
    this.setSpeed(SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at + by))]);
  }

  setSpeed(speed) {
    this.speed = Math.max(SPEEDS[0], Math.min(SPEEDS.at(-1), speed));
    this.onChange();
  }
}
