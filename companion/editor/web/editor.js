// The editor: a sketch, what is found in it and what a plan would be; saved and exported by the program that serves it.
import * as chart from "./chart.js";
import { el, get, renew, set, table } from "./dom.js";
import { bearing, distance, duration, percent, speedUnit, units } from "./format.js";
import * as map from "./map.js";
import { called, degrees, History, middle, placeOf, places, removed, ringEn, same, toEn } from "./sketch.js";
import * as tables from "./tables.js";
import * as water from "./water.js";

/** @typedef {import("./sketch.js").Sketch} Sketch @typedef {import("./sketch.js").Ref} Ref @typedef {import("./sketch.js").Place} Place @typedef {import("./sketch.js").Point} Point @typedef {import("../../view/view").View} View @typedef {import("../../view/view").Area} Area */
/** @typedef {{severity: string, place: string, text: string, remedy: string, at: Place | null, of: "start" | "goal" | "refuge" | null, number: number | null}} Finding */
/** @typedef {{findings: Finding[], is_in_order: boolean, grown: Place[][][]}} Found */
/** @typedef {{to: string, why: string, way: Place[], time_s: number, late_s: number | null, length_m: number, risk: number | null, risks: (number | null)[], tacks: number, gybes: number, clearance_m: number | null}} Leg */
/** @typedef {{error: string, legs: Leg[], time_s: number, length_m: number, tacks: number, gybes: number, clearance_m: number | null}} Plan */
/** @typedef {{version: string, file: string, folder: string, is_new: boolean, called: string, disk: string, sketch: Sketch, frame: import("./sketch.js").Frame, is_placed: boolean, files: import("./tables.js").AreaFile[], locked: {of: string, zone: string, rings: Place[][]}[], wind: {from_deg: number, speed_mps: number}, formats: {ending: string, said: string, part: string}[], kept: string[], said: string, charts: import("./charts.js").Chart[], waters: import("./water.js").Water[], free_m: number | null, drying: {name: string, rings: Place[][], solid_unix_s: [number | null, number | null][]}[], shown_unix_s: number, passage: import("../../view/view").Passage | null, passage_said: string}} State */

const KNOT_MPS = 1852 / 3600, CHECK_MS = 180, PLAN_MS = 350, SIDES = 48;
let token = "";
/** @type {State} */ let state;
/** @type {History} */ let history;
/** @type {Sketch | null} */ let draft = null;
/** @type {Ref | null} */ let selected = null;
/** @type {Found | null} */ let found = null;
/** @type {Plan | null} */ let plan = null;
let saved = "", disk = "", windMps = 5, busy = 0;
/** @type {Record<string, {timer: number, stop: AbortController | null, isOpen: boolean}>} */ const asking = { check: { timer: 0, stop: null, isOpen: false }, plan: { timer: 0, stop: null, isOpen: false } };
const dialog = /** @type {HTMLDialogElement} */ (get("dialog"));
/** @param {string} name */
const input = (name) => /** @type {HTMLInputElement} */ (get(name));

/** @type {chart.Editor} */
const editor = {
  sketch: () => draft ?? history.now, frame: () => state.frame, selected: () => selected,
  select(ref) { selected = ref; tables.show(); map.again(); reveal(); },
  draft(sketch) { draft = sketch; show(); },
  commit(sketch, ref) {
    draft = null;
    if (ref !== undefined) selected = ref;
    history.take(sketch);
    changed();
    reveal();
  },
};

function reveal() {
  const row = selected && document.querySelector(`[data-thing="${selected.of}-${selected.n}"]`);
  if (row && matchMedia("(min-width: 821px)").matches) row.scrollIntoView({ block: "nearest" });
}

/** The sketch is another one. */
function changed() {
  if (selected && placeOf(history.now, selected) === null) selected = null;
  tables.show();
  show();
  marks();
  soon("check", CHECK_MS, check);
}

function marks() {
  const isDirty = JSON.stringify(history.now) !== saved;
  set(get("undo"), { disabled: history.past.length === 0 });
  set(get("redo"), { disabled: history.future.length === 0 });
  set(get("save"), { disabled: !isDirty || busy > 0 });
  get("kept").textContent = isDirty ? "not saved" : state.is_new ? "new" : "saved";
  get("kept").classList.toggle("dirty", isDirty);
}

// ------------------------------------------------------------------------------------------------------ the map
/** @param {Place} place */
const en = (place) => toEn(state.frame, place);

