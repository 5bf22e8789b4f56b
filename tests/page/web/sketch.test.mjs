// The sketch's pure functions.
import assert from "node:assert/strict";
import { test } from "node:test";

import { called, changed, degrees, distanceTo, History, inserted, middle, moved, placeOf, places, removed, reordered, same, toEn, toPlace, within, withGoal } from "../../../companion/editor/web/sketch.js";

const FRAME = { lat: 50.817, lon: -1.31, lat_m: 111250, lon_m: 70450 };
const empty = () => ({ revision: "r", name: "m", start: null, goals: [], refuges: [], shapes: [], margin_m: 12, margin_floor_m: 6, point_radius_m: 10, end: "loiter", laps: 1 });
const square = [[0, 0], [0, 1], [1, 1], [1, 0]];
const full = () => ({ ...empty(), start: { at: [50, -1], heading_deg: 0 }, goals: [{ kind: "point", at: [50.1, -1], key: 0 }, { kind: "gate", port_mark: [50.2, -1], starboard_mark: [50.2, -0.9] }, { kind: "box", ring: square }], refuges: [{ at: [50.3, -1] }], shapes: [{ type: "polygon", zone: "exclusion", rings: [square, [[0.2, 0.2], [0.2, 0.4], [0.4, 0.4]]] }, { type: "point", zone: "exclusion", rings: [[[2, 2]]] }] });

test("degrees are read as people write them", () => {
  for (const [text, which, wanted] of [["50.8203", "lat", 50.8203], ["50 49.218 N", "lat", 50.8203], ["50°49.218′", "lat", 50.8203], ["1°18'36\"W", "lon", -1.31], ["W 1 18.6", "lon", -1.31], ["-1,31", "lon", -1.31], ["−1.31", "lon", -1.31]]) assert.equal(degrees(text, which), wanted, text);
  for (const [text, which] of [["", "lat"], ["north", "lat"], ["91", "lat"], ["181", "lon"], ["50 60 N", "lat"], ["50 W", "lat"], ["1e3", "lon"]]) assert.ok(Number.isNaN(degrees(text, which)), text);
});

test("metres and degrees are each other's inverse, over the antimeridian too", () => {
  for (const frame of [FRAME, { ...FRAME, lon: 179.999 }]) for (const en of [[0, 0], [123.4, -567.8], [-900, 900]]) {
    const back = toEn(frame, toPlace(frame, en));
    assert.ok(Math.hypot(back[0] - en[0], back[1] - en[1]) < 0.02);
  }
  assert.ok(toPlace({ ...FRAME, lon: 179.999 }, [900, 0])[1] < 0);
});

test("what has no name has the number that the check gives it: file by file, what has an area before points", () => {
  const shape = (type, of, zone = "exclusion", name = "") => ({ type, zone, rings: [square], of, name });
  const sketch = { ...empty(), shapes: [shape("point", "a.wkt"), shape("polygon", "a.wkt"), shape("polygon", "b.wkt", "exclusion", "Otter"), shape("circle", "b.wkt"), shape("polygon", "shore.wkt", "inclusion")] };
  assert.deepEqual(sketch.shapes.map((_, n) => called(sketch, { of: "shape", n })), ["obstacle 2", "obstacle 1", "Otter", "obstacle 4", "fence 1"]);
});

test("what is moved is there, and nothing else is elsewhere", () => {
  const sketch = full();
  for (const ref of [{ of: "start", n: 0 }, { of: "goal", n: 0, part: "at" }, { of: "goal", n: 1, part: "port_mark" }, { of: "goal", n: 2, part: "ring", v: 2 }, { of: "refuge", n: 0 }, { of: "shape", n: 0, ring: 1, v: 0 }, { of: "shape", n: 1, ring: 0, v: 0 }]) {
    const out = moved(sketch, ref, [3, 4]);
    assert.deepEqual(placeOf(out, ref), [3, 4]);
    assert.deepEqual(moved(out, ref, placeOf(sketch, ref)), sketch);
  }
  const whole = moved(sketch, { of: "shape", n: 0 }, [1.5, 0.5]);
  assert.deepEqual(middle(whole.shapes[0].rings[0]), [1.5, 0.5]);
  assert.deepEqual(whole.shapes[0].rings[1][0], [1.2, 0.2]);
  assert.deepEqual(moved(sketch, { of: "goal", n: 9 }, [0, 0]), sketch);
});

test("corners come and go; a polygon of three goes as a whole, its hole before it", () => {
  const more = inserted(full(), { of: "shape", n: 0, ring: 0, v: 1 }, [0.5, 1]);
  assert.deepEqual(more.shapes[0].rings[0][2], [0.5, 1]);
  assert.deepEqual(removed(more, { of: "shape", n: 0, ring: 0, v: 2 }), full());
  assert.equal(removed(full(), { of: "shape", n: 0, ring: 1, v: 0 }).shapes[0].rings.length, 1);
  const three = removed(full(), { of: "shape", n: 0, ring: 0, v: 0 });
  assert.equal(removed(three, { of: "shape", n: 0, ring: 0, v: 0 }).shapes.length, 1);
  assert.equal(removed(full(), { of: "goal", n: 2, part: "ring", v: 0 }).goals[2].ring.length, 3);
  assert.equal(removed(full(), { of: "start", n: 0 }).start, null);
});

