// Which frame a view shows, and how its pictures are fetched. Methods of the component in `view.js`.
const KEPT_FRAMES = 16; // decoded, for all cameras
const AHEAD = 4; // frames fetched in the direction of travel
const SIGN_MS = 100; // after which a view says that a frame is on its way
const PREVIEW_MS = 150; // and shows the key frames before it, so that one sees where it goes
const SHRINKS = [4, 2]; // times smaller than the video, as the server has pictures
const sleep = (ms) => new Promise((wake) => setTimeout(wake, ms));

export default {
  refresh() { this.cache.clear(); this.go(this.wanted, true); },
  sharpen() { // what is drawn larger than it was fetched is fetched anew
    if (this.shown && this.shrinks().some((n, i) => n < this.shown.shrinks[i]) && this.sharpened !== this.shown) {
      this.sharpened = this.shown;
      this.refresh();
    }
  },
  show(frame) { this.go(frame); },
  wantedFrame() { return this.wanted; },
  lead(frame, anew) { // as `show`, while nobody has gone elsewhere since it led last
    const follows = anew || this.wanted === this.led;
    this.led = frame;
    if (follows) this.go(frame);
  },
  async fetchPane(pane, frame, shrink, signal, more = "") {
    const answer = await fetch(`${pane.url.replace("{frame}", frame)}&shrink=${shrink}${more}`, { signal });
    const picture = answer.status === 200 ? await createImageBitmap(await answer.blob()) : null;
    return { picture, time_s: answer.headers.get("x-time-s") };
  },
  async fetchOverlay(frame, signal) {
    if (!this.overlay) return { items: [] };
    const answer = await fetch(this.overlay.replace("{frame}", frame), { cache: "no-store", signal });
    return answer.ok ? answer.json() : { items: [] };
  },
  shrinks() { // by how many times each picture may be smaller and still be as large as it is drawn; whole for the loupe
    const ratio = this.ratio();
    return this.layout().map(({ w, scale }) => this.picking ? 1 : SHRINKS.find((n) => w === 0 || n * scale * ratio <= 1) || 1);
  },
  load(frame) {
    if (!this.cache.has(frame)) {
      const stop = new AbortController(), { signal } = stop, shrinks = this.shrinks();
      const parts = [this.fetchOverlay(frame, signal), ...this.panes.map((pane, i) => this.fetchPane(pane, frame, shrinks[i], signal))];
      const all = Promise.all(parts).then(([overlay, ...answers]) => {
        const time_s = answers[0]?.time_s ?? null; // the same for all panes
        return { frame, overlay, shrinks, pictures: answers.map((each) => each.picture), time_s: time_s === null ? null : Number(time_s) };
      });
      this.cache.set(frame, all);
      this.underway.set(frame, stop);
      all.catch(() => this.cache.get(frame) === all && this.cache.delete(frame)).finally(() => this.underway.delete(frame));
      for (const old of this.cache.keys()) {
        if (this.cache.size <= KEPT_FRAMES) break;
        if (old !== frame && old !== this.wanted) this.cache.delete(old);
      }
    }
    return this.cache.get(frame);
  },
  async preview(frame, hurries) { // veiled until the frame is there: what was in view, then, small, the last key frames before it
    const { signal } = (this.previewing = new AbortController()), begun = performance.now();
    if (!hurries) {
      await sleep(SIGN_MS);
      if (signal.aborted) return;
      this.coarse = this.shown.pictures;
      this.draw();
      await sleep(PREVIEW_MS - SIGN_MS);
      if (signal.aborted) return;
    }
    const answers = await Promise.all(this.panes.map((pane) => this.fetchPane(pane, frame, SHRINKS[0], signal, "&near=true"))).catch(() => null);
    if (!answers || signal.aborted) return;
    this.coarse = answers.map(({ picture }) => picture);
    this.draw();
    this.canvas.dataset.coarseMs = (performance.now() - begun).toFixed(1);
  },
  giveUp() { this.previewing?.abort(); this.coarse = null; this.draw(); },
  async go(frame, silent) {
    frame = Math.max(0, Math.min(this.n_frames - 1, Math.round(frame)));
    const direction = Math.sign(frame - this.wanted) || 1;
    const begun = performance.now(), hurries = this.wanted !== this.seen(); // it overtakes another: a slider is drawn
    if (frame !== this.wanted) this.unanswered = 0; // steps of a mark were those of the frame before
    this.wanted = frame;
    for (const [other, stop] of this.underway) // what was fetched ahead of another place only stands in the way
      if (Math.abs(other - frame) > AHEAD) { this.cache.delete(other); stop.abort(); }
    if (!silent && !this.apart) window.dispatchEvent(new CustomEvent("airborne-frame", { detail: { frame, from: this } }));
    this.previewing?.abort();
    if (this.shown && Math.abs(frame - this.shown.frame) > AHEAD && !this.cache.has(frame)) this.preview(frame, hurries); // first in the queue
    let loaded = null;
    try { loaded = await this.load(frame); } catch { return this.wanted === frame && this.giveUp(); }
    if (this.wanted !== frame) return;
    this.previewing?.abort();
    [this.shown, this.coarse] = [loaded, null];
    this.draw();
    this.canvas.dataset.frame = frame;
    this.canvas.dataset.ms = (performance.now() - begun).toFixed(1);
    this.$emit("frame", { frame });
    window.dispatchEvent(new CustomEvent("airborne-shown", { detail: { frame, time_s: loaded.time_s, from: this } }));
    for (let k = 1; k <= AHEAD && this.wanted === frame; k++) {
      const next = frame + k * direction;
      if (next >= 0 && next < this.n_frames) await this.load(next).catch(() => {});
    }
  },
  seen() { return this.shown ? this.shown.frame : this.wanted; }, // what is done here is done to this frame
};