/** @type {WeakMap<readonly Place[], {frame: import("./sketch.js").Frame, radius: number, points: Point[]}>} */
const circles = new WeakMap();

/** A circle as a ring, made once. @param {readonly Place[]} ring its middle @param {number} radius @returns {Point[]} */
function circle(ring, radius) {
  let known = circles.get(ring);
  if (known?.frame !== state.frame || known.radius !== radius) {
    const [e, n] = en(ring[0] ?? [0, 0]);
    known = { frame: state.frame, radius, points: Array.from({ length: SIDES }, (_, k) => /** @type {Point} */ ([e + radius * Math.sin(2 * Math.PI * k / SIDES), n + radius * Math.cos(2 * Math.PI * k / SIDES)])) };
    circles.set(ring, known);
  }
  return known.points;
}

/** What lies on the water. A ring that is as it was is the one that it was: what is drawn of it stays. @param {Sketch} sketch @returns {Area} */
function area(sketch) {
  const ring = (/** @type {Place[]} */ one) => ringEn(state.frame, one);
  const drawn = sketch.shapes.map((shape) => ({ zone: shape.zone, rings: shape.type === "polygon" ? shape.rings.map(ring) : shape.type === "line" ? [] : [circle(shape.rings[0] ?? [], shape.radius_m ?? sketch.point_radius_m)] }));
  const locked = state.locked.map((shape) => ({ zone: shape.zone, rings: shape.rings.map(ring) }));
  const of = (/** @type {string} */ zone) => [...drawn, ...locked].filter((shape) => shape.zone === zone && shape.rings.length > 0).map((shape) => shape.rings);
  const grown = (found?.grown ?? []).map((shape) => shape.map(ring));
  return /** @type {Area} */ (/** @type {unknown} */ ({ hash: "", name: state.called, origin_lat_deg: state.frame.lat, origin_lon_deg: state.frame.lon, lat_m: state.frame.lat_m, lon_m: state.frame.lon_m, drying: state.drying.map((water) => ({ name: water.name, shapes: [water.rings.map(ring)], solid_unix_s: water.solid_unix_s })), obstacles: of("exclusion"), names: [], limits: of("inclusion"), grown, margin_m: sketch.margin_m }));
}

/** The sketch as the map knows a voyage: the boat lies at the start. @param {Sketch} sketch @returns {View} */
function view(sketch) {
  const goals = sketch.goals.map((goal, n) => {
    const place = placeOf(sketch, { of: "goal", n });
    if (place === null) return null;
    const line = goal.port_mark && goal.starboard_mark && goal.kind === "gate" ? [en(goal.port_mark), en(goal.starboard_mark)] : null;
    return { name: `${n + 1}${goal.name ? ` ${goal.name}` : ""}`, at_en_m: en(place), radius_m: goal.kind === "point" || goal.kind === "field" ? goal.radius_m ?? 10 : null, side: goal.rounding ?? null, line_en_m: line, is_next: true, is_reached: false };
  }).filter((goal) => goal !== null);
  const refuges = sketch.refuges.map((refuge, n) => ({ name: called(sketch, { of: "refuge", n }), at_en_m: en(refuge.at), radius_m: refuge.radius_m ?? 15 }));
  const start = sketch.start ? { at_en_m: en(sketch.start.at), heading_deg: sketch.start.heading_deg ?? 0, cog_deg: null, sog_mps: null } : { at_en_m: null, heading_deg: null, cog_deg: null, sog_mps: null };
  const from = Number(input("windfrom").value) || 0;
  return /** @type {View} */ (/** @type {unknown} */ ({ name: state.called, t_s: 0, unix_s: state.shown_unix_s, boat: start, goals, refuges, home: null, safe_end: null, plan: null, predicted: null, laylines: null, no_go: null, vessels: [], orders: { standing: null }, wind: { mean_twd_from_deg: from, twd_from_deg: from } }));
}

function show() {
  const sketch = editor.sketch();
  get("dryingkey").textContent = `water that dries, as it is at ${new Date(1000 * state.shown_unix_s).toISOString().slice(0, 16).replace("T", " ")} UTC: filled while it is solid`;
  map.show(view(sketch), area(sketch), null);
}

/** Show it all: also what is only shown. */
function whole() {
  const all = [...places(history.now), ...state.locked.flatMap((shape) => shape.rings[0] ?? [])].map(en);
  if (all.length === 1 && all[0]) { const [e, n] = all[0]; map.fit([[e - 300, n - 200], [e + 300, n + 200]]); } else if (all.length) map.fit(all); else map.fit([[-300, -200], [300, 200]]);
}

