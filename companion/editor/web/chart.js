// Drawing on the chart: tools, handles, and what lies above the water of the map.
import { get, set, svg } from "./dom.js";
import { path } from "./geometry.js";
import * as map from "./map.js";
import { called, distanceTo, inserted, moved, placeOf, ringEn, toEn, toPlace, within, withGoal } from "./sketch.js";

/** @typedef {import("./sketch.js").Sketch} Sketch @typedef {import("./sketch.js").Ref} Ref @typedef {import("./sketch.js").Place} Place @typedef {import("./sketch.js").Point} Point @typedef {import("./sketch.js").Frame} Frame @typedef {import("./sketch.js").Shape} Shape @typedef {import("./geometry.js").Camera} Camera */
/** What the chart asks of the editor. @typedef {{sketch: () => Sketch, frame: () => Frame, selected: () => Ref | null, select: (ref: Ref | null) => void, draft: (sketch: Sketch) => void, commit: (sketch: Sketch, ref?: Ref | null) => void}} Editor */

const NEAR = 13, NEAR_TOUCH = 24;      // px of a handle
/** name, key, what it is, how it is drawn: one point, two points or a polygon @type {[string, string, string, string, string][]} */
export const TOOLS = [
  ["select", "v", "Move", "", "Drag a point to move it; click a thing for its numbers; drag the water to move the chart."],
  ["start", "s", "Start", "one", "Click where the boat starts."],
  ["goal", "g", "Mark", "one", "Click the marks in the order of the course."],
  ["gate", "t", "Gate", "two", "Click the mark to be left to port, then the one to starboard."],
  ["box", "b", "Box", "polygon", "Click the corners of the water to stay in; the first one again closes it."],
  ["search", "h", "Search", "polygon", "Click the corners of the water to look at; the first one again closes it."],
  ["refuge", "r", "Refuge", "one", "Click safe places to wait in."],
  ["obstacle", "o", "Obstacle", "polygon", "Click round the obstacle; the first corner again closes it."],
  ["rock", "k", "Rock", "one", "Click rocks, buoys and other points to keep clear of."],
  ["fence", "f", "Fence", "polygon", "Click round the water to stay inside of; the first corner again closes it."],
];

/** @type {Editor} */ let editor;
let tool = "select";
/** @type {Place[]} */ let pending = [];
/** @type {Point | null} */ let cursor = null;
/** @type {{ref: Ref, from: Sketch} | null} */ let drag = null;
let isByKeys = false;

/** @param {Editor} owner */
export function build(owner) {
  editor = owner;
  map.drawOn({ down, move, up, tap, hover }, over);
  get("tools").replaceChildren(...TOOLS.map(([name, key, words]) => {
    const button = document.createElement("button");
    set(button, { type: "button", "data-tool": name, "aria-pressed": name === tool ? "true" : "false", title: `${words} (${key})` });
    button.append(sign(name), words);
    button.addEventListener("click", () => choose(name));
    return button;
  }));
  get("done").addEventListener("click", () => finish());
  get("back").addEventListener("click", () => back());
  get("give").addEventListener("click", () => cancel());
  choose("select");
}

/** A small sign of a tool. @param {string} name */
export function sign(name) {
  const icon = svg("svg", { viewBox: "-9 -9 18 18", class: `sign ${name}`, "aria-hidden": "true" });
  const draw = (/** @type {string} */ d, extra = {}) => icon.append(svg("path", { d, ...extra }));
  if (name === "select") draw("M-5-7V5L-2 2L1 8L3 7L0 1H5Z", { class: "full" });
  if (name === "start") draw("M0-7C3-3 3 2 2 6H-2C-3 2-3-3 0-7Z");
  if (name === "goal") draw("M0-6L5 5H-5Z", { class: "full" });
  if (name === "gate") { draw("M-6 0H6", { class: "dashed" }); icon.append(svg("circle", { cx: -6, cy: 0, r: 2.6, class: "port" }), svg("circle", { cx: 6, cy: 0, r: 2.6, class: "starboard" })); }
  if (name === "box") draw("M-6-5H6V5H-6Z");
  if (name === "search") draw("M-6-5H6V-1H-6V3H6");
  if (name === "refuge") draw("M-5-5H5V5H-5Z", { class: "good" });
  if (name === "obstacle") draw("M-6 2L-3-5L4-4L6 3L0 6Z", { class: "land" });
  if (name === "rock") draw("M-5 0H5M0-5V5M-3.5-3.5L3.5 3.5M-3.5 3.5L3.5-3.5");
  if (name === "fence") draw("M-6-3L2-6L6 2L-2 6Z", { class: "dashed" });
  return icon;
}

