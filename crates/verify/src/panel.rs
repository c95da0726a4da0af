//! Claims of `panel`: how the written panels meet, and how far they are from the design.
//!
//! A written panel is a fan of triangles over the points it was fitted with: four to a side of its
//! border, of which every fourth is a corner, then two to a side inside, then the middle. Along a
//! seam both panels have a point on the normal of the design at the same five places, so the
//! distance of the two is the gap. The table of the panels has the molds and where they stand, and
//! with the design everything else.

use crate::claims::Values;
use crate::content::{Content, Mesh, PanelRow, diagonal};
use crate::shape::angle_deg;
use crate::spline::{Jet, NearestGrid, Spline};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Points of a side without its last one.
const STEPS: usize = 4;
/// Sides of two panels are one seam if their middles and ends are closer than this share of their
/// length.
const REACH: f64 = 0.25;
/// The same on the design itself, where only rounding is between them.
const SAME_PLACE: f64 = 1e-6;

pub(crate) fn recompute(content: &Content, input: Option<&Spline>, values: &mut Values) {
    if !content.panels.is_empty() {
        table(content, values);
        if let Some(design) = input {
            on_molds(content, design, values);
        }
    }
    if !content.surfaces.is_empty() {
        values.count("molds", content.surfaces.len());
    }
    let panels: Vec<Panel> = content.meshes.iter().flat_map(panels_of).collect();
    if panels.is_empty() || panels.iter().any(|p| p.sides == 0) {
        return;
    }
    values.count("panels", panels.len());
    let mut gaps = Vec::new();
    for [a, b] in seams(&panels, REACH) {
        for k in 0..=STEPS {
            gaps.push(panels[a.0].at(a.1, k).distance(panels[b.0].at(b.1, STEPS - k)));
        }
    }
    spread(&mut gaps, "gap", "", 1.0, values);
    if let Some(design) = input {
        deviations(&panels, design, &mut gaps, values);
    }
}

/// What the table says itself.
fn table(content: &Content, values: &mut Values) {
    values.count("panels", content.panels.len());
    let mut molds: Vec<usize> = content.panels.iter().map(|p| p.mold).collect();
    molds.sort_unstable();
    molds.dedup();
    values.count("molds", if content.molds.is_empty() { molds.len() } else { content.molds.len() });
    let most = |f: fn(&PanelRow) -> f64| content.panels.iter().map(f).fold(0.0, f64::max);
    values.number("kink_max_deg", most(|p| p.worst_kink_deg));
    values.number("gap_max", most(|p| p.worst_gap));
}

/// Kinks, gaps and deviations of the molds of the table where it puts them, at the points of the
/// design the corners give.
fn on_molds(content: &Content, design: &Spline, values: &mut Values) {
    let (rows, molds) = (&content.panels, &content.molds);
    if rows.iter().any(|row| row.corners.len() < 3 || row.mold >= molds.len()) {
        return;
    }
    let designs: Vec<[Panel; 2]> = rows.par_iter().map(|row| on_design(design, row)).collect();
    let (points, normals): (Vec<Panel>, Vec<Panel>) =
        designs.into_iter().map(|[p, n]| (p, n)).unzip();
    // Offset and normal of the mold of panel `p` from a point of the design along its normal.
    let foot = |p: usize, at: DVec3, normal: DVec3| {
        let row = &rows[p];
        let [x, z] = row.axes;
        let frame = DMat3::from_cols(x, z.cross(x), z);
        let to_local = frame.transpose();
        let (t, mold) = molds[row.mold].foot(to_local * (at - row.origin), to_local * normal);
        (t, frame * mold)
    };
    let seams = seams(&points, SAME_PLACE);
    let both: Vec<(f64, f64)> = seams
        .par_iter()
        .flat_map_iter(|[a, b]| {
            let (points, normals) = (&points, &normals);
            (0..=STEPS).map(move |k| {
                let (at, n) = (points[a.0].at(a.1, k), normals[a.0].at(a.1, k));
                let ((s, m), (t, o)) = (foot(a.0, at, n), foot(b.0, at, n));
                ((s - t).abs(), angle_deg(m, o))
            })
        })
        .collect();
    let (mut gaps, mut kinks): (Vec<f64>, Vec<f64>) = both.into_iter().unzip();
    let offsets: Vec<f64> = (0..rows.len())
        .into_par_iter()
        .flat_map_iter(|p| {
            let pairs = points[p].points.iter().zip(&normals[p].points);
            pairs.map(move |(at, n)| foot(p, *at, *n).0.abs())
        })
        .collect();
    spread(&mut gaps, "gap", "", 1.0, values);
    spread(&mut kinks, "kink", "_deg", 1.0, values);
    let all = points.iter().flat_map(|p| p.points.iter().copied());
    percentages(design, diagonal(all), &offsets, &mut gaps, values);
}

