// Shared by all plots: layout, fonts, and how they are saved.

import { data } from "report/data";

const Plotly = globalThis.Plotly;
const large = window.innerWidth >= 1600;

const LONGEST = 34;
export const font = { family: 'system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif', size: large ? 15 : 12.5, color: "#22272e" };
export const config = { displayModeBar: false, scrollZoom: true, doubleClick: "reset" };

// A title of two lines where one is too long.
function broken(title) {
  if (title.replace(/<[^>]*>/g, "").length <= LONGEST) return title;
  const words = title.split(" "), middle = Math.ceil(words.length / 2);
  return `${words.slice(0, middle).join(" ")}<br>${words.slice(middle).join(" ")}`;
}

const axis = (title) => ({
  title: { text: broken(title), standoff: 6 },
  automargin: true,
  gridcolor: "#e7ebef",
  zerolinecolor: "#c2cad2",
  linecolor: "#8b95a1",
  exponentformat: "power", // not plotly's 20p and 400M
  ticks: "outside",
  ticklen: 4,
  tickcolor: "#8b95a1",
});

export function layout(x, y, more = {}) {
  return {
    font,
    margin: { l: 52, r: 10, t: 8, b: 38 },
    paper_bgcolor: "white",
    plot_bgcolor: "white",
    showlegend: false,
    hovermode: "closest",
    hoverdistance: 30,
    hoverlabel: { bgcolor: "white", bordercolor: "#66707c", font: { ...font, size: font.size }, align: "left" },
    dragmode: "pan",
    xaxis: axis(x),
    yaxis: axis(y),
    ...more,
  };
}

// Draw a plot anew; it follows the size of its box at once (Plotly.Plots.resize waits for a time that may not come).
export function draw(plot, traces, how) {
  const fit = () => plot._fullLayout && plot.clientHeight && Plotly.relayout(plot, { autosize: true });
  if (!plot.watched) new ResizeObserver(fit).observe(plot);
  plot.watched = true;
  return Plotly.react(plot, traces, how, config);
}

// Save a plot as PNG, at twice its size, or as SVG, with a title.
export function save(plot, format, name) {
  const { width, height } = plot.getBoundingClientRect();
  const figure = { data: plot.data, layout: { ...plot.layout, title: { text: "" } } };
  return Plotly.downloadImage(figure, { format, width, height, scale: format === "png" ? 3 : 1, filename: `${data.scene}-${name}` });
}

export function empty(plot, sentence) {
  Plotly.purge(plot);
  plot.replaceChildren();
  const text = document.createElement("div");
  text.className = "empty";
  text.textContent = sentence;
  plot.append(text);
}
