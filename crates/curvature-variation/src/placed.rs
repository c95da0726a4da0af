//! A mesh is faired around the origin and about one unit large: where it has the most digits, and so
//! that neither its place nor its unit of length matters.

use geom_core::{DVec3, Normalization, PolyMesh};
use gp_solver::Stage;

use crate::error::Error;
use crate::functional::Energy;
use crate::input::Input;
use crate::options::Options;
use crate::solution::Solution;

/// An input in normalised coordinates, and the way back.
pub(crate) struct Placed<'i> {
    pub(crate) input: Input,
    /// With the energy that has the same value on the normalised surface.
    pub(crate) options: Options,
    given: (&'i Input, &'i Options),
    place: Normalization,
}

impl<'i> Placed<'i> {
    pub(crate) fn new(given: &'i Input, options: &'i Options) -> Result<Self, Error> {
        let place = Normalization::of(given.mesh.positions())?;
        let mut input = given.clone();
        for mesh in std::iter::once(&mut input.mesh).chain(&mut input.members) {
            mesh.positions_mut().iter_mut().for_each(|p| *p = place.apply(*p));
        }
        for target in input.constraints.limit_points.iter_mut().filter_map(|(_, p)| p.as_mut()) {
            *target = place.apply(DVec3::from_array(*target)).to_array();
        }
        let mut normalised = options.clone();
        for (weight, functional) in &mut normalised.energy.terms {
            *weight *= place.scale().powi(-functional.length_power());
        }
        Ok(Self { input, options: normalised, given: (given, options), place })
    }

    /// A stage whose unknowns are normalised coordinates.
    pub(crate) fn stage(&self, stage: Stage) -> Stage {
        stage.at(self.place.center().to_array(), self.place.scale())
    }

    /// The result in the model's coordinates and units. Vertices that have not moved come back to
    /// the bit.
    pub(crate) fn back(&self, result: Result<Solution, Error>) -> Result<Solution, Error> {
        let mut solution = result.map_err(|error| named(error, &self.given.1.energy))?;
        self.restore(&mut solution.result);
        self.restore(&mut solution.initial);
        let unit = self.place.scale().recip();
        solution.before.scale_lengths(unit);
        solution.after.scale_lengths(unit);
        solution.metrics.restore(self.place);
        Ok(solution)
    }

    fn restore(&self, mesh: &mut PolyMesh) {
        let (here, given) = (self.input.mesh.positions(), self.given.0.mesh.positions());
        for (k, p) in mesh.positions_mut().iter_mut().enumerate() {
            *p = if here.get(k) == Some(p) { given[k] } else { self.place.restore(*p) };
        }
    }
}

/// The error with the energy as it was given.
fn named(mut error: Error, given: &Energy) -> Error {
    match &mut error {
        Error::ScaleFree { energy } | Error::Unbounded { energy, .. } | Error::Torn { energy } => {
            *energy = given.to_string();
        }
        _ => {}
    }
    error
}
