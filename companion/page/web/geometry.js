// Geometry of the pictures: pure functions, tried by node.

/** @typedef {[number, number]} Point */
/** @typedef {{centre: Point, scale: number, up: number, width: number, height: number}} Camera  metres; px a metre; degrees that are up; px */

const RAD = Math.PI / 180;

/** @param {number} degrees */
export function wrap(degrees) {
  return ((degrees + 180) % 360 + 360) % 360 - 180;
}

/** Where a place on the water is on the screen. @param {Camera} camera @param {Point} en @returns {Point} */
export function project(camera, en) {
  const east = en[0] - camera.centre[0], north = en[1] - camera.centre[1];
  const c = Math.cos(camera.up * RAD), s = Math.sin(camera.up * RAD);
  return [camera.width / 2 + camera.scale * (east * c - north * s),
          camera.height / 2 - camera.scale * (east * s + north * c)];
}

/** Which place is at a point of the screen. @param {Camera} camera @param {Point} at @returns {Point} */
export function unproject(camera, at) {
  const x = (at[0] - camera.width / 2) / camera.scale, y = (camera.height / 2 - at[1]) / camera.scale;
  const c = Math.cos(camera.up * RAD), s = Math.sin(camera.up * RAD);
  return [camera.centre[0] + x * c + y * s, camera.centre[1] - x * s + y * c];
}

/** The camera's matrix, for what is drawn in metres. @param {Camera} camera */
export function matrix(camera) {
  const c = camera.scale * Math.cos(camera.up * RAD), s = camera.scale * Math.sin(camera.up * RAD);
  const [e, n] = camera.centre;
  const x = camera.width / 2 - c * e + s * n, y = camera.height / 2 + s * e + c * n;
  return `matrix(${c} ${-s} ${-s} ${-c} ${x} ${y})`;
}

/** A point so far off in a direction. @param {Point} from @param {number} degrees @param {number} by @returns {Point} */
export function moved(from, degrees, by) {
  return [from[0] + by * Math.sin(degrees * RAD), from[1] + by * Math.cos(degrees * RAD)];
}

/** A point of a dial: 0 is up, clockwise. @param {number} degrees @param {number} radius @returns {Point} */
export function onDial(degrees, radius) {
  return [radius * Math.sin(degrees * RAD), -radius * Math.cos(degrees * RAD)];
}

/** A sector of a dial as a path. @param {number} from @param {number} to @param {number} inner @param {number} outer */
export function sector(from, to, inner, outer) {
  const wide = Math.min(359.9, Math.max(0, to - from));
  const [a, b, c, d] = [onDial(from, outer), onDial(from + wide, outer), onDial(from + wide, inner), onDial(from, inner)];
  const large = wide > 180 ? 1 : 0;
  const r = (/** @type {Point} */ p) => `${p[0].toFixed(2)} ${p[1].toFixed(2)}`;
  return `M${r(a)}A${outer} ${outer} 0 ${large} 1 ${r(b)}L${r(c)}` +
    (inner > 0 ? `A${inner} ${inner} 0 ${large} 0 ${r(d)}` : "") + "Z";
}

/** @param {readonly Point[]} points @param {boolean} [closed] */
export function path(points, closed = false) {
  if (points.length === 0) return "";
  return "M" + points.map((p) => `${p[0].toFixed(1)} ${p[1].toFixed(1)}`).join("L") + (closed ? "Z" : "");
}

/** A line from left to right with four points a pixel at the most: of those in one the first, the lowest, the highest and the last,
 * which are drawn as all of them are. @param {readonly Point[]} points @returns {Point[]} */
export function thinned(points) {
  /** @type {Point[]} */
  const out = [];
  for (let n = 0; n < points.length;) {
    const column = Math.floor(points[n]?.[0] ?? 0);
    let end = n + 1, low = n, high = n;
    for (let y = points[n]?.[1] ?? 0, least = y, most = y; end < points.length && Math.floor(points[end]?.[0] ?? 0) === column; end++) {
      y = points[end]?.[1] ?? 0;
      if (y < least) { least = y; low = end; }
      if (y > most) { most = y; high = end; }
    }
    for (const k of new Set([n, Math.min(low, high), Math.max(low, high), end - 1])) out.push(/** @type {Point} */ (points[k]));
    n = end;
  }
  return out;
}

