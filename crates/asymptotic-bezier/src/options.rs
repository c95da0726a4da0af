//! Settings of a run.

use gp_solver::{List, ListItem, OptionValue, options, serde_as_text};
use serde::{Deserialize, Serialize};

use crate::boundary::options::{BoundaryEnergy, BoundaryOptions, CurveForm};
use crate::error::Error;
use crate::patch::mask::Interior;
use crate::patch::options::{Ansatz, PatchOptions};
use crate::shell::joins::Joins;

/// Degree of the curves of a single patch that needs no curvatures.
const QUARTIC: usize = 4;

/// One number or a range for a corner or vertex, `00=1.2` or `00=0.5..2`.
#[derive(Clone, Debug, PartialEq)]
pub struct Wish {
    /// Name of a corner (`00`, `10`, `01`, `11`) or number of a vertex.
    pub corner: String,
    /// Least value.
    pub min: f64,
    /// Greatest value; one value if it is the least as well.
    pub max: f64,
}

impl OptionValue for Wish {
    const FORM: &'static str = "CORNER=X";

    fn read(text: &str) -> Result<Self, String> {
        let number = |t: &str| t.trim().parse::<f64>().ok();
        let wish = text.split_once('=').and_then(|(corner, value)| {
            let (min, max) = value.split_once("..").unwrap_or((value, value));
            Some(Self { corner: corner.trim().to_owned(), min: number(min)?, max: number(max)? })
        });
        wish.ok_or_else(|| {
            format!("`{text}` is not of the form CORNER=NUMBER or CORNER=MIN..MAX, as in 00=0.5..2")
        })
    }

    fn print(&self) -> Option<String> {
        let Self { corner, min, max } = self;
        Some(if min == max { format!("{corner}={min}") } else { format!("{corner}={min}..{max}") })
    }
}

impl ListItem for Wish {
    const BETWEEN: char = ',';
    const LIST_FORM: &'static str = "CORNER=X";
}

serde_as_text!(Wish);

options! {
    /// Settings of a run.
    ///
    /// # Example
    /// ```
    /// use asymptotic_bezier::{Ansatz, Joins, Options};
    /// let options = Options { joins: Joins::G2, degree: Some(9), ..Options::default() };
    /// assert_eq!((options.ansatz, options.boundary_degree), (Ansatz::Module, None));
    /// assert!(Options::FIELDS.iter().any(|field| field.name == "joins"));
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct Options {
        /// Degree of the patches, 5 to 15; without it 7, and 8 or 11 where 7 folds.
        degree: Option<usize> = None;
        /// Tangent fields: all polynomial ones, or the published ansatz of degree eleven.
        ///
        /// Wang et al. 2019, Eq. 4.1; `paper_free` leaves the free coefficients of `x` to the energy.
        ansatz: Ansatz = Ansatz::Module;
        /// How the inner control points are found: with the tangent fields, or by a mask.
        interior: Interior = Interior::ThinPlate;
        /// Degree of boundary curves made from curvatures, 5 to 9; 4 for exact data of one patch,
        /// curvatures unused.
        boundary_degree: Option<usize> = None;
        /// What the boundary curves are made from: tangents and curvatures as given, or normals (of
        /// degree 7), which inflections do not disturb; auto takes normals if a net made from
        /// positions needs them.
        curves: CurveForm = CurveForm::Auto;
        /// What the freedom of boundary curves made from curvatures minimises; without it strain.
        boundary_energy: Option<BoundaryEnergy> = None;
        /// Take the input for a quad mesh along asymptotic lines and estimate its curves.
        ///
        /// For programs that read files: it says which [`InputData`](crate::InputData) to make.
        from_net: bool = false;
        /// How patches of a net join: common tangent planes, common cross derivatives where the
        /// curves allow it, or besides the least jump of the mean curvature.
        joins: Joins = Joins::G1;
        /// Torsion of the curves in the u-direction at a corner (00, 10, 01, 11) or vertex (its
        /// number), as 00=1.2 or 00=0.5..2 (repeatable).
        torsion: List<Wish> = List::default();
        /// Gaussian curvature at a corner or vertex, as 00=-0.4 or 00=-1..-0.2 (repeatable).
        gauss: List<Wish> = List::default();
        /// Move tangents and curvatures of bad data, a little and within limits.
        relaxed: bool = false;
        /// Width of the lamellas across the surface; without it 1/20 of the longest one.
        lamella_width: Option<f64> = None;
        /// Thickness of the lamellas; without it 1/20 of their width.
        lamella_thickness: Option<f64> = None;
        /// Young's modulus of the lamellas, for stresses and energies in the table.
        youngs_modulus: Option<f64> = None;
        /// Shear modulus of the lamellas.
        shear_modulus: Option<f64> = None;
    }
}

