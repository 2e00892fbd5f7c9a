// Which part of the pitch is seen: zoom, position, what is followed; and the pointers that change it.

import { BALL } from "./match.js";

export const HALF_LENGTH = 52.5;
export const HALF_WIDTH = 34;
const MARGIN_X = 3.8;
const MARGIN_Y = 3.2;
const MOST_ZOOM = 16;
const CLOSE = 3; // zoom when following begins

export class Camera {
  constructor() {
    this.zoom = 1;
    this.x = 0;
    this.y = 0;
    this.follow = "none"; // none, ball, player
    this.width = this.height = 1;
  }

  /** Pixels a metre. */
  get scale() {
    const whole = Math.min(this.width / (2 * (HALF_LENGTH + MARGIN_X)), this.height / (2 * (HALF_WIDTH + MARGIN_Y)));
    return whole * this.zoom;
  }

  resize(width, height) {
    this.width = width;
    this.height = height;
    this.clamp();
  }

  toPixels([x, y]) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 + (y - this.y) * this.scale];
  }

  toMetres([px, py]) {
    return [this.x + (px - this.width / 2) / this.scale, this.y + (py - this.height / 2) / this.scale];
  }

  clamp() {
    const reach = (half, margin, size) => Math.max(0, half + margin - size / 2 / this.scale);
    const x = reach(HALF_LENGTH, MARGIN_X, this.width);
    const y = reach(HALF_WIDTH, MARGIN_Y, this.height);
    this.x = Math.max(-x, Math.min(x, this.x));
    this.y = Math.max(-y, Math.min(y, this.y));
  }

  /** Zoom by a factor, keeping what is under a pixel where it is. */
  zoomBy(factor, pixel = [this.width / 2, this.height / 2]) {
    const before = this.toMetres(pixel);
    this.zoom = Math.max(1, Math.min(MOST_ZOOM, this.zoom * factor));
    const after = this.toMetres(pixel);
    this.x += before[0] - after[0];
    this.y += before[1] - after[1];
    this.clamp();
  }

  panBy(dx, dy) {
    this.x -= dx / this.scale;
    this.y -= dy / this.scale;
    this.clamp();
  }

  setFollow(what) {
    this.follow = what;
    if (what === "none") this.reset();
    else if (this.zoom < CLOSE) this.zoom = CLOSE;
  }

  reset() {
    this.follow = "none";
    this.zoom = 1;
    this.x = this.y = 0;
  }

  /** Move towards what is followed; `share` of the way, 1 at once. */
  track(match, time, chosen, share) {
    const target = this.follow === "ball" ? BALL : this.follow === "player" ? chosen : null;
    if (target === null || !match.there(target, Math.floor(time))) return;
    const [x, y] = match.place(target, time);
    this.x += (x - this.x) * share;
    this.y += (y - this.y) * share;
    this.clamp();
  }
}

/** Let pointers on a canvas choose, drag and pinch. `onTap` gets metres and the pixels of a metre. */
export function watchPointers(canvas, camera, { onTap, onMove }) {
  const down = new Map();
  let moved = 0;
  const at = (event) => [event.offsetX, event.offsetY];
  const spread = () => {
    const [a, b] = [...down.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  canvas.addEventListener("pointerdown", (event) => {
    down.set(event.pointerId, at(event));
    canvas.setPointerCapture(event.pointerId);
    if (down.size === 1) moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = down.get(event.pointerId);
    if (!before) return;
    const now = at(event);
    if (down.size === 2) {
      const wide = spread();
      down.set(event.pointerId, now);
      const [a, b] = [...down.values()];
      camera.zoomBy(spread() / Math.max(wide, 1), [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]);
      moved = 99;
    } else {
      moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
      down.set(event.pointerId, now);
      if (moved > 4 && camera.zoom > 1) {
        camera.follow = "none";
        camera.panBy(now[0] - before[0], now[1] - before[1]);
      }
    }
    onMove();
  });
  const up = (event) => {
    if (down.delete(event.pointerId) && event.type === "pointerup" && moved <= 4) onTap(camera.toMetres(at(event)), camera.scale);
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoomBy(Math.exp(-event.deltaY / 400), at(event));
    onMove();
  }, { passive: false });
}
