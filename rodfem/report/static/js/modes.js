// Buttons of the modes that a state has, and of the states that have some.

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
  return `${mode.kind === "grows" ? "◌" : "●"} ${value} ${mode.kind}${mode === state.mode ? `: ${mode.motion}` : ""}`;
}

function redraw() {
  const b = branch(), here = b.modes[state.row] ?? [];
  const rows = Object.keys(b.modes).map(Number), none = !rows.length && (b.spectrum || b.omega2) && document.createElement("span");
  const key = [state.branch, here.length || none ? state.row : -1, here.indexOf(state.mode)].join();
  if (key === shown) return;
  shown = key;
  const buttons = here.map((mode) => button(words(mode), mode === state.mode, () => showMode(mode === state.mode ? null : mode), mode.kind));
  if (none) {
    none.className = "quiet";
    none.title = "The command of this report, with these options besides: see About";
    none.textContent = `Modes that move: run with --at ${digits(b.load[state.row], 4)} --modes 3`;
  }
  buttons.forEach((one, i) => (one.title = `Mode ${i + 1}: ${here[i].motion}`));
  const others = here.length ? [] : rows.map((row) => button(`modes at ${data.symbol} = ${digits(b.load[row])}`, null, () => select(state.branch, row)));
  box.replaceChildren(...buttons, ...others, ...(none ? [none] : []));
}

export function start() {
  subscribe(redraw);
}
