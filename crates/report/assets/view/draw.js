// Draws the scene when something changed, never otherwise.
let pending = false;
function redraw() {
  if (pending || !gl) return;
  pending = true;
  requestAnimationFrame(() => { pending = false; draw(); });
}

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

function use(name, view, scalar, plain) {
  const { program, uniforms: u } = programs[name];
  gl.useProgram(program);
  gl.uniformMatrix4fv(u.uView, false, view.m);
  gl.uniformMatrix4fv(u.uModel, false, view.model);
  gl.uniform3fv(u.uLo, scene.lo);
  gl.uniform1f(u.uStep, scene.step);
  gl.uniform4fv(u.uClip, clipPlane());
  gl.uniform3fv(u.uEye, axes().eye);
  gl.uniform4fv(u.uPlain, plain);
  gl.uniform1i(u.uColoured, scalar ? 1 : 0);
  gl.uniform1i(u.uRamp, 0);
  const s = scalar || { lo: 0, step: 0, range: [0, 1], map: 0 };
  gl.uniform4f(u.uScalar, s.lo, s.step, s.range[0], 1 / Math.max(s.range[1] - s.range[0], 1e-30));
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, rampTextures[s.map]);
  return u;
}

function attribute(location, b, size, stride, offset, divisor) {
  gl.bindBuffer(gl.ARRAY_BUFFER, b);
  gl.enableVertexAttribArray(location);
  gl.vertexAttribIPointer(location, size, gl.UNSIGNED_SHORT, stride, offset);
  gl.vertexAttribDivisor(location, divisor);
}

function noAttributes() {
  for (let i = 0; i < 4; i++) { gl.disableVertexAttribArray(i); gl.vertexAttribDivisor(i, 0); }
  // scalars that an item lacks read as "no value"
  for (const i of [2, 3]) gl.vertexAttribI4ui(i, NO_VALUE, 0, 0, 0);
}

function drawLines(set, view, density) {
  if (!set.shown || set.points < 2) return;
  const scalar = set.width > 0 ? named(set, "lineScalar") : null;
  const half = Math.max(set.width > 0 ? 0.5 * set.width / camera.scale * density : 0, 0.6 * density);
  const u = use("lines", view, scalar, [...rgb(css(set.width > 0 ? "--bead" : "--hairline")), 1]);
  gl.uniform2f(u.uPixels, canvas.width, canvas.height);
  gl.uniform1f(u.uHalf, half);
  gl.uniform1f(u.uDepth, 0.25 * set.width / view.depth);
  gl.uniform2ui(u.uLayers, state.only ? state.layer : 1, state.layer);
  const buffers = camera.scale > 0.7 * scene.step * COARSE ? set.coarse : set.fine;
  noAttributes();
  attribute(0, buffers.buffer, 4, 8, 0, 1);
  attribute(1, buffers.buffer, 4, 8, 8, 1);
  if (scalar) {
    const values = buffers.scalars[set.scalars.indexOf(scalar)];
    attribute(2, values, 1, 2, 0, 1);
    attribute(3, values, 1, 2, 2, 1);
  }
  gl.enable(gl.SAMPLE_ALPHA_TO_COVERAGE);
  const laid = laidBy(set, buffers);
  if (laid > 1) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, laid - 1);
  gl.disable(gl.SAMPLE_ALPHA_TO_COVERAGE);
}

function drawSurface(surface, view) {
  const scalar = named(surface, "surfaceScalar");
  use("mesh", view, scalar, [...rgb(css("--metal")), surface.through ? surface.opacity : 1]);
  noAttributes();
  attribute(0, surface.buffer, 4, 8, 0, 0);
  if (scalar) attribute(2, scalar.buffer, 1, 2, 0, 0);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, surface.indexBuffer);
  throughOrSolid(surface, () => gl.drawElements(gl.TRIANGLES, surface.triangles.length, gl.UNSIGNED_INT, 0));
}

/** Draws opaque, or the nearest layer only and blended with what stands behind it. */
function throughOrSolid(item, drawIt) {
  if (!item.through) return drawIt();
  gl.colorMask(false, false, false, false);
  drawIt();
  gl.colorMask(true, true, true, true);
  gl.enable(gl.BLEND);
  drawIt();
  gl.disable(gl.BLEND);
}