/** @param {string} name */
export function choose(name) {
  tool = name;
  pending = [];
  drag = null;
  for (const button of document.querySelectorAll("[data-tool]")) set(button, { "aria-pressed": /** @type {HTMLElement} */ (button).dataset.tool === tool ? "true" : "false" });
  if (tool === "fence" && editor.sketch().shapes.some((shape) => shape.zone === "inclusion")) {
    const n = editor.sketch().shapes.findIndex((shape) => shape.zone === "inclusion");
    tool = "select";
    choose("select");
    editor.select({ of: "shape", n });
    return hint("There is a fence: drag its corners, or delete it and draw another.");
  }
  get("map").classList.toggle("picking", tool !== "select");
  hint(TOOLS.find((row) => row[0] === tool)?.[4] ?? "");
  doing();
  map.again();
}

export function tooled() {
  return tool;
}

/** @param {string} words */
export function hint(words) {
  get("hint").textContent = words;
}

function doing() {
  const style = TOOLS.find((row) => row[0] === tool)?.[3];
  get("doing").hidden = pending.length === 0;
  set(get("done"), { hidden: style !== "polygon", disabled: pending.length < 3 });
}

/** Give up what is being drawn; with nothing begun the tool. */
export function cancel() {
  if (pending.length > 0) { pending = []; doing(); map.again(); return; }
  if (tool !== "select") return choose("select");
  editor.select(null);
}

export function back() {
  pending = pending.slice(0, -1);
  doing();
  map.again();
  return true;
}

export function isDrawing() {
  return pending.length > 0;
}

/** Put a point of the tool's there. @param {Point} en */
export function put(en) {
  const at = toPlace(editor.frame(), en), sketch = editor.sketch();
  if (tool === "start") { editor.commit({ ...sketch, start: { heading_deg: 0, ...sketch.start, at } }, { of: "start", n: 0 }); return choose("select"); }
  if (tool === "goal") return editor.commit(withGoal(sketch, { kind: "point", at, radius_m: 10 }), { of: "goal", n: sketch.goals.length });
  if (tool === "refuge") return editor.commit({ ...sketch, refuges: [...sketch.refuges, { at, radius_m: 15 }] }, { of: "refuge", n: sketch.refuges.length });
  if (tool === "rock") return editor.commit({ ...sketch, shapes: [...sketch.shapes, { type: "point", zone: "exclusion", rings: [[at]] }] }, { of: "shape", n: sketch.shapes.length });
  pending = [...pending, at];
  if (tool === "gate" && pending.length === 2) {
    const [port_mark, starboard_mark] = pending;
    pending = [];
    editor.commit(withGoal(sketch, { kind: "gate", port_mark, starboard_mark, mark_radius_m: 5 }), { of: "goal", n: sketch.goals.length });
  }
  doing();
  map.again();
}

/** Close the polygon that is drawn. */
export function finish() {
  if (pending.length < 3) return;
  const ring = pending, sketch = editor.sketch();
  pending = [];
  if (tool === "box") editor.commit(withGoal(sketch, { kind: "box", ring, for_s: 300 }), { of: "goal", n: sketch.goals.length });
  else if (tool === "search") editor.commit(withGoal(sketch, { kind: "search", ring, swath_m: 20, coverage: 0.95 }), { of: "goal", n: sketch.goals.length });
  else editor.commit({ ...sketch, shapes: [...sketch.shapes, { type: "polygon", zone: tool === "fence" ? "inclusion" : "exclusion", rings: [ring] }] }, { of: "shape", n: sketch.shapes.length });
  if (tool === "fence") choose("select");
  doing();
  map.again();
}

// ------------------------------------------------------------------------------------------------------ the pointer
/** @param {Ref} ref */
function screen(ref) {
  const place = placeOf(editor.sketch(), ref);
  return place === null ? null : map.onScreen(toEn(editor.frame(), place));
}

