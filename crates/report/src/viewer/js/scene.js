// Draws the stages: fills the attributes that depend on the state, then the passes.

const LINE_STYLES = {
  "control-net": { colour: [0.10, 0.12, 0.16, 0.85], width: 1.3, bias: 2e-4 },
  mesh: { colour: [0.10, 0.12, 0.16, 0.40], width: 0.9, bias: 4e-4 },
  isolines: { colour: [0.10, 0.12, 0.16, 0.85], width: 1.4, bias: 4e-4 },
  directions: { colour: [0.08, 0.10, 0.14, 0.80], width: 1.2, bias: 6e-4 },
  curves: { colour: [0.62, 0.10, 0.30, 1.0], width: 2.2, bias: 6e-4 },
};
const WIRE = { colour: [0.10, 0.12, 0.16, 0.28], width: 0.8, bias: 3e-4 };
const OUTLINE = { colour: [0.10, 0.12, 0.16, 0.62], width: 1.2, bias: 4e-4 };
const BORDERS = { colour: [0.10, 0.12, 0.16, 0.30], width: 0.9, bias: 3e-4 };
const PANEL_EDGES = { ...BORDERS, colour: [0.10, 0.12, 0.16, 0.17] };
const SEAM = { colour: [0.78, 0.06, 0.26, 1.0], width: 4.0, bias: 2e-3 };
const PAPER = [0.972, 0.968, 0.958];

