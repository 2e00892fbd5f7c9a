// The match: what is where in a frame, what was done, what was expected.

export const PLAYERS = 22;
export const BALL = 22;
const LARGEST_STEP_M = 4; // a body that is farther away in the next frame was moved there

export const STATE = {
  stand: 0x1, kick: 0x2, kickFault: 0x4, goalie: 0x8, catch: 0x10, catchFault: 0x20, tackle: 0x1000, tackleFault: 0x2000,
  charged: 0x20000, yellow: 0x40000, red: 0x80000,
};

/** One degree in radians. */
export const RADIANS = Math.PI / 180;

const lerp = (a, b, t) => a + (b - a) * t;

/** Return an angle in degrees in [-180, 180). */
export const wrap = (angle) => ((((angle + 180) % 360) + 360) % 360) - 180;

export class Match {
  constructor(head, columns) {
    this.head = head;
    this.columns = columns;
    this.frames = head.frames;
    this.names = [head.left, head.right];
    this.predictions = head.predictions;
    this.events = head.events.map(([frame, kind, side, unum, text]) => ({ frame, kind, side, unum, text }));
    this.fans = head.fans.of;
    this.says = says(head.says);
    const last = this.frames - 1;
    this.lastCycle = this.value("cycle", 0, last);
  }

  has(name) {
    return this.columns.has(name);
  }

  /** The value of a column; NaN where it is not known. */
  value(name, row, frame) {
    const column = this.columns.get(name);
    if (!column) return NaN;
    const raw = column.data[row * this.frames + frame];
    return raw === column.none ? NaN : raw * column.step;
  }

  there(slot, frame) {
    return slot === BALL || (this.value("state", slot, frame) & STATE.stand) !== 0;
  }

  state(slot, frame) {
    return this.value("state", slot, frame);
  }

  /** [x, y] of a player or the ball, between frames too. */
  place(slot, time) {
    const frame = Math.min(Math.floor(time), this.frames - 1);
    const here = this.placeIn(slot, frame);
    const t = time - frame;
    if (t <= 0 || frame + 1 >= this.frames || !this.there(slot, frame + 1)) return here;
    const next = this.placeIn(slot, frame + 1);
    if (Math.hypot(next[0] - here[0], next[1] - here[1]) > LARGEST_STEP_M) return t < 0.5 ? here : next;
    return [lerp(here[0], next[0], t), lerp(here[1], next[1], t)];
  }

  placeIn(slot, frame) {
    return slot === BALL
      ? [this.value("ball_x", 0, frame), this.value("ball_y", 0, frame)]
      : [this.value("x", slot, frame), this.value("y", slot, frame)];
  }

  /** An angle of a player in degrees, between frames too. */
  angle(name, slot, time) {
    const frame = Math.min(Math.floor(time), this.frames - 1);
    const here = this.value(name, slot, frame);
    const t = time - frame;
    if (t <= 0 || frame + 1 >= this.frames) return here;
    return here + wrap(this.value(name, slot, frame + 1) - here) * t;
  }

  /** Metres that a body covered in the cycle after a frame; NaN at the end. */
  speed(slot, frame) {
    if (frame + 1 >= this.frames) return NaN;
    const [x, y] = this.placeIn(slot, frame);
    const [u, v] = this.placeIn(slot, frame + 1);
    return Math.hypot(u - x, v - y);
  }

  cycle(frame) {
    return this.value("cycle", 0, frame);
  }

  stoppage(frame) {
    return this.value("stoppage", 0, frame);
  }

