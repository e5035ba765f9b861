// Places named in the verdict: the view flies there, shows the layers up to theirs, and marks the spot.
let pin = null;

/** Millimetres across the picture near a place: some beads, or an eighth of the scene. */
const nearWidth = () => Math.max(25 * Math.max(0, ...beads.map((l) => l.width)), radius / 4);

/** Moves target and scale in a fraction of a second, at once where a person asked for no motion. */
let flight = 0;
function fly(target, scale) {
  const from = [...camera.target], start = camera.scale, begun = performance.now(), mine = ++flight;
  const lasts = matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : 500;
  const step = (now) => {
    if (mine !== flight) return;
    const t = lasts ? Math.min(Math.max((now - begun) / lasts, 0), 1) : 1, s = t * t * (3 - 2 * t);
    camera.target = from.map((v, k) => v + s * (target[k] - v));
    camera.scale = start * (scale / start) ** s;
    redraw();
    if (t < 1) requestAnimationFrame(step);
  };
  step(begun);
}

function showPlace(button) {
  const slider = $("layer"), { layer, position } = button.dataset;
  if (layer && scene.layers > 1) {
    slider.value = layer;
    slider.dispatchEvent(new Event("input"));
  }
  pin = position ? position.split(" ").map(Number) : null;
  const check = button.closest("tr, li, div[data-fact]");
  const name = check.querySelector("th, dt, code");
  $("pin-name").textContent = `${name ? name.textContent + ": " : ""}${button.textContent}`;
  $("pin").hidden = !pin;
  $("pin-name").hidden = false;
  hide();
  // a cut through elsewhere would hide the place
  if (state.axis >= 0) { $("section-axis").value = ""; $("section-axis").dispatchEvent(new Event("change")); }
  const fitting = fittingScale(canvas.clientWidth, canvas.clientHeight);
  if (pin && machine) showMoment(momentOf(pin, +layer || 0));
  if (pin) fly(inView(pin), Math.min(fitting, nearWidth() / Math.max(canvas.clientWidth, 1)));
  else fly(centre, fitting);
  $("view").scrollIntoView();
  canvas.focus({ preventScroll: true });
}

/** When the bead nearest to a place was laid; the end of its layer where beads tell no time. */
function momentOf(point, layer) {
  let best = layer ? endOfLayer(layer) : filmLength(), least = Infinity;
  for (const item of beads) {
    const time = item.scalars.find((s) => s.name === "time");
    if (!time) continue;
    for (let i = 0; i < item.points; i++) {
      const own = item.codes[4 * i + 3] & LAYER;
      if (layer && own && own !== layer) continue;
      const off = [0, 1, 2].reduce((sum, k) => sum + (scene.lo[k] + scene.step * item.codes[4 * i + k] - point[k]) ** 2, 0);
      if (off < least) { least = off; best = secondsOf(time) * (time.lo + time.step * time.codes[i]); }
    }
  }
  return best;
}

function drawPin() {
  if (pin) putAt($("pin"), pin);
}

function unpin() {
  flight++;
  pin = null;
  $("pin").hidden = $("pin-name").hidden = true;
}

function places() {
  for (const button of document.querySelectorAll("button.fly")) button.addEventListener("click", () => showPlace(button));
}