function drawHeights(h, view) {
  // what is laid now is shown by its beads
  const frame = heightFrame(state.layer - (film.upto < Infinity)), n = h.nx * h.ny;
  if (!h.shown || frame < 0 || h.nx < 2 || h.ny < 2) return;
  const index = heightScalarIndex(), own = { lo: h.lo, step: h.step, range: [h.lo, h.lo + 65534 * h.step], map: 0 };
  const scalar = index === -1 ? own : h.scalars[index] || null;
  if (shownFrame !== frame + ":" + index) {
    shownFrame = frame + ":" + index;
    const put = (unit, t, data, f) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, t);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, h.nx, h.ny, 0, gl.RED_INTEGER, gl.UNSIGNED_SHORT, data, f * n);
    };
    put(1, h.now, h.codes, frame);
    // before the first frame everything is new
    if (frame > 0) put(2, h.before, h.codes, frame - 1); else put(2, h.before, new Uint16Array(n).fill(NO_VALUE), 0);
    put(3, h.field, index >= 0 ? h.scalars[index].codes : h.codes, frame);
  }
  const u = use("heights", view, scalar, [...rgb(css("--metal")), h.through ? h.opacity : 1]);
  [h.now, h.before, h.field].forEach((t, i) => { gl.activeTexture(gl.TEXTURE1 + i); gl.bindTexture(gl.TEXTURE_2D, t); });
  gl.uniform1i(u.uNow, 1); gl.uniform1i(u.uBefore, 2); gl.uniform1i(u.uField, 3);
  gl.uniform2i(u.uCells, h.nx, h.ny);
  gl.uniform3f(u.uGrid, h.origin[0], h.origin[1], h.cell);
  gl.uniform2f(u.uHeight, h.lo, h.step);
  gl.uniform1i(u.uFieldIs, index >= 0 ? 1 : 0);
  gl.uniform1i(u.uOnly, state.only ? 1 : 0);
  noAttributes();
  throughOrSolid(h, () => gl.drawArrays(gl.TRIANGLES, 0, 6 * (h.nx - 1) * (h.ny - 1)));
}

function draw() {
  if (!gl || !canvas.clientWidth) return;
  const density = Math.min(window.devicePixelRatio || 1, 2);
  const w = Math.round(canvas.clientWidth * density), h = Math.round(canvas.clientHeight * density);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  followSize();
  gl.viewport(0, 0, w, h);
  gl.clearColor(...rgb(css("--stage")), 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  const view = { ...viewMatrix(), model: film.part || UNMOVED };
  use("grid", view, null, [...rgb(css("--stage-grid")), 1]);
  noAttributes();
  gl.bindBuffer(gl.ARRAY_BUFFER, gridBuffer);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
  gl.drawArrays(gl.LINES, 0, gridCount);
  const surfaces = (through) => {
    if (scene.heights && scene.heights.through === through) drawHeights(scene.heights, view);
    for (const s of scene.surfaces) if (s.shown && s.through === through && !(s.finished && film.upto < Infinity)) drawSurface(s, view);
  };
  surfaces(false);
  drawMachine(view);
  for (const l of scene.lines) drawLines(l, view, density);
  surfaces(true);
  drawTriad();
  drawScale();
  drawPin();
}

function drawTriad() {
  const { right, up, eye } = axes();
  const colours = ["#d64545", "#2f9e44", "#3b7dd8"];
  const parts = [0, 1, 2].map((k) => ({ k, x: 24 * right[k], y: -24 * up[k], depth: eye[k] })).sort((a, b) => a.depth - b.depth);
  $("triad").innerHTML = parts.map(({ k, x, y }) =>
    `<path d="M0 0L${x.toFixed(1)} ${y.toFixed(1)}" stroke="${colours[k]}" stroke-width="2.5"/>` +
    `<text x="${(1.35 * x).toFixed(1)}" y="${(1.35 * y + 4).toFixed(1)}" text-anchor="middle" fill="${colours[k]}">${"XYZ"[k]}</text>`).join("");
}

/** 1, 2 or 5 times a power of ten, at least `least`. */
function roundLength(least) {
  const decade = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((m) => m * decade).find((v) => v >= least * 0.999);
}

function drawScale() {
  const length = roundLength(60 * camera.scale);
  $("scale").firstElementChild.textContent = length + " mm";
  $("scale").style.width = length / camera.scale + "px";
}
