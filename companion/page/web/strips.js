// Histories: direction, strength, speed, clearance; with what was forecast a minute before, and what is forecast now.
import { picture, renew, set, sketch } from "./dom.js";
import { bearing, clock, distance, scaled, speed, speedUnit } from "./format.js";
import { minutes, path, scale, thinned, unwrapped, wrap } from "./geometry.js";

/** @typedef {import("../../view/view").View} View @typedef {import("../../view/view").Past} Past @typedef {import("./geometry.js").Point} Point */
/** @typedef {{name: string, unit: string, values: (number | null)[], low: (number | null)[], high: (number | null)[], ahead: [number, number, number][], other: [number, number][], label: (v: number) => string, now: string, least: number, line: number | null, floor: number | null, steps: number[]}} Strip */

const LEFT = 58, RIGHT = 64, TALL = 92, GAP = 10, TOP = 6, FOOT = 20;
const AHEAD_S = 60;
const root = picture("stripchart");
let windowS = 600;
let wide = 0;     // px; to ask for it while a view is drawn would lay the page out twice
let again = () => {};
new ResizeObserver(() => { if (wide !== root.clientWidth) { wide = root.clientWidth; again(); } }).observe(root);

/** @param {number} seconds */
export function over(seconds) {
  windowS = seconds;
}

/** @param {View | null} view @param {Past | null} past @param {number | null} margin @param {{past: Past, off: number, count: number} | null} [other] */
export function show(view, past, margin, other = null) {
  again = () => show(view, past, margin, other);
  const width = Math.max(280, (wide ||= root.clientWidth) || 600);
  const height = TOP + 4 * (TALL + GAP) + FOOT;
  set(root, { viewBox: `0 0 ${width} ${height}` });
  root.style.height = `${height}px`;
  if (!view || !past || past.t_s.length === 0) return renew(root, []);
  const now = view.t_s;
  const begin = Math.max(past.t_s[0] ?? 0, now - windowS);
  const ahead = Math.min(300, Math.max(60, 0.18 * (now - begin)));
  const end = now + ahead;
  let first = 0, last = past.t_s.length;
  while (first < last && (past.t_s[first] ?? 0) < begin - AHEAD_S - 5) first += 1;
  while (last > first && (past.t_s[last - 1] ?? 0) > now + 0.05) last -= 1;
  const cut = (/** @type {readonly any[]} */ column) => column.slice(first, last);
  const t = cut(past.t_s);
  const x = (/** @type {number} */ at) => LEFT + (width - LEFT - RIGHT) * (at - begin) / Math.max(1, end - begin);
  const children = [];
  const bottom = TOP + 4 * (TALL + GAP) - GAP;
  for (const at of minutes(begin, end, Math.max(2, Math.floor(width / 130)), past.unix_s)) {
    children.push(sketch("path", { class: "grid", d: path([[x(at), TOP], [x(at), bottom]]) }),
      sketch("text", { x: x(at), y: bottom + 15, class: "axis middle" }, past.unix_s === null ? clock(null, at) : clock(Math.round(past.unix_s + at)).slice(0, 5)));
  }
  for (const [n, strip] of strips(view, past, cut, now, margin).entries()) {
    if (other) {
      const column = [other.past.twd_from_deg, other.past.tws_mps, other.past.sog_mps, other.past.clearance_m][n] ?? [];
      const base = Number(strip.values.find((v) => v !== null) ?? 0);
      for (let k = 0; k < other.count; k++) {
        const at = (other.past.t_s[k] ?? 0) + other.off, value = column[k];
        if (at >= begin && value != null) strip.other.push([at, n === 0 ? base + wrap(value - base) : value]);
      }
    }
    children.push(...draw(strip, TOP + n * (TALL + GAP), t, x, now, width, begin));
  }
  children.push(sketch("path", { class: "present", d: path([[x(now), TOP], [x(now), bottom]]) }));
  renew(root, children);
}

/** @param {View} view @param {Past} past @param {(column: readonly any[]) => any[]} cut @param {number} now @param {number | null} margin @returns {Strip[]} */
function strips(view, past, cut, now, margin) {
  const twd = unwrapped(cut(past.twd_from_deg));
  const base = [...twd].reverse().find((v) => v !== null) ?? 0;
  const near = (/** @type {number | null} */ value, /** @type {number | null | undefined} */ to) => value === null || value === undefined ? null : (to ?? base) + wrap(value - (to ?? base));
  const mean = cut(past.ahead_twd_deg).map((v, n) => near(v, twd[n]));
  const half = cut(past.ahead_half_deg);
  const tws = cut(past.ahead_tws_mps), sigma = cut(past.ahead_tws_sigma_mps);
  const off = (/** @type {(number | null)[]} */ a, /** @type {(number | null)[]} */ b, /** @type {number} */ k) => a.map((v, n) => v === null || b[n] === null || b[n] === undefined ? null : v + k * /** @type {number} */ (b[n]));
  const levels = view.wind?.levels ?? [];
  const at80 = levels.indexOf(0.8);
  const bands = view.wind?.bands ?? [];
  return [
    { name: "TWD", other: [], unit: "", values: twd, low: off(mean, half, -1), high: off(mean, half, 1), steps: [1, 2, 3, 4.5], line: null, floor: null, least: 20,
      ahead: bands.map((b) => { const m = near(b.twd_from_deg, base) ?? 0, h = b.half_deg[at80] ?? b.sigma_deg; return [now + b.horizon_s, m - h, m + h]; }),
      label: (v) => bearing(v), now: bearing(view.wind?.twd_from_deg) },
    { name: "TWS", other: [], unit: speedUnit(), values: cut(past.tws_mps), low: off(tws, sigma, -1.28), high: off(tws, sigma, 1.28), steps: [1, 2, 5], line: null, floor: 0, least: 2,
      ahead: bands.map((b) => [now + b.horizon_s, b.tws_mps - 1.28 * b.tws_sigma_mps, b.tws_mps + 1.28 * b.tws_sigma_mps]),
      label: (v) => speed(v, 0), now: speed(view.wind?.tws_mps) },
    { name: "SOG", other: [], unit: speedUnit(), values: cut(past.sog_mps), low: [], high: [], ahead: [], steps: [1, 2, 5], line: null, floor: 0, least: 1, label: (v) => speed(v, 0), now: speed(view.boat.sog_mps) },
    { name: "clear", other: [], unit: "m", values: cut(past.clearance_m), low: [], high: [], ahead: [], steps: [1, 2, 5], line: margin, floor: 0, least: 20, label: (v) => String(Math.round(v)), now: distance(view.boat.clearance_m) },
  ];
}

