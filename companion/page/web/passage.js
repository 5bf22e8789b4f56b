// The passage as it was planned ashore: route, band, isochrones, the wind and the current as she passes, where she should be now.
import { get, renew, set, sketch, svg, table } from "./dom.js";
import { bearing, distance, NONE, speed, speedUnit } from "./format.js";
import { path } from "./geometry.js";

/** @typedef {import("../../view/view").Passage} Passage @typedef {import("../../view/view").View} View @typedef {import("./geometry.js").Point} Point */
/** @typedef {{left: number, top: number, right: number, bottom: number}} Seen  px */
/** @typedef {{at: (en: Point) => Point, seen: Seen, up: number, isSouth: boolean}} Chart */

const FREE_PX = 40, EDGE_PX = 30;      // between two barbs; beyond the picture
const FAR = 0.002, NEAR_M = 50;        // of a place's distance, and in metres: two that are one place on the chart

/** @type {{passage: Passage | null, isShown: boolean, isNow: boolean, said: string, world: SVGElement | null, signs: SVGElement | null}} */
const state = { passage: null, isShown: true, isNow: true, said: "", world: null, signs: null };

// ------------------------------------------------------------------------------------- pure, tried by node
/** A column at a time, between those that are told; null: it is not known there. @param {readonly number[]} times @param {readonly (number | null)[]} column @param {number} at */
export function valueAt(times, column, at) {
  if (at < (times[0] ?? 0)) return column[0] ?? null;
  for (let n = 1; n < times.length; n++) {
    const a = times[n - 1] ?? 0, b = times[n] ?? 0;
    if (at > b) continue;
    const from = column[n - 1] ?? null, to = column[n] ?? null;
    return from === null || to === null ? null : from + (to - from) * (b > a ? (at - a) / (b - a) : 0);
  }
  return column[column.length - 1] ?? null;
}

/** Where a way along the route is. @param {Passage} passage @param {number} way @returns {Point} */
export function placeAt(passage, way) {
  const ways = passage.line.map((row) => row[0]);
  return [valueAt(ways, passage.line.map((row) => row[1]), way) ?? 0, valueAt(ways, passage.line.map((row) => row[2]), way) ?? 0];
}

/** The way along the route that is the nearest to a place, and how far off that is. @param {Passage} passage @param {Point} en */
export function nearest(passage, en) {
  let way = 0, off = Infinity;
  for (let n = 1; n < passage.line.length; n++) {
    const [s, e, m] = passage.line[n - 1] ?? [0, 0, 0], [t, f, o] = passage.line[n] ?? [0, 0, 0];
    const length = Math.hypot(f - e, o - m);
    const share = length > 0 ? Math.min(1, Math.max(0, ((en[0] - e) * (f - e) + (en[1] - m) * (o - m)) / length ** 2)) : 0;
    const far = Math.hypot(en[0] - e - share * (f - e), en[1] - m - share * (o - m));
    if (far < off) { off = far; way = s + share * (t - s); }
  }
  return { way, off };
}

/** When the middle run is so far along first [s]; null: never. @param {Passage} passage @param {number} way */
export function timeOf(passage, way) {
  for (let n = 0; n < passage.at_s.length; n++) {
    const there = passage.middle_m[n] ?? null;
    if (there === null) return null;
    if (there < way) continue;
    const a = passage.at_s[n - 1] ?? 0, b = passage.at_s[n] ?? 0, from = passage.middle_m[n - 1] ?? 0;
    return n === 0 || there <= from ? b : a + (b - a) * (way - from) / (there - from);
  }
  return null;
}

/** Where the members' runs are at a time, those that have not ended, sorted: ways [m]. @param {Passage} passage @param {number} since */
export function membersAt(passage, since) {
  const ways = passage.members_m.map((row) => valueAt(passage.at_s, row, since));
  return /** @type {number[]} */ (ways.filter((way) => way !== null)).sort((a, b) => a - b);
}

