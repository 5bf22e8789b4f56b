// The link of the live page: a companion that has ended is asked for again, for the next voyage's answers there.
import assert from "node:assert/strict";
import { mock, test } from "node:test";

const sources = [];
globalThis.EventSource = class extends EventTarget {
  static CLOSED = 2;
  constructor() { super(); this.isClosed = false; sources.push(this); }
  close() { this.isClosed = true; }
};
globalThis.document = Object.assign(new EventTarget(), { hidden: false });
globalThis.addEventListener = () => {};
const { follow } = await import("../../../companion/page/web/feed.js");

test("after the end the page listens for who comes next", () => {
  mock.timers.enable({ apis: ["setTimeout", "setInterval"] });
  const heard = [];
  follow({ view() {}, log() {}, link: (isUp) => heard.push(isUp), over: () => heard.push("over") });
  sources[0].dispatchEvent(new Event("over"));
  assert.ok(sources[0].isClosed);
  assert.deepEqual(heard, ["over"]);
  mock.timers.tick(5000);
  assert.equal(sources.length, 2);
  sources[1].dispatchEvent(new Event("open"));
  assert.deepEqual(heard, ["over", true]);
  mock.timers.reset();
});
