// The list of events: those of the match, the most surprising commands, the fans of futures; filters and search.

import { peaks } from "./match.js";

export const SURPRISE = "surprise";
export const FUTURE = "futures";
const MESSAGE = "message";
/** Kinds of which there are so many that the list begins without them. */
export const HIDDEN_AT_FIRST = new Set(["kick", "dribble", "self pass", "ball touch", "multi touch", "press"]);
const MOST_MESSAGES = 200;

/** A new element with a class and a text; texts are never markup. */
export function element(tag, className = "", text = "") {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
}

export function chip(slot) {
  return element("span", `chip ${slot < 11 ? "left" : "right"}`, String((slot % 11) + 1));
}

/** A probability in words. */
export const percent = (p) => (p > 0 && p < 0.01 ? "<\u00a01\u00a0%" : `${Math.round(100 * p)}\u00a0%`);

/** A command in a sentence. */
export const spoken = (word) => (word === "none" ? "nothing" : word);

/** The commands of some players that the clone expected least, as events. */
export function surprises(match, slots) {
  const column = match.columns.get("loss");
  if (!column || !slots.length) return [];
  const greatest = new Float32Array(match.frames).fill(NaN);
  const whose = new Uint8Array(match.frames);
  for (const slot of slots)
    for (let frame = 0, i = slot * match.frames; frame < match.frames; frame++, i++) {
      const loss = column.data[i] === column.none ? NaN : column.data[i] * column.step;
      if (loss > (greatest[frame] || 0) || (Number.isNaN(greatest[frame]) && !Number.isNaN(loss))) {
        greatest[frame] = loss;
        whose[frame] = slot;
      }
    }
  return peaks(greatest).map((frame) => {
    const slot = whose[frame];
    const { answered, likeliest, loss } = match.expected(slot, frame);
    const text = `${spoken(answered.word)} (${percent(Math.exp(-loss))} expected), not ${spoken(likeliest.word)} (${percent(likeliest.p)})`;
    return { frame, kind: SURPRISE, side: slot < 11 ? 1 : -1, unum: (slot % 11) + 1, text };
  });
}

export function futures(match) {
  return match.fans.map((fan) => ({ frame: fan.frame, kind: FUTURE, side: 0, unum: 0, text: `${fan.ahead.at(-1)} cycles ahead` }));
}

export class EventList {
  constructor(match, onSeek) {
    this.match = match;
    this.onSeek = onSeek;
    this.list = document.getElementById("list");
    this.search = document.getElementById("search");
    this.filters = document.getElementById("filters");
    this.count = document.getElementById("count");
    this.extra = [];
    this.shown = [];
    this.current = -1;
    this.focused = null;
    const kinds = [...match.head.kinds, ...(match.predictions ? [SURPRISE] : []), ...(match.fans.length ? [FUTURE] : [])];
    const there = new Set([...match.events.map((event) => event.kind), SURPRISE, FUTURE]);
    this.kinds = kinds.filter((kind) => there.has(kind));
    this.on = new Set(this.kinds.filter((kind) => !HIDDEN_AT_FIRST.has(kind)));
    this.buttons = new Map(this.kinds.map((kind) => [kind, this.filterButton(kind)]));
    this.filters.append(...this.buttons.values());
    this.search.addEventListener("input", () => this.render());
    this.onFilter = () => {};
  }

  filterButton(kind) {
    const button = element("button", "", kind);
    button.type = "button";
    button.addEventListener("click", () => {
      if (this.on.has(kind)) this.on.delete(kind);
      else this.on.add(kind);
      this.render();
    });
    return button;
  }

  /** All events in their order, shown or not. */
  get all() {
    return this.merged;
  }

  setExtra(extra) {
    this.merged = [...this.match.events, ...extra].sort((a, b) => a.frame - b.frame);
    this.render();
  }

  setFilters(kinds, query) {
    if (kinds) this.on = new Set(this.kinds.filter((kind) => kinds.includes(kind)));
    if (query !== null) this.search.value = query;
    this.render();
  }

  /** Frames of a kind, in their order. */
  framesOf(kind) {
    const wanted = kind === "any" ? this.shown : this.merged.filter((event) => event.kind === kind);
    return wanted.map((event) => event.frame);
  }

  words(event) {
    const { match } = this;
    const team = event.side ? match.teamName(event.side > 0 ? 0 : 1) : "";
    const short = event.side && event.unum ? `${event.side > 0 ? "l" : "r"}${event.unum}` : "";
    return `${match.cycle(event.frame)} ${event.kind} ${team} ${short} ${event.text}`.toLowerCase();
  }

  render() {
    const query = this.search.value.trim().toLowerCase();
    const parts = query.split(/\s+/).filter(Boolean);
    this.shown = this.merged.filter((event) => this.on.has(event.kind) && (!parts.length || parts.every((part) => this.words(event).includes(part))));
    if (query.length > 1) this.shown = [...this.shown, ...this.messages(query)].sort((a, b) => a.frame - b.frame);
    const had = this.focused;
    this.list.replaceChildren(...this.shown.map((event) => this.row(event)));
    // The list is made anew when a player is chosen; who walks through it by keyboard goes on where it was.
    const again = had ? this.shown.findIndex((one) => one.frame === had.frame && one.kind === had.kind && one.unum === had.unum) : -1;
    this.list.children[again]?.firstElementChild.focus({ preventScroll: true });
    this.focused = again < 0 ? null : had;
    for (const [kind, button] of this.buttons) button.setAttribute("aria-pressed", String(this.on.has(kind)));
    this.count.textContent = this.shown.length ? `${this.shown.length}` : "none";
    this.current = -1;
    this.onFilter();
  }

  messages(query) {
    const found = [];
    for (const { frame, slot, text } of this.match.says.all) {
      if (found.length >= MOST_MESSAGES) break;
      if (text.toLowerCase().includes(query)) found.push({ frame, kind: MESSAGE, side: slot < 11 ? 1 : -1, unum: (slot % 11) + 1, text });
    }
    return found;
  }

  row(event) {
    const button = element("button");
    button.type = "button";
    const what = element("span", "what");
    what.append(element("b", "", event.kind), ` ${event.text}`);
    const slot = event.side ? (event.side > 0 ? 0 : 11) + Math.max(0, event.unum - 1) : null;
    const who = slot === null ? element("span", "chip none", "–") : chip(slot);
    if (slot !== null && !event.unum) who.textContent = "·";
    const name = slot === null ? "" : event.unum ? this.match.label(slot) : this.match.teamName(this.match.team(slot));
    who.title = name;
    who.setAttribute("aria-label", name);
    button.append(element("span", "at", String(this.match.cycle(event.frame))), who, what);
    button.addEventListener("click", () => this.onSeek(event));
    button.addEventListener("focus", () => { this.focused = event; });
    button.addEventListener("blur", () => { this.focused = null; });
    const row = element("li");
    row.append(button);
    return row;
  }

  /** Mark the last event before a frame. */
  follow(frame) {
    let current = -1;
    while (current + 1 < this.shown.length && this.shown[current + 1].frame <= frame) current++;
    if (current === this.current) return;
    this.list.children[this.current]?.removeAttribute("aria-current");
    const row = this.list.children[current];
    row?.setAttribute("aria-current", "true");
    this.current = current;
    if (!row || this.list.matches(":hover") || this.list.contains(document.activeElement)) return;
    const above = row.offsetTop - this.list.offsetTop - this.list.scrollTop;
    if (above < 0 || above > this.list.clientHeight - row.offsetHeight) this.list.scrollTop += above - this.list.clientHeight / 3;
  }
}
