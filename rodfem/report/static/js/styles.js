// Dashes and symbols, as in the pictures that matplotlib draws; stability never shows by colour alone.

export const STABLE = "stable", PLANAR = "stable in the plane, unstable in space", UNSTABLE = "unstable", UNDECIDED = "stability undecided";
export const DASHES = { [STABLE]: "solid", [PLANAR]: "8px,3px", [UNDECIDED]: "9px,3px,2.5px,3px", [UNSTABLE]: "2.2px,2.8px" };
export const WIDTHS = { [STABLE]: 3.6, [PLANAR]: 2.8, [UNDECIDED]: 2.8, [UNSTABLE]: 2.2 };
export const INK = "#22272e"; // stability shows by marks and lines: hues are those of branches

const edge = (width) => ({ color: "black", width });
export const SYMBOLS = {
  "branch point": { symbol: "circle", size: 9, color: "white", line: edge(1.8) },
  fold: { symbol: "diamond", size: 9, color: "black" },
  "imperfect bifurcation": { symbol: "cross", size: 11, color: "white", line: edge(1.4) },
  flutter: { symbol: "star", size: 14, color: "#f0e442", line: edge(1.2) },
  divergence: { symbol: "triangle-down", size: 12, color: "#f0e442", line: edge(1.2) },
  event: { symbol: "cross-thin", size: 10, line: edge(1.8) },
  level: { symbol: "y-up", size: 10, line: edge(1.8) },
  user: { symbol: "x-thin", size: 8, line: edge(1.8) },
};
export const ENDS = { symbol: "x", size: 9, color: "white", line: { color: "#b3123e", width: 1.6 } };
export const UNEXPLAINED = { symbol: "triangle-up", size: 13, color: "#f0e442", line: { color: "#b3123e", width: 2 } };
