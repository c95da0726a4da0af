//! Every block against differences of its residuals.

use fixtures::asymptotic_nets;
use geom_core::{PolyMesh, TriMesh};
use gp_solver::{ResidualBlock, Variables, check_jacobian};

use super::*;
use crate::options::{Boundary, Options, StarPlanarity};
use crate::vectors::unknowns;
use crate::{LelieuvreStart, QuadNet, second_differences, third_differences};

fn net() -> QuadNet {
    let model = asymptotic_nets::schwarz_p_disc(3).jittered(0.05, 4);
    QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap()
}

/// Positions of the net and made-up normals.
fn start(net: &QuadNet, variables: &Variables) -> Vec<f64> {
    let mut x: Vec<f64> = (0..variables.len()).map(|k| (1.7 * k as f64).sin()).collect();
    let positions = variables.group(crate::POSITIONS).unwrap();
    for (v, p) in net.positions().iter().enumerate() {
        positions.set(&mut x, v, p.to_array());
    }
    x
}

fn check(mut block: impl ResidualBlock, x: &[f64]) {
    block.refresh(x);
    let worst = check_jacobian(&block, x).unwrap().expect("it has derivatives");
    assert!(worst.error < 1e-6, "{worst:?}");
}

#[test]
fn combinations_have_their_coefficients_as_derivatives() {
    let net = net();
    let (variables, positions, normals) = unknowns(&net, &Options::default());
    let x = start(&net, &variables);
    let (second, third) = (second_differences(&net), third_differences(&net));
    check(Combinations::new("second", positions, second.iter().map(Vec::as_slice)), &x);
    check(Combinations::new("third", normals.unwrap(), third.iter().map(Vec::as_slice)), &x);
}

#[test]
fn proximity_to_planes_points_and_curves_is_differentiated() {
    let net = net();
    let surface = TriMesh::from_poly_mesh(net.mesh());
    let (variables, positions, _) = unknowns(&net, &Options::default());
    let count = net.positions().len();
    let h = 0.25;
    let mut x = start(&net, &variables);
    for v in 0..count {
        let off = |c: usize| 0.05 * (2.3 * (3 * v + c) as f64).cos();
        let p = net.positions()[v].to_array();
        positions.set(&mut x, v, std::array::from_fn::<_, 3, _>(|c| (p[c] + off(c)) / h));
    }
    for boundary in [Boundary::Free, Boundary::Anchored, Boundary::Glide] {
        let root = |k: usize| 0.5 + 0.01 * k as f64;
        let weights = ProximityWeights {
            plane: (0..count).map(root).collect(),
            point: (0..count).map(|k| 0.1 * root(k)).collect(),
            curve: 3.0,
        };
        let targets = Targets::new(&net, boundary);
        let curves = targets.of_vertices.iter().any(|t| matches!(t, Target::Curve(_)));
        assert_eq!(curves, boundary == Boundary::Glide);
        check(Proximity::new(positions, h, &surface, targets, weights), &x);
    }
}

#[test]
fn quad_distances_are_differentiated_by_every_vertex_of_a_mix() {
    let mut variables = Variables::new();
    let positions = variables.add(crate::POSITIONS, 6, 3);
    let plain = |v| [(v, 1.0), (0, 0.0)];
    let quads = [
        [plain(0), plain(1), plain(2), plain(3)],
        [plain(0), [(1, 0.3), (2, 0.7)], plain(3), [(4, 0.6), (5, 0.4)]],
    ];
    let x: Vec<f64> =
        (0..18).map(|k| (1.7 * f64::from(k)).sin() + 0.1 * f64::from(k % 3)).collect();
    check(QuadDistances::new("planar", positions, quads), &x);
}

#[test]
fn frame_points_are_differentiated_and_vanish_on_smooth_joins() {
    let net = net();
    let options = Options { planarity: StarPlanarity::Quads, ..Options::published() };
    let (variables, positions, normals) = unknowns(&net, &options);
    assert!(normals.is_none());
    let shape: Vec<f64> = (0..net.quads().len()).map(|f| 1.0 + 0.3 * (f as f64).sin()).collect();
    check(FramePoints::new(&net, positions, &shape), &start(&net, &variables));

    let model = asymptotic_nets::moutard(5, 4, 3);
    let exact = QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap();
    let shape = crate::shape_parameters(&exact, &model.normals);
    let (variables, positions, _) = unknowns(&exact, &options);
    let rows = FramePoints::new(&exact, positions, &shape);
    let mut residuals = vec![1.0; rows.elements().rows_total()];
    rows.residuals(&start(&exact, &variables), &mut residuals);
    assert!(residuals.iter().all(|r| r.abs() < 1e-10), "{residuals:?}");
}

#[test]
fn edge_and_star_equations_are_differentiated() {
    let net = net();
    let (variables, positions, normals) = unknowns(&net, &Options::default());
    let normals = normals.unwrap();
    let signs = LelieuvreStart::new(&net).unwrap().signs;
    let x = start(&net, &variables);
    check(edge_equations(&net, &signs, positions, normals, 0.3), &x);
    check(star_equations(&net, positions, normals), &x);
}