// ------------------------------------------------------------------------------------------------------ the program
/** @param {string} name @param {number} after @param {(signal: AbortSignal) => Promise<void>} ask */
function soon(name, after, ask) {
  const one = asking[name];
  if (!one) return;
  clearTimeout(one.timer);
  one.isOpen = true;
  one.timer = setTimeout(() => {
    one.stop?.abort();
    const stop = one.stop = new AbortController();
    void ask(stop.signal).finally(() => { if (one.stop === stop) one.isOpen = false; });
  }, after);
}

/** @param {string} path @param {Record<string, any>} body @param {AbortSignal | null} [signal] @returns {Promise<{status: number, found: any}>} */
async function post(path, body, signal = null) {
  try {
    const answer = await fetch(path, { method: "POST", body: JSON.stringify(body), signal, headers: { "Content-Type": "application/json", "X-Companion": "1", Authorization: `Bearer ${token}` } });
    const told = await answer.json();
    trouble(answer.status === 401 ? "The token is missing or wrong: open the address that `companion mission edit` printed." : "");
    return { status: answer.status, found: told };
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") return { status: 409, found: {} };
    trouble("The editor is not reached: nothing is checked or saved until it is back. What is drawn is still here.");
    return { status: 0, found: { error: "the editor is not reached" } };
  }
}

/** @param {string} words */
function trouble(words) {
  const box = get("trouble");
  if (box.textContent !== words) box.textContent = words;
  box.hidden = words === "";
}

/** @param {AbortSignal} signal */
async function check(signal) {
  const { status, found: told } = await post("/api/check", { sketch: history.now, from_deg: Number(input("windfrom").value) || 0 }, signal);
  if (status === 409 || status === 0 || status === 401) return;
  found = status === 200 ? told : { findings: [{ severity: "error", place: "", text: told.error, remedy: "", at: null, of: null, number: null }], is_in_order: false, grown: [] };
  findings();
  show();
  if (input("plans").checked) soon("plan", PLAN_MS - CHECK_MS, planned); else planWords();
}

/** @param {AbortSignal} signal */
async function planned(signal) {
  if (!input("plans").checked) return;
  get("planwords").textContent = "The plan is being made…";
  const { status, found: told } = await post("/api/plan", { sketch: history.now, from_deg: Number(input("windfrom").value) || 0, speed_mps: windMps, spread_deg: Number(input("windspread").value) || 0 }, signal);
  if (status === 409 || status === 0 || status === 401) return;
  plan = status === 200 ? told : { error: told.error, legs: [], time_s: 0, length_m: 0, tacks: 0, gybes: 0, clearance_m: null };
  planWords();
}

function planWords() {
  const words = get("planwords"), legs = plan?.legs ?? [];
  if (!input("plans").checked) plan = null;
  words.textContent = plan === null ? "" : history.now.goals.length === 0 ? "Nothing to plan yet." : plan.error ? `No plan: ${plan.error}.` : legs.length === 0 ? "Nothing to plan yet." : "";
  words.classList.toggle("warn", Boolean(plan?.error) && history.now.goals.length > 0);
  const facts = plan === null || legs.length === 0 ? [] : [["time", duration(plan.time_s)], ["way", distance(plan.length_m)], ["tacks, gybes", `${plan.tacks}, ${plan.gybes}`], ["beyond the margin", distance(plan.clearance_m)], ...(legs.length === 1 ? [["off the plan", percent(legs[0]?.risk)]] : [])];
  get("planfacts").replaceChildren(...facts.map(([name, value]) => el("div", {}, el("dt", {}, name ?? ""), el("dd", {}, value ?? ""))));
  renew(get("plantable"), plan && legs.length > 1 ? [table("Legs", ["to", "time", "nine of ten", "way", "tacks", "off plan"], legs.map((leg) => [leg.to, duration(leg.time_s), duration(leg.late_s), distance(leg.length_m), String(leg.tacks), percent(leg.risk)]))] : []);
  const first = legs[0]?.why;
  if (plan && !plan.error && first && legs.length === 1) words.textContent = first;
  /** @type {Point[]} */ const way = [];
  /** @type {(number | null)[]} */ const risks = [];
  for (const leg of legs) {
    const points = leg.way.map(en);
    if (way.length > 0) points.shift();
    way.push(...points);
    risks.push(...leg.risks.slice(0, leg.way.length - 1));
  }
  map.showPreview(way.length > 1 ? { way, risks } : null);
}

