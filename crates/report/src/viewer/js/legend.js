// The colour bar with numbers, the length scale and the values under the pointer.

const element = (name, attributes = {}, ...children) => {
  const svg = ["svg", "path", "line", "rect", "text", "circle", "g", "clipPath", "defs"].includes(name);
  const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    // The page's policy refuses the attribute, and takes what its own script sets.
    if (key === "style") node.style.cssText = value;
    else node.setAttribute(key, value);
  }
  node.append(...children);
  return node;
};

const withUnit = (text, unit) => (unit ? `${text} ${unit}` : text);

function drawLegend(node, app) {
  const { state, look, stages, data } = app;
  const stage = stages[state.stage];
  const parts = [];
  if (state.mode === "field") {
    const field = look.everywhere(state.field)[0];
    if (field) parts.push(...colourBar(app, field, data.maps[field.signed ? "signed" : "magnitude"]));
  } else if (state.mode === "groups") {
    const group = stage.groups.find((g) => g.id === state.group);
    if (group) {
      parts.push(element("h3", {}, group.label), element("p", {}, `${group.names.length} in all`));
      const chosen = group.names[state.chosenGroup];
      parts.push(element("p", { class: "quiet" }, chosen ? `${chosen} is shown alone` : "click one to single it out"));
    } else {
      parts.push(element("p", {}, "no such grouping in this stage"));
    }
  } else if (state.mode !== "plain") {
    const name = state.mode === "zebra" ? "Zebra stripes" : "Isophotes";
    parts.push(element("h3", {}, name), element("p", { class: "quiet" }, stage.exactNormals ? "shaded from the surface's exact normals" : "shaded from normals averaged at the vertices"));
  }
  state.iso.forEach((id, k) => {
    const step = look.isoStep(id, app.shown());
    const field = look.everywhere(id)[0];
    if (!field) return;
    const every = step > 0 ? `every ${withUnit(formatNumber(step), field.unit)}` : "is constant";
    const swatch = element("span", { class: k === 0 ? "iso-dark" : "iso-light" });
    parts.push(element("p", { class: "iso" }, swatch, `${shortName(id)} ${every}`));
  });
  node.replaceChildren(...parts);
  node.hidden = parts.length === 0;
}

const shortName = (id) => ({ kappa1: "κ₁", kappa2: "κ₂" })[id] ?? id;

function colourBar(app, field, map) {
  const { state, look } = app;
  const range = state.range ?? look.autoRange(field.id, app.shown());
  const height = 190;
  const bar = element("div", { class: "bar-row", style: `height:${height}px` });
  const [first, last] = mapPart(field, range);
  const stops = Array.from({ length: 17 }, (_, i) => map[Math.round((first + (last - first) * (i / 16)) * 255)]);
  bar.append(element("div", { class: "ramp", style: `background:linear-gradient(to top, ${stops.join(",")})` }));
  // How the area is spread over the values.
  const density = look.density(state.stage, field.id, range, 48);
  const most = Math.max(...density);
  const svg = element("svg", { class: "density", width: 26, height, "aria-hidden": "true" });
  if (most > 0) {
    const points = [...density].map((d, i) => `L${((d / most) * 24).toFixed(1)} ${(height * (1 - (i + 0.5) / 48)).toFixed(1)}`);
    svg.append(element("path", { d: `M0 ${height}${points.join("")}L0 0Z` }));
  }
  bar.append(svg);
  for (const t of ticks(range[0], range[1], 5)) {
    const at = (t - range[0]) / (range[1] - range[0]);
    bar.append(element("span", { class: "tick", style: `bottom:${(at * height).toFixed(1)}px` }, formatNumber(t)));
  }
  const title = element("h3", {}, field.label);
  const unit = element("p", { class: "quiet" }, field.unit ? `in ${field.unit}` : "no unit");
  const parts = [title, unit, bar];
  const own = look.extremes(state.stage, field.id);
  if (own) {
    parts.push(element("p", { class: "quiet" }, `from ${formatNumber(own.lo)} to ${formatNumber(own.hi)}`));
    if (own.gaps) parts.push(element("p", { class: "quiet" }, "grey: no value"));
  } else {
    parts.push(element("p", { class: "quiet" }, "not known for this stage"));
  }
  return parts;
}

// A bar of round length at the depth of the target.
function drawRuler(node, app, height) {
  const perUnit = height / (2 * Math.tan(FIELD_OF_VIEW / 2) * app.state.camera.distance);
  const length = niceStep(110 / perUnit, 1);
  const shown = length * perUnit > 160 ? length / 2 : length;
  node.style.width = `${(shown * perUnit).toFixed(1)}px`;
  node.textContent = withUnit(formatNumber(shown), app.data.lengthUnit);
}

function drawReadout(node, app, stageIndex, vertex) {
  if (vertex < 0) {
    node.hidden = true;
    return;
  }
  const stage = app.stages[stageIndex];
  const rows = [];
  const place = [0, 1, 2].map((k) => formatNumber(stage.positions[3 * vertex + k] + app.origin[k], 4));
  rows.push(["at", place.join(", ")]);
  for (const f of stage.fields) rows.push([shortName(f.id), withUnit(formatNumber(f.values[vertex], 4), f.unit)]);
  for (const g of stage.groups) rows.push([g.label, g.names[g.ofVertex[vertex]]]);
  const table = element("table");
  for (const [name, value] of rows) table.append(element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value)));
  node.replaceChildren(table);
  node.hidden = false;
}
