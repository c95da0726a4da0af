//! NIST StRD nonlinear regression: all 27 problems, both starts, default options.
//!
//! Passed if every certified parameter is met to 4 digits, on lower and average difficulty to 6.

mod problems;

use problems::nist::{self, Level};

#[test]
fn certified_parameters_are_met_from_both_starts() {
    let mut failures = Vec::new();
    for (name, _) in nist::MODELS {
        let set = nist::read(name);
        for start in 0..2 {
            let mut x = set.starts[start].clone();
            let report = set.problem(start).solve(&mut x).unwrap();
            let digits = nist::digits(&x, &set.certified);
            let wanted = if set.level == Level::Higher { 4.0 } else { 6.0 };
            println!("{name} {start} {digits:.2} {} {}", report.iterations, report.status);
            for pair in report.history.windows(2) {
                assert!(pair[1].energy <= pair[0].energy, "{name}: the energy rose");
            }
            if digits < wanted {
                failures.push(format!("{name} start {start}: {digits:.1} digits"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
