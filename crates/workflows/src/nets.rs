//! Quads along asymptotic lines from whatever mesh there is.

use bspline::BsplineSurface;
use geom_core::{DVec3, PolyMesh, TriMesh, diagonal_meshes};
use gp_solver::{Observer, choices};
use hyperbolic_nets::Error::NotNegativelyCurved;
use hyperbolic_nets::{AsymptoticField, GateReport, QuadNet, inspect};
use serde::{Deserialize, Serialize};
use std::fmt;

/// What to do with the edges of an input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InputEdges {
    /// Keep them if they follow the asymptotic directions, take the diagonals if these do, else
    /// remesh.
    #[default]
    Auto,
    /// Keep them.
    Keep,
    /// Take the diagonals of the quads.
    Diagonals,
    /// Make new quads.
    Remesh,
}

choices!(InputEdges {
    Auto = "auto",
    Keep = "keep",
    Diagonals = "diagonals",
    Remesh = "remesh",
});

/// What was done with them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Did {
    /// Kept.
    Kept,
    /// The diagonals were taken.
    Diagonals,
    /// New quads were made.
    Remeshed,
}

impl fmt::Display for Did {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Kept => "the edges of the input are kept",
            Self::Diagonals => "the diagonals of the input's quads are the edges of the net",
            Self::Remeshed => "the input was remeshed along its asymptotic lines",
        })
    }
}

/// A net to be solved.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Quads along asymptotic lines.
    pub net: QuadNet,
    /// The surface they stand for, where it is not the net itself.
    pub reference: Option<TriMesh>,
    /// How the net came about.
    pub did: Did,
    /// What the remesher had to say.
    pub warnings: Vec<String>,
}

