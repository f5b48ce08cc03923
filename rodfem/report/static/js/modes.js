// Buttons of the modes that a state has; where it has none, of the nearest states that have some.

import { data, digits, rough } from "report/data";
import { branch, select, showMode, state, subscribe } from "report/store";

const box = document.getElementById("modes");
let shown = "";

function button(text, pressed, action, kind = "") {
  const made = document.createElement("button");
  made.type = "button";
  made.className = kind;
  made.textContent = text;
  if (pressed !== null) made.setAttribute("aria-pressed", pressed);
  made.addEventListener("click", action);
  return made;
}

// Its value and what it does; what moves only where it does, or the buttons would not stand side by side.
function words(mode) {
  const [x, y] = mode.value;
  const value = mode.words || `${rough(x, 5)}${y ? ` ${y > 0 ? "+" : "−"} ${digits(Math.abs(y), 5)} i` : ""}`;
  const does = mode.kind === "zero" && value.startsWith("0") ? "" : ` ${mode.kind}`;
  return `${mode.kind === "grows" ? "◌" : "●"} ${value}${does}${mode === state.mode ? `: ${mode.motion}` : ""}`;
}

// The nearest states on either side that have modes, that of the smaller load first, as in the chart above.
function nearest(rows) {
  const b = branch(), found = [rows.filter((row) => row < state.row).at(-1), rows.find((row) => row > state.row)];
  const ordered = found.filter((row) => row !== undefined).sort((p, q) => b.load[p] - b.load[q]);
  return ordered.map((row) => button(`modes at ${data.symbol} = ${digits(b.load[row], 5)}`, null, () => select(state.branch, row)));
}

function quiet(text, title = "") {
  const made = document.createElement("span");
  made.className = "quiet";
  made.textContent = text;
  made.title = title;
  return made;
}

function redraw() {
  const b = branch(), here = b.modes[state.row] ?? [], rows = Object.keys(b.modes).map(Number);
  const key = [state.branch, state.row, here.indexOf(state.mode)].join();
  if (key === shown) return;
  shown = key;
  const buttons = here.map((mode) => button(words(mode), mode === state.mode, () => showMode(mode === state.mode ? null : mode), mode.kind));
  buttons.forEach((one, i) => (one.title = `Mode ${i + 1}: ${here[i].motion} (key ${i + 1})`));
  const missed = b.missed?.[state.row], none = !here.length && !missed && !rows.length;
  const others = [
    ...(missed ? [quiet(`No modes: ${missed}`)] : here.length ? [] : nearest(rows)),
    ...(none ? [quiet("No modes were computed: the rod has no inertia, or an earlier version of rodfem wrote the files.")] : []),
  ];
  box.replaceChildren(...buttons, ...others);
}

export function start() {
  subscribe(redraw);
}
