//! The whole run: mend, directions, two functions, cells, net.

use bspline::BsplineSurface;
use geom_core::{DMat3, DVec3, Normalization, PolyMesh};
use gp_solver::{Observer, Status};

use crate::cut::Cut;
use crate::error::Error;
use crate::field::Field;
use crate::foliation::{Foliation, Frames, Ground, Missing};
use crate::metrics::{self, Metrics};
use crate::net::{Net, assemble};
use crate::options::Options;
use crate::parameters::Parameters;
use crate::repair::{Repaired, repair};
use crate::singular::{Matching, Singular, settle, singular_vertices};
use crate::spline::Sampled;
use crate::surface::Surface;
use crate::trace::cells;
use crate::warning::Warning;
use crate::whole::Unknowns;

/// Share of negatively curved area below which a surface is refused, and below which it is warned of.
const NEGATIVE_SHARE: [f64; 2] = [0.60, 0.95];
/// Factor of the edge length where the asked one makes the net fold, and how often.
const SHORTER: f64 = 0.7;
const TRIES: usize = 4;
/// Rounds in which the edge length follows the number of faces, and the share by which that may be off.
const COUNT_ROUNDS: usize = 6;
const COUNT_SHARE: f64 = 0.05;
/// Weight of a triangle with curvature `R`: the share `R / median R` squared, 1 at most, and this.
const LEAST_WEIGHT: f64 = 0.3;

/// A quad net along the asymptotic lines of a surface, with what is to be said about it.
///
/// # Example
/// ```
/// use quad_remesh::{Options, solve};
/// // Triangles of the saddle z = x² − y², whose asymptotic lines are its diagonals.
/// let at = |k: u32| f64::from(k) / 20.0 - 0.5;
/// let points: Vec<_> = (0..441)
///     .map(|k| (at(k / 21), at(k % 21)))
///     .map(|(x, y)| geom_core::DVec3::new(x, y, x * x - y * y))
///     .collect();
/// let cells = (0..400).map(|k| 21 * (k / 20) + k % 20);
/// let faces: Vec<[u32; 3]> =
///     cells.flat_map(|a| [[a, a + 21, a + 22], [a, a + 22, a + 1]]).collect();
/// let options = Options { edge_length: Some(0.1), ..Options::default() };
/// let solution = solve(&points, &faces, &options, &mut ())?;
/// assert_eq!(solution.metrics.irregular_vertices, 0);
/// assert!(solution.metrics.asymptotic_deviation_mean_deg < 1.0);
/// # Ok::<(), quad_remesh::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solution {
    /// The quads, in model units; sides 0–1 and 2–3 of every face follow one family, up to where
    /// directions turn over.
    pub result: PolyMesh,
    /// The triangles the net was made on: the input, mended.
    pub surface: PolyMesh,
    /// The numbers it is judged by.
    pub metrics: Metrics,
    /// [`Status::Converged`] if the net has the topology of the surface, else [`Status::Partial`].
    pub status: Status,
    /// Vertices of the surface around which directions turn, with twice their index.
    pub singular: Vec<(DVec3, i32)>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// Makes a quad net along the asymptotic lines of a negatively curved surface that is given by
/// triangles or polygons.
///
/// # Errors
/// [`Error`] says why there is no such net, or why none was found, and how to mend that.
///
/// # Example
/// See [`Solution`].
pub fn solve<F: AsRef<[u32]>>(
    points: &[DVec3],
    faces: &[F],
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    run(points, faces, None, options, observer)
}

/// As [`solve`], of a spline surface: directions come from its own second form, and it is cut into
/// triangles fine enough for the wanted edges. Closed and periodic surfaces are closed.
///
/// # Errors
/// As [`solve`].
///
/// # Example
/// ```
/// use bspline::{BsplineSurface, Degree, KnotVector};
/// use geom_core::DVec3;
/// use quad_remesh::{Options, solve_surface};
/// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
/// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
/// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
/// let options = Options { faces: Some(100), ..Options::default() };
/// let solution = solve_surface(&saddle, &options, &mut ())?;
/// assert!(solution.metrics.asymptotic_deviation_mean_deg < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_surface(
    surface: &BsplineSurface,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    options.check()?;
    let Sampled { points, triangles, tensors } = Sampled::new(surface, options);
    run(&points, &triangles, Some(&tensors), options, observer)
}

