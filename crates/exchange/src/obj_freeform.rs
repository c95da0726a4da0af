//! Free-form curves and surfaces of OBJ: B-splines and Bezier, polynomial and rational, with the
//! loops of curves that trim them.

use crate::error::{ReadError, clip};
use crate::text_number::coordinate;
use crate::wrapped::{Direction, unwrap, unwrap_curve};
use bspline::{BsplineCurve, BsplineSurface, Degree, Trim, TrimCurve, TrimLoop};
use geom_core::DVec3;

/// Ends of trim curves this share of the parameter plane apart are joined.
const SLACK: f64 = 1e-6;
const MEND: &str = "export the free-form geometry again";

/// The vertices of a file so far.
#[derive(Clone, Copy)]
pub(crate) struct Vertices<'v> {
    pub(crate) positions: &'v [DVec3],
    /// Weights of the first ones; the others have weight 1.
    pub(crate) weights: &'v [f64],
}

impl Vertices<'_> {
    fn weight(self, k: usize) -> f64 {
        self.weights.get(k).copied().unwrap_or(1.0)
    }
}

/// What a statement block described.
pub(crate) enum FreeForm {
    /// A surface with its trim.
    Surface(BsplineSurface, Option<Trim>),
    /// A curve in space.
    Curve(BsplineCurve),
    /// A curve in parameter planes, which stays here.
    Planar,
    /// A kind that is not read, by its name.
    Unknown(String),
}

/// The block that is being read, from its first statement to `end`.
#[derive(Default)]
pub(crate) struct Block {
    kind: Option<Kind>,
    /// Control vertices: numbers counted from 0.
    control: Vec<usize>,
    range: Vec<f64>,
    knots: [Vec<f64>; 2],
    /// Loops as pieces of planar curves: start, end, number of the curve.
    loops: Vec<Vec<(f64, f64, usize)>>,
    line: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Surface,
    Curve,
    Planar,
}

/// The state that outlives blocks, and the block at work.
#[derive(Default)]
pub(crate) struct Reader {
    basis: String,
    rational: bool,
    degrees: Vec<usize>,
    /// `(u, v, weight)` of the vertices of parameter planes.
    planar_points: Vec<[f64; 3]>,
    planar: Vec<BsplineCurve>,
    block: Block,
    /// Control points and points of polylines that may still be made.
    left: usize,
}

/// Points that any file may become, and bytes of text per point above that: a number of a vertex
/// takes two bytes, the control point it stands for dozens.
const FREE: usize = 1 << 18;
/// See [`FREE`].
const BYTES_PER_POINT: usize = 8;

impl Reader {
    /// Sets how much a file of this many bytes may become.
    pub(crate) fn allow(&mut self, bytes: usize) {
        self.left = FREE + bytes / BYTES_PER_POINT;
    }

    /// Takes so many points off what may still be made.
    pub(crate) fn spend(&mut self, points: usize, line: usize) -> Result<(), ReadError> {
        let left = self.left.checked_sub(points);
        self.left = left.ok_or_else(|| {
            let what = "the free-form geometry becomes more points than fit into memory";
            ReadError::text(line, what, "export it in parts")
        })?;
        Ok(())
    }

    /// Takes a statement, which may end a block.
    pub(crate) fn statement(
        &mut self,
        keyword: &str,
        words: &[&str],
        line: usize,
        vertices: Vertices<'_>,
    ) -> Result<Option<FreeForm>, ReadError> {
        let number = |word: &&str| coordinate(word, line);
        match keyword {
            "vp" => {
                let mut point = [0.0, 0.0, 1.0];
                for (x, word) in point.iter_mut().zip(words) {
                    *x = number(word)?;
                }
                self.planar_points.push(point);
            }
            "cstype" => {
                self.rational = words.first() == Some(&"rat");
                self.basis = words.last().copied().unwrap_or_default().to_owned();
            }
            "deg" => {
                let degrees = words.iter().map(|w| w.parse::<usize>().ok());
                self.degrees = degrees
                    .collect::<Option<_>>()
                    .ok_or_else(|| ReadError::text(line, "degrees are whole numbers", MEND))?;
            }
            "surf" => {
                self.begin(Kind::Surface, line);
                self.block.range = words.iter().take(4).map(number).collect::<Result<_, _>>()?;
                let control = words.get(4..).unwrap_or_default();
                self.block.control = indices(control, vertices.positions.len(), line)?;
            }
            "curv" => {
                self.begin(Kind::Curve, line);
                self.block.range = words.iter().take(2).map(number).collect::<Result<_, _>>()?;
                let control = words.get(2..).unwrap_or_default();
                self.block.control = indices(control, vertices.positions.len(), line)?;
            }
            "curv2" => {
                self.begin(Kind::Planar, line);
                self.block.control = indices(words, self.planar_points.len(), line)?;
            }
            "parm" => {
                let direction = match words.first() {
                    Some(&"u") => 0,
                    Some(&"v") => 1,
                    _ => return Err(ReadError::text(line, "parm without u or v", MEND)),
                };
                let knots = words[1..].iter().map(number).collect::<Result<Vec<_>, _>>()?;
                self.block.knots[direction].extend(knots);
            }
            "trim" | "hole" => {
                let mut pieces = Vec::new();
                for piece in words.chunks_exact(3) {
                    let curve = indices(&piece[2..], self.planar.len(), line)?;
                    pieces.push((number(&piece[0])?, number(&piece[1])?, curve[0]));
                }
                self.block.loops.push(pieces);
            }
            "end" => return self.end(vertices),
            _ => {}
        }
        Ok(None)
    }

