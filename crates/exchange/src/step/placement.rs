//! Where things stand: frames of geometry, and placements of parts in assemblies.

use super::file::StepFile;
use super::parse::Cursor;
use crate::error::ReadError;
use bspline::Frame;
use geom_core::{DMat3, DVec3};
use glam::DAffine3;

impl<'a> StepFile<'a> {
    /// The frame of an `AXIS2_PLACEMENT_3D`, wanted by `from`.
    pub(super) fn frame(&self, id: u64, from: &Cursor<'a>) -> Result<Frame, ReadError> {
        let mut cursor = self.record(id, "AXIS2_PLACEMENT_3D", from)?;
        let here = cursor.clone();
        cursor.skip_arguments(1)?;
        let origin = self.point(cursor.reference()?, &here)?;
        let [z, x] = self.two_axes(&mut cursor)?;
        Ok(Frame::new(origin, z.unwrap_or(DVec3::Z), x))
    }

    /// Two optional directions behind commas.
    fn two_axes(&self, cursor: &mut Cursor<'a>) -> Result<[Option<DVec3>; 2], ReadError> {
        let mut axes = [None, None];
        for axis in &mut axes {
            cursor.comma()?;
            let here = cursor.clone();
            if let Some(id) = cursor.optional_reference()? {
                *axis = Some(self.direction(id, &here)?);
            }
        }
        Ok(axes)
    }

    /// The map from local coordinates to those around a placement or transformation operator.
    pub(super) fn placement(&self, id: u64, from: &Cursor<'a>) -> Result<DAffine3, ReadError> {
        let target = self.index.open(id, from)?;
        if target.record("AXIS2_PLACEMENT_3D").is_some() {
            return Ok(map_of(&self.frame(id, from)?, 1.0, false));
        }
        let simple = target.record("CARTESIAN_TRANSFORMATION_OPERATOR_3D");
        let is_simple = simple.as_ref().is_some_and(|_| self.keyword(id) != b"(");
        let general = target.record("CARTESIAN_TRANSFORMATION_OPERATOR");
        let Some(mut cursor) = (if is_simple { simple.clone() } else { general }) else {
            let what = format!("#{id} is no placement in space");
            return Err(from.error(what, "use an AXIS2_PLACEMENT_3D"));
        };
        // In a simple instance the name comes first and the third axis last.
        let here = cursor.clone();
        if is_simple {
            cursor.skip_arguments(1)?;
        }
        let axis = |cursor: &mut Cursor<'a>| -> Result<Option<DVec3>, ReadError> {
            let id = cursor.optional_reference()?;
            id.map(|id| self.direction(id, &here)).transpose()
        };
        let x = axis(&mut cursor)?;
        cursor.comma()?;
        let y = axis(&mut cursor)?;
        cursor.comma()?;
        let origin = self.point(cursor.reference()?, &here)?;
        cursor.comma()?;
        let scale = cursor.clone().real().unwrap_or(1.0);
        cursor.skip_value()?;
        let z = if is_simple {
            cursor.comma()?;
            axis(&mut cursor)?
        } else {
            match simple {
                Some(mut third) => axis(&mut third)?,
                None => None,
            }
        };
        if !(scale > 0.0) {
            return Err(here.error("a placement with a scale that is not positive", "use 1"));
        }
        let x = x.unwrap_or(DVec3::X);
        let z = z.unwrap_or_else(|| x.cross(y.unwrap_or(DVec3::Y)));
        let frame = Frame::new(origin, z, Some(x));
        let mirrored = y.is_some_and(|y| frame.y.dot(y) < 0.0);
        Ok(map_of(&frame, scale, mirrored))
    }
}

fn map_of(frame: &Frame, scale: f64, mirrored: bool) -> DAffine3 {
    let y = if mirrored { -frame.y } else { frame.y };
    let axes = DMat3::from_cols(scale * frame.x, scale * y, scale * frame.z);
    DAffine3 { matrix3: axes, translation: frame.origin }
}
