// The sketch: what of a mission is drawn. Pure functions, tried by node: a sketch goes in, another comes out.

/** @typedef {[number, number]} Place  latitude, longitude in degrees */
/** @typedef {[number, number]} Point  metres east, north */
/** @typedef {{lat: number, lon: number, lat_m: number, lon_m: number}} Frame */
/** @typedef {{type: "polygon" | "circle" | "point" | "line", zone: "inclusion" | "exclusion", rings: Place[][], radius_m?: number | null, margin_m?: number | null, name?: string, of?: string, key?: number | null}} Shape */
/** @typedef {{kind: "point" | "gate" | "box" | "search" | "field", key?: number | null, name?: string, at?: Place | null, radius_m?: number | null, rounding?: "port" | "starboard" | null, port_mark?: Place | null, starboard_mark?: Place | null, mark_radius_m?: number | null, after_s?: number | null, ring?: Place[] | null, for_s?: number | null, swath_m?: number | null, coverage?: number | null, polygon?: string | null, field?: string | null, until?: string | null}} Goal */
/** @typedef {{at: Place, radius_m?: number, name?: string, key?: number | null}} Refuge */
/** @typedef {{revision: string, name?: string | null, start?: {at: Place, heading_deg?: number} | null, goals: Goal[], refuges: Refuge[], shapes: Shape[], margin_m: number, margin_floor_m: number, point_radius_m: number, end: "loiter" | "home", laps: number}} Sketch */
/** What one means: a thing, and one point of it. ring and v: of a polygon. @typedef {{of: "start" | "goal" | "refuge" | "shape", n: number, part?: "at" | "port_mark" | "starboard_mark" | "ring" | "", ring?: number, v?: number}} Ref */

const KEPT = 200;      // steps that can be undone

/** @param {number} degrees */
export function round(degrees) {
  return Number(degrees.toFixed(7));
}

/** @param {Frame} frame @param {Place} place @returns {Point} */
export function toEn(frame, place) {
  let east = place[1] - frame.lon;
  if (east > 180) east -= 360;
  if (east < -180) east += 360;
  return [east * frame.lon_m, (place[0] - frame.lat) * frame.lat_m];
}

/** @type {WeakMap<readonly Place[], {frame: Frame, points: Point[]}>} */
const inMetres = new WeakMap();

/** A ring in metres, made once: a sketch that is another one has most of its rings from the one before. @param {Frame} frame @param {readonly Place[]} ring @returns {Point[]} */
export function ringEn(frame, ring) {
  let known = inMetres.get(ring);
  if (known?.frame !== frame) inMetres.set(ring, known = { frame, points: ring.map((place) => toEn(frame, place)) });
  return known.points;
}

/** @param {Frame} frame @param {Point} en @returns {Place} */
export function toPlace(frame, en) {
  let lon = frame.lon + en[0] / frame.lon_m;
  if (lon > 180) lon -= 360;
  if (lon < -180) lon += 360;
  return [round(Math.max(-90, Math.min(90, frame.lat + en[1] / frame.lat_m))), round(lon)];
}

/** Degrees as people type them: 50.8203, 50 49.21 N, 50°49′12″N, 1.31 W. NaN: they are none.
 * @param {string} text @param {"lat" | "lon"} which */
