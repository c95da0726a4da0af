//! The energies a second time, in dual numbers and by the textbook: Christoffel symbols, principal
//! directions from an angle, harmonics by sampling a circle. Nothing here is shared with the
//! kernels but the basis weights, so agreement of derivatives checks every adjoint.

use crate::density::GUARD;
use crate::element::Mixture;
use crate::evaluator::{SurfaceEnergy, Workspace, flatten};
use crate::freedom::Freedom;
use crate::functional::{Energy, Functional, ROOT_EPSILON};
use crate::metric::MetricAssembly;
use crate::rules::{Quadrature, gauss_legendre, quartered};
use crate::symmetry::SymmetryGroup;
use fixtures::quad_graphs;
use geom_core::{DVec3, PolyMesh};
use num_dual::{Dual64, DualNum};
use std::collections::HashMap;
use subdiv_catmull_clark::{
    BasisId, Blend, Creases, GuideSector, JetWeights, SubdivisionSurface, limit_masks, refine,
};

type Vector = [Dual64; 3];

fn dot(a: Vector, b: Vector) -> Dual64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn scaled(a: Vector, s: Dual64) -> Vector {
    a.map(|x| x * s)
}

/// Curvatures of one sample.
struct Sample {
    /// Area element.
    area: Dual64,
    k: [Dual64; 2],
    /// Second form in the frame whose first direction is that of `S_u`.
    second: [Dual64; 3],
    /// `F1c, F1s, F3c, F3s` of the normal curvature's derivative in that frame.
    harmonics: [Dual64; 4],
    /// Mean squares over all directions: of `κ'` itself and of its derivative across.
    inline: Dual64,
    across: Dual64,
    /// `(dk1/de1)² + (dk2/de2)²`, and the same with `(dk1/de2)² + (dk2/de1)²` added.
    mvs: Dual64,
    mvs_cross: Dual64,
}

