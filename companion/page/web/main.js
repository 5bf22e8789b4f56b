// The page: hears views from its feed and shows them, each part by its own module.
import { el, get, set } from "./dom.js";
import { follow, Moments, packed, read } from "./feed.js";
import { units } from "./format.js";
import * as dial from "./dial.js";
import * as log from "./log.js";
import * as map from "./map.js";
import * as orders from "./orders.js";
import * as panel from "./panel.js";
import * as polar from "./polar.js";
import * as strips from "./strips.js";
import { Timeline } from "./timeline.js";

/** @typedef {import("../../view/view").View} View @typedef {import("../../view/view").Area} Area @typedef {import("../../view/view").Past} Past @typedef {import("./feed.js").Hello} Hello */

const KEPT = 7200;
const GAP_S = 8;        // after a hole in the views the past is asked for again
/** @type {{view: View | null, area: Area | null, past: Past | null, hello: Hello | null, beside: import("./feed.js").Beside | null, timeline: Timeline | null, heard: number, isUp: boolean, isOver: boolean}} */
const page = { view: null, area: null, past: null, hello: null, beside: null, timeline: null, heard: performance.now(), isUp: true, isOver: false };
// for tests, and for who is curious
Object.assign(window, { companion: page });

function show() {
  const { view, area, past } = page;
  panel.show(view, page.isOver ? "over" : page.hello?.kind ?? "connecting", page.beside, page.area);
  const other = beside();
  map.show(view, area, past, other);
  dial.show(view, past);
  strips.show(view, past, view?.plan?.margin_m ?? area?.margin_m ?? null, other);
  polar.show(view, past);
  orders.show(view);
  log.show(view?.t_s ?? -Infinity, view?.unix_s);
  if (view) page.timeline?.words(view);
  old();
}

/** The other voyage, its time moved so that both set sail at once. */
function beside() {
  const other = page.beside;
  if (!other || !page.view) return null;
  const off = (page.hello?.sails_s ?? page.past?.t_s[0] ?? 0) - (other.sails_s ?? other.past.t_s[0] ?? 0);
  let count = other.past.t_s.length;
  while (count > 0 && (other.past.t_s[count - 1] ?? 0) + off > page.view.t_s + 0.05) count -= 1;
  return { name: other.name, past: other.past, off, count };
}

function old() {
  const since = page.hello?.kind === "recorded" ? 0 : (performance.now() - page.heard) / 1000;
  panel.age(page.view, since, page.hello?.kind !== "recorded" && (!page.isUp || since > 10), page.isOver);
}

/** What a view adds to the past; names as in Sample. @param {Past} past @param {View} view */
function remember(past, view) {
  const last = past.t_s[past.t_s.length - 1];
  if (last !== undefined && view.t_s <= last + 0.3) return;
  const minute = view.wind?.bands.find((b) => b.horizon_s === 60);
  const [east, north] = view.boat.at_en_m ?? [null, null];
  if (view.unix_s !== null) past.unix_s = view.unix_s - view.t_s;
  past.t_s.push(view.t_s); past.east_m.push(east); past.north_m.push(north); past.heading_deg.push(view.boat.heading_deg);
  past.sog_mps.push(view.boat.sog_mps); past.twd_from_deg.push(view.wind?.twd_from_deg ?? null); past.tws_mps.push(view.wind?.tws_mps ?? null);
  past.clearance_m.push(view.boat.clearance_m); past.starboard.push(view.boat.tack === null ? null : view.boat.tack === "starboard");
  past.polar_twa_deg.push(view.polar?.live_twa_deg ?? null); past.polar_mps.push(view.polar?.live_mps ?? null);
  past.ahead_twd_deg.push(minute?.twd_from_deg ?? null); past.ahead_half_deg.push(minute?.half_deg[1] ?? null);
  past.ahead_tws_mps.push(minute?.tws_mps ?? null); past.ahead_tws_sigma_mps.push(minute?.tws_sigma_mps ?? null);
  if (past.t_s.length > KEPT) for (const column of Object.values(past)) if (Array.isArray(column)) column.splice(0, KEPT / 10);
}