/** The points that may be taken hold of, the nearest things first: those of what is selected, then every mark. @returns {{ref: Ref, kind: "point" | "between" | "whole"}[]} */
function handles() {
  const sketch = editor.sketch(), selected = editor.selected();
  /** @type {{ref: Ref, kind: "point" | "between" | "whole"}[]} */
  const out = [];
  if (selected?.of === "shape" || (selected?.of === "goal" && sketch.goals[selected.n]?.ring)) {
    const rings = selected.of === "shape" ? sketch.shapes[selected.n]?.rings ?? [] : [sketch.goals[selected.n]?.ring ?? []];
    rings.forEach((ring, r) => ring.forEach((_, v) => out.push({ ref: { of: selected.of, n: selected.n, part: "ring", ring: r, v }, kind: "point" })));
    const type = selected.of === "shape" ? sketch.shapes[selected.n]?.type : "polygon";
    if (type === "polygon" || type === "line") {
      rings.forEach((ring, r) => ring.forEach((_, v) => { if (type === "polygon" || v + 1 < ring.length) out.push({ ref: { of: selected.of, n: selected.n, part: "ring", ring: r, v }, kind: "between" }); }));
      out.push({ ref: { of: selected.of, n: selected.n }, kind: "whole" });
    }
  }
  if (sketch.start) out.push({ ref: { of: "start", n: 0 }, kind: "point" });
  sketch.goals.forEach((goal, n) => {
    if (goal.kind === "point" || goal.kind === "field") out.push({ ref: { of: "goal", n, part: "at" }, kind: "point" });
    if (goal.kind === "gate") for (const part of /** @type {const} */ (["port_mark", "starboard_mark"])) out.push({ ref: { of: "goal", n, part }, kind: "point" });
  });
  sketch.refuges.forEach((_, n) => out.push({ ref: { of: "refuge", n }, kind: "point" }));
  sketch.shapes.forEach((shape, n) => { if (shape.type === "point" || shape.type === "circle") out.push({ ref: { of: "shape", n, ring: 0, v: 0 }, kind: "point" }); });
  return out;
}

/** Where a handle between two points is. @param {Ref} ref @returns {Place | null} */
function between(ref) {
  const sketch = editor.sketch();
  const ring = ref.of === "shape" ? sketch.shapes[ref.n]?.rings[ref.ring ?? 0] : sketch.goals[ref.n]?.ring;
  const a = ring?.[ref.v ?? 0], b = ring?.[((ref.v ?? 0) + 1) % (ring?.length ?? 1)];
  return a && b ? [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2] : null;
}

/** @param {Point} at @param {PointerEvent} event */
function taken(at, event) {
  const reach = event.pointerType === "touch" ? NEAR_TOUCH : NEAR;
  let best = null, least = reach;
  const on = (/** @type {Place} */ place) => map.onScreen(toEn(editor.frame(), place));
  for (const handle of handles()) {
    if (handle.kind !== "point" && isCrowded(editor.sketch(), handle.ref, handle.kind, on)) continue;
    const place = handle.kind === "between" ? between(handle.ref) : placeOf(editor.sketch(), handle.ref);
    if (place === null) continue;
    const [x, y] = map.onScreen(toEn(editor.frame(), place));
    const far = Math.hypot(x - at[0], y - at[1]) + (handle.kind === "point" ? 0 : 4);
    if (far < least) { least = far; best = handle; }
  }
  return best;
}

/** @param {Point} at @param {Point} _en @param {PointerEvent} event */
function down(at, _en, event) {
  isByKeys = false;
  if (event.button > 0 || tool !== "select") return false;
  const handle = taken(at, event);
  if (handle === null) return false;
  let ref = handle.ref, from = editor.sketch();
  if (handle.kind === "between") {
    const place = between(ref);
    if (place === null) return false;
    from = inserted(from, ref, place);
    ref = { ...ref, v: (ref.v ?? 0) + 1 };
  }
  editor.select(ref);
  if (handle.kind === "between") editor.draft(from);
  drag = { ref, from };
  return true;
}

export function isDragging() {
  return drag !== null;
}

/** @param {Point} _at @param {Point} en */
function move(_at, en) {
  if (drag) editor.draft(moved(drag.from, drag.ref, toPlace(editor.frame(), en)));
}

/** @param {Point} _at @param {Point} _en @param {PointerEvent} event */
function up(_at, _en, event) {
  const was = drag;
  drag = null;
  if (!was) return;
  if (event.type === "pointercancel") return editor.draft(was.from);
  editor.commit(editor.sketch(), was.ref);
}

/** @param {Point} at @param {Point} en */
function hover(at, en) {
  if (tool === "select") return;
  cursor = en;
  if (pending.length > 0) map.again();
}