/// The run on triangles or polygons, with second forms at the points if they are known.
fn run<F: AsRef<[u32]>>(
    points: &[DVec3],
    faces: &[F],
    tensors: Option<&[Option<DMat3>]>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    options.check()?;
    let Repaired { surface, sources, mut warnings } = repair(points, faces)?;
    // Everything is computed in normalised coordinates.
    let place = Normalization::of(&surface.positions)?;
    let positions = surface.positions.iter().map(|&p| place.apply(p)).collect();
    let surface = Surface::new(positions, surface.triangles);
    let scale = place.scale();
    // Curvatures are one over lengths.
    let tensors: Option<Vec<Option<DMat3>>> = tensors.map(|tensors| {
        sources.iter().map(|&v| tensors[v as usize].map(|t| t * (1.0 / scale))).collect()
    });
    let mut run = Run { surface, tensors, options, observer, warnings: Vec::new() };
    let made = run.net(options.edge_length.map(|l| l * scale)).map_err(|e| restored(e, &place))?;
    warnings.append(&mut run.warnings);
    let in_model = |list: &[DVec3]| list.iter().map(|&p| place.restore(p)).collect::<Vec<_>>();
    let no_cell = || Error::NoCell {
        edge_length: made.edge / scale,
        suggestion: SHORTER * SHORTER * made.edge / scale,
    };
    if made.net.quads.is_empty() {
        return Err(no_cell());
    }
    let mesh = PolyMesh::new(made.net.positions.clone(), &made.net.quads).map_err(|_| no_cell())?;
    let metrics = made.measure(&run, &mesh, scale);
    if let (Some(asked), used) = (options.edge_length, made.edge / scale)
        && used < 0.99 * asked
    {
        warnings.push(Warning::Shortened { asked, used });
    }
    let (own, of) = (metrics.euler_characteristic, metrics.surface_euler_characteristic);
    let status = if own == of { Status::Converged } else { Status::Partial };
    if own != of {
        warnings.push(Warning::Topology { net: own, surface: of });
    }
    let surface = &run.surface;
    let singular = made.singular.iter();
    Ok(Solution {
        result: PolyMesh::new(in_model(&made.net.positions), &made.net.quads)
            .map_err(|_| no_cell())?,
        surface: PolyMesh::new(in_model(&surface.positions), &surface.triangles)
            .map_err(|_| no_cell())?,
        metrics,
        status,
        singular: singular
            .map(|s| (place.restore(surface.positions[s.vertex]), s.twice_index))
            .collect(),
        warnings,
    })
}

/// An error in units of the model.
fn restored(error: Error, place: &Normalization) -> Error {
    let scale = place.scale();
    match error {
        Error::Folds { edge_length, x, y, z, suggestion } => {
            let p = place.restore(DVec3::new(x, y, z));
            let (edge_length, suggestion) = (edge_length / scale, suggestion / scale);
            Error::Folds { edge_length, x: p.x, y: p.y, z: p.z, suggestion }
        }
        Error::NoCell { edge_length, suggestion } => {
            Error::NoCell { edge_length: edge_length / scale, suggestion: suggestion / scale }
        }
        other => other,
    }
}

struct Run<'a> {
    surface: Surface,
    /// Second forms at the vertices, if they are known and need no fit.
    tensors: Option<Vec<Option<DMat3>>>,
    options: &'a Options,
    observer: &'a mut dyn Observer,
    warnings: Vec<Warning>,
}

/// A net with what it was made from.
struct Made {
    net: Net,
    edge: f64,
    frames: [Frames; 2],
    gradients: [Vec<DVec3>; 2],
    singular: Vec<Singular>,
    wholes: usize,
    cuts: usize,
    steps: usize,
    negative_share: f64,
}

/// Directions of the whole surface, made for one edge length.
struct Directions {
    cut: Cut,
    unknowns: Unknowns,
    frames: [Frames; 2],
    singular: Vec<Singular>,
    negative_share: f64,
    /// Area of the surface in cells with edges of length 1.
    cells: f64,
}

