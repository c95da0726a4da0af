uniform vec4 uColour;
out vec4 colour;

void main() {
  colour = vec4(uColour.rgb * uColour.a, uColour.a);
}
