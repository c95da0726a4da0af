//! The 35 least-squares problems of Moré, Garbow and Hillstrom 1981, at their sizes.

use super::nist;
use super::{Dense, Dual};
use numerics::{Number, Real};

/// A problem and its known minima (sums of squares), local ones included.
pub struct Mgh {
    pub number: usize,
    pub problem: Dense,
    pub minima: Vec<f64>,
    /// Watson's start is 0; MINPACK then takes the factor itself.
    pub zero_start: bool,
}

impl Mgh {
    /// Whether a sum of squares is one of the known minima, to 1e-8 (relative if positive).
    pub fn is_known_minimum(&self, sum: f64) -> bool {
        self.minima.iter().any(|&w| (sum - w).abs() <= if w > 0.0 { 1e-8 * w } else { 1e-8 })
    }

    /// The start `factor · x₀` by MINPACK's rule.
    pub fn start(&self, factor: f64) -> Vec<f64> {
        if self.zero_start && factor != 1.0 {
            vec![factor; self.problem.start.len()]
        } else {
            self.problem.start.iter().map(|x| factor * x).collect()
        }
    }
}

const BARD: [f64; 15] =
    [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39];
const GAUSSIAN: [f64; 8] = [0.0009, 0.0044, 0.0175, 0.0540, 0.1295, 0.2420, 0.3521, 0.3989];
const KOWALIK_U: [f64; 11] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625];
const KOWALIK_Y: [f64; 11] =
    [0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246];
const MEYER: [f64; 16] = [
    34780.0, 28610.0, 23650.0, 19630.0, 16370.0, 13720.0, 11540.0, 9744.0, 8261.0, 7030.0, 6005.0,
    5147.0, 4427.0, 3820.0, 3307.0, 2872.0,
];
const OSBORNE_2: [f64; 65] = [
    1.366, 1.191, 1.112, 1.013, 0.991, 0.885, 0.831, 0.847, 0.786, 0.725, 0.746, 0.679, 0.608,
    0.655, 0.616, 0.606, 0.602, 0.626, 0.651, 0.724, 0.649, 0.649, 0.694, 0.644, 0.624, 0.661,
    0.612, 0.558, 0.533, 0.495, 0.500, 0.423, 0.395, 0.375, 0.372, 0.391, 0.396, 0.405, 0.428,
    0.429, 0.523, 0.562, 0.607, 0.653, 0.672, 0.708, 0.633, 0.668, 0.645, 0.632, 0.591, 0.559,
    0.597, 0.625, 0.739, 0.710, 0.729, 0.720, 0.636, 0.581, 0.428, 0.292, 0.162, 0.098, 0.054,
];

/// A run of MINPACK's published test program for `lmder1` from a far start.
pub struct Published {
    pub name: &'static str,
    pub factor: f64,
    /// Whether its exit parameter says success (1 to 4; 5 is its limit of evaluations).
    pub succeeds: bool,
    /// Final Euclidean norm of the residuals, 8 digits.
    pub norm: f64,
}

/// The far starts of MINPACK's test program (Moré, Garbow and Hillstrom 1980) with nonlinear
/// residuals, as its summary lists them.
pub const PUBLISHED: [Published; 25] = {
    const fn run(name: &'static str, factor: f64, norm: f64) -> Published {
        Published { name, factor, succeeds: true, norm }
    }
    const fn failed(name: &'static str, factor: f64, norm: f64) -> Published {
        Published { name, factor, succeeds: false, norm }
    }
    [
        run("Rosenbrock", 10.0, 0.0),
        run("Rosenbrock", 100.0, 0.0),
        run("Helical valley", 10.0, 0.0),
        run("Helical valley", 100.0, 0.0),
        run("Powell singular", 10.0, 0.0),
        run("Powell singular", 100.0, 0.0),
        run("Freudenstein and Roth", 10.0, 6.9988752),
        run("Freudenstein and Roth", 100.0, 6.9988752),
        run("Bard", 10.0, 4.1747687),
        run("Bard", 100.0, 4.1747687),
        run("Kowalik and Osborne", 10.0, 3.2052193e-2),
        failed("Kowalik and Osborne", 100.0, 1.7535838e-2),
        failed("Meyer", 10.0, 795.09584),
        run("Watson 6", 10.0, 4.7829594e-2),
        run("Watson 6", 100.0, 4.7829594e-2),
        run("Watson 9", 10.0, 1.1831146e-3),
        run("Watson 9", 100.0, 1.1831146e-3),
        run("Watson 12", 10.0, 2.1731040e-5),
        run("Watson 12", 100.0, 2.1731040e-5),
        run("Brown and Dennis", 10.0, 292.95427),
        run("Brown and Dennis", 100.0, 292.95431),
        run("Chebyquad 1 of 8 rows", 10.0, 1.8842482),
        run("Chebyquad 1 of 8 rows", 100.0, 1.8842482),
        run("Brown almost linear 10", 10.0, 0.0),
        run("Brown almost linear 10", 100.0, 0.0),
    ]
};

