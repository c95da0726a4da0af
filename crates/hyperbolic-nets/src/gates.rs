//! What to know about an input net before it is solved.

use crate::net::signs;
use crate::{AsymptoticField, Error, QuadNet, Warning};

/// Share of negatively curved area below which a net is refused, and below which it is warned of.
const NEGATIVE_SHARE: [f64; 2] = [0.60, 0.95];
/// Mean misalignment in degrees above which a net is refused, and above which it is warned of.
const MISALIGNMENT_DEG: [f64; 2] = [20.0, 12.0];
/// Share of wrongly twisted edges above which a net is taken for one along curvature lines.
const WRONG_TWISTS: f64 = 0.25;
/// Height of the control tetrahedron over its edges below which a face counts as planar.
const PLANAR_RATIO: f64 = 1e-9;

/// Measures of an input net.
#[derive(Clone, Debug, PartialEq)]
pub struct GateReport {
    /// Share of the reference surface with negative Gaussian curvature, 0 to 1.
    pub negative_share: f64,
    /// Mean angle between edges and asymptotic directions, in radians; 0 where there are none.
    pub misalignment: f64,
    /// Edges that twist against their family.
    pub wrong_twists: usize,
    /// Number of edges.
    pub edges: usize,
    /// Inner edges at which the net folds back.
    pub folds: usize,
    /// Faces with all corners in a plane.
    pub planar_faces: Vec<usize>,
    /// Whether the vertices can be coloured alternately.
    pub two_colourable: bool,
}

/// Measures a net; `field` belongs to its reference surface.
#[must_use]
pub fn inspect(net: &QuadNet, field: &AsymptoticField<'_>) -> GateReport {
    let positions = net.positions();
    let normals = net.vertex_normals(positions);
    let (_, wrong_twists) = signs(net, positions, &normals);
    let planar = |q: &[u32; 4]| {
        let [a, b, c, d] = q.map(|v| positions[v as usize]);
        let volume = (b - a).cross(d - a).dot(c - a).abs();
        let longest =
            [b - a, c - b, d - c, a - d].map(|e| e.length()).into_iter().fold(0.0, f64::max);
        volume <= PLANAR_RATIO * longest.powi(3)
    };
    let planar_faces: Vec<usize> =
        (0..net.quads().len()).filter(|&f| planar(&net.quads()[f])).collect();
    // A skew quad is a saddle whatever lies around it; this is all that is known of nets too small
    // for a fit.
    let skew = 1.0 - planar_faces.len() as f64 / net.quads().len() as f64;
    GateReport {
        negative_share: field.known_negative_share().unwrap_or(skew),
        misalignment: field.mean_misalignment(net),
        wrong_twists,
        edges: net.edges().len(),
        folds: net.inner_edges().iter().filter(|e| net.join(e, positions).is_folded()).count(),
        planar_faces,
        two_colourable: net.colours().is_some(),
    }
}

impl GateReport {
    /// Warnings for what is unusual.
    ///
    /// # Errors
    /// [`Error::CurvatureAligned`], [`Error::NotNegativelyCurved`] or
    /// [`Error::Misaligned`] for nets that no solver here can make smooth.
    pub fn check(&self) -> Result<Vec<Warning>, Error> {
        let (wrong, edges) = (self.wrong_twists, self.edges);
        let percent = 100.0 * self.negative_share;
        if self.negative_share < NEGATIVE_SHARE[0] {
            return Err(Error::NotNegativelyCurved { percent, needed: 100.0 * NEGATIVE_SHARE[0] });
        }
        if wrong as f64 > WRONG_TWISTS * edges as f64 {
            return Err(Error::CurvatureAligned { wrong, edges });
        }
        let mean_deg = self.misalignment.to_degrees();
        if mean_deg > MISALIGNMENT_DEG[0] {
            return Err(Error::Misaligned { mean_deg, limit_deg: MISALIGNMENT_DEG[0] });
        }
        let mut warnings = Vec::new();
        if self.negative_share < NEGATIVE_SHARE[1] {
            warnings.push(Warning::NotEverywhereNegative { percent: 100.0 - percent });
        }
        if mean_deg > MISALIGNMENT_DEG[1] {
            warnings.push(Warning::Misaligned { mean_deg });
        }
        if wrong > 0 {
            warnings.push(Warning::WrongTwists { wrong, edges });
        }
        if self.folds > 0 {
            warnings.push(Warning::Folds { edges: self.folds });
        }
        if let Some(&first) = self.planar_faces.first() {
            warnings.push(Warning::PlanarFaces { count: self.planar_faces.len(), first });
        }
        if !self.two_colourable {
            warnings.push(Warning::NotTwoColourable);
        }
        Ok(warnings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BoundaryPolygon;
    use fixtures::asymptotic_nets;
    use geom_core::{DVec3, PolyMesh, TriMesh};

    fn gates(positions: Vec<DVec3>, quads: &[[u32; 4]]) -> GateReport {
        let mesh = PolyMesh::new(positions, quads).unwrap();
        let triangles = TriMesh::from_poly_mesh(&mesh);
        inspect(&QuadNet::new(&mesh).unwrap(), &AsymptoticField::new(&triangles))
    }

    fn grid(n: u32, f: impl Fn(f64, f64) -> DVec3) -> (Vec<DVec3>, Vec<[u32; 4]>) {
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let t = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
        let positions = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| (i, j)))
            .map(|(i, j)| f(t(i), t(j)))
            .collect();
        let quads = (0..n)
            .flat_map(|i| {
                (0..n).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
            })
            .collect();
        (positions, quads)
    }

