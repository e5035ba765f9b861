// GLSL programs: round beads, meshes, height maps, the ground grid. Positions are 16-bit codes of the scene's box.
const COMMON = `#version 300 es
precision highp float; precision highp int;
uniform mat4 uView; uniform mat4 uModel; uniform vec3 uLo; uniform float uStep;
uniform vec4 uScalar;      // value of code 0, step, low end of the colours, 1 / their range
vec3 placed(vec3 p) { return (uModel * vec4(p, 1.0)).xyz; }
// place on the colour ramp and 1; zeros for no value, so that what lies between a value and none shows no colour
vec2 ramp(uint code) {
  return code == 65535u ? vec2(0.0) : vec2(clamp((uScalar.x + uScalar.y * float(code) - uScalar.z) * uScalar.w, 0.0, 1.0), 1.0);
}
`;
const SHADE = `#version 300 es
precision highp float; precision highp int;
uniform sampler2D uRamp; uniform int uColoured; uniform vec4 uPlain; uniform vec4 uClip; uniform vec3 uEye;
out vec4 colour;
vec3 base(vec2 t) {
  if (uColoured == 0 || t.y < 0.99) return uPlain.rgb;
  return texture(uRamp, vec2((t.x * 255.0 + 0.5) / 256.0, 0.5)).rgb;
}
void clip(vec3 p) { if (dot(uClip.xyz, p) > uClip.w) discard; }
vec3 lit(vec3 c, vec3 n) {
  float facing = abs(dot(n, uEye));
  float sky = 0.5 + 0.5 * n.z;
  float key = max(dot(n, normalize(uEye + vec3(-0.4, -0.3, 0.8))), 0.0);
  return c * (0.34 + 0.26 * facing + 0.16 * sky + 0.34 * key);
}
`;
const PROGRAMS = {
  lines: [COMMON + `
layout(location=0) in uvec4 aA; layout(location=1) in uvec4 aB;
layout(location=2) in uint aSA; layout(location=3) in uint aSB;
uniform vec2 uPixels; uniform float uHalf; uniform uvec2 uLayers;
out vec2 vAt; out vec3 vPoint; flat out float vLength; out vec2 vT;
void main() {
  uint layer = aB.w & 0x7fffu;
  bool shown = layer == 0u || (layer >= uLayers.x && layer <= uLayers.y);
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  if ((aB.w & 0x8000u) != 0u || !shown) return;
  vec3 pa = placed(uLo + uStep * vec3(aA.xyz)), pb = placed(uLo + uStep * vec3(aB.xyz));
  vec4 ca = uView * vec4(pa, 1.0), cb = uView * vec4(pb, 1.0);
  vec2 a = ca.xy * 0.5 * uPixels, b = cb.xy * 0.5 * uPixels, d = b - a;
  float len = length(d);
  vec2 along = len > 1e-3 ? d / len : vec2(1.0, 0.0), across = vec2(-along.y, along.x);
  float end = float(gl_VertexID & 1), side = float(gl_VertexID >> 1) * 2.0 - 1.0;
  float reach = uHalf + 1.0;
  vec2 at = mix(a, b, end) + along * reach * (end * 2.0 - 1.0) + across * reach * side;
  vLength = len;
  vAt = vec2(mix(-reach, len + reach, end), reach * side);
  vPoint = mix(pa, pb, end);
  vT = mix(ramp(aSA), ramp(aSB), end);
  gl_Position = vec4(at * 2.0 / uPixels, mix(ca.z, cb.z, end), 1.0);
}`, SHADE + `
uniform float uHalf; uniform float uDepth;
in vec2 vAt; in vec3 vPoint; flat in float vLength; in vec2 vT;
void main() {
  clip(vPoint);
  float off = length(vec2(vAt.x - clamp(vAt.x, 0.0, vLength), vAt.y));
  float cover = clamp(uHalf + 0.5 - off, 0.0, 1.0);
  if (cover <= 0.0) discard;
  float height = sqrt(max(0.0, 1.0 - off * off / (uHalf * uHalf)));
  float shade = mix(1.0, 0.5 + 0.55 * height, clamp(uHalf - 0.8, 0.0, 1.0));
  gl_FragDepth = gl_FragCoord.z - uDepth * height;
  colour = vec4(base(vT) * shade, cover * uPlain.a);
}`],
  mesh: [COMMON + `
layout(location=0) in uvec4 aA; layout(location=2) in uint aSA;
out vec3 vPoint; out vec2 vT;
void main() {
  vPoint = placed(uLo + uStep * vec3(aA.xyz));
  vT = ramp(aSA);
  gl_Position = uView * vec4(vPoint, 1.0);
}`, SHADE + `
in vec3 vPoint; in vec2 vT;
void main() {
  clip(vPoint);
  vec3 n = normalize(cross(dFdx(vPoint), dFdy(vPoint)));
  if (dot(n, uEye) < 0.0) n = -n;
  if (!gl_FrontFacing && uClip.w < 1e29) { colour = vec4(0.80, 0.45, 0.22, 1.0); return; }
  colour = vec4(lit(base(vT), n), uPlain.a);
}`],
  heights: [COMMON + `
uniform highp usampler2D uNow, uBefore, uField; uniform ivec2 uCells; uniform vec3 uGrid; uniform vec2 uHeight; uniform int uFieldIs;
out vec3 vPoint; out vec3 vNormal; out vec2 vT; out float vNew;
uint code(ivec2 c) { return texelFetch(uNow, clamp(c, ivec2(0), uCells - 1), 0).r; }
float z(ivec2 c, float own) { uint q = code(c); return q == 65535u ? own : uHeight.x + uHeight.y * float(q); }
void main() {
  int cell = gl_VertexID / 6, corner = gl_VertexID % 6, across = uCells.x - 1;
  ivec2 c0 = ivec2(cell % across, cell / across);
  int k = corner == 0 ? 0 : corner == 1 || corner == 3 ? 1 : corner == 2 || corner == 5 ? 2 : 3;
  k = corner == 4 ? 3 : k;
  ivec2 c = c0 + ivec2(k & 1, k >> 1);
  bool hole = code(c0) == 65535u || code(c0 + ivec2(1, 0)) == 65535u || code(c0 + ivec2(0, 1)) == 65535u || code(c0 + 1) == 65535u;
  uint q = code(c);
  float own = uHeight.x + uHeight.y * float(q);
  vPoint = placed(vec3(uGrid.xy + uGrid.z * vec2(c), own));
  vNormal = mat3(uModel) * vec3(z(c - ivec2(1, 0), own) - z(c + ivec2(1, 0), own), z(c - ivec2(0, 1), own) - z(c + ivec2(0, 1), own), 2.0 * uGrid.z);
  vNew = texelFetch(uBefore, c, 0).r != q ? 1.0 : 0.0;
  vT = ramp(uFieldIs == 0 ? q : texelFetch(uField, c, 0).r);
  gl_Position = hole ? vec4(2.0, 2.0, 2.0, 1.0) : uView * vec4(vPoint, 1.0);
}`, SHADE + `
uniform int uOnly;
in vec3 vPoint; in vec3 vNormal; in vec2 vT; in float vNew;
void main() {
  clip(vPoint);
  if (!gl_FrontFacing) { colour = vec4(uClip.w < 1e29 ? vec3(0.80, 0.45, 0.22) : vec3(0.45), 1.0); return; }
  bool old = uOnly == 1 && vNew < 0.5;
  colour = vec4(lit(old ? vec3(0.62) : base(vT), normalize(vNormal)), uPlain.a);
}`],
  grid: [COMMON + `
layout(location=0) in vec3 aPoint;
void main() { gl_Position = uView * vec4(aPoint, 1.0); }`, SHADE + `
void main() { colour = uPlain; }`],
};
