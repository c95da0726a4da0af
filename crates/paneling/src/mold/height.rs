//! Values of height functions.

/// Most parameters a mold can have.
pub(crate) const MAX_PARAMETERS: usize = 7;

/// A height function and its derivatives at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Height {
    pub(crate) f: f64,
    pub(crate) fx: f64,
    pub(crate) fy: f64,
    pub(crate) fxx: f64,
    pub(crate) fxy: f64,
    pub(crate) fyy: f64,
}

/// Derivatives of `f, f_x, f_y` in the parameters of the mold.
pub(crate) type ParameterRows = [[f64; MAX_PARAMETERS]; 3];

/// Beyond the reach of a round mold.
pub(crate) const UNREACHED: Height =
    Height { f: f64::NAN, fx: f64::NAN, fy: f64::NAN, fxx: f64::NAN, fxy: f64::NAN, fyy: f64::NAN };
