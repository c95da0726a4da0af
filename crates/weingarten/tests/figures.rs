//! Figures of Pellis et al. 2021 as numbers.

use fixtures::surfaces::Shape;
use gp_solver::Counts;
use weingarten::{
    Border, Input, Options, Relation, RelationMiss, Solution, Status, fitted_curve, solve,
};

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

/// A fitted curve goes along the whole diagram, in units of the input's spread; bent by 0.3 of its height it
/// is reached in one run from there.
#[test]
fn a_saddle_follows_a_curve_and_the_curve_is_edited() {
    let saddle = Shape::Saddle.surface(12, 12, 4, 4);
    let options = Options { relation: Relation::CurveFit, iterations: 20, ..Options::default() };
    let fitted = solve(&saddle, &options, &mut ()).expect("a saddle");
    assert!(fitted.before.relation_rms > 0.2 && fitted.metrics.relation_rms <= 0.02);

    let control = fitted_curve(&fitted.result).expect("regular").expect("a curve");
    let (low, high) = control
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[1]), h.max(p[1])));
    let last = control.len() as f64 - 1.0;
    let bend = |i: usize| 0.3 * (high - low) * (std::f64::consts::PI * i as f64 / last).sin();
    let bent = control.iter().enumerate().map(|(i, p)| [p[0], p[1] + bend(i)]).collect();
    let options = Options {
        relation: Relation::Curve(bent),
        iterations: 20,
        closeness: 1e-3,
        fairness: 1e-2,
        ..Options::default()
    };
    let input = Input::from(&saddle).starting_from(&fitted.result);
    let edited = solve(input, &options, &mut ()).expect("an edit");
    assert!(edited.metrics.relation_rms <= 0.01, "{}", edited.metrics.relation_rms);
    assert_eq!(edited.flaws, []);
    assert!(edited.report.stages.len() > 1, "the way to the edited curve has parts");
}

/// Fig. 12: a local minimum, and the way around it over levels.
#[test]
fn an_egg_box_stalls_on_its_own_net_and_not_over_levels() {
    let eggbox = Shape::Eggbox.surface(10, 10, 4, 4);
    let run = |options: Options| solve(&eggbox, &options, &mut ()).expect("an egg box");
    let stuck = run(Options { iterations: 200, ..Options::default() });
    assert_eq!(stuck.report.status, Status::Stalled);
    assert!(stuck.report.iterations < 200);
    let levels = [(10, 8), (14, 10), (18, 14), (25, 18)];
    let levels: Vec<Counts> = levels.into_iter().map(|(u, v)| Counts { u, v }).collect();
    let over_levels = run(Options { levels: levels.into(), ..Options::default() });
    assert!(3.0 * over_levels.metrics.diagram_area <= stuck.metrics.diagram_area);
}

/// On one net every iterate a shorter run would end with has been looked at.
#[test]
fn more_steps_never_ruin_a_result() {
    for shape in [Shape::Roof, Shape::Eggbox, Shape::Tube] {
        let surface = shape.surface(12, 10, 4, 4);
        let mut least = f64::INFINITY;
        for iterations in [5, 10, 20, 40, 80] {
            let options = Options { iterations, ..Options::default() };
            let alignment =
                solve(&surface, &options, &mut ()).expect("a surface").metrics.alignment_rms;
            assert!(alignment <= 1.000_001 * least, "{shape:?} {iterations}: {alignment} {least}");
            least = least.min(alignment);
        }
    }
}

/// Over several levels the border of the input is held on the last one, in a net with at least the control
/// points asked for.
#[test]
fn a_fixed_border_is_that_of_the_input_over_levels_too() {
    let vault = Shape::Vault.surface(9, 8, 4, 4);
    let levels = vec![Counts { u: 7, v: 7 }, Counts { u: 16, v: 12 }];
    for relation in [Relation::Free, Relation::ConstantMeanFit] {
        let options = Options {
            border: Border::Fixed,
            levels: levels.clone().into(),
            relation,
            ..Options::default()
        };
        let solution = solve(&vault, &options, &mut ()).expect("a vault");
        assert!(border(&solution) < 1e-10, "{}", border(&solution));
        assert_eq!((solution.result.n_u(), solution.result.n_v()), (19, 12));
        assert!(solution.metrics.deviation_mean_percent > 0.05);
    }
}
