// Small drawings of legends: symbols and lines.

const SVG = "http://www.w3.org/2000/svg";
const PATHS = {
  circle: "M11 6.5a4.5 4.5 0 1 1-9 0a4.5 4.5 0 1 1 9 0z",
  diamond: "M6.5 1.5L11.5 6.5L6.5 11.5L1.5 6.5z",
  cross: "M4.5 1h4v3.5H12v4H8.5V12h-4V8.5H1v-4h3.5z",
  star: "M6.5 .5L8.1 4.8L12.6 5L9.1 7.8L10.3 12.2L6.5 9.7L2.7 12.2L3.9 7.8L.4 5L4.9 4.8z",
  "triangle-down": "M1 2H12L6.5 11.5z",
  "triangle-up": "M1 11H12L6.5 1.5z",
  x: "M3.5 1L6.5 4L9.5 1L12 3.5L9 6.5L12 9.5L9.5 12L6.5 9L3.5 12L1 9.5L4 6.5L1 3.5z",
  "cross-thin": "M6.5 1V12M1 6.5H12",
  "x-thin": "M2.5 2.5L10.5 10.5M2.5 10.5L10.5 2.5",
};

function icon(width, path, style) {
  const svg = document.createElementNS(SVG, "svg"), drawn = document.createElementNS(SVG, "path");
  svg.setAttribute("width", width);
  svg.setAttribute("height", 13);
  drawn.setAttribute("d", path);
  for (const [name, value] of Object.entries(style)) drawn.setAttribute(name, value);
  svg.append(drawn);
  return svg;
}

export const symbol = (marker) =>
  icon(13, PATHS[marker.symbol], { fill: marker.color ?? "none", stroke: marker.line?.color ?? marker.color, "stroke-width": marker.line?.width ?? 0 });

export function item(drawn, text, element = "span") {
  const span = document.createElement(element);
  span.append(drawn, text);
  return span;
}

export const lineIcon = (colour, width, dash = "solid") =>
  icon(30, "M1 6.5H29", { stroke: colour, "stroke-width": width, "stroke-dasharray": dash === "solid" ? "none" : dash });

export const area = (colour) => icon(20, "M1 1H19V12H1z", { fill: colour, stroke: "#8bb8a6" });
