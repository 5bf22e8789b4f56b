// The timeline of a recorded voyage: played to 60 times, moved by hand and by keys, decisions as ticks.
import { get, picture, set, svg } from "./dom.js";
import { clock, duration } from "./format.js";
import { isDecision } from "./log.js";

/** @typedef {import("../../view/view").View} View @typedef {import("../../view/view").Event} LogEvent */

export class Timeline {
  /** @param {number[]} times @param {LogEvent[]} events @param {(n: number) => void} moved */
  constructor(times, events, moved) {
    this.times = times;
    this.moved = moved;
    this.at = 0;
    this.isPlaying = false;
    this.clock_s = times[0] ?? 0;
    this.last = 0;
    this.stops = [...new Set(events.filter(isDecision).map((e) => this.index(e.t_s)))].sort((a, b) => a - b);
    this.slider = /** @type {HTMLInputElement} */ (get("moment"));
    this.slider.max = String(Math.max(0, times.length - 1));
    this.slider.addEventListener("input", () => this.go(Number(this.slider.value)));
    get("play").addEventListener("click", () => this.play(!this.isPlaying));
    get("before").addEventListener("click", () => this.jump(-1));
    get("after").addEventListener("click", () => this.jump(1));
    get("timeline").hidden = false;
    document.body.classList.add("recorded");
    this.ticks(events);
  }

  /** @param {number} t_s */
  index(t_s) {
    let low = 0, high = this.times.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((this.times[middle] ?? 0) < t_s - 0.05) low = middle + 1; else high = middle;
    }
    return Math.max(0, low);
  }

  /** @param {number} n */
  go(n) {
    this.at = Math.min(this.times.length - 1, Math.max(0, Math.round(n)));
    this.clock_s = this.times[this.at] ?? 0;
    this.slider.value = String(this.at);
    this.moved(this.at);
  }

  /** @param {number} by */
  step(by) {
    this.play(false);
    this.go(this.at + by);
  }

  /** To the next decision, or the one before. @param {1 | -1} way */
  jump(way) {
    this.play(false);
    const next = way > 0 ? this.stops.find((n) => n > this.at) : [...this.stops].reverse().find((n) => n < this.at);
    if (next !== undefined) this.go(next);
  }

  /** @param {boolean} plays */
  play(plays) {
    if (plays && this.at >= this.times.length - 1) this.go(0);
    this.isPlaying = plays;
    set(get("play"), { "aria-pressed": plays ? "true" : "false", "aria-label": plays ? "Pause" : "Play" });
    get("play").textContent = plays ? "❚❚" : "▶";
    this.last = performance.now();
    if (plays) requestAnimationFrame((now) => this.run(now));
  }

  /** @param {number} now */
  run(now) {
    if (!this.isPlaying) return;
    const rate = Number(/** @type {HTMLSelectElement} */ (get("rate")).value);
    this.clock_s += rate * Math.min(0.5, (now - this.last) / 1000);
    this.last = now;
    let n = this.at;
    while (n < this.times.length - 1 && (this.times[n + 1] ?? 0) <= this.clock_s) n += 1;
    if (n !== this.at) {
      this.at = n;
      this.slider.value = String(n);
      this.moved(n);
    }
    if (n >= this.times.length - 1) return this.play(false);
    requestAnimationFrame((next) => this.run(next));
  }

  /** @param {LogEvent[]} events */
  ticks(events) {
    const most = Math.max(1, this.times.length - 1);
    const ticks = picture("ticks");
    set(ticks, { viewBox: "0 0 1000 14", preserveAspectRatio: "none" });
    ticks.replaceChildren(...events.filter(isDecision).map((event) => {
      const x = (1000 * this.index(event.t_s) / most).toFixed(1);
      return svg("path", { class: `${event.kind} ${event.level}`, d: `M${x} 1V13` });
    }));
  }

  /** @param {View} view */
  words(view) {
    const begin = this.times[0] ?? 0, end = this.times[this.times.length - 1] ?? 0;
    get("elapsed").textContent = `${clock(view.unix_s, view.t_s)}  ${duration(view.t_s - begin)} of ${duration(end - begin)}`;
    set(this.slider, { "aria-valuetext": `${duration(view.t_s - begin)} of ${duration(end - begin)}` });
  }
}
