// The machine that moves around the part, as a film: bodies on axes, and the metal up to the moment shown.
// While the machine is shown the world stands, and the part lies and moves in it as its holder has it.
const machine = scene.machine;
const film = { now: 0, upto: Infinity, partStands: false, part: null, bodies: [] };
const UNMOVED = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** A pose, position then quaternion, as a matrix by columns. */
function poseMatrix([px, py, pz, x, y, z, w]) {
  return [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
    2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
    2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0, px, py, pz, 1];
}

function product(a, b) {
  const m = new Array(16).fill(0);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return m;
}

function inverse(m) {
  const t = [m[12], m[13], m[14]], back = (k) => -dot([m[4 * k], m[4 * k + 1], m[4 * k + 2]], t);
  return [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, back(0), back(1), back(2), 1];
}

const moved = (m, p) => [0, 1, 2].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);

const timeOf = (i) => machine.times.lo + machine.times.step * machine.times.codes[i];
const filmLength = () => timeOf(machine.times.codes.length - 1);

/** How many of `count` values in order are at most `value`. */
function countUpTo(value, count, get) {
  let lo = 0, hi = count;
  while (lo < hi) { const mid = (lo + hi) >> 1; if (get(mid) <= value) lo = mid + 1; else hi = mid; }
  return lo;
}

/** Matrices of all bodies and of the part in the world, at a time. */
function placed(time) {
  const last = machine.times.codes.length - 1;
  const i = Math.max(Math.min(countUpTo(time, last + 1, timeOf) - 1, last), 0), j = Math.min(i + 1, last);
  const share = timeOf(j) > timeOf(i) ? Math.min((time - timeOf(i)) / (timeOf(j) - timeOf(i)), 1) : 0;
  const values = machine.axes.map((a) => a.lo + a.step * (a.codes[i] + share * (a.codes[j] - a.codes[i])));
  const bodies = [];
  for (const body of machine.bodies) {
    let m = poseMatrix(body.pose);
    if (body.axis !== null) {
      const v = values[body.axis], s = Math.sin(v / 2);
      m = product(m, poseMatrix(body.turns ? [0, 0, 0, ...body.along.map((k) => k * s), Math.cos(v / 2)] : [...body.along.map((k) => k * v), 0, 0, 0, 1]));
    }
    bodies.push(body.carrier === null ? m : product(bodies[body.carrier], m));
  }
  const part = poseMatrix(machine.part);
  return { bodies, part: machine.holder === null ? part : product(bodies[machine.holder], part), layer: machine.layers.codes[i] };
}

/** Moves the machine to a time; the metal follows where it is told to. */
function setMoment(time) {
  film.now = Math.min(Math.max(time, 0), filmLength());
  const at = placed(film.now), from = machine.shown && !film.partStands ? machine.world : inverse(at.part);
  film.bodies = at.bodies.map((m) => product(from, m));
  const part = product(from, at.part);
  film.part = part.some((v, k) => Math.abs(v - UNMOVED[k]) > 1e-4) ? part : null;
  $("film").value = Math.round(1000 * film.now / Math.max(filmLength(), 1e-9));
  $("film-label").textContent = `${figure(film.now / 60, 3)} min`;
  hide();
  redraw();
  return at.layer;
}

/** Shows the build as it stands at a time. */
function showMoment(time) {
  const layer = setMoment(time);
  film.upto = film.now >= filmLength() ? Infinity : film.now;
  state.layer = Math.max(layer, 1);
  $("layer").value = state.layer;
  $("layer-label").textContent = `${state.layer} of ${scene.layers}`;
}

/** The end of a layer; the whole film for the last. */
function endOfLayer(layer) {
  if (layer >= scene.layers) return filmLength();
  return timeOf(Math.max(countUpTo(layer, machine.layers.codes.length, (i) => machine.layers.codes[i]) - 1, 0));
}

const secondsOf = (time) => time.unit === "min" ? 60 : 1;

