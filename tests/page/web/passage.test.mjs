// What the layer of a passage says, tried by node.
import assert from "node:assert/strict";
import { test } from "node:test";
import { feathers, forecastWords, isOf, membersAt, nearest, often, placeAt, span, standing, timeOf, valueAt } from "../../../companion/page/web/passage.js";

const H = 3600;
const passage = {
  departs_unix_s: 1_776_643_200, run_unix_s: 1_776_643_200 - 6 * H, until_unix_s: 1_776_643_200 + 48 * H, climate_unix_s: null,
  runs: 10, low: 0.1, high: 0.9, line: [[0, 0, 0], [10_000, 10_000, 0], [20_000, 10_000, 10_000]],
  waypoints: [{ at_en_m: [0, 0], way_m: 0, middle_s: 0 }, { at_en_m: [10_000, 10_000], way_m: 20_000, middle_s: 4 * H }],
  at_s: [0, H, 2 * H, 3 * H, 4 * H], middle_m: [0, 5000, 10_000, 10_000, 20_000], members_m: [[0, 6000, 12_000, 18_000, 20_000], [0, 4000, null, null, null]],
};
const at = (hours, en) => standing(passage, passage.departs_unix_s + hours * H, en);

test("a column is known between its times, and not past a run's end", () => {
  assert.equal(valueAt(passage.at_s, passage.middle_m, 1.5 * H), 7500);
  assert.equal(valueAt(passage.at_s, passage.members_m[1], 1.5 * H), null);
  assert.deepEqual(membersAt(passage, 0.5 * H), [2000, 3000]);
  assert.deepEqual(membersAt(passage, 3 * H), [18_000]);
});

test("a way has its place and a place its way", () => {
  assert.deepEqual(placeAt(passage, 15_000), [10_000, 5000]);
  assert.deepEqual(nearest(passage, [10_300, 5000]), { way: 15_000, off: 300 });
  assert.equal(timeOf(passage, 5000), H);
  assert.equal(timeOf(passage, 10_000), 2 * H);   // and not when she went on
  assert.equal(timeOf(passage, 15_000), 3.5 * H);
});

test("she is behind, ahead, on time, not under way yet, late", () => {
  assert.equal(at(2, [5000, 100]), "1 h 00 behind the middle run, 100 m off the route");
  assert.equal(at(0.5, [5000, 100]), "30 min ahead of the middle run, 100 m off the route");
  assert.equal(at(1, [5000, 100]), "on time, 100 m off the route");
  assert.equal(at(-2, [0, 0]), "departs in 2 h 00");
  assert.equal(at(5, [10_000, 9000]), "she should be there since 04-20 04:00 UTC; 1000 m to go, 0.0 m off the route");
  assert.equal(at(1, null), "where she is is not known");
  assert.match(standing(passage, null, [0, 0]), /time is not known/);
});

test("a forecast has its run and its age, and an end", () => {
  const now = (hours) => forecastWords(passage, passage.departs_unix_s + hours * H);
  assert.equal(now(8), "forecast of 04-19 18:00 UTC, 14 h 00 old");
  assert.equal(now(50), "forecast of 04-19 18:00 UTC, 56 h 00 old; it ended 2 h 00 ago");
  assert.equal(forecastWords(passage, null), "forecast of 04-19 18:00 UTC, how old is not known");
  assert.match(forecastWords({ ...passage, climate_unix_s: passage.until_unix_s }, null), /from 04-22 00:00 on it is climatology, and no forecast/);
  assert.equal(span(200 * H), "8 d 8 h");
});

test("goals of another mission are no places of it", () => {
  assert.ok(isOf(passage, [{ at_en_m: [10_010, 10_010] }]));
  assert.ok(!isOf(passage, [{ at_en_m: [10_010, 10_010] }, { at_en_m: [3000, 0] }]));
});

test("quantiles are no more than the runs show", () => {
  assert.equal(often(passage), "8 of 10");
  assert.equal(often({ ...passage, runs: 1 }), "");
});

test("barbs count fives of knots", () => {
  assert.deepEqual(feathers(7.7), { pennants: 0, long: 1, short: 1 });
  assert.deepEqual(feathers(33.4), { pennants: 1, long: 1, short: 1 });
  assert.deepEqual(feathers(1), { pennants: 0, long: 0, short: 0 });
});
