// What the page says of its age.
import assert from "node:assert/strict";
import { test } from "node:test";

const named = new Map();
const element = (id) => named.get(id) ?? named.set(id, { textContent: "", hidden: false, dataset: {} }).get(id);
globalThis.document = { getElementById: element, body: { classList: { toggle: (name, is) => { element(name).textContent = String(is); } } } };
const { age } = await import("../../../companion/page/web/panel.js");

test("a companion that has ended is no boat that is not heard", () => {
  age({ age_s: 0.2 }, 13, false, true);
  assert.equal(element("stale").textContent, "The companion has ended. What is shown is 13 s old");
  assert.equal(element("stale").hidden, false);
  age({ age_s: 0.2 }, 0, false, true);
  assert.equal(element("stale").hidden, false);   // at once, not when its last view is old
  age({ age_s: 12 }, 0, false, false);
  assert.equal(element("stale").textContent, "Data 12 s old: the boat is not heard");
  age({ age_s: 0.2 }, 30, true, false);
  assert.equal(element("stale").textContent, "No link to the companion. What is shown is 30 s old");
  age({ age_s: 0.2 }, 0, false, false);
  assert.equal(element("stale").hidden, true);
});
