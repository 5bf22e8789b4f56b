// Elements. Words of others (vessels' names, autopilots' texts) go in as text, never as markup.

const SVG = "http://www.w3.org/2000/svg";

/** @typedef {Record<string, string | number | boolean | null | undefined>} Attributes */

/** @typedef {Attributes[string]} Value */
/** @typedef {{name: string, attributes: Attributes, children: readonly (Sketch | string)[]}} Sketch  what an element is to be */

/** An attribute's text, null: it has none. @param {Value} value */
function written(value) {
  return value === null || value === undefined || value === false ? null : value === true ? "" : String(value);
}

/** @param {Element} element @param {string} name @param {Value} value */
function put(element, name, value) {
  const text = written(value);
  if (text === null) element.removeAttribute(name); else element.setAttribute(name, text);
}

/** Set attributes; one that is so already is not written. @param {Element} element @param {Attributes} attributes */
export function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) if (element.getAttribute(name) !== written(value)) put(element, name, value);
}

/** What an element is to be, for ``renew``. @param {string} name @param {Attributes} [attributes] @param {...(Sketch | string)} children
 * @returns {Sketch} */
export function sketch(name, attributes = {}, ...children) {
  return { name, attributes, children };
}

const EMPTY = sketch("circle");

/** Children by their numbers, each in a place that it keeps while others come and go: the places are taken in turn.
 * @param {Map<number, Sketch>} numbered circles, the numbers near each other @returns {Sketch[]} */
export function slots(numbered) {
  const numbers = [...numbered.keys()], span = numbers.length ? Math.max(...numbers) - Math.min(...numbers) + 1 : 0;
  const out = Array.from({ length: 64 * Math.ceil(span / 64) }, () => EMPTY);
  for (const [n, one] of numbered) out[n % out.length] = one;
  return out;
}

/** @type {WeakMap<Element, {children: readonly (Sketch | string)[], nodes: (Element | Text)[]}>} what ``renew`` has made of a parent */
const made = new WeakMap();

/** Give a parent what is sketched, and touch nothing that is so already: a browser styles, lays out and paints anew what is written,
 * were it the same. The parent's children are those alone. @param {Element} parent @param {readonly (Sketch | string)[]} children */
export function renew(parent, children) {
  const known = made.get(parent), nodes = known?.nodes ?? [], before = known?.children ?? [];
  if (known === undefined && parent.firstChild) parent.replaceChildren();
  children.forEach((wanted, n) => {
    const was = before[n], node = nodes[n];
    if (was === undefined || node === undefined) parent.append(nodes[n] = create(parent, wanted));
    else if (typeof was === "string" && typeof wanted === "string") { if (was !== wanted) node.textContent = wanted; }
    else if (typeof was === "string" || typeof wanted === "string" || was.name !== wanted.name) node.replaceWith(nodes[n] = create(parent, wanted));
    else change(/** @type {Element} */ (node), was, wanted);
  });
  for (const node of nodes.splice(children.length)) node.remove();
  made.set(parent, { children, nodes });
}

/** @param {Element} parent @param {Sketch | string} wanted */
function create(parent, wanted) {
  if (typeof wanted === "string") return document.createTextNode(wanted);
  const isPicture = wanted.name === "svg" || parent.namespaceURI === SVG;
  const element = isPicture ? document.createElementNS(SVG, wanted.name) : document.createElement(wanted.name);
  for (const name in wanted.attributes) put(element, name, wanted.attributes[name]);
  if (wanted.children.length > 0) renew(element, wanted.children);
  return element;
}

/** @param {Element} element @param {Sketch} was @param {Sketch} wanted */
function change(element, was, wanted) {
  if (was === wanted) return;
  for (const name in was.attributes) if (!(name in wanted.attributes)) element.removeAttribute(name);
  for (const name in wanted.attributes) if (wanted.attributes[name] !== was.attributes[name]) put(element, name, wanted.attributes[name]);
  if (was.children.length > 0 || wanted.children.length > 0) renew(element, wanted.children);
}

/**
 * An element of the page.
 * @param {string} name @param {Attributes} [attributes] @param {...(Node | string)} children
 */
export function el(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const key in attributes) put(element, key, attributes[key]);
  element.append(...children);
  return element;
}

/**
 * An element of a picture.
 * @param {string} name @param {Attributes} [attributes] @param {...(Node | string)} children
 */
export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, name);
  for (const key in attributes) put(element, key, attributes[key]);
  element.append(...children);
  return element;
}

/** The element with an id; it is there: the page is ours. @param {string} id @returns {HTMLElement} */
export function get(id) {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`the page has no #${id}`);
  return element;
}

/** @param {string} id @returns {SVGSVGElement} */
export function picture(id) {
  return /** @type {SVGSVGElement} */ (/** @type {unknown} */ (get(id)));
}

/** Set text where it has changed, for a screen reader hears every change. @param {string} id @param {string} text */
export function say(id, text) {
  const element = get(id);
  if (element.textContent !== text) element.textContent = text;
}

/**
 * A table with a caption, for eyes and for screen readers.
 * @param {string} caption @param {string[]} head @param {(string | Sketch)[][]} rows
 */
export function table(caption, head, rows) {
  return sketch("table", {}, sketch("caption", {}, caption),
    sketch("thead", {}, sketch("tr", {}, ...head.map((text) => sketch("th", { scope: "col" }, text)))),
    sketch("tbody", {}, ...rows.length === 0 ? [sketch("tr", {}, sketch("th", { scope: "row", colspan: String(head.length) }, "none"))] : rows.map((row) => sketch("tr", {}, ...row.map((cell, n) =>
      n === 0 ? sketch("th", { scope: "row" }, cell) : sketch("td", {}, cell))))));
}
