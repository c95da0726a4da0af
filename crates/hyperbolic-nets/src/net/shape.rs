//! Shape parameters of the patches over a given asymptotic net (Shi et al. 2014, §3.2, step 2).

use super::quad_net::QuadNet;
use crate::Error;
use geom_core::DVec3;
use gp_solver::{choices, solve_rows};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// How shape parameters spread over the net.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Spread {
    /// From face to face, breadth first, starting with `W = 1`, as published. On a net that is
    /// not exact all errors end up where the search meets itself, and where vertices cannot be
    /// coloured alternately the start value is wrong.
    BreadthFirst,
    /// Least squares of the logarithms of all ratios.
    #[default]
    LeastSquares,
}

choices!(Spread { BreadthFirst = "breadth_first", LeastSquares = "least_squares" });

/// Shape parameters and how well they fit.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeFit {
    /// `W` of the diagonal 0–2 of every face.
    pub shape: Vec<f64>,
    /// Largest error of `log(W_r / W_l)` at an edge; 0 to rounding iff the net extends smoothly.
    pub closure: f64,
    /// Whether one factor was free in every component, and chosen best.
    pub factor_is_free: bool,
    /// Edges whose faces twist in opposite senses (no positive parameters join them smoothly).
    pub opposite_twists: usize,
}

/// Shape parameters with the ratios of Eq. 7 at all inner edges, and the best free factor.
///
/// # Errors
/// [`Error::Linear`] if the least-squares system cannot be solved.
pub fn fit_shape_parameters(
    net: &QuadNet,
    positions: &[DVec3],
    spread: Spread,
) -> Result<ShapeFit, Error> {
    let links = Links::new(net, positions);
    let faces = net.quads().len();
    let tree = links.tree(faces);
    let mut log = match spread {
        Spread::BreadthFirst => links.breadth_first(&tree, faces),
        Spread::LeastSquares => links.least_squares(&tree, faces)?,
    };
    let mut factor_is_free = true;
    for component in &tree.components {
        factor_is_free &= component.consistent;
        if component.consistent {
            let of = |f: &usize| (log[*f], tree.sign[*f]);
            let pairs: Vec<(f64, f64)> = component.faces.iter().map(of).collect();
            let shift = best_log_factor(&pairs);
            for &f in &component.faces {
                log[f] += tree.sign[f] * shift;
            }
        }
    }
    let closure = links.all.iter().map(|l| l.error(&log).abs()).fold(0.0, f64::max);
    let opposite_twists = links.opposite;
    let shape = log.iter().map(|y| y.exp()).collect();
    Ok(ShapeFit { shape, closure, factor_is_free, opposite_twists })
}

/// The `t` that minimises `Σ (W − 1)² + (1/W − 1)²` over `log W_i = y_i + c_i t`, `c_i = ±1`
/// (ibid., Eq. 11).
///
/// With `s = y + c t` every term is `2 cosh 2s − 4 cosh s + 2`, strictly convex, so the quartic of
/// the paper has exactly one positive root and Newton's method finds it.
#[must_use]
pub fn best_log_factor(pairs: &[(f64, f64)]) -> f64 {
    let mut t = -pairs.iter().map(|(y, c)| c * y).sum::<f64>() / pairs.len().max(1) as f64;
    for _ in 0..100 {
        let (mut first, mut second) = (0.0, 0.0);
        for &(y, c) in pairs {
            let s = c * y + t;
            first += 4.0 * ((2.0 * s).sinh() - s.sinh());
            second += 8.0 * (2.0 * s).cosh() - 4.0 * s.cosh();
        }
        // Far from the minimum the function grows exponentially; Newton's steps are then short.
        let step = (first / second).clamp(-1.0, 1.0);
        t -= step;
        if step.abs() < 1e-15 {
            break;
        }
    }
    t
}

/// `e_g y_g − e_f y_f = log ratio` at an inner edge.
struct Link {
    faces: [usize; 2],
    exponents: [f64; 2],
    log_ratio: f64,
}

impl Link {
    fn error(&self, log: &[f64]) -> f64 {
        let ([f, g], [a, b]) = (self.faces, self.exponents);
        b * log[g] - a * log[f] - self.log_ratio
    }
}

struct Links {
    all: Vec<Link>,
    opposite: usize,
}

struct Component {
    faces: Vec<usize>,
    /// Whether signs agree along all loops, so that a factor is free.
    consistent: bool,
}

struct Tree {
    /// Sign with which the free factor acts on every face.
    sign: Vec<f64>,
    components: Vec<Component>,
    /// Faces in breadth-first order with the link they were reached by.
    order: Vec<(usize, Option<usize>)>,
}

impl Links {
    fn new(net: &QuadNet, positions: &[DVec3]) -> Self {
        let mut opposite = 0;
        let all = net
            .inner_edges()
            .iter()
            .map(|e| {
                let ratio = net.join(e, positions).shape_ratio();
                opposite += usize::from(!(ratio > 0.0));
                let log_ratio = ratio.abs().clamp(1e-6, 1e6).ln();
                Link { faces: e.faces, exponents: e.exponents, log_ratio }
            })
            .collect();
        Self { all, opposite }
    }