impl Sample {
    fn new(weights: &JetWeights, controls: &[u32], x: &[Dual64]) -> Self {
        let derivative = |d: usize| -> Vector {
            std::array::from_fn(|c| {
                let row = weights.row(d).iter().zip(controls);
                row.map(|(&w, &v)| x[3 * v as usize + c] * w).sum()
            })
        };
        let s = [derivative(1), derivative(2)];
        let ss = [[derivative(3), derivative(4)], [derivative(4), derivative(5)]];
        let sss = |i: usize, j: usize, k: usize| derivative(6 + i + j + k);
        let g = |i: usize, j: usize| dot(s[i], s[j]);
        let normal = cross(s[0], s[1]);
        let area = dot(normal, normal).sqrt();
        let n = scaled(normal, area.recip());
        let determinant = g(0, 0) * g(1, 1) - g(0, 1) * g(0, 1);
        let inverse = [
            [g(1, 1) / determinant, -g(0, 1) / determinant],
            [-g(0, 1) / determinant, g(0, 0) / determinant],
        ];
        let h = |i: usize, j: usize| dot(ss[i][j], n);
        let christoffel = |l: usize, i: usize, j: usize| -> Dual64 {
            (0..2).map(|m| inverse[l][m] * dot(ss[i][j], s[m])).sum()
        };
        // ∇_k h_ij = ∂_k h_ij − Γ^l_ki h_lj − Γ^l_kj h_il, with Weingarten's n_k = −h_kl g^lm S_m.
        let mut c = [[[Dual64::from(0.0); 2]; 2]; 2];
        for i in 0..2 {
            for j in 0..2 {
                for k in 0..2 {
                    let mut value = dot(sss(i, j, k), n);
                    for l in 0..2 {
                        for m in 0..2 {
                            value -= h(k, l) * inverse[l][m] * dot(ss[i][j], s[m]);
                        }
                        value -= christoffel(l, k, i) * h(l, j) + christoffel(l, k, j) * h(i, l);
                    }
                    c[i][j][k] = value;
                }
            }
        }
        let e1 = scaled(s[0], g(0, 0).sqrt().recip());
        let e2 = cross(n, e1);
        let coordinates = |w: Vector| -> [Dual64; 2] {
            std::array::from_fn(|i| (0..2).map(|m| inverse[i][m] * dot(w, s[m])).sum())
        };
        let frame = [coordinates(e1), coordinates(e2)];
        let direction = |angle: Dual64| -> [Dual64; 2] {
            let (sin, cos) = (angle.sin(), angle.cos());
            std::array::from_fn(|i| frame[0][i] * cos + frame[1][i] * sin)
        };
        let quadratic = |a: &[Dual64; 2], b: &[Dual64; 2]| -> Dual64 {
            let mut sum = Dual64::from(0.0);
            for i in 0..2 {
                for j in 0..2 {
                    sum += h(i, j) * a[i] * b[j];
                }
            }
            sum
        };
        let cubic = |a: &[Dual64; 2], b: &[Dual64; 2], d: &[Dual64; 2]| -> Dual64 {
            let mut sum = Dual64::from(0.0);
            for i in 0..2 {
                for j in 0..2 {
                    for k in 0..2 {
                        sum += c[i][j][k] * a[i] * b[j] * d[k];
                    }
                }
            }
            sum
        };
        let second = [
            quadratic(&frame[0], &frame[0]),
            quadratic(&frame[0], &frame[1]),
            quadratic(&frame[1], &frame[1]),
        ];
        // Twelve directions sum up trigonometric polynomials of degree six exactly.
        let mut harmonics = [Dual64::from(0.0); 4];
        let (mut inline, mut across) = (Dual64::from(0.0), Dual64::from(0.0));
        let quarter = std::f64::consts::FRAC_PI_2;
        for step in 0..12 {
            let angle = std::f64::consts::TAU * f64::from(step) / 12.0;
            let (w, turned) = (direction(angle.into()), direction((angle + quarter).into()));
            let value = cubic(&w, &w, &w);
            for (k, factor) in [angle.cos(), angle.sin(), (3.0 * angle).cos(), (3.0 * angle).sin()]
                .into_iter()
                .enumerate()
            {
                harmonics[k] += value * (factor / 6.0);
            }
            inline += value * value / 12.0;
            across += cubic(&w, &w, &turned).powi(2) / 12.0;
        }
        let [l, m, q] = second;
        let r2 = ((l - q) * 0.5).powi(2) + m * m;
        let angle = (m * 2.0).atan2(l - q) * 0.5;
        let (d1, d2) = (direction(angle), direction(angle + quarter));
        // The umbilic guard as documented: the part that depends on the principal directions fades
        // to the mean over all of them.
        let guard = r2 / (r2 + (l * l + m * m * 2.0 + q * q) * GUARD);
        let isotropic = |f1: f64, f3: f64| {
            (harmonics[0].powi(2) + harmonics[1].powi(2)) * f1
                + (harmonics[2].powi(2) + harmonics[3].powi(2)) * f3
        };
        let faded = |exact: Dual64, mean: Dual64| mean + (exact - mean) * guard;
        let along = cubic(&d1, &d1, &d1).powi(2) + cubic(&d2, &d2, &d2).powi(2);
        let all = along + cubic(&d1, &d1, &d2).powi(2) + cubic(&d2, &d2, &d1).powi(2);
        let root = r2.sqrt();
        Self {
            area,
            k: [(l + q) * 0.5 + root, (l + q) * 0.5 - root],
            second,
            harmonics,
            inline,
            across,
            mvs: faded(along, isotropic(1.0, 1.0)),
            mvs_cross: faded(all, isotropic(10.0 / 9.0, 2.0)),
        }
    }

    fn density(&self, functional: Functional, epsilon: f64) -> Dual64 {
        let [k1, k2] = self.k;
        let first = self.harmonics[0].powi(2) + self.harmonics[1].powi(2);
        let third = self.harmonics[2].powi(2) + self.harmonics[3].powi(2);
        match functional {
            Functional::Area => 1.0.into(),
            Functional::MeanCurvature => (k1 + k2) * 0.5,
            Functional::Gaussian => k1 * k2,
            Functional::Bending => k1 * k1 + k2 * k2,
            Functional::Willmore => ((k1 + k2) * 0.5).powi(2),
            Functional::UmbilicDeviation => (k1 - k2).powi(2),
            Functional::Mvs => self.mvs,
            Functional::MvsCross => self.mvs_cross,
            Functional::F1 => first * 0.5,
            Functional::F3 => third * 0.5,
            Functional::MehlumTarrou { w1, w3 } if (w1, w3) == (1.0, 1.0) => self.inline,
            Functional::MehlumTarrou { w1, w3 } => first * (0.5 * w1) + third * (0.5 * w3),
            Functional::CrossCurvature => self.across,
            Functional::AverageDerivative => (self.inline + self.across) * 0.5,
            Functional::Sqrt => (self.inline * 2.0 + epsilon * epsilon).sqrt(),
        }
    }
}

