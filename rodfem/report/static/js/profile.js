// Strains, contact forces and moments along the rod, components along the directors or in space, by colour and dashes.

import { data, values } from "report/data";
import { branch, state, subscribe } from "report/store";
import { item, lineIcon } from "report/icons";
import { draw, empty, layout } from "report/plotting";

const plot = document.getElementById("profile"), legend = document.getElementById("profile-legend"), error = document.getElementById("profile-error");
const choice = document.getElementById("profile-space"), space = choice.querySelector("input");
const SIZE = 17, FRAME = 13; // of a point: arclength, v, k, n, m, and from FRAME on the quaternion of its directors
const TABS = {
  curvature: { symbol: "k", first: 4, names: ["bending about d₁", "bending about d₂", "twist"] },
  strain: { symbol: "v", first: 1, names: ["shear along d₁", "shear along d₂", "stretch"] },
  moment: { symbol: "m", first: 10, names: ["bending about d₁", "bending about d₂", "torque"], space: ["about e₁", "about e₂", "about e₃"] },
  force: { symbol: "n", first: 7, names: ["shear along d₁", "shear along d₂", "tension"], space: ["along e₁", "along e₂", "along e₃"] },
};
const BELOW = ["₁", "₂", "₃"];
const LINES = [
  { color: "#0072b2", width: 2.4 },
  { color: "#d55e00", width: 2.4, dash: "7px,3px" },
  { color: "#009e73", width: 2.4, dash: "2px,2px" },
];
const { length = 1, force = 1, moment = 1 } = data.natural; // an older file has none
const NATURAL = { v: 1, k: 1 / length, n: force, m: moment };
const LEAST = 1e-4; // difference of values, over their natural size, up to which a quantity is drawn as constant
const ROUND_OFF = 1e-9; // jumps, relative, below which a quantity is continuous by its equations, as forces and moments are
const PAUSE = 120; // milliseconds
const FINE = 8; // points of a curve for each interval between two that an element has
let waiting = 0, last = 0;
let tab = Object.keys(TABS)[0];

// What the tab that is chosen shows: its names are those of components in space, if these are asked for and it has them.
function shown() {
  const found = TABS[tab], inSpace = Boolean(found.space && space.checked);
  return { ...found, inSpace, names: inSpace ? found.space : found.names };
}

// Profiles of a branch with forces and moments by their components in space.
function turned(b) {
  if (!b.turned) {
    const all = (b.turned = values(b.profile).slice());
    for (let i = 0; i < all.length; i += SIZE) {
      const [w, ...u] = all.subarray(i + FRAME, i + SIZE);
      for (const { first } of Object.values(TABS).filter((one) => one.space)) {
        const v = all.slice(i + first, i + first + 3), t = cross(u, v).map((x) => 2 * x), further = cross(u, t);
        for (let k = 0; k < 3; k++) all[i + first + k] = v[k] + w * t[k] + further[k];
      }
    }
  }
  return b.turned;
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

// Range of a quantity over the whole branch, so that the axes stay while the state changes.
function range(b, { first, inSpace }, natural, all) {
  const key = `range${first}${inSpace}`;
  if (!b[key]) {
    let [low, high] = [Infinity, -Infinity];
    for (let i = 0; i < all.length; i += SIZE)
      for (let k = first; k < first + 3; k++) if (!Number.isNaN(all[i + k])) [low, high] = [Math.min(low, all[i + k]), Math.max(high, all[i + k])];
    const room = high - low > LEAST * Math.max(natural, Math.abs(low)) ? 0.06 * (high - low) : 0.5 * natural;
    b[key] = [low - room, high + room];
  }
  return b[key];
}

// Places in a row of `size` points that each element has, with the weights of the polynomial through them.
function interpolation(size) {
  const weights = Array.from({ length: size }, (_, i) => Array.from({ length: size }, (_, j) => (i === j ? 1 : 1 / (i - j))).reduce((a, b) => a * b));
  return Array.from({ length: (size - 1) * FINE + 1 }, (_, n) => {
    const at = n / FINE, parts = weights.map((weight, i) => weight / (at - i)), sum = parts.reduce((a, b) => a + b);
    return n % FINE ? parts.map((part) => part / sum) : weights.map((_, i) => Number(i === at));
  });
}

// Points of the curves of a state: those of its polynomials, element by element, or those that there are.
function curves(all, size) {
  let count = 0;
  while (count * SIZE < all.length && !Number.isNaN(all[count * SIZE])) count++;
  const at = (i, k) => all[i * SIZE + k];
  if (size < 3) return (k) => Array.from({ length: count }, (_, i) => at(i, k));
  const places = interpolation(size), starts = Array.from({ length: Math.floor(count / size) }, (_, e) => e * size);
  return (k) => starts.flatMap((start) => places.map((parts) => parts.reduce((sum, part, i) => sum + part * at(start + i, k), 0)));
}

function redraw() {
  const b = branch(), found = shown(), { symbol, first, names } = found;
  if (!b.profile) {
    error.textContent = "";
    return empty(plot, "The files of this run have no strains, forces and moments:\nrun the scene again.");
  }
  const all = found.inSpace ? turned(b) : values(b.profile), size = b.profile.shape[1] * SIZE, i = b.drawn[state.row];
  const column = curves(all.subarray(i * size, (i + 1) * size), b.element[i]), s = column(0);
  const traces = names.map((name, i) => ({
    x: s,
    y: column(first + i),
    name,
    mode: "lines",
    line: LINES[i],
    hovertemplate: `s = %{x:.4g}<br>${symbol}${BELOW[i]} = %{y:.5g}, ${name}<extra></extra>`,
  }));
  const how = layout("arclength s", `${tab} ${symbol}`, { margin: { l: 46, r: 10, t: 6, b: 34 }, uirevision: tab });
  how.yaxis.range = range(b, found, NATURAL[symbol], all);
  const jump = b.jumps[symbol][state.row], largest = Math.max(...how.yaxis.range.map(Math.abs));
  error.textContent = jump > ROUND_OFF * largest ? `error ≈ ${jump.toExponential(0)}` : "error: ~";
  return draw(plot, traces, how);
}

function explain() {
  const { symbol, names, space: offered } = shown();
  choice.hidden = !offered;
  legend.replaceChildren(...LINES.map((line, i) => item(lineIcon(line.color, line.width, line.dash), `${symbol}${BELOW[i]} ${names[i]}`)));
}

// Redraw at once, but not more often than PAUSE while states follow each other quickly.
function soon() {
  if (waiting) return;
  const rest = Math.max(0, last + PAUSE - performance.now());
  waiting = setTimeout(() => {
    waiting = 0;
    last = performance.now();
    redraw();
  }, rest);
}

export function start() {
  const tabs = document.getElementById("profile-tabs");
  const buttons = Object.keys(TABS).map((name) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    button.addEventListener("click", () => {
      tab = name;
      mark();
      explain();
      redraw();
    });
    return button;
  });
  const mark = () => buttons.forEach((button) => button.setAttribute("aria-selected", button.textContent === tab));
  tabs.append(...buttons);
  mark();
  explain();
  space.addEventListener("change", () => {
    explain();
    redraw();
  });
  subscribe(soon);
}
