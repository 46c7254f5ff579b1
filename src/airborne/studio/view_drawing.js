// How a view is drawn: pictures, what lies over them, marks, the loupe. Methods of the component in `view.js`.
const LOUPE = 8; // times as large as the video
const RIM = "rgba(0,0,0,0.6)"; // about what is drawn, or a yellow line on a yellow body would not be seen

export default {
  draw() {
    if (!this.canvas) return;
    const box = this.box(), ratio = this.ratio();
    if (!box.width || !this.panes.length) return;
    const [width, height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const pen = this.pens;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = "#16191d";
    pen.fillRect(0, 0, box.width, box.height);
    this.layout().forEach((place, i) => place.w && this.drawPane(pen, place, i));
    this.sharpen();
  },
  drawPane(pen, place, i) {
    pen.save();
    pen.beginPath();
    pen.rect(place.x, place.y, place.w, place.h);
    pen.clip();
    this.drawPicture(pen, place, i);
    if (this.coarse) this.drawVeil(pen, place);
    else this.drawOver(pen, place, i);
    if (this.picking && !this.coarse && this.pointer && this.pointer.pane === i) this.drawLoupe(pen, place, i);
    pen.restore();
    const overlay = this.shown && !this.coarse && this.shown.overlay;
    const text = this.panes[i].name + (i === 0 && overlay && overlay.label ? "   " + overlay.label : "");
    this.write(pen, text, place.x + 8, place.y + 18, "#ffffff");
  },
  drawPicture(pen, place, i) {
    const pane = this.panes[i], picture = this.coarse ? this.coarse[i] : this.shown && this.shown.pictures[i];
    pen.fillStyle = "#2a2f36";
    pen.fillRect(place.x, place.y, place.w, place.h);
    const [x, y] = this.toScreen(place, -0.5, -0.5);
    pen.imageSmoothingEnabled = place.scale < 3;
    if (picture) pen.drawImage(picture, x, y, pane.width * place.scale, pane.height * place.scale);
    else if (this.shown) this.write(pen, "no picture", place.x + place.w / 2 - 30, place.y + place.h / 2, "#c8cdd3");
  },
  drawVeil(pen, place) { // no one shall take these pictures for the frame's own
    pen.fillStyle = "rgba(22, 25, 29, 0.45)";
    pen.fillRect(place.x, place.y, place.w, place.h);
    this.write(pen, `frame ${this.wanted} is on its way`, place.x + 8, place.y + place.h - 10, "#ffffff");
  },
  drawOver(pen, place, i) {
    const lines = [...((this.shown && this.shown.overlay.items) || []), ...this.nowItems()];
    for (const item of lines) if (item.pane === i) this.drawItem(pen, place, item);
    this.labels = [];
    for (const mark of this.nowMarks()) if (mark.pane === i) this.drawMark(pen, place, mark);
  },
  nowMarks() { return (this.live || this).marks || []; },
  nowItems() { return (this.live || this).items || []; },
  trace(pen, place, item) {
    pen.beginPath();
    item.points.forEach((point, k) => pen[k ? "lineTo" : "moveTo"](...this.toScreen(place, ...point)));
    if (item.closed) pen.closePath();
  },
  drawItem(pen, place, item) {
    this.trace(pen, place, item);
    if (item.fill) { pen.fillStyle = item.fill; pen.fill(); }
    const width = item.width || 1.5, strokes = item.colour ? [[RIM, width + 2], [item.colour, width]] : [];
    for (const [colour, wide] of strokes) { pen.strokeStyle = colour; pen.lineWidth = wide; pen.stroke(); }
    if (item.text) this.write(pen, item.text, ...this.toScreen(place, ...item.points[0]), item.colour);
  },
  drawMark(pen, place, mark) {
    const [u, v] = this.dragged && this.dragged.id === mark.id ? [this.dragged.u, this.dragged.v] : [mark.u, mark.v];
    const [x, y] = this.toScreen(place, u, v), chosen = mark.id === this.selected, r = chosen ? 9 : 6;
    for (const [colour, width] of [[RIM, 3.5], [mark.colour, 1.5]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.beginPath();
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
        pen.moveTo(x + 2 * dx, y + 2 * dy);
        pen.lineTo(x + r * dx, y + r * dy);
      }
      if (chosen) { pen.moveTo(x + 12, y); pen.arc(x, y, 12, 0, 2 * Math.PI); }
      if (mark.to) { // ten times the residual
        pen.moveTo(x, y);
        pen.lineTo(x + 10 * (mark.to[0] - u) * place.scale, y + 10 * (mark.to[1] - v) * place.scale);
      }
      pen.stroke();
    }
    const box = [x + 9, y - 19, 7 * (mark.label || "").length, 14]; // a label that would hide another is left out
    const hides = ([left, top, width, height]) =>
      box[0] < left + width && left < box[0] + box[2] && box[1] < top + height && top < box[1] + box[3];
    if (!chosen && this.labels.some(hides)) return;
    this.labels.push(box);
    this.write(pen, mark.label || "", x + 9, y - 7, mark.colour);
  },
  drawLoupe(pen, place, i) {
    const picture = this.shown && this.shown.pictures[i];
    if (!picture) return;
    const side = Math.min(150, place.w / 3), { x, y } = this.pointer, [u, v] = this.toVideo(place, x, y);
    const left = x - place.x > place.w / 2 ? place.x + 6 : place.x + place.w - side - 6, top = place.y + place.h - side - 6;
    const times = Math.max(LOUPE * place.fit, 2 * place.scale, 4), across = side / times;
    pen.save();
    pen.beginPath();
    pen.rect(left, top, side, side);
    pen.clip();
    pen.fillStyle = "#000";
    pen.fillRect(left, top, side, side);
    pen.imageSmoothingEnabled = false;
    const near = { x: left, y: top, scale: times, u0: u + 0.5 - across / 2, v0: v + 0.5 - across / 2 };
    const [px, py] = this.toScreen(near, -0.5, -0.5);
    pen.drawImage(picture, px, py, picture.width * times, this.panes[i].height * times);
    this.drawOver(pen, near, i);
    pen.strokeStyle = "rgba(255,255,255,0.9)";
    pen.lineWidth = 1;
    pen.strokeRect(left + 0.5, top + 0.5, side - 1, side - 1);
    pen.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      pen.moveTo(left + side / 2 + 4 * dx, top + side / 2 + 4 * dy);
      pen.lineTo(left + side / 2 + 20 * dx, top + side / 2 + 20 * dy);
    }
    pen.stroke();
    this.write(pen, `${u.toFixed(1)}, ${v.toFixed(1)} px`, left + 5, top + side - 6, "#ffffff");
    pen.restore();
  },
  write(pen, text, x, y, colour) {
    if (!text) return;
    pen.font = "12px system-ui, sans-serif";
    pen.lineWidth = 3;
    pen.strokeStyle = "rgba(0,0,0,0.75)";
    pen.strokeText(text, x, y);
    pen.fillStyle = colour || "#ffffff";
    pen.fillText(text, x, y);
  },
};