/** How many of ten lie between the early and the late. @param {Passage} passage */
export function often(passage) {
  return passage.high > passage.low && passage.runs > 1 ? `${(10 * (passage.high - passage.low)).toFixed(0)} of 10` : "";
}

/** A time to the nearest minute, as `companion passage` tells it. @param {number} unix_s */
export function when(unix_s) {
  const text = new Date(60000 * Math.round(unix_s / 60)).toISOString();
  return `${text.slice(5, 10)} ${text.slice(11, 16)}`;
}

/** A time in hours and minutes. @param {number} seconds */
export function span(seconds) {
  const minutes = Math.round(seconds / 60), days = Math.floor(minutes / 1440), hours = Math.floor(minutes / 60);
  if (days >= 3) return `${days} d ${hours % 24} h`;
  return hours === 0 ? `${minutes} min` : `${hours} h ${String(minutes % 60).padStart(2, "0")}`;
}

/** Of which run the forecast is and how old, and what is none any more. @param {Passage} passage @param {number | null} unix_s */
export function forecastWords(passage, unix_s) {
  const age = unix_s === null ? "how old is not known" : unix_s < passage.run_unix_s ? "of a time to come" : `${span(unix_s - passage.run_unix_s)} old`;
  const words = [`forecast of ${when(passage.run_unix_s)} UTC, ${age}`];
  if (passage.climate_unix_s !== null) words.push(`from ${when(passage.climate_unix_s)} on it is climatology, and no forecast`);
  else if (unix_s !== null && unix_s > passage.until_unix_s) words.push(`it ended ${span(unix_s - passage.until_unix_s)} ago`);
  return words.join("; ");
}

/** Where she is beside where she should be, in words. @param {Passage} passage @param {number | null | undefined} unix_s @param {Point | null} en */
export function standing(passage, unix_s, en) {
  if (unix_s === null || unix_s === undefined) return "the time is not known, and so not where she should be";
  const since = unix_s - passage.departs_unix_s;
  if (since < 0) return `departs in ${span(-since)}`;
  const end = passage.waypoints[passage.waypoints.length - 1];
  const over = end?.middle_s != null && since > end.middle_s ? `she should be there since ${when(passage.departs_unix_s + end.middle_s)} UTC` : "";
  if (en === null) return over || "where she is is not known";
  const here = nearest(passage, en), due = timeOf(passage, here.way);
  const off = `${distance(here.off)} off the route`;
  if (over) return `${over}; ${distance(Math.max(0, (end?.way_m ?? 0) - here.way))} to go, ${off}`;
  if (due === null) return `farther than the middle run comes, ${off}`;
  const late = since - due;
  return `${Math.abs(late) < 60 ? "on time" : `${span(Math.abs(late))} ${late > 0 ? "behind" : "ahead of"} the middle run`}, ${off}`;
}

/** Whether goals are places of this passage. @param {Passage} passage @param {readonly {at_en_m: Point}[]} goals */
export function isOf(passage, goals) {
  return goals.every((goal) => passage.waypoints.some((point) =>
    Math.hypot(point.at_en_m[0] - goal.at_en_m[0], point.at_en_m[1] - goal.at_en_m[1]) < NEAR_M + FAR * Math.hypot(goal.at_en_m[0], goal.at_en_m[1])));
}

/** The feathers of a wind barb: pennants of 50 knots, long ones of 10, short ones of 5. @param {number} mps */
export function feathers(mps) {
  let fives = Math.round(mps * 3600 / 1852 / 5);
  const pennants = Math.floor(fives / 10);
  fives -= 10 * pennants;
  return { pennants, long: Math.floor(fives / 2), short: fives % 2 };
}

// ------------------------------------------------------------------------------------------------ the layer
/** @param {SVGElement} world in metres @param {SVGElement} signs on the screen */
export function build(world, signs) {
  state.world = world;
  state.signs = signs;
}

