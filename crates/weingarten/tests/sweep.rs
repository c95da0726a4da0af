//! Relations asked of surfaces that need not be near to any such surface: whatever comes of it, no
//! torn surface passes as a result, and every status is true.

use std::time::Instant;

use bspline::{BsplineSurface, Degree, KnotVector, fit_surface};
use fixtures::surfaces::Shape;
use geom_core::DVec3;
use weingarten::{Border, Options, Relation, Solution, Status, solve};

/// A net of `n` by `n` control points of degree 4 through a graph over `[-1, 1]²`.
fn graph(n: usize, f: impl Fn(f64, f64) -> DVec3) -> BsplineSurface {
    let degree = Degree::new(4).expect("a degree");
    let knots = KnotVector::clamped_uniform(degree, n).expect("enough points");
    let t = knots.uniform_parameters(4 * n);
    let at = |t: f64| 2.0 * t - 1.0;
    let points: Vec<DVec3> = t
        .iter()
        .flat_map(|&u| t.iter().map(move |&v| (u, v)))
        .map(|(u, v)| f(at(u), at(v)))
        .collect();
    fit_surface(&knots, &knots, &t, &t, &points).expect("enough samples")
}

fn surfaces() -> Vec<(&'static str, BsplineSurface)> {
    vec![
        ("vault", Shape::Vault.surface(12, 12, 4, 4)),
        ("saddle", Shape::Saddle.surface(10, 8, 4, 4)),
        ("roof", Shape::Roof.surface(10, 8, 4, 4)),
        (
            "canopy",
            graph(10, |x, y| {
                let z = 0.5 - 0.22 * x * x - 0.3 * y * y
                    + 0.08 * x * y * y
                    + 0.05 * (1.7 * x + y).sin();
                DVec3::new(1.4 * x, y + 0.05 * x * x, z)
            }),
        ),
        (
            "ridge",
            graph(11, |x, y| {
                let z =
                    0.35 * (-2.5 * (x - 0.2 * y) * (x - 0.2 * y)).exp() + 0.1 * y * y - 0.05 * x;
                DVec3::new(1.2 * x, y, z)
            }),
        ),
        ("helical", Shape::Helical.surface(12, 9, 4, 4)),
    ]
}

/// The relations of the sweep, in units that suit the surface.
fn relations(surface: &BsplineSurface) -> Vec<(&'static str, Relation)> {
    let still = Options { iterations: 0, ..Options::default() };
    let m = solve(surface, &still, &mut ()).expect("a surface").before;
    let h = 0.5 * (m.mean_curvature_min + m.mean_curvature_max);
    let size = 0.5 * (m.mean_curvature_max - m.mean_curvature_min).max(h.abs());
    let (h, dh) = (h, size);
    let k = 0.5 * (m.gaussian_curvature_min + m.gaussian_curvature_max);
    let dk = 0.5 * (m.gaussian_curvature_max - m.gaussian_curvature_min);
    let at = |s: f64, t: f64| [h + s * dh, k + t * dk];
    vec![
        ("minimal", Relation::Minimal),
        ("cmc", Relation::ConstantMeanFit),
        ("cmc 1.5", Relation::ConstantMean(1.5 * h)),
        ("cmc far", Relation::ConstantMean(h - 2.0 * dh)),
        ("developable", Relation::Developable),
        ("gauss", Relation::ConstantGauss(k)),
        ("gauss far", Relation::ConstantGauss(k + 3.0 * dk)),
        ("ratio -1", Relation::Ratio(-1.0)),
        ("ratio 0.5", Relation::Ratio(0.5)),
        ("linear", Relation::LinearFit),
        ("line", Relation::Linear(1.0 / dh, -1.0 / dk, 0.3 - h / dh + k / dk)),
        ("curve", Relation::CurveFit),
        (
            "s-curve",
            Relation::Curve(vec![at(-1.0, -0.5), at(-0.4, 0.6), at(0.4, -0.6), at(1.0, 0.5)]),
        ),
    ]
}

