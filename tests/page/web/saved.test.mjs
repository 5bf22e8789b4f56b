// What is chosen stays chosen when the program gives the sketch back in the order of its files.
import assert from "node:assert/strict";
import { test } from "node:test";

import { edit, element, pointer } from "./stage.mjs";

const ring = (lat) => [[lat, 0], [lat, 0.001], [lat + 0.001, 0.001]];
const shape = (lat, values = {}) => ({ type: "polygon", zone: "exclusion", rings: [ring(lat)], name: "", radius_m: null, margin_m: null, ...values });
const rocks = [shape(0.01, { of: "kea.wkt", key: 0 }), shape(0.02, { of: "kea.wkt", key: 1 })], fence = shape(0.03, { zone: "inclusion", of: "shore.wkt", key: 0 });
const sketch = { revision: "r", name: "m", start: { at: [0, 0], heading_deg: 0 }, goals: [{ kind: "point", at: [0.001, 0], radius_m: 10, key: 0 }], refuges: [], shapes: [...rocks, fence], margin_m: 12, margin_floor_m: 6, point_radius_m: 10, end: "loiter", laps: 1 };
const mission = { version: "", file: "m.toml", folder: "/", is_new: false, called: "m", disk: "d", sketch, frame: { lat: 0, lon: 0, lat_m: 111_000, lon_m: 111_000 }, is_placed: true, files: [], locked: [], wind: { from_deg: 200, speed_mps: 5 }, formats: [], kept: [], said: "saved", charts: [], waters: [], free_m: null, drying: [], shown_unix_s: 0, passage: null, passage_said: "" };
const answers = { "/api/mission": mission, "/api/check": { findings: [], is_in_order: true, grown: [] } };
const editing = await edit(answers);
const press = (one) => { for (const hear of one.heard.click) hear(); };
const pick = (n) => press(element("shapes").children[n].children[0]);
const chosen = () => element("shapes").children.flatMap((row, n) => (row.attributes.class === "thing chosen" ? [n] : []));
const pause = () => new Promise((done) => setTimeout(done, 20));

/** Draw a new obstacle. */
function draw() {
  press(element("tools").children.find((tool) => tool.attributes["data-tool"] === "obstacle"));
  for (const at of ring(0.04)) for (const type of ["pointerdown", "pointerup"]) pointer(type, editing.screen(at));
  press(element("done"));
}

test("what was drawn is what is chosen after it was saved: the program writes it before the fence", async () => {
  draw();
  assert.deepEqual(editing.selected(), { of: "shape", n: 3 });
  const made = editing.now().shapes[3];
  answers["/api/save"] = { ...mission, disk: "e", sketch: { ...sketch, revision: "e", shapes: [...rocks, { ...shape(0), rings: made.rings, of: "kea.wkt", key: 2 }, fence] } };
  press(element("save"));
  await pause();
  assert.deepEqual(editing.selected(), { of: "shape", n: 2 });
  assert.deepEqual(chosen(), [2]);
  press(element("undo"));   // back to the sketch before: it was not drawn yet
  assert.equal(editing.selected(), null);
});
