// One frame of the run in view: its pictures, the body in 3D, the curves' cursor. "frame 12" in the page leads here.
(() => {
  const run = JSON.parse(document.getElementById("run").textContent), box = document.getElementById("viewer");
  const find = (what) => box.querySelector(what);
  if (!run.frame.length) return;
  box.hidden = false;
  let row = 0, timer = null;
  const film = run.film, strip = find(".film"), pictures = [];
  if (film) for (const camera of film.cameras) {
    const figure = document.createElement("figure"), image = document.createElement("img"), caption = document.createElement("figcaption");
    image.alt = `what ${camera} saw, with what was drawn over it`;
    caption.textContent = camera;
    figure.append(image, caption);
    strip.append(figure);
    pictures.push(image);
  }
  const solid = find(".in-3d");
  let stage = null;
  if (run.glb) {
    const bytes = Uint8Array.from(atob(run.glb), (each) => each.charCodeAt(0));
    stage = new Stage(solid, bytes);
    find(".save").href = URL.createObjectURL(new Blob([bytes], { type: "model/gltf-binary" }));
  }
  if (!stage || !stage.ok) solid.remove();
  if (!run.glb) find(".save").remove();
  const curves = find(".curves"), group = find(".group"), at = find(".at"), play = find(".play");
  run.groups.forEach(({ name }, k) => group.add(new Option(name, k)));
  at.max = run.frame.length - 1;
  const data = () => ({ ...run, series: run.groups[Number(group.value)].series });
  const nearest = (frames, frame) => frames.reduce((best, each, k) => (Math.abs(each - frame) < Math.abs(frames[best] - frame) ? k : best), 0);

  function show(next) {
    row = Math.max(0, Math.min(run.frame.length - 1, next));
    const frame = run.frame[row];
    at.value = row;
    box.dataset.frame = frame;
    find(".now").textContent = `frame ${frame}, ${run.time_s[row].toFixed(3)} s, ${run.status[row]}`;
    if (film) {
      const k = nearest(film.frame, frame);
      pictures.forEach((image, camera) => { image.src = `data:image/jpeg;base64,${film.jpegs[k][camera]}`; });
      find(".film-note").textContent = film.frame[k] === frame ? "" : `The report holds pictures of ${film.frame.length} frames; these are of frame ${film.frame[k]}.`;
    }
    if (stage && stage.ok) stage.show(run.time_s[row] - run.time_s[0]);
    drawCurves(curves, data(), frame);
  }
  const stop = () => { clearInterval(timer); timer = null; play.textContent = "Play"; play.setAttribute("aria-pressed", "false"); };
  play.addEventListener("click", () => {
    if (timer) return stop();
    const begun = performance.now(), from = row + 1 < run.frame.length ? run.time_s[row] : run.time_s[0];
    play.textContent = "Stop";
    play.setAttribute("aria-pressed", "true");
    timer = setInterval(() => { // four times slower than it was
      const now = from + (performance.now() - begun) / 4000, next = run.time_s.findIndex((each) => each >= now);
      if (next < 0) { show(run.frame.length - 1); stop(); } else show(next);
    }, 40);
  });
  at.addEventListener("input", () => show(Number(at.value)));
  group.addEventListener("change", () => show(row));
  for (const name of ["pointerdown", "pointermove"])
    curves.addEventListener(name, (event) => event.buttons & 1 && show(nearest(run.frame, frameAt(curves, data(), event.clientX))));
  for (const each of [curves, solid])
    each.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (step) { show(row + step * (event.shiftKey ? 10 : 1)); event.preventDefault(); }
    });
  new ResizeObserver(() => drawCurves(curves, data(), run.frame[row])).observe(curves);

  document.addEventListener("DOMContentLoaded", () => { // once the rest of the page is there
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), texts = [];
    while (walker.nextNode()) if (!box.contains(walker.currentNode) && !walker.currentNode.parentElement.closest("script, style")) texts.push(walker.currentNode);
    for (const text of texts) {
      const parts = text.data.split(/\b(frame \d+)\b/);
      if (parts.length < 2) continue;
      text.replaceWith(...parts.map((part, k) => {
        if (k % 2 === 0) return part;
        const link = document.createElement("a"), frame = Number(part.slice(6));
        Object.assign(link, { href: "#viewer", textContent: part });
        link.addEventListener("click", () => show(nearest(run.frame, frame)));
        return link;
      }));
    }
  });
  show(0);
})();
