// Scalars, legends, and the controls beside the view.
/** Names of scalars over several items, in order of appearance. */
function names(items) {
  const all = new Map();
  for (const item of items) for (const s of item.scalars) if (!all.has(s.name)) all.set(s.name, s);
  return [...all.values()];
}

const beads = scene.lines.filter((l) => l.width > 0);
const lineScalars = names(beads);
const surfaceItems = [...scene.surfaces, ...(scene.heights ? [scene.heights] : [])];
const surfaceScalars = names(surfaceItems);
if (scene.heights) surfaceScalars.push({ name: "height", unit: "mm", own: true, map: 0, range: [scene.heights.lo, scene.heights.lo + 65534 * scene.heights.step] });

function named(item, which) {
  const wanted = (which === "lineScalar" ? lineScalars : surfaceScalars)[state[which]];
  return wanted ? item.scalars.find((s) => s.name === wanted.name && !wanted.own) || null : null;
}

/** -1: by its own height; -2: plain; otherwise the field's index. */
function heightScalarIndex() {
  const wanted = surfaceScalars[state.surfaceScalar];
  if (!wanted) return -2;
  if (wanted.own) return -1;
  const i = scene.heights.scalars.findIndex((s) => s.name === wanted.name);
  return i < 0 ? -2 : i;
}

const figure = (v, figures = 4) => Number.isFinite(v) ? String(+v.toPrecision(figures)).replace("-", "−") : "–";

function ramp(element, scalar) {
  element.replaceChildren();
  if (!scalar) return;
  const stops = scene.maps[scalar.map].map((c, i, all) => `rgb(${c}) ${100 * i / (all.length - 1)}%`);
  const bar = document.createElement("div");
  bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
  const labels = document.createElement("div");
  const [lo, hi] = scalar.range;
  for (let i = 0; i <= 4; i++) {
    const label = document.createElement("span");
    const value = lo + (hi - lo) * i / 4;
    label.textContent = figure(Math.abs(value) < 1e-9 * (hi - lo) ? 0 : value, 3);
    labels.append(label);
  }
  const unit = document.createElement("p");
  unit.textContent = scalar.name + (scalar.unit ? ` (${scalar.unit})` : "") + "; grey: no value";
  element.append(bar, labels, unit);
}

function choices(select, scalars, which, element) {
  const add = (value, text) => select.append(new Option(text, value));
  scalars.forEach((s, i) => add(i, s.name + (s.unit ? ` (${s.unit})` : "")));
  add(-1, "plain");
  const change = () => { state[which] = +select.value; ramp(element, scalars[state[which]]); redraw(); };
  select.addEventListener("change", change);
  select.value = scalars.length ? 0 : -1;
  change();
}

function controls() {
  for (const b of document.querySelectorAll("[data-view]")) b.addEventListener("click", () => look(b.dataset.view));
  for (const item of [...scene.lines, ...surfaceItems]) {
    const label = document.createElement("label"), box = document.createElement("input");
    if (item.shown === undefined) item.shown = true;
    Object.assign(box, { type: "checkbox", checked: item.shown });
    box.addEventListener("change", () => { item.shown = box.checked; redraw(); });
    label.append(box, " " + item.name);
    const row = document.createElement("div");
    row.append(label);
    if (surfaceItems.includes(item)) {
      const button = document.createElement("button");
      const set = (through) => { item.through = through; button.setAttribute("aria-pressed", through); redraw(); };
      Object.assign(button, { type: "button", textContent: "see through", title: item.name + ": see through it" });
      button.addEventListener("click", () => set(!item.through));
      set(item.opacity < 1);
      row.append(button);
    }
    $("items").append(row);
  }
  choices($("line-scalar"), lineScalars, "lineScalar", $("line-ramp"));
  choices($("surface-scalar"), surfaceScalars, "surfaceScalar", $("surface-ramp"));
  $("line-colours").hidden = !lineScalars.length;
  $("surface-colours").hidden = !surfaceScalars.length;
  $("layer-controls").hidden = scene.layers < 2;
  $("layer").max = scene.layers;
  $("layer").value = scene.layers;
  const setLayer = () => {
    state.layer = +$("layer").value;
    $("layer-label").textContent = `${state.layer} of ${scene.layers}`;
    film.upto = Infinity;
    if (machine && machine.world) setMoment(endOfLayer(state.layer));
    redraw();
  };
  $("layer").addEventListener("input", setLayer);
  setLayer();
  for (const r of document.querySelectorAll("[name=layer-mode]")) r.addEventListener("change", () => { state.only = r.value === "only" && r.checked; redraw(); });
  let timer = 0;
  const play = $("play");
  const stop = () => { clearInterval(timer); timer = 0; play.textContent = "▶"; play.setAttribute("aria-label", "Play the layers"); };
  play.addEventListener("click", () => {
    if (timer) return stop();
    if (state.layer >= scene.layers) { $("layer").value = 1; setLayer(); }
    play.textContent = "❚❚";
    play.setAttribute("aria-label", "Stop");
    timer = setInterval(() => {
      $("layer").value = state.layer + 1;
      setLayer();
      if (state.layer >= scene.layers) stop();
    }, Math.max(60, Math.min(400, 8000 / scene.layers)));
  });
  const cut = () => {
    state.axis = $("section-axis").value === "" ? -1 : +$("section-axis").value;
    state.cut = $("section-place").value / 1000;
    $("section-place").disabled = state.axis < 0;
    $("section-label").textContent = state.axis < 0 ? "" : `${"XYZ"[state.axis]} ${figure(cutPlace())} mm`;
    redraw();
  };
  $("section-axis").addEventListener("change", cut);
  $("section-place").addEventListener("input", cut);
}
