// Curves over time with bands of two standard deviations, and a strip that says how each frame went; one cursor.
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000", "#6600cc"];
const RANKS = ["tracked", "uncertain", "unknown", "lost"]; // of a joint: unknown is what no picture shows
const STATUS = { tracked: "#009e73", uncertain: "#e69f00", unknown: "#5d666f", lost: "#d55e00" };
const STRIP = 12, ROW = 10, LEGIBLE = 8, MOST_NAMES = 6, LEFT = 58, RIGHT = 10, TOP = 20, BOTTOM = 32, STEP = 16, FONT = "11px system-ui, sans-serif";

// data: {frame, time_s, status, series: [{name, unit, value, sd}]}; null where nothing is known. {is_thinned}: two rows in a
// row hold the least and the greatest of the frames from the first's to the next but one. What another run has,
// {beside: {frame, series}}, is drawn with dashes. {last}: the frame up to which a run that goes on will go.
// {strips: [{name, rank}]}: how each joint or player went, a digit a frame.
export function drawCurves(canvas, data, now) {
  const box = boxOf(canvas), ratio = (window.devicePixelRatio || 1) * box.zoom;
  if (!box.width) return;
  const [width, height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
  let still = canvas.still; // all but the cursor, drawn once
  if (!still || still.data !== data || still.image.width !== width || still.image.height !== height) {
    const image = Object.assign(document.createElement("canvas"), { width, height });
    still = canvas.still = { data, image };
    const pen = image.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (data && data.frame.length) drawStill(pen, box, data);
  }
  Object.assign(canvas, { width, height });
  const pen = canvas.getContext("2d");
  pen.drawImage(still.image, 0, 0);
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (!data || !data.frame.length) return;
  const { first, last } = spanOf(data), row = data.frame.indexOf(now);
  const at = LEFT + ((Math.max(first, Math.min(last, now)) - first) / (last - first)) * (box.width - LEFT - RIGHT);
  pen.strokeStyle = "#1f2429";
  pen.beginPath();
  pen.moveTo(at, TOP - 4);
  pen.lineTo(at, box.height - BOTTOM + 2);
  pen.stroke();
  const [names, all] = row < 0 ? ["", ""] : [namesOf(data, row, MOST_NAMES), namesOf(data, row, Infinity)];
  canvas.title = names === all ? "" : all.trim();
  const time = row < 0 ? "" : `   ${data.time_s[row].toFixed(3)} s   ${data.status[row]}${names}`;
  pen.fillStyle = "#5d666f";
  pen.font = FONT;
  pen.fillText(`frame ${now}${time}${data.is_provisional ? "   ± is not final: it grows when the run ends" : ""}`, LEFT, box.height - 4);
  drawLegend(pen, data.series, data.series.map((each) => valueAt(each, data, now)), canvas);
}

function drawStill(pen, box, data) {
  const { frame, status, series } = data, { first, last } = spanOf(data);
  const width = box.width - LEFT - RIGHT, strips = data.strips || [];
  const thick = Math.max(2, Math.floor(Math.min(ROW, (0.4 * box.height) / Math.max(strips.length, 1))));
  const top = Math.floor(box.height - BOTTOM - strips.length * thick);
  const bottom = top - STRIP - 4, height = bottom - TOP;
  const x = (each) => LEFT + ((each - first) / (last - first)) * width;
  const others = data.beside ? data.beside.series : [];
  const [low, high] = rangeOf([...series, ...others]), y = (value) => bottom - ((value - low) / (high - low)) * height;
  drawAxes(pen, low, high, y, box.width, series.length ? series[0].unit : "");
  drawTimes(pen, data, x, TOP, box.height - BOTTOM, box.width - 4);
  series.forEach((each, k) => drawCurve(pen, each, COLOURS[k % COLOURS.length], frame, x, y));
  pen.save();
  pen.beginPath();
  pen.rect(LEFT, 0, width, bottom);
  pen.clip();
  pen.setLineDash([6, 4]);
  others.forEach((each, k) => drawCurve(pen, { value: each.value }, COLOURS[k % COLOURS.length], data.beside.frame, x, y));
  pen.restore();
  const drawStrip = (ranks, y, high) => RANKS.forEach((name, rank) => { // the worst that share a column is drawn last
    pen.fillStyle = STATUS[name];
    frame.forEach((each, k) => {
      const wide = Math.min(Math.max(1.5, width / (last - first) + 0.7), LEFT + width + 1.5 - x(each));
      if (Number(ranks[k]) === rank) pen.fillRect(x(each), y, wide, high);
    });
  });
  drawStrip(status.map((each) => RANKS.indexOf(each)), bottom + 4, STRIP);
  strips.forEach((each, k) => {
    drawStrip(each.rank, top + k * thick + 1, thick - 1);
    if (thick < LEGIBLE) return;
    pen.fillStyle = "#5d666f";
    pen.font = `${thick - 1}px system-ui, sans-serif`;
    pen.textAlign = "right";
    pen.fillText(each.name.replaceAll("_", " "), LEFT - 6, top + (k + 1) * thick - 2, LEFT - 8);
  });
}

// Which joints or players are worse than tracked in a row, so many of each kind, where not all of them are.
function namesOf({ status, strips = [] }, row, most) {
  if (status[row] === "lost") return "";
  const of = (rank) => strips.filter((each) => each.rank[row] === String(rank)).map((each) => each.name.replaceAll("_", " "));
  const told = RANKS.map((name, rank) => [name, rank ? of(rank) : []]).filter(([, names]) => names.length);
  const list = (names) => names.slice(0, most).join(", ") + (names.length > most ? ", ..." : "");
  return told.map(([name, names]) => `   ${name}: ${list(names)}`).join("");
}

// The frame at a place of the pointer.
export function frameAt(canvas, data, clientX) {
  const box = boxOf(canvas), { first, last } = spanOf(data);
  const share = ((clientX - box.left) / box.zoom - LEFT) / (box.width - LEFT - RIGHT);
  return Math.round(first + Math.max(0, Math.min(1, share)) * (last - first));
}

// Where a canvas is on the page; its size in its own CSS px, of which `zoom` of the page's make one.
function boxOf(canvas) {
  const { left, width, height } = canvas.getBoundingClientRect(), zoom = canvas.currentCSSZoom || 1;
  return { left, width: width / zoom, height: height / zoom, zoom };
}

function spanOf({ frame, last = 0 }) { return { first: frame[0], last: Math.max(frame[frame.length - 1], frame[0] + 1, last) }; }

function rangeOf(series) {
  let low = Infinity, high = -Infinity;
  for (const each of series) for (const value of each.value) if (value !== null) { low = Math.min(low, value); high = Math.max(high, value); }
  if (!(low < high)) return [low - 0.5 || 0, high + 0.5 || 1];
  const rim = 0.06 * (high - low);
  return [low - rim, high + rim];
}

function drawAxes(pen, low, high, y, width, unit) {
  pen.font = FONT;
  pen.textAlign = "right";
  const step = stepOf((high - low) / 4);
  for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
    pen.fillStyle = "#5d666f";
    pen.fillText(`${Number(value.toPrecision(6))} ${unit}`, LEFT - 6, y(value) + 4);
    pen.strokeStyle = "#eceff1";
    pen.beginPath();
    pen.moveTo(LEFT, y(value));
    pen.lineTo(width - RIGHT, y(value));
    pen.stroke();
  }
}

