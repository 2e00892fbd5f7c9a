// The picture of a moment: pitch, players, ball.

import { BALL, PLAYERS, RADIANS, STATE } from "./match.js";
import { colours, FONT } from "./theme.js";
import { HALF_LENGTH, HALF_WIDTH } from "./camera.js";

const GOAL = [7.01, 2.44]; // half its width, its depth
const AREAS = [[16.5, 20.16], [5.5, 9.16]]; // depth and half the width of penalty and goal area
const CIRCLE = 9.15;
const SPOT = 11;
const LEAST_RADIUS = [5.2, 8]; // pixels of a player, on a phone and on a desk
const RADIUS_M = 0.85; // of a player as drawn, so that numbers are legible; the body is smaller

/** Pixels of a player's disc. */
export function discRadius(camera) {
  return Math.max(camera.width < 600 ? LEAST_RADIUS[0] : LEAST_RADIUS[1], RADIUS_M * camera.scale);
}

export function drawPitch(context, camera) {
  const { width, height, scale } = camera;
  context.fillStyle = colours.grass;
  context.fillRect(0, 0, width, height);
  const [left, top] = camera.toPixels([-HALF_LENGTH, -HALF_WIDTH]);
  const [right, bottom] = camera.toPixels([HALF_LENGTH, HALF_WIDTH]);
  context.fillStyle = colours.stripe;
  for (let stripe = 0; stripe < 10; stripe += 2)
    context.fillRect(left + ((right - left) * stripe) / 10, top, (right - left) / 10, bottom - top);
  context.strokeStyle = context.fillStyle = colours.line;
  context.lineWidth = Math.max(1.2, scale * 0.1);
  context.strokeRect(left, top, right - left, bottom - top);
  const [centre, middle] = camera.toPixels([0, 0]);
  context.beginPath();
  context.moveTo(centre, top);
  context.lineTo(centre, bottom);
  context.moveTo(centre + CIRCLE * scale, middle);
  context.arc(centre, middle, CIRCLE * scale, 0, 2 * Math.PI);
  context.stroke();
  dot(context, centre, middle, Math.max(2, scale * 0.2));
  for (const side of [-1, 1]) {
    const line = side < 0 ? left : right;
    for (const [depth, half] of AREAS)
      context.strokeRect(line, middle - half * scale, -side * depth * scale, 2 * half * scale);
    dot(context, line - side * SPOT * scale, middle, Math.max(2, scale * 0.2));
    context.strokeRect(line, middle - GOAL[0] * scale, side * GOAL[1] * scale, 2 * GOAL[0] * scale);
    context.globalAlpha = 0.35;
    context.fillRect(line, middle - GOAL[0] * scale, side * GOAL[1] * scale, 2 * GOAL[0] * scale);
    context.globalAlpha = 1;
  }
}

export function drawPlayers(context, camera, match, time, view) {
  const frame = Math.min(Math.floor(time), match.frames - 1);
  const radius = discRadius(camera);
  // The chosen player is drawn last, above the others.
  const order = [...Array(PLAYERS).keys()].filter((slot) => match.there(slot, frame));
  order.sort((a, b) => (a === view.chosen) - (b === view.chosen));
  for (const slot of order) {
    const [x, y] = camera.toPixels(match.place(slot, time));
    if (x < -40 || y < -40 || x > camera.width + 40 || y > camera.height + 40) continue;
    drawPlayer(context, match, slot, time, { x, y, radius, scale: camera.scale, chosen: slot === view.chosen, view });
  }
}

