uniform mat4 uViewProjection;
uniform vec2 uViewport;     // pixels
uniform float uWidth;       // pixels
uniform float uBias;        // towards the eye, as a share of the depth

layout(location = 0) in vec3 aStart;
layout(location = 1) in vec3 aEnd;

void main() {
  vec4 a = uViewProjection * vec4(aStart, 1.0);
  vec4 b = uViewProjection * vec4(aEnd, 1.0);
  // An end behind the eye is moved along the line to just in front of it.
  float least = 1e-4 * max(abs(a.w), abs(b.w));
  if (a.w < least && b.w > least) a = mix(a, b, (least - a.w) / (b.w - a.w));
  if (b.w < least && a.w > least) b = mix(b, a, (least - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * uViewport;
  float size = length(along);
  along = size > 1e-6 ? along / size : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x);
  bool atEnd = (gl_VertexID & 2) != 0;
  float side = (gl_VertexID & 1) != 0 ? 1.0 : -1.0;
  vec4 p = atEnd ? b : a;
  vec2 offset = (across * side + along * (atEnd ? 0.5 : -0.5)) * uWidth / uViewport;
  gl_Position = p + vec4(offset * p.w, -uBias * p.w, 0.0);
}
