//! The recorded reference data sets.

#![allow(dead_code, reason = "each test file uses its share")]
#![allow(clippy::unwrap_used, reason = "recorded data; a wrong file should stop the test")]

pub(crate) mod star;

use asymptotic_bezier::{AsymptoticNet, BezierCurve, CornerData, Curvatures, NetCurve};
use geom_core::DVec3;
use serde_json::Value;

/// One recorded set.
pub(crate) struct ReferenceSet {
    pub(crate) name: String,
    pub(crate) data: CornerData,
    pub(crate) json: Value,
}

impl ReferenceSet {
    pub(crate) fn number(&self, path: &[&str]) -> f64 {
        path.iter().fold(&self.json, |v, key| &v[*key]).as_f64().unwrap()
    }
}

pub(crate) fn vector(value: &Value) -> DVec3 {
    let at = |i: usize| value[i].as_f64().unwrap();
    DVec3::new(at(0), at(1), at(2))
}

/// All sets of `fixtures/asymptotic/reference.json`.
pub(crate) fn reference_sets() -> Vec<ReferenceSet> {
    let text = include_str!("../../../../../fixtures/asymptotic/reference.json");
    let json: Value = serde_json::from_str(text).unwrap();
    json["sets"].as_array().unwrap().iter().map(read_set).collect()
}

/// The set whose name starts with `prefix`.
pub(crate) fn reference_set(prefix: &str) -> ReferenceSet {
    reference_sets().into_iter().find(|s| s.name.starts_with(prefix)).unwrap()
}

fn read_set(json: &Value) -> ReferenceSet {
    let signed =
        std::array::from_fn(|i| std::array::from_fn(|e| json["signed_k"][i][e].as_f64().unwrap()));
    ReferenceSet {
        name: json["name"].as_str().unwrap().to_owned(),
        data: CornerData {
            corners: ["00", "10", "01", "11"].map(|c| vector(&json["X"][c])),
            start_points: std::array::from_fn(|i| vector(&json["P_i1"][i])),
            end_points: std::array::from_fn(|i| vector(&json["P_i4"][i])),
            curvatures: Curvatures::Signed(signed),
            lines: [false; 4],
            inflections: [0; 4],
        },
        json: json.clone(),
    }
}

/// Point of Enneper's surface in asymptotic parameters.
pub(crate) fn enneper(p: f64, q: f64) -> DVec3 {
    let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
    DVec3::new(u - u.powi(3) / 3.0 + u * v * v, v - v.powi(3) / 3.0 + v * u * u, u * u - v * v)
}

/// Point of the catenoid in asymptotic parameters.
pub(crate) fn catenoid(p: f64, q: f64) -> DVec3 {
    let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
    DVec3::new(u.cosh() * v.cos(), u.cosh() * v.sin(), u)
}

/// Quad mesh with `n × m` faces over `[p0, p1] × [q0, q1]`, oriented by `∂p × ∂q`.
pub(crate) fn sampled_net(
    surface: impl Fn(f64, f64) -> DVec3,
    [p0, p1, q0, q1]: [f64; 4],
    [n, m]: [usize; 2],
) -> geom_core::PolyMesh {
    let mut positions = Vec::new();
    for i in 0..=n {
        for j in 0..=m {
            let (s, t) = (i as f64 / n as f64, j as f64 / m as f64);
            positions.push(surface(p0 + (p1 - p0) * s, q0 + (q1 - q0) * t));
        }
    }
    let at = |i: usize, j: usize| (i * (m + 1) + j) as u32;
    let faces: Vec<[u32; 4]> = (0..n * m)
        .map(|k| (k / m, k % m))
        .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
        .collect();
    geom_core::PolyMesh::new(positions, &faces).unwrap()
}

