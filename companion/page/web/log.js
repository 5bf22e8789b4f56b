// The log of decisions, the newest first: what, why, by which numbers, and what was rejected for it.
import { el, get } from "./dom.js";
import { clock } from "./format.js";

/** @typedef {import("../../view/view").Event} LogEvent */

const MOST = 250;
const DECISIONS = new Set(["phase", "plan", "kept", "order", "answer", "mode"]);
const LOUD = new Set(["critical", "error", "warning", "notice"]);
/** @type {LogEvent[]} */
let events = [];
let shown = "";
/** Unix time of the voyage's time 0 [s]. @type {number | null} */
let began = null;
/** @type {((t_s: number) => void) | null} */
let jumps = null;

/** @param {LogEvent} event */
export function isDecision(event) {
  return DECISIONS.has(event.kind) || (event.kind === "said" && LOUD.has(event.level));
}

/** Take events; of numbers that are known already nothing is taken twice. @param {readonly LogEvent[]} more */
export function add(more) {
  const known = new Set(events.map((e) => e.number));
  events = [...events, ...more.filter((e) => !known.has(e.number))].sort((a, b) => a.number - b.number).slice(-4000);
}

export function clear() {
  events = [];
  shown = "";
}

export function all() {
  return events;
}

/** @param {(t_s: number) => void} jump */
export function onJump(jump) {
  jumps = jump;
}

/** Show what has happened up to a time, each line by the clock of now: what was said before the autopilot's was known too.
 * @param {number} t_s @param {number | null} [unix_s] of the same moment */
export function show(t_s, unix_s = null) {
  const everything = /** @type {HTMLInputElement} */ (get("everything")).checked;
  const wanted = events.filter((e) => e.t_s <= t_s + 0.05 && (everything || isDecision(e))).slice(-MOST);
  const zero = unix_s === null ? null : unix_s - t_s;
  if (zero === null || began === null || Math.abs(zero - began) >= 1) {    // a clock that is set is told by seconds
    if (zero !== began) shown = "";
    began = zero;
  }
  const key = `${everything} ${wanted[0]?.number} ${wanted[wanted.length - 1]?.number} ${wanted.length}`;
  if (key === shown) return;
  shown = key;
  get("log").replaceChildren(...wanted.reverse().map((event) => {
    const time = clock(began === null ? null : began + event.t_s, event.t_s);
    const head = [jumps === null ? el("time", {}, time) : button(time, event.t_s), el("strong", {}, event.title)];
    const facts = event.facts.map(([name, value]) => el("span", {}, el("i", {}, name), ` ${value}`));
    return el("li", { class: `${event.kind} ${event.level}` }, el("div", { class: "head" }, ...head), ...(event.text ? [el("p", {}, event.text)] : []), ...(facts.length ? [el("p", { class: "numbers" }, ...facts)] : []));
  }));
}

/** @param {string} words @param {number} t_s */
function button(words, t_s) {
  const out = el("button", { type: "button", "aria-label": `to ${words}` }, words);
  out.addEventListener("click", () => jumps?.(t_s));
  return out;
}
