// Elements. Words of others (vessels' names, autopilots' texts) go in as text, never as markup.

const SVG = "http://www.w3.org/2000/svg";

/** @typedef {Record<string, string | number | boolean | null | undefined>} Attributes */

/** @param {Element} element @param {Attributes} attributes */
export function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) element.removeAttribute(name);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
}

/**
 * An element of the page.
 * @param {string} name @param {Attributes} [attributes] @param {...(Node | string)} children
 */
export function el(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  set(element, attributes);
  element.append(...children);
  return element;
}

/**
 * An element of a picture.
 * @param {string} name @param {Attributes} [attributes] @param {...(Node | string)} children
 */
export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, name);
  set(element, attributes);
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
 * @param {string} caption @param {string[]} head @param {(string | Node)[][]} rows
 */
export function table(caption, head, rows) {
  return el("table", {}, el("caption", {}, caption),
    el("thead", {}, el("tr", {}, ...head.map((text) => el("th", { scope: "col" }, text)))),
    el("tbody", {}, ...rows.length === 0 ? [el("tr", {}, el("th", { scope: "row", colspan: String(head.length) }, "none"))] : rows.map((row) => el("tr", {}, ...row.map((cell, n) =>
      n === 0 ? el("th", { scope: "row" }, cell) : el("td", {}, cell))))));
}
