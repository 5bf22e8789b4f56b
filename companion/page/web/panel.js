// State, alarms, figures and tables.
import { el, get, renew, say, sketch, table } from "./dom.js";
import { atBow, bearing, bearingUnit, clock, distance, drying, duration, figure, NONE, percent, position, speed, speedUnit } from "./format.js";
import { riskClass } from "./geometry.js";

/** @typedef {import("../../view/view").View} View */

const OLD_S = 5;

/** @param {View | null} view @param {string} kind @param {import("./feed.js").Beside | null} [beside] @param {import("../../view/view").Area | null} [area] */
export function show(view, kind, beside = null, area = null) {
  say("name", view?.name || "Companion");
  const title = view ? `${view.name}: ${view.state.phase}` : "Companion";
  if (document.title !== title) document.title = title;
  say("kind", { live: "live", radio: "by radio", recorded: "recorded" }[kind] ?? kind);
  say("phase", view?.state.phase ?? "not heard");
  get("phase").dataset.phase = view?.state.phase ?? "";
  say("why", view ? [view.state.why, view.state.task].filter(Boolean).join(" · ") : "");
  say("mode", view?.state.mode ? `${view.state.mode}${view.state.is_armed === false ? ", disarmed" : view.state.is_armed ? ", armed" : ""}` : NONE);
  say("clock", view ? clock(view.unix_s, view.t_s) : NONE);
  alarms(view);
  figures(view);
  plan(view);
  tables(view, beside, area);
}

/** How old the data are, with what has passed since they came. @param {View | null} view @param {number} since_s @param {boolean} isLost @param {boolean} [isOver] */
export function age(view, since_s, isLost, isOver = false) {
  const age_s = view && view.age_s !== null ? view.age_s + since_s : null;
  const isOld = isLost || isOver || (age_s !== null && age_s > OLD_S);
  say("age", age_s === null ? NONE : age_s < 2 ? "now" : `${duration(age_s)} old`);
  document.body.classList.toggle("stale", isOld);
  const strip = get("stale");
  strip.hidden = !isOld;
  if (isOld) {
    const words = isOver ? `The companion has ended. What is shown is ${age_s === null ? "of before" : `${duration(age_s)} old`}` : isLost ? `No link to the companion. What is shown is ${age_s === null ? "not" : duration(age_s)} old` : `Data ${duration(age_s)} old: the boat is not heard`;
    if (strip.textContent !== words) strip.textContent = words;
  }
}

/** @param {View | null} view */
function alarms(view) {
  const wanted = (view?.alarms ?? []).map((alarm) => ({ key: `${alarm.code}|${alarm.level}`, ...alarm }));
  const box = get("alarms");
  const have = new Map([...box.children].map((child) => [/** @type {HTMLElement} */ (child).dataset.key, child]));
  for (const [key, child] of have) if (!wanted.some((a) => a.key === key)) child.remove();
  for (const alarm of wanted) {
    const known = have.get(alarm.key);
    // the age runs on; only the words are read out
    const words = alarm.text;
    if (known) {
      const text = known.querySelector("p");
      if (text && text.textContent !== words) text.textContent = words;
      const since = known.querySelector("time");
      if (since) since.textContent = duration(alarm.age_s);
    } else {
      box.append(el("div", { class: `alarm ${alarm.level}`, "data-key": alarm.key }, el("strong", {}, alarm.level), el("p", {}, words), el("time", { "aria-hidden": "true" }, duration(alarm.age_s))));
    }
  }
}

const THERE = "The time until the next goal is reached, at the pace that the boat has lately kept; in nine cases of ten it is there by the second figure.";
const NOT_THERE = "No time is told while the way on board is not being sailed, or where it does not lead to the next goal; the plan's own times are of when it was judged.";
const TACK = "At the end of the leg that is sailed; 'about' is the autopilot's own, on a leg that it beats, which goes with the wind, or one behind a waypoint, where a new plan may change it.";
const JUDGED = "When the plan was made, or last held against a new one and kept: wind and times beside it are of then.";
const BEAT = "A beat: the autopilot tacks by itself along this line, so the line may lie in the no-go zone.";
const OFF_PLAN = "The chance that the boat is forced off the plan before the next goal: that the wind makes it tack or bear away unplanned, or that a vessel comes too near.";

/** @param {string} name @param {string} value @param {string} unit @param {string} [kind] @param {string} [hint] */
function one(name, value, unit, kind = "", hint = "") {
  const about = value.startsWith("about ") ? [sketch("small", {}, "about ")] : [];   // a small word, for the figure has no room beside a large one
  return sketch("div", hint ? { class: kind, title: hint } : { class: kind }, sketch("dt", {}, name), sketch("dd", {}, ...about, about.length ? value.slice(6) : value, value === NONE || !unit ? "" : sketch("small", {}, ` ${unit}`)));
}