function makeScene(gl, data, stages) {
  const programs = makePrograms(gl);
  const gpu = stages.map((s) => uploadStage(gl, s));
  const texture = makeMapTexture(gl, data.maps);
  const noValue = rgbOf(data.noValue);
  const groupColours = data.groupColours.map((hex) => rgbOf(hex).map((c) => Math.round(255 * c)));
  const seamLines = new Map();
  const pickTarget = makePickTarget(gl);
  const radius = Math.max(...stages.map((s) => boundingRadius(s.positions)));
  const filled = stages.map(() => ({}));
  const slow = { limit: 30000, cells: 64 }; // triangles above which a coarse mesh is worth it

  const fieldOf = (stage, id) => stage.fields.find((f) => f.id === id);
  const missing = (count, size) => new Float32Array(count * size).fill(NO_VALUE);
  const orNoValue = (v) => (Number.isFinite(v) ? v : NO_VALUE);

  // Fills an attribute once per `key`, which names what the data depends on.
  function refill(i, name, key, data) {
    if (filled[i][name] === key) return;
    filled[i][name] = key;
    fillAttribute(gl, gpu[i], name, data());
  }

  function update(i, state) {
    const stage = stages[i];
    refill(i, "value", state.field, () => {
      const field = fieldOf(stage, state.field);
      return field ? Float32Array.from(field.values, orNoValue) : missing(stage.count, 1);
    });
    refill(i, "iso", state.iso.join(), () => {
      const out = missing(stage.count, 2);
      state.iso.forEach((id, k) => {
        fieldOf(stage, id)?.values.forEach((v, j) => { out[2 * j + k] = orNoValue(v); });
      });
      return out;
    });
    refill(i, "diagram", state.axes, () => {
      const points = diagramPoints(stage, state.axes);
      return points ? Float32Array.from(points, orNoValue) : missing(stage.count, 2);
    });
    refill(i, "selected", state.selection?.key ?? "", () => {
      const out = new Uint8Array(stage.count);
      if (state.selection?.stage === i) for (const v of state.selection.vertices) out[v] = 255;
      return out;
    });
    refill(i, "group", `${state.group}/${state.chosenGroup}`, () => {
      const group = stage.groups.find((g) => g.id === state.group);
      const out = new Uint8Array(4 * stage.count);
      const none = noValue.map((c) => 255 * c);
      for (let v = 0; v < stage.count; v++) {
        const index = group ? group.ofVertex[v] : -1;
        const colour = group ? groupColours[index] : none;
        for (let k = 0; k < 3; k++) out[4 * v + k] = colour[k];
        out[4 * v + 3] = index === state.chosenGroup ? 255 : 0;
      }
      return out;
    });
  }

  function common(state, look, field) {
    const brush = state.brush ? 1 : state.selection ? 2 : state.chosenGroup >= 0 ? 3 : 0;
    return {
      uMap: 0, uMapRow: field && !field.signed ? 0.75 : 0.25, uMapPart: mapPart(field, look.range),
      uRange: look.range, uNoValue: noValue,
      uBrush: brush, uBox: state.brush ?? [0, 0, 0, 0], uMode: MODES[state.mode],
    };
  }

  function linesOf(i, name) {
    const { lines } = gpu[i];
    if (!lines.has(name) && stages[i].segments[name]) lines.set(name, uploadSegments(gl, stages[i].segments[name]()));
    return lines.get(name);
  }

  function trianglesOf(i, quick) {
    if (!quick) return gpu[i].fine;
    gpu[i].coarse ??= uploadTriangles(gl, coarseTriangles(stages[i], slow.cells));
    return gpu[i].coarse;
  }

  function drawLines(lines, matrix, viewport, style, ratio, quick) {
    if (!lines || lines.count === 0 || (quick && lines.thin)) return;
    const program = lines.thin ? programs.thin : programs.line;
    gl.useProgram(program.program);
    program.set({
      uViewProjection: matrix, uViewport: [viewport.width, viewport.height],
      uColour: style.colour, uWidth: style.width * ratio, uBias: style.bias,
    });
    gl.bindVertexArray(lines.vao);
    if (lines.thin) gl.drawArrays(gl.LINES, 0, 2 * lines.count);
    else gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.count);
  }

  // One stage into a viewport given in device pixels from the lower left. `hurry` asks for a coarse
  // mesh if the stage has many triangles.
  function drawStage(i, state, look, viewport, ratio, hurry) {
    const quick = hurry && stages[i].triangles.length / 3 > slow.limit;
    update(i, state);
    const stage = stages[i];
    const matrix = viewProjection(state.camera, viewport.width / viewport.height, radius);
    const axes = cameraAxes(state.camera);
    gl.viewport(viewport.x, viewport.y, viewport.width, viewport.height);
    gl.scissor(viewport.x, viewport.y, viewport.width, viewport.height);
    gl.clearColor(...PAPER, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.useProgram(programs.surface.program);
    programs.surface.set({
      ...common(state, look, fieldOf(stage, state.field)),
      uViewProjection: matrix, uEye: eyeOf(state.camera), uRight: axes.right, uUp: axes.up,
      uStripes: state.stripes, uAngle: (state.angle * Math.PI) / 180, uIsoStep: look.isoSteps,
    });
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const triangles = trianglesOf(i, quick);
    gl.bindVertexArray(gpu[i].vao);
    triangles.draw();
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    const line = (name, style) => drawLines(linesOf(i, name), matrix, viewport, style, ratio, quick);
    if (state.wire) line("wire", WIRE);
    if (state.edges && state.mode === "groups") line("borders", BORDERS);
    // The borders of many panels would hide what is on them.
    if (state.edges) line("outline", linesOf(i, "outline").count > 2000 ? PANEL_EDGES : OUTLINE);
    for (const l of stage.lines) if (state.lines.has(l.id)) line(`set:${l.id}`, LINE_STYLES[l.role]);
    const seam = data.seams?.[state.seam];
    if (seam && seam.stage === i) {
      if (!seamLines.has(state.seam)) seamLines.set(state.seam, uploadSegments(gl, seam.segments));
      drawLines(seamLines.get(state.seam), matrix, viewport, SEAM, ratio);
    }
    gl.depthMask(true);
    gl.bindVertexArray(null);
    return quick;
  }

  // The stage's points over those of the stage `behind` in grey (-1 for none), and the triangles
  // between them unless there are many and `hurry` is asked for; tells whether they were left out.
  function drawDiagram(state, look, viewport, window_, ratio, behind, hurry) {
    const quick = hurry && stages[state.stage].triangles.length / 3 > slow.limit;
    gl.viewport(viewport.x, viewport.y, viewport.width, viewport.height);
    gl.scissor(viewport.x, viewport.y, viewport.width, viewport.height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(programs.diagram.program);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const size = [window_[2] - window_[0], window_[3] - window_[1]];
    const draw = (i, part, alpha, points) => {
      const stage = stages[i];
      update(i, state);
      const few = quick && i === state.stage ? trianglesOf(i, true) : null;
      gl.bindVertexArray(gpu[i].vao);
      programs.diagram.set({
        ...common(state, look, fieldOf(stage, state.field)),
        uWindow: [window_[0], window_[1], ...size], uPart: part, uAlpha: alpha,
        uPointSize: (stage.count > 60000 ? 1.6 : stage.count > 8000 ? 2.2 : 3.2) * (part === 2 ? 1.8 : 1) * ratio,
      });
      if (points && few) few.draw(gl.POINTS);
      else if (points) gl.drawArrays(gl.POINTS, 0, stage.count);
      else gpu[i].fine.draw();
    };
    if (behind >= 0) draw(behind, 3, 0.8, true);
    const brushing = state.brush || state.selection || state.chosenGroup >= 0;
    if (!quick) draw(state.stage, brushing ? 1 : 0, 0.12, false);
    draw(state.stage, brushing ? 1 : 0, 0.9, true);
    if (brushing) {
      if (!quick) draw(state.stage, 2, 0.25, false);
      draw(state.stage, 2, 1, true);
    }
    gl.bindVertexArray(null);
    return quick;
  }

  // Numbers of the vertices in a rectangle of the viewport (pixels from its lower left), 0 for none.
  function pick(i, state, viewport, rectangle) {
    const { width, height } = viewport;
    pickTarget.resize(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, pickTarget.frame);
    gl.viewport(0, 0, width, height);
    gl.scissor(0, 0, width, height);
    const key = JSON.stringify([i, state.camera, width, height]);
    if (pickTarget.key !== key) {
      pickTarget.key = key;
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.disable(gl.BLEND);
      gl.useProgram(programs.pick.program);
      programs.pick.set({ uViewProjection: viewProjection(state.camera, width / height, radius) });
      gl.bindVertexArray(gpu[i].vao);
      gpu[i].fine.draw();
      gl.bindVertexArray(null);
    }
    const x = clamp(Math.floor(rectangle.x), 0, width - 1);
    const y = clamp(Math.floor(rectangle.y), 0, height - 1);
    const w = clamp(Math.ceil(rectangle.width), 1, width - x);
    const h = clamp(Math.ceil(rectangle.height), 1, height - y);
    const bytes = new Uint8Array(4 * w * h);
    gl.readPixels(x, y, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return new Uint32Array(bytes.buffer);
  }

  gl.enable(gl.SCISSOR_TEST);
  return { drawStage, drawDiagram, pick, radius };
}

function boundingRadius(positions) {
  let most = 0;
  for (let i = 0; i < positions.length; i += 3) {
    most = Math.max(most, Math.hypot(positions[i], positions[i + 1], positions[i + 2]));
  }
  return most || 1;
}

// Place of every vertex in the diagram, or null if the stage has no curvatures.
function diagramPoints(stage, axesName) {
  const axes = AXES[axesName];
  const [h, k] = axes.needs.map((id) => stage.fields.find((f) => f.id === id)?.values);
  if (!h || !k) return null;
  stage.diagram ??= {};
  if (!stage.diagram[axesName]) {
    const points = new Float64Array(2 * stage.count);
    // Given principal curvatures are better than a root of a difference near umbilic points.
    const given = (axes.fields ?? []).map((id) => stage.fields.find((f) => f.id === id)?.values);
    const exact = given.length === 2 && given.every(Boolean);
    for (let v = 0; v < stage.count; v++) {
      const [x, y] = exact ? [given[0][v], given[1][v]] : axes.at(h[v], k[v]);
      points[2 * v] = x;
      points[2 * v + 1] = y;
    }
    stage.diagram[axesName] = points;
  }
  return stage.diagram[axesName];
}
