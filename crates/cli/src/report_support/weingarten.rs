//! The report of a Weingarten optimisation.

use super::energies::energy_history;
use super::jets::spline_view;
use crate::failure::Failure;
use bspline::BsplineSurface;
use report::{RelationCurve, Report};
use weingarten::{Metrics, Optimized, Relation, RelationLocus, WeingartenOptions};

/// The surface before and after with its deviation, the energies, and the options in force.
pub(crate) fn weingarten_report(
    input: &BsplineSurface,
    optimized: &Optimized,
    options: &WeingartenOptions,
    length_unit: &str,
) -> Result<Report, Failure> {
    let mut report = super::new("Weingarten optimisation");
    report.length_unit = length_unit.to_owned();
    report.stages.push(spline_view("before", &[input], None, length_unit)?);
    let after = spline_view("after", &[&optimized.surface], Some(&[input]), length_unit)?;
    report.stages.push(after);
    let levels = optimized.report.levels.iter();
    let levels = levels.map(|l| (format!("{}x{}", l.control.0, l.control.1), &l.solver));
    report.energies = Some(energy_history(levels));
    report
        .relations
        .extend(optimized.relation.as_ref().map(|locus| relation_curve(locus, optimized)));

    let levels = optimized.report.levels.iter();
    let nets: Vec<String> = levels.map(|l| format!("{}x{}", l.control.0, l.control.1)).collect();
    report.option("levels", nets.join(", "));
    report.option("iterations", options.iterations);
    if let Some(last) = optimized.report.levels.last() {
        report.option("samples", format!("{}x{}", last.samples.0, last.samples.1));
    }
    report.option("formulation", word(format!("{:?}", options.formulation)));
    report.option("border", word(format!("{:?}", options.border)));
    report.option("relation", relation_words(&options.relation, optimized));
    let weights = [
        ("alignment", options.weights.alignment),
        ("closeness", options.weights.closeness),
        ("shape", options.weights.shape),
        ("fairness", options.weights.fairness),
        ("parallel", options.weights.parallel),
    ];
    for (name, weight) in weights {
        if let Some(weight) = weight {
            report.option(&format!("weight of {name}"), weight);
        }
    }
    report.option("moved control points", options.moves.len());
    Ok(report)
}

/// The relation over the curvatures of both surfaces.
fn relation_curve(locus: &RelationLocus, optimized: &Optimized) -> RelationCurve {
    let both = [&optimized.before, &optimized.after];
    let range = |low: fn(&Metrics) -> f64, high: fn(&Metrics) -> f64| {
        let least = both.map(low).into_iter().fold(f64::INFINITY, f64::min);
        [least, both.map(high).into_iter().fold(f64::NEG_INFINITY, f64::max)]
    };
    let h = range(|m| m.mean_curvature_min, |m| m.mean_curvature_max);
    let k = range(|m| m.gaussian_curvature_min, |m| m.gaussian_curvature_max);
    RelationCurve { name: locus.to_string().replace('-', "−"), points: locus.points(h, k) }
}

/// What was asked for, and what it came to if that was fitted.
fn relation_words(relation: &Relation, optimized: &Optimized) -> String {
    let locus = optimized.relation.as_ref().map(ToString::to_string);
    match (relation, locus) {
        (Relation::LinearFit | Relation::ConstantMeanFit, Some(found)) => {
            format!("{found}, fitted")
        }
        (Relation::CurveFit, _) => "fitted curve".to_owned(),
        (Relation::Curve(points), _) => format!("curve of {} control points", points.len()),
        (_, Some(given)) => given,
        (_, None) => "any".to_owned(),
    }
}

/// A variant's name as words: `ConstantMeanFit` becomes `constant mean fit`.
fn word(debug: String) -> String {
    let mut words = String::new();
    for c in debug.chars() {
        if c.is_uppercase() && words.ends_with(char::is_alphabetic) {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}
