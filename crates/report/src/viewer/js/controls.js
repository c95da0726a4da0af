// Buttons and fields around the view, kept in step with the state.

const byId = (id) => document.getElementById(id);

function makeControls(app) {
  const { stages, look } = app;

  const segments = (node, entries, isOn, choose) => {
    const buttons = entries.map(([value, label]) => {
      const button = element("button", { type: "button" }, label);
      button.addEventListener("click", () => choose(value));
      return [value, button];
    });
    node.replaceChildren(...buttons.map(([, b]) => b));
    node.hidden = entries.length < 2;
    return () => buttons.forEach(([value, b]) => b.setAttribute("aria-pressed", String(isOn(value))));
  };
  const options = (select, entries, choose) => {
    select.replaceChildren(...entries.map(([value, label]) => element("option", { value }, label)));
    select.addEventListener("change", () => choose(select.value));
  };
  const unique = (lists) => [...new Map(lists.flat().map((x) => [x.id, x])).values()];

  const fields = unique(stages.map((s) => s.fields));
  const groups = unique(stages.map((s) => s.groups));
  const lines = unique(stages.map((s) => s.lines));
  const modes = [["field", "Field"], ["groups", "Groups"], ["zebra", "Zebra"], ["isophotes", "Isophotes"], ["plain", "Plain"]];
  const possible = modes.filter(([m]) => (m !== "field" || fields.length) && (m !== "groups" || groups.length));

  const syncStages = segments(byId("stages"), stages.map((s, i) => [i, s.name]),
    (i) => i === app.state.stage, (stage) => app.change({ stage }));
  const syncModes = segments(byId("modes"), possible, (m) => m === app.state.mode,
    (mode) => app.change({ mode, chosenGroup: -1 }));
  options(byId("field"), fields.map((f) => [f.id, f.label]), (field) => app.change({ field, mode: "field", range: null }));
  options(byId("group"), groups.map((g) => [g.id, g.label]), (group) => app.change({ group, mode: "groups", chosenGroup: -1 }));
  const compare = [["", "nothing"], ...stages.map((s, i) => [String(i), s.name])];
  options(byId("compare"), compare, (value) => app.change(value === "" ? { compare: false } : { compare: true, other: Number(value) }));
  byId("compare").parentElement.hidden = stages.length < 2;
  const behind = [["-1", "nothing"], ...stages.map((s, i) => [String(i), s.name])];
  options(byId("behind"), behind, (value) => {
    app.diagram.zoom = null;
    app.change({ behind: Number(value) });
  });
  const none = [["", "none"], ...fields.map((f) => [f.id, f.label])];
  ["iso-first", "iso-second"].forEach((id, k) => {
    options(byId(id), none, (value) => {
      const iso = [...app.state.iso];
      iso[k] = value;
      app.change({ iso });
    });
  });
  byId("isolines").hidden = fields.length === 0;
  byId("range-box").hidden = fields.length === 0;
  const axes = Object.entries(AXES).map(([id, a]) => [id, `${a.names[0]}, ${a.names[1]}`]);
  options(byId("axes"), axes, (value) => {
    app.diagram.zoom = null;
    app.change({ axes: value, brush: null });
  });

  const lineChecks = [["edges", "border"], ["wire", "display mesh"]].map(([key, label]) => {
    const input = element("input", { type: "checkbox" });
    input.addEventListener("change", () => app.change({ [key]: input.checked }));
    return { label: element("label", {}, input, label), sync: () => { input.checked = app.state[key]; } };
  });
  for (const l of lines) {
    const input = element("input", { type: "checkbox" });
    input.addEventListener("change", () => {
      const chosen = new Set(app.state.lines);
      if (input.checked) chosen.add(l.id);
      else chosen.delete(l.id);
      app.change({ lines: chosen });
    });
    const label = element("label", {}, input, l.label);
    const sync = () => {
      input.checked = app.state.lines.has(l.id);
      label.hidden = !app.shown().some((i) => stages[i].lines.some((own) => own.id === l.id));
    };
    lineChecks.push({ label, sync });
  }
  byId("lines").append(...lineChecks.map((c) => c.label));

  const range = [byId("range-low"), byId("range-high")];
  const setRange = () => {
    const values = range.map((input) => Number(input.value.replace("−", "-").replace(",", ".")));
    if (values.every(Number.isFinite) && values[0] < values[1]) app.change({ range: values });
    else syncRange();
  };
  for (const input of range) input.addEventListener("change", setRange);
  byId("range-auto").addEventListener("click", () => app.change({ range: null }));
  byId("range-full").addEventListener("click", () => app.change({ range: look.autoRange(app.state.field, undefined, true) }));
  byId("range-all").addEventListener("click", () => app.change({ range: look.autoRange(app.state.field) }));
  byId("range-all").hidden = stages.length < 2;
  const syncRange = () => {
    const values = app.state.range ?? look.autoRange(app.state.field, app.shown());
    const short = (x) => (x !== 0 && Math.abs(x) < 1e-3 ? Number(x.toPrecision(4)).toExponential() : String(Number(x.toPrecision(4))));
    range.forEach((input, i) => { input.value = short(values[i]); });
  };

  for (const key of ["stripes", "angle"]) {
    byId(key).addEventListener("input", () => app.change({ [key]: Number(byId(key).value) }));
  }
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => app.setView(button.dataset.view));
  }
  byId("select-tool").addEventListener("click", () => {
    app.selecting = !app.selecting;
    app.refresh();
  });
  byId("clear-brush").addEventListener("click", () => app.clearBrush());
  for (const button of document.querySelectorAll("[data-seam]")) {
    button.addEventListener("click", () => {
      app.showSeam(Number(button.dataset.seam));
      byId("view3d").scrollIntoView({ block: "center" });
    });
  }
  window.addEventListener("keydown", (event) => {
    if (event.key === "Escape") app.clearBrush();
  });

  // What no stage in view has cannot be chosen.
  const offer = (select, kind) => {
    const known = new Set(app.shown().flatMap((i) => stages[i][kind].map((x) => x.id)));
    for (const option of select.options) option.disabled = option.value !== "" && !known.has(option.value);
  };

  return () => {
    const s = app.state;
    syncStages();
    syncModes();
    offer(byId("field"), "fields");
    offer(byId("group"), "groups");
    offer(byId("iso-first"), "fields");
    offer(byId("iso-second"), "fields");
    byId("field").value = s.field;
    byId("group").value = s.group;
    byId("field").parentElement.hidden = fields.length === 0 || s.mode !== "field";
    byId("group").parentElement.hidden = s.mode !== "groups";
    byId("behind").value = String(s.behind);
    byId("behind-box").hidden = stages.length < 2 || s.compare;
    byId("compare").value = s.compare ? String(s.other) : "";
    byId("iso-first").value = s.iso[0];
    byId("iso-second").value = s.iso[1];
    byId("axes").value = s.axes;
    lineChecks.forEach((c) => c.sync());
    syncRange();
    byId("range-box").hidden = fields.length === 0 || s.mode !== "field";
    byId("stripe-box").hidden = s.mode !== "zebra" && s.mode !== "isophotes";
    byId("stripes").value = s.stripes;
    byId("angle").value = s.angle;
    byId("select-tool").setAttribute("aria-pressed", String(app.selecting));
    byId("view3d").classList.toggle("selecting", app.selecting);
    document.querySelectorAll("[data-view]").forEach((b) => b.setAttribute("aria-pressed", String(b.dataset.view === s.view)));
    document.querySelectorAll("[data-seam]").forEach((b) => {
      b.closest("tr").classList.toggle("chosen", Number(b.dataset.seam) === s.seam);
    });
  };
}