impl Run<'_> {
    fn go_on(&mut self) -> Result<(), Error> {
        if self.observer.stop_requested() { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// The net of this edge length, or of the wanted number of faces.
    fn net(&mut self, edge_length: Option<f64>) -> Result<Made, Error> {
        let area = self.surface.area();
        let wanted = self.options.wanted_faces();
        // Cells are squares at first; their angle is known with the directions.
        let first = wanted.map_or(1.0, |n| (area / n as f64).sqrt());
        let mut edge = edge_length.unwrap_or(first);
        let original = self.surface.clone();
        for attempt in 0..TRIES {
            self.surface = original.clone();
            let directions = self.directions(edge)?;
            if let (Some(n), 0) = (wanted, attempt) {
                edge = (directions.cells / n as f64).sqrt();
            }
            match self.with_count(&directions, edge, wanted.filter(|_| attempt == 0)) {
                Err(Error::Folds { .. }) if attempt + 1 < TRIES => edge *= SHORTER,
                other => return other,
            }
        }
        Err(Error::NoCell { edge_length: edge, suggestion: SHORTER * edge })
    }

    fn with_count(
        &mut self,
        directions: &Directions,
        mut edge: f64,
        wanted: Option<usize>,
    ) -> Result<Made, Error> {
        let mut made = self.of_length(directions, edge)?;
        let Some(wanted) = wanted else { return Ok(made) };
        let wanted = wanted as f64;
        let count = |made: &Made| made.net.quads.len() as f64;
        let off = |made: &Made| (count(made) - wanted).abs();
        // Edges known to give too few faces, and too many.
        let (mut long, mut short) = (f64::INFINITY, 0.0_f64);
        let mut last = count(&made);
        for _ in 0..COUNT_ROUNDS {
            if off(&made) <= COUNT_SHARE * wanted || last == 0.0 {
                break;
            }
            if last < wanted {
                long = long.min(edge);
            } else {
                short = short.max(edge);
            }
            edge *= (last / wanted).sqrt();
            if edge >= long || edge <= short {
                edge = (long * short).sqrt();
            }
            let next = match self.of_length(directions, edge) {
                Err(Error::Folds { .. }) => break,
                other => other?,
            };
            last = count(&next);
            if off(&next) < off(&made) {
                made = next;
            }
        }
        Ok(made)
    }

    fn directions(&mut self, edge: f64) -> Result<Directions, Error> {
        self.go_on()?;
        let mut field = match &self.tensors {
            Some(tensors) => Field::of_tensors(&self.surface, tensors)?,
            None => Field::fitted(&self.surface, edge)?,
        };
        let negative_share = field.negative_share(&self.surface);
        if negative_share < NEGATIVE_SHARE[0] {
            let percent = 100.0 * negative_share;
            return Err(Error::NotNegativelyCurved { percent, needed: 100.0 * NEGATIVE_SHARE[0] });
        }
        self.go_on()?;
        settle(&mut self.surface, &mut field, edge);
        let surface = &self.surface;
        let matching = Matching::new(surface, &field);
        let singular = singular_vertices(surface, &matching);
        let cut = Cut::new(surface, &matching, &singular);
        let unknowns = Unknowns::new(surface, &cut, &singular)?;
        let limit = self.options.min_angle.to_radians().cos();
        let (frames, cells, clamped) = frames(surface, &field, &cut.combing, limit);
        self.warnings.clear();
        if negative_share < NEGATIVE_SHARE[1] {
            let percent = 100.0 * (1.0 - negative_share);
            self.warnings.push(Warning::NotEverywhereNegative { percent });
        }
        if clamped > 0.01 {
            let degrees = self.options.min_angle;
            self.warnings.push(Warning::Clamped { percent: 100.0 * clamped, degrees });
        }
        Ok(Directions { cut, unknowns, frames, singular, negative_share, cells })
    }

    fn of_length(&mut self, directions: &Directions, edge: f64) -> Result<Made, Error> {
        self.go_on()?;
        let Directions { cut, unknowns, frames, singular, negative_share, .. } = directions;
        let surface = &self.surface;
        let ground = Ground { surface, sheets: &cut.sheets, unknowns, edge };
        let (u, v) = rayon::join(|| ground.solve(&frames[0]), || ground.solve(&frames[1]));
        let refused = |missing: Missing| match missing {
            Missing::Solver(e) => Error::Solver(e),
            Missing::Folds(f) => {
                let p = surface.centre(f);
                let (edge_length, suggestion) = (edge, SHORTER * edge);
                Error::Folds { edge_length, x: p.x, y: p.y, z: p.z, suggestion }
            }
        };
        let (u, v) = (u.map_err(refused)?, v.map_err(refused)?);
        let parameters = Parameters::new(&ground, cut, &u, &v);
        debug_assert!(parameters.fits(surface), "both sides of every cut are the same");
        if let Some(f) = parameters.folded().next() {
            return Err(refused(Missing::Folds(f)));
        }
        // With no triangle turned over the plane winds around a vertex as the directions do.
        let wrong = singular
            .iter()
            .find(|s| parameters.quarters(surface, s.vertex) != 4 - 2 * s.twice_index);
        if let Some(s) = wrong {
            return Err(refused(Missing::Folds(surface.star(s.vertex)[0].0 as usize)));
        }
        let net = assemble(cells(surface, &parameters));
        let gradients = [gradients(&ground, &u), gradients(&ground, &v)];
        Ok(Made {
            net,
            edge,
            frames: frames.clone(),
            gradients,
            singular: singular.clone(),
            wholes: unknowns.wholes,
            cuts: u.cuts + v.cuts,
            steps: u.steps + v.steps,
            negative_share: *negative_share,
        })
    }
}

impl Made {
    fn measure(&self, run: &Run<'_>, mesh: &PolyMesh, scale: f64) -> Metrics {
        let surface = &run.surface;
        let [mean, low, high, angle] = metrics::shape(mesh);
        let (irregular, odd) = metrics::irregular(mesh);
        let (mut sum, mut most, mut area) = (0.0, 0.0_f64, 0.0);
        for (frames, gradients) in self.frames.iter().zip(&self.gradients) {
            for f in 0..gradients.len() {
                let (g, level) = (gradients[f], frames.level[f]);
                let off = g.dot(level).abs().atan2(g.reject_from_normalized(level).length());
                sum += surface.areas[f] * off;
                area += surface.areas[f];
                most = most.max(off);
            }
        }
        let samples: Vec<(DVec3, f64)> =
            (0..surface.areas.len()).map(|f| (surface.centre(f), surface.areas[f])).collect();
        Metrics {
            faces: mesh.face_count(),
            vertices: mesh.vertex_count(),
            irregular_vertices: irregular,
            odd_valence_vertices: odd,
            euler_characteristic: mesh.euler_characteristic(),
            surface_euler_characteristic: surface.euler_characteristic(),
            singular_points: self.singular.len(),
            index_sum: 0.5 * f64::from(self.singular.iter().map(|s| s.twice_index).sum::<i32>()),
            whole_numbers: self.wholes,
            whole_number_cuts: self.cuts,
            unfolding_steps: self.steps,
            folded_triangles: 0,
            cells_left_out: self.net.dropped,
            edge_length: self.edge / scale,
            edge_length_mean: mean / scale,
            edge_ratio_min: low / self.edge,
            edge_ratio_max: high / self.edge,
            angle_min_deg: angle,
            asymptotic_deviation_mean_deg: (sum / area).to_degrees(),
            asymptotic_deviation_max_deg: most.to_degrees(),
            negative_share: self.negative_share,
            covered_share: metrics::covered(mesh, &samples),
        }
    }
}

/// Gradient of a function in every triangle.
fn gradients(ground: &Ground<'_>, function: &Foliation) -> Vec<DVec3> {
    let value = |sheet: u32| {
        let value = &ground.unknowns.values[sheet as usize];
        ground.value(value, &function.reals, &function.wholes)
    };
    let gradient = |f: usize| {
        let hats = ground.surface.hat_gradients(f);
        ground.sheets[f].iter().zip(hats).map(|(&s, hat)| hat * value(s)).sum()
    };
    (0..ground.sheets.len()).map(gradient).collect()
}

/// What both functions are to follow, the area in cells of edge length 1, and the share of the area
/// where the angle of the families is clamped.
fn frames(
    surface: &Surface,
    field: &Field,
    combing: &[f64],
    limit: f64,
) -> ([Frames; 2], f64, f64) {
    let n = surface.triangles.len();
    let mut sizes: Vec<f64> = field.deviator.iter().map(|q| q.length()).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes[n / 2].max(f64::MIN_POSITIVE);
    let mean_area = surface.area() / n as f64;
    let (mut one, mut other) = (Vec::with_capacity(n), Vec::with_capacity(n));
    let (mut first, mut second, mut minus) =
        (Vec::with_capacity(n), Vec::with_capacity(n), Vec::with_capacity(n));
    let (mut weights, mut cells, mut clamped) = (Vec::with_capacity(n), 0.0, 0.0);
    for f in 0..n {
        let e1 = surface.global(f, crate::field::unit(field.principal_angle(f))) * combing[f];
        let e2 = surface.normals[f].cross(e1);
        let (angle, is_clamped) = field.asymptotic_angle(f, limit);
        let (sin, cos) = angle.sin_cos();
        one.push(e1 * cos - e2 * sin);
        other.push(e1 * cos + e2 * sin);
        first.push(e1);
        second.push(e2);
        minus.push(-e2);
        let share = surface.areas[f] / mean_area;
        let size = field.deviator[f].length() / median;
        weights.push(share * ((size * size).min(1.0) + LEAST_WEIGHT));
        cells += surface.areas[f] / (2.0 * angle).sin();
        clamped += if is_clamped { surface.areas[f] } else { 0.0 };
    }
    // The first function rises along one family and is constant along the other: its gradient lies
    // between the first principal direction and the opposite of the second.
    let u = Frames {
        along: one.clone(),
        level: other.clone(),
        rising: [first.clone(), minus],
        weights: weights.clone(),
    };
    let v = Frames { along: other, level: one, rising: [first, second], weights };
    ([u, v], cells, clamped / surface.area())
}