    fn begin(&mut self, kind: Kind, line: usize) {
        self.block = Block { kind: Some(kind), line, ..Block::default() };
    }

    fn end(&mut self, vertices: Vertices<'_>) -> Result<Option<FreeForm>, ReadError> {
        let block = std::mem::take(&mut self.block);
        let Some(kind) = block.kind else { return Ok(None) };
        let line = block.line;
        self.spend(block.control.len(), line)?;
        if !matches!(self.basis.as_str(), "bspline" | "bezier") {
            // Numbers of later curves must not slip.
            if kind == Kind::Planar {
                let unit = BsplineCurve::segment(DVec3::ZERO, DVec3::X, 0.0, 1.0);
                self.planar.push(unit.map_err(|e| fault(line, &e))?);
            }
            return Ok(Some(FreeForm::Unknown(clip(&self.basis))));
        }
        match kind {
            Kind::Surface => {
                for (_, _, curve) in block.loops.iter().flatten() {
                    self.spend(self.planar[*curve].control_points().len(), line)?;
                }
                self.surface(&block, vertices).map(Some)
            }
            Kind::Curve => {
                let (points, weights) = self.picked(&block, vertices);
                let curve = self.curve(&block, &points, weights.as_deref())?;
                Ok(Some(FreeForm::Curve(cut(curve, &block.range, line)?)))
            }
            Kind::Planar => {
                let points = &self.planar_points;
                let at = |k: &usize| DVec3::new(points[*k][0], points[*k][1], 0.0);
                let flat: Vec<DVec3> = block.control.iter().map(at).collect();
                let weights: Option<Vec<f64>> =
                    self.rational.then(|| block.control.iter().map(|k| points[*k][2]).collect());
                let curve = self.curve(&block, &flat, weights.as_deref())?;
                self.planar.push(curve);
                Ok(Some(FreeForm::Planar))
            }
        }
    }

    fn picked(&self, block: &Block, vertices: Vertices<'_>) -> (Vec<DVec3>, Option<Vec<f64>>) {
        let points = block.control.iter().map(|k| vertices.positions[*k]).collect();
        let weights =
            self.rational.then(|| block.control.iter().map(|k| vertices.weight(*k)).collect());
        (points, weights)
    }

    fn curve(
        &self,
        block: &Block,
        points: &[DVec3],
        weights: Option<&[f64]>,
    ) -> Result<BsplineCurve, ReadError> {
        let along = self.direction(block, 0, points.len())?;
        unwrap_curve(&along, points, weights).map_err(|e| fault(block.line, &e))
    }

    /// The knots of a direction for the number of control points that the knots of the file ask
    /// for, or for `count` of them.
    fn direction(&self, block: &Block, k: usize, count: usize) -> Result<Direction, ReadError> {
        let line = block.line;
        let degree = self.degrees.get(k).copied().unwrap_or(0);
        let degree = Degree::new(degree).map_err(|e| fault(line, &e))?;
        let knots = self.knots(block, k, degree);
        Direction::new(degree, knots, true, count).map_err(|e| fault(line, &e))
    }

    fn knots(&self, block: &Block, k: usize, degree: Degree) -> Vec<f64> {
        let given = &block.knots[k];
        if self.basis != "bezier" {
            return given.clone();
        }
        // Of Bezier pieces the file gives the ends, each a knot of full multiplicity.
        let d = degree.get();
        let mut knots: Vec<f64> = given.iter().flat_map(|t| std::iter::repeat_n(*t, d)).collect();
        if let (Some(first), Some(last)) = (given.first(), given.last()) {
            knots.insert(0, *first);
            knots.push(*last);
        }
        knots
    }

