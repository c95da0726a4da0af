//! What a file can hold.

use crate::mesh::Mesh;
use crate::unit::LengthUnit;
use bspline::{BsplineSurface, Trim};
use geom_core::{CurvatureStatistics, DVec3};

/// A surface with the name it has in files; the name may be empty.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSurface {
    /// Shown as the face's name in CAD programs.
    pub name: String,
    /// The surface.
    pub surface: BsplineSurface,
    /// The part of the surface that counts; without, all of it.
    pub trim: Option<Trim>,
    /// Linear RGB in 0..=1, if the file gives the face a colour.
    pub color: Option<[f32; 3]>,
    /// The layer it stands on, in formats that have layers; may be empty.
    pub layer: String,
}

impl NamedSurface {
    /// A whole surface without a colour.
    #[must_use]
    pub fn new(name: impl Into<String>, surface: BsplineSurface) -> Self {
        Self { name: name.into(), surface, trim: None, color: None, layer: String::new() }
    }

    /// Area and curvatures of the part that counts.
    #[must_use]
    pub fn curvature_statistics(&self) -> CurvatureStatistics {
        match &self.trim {
            None => self.surface.curvature_statistics(),
            Some(trim) => self.surface.curvature_statistics_within(trim),
        }
    }
}

/// A regular grid of points, `points[i * n_v + j]`.
#[derive(Clone, Debug, PartialEq)]
pub struct PointGrid {
    /// The name, may be empty.
    pub name: String,
    /// Number of points in the first direction.
    pub n_u: usize,
    /// Number of points in the second direction.
    pub n_v: usize,
    /// The points.
    pub points: Vec<DVec3>,
}

/// The content of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// What a coordinate of 1 means.
    pub unit: LengthUnit,
    /// B-spline surfaces.
    pub surfaces: Vec<NamedSurface>,
    /// Point grids.
    pub grids: Vec<PointGrid>,
    /// Meshes, polylines and points.
    pub meshes: Vec<Mesh>,
    /// What the reader had to leave out.
    pub warnings: Vec<String>,
}

impl Model {
    /// One surface, nothing else.
    #[must_use]
    pub fn of_surface(name: &str, surface: BsplineSurface, unit: LengthUnit) -> Self {
        let surfaces = vec![NamedSurface::new(name, surface)];
        Self { unit, surfaces, ..Self::default() }
    }

    /// Mean of the control points of all surfaces, or, without surfaces, of the vertices of all
    /// meshes; `None` for neither.
    #[must_use]
    pub fn centroid(&self) -> Option<DVec3> {
        let nets = self.surfaces.iter().flat_map(|s| s.surface.control_points());
        let vertices = self.meshes.iter().flat_map(|m| &m.positions);
        let mean = |points: &mut dyn Iterator<Item = &DVec3>| {
            let (sum, count) = points.fold((DVec3::ZERO, 0.0), |(s, n), p| (s + *p, n + 1.0));
            (count > 0.0).then(|| sum / count)
        };
        if self.surfaces.is_empty() { mean(&mut { vertices }) } else { mean(&mut { nets }) }
    }

    /// One mesh, nothing else.
    #[must_use]
    pub fn of_mesh(mesh: Mesh, unit: LengthUnit) -> Self {
        Self { unit, meshes: vec![mesh], ..Self::default() }
    }
}
