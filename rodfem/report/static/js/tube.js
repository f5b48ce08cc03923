// Surface of a rod: its cross-sections in the planes of d1 and d2.

import { BufferAttribute, BufferGeometry, Color, Mesh, MeshStandardMaterial, DoubleSide } from "three";
import { refined } from "report/curve";

const RINGS = 170;

export class Tube extends Mesh {
  // `outline` (1 or stations, k, 2) packed; a closed one has lids.
  constructor(outline, points, stations, closed, colour, opacity = 1) {
    super(new BufferGeometry(), new MeshStandardMaterial({ color: colour, roughness: 0.55, metalness: 0, side: DoubleSide, transparent: opacity < 1, opacity, depthWrite: opacity === 1 }));
    this.times = Math.max(1, Math.ceil(RINGS / (stations - 1)));
    this.rings = (stations - 1) * this.times + 1;
    [this.sections, this.sides] = outline.shape;
    this.outline = points;
    this.closed = closed;
    this.own = colour;
    this.painted = false;
    const lids = closed ? 2 * (this.sides + 1) : 0, count = this.rings * this.sides + lids;
    this.geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3));
    this.geometry.setAttribute("normal", new BufferAttribute(new Float32Array(3 * count), 3));
    this.geometry.setIndex(this.faces());
    this.frustumCulled = false;
  }

  faces() {
    const { rings, sides, closed } = this, faces = [];
    for (let i = 0; i + 1 < rings; i++)
      for (let j = 0; j < (closed ? sides : sides - 1); j++) {
        const a = i * sides + j, b = i * sides + ((j + 1) % sides);
        faces.push(a, b, b + sides, a, b + sides, a + sides);
      }
    for (let lid = 0; closed && lid < 2; lid++) {
      const first = rings * sides + lid * (sides + 1);
      for (let j = 0; j < sides; j++) faces.push(first, first + 1 + j, first + 1 + ((j + 1) % sides));
    }
    return faces;
  }

  // Colour the rings by their part of the length, 0 to 1; null: all of its own colour.
  paint(colours) {
    const { material, geometry, sides, rings, closed } = this;
    if (colours) {
      const found = Array.from({ length: rings }, (_, i) => new Color(colours(i / (rings - 1))).toArray());
      const all = [...found.flatMap((each) => Array(sides).fill(each)), ...(closed ? [found[0], found[rings - 1]].flatMap((each) => Array(sides + 1).fill(each)) : [])];
      geometry.setAttribute("color", new BufferAttribute(new Float32Array(all.flat()), 3));
    }
    if (Boolean(colours) === this.painted) return;
    this.painted = Boolean(colours);
    material.vertexColors = this.painted;
    material.color.set(this.painted ? "#ffffff" : this.own);
    material.needsUpdate = true;
  }

  // Take the shape (r, q) at the stations.
  update(shape) {
    const { sides, rings, sections, outline } = this, curve = refined(shape, this.times);
    const position = this.geometry.attributes.position.array, normal = this.geometry.attributes.normal.array;
    for (let i = 0; i < rings; i++) {
      const o = i * 7, size = Math.hypot(curve[o + 3], curve[o + 4], curve[o + 5], curve[o + 6]);
      const [w, x, y, z] = [curve[o + 3] / size, curve[o + 4] / size, curve[o + 5] / size, curve[o + 6] / size];
      const d1 = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)];
      const d2 = [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)];
      const section = sections === 1 ? 0 : Math.round(i / this.times);
      const at = (j, k) => outline[(section * sides + ((j + sides) % sides)) * 2 + k];
      for (let j = 0; j < sides; j++) {
        const [before, after] = this.closed ? [j - 1, j + 1] : [Math.max(j - 1, 0), Math.min(j + 1, sides - 1)];
        let n1 = at(after, 1) - at(before, 1), n2 = at(before, 0) - at(after, 0);
        const length = Math.hypot(n1, n2) || 1;
        for (let k = 0; k < 3; k++) {
          const to = (i * sides + j) * 3 + k;
          position[to] = curve[o + k] + at(j, 0) * d1[k] + at(j, 1) * d2[k];
          normal[to] = (n1 * d1[k] + n2 * d2[k]) / length;
        }
      }
      if (this.closed && (i === 0 || i === rings - 1)) this.lid(i, curve.subarray(o, o + 3), d1, d2);
    }
    this.geometry.attributes.position.needsUpdate = this.geometry.attributes.normal.needsUpdate = true;
  }

  lid(i, centre, d1, d2) {
    const { sides, rings } = this, sign = i ? 1 : -1, first = rings * sides + (i ? sides + 1 : 0);
    const position = this.geometry.attributes.position.array, normal = this.geometry.attributes.normal.array;
    const d3 = [0, 1, 2].map((k) => sign * (d1[(k + 1) % 3] * d2[(k + 2) % 3] - d1[(k + 2) % 3] * d2[(k + 1) % 3]));
    position.set(centre, first * 3);
    position.copyWithin((first + 1) * 3, i * sides * 3, (i + 1) * sides * 3);
    for (let j = 0; j <= sides; j++) normal.set(d3, (first + j) * 3);
  }
}
