// Starts all parts, and listens to keys.

import { data } from "report/data";
import { branch, select, showMode, state, tell, visible } from "report/store";
import * as coexisting from "report/coexisting";
import * as diagram from "report/diagram";
import * as legend from "report/legend";
import * as loci from "report/loci";
import * as modes from "report/modes";
import { save } from "report/plotting";
import * as profile from "report/profile";
import * as rod from "report/rod";
import * as spectrum from "report/spectrum";
import * as text from "report/text";

const PACE = 90; // milliseconds of a state while the branch is played
const play = document.getElementById("play");
let playing = 0;

function toggle() {
  play.textContent = playing ? "▶" : "❚❚";
  if (playing) {
    clearInterval(playing);
    playing = 0;
    return;
  }
  if (state.row === branch().load.length - 1) select(state.branch, 0);
  playing = setInterval(() => (state.row === branch().load.length - 1 ? toggle() : select(state.branch, state.row + 1)), PACE);
}

const otherBranch = (step) => {
  const count = data.branches.length;
  let next = (state.branch + step + count) % count;
  while (!visible(next)) next = (next + step + count) % count;
  const { load } = data.branches[next];
  const row = load.reduce((best, x, i) => (Math.abs(x - state.load) < Math.abs(load[best] - state.load) ? i : best), 0);
  select(next, row);
};

const KEYS = {
  ArrowLeft: () => select(state.branch, state.row - 1),
  ArrowRight: () => select(state.branch, state.row + 1),
  ArrowUp: () => otherBranch(-1),
  ArrowDown: () => otherBranch(1),
  Home: () => select(state.branch, 0),
  End: () => select(state.branch, Infinity),
  " ": toggle,
  Escape: () => showMode(null),
};

// Let a mode of the state move, by its number from 1 on, or stop it.
function move(number) {
  const mode = branch().modes[state.row]?.[number - 1];
  if (mode) showMode(mode === state.mode ? null : mode);
}
for (let number = 1; number <= 9; number++) KEYS[number] = () => move(number);

document.addEventListener("keydown", (event) => {
  const busy = event.target.closest("select, input[type=range], dialog") || (event.key === " " && event.target.closest("button"));
  if (busy || !KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  KEYS[event.key]();
});
play.addEventListener("click", () => (toggle(), play.blur()));

for (const button of document.querySelectorAll("[data-export]"))
  button.addEventListener("click", () => {
    const shown = document.getElementById("diagram").hidden ? "loci" : "diagram";
    save(document.getElementById(shown), button.dataset.export, shown);
  });
function download(blob, format) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `${data.scene}-rod.${format}` });
  link.click();
  URL.revokeObjectURL(link.href);
}
document.getElementById("rod-png").addEventListener("click", () => rod.picture().toBlob((blob) => download(blob, "png")));
document.getElementById("rod-svg").addEventListener("click", () => download(new Blob([rod.vector()], { type: "image/svg+xml" }), "svg"));

text.start();
legend.start();
modes.start();
tell(); // words leave the pictures their room
rod.start();
await diagram.start();
await loci.start();
spectrum.start();
profile.start();
coexisting.start();
tell();
document.body.dataset.ready = "yes";