struct Case {
    mesh: PolyMesh,
    surface: SubdivisionSurface,
    creases: bool,
}

fn refined(mesh: &PolyMesh, creases: &Creases, levels: usize) -> (PolyMesh, Creases) {
    (0..levels).fold((mesh.clone(), creases.clone()), |(mesh, creases), _| {
        let fine = refine(&mesh, &creases).unwrap();
        (fine.mesh, fine.creases)
    })
}

/// Unknowns of a case, their values, the control points they stand for, and the energies.
struct Unknowns {
    freedom: Freedom,
    y: Vec<f64>,
    x: Vec<f64>,
    evaluator: SurfaceEnergy,
}

impl Case {
    fn new(mesh: &PolyMesh, creases: &Creases, levels: usize, blend: Blend) -> Self {
        let (mesh, left) = refined(mesh, creases, levels);
        let surface = SubdivisionSurface::new(&mesh, &left, blend).unwrap();
        Self { mesh, surface, creases: *creases != Creases::none() }
    }

    /// Regular patches; valences 3 and 6 with both blends; a boundary; a semi-sharp crease.
    fn all() -> Vec<Self> {
        let none = Creases::none();
        let sphere = quad_graphs::ellipsoid(5, DVec3::new(1.0, 1.3, 1.7));
        // Around the first face that is far enough from the vertices of valence 3.
        let creased = sphere.faces().find_map(|f| {
            let mut creases = Creases::none();
            for h in sphere.face_half_edges(f) {
                creases.set(sphere.origin(h), sphere.target(h), 1.5);
            }
            let surface = SubdivisionSurface::new(&sphere, &creases, Blend::Smooth);
            surface.is_ok().then_some(creases)
        });
        let creased = creased.unwrap();
        vec![
            Self::new(&quad_graphs::torus(8, 6, 1.0, 0.4), &none, 0, Blend::Smooth),
            Self::new(&sphere, &none, 0, Blend::Smooth),
            Self::new(&sphere, &none, 0, Blend::Flat),
            Self::new(&quad_graphs::theta_graph(3), &none, 1, Blend::Smooth),
            Self::new(&quad_graphs::lamp_shade(6), &none, 0, Blend::Smooth),
            Self::new(&sphere, &creased, 0, Blend::Smooth),
        ]
    }

    fn group(&self, symmetric: bool) -> SymmetryGroup {
        if symmetric {
            SymmetryGroup::detect(&self.mesh, &mut || false)
        } else {
            SymmetryGroup::trivial(&self.mesh)
        }
    }

    /// What the energies of the case depend on, with the mesh's symmetries or without.
    fn unknowns(&self, symmetric: bool, fixed: &[bool], quadrature: Quadrature) -> Unknowns {
        let group = self.group(symmetric);
        let n = self.mesh.vertex_count();
        let freedom = Freedom::new(self.mesh.positions(), fixed, &group);
        let y = freedom.restrict(&flatten(self.mesh.positions()));
        let mut x = vec![0.0; 3 * n];
        freedom.expand(&y, &mut x);
        let multiplicities = group.face_multiplicities();
        let evaluator =
            SurfaceEnergy::with_multiplicities(&self.surface, n, quadrature, &multiplicities);
        Unknowns { freedom, y, x, evaluator }
    }

    /// All samples of the patches with their quadrature weights; every patch counts as often as
    /// `multiplicities` says.
    fn samples(
        &self,
        x: &[Dual64],
        multiplicities: &[u32],
        regular: usize,
        other: usize,
    ) -> Vec<(f64, Sample)> {
        let mut x = x.to_vec();
        for sector in self.surface.sectors() {
            for k in 0..GuideSector::COEFFICIENTS {
                for c in 0..3 {
                    let vertices = sector.vertices.iter().zip(sector.weights(k));
                    x.push(vertices.map(|(&v, &w)| x[3 * v as usize + c] * w).sum());
                }
            }
        }
        let mut tables: HashMap<BasisId, Vec<(f64, JetWeights)>> = HashMap::new();
        let mut samples = Vec::new();
        for (patch, &count) in self.surface.patches().iter().zip(multiplicities) {
            if count == 0 {
                continue;
            }
            let table = tables.entry(patch.basis).or_insert_with(|| {
                let quadrature = Quadrature { regular, extraordinary: other };
                let nodes = quadrature.nodes(&self.surface, patch.basis);
                let plain = self.surface.is_smooth(patch.basis);
                let rule = if plain { gauss_legendre(nodes) } else { quartered(nodes) };
                let product = |&(u, a): &(f64, f64)| {
                    let at =
                        |&(v, b): &(f64, f64)| (a * b, self.surface.weights(patch.basis, u, v));
                    rule.iter().map(at).collect::<Vec<_>>()
                };
                rule.iter().flat_map(product).collect()
            });
            for (weight, jet) in table.iter() {
                samples.push((f64::from(count) * weight, Sample::new(jet, &patch.controls, &x)));
            }
        }
        samples
    }
}

