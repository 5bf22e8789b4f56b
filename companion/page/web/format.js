// Figures as a person reads them. What is not known is a dash, never 0.

export const NONE = "–";
const KNOTS = 3600 / 1852;

/** @typedef {{speeds: "kn" | "mps", bearings: "true" | "magnetic", variation: number}} Units */

/** @type {Units} */
export const units = { speeds: "kn", bearings: "true", variation: 0 };

/** @param {number | null | undefined} value @param {number} [digits] @param {string} [unit] */
export function figure(value, digits = 0, unit = "") {
  if (value === null || value === undefined || !Number.isFinite(value)) return NONE;
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−")) + unit;
}

/** @param {number | null | undefined} mps @param {number} [digits] */
export function speed(mps, digits = 1) {
  if (mps === null || mps === undefined) return NONE;
  return figure(units.speeds === "kn" ? mps * KNOTS : mps, digits);
}

export function speedUnit() {
  return units.speeds === "kn" ? "kn" : "m/s";
}

/** A speed as it is drawn. @param {number} mps */
export function scaled(mps) {
  return units.speeds === "kn" ? mps * KNOTS : mps;
}

/** A direction in three digits: 007°. @param {number | null | undefined} degrees */
export function bearing(degrees) {
  if (degrees === null || degrees === undefined || !Number.isFinite(degrees)) return NONE;
  const off = units.bearings === "magnetic" ? units.variation : 0;
  const whole = ((Math.round(degrees - off) % 360) + 360) % 360;
  return `${String(whole).padStart(3, "0")}°`;
}

export function bearingUnit() {
  return units.bearings === "magnetic" ? "M" : "T";
}

/** An angle at the bow: 42° S where the wind comes over starboard. @param {number | null | undefined} degrees */
export function atBow(degrees) {
  if (degrees === null || degrees === undefined || !Number.isFinite(degrees)) return NONE;
  const whole = Math.round(Math.abs(degrees));
  return `${whole}°${whole === 0 || whole === 180 ? "" : degrees > 0 ? " S" : " P"}`;
}

/** @param {number | null | undefined} metres */
export function distance(metres) {
  if (metres === null || metres === undefined) return NONE;
  if (Math.abs(metres) >= 9999.5) return figure(metres / 1852, 1, " nm");
  return figure(metres, Math.abs(metres) < 20 ? 1 : 0, " m");
}

/** @param {number | null | undefined} share of 1 */
export function percent(share) {
  if (share === null || share === undefined) return NONE;
  if (share > 0 && share < 0.01) return `${(100 * share).toFixed(1)} %`;
  return figure(100 * share, 0, " %");
}

/** Minutes and seconds, or hours and minutes. @param {number | null | undefined} seconds */
export function duration(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return NONE;
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole} s`;
  const two = (/** @type {number} */ n) => String(n).padStart(2, "0");
  if (whole < 3600) return `${Math.floor(whole / 60)}:${two(whole % 60)}`;
  return `${Math.floor(whole / 3600)} h ${two(Math.floor((whole % 3600) / 60))}`;
}

/** Time of day, UTC; of a voyage whose date is not known the time since it began. @param {number | null} unix_s @param {number} [t_s] */
export function clock(unix_s, t_s) {
  if (unix_s !== null && Number.isFinite(unix_s)) return new Date(unix_s * 1000).toISOString().slice(11, 19);
  return t_s === undefined ? NONE : `+${duration(t_s)}`;
}

/** When water that dries is solid: now, until when, and in words. @param {(number | null)[][]} spans of Unix time; an end that is null there is none @param {number | null | undefined} unix_s now
 * @returns {{isSolid: boolean, words: string}} */
export function drying(spans, unix_s) {
  if (unix_s === null || unix_s === undefined || !Number.isFinite(unix_s)) return { isSolid: true, words: "solid: the time is not known" };
  const inside = spans.find(([from, to]) => unix_s >= (from ?? -Infinity) && unix_s < (to ?? Infinity));
  const next = inside ? inside[1] ?? null : spans.map(([from]) => from ?? null).find((from) => from !== null && from > unix_s) ?? null;
  const state = inside ? "solid" : "open";
  if (next === null) return { isSolid: inside !== undefined, words: state };
  const at = new Date(next * 1000).toISOString();
  const day = at.slice(0, 10) === new Date(unix_s * 1000).toISOString().slice(0, 10) ? "" : `${at.slice(5, 10)} `;
  return { isSolid: inside !== undefined, words: `${state} until ${day}${at.slice(11, 16)} UTC` };
}

/** @param {number} lat @param {number} lon */
export function position(lat, lon) {
  const part = (/** @type {number} */ value, /** @type {string} */ plus, /** @type {string} */ minus, /** @type {number} */ wide) => {
    const size = Math.abs(value);
    let whole = Math.floor(size);
    let minutes = ((size - whole) * 60).toFixed(3);
    if (minutes === "60.000") { whole += 1; minutes = "0.000"; }
    return `${String(whole).padStart(wide, "0")}°${minutes.padStart(6, "0")}′ ${value < 0 ? minus : plus}`;
  };
  return `${part(lat, "N", "S", 2)}  ${part(lon, "E", "W", 3)}`;
}
