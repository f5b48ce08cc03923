// Where along the rod a constant matters most: the colour of the rod at a special point, by the density of a derivative.

import { data, digits, values } from "report/data";
import { branch, state, subscribe } from "report/store";

const SCALES = { less: ["#f7f7f7", "#2166ac"], more: ["#f7f7f7", "#b2182b"] }; // from nothing to the most, that lowers and raises the load
const label = document.getElementById("stiffen-label"), choice = document.getElementById("stiffen"), legend = document.getElementById("stiffen-legend");
const stations = values(data.s);
let chosen = "", offered = null;

const densities = () => branch().special.find((x) => x.row === state.row && Object.keys(x.densities).length)?.densities;
const hex = (colour) => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));

// Colour of a share of the most, from -1 to 1.
export function colour(share) {
  const [none, most] = (share < 0 ? SCALES.less : SCALES.more).map(hex), part = Math.min(Math.abs(share), 1);
  return `rgb(${none.map((x, i) => Math.round(x + part * (most[i] - x))).join(",")})`;
}

// Value at an arclength, on lines between the middles of the pieces.
function at(ends, means, s) {
  const middle = (i) => (ends[i] + ends[i + 1]) / 2;
  let i = 0;
  while (i + 2 < means.length && middle(i + 1) < s) i++;
  const part = Math.min(Math.max((s - middle(i)) / (middle(i + 1) - middle(i)), 0), 1);
  return means[i] + part * (means[i + 1] - means[i]);
}

// The colour at a part of the stations, 0 to 1, of the state that is shown; null where nothing is to be coloured.
export function colours() {
  const [ends, means] = densities()?.[chosen] ?? [];
  if (!means) return null;
  const most = Math.max(...means.map(Math.abs));
  return (t) => {
    const place = t * (stations.length - 1), i = Math.min(Math.floor(place), stations.length - 2);
    return colour(at(ends, means, stations[i] + (place - i) * (stations[i + 1] - stations[i])) / most);
  };
}

// A bar of the colours from one end of the rod to the other, and the least and the greatest density in numbers.
function explain() {
  const [ends, means] = densities()?.[chosen] ?? [];
  legend.hidden = !means;
  if (!means) return;
  const shown = colours(), steps = 48, bar = document.createElement("span"), words = document.createElement("span");
  bar.className = "strip";
  bar.style.background = `linear-gradient(to right, ${Array.from({ length: steps + 1 }, (_, i) => shown(i / steps)).join(", ")})`;
  const most = means.reduce((best, x, i) => (Math.abs(x) > Math.abs(means[best]) ? i : best), 0);
  words.textContent = `∂${data.symbol}/∂${chosen} along the rod, per length: ${digits(Math.min(...means), 3)} to ${digits(Math.max(...means), 3)}, most about s = ${digits((ends[most] + ends[most + 1]) / 2, 3)}`;
  bar.title = `From s = ${digits(ends[0])} to ${digits(ends.at(-1))}: red where a greater ${chosen} raises the critical load, blue where it lowers it`;
  legend.replaceChildren(bar, words);
}

// Offer the constants that the shown state has a density of.
function offer() {
  const found = densities();
  label.hidden = !found;
  if (found !== offered) {
    offered = found;
    const names = Object.keys(found ?? {});
    choice.replaceChildren(new Option("nothing", ""), ...names.map((name) => new Option(name, name)));
    choice.value = names.includes(chosen) ? chosen : "";
  }
  explain();
}

export function start(redraw) {
  choice.addEventListener("change", () => {
    chosen = choice.value;
    explain();
    redraw();
  });
  subscribe(offer);
}
