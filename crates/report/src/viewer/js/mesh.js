// One stage as arrays for the GPU: a vertex is doubled where groups meet, edges are collected.

const NO_VALUE = 3e38; // a GPU may not keep NaN; anything this large counts as "no value"

function readStage(about, bytes, origin) {
  const positions = decodePoints(bytes, about.positions, origin);
  const triangles = decodeIntegers(bytes, about.triangles);
  const groups = about.groups.map((g) => ({ ...g, ofTriangle: decodeIntegers(bytes, g.ofTriangle) }));
  const split = splitAtGroups(triangles, positions.length / 3, groups);
  const pick3 = (array) => {
    const out = new Float32Array(3 * split.source.length);
    for (let i = 0; i < split.source.length; i++) {
      for (let k = 0; k < 3; k++) out[3 * i + k] = array[3 * split.source[i] + k];
    }
    return out;
  };
  const stage = {
    name: about.name,
    exactNormals: about.exactNormals,
    count: split.source.length,
    positions: pick3(positions),
    normals: pick3(decodeNormals(bytes, about.normals)),
    triangles: split.triangles,
    groups,
    fields: about.fields.map((f) => {
      const values = decodeFloats(bytes, f.values);
      if (split.source.length === values.length) return { ...f, values };
      const spread = new Float64Array(split.source.length);
      for (let i = 0; i < spread.length; i++) spread[i] = values[split.source[i]];
      return { ...f, values: spread };
    }),
    lines: about.lines.map((l) => ({
      ...l,
      segments: polylineSegments(decodeIntegers(bytes, l.lengths), decodePoints(bytes, l.points, origin)),
    })),
  };
  for (const group of groups) group.ofVertex = perVertex(group.ofTriangle, split.triangles, stage.count);
  stage.areas = vertexAreas(stage);
  // Lines are collected when they are first drawn; most are never asked for.
  const drawn = once(() => uniqueEdges(triangles, positions.length / 3));
  stage.segments = {
    wire: () => edgeSegments(drawn().edges, positions),
    outline: () => edgeSegments(drawn().border, positions),
    borders: () => edgeSegments(groups.length ? uniqueEdges(split.triangles, stage.count).border : [], stage.positions),
  };
  for (const l of stage.lines) stage.segments[`set:${l.id}`] = () => l.segments;
  return stage;
}

function once(make) {
  let made = null;
  return () => (made ??= make());
}

// Gives every vertex one group per grouping by doubling it where groups meet.
function splitAtGroups(corners, vertexCount, groups) {
  const triangles = Uint32Array.from(corners);
  const source = [];
  for (let i = 0; i < vertexCount; i++) source.push(i);
  if (groups.length === 0) return { triangles, source };
  const signature = new Float64Array(triangles.length / 3);
  for (const g of groups) {
    for (let t = 0; t < signature.length; t++) signature[t] = signature[t] * (g.names.length + 1) + g.ofTriangle[t];
  }
  const firstOf = new Float64Array(vertexCount).fill(-1);
  const doubled = new Map();
  for (let i = 0; i < triangles.length; i++) {
    const v = triangles[i];
    const s = signature[Math.floor(i / 3)];
    if (firstOf[v] < 0) firstOf[v] = s;
    if (firstOf[v] === s) continue;
    const key = `${v}/${s}`;
    if (!doubled.has(key)) {
      doubled.set(key, source.length);
      source.push(v);
    }
    triangles[i] = doubled.get(key);
  }
  return { triangles, source };
}

function perVertex(ofTriangle, triangles, count) {
  const out = new Float32Array(count);
  for (let i = 0; i < triangles.length; i++) out[triangles[i]] = ofTriangle[Math.floor(i / 3)];
  return out;
}

function vertexAreas({ positions: p, triangles, count }) {
  const areas = new Float64Array(count);
  for (let i = 0; i < triangles.length; i += 3) {
    const a = 3 * triangles[i];
    const b = 3 * triangles[i + 1];
    const c = 3 * triangles[i + 2];
    let [uu, uv, vv] = [0, 0, 0];
    for (let k = 0; k < 3; k++) {
      const u = p[b + k] - p[a + k];
      const v = p[c + k] - p[a + k];
      uu += u * u;
      uv += u * v;
      vv += v * v;
    }
    const share = Math.sqrt(Math.max(uu * vv - uv * uv, 0)) / 6;
    for (let k = 0; k < 3; k++) areas[triangles[i + k]] += share;
  }
  return areas;
}

// Each edge once, and the edges of one triangle only, as pairs of vertices one after the other.
function uniqueEdges(triangles, vertexCount) {
  const keys = new Float64Array(triangles.length);
  for (let i = 0; i < triangles.length; i++) {
    const next = i % 3 === 2 ? i - 2 : i + 1;
    const a = triangles[i];
    const b = triangles[next];
    keys[i] = Math.min(a, b) * vertexCount + Math.max(a, b);
  }
  keys.sort();
  const [edges, border] = [[], []];
  for (let i = 0; i < keys.length; ) {
    let j = i + 1;
    while (j < keys.length && keys[j] === keys[i]) j++;
    const a = Math.floor(keys[i] / vertexCount);
    const b = keys[i] % vertexCount;
    edges.push(a, b);
    if (j === i + 1) border.push(a, b);
    i = j;
  }
  return { edges, border };
}

// Segments as six floats each: start and end.
function edgeSegments(edges, positions) {
  const out = new Float32Array(3 * edges.length);
  for (let i = 0; i < edges.length; i++) {
    for (let k = 0; k < 3; k++) out[3 * i + k] = positions[3 * edges[i] + k];
  }
  return out;
}

function polylineSegments(lengths, points) {
  const edges = [];
  let start = 0;
  for (const length of lengths) {
    for (let i = 1; i < length; i++) edges.push(start + i - 1, start + i);
    start += length;
  }
  return edgeSegments(edges, points);
}

// Triangles for a quick look while the camera moves: vertices that share a cell of a grid become
// the first of them. Drawn with the attributes of all vertices.
function coarseTriangles({ positions: p, triangles, count }, cells) {
  const [lo, hi] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (let i = 0; i < p.length; i++) {
    lo[i % 3] = Math.min(lo[i % 3], p[i]);
    hi[i % 3] = Math.max(hi[i % 3], p[i]);
  }
  const size = Math.max(...subtract(hi, lo)) / cells || 1;
  const first = new Map();
  const leader = new Uint32Array(count);
  for (let v = 0; v < count; v++) {
    let key = 0;
    for (let k = 0; k < 3; k++) key = key * (cells + 1) + Math.floor((p[3 * v + k] - lo[k]) / size);
    if (!first.has(key)) first.set(key, v);
    leader[v] = first.get(key);
  }
  const kept = [];
  for (let i = 0; i < triangles.length; i += 3) {
    const a = leader[triangles[i]];
    const b = leader[triangles[i + 1]];
    const c = leader[triangles[i + 2]];
    if (a !== b && b !== c && c !== a) kept.push(a, b, c);
  }
  return Uint32Array.from(kept);
}
