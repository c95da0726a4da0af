//! Seam layouts: polygons over the unit square, which stands for the domain of the surface.

use crate::error::Error;
use crate::layout::polygon::{self, Corner};
use bspline::BsplineSurface;
use gp_solver::choices;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Most panels a layout may have: a slip of a digit should not fill the memory.
pub const MAX_PANELS: usize = 4_000_000;

/// The patterns that can be generated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Rows and columns of quads.
    #[default]
    Quad,
    /// Quads with every other row moved by half a panel.
    Staggered,
    /// Quads cut along their diagonals, two triangles each.
    Triangle,
    /// A honeycomb, cut off straight at the borders.
    Hexagon,
    /// Quads standing on their corners, with triangles along the borders.
    Diagonal,
}

choices!(Pattern {
    Quad = "quad",
    Staggered = "staggered",
    Triangle = "triangle",
    Hexagon = "hexagon",
    Diagonal = "diagonal",
});

impl Pattern {
    /// All patterns.
    pub const ALL: [Self; 5] =
        [Self::Quad, Self::Staggered, Self::Triangle, Self::Hexagon, Self::Diagonal];

    /// The name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Quad => "quad",
            Self::Staggered => "staggered",
            Self::Triangle => "triangle",
            Self::Hexagon => "hexagon",
            Self::Diagonal => "diagonal",
        }
    }

    /// The pattern of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }
}

/// A layout: panels as polygons over the unit square, counterclockwise; no edge belongs to more
/// than two panels (kept by the constructors).
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    panels: Vec<Vec<Corner>>,
}

/// Collects polygons whose corners are named by places on an integer grid.
struct Builder {
    /// Grid steps from border to border.
    steps: [usize; 2],
    closed: [bool; 2],
    vertices: HashMap<[usize; 2], usize>,
    panels: Vec<Vec<Corner>>,
}

impl Builder {
    fn new(steps: [usize; 2], closed: [bool; 2]) -> Self {
        Self { steps, closed, vertices: HashMap::new(), panels: Vec::new() }
    }

    fn add(&mut self, corners: &[[usize; 2]]) {
        let panel = corners.iter().map(|&at| {
            let mut key = at;
            for k in 0..2 {
                if self.closed[k] {
                    key[k] %= self.steps[k];
                }
            }
            let fresh = self.vertices.len();
            let vertex = *self.vertices.entry(key).or_insert(fresh);
            let uv = [at[0] as f64 / self.steps[0] as f64, at[1] as f64 / self.steps[1] as f64];
            Corner { vertex, uv }
        });
        let panel = panel.collect();
        self.panels.push(panel);
    }
}

impl Layout {
    /// A generated layout of about `u` by `v` panels for a surface that is closed or open in
    /// either direction.
    ///
    /// # Errors
    /// [`Error`] if a count is zero, too large, or too small to go around.
    pub fn generate(
        pattern: Pattern,
        u: usize,
        v: usize,
        closed: [bool; 2],
    ) -> Result<Self, Error> {
        if u == 0 || v == 0 {
            return Err(Error::NoPanels { u, v });
        }
        let panels = u.saturating_mul(v);
        if panels > MAX_PANELS {
            return Err(Error::TooManyPanels { panels, limit: MAX_PANELS });
        }
        for (k, found) in [u, v].into_iter().enumerate() {
            let direction = ["u", "v"][k];
            // With fewer, two panels would share more than one edge or a panel meet itself.
            if closed[k] && found < 3 {
                return Err(Error::TooFewAround { direction, needed: 3, found });
            }
            let pairs = k == 1 && matches!(pattern, Pattern::Staggered | Pattern::Hexagon);
            if closed[k] && pairs && !found.is_multiple_of(2) {
                return Err(Error::OddAround { direction, found });
            }
        }
        let builder = match pattern {
            Pattern::Quad => quads(u, v, closed),
            Pattern::Staggered => bricks(u, v, closed, 0),
            Pattern::Triangle => triangles(u, v, closed),
            Pattern::Hexagon => bricks(u, v, closed, 1),
            Pattern::Diagonal => diagonals(u, v, closed),
        };
        Ok(Self { panels: builder.panels })
    }

