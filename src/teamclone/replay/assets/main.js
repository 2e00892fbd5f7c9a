// Puts the parts together: one clock, one view, drawn once a frame of the screen.

import { decode } from "./decode.js";
import { Match, PLAYERS } from "./match.js";
import { Clock, SPEEDS } from "./clock.js";
import { fitted, watchColours } from "./theme.js";
import { Camera, watchPointers } from "./camera.js";
import { discRadius, drawBall, drawPitch, drawPlayers } from "./pitch.js";
import { drawOver, drawUnder } from "./overlays.js";
import { Detail, Overview, seriesOf, watchScrubbing } from "./timeline.js";
import { EventList, FUTURE, HIDDEN_AT_FIRST, SURPRISE, element, futures, surprises } from "./events.js";
import { Panel } from "./panel.js";
import { Capture } from "./capture.js";
import { LinkWriter, readLink } from "./link.js";
import { listKeys, watchKeys } from "./keys.js";

const PANEL_MS = 90; // between two drawings of the panel while time runs
const DIGITS_MS = 700; // in which two digits are one number
const byId = (id) => document.getElementById(id);

/** What may be shown or hidden: name, key, text, at first, and whether the match has it. */
const SWITCHES = [
  ["arrows", "a", "commands of the chosen player", true, (match) => match.has("kind") || match.predictions],
  ["all", "shift+a", "commands of all players", false, (match) => match.has("kind") || match.predictions],
  ["wrong", "w", "mark wrong predictions", true, (match) => match.predictions],
  ["fans", "u", "futures of roll-outs", true, (match) => match.fans.length],
  ["trail", "b", "trail of the ball", true, () => true],
  ["offside", "o", "offside lines", false, () => true],
  ["stamina", "m", "stamina, as a ring", true, (match) => match.has("stamina")],
  ["cones", "v", "view of all players", false, (match) => match.has("view_width")],
];

class Replay {
  constructor(match) {
    this.match = match;
    this.clock = new Clock(match.frames);
    this.camera = new Camera();
    this.view = { chosen: null, show: {} };
    this.pitch = byId("pitch");
    this.overview = new Overview(byId("overview"), match);
    this.detail = new Detail(byId("detail"), match);
    this.panel = new Panel(match, (slot) => this.choose(slot));
    this.events = new EventList(match, (event) => this.seekEvent(event));
    this.capture = new Capture(this.pitch, match, this.clock, (text) => this.captured(text));
    this.link = new LinkWriter(() => this.state());
    this.dirty = true;
    this.panelDrawn = 0;
    this.frameShown = -1;
    this.pictures = 0;
    this.clock.onChange = () => this.changed();
    this.events.onFilter = () => this.link.changed();
    this.fill();
    this.listen();
    this.choose(null);
    this.colours = watchColours(() => this.recolour());
    this.follow(readLink(location.hash));
    new ResizeObserver(() => this.resize()).observe(this.pitch);
    this.resize();
    requestAnimationFrame((now) => this.tick(now));
  }

  // Building the page.

  fill() {
    const { match } = this;
    byId("left-name").textContent = match.teamName(0);
    byId("right-name").textContent = match.teamName(1);
    document.title = `${match.teamName(0)} – ${match.teamName(1)} · teamclone replay`;
    byId("home").hidden = !match.head.home;
    if (match.head.home) byId("home").href = match.head.home;
    for (const speed of SPEEDS) byId("speed").append(new Option(`${speed} ×`, String(speed)));
    for (const [value, text] of [["none", "whole pitch"], ["ball", "follow ball"], ["player", "follow player"]]) byId("follow").append(new Option(text, value));
    for (const kind of ["any", ...this.events.kinds]) byId("jump").append(new Option(kind === "any" ? "next shown" : kind, kind));
    byId("jump").value = this.events.kinds.includes(SURPRISE) ? SURPRISE : "any";
    for (const [name, key, text, on, there] of SWITCHES) {
      this.view.show[name] = Boolean(there(match)) && on;
      if (!there(match)) continue;
      const label = element("label");
      const box = document.createElement("input");
      box.type = "checkbox";
      box.checked = on;
      box.dataset.name = name;
      box.addEventListener("change", () => this.toggle(name, box.checked));
      label.append(box, text, element("kbd", "", key.replace("shift+", "⇧").toUpperCase()));
      byId("switches").append(label);
    }
    byId("notes").replaceChildren(...match.head.notes.map((note) => element("p", "", note)));
  }