const BORDERS: [Border; 3] = [Border::Free, Border::Glide, Border::Fixed];

/// Least area element on a grid ten times as dense as samples, over the median of the start's.
fn least_area(surface: &BsplineSurface, start: &BsplineSurface) -> f64 {
    let [u, v] = start.check_parameters();
    let areas = |s: &BsplineSurface| -> Vec<f64> {
        s.area_vector_grid(&u, &v).iter().map(|n| n.length()).collect()
    };
    let mut before = areas(start);
    before.sort_by(f64::total_cmp);
    areas(surface).into_iter().fold(f64::INFINITY, f64::min) / before[before.len() / 2]
}

/// One run, and one line of the table.
fn run(
    name: &str,
    surface: &BsplineSurface,
    label: &str,
    relation: &Relation,
    border: Border,
) -> (Solution, bool) {
    let options = Options {
        relation: relation.clone(),
        border,
        iterations: 20,
        closeness: 1e-3,
        fairness: 1e-2,
        ..Options::default()
    };
    let begin = Instant::now();
    let solution = solve(surface, &options, &mut ()).expect("a surface to optimise");
    let seconds = begin.elapsed().as_secs_f64();
    let least = least_area(&solution.result, surface);
    let m = solution.metrics;
    let is_solved = m.relation_rms < 0.05 * solution.before.relation_rms || m.relation_rms < 0.01;
    eprintln!(
        "{name:8} {label:12} {border:?}\t{:15} rms {:9.4} -> {:8.4}  least area {least:6.3}  deviation {:6.2} / {:6.2} %  {:3} steps {:5.2} s {}",
        solution.report.status.as_str(),
        solution.before.relation_rms,
        m.relation_rms,
        m.deviation_mean_percent,
        m.deviation_max_percent,
        solution.report.iterations,
        seconds,
        if is_solved { "*" } else { "" }
    );
    if solution.report.status == Status::Converged {
        assert!(solution.miss.is_some_and(|miss| miss.is_held()), "{name} {label} {border:?}");
    }
    // Whatever comes of it, it is no farther from the relation than the input.
    assert!(m.relation_rms <= solution.before.relation_rms, "{name} {label} {border:?}");
    if border == Border::Fixed {
        assert!(m.boundary_deviation_max_percent < 1e-10, "{name} {label}");
    }
    if solution.report.status != Status::Failed {
        assert!(least >= 0.05, "{name} {label} {border:?}: {least}");
        assert_eq!(solution.result.flaws_against(surface), [], "{name} {label} {border:?}");
    }
    assert!(m.relation_rms.is_finite());
    (solution, is_solved)
}

/// Relations near and far, some of which no surface near by can have.
#[test]
fn twelve_of_the_sweep() {
    let (name, surface) = surfaces().swap_remove(1);
    let wanted = ["minimal", "developable", "gauss far", "s-curve"];
    for (label, relation) in relations(&surface) {
        for border in BORDERS.into_iter().filter(|_| wanted.contains(&label)) {
            let (solution, is_solved) = run(name, &surface, label, &relation, border);
            assert_ne!(solution.report.status, Status::Failed, "{label} {border:?}");
            assert!(is_solved || border != Border::Free || label == "gauss far", "{label}");
        }
    }
}

#[test]
#[ignore = "minutes"]
fn the_whole_sweep() {
    let (mut solved, mut failed, mut all) = (0, 0, 0);
    for (name, surface) in surfaces() {
        for (label, relation) in relations(&surface) {
            for border in BORDERS {
                let (solution, is_solved) = run(name, &surface, label, &relation, border);
                solved += usize::from(is_solved);
                failed += usize::from(solution.report.status == Status::Failed);
                all += 1;
            }
        }
    }
    eprintln!("{solved} of {all} solved, {failed} failed");
}