    /// A layout from polygons over the unit square: `vertices[i]` is `(u, v, z)` with `z = 0`.
    ///
    /// # Errors
    /// [`Error`] names the first vertex, face or edge at fault: not planar, outside the
    /// unit square, not simple, turned over, or overlapping.
    ///
    /// # Panics
    /// If a face names a vertex that does not exist.
    pub fn from_polygons(vertices: &[[f64; 3]], faces: &[Vec<usize>]) -> Result<Self, Error> {
        let size = vertices.iter().flat_map(|p| [p[0].abs(), p[1].abs()]).fold(0.0_f64, f64::max);
        for (vertex, &[u, v, z]) in vertices.iter().enumerate() {
            if !(z.abs() <= 1e-9 * size.max(1e-300)) {
                return Err(Error::NotPlanar { vertex, z });
            }
            if !((-1e-9..=1.0 + 1e-9).contains(&u) && (-1e-9..=1.0 + 1e-9).contains(&v)) {
                return Err(Error::OutsideDomain { vertex, u, v });
            }
        }
        if faces.is_empty() {
            return Err(Error::NoPanels { u: 0, v: 0 });
        }
        let corner = |&vertex: &usize| {
            let [u, v, _] = vertices[vertex];
            Corner { vertex, uv: [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)] }
        };
        let mut panels: Vec<Vec<Corner>> =
            faces.iter().map(|f| f.iter().map(corner).collect()).collect();
        // A layout drawn clockwise throughout is turned over as a whole.
        if panels.iter().map(|p| polygon::area(p)).sum::<f64>() < 0.0 {
            panels.iter_mut().for_each(|p| p.reverse());
        }
        polygon::check(&panels)?;
        Ok(Self { panels })
    }

    /// Number of panels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.panels.len()
    }

    /// Whether there are no panels; never so.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.panels.is_empty()
    }

    pub(crate) fn panels(&self) -> &[Vec<Corner>] {
        &self.panels
    }

    /// Stretches the layout so that equal steps become equal mean arc lengths on the surface,
    /// in each direction separately.
    #[must_use]
    pub fn with_equal_arc_length(mut self, surface: &BsplineSurface) -> Self {
        let maps = [arc_length_map(surface, 0), arc_length_map(surface, 1)];
        for corner in self.panels.iter_mut().flatten() {
            for k in 0..2 {
                let whole = corner.uv[k].floor();
                let part = corner.uv[k] - whole;
                let map = &maps[k];
                let steps = (map.len() - 1) as f64;
                let at = (map.partition_point(|&s| s <= part).max(1) - 1).min(map.len() - 2);
                let share = (part - map[at]) / (map[at + 1] - map[at]);
                corner.uv[k] = whole + (at as f64 + share) / steps;
            }
        }
        self
    }
}

/// Share of the mean length at equal parameter steps, from 0 to 1, strictly rising.
fn arc_length_map(surface: &BsplineSurface, direction: usize) -> Vec<f64> {
    const STEPS: usize = 512;
    const LINES: usize = 16;
    let (along, across) = if direction == 0 {
        (surface.knots_u(), surface.knots_v())
    } else {
        (surface.knots_v(), surface.knots_u())
    };
    let (start, end) = along.domain();
    let t: Vec<f64> =
        (0..=STEPS).map(|i| start + (end - start) * i as f64 / STEPS as f64).collect();
    let lines = across.cell_midpoints(LINES);
    let points = if direction == 0 {
        surface.point_grid(&t, &lines)
    } else {
        bspline_transpose(&surface.point_grid(&lines, &t), LINES)
    };
    let mut map = vec![0.0];
    for i in 0..STEPS {
        let step: f64 =
            (0..LINES).map(|j| points[i * LINES + j].distance(points[(i + 1) * LINES + j])).sum();
        map.push(map[i] + step);
    }
    let total = map[STEPS].max(f64::MIN_POSITIVE);
    // A little of the parameter keeps the map invertible where the surface does not move.
    let blend = |(i, s): (usize, f64)| (1.0 - 1e-9) * s / total + 1e-9 * i as f64 / STEPS as f64;
    map.into_iter().enumerate().map(blend).collect()
}