/** @param {Point} at @param {Point} en @param {PointerEvent} event */
function tap(at, en, event) {
  isByKeys = false;
  if (tool === "select") return editor.select(thingAt(en));
  const style = TOOLS.find((row) => row[0] === tool)?.[3];
  const first = pending[0];
  if (style === "polygon" && first && pending.length >= 3) {
    const [x, y] = map.onScreen(toEn(editor.frame(), first));
    if (Math.hypot(x - at[0], y - at[1]) < (event.pointerType === "touch" ? NEAR_TOUCH : NEAR)) return finish();
  }
  put(en);
}

/** What lies at a place: the smallest area that holds it, or a line near by. @param {Point} en @returns {Ref | null} */
function thingAt(en) {
  const sketch = editor.sketch(), frame = editor.frame(), reach = NEAR / map.middle().scale;
  /** @type {[number, Ref][]} */
  const found = [];
  const look = (/** @type {Place[]} */ ring, /** @type {Ref} */ ref, /** @type {boolean} */ isOpen, /** @type {boolean} */ isEdge) => {
    const points = ring.map((p) => toEn(frame, p));
    const near = points.some((p, n) => { const q = points[(n + 1) % points.length]; return q !== undefined && (!isOpen || n + 1 < points.length) && distanceTo(en, p, q) < reach; });
    const size = Math.max(...points.map((p) => p[0])) - Math.min(...points.map((p) => p[0]));
    if (near || (!isOpen && !isEdge && within(points, en))) found.push([near ? 0 : size, ref]);
  };
  sketch.shapes.forEach((shape, n) => look(shape.rings[0] ?? [], { of: "shape", n }, shape.type === "line", shape.zone === "inclusion"));
  sketch.goals.forEach((goal, n) => { if (goal.ring) look(goal.ring, { of: "goal", n }, false, false); });
  found.sort((a, b) => a[0] - b[0]);
  return found[0]?.[1] ?? null;
}

// ------------------------------------------------------------------------------------------------------ the keyboard
/** A key on the chart; true: it was one of the chart's. @param {KeyboardEvent} event */
export function key(event) {
  /** @type {Record<string, Point>} */
  const arrows = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] };
  const arrow = arrows[event.key], { en, scale } = map.middle(), selected = editor.selected();
  if (arrow) {
    const by = event.shiftKey ? 10 : 1;
    if (tool === "select" && selected) {
      const place = placeOf(editor.sketch(), selected);
      if (place) { const from = toEn(editor.frame(), place); editor.commit(moved(editor.sketch(), selected, toPlace(editor.frame(), [from[0] + by * arrow[0], from[1] + by * arrow[1]])), selected); }
    } else {
      const step = (event.shiftKey ? 100 : 20) / scale;
      map.centre([en[0] + step * arrow[0], en[1] + step * arrow[1]]);
      isByKeys = tool !== "select";
      cursor = map.middle().en;
      map.again();
    }
    return true;
  }
  if (event.key === " " && tool !== "select") { isByKeys = true; put(en); return true; }
  if (event.key === "Enter" && pending.length >= 3) { finish(); return true; }
  if (event.key === "Backspace" && pending.length > 0) return back();
  return false;
}

