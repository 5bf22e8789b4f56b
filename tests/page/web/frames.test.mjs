// What a frame of the editor costs over a harbour's chart: nothing for a corner that lies where it lay, but a shape's first.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { edit, element, pointer, written } from "./stage.mjs";

const CHART = new URL("../../../sitl/missions/rhode-river-chart.geojson", import.meta.url);
const FRAME = { lat: 38.8745, lon: -76.519, lat_m: 111_020, lon_m: 86_750 };
let corners = 0;
/** A list that counts how often its corners are asked for. */
const counted = (ring) => new Proxy(ring, { get(list, key) { if (typeof key === "string" && /^\d/.test(key)) corners += 1; return list[key]; } });
const shapes = JSON.parse(readFileSync(CHART, "utf8")).features.map(({ geometry: { type, coordinates }, properties }) => ({
  type: type === "Point" ? "point" : "polygon", zone: "exclusion", name: properties.name, of: "chart.geojson",
  rings: (type === "Point" ? [[coordinates]] : coordinates).map((ring) => counted(ring.map(([lon, lat]) => [lat, lon]))),
}));
const sketch = { revision: "r", name: "m", start: { at: [38.8745, -76.519], heading_deg: 330 }, goals: [{ kind: "point", at: [38.8872, -76.5355], radius_m: 15, key: 0 }], refuges: [], shapes, margin_m: 12, margin_floor_m: 6, point_radius_m: 10, end: "loiter", laps: 1 };
const mission = { version: "", file: "m.toml", folder: "/", is_new: false, called: "m", disk: "d", sketch, frame: FRAME, is_placed: true, files: [], locked: [], wind: { from_deg: 200, speed_mps: 5 }, formats: [], kept: [], said: "", charts: [], waters: [], free_m: null, drying: [], shown_unix_s: 0, passage: null, passage_said: "" };
const grown = shapes.filter((shape) => shape.type === "polygon").map((shape) => shape.rings);
const editing = await edit({ "/api/mission": mission, "/api/check": { findings: [], is_in_order: true, grown } });
await new Promise((done) => setTimeout(done, 400));   // until it is checked: what the margin adds is drawn

/** What a frame costs: corners asked for, characters written, elements made, and its time, which is told only. */
function cost(words, frame, count = 60) {
  for (let n = 0; n < 5; n++) frame(n);
  const before = { ...written }, took = [];
  corners = 0;
  for (let n = 0; n < count; n++) { const began = performance.now(); frame(n); took.push(performance.now() - began); }
  const told = { corners: corners / count, characters: (written.characters - before.characters) / count, elements: (written.elements - before.elements) / count };
  console.log(`${words}: ${took.sort((a, b) => a - b)[count >> 1]?.toFixed(3)} ms, ${JSON.stringify(told)}`);
  return told;
}

const { map } = editing, { en } = map.middle();
const pan = (n) => map.centre([en[0] + 100 * Math.sin(n / 12), en[1] + 100 * Math.sin(n / 19)]);

test("the harbour is drawn", () => {
  assert.ok(shapes.reduce((sum, shape) => sum + shape.rings.flat().length, 0) > 2000);
  for (const name of ["grown", "obstacles"]) assert.ok(drawn(name).length > 20_000, name);
});

/** @param {string} name of a layer */
function drawn(name) {
  const layers = element("map").children[1].children;
  return layers.find((layer) => layer.attributes.class === name).children.map((shape) => shape.attributes.d).join("");
}

test("a frame in which the water moves asks for one corner of a shape at the most and writes little", () => {
  for (const [words, frame] of [["pan", pan], ["zoom", (n) => map.zoom(n % 2 ? 1.02 : 1 / 1.02)]]) {
    const { corners, characters, elements } = cost(words, frame);
    assert.ok(corners <= shapes.length, words);
    assert.ok(characters < 6000 && elements < 80, words);
  }
});

test("nor does one in which a mark is dragged, and a corner that is dragged is drawn where it is", () => {
  map.centre(en);
  const before = drawn("obstacles"), [x, y] = editing.screen(sketch.goals[0].at);
  pointer("pointerdown", [x, y]);
  const { corners, characters } = cost("drag of a mark", (n) => pointer("pointermove", [x + 20 * Math.sin(n / 9), y + 10]));
  pointer("pointerup", [x + 10, y + 10]);
  assert.ok(corners <= shapes.length);
  assert.ok(characters < 6000);
  assert.notDeepEqual(editing.now().goals[0].at, sketch.goals[0].at);
  assert.equal(drawn("obstacles"), before);
  const rock = shapes.findIndex((shape) => shape.type === "point"), [p, q] = editing.screen(shapes[rock].rings[0][0]);
  pointer("pointerdown", [p, q]);
  pointer("pointermove", [p + 30, q]);
  const there = drawn("obstacles");
  assert.notEqual(there, before);
  assert.equal(there.length, before.length, "the others are where they were");
  pointer("pointermove", [p, q]);
  pointer("pointerup", [p, q]);
});

