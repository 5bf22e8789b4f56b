// The polar in the present wind, the boat's point and where it was lately, the best angles, the no-go zone.
import { picture, renew, sketch, slots } from "./dom.js";
import { figure, scaled, speed, speedUnit } from "./format.js";
import { marks, onDial, path, sector } from "./geometry.js";

/** @typedef {import("../../view/view").View} View @typedef {import("../../view/view").Past} Past @typedef {import("./geometry.js").Point} Point */

const R = 108, LATELY_S = 300;
const root = picture("polar");

/** @param {View | null} view @param {Past | null} past */
export function show(view, past) {
  const polar = view?.polar;
  if (!view || !polar || polar.speed_mps.length === 0) {
    return renew(root, [sketch("text", { x: 170, y: 120, class: "axis middle" }, "no wind, no polar")]);
  }
  const most = Math.max(0.5, ...polar.speed_mps, polar.live_mps ?? 0);
  const r = (/** @type {number} */ mps) => R * mps / (1.06 * most);
  const both = (/** @type {1 | -1} */ side) => polar.twa_deg.map((angle, n) => onDial(side * angle, r(polar.speed_mps[n] ?? 0)));
  /** @type {import("./dom.js").Sketch[]} */
  const out = [];
  const zone = view.no_go?.wedges ?? [];
  [...zone].reverse().forEach((one, n) => out.push(sketch("path", { class: `zone z${zone.length - 1 - n}`, d: sector(-one.half_deg, one.half_deg, 0, R) })));
  for (const mark of marks(0, scaled(most), 4)) {
    if (mark === 0) continue;
    const radius = r(mark / scaled(1));
    out.push(sketch("circle", { r: radius.toFixed(1), class: "ring" }), sketch("text", { x: 3, y: (radius + 10).toFixed(1), class: "axis" }, figure(mark, mark < 1 ? 1 : 0)));
  }
  for (let angle = 0; angle < 360; angle += 30) out.push(sketch("path", { class: "spoke", d: path([[0, 0], onDial(angle, R)]) }));
  for (const angle of [30, 60, 90, 120, 150]) {
    const [x, y] = onDial(angle, R + 12);
    out.push(sketch("text", { x, y: y + 4, class: "axis middle" }, String(angle)), sketch("text", { x: -x, y: y + 4, class: "axis middle" }, String(angle)));
  }
  out.push(sketch("path", { class: "curve", d: path([...both(-1).reverse(), ...both(1)]) }));
  for (const best of [polar.beat_deg, polar.run_deg]) {
    if (best === null || best >= 179) continue;
    const v = at(polar.twa_deg, polar.speed_mps, best);
    for (const side of [1, -1]) {
      const [x, y] = onDial(side * best, r(v));
      out.push(sketch("circle", { cx: x, cy: y, r: 3.4, class: "best" }));
    }
  }
  /** @type {Map<number, import("./dom.js").Sketch>} */
  const dots = new Map();
  for (let n = (past?.t_s.length ?? 0) - 1; past && n >= 0; n--) {
    const ago = view.t_s - (past.t_s[n] ?? 0), twa = past.polar_twa_deg[n], speed = past.polar_mps[n];
    if (ago > LATELY_S) break;
    if (n % 3 !== 0 || ago < 0 || twa == null || speed == null) continue;
    const [x, y] = onDial(twa, r(speed));
    dots.set(n / 3, sketch("circle", { cx: x.toFixed(1), cy: y.toFixed(1), r: 1.7, class: "was", "fill-opacity": (0.75 - 0.65 * ago / LATELY_S).toFixed(2) }));
  }
  out.push(sketch("g", {}, ...slots(dots)));
  let share = "";
  if (polar.live_twa_deg !== null && polar.live_mps !== null) {
    const [x, y] = onDial(polar.live_twa_deg, r(polar.live_mps));
    const target = at(polar.twa_deg, polar.speed_mps, Math.abs(polar.live_twa_deg));
    // close to the wind's eye she carries her way, and the polar says nothing
    if (target > 0.1 && Math.abs(polar.live_twa_deg) > (polar.beat_deg ?? 0) - 8) share = `${Math.round(100 * polar.live_mps / target)} %`;
    out.push(sketch("path", { class: "towards", d: path([[0, 0], [x, y]]) }), sketch("circle", { cx: x, cy: y, r: 5.5, class: `live ${polar.live_twa_deg > 0 ? "starboard" : "port"}` }));
  }
  renew(root, [sketch("g", { transform: "translate(170 120)" }, ...out),
    sketch("text", { x: 4, y: 16, class: "axis" }, `polar in ${speed(polar.tws_mps)} ${speedUnit()}`), sketch("text", { x: 4, y: 240, class: "axis" }, "P"), sketch("text", { x: 336, y: 240, class: "axis end" }, "S"),
    ...(share ? [sketch("text", { x: 336, y: 16, class: "axis end strong" }, `${share} of polar`)] : [])]);
}

/** @param {readonly number[]} xs @param {readonly number[]} ys @param {number} x */
function at(xs, ys, x) {
  for (let n = 1; n < xs.length; n++) {
    const a = xs[n - 1] ?? 0, b = xs[n] ?? 0;
    if (x <= b) return (ys[n - 1] ?? 0) + ((ys[n] ?? 0) - (ys[n - 1] ?? 0)) * (b > a ? (x - a) / (b - a) : 0);
  }
  return ys[ys.length - 1] ?? 0;
}