  listen() {
    const { clock, camera } = this;
    const click = (id, act) => byId(id).addEventListener("click", act);
    click("play", () => clock.toggle(1));
    click("reverse", () => clock.toggle(-1));
    click("back", () => clock.step(-1));
    click("forward", () => clock.step(1));
    click("previous", () => this.jump(byId("jump").value, -1));
    click("next", () => this.jump(byId("jump").value, 1));
    click("in", () => this.zoom(1.5));
    click("out", () => this.zoom(1 / 1.5));
    click("png", () => this.capture.png());
    click("clip", () => this.clip());
    click("help", () => byId("keys").showModal());
    click("theme", () => this.colours.toggle());
    byId("speed").addEventListener("change", (event) => clock.setSpeed(Number(event.target.value)));
    byId("follow").addEventListener("change", (event) => this.setFollow(event.target.value));
    byId("cycle").addEventListener("change", (event) => this.goTo(event.target.value));
    watchPointers(this.pitch, camera, { onTap: (at, scale) => this.tap(at, scale), onMove: () => this.changed() });
    watchScrubbing(byId("overview"), { onFrame: (x) => clock.seek(this.overview.frameAt(x)) });
    const pixels = () => this.detail.pixels();
    watchScrubbing(byId("detail"), {
      relative: (by) => clock.seek(clock.now - by / pixels()),
      onFrame: (x) => clock.seek(Math.floor(clock.now + (x - byId("detail").clientWidth / 2) / pixels())),
    });
    addEventListener("hashchange", () => {
      if (location.hash !== this.link.written) this.follow(readLink(location.hash));
    });
    document.addEventListener("click", (event) => {
      if (!byId("show").contains(event.target)) byId("show").open = false;
    });
    const table = this.keyTable();
    watchKeys(table);
    listKeys(table, byId("key-list"));
  }

  keyTable() {
    const { clock } = this;
    const kinds = [
      ["s", SURPRISE, "surprise"], ["g", "goal", "goal"], ["h", "shot", "shot"], ["k", "kick", "kick"], ["t", "interception", "interception"],
      ["p", "set play", "set play"], ["x", "tackle", "tackle"], ["l", "foul", "foul"], ["j", FUTURE, "futures"], ["e", "any", "event in the list"],
    ].filter(([, kind]) => kind === "any" || this.events.kinds.includes(kind));
    return [
      [[" "], "play or pause", () => clock.toggle(1)],
      [["r"], "play backwards", () => clock.toggle(-1)],
      [["ArrowLeft", "ArrowRight"], "one cycle back, forward", () => {}],
      [["ArrowLeft"], "", () => clock.step(-1)],
      [["ArrowRight"], "", () => clock.step(1)],
      [["shift+ArrowLeft", "shift+ArrowRight"], "ten cycles", () => {}],
      [["shift+ArrowLeft"], "", () => clock.step(-10)],
      [["shift+ArrowRight"], "", () => clock.step(10)],
      [["ArrowUp", "ArrowDown"], "faster, slower", () => {}],
      [["ArrowUp"], "", () => clock.faster(1)],
      [["ArrowDown"], "", () => clock.faster(-1)],
      [["Home", "End"], "begin, end", () => {}],
      [["Home"], "", () => clock.seek(0)],
      [["End"], "", () => clock.seek(clock.last)],
      ...kinds.flatMap(([key, kind, text]) => [
        [[key, `shift+${key}`], `next ${text}, the one before`, () => {}],
        [[key], "", () => this.jump(kind, 1)],
        [[`shift+${key}`], "", () => this.jump(kind, -1)],
      ]),
      [["1", "…", "10", "11"], "player of the team last chosen", () => {}],
      ...[..."1234567890"].map((key) => [[key], "", () => this.digit(Number(key))]),
      [["q"], "the same number of the other team", () => this.choose(((this.view.chosen ?? this.lastChosen ?? 0) + 11) % PLAYERS)],
      [["Escape"], "choose nobody, see the whole pitch", () => this.whole()],
      [["f"], "follow ball, player, neither", () => this.nextFollow()],
      [["+", "-"], "zoom in, out", () => {}],
      [["+"], "", () => this.zoom(1.5)],
      [["="], "", () => this.zoom(1.5)],
      [["-"], "", () => this.zoom(1 / 1.5)],
      [["z"], "whole pitch", () => this.setFollow("none")],
      ...SWITCHES.filter(([name]) => byId("switches").querySelector(`[data-name=${name}]`)).map(([name, key, text]) => [[key], text, () => this.toggle(name)]),
      [["d"], "day or night colours", () => this.colours.toggle()],
      [["i"], "save the moment as PNG", () => this.capture.png()],
      [["c"], "record a clip, end it", () => this.clip()],
      [["n"], "copy the address of this moment", () => this.copyLink()],
      [["/"], "search", () => byId("search").focus()],
      [["?"], "this list", () => byId("keys").showModal()],
    ];
  }

  // What the user does.

