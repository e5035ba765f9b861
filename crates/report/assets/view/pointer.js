// Mouse, touch, keys, and the read-out under the pointer.
function turn(dx, dy) {
  camera.azimuth -= dx * 0.008;
  camera.height = Math.min(Math.max(camera.height + dy * 0.008, -Math.PI / 2), Math.PI / 2);
}

function shift(dx, dy) {
  const { right, up } = axes();
  camera.target = camera.target.map((v, k) => v + camera.scale * (-right[k] * dx + up[k] * dy));
}

/** Zooms about a point of the canvas given from its centre, in pixels, so that what is there stays there. */
function zoom(factor, x = 0, y = 0) {
  const next = Math.min(Math.max(camera.scale * factor, radius * 1e-6), radius);
  const { right, up } = axes(), d = camera.scale - next;
  camera.target = camera.target.map((v, k) => v + d * (right[k] * x - up[k] * y));
  camera.scale = next;
}

function fromCentre(e) {
  const box = canvas.getBoundingClientRect();
  return [e.clientX - box.left - box.width / 2, e.clientY - box.top - box.height / 2];
}

function pointers() {
  const down = new Map();
  let hover = 0;
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); down.set(e.pointerId, e); hide(); });
  for (const type of ["pointerup", "pointercancel"]) canvas.addEventListener(type, (e) => down.delete(e.pointerId));
  canvas.addEventListener("pointerleave", () => { clearTimeout(hover); hide(); });
  canvas.addEventListener("pointermove", (e) => {
    const last = down.get(e.pointerId);
    if (!last) {
      clearTimeout(hover);
      hover = setTimeout(() => readOut(...fromCentre(e)), 60);
      return;
    }
    const dx = e.clientX - last.clientX, dy = e.clientY - last.clientY;
    if (down.size === 1) {
      if (e.shiftKey || e.buttons & 6) shift(dx, dy); else turn(dx, dy);
    } else {
      const other = [...down.values()].find((p) => p.pointerId !== e.pointerId);
      const [ox, oy] = fromCentre(other), [x, y] = fromCentre(e), [lx, ly] = fromCentre(last);
      zoom(Math.hypot(lx - ox, ly - oy) / Math.max(Math.hypot(x - ox, y - oy), 1), (x + ox) / 2, (y + oy) / 2);
      shift(dx / 2, dy / 2);
    }
    down.set(e.pointerId, e);
    redraw();
  });
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom(Math.exp(Math.sign(e.deltaY) * Math.min(Math.abs(e.deltaY), 100) * 0.0016), ...fromCentre(e));
    redraw();
  }, { passive: false });
  canvas.addEventListener("dblclick", (e) => {
    const hit = nearest(...fromCentre(e));
    if (hit) { camera.target = inView(hit.point); redraw(); }
  });
  const keys = { f: "fit", t: "top", r: "front", s: "side", i: "oblique" };
  canvas.addEventListener("keydown", (e) => {
    const arrow = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] }[e.key];
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    if (arrow) { if (e.shiftKey) shift(...arrow); else turn(...arrow); }
    else if (e.key === "+" || e.key === "=") zoom(0.85);
    else if (e.key === "-") zoom(1 / 0.85);
    else if (e.key.toLowerCase() in keys) return look(keys[e.key.toLowerCase()]);
    else return;
    e.preventDefault();
    redraw();
  });
}

/** The point within eight pixels of (x, y) that lies nearest to the eye. */
function nearest(x, y) {
  const { right, up, eye } = axes(), s = camera.scale, plane = clipPlane();
  const origin = [dot(right, camera.target) + x * s, dot(up, camera.target) - y * s];
  const reach = (8 * s) ** 2;
  let best = null, bestDepth = -Infinity;
  const consider = (px, py, pz, give) => {
    const own = [px, py, pz];
    if (film.part) [px, py, pz] = moved(film.part, own);
    const u = right[0] * px + right[1] * py + right[2] * pz - origin[0];
    const v = up[0] * px + up[1] * py + up[2] * pz - origin[1];
    const off = u * u + v * v;
    if (off > reach) return;
    // nearer to the pointer counts as nearer to the eye, pixel for pixel
    const depth = eye[0] * px + eye[1] * py + eye[2] * pz - 2 * Math.sqrt(off);
    if (depth <= bestDepth || plane[0] * px + plane[1] * py + plane[2] * pz > plane[3]) return;
    bestDepth = depth;
    best = { point: own, ...give() };
  };
  const first = state.only ? state.layer : 1;
  for (const item of scene.lines) {
    if (!item.shown || item.width <= 0) continue;
    const laid = laidBy(item, { points: item.points });
    for (let i = 0; i < laid; i++) {
      const layer = item.codes[4 * i + 3] & LAYER;
      if (layer && (layer < first || layer > state.layer)) continue;
      const at = (k) => scene.lo[k] + scene.step * item.codes[4 * i + k];
      consider(at(0), at(1), at(2), () => ({ item, index: i, layer }));
    }
  }
  const h = scene.heights, frame = h ? heightFrame(state.layer) : -1;
  if (h && h.shown && frame >= 0) {
    const base = frame * h.nx * h.ny;
    for (let iy = 0, i = base; iy < h.ny; iy++) for (let ix = 0; ix < h.nx; ix++, i++) {
      if (h.codes[i] === NO_VALUE) continue;
      consider(h.origin[0] + ix * h.cell, h.origin[1] + iy * h.cell, h.lo + h.step * h.codes[i], () => ({ item: h, index: i, layer: 0 }));
    }
  }
  return best;
}

function readOut(x, y) {
  const hit = nearest(x, y);
  if (!hit) return hide();
  const value = (s) => s.codes[hit.index] === NO_VALUE ? "–" : figure(s.lo + s.step * s.codes[hit.index]) + (s.unit ? " " + s.unit : "");
  const rows = [hit.item.name + (hit.layer ? `, layer ${hit.layer}` : ""), ...hit.item.scalars.map((s) => `${s.name}: ${value(s)}`),
    "x, y, z: " + hit.point.map((v) => figure(+v.toFixed(2), 6)).join(", ") + " mm"];
  const out = $("readout");
  out.replaceChildren(...rows.map((text) => Object.assign(document.createElement("div"), { textContent: text })));
  putAt($("marker"), hit.point);
  out.hidden = $("marker").hidden = false;
}

/** Where a point of the part is drawn. */
const inView = (point) => film.part ? moved(film.part, point) : point;

/** Puts an element of the page over a point of the scene. */
function putAt(element, point) {
  const { right, up } = axes(), d = inView(point).map((v, k) => v - camera.target[k]);
  element.style.left = canvas.clientWidth / 2 + dot(right, d) / camera.scale + "px";
  element.style.top = canvas.clientHeight / 2 - dot(up, d) / camera.scale + "px";
}

function hide() { $("readout").hidden = $("marker").hidden = true; }