/** @param {Strip} strip @param {number} top @param {number[]} t @param {(at: number) => number} x @param {number} now @param {number} width @param {number} begin */
function draw(strip, top, t, x, now, width, begin) {
  const right = width - RIGHT;
  let low = Infinity, high = -Infinity;
  const bound = (/** @type {number | null | undefined} */ v) => { if (v != null) { low = Math.min(low, v); high = Math.max(high, v); } };
  strip.values.forEach((v, n) => { if ((t[n] ?? 0) >= begin) bound(v); });
  if (strip.line !== null && low <= 3 * strip.line) bound(strip.line);
  for (const column of [strip.low, strip.high]) column.forEach((v, n) => { if ((t[n] ?? 0) >= begin - AHEAD_S) bound(v); });
  for (const [at, from, to] of strip.ahead) if (x(at) <= right) { bound(from); bound(to); }
  if (low > high) { low = 0; high = strip.least; }
  if (strip.floor !== null) low = Math.max(strip.floor, low);
  const lacks = Math.max(0, strip.least - (high - low)) / 2 + 0.06 * (high - low);
  low = strip.floor !== null ? Math.max(strip.floor, low - lacks) : low - lacks;
  high += lacks;
  const y = (/** @type {number} */ v) => top + TALL - TALL * (Math.min(high, Math.max(low, v)) - low) / Math.max(1e-9, high - low);
  /** @type {import("./dom.js").Sketch[]} */
  const out = [sketch("rect", { x: LEFT, y: top, width: right - LEFT, height: TALL, class: "frame" })];
  const toUnit = strip.unit === "kn" || strip.unit === "m/s" ? scaled(1) : 1;
  for (const mark of scale(low * toUnit, high * toUnit, strip.steps)) {
    const v = mark / toUnit;
    out.push(sketch("path", { class: "grid", d: path([[LEFT, y(v)], [right, y(v)]]) }), sketch("text", { x: LEFT - 6, y: y(v) + 4, class: "axis end" }, strip.label(v)));
  }
  // what was forecast a minute before for this moment
  /** @type {Point[]} */ const lows = [];
  /** @type {Point[]} */ const highs = [];
  strip.low.forEach((v, n) => {
    const at = (t[n] ?? 0) + AHEAD_S, h = strip.high[n];
    if (v !== null && h !== null && h !== undefined && at >= begin && at <= now) { lows.push([x(at), y(v)]); highs.push([x(at), y(h)]); }
  });
  if (lows.length > 1) out.push(sketch("path", { class: "band", d: path([...thinned(lows), ...thinned(highs).reverse()], true) }));
  const coming = strip.ahead.filter((a) => x(a[0]) <= right + 1);
  if (coming.length > 1) {
    out.push(sketch("path", { class: "coming", d: path([...coming.map((a) => /** @type {Point} */ ([x(a[0]), y(a[1])])), ...coming.reverse().map((a) => /** @type {Point} */ ([x(a[0]), y(a[2])]))], true) }));
  }
  if (strip.line !== null && strip.line >= low && strip.line <= high) {
    out.push(sketch("path", { class: "limit", d: path([[LEFT, y(strip.line)], [right, y(strip.line)]]) }), sketch("text", { x: right - 4, y: y(strip.line) - 4, class: "axis end" }, "margin"));
  }
  /** @type {Point[][]} */ const pieces = [[]];
  strip.values.forEach((v, n) => {
    const at = t[n] ?? 0;
    if (v === null || v === undefined || at < begin) pieces.push([]);
    else pieces[pieces.length - 1]?.push([x(at), y(v)]);
  });
  if (strip.other.length > 1) out.push(sketch("path", { class: "otherline", d: path(thinned(strip.other.map(([at, v]) => [x(at), y(v)]))) }));
  out.push(sketch("path", { class: `line ${strip.name}`, d: pieces.filter((p) => p.length > 1).map((p) => path(thinned(p))).join("") }));
  out.push(sketch("text", { x: right + 8, y: top + 14, class: "stripname" }, strip.unit ? `${strip.name} ${strip.unit}` : strip.name), sketch("text", { x: right + 8, y: top + 38, class: "stripvalue" }, strip.now.replace(" m", "")));
  return out;
}