function findings() {
  if (found === null) return;
  const errors = found.findings.filter((f) => f.severity === "error").length, warnings = found.findings.filter((f) => f.severity === "warning").length;
  const count = (/** @type {number} */ n, /** @type {string} */ word) => `${n} ${word}${n === 1 ? "" : "s"}`;
  const isEmpty = history.now.goals.length === 0;
  const words = isEmpty ? "draw a mission: a start and a mark" : errors ? `not in order: ${count(errors, "error")}` : warnings ? `in order, ${count(warnings, "warning")}` : "in order";
  if (get("order").textContent !== words) get("order").textContent = words;
  get("order").dataset.grade = errors && !isEmpty ? "bad" : warnings ? "poor" : isEmpty ? "none" : "good";
  const rows = found.findings.filter((f) => !(isEmpty && f.place === "goal"));
  get("findings").replaceChildren(...rows.map((finding) => {
    const words = [el("b", { class: finding.severity }, finding.severity), ` ${finding.place ? `${finding.place}: ` : ""}${finding.text}${finding.remedy ? `; ${finding.remedy}` : ""}`];
    const isSomewhere = finding.at !== null || finding.of !== null;
    const row = isSomewhere ? el("button", { type: "button" }, ...words) : el("p", {}, ...words);
    if (isSomewhere) row.addEventListener("click", () => lead(finding));
    return el("li", { class: finding.severity }, row);
  }));
  if (rows.length === 0) get("findings").append(el("li", { class: "none" }, isEmpty ? "Nothing yet." : "Nothing: it can be sailed as it stands."));
}

/** To where a finding is. @param {Finding} finding */
function lead(finding) {
  const ref = finding.of === "goal" || finding.of === "refuge" || finding.of === "start" ? /** @type {Ref} */ ({ of: finding.of, n: finding.number ?? 0 }) : null;
  const at = finding.at ?? (ref && placeOf(history.now, ref));
  const n = finding.at ? history.now.shapes.findIndex((shape, m) => called(history.now, { of: "shape", n: m }) === finding.place && middle(shape.rings[0] ?? []) !== null) : -1;
  editor.select(ref ?? (n >= 0 ? { of: "shape", n } : null));
  if (at) map.centre(en(at));
  get("map").scrollIntoView({ block: "nearest" });
}

// ------------------------------------------------------------------------------------------------------ the file
/** @param {boolean} isForced */
async function save(isForced = false) {
  if (busy > 0) return;
  const sketch = history.now;
  busy += 1;
  marks();
  const { status, found: told } = await post("/api/save", { sketch, disk, from_deg: Number(input("windfrom").value) || 0, is_forced: isForced });
  busy -= 1;
  if (status === 200) {
    const isSame = history.now === sketch && !chart.isDragging();   // what is dragged is of the sketch before
    take(told, isSame);
    chart.hint(`${told.said}.`);
  } else if (status === 409) {
    ask("Changed meanwhile", `${told.error}. What is drawn here is not saved.`, [["Write over it", () => save(true)], ["Read it again, and lose what is drawn here", () => load()]]);
  } else if (status !== 0 && status !== 401) ask("Not saved", told.error, []);
  marks();
}

/** Another state of the file: of its sketch the keys are new, and the order of its shapes. @param {State} told @param {boolean} isSame */
function take(told, isSame) {
  state = { ...told, frame: state?.frame ?? told.frame };
  disk = told.disk;
  if (isSame) {
    selected = same(history.now, selected, told.sketch);
    draft = null;
    history.now = told.sketch;
  }
  saved = JSON.stringify(told.sketch);
  tables.about(told.files, told.kept);
  set(get("name"), { title: `${told.folder}/${told.file}` });
  get("name").textContent = told.file;
  document.title = `${told.file}: mission editor`;
  tables.show();
  show();
  marks();
}

async function load() {
  const { status, found: told } = await post("/api/mission", {});
  if (status !== 200) { if (status !== 401 && status !== 0) trouble(told.error); return false; }
  const isFirst = state === undefined;
  state = told;
  history = new History(told.sketch);
  draft = null;
  selected = null;
  if (isFirst) { windMps = told.wind.speed_mps; input("windfrom").value = String(told.wind.from_deg); typedWind(); shownWind(); tables.build(editor); chart.build(editor); map.lay(told.charts); water.build(/** @type {HTMLCanvasElement} */ (get("water")), () => state.frame, tile); map.drawUnder(water.draw); useChart(); }
  waters(told.waters);
  map.planned(told.passage, false, told.passage_said);
  take(told, true);
  changed();
  whole();
  if (isFirst && !told.is_placed) { if (told.waters.length) { begin(water.middle() ?? [0, 0]); charting(true); } else if (told.charts[0]) begin(onChart(told.charts[0])); else where(); }
  return true;
}