/// All problems in the paper's order; those of variable size may occur at several sizes.
pub fn all() -> Vec<Mgh> {
    let mut list = Vec::new();
    let mut add = |number: usize, minima: &[f64], problem: Dense| {
        let zero_start = problem.start.iter().all(|&x| x == 0.0);
        list.push(Mgh { number, problem, minima: minima.to_vec(), zero_start });
    };
    let f = |i: usize| i as f64;

    add(
        1,
        &[0.0],
        Dense::new("Rosenbrock", vec![-1.2, 1.0], |x| {
            vec![10.0 * (x[1] - x[0].powi(2)), 1.0 - x[0]]
        }),
    );
    add(
        2,
        &[0.0, 48.984_253_679_240_01],
        Dense::new("Freudenstein and Roth", vec![0.5, -2.0], |x| {
            vec![
                -13.0 + x[0] + ((5.0 - x[1]) * x[1] - 2.0) * x[1],
                -29.0 + x[0] + ((x[1] + 1.0) * x[1] - 14.0) * x[1],
            ]
        }),
    );
    add(
        3,
        &[0.0],
        Dense::new("Powell badly scaled", vec![0.0, 1.0], |x| {
            vec![1e4 * x[0] * x[1] - 1.0, (-x[0]).exp() + (-x[1]).exp() - 1.0001]
        }),
    );
    add(
        4,
        &[0.0],
        Dense::new("Brown badly scaled", vec![1.0, 1.0], |x| {
            vec![x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2.0]
        }),
    );
    add(
        5,
        &[0.0],
        Dense::new("Beale", vec![1.0, 1.0], |x| {
            let y = [1.5, 2.25, 2.625];
            (0..3).map(|i| y[i] - x[0] * (1.0 - x[1].powi(i as i32 + 1))).collect()
        }),
    );
    add(
        6,
        &[124.362_182_355_614_9],
        Dense::new("Jennrich and Sampson", vec![0.3, 0.4], move |x| {
            (1..=10)
                .map(|i| 2.0 + 2.0 * f(i) - ((f(i) * x[0]).exp() + (f(i) * x[1]).exp()))
                .collect()
        }),
    );
    add(
        7,
        &[0.0],
        Dense::new("Helical valley", vec![-1.0, 0.0, 0.0], |x| {
            let turn = (x[1] / x[0]).atan() / std::f64::consts::TAU;
            let angle = if x[0].value > 0.0 { turn } else { turn + 0.5 };
            vec![
                10.0 * (x[2] - 10.0 * angle),
                10.0 * ((x[0].powi(2) + x[1].powi(2)).sqrt() - 1.0),
                x[2],
            ]
        }),
    );
    add(
        8,
        &[0.008_214_877_306_578_96, 17.428_693_333_333_3],
        Dense::new("Bard", vec![1.0; 3], move |x| {
            (1..=15)
                .map(|i| {
                    let (u, v) = (f(i), f(16 - i));
                    BARD[i - 1] - (x[0] + u / (v * x[1] + u.min(v) * x[2]))
                })
                .collect()
        }),
    );
    add(
        9,
        &[1.127_932_769_618_787e-8],
        Dense::new("Gaussian", vec![0.4, 1.0, 0.0], move |x| {
            (1..=15)
                .map(|i| {
                    let t = (8.0 - f(i)) / 2.0;
                    let y = GAUSSIAN[(i - 1).min(15 - i)];
                    x[0] * (-x[1] * (t - x[2]).powi(2) / 2.0).exp() - y
                })
                .collect()
        }),
    );
    add(
        10,
        &[87.945_855_170_674],
        Dense::new("Meyer", vec![0.02, 4000.0, 250.0], move |x| {
            (1..=16)
                .map(|i| x[0] * (x[1] / (45.0 + 5.0 * f(i) + x[2])).exp() - MEYER[i - 1])
                .collect()
        }),
    );
    add(
        11,
        &[0.0],
        Dense::new("Gulf research", vec![5.0, 2.5, 0.15], move |x| {
            (1..=10)
                .map(|i| {
                    let t = f(i) / 100.0;
                    let y = 25.0 + (-50.0 * t.ln()).powf(2.0 / 3.0);
                    (-(y - x[1]).abs().powf(x[2]) / x[0]).exp() - t
                })
                .collect()
        }),
    );
    add(
        12,
        &[0.0],
        Dense::new("Box three-dimensional", vec![0.0, 10.0, 20.0], move |x| {
            (1..=10)
                .map(|i| {
                    let t = 0.1 * f(i);
                    (-t * x[0]).exp() - (-t * x[1]).exp() - x[2] * ((-t).exp() - (-10.0 * t).exp())
                })
                .collect()
        }),
    );
    add(13, &[0.0], Dense::new("Powell singular", vec![3.0, -1.0, 0.0, 1.0], powell_singular));
    add(
        14,
        &[0.0],
        Dense::new("Wood", vec![-3.0, -1.0, -3.0, -1.0], |x| {
            vec![
                10.0 * (x[1] - x[0].powi(2)),
                1.0 - x[0],
                90_f64.sqrt() * (x[3] - x[2].powi(2)),
                1.0 - x[2],
                10_f64.sqrt() * (x[1] + x[3] - 2.0),
                (x[1] - x[3]) / 10_f64.sqrt(),
            ]
        }),
    );
    add(
        15,
        &[3.075_056_038_492_37e-4, 1.027_343_071_10e-3],
        Dense::new("Kowalik and Osborne", vec![0.25, 0.39, 0.415, 0.39], move |x| {
            (0..11)
                .map(|i| {
                    let u = KOWALIK_U[i];
                    KOWALIK_Y[i] - x[0] * (u * u + u * x[1]) / (u * u + u * x[2] + x[3])
                })
                .collect()
        }),
    );
    add(
        16,
        &[85_822.201_626_356_3],
        Dense::new("Brown and Dennis", vec![25.0, 5.0, -5.0, -1.0], move |x| {
            (1..=20)
                .map(|i| {
                    let t = f(i) / 5.0;
                    (x[0] + t * x[1] - t.exp()).powi(2) + (x[2] + x[3] * t.sin() - t.cos()).powi(2)
                })
                .collect()
        }),
    );
    // Osborne's first problem has the data of NIST's MGH17.
    let osborne_1 = nist::read("MGH17").data;
    add(
        17,
        &[5.464_894_697_482_8e-5],
        Dense::new("Osborne 1", vec![0.5, 1.5, -1.0, 0.01, 0.02], move |x| {
            let model = |t: f64| x[0] + x[1] * (-t * x[3]).exp() + x[2] * (-t * x[4]).exp();
            osborne_1.iter().map(|row| row[0] - model(row[1])).collect()
        }),
    );
    add(
        18,
        &[0.0, 5.655_649_925_499e-3],
        Dense::new("Biggs EXP6", vec![1.0, 2.0, 1.0, 1.0, 1.0, 1.0], move |x| {
            (1..=13)
                .map(|i| {
                    let t = 0.1 * f(i);
                    let y = (-t).exp() - 5.0 * (-10.0 * t).exp() + 3.0 * (-4.0 * t).exp();
                    x[2] * (-t * x[0]).exp() - x[3] * (-t * x[1]).exp() + x[5] * (-t * x[4]).exp()
                        - y
                })
                .collect()
        }),
    );
    add(
        19,
        &[4.013_773_629_354_8e-2],
        Dense::new(
            "Osborne 2",
            vec![1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5],
            move |x| {
                (0..65)
                    .map(|i| {
                        let t = f(i) / 10.0;
                        let bell = |k: usize| x[k] * (-(t - x[k + 7]).powi(2) * x[k + 4]).exp();
                        OSBORNE_2[i] - (x[0] * (-t * x[4]).exp() + bell(1) + bell(2) + bell(3))
                    })
                    .collect()
            },
        ),
    );
    for (n, minimum) in
        [(6, 2.287_670_053_552_4e-3), (9, 1.399_760_138_094e-6), (12, 4.722_381_104e-10)]
    {
        add(20, &[minimum], Dense::new(format!("Watson {n}"), vec![0.0; n], watson));
    }
    add(
        21,
        &[0.0],
        Dense::new("Extended Rosenbrock 10", repeat(&[-1.2, 1.0], 5), |x| {
            x.chunks(2).flat_map(|p| [10.0 * (p[1] - p[0].powi(2)), 1.0 - p[0]]).collect()
        }),
    );
    add(
        22,
        &[0.0],
        Dense::new("Extended Powell singular 12", repeat(&[3.0, -1.0, 0.0, 1.0], 3), |x| {
            x.chunks(4).flat_map(powell_singular).collect()
        }),
    );
    for (n, minimum) in [(4, 2.249_977_500_9e-5), (10, 7.087_651_467e-5)] {
        let start = (1..=n).map(f).collect();
        add(
            23,
            &[minimum],
            Dense::new(format!("Penalty I {n}"), start, |x| {
                let mut r: Vec<Dual> = x.iter().map(|&x| 1e-5_f64.sqrt() * (x - 1.0)).collect();
                r.push(x.iter().map(|x| x.powi(2)).sum::<Dual>() - 0.25);
                r
            }),
        );
    }
    for (n, minimum) in [(4, 9.376_293_007e-6), (10, 2.936_605_374e-4)] {
        add(
            24,
            &[minimum],
            Dense::new(format!("Penalty II {n}"), vec![0.5; n], move |x| {
                let a = 1e-5_f64.sqrt();
                let mut r = vec![x[0] - 0.2];
                for i in 1..n {
                    let y = (f(i + 1) / 10.0).exp() + (f(i) / 10.0).exp();
                    r.push(a * ((x[i] / 10.0).exp() + (x[i - 1] / 10.0).exp() - y));
                }
                for i in 1..n {
                    r.push(a * ((x[i] / 10.0).exp() - (-0.1_f64).exp()));
                }
                r.push((0..n).map(|j| f(n - j) * x[j].powi(2)).sum::<Dual>() - 1.0);
                r
            }),
        );
    }
    let start = (1..=10).map(|j| 1.0 - f(j) / 10.0).collect();
    add(
        25,
        &[0.0],
        Dense::new("Variably dimensioned 10", start, move |x| {
            let mut r: Vec<Dual> = x.iter().map(|&x| x - 1.0).collect();
            let sum: Dual = x.iter().enumerate().map(|(j, &x)| f(j + 1) * (x - 1.0)).sum();
            r.extend([sum, sum.powi(2)]);
            r
        }),
    );
    add(
        26,
        &[0.0, 2.795_056_121_878e-5],
        Dense::new("Trigonometric 10", vec![0.1; 10], move |x| {
            let sum: Dual = x.iter().map(|x| x.cos()).sum();
            x.iter()
                .enumerate()
                .map(|(i, x)| 10.0 - sum + f(i + 1) * (1.0 - x.cos()) - x.sin())
                .collect()
        }),
    );
    for n in [10, 30, 40] {
        let name = format!("Brown almost linear {n}");
        add(
            27,
            &[0.0, 1.0],
            Dense::new(name, vec![0.5; n], move |x| {
                let sum: Dual = x.iter().copied().sum();
                let product = x.iter().fold(Dual::from(1.0), |p, &x| p * x);
                let mut r: Vec<Dual> = x[..n - 1].iter().map(|&x| x + sum - f(n + 1)).collect();
                r.push(product - 1.0);
                r
            }),
        );
    }
    let grid = |n: usize| move |i: usize| f(i + 1) / f(n + 1);
    let start: Vec<f64> = (0..10).map(grid(10)).map(|t| t * (t - 1.0)).collect();
    add(
        28,
        &[0.0],
        Dense::new("Discrete boundary value 10", start.clone(), move |x| {
            let h = 1.0 / 11.0;
            let at = |i: usize| if (1..=10).contains(&i) { x[i - 1] } else { Dual::from(0.0) };
            (1..=10)
                .map(|i| {
                    2.0 * at(i) - at(i - 1) - at(i + 1)
                        + h * h * (at(i) + (f(i) * h + 1.0)).powi(3) / 2.0
                })
                .collect()
        }),
    );
    add(
        29,
        &[0.0],
        Dense::new("Discrete integral 10", start, move |x| {
            let h = 1.0 / 11.0;
            let t = |i: usize| f(i + 1) * h;
            let cube = |j: usize| (x[j] + t(j) + 1.0).powi(3);
            (0..10)
                .map(|i| {
                    let left: Dual = (0..=i).map(|j| t(j) * cube(j)).sum();
                    let right: Dual = (i + 1..10).map(|j| (1.0 - t(j)) * cube(j)).sum();
                    x[i] + h * ((1.0 - t(i)) * left + t(i) * right) / 2.0
                })
                .collect()
        }),
    );
    add(
        30,
        &[0.0],
        Dense::new("Broyden tridiagonal 10", vec![-1.0; 10], |x| {
            (0..10)
                .map(|i| {
                    let left = if i > 0 { x[i - 1] } else { Dual::from(0.0) };
                    let right = if i < 9 { x[i + 1] } else { Dual::from(0.0) };
                    (3.0 - 2.0 * x[i]) * x[i] - left - 2.0 * right + 1.0
                })
                .collect()
        }),
    );
    add(
        31,
        &[0.0],
        Dense::new("Broyden banded 10", vec![-1.0; 10], |x| {
            (0..10_usize)
                .map(|i| {
                    let near = (i.saturating_sub(5)..(i + 2).min(10)).filter(|&j| j != i);
                    let sum: Dual = near.map(|j| x[j] * (1.0 + x[j])).sum();
                    x[i] * (2.0 + 5.0 * x[i].powi(2)) + 1.0 - sum
                })
                .collect()
        }),
    );
    for m in [10, 50] {
        add(
            32,
            &[f(m) - 5.0],
            Dense::new(format!("Linear full rank {m}"), vec![1.0; 5], move |x| {
                let sum: Dual = x.iter().copied().sum();
                let common = -2.0 / f(m) * sum - 1.0;
                (0..m).map(|i| if i < 5 { x[i] + common } else { common }).collect()
            }),
        );
        let weighted =
            |x: &[Dual]| -> Dual { x.iter().enumerate().map(|(j, &x)| (j as f64 + 1.0) * x).sum() };
        let minimum = f(m) * (f(m) - 1.0) / (2.0 * (2.0 * f(m) + 1.0));
        add(
            33,
            &[minimum],
            Dense::new(format!("Linear rank 1 {m}"), vec![1.0; 5], move |x| {
                (0..m).map(|i| f(i + 1) * weighted(x) - 1.0).collect()
            }),
        );
        let minimum = (f(m) * f(m) + 3.0 * f(m) - 6.0) / (2.0 * (2.0 * f(m) - 3.0));
        add(
            34,
            &[minimum],
            Dense::new(format!("Linear rank 1 with zeros {m}"), vec![1.0; 5], move |x| {
                let inner: Dual = (1..4).map(|j| f(j + 1) * x[j]).sum();
                (0..m)
                    .map(
                        |i| {
                            if i == 0 || i == m - 1 { Dual::from(-1.0) } else { f(i) * inner - 1.0 }
                        },
                    )
                    .collect()
            }),
        );
    }
    for (n, minima) in [
        (7, &[0.0][..]),
        (8, &[3.516_873_725_68e-3]),
        (9, &[0.0]),
        (10, &[6.503_954_8e-3, 4.772_713_6e-3]),
    ] {
        let start = (1..=n).map(|j| f(j) / f(n + 1)).collect();
        add(35, minima, Dense::new(format!("Chebyquad {n}"), start, move |x| chebyquad(x, n)));
    }
    // MINPACK's test programs have one of 8 rows for one unknown, whose start is stationary.
    add(
        35,
        &[3.557_893_675_988_914, 3.550_391_297_675_73],
        Dense::new("Chebyquad 1 of 8 rows", vec![0.5], |x| chebyquad(x, 8)),
    );
    list
}