/** A clearance; below nought it is how far she is where she must not be. @param {number | null | undefined} metres */
function clearance(metres) {
  return metres != null && metres < -0.05 ? `${distance(-metres)} inside an obstacle or outside the fence` : distance(metres);
}

/** A figure of the table, by its kind. @param {import("../../view/view").Figure} f */
function shown(f) {
  const [text, unit] = f.kind === "speed" ? [speed(f.value), speedUnit()] : f.kind === "distance" ? [distance(f.value), ""] : f.kind === "time" ? [duration(f.value), ""]
    : f.kind === "bearing" ? [bearing(f.value), bearingUnit()] : f.kind === "angle" ? [atBow(f.value), ""] : f.kind === "share" ? [percent(f.value), ""] : [figure(f.value, 1), ""];
  return one(f.label, text ?? NONE, unit ?? "", "", f.hint);
}

/** @param {View | null} view */
function figures(view) {
  const boat = view?.boat, wind = view?.wind, plan = view?.plan;
  const tack = boat?.tack ?? "";
  renew(get("figures"), [
    one("TWA", atBow(wind?.twa_deg), "", tack), one("AWA", atBow(wind?.awa_deg), "", tack),
    one("AWS", speed(wind?.aws_mps), speedUnit()), ...(view?.shown ?? []).map(shown),
    one("COG", bearing(boat?.cog_deg), bearingUnit()), one("to mark", distance(boat?.goal_m), ""),
    one("TWD σ 1 min", wind?.sigma_deg == null ? NONE : `±${figure(wind.sigma_deg, 0)}°`, ""), one("clearance", distance(boat?.clearance_m), ""),
    one("next tack", `${plan?.next_tack_is_planned === false ? "about " : ""}${duration(plan?.next_tack_s)}`, "", "", TACK), one("there in", duration(plan?.there_s), "", "", plan?.there_s == null ? NOT_THERE : THERE), one("off the plan", percent(plan?.path_risk), "", "", OFF_PLAN),
    one("off the leg", boat?.cross_track_m == null ? NONE : `${figure(Math.abs(boat.cross_track_m), 1)} m ${boat.cross_track_m < -0.05 ? "L" : boat.cross_track_m > 0.05 ? "R" : ""}`, ""),
    ...(view?.water?.is_planned ? [one("current", `${bearing(view.water.set_deg)} ${speed(view.water.drift_mps)}`, speedUnit())] : []),
    one("battery", figure(boat?.battery_v, 1), boat?.battery_share == null ? "V" : `V ${percent(boat.battery_share)}`)]);
}

/** @param {View | null} view */
function plan(view) {
  const p = view?.plan;
  say("planwhy", p ? p.why || "The plan in force gives no reason." : view ? "There is no plan." : "");
  const facts = !p ? [] : [
    ["plan", `${p.number ?? NONE}${p.reason ? `, for ${p.reason.replaceAll("_", " ")}` : ""}`], ["judged", p.age_s === null ? NONE : `${duration(p.age_s)} ago`, JUDGED],
    ["in a wind of", p.twd_from_deg === null ? NONE : `${bearing(p.twd_from_deg)} ${speed(p.tws_mps)} ${speedUnit()}`],
    ["time from then", p.cost_s === null ? NONE : `${duration(p.cost_s)}${p.bound_s ? `, no less than ${duration(p.bound_s)}` : ""}`],
    ["as wind and boat may be", p.median_s === null ? NONE : `${duration(p.median_s)}, nine of ten ${p.late_s === null ? "not in any time" : duration(p.late_s)}`],
    ["there in", p.there_s === null ? `${NONE} (not under way to it)` : `${duration(p.there_s)}, nine of ten ${duration(p.there_late_s)}`, p.there_s === null ? NOT_THERE : THERE], ["off the plan", percent(p.path_risk), OFF_PLAN],
    ["margin", distance(p.margin_m)], ["clearance expected", clearance(p.expected_clearance_m)], ["leg", `${p.leg ?? NONE} of ${p.count ?? NONE}`],
    ...(p.rung ? [["found by", p.rung]] : []), ...(p.bound_for ? [["bound for", p.bound_for]] : [])];
  renew(get("planfacts"), facts.map(([name, value, hint]) => sketch("div", hint ? { title: hint } : {}, sketch("dt", {}, name ?? ""), sketch("dd", {}, value ?? ""))));
  const legs = p?.legs ?? [];
  const first = p?.leg ?? (p?.count ?? legs.length) - legs.length + 1;
  renew(get("plantable"), [table("Legs that are left; spare: to the nearest obstacle, fence or mark, beyond what is kept clear of it", ["leg", "off plan", "course", "TWA", "length", "no-go", "spare"], legs.map((leg, n) => [
    leg.is_loiter ? `${first + n} loiter` : sketch("span", leg.is_beat ? { title: BEAT } : {}, `${first + n} ${[leg.manoeuvre, leg.is_beat ? "beat" : ""].filter(Boolean).join(", ")}`), sketch("span", { class: `risk r${riskClass(leg.risk)}` }, percent(leg.risk)),
    bearing(leg.course_deg), atBow(leg.twa_deg), leg.is_loiter ? NONE : distance(leg.length_m), leg.is_beat ? NONE : figure(leg.no_go_half_deg, 0, "°"), distance(leg.clearance_m)]))]);
}

