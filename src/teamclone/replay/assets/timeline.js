// The two graphs under the pitch: the whole match, and the cycles around this one. Dragging on them scrubs.

import { colours, fitted, FONT } from "./theme.js";

const BESIDE = 75; // frames to each side of the middle of the detail
const LEAST_TOP = 0.25; // nats at the top of the graphs, at least
const CUT_OFF = 0.005; // share of the cycles whose loss is beyond the top
const RIBBON = 10; // pixels of a row of commands
const CELL = { dash: 0.5, turn: 0.75 }; // share of the row that a command fills, so that colour is not all; others all
const MARKED = new Set(["goal", "shot", "card", "set play", "interception", "foul", "offside"]);

/** What the graphs show: one or two series of log loss, or the ball's x where there is no prediction. */
export function seriesOf(match, chosen) {
  const range = (first) => Array.from({ length: 11 }, (_, i) => first + i);
  if (chosen !== null && match.predicted(chosen)) {
    const values = match.losses([chosen]);
    return { title: `surprise at ${match.label(chosen)}, nats`, of: [{ values, colour: edge(chosen < 11 ? 0 : 1) }], top: topOf([values]), slots: [chosen] };
  }
  const teams = [0, 1].filter((team) => match.predicted(11 * team));
  if (teams.length) {
    const of = teams.map((team) => ({ values: match.losses(range(11 * team)), colour: edge(team) }));
    const names = teams.map((team) => match.teamName(team)).join(" (up) and ") + (teams.length > 1 ? " (down)" : "");
    return { title: `surprise at ${names}, nats a player`, of, top: topOf(of.map((one) => one.values)), slots: teams.flatMap((team) => range(11 * team)) };
  }
  const values = new Float32Array(match.frames);
  for (let frame = 0; frame < match.frames; frame++) values[frame] = match.value("ball_x", 0, frame) / 52.5;
  return { title: `where the ball is: up towards the right goal`, of: [{ values, colour: edge(0) }], ball: true, top: 1, slots: [] };
}

/** The loss at the top of the graphs: few are greater. */
function topOf(all) {
  const known = all.flatMap((values) => [...values.filter((value) => !Number.isNaN(value))]).sort((a, b) => a - b);
  return Math.max(LEAST_TOP, known[Math.floor((1 - CUT_OFF) * (known.length - 1))] ?? 0);
}

const edge = (team) => (team === 0 ? "left-edge" : "right-edge");

export class Overview {
  constructor(canvas, match) {
    this.canvas = canvas;
    this.match = match;
    this.picture = null;
  }

  frameAt(x) {
    return Math.round((x / this.canvas.clientWidth) * (this.match.frames - 1));
  }

  /** Forget the picture after a change of series, events, colours or size. */
  change(series, events, peaks) {
    Object.assign(this, { series, events, peaks, picture: null });
  }

  draw(time) {
    const [context, width, height] = fitted(this.canvas);
    if (!this.picture || this.picture.width !== this.canvas.width || this.picture.height !== this.canvas.height) this.paint(width, height);
    context.clearRect(0, 0, width, height);
    context.drawImage(this.picture, 0, 0, width, height);
    const x = (time / Math.max(1, this.match.frames - 1)) * width;
    const half = (BESIDE / this.match.frames) * width;
    context.globalAlpha = 0.12;
    context.fillStyle = colours.ink;
    context.fillRect(x - half, 0, 2 * half, height);
    context.globalAlpha = 1;
    context.fillRect(x - 1, 0, 2, height);
  }

  paint(width, height) {
    this.picture = document.createElement("canvas");
    this.picture.width = this.canvas.width;
    this.picture.height = this.canvas.height;
    const context = this.picture.getContext("2d");
    context.scale(this.canvas.width / width, this.canvas.height / height);
    const { of, ball } = this.series;
    const top = 14;
    const two = of.length === 2 || ball;
    const base = two ? top + (height - top) / 2 : height - 1;
    const tall = two ? (height - top) / 2 - 1 : height - top - 2;
    of.forEach(({ values, colour }, index) => {
      const up = index === 0 ? 1 : -1;
      for (let x = 0; x < width; x++) {
        const [mean, most] = binned(values, Math.floor((x / width) * values.length), Math.ceil(((x + 1) / width) * values.length), ball);
        if (Number.isNaN(mean)) continue;
        const bar = (value) => up * tall * Math.max(-1, Math.min(1, value / this.series.top));
        context.fillStyle = colours[ball && mean < 0 ? "right-edge" : colour];
        context.globalAlpha = 0.3;
        context.fillRect(x, base, 1, -bar(most));
        context.globalAlpha = 0.9;
        context.fillRect(x, base, 1, -bar(mean));
      }
    });
    context.globalAlpha = 1;
    context.fillStyle = colours.rule;
    if (two) context.fillRect(0, base, width, 1);
    for (const event of this.events) if (MARKED.has(event.kind)) this.markEvent(context, event, width, height);
  }

