//! What a file holds, as plain numbers.

use crate::ball::Ball;
use crate::mold::Mold;
use crate::spline::Spline;
use glam::DVec3;

/// Everything of a file that claims can be recomputed from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Content {
    /// Spline surfaces in the order of the file.
    pub surfaces: Vec<Spline>,
    /// Meshes and clouds of points in the order of the file.
    pub meshes: Vec<Mesh>,
    /// Shape parameters of the quads of the first mesh, if the file has them: those of the
    /// diagonals from corner 0 to corner 2.
    pub shape_parameters: Vec<f64>,
    /// Rows of a table of panels.
    pub panels: Vec<PanelRow>,
    /// The molds the rows of the table refer to, if the file has them.
    pub molds: Vec<Mold>,
    /// Whether the numbers of the file have 24 bits only.
    pub is_single: bool,
    /// Whether only parts of its surfaces count.
    pub is_trimmed: bool,
}

/// Points and faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions.
    pub positions: Vec<DVec3>,
    /// Corners of the faces.
    pub faces: Vec<Vec<usize>>,
}

/// What a table says of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelRow {
    /// Number of its mold.
    pub mold: usize,
    /// Origin of the mold's frame.
    pub origin: DVec3,
    /// First and third axis of the frame.
    pub axes: [DVec3; 2],
    /// Corners in the domain of the design; empty if the file does not have them.
    pub corners: Vec<[f64; 2]>,
    /// Largest kink at its seams, in degrees.
    pub worst_kink_deg: f64,
    /// Largest gap at its seams.
    pub worst_gap: f64,
}

impl Content {
    /// All points of the file: control points, positions.
    pub fn points(&self) -> impl Iterator<Item = DVec3> {
        let nets = self.surfaces.iter().flat_map(Spline::control_points);
        nets.chain(self.meshes.iter().flat_map(|m| m.positions.iter().copied()))
    }

    /// The diameter of the smallest ball around all points, 1 without any, and its centre.
    #[must_use]
    pub fn extent(&self) -> (f64, DVec3) {
        let panels = self.panels.iter().map(|p| p.origin);
        match Ball::around(self.points().chain(panels)) {
            Some(ball) if ball.radius > 0.0 => (2.0 * ball.radius, ball.center),
            Some(ball) => (1.0, ball.center),
            None => (1.0, DVec3::ZERO),
        }
    }

    /// The same moved by a vector.
    #[must_use]
    pub fn moved(&self, by: DVec3) -> Self {
        let mut moved = self.clone();
        moved.surfaces.iter_mut().for_each(|s| *s = s.moved(by));
        moved.meshes.iter_mut().flat_map(|m| &mut m.positions).for_each(|p| *p += by);
        moved.panels.iter_mut().for_each(|p| p.origin += by);
        moved
    }

    /// The largest number of control points in a direction, at least one.
    pub(crate) fn most_in_a_direction(&self) -> usize {
        self.surfaces.iter().flat_map(Spline::counts).fold(1, usize::max)
    }

    /// The one mesh with faces.
    #[must_use]
    pub fn mesh(&self) -> Option<&Mesh> {
        let mut with_faces = self.meshes.iter().filter(|m| !m.faces.is_empty());
        match (with_faces.next(), with_faces.next()) {
            (Some(mesh), None) => Some(mesh),
            _ => None,
        }
    }
}

/// Diagonal of the box around some points.
#[must_use]
pub(crate) fn diagonal(points: impl Iterator<Item = DVec3>) -> Option<f64> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in points {
        (low, high) = (low.min(p), high.max(p));
    }
    (low.x <= high.x).then(|| low.distance(high))
}

/// Mean of some points.
#[must_use]
pub(crate) fn centroid(points: impl Iterator<Item = DVec3>) -> Option<DVec3> {
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for p in points {
        (sum, count) = (sum + p, count + 1.0);
    }
    (count > 0.0).then(|| sum / count)
}
