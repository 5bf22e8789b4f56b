// The tables beside the chart: every thing with its numbers, to be read, typed and put in order.
import { sign } from "./chart.js";
import { el, get } from "./dom.js";
import { called, changed, degrees, moved, placeOf, removed, reordered, toEn } from "./sketch.js";

/** @typedef {import("./sketch.js").Sketch} Sketch @typedef {import("./sketch.js").Ref} Ref @typedef {import("./sketch.js").Place} Place @typedef {import("./chart.js").Editor} Editor */
/** @typedef {{name: string, zone: string, why: string, shared_by: string[]}} AreaFile */

const MOST_CORNERS = 80;     // typed one by one
/** @type {Editor} */ let editor;
/** @type {AreaFile[]} */ let files = [];
/** @type {string[]} */ let others = [];

/** @param {Editor} owner */
export function build(owner) {
  editor = owner;
}

/** @param {AreaFile[]} list @param {string[]} kept */
export function about(list, kept) {
  files = list;
  others = kept;
}

/** Show the sketch. What is typed in stays in focus. */
export function show() {
  const focused = document.activeElement?.id ?? "";
  const sketch = editor.sketch();
  get("course").replaceChildren(
    ...(sketch.start ? [thing({ of: "start", n: 0 }, "boat")] : []), ...sketch.goals.map((goal, n) => thing({ of: "goal", n }, goal.kind)));
  if (!sketch.start && sketch.goals.length === 0) get("course").append(el("li", { class: "none" }, "Put the start and the marks on the chart."));
  get("refuges").replaceChildren(...sketch.refuges.map((_, n) => thing({ of: "refuge", n }, "refuge")));
  if (sketch.refuges.length === 0) get("refuges").append(el("li", { class: "none" }, "None: a place to wait in, for a battery that runs low, darkness, a leak."));
  get("shapes").replaceChildren(...sketch.shapes.map((shape, n) => thing({ of: "shape", n }, shape.zone === "inclusion" ? "fence" : shape.type)));
  if (sketch.shapes.length === 0) get("shapes").append(el("li", { class: "none" }, "Open water: nothing is kept clear of."));
  mission(sketch);
  if (focused) document.getElementById(focused)?.focus({ preventScroll: true });
}

/** @param {Ref} ref */
function id(ref) {
  return `${ref.of}-${ref.n}`;
}

/** @param {Ref} ref @param {string} kind */
function thing(ref, kind) {
  const sketch = editor.sketch(), selected = editor.selected();
  const isChosen = selected?.of === ref.of && selected.n === ref.n;
  const place = placeOf(sketch, ref);
  const head = el("button", { type: "button", class: "pick", id: `pick-${id(ref)}`, "aria-expanded": isChosen ? "true" : "false" },
    el("span", { class: "number" }, ref.of === "goal" ? String(ref.n + 1) : sign(ref.of === "shape" ? (kind === "fence" ? "fence" : kind === "polygon" ? "obstacle" : "rock") : ref.of)),
    el("span", { class: "what" }, called(sketch, ref)), el("span", { class: "kind" }, summary(ref, kind)));
  head.addEventListener("click", () => editor.select(isChosen ? null : ref));
  const row = el("li", { class: isChosen ? "thing chosen" : "thing", "data-thing": id(ref) }, head);
  if (isChosen && place) row.append(details(ref, kind));
  return row;
}

/** @param {Ref} ref @param {string} kind */
function summary(ref, kind) {
  const sketch = editor.sketch();
  if (ref.of === "start") return `heading ${sketch.start?.heading_deg ?? 0}°`;
  if (ref.of === "refuge") return `${sketch.refuges[ref.n]?.radius_m ?? 15} m`;
  if (ref.of === "goal") {
    const goal = sketch.goals[ref.n];
    if (goal?.kind === "point") return goal.rounding ? `leave to ${goal.rounding}` : `within ${goal.radius_m ?? 10} m`;
    if (goal?.kind === "gate") return goal.port_mark && goal.starboard_mark ? `gate, ${apart(goal.port_mark, goal.starboard_mark)} m wide` : "gate";
    if (goal?.kind === "field") return `by field ${goal.field ?? ""}`;
    if (goal?.kind === "box") return goal.for_s ? `box, for ${goal.for_s} s` : "box, until told to go on";
    return `search, ${goal?.swath_m ?? "?"} m swath`;
  }
  const shape = sketch.shapes[ref.n];
  if (kind === "polygon" || kind === "fence") return `${shape?.rings[0]?.length ?? 0} corners`;
  return kind === "circle" ? `${shape?.radius_m} m` : kind === "point" ? `${sketch.point_radius_m} m` : kind;
}

