//! The published pipeline against the recorded kinks of an independent program.

use fixtures::asymptotic_nets::{self, AsymptoticNet};
use geom_core::PolyMesh;
use hyperbolic_nets::{FairnessOrder, Input, Options, QuadNet, Spread, StarPlanarity, solve};

fn run(model: &AsymptoticNet, options: &Options) -> (f64, f64, f64) {
    let mesh = PolyMesh::new(model.positions.clone(), &model.quads).unwrap();
    let net = QuadNet::new(&mesh).unwrap();
    let input = Input::near_surface(&net, &*model.surface);
    let surface = solve(&input, options, &mut ()).unwrap().result;
    let kinks = surface.kink_statistics();
    let planarity = hyperbolic_nets::star_planarity(surface.net());
    (kinks.max.to_degrees(), kinks.mean.to_degrees(), planarity)
}

fn weights(fairness: f64, proximity: f64, frame: f64) -> Options {
    let (fairness, proximity, frame) = (Some(fairness), Some(proximity), Some(frame));
    Options { fairness, proximity, frame, ..Options::published() }
}

/// Worst of the seeds against 1.3 times the recorded largest and mean kink, in degrees.
fn check(
    name: &str,
    make: impl Fn() -> AsymptoticNet,
    options: &Options,
    seeds: u64,
    want: (f64, f64),
) {
    let mut worst = (0.0_f64, 0.0_f64);
    for seed in 1..=seeds {
        let (max, mean, _) = run(&make().jittered(0.05, seed), options);
        worst = (worst.0.max(max), worst.1.max(mean));
    }
    eprintln!(
        "{name}: {:.3} / {:.3} deg, recorded {:.2} / {:.2}",
        worst.0, worst.1, want.0, want.1
    );
    assert!(worst.0 <= 1.3 * want.0, "{name}: kink max {} deg", worst.0);
    assert!(worst.1 <= 1.3 * want.1, "{name}: kink mean {} deg", worst.1);
}

#[test]
fn discs_are_as_good_as_published() {
    check("helicoid", asymptotic_nets::helicoid, &weights(0.86, 0.12, 0.65), 5, (2.26, 0.95));
    check("scherk", || asymptotic_nets::scherk(12), &weights(0.86, 0.08, 0.60), 5, (0.74, 0.37));
    check("enneper", asymptotic_nets::enneper, &weights(0.86, 0.08, 0.60), 5, (1.62, 0.73));
    check(
        "P disc",
        || asymptotic_nets::schwarz_p_disc(5),
        &weights(0.6, 0.04, 0.6),
        5,
        (1.08, 0.45),
    );
}

#[test]
fn rings_are_as_good_as_published() {
    let options = weights(0.4, 0.02, 0.6);
    check("even ring", || asymptotic_nets::catenoid(44, 32), &options, 1, (0.67, 0.52));
    check("odd ring", asymptotic_nets::catenoid_odd, &options, 2, (2.02, 1.30));
    check("bumped ring", || asymptotic_nets::bumped_catenoid(44, 32), &options, 1, (0.83, 0.52));
}

#[test]
fn cell_with_holes_is_as_good_as_published() {
    check(
        "P cell",
        || asymptotic_nets::schwarz_p_cell(4),
        &weights(0.6, 0.04, 0.6),
        5,
        (2.65, 1.43),
    );
}

#[test]
fn every_variant_flattens_the_stars() {
    let model = asymptotic_nets::scherk(8).jittered(0.05, 1);
    let before = {
        let mesh = PolyMesh::new(model.positions.clone(), &model.quads).unwrap();
        hyperbolic_nets::star_planarity(&QuadNet::new(&mesh).unwrap())
    };
    for planarity in [StarPlanarity::Quads, StarPlanarity::Normals] {
        for fairness_order in [FairnessOrder::Second, FairnessOrder::Third] {
            for spread in [Spread::BreadthFirst, Spread::LeastSquares] {
                let options =
                    Options { planarity, fairness_order, spread, ..weights(0.05, 0.08, 0.6) };
                let (kink, _, star) = run(&model, &options);
                eprintln!(
                    "{planarity:?} {fairness_order:?} {spread:?}: {kink:.3} deg, star {star:.1e} from {before:.1e}"
                );
                assert!(star < 0.2 * before && kink < 2.0);
            }
        }
    }
}
