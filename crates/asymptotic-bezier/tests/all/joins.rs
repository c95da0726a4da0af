//! Joins with common cross derivatives, and with the least jump of the mean curvature.

use crate::common::star::star;
use crate::common::{catenoid, enneper, exact_net};
use asymptotic_bezier::{
    AsymptoticNet, GridshellCheck, GridshellOptions, Interior, Joins, PatchOptions, fill_net,
};

fn filled(net: &AsymptoticNet, joins: Joins, degree: usize) -> (GridshellCheck, f64, usize) {
    let patch = PatchOptions { degree: Some(degree), ..Default::default() };
    let options = GridshellOptions { patch, joins, ..Default::default() };
    let shell = fill_net(net, &options).unwrap();
    let check = shell.verify(net, &options.patch);
    for join in &check.joins {
        assert!(join.kink.to_degrees() <= 1e-8, "{join:?}");
        assert!(join.gaussian_jump < 1e-6, "{join:?}");
        if shell.continuous[join.curve] {
            assert!(join.derivative_jump < 1e-10, "{join:?}");
        }
    }
    assert!(check.patches.iter().all(|p| p.normal_curvature <= 1e-10));
    (check, shell.thin_plate_energy(), shell.continuous.iter().filter(|c| **c).count())
}

#[test]
fn cross_derivatives_agree_at_a_small_cost() {
    for (name, net) in [
        ("Enneper", exact_net(enneper, [-0.6, 0.9, 0.2, 1.3], [3, 3])),
        ("catenoid", exact_net(catenoid, [0.2, 1.4, -0.1, 0.9], [3, 3])),
    ] {
        let (g1, free, none) = filled(&net, Joins::G1, 7);
        let (c1, shared, all) = filled(&net, Joins::C1, 7);
        println!("{name}: energy {free} to {shared}, dH {} to {}", g1.mean_jump(), c1.mean_jump());
        assert_eq!((none, all), (0, 12));
        assert!(shared >= free * (1.0 - 1e-12) && shared < 1.05 * free, "{name}");
        assert!(c1.patches.iter().all(|p| p.sine > 0.5));
    }
}

#[test]
fn the_mean_curvature_jump_is_least_and_vanishes_on_polynomial_nets() {
    let net = exact_net(enneper, [-0.6, 0.9, 0.2, 1.3], [2, 2]);
    let (g1, ..) = filled(&net, Joins::G1, 7);
    let (g2, energy, _) = filled(&net, Joins::G2, 7);
    println!("Enneper: energy {energy}, dH {} to {}", g1.mean_jump(), g2.mean_jump());
    assert!(g2.mean_jump() < 1e-3 * g1.mean_jump());
    let net = exact_net(catenoid, [0.2, 1.4, -0.1, 0.9], [3, 3]);
    let (g1, ..) = filled(&net, Joins::G1, 7);
    for degree in [7, 9] {
        let (g2, energy, _) = filled(&net, Joins::G2, degree);
        println!(
            "catenoid bi-{degree}: energy {energy}, dH {} to {}",
            g1.mean_jump(),
            g2.mean_jump()
        );
        assert!(g2.mean_jump() < 0.5 * g1.mean_jump());
        assert!(g2.patches.iter().all(|p| p.sine > 0.5));
    }
}

#[test]
fn joins_at_irregular_vertices_stay_g1() {
    let net = star(6);
    let (_, _, shared) = filled(&net, Joins::C1, 7);
    assert_eq!(shared, 0);
    let options = GridshellOptions {
        patch: PatchOptions { degree: Some(5), ..Default::default() },
        joins: Joins::C1,
        ..Default::default()
    };
    let masked = GridshellOptions {
        patch: PatchOptions { interior: Interior::Bending, ..Default::default() },
        joins: Joins::G2,
        ..Default::default()
    };
    let error = fill_net(&net, &masked).unwrap_err().to_string();
    assert!(error.starts_with("C1 and G2 joins need the tangent module and thin plates"));
    let error = fill_net(&net, &options).unwrap_err().to_string();
    assert_eq!(error, "degree 5 of the jointly filled surface is outside 6..=15");
}