/// Deviations and gaps in percent of the size of the design, and of the diagonal of the box around
/// the points of it that panels were fitted to.
fn percentages(
    design: &Spline,
    diagonal: Option<f64>,
    offsets: &[f64],
    gaps: &mut [f64],
    values: &mut Values,
) {
    let most = offsets.iter().copied().fold(0.0, f64::max);
    for (of, length) in [("", design.size()), ("_box", diagonal.filter(|d| *d > 0.0))] {
        let Some(length) = length else { continue };
        values.number(&format!("deviation_max_percent{of}"), 100.0 * most / length);
        let rms = rms(offsets.iter().copied());
        values.number(&format!("deviation_rms_percent{of}"), 100.0 * rms / length);
        spread(gaps, "gap", &format!("_percent{of}"), 100.0 / length, values);
    }
}

/// Points of the design a panel is fitted to, and its unit normals there, in the order of a written
/// panel.
fn on_design(design: &Spline, row: &PanelRow) -> [Panel; 2] {
    let corners = &row.corners;
    let n = corners.len();
    let lerp = |a: [f64; 2], b: [f64; 2], t: f64| [0, 1].map(|k| a[k] + t * (b[k] - a[k]));
    let middle = [0, 1].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / n as f64);
    let along = |side: usize, t: f64| lerp(corners[side], corners[(side + 1) % n], t);
    let mut places: Vec<[f64; 2]> = (0..n)
        .flat_map(|side| (0..STEPS).map(move |k| (side, k as f64 / STEPS as f64)))
        .map(|(side, t)| along(side, t))
        .collect();
    for side in 0..n {
        places.push(lerp(along(side, 0.0), middle, 0.5));
        places.push(lerp(along(side, 0.5), middle, 0.5));
    }
    places.push(middle);
    let jets: Vec<Jet> = places.iter().map(|[u, v]| design.jet_around(*u, *v, 1)).collect();
    let normal = |jet: &Jet| jet.d[1][0].cross(jet.d[0][1]).normalize();
    [
        Panel { points: jets.iter().map(|jet| jet.d[0][0]).collect(), sides: n },
        Panel { points: jets.iter().map(normal).collect(), sides: n },
    ]
}

/// A panel: its points, or what there is at each, in the order of the file.
struct Panel {
    points: Vec<DVec3>,
    /// 0 if the points are not those of a panel.
    sides: usize,
}

impl Panel {
    /// Point `k` of 5 along a side.
    fn at(&self, side: usize, k: usize) -> DVec3 {
        self.points[(STEPS * side + k) % (STEPS * self.sides)]
    }
}

/// Connected parts of a mesh, each a panel.
fn panels_of(mesh: &Mesh) -> Vec<Panel> {
    let mut root: Vec<usize> = (0..mesh.positions.len()).collect();
    fn find(root: &mut [usize], mut v: usize) -> usize {
        while root[v] != v {
            root[v] = root[root[v]];
            v = root[v];
        }
        v
    }
    for face in &mesh.faces {
        for pair in face.windows(2) {
            let (a, b) = (find(&mut root, pair[0]), find(&mut root, pair[1]));
            root[a.max(b)] = a.min(b);
        }
    }
    let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let used = mesh.faces.iter().flatten().copied().collect::<std::collections::BTreeSet<_>>();
    for v in used {
        parts.entry(find(&mut root, v)).or_default().push(v);
    }
    let panel = |part: Vec<usize>| {
        let n = part.len();
        let per_side = STEPS + STEPS / 2;
        let sides = if n % per_side == 1 && n > 3 * per_side { n / per_side } else { 0 };
        Panel { points: part.iter().map(|v| mesh.positions[*v]).collect(), sides }
    };
    parts.into_values().map(panel).collect()
}

/// A side of a panel.
type Side = (usize, usize);

/// Pairs of sides of different panels that lie along one another, in opposite directions.
///
/// `reach` is how far apart they may be, as a share of their length.
fn seams(panels: &[Panel], reach: f64) -> Vec<[Side; 2]> {
    let sides: Vec<Side> =
        (0..panels.len()).flat_map(|p| (0..panels[p].sides).map(move |k| (p, k))).collect();
    let at = |(p, side): Side, k: usize| panels[p].at(side, k);
    let length = |side: Side| at(side, 0).distance(at(side, STEPS));
    let longest = sides.iter().map(|s| length(*s)).fold(0.0, f64::max);
    if !(longest > 0.0) {
        return Vec::new();
    }
    let key = |p: DVec3| (p / (REACH * longest)).to_array().map(|x| x.floor() as i64);
    let mut cells: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (index, side) in sides.iter().enumerate() {
        cells.entry(key(at(*side, STEPS / 2))).or_default().push(index);
    }
    let apart = |a: Side, b: Side| {
        [0, STEPS / 2, STEPS].map(|k| at(a, k).distance(at(b, STEPS - k))).into_iter().sum::<f64>()
    };
    let mut out = Vec::new();
    for (index, side) in sides.iter().enumerate() {
        let reach = reach * length(*side);
        let [x, y, z] = key(at(*side, STEPS / 2));
        let mut best: Option<(f64, usize)> = None;
        for cell in (-1..=1)
            .flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [x + i, y + j, z + k])))
        {
            for &other in cells.get(&cell).into_iter().flatten() {
                let far = apart(*side, sides[other]);
                if other != index && far < reach && best.is_none_or(|(least, _)| far < least) {
                    best = Some((far, other));
                }
            }
        }
        out.extend(
            best.filter(|(_, other)| *other > index).map(|(_, other)| [*side, sides[other]]),
        );
    }
    out
}