export function degrees(text, which) {
  const cleaned = text.trim().toUpperCase().replace(/[−–]/g, "-").replace(/,/g, ".");
  const match = /^([NSEW])?\s*([-+]?)(\d+(?:\.\d*)?)\s*°?\s*(?:(\d+(?:\.\d*)?)\s*['′]?\s*)?(?:(\d+(?:\.\d*)?)\s*["″]?\s*)?([NSEW])?$/.exec(cleaned);
  if (!match) return NaN;
  const side = match[1] ?? match[6] ?? "";
  if (side && !(which === "lat" ? "NS" : "EW").includes(side)) return NaN;
  const minutes = Number(match[4] ?? 0), seconds = Number(match[5] ?? 0);
  if (minutes >= 60 || seconds >= 60) return NaN;
  const size = Number(match[3]) + minutes / 60 + seconds / 3600;
  const value = match[2] === "-" || side === "S" || side === "W" ? -size : size;
  return Math.abs(value) <= (which === "lat" ? 90 : 180) ? round(value) : NaN;
}

/** @template T @param {readonly T[]} list @param {number} n @param {T} value @returns {T[]} */
function put(list, n, value) {
  return list.map((old, m) => (m === n ? value : old));
}

/** The place that is meant, null: there is none. @param {Sketch} sketch @param {Ref} ref @returns {Place | null} */
export function placeOf(sketch, ref) {
  if (ref.of === "start") return sketch.start?.at ?? null;
  if (ref.of === "refuge") return sketch.refuges[ref.n]?.at ?? null;
  if (ref.of === "shape") return ref.v === undefined ? middle(sketch.shapes[ref.n]?.rings[0] ?? []) : sketch.shapes[ref.n]?.rings[ref.ring ?? 0]?.[ref.v] ?? null;
  const goal = sketch.goals[ref.n];
  if (!goal) return null;
  if (ref.part === "ring" && ref.v !== undefined) return goal.ring?.[ref.v] ?? null;
  if (ref.part === "port_mark" || ref.part === "starboard_mark") return goal[ref.part] ?? null;
  if (goal.at) return goal.at;
  if (goal.ring) return middle(goal.ring);
  return goal.port_mark && goal.starboard_mark ? middle([goal.port_mark, goal.starboard_mark]) : null;
}

/** @param {Place[]} ring @returns {Place | null} */
export function middle(ring) {
  if (ring.length === 0) return null;
  const sum = ring.reduce((a, b) => [a[0] + b[0], a[1] + b[1]], [0, 0]);
  return [round(sum[0] / ring.length), round(sum[1] / ring.length)];
}

/** A thing with one point of it elsewhere; without a point the whole thing is moved. @param {Sketch} sketch @param {Ref} ref @param {Place} to @returns {Sketch} */
export function moved(sketch, ref, to) {
  const from = placeOf(sketch, ref);
  if (from === null) return sketch;
  const by = [to[0] - from[0], to[1] - from[1]];
  const along = (/** @type {Place[]} */ ring) => ring.map((p) => /** @type {Place} */ ([round(p[0] + (by[0] ?? 0)), round(p[1] + (by[1] ?? 0))]));
  if (ref.of === "start") return sketch.start ? { ...sketch, start: { ...sketch.start, at: to } } : sketch;
  if (ref.of === "refuge") { const one = sketch.refuges[ref.n]; return one ? { ...sketch, refuges: put(sketch.refuges, ref.n, { ...one, at: to }) } : sketch; }
  if (ref.of === "shape") {
    const one = sketch.shapes[ref.n];
    if (!one) return sketch;
    const rings = ref.v === undefined ? one.rings.map(along) : put(one.rings, ref.ring ?? 0, put(one.rings[ref.ring ?? 0] ?? [], ref.v, to));
    return { ...sketch, shapes: put(sketch.shapes, ref.n, { ...one, rings }) };
  }
  const goal = sketch.goals[ref.n];
  if (!goal) return sketch;
  let changed = goal;
  if (ref.part === "ring" && ref.v !== undefined) changed = { ...goal, ring: put(goal.ring ?? [], ref.v, to) };
  else if (ref.part === "port_mark" || ref.part === "starboard_mark") changed = { ...goal, [ref.part]: to };
  else if (goal.kind === "point" || goal.kind === "field") changed = { ...goal, at: to };
  else if (goal.ring) changed = { ...goal, ring: along(goal.ring) };
  else if (goal.port_mark && goal.starboard_mark) { const [port, starboard] = along([goal.port_mark, goal.starboard_mark]); changed = { ...goal, port_mark: port ?? null, starboard_mark: starboard ?? null }; }
  return { ...sketch, goals: put(sketch.goals, ref.n, changed) };
}

/** Without a thing, or without a point of a polygon that has more than three. @param {Sketch} sketch @param {Ref} ref @returns {Sketch} */
export function removed(sketch, ref) {
  const without = (/** @type {any[]} */ list, /** @type {number} */ n) => list.filter((_, m) => m !== n);
  if (ref.of === "start") return { ...sketch, start: null };
  if (ref.of === "refuge") return { ...sketch, refuges: without(sketch.refuges, ref.n) };
  if (ref.of === "goal") {
    const goal = sketch.goals[ref.n];
    if (ref.part === "ring" && ref.v !== undefined && goal?.ring && goal.ring.length > 3) return { ...sketch, goals: put(sketch.goals, ref.n, { ...goal, ring: without(goal.ring, ref.v) }) };
    return { ...sketch, goals: without(sketch.goals, ref.n) };
  }
  const shape = sketch.shapes[ref.n];
  if (!shape || ref.v === undefined) return { ...sketch, shapes: without(sketch.shapes, ref.n) };
  const ring = shape.rings[ref.ring ?? 0] ?? [];
  const least = shape.type === "polygon" ? 3 : shape.type === "line" ? 2 : 1;
  if (ring.length > least) return { ...sketch, shapes: put(sketch.shapes, ref.n, { ...shape, rings: put(shape.rings, ref.ring ?? 0, without(ring, ref.v)) }) };
  if ((ref.ring ?? 0) > 0) return { ...sketch, shapes: put(sketch.shapes, ref.n, { ...shape, rings: without(shape.rings, ref.ring ?? 0) }) };
  return { ...sketch, shapes: without(sketch.shapes, ref.n) };
}

/** With a point more, behind one of a polygon's or line's. @param {Sketch} sketch @param {Ref} ref @param {Place} at @returns {Sketch} */
export function inserted(sketch, ref, at) {
  const with_ = (/** @type {Place[]} */ ring) => [...ring.slice(0, (ref.v ?? 0) + 1), at, ...ring.slice((ref.v ?? 0) + 1)];
  if (ref.of === "goal") {
    const goal = sketch.goals[ref.n];
    return goal?.ring ? { ...sketch, goals: put(sketch.goals, ref.n, { ...goal, ring: with_(goal.ring) }) } : sketch;
  }
  const shape = sketch.shapes[ref.n];
  if (ref.of !== "shape" || !shape) return sketch;
  return { ...sketch, shapes: put(sketch.shapes, ref.n, { ...shape, rings: put(shape.rings, ref.ring ?? 0, with_(shape.rings[ref.ring ?? 0] ?? [])) }) };
}

/** @param {Sketch} sketch @param {Goal} goal @returns {Sketch} */
export function withGoal(sketch, goal) {
  return { ...sketch, goals: [...sketch.goals, goal] };
}

/** A goal earlier or later in their order. @param {Sketch} sketch @param {number} n @param {number} by @returns {Sketch} */
export function reordered(sketch, n, by) {
  const to = n + by, goal = sketch.goals[n];
  if (!goal || to < 0 || to >= sketch.goals.length) return sketch;
  const rest = sketch.goals.filter((_, m) => m !== n);
  return { ...sketch, goals: [...rest.slice(0, to), goal, ...rest.slice(to)] };
}

/** With some values of a thing changed. @param {Sketch} sketch @param {Ref} ref @param {Record<string, any>} values @returns {Sketch} */
export function changed(sketch, ref, values) {
  if (ref.of === "start") return sketch.start ? { ...sketch, start: { ...sketch.start, ...values } } : sketch;
  const list = ref.of === "goal" ? "goals" : ref.of === "refuge" ? "refuges" : "shapes";
  return { ...sketch, [list]: /** @type {any[]} */ (sketch[list]).map((one, m) => (m === ref.n ? { ...one, ...values } : one)) };
}

/** What a thing is and where it lies: without its name, its numbers and where it is written. @param {Record<string, any>} one */
function made(one) {
  return JSON.stringify(["kind", "type", "zone", "rings", "at", "port_mark", "starboard_mark", "ring", "polygon"].map((part) => one[part] ?? null));
}

/** How many corners each of its rings has. @param {any} one */
function counts(one) {
  return JSON.stringify((one.rings ?? [one.ring ?? []]).map((/** @type {Place[]} */ ring) => ring.length));
}

/** The same thing in another sketch, where it may have another number: it lies where it lay, or has its key in the same
 * files. Null: it is not there, or cannot be told. @param {Sketch} before @param {Ref | null} ref @param {Sketch} after @returns {Ref | null} */
export function same(before, ref, after) {
  if (ref === null || ref.of === "start") return after.start ? ref : null;
  const list = ref.of === "goal" ? "goals" : ref.of === "refuge" ? "refuges" : "shapes";
  const old = /** @type {any[]} */ (before[list]), now = /** @type {any[]} */ (after[list]), one = old[ref.n];
  if (!one) return null;
  const numbers = (/** @type {(other: any) => boolean} */ is) => now.flatMap((other, n) => (is(other) ? [n] : []));
  const words = made(one), alike = numbers((other) => made(other) === words), named = alike.filter((n) => (now[n].name ?? "") === (one.name ?? ""));
  const found = named.length ? named : alike;
  if (found.length) return found.length === 1 ? { ...ref, n: found[0] ?? 0 } : found.includes(ref.n) ? ref : null;
  if (before.revision !== after.revision) return null;
  // it was moved between the two: what is in the files has its key, what is new its place in the list
  const key = one.key ?? null;
  const [n, ...more] = key !== null ? numbers((other) => other.key === key && other.of === one.of) : old.length === now.length && (now[ref.n].key ?? null) === null ? [ref.n] : [];
  if (n === undefined || more.length) return null;
  return counts(now[n]) === counts(one) ? { ...ref, n } : { of: ref.of, n };
}

/** Every place of a sketch, to show them all. @param {Sketch} sketch @returns {Place[]} */
export function places(sketch) {
  /** @type {(Place | null | undefined)[]} */
  const out = [sketch.start?.at];
  for (const goal of sketch.goals) out.push(goal.at, goal.port_mark, goal.starboard_mark, ...(goal.ring ?? []));
  for (const refuge of sketch.refuges) out.push(refuge.at);
  for (const shape of sketch.shapes) for (const ring of shape.rings) out.push(...ring);
  return out.filter((p) => p !== null && p !== undefined);
}

/** Which of the obstacles, or of the fences, a shape is, as `companion mission check` numbers them: file by file, in each
 * what has an area before points and lines. @param {Sketch} sketch @param {number} n */
function numberOf(sketch, n) {
  const shape = sketch.shapes[n], files = [...new Set(sketch.shapes.map((other) => other.of ?? ""))];
  /** @param {Shape | undefined} of */
  const rank = (of) => 2 * files.indexOf(of?.of ?? "") + (of?.type === "point" || of?.type === "line" ? 1 : 0);
  return 1 + sketch.shapes.filter((other, m) => (other.zone === "inclusion") === (shape?.zone === "inclusion")
    && (rank(other) < rank(shape) || (rank(other) === rank(shape) && m < n))).length;
}

/** What a thing is called. @param {Sketch} sketch @param {Ref} ref */
export function called(sketch, ref) {
  if (ref.of === "start") return "Start";
  if (ref.of === "refuge") return sketch.refuges[ref.n]?.name || `Refuge ${ref.n + 1}`;
  if (ref.of === "goal") { const goal = sketch.goals[ref.n]; return goal?.name || `${{ point: "Mark", gate: "Gate", box: "Box", search: "Search", field: "Field" }[goal?.kind ?? "point"]} ${ref.n + 1}`; }
  const shape = sketch.shapes[ref.n];
  return shape?.name || `${shape?.zone === "inclusion" ? "fence" : "obstacle"} ${numberOf(sketch, ref.n)}`;
}

/** Is a place within a ring? @param {Point[]} ring @param {Point} at */
export function within(ring, at) {
  let inside = false;
  for (let n = 0, m = ring.length - 1; n < ring.length; m = n++) {
    const a = ring[n], b = ring[m];
    if (!a || !b) continue;
    if ((a[1] > at[1]) !== (b[1] > at[1]) && at[0] < (b[0] - a[0]) * (at[1] - a[1]) / (b[1] - a[1]) + a[0]) inside = !inside;
  }
  return inside;
}

/** How far a point is from a stretch. @param {Point} at @param {Point} a @param {Point} b */
export function distanceTo(at, a, b) {
  const d = [b[0] - a[0], b[1] - a[1]];
  const length = (d[0] ?? 0) ** 2 + (d[1] ?? 0) ** 2;
  const share = length === 0 ? 0 : Math.max(0, Math.min(1, ((at[0] - a[0]) * (d[0] ?? 0) + (at[1] - a[1]) * (d[1] ?? 0)) / length));
  return Math.hypot(at[0] - a[0] - share * (d[0] ?? 0), at[1] - a[1] - share * (d[1] ?? 0));
}

/** What was drawn, step by step. */
export class History {
  /** @param {Sketch} now */
  constructor(now) {
    /** @type {Sketch[]} */ this.past = [];
    /** @type {Sketch[]} */ this.future = [];
    this.now = now;
  }

  /** @param {Sketch} sketch */
  take(sketch) {
    if (sketch === this.now || JSON.stringify(sketch) === JSON.stringify(this.now)) return false;
    this.past = [...this.past, this.now].slice(-KEPT);
    this.future = [];
    this.now = sketch;
    return true;
  }

  undo() {
    const before = this.past.pop();
    if (before === undefined) return false;
    this.future.push(this.now);
    this.now = before;
    return true;
  }

  redo() {
    const after = this.future.pop();
    if (after === undefined) return false;
    this.past.push(this.now);
    this.now = after;
    return true;
  }
}
