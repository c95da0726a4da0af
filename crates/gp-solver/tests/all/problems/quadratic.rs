//! Those of the Moré-Garbow-Hillstrom problems whose residuals are quadratic as they stand, as
//! coefficients of quadratic equations.

use gp_solver::{Equation, QuadraticBuilder, QuadraticConstraints};

/// The problem with this name of [`mgh::all`](super::mgh::all), or nothing if one of its residuals
/// is not quadratic.
pub fn by_name(name: &str) -> Option<QuadraticConstraints> {
    let (family, size) = match name.rsplit_once(' ') {
        Some((family, number)) => match number.parse::<usize>() {
            Ok(size) => (family, size),
            Err(_) => (name, 0),
        },
        None => (name, 0),
    };
    let mut rows = QuadraticBuilder::new(name);
    match family {
        "Rosenbrock" => rosenbrock(&mut rows, 2),
        "Extended Rosenbrock" => rosenbrock(&mut rows, size),
        "Brown badly scaled" => {
            rows.equation(1.0).linear(0, 1.0).constant(-1e6);
            rows.equation(1.0).linear(1, 1.0).constant(-2e-6);
            rows.equation(1.0).product(0, 1, 1.0).constant(-2.0);
        }
        "Powell singular" => powell_singular(&mut rows, 4),
        "Extended Powell singular" => powell_singular(&mut rows, size),
        "Wood" => wood(&mut rows),
        "Brown and Dennis" => brown_and_dennis(&mut rows),
        "Watson" => watson(&mut rows, size),
        "Penalty I" => {
            for i in 0..size {
                rows.equation(1e-5_f64.sqrt()).linear(i, 1.0).constant(-1.0);
            }
            let row = rows.equation(1.0).constant(-0.25);
            for i in 0..size {
                row.product(i, i, 1.0);
            }
        }
        "Variably dimensioned" => {
            for i in 0..size {
                rows.equation(1.0).linear(i, 1.0).constant(-1.0);
            }
            let sum: Vec<(usize, f64)> = (0..size).map(|j| (j, j as f64 + 1.0)).collect();
            let at_one = sum.iter().map(|(_, a)| a).sum::<f64>();
            linear(rows.equation(1.0), &sum, -at_one);
            square(rows.equation(1.0), 1.0, &sum, -at_one);
        }
        "Broyden tridiagonal" => broyden_tridiagonal(&mut rows, size),
        "Linear full rank" => {
            for i in 0..size {
                let row = rows.equation(1.0).constant(-1.0);
                for j in 0..5 {
                    row.linear(j, -2.0 / size as f64);
                }
                if i < 5 {
                    row.linear(i, 1.0);
                }
            }
        }
        "Linear rank 1" => {
            for i in 1..=size {
                let row = rows.equation(1.0).constant(-1.0);
                for j in 0..5 {
                    row.linear(j, (i * (j + 1)) as f64);
                }
            }
        }
        "Linear rank 1 with zeros" => {
            for i in 0..size {
                let row = rows.equation(1.0).constant(-1.0);
                for j in 1..4 {
                    if i > 0 && i + 1 < size {
                        row.linear(j, (i * (j + 1)) as f64);
                    }
                }
            }
        }
        _ => return None,
    }
    Some(rows.build())
}

/// Rosenbrock's valley `n / 2` times.
pub fn rosenbrock(rows: &mut QuadraticBuilder, n: usize) {
    for i in (0..n).step_by(2) {
        rows.equation(10.0).linear(i + 1, 1.0).product(i, i, -1.0);
        rows.equation(1.0).linear(i, -1.0).constant(1.0);
    }
}

/// Powell's singular function `n / 4` times.
pub fn powell_singular(rows: &mut QuadraticBuilder, n: usize) {
    for i in (0..n).step_by(4) {
        rows.equation(1.0).linear(i, 1.0).linear(i + 1, 10.0);
        rows.equation(5_f64.sqrt()).linear(i + 2, 1.0).linear(i + 3, -1.0);
        square(rows.equation(1.0), 1.0, &[(i + 1, 1.0), (i + 2, -2.0)], 0.0);
        square(rows.equation(10_f64.sqrt()), 1.0, &[(i, 1.0), (i + 3, -1.0)], 0.0);
    }
}

/// Broyden's tridiagonal function of `n` unknowns.
pub fn broyden_tridiagonal(rows: &mut QuadraticBuilder, n: usize) {
    for i in 0..n {
        let row = rows.equation(1.0).linear(i, 3.0).product(i, i, -2.0).constant(1.0);
        if i > 0 {
            row.linear(i - 1, -1.0);
        }
        if i + 1 < n {
            row.linear(i + 1, -2.0);
        }
    }
}

fn wood(rows: &mut QuadraticBuilder) {
    rosenbrock(rows, 2);
    rows.equation(90_f64.sqrt()).linear(3, 1.0).product(2, 2, -1.0);
    rows.equation(1.0).linear(2, -1.0).constant(1.0);
    rows.equation(10_f64.sqrt()).linear(1, 1.0).linear(3, 1.0).constant(-2.0);
    rows.equation(0.1_f64.sqrt()).linear(1, 1.0).linear(3, -1.0);
}

fn brown_and_dennis(rows: &mut QuadraticBuilder) {
    for i in 1..=20 {
        let t = f64::from(i) / 5.0;
        let row = rows.equation(1.0);
        square(row, 1.0, &[(0, 1.0), (1, t)], -t.exp());
        square(row, 1.0, &[(2, 1.0), (3, t.sin())], -t.cos());
    }
}

fn watson(rows: &mut QuadraticBuilder, n: usize) {
    for i in 1..=29 {
        let t = f64::from(i) / 29.0;
        let value: Vec<(usize, f64)> = (0..n).map(|j| (j, t.powi(j as i32))).collect();
        let row = rows.equation(1.0).constant(-1.0);
        for j in 1..n {
            row.linear(j, j as f64 * t.powi(j as i32 - 1));
        }
        square(row, -1.0, &value, 0.0);
    }
    rows.equation(1.0).linear(0, 1.0);
    rows.equation(1.0).linear(1, 1.0).product(0, 0, -1.0).constant(-1.0);
}

/// Adds `Σ a x + c`.
fn linear(row: &mut Equation, terms: &[(usize, f64)], c: f64) {
    for &(i, a) in terms {
        row.linear(i, a);
    }
    row.constant(c);
}

/// Adds `factor · (Σ a x + c)²`.
fn square(row: &mut Equation, factor: f64, terms: &[(usize, f64)], c: f64) {
    for &(i, a) in terms {
        for &(j, b) in terms {
            row.product(i, j, factor * a * b);
        }
        row.linear(i, 2.0 * factor * c * a);
    }
    row.constant(factor * c * c);
}
