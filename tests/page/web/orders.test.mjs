// Orders on the page, with as much of a document as they touch: a chart that keeps what it is told, an answer that waits.
import assert from "node:assert/strict";
import { register } from "node:module";
import { test } from "node:test";

class Thing extends EventTarget {
  children = []; parent = null; open = false; textContent = ""; attributes = {}; classList = { toggle() {} };
  setAttribute(name, value) { this.attributes[name] = value; }
  removeAttribute(name) { delete this.attributes[name]; }
  getAttribute(name) { return this.attributes[name] ?? null; }
  append(...things) { for (const one of things) { if (one instanceof Thing) one.parent = this; this.children.push(one); } }
  replaceChildren(...things) { for (const one of this.children) if (one instanceof Thing) one.parent = null; this.children = []; this.append(...things); }
  get isConnected() { return this === page.dialog || this === page.orders || Boolean(this.parent?.isConnected); }
  find(wanted) { return wanted(this) ? this : this.children.filter((c) => c instanceof Thing).map((c) => c.find(wanted)).find(Boolean); }
  show() { this.open = true; }
  showModal() { assert.ok(!this.open, "InvalidStateError"); this.open = true; }   // as browsers do
  close() { this.open = false; this.dispatchEvent(new Event("close")); }
  click() { this.dispatchEvent(new Event("click")); }
  focus() {}
}
const page = { dialog: new Thing(), orders: new Thing() };
globalThis.document = { getElementById: (id) => page[id] ?? null, createElement: () => new Thing() };
globalThis.sessionStorage = { getItem: () => "a token", setItem() {}, removeItem() {} };
globalThis.charted = [];
const map = "data:text/javascript,export const showPreview=(p)=>charted.push(p);export const pick=()=>{};export const onGlobe=()=>null;";
register("data:text/javascript," + encodeURIComponent(
  `export const resolve = (name, context, next) => name === "./map.js" ? { url: ${JSON.stringify(map)}, shortCircuit: true } : next(name, context);`));
const orders = await import("../../../companion/page/web/orders.js");

const settled = () => new Promise((resolve) => setImmediate(resolve));
const button = (words) => page.dialog.find((t) => t.children[0] === words);
const plan = (length_m) => ({ status: 200, json: async () => ({ error: null, way_en_m: [[0, 0], [length_m, 0]], risks: [0], length_m, time_s: 60, tacks: 0, gybes: 0 }) });

/** Ask for the way home; return what answers it. */
async function home() {
  let answer;
  globalThis.fetch = () => new Promise((resolve) => { answer = resolve; });
  page.orders.find((t) => t.attributes["data-verb"] === "home").click();
  await settled();
  return answer;
}

test("a plan that comes after it was cancelled is not shown, nor is it that of the next order", async () => {
  orders.build(["home"]);
  (await home())(plan(100));
  await settled();
  assert.deepEqual(charted.pop().way, [[0, 0], [100, 0]]);
  button("Cancel").click();
  assert.deepEqual(charted, [null]);

  const late = await home();
  button("Cancel").click();
  late(plan(200));
  await settled();
  assert.deepEqual(charted, [null, null]);

  const left = await home();
  button("Cancel").click();
  await home();
  left(plan(300));
  await settled();
  assert.deepEqual(charted, [null, null, null]);
  assert.equal(button("Give the order").attributes.disabled, "");
});

test("what is asked for while a plan waits to be confirmed takes its place", async () => {
  orders.build(["home", "hold"]);
  (await home())(plan(100));
  await settled();
  page.orders.find((t) => t.attributes["data-verb"] === "hold").click();
  await settled();
  assert.equal(charted.pop(), null);   // the way home is no longer on the chart
  assert.ok(page.dialog.open);
  assert.ok(page.dialog.find((t) => t.children[0] === "Hold here"));
  button("Cancel").click();
});