/** What is static, again: at the beginning, after a lost link, when the water is another's. */
async function whole() {
  // in the metres of the area, which go along with a boat that sails far
  const [area, past, events, planned] = await Promise.all([read("/api/area").catch(() => null), read("/api/past"), read("/api/log"),
    page.hello?.passage ? read("/api/passage").catch(() => null) : null]);
  page.area = area;
  page.past = past;
  map.planned(planned, true, page.hello?.passage_said);
  if (page.view && past) remember(past, page.view);
  log.add(events);
}

async function live() {
  await whole();
  show();
  let isBack = false;
  follow({
    view(view) {
      const before = page.view;
      // a companion that was started again counts its time anew
      if (before && (view.t_s < before.t_s - 5 || view.name !== before.name)) { log.clear(); isBack = true; }
      if (before && view.t_s > before.t_s + GAP_S) isBack = true;
      page.view = view;
      page.heard = performance.now();
      page.isUp = true;
      if (page.past && !isBack) remember(page.past, view);
      if (isBack || view.area !== (page.area?.hash ?? null)) { isBack = false; void whole().then(show, () => { isBack = true; }); }
      show();
    },
    log(event) { log.add([event]); },
    link(isUp) {
      if (isUp && (!page.isUp || page.isOver)) isBack = true;
      page.isUp = isUp;
      if (isUp) page.isOver = false;
      old();
    },
    over() { page.isOver = true; show(); },
  });
}

/** @param {Hello} hello @param {import("./feed.js").Packed | null} inside */
async function recorded(hello, inside) {
  page.area = inside ? inside.area : await read("/api/area");
  page.past = inside ? inside.past : await read("/api/past");
  log.add(inside ? inside.log : await read("/api/log"));
  page.beside = inside ? inside.beside ?? null : hello.beside ? await read("/api/beside") : null;
  const planned = inside ? inside.passage ?? null : hello.passage ? await read("/api/passage") : null;
  map.planned(planned, true, hello.passage_said);
  const moments = new Moments(hello.count ?? 0, hello.chunk ?? 60, inside?.moments ?? null);
  const times = page.past?.t_s ?? [];
  let wanted = 0;
  const timeline = new Timeline(times, log.all(), (n) => {
    wanted = n;
    const view = moments.at(n);
    if (view) { page.view = view; return show(); }
    void moments.fetch(Math.floor(n / moments.size)).then(() => { if (wanted === n) { page.view = moments.at(n) ?? page.view; show(); } });
  });
  page.timeline = timeline;
  log.onJump((t_s) => { timeline.play(false); timeline.go(timeline.index(t_s)); });
  await moments.fetch(0);
  const first = times.findIndex((_, n) => page.past?.east_m[n] != null);
  timeline.go(Math.max(0, first));
  map.all();
}

/** @param {string} name @param {(value: string) => void} use @param {string} value */
function setting(name, use, value) {
  const field = /** @type {HTMLSelectElement | HTMLInputElement} */ (get(name));
  try { value = localStorage.getItem(name) ?? value; } catch { /* a file has no storage */ }
  field.value = value;
  use(field.value);
  field.addEventListener("change", () => {
    try { localStorage.setItem(name, field.value); } catch { /* not kept */ }
    use(field.value);
    show();
  });
}

function settings() {
  setting("palette", (value) => { document.documentElement.dataset.palette = value; }, document.documentElement.dataset.palette ?? "day");
  setting("speeds", (value) => { units.speeds = value === "mps" ? "mps" : "kn"; }, "kn");
  setting("bearings", (value) => { units.bearings = value === "magnetic" ? "magnetic" : "true"; get("variationlabel").hidden = value !== "magnetic"; }, "true");
  setting("variation", (value) => { units.variation = Number.isFinite(Number(value)) ? Number(value) : 0; }, "0");
  setting("window", (value) => strips.over(Number(value)), "600");
  get("everything").addEventListener("change", show);
  for (const button of document.querySelectorAll("[data-up]")) {
    button.addEventListener("click", () => map.orient(/** @type {HTMLElement} */ (button).dataset.up ?? "north"));
  }
  get("follow").addEventListener("click", () => map.follow(!map.isFollowing()));
  get("whole").addEventListener("click", () => map.all());
  get("nearer").addEventListener("click", () => map.zoom(1.5));
  get("farther").addEventListener("click", () => map.zoom(1 / 1.5));
  get("help").addEventListener("click", help);
  addEventListener("keydown", keys);
}