/** The track in pieces of one tack, each beginning where the one before ends. A gap in the positions parts it, too.
 * @param {readonly (number | null)[]} east @param {readonly (number | null)[]} north @param {readonly (boolean | null)[]} starboard
 * @returns {{starboard: boolean | null, points: Point[]}[]} */
export function byTack(east, north, starboard) {
  /** @type {{starboard: boolean | null, points: Point[]}[]} */
  const out = [];
  /** @type {Point | null} */
  let last = null;
  for (let n = 0; n < east.length; n++) {
    const e = east[n], m = north[n], side = starboard[n] ?? null;
    if (e === null || e === undefined || m === null || m === undefined) { last = null; continue; }
    const point = /** @type {Point} */ ([e, m]);
    const open = out[out.length - 1];
    if (last === null || open === undefined) out.push({ starboard: side, points: [point] });
    else if (open.starboard !== side) out.push({ starboard: side, points: [last, point] });
    else open.points.push(point);
    last = point;
  }
  return out;
}

const MERCATOR_M = 40075016.686;   // a tile's width at zoom 0, on the equator

/** @typedef {{origin_lat_deg: number, origin_lon_deg: number, lat_m: number, lon_m: number}} Origin  where the metres are on the globe */
/** @typedef {{bounds_deg: [number, number, number, number], least_zoom: number, most_zoom: number}} Covers */
/** @typedef {{z: number, x: number, y: number, west_m: number, south_m: number, wide_m: number, tall_m: number}} Tile */

/** Where a latitude and a longitude are on the chart's metres. Meridians come together: a metre east is fewer of them here than there.
 * @param {Origin} origin @param {number} lat @param {number} lon @returns {Point} */
export function onWater(origin, lat, lon) {
  const narrower = Math.cos(lat * RAD) / Math.cos(origin.origin_lat_deg * RAD);
  return [wrap(lon - origin.origin_lon_deg) * origin.lon_m * narrower, (lat - origin.origin_lat_deg) * origin.lat_m];
}

/** The parallel at a share of Web Mercator's height, 0 in the north. @param {number} y */
const parallel = (y) => Math.atan(Math.sinh(Math.PI * (1 - 2 * y))) / RAD;

/** The tiles of a chart that a camera sees, at the zoom that is fine enough for its pixels; none where there would be too many.
 * @param {Camera} camera @param {Origin} origin @param {Covers} chart @param {number} dense pixels of the screen in one of the page @param {number} most @returns {Tile[]} */
