// The page's pure functions: node --test.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as format from "../../../companion/page/web/format.js";
import * as g from "../../../companion/page/web/geometry.js";

const near = (a, b, by = 1e-6) => assert.ok(Math.abs(a - b) <= by, `${a} is not ${b}`);
const cameras = [0, 37, 90, 180, 271.5].map((up) => ({ centre: [120, -40], scale: 1.7, up, width: 640, height: 480 }));

test("what is up is up, and right of it is right", () => {
  for (const camera of cameras) {
    const [x, y] = g.project(camera, g.moved(camera.centre, camera.up, 10));
    near(x, 320); near(y, 240 - 17);
    const [a, b] = g.project(camera, g.moved(camera.centre, camera.up + 90, 10));
    near(a, 320 + 17); near(b, 240);
  }
});

test("a place on the screen is found again", () => {
  for (const camera of cameras) {
    for (const place of [[0, 0], [500, -800], [-3.5, 12]]) {
      const back = g.unproject(camera, g.project(camera, place));
      near(back[0], place[0]); near(back[1], place[1]);
    }
  }
});

test("the matrix does what project does", () => {
  for (const camera of cameras) {
    const [a, b, c, d, e, f] = g.matrix(camera).slice(7, -1).split(" ").map(Number);
    const [x, y] = g.project(camera, [33, 44]);
    near(a * 33 + c * 44 + e, x); near(b * 33 + d * 44 + f, y);
  }
});

test("the track is parted by tack and by gaps, and joined at each tack", () => {
  const pieces = g.byTack([0, 1, 2, 3, null, 5, 6], [0, 0, 0, 0, null, 0, 0], [true, true, false, false, false, false, false]);
  assert.deepEqual(pieces.map((p) => p.starboard), [true, false, false]);
  assert.deepEqual(pieces[1].points[0], [1, 0]);   // begins where the tack before ends
  assert.deepEqual(pieces[2].points, [[5, 0], [6, 0]]);
});

test("directions go on over north", () => {
  assert.deepEqual(g.unwrapped([350, null, 358, 5, 355]), [350, null, 358, 365, 355]);
});

test("a sector goes clockwise from its first to its last direction", () => {
  assert.match(g.sector(0, 90, 0, 10), /^M0\.00 -10\.00A10 10 0 0 1 10\.00 -?0\.00/);
  assert.match(g.sector(0, 200, 0, 10), / 0 1 1 /);
});

test("an axis has two figures at least", () => {
  assert.deepEqual(g.scale(6.5, 14.9, [1, 2, 5]), [8, 10, 12, 14]);   // 10 stood there alone
  assert.deepEqual(g.scale(0, 4.5, [1, 2, 5]), [0, 2, 4]);
  for (let low = 0; low < 30; low += 0.7) for (let wide = 1; wide < 300; wide *= 1.1) assert.ok(g.scale(low, low + wide, [1, 2, 5]).length > 1, `${low} ${wide}`);
});

test("marks are round, within, and not too many", () => {
  for (const [low, high] of [[0, 1], [-3, 17], [340, 385], [4.1, 4.9], [0, 1e-9]]) {
    const marks = g.marks(low, high, 4);
    assert.ok(marks.length <= 5 && marks.every((m) => m >= low - 1e-9 && m <= high + 1e-9), String(marks));
  }
});

test("a time on the axis is where the clock says it", () => {
  for (const unix of [1780913597.4, 1780913640, null]) {
    for (const [begin, end] of [[0, 95], [12.5, 700], [3600, 90000]]) {
      const at = g.minutes(begin, end, 5, unix);
      assert.ok(at.length >= 1 && at.length <= 6 && at.every((t) => t >= begin && t <= end), String(at));
      // what is written beside it is cut to minutes: nothing may be cut
      for (const t of at) near(Math.round((unix ?? 0) + t) % 60, 0);
    }
  }
});

test("a leg's risk has three classes, and unknown is none of them", () => {
  assert.deepEqual([0, 0.019, 0.02, 0.099, 0.1, null].map(g.riskClass), ["0", "0", "1", "1", "2", "unknown"]);
});

test("unknown is a dash and never nought", () => {
  for (const show of [format.figure, format.speed, format.bearing, format.distance, format.percent, format.duration, format.atBow]) {
    assert.equal(show(null), format.NONE);
    assert.notEqual(show(0), format.NONE);
  }
});

test("bearings have three digits and turn with the variation", () => {
  Object.assign(format.units, { bearings: "true", variation: 10 });
  assert.equal(format.bearing(359.6), "000°");
  assert.equal(format.bearing(7), "007°");
  format.units.bearings = "magnetic";
  assert.equal(format.bearing(5), "355°");
  format.units.bearings = "true";
});

test("speeds are knots or metres a second", () => {
  format.units.speeds = "kn";
  assert.equal(format.speed(1), "1.9");
  format.units.speeds = "mps";
  assert.equal(format.speed(1), "1.0");
});

