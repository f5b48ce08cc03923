// What is shown: a branch, a row of it, its load, hidden branches, and a mode that moves. Listeners hear of changes once
// a frame.

import * as address from "report/address";
import { data } from "report/data";

const first = address.chosen("branch", address.names(), data.start[0]);
const asked = address.row(data.branches[first].load.length);
export const state = { branch: first, row: asked ?? (first === data.start[0] ? data.start[1] : 0), load: 0, mode: null, hidden: new Set() };
state.load = data.branches[state.branch].load[state.row];

const listeners = [];
let waiting = false;

export const branch = () => data.branches[state.branch];
export const words = (b, row) => b.told[b.words[row]];
export const visible = (number) => !state.hidden.has(number);

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

// Show a row of a branch; all that is on the screen is at its load.
export function select(number, row) {
  const chosen = data.branches[number];
  if (!chosen) return;
  state.hidden.delete(number);
  state.branch = number;
  state.row = Math.min(Math.max(row, 0), chosen.load.length - 1);
  state.load = chosen.load[state.row];
  state.mode = null;
  changed();
}

// Hide a branch, or show it again; of the one that is shown another takes the place, and one always stays.
export function toggle(number) {
  if (state.hidden.delete(number)) return changed();
  const others = data.branches.map((_, i) => i).filter((i) => i !== number && visible(i));
  if (!others.length) return;
  if (number === state.branch) select(others[0], Math.floor(data.branches[others[0]].load.length / 2));
  state.hidden.add(number);
  changed();
}

export function showMode(mode) {
  state.mode = mode;
  changed();
}