/** @type {[string, string, () => void][]} */
const KEYS = [
  ["n", "north up", () => map.orient("north")], ["h", "head up", () => map.orient("head")], ["w", "wind up", () => map.orient("wind")],
  ["c", "charts", () => get("charts").click()], ["p", "the planned passage", () => get("passage").click()], ["f", "follow the boat", () => map.follow(!map.isFollowing())], ["a", "show all", () => map.all()], ["+", "nearer", () => map.zoom(1.5)], ["-", "farther", () => map.zoom(1 / 1.5)],
  ["d", "day, dusk, night", () => cycle("palette")], ["u", "knots or m/s", () => cycle("speeds")], ["m", "true or magnetic", () => cycle("bearings")],
  [" ", "play and pause", () => page.timeline?.play(!page.timeline.isPlaying)], ["ArrowLeft", "a moment back", () => page.timeline?.step(-1)], ["ArrowRight", "a moment on", () => page.timeline?.step(1)],
  ["[", "to the decision before", () => page.timeline?.jump(-1)], ["]", "to the next decision", () => page.timeline?.jump(1)], ["?", "these keys", () => help()],
];

const TIMELINE = new Set([" ", "ArrowLeft", "ArrowRight", "[", "]"]);
/** @type {Record<string, [number, number]>} px */
const PAN = { ArrowLeft: [-80, 0], ArrowRight: [80, 0], ArrowUp: [0, -80], ArrowDown: [0, 80] };

/** @param {KeyboardEvent} event */
function keys(event) {
  if (event.key === "Escape") return orders.cancel();
  if (event.ctrlKey || event.metaKey || event.altKey || get("dialog").hasAttribute("open")) return;
  const target = event.target;
  if (target instanceof HTMLInputElement || target instanceof HTMLSelectElement) return;
  if (event.key === " " && target instanceof HTMLButtonElement) return;
  const way = event.shiftKey ? PAN[event.key] : undefined;
  if (way) { event.preventDefault(); return map.pan(...way); }
  if (page.timeline === null && TIMELINE.has(event.key)) return;   // live they are the browser's: Space and arrows move the page
  const found = KEYS.find(([key]) => key === event.key);
  if (found) { event.preventDefault(); found[2](); }
}

/** @param {string} name */
function cycle(name) {
  const field = /** @type {HTMLSelectElement} */ (get(name));
  field.selectedIndex = (field.selectedIndex + 1) % field.options.length;
  field.dispatchEvent(new window.Event("change"));
}

function help() {
  const dialog = /** @type {HTMLDialogElement} */ (get("dialog"));
  const close = el("button", { type: "button", class: "primary" }, "Close");
  close.addEventListener("click", () => dialog.close());
  const names = /** @type {Record<string, string>} */ ({ " ": "space", ArrowLeft: "←", ArrowRight: "→" });
  dialog.replaceChildren(el("h2", { id: "dialogtitle" }, "Keys and signs"),
    el("dl", { class: "keys" }, ...KEYS.map(([key, words]) => el("div", {}, el("dt", {}, el("kbd", {}, names[key] ?? key)), el("dd", {}, words))),
      el("div", {}, el("dt", {}, el("kbd", {}, "⇧ ←")), el("dd", {}, "move the chart: Shift and an arrow"))),
    el("p", {}, "T is the true wind, A the apparent, ◆ the course over ground, ● the mark. P and S are port and starboard tack: the side that the wind comes over. The wedges are the no-go zone now, in a minute and in five; a layline's fan holds 80 % of the forecast."), close);
  if (!dialog.open) dialog.showModal();
}

async function begin() {
  map.build();
  settings();
  const inside = await packed();
  /** @type {Hello | null} */
  let hello = inside?.hello ?? null;
  while (hello === null) {
    try {
      hello = /** @type {Hello} */ (await read("/api/hello"));
    } catch {
      page.isUp = false;
      old();
      await new Promise((resolve) => setTimeout(resolve, 2000));
    }
  }
  page.isUp = true;
  page.hello = hello;
  if (hello.takes_orders) orders.build(hello.orders ?? []);
  map.lay(hello.charts ?? []);
  setInterval(old, 1000);
  addEventListener("resize", () => show());
  if (hello.kind === "recorded") await recorded(hello, inside);
  else await live();
  set(document.body, { "data-ready": "1" });
}

void begin();