/// Median, 95th percentile, largest and root mean square.
fn spread(list: &mut [f64], name: &str, unit: &str, factor: f64, values: &mut Values) {
    list.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = share * list.len().saturating_sub(1) as f64;
        let (low, part) = (place.floor() as usize, place.fract());
        let (Some(a), b) = (list.get(low), list.get(low + 1)) else { return 0.0 };
        a + part * (b.unwrap_or(a) - a)
    };
    values.number(&format!("{name}_median{unit}"), factor * at(0.5));
    values.number(&format!("{name}_p95{unit}"), factor * at(0.95));
    values.number(&format!("{name}_max{unit}"), factor * at(1.0));
    values.number(&format!("{name}_rms{unit}"), factor * rms(list.iter().copied()));
}

fn rms(list: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = list.fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
}

/// Distances of all points from the design. The feet are the points of the design the panels were
/// fitted to.
fn deviations(panels: &[Panel], design: &Spline, gaps: &mut [f64], values: &mut Values) {
    let grid = NearestGrid::new(design);
    let points: Vec<DVec3> = panels.iter().flat_map(|p| p.points.iter().copied()).collect();
    let found: Vec<(DVec3, f64)> = points
        .par_iter()
        .map(|p| {
            let ([u, v], far) = design.nearest(&grid, *p);
            (design.jet(u, v, 0).d[0][0], far)
        })
        .collect();
    let (feet, offsets): (Vec<DVec3>, Vec<f64>) = found.into_iter().unzip();
    percentages(design, diagonal(feet.into_iter()), &offsets, gaps, values);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mold::Mold;

    /// Two unit squares side by side in a plane, the second lifted and tilted about the seam.
    fn two(lift: f64, tilt: f64) -> Content {
        let mut mesh = Mesh::default();
        let mut panels = Vec::new();
        for panel in 0..2 {
            let first = mesh.positions.len();
            let x0 = f64::from(panel);
            let slope = x0 * tilt;
            let corners = [[x0, 0.0], [x0 + 1.0, 0.0], [x0 + 1.0, 1.0], [x0, 1.0]];
            let row = PanelRow {
                mold: 0,
                origin: DVec3::new(1.0, 0.0, x0 * lift),
                axes: [DVec3::new(1.0, 0.0, slope), DVec3::new(-slope, 0.0, 1.0)]
                    .map(DVec3::normalize),
                corners: corners.map(|[x, y]| [0.5 * x, y]).to_vec(),
                worst_kink_deg: 1.0,
                worst_gap: 2.0,
            };
            let [points, _] = on_design(&design(), &row);
            let at = |p: &DVec3| DVec3::new(p.x, p.y, slope * (p.x - 1.0) + x0 * lift);
            mesh.positions.extend(points.points.iter().map(at));
            for k in 0..24 {
                mesh.faces.push(vec![first + k, first + (k + 1) % 24, first + 24]);
            }
            panels.push(row);
        }
        let molds = vec![Mold::Plane];
        Content { meshes: vec![mesh], panels, molds, ..Content::default() }
    }

    fn design() -> Spline {
        let corners = [(0.0, 0.0), (0.0, 1.0), (2.0, 0.0), (2.0, 1.0)];
        Spline::bezier(1, &corners.map(|(x, y)| DVec3::new(x, y, 0.0))).unwrap()
    }

    #[test]
    fn the_seam_between_two_panels_is_measured() {
        let both = two(0.01, 0.02);
        let mesh = Content { panels: Vec::new(), ..both.clone() };
        let table = Content { meshes: Vec::new(), ..both };
        for (content, has_normals) in [(mesh, false), (table, true)] {
            let mut values = Values::default();
            recompute(&content, Some(&design()), &mut values);
            let get = |key: &str| values.get(key).unwrap();
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
            assert_eq!(get("panels"), 2.0);
            for key in ["gap_median", "gap_p95", "gap_max", "gap_rms"] {
                close(get(key), 0.01);
            }
            if has_normals {
                close(get("kink_max_deg"), 0.02_f64.atan().to_degrees());
            }
            close(get("deviation_max_percent"), 100.0 * 0.03 / 5.0_f64.sqrt());
            close(get("gap_max_percent"), 1.0 / 5.0_f64.sqrt());
        }
    }

    #[test]
    fn a_table_without_molds_is_held_to_what_it_says() {
        let content = two(0.0, 0.0);
        let table = Content { meshes: Vec::new(), molds: Vec::new(), ..content };
        let mut values = Values::default();
        recompute(&table, Some(&design()), &mut values);
        assert_eq!((values.get("molds"), values.get("kink_max_deg")), (Some(1.0), Some(1.0)));
        assert_eq!((values.get("panels"), values.get("gap_max")), (Some(2.0), Some(2.0)));
        assert_eq!(values.get("gap_rms"), None);
    }
}
