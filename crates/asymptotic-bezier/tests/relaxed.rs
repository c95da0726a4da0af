//! Relaxed mode on noisy data.

mod common;

use asymptotic_bezier::{BoundaryOptions, RelaxOptions, relax, solve_quadrilateral};
use common::{noisy, reference_set};

/// Of 100 draws with one percent of noise at least 80 are repaired, by small moves, and none of
/// those that are not passes without a warning.
#[test]
fn noise_of_one_percent_is_repaired_in_four_of_five_draws() {
    for name in ["A", "B", "C"] {
        let set = reference_set(name);
        let mut repaired = 0;
        for seed in 0..100 {
            let data = noisy(&set.data, 0.01, seed);
            let relaxed = relax(&data, &RelaxOptions::default()).unwrap();
            if relaxed.acceptable {
                repaired += 1;
                assert!(relaxed.rms_move() <= 0.02 && relaxed.max_move() <= 0.05);
                assert!(relaxed.quad.qualities.iter().all(|q| {
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
    let relaxed = relax(&set.data, &RelaxOptions::default()).unwrap();
    assert!(relaxed.acceptable && relaxed.max_move() == 0.0 && relaxed.iterations == 0);
    assert_eq!(relaxed.data, set.data);
}
