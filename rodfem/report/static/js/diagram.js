// The bifurcation diagram: a trace for each piece of one index, special points, and the state that is shown; of loads
// without a potential the frequencies come first.

import { data, escaped, reading, unit } from "report/data";
import { select, state, subscribe, visible } from "report/store";
import * as address from "report/address";
import { cursorOf } from "report/cursor";
import * as frequencies from "report/frequencies";
import { draw, layout } from "report/plotting";
import { DASHES, ENDS, SYMBOLS, UNEXPLAINED, WIDTHS } from "report/styles";

const plot = document.getElementById("diagram");
const choice = document.getElementById("ordinate");
const FREQUENCIES = { key: "frequencies", name: "frequencies" };
const ordinates = [...(frequencies.ANY ? [FREQUENCIES] : []), ...data.ordinates];
const NAMED = 12, MANY = 1500; // branches up to which each has its name in the plot; places that labels keep clear of
const LETTER = 0.0095, TALL = 0.03, AWAY = [0.022, 0.05]; // half the size of a label, for each letter, and its distances: shares of the plot
const CLEAR = [14, 20]; // the same in pixels: the ring of the state that is shown has a radius of 10 with its edge
const LINE = 0.03; // half the height that a label keeps clear of others
const SHORTEST = 0.07, LEAST = 0.7; // pieces without a label; room for a name, of what it takes
const SHARES = [0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.2]; // of a piece at which a label may stand
const SIDES = [[0, 1], [0, -1], [1, 0], [-1, 0]]; // of a row at which it may
let ordinate = ordinates[address.chosen("ordinate", ordinates.map((each) => each.key), 0)];
let cursor = null, hidden = "";

const heights = (branch) => branch.ordinates[ordinate.key];

// What is said of a row of a branch.
export function hover(branch, row) {
  const words = branch.told[branch.words[row]];
  const special = branch.special.find((x) => x.row === row);
  const lines = [
    `<b>${escaped(branch.name)}</b>, row ${row}`,
    `${escaped(data.symbol)} = ${escaped(reading(branch, row, "load") + unit("load"))}`,
    `${escaped(ordinate.name)} = ${escaped(reading(branch, row, ordinate.key) + unit(ordinate.key))}`,
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

// The index beside each piece that is long enough for it, and the name beside its branch, where they cover least.
function labels() {
  const all = data.branches.flatMap((b) => b.load.map((x, i) => [x, heights(b)[i]])).filter((p) => p[1] !== null);
  const range = (k) => all.reduce((most, p) => Math.max(most, p[k]), -Infinity) - all.reduce((least, p) => Math.min(least, p[k]), Infinity) || 1;
  const size = [range(0), range(1)], at = (b, row) => [b.load[row] / size[0], heights(b)[row] / size[1]];
  const special = data.branches.flatMap((b) => b.special.filter((x) => x.drawn && heights(b)[x.row] !== null).map((x) => at(b, x.row)));
  const taken = [...all.filter((_, i) => i % Math.ceil(all.length / MANY) === 0).map(([x, y]) => [x / size[0], y / size[1]]), ...special];
  // Writes a text beside one of the rows of a branch, if there is as much room as is wanted.
  const place = (b, rows, text, wide, wanted, style) => {
    const room = ([x, v]) => taken.reduce((least, [p, q]) => Math.min(least, Math.max(Math.abs(p - x) / wide, Math.abs(q - v) / TALL)), 1);
    const places = rows.filter((row) => heights(b)[row] !== null).flatMap((row) => SIDES.map(([right, up]) => {
      const [x, v] = at(b, row), middle = [x + (wide + AWAY[0]) * right, v + AWAY[1] * up];
      return { row, right, up, middle, room: room(middle) };
    }));
    const best = places.reduce((one, other) => (one && one.room >= other.room ? one : other), null);
    if (!best || best.room < wanted) return [];
    taken.push(...[-0.8, 0, 0.8].flatMap((share) => [-1, 0, 1].map((side) => [best.middle[0] + share * wide, best.middle[1] + side * LINE])));
    const { row, right, up } = best, xanchor = ["right", "center", "left"][right + 1];
    return [{ x: b.load[row], y: heights(b)[row], text, showarrow: false, yshift: CLEAR[1] * up, xshift: CLEAR[0] * right, xanchor, font: { color: b.colour, ...style }, bgcolor: "rgba(255,255,255,0.75)", borderpad: 0, captureevents: false }];
  };
  const rowsOf = (first, last) => SHARES.map((share) => Math.round(first + share * (last - first)));
  const shown = data.branches.filter((_, number) => visible(number));
  const indices = shown.flatMap((b) => b.pieces.flatMap(({ rows: [first, last], index }) => {
    let length = 0;
    for (let i = first; i < last; i++) length += Math.hypot(...at(b, i + 1).map((x, k) => x - at(b, i)[k]));
    return length > SHORTEST ? place(b, rowsOf(first, last), `<b>${escaped(index)}</b>`, LETTER * Math.max(index.length, 2), 0, { size: 14 }) : [];
  }));
  const named = shown.length > NAMED ? [] : shown;
  return [...indices, ...named.flatMap((b) => place(b, rowsOf(0, b.load.length - 1), escaped(b.name), LETTER * b.name.length, LEAST, { size: 12 }))];
}

function traces() {
  const each = data.branches.map((branch, number) => [branch, number]).filter(([, number]) => visible(number));
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
  if (hidden !== [...state.hidden].join()) redraw();
  hidden = [...state.hidden].join();
  address.write({ branch: data.branches[state.branch].name, row: state.row, ordinate: ordinate.key });
  const b = data.branches[state.branch];
  cursor(b.load[state.row], ordinate === FREQUENCIES ? null : (heights(b)[state.row] ?? undefined));
}

export async function start() {
  for (const [i, each] of ordinates.entries()) choice.add(new Option(each.name, i));
  choice.value = ordinates.indexOf(ordinate);
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