// ------------------------------------------------------------------------------------------------------ charts
const REACH_M = 2000, FREE_M = 2;
let isChartShown = true;

/** A tile of a chart; null: it has not come. @param {string} path @returns {Promise<any>} */
async function tile(path) {
  try {
    const answer = await fetch(path, { headers: { "Content-Type": "application/json", "X-Companion": "1", Authorization: `Bearer ${token}` } });
    return answer.ok ? await answer.json() : null;
  } catch { return null; }
}

/** @param {import("./water.js").Water[]} given */
function waters(given) {
  state.waters = given;
  water.lay(given, state.free_m ?? FREE_M);
  get("waters").hidden = given.length === 0;
  for (const old of document.querySelectorAll("#key .water")) old.remove();
  for (const one of given) get("key").append(el("li", { class: "credit water" }, `chart: ${one.name}, not fit for navigation`));
  map.again();
}

/** The first of the tools: the chart instead of drawing. */
function useChart() {
  const button = el("button", { type: "button", id: "usechart", title: "Obstacles and fence of a chart" }, chart.sign("obstacle"), "Use the chart…");
  button.addEventListener("click", () => charting(false));
  get("tools").prepend(button);
  get("waters").addEventListener("click", () => {
    isChartShown = !isChartShown;
    set(get("waters"), { "aria-pressed": isChartShown ? "true" : "false" });
    water.show(isChartShown);
    map.again();
  });
}

/** Files of charts, to be opened; the rest of the dialog waits for them. @param {(told: string) => void} say */
function opener(say) {
  const files = /** @type {HTMLInputElement} */ (el("input", { type: "file", id: "chartfiles", multiple: true, "aria-label": "chart files" }));
  files.addEventListener("change", async () => {
    say("Being read…");
    const read = await Promise.all([...files.files ?? []].map(async (file) => {
      const bytes = new Uint8Array(await file.arrayBuffer());
      let text = "";
      for (let n = 0; n < bytes.length; n += 32768) text += String.fromCharCode(...bytes.subarray(n, n + 32768));
      return [file.name, btoa(text)];
    }));
    const { status, found: told } = await post("/api/open", { files: read });
    if (status !== 200) return say(told.error ?? "It is not taken.");
    waters(told.waters);
    say(`Open: ${state.waters.map((one) => one.name).join(", ")}.`);
    const middle = water.middle();
    if (middle && places(history.now).length === 0) { begin(middle); fields(middle); }
  });
  return el("label", {}, "chart files (S-57 cells with their updates, coastlines, grids)", files);
}

/** @param {Place} at */
function fields(at) {
  for (const [name, value] of /** @type {[string, number][]} */ ([["wherelat", at[0]], ["wherelon", at[1]]])) {
    const field = document.getElementById(name);
    if (field instanceof HTMLInputElement) field.value = value.toFixed(5);
  }
}

/** Where obstacles and fence come from. @param {boolean} isNew */
function charting(isNew) {
  const all = places(history.now).map(en), own = water.middle();
  const mid = all.length ? /** @type {Point} */ ([(Math.min(...all.map((p) => p[0])) + Math.max(...all.map((p) => p[0]))) / 2, (Math.min(...all.map((p) => p[1])) + Math.max(...all.map((p) => p[1]))) / 2]) : null;
  const seen = mid ?? (isNew ? null : map.middle().en), at = seen ? /** @type {Place} */ ([state.frame.lat + seen[1] / state.frame.lat_m, state.frame.lon + seen[0] / state.frame.lon_m]) : own ?? [state.frame.lat, state.frame.lon];
  const reach = mid ? Math.ceil((REACH_M + Math.max(...all.map((p) => Math.hypot(p[0] - mid[0], p[1] - mid[1])))) / 100) * 100 : REACH_M;
  const field = (/** @type {string} */ name, /** @type {string} */ words, /** @type {string} */ value) => el("label", {}, words, el("input", { type: "text", id: name, inputmode: "decimal", value }));
  const told = el("p", { id: "charttold", role: "status" }), say = (/** @type {string} */ words) => { told.textContent = words; };
  const use = el("button", { type: "submit", class: "primary", id: "takechart" }, "Draw nothing: use the chart"), hand = el("button", { type: "button", id: "byhand" }, isNew ? "Draw it by hand" : "Cancel");
  const form = el("form", { method: "dialog" }, el("h2", { id: "dialogtitle" }, "Use the chart"), el("div", { class: "buttons column" }, use, hand),
    el("p", {}, "Obstacles and the fence of what the chart says. It may be old, coarse or wrong: look at it before it is sailed by."), opener(say),
    field("wherelat", "middle: latitude", at[0].toFixed(5)), field("wherelon", "longitude", at[1].toFixed(5)), field("chartreach", "how far from there, m", String(reach)), field("chartfree", "water is free from, m below the chart's datum (draught and what is kept below it)", String(state.free_m ?? FREE_M)), told);
  hand.addEventListener("click", () => { dialog.close(); if (isNew) begin(at); });
  form.addEventListener("submit", (event) => { event.preventDefault(); void taken(say); });
  dialog.replaceChildren(form);
  dialog.showModal();
}

