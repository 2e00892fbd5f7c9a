// What is known of the chosen player in this cycle, or of all players.

import { PLAYERS } from "./match.js";
import { chip, element, percent, spoken } from "./events.js";

const number = (value, digits = 0) => (Number.isNaN(value) ? "–" : value.toFixed(digits).replace("-", "−"));
const UNITS = { deg: "°", power: "", m: " m" };

/** The numbers of a command in words: "80, 15°". */
export function numbersOf(word, [first, second] = []) {
  const known = (value) => value !== undefined && !Number.isNaN(value);
  if (word === "dash" || word === "kick") {
    if (!known(first)) return known(second) ? `towards ${number(second)}°` : "";
    return `${number(first)}${known(second) && (second !== 0 || word === "kick") ? `, ${number(second)}°` : ""}`;
  }
  if (word === "move") return known(first) ? `${number(first, 1)}, ${number(second, 1)}` : "";
  return known(first) && word !== "none" ? `${number(first, word === "turn" ? 1 : 0)}°` : "";
}

export class Panel {
  constructor(match, onChoose) {
    this.match = match;
    this.onChoose = onChoose;
    this.facts = document.getElementById("facts");
    this.select = document.getElementById("player");
    this.fillSelect();
    this.select.addEventListener("change", () => onChoose(this.select.value === "" ? null : Number(this.select.value)));
    this.kind = "";
  }

  fillSelect() {
    const everybody = element("option", "", "All players");
    everybody.value = "";
    this.select.append(everybody);
    for (const team of [0, 1]) {
      const group = document.createElement("optgroup");
      group.label = this.match.teamName(team);
      for (let slot = 11 * team; slot < 11 * team + 11; slot++) {
        const option = element("option", "", `${(slot % 11) + 1}  ${this.match.teamName(team)}`);
        option.value = String(slot);
        group.append(option);
      }
      this.select.append(group);
    }
  }

  draw(frame, chosen) {
    this.select.value = chosen === null ? "" : String(chosen);
    const kind = chosen === null ? "all" : `one ${this.match.predicted(chosen)}`;
    if (kind !== this.kind) this.build(kind, chosen);
    this.kind = kind;
    if (chosen === null) this.drawAll(frame);
    else this.drawOne(frame, chosen);
  }

  build(kind, chosen) {
    const had = this.facts.contains(document.activeElement);
    this.facts.replaceChildren();
    if (had) this.select.focus();
    if (kind === "all") this.buildAll();
    else this.buildOne(chosen);
  }

  // One player: verdict, probabilities, facts.

  buildOne(chosen) {
    this.verdict = element("p", "verdict");
    this.facts.append(this.verdict);
    this.bars = new Map();
    if (this.match.predicted(chosen)) {
      const bars = element("div", "bars");
      for (const word of this.match.predictions.commands) {
        const bar = element("div", "bar");
        const fill = element("div", "fill");
        fill.style.background = `var(--${word})`;
        const track = element("div", "track");
        track.append(fill);
        const share = element("span", "number");
        const values = element("span", "values");
        bar.append(element("span", "word", word), track, share, values);
        bars.append(bar);
        this.bars.set(word, { bar, fill, share, values });
      }
      this.facts.append(bars);
    }
    const list = document.createElement("dl");
    this.fields = new Map();
    for (const [name, wide] of FIELDS) {
      const value = element("dd", wide ? "wide" : "");
      list.append(element("dt", "", name), value);
      this.fields.set(name, value);
    }
    this.facts.append(list);
  }

  drawOne(frame, slot) {
    const { match } = this;
    const there = match.there(slot, frame);
    const done = there ? match.done(slot, frame) : null;
    const expected = there ? match.expected(slot, frame) : null;
    this.drawVerdict(there, done, expected, slot, frame);
    for (const [word, { bar, fill, share, values }] of this.bars) {
      const command = expected?.commands.find((one) => one.word === word);
      fill.style.width = command ? `${100 * Math.min(1, command.p)}%` : "0";
      share.textContent = command ? percent(command.p) : "–";
      bar.classList.toggle("done", Boolean(expected?.answered) && expected.answered.word === word);
      values.textContent = command ? likeliest(command) : "";
    }
    const facts = there ? factsOf(match, slot, frame) : {};
    for (const [name, cell] of this.fields) cell.textContent = facts[name] ?? "–";
  }

  drawVerdict(there, done, expected, slot, frame) {
    const { verdict, match } = this;
    if (!there) {
      verdict.replaceChildren("Not on the field.");
      return;
    }
    const did = done ? `${done.word} ${numbersOf(done.word, done.values)}`.trim() : "";
    const parts = [];
    if (done) parts.push("Did ", element("b", "", spoken(did)), done.refused ? ", which the server refused. " : ". ");
    if (!expected) {
      if (match.predicted(slot)) parts.push("Nothing is predicted in this play mode.");
    } else if (!expected.answered) parts.push(`The clone expected ${spoken(expected.likeliest.word)}.`);
    else {
      const right = expected.answered === expected.likeliest;
      const p = Math.exp(-expected.loss);
      parts.push(element("span", right ? "right" : "wrong", right ? "✓ As the clone expected" : `✗ The clone expected ${spoken(expected.likeliest.word)}`));
      parts.push(right ? `, with ${percent(p)}.` : `; it gave this ${percent(p)} (${number(expected.loss, 2)} nats).`);
    }
    if (!parts.length) parts.push("No commands are known.");
    verdict.replaceChildren(...parts);
  }