/** @param {Passage | null} passage @param {() => void} changed @param {boolean} [isNow] whether a boat is under way @param {string} [said] why there is none */
export function take(passage, changed, isNow = true, said = "") {
  const isFirst = state.passage === null;
  state.passage = passage;
  state.isNow = isNow;
  state.said = "";
  const button = get("passage");
  button.hidden = passage === null;
  get("passagekey").hidden = passage === null;
  get("passagepart").hidden = passage === null;
  if (passage !== null && isFirst) button.addEventListener("click", () => {
    state.isShown = !state.isShown;
    set(button, { "aria-pressed": state.isShown ? "true" : "false" });
    changed();
  });
  if (passage === null) get("passagewords").textContent = said;
  state.world?.replaceChildren();
  if (passage !== null) {
    const rings = passage.band.map((shape) => shape.map((ring) => path(ring, true)).join("")).join("");
    state.world?.append(svg("path", { class: "pband", d: rings, "fill-rule": "evenodd" }),
      svg("path", { class: "piso", d: passage.isochrones.map((one) => one.lines.map((line) => path(line)).join("")).join("") }),
      svg("path", { class: "proute", d: path(passage.line.map((row) => /** @type {Point} */ ([row[1], row[2]]))) }));
  }
  changed();
}

/** @param {View | null} view @param {Chart} chart */
export function draw(view, chart) {
  const { passage, world, signs } = state;
  if (!world || !signs) return;
  set(world, { visibility: state.isShown ? null : "hidden" });
  if (passage === null || !state.isShown) return renew(signs, []);
  /** @type {Point[]} */
  const taken = [];
  const isFree = (/** @type {Point} */ p, /** @type {number} */ px) => isSeen(p, chart.seen) && !taken.some((q) => Math.hypot(p[0] - q[0], p[1] - q[1]) < px);
  renew(signs, [...now(passage, view, chart), ...waypoints(passage, chart), ...weather(passage, chart, isFree, taken),
    ...hours(passage, chart, isFree, taken), ...ends(passage, chart)]);
}

/** @param {Point} p @param {Seen} seen */
function isSeen(p, seen) {
  return p[0] > seen.left - EDGE_PX && p[1] > seen.top - EDGE_PX && p[0] < seen.right + EDGE_PX && p[1] < seen.bottom + EDGE_PX;
}

/** Where the members are now, and where the middle run is. @param {Passage} passage @param {View | null} view @param {Chart} chart */
function now(passage, view, chart) {
  if (!state.isNow || view?.unix_s == null) return [];
  const since = view.unix_s - passage.departs_unix_s, middle = valueAt(passage.at_s, passage.middle_m, since);
  if (since < 0 || since > (passage.at_s[passage.at_s.length - 1] ?? 0)) return [];
  const members = membersAt(passage, since);
  const out = members.map((way) => { const [cx, cy] = chart.at(placeAt(passage, way)); return sketch("circle", { cx, cy, r: 3, class: "pmember" }); });
  if (middle === null) return out;
  const [x, y] = chart.at(placeAt(passage, middle));
  return [...out, sketch("path", { d: `M${x} ${y - 7}l7 7l-7 7l-7 -7z`, class: "pnow" }), sketch("text", { x: x + 10, y: y + 16, class: "word pword" }, "should be")];
}

/** @param {Passage} passage @param {Chart} chart */
function waypoints(passage, chart) {
  /** @type {import("./dom.js").Sketch[]} */
  const out = [];
  /** @type {Point[]} */
  const taken = [];
  for (const point of passage.waypoints) {
    const [x, y] = chart.at(point.at_en_m);
    if (!isSeen([x, y], chart.seen)) continue;
    out.push(sketch("circle", { cx: x, cy: y, r: 3.5, class: "ppoint" }));
    if (taken.some(([a, b]) => Math.abs(a - x) < 110 && Math.abs(b - y) < 14)) continue;
    taken.push([x, y]);
    const isCut = x > chart.seen.right - 80;
    if (point.middle_s !== null) out.push(sketch("text", { x: isCut ? x - 7 : x + 7, y: y + 28, class: "word small pword", "text-anchor": isCut ? "end" : "start" }, when(passage.departs_unix_s + point.middle_s)));
  }
  return out;
}

