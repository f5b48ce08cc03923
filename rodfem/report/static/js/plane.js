// The plane of the load and another parameter: loci, stable regions, and the line of the diagram with its states.

import { data, digits, escaped, rough } from "report/data";
import { hover } from "report/diagram";
import { draw, layout } from "report/plotting";
import { STABLE, SYMBOLS } from "report/styles";

const LINES = { "branch point": "solid", fold: "7px,3px", flutter: "7px,2px,2px,2px", divergence: "3px,3px" };
export const MARK = { symbol: "triangle-up", size: 10, color: "white", line: { color: "black", width: 1.5 } };
export const REGION = "#ddf0e8", STRIPE = 6;
const ROOM = 0.08, PARTS = [0, 0.2, 0.4, 0.6, 0.8, 1];
const WIDE = 0.12, TALL = 0.025, BESIDE = 0.04; // halves of a label and its distance, in shares of the plane

// Whether stability ends on a locus.
export const bounds = (pair) => pair[0] === 0;

// What lies between the stable side of a locus and the next one.
const region = ({ region: [x, edge, end] }) => ({
  x: [...x, ...x.toReversed()], y: [...edge, ...end.toReversed()],
  mode: "lines", line: { width: 0 }, fill: "toself", fillcolor: REGION, hoverinfo: "skip",
});

// The other parameter and the load of a row, with the bounds of their errors where these are estimated.
const reading = (locus, row) => (locus.readings[row].length ? locus.readings[row] : [rough(locus.x[row]), rough(locus.load[row])]);

function curve(locus) {
  const shown = locus.special.map(([branch]) => data.branches[branch].name), here = `${escaped(locus.parameter)} = ${digits(locus.here)}`;
  const link = shown.length ? `<br><i>click: the ${escaped(locus.kind)} of ${escaped(shown[0])} at ${here}</i>` : "";
  return {
    x: locus.x,
    y: locus.load,
    customdata: locus.load.map((load) => passed(locus, load)),
    text: locus.index.map((pair, i) => `<b>${escaped(locus.kind)}</b>, ${escaped(locus.file.replace(".json", ""))}<br>${escaped(data.symbol)} = ${escaped(reading(locus, i)[1])}, ${escaped(locus.parameter)} = ${escaped(reading(locus, i)[0])}${pair[0] < 0 ? "" : `<br>index${locus.plane} ${pair[0]} on one side, ${pair[1]} on the other`}${link}`),
    hovertemplate: "%{text}<extra></extra>",
    mode: "lines",
    line: { color: locus.colour, width: locus.index.some(bounds) ? 4 : 2, dash: LINES[locus.kind] ?? "solid" },
  };
}

// Branch and row of the special point on a locus that is nearest to a load.
function passed(locus, load) {
  const away = ([branch, row]) => Math.abs(data.branches[branch].load[row] - load);
  return locus.special.reduce((best, each) => (!best || away(each) < away(best) ? each : best), null);
}

// Points of all curves, close to each other.
const dense = () => data.loci.flatMap(({ x, load }) => x.slice(1).flatMap((_, i) => PARTS.map((t) => [x[i] + t * (x[i + 1] - x[i]), load[i] + t * (load[i + 1] - load[i])])));