test("a track is drawn again when it has grown, and not because the water moves", () => {
  const east_m = counted(Array.from({ length: 20_000 }, (_, n) => n % 700)), north_m = Array.from({ length: 20_000 }, (_, n) => n / 30);
  const past = { t_s: north_m.map((_, n) => n), east_m, north_m, starboard: north_m.map((_, n) => n % 400 < 200), heading_deg: north_m.map(() => 0) };
  const tail = () => element("map").children[1].children.find((layer) => layer.attributes.class === "track").children.at(-1)?.attributes.d;
  map.show(null, null, past);
  const before = tail(), { corners, characters } = cost("pan over a track of 20,000 places", pan);
  assert.ok(corners < 50, "of the shapes and of the end of the track");
  assert.ok(characters < 6000);
  past.t_s.push(20_000); east_m.push(9); north_m.push(700); past.starboard.push(true); past.heading_deg.push(0);
  const wrote = written.characters;
  map.again();
  assert.notEqual(tail(), before);
  assert.match(tail(), /9\.0 700\.0$/);
  assert.ok(written.characters - wrote < 10_000, "what is new, and no more");
  const layer = () => element("map").children[1].children.find((one) => one.attributes.class === "track").children.map((one) => one.attributes);
  assert.equal(layer().filter((one) => one.class === "port").length + layer().filter((one) => one.class === "starboard").length, layer().length);
  assert.equal(new Set(layer().flatMap(({ d }) => d.slice(1).split("L"))).size, new Set(east_m.map((e, n) => `${e.toFixed(1)} ${north_m[n].toFixed(1)}`)).size, "every place, joined");
  map.show({ ...past, t_s: 900, boat: {}, goals: [], refuges: [], predicted: [], vessels: [], orders: {} }, null, past);
  const come = element("map").children[1].children.find((one) => one.attributes.class === "tocome").children.at(-1)?.attributes.d;
  assert.match(come, /9\.0 700\.0$/, "what is to come, to its end");
  assert.match(tail(), /200\.0 30\.0$/, "where she is");
  map.show(null, null, past);
  for (const column of Object.values(past)) column.splice(0, 1);
  past.t_s.push(20_001); east_m.push(11); north_m.push(701); past.starboard.push(true); past.heading_deg.push(0);
  map.again();
  assert.match(tail(), /11\.0 701\.0$/, "as long as it was, and later");
  const other = { name: "b", past: { ...past, t_s: [0], east_m: [5], north_m: [6], heading_deg: [0] }, off: 0, count: 1 };
  const beside = () => element("map").children[1].children.find((layer) => layer.attributes.class === "other").children.length;
  map.show(null, null, past, other);
  assert.equal(beside(), 1);
  map.show(null, null, null);
  assert.equal(tail(), undefined);
  assert.equal(beside(), 0);
});

test("what is written on the water lies where it lay while the water moves, and is written anew where it is nearer", () => {
  const area = { name: "", origin_lat_deg: 0, origin_lon_deg: 0, lat_m: 111_000, lon_m: 111_000, hash: "", obstacles: [], names: [], grown: [], limits: [], drying: [], margin_m: 1 };
  const vessels = Array.from({ length: 40 }, (_, n) => ({ name: `ship ${n}`, at_en_m: [10 * n, 5 * n], heading_deg: 20, course_deg: 20, alarm: "none", cpa_s: 20 + n, cpa_m: 9, cpa_en_m: [n, n], own_cpa_en_m: [0, n], length_m: 9, beam_m: 3 }));
  const view = { t_s: 0, boat: { at_en_m: [0, 0], heading_deg: 10, cog_deg: 12, sog_mps: 2 }, goals: [{ name: "buoy", kind: "point", at_en_m: [90, 40], radius_m: 9 }], refuges: [], home: null, safe_end: null, orders: {}, predicted: [], plan: null, vessels };
  map.show(view, area, null);
  map.orient("north");
  map.centre([0, 0]);
  const signs = () => element("map").children.find((layer) => layer.attributes.class === "signs"), of = (name) => signs().children.find((layer) => layer.attributes.class === name);
  assert.equal(of("vessels").children.length, 40 * 7);
  const told = cost("pan among 40 ships", (n) => map.centre([10 * Math.sin(n / 12), 10 * Math.sin(n / 19)]));
  assert.ok(told.elements < 30 && told.characters < 3500, "the mission's own alone");
  const ship = () => of("vessels").children[4].attributes.transform, at = ship(), { scale } = map.middle();
  map.centre([30, -20]);
  assert.equal(ship(), at);
  const [x, y] = signs().attributes.transform.match(/-?[\d.]+/g).map(Number), [sx, sy] = at.match(/-?[\d.]+/g).map(Number);
  assert.ok(Math.hypot(x + sx - (390 / 2 - 30 * scale), y + sy - (700 / 2 - 20 * scale)) < 1e-6, "where the camera sees it");
  map.zoom(2);
  assert.notEqual(ship(), at);
  map.show(null, null, null);
});
