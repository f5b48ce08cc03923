// The bifurcation diagram: a trace for each piece of one index, special points, and the state that is shown; of loads
// without a potential the frequencies come first.

import { data, escaped, reading } from "report/data";
import { select, state, subscribe } from "report/store";
import { cursorOf } from "report/cursor";
import * as frequencies from "report/frequencies";
import { draw, layout } from "report/plotting";
import { DASHES, ENDS, SYMBOLS, UNEXPLAINED, WIDTHS } from "report/styles";

const plot = document.getElementById("diagram");
const choice = document.getElementById("ordinate");
const FREQUENCIES = { key: "frequencies", name: "frequencies" };
const ordinates = [...(frequencies.ANY ? [FREQUENCIES] : []), ...data.ordinates];
let ordinate = ordinates[0];
let cursor = null;

const heights = (branch) => branch.ordinates[ordinate.key];

// What is said of a row of a branch.
export function hover(branch, row) {
  const words = branch.told[branch.words[row]];
  const special = branch.special.find((x) => x.row === row);
  const lines = [
    `<b>${escaped(branch.name)}</b>, row ${row}`,
    `${escaped(data.symbol)} = ${escaped(reading(branch, row, "load"))}`,
    `${escaped(ordinate.name)} = ${escaped(reading(branch, row, ordinate.key))}`,
    `index ${escaped(words.index)}, ${words.verdict === "planar" ? "stable in the plane only" : words.verdict === "undecided" ? "stability undecided" : words.verdict}`,
    ...branch.endings.filter(([at]) => at === row).map(([, reason]) => `<b>ends here: ${escaped(reason)}</b>`),
    special ? `<b>${escaped(special.kind)}</b>${special.law ? `, ${escaped(special.law)}` : ""}` : "",
  ];
  return lines.filter(Boolean).join("<br>");
}

// Points between a row and the next, each with the row that it is nearest to.
const more = (found, row) => (found?.[0] ?? []).map((load, i, all) => [load, found[1][i], 2 * i < all.length ? row : row + 1]);

function line(branch, number, piece) {
  const [a, b] = piece.rows, between = branch.between[ordinate.key] ?? {};
  const rows = Array.from({ length: b - a + 1 }, (_, i) => a + i);
  const points = rows.flatMap((row) => [[branch.load[row], heights(branch)[row], row], ...(row < b ? more(between[row], row) : [])]);
  return {
    x: points.map(([load]) => load),
    y: points.map(([, value]) => value),
    customdata: points.map(([, , near]) => [number, near]),
    text: points.map(([, , near]) => hover(branch, near)),
    hovertemplate: "%{text}<extra></extra>",
    mode: "lines",
    line: { color: branch.colour, width: WIDTHS[piece.kind], dash: DASHES[piece.kind], simplify: false },
  };
}

// The image of a piece by a symmetry of the scene, which takes the scene's ordinate to its opposite.
function image(branch, number, piece) {
  const { x, y, customdata, line: { color, dash } } = line(branch, number, piece), words = `image of ${escaped(branch.name)}, not traced: ${escaped(branch.image)}`;
  return { x, y: y.map((value) => (value === null ? null : -value)), customdata, hovertemplate: `${words}<extra></extra>`, mode: "lines", opacity: 0.75, line: { color, width: 1.1, dash, simplify: false } };
}

function marks(branch, number, kind) {
  const rows = branch.special.filter((x) => x.drawn && x.kind === kind).map((x) => x.row);
  return points(branch, number, rows, SYMBOLS[kind]);
}

function points(branch, number, rows, marker) {
  return {
    x: rows.map((row) => branch.load[row]),
    y: rows.map((row) => heights(branch)[row]),
    customdata: rows.map((row) => [number, row]),
    text: rows.map((row) => hover(branch, row)),
    hovertemplate: "%{text}<extra></extra>",
    mode: "markers",
    cliponaxis: false,
    marker,
  };
}

// The index beside the middle of each piece that is long enough for it.
function labels() {
  const all = data.branches.flatMap((b) => b.load.map((x, i) => [x, heights(b)[i]])).filter((p) => p[1] !== null);
  const range = (k) => Math.max(...all.map((p) => p[k])) - Math.min(...all.map((p) => p[k])) || 1;
  const [width, height] = [range(0), range(1)];
  const found = [];
  for (const b of data.branches)
    for (const piece of b.pieces) {
      const [first, last] = piece.rows, y = heights(b), at = (i) => [b.load[i] / width, y[i] / height];
      let length = 0;
      for (let i = first; i < last; i++) length += Math.hypot(at(i + 1)[0] - at(i)[0], at(i + 1)[1] - at(i)[1]);
      const row = Math.round((first + last) / 2), [x, v] = at(row);
      if (length > 0.07 && y[row] !== null && !found.some((o) => Math.hypot(o.x - x, o.v - v) < 0.045)) found.push({ x, v, row, b, text: piece.index });
    }
  return found.map(({ b, row, text }) => ({
    x: b.load[row], y: heights(b)[row], text: `<b>${escaped(text)}</b>`, showarrow: false, yshift: 11, xshift: 7,
    font: { color: b.colour, size: 14 }, bgcolor: "rgba(255,255,255,0.75)", borderpad: 0, captureevents: false,
  }));
}

function traces() {
  const each = data.branches.map((branch, number) => [branch, number]);
  const thick = (trace) => -trace.line.width;
  const lines = each.flatMap(([b, i]) => b.pieces.map((piece) => line(b, i, piece))).sort((a, b) => thick(a) - thick(b));
  const images = ordinate.key === "ordinate" ? each.filter(([b]) => b.image).flatMap(([b, i]) => b.pieces.map((piece) => image(b, i, piece))) : [];
  const single = each.filter(([b]) => !b.pieces.length).map(([b, i]) => points(b, i, [0], { size: 7, color: b.colour }));
  const special = Object.keys(SYMBOLS).flatMap((kind) => each.map(([b, i]) => marks(b, i, kind)));
  const doubts = each.map(([b, i]) => points(b, i, b.unexplained, UNEXPLAINED));
  const ends = each.map(([b, i]) => points(b, i, b.endings.map(([row]) => row), ENDS));
  return [...images, ...lines, ...single, ...[...special, ...ends, ...doubts].filter((trace) => trace.x.length)];
}

function redraw() {
  document.body.dataset.ordinate = ordinate.key;
  if (ordinate === FREQUENCIES) return draw(plot, frequencies.traces(), frequencies.frame());
  return draw(plot, traces(), layout(data.label, ordinate.label, { annotations: labels(), uirevision: ordinate.key }));
}

function moveCursor() {
  const b = data.branches[state.branch];
  cursor(b.load[state.row], ordinate === FREQUENCIES ? null : (heights(b)[state.row] ?? undefined));
}

export async function start() {
  for (const [i, each] of ordinates.entries()) choice.add(new Option(each.name, i));
  choice.addEventListener("change", async () => {
    ordinate = ordinates[choice.value];
    await redraw();
    moveCursor();
  });
  await redraw();
  cursor = cursorOf(plot);
  plot.on("plotly_click", (event) => {
    const place = event.points.find((point) => point.customdata)?.customdata;
    if (place) select(place[0], place[1]);
  });
  subscribe(moveCursor);
}