  choose(slot) {
    this.view.chosen = slot;
    if (slot !== null) this.lastChosen = slot;
    if (slot === null && this.camera.follow === "player") this.setFollow("none");
    this.series = seriesOf(this.match, slot);
    this.found = surprises(this.match, this.series.slots);
    this.events.setExtra([...this.found, ...futures(this.match)]);
    this.regraph();
    this.changed();
  }

  /** Choose by number: 1, then 0 or 1 at once is 10 or 11. */
  digit(digit) {
    const now = performance.now();
    const second = this.digitBefore === 1 && digit <= 1 && now - this.digitAt < DIGITS_MS;
    const unum = second ? 10 + digit : digit || 10;
    this.digitBefore = second ? null : digit;
    this.digitAt = now;
    this.choose(this.match.team(this.view.chosen ?? this.lastChosen ?? 0) * 11 + unum - 1);
  }

  tap(at, scale) {
    const time = this.clock.now;
    const reach = Math.max(1.6, (discRadius(this.camera) + 8) / scale);
    let best = null;
    let least = reach;
    for (let slot = 0; slot < PLAYERS; slot++) {
      if (!this.match.there(slot, Math.floor(time))) continue;
      const [x, y] = this.match.place(slot, time);
      const away = Math.hypot(x - at[0], y - at[1]);
      if (away < least) [best, least] = [slot, away];
    }
    this.choose(best === this.view.chosen ? null : best);
  }

  jump(kind, direction) {
    const frames = this.events.framesOf(kind);
    const now = this.clock.frame;
    const next = direction > 0 ? frames.find((frame) => frame > now) : frames.findLast((frame) => frame < now);
    if (next === undefined) {
      this.announce(`No ${kind === "any" ? "event" : kind} ${direction > 0 ? "after" : "before"} this.`);
      return;
    }
    this.clock.pause();
    this.clock.seek(next);
    const event = this.events.all.find((one) => one.frame === next && (kind === "any" || one.kind === kind));
    if (event) this.announce(`Cycle ${this.match.cycle(next)}: ${event.kind} ${event.text}`);
  }

  seekEvent(event) {
    this.clock.pause();
    this.clock.seek(event.frame);
    if (event.side && event.unum) this.choose((event.side > 0 ? 0 : 11) + event.unum - 1);
  }

  goTo(text) {
    const [cycle, stoppage] = text.split(/[.+]/).map((part) => Number.parseInt(part, 10));
    if (!Number.isNaN(cycle)) {
      this.clock.pause();
      this.clock.seek(this.match.frameOf(cycle, stoppage || 0));
    }
    this.changed();
  }

  zoom(factor) {
    this.camera.zoomBy(factor);
    this.changed();
  }

  setFollow(what) {
    if (what === "player" && this.view.chosen === null) {
      this.announce("Choose a player first.");
      byId("follow").value = this.camera.follow;
      return;
    }
    this.camera.setFollow(what);
    this.camera.track(this.match, this.clock.now, this.view.chosen, 1);
    this.changed();
  }

  nextFollow() {
    const order = this.view.chosen === null ? ["none", "ball"] : ["none", "ball", "player"];
    this.setFollow(order[(order.indexOf(this.camera.follow) + 1) % order.length]);
  }

  whole() {
    this.camera.reset();
    this.choose(null);
  }

  toggle(name, on = !this.view.show[name]) {
    this.view.show[name] = on;
    const box = byId("switches").querySelector(`[data-name=${name}]`);
    if (box) box.checked = on;
    this.changed();
  }

  clip() {
    this.capture.clip();
    if (this.capture.recording && !this.clock.playing) this.clock.play(1);
  }

  captured(text) {
    byId("clip").classList.toggle("recording", this.capture.recording);
    byId("clip").textContent = this.capture.recording ? "Stop" : "Clip";
    this.announce(text);
  }

  async copyLink() {
    this.link.write();
    try {
      await navigator.clipboard.writeText(location.href);
      this.announce("The address is copied.");
    } catch {
      this.announce("Copy the address from the browser's bar.");
    }
  }

  announce(text) {
    byId("announce").textContent = text;
  }

  // The address.

  state() {
    const { clock, match, view, events, camera } = this;
    const first = events.kinds.filter((kind) => !HIDDEN_AT_FIRST.has(kind));
    const kinds = events.kinds.filter((kind) => events.on.has(kind));
    return {
      cycle: match.cycle(clock.frame),
      stoppage: match.stoppage(clock.frame),
      chosen: view.chosen,
      speed: clock.speed,
      kinds: kinds.join() === first.join() ? null : kinds,
      query: events.search.value,
      follow: camera.follow,
    };
  }

