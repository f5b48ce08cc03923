// Strains along the rod: curvatures k and strains v along the directors, each by colour and dashes.

import { data, entry, values } from "report/data";
import { branch, state, subscribe } from "report/store";
import { item, lineIcon } from "report/icons";
import { draw, layout } from "report/plotting";

const plot = document.getElementById("profile");
const TABS = {
  "curvatures k": { first: 3, names: ["k<sub>1</sub>", "k<sub>2</sub>", "k<sub>3</sub>"] },
  "strains v": { first: 0, names: ["v<sub>1</sub>", "v<sub>2</sub>", "v<sub>3</sub>"] },
};
const LINES = [
  { color: "#0072b2", width: 2.4 },
  { color: "#d55e00", width: 2.4, dash: "7px,3px" },
  { color: "#009e73", width: 2.4, dash: "2px,2px" },
];
const LEAST = 1e-4; // difference of values up to which a quantity is drawn as constant
const PAUSE = 120; // milliseconds
let waiting = 0, last = 0;
let tab = Object.keys(TABS)[0];

// Range of a quantity over the whole branch, so that the axes stay while the state changes.
function range(b, first) {
  const key = `range${first}`;
  if (!b[key]) {
    const all = values(b.strain);
    let [low, high] = [Infinity, -Infinity];
    for (let i = 0; i < all.length; i += 6)
      for (let k = first; k < first + 3; k++) [low, high] = [Math.min(low, all[i + k]), Math.max(high, all[i + k])];
    const room = high - low > LEAST ? 0.06 * (high - low) : 0.5;
    b[key] = [low - room, high + room];
  }
  return b[key];
}

function redraw() {
  const b = branch(), { first, names } = TABS[tab], strain = entry(b.strain, state.row), s = Array.from(values(data.s));
  const traces = names.map((name, i) => ({
    x: s,
    y: s.map((_, n) => strain[n * 6 + first + i]),
    name,
    mode: "lines",
    line: LINES[i],
    hovertemplate: `s = %{x:.4g}<br>${name} = %{y:.5g}<extra></extra>`,
  }));
  const how = layout("s", "", { margin: { l: 46, r: 10, t: 6, b: 34 }, uirevision: tab });
  how.yaxis.range = range(b, first);
  draw(plot, traces, how);
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
      redraw();
    });
    return button;
  });
  const mark = () => buttons.forEach((button) => button.setAttribute("aria-selected", button.textContent === tab));
  tabs.append(...buttons);
  document.getElementById("profile-legend").append(...LINES.map((line, i) => item(lineIcon(line.color, line.width, line.dash), `${i + 1}`)));
  mark();
  subscribe(soon);
}
