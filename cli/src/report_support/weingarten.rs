//! The report of a Weingarten optimisation.

use super::energies::energy_history;
use super::jets::spline_view;
use crate::failure::Failure;
use bspline::BsplineSurface;
use report::{RelationCurve, Report};
use weingarten::{Optimized, Relation, WeingartenOptions};

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
    if let Relation::Curve(points) = &options.relation {
        let curve = RelationCurve { name: "relation".to_owned(), points: points.clone() };
        report.relations.push(curve);
    }

    let levels = optimized.report.levels.iter();
    let nets: Vec<String> = levels.map(|l| format!("{}x{}", l.control.0, l.control.1)).collect();
    report.option("levels", nets.join(", "));
    report.option("iterations", options.iterations);
    if let Some(last) = optimized.report.levels.last() {
        report.option("samples", format!("{}x{}", last.samples.0, last.samples.1));
    }
    report.option("formulation", word(format!("{:?}", options.formulation)));
    report.option("border", word(format!("{:?}", options.border)));
    report.option("relation", word(format!("{:?}", options.relation)));
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
