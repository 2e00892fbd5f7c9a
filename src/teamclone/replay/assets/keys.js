// The keys, and the list of them.

import { element } from "./events.js";

/** `table` has [keys, what they do, function]; a key may have "shift+" in front. */
export function watchKeys(table) {
  const actions = new Map();
  for (const [keys, , act] of table) for (const key of keys) actions.set(key, act);
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const { target } = event;
    if (target.matches("input:not([type=checkbox]), select, textarea")) {
      if (event.key === "Escape" || (event.key === "Enter" && target.matches("input"))) target.blur();
      return;
    }
    // A button or a switch has its own use of these.
    if (target.matches("button, summary, input") && (event.key === " " || event.key === "Enter")) return;
    const letter = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const act = actions.get((event.shiftKey && /^([a-z]|Arrow.*)$/.test(letter) ? "shift+" : "") + letter);
    if (!act) return;
    event.preventDefault();
    act();
  });
}

const SHOWN = { " ": "space", ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", Escape: "Esc" };

export function listKeys(table, list) {
  for (const [keys, text] of table) {
    if (!text) continue;
    const row = document.createElement("div");
    const names = element("dt");
    keys.forEach((key, i) => {
      if (i) names.append(" ");
      const shift = key.startsWith("shift+");
      const bare = key.replace("shift+", "");
      names.append(element("kbd", "", (shift ? "⇧" : "") + (SHOWN[bare] ?? (bare.length === 1 ? bare.toUpperCase() : bare))));
    });
    row.append(names, element("dd", "", text));
    list.append(row);
  }
}