// ------------------------------------------------------------------------------------------------------ what is drawn
/** @param {(en: Point) => Point} at @param {Camera} camera @returns {Element[]} */
function over(at, camera) {
  if (!editor) return [];
  const sketch = editor.sketch(), frame = editor.frame(), selected = editor.selected();
  const on = (/** @type {Place} */ place) => at(toEn(frame, place));
  /** @type {Element[]} */
  const out = [];
  course(sketch, on, out);
  sketch.goals.forEach((goal, n) => {
    if (goal.ring) {
      const first = on(placeOf(sketch, { of: "goal", n }) ?? goal.ring[0] ?? [0, 0]);
      out.push(svg("path", { d: path(goal.ring.map(on), true), class: `ring ${goal.kind}` }), svg("text", { x: first[0], y: first[1] + 18, class: "word small", "text-anchor": "middle" }, goal.kind));
    }
    if (goal.kind === "gate" && goal.port_mark && goal.starboard_mark) out.push(...through(on(goal.port_mark), on(goal.starboard_mark)));
    if (goal.rounding && goal.at) out.push(round(on(goal.at), Math.max(9, (goal.radius_m ?? 10) * camera.scale) + 6, goal.rounding));
  });
  for (const shape of sketch.shapes) if (shape.type === "line") out.push(svg("path", { d: path((shape.rings[0] ?? []).map(on)), class: "cable" }));
  sketch.shapes.forEach((shape) => {
    const place = shape.rings[0]?.[0];
    if (place && (shape.type === "point" || shape.type === "circle")) { const [x, y] = on(place); out.push(svg("path", { d: `M${x - 5} ${y}h10M${x} ${y - 5}v10M${x - 3.5} ${y - 3.5}l7 7M${x - 3.5} ${y + 3.5}l7-7`, class: "rock" })); }
  });
  if (sketch.start) { const [x, y] = on(sketch.start.at); out.push(svg("text", { x: x + 10, y: y + 14, class: "word" }, "start")); }
  const last = sketch.goals.length - 1, home = sketch.end === "home" ? sketch.start?.at : last >= 0 ? placeOf(sketch, { of: "goal", n: last }) : null;
  if (home) {
    const [x, y] = on(home), start = sketch.start ? on(sketch.start.at) : null;
    const below = start && Math.abs(start[0] - x) < 50 && Math.abs(start[1] - y) < 20 ? start[1] + 30 : y + 18;   // the word at the start is above it
    out.push(svg("circle", { cx: x, cy: y, r: 15, class: "safeend" }), svg("text", { x: x + 18, y: below, class: "word small safe" }, "safe end"));
  }
  sketch.shapes.forEach((shape, n) => { if (selected?.of !== "shape" || selected.n !== n) name(shape, at, camera, out); });
  chosen(sketch, selected, on, out);
  if (pending.length > 0) {
    const points = pending.map(on);
    if (cursor) points.push(at(cursor));
    out.push(svg("path", { d: path(points), class: "pending" }));
    pending.forEach((place, n) => { const [x, y] = on(place); out.push(svg("circle", { cx: x, cy: y, r: n === 0 ? 7 : 4.5, class: n === 0 ? "handle first" : "handle" })); });
  }
  if (isByKeys && tool !== "select") { const [x, y] = [camera.width / 2, camera.height / 2]; out.push(svg("path", { d: `M${x - 16} ${y}h32M${x} ${y - 16}v32`, class: "cross" })); }
  return out;
}

/** The order of the course. @param {Sketch} sketch @param {(place: Place) => Point} on @param {Element[]} out */
function course(sketch, on, out) {
  const stops = [sketch.start?.at ?? null, ...sketch.goals.map((_, n) => placeOf(sketch, { of: "goal", n })), sketch.end === "home" ? sketch.start?.at ?? null : null].filter((p) => p !== null);
  if (stops.length > 1) out.push(svg("path", { d: path(stops.map(on)), class: "courseline" }));
}

/** Which way through a gate: the port mark stays on the port hand. @param {Point} port @param {Point} starboard */
function through(port, starboard) {
  const d = [starboard[0] - port[0], starboard[1] - port[1]], length = Math.hypot(d[0] ?? 0, d[1] ?? 0);
  if (length < 1) return [];
  const mid = [(port[0] + starboard[0]) / 2, (port[1] + starboard[1]) / 2], u = [(d[1] ?? 0) / length, -(d[0] ?? 0) / length];
  const p = (/** @type {number} */ along, /** @type {number} */ aside) => /** @type {Point} */ ([(mid[0] ?? 0) + along * (u[0] ?? 0) + aside * (d[0] ?? 0) / length, (mid[1] ?? 0) + along * (u[1] ?? 0) + aside * (d[1] ?? 0) / length]);
  return [svg("path", { d: path([p(-14, 0), p(16, 0)]) + path([p(9, -5), p(16, 0), p(9, 5)]), class: "through" })];
}

/** Which way round a mark: left to port she turns against the clock. @param {Point} at @param {number} radius @param {string} side */
function round(at, radius, side) {
  const turn = side === "port" ? -1 : 1;
  const on = (/** @type {number} */ degrees, /** @type {number} */ r) => /** @type {Point} */ ([at[0] + r * Math.sin(degrees * Math.PI / 180), at[1] - r * Math.cos(degrees * Math.PI / 180)]);
  const [a, b] = [on(-turn * 130, radius), on(turn * 130, radius)];
  const [c, d] = [on(turn * (130 - 420 / radius), radius + 5), on(turn * (130 - 420 / radius), radius - 5)];
  return svg("path", { d: `M${a[0]} ${a[1]}A${radius} ${radius} 0 1 ${turn > 0 ? 1 : 0} ${b[0]} ${b[1]}M${c[0]} ${c[1]}L${b[0]} ${b[1]}L${d[0]} ${d[1]}`, class: `rounding ${side}` });
}

