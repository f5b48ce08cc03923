// Left-most eigenvalues along the branch, by sign: negative ones are triangles, positive ones circles. They are those of
// every row where a run was asked for that, else those of the states that have modes; where there are none, the index.

import { data, digits, escaped, rough, symbolOf } from "report/data";
import { branch, select, state, subscribe } from "report/store";
import { cursorOf } from "report/cursor";
import { draw, layout } from "report/plotting";
import { DASHES, INK, PLANAR, UNSTABLE } from "report/styles";

const plot = document.getElementById("spectrum");
const TALL = 150; // pixels that an axis takes with its name in words
let shown = null, cursor = null;

const KINDS = [
  { name: "positive", test: ([x, y]) => !y && x > 0, marker: { symbol: "circle", size: 6, color: INK } },
  { name: "zero", test: ([x, y]) => !y && x === 0, marker: { symbol: "circle-open", size: 5, color: "#555" } },
  { name: "negative", test: ([x, y]) => !y && x < 0, marker: { symbol: "triangle-down-open", size: 8, color: INK } },
  { name: "complex", test: ([, y]) => y !== 0, marker: { symbol: "x-thin", size: 6, line: { color: INK, width: 1.8 } } },
];

// Eigenvalues of the rows that have modes, without those of symmetries.
const ofModes = (b) => Object.entries(b.modes).map(([row, modes]) => [Number(row), modes.filter((mode) => mode.motion !== "symmetry").map((mode) => mode.value)]);

// Row and value of all eigenvalues that a branch has recorded.
function recorded(b) {
  const every = b.spectrum?.map((each) => each.map((x) => [x, 0])) ?? b.omega2;
  return (every ? [...every.entries()] : ofModes(b)).flatMap(([row, each]) => each.map((value) => ({ row, value })));
}

// Dotted lines that join the least eigenvalues of the states with modes, the second ones, and so on: these are continuous.
function guides(b) {
  if (b.spectrum || b.omega2) return [];
  const rows = ofModes(b), most = Math.max(...rows.map(([, each]) => each.length));
  return Array.from({ length: most }, (_, k) => ({
    x: rows.map(([row]) => b.load[row]),
    y: rows.map(([, each]) => each[k]?.[0] ?? null),
    mode: "lines",
    hoverinfo: "skip",
    line: { color: "#aab4be", width: 1, dash: "1px,3px" },
  }));
}

// All eigenvalues; of squared frequencies the lowest two that are not zero, which may meet.
function range(b, all) {
  const lowest = (each) => each.map(([x]) => x).filter((x) => x).slice(0, 2);
  const highest = b.omega2 ? b.omega2.flatMap(lowest) : all.map((each) => each.value[0]);
  const low = Math.min(0, ...all.map((each) => each.value[0])), high = Math.max(0, ...highest), room = 0.07 * (high - low) || 1;
  return [low - room, high + room];
}

// The index of each piece against the load.
function counts(b) {
  const traces = b.pieces.map(({ rows: [first, last], index, kind }) => {
    const rows = Array.from({ length: last - first + 1 }, (_, i) => first + i), count = parseInt(index);
    return {
      x: rows.map((row) => b.load[row]),
      y: rows.map(() => count),
      customdata: rows,
      text: rows.map((row) => `row ${row}, ${escaped(data.symbol)} = ${digits(b.load[row])}<br>negative eigenvalues: ${escaped(index)}`),
      hovertemplate: "%{text}<extra></extra>",
      mode: "lines",
      line: { color: INK, width: 4, dash: DASHES[count ? UNSTABLE : kind] },
    };
  });
  const how = layout(data.label, "index", { margin: { l: 60, r: 8, t: 4, b: 34 }, uirevision: b.name });
  const most = Math.max(1, ...b.pieces.map((piece) => parseInt(piece.index)));
  Object.assign(how.yaxis, { range: [-0.2 * most, 1.4 * most], dtick: Math.ceil(most / 4) });
  finish(traces, how);
}

function finish(traces, how) {
  draw(plot, traces, how);
  if (cursor) return;
  cursor = cursorOf(plot);
  plot.on("plotly_click", (event) => select(state.branch, event.points[0].customdata));
}

function redraw() {
  const b = branch(), all = recorded(b);
  shown = b;
  if (!all.length) return counts(b);
  const words = ({ row, value: [x, y] }) => `row ${row}, ${escaped(data.symbol)} = ${digits(b.load[row])}<br>${symbolOf(b)} = ${rough(x)}${y ? ` ± ${digits(Math.abs(y))} i` : ""}`;
  const traces = KINDS.map(({ name, test, marker }) => {
    const found = all.filter((each) => test(each.value));
    return {
      x: found.map((each) => b.load[each.row]),
      y: found.map((each) => each.value[0]),
      customdata: found.map((each) => each.row),
      text: found.map((each) => `${name}: ${words(each)}`),
      hovertemplate: "%{text}<extra></extra>",
      mode: "markers",
      marker,
    };
  });
  const title = b.omega2 ? `Re ${symbolOf(b)}` : plot.clientHeight < TALL ? "μ" : "eigenvalue μ";
  const how = layout(data.label, title, { margin: { l: 60, r: 8, t: 4, b: 34 }, uirevision: b.name });
  how.yaxis.range = range(b, all);
  finish([...guides(b), ...traces], how);
}

export function start() {
  subscribe(() => {
    if (shown !== branch()) redraw();
    cursor?.(branch().load[state.row], null);
  });
}
