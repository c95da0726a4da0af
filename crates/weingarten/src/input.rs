//! What is optimised.

use bspline::{BsplineSurface, Trim};

/// A surface, or the part of it that counts. Outside of the part nothing is asked of the
/// curvatures; control points without influence inside follow fairness and closeness alone. The
/// parameters of the surface stay, so that the trim bounds the result as well (its curves in the
/// parameter plane; those in space move).
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    pub(crate) surface: &'a BsplineSurface,
    pub(crate) trim: Option<&'a Trim>,
    pub(crate) start: Option<&'a BsplineSurface>,
}

impl<'a> Input<'a> {
    /// The part of `surface` that `trim` bounds; all of it without.
    ///
    /// # Example
    /// ```
    /// use bspline::{ArcSpans, BsplineCurve, Trim, TrimCurve, TrimLoop};
    /// use geom_core::DVec3;
    /// use weingarten::{Input, Options, solve};
    /// let roof = fixtures::surfaces::Shape::Roof.surface(8, 7, 4, 4);
    /// let (center, turn) = (DVec3::new(0.5, 0.5, 0.0), ArcSpans::new(0.0, std::f64::consts::TAU));
    /// let parameters = BsplineCurve::arc(center, 0.4 * DVec3::X, 0.4 * DVec3::Y, turn)?;
    /// let disc = TrimLoop::new(vec![TrimCurve { parameters, edge: None }], 1e-12)?;
    /// let trim = Trim::new(vec![disc])?;
    /// let solution = solve(Input::within(&roof, Some(&trim)), &Options::default(), &mut ())?;
    /// assert!(solution.metrics.alignment_rms < 0.5 * solution.before.alignment_rms);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn within(surface: &'a BsplineSurface, trim: Option<&'a Trim>) -> Self {
        Self { surface, trim, start: None }
    }

    /// Begins at another surface over the same domain, a result of before perhaps: terms and
    /// reference stay those of the surface, damping begins afresh.
    ///
    /// # Example
    /// ```
    /// use weingarten::{Input, Options, solve};
    /// let roof = fixtures::surfaces::Shape::Roof.surface(8, 7, 4, 4);
    /// let first = solve(&roof, &Options::default(), &mut ())?;
    /// let further = solve(
    ///     Input::from(&roof).starting_from(&first.result),
    ///     &Options::default(),
    ///     &mut (),
    /// )?;
    /// let end = |s: &weingarten::Solution| s.report.stages[0].solver.final_energy;
    /// assert!(end(&further) <= end(&first));
    /// # Ok::<(), weingarten::Error>(())
    /// ```
    #[must_use]
    pub fn starting_from(self, start: &'a BsplineSurface) -> Self {
        Self { start: Some(start), ..self }
    }
}

impl<'a> From<&'a BsplineSurface> for Input<'a> {
    fn from(surface: &'a BsplineSurface) -> Self {
        Self { surface, trim: None, start: None }
    }
}
