// Loci of special points in the plane of the load and another parameter, linked to the load of the diagram.

import { data, digits, escaped } from "report/data";
import { select, state, subscribe } from "report/store";
import { cursorOf } from "report/cursor";
import { item, lineIcon, symbol } from "report/icons";
import { draw, layout } from "report/plotting";
import { BLUE, STABLE } from "report/styles";

const plot = document.getElementById("loci"), diagram = document.getElementById("diagram");
const DASHES = { "branch point": "solid", fold: "7px,3px", flutter: "7px,2px,2px,2px", divergence: "3px,3px" };
const MARK = { symbol: "triangle-up", size: 10, color: "white", line: { color: "black", width: 1.5 } };
const legend = document.getElementById("loci-legend");
let cursor = null;

const bounds = (pair) => pair[0] === 0;

function curve(locus) {
  const names = `${escaped(data.symbol)} = `;
  return {
    x: locus.x,
    y: locus.load,
    customdata: locus.load,
    text: locus.index.map((pair, i) => `${escaped(locus.kind)}, ${escaped(locus.file.replace(".json", ""))}<br>${names}${digits(locus.load[i])}<br>${escaped(locus.parameter)} = ${digits(locus.x[i])}${pair[0] < 0 ? "" : `<br>index ${pair[0]} on one side, ${pair[1]} on the other`}`),
    hovertemplate: "%{text}<extra></extra>",
    mode: "lines",
    line: { color: locus.colour, width: locus.index.some(bounds) ? 4 : 2, dash: DASHES[locus.kind] ?? "solid" },
  };
}

const label = (locus) => {
  const i = Math.floor(locus.x.length / 2), [low, high] = locus.index[i] ?? [-1];
  const text = low < 0 ? locus.kind : `${locus.kind} ${low}|${high}`;
  return { x: locus.x[i], y: locus.load[i], text: `<b>${escaped(text)}</b>`, showarrow: false, yshift: 12, font: { color: locus.colour, size: 13 }, bgcolor: "rgba(255,255,255,0.8)" };
};

const marks = (locus) => ({
  x: locus.marks.map((mark) => locus.x[mark.row]),
  y: locus.marks.map((mark) => locus.load[mark.row]),
  text: locus.marks.map((mark) => escaped(mark.kind)),
  hovertemplate: "%{text}<extra></extra>",
  mode: "markers",
  marker: MARK,
});

// Loads at which a branch of the diagram is stable, at the constant that it was computed for.
function stable(here) {
  const pieces = data.branches.flatMap((b) => b.pieces.filter((p) => p.kind === STABLE).map((p) => b.load.slice(p.rows[0], p.rows[1] + 1)));
  const ends = pieces.flatMap((loads) => [Math.min(...loads), Math.max(...loads), null]);
  return { x: ends.map((y) => (y === null ? null : here)), y: ends, mode: "lines", line: { color: BLUE, width: 7 }, opacity: 0.45, hovertemplate: "a stable state in the diagram<extra></extra>" };
}

function redraw() {
  const [first] = data.loci, here = { type: "line", x0: first.here, x1: first.here, y0: 0, y1: 1, yref: "paper", line: { color: "#8b95a1", width: 1.2, dash: "dot" } };
  const note = { x: first.here, y: 1, yref: "paper", text: `this diagram: ${escaped(first.parameter)} = ${digits(first.here)}`, showarrow: false, xanchor: "left", yanchor: "top", xshift: 5, font: { color: "#66707c" } };
  const traces = [stable(first.here), ...data.loci.map(curve), ...data.loci.map(marks)];
  return draw(plot, traces, layout(first.label, data.label, { shapes: [here], annotations: [...data.loci.map(label), note] }));
}

// Row of the branch that is shown, nearest to a load.
function atLoad(load) {
  const loads = data.branches[state.branch].load;
  const row = loads.reduce((best, x, i) => (Math.abs(x - load) < Math.abs(loads[best] - load) ? i : best), 0);
  select(state.branch, row, load);
}

function explain() {
  legend.append(
    item(lineIcon(BLUE, 7), "loads of this diagram with a stable state"),
    ...(data.loci.some((locus) => locus.index.some(bounds)) ? [item(lineIcon("#555", 4), "index 0 on one side")] : []),
    ...(data.loci.some((locus) => locus.index.some(([low]) => low > 0)) ? [item(lineIcon("#555", 2), "greater index on both sides")] : []),
    ...(data.loci.some((locus) => locus.marks.length) ? [item(symbol(MARK), "turning point, cusp, end")] : []),
  );
}

export async function start() {
  const tabs = document.getElementById("diagram-tabs"), plots = { Diagram: diagram, ...(data.loci.length ? { Loci: plot } : {}) };
  const buttons = Object.keys(plots).map((name) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    button.addEventListener("click", () => open(name));
    return button;
  });
  const open = async (name) => {
    buttons.forEach((button) => button.setAttribute("aria-selected", button.textContent === name));
    for (const [other, each] of Object.entries(plots)) each.hidden = other !== name;
    for (const id of ["legend", "ordinate-label"]) document.getElementById(id).hidden = name !== "Diagram";
    legend.hidden = name !== "Loci";
    if (name === "Loci") {
      await redraw();
      cursor ??= cursorOf(plot);
      cursor(data.loci[0].here, state.load);
      if (!plot.linked) plot.on("plotly_click", (event) => atLoad(event.points[0].y));
      plot.linked = true;
    }
    window.dispatchEvent(new Event("resize"));
  };
  if (buttons.length > 1) tabs.append(...buttons);
  else tabs.textContent = "Bifurcation diagram";
  explain();
  buttons[0].setAttribute("aria-selected", true);
  subscribe(() => cursor?.(data.loci[0].here, state.load));
}
