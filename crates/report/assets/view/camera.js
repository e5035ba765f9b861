// What is looked at and from where: a parallel projection, so that the scale bar holds everywhere in the picture.
const centre = scene.lo.map((v, k) => v + scene.size[k] / 2);
const radius = Math.max(Math.hypot(...scene.size) / 2, 1e-3);
const camera = { target: [...centre], azimuth: -0.9, height: 0.6, scale: 1 };
const state = { layer: Math.max(scene.layers, 1), only: false, lineScalar: -1, surfaceScalar: -1, axis: -1, cut: 0.5 };
let shownFrame = "";

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Right, up, and towards the eye. */
function axes() {
  const { azimuth: a, height: h } = camera;
  const eye = [Math.cos(h) * Math.cos(a), Math.cos(h) * Math.sin(a), Math.sin(h)];
  const right = [-Math.sin(a), Math.cos(a), 0];
  return { right, up: cross(eye, right), eye };
}

function viewMatrix() {
  const { right, up, eye } = axes();
  const w = canvas.clientWidth * camera.scale / 2, h = canvas.clientHeight * camera.scale / 2;
  // everything stays between the depth planes, wherever the target was moved
  const depth = Math.max(2 * radius, machine && machine.shown ? machine.reach : 0) + Math.hypot(...camera.target.map((v, k) => v - centre[k]));
  const rows = [right.map((v) => v / w), up.map((v) => v / h), eye.map((v) => -v / depth)];
  const m = new Float32Array(16);
  rows.forEach((row, r) => {
    for (let k = 0; k < 3; k++) m[4 * k + r] = row[k];
    m[12 + r] = -dot(row, camera.target);
  });
  m[15] = 1;
  return { m, rows, depth };
}

const VIEWS = { top: [-Math.PI / 2, Math.PI / 2], front: [-Math.PI / 2, 0], side: [0, 0], oblique: [-0.9, 0.6] };

function look(name) {
  if (name === "cell") return lookAtCell();
  unpin();
  if (name in VIEWS) [camera.azimuth, camera.height] = VIEWS[name];
  camera.target = [...centre];
  camera.scale = fittingScale(canvas.clientWidth, canvas.clientHeight);
  redraw();
}

/** Millimetres per pixel at which the whole scene fits. */
function fittingScale(width, height) {
  const { right, up } = axes();
  const extent = (axis) => axis.reduce((sum, v, k) => sum + Math.abs(v) * scene.size[k], 0);
  return 1.1 * Math.max(extent(right) / Math.max(width, 1), extent(up) / Math.max(height, 1), 1e-6);
}

/** Keeps the same part of the scene in sight when the canvas changes its size. */
const drawnSize = [0, 0];
function followSize() {
  const size = [canvas.clientWidth, canvas.clientHeight];
  if (drawnSize[0]) camera.scale *= fittingScale(...size) / fittingScale(...drawnSize);
  drawnSize.splice(0, 2, ...size);
}

function clipPlane() {
  if (state.axis < 0) return [0, 0, 0, 1e30];
  // keeps the side away from the eye for X and Y, the lower side for Z
  const towards = state.axis === 2 || axes().eye[state.axis] >= 0 ? 1 : -1;
  const plane = [0, 0, 0, towards * cutPlace()];
  plane[state.axis] = towards;
  return plane;
}

const cutPlace = () => scene.lo[state.axis] + state.cut * scene.size[state.axis];

/** Index of the last height frame at or below the layer; -1 before the first. */
function heightFrame(layer) {
  let frame = -1;
  for (const n of scene.heights.numbers) if (n <= layer) frame++;
  return frame;
}