/** @param {Passage} passage @param {Chart} chart @param {(p: Point, px: number) => boolean} isFree @param {Point[]} taken */
function weather(passage, chart, isFree, taken) {
  /** @type {import("./dom.js").Sketch[]} */
  const out = [];
  for (const one of passage.met) {
    const at = chart.at(one.at_en_m);
    if (!isFree(at, FREE_PX)) continue;
    taken.push(at);
    const turn = one.wind_from_deg + one.north_deg - chart.up;
    out.push(sketch("path", { class: "pbarb", d: barb(one.wind_mps, chart.isSouth ? -1 : 1), transform: `translate(${at[0].toFixed(1)} ${at[1].toFixed(1)}) rotate(${turn.toFixed(1)})` }));
    if (one.current_towards_deg !== null && one.current_mps !== null && one.current_mps >= 0.05) {
      const long = Math.min(34, 12 + 16 * one.current_mps), set_deg = one.current_towards_deg + one.north_deg - chart.up;
      out.push(sketch("path", { class: "pflow", d: `M0 0V${-long}M-4 ${-long + 6}L0 ${-long}L4 ${-long + 6}`, transform: `translate(${at[0].toFixed(1)} ${at[1].toFixed(1)}) rotate(${set_deg.toFixed(1)})` }));
    }
  }
  return out;
}

/** A barb whose staff points up, to where the wind comes from; feathers on the side of the low. @param {number} mps @param {number} side */
function barb(mps, side) {
  const { pennants, long, short } = feathers(mps), step = 5;
  if (pennants + long + short === 0) return "M-4 0A4 4 0 1 0 4 0A4 4 0 1 0 -4 0";
  let y = -30, d = `M0 0V${y}`;
  for (let n = 0; n < pennants; n++, y += 8) d += `M0 ${y}L${11 * side} ${y + 2}L0 ${y + 7}`;
  for (let n = 0; n < long; n++, y += step) d += `M0 ${y}L${11 * side} ${y - 5}`;
  if (short) { if (pennants + long === 0) y += step; d += `M0 ${y}L${5.5 * side} ${y - 2.5}`; }
  return d;
}

/** @param {Passage} passage @param {Chart} chart @param {(p: Point, px: number) => boolean} isFree @param {Point[]} taken */
function hours(passage, chart, isFree, taken) {
  /** @type {import("./dom.js").Sketch[]} */
  const out = [];
  for (const one of passage.isochrones) for (const line of one.lines.slice(0, 1)) for (const share of [0.5, 0.25, 0.75]) {
    const place = line[Math.floor(share * (line.length - 1))];
    const at = place ? chart.at(place) : null;
    if (at === null || !isFree(at, 26)) continue;
    taken.push(at);
    out.push(sketch("text", { x: at[0], y: at[1] + 4, class: "word small", "text-anchor": "middle" }, `${one.hours} h`));
    break;
  }
  return out;
}

/** @param {Passage} passage @param {Chart} chart */
function ends(passage, chart) {
  return passage.ends.flatMap((end) => {
    const [x, y] = chart.at(end.at_en_m);
    return isSeen([x, y], chart.seen) ? [sketch("path", { d: `M${x - 5} ${y - 5}l10 10M${x - 5} ${y + 5}l10 -10`, class: "pend" }), sketch("text", { x: x + 8, y: y - 7, class: "word small pword" }, `${end.runs} of ${passage.runs} runs end`)] : [];
  });
}

