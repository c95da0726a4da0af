//! Relaxed mode on noisy data.

use crate::common::{Gauss, catenoid, exact_net, noisy, reference_set};
use asymptotic_bezier::{
    AsymptoticNet, BoundaryOptions, GridshellOptions, RelaxOptions, fill_net, relax, relax_patch,
    solve_boundary, solve_quadrilateral,
};
use geom_core::DVec3;

/// Of 100 draws with one percent of noise at least 80 are repaired, by small moves, and none of
/// those that are not passes without a warning.
#[test]
fn noise_of_one_percent_is_repaired_in_four_of_five_draws() {
    for name in ["A", "B", "C"] {
        let set = reference_set(name);
        let mut repaired = 0;
        for seed in 0..100 {
            let data = noisy(&set.data, 0.01, seed);
            let (moved, relaxed) = relax_patch(&data, &RelaxOptions::default()).unwrap();
            if relaxed.acceptable {
                repaired += 1;
                assert!(relaxed.rms_move() <= 0.02 && relaxed.max_move() <= 0.05);
                let torsions = relaxed.torsions.clone();
                let options = BoundaryOptions { torsions, ..Default::default() };
                let quad = solve_quadrilateral(&moved, &options).unwrap();
                assert!(quad.qualities.iter().all(|q| {
                    q.turning < std::f64::consts::PI && q.torsion[0] * q.torsion[1] > 0.0
                }));
            }
            let plain = solve_quadrilateral(&data, &BoundaryOptions::default()).unwrap();
            let bad = plain
                .qualities
                .iter()
                .any(|q| q.turning > std::f64::consts::PI || q.torsion[0] * q.torsion[1] < 0.0);
            assert!(!bad || !plain.warnings.is_empty(), "{name} {seed} is silent");
        }
        println!("{name}: {repaired} of 100");
        assert!(repaired >= 80, "{name}: {repaired} of 100");
    }
}

#[test]
fn good_data_come_back_untouched() {
    let set = reference_set("A");
    let (moved, relaxed) = relax_patch(&set.data, &RelaxOptions::default()).unwrap();
    assert!(relaxed.acceptable && relaxed.max_move() == 0.0 && relaxed.iterations == 0);
    assert_eq!(moved, set.data);
}

/// `net` with Gaussian noise as [`noisy`] gives it to one patch; arms stay opposite and in their
/// planes up to the noise, which is what measuring them one by one would give.
fn noisy_net(net: &AsymptoticNet, sigma: f64, seed: u64) -> AsymptoticNet {
    let mut gauss = Gauss::new(seed);
    let mut curves = net.curves().to_vec();
    for curve in &mut curves {
        for e in 0..2 {
            let size = sigma * curve.arms[e].length();
            curve.arms[e] += DVec3::new(gauss.next(), gauss.next(), gauss.next()) * size;
            curve.curvatures[e] *= 1.0 + sigma * gauss.next();
        }
    }
    let quads: Vec<[usize; 4]> =
        net.faces().iter().map(|f| [0, 1, 3, 2].map(|c| net.face_corner(f, c))).collect();
    AsymptoticNet::new(net.positions().to_vec(), &quads, curves).expect("the net is sound")
}

/// The curves of a net are shorter than the sides of a lone patch of the same shape, and what they
/// bear shrinks with the square of their length: a third of the length, a third of a percent.
#[test]
fn noisy_nets_are_repaired_too() {
    let exact = exact_net(catenoid, [0.5, 1.7, -0.2, 0.9], [3, 3]);
    let mut repaired = 0;
    for seed in 0..20 {
        let net = noisy_net(&exact, 0.003, seed);
        let relaxed = relax(&net, &RelaxOptions::default()).unwrap();
        println!(
            "{seed}: {} moves {:.2} % rms {:.2} % most, {} steps",
            relaxed.acceptable,
            100.0 * relaxed.rms_move(),
            100.0 * relaxed.max_move(),
            relaxed.iterations
        );
        if !relaxed.acceptable {
            continue;
        }
        repaired += 1;
        assert!(relaxed.rms_move() <= 0.02 && relaxed.max_move() <= 0.05);
        let mut options = GridshellOptions::default();
        options.boundary.torsions = relaxed.torsions.clone();
        let shell = fill_net(&relaxed.net, &options).unwrap();
        let check = shell.verify(&relaxed.net, &options.patch);
        assert!(check.kink().to_degrees() <= 1e-8);
        assert!(check.patches.iter().all(|p| p.sine >= 0.1 && p.normal_curvature <= 1e-10));
        // As given the noise is beyond what is projected silently, or spoils the torsions.
        let plain = solve_boundary(&net, &BoundaryOptions::default());
        assert!(plain.is_err() || shell.boundary.torsions != plain.unwrap().torsions);
    }
    assert!(repaired >= 16, "{repaired} of 20");
}