/// First and second derivative of a curve at `t` by stencils of nine points.
fn derivatives(f: impl Fn(f64) -> DVec3, t: f64) -> (DVec3, DVec3) {
    let h = 0.02;
    let at = |k: f64| (f(t + k * h), f(t - k * h));
    let first = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    let second = [8.0 / 5.0, -1.0 / 5.0, 8.0 / 315.0, -1.0 / 560.0];
    let (mut d1, mut d2) = (DVec3::ZERO, f(t) * (-205.0 / 72.0));
    for k in 0..4 {
        let (a, b) = at(k as f64 + 1.0);
        d1 += (a - b) * first[k];
        d2 += (a + b) * second[k];
    }
    (d1 / h, d2 / (h * h))
}

/// The net over a grid of a surface in asymptotic parameters with exact tangents and curvatures.
pub(crate) fn exact_net(
    surface: impl Fn(f64, f64) -> DVec3 + Copy,
    window: [f64; 4],
    [n, m]: [usize; 2],
) -> AsymptoticNet {
    let [p0, p1, q0, q1] = window;
    let at = |s: f64, t: f64| surface(p0 + (p1 - p0) * s, q0 + (q1 - q0) * t);
    let mesh = sampled_net(surface, window, [n, m]);
    let node = |i: usize, j: usize| (i as f64 / n as f64, j as f64 / m as f64);
    let mut curves = Vec::new();
    let mut add = |a: (usize, usize), b: (usize, usize)| {
        let u = b.0 > a.0;
        let step = if u { 1.0 / n as f64 } else { 1.0 / m as f64 };
        let mut curve = NetCurve {
            ends: [a.0 * (m + 1) + a.1, b.0 * (m + 1) + b.1],
            arms: [DVec3::ZERO; 2],
            curvatures: [0.0; 2],
            line: false,
            inflections: 0,
        };
        for (e, (i, j)) in [a, b].into_iter().enumerate() {
            let (s, t) = node(i, j);
            let (pu, _) = derivatives(|x| at(x, t), s);
            let (pv, _) = derivatives(|x| at(s, x), t);
            let normal = pu.cross(pv).normalize();
            let (first, second) =
                if u { derivatives(|x| at(x, t), s) } else { derivatives(|x| at(s, x), t) };
            let sign = if e == 0 { 1.0 } else { -1.0 };
            curve.arms[e] = first * (sign * step / 5.0);
            curve.curvatures[e] = sign * first.cross(second).dot(normal) / first.length().powi(3);
        }
        curves.push(curve);
    };
    for i in 0..=n {
        for j in 0..=m {
            if i < n {
                add((i, j), (i + 1, j));
            }
            if j < m {
                add((i, j), (i, j + 1));
            }
        }
    }
    let quads: Vec<[usize; 4]> = mesh
        .faces()
        .map(|f| {
            let corners: Vec<usize> = mesh.face_vertices(f).map(|v| v.index()).collect();
            [corners[0], corners[1], corners[2], corners[3]]
        })
        .collect();
    AsymptoticNet::new(mesh.positions().to_vec(), &quads, curves).unwrap()
}

/// Reproducible standard normal numbers.
pub(crate) struct Gauss(u64);

