//! Where a model stands: everything is solved and measured at the origin and moved back.

use geom_core::{DVec3, Normalization, NormalizationError};

use crate::boundary::four_curves::PatchBoundary;
use crate::boundary::solved::Boundary;
use crate::curve::bezier::BezierCurve;
use crate::data::corners::{AsymptoticNet, CornerData};
use crate::input::{Input, InputData};
use crate::patch::solve::FilledPatch;
use crate::patch::surface::Patch;
use crate::relax::relaxed::Relaxed;
use crate::shell::gridshell::Gridshell;

/// What can stand somewhere else.
pub(crate) trait Moved {
    /// The same, moved.
    fn moved(self, by: DVec3) -> Self;
}

impl Input {
    /// Where the points of the data stand. Points that are missing or not finite are left to the
    /// checks of the data, which name them.
    pub(crate) fn center(&self) -> Result<DVec3, NormalizationError> {
        let place = match &self.data {
            InputData::Patch(data) => Normalization::of(&data.corners),
            InputData::Net(net) => Normalization::of(net.positions()),
            InputData::Polylines(lines) => Normalization::of(&lines.concat()),
            InputData::Mesh(mesh) => Normalization::of(mesh.positions()),
        };
        match place {
            Err(NormalizationError::Empty) => Ok(DVec3::ZERO),
            place => place.map(|place| place.center()),
        }
    }
}

impl Moved for InputData {
    fn moved(self, by: DVec3) -> Self {
        match self {
            Self::Patch(data) => Self::Patch(Box::new(data.moved(by))),
            Self::Net(net) => Self::Net(net.moved(by)),
            Self::Polylines(mut lines) => {
                lines.iter_mut().flatten().for_each(|p| *p += by);
                Self::Polylines(lines)
            }
            Self::Mesh(mut mesh) => {
                mesh.positions_mut().iter_mut().for_each(|p| *p += by);
                Self::Mesh(mesh)
            }
        }
    }
}

impl Moved for CornerData {
    fn moved(mut self, by: DVec3) -> Self {
        for points in [&mut self.corners, &mut self.start_points, &mut self.end_points] {
            points.iter_mut().for_each(|p| *p += by);
        }
        self
    }
}

impl Moved for AsymptoticNet {
    fn moved(mut self, by: DVec3) -> Self {
        self.positions.iter_mut().for_each(|p| *p += by);
        self
    }
}

impl Moved for PatchBoundary {
    fn moved(self, by: DVec3) -> Self {
        Self { curves: self.curves.map(|curve| curve.moved(by)), ..self }
    }
}

impl Moved for Gridshell {
    fn moved(self, by: DVec3) -> Self {
        Self {
            boundary: self.boundary.moved(by),
            patches: self.patches.moved(by),
            outlines: self.outlines.moved(by),
            ..self
        }
    }
}

impl Moved for Boundary {
    fn moved(self, by: DVec3) -> Self {
        Self { curves: self.curves.moved(by), ..self }
    }
}

impl Moved for FilledPatch {
    fn moved(self, by: DVec3) -> Self {
        Self { patch: self.patch.moved(by), ..self }
    }
}

impl Moved for Relaxed {
    fn moved(self, by: DVec3) -> Self {
        Self { net: self.net.moved(by), ..self }
    }
}

impl Moved for Patch {
    fn moved(self, by: DVec3) -> Self {
        Self::new(self.degree(), self.points().iter().map(|&p| p + by).collect())
    }
}

impl Moved for BezierCurve {
    fn moved(self, by: DVec3) -> Self {
        self.translated(by)
    }
}

impl<T: Moved> Moved for Vec<T> {
    fn moved(self, by: DVec3) -> Self {
        self.into_iter().map(|item| item.moved(by)).collect()
    }
}
