// A page without a browser: as much of a document as the editor asks for, which counts what is written into it.
import { copyFileSync, mkdtempSync, readdirSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const ROOT = new URL("../../..", import.meta.url).pathname;
const PHONE = { left: 0, top: 0, width: 390, height: 700 };
/** What was written: elements made, characters of attributes. */
export const written = { elements: 0, characters: 0 };

class Element {
  constructor() {
    Object.assign(this, { attributes: {}, children: [], dataset: {}, style: {}, options: [], heard: {}, value: "", textContent: "", hidden: false, checked: false });
    this.classList = { add() {}, remove() {}, toggle() {} };
    written.elements += 1;
  }
  append(...more) { for (const one of more) if (one instanceof Element) one.above = this; this.children.push(...more); }
  prepend(...more) { this.children.unshift(...more); }
  replaceChildren(...all) { this.children = all; }
  setAttribute(name, text) { this.attributes[name] = text; written.characters += text.length; }
  getAttribute(name) { return this.attributes[name] ?? null; }
  removeAttribute(name) { delete this.attributes[name]; }
  addEventListener(name, hear) { (this.heard[name] ??= []).push(hear); }
  querySelector() { return this.only ??= new Element(); }
  querySelectorAll() { return []; }
  getBoundingClientRect() { return PHONE; }
  get parentElement() { return this.above ??= new Element(); }
  remove() { const all = this.parentElement.children, n = all.indexOf(this); if (n >= 0) all.splice(n, 1); }
  replaceWith(one) { const all = this.parentElement.children; all[all.indexOf(this)] = one; one.above = this.parentElement; }
  setPointerCapture() {}
  showModal() {}
  close() {}
}

const named = new Map();
/** @param {string} id */
export function element(id) {
  if (!named.has(id)) named.set(id, new Element());
  return named.get(id);
}

/** A finger or a mouse on the chart. @param {string} type @param {[number, number]} at px */
export function pointer(type, [clientX, clientY]) {
  for (const hear of element("map").heard[type]) hear({ type, clientX, clientY, pointerId: 1, button: 0, pointerType: "mouse" });
}

/** Start the editor on what the program says; ``answers`` by path. @param {Record<string, unknown>} answers */
export async function edit(answers) {
  const kept = { getItem: () => null, setItem() {} }, hears = { addEventListener() {} };
  const document = { ...hears, body: new Element(), documentElement: new Element(), getElementById: element, createElement: () => new Element(), createElementNS: () => new Element(), createTextNode: (textContent) => Object.assign(new Element(), { textContent }), querySelector: () => null, querySelectorAll: () => [] };
  Object.assign(globalThis, {
    window: globalThis, document, ...hears, location: { hash: "#token", pathname: "/" }, history: { replaceState() {} }, sessionStorage: kept, localStorage: kept,
    ResizeObserver: class { observe() {} }, MutationObserver: class { observe() {} }, matchMedia: () => ({ matches: false }), requestAnimationFrame() {},
    fetch: async (path) => ({ ok: path in answers, status: path in answers ? 200 : 404, json: async () => answers[path] ?? {} }),
  });
  const folder = mkdtempSync(join(tmpdir(), "stage-"));
  for (const web of ["companion/page/web", "companion/editor/web"]) for (const name of readdirSync(join(ROOT, web))) if (name.endsWith(".js")) copyFileSync(join(ROOT, web, name), join(folder, name));
  writeFileSync(join(folder, "package.json"), '{"type": "module"}');
  await import(join(folder, "editor.js"));
  for (let n = 0; n < 500 && document.body.dataset.ready !== "1"; n++) await new Promise((done) => setTimeout(done, 10));
  return globalThis.editing;
}