fn repeat(x: &[f64], times: usize) -> Vec<f64> {
    x.iter().copied().cycle().take(x.len() * times).collect()
}

fn powell_singular(x: &[Dual]) -> Vec<Dual> {
    vec![
        x[0] + 10.0 * x[1],
        5_f64.sqrt() * (x[2] - x[3]),
        (x[1] - 2.0 * x[2]).powi(2),
        10_f64.sqrt() * (x[0] - x[3]).powi(2),
    ]
}

fn chebyquad(x: &[Dual], m: usize) -> Vec<Dual> {
    let n = x.len() as f64;
    let mut r = vec![Dual::from(0.0); m];
    for &x in x {
        let y = 2.0 * x - 1.0;
        let (mut before, mut here) = (Dual::from(1.0), y);
        for r in &mut r {
            *r += here / n;
            (before, here) = (here, 2.0 * y * here - before);
        }
    }
    for i in (2..=m).step_by(2) {
        r[i - 1] = r[i - 1] + 1.0 / ((i * i) as f64 - 1.0);
    }
    r
}

fn watson(x: &[Dual]) -> Vec<Dual> {
    let mut r: Vec<Dual> = (1..=29)
        .map(|i| {
            let t = f64::from(i) / 29.0;
            let value: Dual = x.iter().rev().fold(Dual::from(0.0), |s, &x| s * t + x);
            let slope: Dual = (1..x.len()).map(|j| j as f64 * x[j] * t.powi(j as i32 - 1)).sum();
            slope - value.powi(2) - 1.0
        })
        .collect();
    r.extend([x[0], x[1] - x[0].powi(2) - 1.0]);
    r
}