test("goals change places, keep their keys, and stay when there is no place to go to", () => {
  const out = reordered(full(), 0, 1);
  assert.deepEqual(out.goals.map((g) => g.kind), ["gate", "point", "box"]);
  assert.equal(out.goals[1].key, 0);
  assert.deepEqual(reordered(out, 1, -1), full());
  assert.deepEqual(reordered(full(), 0, -1), full());
  assert.equal(changed(full(), { of: "goal", n: 0 }, { rounding: "port" }).goals[0].rounding, "port");
  assert.equal(withGoal(full(), { kind: "point", at: [0, 0] }).goals.length, 4);
});

test("what is undone is as it was, and is done again", () => {
  const history = new History(empty()), one = withGoal(empty(), { kind: "point", at: [1, 1] });
  assert.equal(history.take(empty()), false);
  history.take(one);
  assert.ok(history.undo() && !history.undo());
  assert.deepEqual(history.now, empty());
  assert.ok(history.redo() && !history.redo());
  assert.deepEqual(history.now, one);
  history.undo();
  history.take({ ...empty(), laps: 2 });
  assert.equal(history.redo(), false);
});

test("a thing is the same one in another sketch, or none where it cannot be told", () => {
  const put = (lat, values) => ({ type: "polygon", zone: "exclusion", rings: [[[lat, 0], [lat, 1], [lat + 1, 1]]], ...values });
  const sketch = (revision, shapes, goals = []) => ({ ...empty(), revision, shapes, goals });
  const shape = (n, values) => ({ of: "shape", n, ...values });
  const before = sketch("a", [put(0, { of: "a.wkt", key: 0 }), put(2, { of: "f.wkt", key: 0, zone: "inclusion" }), put(4, { name: "Otter (north)" })]);
  const after = sketch("b", [put(0, { of: "a.wkt", key: 0 }), put(4, { of: "a.wkt", key: 1, name: "Otter north", radius_m: null }), put(2, { of: "f.wkt", key: 0, zone: "inclusion" })]);
  assert.deepEqual([0, 1, 2].map((n) => same(before, shape(n), after)?.n), [0, 2, 1]);
  assert.deepEqual(same(before, shape(2, { ring: 0, v: 1 }), after), shape(1, { ring: 0, v: 1 }));
  assert.equal(same(before, shape(2), sketch("b", after.shapes.slice(2))), null);
  assert.equal(same(before, null, after), null);
  // of two that lie alike the one with its name; where they have the same one, it cannot be told
  const twins = (name) => sketch("b", [put(0), put(4, { name: "Otter (north)" }), put(4, { name })]);
  assert.equal(same(before, shape(2), twins("Heron"))?.n, 1);
  assert.equal(same(sketch("a", [put(4), put(0)]), shape(0), sketch("b", [put(0), put(4), put(4)])), null);
  // moved between the two, in the same files: by its key; new: by its place in the list; with another count of corners as a whole
  assert.deepEqual(same(before, shape(1, { ring: 0, v: 1 }), moved(before, shape(1), [9, 9])), shape(1, { ring: 0, v: 1 }));
  assert.deepEqual(same(before, shape(2), moved(before, shape(2), [9, 9])), shape(2));
  assert.deepEqual(same(before, shape(2, { ring: 0, v: 1 }), inserted(before, shape(2, { ring: 0, v: 1 }), [9, 9])), shape(2));
  assert.equal(same(before, shape(2), moved(removed(before, shape(0)), shape(1), [9, 9])), null);
  assert.equal(same(before, shape(2), { ...moved(before, shape(2), [9, 9]), revision: "b" }), null);
  // a course may round one mark twice: its goals have an order
  const mark = { kind: "point", at: [1, 1] }, course = [mark, { kind: "point", at: [2, 2] }, mark];
  assert.deepEqual(same(sketch("a", [], course), { of: "goal", n: 2 }, sketch("b", [], course)), { of: "goal", n: 2 });
  assert.deepEqual(same(sketch("a", [], course), { of: "goal", n: 1 }, reordered(sketch("a", [], course), 1, -1)), { of: "goal", n: 0 });
  assert.equal(same(full(), { of: "start", n: 0 }, empty()), null);
});

test("within and near", () => {
  assert.ok(within(square, [0.5, 0.5]) && !within(square, [1.5, 0.5]));
  assert.equal(distanceTo([0.5, -1], [0, 0], [1, 0]), 1);
  assert.equal(distanceTo([2, 0], [0, 0], [1, 0]), 1);
  assert.equal(places(full()).length, 17);
});