/** @param {(told: string) => void} say */
async function taken(say) {
  if (water.isEmpty()) return say("No chart is open yet: choose its files.");
  const place = [degrees(input("wherelat").value, "lat"), degrees(input("wherelon").value, "lon")];
  const reach = Number(input("chartreach").value), free = Number(input("chartfree").value);
  if (!place.every(Number.isFinite)) return say("These are no degrees.");
  if (!(reach >= 50 && reach <= 20000 && free >= 0 && free <= 100)) return say("From 50 to 20,000 m, and a depth of 0 to 100 m.");
  say("Being made…");
  const { status, found: answer } = await post("/api/water", { sketch: history.now, at: place, reach_m: reach, depth_m: free });
  if (status !== 200) return say(answer.error ?? "It could not be made.");
  dialog.close();
  if (places(history.now).length === 0) begin(/** @type {Place} */ (place));
  state.free_m = free;
  waters(state.waters);
  editor.commit(answer.sketch, null);
  whole();
  chart.hint(`${answer.said}.`);
}

/** The middle of a chart. @param {import("./charts.js").Chart} given @returns {Place} */
function onChart(given) {
  const [west, south, east, north] = given.bounds_deg;
  return [(south + north) / 2, (west + east) / 2];
}

/** An empty mission begins there. @param {Place} place */
function begin(place) {
  state.frame = { lat: place[0], lon: place[1], lat_m: 111195, lon_m: 111320 * Math.max(0.01, Math.cos(place[0] * Math.PI / 180)) };
  whole();
  show();
}

/** An empty mission: where on the globe? */
function where() {
  const lat = /** @type {HTMLInputElement} */ (el("input", { type: "text", id: "wherelat", inputmode: "decimal", value: state.frame.lat.toFixed(4), "aria-label": "latitude" }));
  const lon = /** @type {HTMLInputElement} */ (el("input", { type: "text", id: "wherelon", inputmode: "decimal", value: state.frame.lon.toFixed(4), "aria-label": "longitude" }));
  const go = el("button", { type: "submit", class: "primary" }, "Begin there"), use = el("button", { type: "button", id: "fromchart" }, "Draw nothing: use the chart…");
  use.addEventListener("click", () => { dialog.close(); charting(true); });
  const form = el("form", { method: "dialog" }, el("h2", { id: "dialogtitle" }, "Where is the water?"), el("div", { class: "buttons" }, use), el("p", {}, "A place in the middle of it, in degrees: 50.8203, or 50 49.218 N."), el("label", {}, "latitude", lat), el("label", {}, "longitude", lon), el("p", { class: "warn", id: "wherewrong" }), el("div", { class: "buttons" }, go));
  dialog.replaceChildren(form);
  dialog.showModal();
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const place = [degrees(lat.value, "lat"), degrees(lon.value, "lon")];
    if (!place.every(Number.isFinite)) { get("wherewrong").textContent = "These are no degrees."; return; }
    dialog.close();
    begin([place[0] ?? 0, place[1] ?? 0]);
  });
}

/** @param {string} title @param {string} words @param {[string, () => unknown][]} ways */
function ask(title, words, ways) {
  const cancel = el("button", { type: "button" }, ways.length ? "Cancel" : "Close");
  cancel.addEventListener("click", () => dialog.close());
  dialog.replaceChildren(el("h2", { id: "dialogtitle" }, title), el("p", {}, words), el("div", { class: "buttons column" }, ...ways.map(([text, act]) => {
    const button = el("button", { type: "button" }, text);
    button.addEventListener("click", () => { dialog.close(); act(); });
    return button;
  }), cancel));
  dialog.showModal();
}

