// The moment in the address: #c=1234&p=l7&s=2&f=goal,shot&q=text&v=ball. It can be shared, and the back button knows it.

const WRITE_MS = 700;

/** "l7" or "r11" of a place on the player axis. */
export const nameOf = (slot) => `${slot < 11 ? "l" : "r"}${(slot % 11) + 1}`;

/** The place of a player by such a name, null for none. */
export function slotOf(name) {
  const found = /^([lr])(\d{1,2})$/.exec(name ?? "");
  const unum = found ? Number(found[2]) : 0;
  return unum >= 1 && unum <= 11 ? unum - 1 + (found[1] === "l" ? 0 : 11) : null;
}

/** What an address says; what it leaves out is null. */
export function readLink(hash) {
  const values = new URLSearchParams(hash.replace(/^#/, ""));
  const [cycle, stoppage] = (values.get("c") ?? "").split("+").join(".").split(".").map((text) => Number.parseInt(text, 10));
  const speed = Number.parseFloat(values.get("s"));
  return {
    cycle: Number.isNaN(cycle) ? null : cycle,
    stoppage: stoppage > 0 ? stoppage : 0,
    chosen: slotOf(values.get("p")),
    speed: speed > 0 ? speed : null,
    kinds: values.has("f") ? values.get("f").split(",").map((kind) => kind.replaceAll("-", " ")) : null,
    query: values.get("q"),
    follow: ["ball", "player"].includes(values.get("v")) ? values.get("v") : null,
  };
}

export function linkOf({ cycle, stoppage, chosen, speed, kinds, query, follow }) {
  const parts = [`c=${cycle}${stoppage ? `.${stoppage}` : ""}`];
  if (chosen !== null) parts.push(`p=${nameOf(chosen)}`);
  if (speed !== 1) parts.push(`s=${speed}`);
  if (kinds) parts.push(`f=${kinds.map((kind) => kind.replaceAll(" ", "-")).join(",")}`);
  if (query) parts.push(`q=${encodeURIComponent(query)}`);
  if (follow !== "none") parts.push(`v=${follow}`);
  return `#${parts.join("&")}`;
}

/** Writes the address now and then: browsers allow it only so often. */
export class LinkWriter {
  constructor(stateOf) {
    this.stateOf = stateOf;
    this.due = null;
  }

  changed() {
    this.due ??= setTimeout(() => {
      this.due = null;
      this.write();
    }, WRITE_MS);
  }

  write() {
    const link = linkOf(this.stateOf());
    this.written = link;
    if (link !== location.hash) history.replaceState(null, "", link);
  }
}
