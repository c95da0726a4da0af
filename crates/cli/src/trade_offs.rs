//! Molds and cost against tolerance, of a surface before and after it was optimised.

use bspline::BsplineSurface;
use exchange::LengthUnit;
use paneling::{Diagram, FINENESS, Law, TradeOff};
use serde::Serialize;

/// Largest kinks that are tried, in degrees.
pub(crate) const DEGREES: [f64; 5] = [1.0, 0.5, 0.25, 0.1, 0.05];

/// What the same tolerance takes before and after.
#[derive(Debug, Serialize)]
struct Pair {
    before: TradeOff,
    after: TradeOff,
}

/// The trade-off of a surface before and after.
#[derive(Debug, Serialize)]
pub(crate) struct TradeOffs {
    trade_off: Vec<Pair>,
    law_before: Law,
    law_after: Law,
}

impl TradeOffs {
    /// Of surfaces and rows before and after.
    pub(crate) fn new(surfaces: [&BsplineSurface; 2], [before, after]: [Vec<TradeOff>; 2]) -> Self {
        let [first, second] = surfaces.map(Diagram::new);
        // Both in the box of the input, so that cells are of one size.
        let bounds = first.bounds();
        let pairs = before.into_iter().zip(after);
        Self {
            trade_off: pairs.map(|(before, after)| Pair { before, after }).collect(),
            law_before: first.law(&bounds),
            law_after: second.law(&bounds),
        }
    }

    /// The table, and the law below it.
    pub(crate) fn summary(&self, unit: &LengthUnit) -> Vec<String> {
        let mut lines = vec![
            "molds and cost before the optimisation, and after it:".to_owned(),
            format!(
                "  {:>8} {:>8} {:>8} {:>10} {:>10} {:>12} {:>10}",
                "kinks to", "molds", "after", "cost", "after", "gap after", "off design"
            ),
        ];
        // Bounds that cannot be kept have a mark.
        let mark = |row: &TradeOff| if row.is_within { ' ' } else { '*' };
        lines.extend(self.trade_off.iter().map(|Pair { before, after }| {
            format!(
                "  {:>7}° {:>7}{} {:>7}{} {:>10.2} {:>10.2} {:>9.2e} {unit} {:>8.3} %",
                before.max_kink_deg,
                before.molds,
                mark(before),
                after.molds,
                mark(after),
                before.cost,
                after.cost,
                after.gap_max,
                after.deviation_max_percent,
            )
        }));
        if self.trade_off.iter().any(|p| !(p.before.is_within && p.after.is_within)) {
            lines.push("  * the bounds are not met".to_owned());
        }
        let law = |law: &Law| {
            let cells = law.cells.map(|c| c.to_string()).join(", ");
            format!("{cells}, so as n to the power of {:.2}", law.exponent)
        };
        let sizes = FINENESS.map(|n| n.to_string()).join(", ");
        lines.push(format!("  occupied cells of n x n over the curvature diagram, n = {sizes}:"));
        lines.push(format!("    before {}", law(&self.law_before)));
        lines.push(format!("    after  {}", law(&self.law_after)));
        lines
    }

    /// The table with units in its headings.
    pub(crate) fn csv(&self, unit: &LengthUnit) -> String {
        let of = |when: &str| {
            [
                format!("molds {when}"),
                format!("cost {when}"),
                format!("kink_max {when} [deg]"),
                format!("gap_max {when} [{unit}]"),
                format!("deviation_max {when} [% of the size]"),
                format!("within {when}"),
            ]
        };
        let header = ["max_kink [deg]".to_owned()].into_iter().chain(of("before"));
        let header: Vec<String> = header.chain(of("after")).collect();
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        let cells = |row: &TradeOff| {
            let numbers = [row.kink_max_deg, row.gap_max, row.deviation_max_percent];
            let numbers = numbers.map(|x| x.to_string());
            let first = [row.molds.to_string(), row.cost.to_string()];
            first.into_iter().chain(numbers).chain([row.is_within.to_string()])
        };
        let rows = self.trade_off.iter().map(|Pair { before, after }| {
            let tolerance = [before.max_kink_deg.to_string()].into_iter();
            tolerance.chain(cells(before)).chain(cells(after)).collect::<Vec<String>>()
        });
        exchange::write_csv(&header, rows)
    }

    /// How many molds this tolerance takes before and after.
    pub(crate) fn molds(&self, degrees: f64) -> Option<[usize; 2]> {
        let pair = self.trade_off.iter().find(|p| p.before.max_kink_deg == degrees)?;
        Some([pair.before.molds, pair.after.molds])
    }
}
