// Ranges, steps and the diagram's window: what follows from the data for the chosen state.

function makeLook(stages, lengthUnit) {
  const cache = new Map();
  const remember = (key, make) => {
    if (!cache.has(key)) cache.set(key, make());
    return cache.get(key);
  };
  const diagonal = Math.max(...stages.map((s) => boxDiagonal(s.positions)));
  const all = stages.map((_, i) => i);
  const everywhere = (id, shown = all) => shown.flatMap((i) => stages[i].fields.filter((f) => f.id === id));
  const sorted = (id, shown = all) => remember(`sorted ${id} ${shown.join()}`, () => sortedFinite(everywhere(id, shown).map((f) => f.values)));

  // Below this a curvature or length is rounding noise on a model of this size.
  const noise = (id) => (id === "K" ? 1e-9 / diagonal ** 2 : id.match(/^(H|kappa)/) ? 1e-9 / diagonal : 0);

  // Values at the map's ends for the stages shown: those of the central 98 %, or the extremes.
  function autoRange(id, shown = all, full = false) {
    return remember(`range ${id} ${shown.join()} ${full}`, () => {
      const field = everywhere(id, shown)[0];
      const values = sorted(id, shown);
      if (!field || values.length === 0) return [0, 1];
      if (field.range && !full) return field.range;
      const [lo, hi] = full ? [values[0], values[values.length - 1]] : [quantile(values, 0.01), quantile(values, 0.99)];
      if (field.signed) {
        const most = Math.max(Math.abs(lo), Math.abs(hi), noise(id));
        // Values of one sign that differ enough get one half of the map for themselves.
        if (lo * hi > 0 && hi - lo > 0.15 * most) return [lo, hi];
        return most > 0 ? [-most, most] : [-1, 1];
      }
      const start = values[0] >= 0 && lo < 0.4 * hi ? 0 : lo;
      return hi > start ? [start, hi] : [start, start + (Math.abs(start) || 1)];
    });
  }

  // Distance between neighbouring isolines of a field; 0 if there is nothing to draw.
  function isoStep(id, shown) {
    const values = sorted(id, shown);
    if (values.length === 0) return 0;
    const span = quantile(values, 0.99) - quantile(values, 0.01);
    return span > Math.max(noise(id), 1e-9 * Math.abs(values[values.length - 1])) ? niceStep(span, 14) : 0;
  }

  // Share of the area in each of `bins` equal parts of the range.
  function density(index, id, range, bins) {
    return remember(`density ${index} ${id} ${range.join()}`, () => {
      const out = new Float64Array(bins);
      const field = stages[index].fields.find((f) => f.id === id);
      field?.values.forEach((v, i) => {
        const k = Math.floor(((v - range[0]) / (range[1] - range[0])) * bins);
        if (k >= 0 && k < bins) out[k] += stages[index].areas[i];
      });
      return out;
    });
  }

  // Lowest and highest value in one stage, and whether some vertices have none.
  function extremes(index, id) {
    return remember(`extremes ${index} ${id}`, () => {
      const values = stages[index].fields.find((f) => f.id === id)?.values;
      if (!values) return null;
      let [lo, hi, gaps] = [Infinity, -Infinity, false];
      for (const v of values) {
        if (!Number.isFinite(v)) gaps = true;
        if (v < lo) lo = v;
        if (v > hi) hi = v;
      }
      return { lo, hi, gaps };
    });
  }

  // Part of the diagram's plane that holds nearly all points of the given stages.
  function diagramWindow(shown, axes) {
    return remember(`window ${shown.join()} ${axes}`, () => {
      const points = shown.map((i) => diagramPoints(stages[i], axes)).filter(Boolean);
      if (points.length === 0) return [-1, -1, 1, 1];
      const sizes = sorted("K", shown);
      const most = Math.max(Math.abs(quantile(sizes, 0.01)), Math.abs(quantile(sizes, 0.99)), noise("K"));
      const window_ = [0, 0, 0, 0];
      for (const side of [0, 1]) {
        const values = sortedFinite(points.map((p) => p.filter((_, i) => i % 2 === side)));
        const [lo, hi] = [quantile(values, 0.004), quantile(values, 0.996)];
        const size = axes === "HK" && side === 1 ? most : Math.sqrt(most);
        // A constant curvature is shown as a line, not as its rounding noise.
        const half = Math.max(0.58 * (hi - lo), 0.05 * size, 0.02 * Math.abs(hi));
        window_[side] = (lo + hi) / 2 - half;
        window_[side + 2] = (lo + hi) / 2 + half;
      }
      return window_;
    });
  }

  return { autoRange, isoStep, density, extremes, diagramWindow, everywhere, sorted, diagonal, lengthUnit };
}

// The part of the colour map a range uses: signs keep their colours.
function mapPart(field, [lo, hi]) {
  if (!field?.signed || (lo < 0 && hi > 0)) return [0, 1];
  return lo >= 0 ? [0.54, 1] : [0, 0.46];
}

function boxDiagonal(positions) {
  const [lo, hi] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (let i = 0; i < positions.length; i++) {
    lo[i % 3] = Math.min(lo[i % 3], positions[i]);
    hi[i % 3] = Math.max(hi[i % 3], positions[i]);
  }
  return Math.hypot(...subtract(hi, lo));
}
