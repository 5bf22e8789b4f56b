// The chart below the drawing: which level and which tiles a camera needs, and what depths are called.
import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";

const root = new URL("../../..", import.meta.url).pathname, folder = mkdtempSync(join(tmpdir(), "water-"));
for (const [from, name] of [["companion/editor/web/water.js", "water.js"], ["companion/page/web/geometry.js", "geometry.js"]]) writeFileSync(join(folder, name), readFileSync(join(root, from)));
writeFileSync(join(folder, "package.json"), '{"type": "module"}');
const { band, levelOf, sounding, tilesOf } = await import(join(folder, "water.js"));
const water = { tag: "0", name: "", corner: [50, -1], lat_m: 111195, lon_m: 71000, wide_m: 48000, tall_m: 74000, finest_m: 0.5, levels: 13, units: 4, tile_units: 4096 };

test("a level leaves out half a pixel at the most, and more than a quarter", () => {
  for (let scale = 0.0006; scale < 0.9; scale *= 1.13) {
    const left = water.finest_m * 2 ** levelOf(water, scale) * scale;
    assert.ok(left <= 0.5 && (left > 0.25 || levelOf(water, scale) === 12), `${scale}: ${left}`);
  }
  assert.equal(levelOf(water, 50), 0);
  assert.equal(levelOf(water, 1e-9), 12);
});

test("the tiles of a phone are few at every scale, and none lies outside of the chart", () => {
  for (let scale = 0.0002; scale < 20; scale *= 1.37) {
    const level = levelOf(water, scale), [x, y] = [20000, 30000], [w, h] = [390 * 1.6 / scale / 2, 844 * 1.6 / scale / 2];
    const found = tilesOf(water, level, [x - w, y - h, x + w, y + h]);
    assert.ok(found.length > 0 && found.length <= 40, `${scale}: ${found.length}`);
    const size = water.finest_m * 2 ** level / water.units * water.tile_units;
    for (const [tx, ty] of found) assert.ok(tx >= 0 && ty >= 0 && tx * size <= water.wide_m && ty * size <= water.tall_m);
  }
  assert.deepEqual(tilesOf(water, 0, [-9000, -9000, -8000, -8000]), []);
});

test("a depth is one of four bands by what the boat needs", () => {
  assert.deepEqual([-0.1, 0, 1.9, 2, 9.9, 10, 30].map((deep) => band(deep, 2)), ["--chart-dry", "--chart-shoal", "--chart-shoal", "--chart-shallow", "--chart-shallow", "--chart-deep", "--chart-deep"]);
  assert.equal(band(12, 8), "--chart-shallow");
});

test("soundings are never called deeper than they are", () => {
  assert.deepEqual([0, 0.6, 2.34, 2.39, 12.05, 30.99, 31.9, -0.5].map(sounding), ["0", "0₆", "2₃", "2₃", "12", "30₉", "31", "−0₅"]);
});
