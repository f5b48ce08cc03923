// What is shown: a branch, a row of it, a load, and a mode that moves. Listeners hear of changes once a frame.

import { data } from "report/data";

export const state = { branch: data.start[0], row: data.start[1], load: 0, mode: null };
state.load = data.branches[state.branch].load[state.row];

const listeners = [];
let waiting = false;

export const branch = () => data.branches[state.branch];
export const words = (b, row) => b.told[b.words[row]];

export function subscribe(listener) {
  listeners.push(listener);
}

// Tell all listeners at once: as the page is made, when no frame need ever follow.
export function tell() {
  waiting = false;
  document.body.dataset.branch = branch().name;
  document.body.dataset.row = state.row;
  for (const listener of listeners) listener(state);
}

function changed() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(tell);
}

// Show a row of a branch; the load follows unless it is the load that has chosen the row.
export function select(number, row, load = null) {
  const chosen = data.branches[number];
  if (!chosen) return;
  state.branch = number;
  state.row = Math.min(Math.max(row, 0), chosen.load.length - 1);
  state.load = load ?? chosen.load[state.row];
  state.mode = null;
  changed();
}

export function showMode(mode) {
  state.mode = mode;
  changed();
}
