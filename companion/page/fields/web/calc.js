"use strict";
// A composed field, computed as the companion does (companion/field): east and north in metres, headings clockwise from
// north in radians, where the wind comes from. Vectors are [east, north].
/** @typedef {[number, number]} Vec */
/** @typedef {{kind: string, at?: Vec, from?: Vec, to?: Vec, radius?: number, clockwise?: boolean, zone?: number, range?: number, heading?: number, rings?: Vec[][]}} Atom */
/** @typedef {{op: string, name?: string, weight?: number, parts?: Node_[]}} Node_ */
/** @typedef {{at: Vec, course?: number, radius?: number, clockwise?: boolean, half: number}} Zone */
/** @typedef {{tree: Node_, atoms: Record<string, Atom>, sails: boolean, noGo: number, turnRate: number, tackS: number, lagS: number, leeway: number, winds: number[], twa: number[], speeds: number[][]}} Field */
/** @typedef {{twd: number, tws: number}} Wind */

const NOMINAL = 10, REPULSIVE = 20, RING = 10, LEAST = 0.5, STEP_S = 2.5, FINE_S = 0.5;
const TAU = 2 * Math.PI;
/** @param {number} a */
const wrap = (a) => ((a + Math.PI) % TAU + TAU) % TAU - Math.PI;
/** @param {Vec} v */
const heading = (v) => Math.atan2(v[0], v[1]);
/** @param {Vec} v */
const norm = (v) => Math.hypot(v[0], v[1]);
/** @template T @param {T | undefined} value @returns {T} */
function need(value) { if (value === undefined) throw new Error("a part of the field is missing"); return value; }

/** The vector of an atom at a place. @param {Field} f @param {Atom} atom @param {Vec} p @param {Wind} wind @returns {Vec} */
function atomAt(f, atom, p, wind) {
  if (atom.kind === "heading") { const h = need(atom.heading); return [NOMINAL * Math.sin(h), NOMINAL * Math.cos(h)]; }
  if (atom.kind === "leave") return leaveAt(f, atom, p, wind);
  if (atom.kind === "line" || atom.kind === "repulsive_line") {
    const [a, b] = [need(atom.from), need(atom.to)], course = Math.atan2(b[0] - a[0], b[1] - a[1]);
    const s = Math.sin(course), c = Math.cos(course);
    const left = s * (p[1] - a[1]) - c * (p[0] - a[0]);
    if (atom.kind === "line") {
      const angle = course + 0.5 * Math.atan(left / need(atom.zone));
      return [NOMINAL * Math.sin(angle), NOMINAL * Math.cos(angle)];
    }
    const force = REPULSIVE * Math.exp(-((left / need(atom.range)) ** 2)), side = left >= 0 ? force : -force;
    return [-c * side, s * side];
  }
  const at = need(atom.at), x = p[0] - at[0], y = p[1] - at[1], d = Math.hypot(x, y);
  if (atom.kind === "repulsive_point") {
    const force = REPULSIVE * Math.exp(-(d * d) / need(atom.range) ** 2), angle = Math.atan2(y, x);
    return [force * Math.cos(angle), force * Math.sin(angle)];
  }
  if (atom.kind === "circle") {
    const scale = need(atom.radius) / RING, u = d > 0 ? x / scale : 1, v = y / scale, v0 = atom.clockwise ? NOMINAL : -NOMINAL;
    const pull = NOMINAL * Math.atan(0.1 * (RING - d / scale)), e = u * pull + v0 * v, n = v * pull - v0 * u;
    const size = Math.max(Math.hypot(e, n), 1e-12);
    return [NOMINAL * e / size, NOMINAL * n / size];
  }
  const safe = Math.max(d, 1e-9), force = NOMINAL * Math.exp(-1 / safe) / safe;
  return [-x * force, -y * force];
}

/** What the tree says at a place. @param {Field} f @param {Node_} node @param {Vec} p @param {Wind} wind @returns {Vec} */
function nodeAt(f, node, p, wind) {
  if (node.op === "name") return atomAt(f, need(f.atoms[need(node.name)]), p, wind);
  const parts = need(node.parts);
  if (node.op === "project") {
    const part = need(parts[0]), v = nodeAt(f, part, p, wind);
    return f.sails ? turned(f, v, p, zoneIn(f, part, wind), wind, 1) : v;
  }
  const all = parts.map((part) => nodeAt(f, part, p, wind));
  if (node.op === "weigh") { const w = need(node.weight), v = need(all[0]); return [w * v[0], w * v[1]]; }
  if (node.op === "add") return all.reduce((a, b) => /** @type {Vec} */ ([a[0] + b[0], a[1] + b[1]]));
  return all.reduce((a, b) => (norm(a) >= norm(b) ? a : b));
}

