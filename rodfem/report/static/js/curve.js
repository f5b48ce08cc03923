// A centreline with its directors, (r, q) at stations, made smooth for drawing, moved, or blended.

import { Vector3 } from "three";

// Places along the centreline.
export function pointsOf(shape) {
  return Array.from({ length: shape.length / 7 }, (_, i) => new Vector3().fromArray(shape, i * 7));
}

// Points between stations, by cubics through them: `times` of them for each interval.
export function refined(shape, times) {
  const stations = shape.length / 7, count = (stations - 1) * times + 1, out = new Float32Array(count * 7);
  const at = (i, k) => shape[Math.min(Math.max(i, 0), stations - 1) * 7 + k];
  for (let n = 0; n < count; n++) {
    const i = Math.min(Math.floor(n / times), stations - 2), t = n / times - i;
    for (let k = 0; k < 7; k++) {
      const [b, c] = [at(i, k), at(i + 1, k)];
      const a = i > 0 ? at(i - 1, k) : 2 * b - c, d = i + 2 < stations ? at(i + 2, k) : 2 * c - b;
      out[n * 7 + k] = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
    }
  }
  return out;
}

// A state between two rows, for pictures: linear in positions and quaternions.
export function between(a, b, t) {
  const out = new Float32Array(a.length);
  for (let i = 0; i < a.length; i += 7) {
    let same = 0;
    for (let k = 3; k < 7; k++) same += a[i + k] * b[i + k];
    for (let k = 0; k < 7; k++) out[i + k] = (1 - t) * a[i + k] + t * (k > 2 && same < 0 ? -1 : 1) * b[i + k];
  }
  return out;
}

// A state in a mode: `parts` are its real and, if it has one, imaginary part, (u, w) at stations.
export function moved(shape, parts, amplitude) {
  const out = new Float32Array(shape.length);
  for (let i = 0; i < shape.length / 7; i++) {
    const d = [0, 1, 2, 3, 4, 5].map((k) => parts.reduce((sum, part, p) => sum + amplitude[p] * part[i * 6 + k], 0));
    const angle = Math.hypot(d[3], d[4], d[5]), f = angle > 1e-9 ? Math.sin(angle / 2) / angle : 0.5;
    const [a, b, c, e] = [Math.cos(angle / 2), f * d[3], f * d[4], f * d[5]];
    const [w, x, y, z] = shape.subarray(i * 7 + 3, i * 7 + 7);
    out.set([shape[i * 7] + d[0], shape[i * 7 + 1] + d[1], shape[i * 7 + 2] + d[2]], i * 7);
    out.set([a * w - b * x - c * y - e * z, a * x + b * w + c * z - e * y, a * y - b * z + c * w + e * x, a * z + b * y - c * x + e * w], i * 7 + 3);
  }
  return out;
}
