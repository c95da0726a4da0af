uniform int uMode;          // 0 field, 1 groups, 2 zebra, 3 isophotes, 4 plain
uniform vec3 uEye;
uniform vec3 uRight;
uniform vec3 uUp;
uniform float uStripes;
uniform float uAngle;
uniform vec2 uIsoStep;      // 0 switches a family of isolines off

in vec3 vPosition;
in vec3 vNormal;
in float vValue;
in vec2 vIso;
in vec2 vDiagram;
in float vSelected;
flat in vec4 vGroup;
out vec4 colour;

const vec3 INK = vec3(0.09, 0.11, 0.15);
const vec3 CLAY = vec3(0.86, 0.845, 0.82);

// Dark stripes with an edge one pixel wide, fading to grey where they get too dense to draw.
float stripes(float t) {
  float wide = max(fwidth(t), 1e-7);
  float d = abs(fract(t) - 0.5) - 0.25;
  float edge = clamp(d / wide + 0.5, 0.0, 1.0);
  return mix(edge, 0.5, smoothstep(0.25, 0.5, wide));
}

// 1 on a line where `v` is a multiple of `gap`, `width` pixels wide.
float isoline(float v, float gap, float width) {
  if (gap <= 0.0 || !hasValue(v)) return 0.0;
  float t = v / gap;
  float wide = fwidth(t);
  if (wide <= 0.0) return 0.0;
  float off = abs(fract(t - 0.5) - 0.5) / wide;
  float line = 1.0 - clamp(off - 0.5 * width + 0.5, 0.0, 1.0);
  return line * (1.0 - smoothstep(0.15, 0.45, wide));
}

void main() {
  vec3 toEye = normalize(uEye - vPosition);
  vec3 n = normalize(vNormal);
  bool backSide = dot(n, toEye) < 0.0;
  if (backSide) n = -n;

  vec3 back = cross(uRight, uUp);
  vec3 axis = cos(uAngle) * uUp + sin(uAngle) * uRight;
  vec3 base;
  float lit = 1.0;
  if (uMode == 2) {
    vec3 r = reflect(-toEye, n);
    float s = stripes(uStripes * asin(clamp(dot(r, axis), -1.0, 1.0)) / 3.14159265);
    base = mix(vec3(0.13, 0.14, 0.17), vec3(0.985, 0.98, 0.97), s);
  } else if (uMode == 3) {
    vec3 light = normalize(0.8 * axis + 0.6 * back);
    float s = stripes(uStripes * acos(clamp(dot(n, light), -1.0, 1.0)) / 3.14159265);
    base = mix(vec3(0.20, 0.36, 0.55), vec3(0.985, 0.98, 0.97), s);
  } else {
    base = uMode == 0 ? mapped(vValue) : uMode == 1 ? vGroup.rgb : CLAY;
    vec3 key = normalize(-0.45 * uRight + 0.65 * uUp + 0.75 * back);
    float wrap = 0.5 + 0.5 * dot(n, key);
    lit = 0.60 + 0.44 * wrap * wrap;
    float shine = pow(max(dot(reflect(-key, n), toEye), 0.0), 28.0);
    base = base * lit + vec3(0.07 * shine);
  }
  base *= 0.90 + 0.10 * smoothstep(0.0, 0.35, dot(n, toEye));
  if (backSide) base *= 0.94;

  float second = isoline(vIso.y, uIsoStep.y, 1.7);
  float halo = isoline(vIso.y, uIsoStep.y, 3.6);
  base = mix(base, INK, 0.45 * halo);
  base = mix(base, vec3(1.0), second);
  base = mix(base, INK, 0.92 * isoline(vIso.x, uIsoStep.x, 1.5));

  if (brushed(vDiagram, vSelected, vGroup.a) < 0.5) {
    float grey = dot(base, vec3(0.30, 0.59, 0.11));
    base = mix(vec3(0.925, 0.918, 0.902), vec3(grey), 0.16);
  }
  colour = vec4(base, 1.0);
}
