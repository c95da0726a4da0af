//! Every public item of the solver has a caller outside of the solver, or a reason.

use super::family::sources;
use super::tokens::{tokens, without_tests};
use crate::shell::{Outcome, read, root};
use std::collections::BTreeSet;

/// Items that only users outside of the workspace call, each with its reason.
const KEPT: &[(&str, &str)] = &[
    ("NumericBlock", "for people who do not want to derive; shown in the guide for contributors"),
    ("LineSearch", "the type of an option of lbfgs"),
    ("Quantity", "the type of a field of an error"),
    ("ElementVisitor", "the type of an argument of Problem::quadratic_models"),
    ("DerivativeCheck", "what check_jacobian returns"),
    ("Equation", "what QuadraticBuilder::equation returns"),
    ("StepModel", "what System::damped_step returns"),
    ("Triplets", "what System::jacobian_triplets returns"),
    ("BandCholesky", "what Factorization::Band chooses; the benches compare it with others"),
    ("MultifrontalCholesky", "what Factorization::Dissection chooses; benched beside the others"),
    ("SparseCholesky", "what SparseMetric and solve_rows stand on; benched beside the others"),
    ("SymmetricPattern", "what the sparse factorisations are made from"),
    ("QpSolution", "what the quadratic programs return"),
    ("solve_observed", "solve, for those who watch; the methods drive a Run of their own"),
    ("Method", "the type of an option"),
    ("Objective", "what lbfgs takes; closures are one"),
    ("Term", "the type of a field of a report"),
    ("Timings", "the type of a field of a report"),
];

/// Looks for the names of gp-solver's front page in all other crates.
pub(crate) fn check(faults: &mut Vec<String>) -> Outcome {
    let front = read(&root().join("crates/gp-solver/src/lib.rs"))?;
    let mut used = BTreeSet::new();
    for folder in ["crates", "xtask", "fuzz", "fixtures"] {
        for path in sources(&root().join(folder))? {
            if path.starts_with(root().join("crates/gp-solver")) {
                continue;
            }
            let text = read(&path)?;
            let all = tokens(&text);
            let (kept, _) = without_tests(&all);
            used.extend(kept.into_iter().map(str::to_owned));
        }
    }
    for name in exported(&front) {
        let reason = KEPT.iter().any(|(kept, _)| *kept == name);
        if !used.contains(name) && !reason {
            faults.push(format!("gp-solver exports {name}, which nobody calls"));
        }
    }
    Ok(())
}

/// The names behind `pub use` of a front page.
fn exported(front: &str) -> BTreeSet<&str> {
    let all = tokens(front);
    let mut names = BTreeSet::new();
    let mut rest = &all[..];
    while let Some(at) = rest.windows(2).position(|w| w == ["pub", "use"]) {
        rest = &rest[at + 2..];
        let end = rest.iter().position(|t| *t == ";").unwrap_or(rest.len());
        let item = &rest[..end];
        match item.iter().position(|t| *t == "{") {
            Some(open) => names.extend(item[open..].iter().filter(is_name).copied()),
            None => names.extend(item.iter().rev().find(is_name).copied()),
        }
    }
    names
}

fn is_name(token: &&&str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_a_front_page() {
        let front = "pub use a::{B, c};\n#[cfg(x)]\npub use d::E;\nuse f::G;";
        assert_eq!(exported(front).into_iter().collect::<Vec<_>>(), ["B", "E", "c"]);
    }
}