/// Value and slope of an energy, the area under the root held fixed.
fn total(samples: &[(f64, Sample)], energy: &Energy) -> Dual64 {
    let integral = |f: &dyn Fn(&Sample) -> Dual64| -> Dual64 {
        samples.iter().map(|(w, s)| f(s) * s.area * *w).sum()
    };
    let area = integral(&|_| 1.0.into());
    let epsilon = ROOT_EPSILON / area.re;
    let term = |&(weight, functional): &(f64, Functional)| {
        let value = integral(&|s| s.density(functional, epsilon));
        let scaled = functional.density().1;
        if scaled { area * value * weight } else { value * weight }
    };
    energy.terms.iter().map(term).sum()
}

/// A reproducible direction.
fn direction(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|k| (seed + 2.1 * k as f64 + 0.3 * ((k * k) as f64).sqrt()).sin()).collect()
}

fn along(x: &[f64], d: &[f64]) -> Vec<Dual64> {
    x.iter().zip(d).map(|(&x, &d)| Dual64::new(x, d)).collect()
}

fn energies() -> Vec<Energy> {
    let mut all: Vec<Energy> = Functional::ALL.map(Energy::from_functional).to_vec();
    for text in ["mehlum_tarrou(1,0.3)", "0.92*bending + 0.08*mehlum_tarrou", "area + mvs + 2*sqrt"]
    {
        all.push(text.parse().unwrap());
    }
    all
}

