// All states at one load, side by side: between two rows a state is interpolated for its picture.

import { counted, data, digits, unit } from "report/data";
import { select, state, subscribe, visible } from "report/store";
import { between, pointsOf } from "report/curve";
import { listeners, makeRod, makeStripe, ROD, shapeOf, stage as main } from "report/rod";
import { framed, Stage } from "report/stage";
import { PLANAR, STABLE, UNDECIDED } from "report/styles";

const slider = document.getElementById("load"), value = document.getElementById("load-value"), list = document.getElementById("states");
const loads = data.branches.flatMap((b) => b.load), low = Math.min(...loads), high = Math.max(...loads);
const GAP = 6; // between states, in pixels
const STEPS = 1000, MOST = 24, WAIT = 150; // milliseconds of rest before states are drawn
let stage = null, rod = null, stripe = null, waiting = 0;

// Segments of branches that have the load, with the place in them, and the index of their piece.
function statesAt(load) {
  const found = [];
  data.branches.forEach((b, number) => {
    for (const piece of visible(number) ? b.pieces : [])
      for (let row = piece.rows[0]; row < piece.rows[1]; row++) {
        const [x, y] = [b.load[row], b.load[row + 1]];
        const inside = x < y ? x <= load && (load < y || y === high) : y < load && load <= x;
        if (inside || (x > y && y === low && load === low)) found.push({ number, row, t: (load - x) / (y - x), piece });
      }
  });
  return found.sort((a, b) => parseInt(a.piece.index) - parseInt(b.piece.index));
}

const nearest = ({ row, t }) => row + (t > 0.5 ? 1 : 0);
const verdict = (kind) => (kind === STABLE ? "stable" : kind === PLANAR ? "planar" : kind === UNDECIDED ? "undecided" : "unstable");

function card(found) {
  const b = data.branches[found.number], button = document.createElement("button"), name = document.createElement("span");
  button.type = "button";
  button.title = `${b.name}, ${[found.piece.kind, counted(b, found.piece.index)].filter(Boolean).join(", ")}, between rows ${found.row} and ${found.row + 1}`;
  button.setAttribute("aria-pressed", found.number === state.branch && Math.abs(nearest(found) - state.row) <= 1);
  name.className = "name";
  const swatch = document.createElement("i"), index = document.createElement("b"), title = document.createElement("span");
  swatch.className = "swatch";
  swatch.style.background = b.colour;
  index.className = verdict(found.piece.kind);
  index.textContent = `${found.piece.kind === STABLE ? "●" : "◌"} ${counted(b, found.piece.index) || "stable"}`;
  title.textContent = b.name;
  name.append(swatch, index, title);
  const canvas = document.createElement("canvas");
  button.append(canvas, name);
  button.addEventListener("click", () => select(found.number, nearest(found)));
  return { button, canvas, found };
}

function shape({ number, row, t }) {
  const b = data.branches[number];
  return between(shapeOf(b, row), shapeOf(b, row + 1), t);
}

// Draw the states one after the other, in one scale and the direction of the large picture.
function paint(cards) {
  const { width, height } = cards[0]?.canvas.getBoundingClientRect() ?? {};
  if (!(width > 4 && height > 4)) return;
  const up = main.camera.up.clone(), direction = main.camera.position.clone().sub(main.target).normalize();
  const frames = cards.map(({ found }) => framed(pointsOf(shape(found)), up, direction)), room = 3 * data.radius;
  const unit = Math.max(...frames.map(({ wide, tall }) => Math.max((wide + room) / width, (tall + room) / height)));
  stage.resize(width, height);
  stage.half = Math.min(width, height) * unit;
  cards.forEach((card, i) => {
    stage.look(frames[i].middle, direction, up, main.camera.far);
    paintOne(card, width, height);
  });
}

function paintOne({ canvas, found }, width, height) {
  const ratio = Math.min(window.devicePixelRatio, 2);
  rod.update(shape(found));
  stripe.update(shape(found));
  stage.render();
  [canvas.width, canvas.height] = [width * ratio, height * ratio];
  canvas.getContext("2d").drawImage(stage.canvas, 0, 0);
}

function redraw() {
  const found = statesAt(state.load).slice(0, MOST), cards = found.map(card);
  const least = parseFloat(getComputedStyle(list).getPropertyValue("--least")) + GAP;
  list.classList.toggle("many", cards.length * least > list.clientWidth);
  list.replaceChildren(...cards.map((each) => each.button));
  if (!cards.length) list.textContent = "No branch has a state at this load.";
  paint(cards);
}

function later() {
  clearTimeout(waiting);
  if (list.childNodes.length) waiting = setTimeout(redraw, WAIT);
  else redraw();
}

// The nearest row of the branch that is shown, as far as it has the load; else of the first that has it.
function slide() {
  const load = low + ((high - low) * slider.value) / STEPS, found = statesAt(load);
  const near = (x) => (x.number === state.branch ? Math.abs(x.row - state.row) : Infinity);
  const here = found.sort((a, b) => near(a) - near(b) || 0)[0];
  if (here) select(here.number, nearest(here));
}

export function start() {
  stage = new Stage(document.createElement("canvas"));
  [rod, stripe] = [makeRod(ROD), makeStripe()];
  stage.scene.add(rod, stripe);
  slider.addEventListener("input", slide);
  listeners.push(later);
  new ResizeObserver(later).observe(list);
  subscribe(() => {
    slider.value = Math.round((STEPS * (state.load - low)) / (high - low || 1));
    value.textContent = `${data.symbol} = ${digits(state.load, 5)}${unit("load")}`;
    later();
  });
}
