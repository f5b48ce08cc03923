// The legend: branches, which it selects, kinds of lines, and kinds of special points.

import { data } from "report/data";
import { select, state, subscribe, toggle, visible } from "report/store";
import * as frequencies from "report/frequencies";
import { area, item, lineIcon, symbol } from "report/icons";
import { DASHES, ENDS, SYMBOLS, UNEXPLAINED, WIDTHS } from "report/styles";

function swatch(colour) {
  const drawn = document.createElement("i");
  drawn.className = "swatch";
  drawn.style.background = colour;
  return drawn;
}

// The glossary's words on an item show where the pointer rests.
function explained(one, word) {
  one.title = data.glossary[word] ?? "";
  return one;
}

// The swatch of a branch hides it, or shows it again.
function hides(button, number) {
  const drawn = button.querySelector(".swatch");
  drawn.title = "hide or show this branch";
  drawn.addEventListener("click", (event) => {
    event.stopPropagation();
    toggle(number);
  });
}

// Entries that belong to one kind of picture: they stand where it does.
const only = (name, items) => items.map((one) => (one.classList.add(name), one));

const ofFrequencies = () => [
  ...frequencies.motions().map(({ motion, colour }) => item(lineIcon(colour, 3), motion)),
  ...frequencies.parts().slice(1).map((part) => item(lineIcon("#555", frequencies.PARTS[part].width, frequencies.PARTS[part].dash), part)),
  ...frequencies.ranges().map(({ words, shade }) => item(area(shade), words)),
];

export function start() {
  const legend = document.getElementById("legend");
  const buttons = data.branches.map((branch, i) => {
    const button = item(swatch(branch.colour), branch.name, "button");
    button.type = "button";
    button.title = branch.ended ? `${branch.load.length} states; ended: ${branch.ended}` : "";
    button.addEventListener("click", () => select(i, Math.floor(branch.load.length / 2)));
    if (data.branches.length > 1) hides(button, i);
    return button;
  });
  const kinds = new Set(data.branches.flatMap((b) => b.pieces.map((piece) => piece.kind)));
  const lines = Object.keys(DASHES).filter((kind) => kinds.has(kind));
  const special = new Set(data.branches.flatMap((b) => b.special.filter((x) => x.drawn).map((x) => x.kind)));
  const names = { user: "requested load" };
  legend.append(
    ...buttons,
    ...only("of-rows", lines.map((kind) => explained(item(lineIcon("#555", WIDTHS[kind], DASHES[kind]), kind), kind))),
    ...only("of-frequencies", ofFrequencies()),
    ...Object.keys(SYMBOLS).filter((kind) => special.has(kind)).flatMap((kind) => only(frequencies.marked().has(kind) ? "of-both" : "of-rows", [explained(item(symbol(SYMBOLS[kind]), names[kind] ?? kind), kind)])),
    ...[...new Set(data.branches.map((b) => b.image).filter(Boolean))].map((words) => item(lineIcon("#555", 1.1), `image, not traced: ${words}`)),
    ...[...new Set(data.branches.flatMap((b) => b.endings.map(([, reason]) => reason)))].map((reason) => item(symbol(ENDS), `ends: ${reason}`)),
    ...(data.branches.some((b) => b.unexplained.length) ? [item(symbol(UNEXPLAINED), "index change unexplained")] : []),
  );
  subscribe(() => buttons.forEach((button, i) => {
    button.setAttribute("aria-pressed", i === state.branch);
    button.classList.toggle("hidden-branch", !visible(i));
  }));
}