impl Options {
    /// Everything that can be checked without the input.
    ///
    /// # Errors
    /// [`Error::BadOption`], [`Error::OnlyForCurvatures`].
    pub fn check(&self) -> Result<(), Error> {
        let sizes = [
            ("lamella_width", self.lamella_width),
            ("lamella_thickness", self.lamella_thickness),
            ("youngs_modulus", self.youngs_modulus),
            ("shear_modulus", self.shear_modulus),
        ];
        for (name, value) in sizes {
            if let Some(value) = value
                && !(value > 0.0 && value.is_finite())
            {
                return Err(Error::BadOption { name, value, need: "positive and finite" });
            }
        }
        if let (CurveForm::Normals, Some(&name)) = (self.curves, self.for_curvatures().first()) {
            return Err(Error::OnlyForCurvatures { name });
        }
        let moduli = [
            ("youngs_modulus", self.youngs_modulus, "shear_modulus", self.shear_modulus),
            ("shear_modulus", self.shear_modulus, "youngs_modulus", self.youngs_modulus),
        ];
        for (given, one, missing, other) in moduli {
            if one.is_some() && other.is_none() {
                return Err(Error::OneModulus { given, missing });
            }
        }
        Ok(())
    }

    /// The settings given that curves made from normals have no use for.
    pub(crate) fn for_curvatures(&self) -> Vec<&'static str> {
        let degree = self.boundary_degree.map(|_| "boundary_degree");
        let energy = self.boundary_energy.map(|_| "boundary_energy");
        degree.into_iter().chain(energy).collect()
    }

    /// Whether the quartics of a single patch are asked for.
    pub(crate) fn wants_quartics(&self) -> bool {
        self.boundary_degree == Some(QUARTIC)
    }

    pub(crate) fn boundary(&self) -> BoundaryOptions {
        let default = BoundaryOptions::default();
        BoundaryOptions {
            form: self.curves,
            degree: self.boundary_degree.unwrap_or(default.degree),
            energy: self.boundary_energy.unwrap_or_default(),
            torsions: Vec::new(),
        }
    }

    pub(crate) fn patch(&self) -> PatchOptions {
        PatchOptions {
            degree: self.degree,
            ansatz: self.ansatz,
            interior: self.interior,
            ..PatchOptions::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_print_what_they_read() {
        for text in ["00=1.2", "7=-0.5..2"] {
            assert_eq!(Wish::read(text).unwrap().print().as_deref(), Some(text));
        }
        let message = Wish::read("00").unwrap_err();
        assert!(message.contains("CORNER=NUMBER"), "{message}");
    }

    #[test]
    fn nonsense_is_refused_by_the_name_of_its_field() {
        let message = |change: fn(&mut Options)| {
            let mut options = Options::default();
            change(&mut options);
            options.check().unwrap_err().to_string()
        };
        assert!(message(|o| o.lamella_width = Some(-1.0)).starts_with("`lamella_width` is -1"));
        let moduli = message(|o| o.shear_modulus = Some(1.0));
        assert!(moduli.contains("`youngs_modulus`"), "{moduli}");
        let both = message(|o| {
            o.curves = CurveForm::Normals;
            o.boundary_energy = Some(BoundaryEnergy::Jerk);
        });
        assert!(both.starts_with("`boundary_energy` is for curves"), "{both}");
        assert_eq!(Options::default().check(), Ok(()));
    }
}
