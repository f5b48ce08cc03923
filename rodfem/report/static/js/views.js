// Directions of view: which direction of space is vertical, and stays so while the rod is turned.

import { Vector3 } from "three";
import { data } from "report/data";

const AXES = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)];
const [right, above, back] = data.axes.map((row) => new Vector3(...row));
const across = (vector, axis) => vector.clone().addScaledVector(axis, -vector.dot(axis));

// Axis of space, of either sign, nearest to a direction and across another.
function nearest(direction, other) {
  const signed = AXES.flatMap((axis) => [axis, axis.clone().negate()]).filter((axis) => Math.abs(axis.dot(other)) < 0.5);
  return signed.reduce((best, axis) => (axis.dot(direction) > best.dot(direction) ? axis : best));
}

// View in which `up` is vertical, seen from the side from which the picture of the run is seen, a little from above.
function vertical(up, tilt = 0.26) {
  let aside = across(back, up);
  if (aside.length() < 0.2) aside = across(above, up);
  return { up, direction: aside.normalize().multiplyScalar(Math.cos(tilt)).addScaledVector(up, Math.sin(tilt)) };
}

// View in which `axis` goes to the right, or to the left, and stays in the horizontal plane.
function horizontal(axis) {
  const up = across(nearest(above, axis), axis).normalize();
  const front = new Vector3().crossVectors(axis, up);
  return { up, direction: front.multiplyScalar(front.dot(back) < 0 ? -1 : 1).addScaledVector(up, 0.3).normalize() };
}

const down = data.loadDirection && new Vector3(...data.loadDirection);
const e3 = AXES[2];
export const VIEWS = {
  "as in shape.png": { up: nearest(above, right), direction: back },
  "e₃ horizontal": horizontal(e3),
  "e₃ vertical": vertical(e3),
  ...(down ? { "load downwards": vertical(down.clone().negate()), "load horizontal": horizontal(down) } : {}),
};
