//! Figures of Pellis et al. 2021 as numbers.

use fixtures::surfaces::Shape;
use weingarten::{Border, Options, Relation, RelationMiss, Solution, Status, solve};

/// The vault of Fig. 3 with a relation asked for.
fn vault(relation: Relation, border: Border) -> (Solution, RelationMiss) {
    let options = Options {
        relation,
        border,
        iterations: 20,
        closeness: 1e-3,
        shape: 1e-3,
        fairness: 1e-2,
        ..Options::default()
    };
    let surface = Shape::Vault.surface(12, 12, 4, 4);
    let solution = solve(&surface, &options, &mut ()).expect("a vault");
    assert_eq!(solution.flaws, []);
    let miss = solution.miss.expect("a relation");
    (solution, miss)
}

fn border(solution: &Solution) -> f64 {
    solution.metrics.boundary_deviation_max_percent
}

/// One start, three linear relations, the border held softly: Fig. 3.
#[test]
fn a_vault_becomes_minimal_or_of_constant_mean_curvature() {
    let (minimal, miss) = vault(Relation::Minimal, Border::Soft(100.0));
    assert!(miss.inner_rms <= 0.016 && border(&minimal) <= 0.05, "{miss:?} {}", border(&minimal));
    let (cmc, miss) = vault(Relation::ConstantMeanFit, Border::Soft(100.0));
    assert!(miss.inner_rms <= 0.002 && border(&cmc) <= 0.05, "{miss:?} {}", border(&cmc));
}

#[test]
fn a_vault_becomes_developable_where_its_border_may_move() {
    let (solution, miss) = vault(Relation::Developable, Border::Soft(10.0));
    assert!(miss.inner_rms <= 0.08 && border(&solution) <= 6.0, "{miss:?} {}", border(&solution));
}

/// A closed border curve over-determines a developable surface: the run says so and tears nothing.
#[test]
fn no_developable_surface_has_the_border_of_a_vault() {
    let (solution, miss) = vault(Relation::Developable, Border::Fixed);
    assert_eq!(solution.report.status, Status::Stalled);
    assert!(!miss.is_held() && miss.share < 0.2 && border(&solution) < 1e-10, "{miss:?}");
}
