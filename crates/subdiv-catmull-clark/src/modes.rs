//! Least squares on a full turn of equal sectors, mode by mode.
//!
//! Around a vertex of valence `n` everything repeats after a turn by `2π/n`. The discrete Fourier
//! transform over the sectors therefore takes one problem in `6n + 1` control points apart into
//! `n` small ones, a dozen complex unknowns each, of which those of `k` and `n − k` are conjugate.

use crate::jet::jet_index;
use crate::monomials::{DEGREE, MONOMIALS, exponents};
use numerics::minimizers;
use std::f64::consts::TAU;

/// Orbits of the two-ring under the turn: edge neighbours, face neighbours, four of the outer
/// points.
const ORBITS: usize = 6;
/// The orbit of the vertex itself, which takes part in the constant mode only.
const CENTRE: usize = ORBITS;

type Complex = [f64; 2];

/// Where the `2n + 8` control points of sector `j` stand in the two-ring's order: the centre, its
/// ring from sector 0 on, then four outer points per sector.
pub(crate) fn two_ring_columns(n: usize, j: usize) -> Vec<usize> {
    let outer = |sector: usize, k: usize| 2 * n + 1 + 4 * (sector % n) + k;
    let mut columns = vec![0];
    columns.extend((0..2 * n).map(|i| 1 + (i + 2 * j) % (2 * n)));
    columns.push(outer(j + n - 1, 3));
    columns.extend((0..4).map(|k| outer(j, k)));
    columns.extend((0..2).map(|k| outer(j + 1, k)));
    columns
}

/// Orbit and sector of a point of the two-ring.
fn orbit(n: usize, place: usize) -> (usize, usize) {
    match place {
        0 => (CENTRE, 0),
        _ if place <= 2 * n => ((place - 1) % 2, (place - 1) / 2),
        _ => (2 + (place - 2 * n - 1) % 4, (place - 2 * n - 1) / 4),
    }
}

/// The inverse of [`orbit`].
fn place(n: usize, orbit: usize, sector: usize) -> usize {
    match orbit {
        CENTRE => 0,
        0 | 1 => 1 + 2 * sector + orbit,
        _ => 2 * n + 1 + 4 * sector + orbit - 2,
    }
}

/// `z^a z̄^b` with `z = ξ + iη` as a combination of the monomials in `ξ` and `η`.
fn power(a: usize, b: usize) -> [Complex; MONOMIALS] {
    let mut out = [[0.0; 2]; MONOMIALS];
    out[0] = [1.0, 0.0];
    for factor in 0..a + b {
        let sign = if factor < a { 1.0 } else { -1.0 };
        let mut next = [[0.0; 2]; MONOMIALS];
        for (&(i, j), &[re, im]) in exponents().iter().zip(&out) {
            if i + j == factor {
                let (along, across) = (jet_index(i + 1, j), jet_index(i, j + 1));
                next[along] = [next[along][0] + re, next[along][1] + im];
                next[across] = [next[across][0] - sign * im, next[across][1] + sign * re];
            }
        }
        out = next;
    }
    out
}

