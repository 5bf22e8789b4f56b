// What time a line of the log carries.
import assert from "node:assert/strict";
import { test } from "node:test";

class Element {
  constructor() { Object.assign(this, { children: [], checked: true, textContent: "" }); }
  append(...more) { this.children.push(...more); }
  replaceChildren(...all) { this.children = all; drawings += 1; }
  setAttribute() {}
}
let drawings = 0;
const named = new Map();
const element = (id) => named.get(id) ?? named.set(id, new Element()).get(id);
globalThis.document = { getElementById: element, createElement: () => new Element(), createTextNode: (textContent) => ({ textContent }) };
const log = await import("../../../companion/page/web/log.js");

const event = (number, t_s, unix_s, title) => ({ number, t_s, unix_s, kind: "phase", level: "notice", title, text: "", facts: [] });
const text = (one) => (typeof one === "string" ? one : one.children?.length ? one.children.map(text).join(" ") : one.textContent);
const shown = () => element("log").children.map(text);

test("a line that was said before the autopilot's clock was known has its time by that clock once it is", () => {
  log.add([event(1, 0, 31_858, "waiting")]);    // by the computer's clock: 08:50:58
  log.show(1, 31_859);
  assert.deepEqual(shown(), ["08:50:58 waiting"]);
  log.add([event(2, 2, 31_818, "mode MANUAL")]);
  log.show(2, 31_818);
  assert.deepEqual(shown(), ["08:50:18 mode MANUAL", "08:50:16 waiting"]);
  const before = drawings;
  for (const off of [0, 0.4, -0.4, 0]) log.show(3, 31_819 + off);
  assert.equal(drawings, before, "the same clock draws nothing anew");
  log.show(4);
  assert.deepEqual(shown(), ["+2 s mode MANUAL", "+0 s waiting"], "of a voyage whose date is not known");
});
