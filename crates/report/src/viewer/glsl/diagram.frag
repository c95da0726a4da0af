uniform int uMode;
uniform int uPart;          // 0 all, 1 what is not brushed, 2 what is brushed, 3 the other stage
uniform float uAlpha;

in float vValue;
in vec2 vDiagram;
in float vSelected;
flat in vec4 vGroup;
out vec4 colour;

void main() {
  float inside = brushed(vDiagram, vSelected, vGroup.a);
  if (uPart == 1 && inside > 0.5) discard;
  if (uPart == 2 && inside < 0.5) discard;
  vec3 base = uMode == 0 ? mapped(vValue) : uMode == 1 ? vGroup.rgb : vec3(0.25, 0.36, 0.52);
  // Points near zero would vanish on white.
  base *= 0.88;
  if (uPart == 1) base = vec3(0.62, 0.63, 0.66);
  if (uPart == 3) base = uBrush == 0 ? vec3(0.70, 0.71, 0.73) : vec3(0.90, 0.895, 0.88);
  colour = vec4(base * uAlpha, uAlpha);
}