fn product(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// Adds `scale · b` to `a`.
fn add(a: &mut Complex, scale: f64, b: Complex) {
    a[0] += scale * b[0];
    a[1] += scale * b[1];
}

/// The polynomial and the repairs `d` that minimise the squares of `rows` over all `n` sectors, as
/// linear functions of the two-ring's `points = 6n + 1` control points:
/// `(MONOMIALS + points) × points`, row-major.
///
/// A row holds what sector 0 sees: the monomials, then the repairs and the control points of
/// [`two_ring_columns`].
pub(crate) fn rotational_minimizers(n: usize, rows: &[f64]) -> Vec<f64> {
    let points = 6 * n + 1;
    let places: Vec<(usize, usize)> =
        two_ring_columns(n, 0).into_iter().map(|c| orbit(n, c)).collect();
    let turns: Vec<Complex> = (0..n)
        .map(|j| (TAU * j as f64 / n as f64).sin_cos())
        .map(|(sin, cos)| [cos, sin])
        .collect();
    let mut out = vec![0.0; (MONOMIALS + points) * points];
    // d of an orbit's point of sector 0 by the control points of an orbit, sector by sector.
    let mut kernel = vec![0.0; (ORBITS + 1) * (ORBITS + 1) * n];
    for k in 0..=n / 2 {
        let mode = Mode::new(n, k, rows, &places, &turns);
        // The mode n − k is the conjugate one.
        let copies = if k == 0 || 2 * k == n { 1.0 } else { 2.0 };
        for from in 0..mode.orbits {
            let share = if from == CENTRE { copies } else { copies / n as f64 };
            let sectors = if from == CENTRE { 1 } else { n };
            for (p, power) in mode.powers.iter().enumerate() {
                for sector in 0..sectors {
                    let [cos, sin] = turns[k * sector % n];
                    let value = product(mode.solution(p, from), [cos, -sin]);
                    let column = place(n, from, sector);
                    for (m, coefficient) in power.iter().enumerate() {
                        out[m * points + column] += share * product(value, *coefficient)[0];
                    }
                }
            }
            for to in 0..mode.orbits {
                let value = mode.solution(mode.powers.len() + to, from);
                for sector in 0..n {
                    kernel[(to * (ORBITS + 1) + from) * n + sector] +=
                        share * product(value, turns[k * sector % n])[0];
                }
            }
        }
    }
    let repairs = &mut out[MONOMIALS * points..];
    for (row, repair) in repairs.chunks_mut(points).enumerate() {
        let (to, at) = orbit(n, row);
        for (column, value) in repair.iter_mut().enumerate() {
            let (from, sector) = orbit(n, column);
            let turn = if from == CENTRE || to == CENTRE { 0 } else { (at + n - sector) % n };
            *value = kernel[(to * (ORBITS + 1) + from) * n + turn];
        }
    }
    out
}

/// The part of the problem that a turn by one sector multiplies by `e^(2πik/n)`.
struct Mode {
    /// The powers `z^a z̄^b` that turn alike, as monomials.
    powers: Vec<[Complex; MONOMIALS]>,
    /// Orbits that take part.
    orbits: usize,
    /// Real and imaginary parts of the unknowns, alternating, by orbit of the control points.
    solved: Vec<f64>,
}

impl Mode {
    fn new(n: usize, k: usize, rows: &[f64], places: &[(usize, usize)], turns: &[Complex]) -> Self {
        let powers: Vec<[Complex; MONOMIALS]> = exponents()
            .into_iter()
            .filter(|&(a, b)| (a + n * DEGREE - b) % n == k)
            .map(|(a, b)| power(a, b))
            .collect();
        let orbits = ORBITS + usize::from(k == 0);
        let unknowns = powers.len() + orbits;
        let width = 2 * unknowns + orbits;
        let count = places.len();
        let turned: Vec<Complex> = places
            .iter()
            .map(|&(orbit, sector)| match orbit {
                CENTRE => [f64::from(u8::from(k == 0)), 0.0],
                _ => turns[k * sector % n],
            })
            .collect();
        let per_row = MONOMIALS + 2 * count;
        let mut system = Vec::with_capacity(2 * rows.len() / per_row * width);
        let mut entries = vec![[0.0; 2]; unknowns + ORBITS + 1];
        for row in rows.chunks_exact(per_row) {
            entries.fill([0.0; 2]);
            for (entry, power) in entries.iter_mut().zip(&powers) {
                for (value, coefficient) in row[..MONOMIALS].iter().zip(power) {
                    add(entry, *value, *coefficient);
                }
            }
            let (repairs, controls) = row[MONOMIALS..].split_at(count);
            for (i, (&(orbit, _), &turn)) in places.iter().zip(&turned).enumerate() {
                if orbit < orbits {
                    add(&mut entries[powers.len() + orbit], repairs[i], turn);
                    add(&mut entries[unknowns + orbit], controls[i], turn);
                }
            }
            let (left, right) = entries[..unknowns + orbits].split_at(unknowns);
            system.extend(left.iter().flat_map(|&[re, im]| [re, -im]));
            system.extend(right.iter().map(|&[re, _]| re));
            system.extend(left.iter().flat_map(|&[re, im]| [im, re]));
            system.extend(right.iter().map(|&[_, im]| im));
        }
        let solved = minimizers(&mut system, width, 2 * unknowns);
        Self { powers, orbits, solved }
    }

    /// Unknown `i` when the control points of an orbit are those of the mode.
    fn solution(&self, i: usize, from: usize) -> Complex {
        [0, 1].map(|part| self.solved[(2 * i + part) * self.orbits + from])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monomials::rotated_monomials;

    /// The same minimisers from all sectors' rows stacked into one matrix.
    fn stacked(n: usize, rows: &[f64]) -> Vec<f64> {
        let (count, points) = (2 * n + 8, 6 * n + 1);
        let unknowns = MONOMIALS + points;
        let mut all = Vec::new();
        for sector in 0..n {
            let rotation = rotated_monomials(TAU * sector as f64 / n as f64);
            for row in rows.chunks_exact(MONOMIALS + 2 * count) {
                let mut out = vec![0.0; unknowns + points];
                for (k, out) in out[..MONOMIALS].iter_mut().enumerate() {
                    *out = (0..MONOMIALS).map(|m| row[m] * rotation[k * MONOMIALS + m]).sum();
                }
                for (i, &c) in two_ring_columns(n, sector).iter().enumerate() {
                    out[MONOMIALS + c] += row[MONOMIALS + i];
                    out[unknowns + c] += row[MONOMIALS + count + i];
                }
                all.extend(out);
            }
        }
        minimizers(&mut all, unknowns + points, unknowns)
    }

    #[test]
    fn modes_solve_the_stacked_problem() {
        for n in [3, 4, 5, 6, 7, 9] {
            let width = MONOMIALS + 2 * (2 * n + 8);
            // Any rows of full rank will do.
            let entry = |i: usize| (1.7 * i as f64 + 0.013 * (i * i % 8191) as f64).sin();
            let rows: Vec<f64> = (0..(2 * n + 40) * width).map(entry).collect();
            let (modes, want) = (rotational_minimizers(n, &rows), stacked(n, &rows));
            let size = want.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (i, (a, b)) in modes.iter().zip(&want).enumerate() {
                assert!((a - b).abs() < 1e-11 * size, "valence {n}, entry {i}: {a} {b}");
            }
        }
    }
}
