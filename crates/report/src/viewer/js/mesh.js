// One stage as arrays for the GPU: a vertex is doubled where groups meet, edges are collected.

const NO_VALUE = 3e38; // a GPU may not keep NaN; anything this large counts as "no value"

function readStage(about, bytes, origin) {
  const positions = decodePoints(bytes, about.positions, origin);
  const triangles = decodeIntegers(bytes, about.triangles);
  const groups = about.groups.map((g) => ({ ...g, ofTriangle: decodeIntegers(bytes, g.ofTriangle) }));
  const split = splitAtGroups(triangles, positions.length / 3, groups);
  const pick3 = (array) => {
    const out = new Float32Array(3 * split.source.length);
    split.source.forEach((v, i) => {
      for (let k = 0; k < 3; k++) out[3 * i + k] = array[3 * v + k];
    });
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
      return { ...f, values: Float64Array.from(split.source, (v) => values[v]) };
    }),
    lines: about.lines.map((l) => ({
      ...l,
      segments: polylineSegments(decodeIntegers(bytes, l.lengths), decodePoints(bytes, l.points, origin)),
    })),
  };
  for (const group of groups) group.ofVertex = perVertex(group.ofTriangle, split.triangles, stage.count);
  stage.areas = vertexAreas(stage);
  const drawn = uniqueEdges(triangles, positions.length / 3);
  stage.wire = edgeSegments(drawn.edges, positions);
  stage.outline = edgeSegments(drawn.border, positions);
  const cut = uniqueEdges(split.triangles, stage.count).border;
  stage.groupBorders = groups.length ? edgeSegments(cut, stage.positions) : new Float32Array(0);
  return stage;
}

// Gives every vertex one group per grouping by doubling it where groups meet.
function splitAtGroups(corners, vertexCount, groups) {
  const triangles = Uint32Array.from(corners);
  const source = Array.from({ length: vertexCount }, (_, i) => i);
  if (groups.length === 0) return { triangles, source };
  const signature = new Float64Array(triangles.length / 3);
  for (const g of groups) {
    for (let t = 0; t < signature.length; t++) signature[t] = signature[t] * (g.names.length + 1) + g.ofTriangle[t];
  }
  const firstOf = new Float64Array(vertexCount).fill(-1);
  const doubled = new Map();
  for (let i = 0; i < triangles.length; i++) {
    const [v, s] = [triangles[i], signature[Math.floor(i / 3)]];
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
  const at = (v) => [p[3 * v], p[3 * v + 1], p[3 * v + 2]];
  for (let i = 0; i < triangles.length; i += 3) {
    const [a, b, c] = [at(triangles[i]), at(triangles[i + 1]), at(triangles[i + 2])];
    const [u, v] = [subtract(b, a), subtract(c, a)];
    const [uu, uv, vv] = [dot(u, u), dot(u, v), dot(v, v)];
    const share = Math.sqrt(Math.max(uu * vv - uv * uv, 0)) / 6;
    for (let k = 0; k < 3; k++) areas[triangles[i + k]] += share;
  }
  return areas;
}

// Each edge once, and the edges of one triangle only.
function uniqueEdges(triangles, vertexCount) {
  const keys = new Float64Array(triangles.length);
  for (let i = 0; i < triangles.length; i++) {
    const next = i % 3 === 2 ? i - 2 : i + 1;
    const [a, b] = [triangles[i], triangles[next]];
    keys[i] = Math.min(a, b) * vertexCount + Math.max(a, b);
  }
  keys.sort();
  const [edges, border] = [[], []];
  for (let i = 0; i < keys.length; ) {
    let j = i + 1;
    while (j < keys.length && keys[j] === keys[i]) j++;
    const edge = [Math.floor(keys[i] / vertexCount), keys[i] % vertexCount];
    edges.push(edge);
    if (j === i + 1) border.push(edge);
    i = j;
  }
  return { edges, border };
}

// Segments as six floats each: start and end.
function edgeSegments(edges, positions) {
  const out = new Float32Array(6 * edges.length);
  edges.forEach(([a, b], i) => {
    out.set(positions.subarray(3 * a, 3 * a + 3), 6 * i);
    out.set(positions.subarray(3 * b, 3 * b + 3), 6 * i + 3);
  });
  return out;
}

function polylineSegments(lengths, points) {
  const edges = [];
  let start = 0;
  for (const length of lengths) {
    for (let i = 1; i < length; i++) edges.push([start + i - 1, start + i]);
    start += length;
  }
  return edgeSegments(edges, points);
}
