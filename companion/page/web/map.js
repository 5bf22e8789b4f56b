// The chart: own water first. Metres on a local frame; symbols and words stay upright and of one size.
import * as charts from "./charts.js";
import * as passage from "./passage.js";
import { get, picture, renew, set, sketch, svg } from "./dom.js";
import { bearing, distance, drying, duration, percent } from "./format.js";
import { byTack, matrix, moved, path, project, riskClass, scaleBar, unproject } from "./geometry.js";

/** @typedef {import("../../view/view").View} View @typedef {import("../../view/view").Area} Area @typedef {import("../../view/view").Past} Past @typedef {import("./geometry.js").Point} Point @typedef {import("./geometry.js").Camera} Camera */

const ROOM = 1.25;
const LAY_M = 4000;
const LEAST_SCALE = 0.0001;   // px a metre: an ocean

/** @type {Camera} */
const camera = { centre: [0, 0], scale: 1, up: 0, width: 600, height: 400 };
/** The camera by which the signs are written. While the picture only moves they lie where they lay, and their layer moves. @type {Camera} */
const anchor = { ...camera };
/** What is seen, in the pixels of that layer. */
const seen = { left: 0, top: 0, right: 600, bottom: 400 };
/** @typedef {{name: string, past: Past, off: number, count: number}} Other  another voyage: seconds to add to its time, samples until now */
/** @typedef {{way: Point[], risks: (number | null)[]}} Preview */
/** @type {{up: string, follow: boolean, fitted: boolean, view: View | null, area: Area | null, past: Past | null, preview: Preview | null, picks: ((en: Point) => void) | null, other: Other | null}} */
const state = { up: "north", follow: true, fitted: false, view: null, area: null, past: null, preview: null, picks: null, other: null };
/** @typedef {{down: (at: Point, en: Point, event: PointerEvent) => boolean, move: (at: Point, en: Point, event: PointerEvent) => void, up: (at: Point, en: Point, event: PointerEvent) => void, tap: (at: Point, en: Point, event: PointerEvent) => void, hover: (at: Point, en: Point, event: PointerEvent) => void}} Hand  who draws on the chart: what ``down`` takes is not panned */
/** @type {{hand: Hand | null, held: number | null, over: ((at: (en: Point) => Point, camera: Camera) => Element[]) | null, under: ((camera: Camera) => void) | null}} */
const drawing = { hand: null, held: null, over: null, under: null };
/** @type {Record<string, SVGElement>} */
const layers = {};
const root = picture("map");

export function build() {
  const world = svg("g", { class: "world" });
  for (const name of ["chart", "passage", "limits", "grown", "drying", "obstacles", "fan", "other", "tocome", "track"]) world.append(layers[name] = svg("g", { class: name }));
  const signs = svg("g", { class: "signs" });
  for (const name of ["grid", "passagesigns", "wedge", "lay", "plan", "ahead", "preview", "places", "vessels", "ghost", "boat"]) signs.append(layers[name] = svg("g", { class: name }));
  root.append(svg("defs", {}, pattern()), layers.world = world, layers.signs = signs);
  for (const name of ["furniture", "drawing"]) root.append(layers[name] = svg("g", { class: name }));
  passage.build(/** @type {SVGElement} */ (layers.passage), /** @type {SVGElement} */ (layers.passagesigns));
  new ResizeObserver(() => { measure(); draw(); }).observe(root);
  measure();
  listen();
}

