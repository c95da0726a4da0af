uniform mat4 uViewProjection;

layout(location = 0) in vec3 aPosition;
layout(location = 1) in vec3 aNormal;
layout(location = 2) in float aValue;
layout(location = 3) in vec2 aIso;
layout(location = 4) in vec2 aDiagram;
layout(location = 5) in float aSelected;
layout(location = 6) in vec4 aGroup; // colour, and 1 for the chosen group

out vec3 vPosition;
out vec3 vNormal;
out float vValue;
out vec2 vIso;
out vec2 vDiagram;
out float vSelected;
flat out vec4 vGroup;

void main() {
  vPosition = aPosition;
  vNormal = aNormal;
  vValue = aValue;
  vIso = aIso;
  vDiagram = aDiagram;
  vSelected = aSelected;
  vGroup = aGroup;
  gl_Position = uViewProjection * vec4(aPosition, 1.0);
}