/// Why there is no net.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Faces that are no mesh.
    #[error(transparent)]
    Mesh(#[from] geom_core::MeshError),
    /// No diagonals.
    #[error(transparent)]
    Diagonals(#[from] geom_core::DiagonalError),
    /// No net of these quads.
    #[error(transparent)]
    Net(#[from] hyperbolic_nets::Error),
    /// No net of the surface.
    #[error(transparent)]
    Remesh(#[from] quad_remesh::Error),
}

/// Makes a net of a mesh.
///
/// # Errors
/// [`Error`], from the step that failed.
///
/// # Example
/// See that of the [crate].
pub fn prepare<F: AsRef<[u32]>>(
    points: &[DVec3],
    faces: &[F],
    edges: InputEdges,
    options: &quad_remesh::Options,
    observer: &mut dyn Observer,
) -> Result<Prepared, Error> {
    match edges {
        InputEdges::Keep => kept(&PolyMesh::new(points.to_vec(), faces)?),
        InputEdges::Diagonals => diagonals(&PolyMesh::new(points.to_vec(), faces)?),
        InputEdges::Remesh => remeshed(points, faces, options, observer),
        InputEdges::Auto => {
            let mesh = PolyMesh::new(points.to_vec(), faces).ok();
            for make in [kept, diagonals] {
                let made = mesh.as_ref().filter(|m| m.is_quad_mesh()).map(make);
                let Some(Ok(prepared)) = made else { continue };
                match gates(&prepared).check() {
                    Ok(_) => return Ok(prepared),
                    // No other edges change that.
                    Err(e @ NotNegativelyCurved { .. }) => return Err(e.into()),
                    Err(_) => {}
                }
            }
            remeshed(points, faces, options, observer)
        }
    }
}

/// What the solver asks of a net.
fn gates(prepared: &Prepared) -> GateReport {
    let own;
    let surface = match &prepared.reference {
        Some(surface) => surface,
        None => {
            own = TriMesh::from_poly_mesh(prepared.net.mesh());
            &own
        }
    };
    inspect(&prepared.net, &AsymptoticField::new(surface))
}

fn kept(mesh: &PolyMesh) -> Result<Prepared, Error> {
    let net = QuadNet::new(mesh)?;
    Ok(Prepared { net, reference: None, did: Did::Kept, warnings: Vec::new() })
}

/// Of the two meshes of diagonals the larger that makes a net.
fn diagonals(mesh: &PolyMesh) -> Result<Prepared, Error> {
    let [one, other] = diagonal_meshes(mesh)?;
    let (first, second) =
        if other.face_count() > one.face_count() { (other, one) } else { (one, other) };
    let net = QuadNet::new(&first).or_else(|e| QuadNet::new(&second).map_err(|_| e))?;
    let reference = Some(TriMesh::from_poly_mesh(mesh));
    Ok(Prepared { net, reference, did: Did::Diagonals, warnings: Vec::new() })
}

fn remeshed<F: AsRef<[u32]>>(
    points: &[DVec3],
    faces: &[F],
    options: &quad_remesh::Options,
    observer: &mut dyn Observer,
) -> Result<Prepared, Error> {
    let is_free = options.edge_length.is_none() && options.faces.is_none();
    let options = quad_remesh::Options {
        // Quads say how large quads are to be.
        edge_length: if is_free { mean_edge(points, faces) } else { options.edge_length },
        ..options.clone()
    };
    of_solution(&quad_remesh::solve(points, faces, &options, observer)?)
}

/// Makes a net of a spline surface by remeshing it.
///
/// # Errors
/// [`Error`], from the step that failed.
///
/// # Example
/// ```
/// use bspline::{BsplineSurface, Degree, KnotVector};
/// use geom_core::DVec3;
/// use workflows::nets::{Did, prepare_surface};
/// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
/// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
/// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
/// let options = quad_remesh::Options { faces: Some(64), ..Default::default() };
/// assert_eq!(prepare_surface(&saddle, &options, &mut ())?.did, Did::Remeshed);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn prepare_surface(
    surface: &BsplineSurface,
    options: &quad_remesh::Options,
    observer: &mut dyn Observer,
) -> Result<Prepared, Error> {
    of_solution(&quad_remesh::solve_surface(surface, options, observer)?)
}

fn of_solution(solution: &quad_remesh::Solution) -> Result<Prepared, Error> {
    Ok(Prepared {
        net: QuadNet::new(&solution.result)?,
        reference: Some(TriMesh::from_poly_mesh(&solution.surface)),
        did: Did::Remeshed,
        warnings: solution.warnings.iter().map(ToString::to_string).collect(),
    })
}

/// Mean length of the sides, if no face is a triangle.
fn mean_edge<F: AsRef<[u32]>>(points: &[DVec3], faces: &[F]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for face in faces.iter().map(AsRef::as_ref) {
        if face.len() < 4 {
            return None;
        }
        for k in 0..face.len() {
            let end = |k: usize| points.get(face[k % face.len()] as usize);
            sum += end(k)?.distance(*end(k + 1)?);
            count += 1.0;
        }
    }
    (sum > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::saddle_meshes;

    type Quads = (Vec<DVec3>, Vec<[u32; 4]>);

    /// `n × n` quads whose edges are turned by an angle against the curvature lines of a saddle.
    fn saddle(n: u32, angle: f64) -> Quads {
        let at = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
        let (sin, cos) = angle.sin_cos();
        let points = (0..(n + 1) * (n + 1)).map(|k| (at(k / (n + 1)), at(k % (n + 1))));
        let points = points
            .map(|(s, t)| (cos * s - sin * t, sin * s + cos * t))
            .map(|(x, y)| DVec3::new(x, y, 0.3 * (x * x - y * y)))
            .collect();
        let cells = (0..n * n).map(|k| (n + 1) * (k / n) + k % n);
        (points, cells.map(|a| [a, a + n + 1, a + n + 2, a + 1]).collect())
    }

    fn prepared((points, faces): &Quads, edges: InputEdges) -> Result<Prepared, Error> {
        prepare(points, faces, edges, &quad_remesh::Options::default(), &mut ())
    }

    #[test]
    fn what_is_done_depends_on_the_directions() {
        let eighth = std::f64::consts::FRAC_PI_4;
        for (angle, did) in
            [(eighth, Did::Kept), (0.0, Did::Diagonals), (0.5 * eighth, Did::Remeshed)]
        {
            let prepared = prepared(&saddle(16, angle), InputEdges::Auto).unwrap();
            assert_eq!(prepared.did, did);
            let options = hyperbolic_nets::Options::default();
            let reference =
                prepared.reference.unwrap_or_else(|| TriMesh::from_poly_mesh(prepared.net.mesh()));
            let input = hyperbolic_nets::Input::near_mesh(&prepared.net, &reference);
            let solution = hyperbolic_nets::solve(&input, &options, &mut ()).unwrap();
            assert!(solution.metrics.kink_max_deg < 1e-9, "{did} {:?}", solution.metrics);
        }
    }

    #[test]
    fn a_choice_is_obeyed_or_refused() {
        let along_curvature = saddle(12, 0.0);
        assert_eq!(prepared(&along_curvature, InputEdges::Remesh).unwrap().did, Did::Remeshed);
        assert_eq!(prepared(&along_curvature, InputEdges::Keep).unwrap().did, Did::Kept);
        let mesh = saddle_meshes::enneper(1, 0.8, 1_500);
        let options = quad_remesh::Options { faces: Some(100), ..Default::default() };
        let run = |edges| prepare(&mesh.positions, &mesh.triangles, edges, &options, &mut ());
        assert!(matches!(run(InputEdges::Diagonals), Err(Error::Diagonals(_))));
        assert!(matches!(run(InputEdges::Keep), Err(Error::Net(_))));
        assert_eq!(run(InputEdges::Auto).unwrap().did, Did::Remeshed);
    }

    #[test]
    fn a_bowl_is_refused_before_anything_else() {
        let (mut points, quads) = saddle(12, 0.3);
        points.iter_mut().for_each(|p| p.z = 0.3 * (p.x * p.x + p.y * p.y));
        let error = prepared(&(points, quads), InputEdges::Auto).unwrap_err();
        assert!(error.to_string().contains("only 0 % of the surface"), "{error}");
    }
}