    fn surface(&self, block: &Block, vertices: Vertices<'_>) -> Result<FreeForm, ReadError> {
        let line = block.line;
        let (points, weights) = self.picked(block, vertices);
        // The numbers of control points follow from the knots.
        let count = |k: usize| -> Result<usize, ReadError> {
            let degree = self.degrees.get(k).copied().unwrap_or(0);
            let degree = Degree::new(degree).map_err(|e| fault(line, &e))?;
            let knots = self.knots(block, k, degree).len();
            Ok(knots.saturating_sub(degree.order()))
        };
        let (n_u, n_v) = (count(0)?, count(1)?);
        if n_u.checked_mul(n_v) != Some(points.len()) {
            let what = format!("the knots need {n_u} x {n_v} vertices, {} are there", points.len());
            return Err(ReadError::text(line, what, MEND));
        }
        let (u, v) = (self.direction(block, 0, n_u)?, self.direction(block, 1, n_v)?);
        // In the file u runs first.
        let order = (0..n_u).flat_map(|i| (0..n_v).map(move |j| j * n_u + i));
        let turned: Vec<DVec3> = order.clone().map(|k| points[k]).collect();
        let weights = weights.map(|w| order.map(|k| w[k]).collect::<Vec<f64>>());
        let surface = unwrap(&u, &v, &turned, weights.as_deref()).map_err(|e| fault(line, &e))?;
        let surface = match block.range[..] {
            [u0, u1, v0, v1] => {
                let whole = [surface.knots_u().domain(), surface.knots_v().domain()];
                if whole == [(u0, u1), (v0, v1)] {
                    surface
                } else {
                    surface.subdomain([u0, u1], [v0, v1]).map_err(|e| fault(line, &e))?
                }
            }
            _ => return Err(ReadError::text(line, "a surface without its range", MEND)),
        };
        let trim = self.trim(block, &surface)?;
        Ok(FreeForm::Surface(surface, trim))
    }

    fn trim(&self, block: &Block, surface: &BsplineSurface) -> Result<Option<Trim>, ReadError> {
        let line = block.line;
        if block.loops.is_empty() {
            return Ok(None);
        }
        let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
        let slack = SLACK * (u1 - u0).hypot(v1 - v0);
        let mut loops = Vec::with_capacity(block.loops.len());
        for pieces in &block.loops {
            let mut curves = Vec::with_capacity(pieces.len());
            for (start, end, k) in pieces {
                let parameters = cut(self.planar[*k].clone(), &[*start, *end], line)?;
                curves.push(TrimCurve { parameters, edge: None });
            }
            loops.push(TrimLoop::new(curves, slack).map_err(|e| fault(line, &e))?);
        }
        Trim::new(loops).map(Some).map_err(|e| fault(line, &e))
    }
}

fn fault(line: usize, error: &dyn std::fmt::Display) -> ReadError {
    let text = error.to_string();
    let (what, mend) = text.split_once("; ").unwrap_or((&text, MEND));
    ReadError::text(line, what, mend)
}

/// The part of a curve over a range, the other way round if its ends are swapped.
fn cut(curve: BsplineCurve, range: &[f64], line: usize) -> Result<BsplineCurve, ReadError> {
    let [start, end] = *range else {
        return Err(ReadError::text(line, "a curve without its range", MEND));
    };
    let part = curve.subdomain(start.min(end), start.max(end)).map_err(|e| fault(line, &e))?;
    Ok(if start > end { part.reversed() } else { part })
}

/// Numbers from 1, or back from the last, as numbers from 0.
fn indices(words: &[&str], count: usize, line: usize) -> Result<Vec<usize>, ReadError> {
    let index = |word: &&str| {
        let own = word.split('/').next().unwrap_or_default();
        let index = own.parse::<i64>().ok().and_then(|i| match i {
            1.. => usize::try_from(i - 1).ok(),
            0 => None,
            _ => usize::try_from(i.unsigned_abs()).ok().and_then(|back| count.checked_sub(back)),
        });
        index.filter(|i| *i < count).ok_or_else(|| {
            let what = format!("`{}` names none of the {count} before this line", clip(word));
            ReadError::text(line, what, MEND)
        })
    };
    words.iter().map(index).collect()
}
