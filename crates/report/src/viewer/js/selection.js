// From the surface to the diagram: rectangles, clicks and the vertex under the pointer.

// Vertices of the stage seen in a rectangle given as fractions of its viewport.
function selectedVertices(app, fractions) {
  const { scene, stages, state } = app;
  const viewport = app.viewportOf(state.stage);
  const [x0, y0, x1, y1] = fractions;
  const rectangle = {
    x: x0 * viewport.width, y: (1 - y1) * viewport.height,
    width: (x1 - x0) * viewport.width, height: (y1 - y0) * viewport.height,
  };
  const seen = new Set(scene.pick(state.stage, state, viewport, rectangle));
  seen.delete(0);
  const { triangles, positions } = stages[state.stage];
  const matrix = viewProjection(state.camera, viewport.width / viewport.height, scene.radius);
  const inside = (v) => {
    const p = [positions[3 * v], positions[3 * v + 1], positions[3 * v + 2], 1];
    const row = (r) => p.reduce((sum, c, k) => sum + matrix[4 * k + r] * c, 0);
    const x = (row(0) / row(3) + 1) / 2;
    const y = (1 - row(1) / row(3)) / 2;
    return x >= x0 && x <= x1 && y >= y0 && y <= y1;
  };
  // A pixel names the last corner of its triangle; the others count where they are in reach.
  const chosen = new Set();
  for (let i = 0; i < triangles.length; i += 3) {
    if (!seen.has(triangles[i + 2] + 1)) continue;
    for (let k = 0; k < 3; k++) if (inside(triangles[i + k])) chosen.add(triangles[i + k]);
  }
  return [...chosen];
}

// The vertex drawn at a pixel of the stage's viewport, or -1. Both in device pixels from below.
function vertexAt(app, stageIndex, viewport, x, y) {
  const [number] = app.scene.pick(stageIndex, app.state, viewport, { x, y, width: 1, height: 1 });
  return number - 1;
}

// How much of the stage's area is brushed, from 0 to 1.
function brushedShare(app) {
  const { state, stages } = app;
  const stage = stages[state.stage];
  const total = stage.areas.reduce((a, b) => a + b, 0);
  let share = 0;
  if (state.brush) {
    const points = diagramPoints(stage, state.axes);
    if (!points) return 0;
    const [x0, y0, x1, y1] = state.brush;
    stage.areas.forEach((a, v) => {
      const [x, y] = [points[2 * v], points[2 * v + 1]];
      if (x >= x0 && x <= x1 && y >= y0 && y <= y1) share += a;
    });
  } else if (state.selection) {
    for (const v of state.selection.vertices) share += stage.areas[v];
  } else if (state.chosenGroup >= 0) {
    const group = stage.groups.find((g) => g.id === state.group);
    stage.areas.forEach((a, v) => { if (group?.ofVertex[v] === state.chosenGroup) share += a; });
  }
  return total > 0 ? share / total : 0;
}
