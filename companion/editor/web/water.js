// The chart below the drawing, as vectors: tiles of a level of detail, painted into a picture that is moved with the water.
import { unproject } from "./geometry.js";

/** @typedef {import("./geometry.js").Camera} Camera @typedef {import("./sketch.js").Frame} Frame @typedef {import("./sketch.js").Point} Point @typedef {import("./sketch.js").Place} Place */
/** What the program says of a chart: where its corner is, metres a degree, how large, its levels. @typedef {{tag: string, name: string, corner: Place, lat_m: number, lon_m: number, wide_m: number, tall_m: number, finest_m: number, levels: number, units: number, tile_units: number}} Water */
/** @typedef {{areas: {colour: string, path: Path2D}[], lines: {kind: string, path: Path2D}[], points: [string, number, number, number | null, string][], corners: number}} Tile */
/** @typedef {{areas: [string, number | null, number[][]][], lines: [string, number | null, number[][]][], points: [string, number, number, number | null, string][]}} Told */

const ROOM = 0.3;          // beyond each edge of the stage, so that what is moved need not be painted
const MOST_TILES = 160, MOST_ASKED = 6, AGAIN_MS = 4000, STILL_MS = 90;
const COARSER = 4;         // levels above that stand in until a tile has come
const BANDS = /** @type {const} */ (["--chart-dry", "--chart-shoal", "--chart-shallow", "--chart-deep"]);

/** @type {HTMLCanvasElement} */ let canvas;
/** @type {Water[]} */ let waters = [];
/** @type {() => Frame} */ let frame;
/** @type {(path: string) => Promise<Told | null>} */ let fetched;
/** @type {Map<string, Tile>} */ const tiles = new Map();
/** @type {Map<string, number>} asked, and not before when again */ const asked = new Map();
/** @type {{centre: Point, scale: number, wide: number, tall: number} | null} */ let painted = null;
/** @type {Camera | null} */ let seen = null;
/** @type {Record<string, string>} */ let colours = {};
let isShown = true, isDue = false, safe_m = 2, stillTimer = 0, isMoving = false;
/** What the last painting was, for tests and for who is curious. */
export const figures = { paintings: 0, tiles: 0, corners: 0, points: 0, ms: 0 };

/** @param {HTMLCanvasElement} on @param {() => Frame} where @param {(path: string) => Promise<Told | null>} ask */
export function build(on, where, ask) {
  canvas = on;
  frame = where;
  fetched = ask;
  new MutationObserver(() => { colours = {}; tiles.clear(); due(); }).observe(document.documentElement, { attributeFilter: ["data-palette"] });
}

/** @param {Water[]} given the coarsest first @param {number} free_m from which depth on the water is free */
export function lay(given, free_m) {
  if (free_m !== safe_m) tiles.clear();
  waters = given;
  safe_m = free_m;
  canvas.hidden = waters.length === 0 || !isShown;
  canvas.parentElement?.classList.toggle("charted", !canvas.hidden);
  due();
}

/** @param {boolean} shown */
export function show(shown) {
  isShown = shown;
  lay(waters, safe_m);
}

export function isEmpty() {
  return waters.length === 0;
}

/** The middle of the finest chart. @returns {Place | null} */
export function middle() {
  const last = waters[waters.length - 1];
  return last ? [last.corner[0] + last.tall_m / last.lat_m / 2, last.corner[1] + last.wide_m / last.lon_m / 2] : null;
}

/** Move what is painted to where the camera looks, and paint it anew where that is not enough. @param {Camera} camera */
export function draw(camera) {
  const isSame = seen !== null && seen.centre[0] === camera.centre[0] && seen.centre[1] === camera.centre[1] && seen.scale === camera.scale && seen.width === camera.width && seen.height === camera.height;
  seen = { ...camera, centre: [camera.centre[0], camera.centre[1]] };
  if (waters.length === 0 || !isShown) return;
  if (isSame && painted) return;
  place();
  if (!isEnough()) { isMoving = true; due(); }
  clearTimeout(stillTimer);
  stillTimer = setTimeout(() => { isMoving = false; if (painted && (!seen || painted.scale !== seen.scale)) due(); }, STILL_MS);
}

