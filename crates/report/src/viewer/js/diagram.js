// The curvature diagram: axes drawn as SVG over the points, brushing and zooming.

const MARGIN = { left: 54, right: 10, top: 10, bottom: 38 };

function makeDiagram(node, app) {
  const svg = node.querySelector("svg");
  const diagram = { zoom: null, marker: null };
  const ring = element("circle", { r: 6, class: "marker" });

  diagram.window = () => diagram.zoom ?? app.look.diagramWindow(app.inDiagram(), app.state.axes);
  // The plot inside the margins, in CSS pixels of the node.
  diagram.plot = () => ({
    x: MARGIN.left, y: MARGIN.top,
    width: node.clientWidth - MARGIN.left - MARGIN.right, height: node.clientHeight - MARGIN.top - MARGIN.bottom,
  });
  const toPixels = ([x, y]) => {
    const [p, w] = [diagram.plot(), diagram.window()];
    return [p.x + (p.width * (x - w[0])) / (w[2] - w[0]), p.y + p.height * (1 - (y - w[1]) / (w[3] - w[1]))];
  };
  const fromPixels = (x, y) => {
    const [p, w] = [diagram.plot(), diagram.window()];
    return [w[0] + ((x - p.x) / p.width) * (w[2] - w[0]), w[1] + (1 - (y - p.y) / p.height) * (w[3] - w[1])];
  };

  diagram.draw = () => {
    const [p, w] = [diagram.plot(), diagram.window()];
    const axes = AXES[app.state.axes];
    const units = unitsOf(app);
    const parts = [];
    const line = (x1, y1, x2, y2, cls) => parts.push(element("line", { x1, y1, x2, y2, class: cls }));
    const text = (x, y, label, cls) => parts.push(element("text", { x, y, class: cls }, label));
    const bottom = p.y + p.height;
    const factors = [tickFactor(w[0], w[2]), tickFactor(w[1], w[3])];
    const inUnits = (side) => {
      const unit = [factors[side].text, units[side]].filter(Boolean).join(" ");
      return withUnit(axes.names[side], unit && `[${unit}]`);
    };
    for (const t of ticks(w[0], w[2], 5)) {
      const [x] = toPixels([t, 0]);
      line(x, p.y, x, bottom, t === 0 ? "zero" : "grid");
      text(x, bottom + 14, formatNumber(t / factors[0].value), "x-tick");
    }
    for (const t of ticks(w[1], w[3], 5)) {
      const [, y] = toPixels([0, t]);
      line(p.x, y, p.x + p.width, y, t === 0 ? "zero" : "grid");
      text(p.x - 6, y + 3.5, formatNumber(t / factors[1].value), "y-tick");
    }
    parts.push(element("rect", { x: p.x, y: p.y, width: p.width, height: p.height, class: "frame" }));
    text(p.x + p.width / 2, bottom + 31, inUnits(0), "x-name");
    const name = element("text", { class: "y-name", transform: `translate(12 ${p.y + p.height / 2}) rotate(-90)` });
    name.append(inUnits(1));
    parts.push(name);

    const clip = element("clipPath", { id: "plot-clip" }, element("rect", { x: p.x, y: p.y, width: p.width, height: p.height }));
    const inside = element("g", { "clip-path": "url(#plot-clip)" });
    inside.append(umbilicCurve(w, app.state.axes, toPixels));
    for (const relation of app.data.relations) {
      inside.append(element("path", { d: pathOf(relation.points, app.state.axes, toPixels), class: "relation" }));
    }
    if (app.state.brush) {
      const [x0, y1] = toPixels(app.state.brush.slice(0, 2));
      const [x1, y0] = toPixels(app.state.brush.slice(2));
      inside.append(element("rect", { x: x0, y: y0, width: Math.max(x1 - x0, 1), height: Math.max(y1 - y0, 1), class: "brush" }));
    }
    inside.append(ring);
    svg.replaceChildren(element("defs", {}, clip), ...parts, inside);
    diagram.mark(diagram.marker);
  };

  // A ring around the place of the point under the pointer, or none.
  diagram.mark = (place) => {
    diagram.marker = place;
    const there = place !== null && place.every(Number.isFinite);
    ring.style.display = there ? "" : "none";
    if (!there) return;
    const [x, y] = toPixels(place);
    ring.setAttribute("cx", x);
    ring.setAttribute("cy", y);
  };

  // What the dots and curves are.
  diagram.drawKey = () => {
    const { stages, state, data } = app;
    const entry = (cls, text) => element("span", {}, element("i", { class: cls }), text);
    const parts = [entry("dot", stages[state.stage].name)];
    const behind = app.behind();
    if (behind >= 0) parts.push(entry("dot grey", stages[behind].name));
    for (const relation of data.relations) parts.push(entry("curve", relation.name));
    parts.push(entry("dashes", state.axes === "k1k2" ? "κ₁ = κ₂" : "K = H²"));
    byId("diagram-key").replaceChildren(...parts);
  };

  let start = null;
  const place = (event) => {
    const box = node.getBoundingClientRect();
    return fromPixels(event.clientX - box.left, event.clientY - box.top);
  };
  node.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    start = { at: place(event), x: event.clientX, y: event.clientY, moved: false };
    node.setPointerCapture(event.pointerId);
  });
  node.addEventListener("pointermove", (event) => {
    if (!start) return;
    start.moved ||= Math.hypot(event.clientX - start.x, event.clientY - start.y) > 3;
    if (start.moved) app.setBrush(boxOf(start.at, place(event)));
  });
  node.addEventListener("pointerup", () => {
    if (start && !start.moved) app.clearBrush();
    start = null;
  });
  node.addEventListener("dblclick", () => {
    diagram.zoom = null;
    app.refresh();
  });
  node.addEventListener("wheel", (event) => {
    event.preventDefault();
    const [[x, y], w, s] = [place(event), diagram.window(), Math.exp(event.deltaY * 0.0015)];
    diagram.zoom = [x + (w[0] - x) * s, y + (w[1] - y) * s, x + (w[2] - x) * s, y + (w[3] - y) * s];
    app.refresh();
  }, { passive: false });
  // Without a mouse: Enter puts a box in the middle, arrows move it, with Shift they size it.
  node.addEventListener("keydown", (event) => {
    const w = diagram.window();
    const step = [(w[2] - w[0]) / 40, (w[3] - w[1]) / 40];
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    if (event.key === "Enter") {
      const third = (a, b, k) => a + ((b - a) * k) / 3;
      app.setBrush([third(w[0], w[2], 1), third(w[1], w[3], 1), third(w[0], w[2], 2), third(w[1], w[3], 2)]);
    } else if (moves[event.key] && app.state.brush) {
      const [dx, dy] = moves[event.key].map((m, i) => m * step[i]);
      const [x0, y0, x1, y1] = app.state.brush;
      const moved = event.shiftKey ? [x0, y0, x1 + dx, y1 + dy] : [x0 + dx, y0 + dy, x1 + dx, y1 + dy];
      app.setBrush(boxOf(moved.slice(0, 2), moved.slice(2)));
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  });
  return diagram;
}