    #[test]
    fn good_nets_pass_and_the_odd_ring_is_told_apart() {
        let good = asymptotic_nets::catenoid(24, 16).jittered(0.05, 2);
        let report = gates(good.positions, &good.quads);
        assert_eq!(report.check().unwrap(), vec![]);
        let odd = asymptotic_nets::catenoid_odd();
        let warnings = gates(odd.positions, &odd.quads).check().unwrap();
        assert_eq!(warnings, vec![Warning::NotTwoColourable]);
    }

    #[test]
    fn jittered_boundaries_prescribe_an_impossible_product() {
        let net = |model: asymptotic_nets::AsymptoticNet| {
            QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap()
        };
        // An exact asymptotic net has the product 1 by the Lelieuvre equations.
        let exact = BoundaryPolygon::new(&net(asymptotic_nets::enneper()));
        assert!(exact.closing < 1e-9 && exact.plane_angle.to_degrees() < 4.0, "{exact:?}");
        let rough = BoundaryPolygon::new(&net(asymptotic_nets::enneper().jittered(0.05, 1)));
        assert!(rough.closing > 0.1 && rough.plane_angle > exact.plane_angle, "{rough:?}");
        let text = Warning::boundary(&net(asymptotic_nets::enneper()), 0.01).to_string();
        assert!(text.contains("glide") && text.contains("1.0e-2 edge lengths"), "{text}");
    }

    #[test]
    fn curvature_lines_are_refused() {
        let saddle = |x: f64, y: f64| DVec3::new(x, y, 0.4 * (x * x - y * y));
        let (positions, quads) = grid(10, saddle);
        let report = gates(positions, &quads);
        assert!(matches!(report.check(), Err(Error::CurvatureAligned { .. })), "{report:?}");
        assert!(report.misalignment.to_degrees() > 35.0);
        // Its diagonals are asymptotic.
        let turned = |s: f64, t: f64| saddle((s + t) / 2.0, (s - t) / 2.0);
        let (positions, quads) = grid(10, turned);
        assert_eq!(gates(positions, &quads).check().unwrap(), vec![]);
    }

    #[test]
    fn positively_curved_surfaces_are_refused_in_whole_and_warned_of_in_part() {
        let (positions, quads) = grid(10, |x, y| DVec3::new(x, y, -0.2 * (x * x + y * y)));
        let error = gates(positions, &quads).check().unwrap_err();
        assert!(matches!(error, Error::NotNegativelyCurved { .. }), "{error}");
        assert!(error.to_string().contains("trim"));
        // A saddle with a dent.
        let dent = |x: f64, y: f64| {
            let r = (x - 0.5).powi(2) + (y - 0.5).powi(2);
            DVec3::new(x, y, 0.3 * x * y - 0.08 * (-r / 0.12).exp())
        };
        let (positions, quads) = grid(20, dent);
        let report = gates(positions, &quads);
        let warnings = report.check().unwrap();
        assert!(
            warnings.iter().any(|w| matches!(w, Warning::NotEverywhereNegative { .. })),
            "{report:?}"
        );
    }

    #[test]
    fn misaligned_edges_are_measured() {
        // Turned by 16 degrees from the asymptotic directions of z = xy.
        let (sin, cos) = 16.0_f64.to_radians().sin_cos();
        let (positions, quads) = grid(12, |s, t| {
            let (x, y) = (cos * s - sin * t, sin * s + cos * t);
            DVec3::new(x, y, 0.3 * x * y)
        });
        let report = gates(positions, &quads);
        assert!((report.misalignment.to_degrees() - 16.0).abs() < 1.0);
        let warnings = report.check().unwrap();
        assert!(warnings.iter().any(|w| matches!(w, Warning::Misaligned { .. })));
        let worse = GateReport { misalignment: 0.4, ..report };
        assert!(matches!(worse.check(), Err(Error::Misaligned { .. })));
    }

    #[test]
    fn folded_and_planar_faces_are_named() {
        let (mut positions, quads) = grid(8, |x, y| DVec3::new(x, y, 0.4 * x * y));
        positions[0].z = positions[1].z + positions[9].z - positions[10].z;
        let report = gates(positions.clone(), &quads);
        assert_eq!(report.planar_faces, vec![0]);
        positions[40] = positions[40] + 2.5 * (positions[41] - positions[40]);
        let report = gates(positions, &quads);
        assert!(report.folds > 0);
        let warnings = report.check().unwrap();
        assert!(warnings.iter().any(|w| matches!(w, Warning::Folds { .. })));
        assert!(warnings.iter().any(|w| matches!(w, Warning::PlanarFaces { first: 0, .. })));
    }
}
