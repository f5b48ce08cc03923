// The state in words: titles, verdict, and where the report comes from.

import { counted, data, digits, reading, rough, symbolOf, unit } from "report/data";
import { branch, state, subscribe, words } from "report/store";

const at = (id) => document.getElementById(id);
const MOST = 4; // eigenvalues in words
const SAME = 1e-6, COALESCED = 1e-3; // relative differences of eigenvalues that are one; round-off parts a double one by its root
const READ = data.ordinates.filter(({ key }, i) => !i || key === "energy");
const GLOSSARY = { stable: "stable", unstable: "unstable", planar: "stable in the plane, unstable in space", critical: "branch point", undecided: "undecided" };
const NAMES = { stable: "STABLE", unstable: "UNSTABLE", planar: "STABLE IN PLANE", critical: "CRITICAL", undecided: "UNDECIDED" };

function redraw() {
  const b = branch(), { verdict, index, sentence } = words(b, state.row), special = b.special.find((x) => x.row === state.row);
  at("badge").className = `badge ${verdict}`;
  at("badge").title = data.glossary[GLOSSARY[verdict]] ?? "";
  at("badge").textContent = [NAMES[verdict], counted(b, index)].filter(Boolean).join(" · ");
  at("state-load").textContent = `${data.symbol} = ${reading(b, state.row, "load")}${unit("load")}`;
  at("state").textContent = `${b.name}, row ${state.row} of ${b.load.length}`;
  const numbers = READ.map(({ key, name }, i) => `${name} = ${reading(b, state.row, key)}${unit(key)}${i < READ.length - 1 ? "; " : ""}`);
  at("numbers").replaceChildren(...numbers.map((words) => Object.assign(document.createElement("span"), { textContent: words })));
  values(b);
  at("sentence").textContent = sentence + (special?.law ? ` ${special.law[0].toUpperCase()}${special.law.slice(1)}.` : "");
}

// Left-most eigenvalues of the state, but for those that buttons of modes have.
function values(b) {
  const known = (b.modes[state.row] ?? []).map((mode) => mode.value);
  const near = b.special.some((x) => x.row === state.row && x.kind === "flutter") ? COALESCED : SAME;
  const same = (p, q) => Math.hypot(p[0] - q[0], Math.abs(p[1]) - Math.abs(q[1])) <= near * Math.hypot(...q);
  const all = b.spectrum?.[state.row]?.map((x) => [x, 0]) ?? b.omega2?.[state.row] ?? [];
  const found = all.filter((value) => value.some((x) => x) && !known.some((other) => same(value, other)));
  const each = found.slice(0, MOST).map(([x, y]) => {
    const span = document.createElement("span");
    span.className = x < 0 || y ? "negative" : "positive";
    span.textContent = `${y ? "×" : x < 0 ? "▼" : "●"} ${rough(x, 4)}${y ? ` ${y > 0 ? "+" : "−"} ${digits(Math.abs(y), 4)} i` : ""}`;
    return span;
  });
  const none = document.createElement("span");
  none.className = "quiet";
  if (!(b.spectrum || b.omega2 || known.length)) none.append("Values at every state: run with ", Object.assign(document.createElement("code"), { textContent: "--spectrum 4" }));
  none.title = "The command of this report, with this option besides: see About";
  at("values").replaceChildren(...(each.length ? [`${symbolOf(b)}:`, ...each] : none.hasChildNodes() ? [none] : []));
}

function line(list, name, text, code = false) {
  const [term, about] = [document.createElement("dt"), document.createElement("dd")];
  const inner = code ? document.createElement("code") : about;
  term.textContent = name;
  inner.textContent = text;
  if (code) about.append(inner);
  list.append(term, about);
}

function about() {
  const list = at("origin");
  line(list, "scene", data.scene);
  line(list, "computed by", data.program);
  for (const [name, text] of data.origin) line(list, name, text, name === "command");
  line(list, "discretisation", data.mesh);
  for (const [name, value] of Object.entries(data.constants)) line(list, name, digits(value, 17));
  line(list, "this page", `rodfem view ${data.folder}`, true);
  line(list, "shapes", "Rods are splines through the nodes of the mesh; states between rows are interpolated for their pictures.");
  line(list, "forces", "Contact force n and moment m are what the part of the rod to the right exerts on that to the left, along the directors. Where nothing acts strains and curvatures jump from element to element by as much as they are accurate; forces and moments are continuous, by the equations.");
  line(list, "libraries", "plotly.js and three.js, both under the MIT licence; the page needs no network.");
  at("about-button").addEventListener("click", () => at("about").showModal());
}

export function start() {
  at("title").textContent = data.title;
  at("constants").textContent = Object.entries(data.constants).map(([name, value]) => `${name} = ${digits(value)}`).join(", ") + (data.complete ? "" : " (the run is not complete)");
  at("constants").title = at("constants").textContent; // cut off in a narrow window
  at("notes").textContent = data.notes.length ? `not drawn: ${data.notes.join(", ")}` : "";
  about();
  subscribe(redraw);
}
