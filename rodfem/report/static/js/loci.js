// Loci of special points: their tab, their legend, and what a click in their plane shows.

import { data } from "report/data";
import { select, state, subscribe } from "report/store";
import { cursorOf } from "report/cursor";
import { area, item, lineIcon, symbol } from "report/icons";
import { bounds, drawPlane, MARK, REGION, STRIPE } from "report/plane";
import { INK, STABLE } from "report/styles";

const plot = document.getElementById("loci"), diagram = document.getElementById("diagram");
const legend = document.getElementById("loci-legend"), STILL = 4; // pixels that a click may move
let cursor = null;

// The state at a load: of the branch that is shown if it has the load, and of a stable piece if there is one.
function atLoad(load) {
  const found = data.branches.flatMap((b, number) => b.pieces.map(({ kind, rows: [a, z] }) => {
    const rows = Array.from({ length: z - a + 1 }, (_, i) => a + i), away = (row) => Math.abs(b.load[row] - load);
    const row = rows.reduce((best, each) => (away(each) < away(best) ? each : best)), loads = rows.map((each) => b.load[each]);
    const outside = load < loads.reduce((p, q) => Math.min(p, q)) || load > loads.reduce((p, q) => Math.max(p, q));
    return { number, row, cost: [outside ? away(row) + 1e-9 : 0, kind === STABLE ? 0 : 1, number === state.branch ? 0 : 1] };
  }));
  const before = (p, q) => p.cost.map((x, i) => x - q.cost[i]).find((x) => x) < 0;
  const best = found.reduce((one, other) => (before(other, one) ? other : one));
  select(best.number, best.row);
}

// A click on a curve or on the line shows that state, one elsewhere the state of the diagram at that load.
function listen() {
  let from = null;
  plot.on("plotly_click", (event) => {
    const place = event.points.find((point) => point.customdata)?.customdata;
    if (place) select(...place);
  });
  plot.addEventListener("pointerdown", (event) => (from = event), true);
  window.addEventListener("pointerup", (event) => {
    const still = from && Math.hypot(event.clientX - from.clientX, event.clientY - from.clientY) < STILL;
    from = null;
    if (!still || plot._hoverdata?.some((point) => point.customdata)) return;
    const { yaxis } = plot._fullLayout, y = event.clientY - plot.getBoundingClientRect().y - yaxis._offset;
    if (y >= 0 && y <= yaxis._length) atLoad(yaxis.p2l(y));
  });
}

function explain() {
  const has = (test) => data.loci.some((locus) => locus.index.some(test));
  legend.append(
    ...(data.loci.some((locus) => locus.region) ? [item(area(REGION), data.loci[0].words)] : []),
    item(lineIcon(INK, STRIPE), "stable states of this diagram"),
    ...(has(bounds) ? [item(lineIcon("#555", 4), "index 0 on one side")] : []),
    ...(has(([low]) => low > 0) ? [item(lineIcon("#555", 2), "greater index on both sides")] : []),
    ...(data.loci.some((locus) => locus.marks.length) ? [item(symbol(MARK), "turning point, cusp, end")] : []),
  );
}

async function show(wanted) {
  if (!wanted) return;
  await drawPlane(plot);
  if (cursor) return;
  cursor = cursorOf(plot);
  cursor(data.loci[0].here, state.load);
  listen();
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
    await show(name === "Loci");
    window.dispatchEvent(new Event("resize"));
  };
  if (buttons.length > 1) tabs.append(...buttons);
  else tabs.textContent = "Bifurcation diagram";
  if (data.loci.length) explain();
  buttons[0].setAttribute("aria-selected", true);
  subscribe(() => cursor?.(data.loci[0].here, state.load));
}
