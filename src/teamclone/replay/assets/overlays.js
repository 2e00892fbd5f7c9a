// What lies over or under the players: trail, offside lines, view, predicted and actual commands, fans of futures.

import { BALL, PLAYERS, RADIANS } from "./match.js";
import { colours, FONT } from "./theme.js";
import { HALF_WIDTH } from "./camera.js";
import { discRadius, ray } from "./pitch.js";

const TRAIL = 25; // frames
const FAN_STAYS = 15; // frames after its last point

export function drawUnder(context, camera, match, time, view) {
  if (view.show.offside) for (const team of [0, 1]) drawOffside(context, camera, match, team, time);
  if (view.show.trail) drawTrail(context, camera, match, time);
  if (view.show.cones === true || view.chosen !== null)
    for (let slot = 0; slot < PLAYERS; slot++)
      if (view.show.cones || slot === view.chosen) drawCone(context, camera, match, slot, time);
  if (view.show.fans) for (const fan of match.fans) drawFan(context, camera, match, fan, time);
}

export function drawOver(context, camera, match, time, view) {
  const frame = Math.min(Math.floor(time), match.frames - 1);
  if (view.show.all) {
    for (let slot = 0; slot < PLAYERS; slot++)
      if (slot !== view.chosen && match.there(slot, frame)) drawCommands(context, camera, match, slot, time, false);
  }
  if (view.chosen !== null && view.show.arrows && match.there(view.chosen, frame)) drawCommands(context, camera, match, view.chosen, time, true);
}

function drawOffside(context, camera, match, team, time) {
  const x = match.offside(team, time);
  if (Number.isNaN(x)) return;
  const [px, top] = camera.toPixels([x, -HALF_WIDTH]);
  const [, bottom] = camera.toPixels([x, HALF_WIDTH]);
  context.beginPath();
  context.moveTo(px, top);
  context.lineTo(px, bottom);
  context.setLineDash([6, 5]);
  context.lineWidth = 1.2;
  context.globalAlpha = 0.7;
  context.strokeStyle = colours[team === 0 ? "left-edge" : "right-edge"];
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
}

function drawTrail(context, camera, match, time) {
  const frame = Math.floor(time);
  let [x, y] = camera.toPixels(match.place(BALL, time));
  for (let back = 0; back < TRAIL && frame - back >= 0; back++) {
    const there = match.placeIn(BALL, frame - back);
    const [u, v] = camera.toPixels(there);
    if (Math.hypot(u - x, v - y) > 4 * camera.scale) break;
    const alpha = 0.75 * (1 - back / TRAIL);
    context.globalAlpha = alpha;
    context.strokeStyle = context.fillStyle = colours.ink;
    context.lineWidth = 1.4;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(u, v);
    context.stroke();
    context.beginPath();
    context.arc(u, v, 1.6, 0, 2 * Math.PI);
    context.fill();
    [x, y] = [u, v];
  }
  context.globalAlpha = 1;
}

function drawCone(context, camera, match, slot, time) {
  const frame = Math.floor(time);
  const width = match.value("view_width", slot, frame);
  const neck = match.angle("neck", slot, time);
  if (Number.isNaN(width) || Number.isNaN(neck) || !match.there(slot, frame)) return;
  const [x, y] = camera.toPixels(match.place(slot, time));
  const middle = (match.angle("body", slot, time) + neck) * RADIANS;
  context.beginPath();
  context.moveTo(x, y);
  context.arc(x, y, 40 * camera.scale, middle - (width / 2) * RADIANS, middle + (width / 2) * RADIANS);
  context.closePath();
  context.fillStyle = colours[slot < 11 ? "left-edge" : "right-edge"];
  context.globalAlpha = 0.07;
  context.fill();
  context.globalAlpha = 1;
  const point = [match.value("pointto_x", slot, frame), match.value("pointto_y", slot, frame)];
  if (!point.some(Number.isNaN)) dashed(context, [x, y], camera.toPixels(point), colours.muted);
}

function dashed(context, from, to, colour) {
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.setLineDash([2, 4]);
  context.strokeStyle = colour;
  context.lineWidth = 1.2;
  context.stroke();
  context.setLineDash([]);
}

// Commands as arrows: that of the clone dashed with the spread as a wedge, that of the player solid.

const LENGTH_M = { dash: 5, kick: 8, tackle: 6, catch: 3, turn: 3.2 };

function drawCommands(context, camera, match, slot, time, whole) {
  const frame = Math.min(Math.floor(time), match.frames - 1);
  const expected = match.expected(slot, frame);
  const done = match.done(slot, frame);
  if (expected) drawExpected(context, camera, match, slot, time, expected.likeliest, whole);
  if (done) {
    const [first, second] = done.values;
    drawCommand(context, camera, match, slot, time, { word: done.word, first, second, colour: colours.ink, solid: true });
  }
}

function drawExpected(context, camera, match, slot, time, { word, values, p }, whole) {
  const number = (argument) => values.find((one) => one.argument === argument);
  drawCommand(context, camera, match, slot, time, {
    word,
    first: number(0)?.value,
    second: number(1)?.value,
    spread: values.find((one) => one.angle)?.spread,
    colour: colours.model,
    solid: false,
    label: whole ? `${word} ${Math.round(100 * p)} %` : "",
  });
}

