// From columns to buffers and textures of the graphics card.
const canvas = $("canvas");
let gl, programs, rampTextures, gridBuffer, gridCount;

function compile([vertex, fragment]) {
  const program = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(program, i);
    uniforms[name] = gl.getUniformLocation(program, name);
  }
  return { program, uniforms };
}

function buffer(data, target = gl.ARRAY_BUFFER) {
  const b = gl.createBuffer();
  gl.bindBuffer(target, b);
  gl.bufferData(target, data, gl.STATIC_DRAW);
  return b;
}

function texture(unit, filter) {
  const t = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, t);
  for (const f of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, f, filter);
  for (const w of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, w, gl.CLAMP_TO_EDGE);
  return t;
}

function rampColour(stops, t) {
  const at = Math.min(Math.max(t, 0), 1) * (stops.length - 1), i = Math.min(Math.floor(at), stops.length - 2);
  return stops[i].map((c, k) => Math.round(c + (at - i) * (stops[i + 1][k] - c)));
}

/** Points nearer to one another than this, in codes, are one pixel until a person zooms in. */
const COARSE = 65534 / 1000;

/** Indices of the points that show from afar: the ends of each polyline, and points a pixel apart. */
function coarse({ codes, points }) {
  const kept = [];
  let last = 0;
  for (let i = 0; i < points; i++) {
    const end = codes[4 * i + 3] & START || i + 1 === points || codes[4 * i + 7] & START;
    const far = [0, 1, 2].reduce((sum, k) => sum + (codes[4 * i + k] - codes[4 * last + k]) ** 2, 0) > COARSE ** 2;
    if (end || far) kept.push(last = i);
  }
  return kept;
}

/** Buffers of all points, or of those kept. */
function lineBuffers({ codes, points, scalars }, kept) {
  const pick = (all, width) => {
    if (!kept) return all;
    const some = new Uint16Array(width * kept.length);
    kept.forEach((i, at) => { for (let k = 0; k < width; k++) some[width * at + k] = all[width * i + k]; });
    return some;
  };
  return { kept, points: kept ? kept.length : points, buffer: buffer(pick(codes, 4)), scalars: scalars.map((s) => buffer(pick(s.codes, 1))) };
}

function upload() {
  programs = Object.fromEntries(Object.entries(PROGRAMS).map(([name, text]) => [name, compile(text)]));
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  rampTextures = scene.maps.map((stops) => {
    const t = texture(0, gl.LINEAR), texels = new Uint8Array(256 * 4);
    for (let i = 0; i < 256; i++) texels.set([...rampColour(stops, i / 255), 255], 4 * i);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, texels);
    return t;
  });
  for (const set of scene.lines) {
    set.fine = lineBuffers(set, null);
    const kept = set.points > 20_000 ? coarse(set) : null;
    set.coarse = kept ? lineBuffers(set, kept) : set.fine;
  }
  for (const surface of scene.surfaces) {
    surface.buffer = buffer(surface.codes);
    for (const s of surface.scalars) s.buffer = buffer(s.codes);
    surface.indexBuffer = buffer(surface.triangles, gl.ELEMENT_ARRAY_BUFFER);
  }
  const h = scene.heights;
  if (h) [h.now, h.before, h.field] = [1, 2, 3].map((unit) => texture(unit, gl.NEAREST));
  // a ground grid of round cells under everything
  const [sx, sy] = scene.size, cell = roundLength(Math.max(sx, sy, 1) / 12), points = [];
  const lo = [0, 1].map((k) => Math.floor(scene.lo[k] / cell - 0.5) * cell);
  const hi = [0, 1].map((k) => Math.ceil((scene.lo[k] + scene.size[k]) / cell + 0.5) * cell);
  const z = scene.lo[2] - 1e-4 * Math.max(...scene.size, 1);
  for (let x = lo[0]; x <= hi[0] + cell / 2; x += cell) points.push(x, lo[1], z, x, hi[1], z);
  for (let y = lo[1]; y <= hi[1] + cell / 2; y += cell) points.push(lo[0], y, z, hi[0], y, z);
  gridBuffer = buffer(new Float32Array(points));
  gridCount = points.length / 3;
}