test("a position is degrees and minutes, and 60 minutes are a degree", () => {
  assert.equal(format.position(50.99999999, -1.5), "51°00.000′ N  001°30.000′ W");
});

test("the wind over starboard is S", () => {
  assert.deepEqual([format.atBow(42), format.atBow(-42), format.atBow(180)], ["42° S", "42° P", "180°"]);
});

const everywhere = { bounds_deg: [-180, -85, 180, 85], least_zoom: 0, most_zoom: 18 };
const origins = [[50.8, -1.3], [-36.8, 174.7], [0, 0], [75, 20], [-17, 179.999]].map(([lat, lon]) => ({
  origin_lat_deg: lat, origin_lon_deg: lon, lat_m: 111200, lon_m: 111300 * Math.cos(lat * Math.PI / 180) }));

test("the tiles of a chart cover what is seen, and are few", () => {
  for (const origin of origins) for (const camera of cameras) for (const scale of [0.01, 0.3, 1.7, 20]) {
    const seen = { ...camera, scale };
    const tiles = g.tilesIn(seen, origin, everywhere, 1, 48);
    assert.ok(tiles.length > 0 && tiles.length <= 48);
    for (const at of [[1, 1], [639, 1], [320, 240], [1, 479], [639, 479]]) {
      const [e, n] = g.unproject(seen, at);
      const lap = 0.005 * tiles[0].wide_m;
      assert.ok(tiles.some((t) => e >= t.west_m - lap && e <= t.west_m + t.wide_m + lap && n >= t.south_m - lap && n <= t.south_m + t.tall_m + lap),
        `nothing at ${at} of ${JSON.stringify(origin)}, scale ${scale}`);
    }
    for (const t of tiles) assert.ok(t.x >= 0 && t.x < 2 ** t.z && t.y >= 0 && t.y < 2 ** t.z);
  }
});

test("a pixel of a tile is about one of the screen, and what a chart has not is not asked for", () => {
  const [origin] = origins, [camera] = cameras;
  for (const scale of [0.05, 0.4, 1.7]) {
    const [tile] = g.tilesIn({ ...camera, scale }, origin, everywhere, 1, 48);
    const pixels = tile.wide_m * scale / 256;
    assert.ok(pixels > 0.69 && pixels < 1.45, `${pixels}`);
  }
  for (const t of g.tilesIn({ ...camera, scale: 60 }, origin, { ...everywhere, most_zoom: 14 }, 2, 48)) assert.equal(t.z, 14);
  assert.deepEqual(g.tilesIn(camera, origin, { ...everywhere, bounds_deg: [10, 50, 11, 51] }, 1, 48), []);
  assert.deepEqual(g.tilesIn({ ...camera, scale: 0.002 }, origin, { ...everywhere, least_zoom: 17 }, 1, 48), []);
});

test("water that dries is as it is at the moment that is shown, with when that changes", () => {
  const at = (hour, day = 9) => Date.UTC(2026, 5, day, 0, 60 * hour) / 1000;
  const spans = [[null, at(8.5)], [at(15), at(20)], [at(3, 10), null]];
  assert.deepEqual(format.drying(spans, at(8)), { isSolid: true, words: "solid until 08:30 UTC" });
  assert.deepEqual(format.drying(spans, at(8.5)), { isSolid: false, words: "open until 15:00 UTC" });
  assert.deepEqual(format.drying(spans, at(19)), { isSolid: true, words: "solid until 20:00 UTC" });
  assert.deepEqual(format.drying(spans, at(21)), { isSolid: false, words: "open until 06-10 03:00 UTC" });
  assert.deepEqual(format.drying(spans, at(4, 10)), { isSolid: true, words: "solid" });
  assert.deepEqual(format.drying([[null, null]], at(8)), { isSolid: true, words: "solid" });
  assert.deepEqual(format.drying(spans, null), { isSolid: true, words: "solid: the time is not known" });
});

test("a line of many points a pixel keeps those by which it is drawn", () => {
  const line = [[0.1, 5], [0.2, 9], [0.3, 1], [0.4, 4], [0.9, 6], [1, 2], [1.5, 3], [3.2, 7]];
  assert.deepEqual(g.thinned(line), [[0.1, 5], [0.2, 9], [0.3, 1], [0.9, 6], [1, 2], [1.5, 3], [3.2, 7]]);
  assert.deepEqual(g.thinned([]), []);
  const dense = Array.from({ length: 7200 }, (_, n) => [n / 16, Math.sin(n * n)]), few = g.thinned(dense);
  assert.ok(few.length <= 4 * 450);
  for (let x = 0; x < 450; x++) {
    const ys = (points) => points.filter((p) => Math.floor(p[0]) === x).map((p) => p[1]);
    assert.deepEqual([Math.min(...ys(few)), Math.max(...ys(few)), ys(few)[0], ys(few).at(-1)], [Math.min(...ys(dense)), Math.max(...ys(dense)), ys(dense)[0], ys(dense).at(-1)]);
  }
});
