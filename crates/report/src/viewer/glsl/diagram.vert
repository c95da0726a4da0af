uniform vec4 uWindow;       // lower corner and size of what the diagram shows
uniform float uPointSize;

layout(location = 2) in float aValue;
layout(location = 4) in vec2 aDiagram;
layout(location = 5) in float aSelected;
layout(location = 6) in vec4 aGroup;

out float vValue;
out vec2 vDiagram;
out float vSelected;
flat out vec4 vGroup;

void main() {
  vValue = aValue;
  vDiagram = aDiagram;
  vSelected = aSelected;
  vGroup = aGroup;
  vec2 p = (aDiagram - uWindow.xy) / uWindow.zw * 2.0 - 1.0;
  // A point without a value goes where nothing is drawn.
  bool there = abs(aDiagram.x) < 1e30 && abs(aDiagram.y) < 1e30;
  gl_Position = there ? vec4(p, 0.0, 1.0) : vec4(0.0, 0.0, 2.0, 1.0);
  gl_PointSize = uPointSize;
}
