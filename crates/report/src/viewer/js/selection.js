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
  const { triangles, positions, count } = stages[state.stage];
  const seen = new Uint8Array(count + 1);
  for (const number of scene.pick(state.stage, state, viewport, rectangle)) seen[number] = 1;
  const m = viewProjection(state.camera, viewport.width / viewport.height, scene.radius);
  const inside = (v) => {
    const a = positions[3 * v];
    const b = positions[3 * v + 1];
    const c = positions[3 * v + 2];
    const w = m[3] * a + m[7] * b + m[11] * c + m[15];
    const x = ((m[0] * a + m[4] * b + m[8] * c + m[12]) / w + 1) / 2;
    const y = (1 - (m[1] * a + m[5] * b + m[9] * c + m[13]) / w) / 2;
    return x >= x0 && x <= x1 && y >= y0 && y <= y1;
  };
  // A pixel names the last corner of its triangle; the others count where they are in reach.
  const chosen = new Set();
  for (let i = 0; i < triangles.length; i += 3) {
    if (!seen[triangles[i + 2] + 1]) continue;
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
  stage.area ??= stage.areas.reduce((a, b) => a + b, 0);
  let share = 0;
  if (state.brush) {
    const points = diagramPoints(stage, state.axes);
    if (!points) return 0;
    stage.boxAreas ??= {};
    stage.boxAreas[state.axes] ??= areaInBoxes(points, stage.areas);
    share = stage.boxAreas[state.axes](state.brush);
  } else if (state.selection) {
    for (const v of state.selection.vertices) share += stage.areas[v];
  } else if (state.chosenGroup >= 0) {
    const group = stage.groups.find((g) => g.id === state.group);
    for (let v = 0; v < stage.count; v++) if (group?.ofVertex[v] === state.chosenGroup) share += stage.areas[v];
  }
  return stage.area > 0 ? share / stage.area : 0;
}

// The sum of the areas of the points in a box, for many boxes: points sorted by x stand in blocks,
// each block sorted by y with running sums. Only the blocks at the ends are looked at one by one.
function areaInBoxes(points, areas) {
  const order = Uint32Array.from(areas.keys()).filter((v) => points[2 * v] - points[2 * v + 1] < Infinity);
  order.sort((a, b) => points[2 * a] - points[2 * b]);
  const size = Math.ceil(Math.sqrt(order.length)) || 1;
  const blocks = [];
  for (let start = 0; start < order.length; start += size) {
    const part = order.subarray(start, start + size);
    const [lo, hi] = [points[2 * part[0]], points[2 * part.at(-1)]];
    part.sort((a, b) => points[2 * a + 1] - points[2 * b + 1]);
    const sums = new Float64Array(part.length + 1);
    part.forEach((v, i) => { sums[i + 1] = sums[i] + areas[v]; });
    blocks.push({ lo, hi, part, sums });
  }
  // Points of a block below `y`, or up to and including it.
  const below = (part, y, included) => {
    let [from, to] = [0, part.length];
    while (from < to) {
      const middle = (from + to) >> 1;
      const there = points[2 * part[middle] + 1];
      if (there < y || (included && there === y)) from = middle + 1;
      else to = middle;
    }
    return from;
  };
  return ([x0, y0, x1, y1]) => {
    let total = 0;
    for (const { lo, hi, part, sums } of blocks) {
      if (hi < x0 || lo > x1) continue;
      const [from, to] = [below(part, y0, false), below(part, y1, true)];
      if (lo >= x0 && hi <= x1) {
        total += sums[Math.max(to, from)] - sums[from];
        continue;
      }
      for (let i = from; i < to; i++) {
        const x = points[2 * part[i]];
        if (x >= x0 && x <= x1) total += areas[part[i]];
      }
    }
    return total;
  };
}
