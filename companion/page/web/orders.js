// Orders: only with the token, only what the mission permits, and a plan is seen before it is confirmed.
import { el, get, set } from "./dom.js";
import { distance, duration, percent, position } from "./format.js";
import { onGlobe, pick, showPreview } from "./map.js";

/** @typedef {import("../../view/view").View} View @typedef {import("./geometry.js").Point} Point */
/** @typedef {{error: string | null, order?: string, way_en_m?: Point[], risks?: (number | null)[], time_s?: number, late_s?: number | null, length_m?: number, risk?: number | null, tacks?: number, gybes?: number, clearance_m?: number | null}} Preview */

const WORDS = /** @type {Record<string, string>} */ ({ hold: "Hold here", go_on: "Go on", goal: "Sail to…", refuge: "Refuge", home: "Home", replan: "Plan again", skip_goal: "Skip goal", stop: "Give up", why: "Why?", forget_shoal: "Forget shoal" });
const MEANS = /** @type {Record<string, string>} */ ({
  hold: "She loiters here, where there is room near by, until told to go on.", go_on: "The order that stands ends: on to the next goal.", skip_goal: "The goal that is next is given up for the one behind it.",
  stop: "Nothing more is asked of the boat until told to go on: what is on board the autopilot sails on.", replan: "A new plan is made from where she is.", refuge: "She sails to the refuge and stays there until told to go on.",
  home: "She sails to where she was armed and stays there until told to go on.", goal: "She sails to that place, then on to the goals that are left.", forget_shoal: "The nearest shoal that the sounder found is water again." });
const SHOWN = ["hold", "go_on", "goal", "refuge", "home", "replan", "stop"];
const PLANNED = new Set(["goal", "refuge", "home"]);

let token = "";
/** @type {string[]} */ let permitted = [];
/** @type {View | null} */ let view = null;
const dialog = /** @type {HTMLDialogElement} */ (get("dialog"));

/** @param {string[]} orders */
export function build(orders) {
  permitted = SHOWN.filter((verb) => orders.includes(verb));
  try { token = sessionStorage.getItem("token") ?? ""; } catch { /* a browser without storage asks each time */ }
  const box = get("orders");
  box.hidden = false;
  const buttons = permitted.map((verb) => {
    const button = el("button", { type: "button", "data-verb": verb, class: verb === "stop" ? "grave" : "" }, WORDS[verb] ?? verb);
    button.addEventListener("click", () => void wanted(verb));
    return button;
  });
  const none = "The mission permits no orders on board: [operator] local_orders.";
  box.replaceChildren(el("article", {}, el("h2", {}, "Orders"), el("p", { id: "standing", class: "quietly" }, "None stands."), el("div", { class: "buttons", role: "group", "aria-label": "Orders" }, ...buttons),
    el("p", { id: "answer", role: "status" }, permitted.length ? "" : none)));
}

/** @param {View | null} now */
export function show(now) {
  view = now;
  const box = document.getElementById("standing");
  if (box === null || now === null) return;
  const standing = now.orders.standing;
  const words = standing ? `${standing.words}, of ${standing.by || "somebody"}, for ${duration(standing.age_s)}` : "None stands.";
  if (box.textContent !== words) box.textContent = words;
  box.classList.toggle("stands", standing !== null);
}

/** @param {string} words */
function answered(words) {
  const box = document.getElementById("answer");
  if (box) box.textContent = words;
}

/** @param {string} verb */
async function wanted(verb) {
  // a plan that waits to be confirmed leaves the buttons free: what was asked for last is what is meant
  if (dialog.open) await new Promise((resolve) => { dialog.addEventListener("close", resolve, { once: true }); dialog.close(); });
  if (verb === "goal") {
    answered("Click the chart where she should sail to; Esc ends it.");
    pick((en) => {
      const globe = onGlobe(en);
      if (globe) void confirm("goal", `goal ${globe[0].toFixed(6)} ${globe[1].toFixed(6)}`, position(globe[0], globe[1]));
    });
    return;
  }
  if (verb === "refuge") {
    const refuges = view?.refuges ?? [];
    if (refuges.length > 1) return chooseRefuge(refuges.map((r) => r.name));
  }
  await confirm(verb, verb, "");
}

/** @param {string[]} names */
function chooseRefuge(names) {
  const cancel = el("button", { type: "button" }, "Cancel");
  cancel.addEventListener("click", () => dialog.close());
  const buttons = ["the nearest", ...names].map((name, n) => {
    const button = el("button", { type: "button" }, name || `refuge ${n}`);
    button.addEventListener("click", () => { dialog.close(); void confirm("refuge", n === 0 ? "refuge" : `refuge ${n}`, name); });
    return button;
  });
  dialog.replaceChildren(el("h2", { id: "dialogtitle" }, "Which refuge?"), el("div", { class: "buttons column" }, ...buttons, cancel));
  dialog.showModal();
}

