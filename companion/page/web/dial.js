// The wind dial: the boat's bow up, the wind on it, where she cannot sail now and later, the laylines, the shifts lately.
import { picture, renew, set, sketch, slots } from "./dom.js";
import { bearing, bearingUnit, NONE, speed, speedUnit, units } from "./format.js";
import { onDial, path, sector, wrap } from "./geometry.js";

/** @typedef {import("../../view/view").View} View @typedef {import("../../view/view").Past} Past */

const RIM = 138, FACE = 118, LATELY_S = 600;
const root = picture("dial");

/** @param {View | null} view @param {Past | null} past */
export function show(view, past) {
  const heading = view?.boat.heading_deg ?? null;
  const up = heading ?? 0;
  const off = units.bearings === "magnetic" ? units.variation : 0;
  /** @type {import("./dom.js").Sketch[]} */
  const out = [sketch("circle", { r: RIM, class: "rim" }), sketch("circle", { r: FACE, class: "face" })];
  const zone = view?.no_go;
  if (zone) [...zone.wedges].reverse().forEach((one, n) => {
    const k = zone.wedges.length - 1 - n;
    out.push(sketch("path", { class: `zone z${k}`, d: sector(one.from_deg - one.half_deg - up, one.from_deg + one.half_deg - up, 0, FACE - 22 + 11 * k) }));
  });
  const lay = view?.laylines;
  if (lay) for (const line of lay.lines) {
    const at = line.course_deg - up;
    out.push(sketch("path", { class: `swing ${line.tack}`, d: sector(at - line.swing_deg, at + line.swing_deg, FACE - 10, FACE) }),
      sketch("path", { class: `lay ${line.tack}`, d: path([onDial(at, 34), onDial(at, FACE)]) }));
  }
  // what stands still on the water turns as one, and what is written in it stays
  out.push(sketch("g", { transform: `rotate(${off - up})` }, sketch("path", { class: "tick", d: ticks((degrees) => degrees % 30 !== 0, 5) }), sketch("path", { class: "tick major", d: ticks((degrees) => degrees % 30 === 0, 9) })));
  for (let degrees = 0; degrees < 360; degrees += 30) {
    const [x, y] = onDial(degrees + off - up, RIM - 17);
    out.push(sketch("text", { x, y: y + 4, class: degrees % 90 ? "rose" : "rose main" }, { 0: "N", 90: "E", 180: "S", 270: "W" }[degrees] ?? String(degrees)));
  }
  out.push(...shifts(view, past, up));
  const goal = view?.goals.find((g) => g.is_next);
  if (goal && goal.bearing_deg !== null) {
    const [x, y] = onDial(goal.bearing_deg - up, RIM + 7);
    out.push(sketch("circle", { cx: x, cy: y, r: 5.5, class: "mark" }), sketch("title", {}, `to ${goal.name}`));
  }
  const cog = view?.boat.cog_deg ?? null;
  if (cog !== null && (view?.boat.sog_mps ?? 0) > 0.2) {
    const [x, y] = onDial(cog - up, FACE - 2);
    out.push(sketch("path", { class: "cog", d: "M0-8L6 0L0 8L-6 0Z", transform: `translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${cog - up})` }));
  }
  if (heading !== null) {
    out.push(sketch("path", { class: "hull", d: "M0-44C14-22 15 10 10 34H-10C-15 10-14-22 0-44Z" }), sketch("path", { class: "lubber", d: `M0 ${-RIM - 10}l-6-9h12z` }));
  }
  const wind = view?.wind;
  if (wind) {
    if (wind.awa_deg !== null && heading !== null) out.push(arrow(wind.awa_deg, "A", "apparent", FACE - 30));
    if (wind.twd_from_deg !== null) out.push(arrow(wind.twd_from_deg - up, "T", "true", FACE - 2));
  }
  out.push(...corner(-166, -152, "start", "TWD", bearing(wind?.twd_from_deg), bearingUnit()), ...corner(166, -152, "end", `TWS ${speedUnit()}`, speed(wind?.tws_mps), ""),
    ...corner(-166, 152, "start", "HDG", bearing(heading), bearingUnit()), ...corner(166, 152, "end", `SOG ${speedUnit()}`, speed(view?.boat.sog_mps), ""));
  renew(root, out);
  set(root, { "aria-label": `Wind dial: true wind from ${bearing(wind?.twd_from_deg)}, ${speed(wind?.tws_mps)} ${speedUnit()}, heading ${bearing(heading)}` });
}

/** @param {number} at @param {string} letter @param {string} kind @param {number} radius */
function arrow(at, letter, kind, radius) {
  return sketch("g", { class: `arrow ${kind}`, transform: `rotate(${at.toFixed(1)})` },
    sketch("path", { d: `M0 ${-radius + 34}L-11 ${-radius}L0 ${-radius + 8}L11 ${-radius}Z` }),
    sketch("text", { x: 0, y: -radius + 19, transform: `rotate(${(-at).toFixed(1)} 0 ${-radius + 15})` }, letter));
}

/** @param {number} x @param {number} y @param {string} anchor @param {string} name @param {string} value @param {string} unit */
function corner(x, y, anchor, name, value, unit) {
  const top = y < 0;
  return [sketch("text", { x, y: top ? y - 4 : y + 14, class: "cornername", "text-anchor": anchor }, name),
    sketch("text", { x, y: top ? y + 20 : y - 3, class: "cornervalue", "text-anchor": anchor }, value + (unit && value !== NONE ? ` ${unit}` : ""))];
}

/** @param {(degrees: number) => boolean} which @param {number} long */
function ticks(which, long) {
  let d = "";
  for (let degrees = 0; degrees < 360; degrees += 10) if (which(degrees)) d += path([onDial(degrees, RIM), onDial(degrees, RIM - long)]);
  return d;
}

/** Where the wind was lately: dots that fade, and the arc between its limits. @param {View | null} view @param {Past | null} past @param {number} up */
function shifts(view, past, up) {
  if (!view || !past || view.wind?.twd_from_deg == null) return [];
  const middle = view.wind.twd_from_deg;
  let low = 0, high = 0;
  /** @type {Map<number, import("./dom.js").Sketch>} */
  const dots = new Map();
  for (let n = past.t_s.length - 1; n >= 0; n--) {
    const ago = view.t_s - (past.t_s[n] ?? 0), twd = past.twd_from_deg[n];
    if (ago > LATELY_S) break;
    if (ago < 0 || twd === null || twd === undefined) continue;
    const off = wrap(twd - middle);
    low = Math.min(low, off);
    high = Math.max(high, off);
    if (n % 6 === 0) {
      const [cx, cy] = onDial(twd, RIM + 2);
      dots.set(n / 6, sketch("circle", { cx, cy, r: 1.6, class: "shift", "fill-opacity": (1 - 0.85 * ago / LATELY_S).toFixed(2) }));
    }
  }
  return [sketch("path", { class: "limits", d: sector(middle + low - up, middle + high - up, RIM, RIM + 4) }), sketch("g", { transform: `rotate(${-up})` }, ...slots(dots))];
}
