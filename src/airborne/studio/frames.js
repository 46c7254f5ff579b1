// The bar below a view: play, a slider over all frames, the number of the one in view and its time.
const LONGEST_MS = 200; // between frames: over a gap of the recording, playing does not wait longer

export default {
  template: `<div class="frames">
    <button type="button" :aria-label="playing ? 'stop' : 'play'" @click="toggle">{{ playing ? "❚❚" : "▶" }}</button>
    <input type="range" min="0" :max="n_frames - 1" :value="frame" aria-label="all frames" @input="go($event.target.value)" @keydown="leave">
    <input type="number" min="0" :max="n_frames - 1" :value="typed ?? frame" aria-label="frame in view" @input="typed = $event.target.value" @change="goToTyped" @blur="typed = null" @keydown="leave">
    <span>(0 to {{ n_frames - 1 }}){{ time_s === null ? "" : ", " + time_s.toFixed(3) + " s" }}</span>
  </div>`,
  props: { view: Number, n_frames: Number, start: Number },
  data() { return { frame: this.start, time_s: null, playing: false, typed: null }; }, // pictures come while one types
  mounted() {
    this.onShown = ({ detail }) => detail.from === getElement(this.view) && this.show(detail);
    this.onPlay = ({ detail }) => detail.from === getElement(this.view) && this.toggle();
    window.addEventListener("airborne-shown", this.onShown);
    window.addEventListener("airborne-play", this.onPlay);
  },
  unmounted() {
    this.playing = false;
    window.removeEventListener("airborne-shown", this.onShown);
    window.removeEventListener("airborne-play", this.onPlay);
  },
  methods: {
    go(frame) { getElement(this.view).go(Number(frame)); },
    goToTyped() {
      if (this.typed) this.go(this.typed);
      this.typed = null;
    },
    show({ frame, time_s }) {
      const period = this.time_s === null || time_s === null ? LONGEST_MS / 4 : Math.min(LONGEST_MS, 1000 * Math.abs(time_s - this.time_s));
      [this.frame, this.time_s] = [frame, time_s];
      if (this.playing) this.playOn(period - (performance.now() - this.begun));
    },
    leave(event) { // keys of the whole page are heard where nothing is typed
      if (event.key === "?" || (event.ctrlKey && "zy".includes(event.key))) getElement(this.view).canvas.focus();
    },
    toggle() {
      this.playing = !this.playing;
      if (this.playing) this.playOn(0);
    },
    playOn(wait_ms) { // every frame is shown: where the pictures take longer, so does playing
      clearTimeout(this.timer);
      this.timer = setTimeout(() => {
        this.playing &&= this.frame < this.n_frames - 1;
        this.begun = performance.now();
        if (this.playing) this.go(this.frame + 1);
      }, Math.max(0, wait_ms));
    },
  },
};
