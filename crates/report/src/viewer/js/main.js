// Reads the data, joins the parts and draws when something changed.

async function start() {
  const data = JSON.parse(byId("data").textContent);
  showRun(JSON.parse(byId("run").textContent));
  if (data.stages.length === 0) {
    document.title = data.title;
    return;
  }
  const canvas = byId("gl");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, preserveDrawingBuffer: true });
  if (!gl) throw new Error("this browser offers no WebGL 2, so the 3D view stays empty; the tables and plots below are complete");
  const origin = data.stages[0].positions.map((p) => p.lo + p.span / 2);
  const stages = [];
  for (const [i, about] of data.stages.entries()) {
    stages.push(readStage(about, await unpackBytes(byId(`stage-${i}`).textContent), origin));
  }
  for (const seam of data.seams ?? []) {
    seam.location = subtract(seam.location, origin);
    const path = seam.path.map((p) => subtract(p, origin));
    seam.segments = new Float32Array(path.slice(1).flatMap((p, i) => [...path[i], ...p]));
  }
  const app = makeApp(data, stages, origin, gl, canvas);
  applyFragment(app.state, location.hash, stages);
  app.begin();
}

function makeApp(data, stages, origin, gl, canvas) {
  const view = byId("view3d");
  const app = {
    data, stages, origin, selecting: false, state: initialState(stages),
    look: makeLook(stages, data.lengthUnit), scene: makeScene(gl, data, stages),
  };
  app.diagram = makeDiagram(byId("diagram"), app);
  const syncControls = makeControls(app);
  let ratio = 1;
  let saving = 0;
  const hovered = { stage: -1, vertex: -1, at: null };
  // What has to be drawn next: "", "camera" (the surface alone) or "all".
  let wanted = "";
  // What the canvas shows; another layout needs a fresh canvas, other dots a fresh diagram.
  const drawn = { layout: "", diagram: "" };
  // While the camera moves a slow machine gets a coarse mesh: how long the last whole frame took.
  const motion = { moving: false, timer: 0, milliseconds: 0, frames: 0, quick: false };

  app.begin = () => {
    resize();
    drawLegend(byId("legend"), app); // its width decides where the model goes
    if (app.state.view) app.setView(app.state.view, true);
    if (app.state.seam >= 0) app.showSeam(app.state.seam);
    makeNavigation(view, app);
    new ResizeObserver(() => {
      resize();
      if (app.state.view) app.setView(app.state.view, true);
      draw(); // at once: the canvas was emptied by its new size
    }).observe(byId("panes"));
    window.addEventListener("hashchange", () => {
      if (location.hash === app.written) return;
      const fresh = initialState(stages);
      applyFragment(fresh, location.hash, stages);
      app.state = fresh;
      if (fresh.view) app.setView(fresh.view, true);
      if (fresh.seam >= 0) app.showSeam(fresh.seam);
      app.refresh();
    });
    draw();
    document.title = `${data.title} – Umbilic`;
  };

  app.refresh = (what = "all") => {
    const asked = wanted !== "";
    if (wanted !== "all") wanted = what;
    if (asked) return;
    requestAnimationFrame(() => {
      const all = wanted === "all";
      wanted = "";
      if (all) draw();
      else drawSurface();
    });
    clearTimeout(saving);
    saving = setTimeout(save, 400);
  };

  function save() {
    app.written = stateToFragment(app.state);
    try {
      history.replaceState(null, "", app.written);
    } catch {
      // Some browsers forbid this for files; the view works without it.
    }
  }

  function resize() {
    const box = byId("panes");
    ratio = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.round(box.clientWidth * ratio);
    canvas.height = Math.round(box.clientHeight * ratio);
    drawn.layout = "";
  }

  // A node's place on the canvas, in device pixels from the lower left.
  function onCanvas(node, inner) {
    const [outer, box] = [canvas.getBoundingClientRect(), node.getBoundingClientRect()];
    const part = inner ?? { x: 0, y: 0, width: node.clientWidth, height: node.clientHeight };
    const [x, y] = [box.left + node.clientLeft - outer.left + part.x, box.top + node.clientTop - outer.top + part.y];
    return {
      x: Math.round(x * ratio), y: Math.round(canvas.height - (y + part.height) * ratio),
      width: Math.max(1, Math.round(part.width * ratio)), height: Math.max(1, Math.round(part.height * ratio)),
    };
  }

  // The stages in view, with their part of the view in its own CSS pixels.
  const panes = () => {
    const [width, height] = [view.clientWidth, view.clientHeight];
    const { stage, other, compare } = app.state;
    if (!compare) return [{ stage, x: 0, y: 0, width, height }];
    const half = Math.floor(width / 2);
    return [{ stage: other, x: 0, y: 0, width: half - 1, height }, { stage, x: half + 1, y: 0, width: width - half - 1, height }];
  };
  app.shown = () => (app.state.compare ? [app.state.stage, app.state.other] : [app.state.stage]);
  // The stage whose points lie in grey behind those of the stage in view, or -1.
  app.behind = () => {
    const { stage, compare, other, behind } = app.state;
    const found = compare ? other : behind;
    return found >= 0 && found !== stage && diagramPoints(stages[found], app.state.axes) ? found : -1;
  };
  app.inDiagram = () => [app.state.stage, app.behind()].filter((i) => i >= 0);
  app.viewportAt = (x) => panes().find((p) => x < p.x + p.width) ?? panes().at(-1);
  app.viewportOf = (stage) => onCanvas(view, panes().findLast((p) => p.stage === stage));

  function draw() {
    const s = app.state;
    if (s.pick) {
      const key = JSON.stringify([s.pick, s.stage, s.camera, view.clientWidth, view.clientHeight]);
      if (!s.selection) s.selection = { key, stage: s.stage, vertices: selectedVertices(app, s.pick) };
    } else {
      s.selection = null;
    }
    const curved = diagramPoints(stages[s.stage], s.axes) !== null;
    byId("diagram-box").hidden = !curved;
    syncControls(); // may change the size of the diagram
    if (curved) app.diagram.drawKey();
    const place = curved && onCanvas(byId("diagram"), app.diagram.plot());
    const layout = JSON.stringify([canvas.width, canvas.height, s.compare, place]);
    if (drawn.layout !== layout) {
      Object.assign(drawn, { layout, diagram: "" });
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.scissor(0, 0, canvas.width, canvas.height);
      gl.clearColor(1, 1, 1, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
    }
    drawSurface();
    if (curved) {
      const { range } = lookNow();
      const key = JSON.stringify([
        s.stage, app.behind(), s.axes, s.mode, s.field, range, s.group, s.chosenGroup, s.brush,
        s.selection && [s.selection.key, s.selection.stage], app.diagram.window(),
      ]);
      if (drawn.diagram !== key) {
        drawn.diagram = key;
        const hurry = inHurry();
        const quick = app.scene.drawDiagram(s, lookNow(), place, app.diagram.window(), ratio, app.behind(), hurry);
        motion.quick = quick || motion.quick;
        if (quick) drawn.diagram = "";
      }
      app.diagram.draw();
    }
    drawLegend(byId("legend"), app);
    drawCaptions();
    const brushing = s.brush || s.selection || s.chosenGroup >= 0;
    const share = brushing ? `${formatNumber(100 * brushedShare(app))} % of the area is chosen.` : "";
    byId("brush-note").textContent = share || "Drag a box here, or select on the surface, to see where it belongs.";
    byId("clear-brush").hidden = !brushing;
  }

  const lookNow = () => ({
    range: app.state.range ?? app.look.autoRange(app.state.field, app.shown()),
    isoSteps: app.state.iso.map((id) => app.look.isoStep(id, app.shown())),
  });

  const inHurry = () => motion.moving && motion.milliseconds > 50;

  // Something follows the pointer: what is drawn coarsely meanwhile is drawn finely when it rests.
  function keepMoving() {
    motion.moving = true;
    clearTimeout(motion.timer);
    motion.timer = setTimeout(() => {
      motion.moving = false;
      if (motion.quick) app.refresh();
    }, clamp(motion.milliseconds, 160, 700));
  }

  function drawSurface() {
    const hurry = inHurry();
    const look = lookNow();
    motion.quick = false;
    for (const pane of panes()) {
      motion.quick = app.scene.drawStage(pane.stage, app.state, look, onCanvas(view, pane), ratio, hurry) || motion.quick;
    }
    drawRuler(byId("ruler"), app, view.clientHeight);
    // The first frames compile and upload; they say nothing about the next.
    motion.frames += 1;
    if (motion.moving && !motion.quick && motion.frames > 2) timeFrame();
  }

  function timeFrame() {
    if (motion.fence) return;
    const start = performance.now();
    motion.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const poll = () => {
      if (gl.getSyncParameter(motion.fence, gl.SYNC_STATUS) !== gl.SIGNALED) {
        setTimeout(poll, 4);
        return;
      }
      gl.deleteSync(motion.fence);
      Object.assign(motion, { fence: null, milliseconds: performance.now() - start });
    };
    setTimeout(poll, 0);
  }

  function drawCaptions() {
    const s = app.state;
    const captions = s.compare
      ? panes().map((p) => element("span", { style: `left:${p.x + p.width - 12}px` }, stages[p.stage].name))
      : [];
    byId("captions").replaceChildren(...captions);
    byId("captions").classList.toggle("divided", s.compare);
  }

  app.change = (changes) => {
    Object.assign(app.state, changes);
    if ("stage" in changes && app.state.pick) app.state.pick = null;
    if ("compare" in changes && app.state.view) app.setView(app.state.view);
    app.refresh();
  };
  app.nextStage = () => app.change({ stage: (app.state.stage + 1) % stages.length });
  app.cameraMoved = () => {
    const named = app.state.view !== "";
    app.state.view = "";
    keepMoving();
    app.refresh(named ? "all" : "camera");
  };
  app.setView = (name, quiet = false) => {
    const [azimuth, elevation] = VIEWS[name].map((d) => (d * Math.PI) / 180);
    const { width, height } = panes()[0];
    const legend = byId("legend");
    const [left, top] = legend.hidden ? [0, 0] : [legend.offsetWidth + 20, legend.offsetHeight + 20];
    // The model goes beside the legend or below it, wherever it gets larger.
    let camera = null;
    for (const [x, y] of [[left, 0], [0, top]]) {
      const tried = { azimuth, elevation, distance: 1, target: [0, 0, 0] };
      const room = [Math.max(width - x, width / 3), Math.max(height - y, height / 3)];
      const points = stages[app.state.stage].positions;
      fitCamera(tried, points, room[0] / height, room[1] / height);
      if (camera && camera.distance <= tried.distance) continue;
      const { right, up } = cameraAxes(tried);
      const shift = add(scale(right, (room[0] - width) / 2), scale(up, (height - room[1]) / 2));
      const middle = tried.target;
      // Out of the middle of the view what is near is magnified beyond the room, so step back a little.
      for (let k = 0; k < 12; k++) {
        const perPixel = (2 * Math.tan(FIELD_OF_VIEW / 2) * tried.distance) / height;
        tried.target = add(middle, scale(shift, perPixel));
        if (widestReach(tried, points, width / height) < 0.97) break;
        tried.distance *= 1.03;
      }
      camera = tried;
    }
    Object.assign(app.state, { camera, view: name, seam: quiet ? app.state.seam : -1 });
    app.refresh();
  };
  app.setBrush = (brush) => {
    keepMoving();
    app.change({ brush, pick: null, selection: null, chosenGroup: -1 });
  };
  app.clearBrush = () => {
    app.showRubber(null);
    app.change({ brush: null, pick: null, selection: null, chosenGroup: -1, seam: -1 });
  };

  app.showRubber = (from, to) => {
    const rubber = byId("rubber");
    rubber.hidden = !from;
    if (!from) return;
    const box = boxOf(from, to);
    const [left, top] = box;
    rubber.style.cssText = `left:${left}px;top:${top}px;width:${box[2] - left}px;height:${box[3] - top}px`;
  };
  app.selectRectangle = (from, to) => {
    const pane = panes().at(-1);
    const box = boxOf(from, to);
    const part = (v, start, size) => clamp((v - start) / size, 0, 1);
    const pick = [part(box[0], pane.x, pane.width), part(box[1], pane.y, pane.height), part(box[2], pane.x, pane.width), part(box[3], pane.y, pane.height)];
    app.change({ pick, selection: null, brush: null, chosenGroup: -1 });
  };

  const under = (x, y) => {
    const pane = app.viewportAt(x, y);
    const viewport = onCanvas(view, pane);
    return { pane, vertex: vertexAt(app, pane.stage, viewport, (x - pane.x) * ratio, viewport.height - (y - pane.y) * ratio) };
  };
  app.hover = (x, y) => {
    const waiting = hovered.at !== null;
    hovered.at = [x, y];
    if (!waiting) requestAnimationFrame(lookUnderPointer);
  };
  const lookUnderPointer = () => {
    const [x, y] = hovered.at;
    hovered.at = null;
    const found = x < 0 ? { vertex: -1 } : under(x, y);
    const stage = found.pane?.stage ?? -1;
    if (hovered.vertex === found.vertex && hovered.stage === stage) return;
    Object.assign(hovered, { vertex: found.vertex, stage });
    drawReadout(byId("readout"), app, stage, found.vertex);
    const points = found.vertex >= 0 && diagramPoints(stages[stage], app.state.axes);
    app.diagram.mark(points ? [points[2 * found.vertex], points[2 * found.vertex + 1]] : null);
  };
  app.click = (x, y) => {
    const { pane, vertex } = under(x, y);
    const group = pane && stages[pane.stage].groups.find((g) => g.id === app.state.group);
    if (app.state.mode !== "groups" || !group) return;
    const chosen = vertex >= 0 ? group.ofVertex[vertex] : -1;
    app.change({ chosenGroup: chosen === app.state.chosenGroup ? -1 : chosen, brush: null, pick: null, selection: null });
  };
  app.centreOn = (x, y) => {
    const { pane, vertex } = under(x, y);
    if (vertex < 0) return;
    const p = stages[pane.stage].positions;
    app.state.camera.target = [p[3 * vertex], p[3 * vertex + 1], p[3 * vertex + 2]];
    app.cameraMoved();
  };

  app.showSeam = (index) => {
    const seam = data.seams?.[index];
    if (!seam) return;
    const camera = app.state.camera;
    camera.target = [...seam.location];
    camera.distance = clamp((seam.size || app.look.diagonal / 20) * 3, app.look.diagonal / 1000, app.scene.radius * 4);
    const normal = nearestNormal(stages[seam.stage], seam.location);
    // Seen at a grazing angle or from behind other parts, a seam would be hidden.
    if (dot(normal, cameraAxes(camera).back) < 0.5) {
      const up = normal[2] < -0.2 ? scale(normal, -1) : normal;
      camera.elevation = clamp(Math.asin(clamp(up[2], -1, 1)) - 0.35, -1.5, 1.5);
      camera.azimuth = Math.hypot(up[0], up[1]) > 0.05 ? Math.atan2(up[1], up[0]) : camera.azimuth;
    }
    Object.assign(app.state, { seam: index, stage: seam.stage, view: "" });
    app.refresh();
  };
  return app;
}

function nearestNormal(stage, place) {
  let best = Infinity;
  let at = 0;
  const { positions: p, normals } = stage;
  for (let i = 0; i < p.length; i += 3) {
    const d = (p[i] - place[0]) ** 2 + (p[i + 1] - place[1]) ** 2 + (p[i + 2] - place[2]) ** 2;
    if (d < best) [best, at] = [d, i];
  }
  return [normals[at], normals[at + 1], normals[at + 2]];
}

// What changes from run to run is written by the page, so that the rest of the file repeats.
function showRun(run) {
  byId("command").textContent = run.command;
  const body = byId("run-rows");
  if (!body) return;
  for (const [name, value] of Object.entries(run.rows)) {
    const text = typeof value === "number" ? formatNumber(value, 4) : typeof value === "string" ? value : JSON.stringify(value);
    body.append(element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, text)));
  }
}

start().catch((error) => {
  console.error(error);
  const trouble = byId("trouble");
  if (trouble) {
    trouble.hidden = false;
    trouble.textContent = `The 3D view could not be drawn: ${error.message}`;
  }
  document.title = "not drawn";
});