export function tilesIn(camera, origin, chart, dense, most) {
  const near = origin.origin_lat_deg + unproject(camera, [camera.width / 2, camera.height / 2])[1] / origin.lat_m;
  const fine = Math.log2(MERCATOR_M * Math.cos(near * RAD) * camera.scale * dense / 256);
  const corners = [[0, 0], [camera.width, 0], [0, camera.height], [camera.width, camera.height]].map((p) => unproject(camera, /** @type {Point} */ (p)));
  const [west, south, east, north] = chart.bounds_deg;
  const lats = corners.map((p) => origin.origin_lat_deg + p[1] / origin.lat_m), norths = lats.map((lat) => Math.max(-85, Math.min(85, lat)));
  const lons = corners.map((p, n) => origin.origin_lon_deg + p[0] / (origin.lon_m * Math.cos((norths[n] ?? 0) * RAD) / Math.cos(origin.origin_lat_deg * RAD)));
  const low = Math.max(south, Math.min(...norths)), high = Math.min(north, Math.max(...norths));
  if (low >= high) return [];
  for (let z = Math.min(chart.most_zoom, Math.max(chart.least_zoom, Math.round(fine))); z >= chart.least_zoom; z--) {
    const all = 2 ** z, row = (/** @type {number} */ lat) => Math.floor(all * (1 - Math.asinh(Math.tan(Math.max(-85, Math.min(85, lat)) * RAD)) / Math.PI) / 2);
    const column = (/** @type {number} */ lon) => Math.floor(all * (lon + 180) / 360);
    const [top, bottom, left, right] = [row(high), row(low), column(Math.min(...lons)), column(Math.max(...lons))];
    if ((bottom - top + 1) * (right - left + 1) > most) continue;
    /** @type {Tile[]} */
    const out = [];
    for (let y = top; y <= bottom; y++) for (let x = left; x <= right; x++) {
      const round = ((x % all) + all) % all, lon = 360 * round / all - 180;   // past the date line the world begins anew
      if (lon >= east || lon + 360 / all <= west) continue;
      const [up, down] = [parallel(y / all), parallel((y + 1) / all)], middle = (up + down) / 2;
      const at = onWater(origin, middle, 360 * (x + 0.5) / all - 180);
      const wide = 360 / all * origin.lon_m * Math.cos(middle * RAD) / Math.cos(origin.origin_lat_deg * RAD);
      out.push({ z, x: round, y, west_m: at[0] - wide / 2, south_m: (down - origin.origin_lat_deg) * origin.lat_m, wide_m: wide, tall_m: (up - down) * origin.lat_m });
    }
    return out;
  }
  return [];
}

/** The class of a leg by its risk: 0 to 2, or "unknown". @param {number | null | undefined} risk */
export function riskClass(risk) {
  if (risk === null || risk === undefined) return "unknown";
  return risk < 0.02 ? "0" : risk < 0.1 ? "1" : "2";
}

/** Directions made continuous, each within half a turn of the one before. @param {readonly (number | null)[]} degrees @returns {(number | null)[]} */
export function unwrapped(degrees) {
  /** @type {number | null} */
  let before = null;
  return degrees.map((value) => {
    if (value === null || value === undefined) return null;
    before = before === null ? value : before + wrap(value - before);
    return before;
  });
}

/** Round figures between two bounds, at most so many. @param {number} low @param {number} high @param {number} most @param {readonly number[]} [steps] */
export function marks(low, high, most, steps = [1, 2, 5]) {
  const span = Math.max(1e-9, high - low);
  let size = Math.pow(10, Math.floor(Math.log10(span / most)));
  let step = size;
  for (let n = 0; span / step > most && n < 60; n++) {
    step = size * (steps[n % steps.length] ?? 1) * Math.pow(10, Math.floor(n / steps.length));
  }
  const out = [];
  for (let value = Math.ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) out.push(Number(value.toFixed(9)));
  return out;
}

/** The figures of a low axis: three or so, and never one alone, which is no scale. @param {number} low @param {number} high @param {readonly number[]} steps */
export function scale(low, high, steps) {
  const few = marks(low, high, 3, steps);
  return few.length > 1 ? few : marks(low, high, 5, steps);
}

/** Times to be marked on an axis: those of the clock that are round in it [s]. @param {number} begin @param {number} end @param {number} most @param {number | null} unix_s of the time 0; null: the voyage's own time is the clock */
export function minutes(begin, end, most, unix_s) {
  const off = unix_s ?? 0, from = (begin + off) / 60, until = (end + off) / 60;
  const [first, second] = marks(0, until - from, most);
  const every = Math.max(1, (second ?? 1) - (first ?? 0));
  const out = [];
  for (let at = Math.ceil(from / every) * every; at <= until; at += every) out.push(60 * at - off);
  return out;
}

/** A scale bar: a round length and its pixels, at most so wide. @param {number} scale px a metre @param {number} most px */
export function scaleBar(scale, most) {
  const longest = most / scale;
  const size = Math.pow(10, Math.floor(Math.log10(longest)));
  const metres = [5, 2, 1].map((n) => n * size).find((m) => m <= longest) ?? size;
  return { metres, pixels: metres * scale };
}
