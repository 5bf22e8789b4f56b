// Where views come from: a companion that speaks, a voyage on record, or one packed into this very file.

/** @typedef {import("../../view/view").View} View @typedef {import("../../view/view").Area} Area @typedef {import("../../view/view").Past} Past @typedef {import("../../view/view").Event} LogEvent */
/** @typedef {{schema: string, version: string, kind: "live" | "radio" | "recorded", name: string, orders: string[] | null, takes_orders: boolean, charts?: import("./charts.js").Chart[], passage?: boolean, passage_said?: string, count: number | null, chunk: number | null, area: string | null, sails_s?: number | null, beside?: string | null}} Hello */
/** @typedef {{name: string, sails_s: number | null, past: Past, figures: import("../../view/view").Figures | null}} Beside */
/** @typedef {{view: (view: View) => void, log: (event: LogEvent) => void, link: (isUp: boolean) => void, over: () => void}} Hears */
/** @typedef {{hello: Hello, area: Area | null, past: any, log: LogEvent[], moments: string[], beside?: Beside, passage?: import("../../view/view").Passage}} Packed */

/** @param {string} path @returns {Promise<any>} */
export async function read(path) {
  const answer = await fetch(path, { headers: { Accept: "application/json" } });
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
}

/** @param {string} base64 @returns {Promise<any>} */
async function unpack(base64) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).json();
}

/** The voyage in this file, null: it holds none. @returns {Promise<Packed | null>} */
export async function packed() {
  const holder = document.getElementById("voyage");
  return holder === null ? null : unpack(holder.textContent ?? "");
}

/** Follow a companion; while the page is hidden the link is closed, for a browser has six of them only.
 * @param {Hears} hears */
export function follow(hears) {
  /** @type {EventSource | null} */
  let source = null;
  let last = 0;
  const open = () => {
    if (source !== null || document.hidden) return;
    source = new EventSource("/api/stream");
    source.addEventListener("open", () => hears.link(true));
    source.addEventListener("error", () => {
      hears.link(false);
      // a browser gives up on an answer that is no stream (the companion is away, or too many watch): try again
      if (source?.readyState === EventSource.CLOSED) { source = null; setTimeout(open, 2000); }
    });
    source.addEventListener("view", (event) => { last = performance.now(); hears.view(JSON.parse(event.data)); });
    source.addEventListener("log", (event) => hears.log(JSON.parse(event.data)));
    // the companion has ended: the next voyage's may answer at the same address
    source.addEventListener("over", () => { source?.close(); source = null; last = 0; hears.over(); setTimeout(open, 5000); });
  };
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) { source?.close(); source = null; } else open();
  });
  addEventListener("pagehide", () => { source?.close(); source = null; });
  addEventListener("pageshow", () => open());
  open();
  // a link that died without a word (a cable, a sleeping phone) is begun again
  setInterval(() => {
    if (source !== null && last > 0 && performance.now() - last > 20000) { source.close(); source = null; hears.link(false); last = performance.now(); open(); }
  }, 2000);
}

/** A recorded voyage: views by their number, fetched by chunks. */
export class Moments {
  /** @param {number} count @param {number} size @param {string[] | null} inside */
  constructor(count, size, inside) {
    this.count = count;
    this.size = size;
    this.inside = inside;
    /** @type {Map<number, View[]>} */
    this.known = new Map();
    /** @type {Map<number, Promise<void>>} */
    this.coming = new Map();
  }

  /** The view of a number where it is at hand; it is fetched where it is not. @param {number} n @returns {View | null} */
  at(n) {
    const chunk = Math.floor(n / this.size);
    void this.fetch(chunk);
    if (n % this.size > this.size / 2) void this.fetch(chunk + 1);
    return this.known.get(chunk)?.[n % this.size] ?? null;
  }

  /** @param {number} chunk @returns {Promise<void>} */
  fetch(chunk) {
    if (chunk * this.size >= this.count || this.known.has(chunk)) return Promise.resolve();
    const coming = this.coming.get(chunk) ?? this.bring(chunk);
    this.coming.set(chunk, coming);
    return coming;
  }

  /** @param {number} chunk */
  async bring(chunk) {
    try {
      const views = this.inside === null ? await read(`/api/moments/${chunk}`) : await unpack(this.inside[chunk] ?? "");
      if (this.known.size > 40) this.known.delete([...this.known.keys()][0] ?? -1);
      this.known.set(chunk, views);
    } finally {
      this.coming.delete(chunk);
    }
  }
}