/** @param {Place} a @param {Place} b */
function apart(a, b) {
  const [p, q] = [toEn(editor.frame(), a), toEn(editor.frame(), b)];
  return Math.round(Math.hypot(p[0] - q[0], p[1] - q[1]));
}

/** @param {Ref} ref @param {string} kind */
function details(ref, kind) {
  const sketch = editor.sketch(), fields = el("div", { class: "fields" }), box = el("div", { class: "details" }, fields);
  if (ref.of === "goal") fields.append(words(ref, "name", "name", sketch.goals[ref.n]?.name ?? ""));
  if (ref.of === "refuge") fields.append(words(ref, "name", "name", sketch.refuges[ref.n]?.name ?? ""));
  if (ref.of === "shape") fields.append(words(ref, "name", "name", sketch.shapes[ref.n]?.name ?? ""));
  if (ref.of === "start") { fields.append(...position({ ...ref }), number(ref, "heading_deg", "heading", "°", sketch.start?.heading_deg ?? 0, 0, 360)); }
  if (ref.of === "refuge") fields.append(...position(ref), number(ref, "radius_m", "radius", "m", sketch.refuges[ref.n]?.radius_m ?? 15, 1, 5000));
  if (ref.of === "goal") ofGoal(ref, fields, box);
  if (ref.of === "shape") ofShape(ref, kind, fields, box);
  const tools = el("div", { class: "row" });
  if (ref.of === "goal") tools.append(button("Earlier", `earlier-${id(ref)}`, ref.n === 0, () => shift(ref, -1)), button("Later", `later-${id(ref)}`, ref.n + 1 >= sketch.goals.length, () => shift(ref, 1)));
  tools.append(button("Delete", `delete-${id(ref)}`, false, () => editor.commit(removed(editor.sketch(), { of: ref.of, n: ref.n }), null)));
  box.append(tools);
  return box;
}

/** @param {Ref} ref @param {number} by */
function shift(ref, by) {
  editor.commit(reordered(editor.sketch(), ref.n, by), { of: "goal", n: ref.n + by });
  document.getElementById(`${by < 0 ? "earlier" : "later"}-goal-${ref.n + by}`)?.focus();
}

/** @param {Ref} ref @param {HTMLElement} fields @param {HTMLElement} box */
function ofGoal(ref, fields, box) {
  const goal = editor.sketch().goals[ref.n];
  if (!goal) return;
  if (goal.kind === "point") {
    fields.append(...position({ ...ref, part: "at" }), number(ref, "radius_m", goal.rounding ? "room" : "reached within", "m", goal.radius_m ?? 10, 0.1, 5000),
      choice(ref, "rounding", "leave it to", goal.rounding ?? "", [["", "either side"], ["port", "port"], ["starboard", "starboard"]]));
  } else if (goal.kind === "field") {
    fields.append(...position({ ...ref, part: "at" }), number(ref, "radius_m", "there within", "m", goal.radius_m ?? 10, 0.1, 5000),
      number(ref, "for_s", "at the longest", "s", goal.for_s ?? null, 1, 1e7, undefined, "until told"));
    box.append(el("p", { class: "none" }, `She is steered by ${goal.field ?? ""}, and the mission on board leads here meanwhile. Its atoms, and what ends it, are in the file.`));
  } else if (goal.kind === "gate") {
    const swap = button("Sail through the other way", `swap-${id(ref)}`, false, () => editor.commit(changed(editor.sketch(), ref, { port_mark: goal.starboard_mark, starboard_mark: goal.port_mark }), ref));
    fields.append(...position({ ...ref, part: "port_mark" }, "port mark "), ...position({ ...ref, part: "starboard_mark" }, "starboard mark "),
      number(ref, "mark_radius_m", "keep clear of marks", "m", goal.mark_radius_m ?? 5, 0, 500), number(ref, "after_s", "start: not before", "s", goal.after_s ?? null, 1, 1e6));
    box.append(swap);
  } else {
    if (goal.kind === "box") fields.append(number(ref, "for_s", "stay for", "s", goal.for_s ?? null, 1, 1e7, undefined, "until told"));
    else fields.append(number(ref, "swath_m", "seen from the track, across", "m", goal.swath_m ?? 20, 4, 5000), number(ref, "coverage", "share to be seen", "", goal.coverage ?? 0.95, 0.01, 0.99));
    if (goal.polygon) box.append(el("p", { class: "none" }, `Its water is in ${goal.polygon}: shown by the check, not drawn here.`));
    else box.append(corners({ ...ref, part: "ring" }, goal.ring ?? []));
  }
}

