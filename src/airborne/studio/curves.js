// Curves over time with bands of two standard deviations, and a strip that says how each frame went; one cursor.
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000", "#8a6d00"];
const STATUS = { tracked: "#009e73", uncertain: "#e69f00", lost: "#d55e00" };
const STRIP = 12, LEFT = 52, RIGHT = 10, TOP = 20, BOTTOM = 18;

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
      const box = this.canvas.getBoundingClientRect(), { first, last } = this.span();
      const share = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
      this.tell(Math.round(first + Math.max(0, Math.min(1, share)) * (last - first)));
    },
    span() { const all = this.data.frame; return { first: all[0], last: Math.max(all[all.length - 1], all[0] + 1) }; },
    draw() {
      const box = this.canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
      if (!box.width) return;
      Object.assign(this.canvas, { width: Math.round(box.width * ratio), height: Math.round(box.height * ratio) });
      const pen = this.canvas.getContext("2d");
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.clearRect(0, 0, box.width, box.height);
      if (!this.data || !this.data.frame.length) return;
      const { frame, status, series } = this.data, { first, last } = this.span();
      const width = box.width - LEFT - RIGHT, bottom = box.height - BOTTOM - STRIP - 4, height = bottom - TOP;
      const x = (each) => LEFT + ((each - first) / (last - first)) * width;
      const [low, high] = this.range(series), y = (value) => bottom - ((value - low) / (high - low)) * height;
      this.axes(pen, low, high, y, box.width);
      series.forEach((each, k) => this.curve(pen, each, COLOURS[k % COLOURS.length], frame, x, y));
      pen.save();
      frame.forEach((each, k) => { // the strip: the worst of the frames that share a column wins, as it is drawn last
        if (status[k] === "tracked") { pen.fillStyle = STATUS.tracked; pen.fillRect(x(each), bottom + 4, Math.max(1, width / (last - first)), STRIP); }
      });
      for (const name of ["uncertain", "lost"])
        frame.forEach((each, k) => {
          if (status[k] === name) { pen.fillStyle = STATUS[name]; pen.fillRect(x(each), bottom + 4, Math.max(1.5, width / (last - first)), STRIP); }
        });
      pen.restore();
      this.legend(pen, series);
      const now = x(Math.max(first, Math.min(last, this.frame))), row = frame.indexOf(this.frame);
      pen.strokeStyle = "#1f2429";
      pen.beginPath(); pen.moveTo(now, TOP - 4); pen.lineTo(now, bottom + STRIP + 6); pen.stroke();
      const time = row < 0 ? "" : `   ${this.data.time_s[row].toFixed(3)} s   ${status[row]}`;
      pen.fillStyle = "#5d666f";
      pen.textAlign = "left";
      pen.fillText(`frame ${this.frame}${time}`, LEFT, box.height - 4);
    },
    range(series) {
      let low = Infinity, high = -Infinity;
      for (const each of series) for (const value of each.value) if (value !== null) { low = Math.min(low, value); high = Math.max(high, value); }
      if (!(low < high)) return [low - 0.5 || 0, high + 0.5 || 1];
      const rim = 0.06 * (high - low);
      return [low - rim, high + rim];
    },
    axes(pen, low, high, y, width) {
      pen.font = "11px system-ui, sans-serif";
      pen.textAlign = "right";
      const rough = (high - low) / 4, power = 10 ** Math.floor(Math.log10(rough));
      const step = power * [1, 2, 5, 10].find((each) => each * power >= rough);
      for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
        pen.fillStyle = "#5d666f";
        pen.fillText(`${Number(value.toPrecision(6))} m`, LEFT - 6, y(value) + 4);
        pen.strokeStyle = "#eceff1";
        pen.beginPath(); pen.moveTo(LEFT, y(value)); pen.lineTo(width - RIGHT, y(value)); pen.stroke();
      }
    },
    curve(pen, { value, sd }, colour, frame, x, y) {
      if (sd && sd.length) {
        pen.fillStyle = colour + "33";
        for (let k = 1; k < frame.length; k++) {
          if ([value[k - 1], value[k], sd[k - 1], sd[k]].some((each) => each === null)) continue;
          pen.beginPath();
          pen.moveTo(x(frame[k - 1]), y(value[k - 1] + 2 * sd[k - 1]));
          pen.lineTo(x(frame[k]), y(value[k] + 2 * sd[k]));
          pen.lineTo(x(frame[k]), y(value[k] - 2 * sd[k]));
          pen.lineTo(x(frame[k - 1]), y(value[k - 1] - 2 * sd[k - 1]));
          pen.fill();
        }
      }
      pen.strokeStyle = colour;
      pen.lineWidth = 1.5;
      pen.beginPath();
      let isOpen = false;
      frame.forEach((each, k) => {
        if (value[k] === null) { isOpen = false; return; }
        pen[isOpen ? "lineTo" : "moveTo"](x(each), y(value[k]));
        isOpen = true;
      });
      pen.stroke();
      pen.lineWidth = 1;
    },
    legend(pen, series) {
      let left = LEFT;
      pen.textAlign = "left";
      series.forEach((each, k) => {
        pen.fillStyle = COLOURS[k % COLOURS.length];
        pen.fillRect(left, 8, 12, 3);
        pen.fillStyle = "#1f2429";
        pen.fillText(each.name, left + 16, 13);
        left += 28 + pen.measureText(each.name).width;
      });
    },
  },
};
