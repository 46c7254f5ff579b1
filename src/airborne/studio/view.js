// One canvas with every camera's picture at one frame and all that lies over it, drawn in one stroke.
// Pixels are the video's own: (0, 0) is the centre of the top-left one.
import drawing from "/parts/view_drawing.js";
import frames from "/parts/view_frames.js";

const GRAB_PX = 9; // on the screen: how near a mark must be to be grabbed
const STILL_PX = 3; // a pointer that moves less has clicked
const GAP = 4; // between pictures
const SAME_PX = 0.02; // of a video: places are written to a hundredth
const TAKES_KEYS = "canvas.view, input, select, textarea, [role=dialog], [role=listbox], [role=menu], [role=radiogroup], [role=tablist]";
const PRESSED = "button, a, [role=switch], [role=checkbox]"; // by Space

export default {
  template: `<canvas class="view" tabindex="0" role="img" :aria-label="label"></canvas>`,
  props: {
    panes: Array, // {name, width, height, url: "/image/cam/{frame}"}
    n_frames: Number,
    frame: Number, // at first
    overlay: String, // "/overlay/what/{frame}": items of each frame; or none
    marks: Array, // {id, pane, u, v, label, colour, to: [u, v]}: points to grab
    items: Array, // {pane, points, colour, width, closed, fill, text, grab: a drag that begins in it holds the body}
    selected: String, // a mark's id
    picking: Boolean, // a click picks a point
    apart: Boolean, // its frames are its own, not those of the page
    follows: Boolean, // the server draws what is dragged, anew for every movement
    label: String,
  },
  emits: ["pick", "move", "select", "frame", "drag"],
  data: () => ({ wanted: 0, shown: null }),
  mounted() {
    this.canvas = this.$el;
    this.canvas.view = this; // where a pixel is on the screen: for those who look from outside
    this.pens = this.canvas.getContext("2d");
    this.cache = new Map();
    this.underway = new Map();
    this.alone = -1; // the only camera shown; -1: all
    this.zooms = this.panes.map(() => ({ scale: 1, u: 0, v: 0 })); // v, u: what is moved to the pane's corner
    this.pointer = null;
    this.coarse = null; // pictures near the frame that is on its way
    this.drag = null;
    this.dragged = null; // a mark on its way
    this.unanswered = 0; // steps of it by arrows that the server has not answered
    this.live = null; // {marks, items} in the place of the page's own while the body is dragged
    this.pulling = null; // the movement that the server answers now
    this.pull = null; // the newest one after it
    this.canvas.addEventListener("wheel", this.onWheel, { passive: false });
    for (const name of ["pointerdown", "pointermove", "pointerup", "pointerleave", "dblclick", "keydown"])
      this.canvas.addEventListener(name, this["on_" + name]);
    this.onOther = (event) => event.detail.from !== this && !this.apart && this.go(event.detail.frame, true);
    window.addEventListener("airborne-frame", this.onOther);
    window.addEventListener("keydown", this.onPageKey);
    this.sizes = new ResizeObserver(() => this.draw());
    this.sizes.observe(this.canvas);
    this.go(this.frame || 0, true);
  },
  unmounted() {
    this.sizes.disconnect();
    window.removeEventListener("airborne-frame", this.onOther);
    window.removeEventListener("keydown", this.onPageKey);
  },
  watch: {
    marks() {
      const on = this.dragged, mark = on && (this.marks || []).find((each) => each.id === on.id);
      const isThere = !mark || Math.hypot(mark.u - on.u, mark.v - on.v) < SAME_PX;
      this.unanswered = isThere ? 0 : Math.max(this.unanswered - 1, 0);
      if (!this.unanswered) this.dragged = null; // else this answers an earlier step
      this.live = null;
      this.draw();
    },
    items() { this.live = null; this.draw(); },
    selected() { this.draw(); },
    picking() { this.draw(); },
    overlay() { this.refresh(); },
    panes(now, before) {
      if (JSON.stringify(now) === JSON.stringify(before)) return;
      if (this.zooms.length !== this.panes.length) {
        this.zooms = this.panes.map(() => ({ scale: 1, u: 0, v: 0 }));
        this.alone = -1;
      }
      this.refresh();
    },
  },
  methods: {
    ...drawing,
    ...frames,
    // places: in the canvas's own CSS px, of which `zoom` of the page's make one on a large screen
    zoom() { return this.canvas.currentCSSZoom || 1; },
    ratio() { return (window.devicePixelRatio || 1) * this.zoom(); },
    box() {
      const { left, top, width, height } = this.canvas.getBoundingClientRect(), zoom = this.zoom();
      return { left, top, width: width / zoom, height: height / zoom };
    },
    layout() {
      const box = this.box(), n = this.alone < 0 ? this.panes.length : 1;
      let best = { scale: 0 };
      for (let columns = 1; columns <= n; columns++) {
        const rows = Math.ceil(n / columns);
        const w = (box.width - (columns - 1) * GAP) / columns, h = (box.height - (rows - 1) * GAP) / rows;
        const scale = Math.min(...this.panes.map((pane) => Math.min(w / pane.width, h / pane.height)));
        if (scale > best.scale) best = { scale, columns, w, h };
      }
      return this.panes.map((pane, i) => {
        if (this.alone >= 0 && i !== this.alone) return { x: 0, y: 0, w: 0, h: 0, fit: 1, scale: 1, u0: 0, v0: 0 };
        const at = this.alone < 0 ? i : 0;
        const x = (at % best.columns) * (best.w + GAP), y = Math.floor(at / best.columns) * (best.h + GAP);
        const fit = Math.min(best.w / pane.width, best.h / pane.height), zoom = this.zooms[i];
        const scale = fit * zoom.scale;
        const left = x + (best.w - fit * pane.width) / 2, top = y + (best.h - fit * pane.height) / 2;
        return { x: left, y: top, w: fit * pane.width, h: fit * pane.height, fit, scale, u0: zoom.u, v0: zoom.v };
      });
    },
    toScreen(place, u, v) { return [place.x + (u + 0.5 - place.u0) * place.scale, place.y + (v + 0.5 - place.v0) * place.scale]; },
    toVideo(place, x, y) { return [(x - place.x) / place.scale + place.u0 - 0.5, (y - place.y) / place.scale + place.v0 - 0.5]; },
    paneAt(x, y) { return this.layout().findIndex((p) => x >= p.x && x < p.x + p.w && y >= p.y && y < p.y + p.h); },
    hold(i) { // the picture fills its pane
      const zoom = this.zooms[i], pane = this.panes[i];
      zoom.u = Math.max(0, Math.min(zoom.u, pane.width * (1 - 1 / zoom.scale)));
      zoom.v = Math.max(0, Math.min(zoom.v, pane.height * (1 - 1 / zoom.scale)));
    },
    // hands
    place(event) {
      const box = this.box(), zoom = this.zoom(), x = (event.clientX - box.left) / zoom, y = (event.clientY - box.top) / zoom;
      return { x, y, pane: this.paneAt(x, y) };
    },
    markAt({ x, y, pane }) {
      const place = this.layout()[pane];
      const far = (mark) => { const [mx, my] = this.toScreen(place, mark.u, mark.v); return Math.hypot(mx - x, my - y); };
      const near = this.nowMarks().filter((mark) => mark.pane === pane && mark.id && far(mark) < GRAB_PX);
      return near.sort((a, b) => far(a) - far(b))[0];
    },
    isOnBody({ x, y, pane }) {
      const pen = this.pens, place = this.layout()[pane], ratio = this.ratio();
      return this.nowItems().some((item) => {
        if (!item.grab || item.pane !== pane) return false;
        this.trace(pen, place, item);
        pen.lineWidth = GRAB_PX;
        return pen.isPointInPath(x * ratio, y * ratio) || pen.isPointInStroke(x * ratio, y * ratio);
      });
    },
    // dragging: one movement is at the server at a time, and after it the newest
    ask(event, ended) {
      const { pane, x, y, mark } = this.drag, place = this.layout()[pane], at = this.place(event);
      const from = mark ? [mark.u, mark.v] : this.toVideo(place, x, y);
      const [u, v] = [from[0] + (at.x - x) / place.scale, from[1] + (at.y - y) / place.scale];
      this.pull = { frame: this.seen(), n: this.drag.n, pane, from, u, v, id: mark ? mark.id : null, turn: event.shiftKey, ended, at: performance.now() };
      if (!this.pulling) this.send();
    },
    send() {
      [this.pulling, this.pull] = [this.pull, null];
      if (!this.pulling) return;
      this.$emit("drag", this.pulling);
      if (this.pulling.frame !== this.seen()) this.$emit("frame", { frame: this.seen() }); // that was of the one before
    },
    follow(n, marks, items) { // the server's answer
      const answered = this.pulling;
      if (!answered) return;
      if (answered.n === n && items) this.live = { marks: marks || this.marks, items };
      if (marks) this.dragged = null; // the server's is where the body can reach
      this.draw();
      this.canvas.dataset.dragMs = (performance.now() - answered.at).toFixed(1);
      this.canvas.dataset.drags = 1 + Number(this.canvas.dataset.drags || 0);
      this.send();
    },
    onWheel(event) {
      event.preventDefault();
      const at = this.place(event);
      if (at.pane < 0) return;
      const before = this.toVideo(this.layout()[at.pane], at.x, at.y), zoom = this.zooms[at.pane];
      zoom.scale = Math.max(1, Math.min(40, zoom.scale * Math.exp(-event.deltaY / 400)));
      const after = this.toVideo(this.layout()[at.pane], at.x, at.y);
      zoom.u += before[0] - after[0];
      zoom.v += before[1] - after[1];
      this.hold(at.pane);
      this.draw();
    },
    on_pointerdown(event) {
      this.canvas.focus();
      const at = this.place(event);
      if (at.pane < 0 || event.button !== 0 || this.coarse) return; // what is on its way is not clicked
      this.canvas.setPointerCapture(event.pointerId);
      const mark = this.markAt(at), zoom = this.zooms[at.pane];
      const holds = this.follows && (mark ? mark.holds : this.isOnBody(at));
      this.drag = { ...at, mark, holds, n: (this.n_drags = (this.n_drags || 0) + 1), u: zoom.u, v: zoom.v, moved: false };
    },
    on_pointermove(event) {
      this.pointer = this.place(event);
      const drag = this.drag;
      if (drag) {
        const dx = this.pointer.x - drag.x, dy = this.pointer.y - drag.y, place = this.layout()[drag.pane];
        drag.moved ||= Math.hypot(dx, dy) > STILL_PX;
        if (drag.moved && drag.holds) this.ask(event, false);
        if (drag.moved && drag.mark) {
          const { id, u, v } = drag.mark;
          this.unanswered = 0;
          this.dragged = { id, u: u + dx / place.scale, v: v + dy / place.scale };
        } else if (drag.moved && !drag.holds) {
          Object.assign(this.zooms[drag.pane], { u: drag.u - dx / place.scale, v: drag.v - dy / place.scale });
          this.hold(drag.pane);
        }
      } else if (this.follows && this.pointer.pane >= 0)
        this.canvas.style.cursor = this.markAt(this.pointer) || this.isOnBody(this.pointer) ? "grab" : "";
      this.draw();
    },
    on_pointerup(event) {
      const drag = this.drag, at = this.place(event);
      if (drag && drag.moved && drag.holds) this.ask(event, true);
      this.drag = null;
      if (!drag) return;
      if (drag.moved && drag.holds) return;
      if (drag.moved && this.dragged) this.$emit("move", { ...this.dragged, frame: this.seen() });
      else if (!drag.moved && this.picking) { // the server knows whether the mark close by or a new point is meant
        const [u, v] = this.toVideo(this.layout()[drag.pane], at.x, at.y);
        this.$emit("pick", { frame: this.seen(), pane: drag.pane, u, v, near: drag.mark ? drag.mark.id : null });
      } else if (!drag.moved && drag.mark) this.$emit("select", { frame: this.seen(), id: drag.mark.id });
      this.draw();
    },
    on_pointerleave() { this.pointer = null; this.draw(); },
    on_dblclick(event) {
      const { pane } = this.place(event);
      if (pane >= 0 && !this.picking) { this.zooms[pane] = { scale: 1, u: 0, v: 0 }; this.draw(); }
    },
    onPageKey(event) { // wherever the focus is, unless what has it takes the key itself
      const { target } = event, isTaken = target.closest?.(TAKES_KEYS) || document.querySelector(".q-dialog");
      if (event.defaultPrevented || this.apart || isTaken || (event.key === " " && target.closest?.(PRESSED))) return;
      this.on_keydown(event);
    },
    on_keydown(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
      const mark = (this.marks || []).find((each) => each.id === this.selected && each.id);
      if (mark && event.key in arrows) {
        const step = event.shiftKey ? 1 : 0.1, [du, dv] = arrows[event.key];
        const from = this.dragged && this.dragged.id === mark.id ? this.dragged : mark;
        this.dragged = { id: mark.id, u: from.u + du * step, v: from.v + dv * step };
        this.unanswered += 1;
        this.draw();
        this.$emit("move", { ...this.dragged, frame: this.seen() });
      } else if (event.key === "ArrowLeft" || event.key === "ArrowRight")
        this.go(this.wanted + arrows[event.key][0] * (event.shiftKey ? 10 : 1));
      else if (event.key === "," || event.key === ".") this.go(this.wanted + (event.key === "." ? 1 : -1));
      else if (event.key === "Home") this.go(0);
      else if (event.key === "End") this.go(this.n_frames - 1);
      else if (event.key === " ") window.dispatchEvent(new CustomEvent("airborne-play", { detail: { from: this } }));
      else if (event.key === "c") { this.alone = this.alone + 1 < this.panes.length ? this.alone + 1 : -1; this.draw(); }
      else if (event.key === "Escape") this.$emit("select", { frame: this.seen(), id: null });
      else if (event.key === "0") { this.zooms = this.panes.map(() => ({ scale: 1, u: 0, v: 0 })); this.draw(); }
      else return;
      event.preventDefault();
    },
  },
};