/** @param {Ref} ref @param {string} kind @param {HTMLElement} fields @param {HTMLElement} box */
function ofShape(ref, kind, fields, box) {
  const shape = editor.sketch().shapes[ref.n];
  if (!shape) return;
  if (kind === "point" || kind === "circle") {
    fields.append(...position({ ...ref, ring: 0, v: 0 }), number(ref, "radius_m", "radius", "m", shape.radius_m ?? null, 0.1, 5000, (value) => ({ radius_m: value, type: value === null ? "point" : "circle" }), String(editor.sketch().point_radius_m)));
  }
  if (kind !== "fence") fields.append(number(ref, "margin_m", "own margin", "m", shape.margin_m ?? null, 0, 1000, undefined, String(editor.sketch().margin_m)));
  if (kind === "polygon" || kind === "fence" || kind === "line") shape.rings.forEach((ring, r) => box.append(corners({ ...ref, ring: r }, ring, r > 0 ? `hole ${r}` : "")));
  if (shape.of) box.append(el("p", { class: "none" }, `In ${shape.of}.`));
}

/** The corners of a polygon as a table. @param {Ref} ref @param {Place[]} ring @param {string} [title] */
function corners(ref, ring, title = "") {
  if (ring.length > MOST_CORNERS) return el("p", { class: "none" }, `${title} ${ring.length} corners: drag them on the chart.`);
  const rows = ring.map((_, v) => {
    const one = { ...ref, v }, cells = position(one, `corner ${v + 1} `, true);
    const bin = button("×", `without-${id(ref)}-${ref.ring ?? 0}-${v}`, ring.length <= 3, () => editor.commit(removed(editor.sketch(), one), { of: ref.of, n: ref.n }));
    bin.setAttribute("aria-label", `Delete corner ${v + 1}`);
    const isIt = editor.selected()?.v === v && (editor.selected()?.ring ?? 0) === (ref.ring ?? 0);
    return el("tr", { class: isIt ? "it" : "" }, el("th", { scope: "row" }, String(v + 1)), ...cells.map((cell) => el("td", {}, cell)), el("td", {}, bin));
  });
  return el("details", { open: editor.selected()?.v !== undefined }, el("summary", {}, `${title} ${ring.length} corners`),
    el("table", { class: "corners" }, el("thead", {}, el("tr", {}, ...["", "lat", "lon", ""].map((text) => el("th", { scope: "col" }, text)))), el("tbody", {}, ...rows)));
}

// ------------------------------------------------------------------------------------------------------ fields
/** @param {string} text @param {string} key @param {boolean} isOff @param {() => void} act */
function button(text, key, isOff, act) {
  const one = el("button", { type: "button", id: key, disabled: isOff }, text);
  one.addEventListener("click", act);
  return one;
}

/** @param {string} text @param {HTMLElement} input @param {string} [unit] */
function label(text, input, unit = "") {
  return el("label", {}, text, ...(unit ? [" ", el("span", { class: "unit" }, unit)] : []), input);
}

/** A field that is twice as wide. @param {string} text @param {HTMLElement} input */
function doubled(text, input) {
  const field = label(text, input);
  field.className = "double";
  return field;
}

/** @param {Ref} ref @param {string} prefix @param {boolean} [isBare] @returns {HTMLElement[]} */
function position(ref, prefix = "", isBare = false) {
  const place = placeOf(editor.sketch(), ref) ?? [0, 0];
  return /** @type {("lat" | "lon")[]} */ (["lat", "lon"]).map((which, n) => {
    const key = `${which}-${id(ref)}-${ref.part ?? ""}-${ref.ring ?? ""}-${ref.v ?? ""}`;
    const input = /** @type {HTMLInputElement} */ (el("input", { type: "text", inputmode: "decimal", class: "degrees", id: key, value: (place[n] ?? 0).toFixed(7), autocomplete: "off", "aria-label": isBare ? `${prefix}${which}` : null, title: "50.8203, or 50 49.218 N" }));
    input.addEventListener("change", () => {
      const value = degrees(input.value, which), now = placeOf(editor.sketch(), ref);
      if (!Number.isFinite(value) || now === null) { input.setCustomValidity("write degrees: 50.8203, or 50 49.218 N"); input.reportValidity(); return; }
      editor.commit(moved(editor.sketch(), ref, n === 0 ? [value, now[1]] : [now[0], value]), ref.part === "ring" || ref.v !== undefined ? ref : { of: ref.of, n: ref.n });
    });
    input.addEventListener("input", () => input.setCustomValidity(""));
    return isBare ? input : label(`${prefix}${which}`, input, "°");
  });
}