/** @type {WeakMap<readonly Point[], {at: Point, wide_m: number}>} */
const spots = new WeakMap();

/** Where the name of a ring stands, and how wide it is, asked of its corners once. @param {readonly Point[]} ring */
function spot(ring) {
  let known = spots.get(ring);
  if (known === undefined) {
    let [east, north, least, most] = [0, 0, Infinity, -Infinity];
    for (const [e, n] of ring) { east += e; north += n; least = Math.min(least, e); most = Math.max(most, e); }
    spots.set(ring, known = { at: [east / ring.length, north / ring.length], wide_m: most - least });
  }
  return known;
}

/** @param {Shape} shape @param {(en: Point) => Point} at @param {Camera} camera @param {Element[]} out */
function name(shape, at, camera, out) {
  const ring = shape.rings[0] ?? [];
  if (!shape.name || shape.zone === "inclusion" || ring.length === 0) return;
  const known = spot(ringEn(editor.frame(), ring));
  if (shape.type === "polygon" && known.wide_m * camera.scale < 5.5 * shape.name.length) return;
  const [x, y] = at(known.at);
  out.push(svg("text", { x, y: shape.type === "polygon" ? y + 4 : y - 10, class: "word small landword", "text-anchor": "middle" }, shape.name));
}

/** Has a handle no room of its own? @param {Sketch} sketch @param {Ref} ref @param {string} kind @param {(place: Place) => Point} on */
function isCrowded(sketch, ref, kind, on) {
  const ring = (ref.of === "shape" ? sketch.shapes[ref.n]?.rings[ref.ring ?? 0] : sketch.goals[ref.n]?.ring) ?? [];
  if (kind === "whole") { const points = ring.map(on); return Math.max(...points.map((p) => p[0])) - Math.min(...points.map((p) => p[0])) < 44; }
  const a = ring[ref.v ?? 0], b = ring[((ref.v ?? 0) + 1) % ring.length];
  if (!a || !b) return true;
  const [p, q] = [on(a), on(b)];
  return Math.hypot(p[0] - q[0], p[1] - q[1]) < 30;
}

/** What is selected, with its handles. @param {Sketch} sketch @param {Ref | null} selected @param {(place: Place) => Point} on @param {Element[]} out */
function chosen(sketch, selected, on, out) {
  if (!selected) return;
  const rings = selected.of === "shape" ? sketch.shapes[selected.n]?.rings : selected.of === "goal" ? [sketch.goals[selected.n]?.ring ?? []] : [];
  const type = selected.of === "shape" ? sketch.shapes[selected.n]?.type : "polygon";
  for (const ring of rings ?? []) if (ring.length > 1) out.push(svg("path", { d: path(ring.map(on), type === "polygon"), class: "chosen" }));
  for (const { ref, kind } of handles()) {
    if (ref.of !== selected.of || ref.n !== selected.n) continue;
    const place = kind === "between" ? between(ref) : placeOf(sketch, ref);
    if (place === null) continue;
    if (kind !== "point" && isCrowded(sketch, ref, kind, on)) continue;
    const [x, y] = on(place), isIt = kind === "point" && (ref.v ?? -1) === (selected.v ?? -1) && (ref.ring ?? 0) === (selected.ring ?? 0) && (!selected.part || ref.part === selected.part || ref.part === undefined);
    if (kind === "whole") out.push(svg("path", { d: `M${x - 8} ${y}h16M${x} ${y - 8}v16M${x - 8} ${y}l3-3m-3 3l3 3M${x + 8} ${y}l-3-3m3 3l-3 3M${x} ${y - 8}l-3 3m3-3l3 3M${x} ${y + 8}l-3-3m3 3l3-3`, class: "whole" }));
    else out.push(svg("circle", { cx: x, cy: y, r: kind === "between" ? 3.5 : ref.part === "ring" ? 5.5 : 9, class: `handle ${kind}${isIt ? " it" : ""}` }));
  }
  const at = screen(selected);
  if (at && selected.v === undefined && selected.of !== "shape") out.push(svg("title", {}, called(sketch, selected)));
}
