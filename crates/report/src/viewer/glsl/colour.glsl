uniform sampler2D uMap;     // row 0: signed, row 1: magnitude
uniform float uMapRow;
uniform vec2 uMapPart;      // the part of the row that is used
uniform vec2 uRange;
uniform vec3 uNoValue;
uniform int uBrush;         // 0 none, 1 box in the diagram, 2 chosen vertices, 3 chosen group
uniform vec4 uBox;          // lower and upper corner in the diagram

bool hasValue(float v) { return abs(v) < 1e30; }

vec3 mapped(float v) {
  if (!hasValue(v)) return uNoValue;
  float t = clamp((v - uRange.x) / (uRange.y - uRange.x), 0.0, 1.0);
  t = mix(uMapPart.x, uMapPart.y, t);
  return texture(uMap, vec2((t * 255.0 + 0.5) / 256.0, uMapRow)).rgb;
}

// 1 where brushed, 0 elsewhere.
float brushed(vec2 diagram, float selected, float group) {
  if (uBrush == 1) {
    return float(all(greaterThanEqual(diagram, uBox.xy)) && all(lessThanEqual(diagram, uBox.zw)));
  }
  if (uBrush == 2) return step(0.5, selected);
  if (uBrush == 3) return step(0.5, group);
  return 1.0;
}
