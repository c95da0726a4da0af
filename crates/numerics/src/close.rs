//! The one comparison of numbers that the tests of the workspace use.

/// Panics unless `got` is within `bound` of `want`, relative to `|want|` where that is above 1.
///
/// # Panics
/// With got, wanted, their difference and the bound, at the caller's line.
///
/// # Example
/// ```
/// numerics::assert_close(1e6 + 1e-7, 1e6, 1e-12);
/// ```
#[track_caller]
pub fn assert_close(got: f64, want: f64, bound: f64) {
    let allowed = bound * want.abs().max(1.0);
    let difference = (got - want).abs();
    assert!(
        difference <= allowed,
        "got {got:e}, wanted {want:e}: they differ by {difference:e}, allowed is {allowed:e}"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "wanted")]
    fn nan_is_close_to_nothing() {
        assert_close(f64::NAN, 0.0, 1.0);
    }
}