function exporting() {
  const said = (/** @type {{said: string, part: string}} */ f) => (f.part ? `${f.said}: ${f.part}` : f.said);
  const select = /** @type {HTMLSelectElement} */ (el("select", { id: "format" }, ...state.formats.map((f, n) => el("option", { value: n }, f.said.startsWith(".") ? said(f) : `${said(f)} (.${f.ending})`))));
  const make = el("button", { type: "button", class: "primary", id: "make" }, "Make it"), close = el("button", { type: "button" }, "Close"), told = el("div", { id: "exported", role: "status" });
  close.addEventListener("click", () => dialog.close());
  make.addEventListener("click", async () => {
    const format = state.formats[Number(select.value)];
    if (!format) return;
    const { status, found: answer } = await post("/api/export", { sketch: history.now, format: format.ending, part: format.part });
    if (status !== 200) return told.replaceChildren(el("p", { class: "warn" }, answer.error ?? ""));
    const bytes = Uint8Array.from(atob(answer.data), (c) => c.charCodeAt(0));
    const link = el("a", { href: URL.createObjectURL(new Blob([bytes])), download: answer.name, class: "download", id: "download" }, `Download ${answer.name}`);
    told.replaceChildren(...(answer.is_lossy ? [el("p", { class: "warn" }, "This format leaves zones out: whoever sails by it sails without them.")] : []), el("ul", { class: "losses" }, ...answer.losses.map((/** @type {{severity: string, text: string}} */ loss) => el("li", { class: loss.severity }, loss.text))), link);
  });
  dialog.replaceChildren(el("h2", { id: "dialogtitle" }, "Export"), el("p", {}, "What is drawn, saved or not, for other programs. What a format does not carry is said."), el("label", {}, "format", select), told, el("div", { class: "buttons" }, make, close));
  dialog.showModal();
}

// ------------------------------------------------------------------------------------------------------ the page
function undo(isRedo = false) {
  if (draft) draft = null;
  const before = history.now;
  if (!(isRedo ? history.redo() : history.undo())) return;
  selected = same(before, selected, history.now);
  changed();
}

/** @type {[string, string][]} */
const KEYS = [["Esc", "give up what is drawn, the tool, the choice"], ["Enter", "close the polygon"], ["Backspace", "one corner back"], ["Delete", "delete what is chosen"],
  ["Space", "a point under the cross; arrows move the chart"], ["arrows", "what is chosen by 1 m, with Shift 10 m"], ["Ctrl Z, Y", "undo, redo"], ["Ctrl S", "save"], ["+ − a", "nearer, farther, all"], ["d u", "colours, units"]];

function help() {
  const close = el("button", { type: "button" }, "Close");
  close.addEventListener("click", () => dialog.close());
  const tools = chart.TOOLS.map(([, key, words, , means]) => /** @type {[string, string]} */ ([key, `${words}: ${means}`]));
  dialog.replaceChildren(el("h2", { id: "dialogtitle", tabindex: "-1", autofocus: true }, "Keys and signs"), el("dl", { class: "keys" }, ...[...tools, ...KEYS].map(([key, words]) => el("div", {}, el("dt", {}, el("kbd", {}, key)), el("dd", {}, words)))),
    el("p", {}, "Hatched is what the margin adds; blue is the plan, warmer and thicker where she is more likely to be forced off a leg; the thin dashes are the order of the course. The curved arrows say on which side a mark is left, the straight ones which way a gate is sailed."), el("div", { class: "buttons" }, close));
  dialog.showModal();
}