fn bspline_transpose<T: Copy>(values: &[T], rows: usize) -> Vec<T> {
    let columns = values.len() / rows;
    (0..values.len()).map(|k| values[(k % rows) * columns + k / rows]).collect()
}

fn quads(u: usize, v: usize, closed: [bool; 2]) -> Builder {
    let mut b = Builder::new([u, v], closed);
    for i in 0..u {
        for j in 0..v {
            b.add(&[[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]]);
        }
    }
    b
}

fn triangles(u: usize, v: usize, closed: [bool; 2]) -> Builder {
    let mut b = Builder::new([u, v], closed);
    for i in 0..u {
        for j in 0..v {
            b.add(&[[i, j], [i + 1, j], [i + 1, j + 1]]);
            b.add(&[[i, j], [i + 1, j + 1], [i, j + 1]]);
        }
    }
    b
}

/// Rows of bricks, every other row moved by half a brick. With `tooth` 0 the rows are straight;
/// with `tooth` 1 the corners of a brick are raised and lowered in turn, which makes hexagons.
///
/// Corners of one row that lie on the edges of the next are corners there too, so that every
/// seam has one panel on either side.
fn bricks(u: usize, v: usize, closed: [bool; 2], tooth: usize) -> Builder {
    // In u half bricks; in v three units a row, one of which a tooth takes.
    let mut b = Builder::new([2 * u, 3 * v], closed);
    // On line `line` bricks of the row above end at i ≡ line (mod 2), those below in between.
    let height = |i: usize, line: usize| {
        let is_border = !closed[1] && (line == 0 || line == v);
        let is_raised = !is_border && (i + line).is_multiple_of(2);
        3 * line + if is_raised { tooth } else { 0 }
    };
    for j in 0..v {
        let shift = j % 2;
        let mut bricks: Vec<(usize, usize)> =
            (0..u).map(|i| (2 * i + shift, 2 * i + shift + 2)).collect();
        if shift == 1 && !closed[0] {
            bricks[u - 1].1 -= 1;
            bricks.insert(0, (0, 1));
        }
        for (start, end) in bricks {
            let lower = (start..=end).map(|i| [i, height(i, j)]);
            let upper = (start..=end).rev().map(|i| [i, height(i, j + 1)]);
            b.add(&lower.chain(upper).collect::<Vec<_>>());
        }
    }
    b
}

