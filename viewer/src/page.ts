/** The page around the element: which store it shows, and the state in its address. */

import "./impasto-viewer";

const WRITE_MS = 250;

const parameters = new URLSearchParams(location.search);
const viewer = document.createElement("impasto-viewer");
document.documentElement.lang = viewer.lang = parameters.get("lang") ?? navigator.language;
viewer.setAttribute("src", parameters.get("src") ?? "painting.zarr");
if (matchMedia("(max-width: 700px)").matches) viewer.setAttribute("closed", "");
viewer.hash = location.hash;

let waiting = 0;
viewer.addEventListener("impasto-change", ({ detail }) => {
  clearTimeout(waiting);
  // Browsers allow no more than a few changes of the address per second.
  waiting = window.setTimeout(() => history.replaceState(null, "", `#${detail.hash}`), WRITE_MS);
});
viewer.addEventListener("impasto-ready", () => {
  document.title = `${viewer.store?.attributes.title ?? ""} · impasto`;
});
addEventListener("hashchange", () => {
  viewer.hash = location.hash;
});
document.body.append(viewer);