  /** The frame of a cycle, or the nearest before it. */
  frameOf(cycle, stoppage = 0) {
    const { data } = this.columns.get("cycle");
    let low = 0;
    let high = this.frames;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (data[middle] < cycle) low = middle + 1;
      else high = middle;
    }
    if (low >= this.frames || data[low] > cycle) return Math.max(0, low - 1);
    let frame = low;
    while (frame + 1 < this.frames && data[frame + 1] === cycle && this.stoppage(frame) < stoppage) frame++;
    return frame;
  }

  mode(frame) {
    return this.head.playmodes[this.value("playmode", 0, frame)] ?? "unknown mode";
  }

  score(frame) {
    return [this.value("left_score", 0, frame), this.value("right_score", 0, frame)];
  }

  /** [[scored, missed], [scored, missed]] of the shoot-out, or null. */
  penalties(frame) {
    const counts = ["left", "right"].map((side) =>
      ["scored", "missed"].map((what) => this.value(`${side}_penalties_${what}`, 0, frame)));
    return counts.flat().some((count) => count > 0) ? counts : null;
  }

  team(slot) {
    return slot < 11 ? 0 : 1;
  }

  teamName(team) {
    return this.names[team] ?? "nobody";
  }

  label(slot) {
    return `${(slot % 11) + 1} ${this.teamName(this.team(slot))}`;
  }

  /** A field of the player's type now. */
  ofType(name, slot, frame) {
    return this.head.types[name]?.[this.value("type", slot, frame)] ?? NaN;
  }

  /** What a player did in a frame: {word, values, refused}; null where nothing is known. */
  done(slot, frame) {
    const kind = this.value("kind", slot, frame);
    if (!this.has("kind") || Number.isNaN(kind)) return null;
    if (kind === 0) return { word: "none", values: [], refused: false };
    return {
      word: this.head.commands[kind],
      values: [this.value("argument0", slot, frame), this.value("argument1", slot, frame)],
      refused: this.value("refused", slot, frame) === 1,
    };
  }

  /** What the clone expected: {commands: [{word, p, values}], likeliest, answered, loss}; null where it did not. */
  expected(slot, frame) {
    if (!this.predictions) return null;
    const words = this.predictions.commands;
    if (Number.isNaN(this.value(`p_${words[0]}`, slot, frame))) return null;
    const commands = words.map((word) => ({
      word,
      p: this.value(`p_${word}`, slot, frame),
      values: this.predictions.parameters
        .filter((parameter) => parameter.command === word)
        .map((parameter) => ({
          ...parameter,
          value: this.value(parameter.name, slot, frame),
          spread: this.value(`${parameter.name}_spread`, slot, frame),
        })),
    }));
    const likeliest = commands.reduce((best, one) => (one.p > best.p ? one : best));
    const answered = this.value("answered", slot, frame);
    return {
      commands,
      likeliest,
      answered: Number.isNaN(answered) ? null : commands[answered],
      loss: this.value("loss", slot, frame),
    };
  }

  /** Whether the clone named another command than the one given. */
  wrong(slot, frame) {
    const answered = this.value("answered", slot, frame);
    if (Number.isNaN(answered)) return false;
    const p = this.predictions.commands.map((word) => this.value(`p_${word}`, slot, frame));
    return p.indexOf(Math.max(...p)) !== answered;
  }

  /** Predicted slots: those of the predicted teams. */
  predicted(slot) {
    return this.predictions?.of.includes(slot < 11 ? "left" : "right") ?? false;
  }

  /** Log loss by frame, of a player, or the mean of a team's players; NaN where nothing was predicted or known. */
  losses(slots) {
    const made = new Float32Array(this.frames).fill(NaN);
    const column = this.columns.get("loss");
    if (!column) return made;
    const count = new Uint8Array(this.frames);
    for (const slot of slots)
      for (let frame = 0, i = slot * this.frames; frame < this.frames; frame++, i++)
        if (column.data[i] !== column.none) {
          made[frame] = (count[frame]++ ? made[frame] : 0) + column.data[i] * column.step;
        }
    for (let frame = 0; frame < this.frames; frame++) made[frame] /= count[frame] || 1;
    return made;
  }

  /** x of the line behind which players of a team are offside, NaN without an opponent. */
  offside(team, time) {
    const frame = Math.floor(time);
    const sign = team === 0 ? 1 : -1;
    const first = team === 0 ? 11 : 0;
    const depths = [];
    for (let slot = first; slot < first + 11; slot++)
      if (this.there(slot, frame)) depths.push(sign * this.place(slot, time)[0]);
    if (depths.length < 2) return NaN;
    depths.sort((a, b) => b - a);
    return sign * Math.max(depths[1], sign * this.place(BALL, time)[0], 0);
  }

  /** What a player said last, no more than some cycles ago; null for nothing. */
  said(slot, frame, within = 10) {
    const of = this.says.bySlot[slot];
    let low = 0;
    let high = of.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (of[middle].frame <= frame) low = middle + 1;
      else high = middle;
    }
    const last = of[low - 1];
    return last && frame - last.frame <= within ? last : null;
  }
}

function says([steps, slots, texts]) {
  const all = [];
  const bySlot = Array.from({ length: PLAYERS }, () => []);
  let frame = 0;
  for (let i = 0; i < steps.length; i++) {
    frame += steps[i];
    const one = { frame, slot: slots[i], text: texts[i] };
    all.push(one);
    bySlot[one.slot].push(one);
  }
  return { all, bySlot };
}

/** The most surprising frames of a series, in their order: peaks with nothing higher nearby. */
export function peaks(series, { apart = 8, most = 60, least = 0.5 } = {}) {
  const order = [...series.keys()].filter((frame) => series[frame] >= least).sort((a, b) => series[b] - series[a]);
  const taken = new Uint8Array(series.length);
  const chosen = [];
  for (const frame of order) {
    if (chosen.length >= most) break;
    if (taken[frame]) continue;
    chosen.push(frame);
    taken.fill(1, Math.max(0, frame - apart), frame + apart + 1);
  }
  return chosen.sort((a, b) => a - b);
}