fn diagonals(u: usize, v: usize, closed: [bool; 2]) -> Builder {
    let mut b = Builder::new([2 * u, 2 * v], closed);
    for i in 0..u {
        for j in 0..v {
            // The diamond inside the cell.
            let (x, y) = (2 * i, 2 * j);
            b.add(&[[x + 1, y], [x + 2, y + 1], [x + 1, y + 2], [x, y + 1]]);
        }
    }
    // The diamonds around the corners of the cells, cut off at open borders.
    for i in 0..=u {
        for j in 0..=v {
            if (closed[0] && i == u) || (closed[1] && j == v) {
                continue;
            }
            // A diamond around a corner on the seam of a closed direction is drawn one period on.
            let x = 2 * i + if closed[0] && i == 0 { 2 * u } else { 0 };
            let y = 2 * j + if closed[1] && j == 0 { 2 * v } else { 0 };
            let inside =
                |k: usize, at: usize, last: usize| [closed[k] || at > 0, closed[k] || at < last];
            let ([west, east], [south, north]) = (inside(0, i, u), inside(1, j, v));
            let mut corners = Vec::new();
            if south {
                corners.push([x, y - 1]);
            }
            if !(south && east) {
                corners.push([x, y]);
            }
            if east {
                corners.push([x + 1, y]);
            }
            if !(corners.contains(&[x, y]) || east && north) {
                corners.push([x, y]);
            }
            if north {
                corners.push([x, y + 1]);
            }
            if !(corners.contains(&[x, y]) || north && west) {
                corners.push([x, y]);
            }
            if west {
                corners.push([x - 1, y]);
            }
            if corners.len() >= 3 {
                b.add(&corners);
            }
        }
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    fn total_area(layout: &Layout) -> f64 {
        layout.panels().iter().map(|p| polygon::area(p)).sum()
    }

    #[test]
    fn every_pattern_covers_the_square_once_with_matching_edges() {
        for pattern in Pattern::ALL {
            for closed in [[false, false], [true, false], [false, true], [true, true]] {
                let layout = Layout::generate(pattern, 5, 6, closed).unwrap();
                assert_close(total_area(&layout), 1.0, 1e-12);
                let mut edges: HashMap<(usize, usize), usize> = HashMap::new();
                for panel in layout.panels() {
                    assert!(polygon::area(panel) > 0.0, "{pattern:?} {closed:?}");
                    for (k, a) in panel.iter().enumerate() {
                        let b = panel[(k + 1) % panel.len()];
                        *edges.entry((a.vertex, b.vertex)).or_default() += 1;
                    }
                }
                assert!(edges.values().all(|&n| n == 1), "{pattern:?}: an edge used twice");
                // Border edges lie on the border, which a closed direction does not have.
                let border = edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a))).count();
                assert_eq!(border == 0, closed == [true, true], "{pattern:?} {closed:?}: {border}");
            }
            let layout = Layout::generate(pattern, 5, 6, [false, false]).unwrap();
            polygon::check(layout.panels()).unwrap();
        }
    }

    #[test]
    fn faults_are_named() {
        let generate = |p, u, v, closed| Layout::generate(p, u, v, closed).unwrap_err().to_string();
        assert_eq!(
            generate(Pattern::Quad, 0, 4, [false; 2]),
            "a layout of 0 x 4 panels has none; ask for at least 1 x 1"
        );
        assert!(generate(Pattern::Quad, 1_000_000, 1_000_000, [false; 2]).contains("more than"));
        assert!(generate(Pattern::Quad, 2, 4, [true, false]).contains("at least 3 panels"));
        assert!(generate(Pattern::Hexagon, 4, 5, [false, true]).contains("even number"));
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let from = |vertices: &[[f64; 3]], faces: &[&[usize]]| {
            let faces: Vec<Vec<usize>> = faces.iter().map(|f| f.to_vec()).collect();
            Layout::from_polygons(vertices, &faces)
        };
        assert_eq!(from(&square, &[&[0, 1, 2, 3]]).unwrap().len(), 1);
        assert_eq!(from(&square, &[&[3, 2, 1, 0]]).unwrap().len(), 1, "turned over as a whole");
        let mut raised = square;
        raised[2][2] = 0.5;
        assert!(matches!(from(&raised, &[&[0, 1, 2, 3]]), Err(Error::NotPlanar { vertex: 2, .. })));
        let mut far = square;
        far[1][0] = 1.5;
        assert!(matches!(
            from(&far, &[&[0, 1, 2, 3]]),
            Err(Error::OutsideDomain { vertex: 1, .. })
        ));
        assert!(matches!(from(&square, &[&[0, 1, 3, 2]]), Err(Error::BadFace { face: 0 })));
        let overlapping = from(&square, &[&[0, 1, 2], &[0, 1, 3]]);
        assert!(matches!(overlapping, Err(Error::Overlap { .. })));
        assert!(matches!(from(&square, &[]), Err(Error::NoPanels { .. })));
    }

    #[test]
    fn equal_arc_length_evens_out_an_uneven_parametrisation() {
        use bspline::{Degree, KnotVector};
        use geom_core::DVec3;
        // x = u², a plane with slow parameters at the start.
        let quadratic = KnotVector::clamped_uniform(Degree::new(2).unwrap(), 3).unwrap();
        let line = KnotVector::clamped_uniform(Degree::new(1).unwrap(), 2).unwrap();
        let points = [0.0, 0.0, 1.0]
            .iter()
            .flat_map(|&x| [0.0, 1.0].map(|y| DVec3::new(x, y, 0.0)))
            .collect();
        let surface = BsplineSurface::new(quadratic, line, points, None).unwrap();
        let layout = Layout::generate(Pattern::Quad, 4, 2, [false; 2]).unwrap();
        let layout = layout.with_equal_arc_length(&surface);
        let u = layout.panels()[2].first().unwrap().uv[0];
        assert_close(u, 0.5, 1e-4);
        assert_close(total_area(&layout), 1.0, 1e-12);
    }
}