/** @param {string} verb @param {string} words @param {string} where */
async function confirm(verb, words, where) {
  if (!token && !(await askToken())) return;
  const give = el("button", { type: "button", class: "primary", id: "confirm" }, "Give the order");
  const cancel = el("button", { type: "button" }, "Cancel");
  const preview = el("div", { id: "preview", role: "status" }, PLANNED.has(verb) ? "The plan is being made…" : "");
  dialog.replaceChildren(el("h2", { id: "dialogtitle" }, WORDS[verb] ?? verb, where ? el("small", {}, ` ${where}`) : ""), el("p", {}, MEANS[verb] ?? ""), preview, el("div", { class: "buttons" }, give, cancel));
  cancel.addEventListener("click", () => dialog.close());
  give.addEventListener("click", async () => {
    set(give, { disabled: true });
    const answer = await post("/api/order", words);
    dialog.close();
    if (answer) answered(answer.error ? `Refused: ${answer.error}` : `${words}: ${answer.result}. ${answer.text}`);
  });
  dialog.addEventListener("close", () => showPreview(null), { once: true });
  if (PLANNED.has(verb)) set(give, { disabled: true });
  // not in the way of the chart, where the way is shown
  if (PLANNED.has(verb)) dialog.show(); else dialog.showModal();
  if (!PLANNED.has(verb)) return give.focus();
  const stands = () => dialog.open && preview.isConnected;  // not cancelled meanwhile, nor another asked for
  for (let tries = 0; tries < 4 && stands(); tries++) {
    const found = /** @type {Preview | null} */ (await post("/api/preview", words));
    if (found === null || !stands()) return;
    if (found.error?.includes("again in a moment")) { await new Promise((resolve) => setTimeout(resolve, 1200)); continue; }
    if (found.error) return preview.replaceChildren(el("p", { class: "warn" }, found.error));
    showPreview({ way: found.way_en_m ?? [], risks: found.risks ?? [] });
    const facts = [["way", distance(found.length_m)], ["time", `${duration(found.time_s)}${found.late_s ? `, nine of ten ${duration(found.late_s)}` : ""}`], ["tacks, gybes", `${found.tacks}, ${found.gybes}`], ["off the plan", percent(found.risk)], ["beyond the margin", distance(found.clearance_m)]];
    preview.replaceChildren(el("dl", { class: "facts" }, ...facts.map(([name, value]) => el("div", {}, el("dt", {}, name ?? ""), el("dd", {}, value ?? "")))));
    set(give, { disabled: null });
    give.focus();
    return;
  }
  preview.replaceChildren(el("p", { class: "warn" }, "The planner has no time now; cancel, and try again."));
}

/** @returns {Promise<boolean>} whether there is one */
function askToken() {
  const field = /** @type {HTMLInputElement} */ (el("input", { type: "password", id: "token", autocomplete: "off", "aria-label": "Token" }));
  const says = el("p", { id: "tokenanswer", role: "status", class: "warn" });
  const ok = el("button", { type: "submit", class: "primary" }, "Use it");
  const cancel = el("button", { type: "button" }, "Cancel");
  const form = el("form", { method: "dialog" }, el("h2", { id: "dialogtitle" }, "Token"), el("p", {}, "Orders need the token in the file that --http-token names, on board. It is kept until this window is closed."), field, says, el("div", { class: "buttons" }, ok, cancel));
  dialog.replaceChildren(form);
  dialog.showModal();
  return new Promise((resolve) => {
    cancel.addEventListener("click", () => dialog.close());
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      token = field.value.trim();
      const { error } = await post("/api/token", "");
      if (error) {
        token = "";
        says.textContent = `Refused: ${error}`;
        return field.select();
      }
      try { sessionStorage.setItem("token", token); } catch { /* kept in this page alone */ }
      dialog.close();
    });
    dialog.addEventListener("close", () => resolve(token !== ""), { once: true });
  });
}

/** @param {string} path @param {string} order @returns {Promise<any>} */
async function post(path, order) {
  try {
    const answer = await fetch(path, { method: "POST", body: JSON.stringify({ order }), headers: { "Content-Type": "application/json", "X-Companion": "1", Authorization: `Bearer ${token}` } });
    const found = await answer.json();
    if (answer.status === 401) { token = ""; try { sessionStorage.removeItem("token"); } catch { /* none */ } }
    return found;
  } catch {
    return { error: "the companion is not reached" };
  }
}

/** Give a choice of a place up. */
export function cancel() {
  pick(null);
  answered("");
}
