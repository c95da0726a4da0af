//! Settings of a transformation.

use geom_core::DVec3;
use gp_solver::{List, ListItem, OptionValue, options, serde_as_text};
use serde::{Deserialize, Serialize};

use super::cage::Freedom;
use super::error::{CageFault, Error};
use super::map::Branch;

/// Where a corner of the cage goes.
///
/// ```
/// use gp_solver::OptionValue;
/// use hyperbolic_nets::darboux::Corner;
/// let corner = Corner::read("7=1.5,-2,0.3")?;
/// assert_eq!((corner.index, corner.point.y), (7, -2.0));
/// assert_eq!(corner.print().as_deref(), Some("7=1.5,-2,0.3"));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Number of the corner: at the high end in x, y, z where bit 0, 1, 2 is set.
    pub index: usize,
    /// Where it goes, in units of the model.
    pub point: DVec3,
}

impl OptionValue for Corner {
    const FORM: &'static str = "I=X,Y,Z";

    fn read(text: &str) -> Result<Self, String> {
        let parse = || {
            let (index, point) = text.split_once('=')?;
            let numbers: Vec<f64> =
                point.split(',').map(|x| x.trim().parse().ok()).collect::<Option<_>>()?;
            let index = index.trim().parse().ok().filter(|i| *i < 8)?;
            match numbers[..] {
                [x, y, z] if [x, y, z].iter().all(|v: &f64| v.is_finite()) => {
                    Some(Self { index, point: DVec3::new(x, y, z) })
                }
                _ => None,
            }
        };
        parse().ok_or_else(|| {
            format!(
                "`{text}` is not of the form i=x,y,z with a corner number 0 to 7, as in 7=1.5,2,0.3"
            )
        })
    }

    fn print(&self) -> Option<String> {
        let Self { index, point: DVec3 { x, y, z } } = self;
        Some(format!("{index}={x},{y},{z}"))
    }
}

impl ListItem for Corner {
    const BETWEEN: char = ';';
    const LIST_FORM: &'static str = "I=X,Y,Z";
}

serde_as_text!(Corner);

options! {
    /// Settings of [`crate::darboux::solve`].
    ///
    /// With `c`, coordinates are counted from the middle of the smallest ball around the net in lengths
    /// of its diameter, so that a turned net has the turned image. With corners, those of the net's
    /// bounding box, enlarged by 5 % of its diagonal, move.
    ///
    /// # Example
    /// ```
    /// use geom_core::DVec3;
    /// use hyperbolic_nets::darboux::{Corner, Options};
    /// // One corner of the cage is pulled; the others stay.
    /// let pulled = Corner { index: 7, point: DVec3::new(1.2, 1.1, 0.9) };
    /// let options = Options { corners: vec![pulled].into(), ..Options::default() };
    /// assert!(options.check().is_ok());
    /// // A centre as well would be two transformations at once.
    /// assert!(Options { c: Some(-0.6), ..options }.check().is_err());
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct Options {
        /// Centre of the transformation, not 1.
        c: Option<f64> = None;
        /// Where a corner of the cage goes (repeatable); the others stay.
        ///
        /// Of several values for one corner the last counts.
        corners as "corner": List<Corner> = List::default();
        /// Degrees of freedom of a transformation by its cage: 16 as published, 19 in general.
        freedom: Freedom = Freedom::Nineteen;
        /// Which of the two images: regular at the middle of the box or through the cage's corners,
        /// or the other one.
        branch: Branch = Branch::Regular;
    }
}

impl Options {
    /// Refuses what makes no sense.
    ///
    /// # Errors
    /// [`Error`] names the fields.
    pub fn check(&self) -> Result<(), Error> {
        if let Some(c) = self.c.filter(|c| !c.is_finite() || *c == 1.0) {
            return Err(Error::BadCentre { c });
        }
        if self.corners.iter().any(|corner| !corner.point.is_finite() || corner.index > 7) {
            return Err(CageFault::NotFinite.into());
        }
        match (self.c.is_some(), self.corners.is_empty()) {
            (true, false) => Err(Error::TwoTransformations),
            (false, true) => Err(Error::NoTransformation),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_a_number_and_a_point() {
        let want = Corner { index: 7, point: DVec3::new(1.5, -2.0, 0.3) };
        assert_eq!(Corner::read("7=1.5,-2,0.3"), Ok(want));
        for bad in ["8=0,0,0", "1=2,3", "1", "x=1,2,3", "1=a,2,3", "1=nan,0,0"] {
            assert!(Corner::read(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn one_way_to_transform_is_needed() {
        let corner = Corner { index: 1, point: DVec3::ONE };
        let by = |c: Option<f64>, corners: &[Corner]| {
            Options { c, corners: corners.to_vec().into(), ..Options::default() }.check()
        };
        assert_eq!(by(None, &[]), Err(Error::NoTransformation));
        assert_eq!(by(Some(0.5), &[corner]), Err(Error::TwoTransformations));
        assert_eq!(by(Some(1.0), &[]), Err(Error::BadCentre { c: 1.0 }));
        assert_eq!((by(Some(0.5), &[]), by(None, &[corner])), (Ok(()), Ok(())));
    }
}
