// Unpacks the arrays that `codec.rs` packed: base64, deflate, byte planes, prediction.

async function unpackBytes(text) {
  const binary = atob(text);
  const deflated = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) deflated[i] = binary.charCodeAt(i);
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Whole numbers behind the planes; `layout` is what Packer::predicted wrote.
function decodeCodes(bytes, layout) {
  const { at, n, width, shift: [a, b, c] } = layout;
  const mask = width === 3 ? 0xffffff : -1;
  const codes = new Int32Array(n);
  const far = a + Math.max(c, b);
  for (let i = 0; i < n; i++) {
    let r = bytes[at + i] | (bytes[at + n + i] << 8) | (bytes[at + 2 * n + i] << 16);
    if (width === 4) r |= bytes[at + 3 * n + i] << 24;
    const difference = (r >>> 1) ^ -(r & 1);
    let guess = 0;
    if (i < a) guess = i > 0 ? codes[i - 1] : 0;
    else if (b === 0 || i < far) guess = codes[i - a];
    else guess = codes[i - a] + codes[i - b] - codes[i - far];
    codes[i] = (guess + difference) & mask;
  }
  return codes;
}

const decodeIntegers = (bytes, packed) => new Uint32Array(decodeCodes(bytes, packed.layout).buffer);

// Floats as doubles, so that an origin can be subtracted before they become 32 bits wide.
function decodeFloats(bytes, packed) {
  const codes = decodeCodes(bytes, packed.layout);
  const step = packed.span / (packed.levels - 1);
  const values = new Float64Array(codes.length);
  for (let i = 0; i < codes.length; i++) values[i] = codes[i] === packed.levels ? NaN : packed.lo + codes[i] * step;
  return values;
}

function decodePoints(bytes, packed, origin) {
  const [x, y, z] = packed.map((p) => decodeFloats(bytes, p));
  const points = new Float32Array(3 * x.length);
  for (let i = 0; i < x.length; i++) {
    points[3 * i] = x[i] - origin[0];
    points[3 * i + 1] = y[i] - origin[1];
    points[3 * i + 2] = z[i] - origin[2];
  }
  return points;
}

// Directions from their coordinates on the octahedron folded into a square.
function decodeNormals(bytes, packed) {
  const [x, y] = packed.map((p) => decodeFloats(bytes, p));
  const normals = new Float32Array(3 * x.length);
  for (let i = 0; i < x.length; i++) {
    const z = 1 - Math.abs(x[i]) - Math.abs(y[i]);
    const t = Math.max(-z, 0);
    const nx = x[i] - (x[i] < 0 ? -t : t);
    const ny = y[i] - (y[i] < 0 ? -t : t);
    const length = Math.sqrt(nx * nx + ny * ny + z * z);
    normals[3 * i] = nx / length;
    normals[3 * i + 1] = ny / length;
    normals[3 * i + 2] = z / length;
  }
  return normals;
}
