//! What every target does.

mod options;

pub use options::{cage, checkpoint, constraints, creases, energy};

use exchange::{decode_model, encode_model};
use gp_solver::{Factorization, Method, Options, Problem, QuadraticBuilder};
use std::path::PathBuf;

/// Reads `bytes`; what can be read is written in the same format and must be read again.
///
/// # Panics
/// If a file of our own is refused.
pub fn round_trip(extension: &str, bytes: &[u8]) {
    let Ok(model) = decode_model(extension, bytes.to_vec()) else { return };
    // The writer of meshes in JSON is COMPAS's, that of surfaces geomdl's; both are read again.
    let path = PathBuf::from(format!("again.{extension}"));
    let Ok(again) = encode_model(&path, &model) else { return };
    if let Err(error) = decode_model(extension, again) {
        let writable = model.meshes.iter().all(|m| m.faces.iter().len() > 0);
        assert!(!writable, "our own {extension} file is refused: {error}");
    }
}

/// Takes numbers off the front of the input; zeros when it is used up.
pub(crate) struct Input<'b>(pub(crate) &'b [u8]);

impl Input<'_> {
    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    /// Mostly small numbers, sometimes any bit pattern.
    pub(crate) fn number(&mut self) -> f64 {
        match self.byte() {
            255 => f64::from_bits(u64::from_le_bytes(std::array::from_fn(|_| self.byte()))),
            254 => f64::from(self.byte()).exp2(),
            253 => (-f64::from(self.byte())).exp2(),
            small => f64::from(small as i8) / 8.0,
        }
    }
}

/// Solves quadratic equations whose coefficients are the bytes.
///
/// # Panics
/// If the result is not finite, or worse than the start.
pub fn solve(bytes: &[u8]) {
    let mut input = Input(bytes);
    let n = usize::from(input.byte() % 90);
    let factorization = match input.byte() % 3 {
        0 => Factorization::Auto,
        1 => Factorization::Band,
        _ => Factorization::Sparse,
    };
    let mut options = match input.byte() {
        0 => Options::guided_projection(input.number()),
        _ => Options::default(),
    };
    options.factorization = factorization;
    options.max_iterations = 30;
    let is_projection = matches!(options.method, Method::GuidedProjection { .. });
    let mut x: Vec<f64> = (0..n).map(|i| 0.1 * i as f64 - 1.0).collect();
    let mut problem = Problem::new(n);
    let mut rows = QuadraticBuilder::new("bytes");
    while !input.0.is_empty() && rows.len() < 200 {
        let row = rows.equation(input.number());
        row.constant(input.number());
        for _ in 0..input.byte() % 6 {
            // Numbers of unknowns that do not exist are to be refused.
            let (i, j) = (usize::from(input.byte() % 91), usize::from(input.byte() % 91));
            match input.byte() % 3 {
                0 => row.product(i, j, input.number()),
                1 => row.quadratic(i, i, input.number()),
                _ => row.linear(j, input.number()),
            };
        }
        if n > 0 && input.byte() == 7 {
            problem.variables_mut().fix_unknown(usize::from(input.byte()) % n);
        }
        if n > 0 && input.byte() == 9 {
            x[usize::from(input.byte()) % n] = input.number();
        }
    }
    problem.add(rows.build());
    if let Ok(report) = gp_solver::solve(problem, &mut x, &options) {
        assert!(x.iter().all(|v| v.is_finite()), "{x:?}");
        assert!(report.final_energy.is_finite());
        assert!(is_projection || report.final_energy <= report.initial_energy);
    }
}
