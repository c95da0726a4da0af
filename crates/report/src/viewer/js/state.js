// What is shown, and its short form in the page's address.

const MODES = { field: 0, groups: 1, zebra: 2, isophotes: 3, plain: 4 };
const VIEWS = {
  iso: [-60, 28], top: [-90, 89.9], front: [-90, 0], right: [0, 0], low: [-60, 8], back: [120, 28],
};

// Axes of the diagram: the fields they need and how a vertex gets its place.
const signedRoot = (k) => Math.sign(k) * Math.sqrt(Math.abs(k));
const AXES = {
  HK: { needs: ["H", "K"], names: ["H", "K"], at: (h, k) => [h, k] },
  HsK: { needs: ["H", "K"], names: ["H", "sign(K) √|K|"], at: (h, k) => [h, signedRoot(k)] },
  k1k2: {
    needs: ["H", "K"], names: ["κ₁", "κ₂"], fields: ["kappa1", "kappa2"],
    // Beyond K = H² there are no principal curvatures; rounding may lead a little there.
    at: (h, k) => {
      const square = h * h - k;
      const root = square < -1e-6 * (h * h + Math.abs(k)) ? NaN : Math.sqrt(Math.max(square, 0));
      return [h + root, h - root];
    },
  },
};

function initialState(stages) {
  const last = stages.length - 1;
  const ids = stages[last].fields.map((f) => f.id);
  const field = ["H", "K"].find((id) => ids.includes(id)) ?? ids[0] ?? "";
  const groups = stages[last].groups.map((g) => g.id);
  const lines = new Set(stages.flatMap((s) => s.lines.filter((l) => l.visible).map((l) => l.id)));
  return {
    stage: last, compare: false, other: last > 0 ? 0 : last, behind: 0,
    mode: field ? "field" : groups.length ? "groups" : "plain",
    field, group: groups[0] ?? "", range: null, iso: ["", ""], lines,
    edges: true, wire: false, axes: "HK", brush: null, pick: null, chosenGroup: -1,
    stripes: 16, angle: 0, seam: -1,
    camera: { azimuth: 0, elevation: 0, distance: 1, target: [0, 0, 0] }, view: "iso",
  };
}

const round = (x) => String(Number(x.toPrecision(5)));

function stateToFragment(state) {
  const parts = [];
  const put = (key, value) => parts.push(`${key}=${value}`);
  const c = state.camera;
  const degrees = (a) => round((a * 180) / Math.PI);
  if (state.view) put("view", state.view);
  else put("view", [degrees(c.azimuth), degrees(c.elevation), round(c.distance), ...c.target.map(round)].join(","));
  put("stage", state.stage);
  if (state.compare) put("compare", state.other);
  put("mode", state.mode);
  if (state.field) put("field", state.field);
  if (state.group) put("group", state.group);
  if (state.range) put("range", state.range.map(round).join(","));
  if (state.iso.some(Boolean)) put("iso", state.iso.join(","));
  if (state.lines.size) put("lines", [...state.lines].join(","));
  if (!state.edges) put("edges", 0);
  if (state.wire) put("wire", 1);
  put("axes", state.axes);
  if (state.behind < 0) put("behind", "none");
  else if (state.behind > 0) put("behind", state.behind);
  if (state.brush) put("brush", state.brush.map(round).join(","));
  if (state.pick) put("pick", state.pick.map(round).join(","));
  if (state.chosenGroup >= 0) put("chosen", state.chosenGroup);
  if (state.mode === "zebra" || state.mode === "isophotes") {
    put("stripes", state.stripes);
    put("angle", state.angle);
  }
  if (state.seam >= 0) put("seam", state.seam);
  return `#${parts.join("&")}`;
}

// Reads a fragment into `state`; what is unknown or out of range is left as it was.
function applyFragment(state, fragment, stages) {
  const numbers = (text, count) => {
    const list = text.split(",").map(Number);
    return list.length === count && list.every(Number.isFinite) ? list : null;
  };
  const index = (text) => {
    const i = stages.findIndex((s) => s.name === text);
    const k = i >= 0 ? i : Number(text);
    return Number.isInteger(k) && k >= 0 && k < stages.length ? k : null;
  };
  for (const part of fragment.replace(/^#/, "").split("&")) {
    const cut = part.indexOf("=");
    if (cut < 0) continue;
    let text = part.slice(cut + 1);
    try {
      text = decodeURIComponent(text);
    } catch {
      continue;
    }
    switch (part.slice(0, cut)) {
      case "view": {
        const list = numbers(text, 6);
        if (VIEWS[text]) state.view = text;
        else if (list) {
          const rad = Math.PI / 180;
          const target = list.slice(3);
          state.camera = { azimuth: list[0] * rad, elevation: list[1] * rad, distance: list[2], target };
          state.view = "";
        }
        break;
      }
      case "stage": state.stage = index(text) ?? state.stage; break;
      case "compare":
        state.other = index(text) ?? state.other;
        state.compare = stages.length > 1;
        break;
      case "behind": state.behind = text === "none" ? -1 : index(text) ?? state.behind; break;
      case "mode": if (text in MODES) state.mode = text; break;
      case "field": if (stages.some((s) => s.fields.some((f) => f.id === text))) state.field = text; break;
      case "group": if (stages.some((s) => s.groups.some((g) => g.id === text))) state.group = text; break;
      case "range": state.range = numbers(text, 2); break;
      case "iso": state.iso = [...text.split(","), ""].slice(0, 2); break;
      case "lines": state.lines = new Set(text.split(",").filter(Boolean)); break;
      case "edges": state.edges = text !== "0"; break;
      case "wire": state.wire = text !== "0"; break;
      case "axes": if (text in AXES) state.axes = text; break;
      case "brush": {
        const b = numbers(text, 4);
        if (b) state.brush = [Math.min(b[0], b[2]), Math.min(b[1], b[3]), Math.max(b[0], b[2]), Math.max(b[1], b[3])];
        break;
      }
      case "pick": state.pick = numbers(text, 4); break;
      case "chosen": state.chosenGroup = Number(text); break;
      case "stripes": state.stripes = clamp(Number(text) || 16, 2, 80); break;
      case "angle": state.angle = clamp(Number(text) || 0, 0, 180); break;
      case "seam": state.seam = Number(text); break;
    }
  }
}