  markEvent(context, event, width, height) {
    const x = (event.frame / Math.max(1, this.match.frames - 1)) * width;
    context.fillStyle = event.side ? colours[event.side > 0 ? "left-edge" : "right-edge"] : colours.muted;
    if (event.kind === "goal") {
      context.globalAlpha = 0.35;
      context.fillRect(x - 0.5, 0, 1, height);
      context.globalAlpha = 1;
      context.beginPath();
      context.arc(x, 6, 4.5, 0, 2 * Math.PI);
      context.fill();
    } else if (event.kind === "shot") {
      context.beginPath();
      context.moveTo(x - 3, 10);
      context.lineTo(x, 3);
      context.lineTo(x + 3, 10);
      context.fill();
    } else if (event.kind !== "interception") {
      context.globalAlpha = 0.75;
      context.fillRect(x - 0.5, 3, 1, 6);
      context.globalAlpha = 1;
    }
  }
}

/** Mean and greatest of the values known between two frames. */
function binned(values, from, to, signed) {
  let sum = 0;
  let count = 0;
  let most = 0;
  for (let i = from; i < Math.max(to, from + 1) && i < values.length; i++)
    if (!Number.isNaN(values[i])) {
      sum += values[i];
      count++;
      if (signed ? Math.abs(values[i]) > Math.abs(most) : values[i] > most) most = values[i];
    }
  return count ? [sum / count, most] : [NaN, NaN];
}

export class Detail {
  constructor(canvas, match) {
    this.canvas = canvas;
    this.match = match;
  }

  change(series, events, peaks) {
    Object.assign(this, { series, events, peaks: new Set(peaks) });
  }

  pixels() {
    return this.canvas.clientWidth / (2 * BESIDE);
  }

  draw(time, view) {
    const { match, series } = this;
    const [context, width, height] = fitted(this.canvas);
    context.clearRect(0, 0, width, height);
    const step = width / (2 * BESIDE);
    const x = (frame) => width / 2 + (frame - time) * step;
    const first = Math.max(0, Math.floor(time - BESIDE));
    const last = Math.min(match.frames - 1, Math.ceil(time + BESIDE));
    const ribbons = view.chosen !== null && (match.has("kind") || match.predictions);
    const top = 16;
    const bottom = height - 14 - (ribbons ? 2 * RIBBON + 4 : 0);
    this.axis(context, first, last, x, height);
    this.bars(context, { first, last, x, step, top, bottom });
    if (ribbons) this.ribbons(context, view.chosen, { first, last, x, step, y: bottom + 3 });
    context.font = `11px ${FONT}`;
    context.textAlign = "left";
    context.textBaseline = "top";
    plate(context, series.title, 5, 2, colours.muted);
    const free = [0, 0]; // where the next word may begin, in two rows
    for (const event of this.events)
      if (event.frame >= first && event.frame <= last && MARKED.has(event.kind)) this.word(context, event, x(event.frame), { top, bottom, free });
    this.dots(context, { first, last, x, step, top });
    context.fillStyle = colours.ink;
    context.fillRect(width / 2 - 1, 0, 2, height);
  }

  bars(context, { first, last, x, step, top, bottom }) {
    const { of, ball } = this.series;
    const two = of.length === 2 || ball;
    const base = two ? (top + bottom) / 2 : bottom;
    const tall = two ? (bottom - top) / 2 : bottom - top;
    of.forEach(({ values, colour }, index) => {
      for (let frame = first; frame <= last; frame++) {
        const value = values[frame];
        if (Number.isNaN(value)) continue;
        const length = (index === 0 ? 1 : -1) * tall * Math.max(-1, Math.min(1, value / this.series.top));
        context.fillStyle = colours[ball && value < 0 ? "right-edge" : colour];
        context.globalAlpha = frame === Math.floor(this.now) ? 1 : 0.75;
        context.fillRect(x(frame), base, Math.max(1, step - 1), -(Math.abs(length) < 1 ? Math.sign(length || 1) : length));
      }
    });
    context.globalAlpha = 1;
    context.fillStyle = colours.rule;
    context.fillRect(0, base, this.canvas.clientWidth, 1);
  }

