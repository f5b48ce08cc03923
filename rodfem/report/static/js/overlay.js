// Axes of space and a scale, drawn over the picture of the rod.

import { Vector3 } from "three";

const NAMES = ["e₁", "e₂", "e₃"];
const INK = "#4a525c", LINE = 1.8;

// Length of one, two or five times a power of ten, not longer than a wanted one.
function round(wanted) {
  const power = 10 ** Math.floor(Math.log10(wanted));
  return [5, 2, 1].map((x) => x * power).find((x) => x <= wanted);
}

function arrow(context, x, y, dx, dy) {
  const length = Math.hypot(dx, dy);
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x + dx, y + dy);
  context.stroke();
  if (length < 8) return;
  const [a, b] = [dx / length, dy / length];
  context.beginPath();
  context.moveTo(x + dx + 3 * a, y + dy + 3 * b);
  context.lineTo(x + dx - 6 * a - 3.5 * b, y + dy - 6 * b + 3.5 * a);
  context.lineTo(x + dx - 6 * a + 3.5 * b, y + dy - 6 * b - 3.5 * a);
  context.fill();
}

// Text with a white edge: it may stand before the rod.
function halo(context, text, x, y) {
  Object.assign(context, { strokeStyle: "white", lineWidth: 3, lineJoin: "round" });
  context.strokeText(text, x, y);
  Object.assign(context, { strokeStyle: INK, lineWidth: LINE });
  context.fillText(text, x, y);
}

export function drawOverlay(context, stage, ratio) {
  const { width, height, camera, pixel } = stage;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.strokeStyle = context.fillStyle = INK;
  context.lineWidth = LINE;
  context.font = "14px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const view = camera.quaternion.clone().invert(), [x, y] = [50, height - 50];
  NAMES.forEach((name, i) => {
    const e = new Vector3().setComponent(i, 1).applyQuaternion(view);
    arrow(context, x, y, 30 * e.x, -30 * e.y);
    const short = Math.hypot(e.x, e.y) < 0.45;
    halo(context, name, x + (short ? -14 : 42 * e.x), y - (short ? -10 : 42 * e.y));
  });
  const length = round(110 * pixel), pixels = length / pixel, [end, base] = [width - 14, height - 14];
  context.beginPath();
  context.moveTo(end - pixels, base - 5);
  context.lineTo(end - pixels, base);
  context.lineTo(end, base);
  context.lineTo(end, base - 5);
  context.stroke();
  halo(context, String(Number(length.toPrecision(3))), end - pixels / 2, base - 10);
}
