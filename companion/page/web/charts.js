// The user's charts, under the own water: tiles of pictures, laid out in metres.
import { el, get, set, svg } from "./dom.js";
import { tilesIn } from "./geometry.js";

/** @typedef {{name: string, credit: string, bounds_deg: [number, number, number, number], least_zoom: number, most_zoom: number, tag: string}} Chart */
/** @typedef {import("./geometry.js").Camera} Camera @typedef {import("./geometry.js").Origin} Origin */

const MOST = 48;          // tiles at once
const LAP = 1.004;        // so that no water shows through between two

/** @type {{charts: Chart[], isShown: boolean, current: Set<string>}} */
const state = { charts: [], isShown: true, current: new Set() };
/** @type {Map<string, {image: SVGElement, isLoaded: boolean}>} */
const tiles = new Map();
/** @type {Map<Chart, SVGElement>} */
const layers = new Map();

/** @param {Chart[]} charts the lowest first @param {SVGElement} layer @param {() => void} changed */
export function build(charts, layer, changed) {
  state.charts = charts;
  if (charts.length === 0) return;
  set(layer, { transform: "scale(1 -1)" });   // pictures are counted downwards, metres to the north
  const button = get("charts");
  button.hidden = false;
  button.addEventListener("click", () => {
    state.isShown = !state.isShown;
    set(button, { "aria-pressed": state.isShown ? "true" : "false" });
    changed();
  });
  for (const chart of charts) {
    const own = svg("g");
    layers.set(chart, own);
    layer.append(own);
    get("key").append(el("li", { class: "credit" }, `chart: ${chart.name}${chart.credit ? `, ${chart.credit}` : ""}`));
  }
}

/** @param {Camera} camera @param {Origin | null} origin */
export function draw(camera, origin) {
  state.current = new Set();
  if (origin !== null && state.isShown) for (const [chart, layer] of layers) {
    for (const tile of tilesIn(camera, origin, chart, window.devicePixelRatio || 1, MOST)) {
      const path = `/tiles/${chart.tag}/${tile.z}/${tile.x}/${tile.y}`;
      state.current.add(path);
      const image = tiles.get(path)?.image ?? begin(path, layer);
      set(image, { x: tile.west_m.toFixed(2), y: (-tile.south_m - tile.tall_m).toFixed(2), width: (tile.wide_m * LAP).toFixed(2), height: (tile.tall_m * LAP).toFixed(2) });
    }
  }
  tidy();
}

/** @param {string} path @param {SVGElement} layer */
function begin(path, layer) {
  const image = svg("image", { href: path, preserveAspectRatio: "none" });
  const tile = { image, isLoaded: false };
  const done = () => { tile.isLoaded = true; tidy(); };
  image.addEventListener("load", done);
  image.addEventListener("error", done);
  tiles.set(path, tile);
  layer.append(image);
  return image;
}

/** The tiles of another zoom or place stay below until all that are wanted now have come. */
function tidy() {
  for (const path of state.current) if (!tiles.get(path)?.isLoaded) return;
  for (const [path, tile] of tiles) if (!state.current.has(path)) { tile.image.remove(); tiles.delete(path); }
}