// A power of a thousand taken out of the numbers on an axis that would be long otherwise.
function tickFactor(lo, hi) {
  const size = Math.max(Math.abs(lo), Math.abs(hi));
  if (size >= 0.03 && size < 1e4) return { value: 1, text: "" };
  const power = 3 * Math.floor(Math.log10(size || 1) / 3 + 1e-9);
  return { value: 10 ** power, text: `10${raised(power)}` };
}

const boxOf = (a, b) => [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[0], b[0]), Math.max(a[1], b[1])];

function unitsOf(app) {
  const unit = (id) => app.look.everywhere(id)[0]?.unit ?? "";
  return [unit("H"), app.state.axes === "HK" ? unit("K") : unit("H")];
}

// Where both principal curvatures are equal: no point of a surface lies beyond it.
function umbilicCurve(w, axesName, toPixels) {
  const points = [];
  for (let i = 0; i <= 80; i++) {
    const h = w[0] + ((w[2] - w[0]) * i) / 80;
    points.push([h, h * h]);
  }
  return element("path", { d: pathOf(points, axesName, toPixels), class: "umbilic" });
}

// A path through points (H, K); it is broken where a point has no place on the axes.
function pathOf(points, axesName, toPixels) {
  let d = "";
  let pen = "M";
  for (const [h, k] of points) {
    const place = toPixels(AXES[axesName].at(h, k));
    if (place.every((c) => Math.abs(c) < 1e7)) {
      d += `${pen}${place[0].toFixed(1)} ${place[1].toFixed(1)}`;
      pen = "L";
    } else {
      pen = "M";
    }
  }
  return d;
}
