//! Models in other units.

use crate::error::ReadError;
use crate::model::Model;
use crate::unit::LengthUnit;
use bspline::SplineError;
use geom_core::DVec3;

/// Vertex and face fields that are curvatures, with the power of the length below the line.
const CURVATURES: [(&str, i32); 4] = [("h", 1), ("k", 2), ("k1", 1), ("k2", 1)];

impl Model {
    /// The same things with their lengths in another unit: all coordinates are multiplied, the
    /// fields `H`, `K`, `k1`, `k2` of meshes divided. Other fields stay, since nobody knows what
    /// they are.
    ///
    /// # Errors
    /// [`ReadError`] if a coordinate leaves the range of `f64`.
    ///
    /// # Example
    /// ```
    /// use exchange::{LengthUnit, Mesh, Model};
    /// let mesh = Mesh::new(vec![geom_core::DVec3::new(1.0, 2.0, 3.0)], [[0_u32; 0]; 0]);
    /// let inches = Model::of_mesh(mesh, LengthUnit::Inch);
    /// let millimetres = inches.in_unit(LengthUnit::Millimetre)?;
    /// assert_eq!(millimetres.meshes[0].positions[0].x, 25.4);
    /// # Ok::<(), exchange::ReadError>(())
    /// ```
    pub fn in_unit(mut self, unit: LengthUnit) -> Result<Self, ReadError> {
        if unit == self.unit {
            return Ok(self);
        }
        let factor = Ratio::between(&self.unit, &unit);
        let far = || {
            let what = format!("a coordinate is beyond the largest number of {unit}");
            ReadError::content(what, "take another unit")
        };
        let scaled = |p: DVec3| p.to_array().map(|x| factor.apply(x)).into();
        let spline = |_: SplineError| far();
        for named in &mut self.surfaces {
            named.surface = named.surface.mapped(scaled).map_err(spline)?;
            let trim = named.trim.take();
            named.trim = trim.map(|t| t.with_mapped_edges(scaled)).transpose().map_err(spline)?;
        }
        let grids = self.grids.iter_mut().flat_map(|g| &mut g.points);
        let vertices = self.meshes.iter_mut().flat_map(|m| &mut m.positions);
        for p in grids.chain(vertices) {
            *p = scaled(*p);
            if !p.is_finite() {
                return Err(far());
            }
        }
        let fields = self
            .meshes
            .iter_mut()
            .flat_map(|m| m.vertex_fields.iter_mut().chain(&mut m.face_fields));
        for field in fields {
            let name = field.name.to_lowercase();
            if let Some((_, power)) = CURVATURES.iter().find(|(known, _)| *known == name) {
                for value in &mut field.values {
                    *value = (0..*power).fold(*value, |x, _| factor.undo(x));
                }
            }
        }
        self.unit = unit;
        Ok(self)
    }
}

/// A factor that is multiplied or divided, whichever is a whole number where one is.
#[derive(Clone, Copy)]
enum Ratio {
    Times(f64),
    Over(f64),
}

impl Ratio {
    fn between(from: &LengthUnit, to: &LengthUnit) -> Self {
        let (a, b) = (from.metres(), to.metres());
        let nearly_whole = |x: f64| {
            let rounded = (x * 1e4).round() / 1e4;
            if (x / rounded - 1.0).abs() < 1e-14 { rounded } else { x }
        };
        if a >= b { Self::Times(nearly_whole(a / b)) } else { Self::Over(nearly_whole(b / a)) }
    }

    fn apply(self, x: f64) -> f64 {
        match self {
            Self::Times(factor) => x * factor,
            Self::Over(factor) => x / factor,
        }
    }

    fn undo(self, x: f64) -> f64 {
        match self {
            Self::Times(factor) => x / factor,
            Self::Over(factor) => x * factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Field, Mesh};
    use crate::scene::read_scene;
    use geom_core::assert_close;

    #[test]
    fn areas_follow_the_unit_and_come_back() {
        let text = "(unit: \"in\", surfaces: [(u: (degree: 1), v: (degree: 1), \
            control_points: [[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]])])";
        let model = read_scene(text).unwrap();
        let area = model.surfaces[0].curvature_statistics().area;
        let scaled = model.clone().in_unit(LengthUnit::Millimetre).unwrap();
        let in_mm = scaled.surfaces[0].curvature_statistics().area;
        assert_close(in_mm / area / (25.4 * 25.4), 1.0, 1e-14);
        assert_eq!(scaled.surfaces[0].surface.control_point(1, 1), DVec3::splat(25.4));
        assert_eq!(scaled.in_unit(LengthUnit::Inch).unwrap(), model);
    }

    #[test]
    fn curvatures_shrink_and_numbers_stay_round() {
        let mut mesh = Mesh::new(vec![DVec3::new(3.0, 0.5, 1e4)], [[0_u32; 0]; 0]);
        let field = |name: &str| Field { name: name.into(), values: vec![8.0] };
        mesh.vertex_fields = ["H", "K", "K1", "mold"].map(field).to_vec();
        let model = Model::of_mesh(mesh, LengthUnit::Millimetre);
        let cm = model.clone().in_unit(LengthUnit::Centimetre).unwrap();
        assert_eq!(cm.meshes[0].positions[0].to_array(), [0.3, 0.05, 1e3]);
        let values: Vec<f64> = cm.meshes[0].vertex_fields.iter().map(|f| f.values[0]).collect();
        assert_eq!(values, [80.0, 800.0, 80.0, 8.0]);
        let mut far = model;
        far.meshes[0].positions[0].x = 1e308;
        let error = far.in_unit(LengthUnit::from_metres("pm", 1e-12)).unwrap_err().to_string();
        assert_eq!(error, "a coordinate is beyond the largest number of pm; take another unit");
    }

    #[test]
    fn what_a_format_cannot_hold_is_said() {
        let metre = LengthUnit::Metre;
        let obj = "OBJ holds no unit of length; its numbers are in m";
        assert_eq!(metre.lost_in("obj").unwrap(), obj);
        for extension in ["step", "ron", "glb", "ply", "svg"] {
            assert_eq!(metre.lost_in(extension), None);
        }
        assert_eq!(LengthUnit::Millimetre.lost_in("obj"), None);
        let fathom = LengthUnit::from_metres("fathom", 1.8288);
        assert_eq!(fathom.lost_in("step"), None);
        let text = "RON does not know the unit fathom (1.8288 m); its numbers are in that unit";
        assert_eq!(fathom.lost_in("ron").unwrap(), text);
    }
}
