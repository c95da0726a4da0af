//! NIST StRD nonlinear regression (the files in `fixtures/nist`).

use super::{Dense, Dual};
use numerics::Number;
use std::path::PathBuf;

/// Difficulty as NIST grades it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Lower,
    Average,
    Higher,
}

/// One data set.
pub struct Nist {
    pub name: &'static str,
    pub level: Level,
    pub starts: [Vec<f64>; 2],
    pub certified: Vec<f64>,
    pub sum_of_squares: f64,
    /// Response and predictors of every observation.
    pub data: Vec<Vec<f64>>,
}

type Model = fn(&[Dual], &[f64]) -> Dual;

/// Names and models; the model gives the response for parameters and predictors.
pub const MODELS: [(&str, Model); 27] = [
    ("Misra1a", |b, x| b[0] * (1.0 - (-b[1] * x[0]).exp())),
    ("Chwirut2", |b, x| (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])),
    ("Chwirut1", |b, x| (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])),
    ("Lanczos3", lanczos),
    ("Gauss1", gauss),
    ("Gauss2", gauss),
    ("DanWood", |b, x| b[0] * Dual::from(x[0]).powf(b[1])),
    ("Misra1b", |b, x| b[0] * (1.0 - (1.0 + b[1] * x[0] / 2.0).powi(-2))),
    ("Kirby2", |b, x| polynomial(&b[..3], x[0]) / (1.0 + polynomial(&b[3..], x[0]) * x[0])),
    ("Hahn1", |b, x| polynomial(&b[..4], x[0]) / (1.0 + polynomial(&b[4..], x[0]) * x[0])),
    ("Nelson", |b, x| b[0] - b[1] * x[0] * (-b[2] * x[1]).exp()),
    ("MGH17", |b, x| b[0] + b[1] * (-b[3] * x[0]).exp() + b[2] * (-b[4] * x[0]).exp()),
    ("Lanczos1", lanczos),
    ("Lanczos2", lanczos),
    ("Gauss3", gauss),
    ("Misra1c", |b, x| b[0] * (1.0 - (1.0 + 2.0 * b[1] * x[0]).powf(Dual::from(-0.5)))),
    ("Misra1d", |b, x| b[0] * b[1] * x[0] / (1.0 + b[1] * x[0])),
    ("Roszman1", |b, x| b[0] - b[1] * x[0] - (b[2] / (x[0] - b[3])).atan() / std::f64::consts::PI),
    ("ENSO", |b, x| {
        let wave = |period: Dual, cos: Dual, sin: Dual| {
            let angle = std::f64::consts::TAU * x[0] / period;
            cos * angle.cos() + sin * angle.sin()
        };
        b[0] + wave(Dual::from(12.0), b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8])
    }),
    ("MGH09", |b, x| b[0] * (x[0] * x[0] + x[0] * b[1]) / (x[0] * x[0] + x[0] * b[2] + b[3])),
    ("Thurber", |b, x| polynomial(&b[..4], x[0]) / (1.0 + polynomial(&b[4..], x[0]) * x[0])),
    ("BoxBOD", |b, x| b[0] * (1.0 - (-b[1] * x[0]).exp())),
    ("Rat42", |b, x| b[0] / (1.0 + (b[1] - b[2] * x[0]).exp())),
    ("MGH10", |b, x| b[0] * (b[1] / (x[0] + b[2])).exp()),
    ("Eckerle4", |b, x| b[0] / b[1] * (-0.5 * ((x[0] - b[2]) / b[1]).powi(2)).exp()),
    ("Rat43", |b, x| b[0] / (1.0 + (b[1] - b[2] * x[0]).exp()).powf(1.0 / b[3])),
    ("Bennett5", |b, x| b[0] * (b[1] + x[0]).powf(-1.0 / b[2])),
];

fn polynomial(b: &[Dual], x: f64) -> Dual {
    b.iter().rev().fold(Dual::from(0.0), |sum, &c| sum * x + c)
}

fn lanczos(b: &[Dual], x: &[f64]) -> Dual {
    (0..3).map(|k| b[2 * k] * (-b[2 * k + 1] * x[0]).exp()).sum()
}

fn gauss(b: &[Dual], x: &[f64]) -> Dual {
    let bell = |k: usize| b[k] * (-((x[0] - b[k + 1]) / b[k + 2]).powi(2)).exp();
    b[0] * (-b[1] * x[0]).exp() + bell(2) + bell(5)
}

/// Reads a data set.
pub fn read(name: &'static str) -> Nist {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures/nist")
        .join(format!("{name}.dat"));
    let text = std::fs::read_to_string(&path).expect("the NIST files are in fixtures/nist");
    let numbers = |line: &str| -> Vec<f64> {
        line.split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let level = if text.contains("Lower Level") {
        Level::Lower
    } else if text.contains("Average Level") {
        Level::Average
    } else {
        Level::Higher
    };
    let mut starts = [Vec::new(), Vec::new()];
    let mut certified = Vec::new();
    let mut sum_of_squares = f64::NAN;
    let mut data = Vec::new();
    let mut in_data = false;
    for line in text.lines() {
        let word = line.split_whitespace().next().unwrap_or("");
        if in_data {
            let row = numbers(line);
            if !row.is_empty() {
                data.push(row);
            }
        } else if word.starts_with('b')
            && word[1..].parse::<u32>().is_ok()
            && line.contains('=')
            && numbers(line).len() == 4
        {
            let row = numbers(line);
            starts[0].push(row[0]);
            starts[1].push(row[1]);
            certified.push(row[2]);
        } else if line.starts_with("Residual Sum of Squares") {
            sum_of_squares = numbers(line)[0];
        } else if word == "Data:" && line.contains('y') && line.contains('x') && !line.contains('(')
        {
            in_data = true;
        }
    }
    assert!(!data.is_empty() && !certified.is_empty(), "{name} was read");
    Nist { name, level, starts, certified, sum_of_squares, data }
}

impl Nist {
    /// The regression as a dense problem from start 0 or 1.
    pub fn problem(&self, start: usize) -> Dense {
        let model = MODELS.iter().find(|(name, _)| *name == self.name).expect("a known name").1;
        let data = self.data.clone();
        let logarithmic = self.name == "Nelson";
        Dense::new(self.name, self.starts[start].clone(), move |b| {
            let response = |y: f64| if logarithmic { y.ln() } else { y };
            data.iter().map(|row| model(b, &row[1..]) - response(row[0])).collect()
        })
    }
}

/// Log relative error: the number of right digits, at most 11 (those that are certified).
pub fn log_relative_error(got: f64, certified: f64) -> f64 {
    let error = (got - certified).abs() / certified.abs();
    if error == 0.0 { 11.0 } else { (-error.log10()).clamp(0.0, 11.0) }
}

/// The least log relative error over the parameters.
pub fn digits(x: &[f64], certified: &[f64]) -> f64 {
    x.iter().zip(certified).map(|(&a, &b)| log_relative_error(a, b)).fold(11.0, f64::min)
}