function drawPlayer(context, match, slot, time, { x, y, radius, scale, chosen, view }) {
  const frame = Math.min(Math.floor(time), match.frames - 1);
  const side = slot < 11 ? "left" : "right";
  const edge = colours[`${side}-edge`];
  const state = match.state(slot, frame);
  const next = frame + 1 < match.frames ? match.state(slot, frame + 1) : 0;
  const body = match.angle("body", slot, time) * RADIANS;
  const neck = match.angle("neck", slot, time) * RADIANS;
  const lies = (state & (STATE.tackle | STATE.tackleFault)) !== 0;

  if (chosen || scale > 14) {
    const reach = match.ofType("player_size", slot, frame) + match.ofType("kickable_margin", slot, frame) + match.head.server.ball_size;
    if (reach * scale > radius + 2) ring(context, x, y, reach * scale, edge, { width: 1, alpha: 0.55, dash: [3, 3] });
  }
  if (chosen) ring(context, x, y, radius + 6.5, colours.ink, { width: 2.2 });
  if (!Number.isNaN(neck)) {
    ray(context, x, y, body + neck, radius, radius * 1.95, edge, 1.4);
  }
  nose(context, x, y, body, radius, edge);
  context.beginPath();
  if (state & STATE.goalie) context.roundRect(x - radius, y - radius, 2 * radius, 2 * radius, radius * 0.35);
  else context.arc(x, y, radius, 0, 2 * Math.PI);
  // Who lies after a tackle is hollow.
  context.fillStyle = lies ? colours.paper : colours[side];
  context.fill();
  context.lineWidth = 1.6;
  context.strokeStyle = edge;
  if (state & STATE.charged) context.setLineDash([2.5, 2.5]);
  context.stroke();
  context.setLineDash([]);
  context.fillStyle = lies ? edge : colours[`${side}-ink`];
  context.font = `700 ${Math.round(radius * 1.22)}px ${FONT}`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(String((slot % 11) + 1), x, y + radius * 0.06);
  if (view.show.stamina) drawStamina(context, match, slot, frame, x, y, radius, edge);
  if (next & (STATE.kick | STATE.catch)) ring(context, x, y, radius + 4, colours.ink, { width: 2.4 });
  if (next & (STATE.kickFault | STATE.catchFault)) ring(context, x, y, radius + 4, colours.ink, { width: 2, dash: [3, 3] });
  if (state & (STATE.yellow | STATE.red)) card(context, x + radius * 0.75, y - radius * 1.3, radius, state & STATE.red ? colours.low : colours.yellow);
  if (view.show.wrong && match.wrong(slot, frame)) mark(context, x - radius * 0.95, y - radius * 0.95, radius);
}

function drawStamina(context, match, slot, frame, x, y, radius, edge) {
  const { stamina_max: most, effort_dec_thr: low } = match.head.server;
  const share = match.value("stamina", slot, frame) / most;
  if (Number.isNaN(share) || share > 0.985) return;
  const start = -Math.PI / 2;
  context.beginPath();
  context.arc(x, y, radius + 2.6, start, start + 2 * Math.PI * Math.max(share, 0.01));
  context.strokeStyle = share < low ? colours.low : edge;
  context.lineWidth = share < low ? 3 : 1.8;
  context.globalAlpha = share < low ? 1 : 0.6;
  context.stroke();
  context.globalAlpha = 1;
}

export function drawBall(context, camera, match, time) {
  const [x, y] = camera.toPixels(match.place(BALL, time));
  const radius = Math.max(camera.width < 600 ? 3 : 4, match.head.server.ball_size * camera.scale);
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = "#ffffff";
  context.fill();
  context.lineWidth = 2;
  context.strokeStyle = "#111417";
  context.stroke();
}

export function ring(context, x, y, radius, colour, { width = 1.5, alpha = 1, dash = [] } = {}) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.globalAlpha = alpha;
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
}

export function ray(context, x, y, angle, from, to, colour, width) {
  context.beginPath();
  context.moveTo(x + Math.cos(angle) * from, y + Math.sin(angle) * from);
  context.lineTo(x + Math.cos(angle) * to, y + Math.sin(angle) * to);
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke();
}

function nose(context, x, y, angle, radius, colour) {
  const at = (turn, length) => [x + Math.cos(angle + turn) * length, y + Math.sin(angle + turn) * length];
  context.beginPath();
  context.moveTo(...at(-0.62, radius));
  context.lineTo(...at(0, radius * 1.55));
  context.lineTo(...at(0.62, radius));
  context.closePath();
  context.fillStyle = colour;
  context.fill();
}

function dot(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
}

function cross(context, x, y, size, colour) {
  context.beginPath();
  context.moveTo(x - size, y - size);
  context.lineTo(x + size, y + size);
  context.moveTo(x + size, y - size);
  context.lineTo(x - size, y + size);
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.stroke();
}

function card(context, x, y, radius, colour) {
  context.fillStyle = colour;
  context.strokeStyle = "#111417";
  context.lineWidth = 1;
  context.fillRect(x, y, radius * 0.55, radius * 0.8);
  context.strokeRect(x, y, radius * 0.55, radius * 0.8);
}

/** The mark of a wrong prediction: a small cross in the clone's colour. */
function mark(context, x, y, radius) {
  const size = Math.max(3, radius * 0.36);
  context.beginPath();
  context.arc(x, y, size * 1.5, 0, 2 * Math.PI);
  context.fillStyle = colours.paper;
  context.fill();
  cross(context, x, y, size * 0.8, colours.model);
}