impl Gauss {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1)
    }

    fn uniform(&mut self) -> f64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn next(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

/// `data` with Gaussian noise: `sigma · |t|` per tangent component, relative for curvatures.
pub(crate) fn noisy(data: &CornerData, sigma: f64, seed: u64) -> CornerData {
    let mut gauss = Gauss::new(seed);
    let mut out = data.clone();
    let mut k = *data.curvatures.values();
    for i in 0..4 {
        for e in 0..2 {
            let size = sigma * data.arm(i, e).length();
            let noise = DVec3::new(gauss.next(), gauss.next(), gauss.next()) * size;
            let tip = if e == 0 { &mut out.start_points[i] } else { &mut out.end_points[i] };
            *tip += noise;
            k[i][e] *= 1.0 + sigma * gauss.next();
        }
    }
    out.curvatures = Curvatures::Signed(k);
    out
}

/// Corner data of a window of a surface in asymptotic parameters, exact to rounding.
pub(crate) fn corner_data(
    surface: impl Fn(f64, f64) -> DVec3 + Copy,
    [p0, p1, q0, q1]: [f64; 4],
) -> CornerData {
    let at = |s: f64, t: f64| surface(p0 + (p1 - p0) * s, q0 + (q1 - q0) * t);
    // Parameters of both ends of r1..r4 and which parameter runs.
    let ends = [
        ([(0., 0.), (1., 0.)], true),
        ([(0., 0.), (0., 1.)], false),
        ([(0., 1.), (1., 1.)], true),
        ([(1., 0.), (1., 1.)], false),
    ];
    let mut data = CornerData {
        corners: [at(0., 0.), at(1., 0.), at(0., 1.), at(1., 1.)],
        start_points: [DVec3::ZERO; 4],
        end_points: [DVec3::ZERO; 4],
        curvatures: Curvatures::Signed([[0.0; 2]; 4]),
        lines: [false; 4],
        inflections: [0; 4],
    };
    let mut k = [[0.0; 2]; 4];
    for (i, (pair, along_u)) in ends.into_iter().enumerate() {
        for (e, (s, t)) in pair.into_iter().enumerate() {
            let along_s = || derivatives(|x| at(x, t), s);
            let along_t = || derivatives(|x| at(s, x), t);
            let ((first, second), (other, _)) =
                if along_u { (along_s(), along_t()) } else { (along_t(), along_s()) };
            let arm = first * if e == 0 { 0.2 } else { -0.2 };
            if e == 0 {
                data.start_points[i] = at(s, t) + arm;
            } else {
                data.end_points[i] = at(s, t) + arm;
            }
            // Into the patch: along the other parameter at its start, against it at its end.
            let inward = other * if (if along_u { t } else { s }) == 0.0 { 1.0 } else { -1.0 };
            let across = second - first * (second.dot(first) / first.length_squared());
            let size = first.cross(second).length() / first.length().powi(3);
            k[i][e] = size * across.dot(inward).signum();
        }
    }
    data.curvatures = Curvatures::Signed(k);
    data
}

/// Data near `z = x y` whose side `r1` is a quintic `(t, y, z)` with `y″ = w`, `z″ = t w`,
/// `w = (t − 0.3)(t − 0.7)`: two inflections. With the torsions at its ends and the roots of `w`.
pub(crate) fn wave() -> (CornerData, [f64; 2], [f64; 2]) {
    // Twice integrated, from the constant term up.
    let y = [0.0, 0.0, 0.21 / 2.0, -1.0 / 6.0, 1.0 / 12.0, 0.0];
    let z = [0.0, 0.0, 0.0, 0.21 / 6.0, -1.0 / 12.0, 1.0 / 20.0];
    let choose =
        |n: f64, k: usize| (0..k).map(|i| (n - i as f64) / (i + 1) as f64).product::<f64>();
    let bezier = |a: [f64; 6], j: usize| -> f64 {
        (0..=j).map(|i| choose(j as f64, i) / choose(5.0, i) * a[i]).sum()
    };
    let points: Vec<DVec3> =
        (0..6).map(|j| DVec3::new(j as f64 / 5.0, bezier(y, j), bezier(z, j))).collect();
    let curve = BezierCurve::new(points.clone());
    let jets = [curve.jet(0.0), curve.jet(1.0)];
    // The other sides are straight, `r4` in the tangent plane at the end of `r1`.
    let across = DVec3::new(0.0, 1.0, 1.0);
    let corners = [points[0], points[5], DVec3::Y, points[5] + across];
    let along = |i: usize, t: f64| {
        let [a, b]: [usize; 2] = [[0, 1], [0, 2], [2, 3], [1, 3]][i];
        corners[a].lerp(corners[b], t)
    };
    let mut data = CornerData {
        corners,
        start_points: std::array::from_fn(|i| along(i, 0.2)),
        end_points: std::array::from_fn(|i| along(i, 0.8)),
        curvatures: Curvatures::Signed([jets.map(|j| j.curvature()), [0.0; 2], [0.0; 2], [0.0; 2]]),
        lines: [false, true, true, true],
        inflections: [2, 0, 0, 0],
    };
    data.start_points[0] = points[1];
    data.end_points[0] = points[4];
    (data, jets.map(|j| j.torsion()), [0.3, 0.7])
}
