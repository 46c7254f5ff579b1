// Curves of a run; the cursor is the frame in view. How they are drawn is the report's: see `drawCurves`.
import { drawCurves, frameAt } from "/parts/curves.js";

export default {
  template: `<canvas class="curves" tabindex="0" role="img" aria-label="curves over time"></canvas>`,
  props: { url: String, start: Number },
  emits: ["frame"],
  mounted() {
    this.canvas = this.$el;
    this.frame = this.start;
    this.onOther = (event) => { this.frame = event.detail.frame; this.draw(); };
    window.addEventListener("airborne-frame", this.onOther);
    for (const name of ["pointerdown", "pointermove"])
      this.canvas.addEventListener(name, (event) => event.buttons & 1 && this.point(event));
    this.canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (step) { this.tell(this.frame + step * (event.shiftKey ? 10 : 1)); event.preventDefault(); }
    });
    this.sizes = new ResizeObserver(() => this.draw());
    this.sizes.observe(this.canvas);
    this.load();
  },
  unmounted() { this.sizes.disconnect(); window.removeEventListener("airborne-frame", this.onOther); },
  watch: { url() { this.load(); } },
  methods: {
    async load() {
      const answer = await fetch(this.url, { cache: "no-store" });
      this.data = answer.ok ? await answer.json() : null;
      this.canvas.dataset.frames = this.data ? this.data.frame.length : 0;
      this.draw();
    },
    tell(frame) { window.dispatchEvent(new CustomEvent("airborne-frame", { detail: { frame, from: this } })); },
    point(event) {
      if (!this.data || !this.data.frame.length) return;
      this.tell(frameAt(this.canvas, this.data, event.clientX));
    },
    draw() { drawCurves(this.canvas, this.data, this.frame); },
  },
};