/** Draw one command; `first` and `second` are its numbers. */
function drawCommand(context, camera, match, slot, time, { word, first, second, spread, colour, solid, label = "" }) {
  const length = LENGTH_M[word];
  const body = match.angle("body", slot, time);
  const from = camera.toPixels(match.place(word === "kick" || word === "tackle" ? BALL : slot, time));
  if (word === "move") {
    // A right team's places are turned by the server.
    const sign = slot < 11 ? 1 : -1;
    dashed(context, from, camera.toPixels([sign * first, sign * second]), colour);
    return;
  }
  if (!length || Number.isNaN(first) || first === undefined) return;
  const power = word === "dash" || word === "kick";
  const direction = power ? second : first;
  if (direction === undefined || Number.isNaN(direction)) return;
  const share = power ? Math.min(Math.abs(first) / 100, 1) : 1;
  const pixels = Math.max(length * camera.scale, 34) * Math.max(share, 0.15) + (power ? 0 : discRadius(camera) * 0.4);
  const angle = (body + direction + (first < 0 && power ? 180 : 0)) * RADIANS;
  if (spread > 0) wedge(context, from, angle, pixels * 1.05, Math.min(spread, 180) * RADIANS, colour);
  const radius = discRadius(camera);
  const start = word === "kick" || word === "tackle" ? 0 : radius * 1.1;
  if (word === "turn") sweep(context, from, body * RADIANS, direction * RADIANS, radius * 1.75 + (solid ? 0 : 3), colour);
  arrow(context, from, angle, pixels, colour, { solid, start, width: (word === "turn" ? 1.5 : 2.2) * (solid ? 1 : 2) });
  if (label) tag(context, from, angle, Math.max(start + pixels, radius * 2) + 8, { text: label, colour, size: camera.width < 600 ? 10 : 12 });
}

function wedge(context, [x, y], angle, length, half, colour) {
  context.beginPath();
  context.moveTo(x, y);
  context.arc(x, y, length, angle - half, angle + half);
  context.closePath();
  context.fillStyle = colour;
  context.globalAlpha = 0.22;
  context.fill();
  context.globalAlpha = 1;
}

function arrow(context, [x, y], angle, length, colour, { solid, start, width }) {
  context.setLineDash(solid ? [] : [6, 4]);
  context.globalAlpha = solid ? 1 : 0.8;
  ray(context, x, y, angle, start, start + length - 5, colour, width);
  context.setLineDash([]);
  head(context, x + Math.cos(angle) * (start + length), y + Math.sin(angle) * (start + length), angle, colour, solid ? 1 : 1.5);
  context.globalAlpha = 1;
}

/** The way that a body turns, as an arc. */
function sweep(context, [x, y], body, moment, radius, colour) {
  context.beginPath();
  context.arc(x, y, radius, body, body + moment, moment < 0);
  context.strokeStyle = colour;
  context.lineWidth = 1.6;
  context.stroke();
}

function head(context, x, y, angle, colour, size) {
  const at = (turn, length) => [x + Math.cos(angle + turn) * length, y + Math.sin(angle + turn) * length];
  context.beginPath();
  context.moveTo(...at(0, 4));
  context.lineTo(...at(2.5, 7 * size));
  context.lineTo(...at(-2.5, 7 * size));
  context.closePath();
  context.fillStyle = colour;
  context.fill();
}

/** A word on a plate that keeps it legible above anything, so far away that it covers nothing before. */
function tag(context, [x, y], angle, away, { text, colour, size }) {
  context.font = `600 ${size}px ${FONT}`;
  const width = context.measureText(text).width + 8;
  const middle = x + Math.cos(angle) * (away + width / 2);
  const height = y + Math.sin(angle) * (away + size * 0.75);
  context.globalAlpha = 0.88;
  context.fillStyle = colours.paper;
  context.beginPath();
  context.roundRect(middle - width / 2, height - size * 0.75, width, size * 1.5, 5);
  context.fill();
  context.globalAlpha = 1;
  context.fillStyle = colour;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(text, middle, height + 0.5);
}

function drawFan(context, camera, match, fan, time) {
  const ahead = fan.ahead.at(-1);
  const since = time - fan.frame;
  if (since < -1e-6 || since > ahead + FAN_STAYS) return;
  const step = match.head.fans.step;
  for (const { slot, paths } of fan.bodies) {
    const colour = slot === BALL ? colours.ink : colours[slot < 11 ? "left-edge" : "right-edge"];
    context.strokeStyle = context.fillStyle = colour;
    for (const path of paths) {
      context.globalAlpha = 0.26;
      context.lineWidth = 1;
      context.beginPath();
      for (let i = 0; i < path.length; i += 2) context.lineTo(...camera.toPixels([path[i] * step, path[i + 1] * step]));
      context.stroke();
      const point = camera.toPixels(along(fan.ahead, path, Math.min(since, ahead), step));
      context.globalAlpha = 0.6;
      context.beginPath();
      context.arc(...point, 2, 0, 2 * Math.PI);
      context.fill();
    }
  }
  context.globalAlpha = 1;
}

/** The place of a path so many cycles ahead. */
function along(ahead, path, cycles, step) {
  let i = 0;
  while (i + 2 < ahead.length && ahead[i + 1] <= cycles) i++;
  const t = ahead.length < 2 ? 0 : Math.min(1, (cycles - ahead[i]) / (ahead[i + 1] - ahead[i]));
  const at = (j) => path[2 * i + j] * step + (ahead.length < 2 ? 0 : (path[2 * i + 2 + j] - path[2 * i + j]) * step * t);
  return [at(0), at(1)];
}
