// Mouse, touch and keys of the 3D view.

function makeNavigation(node, app) {
  const pointers = new Map();
  let gesture = null;

  const wantsSelection = (event) => app.selecting || event.altKey || event.ctrlKey || event.metaKey;
  const local = (event) => {
    const box = node.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };

  node.addEventListener("contextmenu", (event) => event.preventDefault());
  node.addEventListener("pointerdown", (event) => {
    if (event.target.closest("button, input, select, .legend")) return;
    node.setPointerCapture(event.pointerId);
    node.focus({ preventScroll: true });
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (pointers.size === 2) gesture = { kind: "pinch", ...pinch() };
    else if (event.button === 0 && wantsSelection(event)) gesture = { kind: "select", from: local(event) };
    else gesture = { kind: event.button !== 0 || event.shiftKey ? "pan" : "orbit" };
    Object.assign(gesture, { x: event.clientX, y: event.clientY, start: local(event), moved: false });
  });
  node.addEventListener("pointermove", (event) => {
    if (!gesture) {
      app.hover(...local(event));
      return;
    }
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    const [dx, dy] = [event.clientX - gesture.x, event.clientY - gesture.y];
    if (!gesture.moved && Math.hypot(dx, dy) < 3) return;
    gesture.moved = true;
    if (gesture.kind === "select") {
      app.showRubber(gesture.from, local(event));
      return;
    }
    if (gesture.kind === "pinch") {
      const now = pinch();
      zoom(gesture.distance / now.distance);
      pan(now.x - gesture.middle, now.y - gesture.centre);
      Object.assign(gesture, { distance: now.distance, middle: now.x, centre: now.y });
    } else if (gesture.kind === "orbit") {
      orbit(-dx * 0.008, dy * 0.008);
    } else {
      pan(dx, dy);
    }
    Object.assign(gesture, { x: event.clientX, y: event.clientY });
  });
  const end = (event) => {
    pointers.delete(event.pointerId);
    if (!gesture) return;
    if (gesture.kind === "select" && gesture.moved) app.selectRectangle(gesture.from, local(event));
    else if (!gesture.moved && event.type === "pointerup") app.click(...gesture.start);
    app.showRubber(null);
    gesture = null;
  };
  node.addEventListener("pointerup", end);
  node.addEventListener("pointercancel", end);
  node.addEventListener("pointerleave", () => app.hover(-1, -1));
  node.addEventListener("dblclick", (event) => app.centreOn(...local(event)));
  node.addEventListener("wheel", (event) => {
    event.preventDefault();
    const [x, y] = local(event);
    const box = app.viewportAt(x, y);
    const s = Math.exp(clamp(event.deltaY, -200, 200) * 0.0015);
    // The point under the pointer stays where it is.
    const offset = [x - box.x - box.width / 2, y - box.y - box.height / 2];
    zoom(s);
    pan(offset[0] * (1 - 1 / s), offset[1] * (1 - 1 / s));
  }, { passive: false });

  function pinch() {
    const [[x0, y0], [x1, y1]] = [...pointers.values()];
    const [x, y] = [(x0 + x1) / 2, (y0 + y1) / 2];
    return { distance: Math.hypot(x1 - x0, y1 - y0), x, y, middle: x, centre: y };
  }

  function orbit(azimuth, elevation) {
    const camera = app.state.camera;
    camera.azimuth += azimuth;
    camera.elevation = clamp(camera.elevation + elevation, -1.5698, 1.5698);
    app.cameraMoved();
  }

  function zoom(factor) {
    const camera = app.state.camera;
    camera.distance = clamp(camera.distance * factor, app.scene.radius * 1e-4, app.scene.radius * 50);
    app.cameraMoved();
  }

  function pan(dx, dy) {
    const camera = app.state.camera;
    const perPixel = (2 * Math.tan(FIELD_OF_VIEW / 2) * camera.distance) / node.clientHeight;
    const { right, up } = cameraAxes(camera);
    camera.target = add(camera.target, add(scale(right, -dx * perPixel), scale(up, dy * perPixel)));
    app.cameraMoved();
  }

  node.addEventListener("keydown", (event) => {
    if (event.target !== node || event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const arrow = arrows[event.key];
    const views = { 1: "iso", 2: "top", 3: "front", 4: "right", 0: "iso" };
    if (arrow && event.shiftKey) pan(-40 * arrow[0], -40 * arrow[1]);
    else if (arrow) orbit(0.1 * arrow[0], -0.1 * arrow[1]);
    else if (event.key === "+" || event.key === "=") zoom(0.85);
    else if (event.key === "-") zoom(1 / 0.85);
    else if (views[event.key]) app.setView(views[event.key]);
    else if (event.key === "b") app.nextStage();
    else if (event.key === "z") app.change({ mode: app.state.mode === "zebra" ? "field" : "zebra" });
    else if (event.key === "w") app.change({ wire: !app.state.wire });
    else return;
    event.preventDefault();
  });
}