// The kinds of the curves and the indices on both sides, above or below, where they cover least; and in the regions, 0.
function labels([low, high]) {
  const all = data.loci.flatMap((locus) => locus.x), width = Math.max(...all) - Math.min(...all) || 1, height = high - low;
  const taken = dense(), found = [];
  for (const { x, load, index, kind, colour } of data.loci) {
    const places = [0.5, 0.7, 0.3, 0.85, 0.15].flatMap((share) => [1, -1].map((side) => ({ i: Math.round(share * (x.length - 1)), side })));
    const room = ({ i, side }) => taken.reduce((least, [u, v]) => Math.min(least, Math.max(Math.abs(u - x[i]) / width / WIDE, Math.abs(v - load[i] - side * BESIDE * height) / height / TALL)), 1);
    const { i, side } = places.reduce((best, place) => (room(place) > room(best) ? place : best)), [lower, higher] = index[i] ?? [-1];
    taken.push([x[i] - 0.5 * WIDE * width, load[i] + side * BESIDE * height], [x[i] + 0.5 * WIDE * width, load[i] + side * BESIDE * height]);
    found.push(label(x[i], load[i], lower < 0 ? kind : `${kind} ${lower}|${higher}`, colour, 13 * side));
  }
  for (const { region: [x, edge, end], plane } of data.loci.filter((locus) => locus.region)) {
    const i = Math.round(0.5 * x.length), middle = 0.5 * (edge[i] + end[i]);
    if (Math.abs(edge[i] - end[i]) > 4 * TALL * height) found.push(label(x[i], middle, `stable${plane}: index 0`, "#1d6b52", 0, "rgba(255,255,255,0)"));
  }
  return found;
}

const label = (x, y, text, color, yshift, bgcolor = "rgba(255,255,255,0.8)") => ({ x, y, text: `<b>${escaped(text)}</b>`, showarrow: false, yshift, font: { color, size: 13 }, bgcolor, borderpad: 0, captureevents: false });

const marks = (locus) => ({
  x: locus.marks.map((mark) => locus.x[mark.row]),
  y: locus.marks.map((mark) => locus.load[mark.row]),
  text: locus.marks.map((mark) => escaped(mark.kind)),
  hovertemplate: "%{text}<extra></extra>",
  mode: "markers",
  marker: MARK,
});

// Rows of branches on the line of the diagram: `style` is that of a trace.
const on = (number, rows, style) => ({
  x: rows.map(() => data.loci[0].here),
  y: rows.map((row) => data.branches[number].load[row]),
  customdata: rows.map((row) => [number, row]),
  text: rows.map((row) => hover(data.branches[number], row)),
  hovertemplate: "%{text}<extra></extra>",
  ...style,
});

// Stable parts of the branches, each in its colour, and the special points of all: what the diagram has at its constant.
function line() {
  const each = data.branches.map((branch, number) => ({ branch, number }));
  const stable = each.flatMap(({ branch, number }) => branch.pieces.filter((p) => p.kind === STABLE).map(({ rows: [a, b] }) =>
    on(number, Array.from({ length: b - a + 1 }, (_, i) => a + i), { mode: "lines", opacity: 0.55, line: { color: branch.colour, width: STRIPE, simplify: false } })));
  const special = each.flatMap(({ branch, number }) => branch.special.filter((x) => x.drawn).map(({ kind, row }) =>
    on(number, [row], { mode: "markers", marker: SYMBOLS[kind] })));
  return [...stable, ...special];
}

// Loads of the curves and of the regions, with some room.
function range() {
  const all = data.loci.flatMap(({ load, region: found }) => [...load, ...(found ? [...found[1], ...found[2]] : [])]);
  const [low, high] = [all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b))], room = ROOM * (high - low) || 1;
  return [low - room, high + 1.5 * room];
}

// Draw the plane.
export function drawPlane(plot) {
  const [first] = data.loci, here = { type: "line", x0: first.here, x1: first.here, y0: 0, y1: 1, yref: "paper", line: { color: "#8b95a1", width: 1.2, dash: "dot" } };
  const right = first.here > (Math.min(...first.x) + Math.max(...first.x)) / 2;
  const note = { x: first.here, y: 0, yref: "paper", text: `this diagram: ${escaped(first.parameter)} = ${digits(first.here)}`, showarrow: false, xanchor: right ? "right" : "left", yanchor: "bottom", xshift: right ? -9 : 9, font: { color: "#66707c" } };
  const traces = [...data.loci.filter((locus) => locus.region).map(region), ...data.loci.map(curve), ...data.loci.filter((locus) => locus.marks.length).map(marks), ...line()];
  const how = layout(first.label, data.label, { shapes: [here], annotations: [...labels(range()), note], uirevision: "loci" });
  how.yaxis.range = range();
  return draw(plot, traces, how);
}
