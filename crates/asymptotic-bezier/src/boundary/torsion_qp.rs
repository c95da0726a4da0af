//! The sparse quadratic programme of the vertex torsions, with simple bounds.

use gp_solver::{SolverError, SparseCholesky, SymmetricPattern};
use numerics::{Matrix, axpy, minimize_quadratic};

/// Up to this many free unknowns the system is solved densely.
const DENSE_LIMIT: usize = 64;

/// Minimises `½ τᵀ A τ + gᵀ τ` within `bounds`, where `A` has the given diagonal and, for each
/// triple `(i, j, a)`, the entry `a` at `(i, j)` and `(j, i)`.
///
/// Primal-dual active set: for these weakly coupled systems it ends after a few rounds; each
/// round fixes the unknowns that leave their bounds and frees those whose multiplier has the
/// wrong sign.
pub(crate) fn minimize(
    diagonal: &[f64],
    couplings: &[(usize, usize, f64)],
    gradient: &[f64],
    bounds: &[[f64; 2]],
) -> Vec<f64> {
    let n = diagonal.len();
    // 0 free, −1 at the lower bound, +1 at the upper, 2 fixed for good.
    let mut state: Vec<i8> = (0..n)
        .map(|v| if bounds[v][0] == bounds[v][1] || diagonal[v] == 0.0 { 2 } else { 0 })
        .collect();
    let mut tau: Vec<f64> = bounds
        .iter()
        .map(|b| if b[0] == b[1] { b[0] } else { 0.0_f64.clamp(b[0], b[1]) })
        .collect();
    for _ in 0..100 {
        for v in 0..n {
            match state[v] {
                -1 => tau[v] = bounds[v][0],
                1 => tau[v] = bounds[v][1],
                _ => {}
            }
        }
        solve_free(diagonal, couplings, gradient, &state, &mut tau);
        let mut slope: Vec<f64> = (0..n).map(|v| gradient[v] + diagonal[v] * tau[v]).collect();
        for &(i, j, a) in couplings {
            slope[i] += a * tau[j];
            slope[j] += a * tau[i];
        }
        let mut changed = false;
        for v in 0..n {
            let next = match state[v] {
                0 if tau[v] < bounds[v][0] => -1,
                0 if tau[v] > bounds[v][1] => 1,
                -1 if slope[v] < 0.0 => 0,
                1 if slope[v] > 0.0 => 0,
                same => same,
            };
            changed |= next != state[v];
            state[v] = next;
        }
        if !changed {
            break;
        }
    }
    for v in 0..n {
        if bounds[v][0] <= bounds[v][1] {
            tau[v] = tau[v].clamp(bounds[v][0], bounds[v][1]);
        }
    }
    tau
}

/// Solves for the unknowns in state 0, the others as they stand in `tau`.
fn solve_free(
    diagonal: &[f64],
    couplings: &[(usize, usize, f64)],
    gradient: &[f64],
    state: &[i8],
    tau: &mut [f64],
) {
    let free: Vec<usize> = (0..state.len()).filter(|v| state[*v] == 0).collect();
    let mut index = vec![usize::MAX; state.len()];
    for (k, v) in free.iter().enumerate() {
        index[*v] = k;
    }
    let mut right: Vec<f64> = free.iter().map(|v| gradient[*v]).collect();
    for &(i, j, a) in couplings {
        if state[i] == 0 && state[j] != 0 {
            right[index[i]] += a * tau[j];
        }
        if state[j] == 0 && state[i] != 0 {
            right[index[j]] += a * tau[i];
        }
    }
    let inner: Vec<(usize, usize, f64)> = couplings
        .iter()
        .filter(|(i, j, _)| state[*i] == 0 && state[*j] == 0)
        .map(|(i, j, a)| (index[*i], index[*j], *a))
        .collect();
    let own: Vec<f64> = free.iter().map(|v| diagonal[*v]).collect();
    let sparse = (free.len() > DENSE_LIMIT).then(|| sparse_minimum(&own, &inner, &right));
    let solution = if let Some(Ok(solution)) = sparse {
        solution
    } else {
        // Few unknowns, or a matrix singular to rounding, which the shifts in here can take.
        let mut a = Matrix::zeros(free.len(), free.len());
        for (k, d) in own.iter().enumerate() {
            a[(k, k)] = *d;
        }
        for (i, j, value) in &inner {
            a[(*i, *j)] += value;
            a[(*j, *i)] += value;
        }
        minimize_quadratic(&a, &right)
    };
    for (k, v) in free.iter().enumerate() {
        tau[*v] = solution[k];
    }
}

/// The same minimum by a sparse Cholesky factor.
fn sparse_minimum(
    diagonal: &[f64],
    couplings: &[(usize, usize, f64)],
    gradient: &[f64],
) -> Result<Vec<f64>, SolverError> {
    let n = diagonal.len();
    let entries = couplings.iter().map(|(i, j, _)| (*i, *j));
    let pattern = SymmetricPattern::new(n, entries.chain((0..n).map(|i| (i, i))))?;
    let mut values = vec![0.0; pattern.len()];
    let own = diagonal.iter().enumerate().map(|(i, d)| (i, i, *d));
    for (i, j, a) in own.chain(couplings.iter().copied()) {
        let slot = pattern.slot(i, j).expect("the pattern has every entry");
        values[slot] += a;
    }
    let mut factor = SparseCholesky::new(pattern)?;
    factor.factor(&values)?;
    let mut x: Vec<f64> = gradient.iter().map(|g| -g).collect();
    factor.solve_in_place(&mut x);
    // One step of refinement, as the dense solution has.
    let mut image = vec![0.0; n];
    factor.pattern().multiply(&values, &x, &mut image);
    let mut step: Vec<f64> = gradient.iter().zip(&image).map(|(g, y)| -g - y).collect();
    factor.solve_in_place(&mut step);
    axpy(1.0, &step, &mut x);
    Ok(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Problem = (Vec<f64>, Vec<(usize, usize, f64)>, Vec<f64>);

    fn chain(n: usize) -> Problem {
        let diagonal = (0..n).map(|i| 3.0 + (i % 5) as f64).collect();
        let couplings = (1..n).map(|i| (i - 1, i, 1.0)).collect();
        let gradient = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
        (diagonal, couplings, gradient)
    }

    #[test]
    fn sparse_and_dense_solves_agree() {
        let (d, c, g) = chain(60);
        let free = vec![[f64::NEG_INFINITY, f64::INFINITY]; 60];
        let dense = minimize(&d, &c, &g, &free);
        for (a, b) in dense.iter().zip(sparse_minimum(&d, &c, &g).unwrap()) {
            assert!((a - b).abs() < 1e-13);
        }
    }

    #[test]
    fn bounded_minimum_satisfies_its_conditions() {
        let (d, c, g) = chain(30);
        let bounds = vec![[-0.05, 0.1]; 30];
        let tau = minimize(&d, &c, &g, &bounds);
        let mut slope: Vec<f64> = (0..30).map(|v| g[v] + d[v] * tau[v]).collect();
        for (i, j, a) in c {
            slope[i] += a * tau[j];
            slope[j] += a * tau[i];
        }
        for v in 0..30 {
            match tau[v] {
                -0.05 => assert!(slope[v] >= 0.0),
                0.1 => assert!(slope[v] <= 0.0),
                _ => assert!(slope[v].abs() < 1e-13),
            }
        }
    }
}
