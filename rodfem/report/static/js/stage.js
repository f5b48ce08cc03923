// A scene with a parallel projection: lengths are true in the plane of the picture, and one direction stays vertical.

import { AmbientLight, DirectionalLight, OrthographicCamera, Scene, Vector3, WebGLRenderer } from "three";

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.camera = new OrthographicCamera();
    this.scene = new Scene();
    this.target = new Vector3();
    this.width = this.height = 1;
    this.half = 1;
    const lamp = (x, y, z, strength) => {
      const light = new DirectionalLight("white", strength);
      light.position.set(x, y, z);
      this.camera.add(light, light.target);
    };
    lamp(-0.6, 1.2, 1.2, 1.9);
    lamp(1.2, 0.2, 0.9, 0.7);
    this.scene.add(this.camera, new AmbientLight("white", 1.25));
  }

  resize(width, height, ratio = Math.min(window.devicePixelRatio, 2)) {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(this.width, this.height, false);
    this.project();
  }

  // Look at the target from a direction, `up` being vertical.
  look(target, direction, up, distance) {
    this.target.copy(target);
    this.camera.up.copy(up);
    this.camera.position.copy(target).addScaledVector(direction, distance);
    this.camera.near = 0;
    this.camera.far = 2.5 * distance;
    this.camera.lookAt(target);
    this.camera.zoom = 1;
    this.project();
  }

  // Show at least `half` to each side of the target, where the picture is narrower.
  project() {
    const { camera, width, height } = this, unit = this.half / Math.min(width, height);
    [camera.left, camera.right, camera.top, camera.bottom] = [-unit * width, unit * width, unit * height, -unit * height];
    camera.updateProjectionMatrix();
  }

  // Length in the picture's plane of one pixel of the page.
  get pixel() {
    return (this.camera.right - this.camera.left) / this.width / this.camera.zoom;
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }
}

// Middle of points in the plane of a picture, and how far they reach from it to the sides and up.
export function framed(points, up, direction) {
  const right = new Vector3().crossVectors(up, direction).normalize(), top = new Vector3().crossVectors(direction, right);
  const [a, b, c] = [right, top, direction].map((axis) => {
    const along = points.map((point) => point.dot(axis));
    return [Math.min(...along), Math.max(...along)];
  });
  const middle = [a, b, c].map(([low, high]) => (low + high) / 2);
  const at = new Vector3().addScaledVector(right, middle[0]).addScaledVector(top, middle[1]).addScaledVector(direction, middle[2]);
  return { middle: at, wide: (a[1] - a[0]) / 2, tall: (b[1] - b[0]) / 2 };
}
