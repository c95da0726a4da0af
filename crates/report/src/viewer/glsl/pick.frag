flat in uint vVertex;
out vec4 colour;

// The number of a corner of the triangle, byte by byte.
void main() {
  uvec4 bytes = (uvec4(vVertex) >> uvec4(0u, 8u, 16u, 24u)) & 255u;
  colour = vec4(bytes) / 255.0;
}
