// Marks over a plot of plotly.js: moving one redraws nothing.

// A cursor of a plot: a ring at (x, y), a triangle at the edge that it is beyond, or a line across where y is null.
export function cursorOf(plot) {
  const mark = document.createElement("div");
  plot.append(mark);
  let at = null;
  const place = () => {
    const layout = plot._fullLayout;
    mark.hidden = !at || !layout?.xaxis;
    if (mark.hidden) return;
    const { xaxis, yaxis } = layout;
    const x = xaxis.l2p(at[0]), wanted = at[1] === null ? 0 : yaxis.l2p(at[1]);
    const y = Math.min(Math.max(wanted, 0), yaxis._length), beyond = y > wanted + 1 ? "above" : y < wanted - 1 ? "below" : "point";
    mark.hidden = !(x >= -1 && x <= xaxis._length + 1);
    mark.className = at[1] === null ? "cursor line" : `cursor ${beyond}`;
    mark.style.left = `${xaxis._offset + x}px`;
    mark.style.top = `${yaxis._offset + y}px`;
    mark.style.height = at[1] === null ? `${yaxis._length}px` : "";
  };
  plot.on("plotly_afterplot", place);
  plot.on("plotly_relayouting", place);
  return (x, y) => {
    at = x === null || y === undefined ? null : [x, y];
    place();
  };
}