    fn tree(&self, faces: usize) -> Tree {
        let mut around: Vec<Vec<usize>> = vec![Vec::new(); faces];
        for (k, link) in self.all.iter().enumerate() {
            around[link.faces[0]].push(k);
            around[link.faces[1]].push(k);
        }
        let mut tree = Tree { sign: vec![0.0; faces], components: Vec::new(), order: Vec::new() };
        for start in 0..faces {
            if tree.sign[start] != 0.0 {
                continue;
            }
            let mut component = Component { faces: vec![start], consistent: true };
            tree.sign[start] = 1.0;
            tree.order.push((start, None));
            let mut queue = VecDeque::from([start]);
            while let Some(f) = queue.pop_front() {
                for &k in &around[f] {
                    let link = &self.all[k];
                    let g = link.faces[0] + link.faces[1] - f;
                    let want = tree.sign[f] * link.exponents[0] * link.exponents[1];
                    if tree.sign[g] == 0.0 {
                        tree.sign[g] = want;
                        tree.order.push((g, Some(k)));
                        component.faces.push(g);
                        queue.push_back(g);
                    } else if tree.sign[g] != want {
                        component.consistent = false;
                    }
                }
            }
            tree.components.push(component);
        }
        tree
    }

    fn breadth_first(&self, tree: &Tree, faces: usize) -> Vec<f64> {
        let mut log = vec![0.0; faces];
        for &(face, link) in &tree.order {
            let Some(k) = link else { continue };
            let Link { faces: [f, g], exponents: [a, b], log_ratio } = self.all[k];
            log[face] =
                if face == g { b * (a * log[f] + log_ratio) } else { a * (b * log[g] - log_ratio) };
        }
        log
    }

    fn least_squares(&self, tree: &Tree, faces: usize) -> Result<Vec<f64>, Error> {
        let mut rows: Vec<(Vec<(usize, f64)>, f64)> = self
            .all
            .iter()
            .map(|l| {
                (vec![(l.faces[1], l.exponents[1]), (l.faces[0], -l.exponents[0])], l.log_ratio)
            })
            .collect();
        for component in tree.components.iter().filter(|c| c.consistent) {
            // A free factor is pinned at one face; the residuals do not feel it.
            rows.push((vec![(component.faces[0], 1.0)], 0.0));
        }
        solve_rows(faces, &rows, 0.0)
            .map_err(|source| Error::Linear { what: "shape parameters", source })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::asymptotic_nets;
    use geom_core::PolyMesh;

    fn moutard() -> QuadNet {
        let model = asymptotic_nets::moutard(7, 6, 11);
        QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap()
    }

    #[test]
    fn both_spreads_close_on_an_exact_disc() {
        let net = moutard();
        let wide = fit_shape_parameters(&net, net.positions(), Spread::BreadthFirst).unwrap();
        let least = fit_shape_parameters(&net, net.positions(), Spread::LeastSquares).unwrap();
        assert!(wide.closure < 1e-9 && least.closure < 1e-9);
        assert!(wide.factor_is_free && wide.opposite_twists == 0);
        for (a, b) in wide.shape.iter().zip(&least.shape) {
            assert!((a - b).abs() < 1e-8);
        }
    }

    #[test]
    fn free_factor_solves_the_quartic() {
        let pairs: Vec<(f64, f64)> = (0..40)
            .map(|k| ((1.3 * f64::from(k)).sin(), if k % 3 == 0 { 1.0 } else { -1.0 }))
            .collect();
        let lambda = best_log_factor(&pairs).exp();
        let w: Vec<f64> = pairs.iter().map(|(y, c)| (c * y).exp()).collect();
        let sum = |power: i32| w.iter().map(|w| w.powi(power)).sum::<f64>();
        let quartic =
            sum(2) * lambda.powi(4) - sum(1) * lambda.powi(3) + sum(-1) * lambda - sum(-2);
        assert!(quartic.abs() < 1e-12 * sum(2), "{quartic}");
        // The sum of squares itself does not fall below its value there.
        let energy = |l: f64| {
            w.iter().map(|w| (l * w - 1.0).powi(2) + (1.0 / (l * w) - 1.0).powi(2)).sum::<f64>()
        };
        for other in [0.5, 0.9, 0.99, 1.01, 1.1, 2.0] {
            assert!(energy(other * lambda) > energy(lambda));
        }
    }

    #[test]
    fn odd_ring_has_no_free_factor() {
        let model = asymptotic_nets::catenoid_odd();
        let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap();
        let fit = fit_shape_parameters(&net, net.positions(), Spread::LeastSquares).unwrap();
        assert!(!fit.factor_is_free);
        assert!(fit.shape.iter().all(|w| (0.9..1.1).contains(w)));
    }
}
