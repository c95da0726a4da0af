//! Dense decompositions and number types have one home, the crate `numerics`.

use super::tokens::{tokens, without_tests};

/// Where they may be defined; the second is sparse and banded factorisations.
const HOMES: &[&str] = &["crates/numerics/", "crates/gp-solver/src/linear/"];

/// Words in the names of functions that decompose a matrix.
const DECOMPOSITIONS: &[&str] =
    &["cholesky", "eigenvector", "eigenvectors", "householder", "jordan", "lu", "qr", "svd"];

/// Numbers that kernels run on.
const NUMBER_TYPES: &[&str] = &["Dual", "Lanes", "Taylor"];

/// Looks at one source, `shown` is its path from the root.
pub(crate) fn check(shown: &str, text: &str, faults: &mut Vec<String>) {
    let is_source = shown.starts_with("crates/") && shown.contains("/src/");
    if is_source && !HOMES.iter().any(|home| shown.starts_with(home)) {
        for name in strays(text) {
            faults.push(format!("{shown}: {name} belongs in numerics; use or move it there"));
        }
    }
}

/// Names of the decompositions and number types that a source defines outside of its tests.
fn strays(text: &str) -> Vec<&str> {
    let all = tokens(text);
    let (kept, _) = without_tests(&all);
    let is_stray = |pair: &&[&str]| match pair[0] {
        "fn" => pair[1].split('_').any(|word| DECOMPOSITIONS.contains(&word)),
        "struct" => NUMBER_TYPES.contains(&pair[1]),
        _ => false,
    };
    kept.windows(2).filter(is_stray).map(|pair| pair[1]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strays_are_items_of_known_names() {
        assert_eq!(strays("\npub(crate) fn small_qr(a: &mut [f64]) {"), ["small_qr"]);
        assert_eq!(strays("mod a { struct Dual<T> { v: T } }"), ["Dual"]);
        assert!(
            strays("// fn lu(a)\nstruct DualBlock; let x = lu_solve(a); fn value() {}").is_empty()
        );
        assert!(strays("#[cfg(test)] mod tests { fn householder_keeps_lengths() {} }").is_empty());
    }

    #[test]
    fn homes_are_left_alone() {
        let mut faults = Vec::new();
        check("crates/gp-solver/src/linear/band.rs", "fn cholesky() {}", &mut faults);
        check("crates/paneling/tests/all.rs", "fn cholesky() {}", &mut faults);
        assert!(faults.is_empty());
        check("crates/paneling/src/small.rs", "fn cholesky() {}", &mut faults);
        assert_eq!(
            faults,
            ["crates/paneling/src/small.rs: cholesky belongs in numerics; use or move it there"]
        );
    }
}
