// Supports and loads: bodies placed by affine maps.

import { BufferAttribute, BufferGeometry, DoubleSide, Group, Mesh, MeshStandardMaterial, Vector3 } from "three";
import { data, values } from "report/data";

const made = data.solids.map((solid) => {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(values(solid.points), 3));
  geometry.setIndex(solid.triangles);
  geometry.computeVertexNormals();
  const material = new MeshStandardMaterial({ color: solid.colour, roughness: 0.6, flatShading: solid.flat, side: DoubleSide });
  return { geometry, material };
});

const corners = made.map(({ geometry }) => {
  geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox;
  return [0, 1, 2, 3, 4, 5, 6, 7].map((i) => new Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z));
});

export class Solids extends Group {
  // Corners of boxes around all that is shown.
  get corners() {
    if (!this.visible) return [];
    return this.children.filter((mesh) => mesh.visible).flatMap((mesh) => corners[mesh.number].map((x) => x.clone().applyMatrix4(mesh.matrix)));
  }

  // Show bodies by their numbers, at `maps` (n, 4, 3); in a mode each map is moved towards others.
  update(numbers, maps, towards = [], amplitude = []) {
    while (this.children.length < numbers.length) {
      const mesh = new Mesh();
      mesh.matrixAutoUpdate = mesh.frustumCulled = false;
      this.add(mesh);
    }
    this.children.forEach((mesh, n) => {
      mesh.visible = n < numbers.length;
      if (!mesh.visible) return;
      Object.assign(mesh, made[numbers[n]], { number: numbers[n] });
      const m = Array.from(maps.subarray(n * 12, n * 12 + 12));
      towards.forEach((other, p) => {
        for (let k = 0; k < 12 && other.length >= n * 12 + 12; k++) m[k] += amplitude[p] * (other[n * 12 + k] - maps[n * 12 + k]);
      });
      mesh.matrix.set(m[0], m[3], m[6], m[9], m[1], m[4], m[7], m[10], m[2], m[5], m[8], m[11], 0, 0, 0, 1);
      mesh.matrixWorldNeedsUpdate = true;
    });
  }
}
