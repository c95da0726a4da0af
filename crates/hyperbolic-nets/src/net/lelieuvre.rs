//! Lelieuvre normals: vertex vectors whose cross products are the edges of an asymptotic net.

use super::differences::second_differences;
use super::quad_net::{Family, QuadNet};
use crate::Error;
use geom_core::DVec3;
use gp_solver::{SolverError, solve_rows};

/// First guess of the normals, and the sign of every edge.
#[derive(Clone, Debug, PartialEq)]
pub struct LelieuvreStart {
    /// A normal for every vertex; its length has the unit of the root of a length.
    pub normals: Vec<DVec3>,
    /// `s_e` in `x_j − x_i = s_e ν_i × ν_j`: +1 for one family, −1 for the other.
    pub signs: Vec<f64>,
    /// Edges that twist against the sign of their family.
    pub wrong_twists: usize,
}

impl LelieuvreStart {
    /// `ν_i = ρ_i n_i` with unit vertex normals `n` and `log ρ_i + log ρ_j = log(|x_ij| / |n_i × n_j|)`
    /// on every edge in the least-squares sense.
    ///
    /// # Errors
    /// [`Error::NoTangentPlane`] names a vertex, [`Error::Linear`] the solver's reason.
    pub fn new(net: &QuadNet) -> Result<Self, Error> {
        let positions = net.positions();
        let unit = net.vertex_normals(positions);
        if let Some(vertex) = unit.iter().position(|n| *n == DVec3::ZERO) {
            return Err(Error::NoTangentPlane { vertex });
        }
        let (signs, wrong_twists) = signs(net, positions, &unit);
        let what = "the lengths of normals";
        let log_lengths =
            log_lengths(net, positions, &unit).map_err(|source| Error::Linear { what, source })?;
        let normals = unit.iter().zip(log_lengths).map(|(n, l)| *n * l.exp()).collect();
        Ok(Self { normals, signs, wrong_twists })
    }
}

/// Signs by the majority of `x_ij · (n_i × n_j)` in every component, and the number of edges that
/// disagree.
pub(crate) fn signs(net: &QuadNet, positions: &[DVec3], normals: &[DVec3]) -> (Vec<f64>, usize) {
    let family = |f: Family| if f == Family::First { 1.0 } else { -1.0 };
    let twists: Vec<f64> = net
        .edges()
        .iter()
        .map(|e| {
            let [i, j] = e.ends;
            family(e.family) * (positions[j] - positions[i]).dot(normals[i].cross(normals[j]))
        })
        .collect();
    let mut votes = vec![0.0; net.components().iter().max().map_or(0, |c| c + 1)];
    for (e, &t) in net.edges().iter().zip(&twists) {
        votes[net.components()[e.ends[0]]] += t;
    }
    let mut wrong = 0;
    let signs = net.edges().iter().zip(&twists).map(|(e, &t)| {
        let sign = if votes[net.components()[e.ends[0]]] < 0.0 { -1.0 } else { 1.0 };
        wrong += usize::from(sign * t <= 0.0);
        sign * family(e.family)
    });
    let signs = signs.collect();
    (signs, wrong)
}

fn log_lengths(
    net: &QuadNet,
    positions: &[DVec3],
    unit: &[DVec3],
) -> Result<Vec<f64>, SolverError> {
    let n = positions.len();
    let sines: Vec<f64> =
        net.edges().iter().map(|e| unit[e.ends[0]].cross(unit[e.ends[1]]).length()).collect();
    let mut sorted = sines.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2].max(f64::MIN_POSITIVE);
    // Along nearly flat edges the quotient means little, so their rows weigh little.
    let mut rows: Vec<(Vec<(usize, f64)>, f64)> = Vec::with_capacity(3 * n);
    for (e, &sine) in net.edges().iter().zip(&sines) {
        let [i, j] = e.ends;
        let weight = (sine / median).clamp(0.05, 1.0);
        let length = positions[i].distance(positions[j]);
        let log = (length / sine.max(1e-9)).ln();
        rows.push((vec![(i, weight), (j, weight)], weight * log));
    }
    for mut row in second_differences(net) {
        row.iter_mut().for_each(|(_, value)| *value *= 0.1);
        rows.push((row, 0.0));
    }
    solve_rows(n, &rows, 1e-8)
}

/// `W = |ν₁ + ν₃| / |ν₀ + ν₂|` of every face: with single-valued normals these make all patches
/// join smoothly, since `ν₀ + ν₂` and `ν₁ + ν₃` are parallel (the discrete Moutard equation,
/// Bobenko and Suris 2008, §2.4) and so is the shape ratio of any two neighbours.
#[must_use]
pub fn shape_parameters(net: &QuadNet, normals: &[DVec3]) -> Vec<f64> {
    net.quads()
        .iter()
        .map(|q| {
            let [a, b, c, d] = q.map(|v| normals[v as usize]);
            (b + d).length() / (a + c).length()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::edge_equations;
    use crate::options::Options;
    use crate::vectors::unknowns;
    use fixtures::asymptotic_nets;
    use geom_core::PolyMesh;
    use gp_solver::ResidualBlock;

    #[test]
    fn random_moutard_net_satisfies_the_constraints_and_joins_smoothly() {
        let model = asymptotic_nets::moutard(6, 5, 3);
        let mesh = PolyMesh::new(model.positions.clone(), &model.quads).unwrap();
        let net = QuadNet::new(&mesh).unwrap();
        let (signs, wrong) = signs(&net, net.positions(), &model.normals);
        assert_eq!(wrong, 0);
        let (variables, positions, normals) = unknowns(&net, &Options::default());
        let normals = normals.unwrap();
        let block = edge_equations(&net, &signs, positions, normals, mesh.mean_edge_length());
        let mut x = vec![0.0; variables.len()];
        for v in 0..net.positions().len() {
            positions.set(&mut x, v, net.positions()[v].to_array());
            normals.set(&mut x, v, model.normals[v].to_array());
        }
        let mut residuals = vec![0.0; block.len()];
        block.residuals(&x, &mut residuals);
        assert!(residuals.iter().all(|r| r.abs() < 1e-12));
        let shape = shape_parameters(&net, &model.normals);
        for (w, a) in shape.iter().zip(&model.coefficients) {
            assert!((w.ln().abs() - a.ln().abs()).abs() < 1e-12, "W is a or 1/a of its face");
        }
        for e in net.inner_edges() {
            let [f, g] = e.faces;
            let join = net.join(e, net.positions());
            let (left, right) = (shape[f].powf(e.exponents[0]), shape[g].powf(e.exponents[1]));
            assert!(join.kink(left, right, 11) < 1e-12);
            assert!((join.shape_ratio() * left / right - 1.0).abs() < 1e-10);
        }
    }
}