  // All players: a table of two teams.

  buildAll() {
    const table = element("table", "team");
    const head = document.createElement("tr");
    const columns = ["", "did", ...(this.match.predictions ? ["clone", "gave it"] : []), "stamina"];
    head.append(...columns.map((text) => {
      const cell = element("th", "", text);
      cell.scope = "col";
      return cell;
    }));
    table.append(head);
    this.rows = [];
    for (let slot = 0; slot < PLAYERS; slot++) {
      const row = document.createElement("tr");
      row.dataset.slot = String(slot);
      const choose = element("button");
      choose.type = "button";
      choose.append(chip(slot));
      choose.setAttribute("aria-label", `Choose ${this.match.label(slot)}`);
      const cells = columns.slice(1).map(() => document.createElement("td"));
      const first = document.createElement("td");
      first.append(choose);
      row.append(first, ...cells);
      row.addEventListener("click", () => this.onChoose(slot));
      table.append(row);
      this.rows.push({ row, cells });
    }
    this.facts.append(table);
  }

  drawAll(frame) {
    const { match } = this;
    this.rows.forEach(({ row, cells }, slot) => {
      const there = match.there(slot, frame);
      row.hidden = !there;
      if (!there) return;
      const done = match.done(slot, frame);
      const texts = [done ? `${done.word === "none" ? "–" : done.word} ${numbersOf(done.word, done.values)}${done.refused ? " (refused)" : ""}` : "?"];
      let wrong = false;
      if (match.predictions) {
        const expected = match.expected(slot, frame);
        wrong = Boolean(expected?.answered) && expected.answered !== expected.likeliest;
        texts.push(expected ? `${wrong ? "✗ " : ""}${expected.likeliest.word}` : "");
        texts.push(expected?.answered ? percent(Math.exp(-expected.loss)) : "");
      }
      const stamina = match.value("stamina", slot, frame);
      texts.push(Number.isNaN(stamina) ? "–" : percent(stamina / match.head.server.stamina_max));
      cells.forEach((cell, i) => {
        if (cell.textContent !== texts[i]) cell.textContent = texts[i];
        cell.classList.toggle("wrong", wrong && i === 1);
      });
    });
  }
}

function likeliest({ word, p, values }) {
  if (p < 0.02 || !values.length) return "";
  return values
    .filter((one) => !Number.isNaN(one.value))
    .map(({ name, value, unit, spread }) => {
      const about = Number.isNaN(spread) ? "" : ` ± ${number(spread, spread < 10 ? 1 : 0)}`;
      return `${name.slice(word.length + 1)} ${number(value)}${UNITS[unit] ?? ""}${about}`;
    })
    .join(", ");
}

const FIELDS = [
  ["place", false], ["speed", false], ["body", false], ["neck", false], ["to ball", false], ["view", false],
  ["stamina", true], ["effort", false], ["recovery", false], ["type", true], ["points to", false], ["hears", false],
  ["focus", true], ["said", true],
];

function factsOf(match, slot, frame) {
  const value = (name) => match.value(name, slot, frame);
  const [x, y] = match.placeIn(slot, frame);
  const [bx, by] = match.placeIn(22, frame);
  const speed = match.speed(slot, frame);
  const stamina = value("stamina");
  const capacity = value("capacity");
  const left = Number.isNaN(capacity) ? "" : `, ${number(capacity)} left to recover`;
  const most = match.head.server.stamina_max;
  const listens = value("listens");
  const said = match.said(slot, frame);
  const ago = said ? frame - said.frame : 0;
  const focus = value("focus_distance");
  return {
    place: `${number(x, 1)}, ${number(y, 1)}`,
    speed: `${number(speed, 2)} m`,
    body: `${number(value("body"), 1)}°`,
    neck: Number.isNaN(value("neck")) ? "–" : `${number(value("neck"))}°`,
    "to ball": `${number(Math.hypot(bx - x, by - y), 1)} m`,
    view: Number.isNaN(value("view_width")) ? "–" : `${number(value("view_width"))}°`,
    stamina: Number.isNaN(stamina) ? "–" : `${number(stamina)} (${percent(stamina / most)})${left}`,
    effort: number(value("effort"), 2),
    recovery: number(value("recovery"), 2),
    type: typeText(match, slot, frame),
    "points to": Number.isNaN(value("pointto_x")) ? "–" : `${number(value("pointto_x"))}, ${number(value("pointto_y"))}`,
    "hears": listens > 0 ? `${((listens - 1) % 11) + 1} ${match.team(listens - 1) === match.team(slot) ? "" : "of the others"}` : "–",
    focus: focus > 0 ? `${number(focus, 1)} m away, ${number(value("focus_direction"))}°` : "–",
    said: said ? `“${said.text}”${ago ? `, ${ago} ago` : ""}` : "–",
  };
}

function typeText(match, slot, frame) {
  const of = (name, digits) => number(match.ofType(name, slot, frame), digits);
  return `${number(match.value("type", slot, frame))}: speed ${of("player_speed_max", 2)}, decay ${of("player_decay", 2)}, kickable margin ${of("kickable_margin", 2)}`;
}