// ------------------------------------------------------------------------------------------------- in words
/** What is said below the chart and among the numbers. @param {View | null} view */
export function say(view) {
  const { passage } = state;
  if (passage === null) return;
  const unix_s = state.isNow ? view?.unix_s ?? null : Date.now() / 1000;
  const words = [forecastWords(passage, unix_s)];
  if (state.isNow) words.unshift(standing(passage, unix_s, view?.boat.at_en_m ?? null));
  if (view?.source === "radio") words.unshift("whether this is what she sails is not on the air");
  if (view && !isOf(passage, view.goals)) words.unshift("the mission has other goals than this passage");
  const said = `Passage: ${words.join("; ")}.`;
  const key = `${said}${speedUnit()}${bearing(0)}`;
  if (key === state.said) return;
  state.said = key;
  get("passagewords").textContent = said;
  renew(get("passagebox"), numbers(passage));
}

/** Wind and current at a place; null: the forecast knew none there. @param {Passage} passage @param {Point} en */
function metAt(passage, en) {
  const far = (/** @type {Point} */ p) => Math.hypot(p[0] - en[0], p[1] - en[1]);
  const near = [...passage.met].sort((a, b) => far(a.at_en_m) - far(b.at_en_m))[0];
  return near && far(near.at_en_m) < 0.02 * (passage.line[passage.line.length - 1]?.[0] ?? 0) ? near : null;
}

/** @param {Passage} passage */
function numbers(passage) {
  const share = often(passage);
  const rows = passage.waypoints.map((point) => {
    const met = metAt(passage, point.at_en_m);
    const at = (/** @type {number | null} */ since) => since === null ? "never" : when(passage.departs_unix_s + since);
    const range = share && point.way_m > 0 ? `${at(point.early_s)} to ${at(point.late_s)}` : NONE;
    const wind = met ? `${bearing(met.wind_from_deg)} ${speed(met.wind_mps)}${passage.members > 1 ? ` (${speed(met.low_mps)} to ${speed(met.high_mps)})` : ""}` : NONE;
    const flow = met && met.current_mps !== null ? `${bearing(met.current_towards_deg)} ${speed(met.current_mps)}` : NONE;
    return [point.name, at(point.middle_s), range, wind, flow, distance(point.band_m)];
  });
  return [table(`Passage: ${passage.name || "planned"}`, ["waypoint", "UTC, middle", share ? `${share} between` : "one run only", `wind, ${speedUnit()}`, `current to, ${speedUnit()}`, "band"], rows),
    ...histogram(passage), sketch("ul", { class: "psaid" }, ...[...passage.said, ...passage.binds].map((line) => sketch("li", {}, line)), ...passage.ends.map((end) => sketch("li", {}, `${end.runs} of ${passage.runs} runs end: ${end.why}`)))];
}

/** When all runs arrive. @param {Passage} passage */
function histogram(passage) {
  const all = passage.arrivals_s;
  if (all.length < 2) return [];
  const low = all[0] ?? 0, high = all[all.length - 1] ?? 0, count = Math.min(20, Math.max(4, Math.floor(all.length / 3)));
  const wide = Math.max(1, (high - low) / count);
  const bins = Array.from({ length: count }, () => 0);
  for (const one of all) { const n = Math.min(count - 1, Math.floor((one - low) / wide)); bins[n] = (bins[n] ?? 0) + 1; }
  const most = Math.max(...bins), x = (/** @type {number} */ n) => 4 + 312 * n / count;
  const words = `${when(passage.departs_unix_s + low)} to ${when(passage.departs_unix_s + high)} UTC`;
  return [sketch("svg", { viewBox: "0 0 320 74", class: "phist", role: "img", "aria-label": `When the runs arrive: ${words}` },
    ...bins.map((n, k) => sketch("rect", { x: x(k), y: 50 - 46 * n / most, width: 312 / count - 1, height: 46 * n / most })), sketch("path", { d: "M4 50H316", class: "tick" }),
    sketch("text", { x: 4, y: 66, class: "axis" }, when(passage.departs_unix_s + low)), sketch("text", { x: 316, y: 66, class: "axis end" }, when(passage.departs_unix_s + high)),
    sketch("text", { x: 160, y: 66, class: "axis middle" }, `arrivals of ${passage.arrived < passage.runs ? `${passage.arrived} of ` : ""}${passage.runs} runs`))];
}