/** @param {Ref} ref @param {string} key @param {string} text @param {string} unit @param {number | null} value @param {number} low @param {number} high @param {(value: number | null) => Record<string, any>} [values] @param {string} [otherwise] what holds where nothing is typed */
function number(ref, key, text, unit, value, low, high, values, otherwise = "") {
  const input = /** @type {HTMLInputElement} */ (el("input", { type: "number", id: `${key}-${id(ref)}`, value: value ?? "", min: low, max: high, step: "any", placeholder: otherwise || null }));
  input.addEventListener("change", () => {
    const typed = input.value === "" ? null : Number(input.value);
    if (typed !== null && !(typed >= low && typed <= high)) return void input.reportValidity();
    editor.commit(changed(editor.sketch(), ref, values ? values(typed) : { [key]: typed }), editor.selected());
  });
  return label(text, input, unit);
}

/** @param {Ref} ref @param {string} key @param {string} text @param {string} value */
function words(ref, key, text, value) {
  const input = /** @type {HTMLInputElement} */ (el("input", { type: "text", id: `${key}-${id(ref)}`, value, maxlength: 200, autocomplete: "off" }));
  input.addEventListener("change", () => editor.commit(changed(editor.sketch(), ref, { [key]: input.value }), editor.selected()));
  const field = label(text, input);
  field.className = "wide";
  return field;
}

/** @param {Ref} ref @param {string} key @param {string} text @param {string} value @param {[string, string][]} options */
function choice(ref, key, text, value, options) {
  const select = /** @type {HTMLSelectElement} */ (el("select", { id: `${key}-${id(ref)}` }, ...options.map(([one, said]) => el("option", { value: one, selected: one === value }, said))));
  select.addEventListener("change", () => editor.commit(changed(editor.sketch(), ref, { [key]: select.value || null }), editor.selected()));
  return label(text, select);
}

/** @param {Sketch} sketch */
function mission(sketch) {
  const field = (/** @type {string} */ key, /** @type {string} */ text, /** @type {string} */ unit, /** @type {number} */ low, /** @type {number} */ high, /** @type {number} */ value) => {
    const input = /** @type {HTMLInputElement} */ (el("input", { type: "number", id: `mission-${key}`, value, min: low, max: high, step: key === "laps" ? 1 : "any" }));
    input.addEventListener("change", () => { const typed = Number(input.value); if (input.value !== "" && typed >= low && typed <= high) editor.commit({ ...editor.sketch(), [key]: typed }, editor.selected()); else input.reportValidity(); });
    return label(text, input, unit);
  };
  const name = /** @type {HTMLInputElement} */ (el("input", { type: "text", id: "mission-name", value: sketch.name ?? "", maxlength: 200, autocomplete: "off" }));
  name.addEventListener("change", () => editor.commit({ ...editor.sketch(), name: name.value || null }, editor.selected()));
  const named = label("name", name);
  named.className = "wide";
  const end = /** @type {HTMLSelectElement} */ (el("select", { id: "mission-end" }, el("option", { value: "loiter", selected: sketch.end === "loiter" }, "loiter at the last goal"), el("option", { value: "home", selected: sketch.end === "home" }, "sail home, loiter there")));
  end.addEventListener("change", () => editor.commit({ ...editor.sketch(), end: end.value === "home" ? "home" : "loiter" }, editor.selected()));
  get("mission").replaceChildren(el("div", { class: "fields" }, named, doubled("after the last goal", end), field("laps", "laps", "", 1, 10000, sketch.laps),
    field("margin_m", "margin to everything", "m", 0, 1000, sketch.margin_m), field("margin_floor_m", "at the least", "m", 0, 1000, sketch.margin_floor_m), field("point_radius_m", "radius of rocks", "m", 0.1, 5000, sketch.point_radius_m)),
    ...files.map((file) => el("p", { class: "none" }, el("b", {}, file.name), file.why ? ` ${file.why}` : "", file.shared_by.length ? ` Other missions use it too: ${file.shared_by.join(", ")}.` : "")),
    ...(others.length ? [el("p", { class: "none" }, `Kept in the file as they stand: ${others.map((name) => (name === "description" ? name : `[${name}]`)).join(", ")}.`)] : []));
}
