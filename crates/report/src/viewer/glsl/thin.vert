uniform mat4 uViewProjection;
uniform float uBias;        // towards the eye, as a share of the depth

layout(location = 0) in vec3 aPosition;

void main() {
  vec4 p = uViewProjection * vec4(aPosition, 1.0);
  gl_Position = p - vec4(0.0, 0.0, uBias * p.w, 0.0);
}
