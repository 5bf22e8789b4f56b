// What is drawn again is written where it is another one, and nowhere else.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";

let writes = [];
class Node {
  constructor(name) { Object.assign(this, { name, attributes: {}, nodes: [], above: null, text: "" }); }
  get firstChild() { return this.nodes[0] ?? null; }
  get textContent() { return this.text; }
  set textContent(text) { this.text = text; writes.push(`${this.name}=${text}`); }
  append(...more) { for (const one of more) { one.above = this; this.nodes.push(one); writes.push(`+${one.name}`); } }
  replaceChildren(...all) { this.nodes = []; this.append(...all); writes.push("all"); }
  remove() { this.above.nodes.splice(this.above.nodes.indexOf(this), 1); writes.push(`-${this.name}`); }
  replaceWith(one) { this.above.nodes[this.above.nodes.indexOf(this)] = one; one.above = this.above; writes.push(`${this.name}>${one.name}`); }
  getAttribute(name) { return this.attributes[name] ?? null; }
  setAttribute(name, text) { this.attributes[name] = text; writes.push(`${name}=${text}`); }
  removeAttribute(name) { delete this.attributes[name]; writes.push(`-${name}`); }
}
globalThis.document = { createElement: (name) => new Node(name), createElementNS: (space, name) => Object.assign(new Node(name), { namespaceURI: space }),
  createTextNode: (text) => Object.assign(new Node("text"), { text }) };
const { renew, set, sketch, slots } = await import("../../../companion/page/web/dom.js");

const told = (node) => node.name === "text" ? node.text : [node.name, node.attributes, ...node.nodes.map(told)];
/** A parent with what is sketched, and what is written when it is sketched otherwise. */
function again(first, second) {
  const parent = new Node("parent");
  renew(parent, first);
  writes = [];
  renew(parent, second);
  return { writes, is: parent.nodes.map(told) };
}
beforeEach(() => { writes = []; });

const row = (name, far) => sketch("tr", { class: "row", hidden: false }, sketch("th", {}, name), sketch("td", { title: far > 9 ? "far" : null }, `${far} m`));

test("what is so already is not written", () => {
  const { writes, is } = again([row("a", 5), "words"], [row("a", 5), "words"]);
  assert.deepEqual(writes, []);
  assert.deepEqual(is, [["tr", { class: "row" }, ["th", {}, "a"], ["td", {}, "5 m"]], "words"]);
});

test("of what is otherwise only that is written", () => {
  assert.deepEqual(again([row("a", 5)], [row("a", 6)]).writes, ["text=6 m"]);
  assert.deepEqual(again([row("a", 5)], [row("a", 10)]).writes, ["title=far", "text=10 m"]);
  const { writes, is } = again([sketch("g", { x: 1, y: 2 })], [sketch("g", { x: 1, z: 0 })]);
  assert.deepEqual(writes, ["-y", "z=0"]);
  assert.deepEqual(is, [["g", { x: "1", z: "0" }]]);
});

test("what there is more or less of comes and goes at its end, and what is another thing takes the place", () => {
  assert.deepEqual(again([row("a", 5)], [row("a", 5), sketch("hr")]).writes, ["+hr"]);
  assert.deepEqual(again([row("a", 5), "x", sketch("hr")], [row("a", 5)]), { writes: ["-text", "-hr"], is: [["tr", { class: "row" }, ["th", {}, "a"], ["td", {}, "5 m"]]] });
  assert.deepEqual(again(["a", sketch("b")], [sketch("b"), "a"]).is, [["b", {}], "a"]);
  assert.deepEqual(again([sketch("p", {}, "a", sketch("b"))], [sketch("p")]).is, [["p", {}]]);
  assert.deepEqual(again([sketch("p")], [sketch("p", {}, sketch("b", {}, "c"))]).is, [["p", {}, ["b", {}, "c"]]]);
});

test("an element of a picture is one, wherever the picture is", () => {
  const parent = new Node("div");
  renew(parent, [sketch("svg", {}, sketch("g", {}, sketch("path"))), sketch("p")]);
  const space = "http://www.w3.org/2000/svg", [picture, p] = parent.nodes;
  assert.deepEqual([picture, picture.nodes[0], picture.nodes[0].nodes[0], p].map((one) => one.namespaceURI), [space, space, space, undefined]);
});

test("what stood in a parent before is gone", () => {
  const parent = new Node("parent");
  parent.append(new Node("old"));
  renew(parent, [sketch("new")]);
  assert.deepEqual(parent.nodes.map((one) => one.name), ["new"]);
});

test("an attribute that is set as it is already is not written", () => {
  const node = new Node("g");
  set(node, { x: 1, is: true, not: false });
  assert.deepEqual(writes, ["x=1", "is="]);
  set(node, { x: "1", is: true, not: null });
  assert.equal(writes.length, 2);
  set(node, { x: 2, is: false });
  assert.deepEqual(writes.slice(2), ["x=2", "-is"]);
});

test("of what comes at one end and goes at the other each keeps its place", () => {
  const dots = (from, to) => slots(new Map(Array.from({ length: to - from }, (_, n) => [from + n, sketch("circle", { cx: from + n })])));
  assert.deepEqual(dots(0, 0), []);
  const { writes, is } = again(dots(100, 160), dots(102, 163));
  assert.deepEqual(writes, ["cx=160", "cx=161", "cx=162", "-cx", "-cx"]);
  assert.deepEqual(is.map(([, { cx }]) => cx).filter((cx) => cx !== undefined).map(Number).sort((a, b) => a - b), Array.from({ length: 61 }, (_, n) => 102 + n));
});
