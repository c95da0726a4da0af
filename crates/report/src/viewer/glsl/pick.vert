uniform mat4 uViewProjection;
layout(location = 0) in vec3 aPosition;
flat out uint vVertex;

void main() {
  vVertex = uint(gl_VertexID) + 1u;
  gl_Position = uViewProjection * vec4(aPosition, 1.0);
}
