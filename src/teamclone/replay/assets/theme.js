// The colours of the page as a canvas needs them: resolved, for day and night.

const NAMES = [
  "paper", "panel", "ink", "muted", "rule", "accent", "grass", "stripe", "line", "left", "left-ink", "left-edge", "right",
  "right-ink", "right-edge", "model", "low", "yellow", "dash", "turn", "kick", "tackle", "catch", "move", "none",
];
export const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';

export const colours = {};

/** Read the colours anew. */
export function readColours() {
  const probe = document.createElement("span");
  document.body.append(probe);
  for (const name of NAMES) {
    probe.style.color = `var(--${name})`;
    colours[name] = getComputedStyle(probe).color;
  }
  probe.remove();
}

/** Call back after the system's preference has changed, and now. */
export function watchColours(onChange) {
  const changed = () => {
    readColours();
    onChange();
  };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  changed();
  return {
    toggle() {
      const style = document.documentElement.style;
      const dark = style.colorScheme ? style.colorScheme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
      style.colorScheme = dark ? "light" : "dark";
      changed();
    },
  };
}

/** Size a canvas to its place on the page; return [context, width, height] in CSS pixels. */
export function fitted(canvas) {
  const ratio = Math.min(devicePixelRatio || 1, 2);
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [context, width, height];
}