  /** Dots above the surprises that the keys go to. */
  dots(context, { first, last, x, step, top }) {
    context.fillStyle = colours.model;
    for (let frame = first; frame <= last; frame++)
      if (this.peaks.has(frame)) {
        context.beginPath();
        context.arc(x(frame) + step / 2, top + 2, 3.2, 0, 2 * Math.PI);
        context.fill();
      }
  }

  /** Two rows of a player's commands: what the clone expected, and what was done. */
  ribbons(context, slot, { first, last, x, step, y }) {
    const { match } = this;
    for (let frame = first; frame <= last; frame++) {
      const expected = match.expected(slot, frame);
      const done = match.done(slot, frame);
      if (expected) this.cell(context, expected.likeliest.word, x(frame), y, step, 0.35 + 0.65 * expected.likeliest.p);
      if (done) this.cell(context, done.word, x(frame), y + RIBBON + 1, step, 1);
    }
    context.font = `10px ${FONT}`;
    context.textBaseline = "middle";
    context.textAlign = "left";
    if (match.predicted(slot)) plate(context, "clone", 5, y + RIBBON / 2, colours.model);
    plate(context, "did", 5, y + RIBBON * 1.5 + 1, colours.ink);
  }

  cell(context, word, x, y, step, alpha) {
    if (word === "none") return;
    context.globalAlpha = alpha;
    context.fillStyle = colours[word] ?? colours.muted;
    const height = RIBBON * (CELL[word] ?? 1);
    context.fillRect(x, y + RIBBON - height, Math.max(1, step - 0.7), height);
    context.globalAlpha = 1;
  }

  axis(context, first, last, x, height) {
    context.font = `11px ${FONT}`;
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    for (let frame = first; frame <= last; frame++) {
      const cycle = this.match.cycle(frame);
      if (cycle % 25 || this.match.stoppage(frame)) continue;
      context.fillStyle = colours.rule;
      context.fillRect(x(frame), 0, 1, height - 13);
      context.fillStyle = colours.muted;
      context.fillText(String(cycle), x(frame), height - 3);
    }
  }

  word(context, event, x, { top, bottom, free }) {
    context.fillStyle = event.side ? colours[event.side > 0 ? "left-edge" : "right-edge"] : colours.muted;
    context.fillRect(x - 0.75, top, 1.5, bottom - top);
    if (event.kind === "interception" || event.kind === "set play" || event.kind === "foul" || event.kind === "offside") return;
    context.font = `600 11px ${FONT}`;
    context.textAlign = "left";
    context.textBaseline = "top";
    const text = event.unum ? `${event.kind} ${event.unum}` : event.kind;
    const row = free.findIndex((from) => from <= x);
    if (row < 0) return;
    free[row] = x + context.measureText(text).width + 9;
    plate(context, text, x + 4, top + 2 + 14 * row, context.fillStyle);
  }
}

function plate(context, text, x, y, colour) {
  const width = context.measureText(text).width;
  const middle = context.textBaseline === "middle";
  context.fillStyle = colours.panel;
  context.globalAlpha = 0.85;
  context.fillRect(x - 2, middle ? y - 6 : y - 1, width + 4, 13);
  context.globalAlpha = 1;
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

/** Let a pointer on a graph scrub. `frameAt` gives the frame under a pixel; `relative` drags the graph itself. */
export function watchScrubbing(canvas, { onFrame, relative = null }) {
  let last = null;
  let moved = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    last = event.offsetX;
    moved = 0;
    if (!relative) onFrame(event.offsetX, false);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (last === null) return;
    const by = event.offsetX - last;
    moved += Math.abs(by);
    if (relative) relative(by);
    else onFrame(event.offsetX, false);
    last = event.offsetX;
  });
  const up = (event) => {
    if (last !== null && relative && moved < 4 && event.type === "pointerup") onFrame(event.offsetX, true);
    last = null;
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
}