/** Where the painted picture is now: a matter of the compositor, not of painting. */
function place() {
  if (!painted || !seen) return;
  const by = seen.scale / painted.scale;
  const x = (painted.centre[0] - seen.centre[0]) * seen.scale - painted.wide * by / 2 + seen.width / 2;
  const y = (seen.centre[1] - painted.centre[1]) * seen.scale - painted.tall * by / 2 + seen.height / 2;
  canvas.style.transform = `translate(${x.toFixed(2)}px, ${y.toFixed(2)}px) scale(${by})`;
}

/** Does what is painted cover what is seen, at about its scale? */
function isEnough() {
  if (!painted || !seen) return false;
  const by = seen.scale / painted.scale;
  if (by < 0.5 || by > 2) return false;
  return Math.abs(painted.centre[0] - seen.centre[0]) * seen.scale <= (painted.wide * by - seen.width) / 2
    && Math.abs(painted.centre[1] - seen.centre[1]) * seen.scale <= (painted.tall * by - seen.height) / 2;
}

function due() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(() => { isDue = false; paint(); });
}

/** @param {string} name */
function colour(name) {
  return colours[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim() || "#888";
}

// ------------------------------------------------------------------------------------------------------ tiles
/** The level of detail of a scale: what it leaves out is half a pixel at the most. @param {Water} water @param {number} scale */
export function levelOf(water, scale) {
  return Math.max(0, Math.min(water.levels - 1, Math.floor(Math.log2(0.5 / (scale * water.finest_m)))));
}

/** The tiles of a chart that a stretch of water has. @param {Water} water @param {number} level @param {[number, number, number, number]} box in the chart's own metres @returns {[number, number][]} */
export function tilesOf(water, level, [west, south, east, north]) {
  const size = water.finest_m * 2 ** level / water.units * water.tile_units;
  const [left, low] = [Math.max(0, Math.floor(west / size)), Math.max(0, Math.floor(south / size))];
  const [right, high] = [Math.min(Math.floor(water.wide_m / size), Math.floor(east / size)), Math.min(Math.floor(water.tall_m / size), Math.floor(north / size))];
  /** @type {[number, number][]} */ const out = [];
  for (let y = low; y <= high; y++) for (let x = left; x <= right; x++) out.push([x, y]);
  return out;
}

/** @param {string} key */
function want(key) {
  const after = asked.get(key);
  if (tiles.has(key) || (after !== undefined && after > performance.now())) return;
  if ([...asked.values()].filter((time) => time === Infinity).length >= MOST_ASKED) return;
  asked.set(key, Infinity);
  void fetched(`/water/${key}`).then((told) => {
    asked.set(key, performance.now() + AGAIN_MS);
    if (!told) return;
    asked.delete(key);
    tiles.set(key, made(told));
    for (const old of tiles.keys()) { if (tiles.size <= MOST_TILES) break; tiles.delete(old); }
    due();
  });
}

/** @param {Told} told @returns {Tile} */
function made(told) {
  let corners = 0;
  const path = (/** @type {number[][]} */ rings, /** @type {boolean} */ isClosed) => {
    const out = new Path2D();
    for (const ring of rings) {
      let x = ring[0] ?? 0, y = ring[1] ?? 0;
      out.moveTo(x, y);
      for (let n = 2; n + 1 < ring.length; n += 2) out.lineTo(x += ring[n] ?? 0, y += ring[n + 1] ?? 0);
      if (isClosed) out.closePath();
      corners += ring.length / 2;
    }
    return out;
  };
  const areas = told.areas.map(([kind, deep, rings]) => ({ colour: colour(areaColour(kind, deep)), path: path(rings, true) }));
  const lines = told.lines.map(([kind, , found]) => ({ kind, path: path(found, false) }));
  return { areas, lines, points: told.points, corners };
}

/** @param {string} kind @param {number | null} deep of its shallowest place [m] */
function areaColour(kind, deep) {
  if (kind !== "depth") return kind === "land" ? "--chart-land" : kind === "built" ? "--chart-built" : "--chart-unknown";
  return band(deep ?? 0, safe_m);
}

/** The band of a depth: dry, less than she needs, less than twice that and 10 m, deep. @param {number} deep @param {number} free */
export function band(deep, free) {
  return BANDS[deep < 0 ? 0 : deep < free ? 1 : deep < Math.max(10, 2 * free) ? 2 : 3];
}

// ------------------------------------------------------------------------------------------------------ painting
function paint() {
  if (!seen || waters.length === 0 || !isShown) return;
  const began = performance.now(), dense = Math.min(2, window.devicePixelRatio || 1), at = seen;
  const wide = Math.ceil(at.width * (1 + 2 * ROOM)), tall = Math.ceil(at.height * (1 + 2 * ROOM));
  if (canvas.width !== wide * dense || canvas.height !== tall * dense) {
    canvas.width = wide * dense;
    canvas.height = tall * dense;
    canvas.style.width = `${wide}px`;
    canvas.style.height = `${tall}px`;
  }
  painted = { centre: at.centre, scale: at.scale, wide, tall };
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.fillStyle = colour("--water");
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.lineJoin = "round";
  Object.assign(figures, { paintings: figures.paintings + 1, tiles: 0, corners: 0, points: 0 });
  const camera = { ...at, width: wide, height: tall };
  const words = new Map();
  for (const water of waters) chart(context, water, camera, dense, words);
  for (const [, write] of words) write();
  place();
  figures.ms = performance.now() - began;
}

/** @param {CanvasRenderingContext2D} context @param {Water} water @param {Camera} camera @param {number} dense @param {Map<string, () => void>} words */
function chart(context, water, camera, dense, words) {
  const own = frame(), kx = own.lon_m / water.lon_m, ky = own.lat_m / water.lat_m;
  const off = /** @type {Point} */ ([(water.corner[1] - own.lon) * own.lon_m, (water.corner[0] - own.lat) * own.lat_m]);
  const corners = [[0, 0], [camera.width, camera.height]].map((p) => unproject(camera, /** @type {Point} */ (p)));
  const es = corners.map((p) => (p[0] - off[0]) / kx), ns = corners.map((p) => (p[1] - off[1]) / ky);
  const box = /** @type {[number, number, number, number]} */ ([Math.min(...es), Math.min(...ns), Math.max(...es), Math.max(...ns)]);
  const level = levelOf(water, camera.scale);
  /** @type {[string, number, number, number, Tile][]} coarse ones first: they stand in for what has not come */
  const found = [];
  const stand = new Set();
  for (const [x, y] of tilesOf(water, level, box)) {
    const key = `${water.tag}/${level}/${x}/${y}`, tile = tiles.get(key);
    if (tile) { tiles.delete(key); tiles.set(key, tile); found.push([key, level, x, y, tile]); continue; }
    want(key);
    for (let up = 1; up <= COARSER && level + up < water.levels; up++) {
      const [cx, cy] = [x >> up, y >> up], coarse = `${water.tag}/${level + up}/${cx}/${cy}`, other = tiles.get(coarse);
      if (other) { if (!stand.has(coarse)) { stand.add(coarse); found.unshift([coarse, level + up, cx, cy, other]); } break; }
    }
  }
  for (const [, of, x, y, tile] of found) {
    const unit = water.finest_m * 2 ** of / water.units, size = unit * water.tile_units;
    const [ax, ay] = [camera.scale * kx * unit * dense, -camera.scale * ky * unit * dense];
    const left = (camera.width / 2 + camera.scale * (off[0] + kx * x * size - camera.centre[0])) * dense;
    const top = (camera.height / 2 - camera.scale * (off[1] + ky * y * size - camera.centre[1])) * dense;
    context.setTransform(ax, 0, 0, ay, left, top);
    context.save();
    context.beginPath();
    context.rect(-4, -4, water.tile_units + 8, water.tile_units + 8);
    context.clip();
    for (const area of tile.areas) { context.fillStyle = area.colour; context.fill(area.path); }
    for (const line of tile.lines) {
      context.strokeStyle = colour(line.kind === "contour" ? "--chart-contour" : line.kind === "danger" ? "--chart-danger" : "--chart-shore");
      context.lineWidth = (line.kind === "shore" ? 1.3 : 0.7) * dense / ax;
      context.setLineDash(line.kind === "danger" ? [3 * dense / ax, 3 * dense / ax] : []);
      context.stroke(line.path);
    }
    context.restore();
    figures.tiles += 1;
    figures.corners += tile.corners;
    if (of === level) for (const [kind, px, py, deep, text] of tile.points) {
      const [sx, sy] = [left + ax * px, top + ay * py];
      if (sx < 0 || sy < 0 || sx > canvas.width || sy > canvas.height) continue;
      figures.points += 1;
      words.set(`${Math.round(sx / (14 * dense))} ${Math.round(sy / (9 * dense))}`, () => point(context, kind, sx, sy, deep, text, dense, camera.scale));   // of two charts the finer one
    }
  }
}

/** @param {CanvasRenderingContext2D} context @param {string} kind @param {number} x @param {number} y @param {number | null} deep @param {string} text @param {number} dense @param {number} scale */
function point(context, kind, x, y, deep, text, dense, scale) {
  context.setTransform(dense, 0, 0, dense, x, y);
  if (kind === "sounding") {
    context.fillStyle = colour(deep !== null && deep < safe_m ? "--chart-word" : "--chart-soft");
    context.font = "10px sans-serif";
    context.textAlign = "center";
    const said = sounding(deep ?? 0);
    context.fillText(said, 0, 3);
    return;
  }
  context.strokeStyle = context.fillStyle = colour(kind === "name" ? "--chart-word" : "--chart-mark");
  context.lineWidth = 1.3;
  context.beginPath();
  if (kind === "name") {
    context.font = "italic 12px serif";
    context.textAlign = "center";
    return context.fillText(text, 0, 0);
  }
  if (kind === "buoy") { context.moveTo(-3, 3); context.lineTo(0, -6); context.lineTo(3, 3); context.closePath(); context.fill(); }
  else if (kind === "beacon") { context.arc(0, 0, 3, 0, 7); context.stroke(); context.fillRect(-0.8, -9, 1.6, 6); }
  else if (kind === "pile") { context.arc(0, 0, 1.6, 0, 7); context.fill(); }
  else if (kind === "wreck") { context.moveTo(-6, 0); context.lineTo(6, 0); context.moveTo(-3, -3); context.lineTo(-3, 3); context.moveTo(0, -4); context.lineTo(0, 4); context.moveTo(3, -3); context.lineTo(3, 3); context.stroke(); }
  else { context.moveTo(-4, 0); context.lineTo(4, 0); context.moveTo(0, -4); context.lineTo(0, 4); context.stroke(); if (kind === "obstruction") { context.beginPath(); context.setLineDash([2, 2]); context.arc(0, 0, 6, 0, 7); context.stroke(); context.setLineDash([]); } }
  const said = [deep === null || kind === "buoy" || kind === "beacon" ? "" : sounding(deep), scale > 0.25 ? text : ""].filter((word) => word).join(" ");
  if (said) { context.font = "10px sans-serif"; context.textAlign = "left"; context.fillText(said, 8, 3); }
}

const LOW = "₀₁₂₃₄₅₆₇₈₉";
/** A depth as charts write it: tenths below where they matter, heights of what dries with a line in front. @param {number} deep @returns {string} */
export function sounding(deep) {
  const size = Math.abs(deep), sign = deep < 0 ? "−" : "";
  if (size >= 31) return `${sign}${Math.floor(size)}`;
  const tenths = Math.floor(size * 10 + 1e-6), whole = Math.floor(tenths / 10), rest = tenths % 10;
  return `${sign}${whole}${rest ? LOW[rest] : ""}`;
}

/** @returns {boolean} whether a painting or a tile is on its way */
export function isBusy() {
  return isDue || [...asked.values()].some((time) => time === Infinity) || isMoving;
}
