//! A mesh is faired where it has the most digits: around the origin.

use std::borrow::Cow;

use geom_core::{DVec3, Normalization, PolyMesh};

use crate::error::Error;
use crate::input::Input;
use crate::solution::Solution;

/// An input moved to the origin, and the way back.
pub(crate) struct Centred<'i> {
    pub(crate) input: Cow<'i, Input>,
    given: &'i Input,
    origin: DVec3,
}

impl<'i> Centred<'i> {
    /// Moves the centre of the control mesh to the origin, rounded so that nothing else is.
    pub(crate) fn new(given: &'i Input) -> Result<Self, Error> {
        let origin = Normalization::of(given.mesh.positions())?.center();
        if origin == DVec3::ZERO {
            return Ok(Self { input: Cow::Borrowed(given), given, origin });
        }
        let mut input = given.clone();
        for mesh in std::iter::once(&mut input.mesh).chain(&mut input.members) {
            mesh.positions_mut().iter_mut().for_each(|p| *p -= origin);
        }
        for place in input.constraints.limit_points.iter_mut().filter_map(|(_, p)| p.as_mut()) {
            *place = (DVec3::from_array(*place) - origin).to_array();
        }
        Ok(Self { input: Cow::Owned(input), given, origin })
    }

    /// The point of the model that is the origin of the unknowns.
    pub(crate) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The solution where the input was given. Vertices that have not moved come back to the bit.
    pub(crate) fn back(&self, mut solution: Solution) -> Solution {
        if self.origin != DVec3::ZERO {
            self.restore(&mut solution.result);
            self.restore(&mut solution.initial);
        }
        solution
    }

    fn restore(&self, mesh: &mut PolyMesh) {
        let (here, given) = (self.input.mesh.positions(), self.given.mesh.positions());
        for (k, p) in mesh.positions_mut().iter_mut().enumerate() {
            *p = if here.get(k) == Some(p) { given[k] } else { *p + self.origin };
        }
    }
}
