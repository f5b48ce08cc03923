// The picture of the rod as SVG: far pieces first, rods as thick lines with their stripe, supports and loads as facets.

import { Color, Vector3 } from "three";
import { refined } from "report/curve";
import { drawOverlay } from "report/overlay";
import { Paper } from "report/paper";

const TIMES = 3; // pieces of a rod between two stations
const EDGE = 0.55; // brightness of the edge of a rod
const LIGHT = new Vector3(-0.25, 0.75, 0.6).normalize();
const STRIPE = 0.22, INSIDE = 0.85, EDGEWISE = 0.25; // width of the stripe and its distance from the axis, over those of the rod; from where on it is seen

const shaded = (colour, share) => `#${new Color(colour).multiplyScalar(share).getHexString()}`;

// Place in the picture, in pixels, and distance from the viewer.
function placed(stage, point) {
  const { x, y, z } = point.project(stage.camera);
  return [((x + 1) / 2) * stage.width, ((1 - y) / 2) * stage.height, z];
}

function d1Of([w, x, y, z]) {
  return new Vector3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y));
}

// Pieces of a rod of this shape: each a line between two points, its stripe where that is on the side of the viewer.
function* pieces(stage, { shape, colour, colours, radius, stripe }) {
  const curve = refined(shape, TIMES), towards = stage.camera.getWorldDirection(new Vector3()).negate();
  const rings = Array.from({ length: curve.length / 7 }, (_, i) => {
    const part = curve.subarray(i * 7, i * 7 + 7), at = new Vector3().fromArray(part), q = part.subarray(3);
    const d1 = d1Of(q).normalize(), side = at.clone().addScaledVector(d1, INSIDE * radius);
    return { at: placed(stage, at), side: placed(stage, side), seen: stripe && d1.dot(towards) > EDGEWISE };
  });
  const width = (2 * radius) / stage.pixel;
  for (let i = 0; i + 1 < rings.length; i++) {
    const [a, b] = [rings[i], rings[i + 1]];
    const own = colours?.((i + 0.5) / (rings.length - 1)) ?? colour;
    yield { depth: (a.at[2] + b.at[2]) / 2, line: [a.at, b.at], stripe: a.seen && b.seen ? [a.side, b.side] : null, width, colour: own, dark: stripe };
  }
}

// Facets of a body that face the viewer, lit from above.
function* facets(stage, mesh) {
  const { position } = mesh.geometry.attributes, index = mesh.geometry.index.array, view = stage.camera.quaternion.clone().invert();
  const corner = (i) => new Vector3().fromBufferAttribute(position, index[i]).applyMatrix4(mesh.matrix);
  for (let i = 0; i < index.length; i += 3) {
    const [a, b, c] = [corner(i), corner(i + 1), corner(i + 2)];
    const normal = b.clone().sub(a).cross(c.clone().sub(a)).normalize().applyQuaternion(view);
    if (!(normal.length() > 0.5)) continue;
    const share = 0.55 + 0.45 * Math.abs(normal.dot(LIGHT)), points = [a, b, c].map((x) => placed(stage, x));
    yield { depth: (points[0][2] + points[1][2] + points[2][2]) / 3, facet: points, colour: shaded(mesh.material.color, share) };
  }
}

function drawPiece(paper, { line, stripe, width, colour, dark }) {
  for (const [style, size, cap] of [[shaded(colour, EDGE), width + 1.6, "butt"], [colour, width, "round"]]) {
    Object.assign(paper, { strokeStyle: style, lineWidth: size });
    paper.along(line);
    paper.stroke(cap);
  }
  if (!stripe) return;
  Object.assign(paper, { strokeStyle: dark, lineWidth: STRIPE * width });
  paper.along(stripe);
  paper.stroke("round");
}

function drawFacet(paper, { facet, colour }) {
  Object.assign(paper, { fillStyle: colour, strokeStyle: colour, lineWidth: 0.4 });
  paper.along(facet);
  paper.fill();
  paper.stroke("round");
}

// SVG of rods (`shape`, `colour`, `radius`, and the colour of a `stripe`) and bodies, as the stage shows them. A rod
// without a stripe is one to compare with: it is behind all that is shown.
export function svgOf(stage, rods, meshes) {
  stage.camera.updateMatrixWorld();
  const paper = new Paper(stage.width, stage.height);
  const byDepth = (parts) => parts.sort((a, b) => b.depth - a.depth), rodsThat = (test) => rods.filter(test).flatMap((rod) => [...pieces(stage, rod)]);
  const behind = byDepth(rodsThat((rod) => !rod.stripe)), front = [...rodsThat((rod) => rod.stripe), ...meshes.flatMap((mesh) => [...facets(stage, mesh)])];
  for (const part of [...behind, ...byDepth(front)]) (part.line ? drawPiece : drawFacet)(paper, part);
  drawOverlay(paper, stage, 1);
  return paper.svg;
}