/** @param {View | null} view @param {import("./feed.js").Beside | null} beside @param {import("../../view/view").Area | null} area */
function tables(view, beside, area) {
  renew(get("vesseltable"), [table("Vessels", ["vessel", "range", "bearing", "CPA", "in", "alarm", "we must", "report"], (view?.vessels ?? []).map((v) => [
    v.name, distance(v.range_m), bearing(v.bearing_deg), distance(v.cpa_m), v.cpa_s === null ? "opening" : duration(v.cpa_s),
    sketch("span", { class: `grade ${v.alarm || "none"}` }, v.alarm || NONE), v.role ? `${v.role}${v.rule ? ` (${v.rule})` : ""}` : NONE, v.age_s === null ? NONE : `${duration(v.age_s)} old`]))]);
  const wind = view?.wind, zone = view?.no_go;
  renew(get("windtable"), [table(`Forecast${zone ? `; the no-go zone holds with ${percent(zone.probability)}` : ""}`, ["in", "TWD", "σ", "80 %", "95 %", `TWS ${speedUnit()}`, "no-go"], (wind?.bands ?? []).map((band) => {
    const wedge = zone?.wedges.find((w) => w.horizon_s === band.horizon_s);
    const half = (/** @type {number} */ level) => { const n = wind?.levels.indexOf(level) ?? -1; return n < 0 ? NONE : `±${figure(band.half_deg[n], 0)}°`; };
    return [band.horizon_s === 0 ? "now" : duration(band.horizon_s), bearing(band.twd_from_deg), figure(band.sigma_deg, 1, "°"), half(0.8), half(0.95), `${speed(band.tws_mps)} ± ${speed(band.tws_sigma_mps)}`,
      wedge ? `±${figure(wedge.half_deg, 0)}° (+${figure(wedge.widening_deg, 0)}°)` : NONE];
  }))]);
  renew(get("goaltable"), [table("Goals and places", ["place", "kind", "distance", "bearing"], [
    ...(view?.goals ?? []).map((g) => [g.name, `${g.kind}${g.side ? `, to ${g.side}` : ""}${g.is_reached ? ", reached" : g.is_next ? ", next" : ""}`, distance(g.distance_m), bearing(g.bearing_deg)]),
    ...(view?.refuges ?? []).map((r) => [r.name || "refuge", "refuge", NONE, NONE]),
    ...(area?.drying ?? []).map((w) => [w.name, `dries: ${drying(w.solid_unix_s, view?.unix_s).words}`, NONE, NONE]),
    ...(view && view.boat.lat_deg !== null && view.boat.lon_deg !== null ? [["boat", position(view.boat.lat_deg, view.boat.lon_deg), NONE, NONE]] : [])])]);
  renew(get("healthtable"), [table("Health of every part", ["part", "is", "says", "age"], (view?.health ?? []).map((part) => [
    part.name, sketch("span", { class: `grade ${part.grade}` }, part.grade), part.text || NONE, part.age_s === null ? NONE : duration(part.age_s)]))]);
  const all = [view?.figures ?? null, ...(beside ? [beside.figures] : [])];
  const entries = sketch("span", { title: "5° inside the autopilot's SAIL_NO_GO_ANGLE for 5 s on end" }, "no-go entries");
  /** @type {[string | import("./dom.js").Sketch, (f: import("../../view/view").Figures) => string][]} */
  const rows = [
    ["time under way", (f) => duration(f.time_s)], ["distance", (f) => distance(f.distance_m)], ["tacks, gybes", (f) => `${f.tacks ?? NONE}, ${f.gybes ?? NONE}`],
    ["plans made, asked for anew", (f) => `${f.plans ?? NONE}, ${f.replans ?? NONE}`], ["least clearance, expected", (f) => `${clearance(f.min_clearance_m)}, ${clearance(f.promised_clearance_m)}`], ["contacts", (f) => figure(f.contacts)],
    [entries, (f) => figure(f.no_go_entries)], ["goals reached", (f) => `${f.goals_reached ?? NONE} of ${f.goals ?? NONE}`]];
  renew(get("voyagetable"), [table("The voyage so far", ["figure", "value", ...(beside ? [`beside: ${beside.name}, at its end`] : [])],
    view ? rows.map(([name, show]) => [name, ...all.map((f) => f === null ? NONE : show(f))]) : [])]);
}
