// Frequencies against the load, for loads without a potential: what changes where the shape does not.

import { data, digits, escaped } from "report/data";
import { layout } from "report/plotting";
import { SYMBOLS } from "report/styles";

const each = data.branches.map((branch, number) => ({ number, ...branch.frequencies })).filter((branch) => branch.curves);
export const ANY = each.length > 0;
export const PARTS = {
  frequency: { mode: "lines", dash: "solid", width: 2.6 },
  "complex pair, real part": { mode: "lines", dash: "6px,3px", width: 2 },
  "complex pair, imaginary part": { mode: "lines", dash: "2px,3px", width: 2 },
  "diverged, growth rate": { mode: "lines", dash: "2px,3px", width: 2 },
};
const ROOM = 1.15, ENOUGH = 0.04; // height over the greatest frequency; least width, in parts of the axis, of named ranges

const known = (values) => values.some((value) => value !== null);
const unique = (all, key) => [...new Map(all.map((one) => [key(one), one])).values()];
export const motions = () => unique(each.flatMap((branch) => branch.curves), (curve) => curve.motion);
export const parts = () => Object.keys(PARTS).filter((part) => each.some((branch) => branch.curves.some((curve) => known(curve.parts[part]))));
export const marked = () => new Set(each.flatMap((branch) => branch.marks.map((one) => one.kind)));
export const ranges = () => unique(each.flatMap((branch) => branch.ranges), (range) => range.words);

function line(number, curve, part) {
  const { mode, dash, width } = PARTS[part];
  return {
    x: curve.load,
    y: curve.parts[part],
    customdata: curve.rows.map((row) => [number, row]),
    text: curve.load.map((load, i) => `<b>${escaped(data.branches[number].name)}</b>, row ${curve.rows[i]}<br>${escaped(data.symbol)} = ${digits(load)}<br>${escaped(curve.motion)}<br>${part}: ~${digits(curve.parts[part][i], 5)}`),
    hovertemplate: "%{text}<extra></extra>",
    mode,
    line: { color: curve.colour, width, dash, simplify: false },
  };
}

const mark = (number, { kind, row, frequency }) => ({
  x: [data.branches[number].load[row]],
  y: [frequency],
  customdata: [[number, row]],
  text: `<b>${escaped(kind)}</b><br>${escaped(data.symbol)} = ${escaped(data.branches[number].readings[row]?.load ?? digits(data.branches[number].load[row]))}<br>ω = ~${digits(frequency)}`,
  hovertemplate: "%{text}<extra></extra>",
  mode: "markers",
  cliponaxis: false,
  marker: SYMBOLS[kind],
});

export function traces() {
  const lines = each.flatMap(({ number, curves }) => curves.flatMap((curve) => Object.keys(PARTS).filter((part) => known(curve.parts[part])).map((part) => line(number, curve, part))));
  return [...lines, ...each.flatMap(({ number, marks }) => marks.map((one) => mark(number, one)))];
}

// Axes, shaded ranges, their names, and the special loads.
export function frame() {
  const highest = Math.max(...each.map((branch) => branch.top)) * ROOM, loads = data.branches.flatMap((b) => b.load);
  const wide = loads.reduce((a, b) => Math.max(a, b)) - loads.reduce((a, b) => Math.min(a, b)) || 1, all = each.flatMap((branch) => branch.ranges);
  const shapes = all.map(({ low, high, shade }) => ({ type: "rect", layer: "below", x0: low, x1: high, y0: 0, y1: 1, yref: "paper", line: { width: 0 }, fillcolor: shade }));
  const names = all.filter(({ low, high }) => high - low > ENOUGH * wide).map(({ low, high, words }) => ({ x: (low + high) / 2, y: 0.99, yref: "paper", yanchor: "top", text: `<b>${escaped(words.replace("range of ", ""))}</b>`, showarrow: false, font: { color: "#a34700" } }));
  const loadsOf = each.flatMap(({ number, marks }) => marks.map(({ row, frequency }) => ({ x: data.branches[number].load[row], y: frequency, text: digits(data.branches[number].load[row], 6), showarrow: false, xanchor: "left", xshift: 8, yshift: -16 })));
  const how = layout(data.label, "frequency ω", { shapes, annotations: [...names, ...loadsOf], uirevision: "frequencies" });
  how.yaxis.range = [0, highest];
  return how;
}
