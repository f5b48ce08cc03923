// The data of the page, and its packed arrays.

export const data = JSON.parse(document.getElementById("payload").textContent);

const unpacked = new Map();
const NOTHING = 1e-12; // of its natural size, a number whose error is not estimated is zero

// Values of an array that Python has packed; each is decoded once.
export function values(packed) {
  if (!unpacked.has(packed)) {
    const text = atob(packed.f32);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    unpacked.set(packed, new Float32Array(bytes.buffer));
  }
  return unpacked.get(packed);
}

// Part of an array that belongs to one entry of its first axis.
export function entry(packed, i) {
  const size = packed.shape.slice(1).reduce((a, b) => a * b, 1);
  return values(packed).subarray(i * size, (i + 1) * size);
}

// First map of each row of a branch.
export function mapStarts(branch) {
  if (!branch.starts) {
    branch.starts = [0];
    for (const numbers of branch.bodies) branch.starts.push(branch.starts.at(-1) + numbers.length);
  }
  return branch.starts;
}

// Text that plotly.js shows as it is.
export function escaped(text) {
  return String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
}

// A number of a row with the bound of its error, or marked where that is not estimated.
export function reading(branch, row, name) {
  const value = name === "load" ? branch.load[row] : branch.ordinates[name]?.[row];
  const none = Math.abs(value) < NOTHING * (data.natural[name] ?? 0);
  return branch.readings[row]?.[name] ?? rough(none ? 0 : value);
}

// The unit of a number of a row, with the space before it; nothing where it has none.
export const unit = (name) => (data.units[name] ? ` ${data.units[name]}` : "");

// What is counted at a state: its index, or under loads without potential its squared frequencies, of which none is no news.
export const symbolOf = (b) => (b.omega2 && !b.rates ? "ω²" : "μ");
export const counted = (b, index) => (b.omega2 ? (index === "0" ? "" : `${index} of ${symbolOf(b)}`) : `index ${index}`);

// A number whose error is not estimated.
export function rough(x, count = 6) {
  return x === null || x === undefined ? "unknown" : `~${digits(x, count)}`;
}

// A number with up to so many digits.
export function digits(x, count = 6) {
  if (x === null || x === undefined) return "unknown";
  return String(Number(x.toPrecision(count))).replace("-", "−");
}