  follow({ cycle, stoppage, chosen, speed, kinds, query, follow }) {
    if (chosen !== this.view.chosen) this.choose(chosen);
    if (speed) this.clock.setSpeed(speed);
    if (kinds || query !== null) this.events.setFilters(kinds, query);
    if (cycle !== null) this.clock.seek(this.match.frameOf(cycle, stoppage));
    if (follow) this.setFollow(follow);
    this.changed();
  }

  // Drawing.

  changed() {
    this.dirty = true;
    this.link.changed();
  }

  recolour() {
    this.regraph();
    this.dirty = true;
  }

  regraph() {
    const peaks = this.found.map((event) => event.frame);
    this.overview.change(this.series, this.match.events, peaks);
    this.detail.change(this.series, this.match.events, peaks);
  }

  resize() {
    this.camera.resize(this.pitch.clientWidth, this.pitch.clientHeight);
    this.overview.picture = null;
    this.dirty = true;
  }

  tick(now) {
    const passed = Math.min(100, now - (this.before ?? now));
    this.before = now;
    this.clock.advance(passed);
    if (this.clock.playing) this.link.changed();
    if (this.clock.playing || this.dirty || this.capture.recording) this.draw(now);
    requestAnimationFrame((next) => this.tick(next));
  }

  draw(now) {
    const { match, camera, view, clock } = this;
    const time = clock.now;
    const asked = this.dirty;
    this.dirty = false;
    camera.track(match, time, view.chosen, clock.playing ? 0.12 : 1);
    const [context] = fitted(this.pitch);
    drawPitch(context, camera);
    drawUnder(context, camera, match, time, view);
    drawPlayers(context, camera, match, time, view);
    drawBall(context, camera, match, time);
    drawOver(context, camera, match, time, view);
    this.capture.drawn();
    this.overview.draw(time);
    this.detail.draw(time, view);
    if (asked) this.drawControls();
    if (asked || (clock.frame !== this.frameShown && now - this.panelDrawn > PANEL_MS)) this.drawFrame(now);
    if (!this.pictures++) this.firstPicture = performance.now();
  }

  /** What changes with the user. */
  drawControls() {
    const { clock, camera } = this;
    document.body.classList.toggle("playing", clock.playing && clock.direction > 0);
    byId("play").setAttribute("aria-label", clock.playing && clock.direction > 0 ? "Pause" : "Play");
    byId("reverse").setAttribute("aria-pressed", String(clock.playing && clock.direction < 0));
    byId("speed").value = String(clock.speed);
    byId("follow").value = camera.follow;
    this.pitch.classList.toggle("zoomed", camera.zoom > 1);
  }

  /** What changes with the frame. */
  drawFrame(now) {
    const { match, clock, view } = this;
    const frame = clock.frame;
    this.frameShown = frame;
    this.panelDrawn = now;
    const [left, right] = match.score(frame);
    const shootOut = match.penalties(frame);
    byId("score").textContent = `${left} : ${right}`;
    if (shootOut) byId("score").append(element("small", "", `  penalties ${shootOut[0][0]} : ${shootOut[1][0]}`));
    byId("mode").textContent = match.mode(frame).replaceAll("_", " ");
    const stoppage = match.stoppage(frame);
    const text = `cycle ${match.cycle(frame)}${stoppage ? ` + ${stoppage}` : ""}`;
    byId("time").textContent = text;
    byId("last").textContent = ` of ${match.lastCycle}`;
    if (document.activeElement !== byId("cycle")) byId("cycle").value = `${match.cycle(frame)}${stoppage ? `.${stoppage}` : ""}`;
    this.panel.draw(frame, view.chosen);
    this.events.follow(frame);
    for (const id of ["overview", "detail"]) {
      const slider = byId(id);
      slider.setAttribute("aria-valuemin", "0");
      slider.setAttribute("aria-valuemax", String(clock.last));
      slider.setAttribute("aria-valuenow", String(frame));
      slider.setAttribute("aria-valuetext", text);
    }
    const [x, y] = match.placeIn(22, frame);
    const picture = `Pitch, ${text}, ${match.mode(frame).replaceAll("_", " ")}, ball at ${x.toFixed(0)}, ${y.toFixed(0)}`;
    this.pitch.setAttribute("aria-label", picture);
  }
}

async function start() {
  const loading = byId("loading");
  try {
    if (!globalThis.DecompressionStream) throw new Error("this browser is too old to unpack it; one of 2023 or later can");
    const { head, columns } = await decode(byId("data").textContent.trim());
    byId("data").remove();
    // For a developer at the console, and for tests.
    globalThis.replay = new Replay(new Match(head, columns));
    loading.textContent = "";
  } catch (error) {
    loading.textContent = `The match cannot be shown: ${error.message}.`;
    throw error;
  }
}

start();