/** Points of a set that are laid by now: those of sets that tell no time all are. */
function laidBy(set, buffers) {
  const time = film.upto < Infinity && set.scalars.find((s) => s.name === "time");
  if (!time) return buffers.points;
  const at = buffers.kept ? (i) => time.codes[buffers.kept[i]] : (i) => time.codes[i];
  return countUpTo((film.upto / secondsOf(time) - time.lo) / Math.max(time.step, 1e-30), buffers.points, at);
}

function drawMachine(view) {
  if (!machine || !machine.shown) return;
  machine.bodies.forEach((body, i) => {
    if (!body.triangles.length) return;
    const u = use("mesh", { ...view, model: film.bodies[i] }, null, [...rgb(css("--machine")), 1]);
    gl.uniform3f(u.uLo, body.lo, body.lo, body.lo);
    gl.uniform1f(u.uStep, body.step);
    // a cut is for the part
    gl.uniform4f(u.uClip, 0, 0, 0, 1e30);
    noAttributes();
    attribute(0, body.buffer, 4, 8, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, body.indexBuffer);
    gl.drawElements(gl.TRIANGLES, body.triangles.length, gl.UNSIGNED_INT, 0);
  });
}

/** Corners of the part's box and of everything that the machine is made of, now. */
function machineCorners() {
  const box = [0, 1, 2, 3, 4, 5, 6, 7].map((c) => inView(scene.lo.map((v, k) => v + (c >> k & 1) * scene.size[k])));
  return box.concat(machine.bodies.flatMap((body, i) => {
    const own = [];
    for (let v = 0; v < body.codes.length; v += 4) own.push(moved(film.bodies[i], [0, 1, 2].map((k) => body.lo + body.step * body.codes[v + k])));
    return own;
  }));
}

/** Looks at the whole cell. */
function lookAtCell() {
  unpin();
  showMachine(true);
  const corners = machineCorners(), { right, up } = axes();
  const span = (axis) => { const along = corners.map((c) => dot(axis, c)); return [Math.min(...along), Math.max(...along)]; };
  const middle = [0, 1, 2].map((k) => { const [lo, hi] = span([0, 1, 2].map((j) => +(j === k))); return (lo + hi) / 2; });
  const width = (axis) => { const [lo, hi] = span(axis); return hi - lo; };
  const scale = 1.1 * Math.max(width(right) / canvas.clientWidth, width(up) / canvas.clientHeight, 1e-6);
  fly(middle, scale);
}

function showMachine(on) {
  machine.shown = on;
  $("machine-shown").checked = on;
  setMoment(film.now);
}

function filmControls() {
  $("film-controls").hidden = document.querySelector("[data-view=cell]").hidden = !machine;
  if (!machine) return;
  for (const body of machine.bodies) {
    body.buffer = buffer(body.codes);
    body.indexBuffer = buffer(body.triangles, gl.ELEMENT_ARRAY_BUFFER);
  }
  // the world, shifted so that the part's middle is where it is without the machine
  const first = moved(placed(0).part, centre);
  machine.world = poseMatrix([...centre.map((v, k) => v - first[k]), 0, 0, 0, 1]);
  machine.shown = false;
  $("machine-name").textContent = machine.name;
  setMoment(Infinity);
  // the planes of depth hold everything that it may reach
  machine.reach = 2 * Math.max(...machineCorners().map((c) => Math.hypot(...c.map((v, k) => v - centre[k]))), 0);
  $("machine-shown").addEventListener("change", (e) => showMachine(e.target.checked));
  $("part-stands").addEventListener("change", (e) => { film.partStands = e.target.checked; setMoment(film.now); });
  $("film").addEventListener("input", (e) => { const time = filmLength() * (e.target.value / 1000); showMachine(true); showMoment(time); });
  let timer = 0;
  const play = $("film-play");
  const stop = () => { clearInterval(timer); timer = 0; play.textContent = "▶"; play.setAttribute("aria-label", "Play the film"); };
  play.addEventListener("click", () => {
    if (timer) return stop();
    showMachine(true);
    if (film.now >= filmLength()) showMoment(0);
    play.textContent = "❚❚";
    play.setAttribute("aria-label", "Stop");
    // the whole build within half a minute
    timer = setInterval(() => { showMoment(film.now + filmLength() / 600); if (film.now >= filmLength()) stop(); }, 50);
  });
}