#[test]
fn gradients_match_dual_numbers() {
    for (number, case) in Case::all().iter().enumerate() {
        for symmetric in [false, true] {
            if symmetric && case.creases {
                continue;
            }
            let n = case.mesh.vertex_count();
            let quadrature = Quadrature { regular: 4, extraordinary: 6 };
            let Unknowns { freedom, y, x, evaluator } =
                case.unknowns(symmetric, &vec![false; n], quadrature);
            let mut work = Workspace::default();
            let area = evaluator.area(&x, &mut work);
            for seed in [0.4, 1.9] {
                let dy = direction(y.len(), seed);
                let moved: Vec<f64> = y.iter().zip(&dy).map(|(y, d)| y + d).collect();
                let mut dx = vec![0.0; 3 * n];
                freedom.expand(&moved, &mut dx);
                dx.iter_mut().zip(&x).for_each(|(d, x)| *d -= x);
                let all = vec![1; case.mesh.face_count()];
                let samples = case.samples(&along(&x, &dx), &all, 4, 6);
                for energy in energies() {
                    let want = total(&samples, &energy);
                    let (mut full, mut gradient) = (vec![0.0; 3 * n], vec![0.0; y.len()]);
                    let value = evaluator.gradient(&energy, &x, Some(area), &mut work, &mut full);
                    freedom.pull_back(&full, &mut gradient);
                    let slope: f64 = gradient.iter().zip(&dy).map(|(g, d)| g * d).sum();
                    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                    // A direction may be nearly level; its slope is then compared with what a step
                    // of this length can do at all.
                    let scale = want.eps.abs().max(0.01 * norm(&gradient) * norm(&dy));
                    let name = format!("case {number}, {symmetric}, {energy}");
                    let size = want.re.abs().max(1e-3 * area);
                    assert!((value - want.re).abs() <= 1e-9 * size, "{name}: {value} {want:?}");
                    // The integral of K does not change on a closed surface but for the quadrature.
                    let floor = if energy.to_string() == "gaussian" { 1e-8 } else { 0.0 };
                    assert!(
                        (slope - want.eps).abs() <= 1e-8 * scale + floor,
                        "{name}: {slope} {want:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn gauss_newton_products_match_dual_numbers() {
    for (number, case) in Case::all().iter().enumerate() {
        for symmetric in [false, true] {
            if symmetric && case.creases {
                continue;
            }
            let n = case.mesh.vertex_count();
            let mut fixed = vec![false; n];
            // A fixed vertex shows up in the structure of the matrix.
            fixed[0] = !symmetric;
            let Unknowns { freedom, y, x, evaluator } =
                case.unknowns(symmetric, &fixed, Quadrature::COARSE);
            let metric =
                MetricAssembly::new(&case.surface, &evaluator, &freedom, &[], None).unwrap();
            let area = evaluator.area(&x, &mut Workspace::default());
            let moved = |seed: f64| {
                let dy = direction(y.len(), seed);
                let to: Vec<f64> = y.iter().zip(&dy).map(|(y, d)| y + d).collect();
                let mut dx = vec![0.0; 3 * n];
                freedom.expand(&to, &mut dx);
                dx.iter_mut().zip(&x).for_each(|(d, x)| *d -= x);
                // Residuals depend on the direction of `S_u`, so the same faces have to be taken.
                let counts = case.group(symmetric).face_multiplicities();
                (dy, case.samples(&along(&x, &dx), &counts, 4, 8))
            };
            let ((p, at_p), (q, at_q)) = (moved(0.7), moved(2.3));
            for text in ["mehlum_tarrou(1,0.3)", "bending", "willmore", "mvs_cross", "sqrt"] {
                let energy: Energy = text.parse().unwrap();
                let mut coefficients = energy.coefficients();
                coefficients.plain.root_epsilon = ROOT_EPSILON / area;
                let density = coefficients.plain.plus(area, &coefficients.scaled);
                let mixture = Mixture { density, gauss_newton: true, sobolev: 0.0 };
                let values = metric
                    .assemble(&evaluator, &freedom, &x, area, &mixture, &mut || false)
                    .unwrap();
                let image = metric.multiply(&values, &q);
                let got: f64 = p.iter().zip(&image).map(|(p, i)| p * i).sum();
                // 2 Σ c w (∂_p √J f)(∂_q √J f), with the coefficients of the residuals frozen.
                let product = |a: &[(f64, Sample)], b: &[(f64, Sample)]| -> f64 {
                    a.iter()
                        .zip(b)
                        .map(|((w, a), (_, b))| w * residual_product(a, b, text, area))
                        .sum()
                };
                let want = product(&at_p, &at_q);
                let scale = (product(&at_p, &at_p) * product(&at_q, &at_q)).sqrt();
                assert!(
                    (got - want).abs() <= 1e-8 * scale,
                    "case {number}, {symmetric}, {text}: {got} {want} of {scale}"
                );
            }
        }
    }
}

fn residual_product(a: &Sample, b: &Sample, energy: &str, area: f64) -> f64 {
    let pair = |value: &dyn Fn(&Sample) -> Dual64| {
        2.0 * (value(a) * a.area.sqrt()).eps * (value(b) * b.area.sqrt()).eps
    };
    let harmonics = |first: f64, third: f64| -> f64 {
        (0..4).map(|k| if k < 2 { first } else { third } * pair(&|s| s.harmonics[k])).sum()
    };
    match energy {
        "mehlum_tarrou(1,0.3)" => harmonics(0.5 * area, 0.15 * area),
        "mvs_cross" => harmonics(10.0 / 9.0 * area, 2.0 * area),
        "sqrt" => {
            let epsilon = ROOT_EPSILON / area;
            let slope = 0.5 / (2.0 * a.inline.re + epsilon * epsilon).sqrt();
            harmonics(slope, slope)
        }
        "willmore" => pair(&|s| (s.k[0] + s.k[1]) * 0.5),
        "bending" => pair(&|s| s.second[0]) + pair(&|s| s.second[2]) + 2.0 * pair(&|s| s.second[1]),
        other => panic!("no residuals for {other}"),
    }
}

#[test]
fn weights_of_an_extraordinary_patch_meet_the_limit_masks() {
    // The basis weights are the one thing shared with the kernels; they have their own check.
    let case = Case::new(&quad_graphs::theta_graph(3), &Creases::none(), 1, Blend::None);
    let patch = case
        .surface
        .patches()
        .iter()
        .find(|p| case.mesh.valence(case.mesh.origin(p.corner)) == 6)
        .unwrap();
    let weights = case.surface.weights(patch.basis, 0.0, 0.0);
    for (got, want) in weights.row(0).iter().zip(&limit_masks(6).position) {
        assert!((got - want).abs() < 1e-9);
    }
}
