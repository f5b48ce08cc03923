// A sheet of SVG that takes the few commands of a canvas with which axes and scale are drawn.

const ESCAPES = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
const text = (value) => String(value).replace(/[&<>"]/g, (character) => ESCAPES[character]);
const short = (x) => Number(x.toFixed(2));

export class Paper {
  constructor(width, height) {
    Object.assign(this, { width, height, parts: [], path: "", strokeStyle: "black", fillStyle: "black", lineWidth: 1, font: "14px sans-serif", edge: "" });
  }

  setTransform() {}
  clearRect() {}

  beginPath() {
    this.path = "";
  }

  moveTo(x, y) {
    this.path += `M${short(x)} ${short(y)}`;
  }

  lineTo(x, y) {
    this.path += `L${short(x)} ${short(y)}`;
  }

  stroke(cap = "butt") {
    this.parts.push(`<path d="${this.path}" fill="none" stroke="${text(this.strokeStyle)}" stroke-width="${short(this.lineWidth)}" stroke-linecap="${cap}"/>`);
  }

  fill() {
    this.parts.push(`<path d="${this.path}Z" fill="${text(this.fillStyle)}"/>`);
  }

  // The edge of a text that is filled next.
  strokeText() {
    this.edge = `stroke="${text(this.strokeStyle)}" stroke-width="${short(this.lineWidth)}" stroke-linejoin="round" paint-order="stroke" `;
  }

  fillText(words, x, y) {
    const [size] = this.font.match(/\d+/);
    this.parts.push(`<text x="${short(x)}" y="${short(y)}" font-family="sans-serif" font-size="${size}" text-anchor="middle" dominant-baseline="central" ${this.edge}fill="${text(this.fillStyle)}">${text(words)}</text>`);
    this.edge = "";
  }

  // Points of a line or, filled, of a facet, in pixels.
  along(points) {
    this.beginPath();
    points.forEach(([x, y], i) => (i ? this.lineTo(x, y) : this.moveTo(x, y)));
  }

  get svg() {
    const { width, height } = this;
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"><rect width="100%" height="100%" fill="white"/>${this.parts.join("\n")}</svg>`;
  }
}