/** The band about the first trajectory. @param {Field} f @param {Node_} node @param {Wind} wind @returns {Zone | null} */
function zoneIn(f, node, wind) {
  if (!f.sails) return null;
  if (node.op === "name") {
    const atom = need(f.atoms[need(node.name)]);
    if (atom.kind === "point" || atom.kind === "station") return { at: need(atom.at), course: wind.twd, half: need(atom.zone) };
    if (atom.kind === "line") { const [a, b] = [need(atom.from), need(atom.to)]; return { at: a, course: Math.atan2(b[0] - a[0], b[1] - a[1]), half: need(atom.zone) }; }
    if (atom.kind === "circle") { const radius = need(atom.radius); return { at: need(atom.at), radius, clockwise: atom.clockwise ?? true, half: Math.min(need(atom.zone), 0.25 * radius) }; }
    return null;
  }
  for (const part of need(node.parts)) { const found = zoneIn(f, part, wind); if (found) return found; }
  return null;
}

/** How far left of the trajectory, and its course there. @param {Zone} zone @param {Vec} p @returns {[number, number]} */
function beside(zone, p) {
  const e = p[0] - zone.at[0], n = p[1] - zone.at[1];
  if (zone.radius !== undefined) {
    const out = Math.hypot(e, n) - zone.radius;
    return zone.clockwise ? [out, Math.atan2(e, n) + 0.5 * Math.PI] : [-out, Math.atan2(e, n) - 0.5 * Math.PI];
  }
  const course = need(zone.course);
  return [Math.sin(course) * n - Math.cos(course) * e, course];
}

/** q at a place: by its side outside the band, as it was inside. @param {Zone | null} zone @param {Vec} p @param {number} q */
function sideAt(zone, p, q) {
  if (!zone) return q >= 0 ? 1 : -1;
  const [left] = beside(zone, p);
  return Math.abs(left) > zone.half ? (left > 0 ? 1 : -1) : q >= 0 ? 1 : -1;
}

/** A vector out of the no-go zone. @param {Field} f @param {Vec} v @param {Vec} p @param {Zone | null} zone @param {Wind} wind @param {number} q @returns {Vec} */
function turned(f, v, p, zone, wind, q) {
  const h = heading(v), limit = Math.cos(f.noGo);
  let inside = Math.cos(h - wind.twd) > limit + 1e-12;
  if (zone) {
    const [left, course] = beside(zone, p);
    inside ||= Math.cos(course - wind.twd) > limit + 1e-12 && Math.abs(left) < zone.half && Math.cos(h - course) > Math.cos(f.noGo + 1e-9);
  }
  const chosen = inside ? wind.twd + sideAt(zone, p, q) * f.noGo : h, size = norm(v);
  return [size * Math.sin(chosen), size * Math.cos(chosen)];
}

/** @param {Field} f @param {Vec} p @param {Wind} wind */
const wantedAt = (f, p, wind) => nodeAt(f, f.tree, p, wind);
/** @param {Field} f @param {Vec} p @param {Wind} wind @param {number} q @returns {Vec} */
function sailableAt(f, p, wind, q) {
  const v = wantedAt(f, p, wind);
  return f.sails ? turned(f, v, p, zoneIn(f, f.tree, wind), wind, q) : v;
}

/** Schmitt's fan: the headings between which a vector may be turned. @param {Field} f @param {Vec} p @param {Wind} wind @returns {[number, number]} */
function fanAt(f, p, wind) {
  const h = heading(wantedAt(f, p, wind)), zone = zoneIn(f, f.tree, wind);
  return [h - (sideAt(zone, p, -1) < 0 ? f.noGo : 0), h + (sideAt(zone, p, 1) > 0 ? f.noGo : 0)];
}

