"use strict";
// The picture: arrows, fans, the band of the trajectory, the boat that is dragged, the wind that is turned.
(() => {
  /** @typedef {{field: Field, other: {name: string, field: Field} | null, title: string, words: string[], solid: Vec[][], fence: Vec[][], boat: Vec, place: Vec, radius: number, centre: Vec, half: number, wind: Wind, marks: {kind: string, name: string, at: Vec, to?: Vec, radius?: number, rings?: Vec[][]}[]}} Page */
  /** @param {string} id */
  const get = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
  const page = /** @type {Page} */ (JSON.parse(get("data").textContent ?? "{}"));
  const { half, centre } = page, SVG = "http://www.w3.org/2000/svg", COUNT = 23, SIZE = 1000;
  const chart = /** @type {SVGSVGElement} */ (/** @type {unknown} */ (get("chart"))), rose = /** @type {SVGSVGElement} */ (/** @type {unknown} */ (get("rose")));
  const input = (/** @type {string} */ id) => /** @type {HTMLInputElement} */ (get(id));
  let field = page.field, wind = page.wind, boat = page.boat, q = 1;

  /** @param {Vec} p @returns {Vec} */
  const on = (p) => [(p[0] - centre[0] + half) / (2 * half) * SIZE, (centre[1] + half - p[1]) / (2 * half) * SIZE];
  /** @param {string} name @param {Record<string, string | number>} attributes @param {string} [text] */
  function svg(name, attributes, text) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
    if (text !== undefined) made.textContent = text;
    return made;
  }
  /** @param {Vec[]} points @param {boolean} closed */
  const path = (points, closed) => points.map((p, i) => `${i ? "L" : "M"}${on(p).map((x) => x.toFixed(1)).join(" ")}`).join("") + (closed ? "Z" : "");
  /** @param {Vec} p @param {number} h @param {number} size */
  function arrow(p, h, size) {
    const [x, y] = on(p), s = Math.sin(h), c = -Math.cos(h), ex = x + size * s, ey = y + size * c, b = Math.min(9, 0.45 * size);
    return `M${x.toFixed(1)} ${y.toFixed(1)}L${ex.toFixed(1)} ${ey.toFixed(1)}M${(ex - b * Math.sin(h - 0.45)).toFixed(1)} ${(ey + b * Math.cos(h - 0.45)).toFixed(1)}L${ex.toFixed(1)} ${ey.toFixed(1)}L${(ex - b * Math.sin(h + 0.45)).toFixed(1)} ${(ey + b * Math.cos(h + 0.45)).toFixed(1)}`;
  }
  /** @param {Vec} p */
  const ashore = (p) => page.solid.some((ring) => within([ring], p)) || (page.fence.length > 0 && !within(page.fence, p));

  function drawChart() {
    const back = [], arrows = { field: "", turned: "" };
    let fans = "";
    const step = 2 * half / COUNT, pixel = SIZE / COUNT, withFans = input("fans").checked && field.sails;
    for (let i = 0; i < COUNT; i += 1) for (let j = 0; j < COUNT; j += 1) {
      const p = /** @type {Vec} */ ([centre[0] - half + (i + 0.5) * step, centre[1] - half + (j + 0.5) * step]);
      if (ashore(p)) continue;
      const want = wantedAt(field, p, wind), v = sailableAt(field, p, wind, q), strong = norm(v);
      if (strong < LEAST) continue;
      const size = 0.9 * pixel * Math.sqrt(Math.min(strong, 30) / 20), moved = Math.hypot(want[0] - v[0], want[1] - v[1]) > 1e-6 * strong;
      arrows[moved ? "turned" : "field"] += arrow(p, heading(v), size);
      if (withFans) {
        const [low, high] = fanAt(field, p, wind), [x, y] = on(p), r = 0.6 * pixel;
        if (high > low) fans += `M${x} ${y}L${x + r * Math.sin(low)} ${y - r * Math.cos(low)}A${r} ${r} 0 0 1 ${x + r * Math.sin(high)} ${y - r * Math.cos(high)}Z`;
      }
    }
    const zone = zoneIn(field, field.tree, wind), scale = SIZE / (2 * half);
    for (const ring of page.fence) back.push(svg("path", { d: path(ring, true), class: "fence" }));
    for (const ring of page.solid) back.push(svg("path", { d: path(ring, true), class: "land" }));
    if (zone && zone.radius !== undefined) {
      const [x, y] = on(zone.at);
      for (const r of [zone.radius - zone.half, zone.radius + zone.half]) back.push(svg("circle", { cx: x, cy: y, r: r * scale, class: "band" }));
    } else if (zone) {
      const s = Math.sin(need(zone.course)), c = Math.cos(need(zone.course)), far = 6 * half;
      for (const side of [-1, 1]) { const a = zone.at[0] - side * c * zone.half, b = zone.at[1] + side * s * zone.half; back.push(svg("path", { d: path([[a - far * s, b - far * c], [a + far * s, b + far * c]], false), class: "band" })); }
    }
    for (const mark of page.marks) {
      const [x, y] = on(mark.at), away = mark.kind.startsWith("repulsive");
      if (mark.to) back.push(svg("path", { d: path([mark.at, mark.to], false), class: away ? "away" : "lane" }));
      if (mark.rings) for (const ring of mark.rings) back.push(svg("path", { d: path(ring, true), class: "lane dashed" }));
      if (mark.radius) back.push(svg("circle", { cx: x, cy: y, r: mark.radius * scale, class: away ? "away" : "lane" }));
      back.push(svg("text", { x: x + 6, y: y - 6 - (mark.kind === "circle" ? (mark.radius ?? 0) * scale : 0), class: "name" }, mark.name));
    }
    const [gx, gy] = on(page.place), [bx, by] = on(boat), steered = heading(sailableAt(field, boat, wind, q)), turn = steered * 180 / Math.PI;
    chart.replaceChildren(
      ...back, svg("path", { d: fans, class: "fans" }), svg("path", { d: arrows.field, class: "arrow" }), svg("path", { d: arrows.turned, class: "arrow turned" }),
      svg("path", { d: path(wayFrom(field, boat, wind, q, 2 * half), false), class: "way" }),
      svg("circle", { cx: gx, cy: gy, r: page.radius * scale, class: "goal" }), svg("circle", { cx: gx, cy: gy, r: 5, class: "dot" }),
      svg("path", { d: "M0 -20L11 14L0 8L-11 14Z", transform: `translate(${bx} ${by}) rotate(${turn})`, class: "boat" }));
    drawWind();
    drawRose(steered);
  }

  function drawWind() {
    if (!field.sails) return;
    const deg = wind.twd * 180 / Math.PI;
    chart.append(svg("path", { d: "M0 -45L0 45M-11 27L0 45L11 27", transform: `translate(930 80) rotate(${deg})`, class: "wind" }));
  }

  /** @param {number} steered */
  function drawRose(steered) {
    const all = candidates(field, boat, wind), fastest = Math.max(1e-9, ...all.map((c) => c[1])), best = Math.max(1e-9, ...all.map((c) => c[2]));
    const wanted = heading(wantedAt(field, boat, wind)), out = [svg("circle", { r: 100, class: "ring" }), svg("circle", { r: 50, class: "ring" })];
    /** @param {number} h @param {number} r */
    const to = (h, r) => `${(r * Math.sin(h)).toFixed(1)} ${(-r * Math.cos(h)).toFixed(1)}`;
    if (field.sails) {
      out.push(svg("path", { d: `M0 0L${to(wind.twd - field.noGo, 100)}A100 100 0 0 1 ${to(wind.twd + field.noGo, 100)}Z`, class: "nogo" }));
      out.push(svg("path", { d: `M${to(wind.twd, 130)}L${to(wind.twd, 104)}M${to(wind.twd - 0.07, 114)}L${to(wind.twd, 104)}L${to(wind.twd + 0.07, 114)}`, class: "wind" }));
    }
    for (const [h, speed, worth] of all) if (speed > 0) {
      const r = 100 * speed / fastest;
      out.push(svg("path", { d: `M0 0L${to(h - 0.037, r)}L${to(h + 0.037, r)}Z`, fill: `hsl(${75 + 60 * Math.max(0, worth / best)} 55% ${82 - 50 * Math.max(0, worth / best)}%)` }));
    }
    out.push(svg("path", { d: `M0 0L${to(wanted, 112)}`, class: "wanted" }), svg("path", { d: `M0 0L${to(steered, 112)}`, class: "steered" }));
    rose.replaceChildren(...out);
    const strong = norm(wantedAt(field, boat, wind)), degrees = (/** @type {number} */ h) => `${String(Math.round((h * 180 / Math.PI % 360 + 360) % 360) % 360).padStart(3, "0")}°`;
    get("told").textContent = strong < LEAST ? "The field has no value here: she would not be steered by it."
      : `The field says ${degrees(wanted)} (${strong.toFixed(1)} of 10), she is steered ${degrees(steered)}${field.sails ? `, q ${q > 0 ? "+1" : "−1"}` : ""}. Outer ring ${fastest.toFixed(1)} m/s.`;
    get("fromwords").textContent = degrees(wind.twd);
    get("speedwords").textContent = `${wind.tws} m/s`;
  }

  let due = false;
  function draw() {
    q = sideAt(zoneIn(field, field.tree, wind), boat, q);
    if (due) return;
    due = true;
    requestAnimationFrame(() => { due = false; drawChart(); });
  }
  /** @param {Vec} to */
  function move(to) { boat = [Math.max(centre[0] - half, Math.min(centre[0] + half, to[0])), Math.max(centre[1] - half, Math.min(centre[1] + half, to[1]))]; draw(); }
  /** @param {PointerEvent} event */
  function drag(event) {
    const box = chart.getBoundingClientRect();
    move([centre[0] - half + (event.clientX - box.left) / box.width * 2 * half, centre[1] + half - (event.clientY - box.top) / box.height * 2 * half]);
  }
  chart.addEventListener("pointerdown", (event) => { chart.setPointerCapture(event.pointerId); drag(event); });
  chart.addEventListener("pointermove", (event) => { if (chart.hasPointerCapture(event.pointerId)) drag(event); });
  chart.addEventListener("keydown", (event) => {
    const by = /** @type {Record<string, Vec>} */ ({ ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] })[event.key];
    if (by) { event.preventDefault(); move([boat[0] + by[0] * half / 25, boat[1] + by[1] * half / 25]); }
  });
  input("from").addEventListener("input", () => { wind = { ...wind, twd: input("from").valueAsNumber * Math.PI / 180 }; draw(); });
  input("speed").addEventListener("input", () => { wind = { ...wind, tws: input("speed").valueAsNumber }; draw(); });
  input("fans").addEventListener("input", draw);
  get("side").addEventListener("click", () => { q = -q; draw(); });
  const other = page.other;
  if (other) {
    const name = () => { get("other").textContent = field === page.field ? `Sailed by ${other.name}` : "Sailed by the mission's boat"; };
    get("other").hidden = false;
    get("other").addEventListener("click", () => { field = field === page.field ? other.field : page.field; name(); draw(); });
    name();
  }
  input("from").value = String(Math.round(wind.twd * 180 / Math.PI));
  input("speed").value = String(wind.tws);
  document.title = page.title;
  get("title").textContent = page.title;
  get("words").replaceChildren(...page.words.map((text) => { const item = document.createElement("li"); item.textContent = text; return item; }));
  get("sailing").hidden = !field.sails;
  drawChart();
  document.body.dataset.ready = "1";
})();
