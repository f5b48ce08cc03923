// What is shown, in the address of the page: a link leads to the same branch, row and ordinate.

import { data } from "report/data";

const own = location.protocol !== "about:"; // a page inside a notebook has no address
const asked = new URLSearchParams(own ? decodeURIComponent(location.hash.slice(1)) : "");

// The value of an entry of the address that is among the possible ones, or the first choice.
export function chosen(name, possible, first) {
  const found = possible.findIndex((one) => one === asked.get(name));
  return found < 0 ? first : found;
}

export const row = (count) => {
  const found = Number.parseInt(asked.get("row") ?? "", 10);
  return found >= 0 && found < count ? found : null;
};

addEventListener("hashchange", () => location.reload()); // by hand or by a link: what the page writes makes no such event

export const names = () => data.branches.map((b) => b.name);

export function write(entries) {
  if (!own) return;
  const written = new URLSearchParams(entries).toString();
  if (`#${written}` !== location.hash) history.replaceState(null, "", `#${written}`);
}