/** @param {KeyboardEvent} event */
function keys(event) {
  const isCommand = event.ctrlKey || event.metaKey;
  if (isCommand && event.key.toLowerCase() === "s") { event.preventDefault(); return void save(); }
  const field = event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement;
  if (dialog.open || field) return;
  if (isCommand && event.key.toLowerCase() === "z") { event.preventDefault(); return undo(event.shiftKey); }
  if (isCommand && event.key.toLowerCase() === "y") { event.preventDefault(); return undo(true); }
  if (isCommand || event.altKey) return;
  const onChart = document.activeElement === get("map") || document.activeElement === document.body;
  if (onChart && chart.key(event)) return event.preventDefault();
  if (event.key === "Escape") return chart.cancel();
  if ((event.key === "Delete" || event.key === "Backspace") && selected && onChart) {
    event.preventDefault();
    const rest = removed(history.now, selected), list = selected.of === "goal" ? "goals" : "shapes";
    const isLess = selected.v !== undefined && rest[list].length === history.now[list].length;   // a corner only
    return editor.commit(rest, isLess ? { of: selected.of, n: selected.n } : null);
  }
  const tool = chart.TOOLS.find((row) => row[1] === event.key);
  if (tool) return chart.choose(tool[0]);
  if (event.key === "a") whole();
  if (event.key === "+") map.zoom(1.5);
  if (event.key === "-") map.zoom(1 / 1.5);
  if (event.key === "?") help();
  if (event.key === "d" || event.key === "u") cycle(event.key === "d" ? "palette" : "speeds");
}

/** @param {string} name */
function cycle(name) {
  const field = /** @type {HTMLSelectElement} */ (get(name));
  field.selectedIndex = (field.selectedIndex + 1) % field.options.length;
  field.dispatchEvent(new Event("change"));
}

/** The wind as it was typed before this page was loaded again. */
function typedWind() {
  try {
    const kept = JSON.parse(sessionStorage.getItem(windKey()) ?? "null");
    if (kept) [input("windfrom").value, windMps, input("windspread").value] = kept;
  } catch { /* none is kept */ }
}

function windKey() {
  return `wind of ${state.folder}/${state.file}`;
}

function shownWind() {
  get("windunit").textContent = speedUnit();
  input("windspeed").value = String(Number((units.speeds === "kn" ? windMps / KNOT_MPS : windMps).toFixed(1)));
}

/** @param {string} name @param {(value: string) => void} use @param {string} value */
function setting(name, use, value) {
  const field = /** @type {HTMLSelectElement} */ (get(name));
  try { value = localStorage.getItem(name) ?? value; } catch { /* not kept */ }
  field.value = value;
  use(field.value);
  field.addEventListener("change", () => {
    try { localStorage.setItem(name, field.value); } catch { /* not kept */ }
    use(field.value);
    if (history) { show(); planWords(); }
  });
}

function settings() {
  setting("palette", (value) => { document.documentElement.dataset.palette = value; }, document.documentElement.dataset.palette ?? "day");
  setting("speeds", (value) => { units.speeds = value === "mps" ? "mps" : "kn"; shownWind(); }, "kn");
  get("undo").addEventListener("click", () => undo());
  get("redo").addEventListener("click", () => undo(true));
  get("save").addEventListener("click", () => void save());
  get("export").addEventListener("click", exporting);
  get("help").addEventListener("click", help);
  get("nearer").addEventListener("click", () => map.zoom(1.5));
  get("farther").addEventListener("click", () => map.zoom(1 / 1.5));
  get("whole").addEventListener("click", whole);
  for (const name of ["windfrom", "windspeed", "windspread"]) input(name).addEventListener("change", () => {
    if (!input(name).checkValidity() || input(name).value === "") return void input(name).reportValidity();
    const typed = Number(input("windspeed").value);
    if (name === "windspeed") windMps = units.speeds === "kn" ? typed * KNOT_MPS : typed;
    try { sessionStorage.setItem(windKey(), JSON.stringify([input("windfrom").value, windMps, input("windspread").value])); } catch { /* not kept */ }
    show();
    soon("check", 0, check);
  });
  input("plans").addEventListener("change", () => { if (input("plans").checked) soon("plan", 0, planned); else planWords(); });
  addEventListener("keydown", keys);
  addEventListener("beforeunload", (event) => { if (history && JSON.stringify(history.now) !== saved) event.preventDefault(); });
}

/** The token stands behind # in the address that was printed; it does not stay there. */
function known() {
  const given = location.hash.slice(1);
  try {
    if (given) sessionStorage.setItem("edit-token", given);
    token = given || (sessionStorage.getItem("edit-token") ?? "");
  } catch { token = given; }
  if (given) window.history.replaceState(null, "", location.pathname);
}

known();
map.build();
map.follow(false);
settings();
void load().then(() => { document.body.dataset.ready = "1"; });
// for tests, and for who is curious
Object.assign(window, { editing: { now: () => history.now, found: () => found, plan: () => plan, selected: () => selected, water, map, isAsking: () => Object.values(asking).some((one) => one.isOpen), screen: (/** @type {Place} */ place) => map.onScreen(en(place)), bearing } });
