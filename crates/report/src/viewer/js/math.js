// Small vectors, the camera's matrices, ticks and numbers.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const clamp = (x, lo, hi) => Math.min(Math.max(x, lo), hi);

const FIELD_OF_VIEW = (26 * Math.PI) / 180;

// Axes of a camera that looks from azimuth and elevation (radians) with z up.
function cameraAxes(camera) {
  const [ca, sa] = [Math.cos(camera.azimuth), Math.sin(camera.azimuth)];
  const [ce, se] = [Math.cos(camera.elevation), Math.sin(camera.elevation)];
  return { right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce], back: [ce * ca, ce * sa, se] };
}

const eyeOf = (camera) => add(camera.target, scale(cameraAxes(camera).back, camera.distance));

// World to clip space, column by column, for a viewport of the given aspect.
function viewProjection(camera, aspect, sceneRadius) {
  const { right, up, back } = cameraAxes(camera);
  const eye = eyeOf(camera);
  const reach = sceneRadius * 1.05 + Math.hypot(...camera.target);
  const far = camera.distance + reach;
  const near = Math.max(camera.distance - reach, far / 5000);
  const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
  const rows = [
    [...scale(right, f / aspect), (-f / aspect) * dot(right, eye)],
    [...scale(up, f), -f * dot(up, eye)],
    [0, 0, 0, 0],
    [...scale(back, -1), dot(back, eye)],
  ];
  const depth = (far + near) / (far - near);
  for (let k = 0; k < 4; k++) rows[2][k] = depth * rows[3][k];
  rows[2][3] -= (2 * far * near) / (far - near);
  const matrix = new Float32Array(16);
  for (let r = 0; r < 4; r++) for (let c = 0; c < 4; c++) matrix[4 * c + r] = rows[r][c];
  return matrix;
}

// Distance and target from which all points fill a part of the view, seen from the camera's angles;
// `wide` and `high` are the part's size as a share of the view's height.
function fitCamera(camera, points, wide, high) {
  const { right, up, back } = cameraAxes(camera);
  const step = 3 * Math.max(1, Math.floor(points.length / 3 / 6000));
  const limits = { r: [Infinity, -Infinity], u: [Infinity, -Infinity], b: [Infinity, -Infinity] };
  const seen = [];
  for (let i = 0; i < points.length; i += step) {
    const p = [points[i], points[i + 1], points[i + 2]];
    const q = { r: dot(p, right), u: dot(p, up), b: dot(p, back) };
    seen.push(q);
    for (const k of ["r", "u", "b"]) {
      limits[k][0] = Math.min(limits[k][0], q[k]);
      limits[k][1] = Math.max(limits[k][1], q[k]);
    }
  }
  const middle = {};
  for (const k of ["r", "u", "b"]) middle[k] = (limits[k][0] + limits[k][1]) / 2;
  const t = Math.tan(FIELD_OF_VIEW / 2) * 0.86;
  let distance = 0;
  for (const q of seen) {
    const across = Math.abs(q.r - middle.r) / (t * wide);
    const along = Math.abs(q.u - middle.u) / (t * high);
    distance = Math.max(distance, Math.max(across, along) + q.b - middle.b);
  }
  camera.target = add(scale(right, middle.r), add(scale(up, middle.u), scale(back, middle.b)));
  camera.distance = distance || 1;
}

// How far from the middle of the view points are drawn at most; its borders are at 1.
function widestReach(camera, points, aspect) {
  const { right, up, back } = cameraAxes(camera);
  const t = Math.tan(FIELD_OF_VIEW / 2);
  const step = 3 * Math.max(1, Math.floor(points.length / 3 / 6000));
  let most = 0;
  for (let i = 0; i < points.length; i += step) {
    const p = subtract([points[i], points[i + 1], points[i + 2]], camera.target);
    const depth = (camera.distance - dot(p, back)) * t;
    most = Math.max(most, Math.abs(dot(p, right)) / (depth * aspect), Math.abs(dot(p, up)) / depth);
  }
  return most;
}

// Round numbers from lo to hi, about `count` of them.
function niceStep(span, count) {
  if (!(span > 0)) return 1;
  const raw = span / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * [1, 2, 2.5, 5, 10].find((m) => m * power >= raw * 0.999);
}

function ticks(lo, hi, count) {
  const step = niceStep(hi - lo, count);
  const found = [];
  for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + 1e-9 * step; k++) found.push(k * step);
  return found;
}

const raised = (power) => [...String(power)].map((d) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(d)]).join("");

function formatNumber(x, digits = 3) {
  if (!Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  let text;
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = x.toExponential(digits - 1).split("e");
    const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
    text = `${short}·10${raised(Number(exponent))}`;
  } else {
    text = x.toPrecision(digits);
    if (text.includes(".")) text = text.replace(/\.?0+$/, "");
  }
  return text.replace("-", "−");
}

// Value below which the share `q` of the sorted values lies.
const quantile = (sorted, q) => sorted[Math.round(q * (sorted.length - 1))];

const sortedFinite = (arrays) => {
  const all = [];
  for (const a of arrays) {
    const step = Math.max(1, Math.floor(a.length / 50000));
    for (let i = 0; i < a.length; i += step) if (Number.isFinite(a[i])) all.push(a[i]);
  }
  return Float64Array.from(all).sort();
};
