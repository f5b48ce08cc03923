// The rod in space: the state that is shown, the first one in grey, supports and loads, and a mode that moves.

import { Vector3 } from "three";
import { OrbitControls } from "three/orbit";
import { data, entry, mapStarts, values } from "report/data";
import { branch, state, subscribe } from "report/store";
import { moved, pointsOf } from "report/curve";
import { amplitude, PERIOD } from "report/motion";
import { drawOverlay } from "report/overlay";
import { Solids } from "report/solids";
import * as stiffen from "report/stiffen";
import { framed, Stage } from "report/stage";
import { Tube } from "report/tube";
import { svgOf } from "report/vector";
import { VIEWS } from "report/views";

export const ROD = "#9cc4e6", STRIPE = "#1f3a5f", FIRST = "#b9bec5";
const stations = data.s.shape[0];
const box = document.getElementById("stage"), overlay = document.getElementById("overlay");
const show = { first: document.getElementById("show-first"), bodies: document.getElementById("show-bodies") };
const choice = document.getElementById("view");

export const makeRod = (colour, opacity) => new Tube(data.outline, values(data.outline), stations, true, colour, opacity);
export const makeStripe = () => new Tube(data.stripe, values(data.stripe), stations, false, STRIPE);
export const shapeOf = (b, row) => entry(b.shape, b.drawn[row]);
export const stage = new Stage(document.getElementById("rod"));
const rod = makeRod(ROD), stripe = makeStripe(), first = makeRod(FIRST, 0.55), solids = new Solids();
Object.assign(first.material, { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4 }); // behind the state where they coincide
let controls = null, pending = false, turned = false;
export const listeners = []; // of changes of the view

// Draw now: what has another size is empty until it is drawn, and a hidden or printed page has no further frame.
function draw() {
  stage.render();
  drawOverlay(overlay.getContext("2d"), stage, Math.min(window.devicePixelRatio, 2));
}

// Draw in the next frame.
function redraw() {
  if (pending) return;
  pending = true;
  requestAnimationFrame((time) => {
    pending = false;
    if (state.mode) {
      update(time);
      redraw();
    }
    draw();
  });
}

function update(time = 0) {
  const b = branch(), start = mapStarts(b)[state.row], numbers = b.bodies[state.row];
  const maps = values(b.maps).subarray(start * 12, (start + numbers.length) * 12), mode = state.mode;
  let shape = shapeOf(b, state.row), a = [];
  if (mode) {
    a = amplitude(mode, (time % PERIOD) / PERIOD).slice(0, mode.parts.length);
    shape = moved(shape, mode.parts.map(values), a);
  }
  rod.update(shape);
  rod.paint(stiffen.colours());
  stripe.update(shape);
  solids.update(numbers, maps, mode ? mode.maps.map(values) : [], a);
  first.update(mode ? shapeOf(b, state.row) : shapeOf(data.branches[0], 0));
  first.visible = Boolean(mode) || show.first.checked;
  solids.visible = show.bodies.checked;
}

// Points of the state that is shown, and of the first one.
function shown() {
  const shapes = [shapeOf(branch(), state.row), ...(show.first.checked ? [shapeOf(data.branches[0], 0)] : [])];
  return [...shapes.flatMap(pointsOf), ...solids.corners];
}

// Look along the chosen direction, or on in that of the picture, at the states that are shown.
function look(kept = false) {
  turned = kept && turned;
  const { camera, target } = stage, direction = camera.position.clone().sub(target).normalize();
  fit(shown(), kept ? { up: camera.up.clone(), direction } : VIEWS[choice.value]);
  controls?.dispose();
  controls = new OrbitControls(stage.camera, stage.canvas);
  controls.target.copy(stage.target);
  controls.update();
  controls.zoomToCursor = true;
  controls.addEventListener("start", () => (turned = true));
  controls.addEventListener("change", () => {
    redraw();
    for (const listener of listeners) listener();
  });
  redraw();
  for (const listener of listeners) listener();
}

// Put points into the picture, with room for supports around them.
function fit(points, { up, direction }) {
  const { middle, wide, tall } = framed(points, up, direction), room = 5 * data.radius;
  const smaller = Math.min(stage.width, stage.height);
  stage.half = smaller * Math.max((wide + room) / stage.width, (tall + 2 * room) / stage.height);
  stage.look(middle, direction, up, 8 * data.size);
}

// Whether a state, or what holds and loads it, leaves the picture.
function outside() {
  stage.camera.updateMatrixWorld();
  return [...pointsOf(shapeOf(branch(), state.row)), ...solids.corners].some((point) => {
    point.project(stage.camera);
    return Math.max(Math.abs(point.x), Math.abs(point.y)) > 1;
  });
}

// The picture with axes and scale, as a canvas.
export function picture(scale = 3) {
  const out = document.createElement("canvas"), { width, height } = stage;
  [out.width, out.height] = [width * scale, height * scale];
  stage.resize(width, height, scale);
  stage.render();
  const over = document.createElement("canvas");
  [over.width, over.height] = [out.width, out.height];
  drawOverlay(over.getContext("2d"), stage, scale);
  const context = out.getContext("2d");
  context.fillStyle = "white";
  context.fillRect(0, 0, out.width, out.height);
  context.drawImage(stage.canvas, 0, 0);
  context.drawImage(over, 0, 0);
  stage.resize(width, height);
  redraw();
  return out;
}

// The same as SVG, without a mode.
export function vector() {
  const rods = [{ shape: shapeOf(branch(), state.row), colour: ROD, colours: stiffen.colours(), radius: data.radius, stripe: STRIPE }];
  if (show.first.checked) rods.unshift({ shape: shapeOf(data.branches[0], 0), colour: FIRST, radius: data.radius, stripe: null });
  return svgOf(stage, rods, solids.visible ? solids.children.filter((mesh) => mesh.visible) : []);
}

function resize() {
  const { width, height } = box.getBoundingClientRect(), ratio = Math.min(window.devicePixelRatio, 2);
  [overlay.width, overlay.height] = [width * ratio, height * ratio];
  stage.resize(width, height);
  if (!turned) look();
  draw();
}

export function start() {
  for (const name of Object.keys(VIEWS)) choice.add(new Option(name, name));
  stage.scene.add(rod, stripe, first, solids);
  update();
  resize();
  new ResizeObserver(resize).observe(box);
  choice.addEventListener("change", () => look());
  document.getElementById("fit").addEventListener("click", () => look(true));
  for (const box of Object.values(show))
    box.addEventListener("change", () => {
      update();
      redraw();
    });
  stiffen.start(() => {
    update();
    redraw();
  });
  subscribe(() => {
    update();
    if (outside()) look(true);
    redraw();
  });
}