function pattern() {
  return svg("pattern", { id: "hatch", width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" },
    svg("line", { x1: 0, y1: 0, x2: 0, y2: 6, class: "hatch" }));
}

function measure() {
  const box = root.getBoundingClientRect();
  camera.width = Math.max(50, box.width);
  camera.height = Math.max(50, box.height);
}

/** @param {View | null} view @param {Area | null} area @param {Past | null} past @param {Other | null} [other] */
export function show(view, area, past, other = null) {
  state.view = view;
  state.other = other;
  state.past = past;
  if (area !== state.area) { state.area = area; water(); }
  if (!state.fitted && view !== null && (view.goals.length > 0 || view.boat.at_en_m !== null)) { all(); state.fitted = true; }
  draw();
}

/** @param {Preview | null} preview */
export function showPreview(preview) {
  state.preview = preview;
  draw();
}

/** What lies under the own water. @param {import("./charts.js").Chart[]} given the lowest first */
export function lay(given) {
  charts.build(given, /** @type {SVGElement} */ (layers.chart), draw);
}

/** The passage that was planned, null: none was. @param {import("../../view/view").Passage | null} planned @param {boolean} [isNow] whether a boat is under way @param {string} [said] why there is none */
export function planned(planned, isNow = true, said = "") {
  passage.take(planned, draw, isNow, said);
}

/** Let the next click choose a place. @param {((en: Point) => void) | null} picks */
export function pick(picks) {
  state.picks = picks;
  root.classList.toggle("picking", picks !== null);
}

/** @param {string} up */
export function orient(up) {
  state.up = up;
  for (const button of document.querySelectorAll("[data-up]")) {
    set(button, { "aria-pressed": /** @type {HTMLElement} */ (button).dataset.up === up ? "true" : "false" });
  }
  draw();
}

/** @param {boolean} follow */
export function follow(follow) {
  state.follow = follow;
  const button = document.getElementById("follow");
  if (button) set(button, { "aria-pressed": follow ? "true" : "false" });
  draw();
}

/** Move what is seen. @param {number} right px @param {number} down px */
export function pan(right, down) {
  camera.centre = unproject(camera, [camera.width / 2 + right, camera.height / 2 + down]);
  follow(false);
}

export function isFollowing() {
  return state.follow;
}

/** @param {number} factor */
export function zoom(factor) {
  camera.scale = Math.min(60, Math.max(LEAST_SCALE, camera.scale * factor));
  draw();
}

/** Show all that matters: the way left, where she was, the goals. */
export function all() {
  /** @type {Point[]} */
  const points = [];
  const { view, past, area } = state;
  if (view) {
    for (const goal of view.goals) points.push(goal.at_en_m);
    for (const leg of view.plan?.legs ?? []) points.push(leg.from_en_m, leg.to_en_m);
    if (view.boat.at_en_m) points.push(view.boat.at_en_m);
    if (view.home) points.push(view.home.at_en_m);
  }
  if (past) for (let n = 0; n < past.t_s.length; n++) {
    const e = past.east_m[n], m = past.north_m[n];
    if (e !== null && e !== undefined && m !== null && m !== undefined) points.push([e, m]);
  }
  if (points.length < 2 && area) for (const shape of [...area.limits, ...area.obstacles]) points.push(...(shape[0] ?? []));
  fit(points);
}

/** Show places. @param {Point[]} points */
export function fit(points) {
  if (points.length === 0) return;
  state.fitted = true;
  const low = [Math.min(...points.map((p) => p[0])), Math.min(...points.map((p) => p[1]))];
  const high = [Math.max(...points.map((p) => p[0])), Math.max(...points.map((p) => p[1]))];
  const wide = Math.max(40, (high[0] ?? 0) - (low[0] ?? 0)), tall = Math.max(40, (high[1] ?? 0) - (low[1] ?? 0));
  camera.centre = [((low[0] ?? 0) + (high[0] ?? 0)) / 2, ((low[1] ?? 0) + (high[1] ?? 0)) / 2];
  camera.scale = Math.min(camera.width / wide, camera.height / tall) / ROOM;
  follow(false);
}

/** Bring a place to the middle. @param {Point} en */
export function centre(en) {
  camera.centre = [en[0], en[1]];
  follow(false);
}

/** The place in the middle, and how many pixels a metre has. */
export function middle() {
  return { en: /** @type {Point} */ ([camera.centre[0], camera.centre[1]]), scale: camera.scale };
}

/** Let somebody draw on the chart: ``over`` gives what lies above everything, ``hand`` hears the pointer first.
 * @param {Hand} hand @param {(at: (en: Point) => Point, camera: Camera) => Element[]} over */
export function drawOn(hand, over) {
  drawing.hand = hand;
  drawing.over = over;
}

/** Let somebody draw below it all, each time. @param {(camera: Camera) => void} under */
export function drawUnder(under) {
  drawing.under = under;
}

/** Draw again. */
export function again() {
  draw();
}

/** @type {WeakMap<readonly Point[], string>} each ring is written once */
const written = new WeakMap();
/** @type {Record<string, (readonly Point[])[]>} the rings that a layer shows */
const shown = {};

/** What does not move. What a layer shows already stays: of an area that is another one most is as it was. */
function water() {
  const key = document.getElementById("dryingkey");
  if (key) key.hidden = !state.area?.drying.length;
  const ring = (/** @type {Point[]} */ points) => {
    let text = written.get(points);
    if (text === undefined) written.set(points, text = path(points, true));
    return text;
  };
  const draw = (/** @type {string} */ name, /** @type {Point[][][][]} */ pictures) => {
    const rings = pictures.flat(2), before = shown[name] ?? [];
    if (rings.length === before.length && rings.every((one, n) => one === before[n]) && layers[name]?.children.length === pictures.length) return;
    shown[name] = rings;
    fill(name, pictures.map((shapes) => sketch("path", { d: shapes.flat().map(ring).join(""), "fill-rule": "evenodd" })));
  };
  const { area } = state;
  for (const name of /** @type {const} */ (["grown", "obstacles", "limits"])) draw(name, (area?.[name] ?? []).map((shape) => [shape]));   // a path each: a browser draws but those that a tile of the picture meets
  draw("drying", (area?.drying ?? []).map((water) => water.shapes));
}

/** Water that dries, as it is at the moment that is shown. @param {View | null} view */
function tides(view) {
  state.area?.drying.forEach((water, n) => {
    const shape = layers.drying?.children[n];
    if (shape) set(shape, { class: drying(water.solid_unix_s, view?.unix_s).isSolid ? "solid" : "open" });
  });
}

function draw() {
  const { view } = state;
  const boat = view?.boat;
  const wind = view?.wind?.mean_twd_from_deg ?? view?.wind?.twd_from_deg ?? null;
  camera.up = state.up === "head" ? boat?.heading_deg ?? boat?.cog_deg ?? 0 : state.up === "wind" ? wind ?? 0 : 0;
  if (state.follow && boat?.at_en_m) {
    camera.centre = state.up === "north" ? boat.at_en_m : moved(boat.at_en_m, camera.up, 0.15 * camera.height / camera.scale);
  }
  set(/** @type {SVGElement} */ (layers.world), { transform: matrix(camera) });
  set(/** @type {Element} */ (root.querySelector("#hatch")), { patternTransform: `rotate(45) scale(${1 / camera.scale})` });
  charts.draw(camera, state.area);
  tides(view);
  drawing.under?.(camera);
  moveSigns();
  const at = (/** @type {Point} */ en) => project(anchor, en);
  grid(at);
  passage.draw(view, { at, seen, up: camera.up, isSouth: (state.area?.origin_lat_deg ?? 0) < 0 });
  passage.say(view);
  track();
  laylines(view, at);
  wedge(view, at);
  plan(view, at);
  expected(view, at);
  previewed(at);
  places(view, at);
  vessels(view, at);
  beside(at);
  own(view, at);
  furniture(view, wind);
  if (drawing.over) layers.drawing?.replaceChildren(...drawing.over((en) => project(camera, en), camera));
}

/** Move the layer of the signs, or write them by the present camera where it is turned, nearer, or far away. */
function moveSigns() {
  let [x, y] = project(camera, anchor.centre);
  const isFar = Math.hypot(x, y) > 3 * (camera.width + camera.height);
  if (isFar || anchor.scale !== camera.scale || anchor.up !== camera.up || anchor.width !== camera.width || anchor.height !== camera.height) {
    Object.assign(anchor, camera, { centre: [...camera.centre] });
    [x, y] = [camera.width / 2, camera.height / 2];
  }
  const left = camera.width / 2 - x, top = camera.height / 2 - y;
  Object.assign(seen, { left, top, right: left + camera.width, bottom: top + camera.height });
  set(/** @type {SVGElement} */ (layers.signs), { transform: `translate(${-left} ${-top})` });
}

/** @param {string} name @param {import("./dom.js").Sketch[]} children */
function fill(name, children) {
  const layer = layers[name];
  if (layer) renew(layer, children);
}

/** @param {(en: Point) => Point} at */
function grid(at) {
  const step = scaleBar(camera.scale, 170).metres;
  const corners = [[0, 0], [camera.width, 0], [0, camera.height], [camera.width, camera.height]].map(
    (p) => unproject(camera, /** @type {Point} */ (p)));
  const es = corners.map((p) => p[0]), ns = corners.map((p) => p[1]);
  // from line to line: while none comes into sight the grid is the same
  const [west, east] = [Math.floor(Math.min(...es) / step), Math.ceil(Math.max(...es) / step)], [south, north] = [Math.floor(Math.min(...ns) / step), Math.ceil(Math.max(...ns) / step)];
  const lines = [];
  for (let e = west; e <= east; e++) lines.push(path([at([e * step, south * step]), at([e * step, north * step])]));
  for (let n = south; n <= north; n++) lines.push(path([at([west * step, n * step]), at([east * step, n * step])]));
  fill("grid", [sketch("path", { d: lines.join("") })]);
}

/** @type {Record<string, readonly unknown[]>} what the track in a layer was drawn of: it lies in metres, and the camera is nothing to it */
const tracked = {};

/** Is a track drawn of this already? @param {string} name @param {readonly unknown[]} made */
function isTracked(name, made) {
  const before = tracked[name];
  tracked[name] = made;
  return before !== undefined && made.every((one, n) => one === before[n]);
}

const PIECE = 256;   // samples of the past that are written once, as soon as they are whole
/** @type {{made: readonly unknown[], pieces: Map<string, import("./dom.js").Sketch[]>}} */
const whole = { made: [], pieces: new Map() };

/** What is drawn of samples. @param {Past} past @param {number} from @param {number} to the first that is not @param {boolean} hasCome */
function pieces(past, from, to, hasCome) {
  /** @type {import("./dom.js").Sketch[]} */
  const out = [];
  for (let begin = PIECE * Math.floor(from / PIECE); begin + 1 < to; begin += PIECE) {
    const [a, b] = [Math.max(from, begin), Math.min(to, begin + PIECE + 1)], isWhole = b - a === PIECE + 1, name = `${begin} ${hasCome}`;
    const made = (isWhole ? whole.pieces.get(name) : undefined) ?? byTack(past.east_m.slice(a, b), past.north_m.slice(a, b), hasCome ? past.starboard.slice(a, b) : []).map((piece) =>
      sketch("path", { d: path(piece.points), class: !hasCome ? null : piece.starboard === null ? "unknown" : piece.starboard ? "starboard" : "port" }));
    if (isWhole) whole.pieces.set(name, made);
    out.push(...made);
  }
  return out;
}

function track() {
  const past = state.past;
  // what has not come yet of a recorded voyage is shown faintly: what was known then against what came
  const now = state.view?.t_s ?? Infinity, length = past?.t_s.length ?? 0;
  let count = length;
  while (past !== null && count > 0 && (past.t_s[count - 1] ?? 0) > now + 0.05) count -= 1;
  if (isTracked("track", [past, length, past?.t_s[0], past?.t_s[length - 1], count])) return;   // a past grows at its end, and is cut at its beginning
  if (past === null) { fill("tocome", []); return fill("track", []); }
  if (whole.made[0] !== past || whole.made[1] !== past.t_s[0]) Object.assign(whole, { made: [past, past.t_s[0]], pieces: new Map() });
  fill("track", pieces(past, 0, count, true));
  fill("tocome", count < length ? pieces(past, Math.max(0, count - 1), length, false) : []);
}

/** @param {View | null} view @param {(en: Point) => Point} at */
function laylines(view, at) {
  const lay = view?.laylines;
  if (!lay) return fill("lay", []);
  /** @type {import("./dom.js").Sketch[]} */
  const children = [];
  for (const line of lay.lines) {
    const end = (/** @type {number} */ off) => at(moved(lay.mark_en_m, line.course_deg + 180 + off, LAY_M));
    children.push(sketch("path", { class: `fan ${line.tack}`, d: path([at(lay.mark_en_m), end(-line.swing_deg), end(line.swing_deg)], true) }));
    children.push(sketch("path", { class: `line ${line.tack}`, d: path([at(lay.mark_en_m), end(0)]) }));
  }
  fill("lay", children);
}

/** The no-go zone about the boat, now, in a minute and in five. @param {View | null} view @param {(en: Point) => Point} at */
function wedge(view, at) {
  const boat = view?.boat.at_en_m, zone = view?.no_go;
  if (!boat || !zone) return fill("wedge", []);
  const [x, y] = at(boat);
  /** @type {import("./dom.js").Sketch[]} */
  const children = [];
  [...zone.wedges].reverse().forEach((one, n) => {
    const radius = 46 + 16 * (zone.wedges.length - 1 - n);
    const side = (/** @type {number} */ degrees) => {
      const angle = (degrees - camera.up) * Math.PI / 180;
      return [x + radius * Math.sin(angle), y - radius * Math.cos(angle)];
    };
    const [a, b] = [side(one.from_deg - one.half_deg), side(one.from_deg + one.half_deg)];
    const large = one.half_deg > 90 ? 1 : 0;
    children.push(sketch("path", { class: `zone z${zone.wedges.length - 1 - n}`,
      d: `M${x} ${y}L${a[0]} ${a[1]}A${radius} ${radius} 0 ${large} 1 ${b[0]} ${b[1]}Z` }));
  });
  fill("wedge", children);
}

/** @param {View | null} view @param {(en: Point) => Point} at */
function plan(view, at) {
  /** @type {import("./dom.js").Sketch[]} */
  const children = [];
  const legs = view?.plan?.legs ?? [];
  legs.forEach((leg, n) => {
    if (leg.is_loiter) return;
    const from = n === 0 && view?.boat.at_en_m ? leg.from_en_m : leg.from_en_m;
    children.push(sketch("path", { d: path([at(from), at(leg.to_en_m)]), class: `leg r${riskClass(leg.risk)}${leg.is_beat ? " beat" : ""}` }));
  });
  legs.forEach((leg, n) => {
    if (leg.is_loiter) return;
    const [x, y] = at(leg.to_en_m);
    children.push(sketch("circle", { cx: x, cy: y, r: 3, class: "waypoint" }));
    const words = [];
    const [fx, fy] = at(leg.from_en_m);
    if (leg.manoeuvre && n > 0) children.push(sketch("text", { x: fx + 7, y: fy - 6, class: "word small" }, leg.manoeuvre));
    if (leg.risk !== null && leg.risk >= 0.02) words.push(percent(leg.risk));
    const [a, b] = [at(leg.from_en_m), at(leg.to_en_m)];
    if (words.length && Math.hypot(a[0] - b[0], a[1] - b[1]) > 45) {
      const off = 11 / Math.max(1, Math.hypot(b[0] - a[0], b[1] - a[1]));
      const right = (b[1] - a[1]) > 0 === (b[0] - a[0]) > 0;
      children.push(sketch("text", { x: (a[0] + b[0]) / 2 + off * Math.abs(b[1] - a[1]), y: (a[1] + b[1]) / 2 + (right ? -4 : 12), class: "word" }, words.join(" ")));
    }
  });
  fill("plan", children);
}

/** @param {View | null} view @param {(en: Point) => Point} at */
function expected(view, at) {
  const ahead = view?.predicted ?? [];
  const children = [sketch("path", { d: path(ahead.map((p) => at(p.at_en_m))), class: "way" })];
  let minute = 60;
  for (let n = 1; n < ahead.length; n++) {
    const a = ahead[n - 1], b = ahead[n];
    if (!a || !b) continue;
    while (minute <= b.in_s && b.in_s > a.in_s) {
      const f = (minute - a.in_s) / (b.in_s - a.in_s);
      const [x, y] = at([a.at_en_m[0] + f * (b.at_en_m[0] - a.at_en_m[0]), a.at_en_m[1] + f * (b.at_en_m[1] - a.at_en_m[1])]);
      if (minute === 60 && b.within_m !== null) {   // nine boats in ten are within
        const edge = at([a.at_en_m[0] + f * (b.at_en_m[0] - a.at_en_m[0]) + b.within_m, a.at_en_m[1] + f * (b.at_en_m[1] - a.at_en_m[1])]);
        children.push(sketch("circle", { cx: x, cy: y, r: Math.hypot(edge[0] - x, edge[1] - y), class: "within" }));
      }
      children.push(sketch("circle", { cx: x, cy: y, r: 2.2, class: "minute" }), sketch("text", { x: x + 5, y: y - 4, class: "word small" }, `${minute / 60}′`));
      minute += 60;
    }
  }
  fill("ahead", children);
}

/** @param {(en: Point) => Point} at */
function previewed(at) {
  const preview = state.preview;
  if (preview === null) return fill("preview", []);
  const children = [];
  for (let n = 1; n < preview.way.length; n++) {
    const a = preview.way[n - 1], b = preview.way[n];
    if (a && b) children.push(sketch("path", { d: path([at(a), at(b)]), class: `leg r${riskClass(preview.risks[n - 1])}` }));
  }
  const end = preview.way[preview.way.length - 1];
  if (end) {
    const [x, y] = at(end);
    children.push(sketch("circle", { cx: x, cy: y, r: 9, class: "target" }), sketch("path", { d: `M${x - 14} ${y}h28M${x} ${y - 14}v28`, class: "target" }));
  }
  fill("preview", children);
}

/** @type {WeakMap<readonly Point[], [number, number, number, number]>} */
const extents = new WeakMap();

/** How far a ring reaches east, west, south and north, asked of its corners once. @param {readonly Point[]} ring */
function extent(ring) {
  let known = extents.get(ring);
  if (known === undefined) {
    known = [-Infinity, Infinity, Infinity, -Infinity];
    for (const [e, n] of ring) known = [Math.max(known[0], e), Math.min(known[1], e), Math.min(known[2], n), Math.max(known[3], n)];
    extents.set(ring, known);
  }
  return known;
}

/** @param {View | null} view @param {(en: Point) => Point} at */
function places(view, at) {
  const children = [];
  /** @type {[Point, string, string][]} */
  const words = [];
  for (const goal of view?.goals ?? []) {
    const [x, y] = at(goal.at_en_m);
    const kind = goal.is_reached ? "reached" : goal.is_next ? "next" : "later";
    if (goal.radius_m) children.push(sketch("circle", { cx: x, cy: y, r: Math.max(3, goal.radius_m * camera.scale), class: `goal ${kind}` }));
    if (goal.line_en_m) {
      const [p, s] = goal.line_en_m.map(at);
      if (p && s) children.push(sketch("path", { d: path([p, s]), class: `gate ${kind}` }), sketch("circle", { cx: p[0], cy: p[1], r: 4, class: "mark port" }), sketch("circle", { cx: s[0], cy: s[1], r: 4, class: "mark starboard" }));
    }
    children.push(sketch("path", { d: `M${x} ${y - 6}l5 9h-10z`, class: `goal flag ${kind}` }));
    words.push([[x + 9, y - 6], goal.name + (goal.side ? ` (${goal.side})` : ""), kind]);
  }
  for (const refuge of view?.refuges ?? []) {
    const [x, y] = at(refuge.at_en_m);
    children.push(sketch("rect", { x: x - 5, y: y - 5, width: 10, height: 10, class: "refuge" }));
    words.push([[x + 9, y + 4], refuge.name || "refuge", "refuge"]);
  }
  if (view?.home) {
    const [x, y] = at(view.home.at_en_m);
    children.push(sketch("path", { d: `M${x} ${y - 6}l6 5v6h-12v-6z`, class: "home" }));
    words.push([[x + 9, y + 14], "home", "home"]);
  }
  if (view?.safe_end && view.plan) {
    const [x, y] = at(view.safe_end.at_en_m);
    children.push(sketch("circle", { cx: x, cy: y, r: 7, class: "safeend" }));
    if (!view.goals.some((goal) => Math.hypot(at(goal.at_en_m)[0] - x, at(goal.at_en_m)[1] - y) < 30)) words.push([[x + 9, y + 14], "safe end", "safeend"]);
  }
  if (view?.orders.standing?.at_en_m) {
    const [x, y] = at(view.orders.standing.at_en_m);
    children.push(sketch("path", { d: `M${x - 8} ${y}h16M${x} ${y - 8}v16`, class: "ordered" }));
    words.push([[x + 9, y + 4], "ordered", "ordered"]);
  }
  /** @type {Point[]} */
  const taken = [];
  for (const [[x, y], text, kind] of words) {
    let line = y;
    while (taken.some(([a, b]) => Math.abs(a - x) < 70 && Math.abs(b - line) < 12)) line += 12;
    taken.push([x, line]);
    const isCut = x + 8 * text.length > seen.right;
    children.push(sketch("text", { x: isCut ? x - 18 : x, y: line, class: `word ${kind}`, "text-anchor": isCut ? "end" : "start" }, text));
  }
  const land = (/** @type {string} */ name, /** @type {Point[]} */ ring, /** @type {string} */ kind) => {
    const [e, w, s, m] = extent(ring);
    const [x, y] = at([(e + w) / 2, (s + m) / 2]);
    // a name that its island has room for, and nothing else is written over
    if (Math.max(e - w, m - s) * camera.scale < 24 || taken.some(([a, b]) => Math.abs(a - x) < 70 && Math.abs(b - y) < 12)) return;
    taken.push([x, y]);
    children.push(sketch("text", { x, y: y + 4, class: `word ${kind}`, "text-anchor": "middle" }, name));
  };
  for (const water of state.area?.drying ?? []) land(`${water.name}: ${drying(water.solid_unix_s, view?.unix_s).words}`, water.shapes[0]?.[0] ?? [], "drying");
  state.area?.names?.forEach((name, n) => land(name, state.area?.obstacles[n]?.[0] ?? [], "land"));
  fill("places", children);
}

/** @param {View | null} view @param {(en: Point) => Point} at */
function vessels(view, at) {
  const children = [];
  for (const vessel of view?.vessels ?? []) {
    if (!vessel.at_en_m) continue;
    const [x, y] = at(vessel.at_en_m);
    const heading = vessel.heading_deg ?? vessel.course_deg;
    const alarm = vessel.alarm && vessel.alarm !== "none" ? vessel.alarm : "clear";
    if (vessel.cpa_en_m && vessel.own_cpa_en_m && view?.boat.at_en_m) {
      const [a, b] = [at(vessel.cpa_en_m), at(vessel.own_cpa_en_m)];
      children.push(sketch("path", { d: path([[x, y], a]), class: "vector" }), sketch("path", { d: path([at(view.boat.at_en_m), b]), class: "vector own" }),
        sketch("path", { d: path([a, b]), class: `cpa ${alarm}` }));
      children.push(sketch("circle", { cx: a[0], cy: a[1], r: 4, class: `ghost ${alarm}` }));
    }
    const length = Math.max(16, (vessel.length_m ?? 12) * camera.scale), beam = Math.max(7, (vessel.beam_m ?? 4) * camera.scale);
    children.push(heading === null
      ? sketch("rect", { x: x - 5, y: y - 5, width: 10, height: 10, class: `vessel ${alarm}`, transform: `rotate(45 ${x} ${y})` })
      : sketch("path", { d: `M0 ${-length / 2}L${beam / 2} ${-length / 6}V${length / 2}H${-beam / 2}V${-length / 6}Z`, class: `vessel ${alarm}`, transform: `translate(${x} ${y}) rotate(${heading - camera.up})` }));
    const cpa = vessel.cpa_s === null ? "opening" : `CPA ${distance(vessel.cpa_m)} in ${duration(vessel.cpa_s)}`;
    children.push(sketch("text", { x: x + beam / 2 + 6, y: y - 4, class: `word vesselword ${alarm}` }, vessel.name),
      sketch("text", { x: x + beam / 2 + 6, y: y + 9, class: `word small vesselword ${alarm}` }, cpa));
  }
  fill("vessels", children);
}

/** The other voyage at this moment. @param {(en: Point) => Point} at */
function beside(at) {
  const other = state.other;
  const isSame = isTracked("other", [other?.past, other?.count]);
  if (!other) { if (!isSame) fill("other", []); return fill("ghost", []); }
  if (!isSame) fill("other", byTack(other.past.east_m.slice(0, other.count), other.past.north_m.slice(0, other.count), []).map((piece) => sketch("path", { d: path(piece.points) })));
  const n = other.count - 1, e = other.past.east_m[n], m = other.past.north_m[n];
  if (e == null || m == null) return fill("ghost", []);
  const [x, y] = at([e, m]);
  fill("ghost", [sketch("path", { d: "M0-13C5-6 5 3 3.5 9H-3.5C-5 3-5-6 0-13Z", transform: `translate(${x} ${y}) rotate(${(other.past.heading_deg[n] ?? 0) - camera.up})` }), sketch("text", { x: x + (x > seen.right - 110 ? -9 : 9), y: y + 12, class: "word small", "text-anchor": x > seen.right - 110 ? "end" : "start" }, `beside: ${other.name}`)]);
}

/** @param {View | null} view @param {(en: Point) => Point} at */
function own(view, at) {
  const boat = view?.boat;
  if (!boat?.at_en_m) return fill("boat", []);
  const [x, y] = at(boat.at_en_m);
  const children = [];
  if (boat.cog_deg !== null && boat.sog_mps !== null && boat.sog_mps > 0.2) {
    children.push(sketch("path", { d: path([[x, y], at(moved(boat.at_en_m, boat.cog_deg, 30 * boat.sog_mps))]), class: "course" }));
  }
  const turn = boat.heading_deg ?? boat.cog_deg;
  children.push(turn === null
    ? sketch("circle", { cx: x, cy: y, r: 6, class: "hull" })
    : sketch("path", { d: "M0-13C5-6 5 3 3.5 9H-3.5C-5 3-5-6 0-13Z", class: "hull", transform: `translate(${x} ${y}) rotate(${turn - camera.up})` }));
  fill("boat", children);
}

/** North, wind, scale. @param {View | null} view @param {number | null} wind */
function furniture(view, wind) {
  const bar = scaleBar(camera.scale, Math.min(170, camera.width / 3));
  const x = 14, y = camera.height - 16;
  const children = [
    sketch("path", { d: `M${x} ${y - 5}v5h${bar.pixels}v-5`, class: "scale" }),
    sketch("text", { x: x + bar.pixels + 6, y: y + 2, class: "word" }, distance(bar.metres).replace(".0", "")),
    sketch("g", { transform: `translate(${camera.width - 30} 34) rotate(${-camera.up})`, class: "north" },
      sketch("path", { d: "M0-18L5 6L0 2L-5 6Z" }), sketch("text", { x: 0, y: 19, "text-anchor": "middle", transform: `rotate(${camera.up} 0 15)` }, "N")),
  ];
  if (wind !== null) {
    children.push(sketch("g", { transform: `translate(${camera.width - 72} 34) rotate(${wind - camera.up})`, class: "windarrow" }, sketch("path", { d: "M0 18V-10M-5 8L0 18L5 8" })),
      sketch("text", { x: camera.width - 72, y: 68, "text-anchor": "middle", class: "word wind" }, view?.wind?.mean_twd_from_deg == null ? bearing(wind) : `mean ${bearing(view.wind.mean_twd_from_deg)}`));
  }
  fill("furniture", children);
}

function listen() {
  /** @type {Map<number, Point>} */
  const down = new Map();
  let wasMoved = false;
  const here = (/** @type {PointerEvent | WheelEvent} */ event) => {
    const box = root.getBoundingClientRect();
    return /** @type {Point} */ ([event.clientX - box.left, event.clientY - box.top]);
  };
  root.addEventListener("pointerdown", (event) => {
    root.setPointerCapture(event.pointerId);
    const at = here(event);
    if (down.size === 0 && drawing.held === null && drawing.hand?.down(at, unproject(camera, at), event)) { drawing.held = event.pointerId; return; }
    down.set(event.pointerId, at);
    wasMoved = down.size > 1;   // two fingers choose no place
  });
  root.addEventListener("pointermove", (event) => {
    const from = down.get(event.pointerId), to = here(event);
    if (drawing.held === event.pointerId) return drawing.hand?.move(to, unproject(camera, to), event);
    if (from === undefined) return drawing.hand?.hover(to, unproject(camera, to), event);
    if (!wasMoved && Math.hypot(to[0] - from[0], to[1] - from[1]) < 4) return;
    wasMoved = true;
    if (down.size === 2) {
      const other = [...down.entries()].find(([id]) => id !== event.pointerId)?.[1];
      if (other) zoom(Math.hypot(to[0] - other[0], to[1] - other[1]) / Math.max(1, Math.hypot(from[0] - other[0], from[1] - other[1])));
    } else {
      const [a, b] = [unproject(camera, from), unproject(camera, to)];
      camera.centre = [camera.centre[0] + a[0] - b[0], camera.centre[1] + a[1] - b[1]];
      if (state.follow) follow(false); else draw();
    }
    down.set(event.pointerId, to);
  });
  const up = (/** @type {PointerEvent} */ event) => {
    const at = here(event);
    if (drawing.held === event.pointerId) { drawing.held = null; return drawing.hand?.up(at, unproject(camera, at), event); }
    if (down.size === 1 && down.has(event.pointerId) && !wasMoved && state.picks === null && event.type === "pointerup") drawing.hand?.tap(at, unproject(camera, at), event);
    if (down.delete(event.pointerId) && !wasMoved && state.picks !== null && event.type === "pointerup") {
      const picks = state.picks;
      pick(null);
      picks(unproject(camera, at));
    }
  };
  root.addEventListener("pointerup", up);
  root.addEventListener("pointercancel", up);
  root.addEventListener("wheel", (event) => {
    event.preventDefault();
    const at = here(event), before = unproject(camera, at);
    camera.scale = Math.min(60, Math.max(LEAST_SCALE, camera.scale * Math.exp(-event.deltaY / 500)));
    const after = unproject(camera, at);
    if (!state.follow) camera.centre = [camera.centre[0] + before[0] - after[0], camera.centre[1] + before[1] - after[1]];
    draw();
  }, { passive: false });
}

/** Where the chart's metres are on the globe. @param {Point} en @returns {Point | null} latitude, longitude */
export function onGlobe(en) {
  const area = state.area;
  return area === null ? null : [area.origin_lat_deg + en[1] / area.lat_m, area.origin_lon_deg + en[0] / area.lon_m];
}

/** The place on the screen, for tests. @param {Point} en */
export function onScreen(en) {
  return project(camera, en);
}
