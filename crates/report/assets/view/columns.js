// The packed scene: its description, and its columns undone: base64, raw DEFLATE, byte planes, zigzag differences.
// The other side is packing.rs and scene_data.rs.
const scene = JSON.parse($("scene").textContent);
const NO_VALUE = 65535, START = 0x8000, LAYER = 0x7fff;

async function inflated(column) {
  const element = $("column-" + column);
  const text = atob(element.textContent);
  element.remove();
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function codes(column, stride) {
  const planes = await inflated(column), n = planes.length / 2, out = new Uint16Array(n);
  for (let i = 0; i < n; i++) {
    const z = planes[i] | planes[n + i] << 8;
    out[i] = (i < stride ? 0 : out[i - stride]) + ((z >>> 1) ^ -(z & 1));
  }
  return out;
}

async function indices(column, stride) {
  const planes = await inflated(column), n = planes.length / 4, out = new Uint32Array(n);
  for (let i = 0; i < n; i++) {
    const z = (planes[i] | planes[n + i] << 8 | planes[2 * n + i] << 16 | planes[3 * n + i] << 24) >>> 0;
    out[i] = (i < stride ? 0 : out[i - stride]) + ((z >>> 1) ^ -(z & 1));
  }
  return out;
}

async function unpack() {
  const scalars = async (list, stride) => {
    for (const s of list) s.codes = await codes(s.data, stride);
  };
  for (const l of scene.lines) { l.codes = await codes(l.data, 4); await scalars(l.scalars, 1); }
  for (const s of scene.surfaces) {
    s.codes = await codes(s.data, 4);
    s.triangles = await indices(s.indices, 3);
    await scalars(s.scalars, 1);
  }
  const m = scene.machine;
  if (m) {
    for (const b of m.bodies) { b.codes = await codes(b.data, 4); b.triangles = await indices(b.indices, 3); }
    for (const column of [...m.axes, m.times]) column.codes = await codes(column.data, 1);
    m.layers = { codes: await codes(m.layers, 1) };
  }
  const h = scene.heights;
  if (h) { h.codes = await codes(h.data, h.nx * h.ny); await scalars(h.scalars, h.nx * h.ny); }
}