// Lines at round times over the curves, and below all strips how many seconds each is.
function drawTimes(pen, { frame, time_s }, x, top, bottom, right) {
  const step = stepOf((time_s.at(-1) - time_s[0]) / 8);
  pen.textAlign = "center";
  for (let k = 1, at = Math.ceil(time_s[0] / step); step > 0 && at * step <= time_s.at(-1); at++) {
    while (k < frame.length - 1 && time_s[k] < at * step) k++;
    const share = k < frame.length ? (at * step - time_s[k - 1]) / (time_s[k] - time_s[k - 1]) : 0;
    const place = x(frame[k - 1] + (share ? share * (frame[k] - frame[k - 1]) : 0));
    pen.fillStyle = "#5d666f";
    const text = `${Number((at * step).toPrecision(6))} s`;
    pen.fillText(text, Math.min(place, right - pen.measureText(text).width / 2), bottom + 12);
    pen.strokeStyle = "#eceff1";
    pen.beginPath();
    pen.moveTo(place, top);
    pen.lineTo(place, bottom + 2);
    pen.stroke();
  }
}

function stepOf(rough) { // the next 1, 2, 5 or 10 of its power of ten; 0 of nothing
  const power = 10 ** Math.floor(Math.log10(rough));
  return rough > 0 ? power * [1, 2, 5, 10].find((each) => each * power >= rough) : 0;
}

function drawCurve(pen, { value, sd }, colour, frame, x, y) {
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
}

// What a curve is at the cursor, ± its standard deviation; of frames that share a point, from the least to the greatest.
function valueAt({ value, sd, unit }, { frame, is_thinned }, now) {
  const row = is_thinned ? 2 * Math.floor(frame.findLastIndex((each) => each <= now) / 2) : frame.indexOf(now);
  const ends = [...new Set([value[row], value[row + (is_thinned ? 1 : 0)]])];
  if (ends.some((each) => each === null || each === undefined)) return "";
  const has = sd && sd.length, of = has && sd[row];
  const digits = of ? Math.max(0, Math.min(5, 1 - Math.floor(Math.log10(of)))) : 3; // two of the deviation count
  const spread = has ? ` ± ${of === null ? "?" : of.toFixed(digits)}` : "";
  return `${ends.map((each) => each.toFixed(digits)).join(" to ")}${spread} ${unit}`;
}

function drawLegend(pen, series, values, canvas) {
  let left = LEFT;
  const texts = series.map(({ name }, k) => (values[k] ? `${name} ${values[k]}` : name));
  series.forEach((_, k) => {
    pen.fillStyle = COLOURS[k % COLOURS.length];
    pen.fillRect(left, 8, 12, 3);
    pen.fillStyle = "#1f2429";
    pen.fillText(texts[k], left + 16, 13);
    left += 28 + STEP * Math.ceil(pen.measureText(texts[k]).width / STEP); // or they would tremble as they change
  });
  canvas.setAttribute("aria-description", texts.join(", "));
}
