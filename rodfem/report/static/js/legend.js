// The legend: branches, which it selects, kinds of lines, and kinds of special points.

import { data } from "report/data";
import { select, state, subscribe } from "report/store";
import { item, lineIcon, symbol } from "report/icons";
import { DASHES, ENDS, SYMBOLS, UNEXPLAINED, WIDTHS } from "report/styles";

function swatch(colour) {
  const drawn = document.createElement("i");
  drawn.className = "swatch";
  drawn.style.background = colour;
  return drawn;
}

export function start() {
  const legend = document.getElementById("legend");
  const buttons = data.branches.map((branch, i) => {
    const button = item(swatch(branch.colour), branch.name, "button");
    button.type = "button";
    button.title = branch.ended ? `${branch.load.length} states; ended: ${branch.ended}` : "";
    button.addEventListener("click", () => select(i, Math.floor(branch.load.length / 2)));
    return button;
  });
  const kinds = new Set(data.branches.flatMap((b) => b.pieces.map((piece) => piece.kind)));
  const lines = Object.keys(DASHES).filter((kind) => kinds.has(kind));
  const special = new Set(data.branches.flatMap((b) => b.special.filter((x) => x.drawn).map((x) => x.kind)));
  const names = { user: "requested load" };
  legend.append(
    ...buttons,
    ...lines.map((kind) =>
      item(lineIcon("#555", WIDTHS[kind], DASHES[kind]), kind),
    ),
    ...Object.keys(SYMBOLS).filter((kind) => special.has(kind)).map((kind) => item(symbol(SYMBOLS[kind]), names[kind] ?? kind)),
    ...[...new Set(data.branches.map((b) => b.image).filter(Boolean))].map((words) => item(lineIcon("#555", 1.1), `image, not traced: ${words}`)),
    ...[...new Set(data.branches.flatMap((b) => b.endings.map(([, reason]) => reason)))].map((reason) => item(symbol(ENDS), `ends: ${reason}`)),
    ...(data.branches.some((b) => b.unexplained.length) ? [item(symbol(UNEXPLAINED), "index change unexplained")] : []),
  );
  subscribe(() => buttons.forEach((button, i) => button.setAttribute("aria-pressed", i === state.branch)));
}