/** Speed by the polar, a table for each wind. @param {Field} f @param {number} twa @param {Wind} wind */
function speedAt(f, twa, wind) {
  const a = Math.abs(wrap(twa));
  let row = 0;
  f.winds.forEach((w, i) => { if (Math.abs(w - wind.tws) < Math.abs(need(f.winds[row]) - wind.tws)) row = i; });
  const speeds = need(f.speeds[row]);
  let i = 1;
  while (i < f.twa.length - 1 && need(f.twa[i]) < a) i += 1;
  const [x0, x1] = [need(f.twa[i - 1]), need(f.twa[i])], [y0, y1] = [need(speeds[i - 1]), need(speeds[i])];
  return y0 + (y1 - y0) * Math.min(1, Math.max(0, (a - x0) / (x1 - x0)));
}

/** Candidate headings where the boat is: [heading, speed, way made along the field]. @param {Field} f @param {Vec} p @param {Wind} wind */
function candidates(f, p, wind) {
  const wanted = heading(wantedAt(f, p, wind)), out = [];
  for (let deg = 0; deg < 360; deg += 5) {
    const h = deg * Math.PI / 180, twa = Math.abs(wrap(wind.twd - h));
    const speed = f.sails && twa < f.noGo - 1e-9 ? 0 : speedAt(f, twa, wind);
    out.push(/** @type {[number, number, number]} */ ([h, speed, speed * Math.cos(h - wanted)]));
  }
  return out;
}

/** @param {Vec[][]} rings @param {Vec} p */
function within(rings, p) {
  let inside = false;
  for (const ring of rings) for (let i = 0, j = ring.length - 1; i < ring.length; j = i, i += 1) {
    const a = need(ring[i]), b = need(ring[j]);
    if ((a[1] > p[1]) !== (b[1] > p[1]) && p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]) inside = !inside;
  }
  return inside;
}

/** Out of some water by the heading that is soonest out, for a boat that lies there bow north; `rings` are 5 m outside of it. @param {Field} f @param {Atom} atom @param {Vec} p @param {Wind} wind @returns {Vec} */
function leaveAt(f, atom, p, wind) {
  const rings = need(atom.rings);
  if (!within(rings, p)) return [0, 0];
  const lookS = need(atom.range), fine = Math.ceil((lookS - FINE_S / 2) / FINE_S), per = STEP_S / FINE_S;
  const count = Math.floor(fine / per) + 1, stepS = lookS / Math.max(1, count - 1);
  let best = 0, least = Infinity;
  for (let deg = 0; deg < 360; deg += 10) {
    const h = deg * Math.PI / 180, twa = wrap(wind.twd - h), turn = wrap(h);
    if (f.sails && !(Math.abs(twa) > f.noGo + 4 * Math.PI / 180)) continue;
    const speed = speedAt(f, f.sails ? twa : Math.PI, wind), now = wrap(wind.twd);
    const tacks = f.sails && twa * now < 0 && Math.abs(twa - now) < Math.PI;
    const lost = Math.abs(turn) / f.turnRate + (tacks ? f.tackS : 0);
    let steps = count, x = p[0], y = p[1];
    for (let k = 0, n = 0; k < count; k += 1) {
      if (!within(rings, [x, y])) { steps = k; break; }
      for (let m = 0; m < per && n < fine; m += 1, n += 1) {  // the way turns with the bow, the speed grows
        const t = (n + 0.5) * FINE_S, to = turn * Math.min(1, t / Math.max(lost, FINE_S));
        const run = FINE_S * speed * (1 - Math.exp(-t / Math.max(f.lagS, 0.1)));
        x += run * Math.sin(to);
        y += run * Math.cos(to);
      }
    }
    if (steps * stepS < least - 1e-12) { least = steps * stepS; best = h; }
  }
  return [NOMINAL * Math.sin(best), NOMINAL * Math.cos(best)];
}

/** Where the field leads from a place: q moves with the boat, who turns at once; no shore, no vessels. @param {Field} f @param {Vec} from @param {Wind} wind @param {number} q @param {number} reach @returns {Vec[]} */
function wayFrom(f, from, wind, q, reach) {
  const zone = zoneIn(f, f.tree, wind), out = [from], step = reach / 200;
  let p = from;
  for (let n = 0; n < 600; n += 1) {
    q = sideAt(zone, p, q);
    const v = sailableAt(f, p, wind, q), size = norm(v);
    if (size < LEAST) break;
    p = [p[0] + step * v[0] / size, p[1] + step * v[1] / size];
    out.push(p);
  }
  return out;
}
