//! Views of smooth surfaces, sampled with their exact normals and curvatures.

use crate::failure::{Failure, refused};
use bspline::{BsplineSurface, KnotVector, SurfaceCurvature};
use geom_core::{DVec2, DVec3, SurfaceJet, asymptotic_directions, principal_curvatures};
use report::{FaceGroups, LineRole, LineSet, ScalarField, SurfaceView};
use std::collections::BTreeMap;

/// Vertices aimed at for a whole view: fine enough to look smooth, small enough for a page.
const VERTICES: f64 = 12_000.0;
/// Direction strokes aimed at for a whole view.
const STROKES: f64 = 500.0;
/// How far inside a pole or collapsed edge its normal is taken, as a share of the domain.
const INSIDE: f64 = 1e-5;

/// A rectangular piece of surface, `jets[i * columns + j]`, to at least second order.
#[derive(Clone, Debug, Default)]
pub(crate) struct JetGrid {
    pub(crate) jets: Vec<SurfaceJet>,
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    /// H and K of places, such as poles, whose jets do not hold them.
    pub(crate) known: BTreeMap<usize, (f64, f64)>,
}

impl JetGrid {
    /// Points per side of each of `count` pieces so that the whole is neither coarse nor heavy.
    pub(crate) fn side_for(count: usize) -> usize {
        (VERTICES / count.max(1) as f64).sqrt().clamp(4.0, 110.0) as usize
    }
}

/// `jet`, or the position of `jet` with the derivatives from just inside where it is singular or
/// `on_pole`, where the tangents may be noise.
fn regular(jet: SurfaceJet, on_pole: bool, inside: impl Fn() -> SurfaceJet) -> SurfaceJet {
    if jet.normal().is_ok() && !on_pole {
        return jet;
    }
    let mut moved = inside();
    moved.derivatives[0] = jet.derivatives[0];
    moved
}

/// A view of smooth pieces with H, K and the principal curvatures, grouped as `patches` if there
/// are several, with strokes along the principal and asymptotic directions.
pub(crate) fn jets_view(
    name: &str,
    grids: &[JetGrid],
    length_unit: &str,
) -> Result<SurfaceView, Failure> {
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    let (mut h, mut k, mut k1, mut k2) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut of_triangle = Vec::new();
    for (patch, grid) in grids.iter().enumerate() {
        let base = positions.len() as u32;
        let mut sound = Vec::with_capacity(grid.jets.len());
        for (place, jet) in grid.jets.iter().enumerate() {
            let normal = jet.normal();
            sound.push(normal.is_ok() && jet.position().is_finite());
            positions.push(if jet.position().is_finite() { jet.position() } else { DVec3::ZERO });
            normals.push(normal.unwrap_or(DVec3::Z));
            if let Some(&(mean, gaussian)) = grid.known.get(&place) {
                let half = (mean * mean - gaussian).max(0.0).sqrt();
                let all = [(&mut h, mean), (&mut k, gaussian)];
                let all = all.into_iter().chain([(&mut k1, mean + half), (&mut k2, mean - half)]);
                all.for_each(|(list, value)| list.push(value));
                continue;
            }
            h.push(jet.mean_curvature().unwrap_or(f64::NAN));
            k.push(jet.gaussian_curvature().unwrap_or(f64::NAN));
            let second = jet.second_form();
            let principal = second.and_then(|s| principal_curvatures(jet.first_form(), s));
            let (a, b) = principal.map_or((f64::NAN, f64::NAN), |p| (p.k1, p.k2));
            k1.push(a);
            k2.push(b);
        }
        for t in SurfaceView::grid_triangles(grid.rows, grid.columns) {
            if t.iter().all(|&v| sound[v as usize]) {
                triangles.push(t.map(|v| v + base));
                of_triangle.push(patch as u32);
            }
        }
    }
    let mut view = SurfaceView::new(name, positions, normals, triangles)
        .and_then(|v| v.with_field(ScalarField::mean_curvature(h, length_unit)))
        .and_then(|v| v.with_field(ScalarField::gaussian_curvature(k, length_unit)))
        .and_then(|v| v.with_field(ScalarField::kappa1(k1, length_unit)))
        .and_then(|v| v.with_field(ScalarField::kappa2(k2, length_unit)))
        .map_err(refused)?;
    if grids.len() > 1 {
        let names = (0..grids.len()).map(|i| format!("patch {i}")).collect();
        let (id, label) = ("patches".to_owned(), "patches".to_owned());
        view = view.with_groups(FaceGroups { id, label, of_triangle, names }).map_err(refused)?;
    }
    for lines in direction_strokes(grids) {
        if !lines.polylines.is_empty() {
            view = view.with_lines(lines).map_err(refused)?;
        }
    }
    Ok(view)
}

/// A view of spline surfaces with their control nets and knot lines.
///
/// `reference` are the surfaces the work started from, one for each: their distance at the same
/// parameters becomes the field `deviation`.
pub(crate) fn spline_view(
    name: &str,
    surfaces: &[&BsplineSurface],
    reference: Option<&[&BsplineSurface]>,
    length_unit: &str,
) -> Result<SurfaceView, Failure> {
    let side = JetGrid::side_for(surfaces.len());
    let mut grids = Vec::with_capacity(surfaces.len());
    let (mut deviation, mut knot_lines, mut net) = (Vec::new(), Vec::new(), Vec::new());
    for (i, surface) in surfaces.iter().enumerate() {
        let u = parameters(surface.knots_u(), side);
        let v = parameters(surface.knots_v(), side);
        let mut jets = surface.jet_grid(&u, &v, 2);
        let middle = [mid(surface.knots_u()), mid(surface.knots_v())];
        let (poles, curvature) = (surface.pole_sides(None), SurfaceCurvature::new(surface).ok());
        let mut known = BTreeMap::new();
        for (index, jet) in jets.iter_mut().enumerate() {
            let (u, v) = (u[index / v.len()], v[index % v.len()]);
            let inside = |t: f64, m: f64| t + INSIDE * (m - t);
            let on_pole = surface.is_on_pole(&poles, [u, v]);
            let curvatures = curvature.as_ref().filter(|_| on_pole).and_then(|c| c.at(u, v).ok());
            known.extend(curvatures.map(|c| (index, c)));
            let beside = || surface.jet(inside(u, middle[0]), inside(v, middle[1]), 2);
            *jet = regular(*jet, on_pole, beside);
        }
        if let Some(from) = reference {
            let distance = jets.iter().zip(from[i].point_grid(&u, &v));
            deviation.extend(distance.map(|(jet, p)| jet.position().distance(p)));
        }
        for &knot in &surface.knots_u().breaks() {
            knot_lines.push(surface.point_grid(&[knot], &v));
        }
        for &knot in &surface.knots_v().breaks() {
            knot_lines.push(surface.point_grid(&u, &[knot]));
        }
        let lines = LineSet::control_net(surface.control_points(), surface.n_u(), surface.n_v());
        net.extend(lines.polylines);
        grids.push(JetGrid { jets, rows: u.len(), columns: v.len(), known });
    }
    let mut view = jets_view(name, &grids, length_unit)?;
    if reference.is_some() {
        let field = ScalarField::deviation(deviation, length_unit);
        view = view.with_field(field).map_err(refused)?;
    }
    view.with_lines(LineSet::new("knots", "knot lines", LineRole::Mesh, knot_lines))
        .and_then(|v| {
            v.with_lines(LineSet::new("control-net", "control net", LineRole::ControlNet, net))
        })
        .map_err(refused)
}

/// Parameters with equal steps within every knot span, about `count` in all, the ends included.
/// A knot where the surface may have a crease comes twice, so that each side keeps its normal.
fn parameters(knots: &KnotVector, count: usize) -> Vec<f64> {
    let breaks = knots.breaks();
    let spans = breaks.len() - 1;
    let steps = count.div_ceil(spans).max(2);
    let (start, end) = knots.domain();
    let mut all = vec![start];
    for pair in breaks.windows(2) {
        if pair[0] > start && knots.multiplicity(pair[0]) >= knots.degree().get() {
            if let Some(last) = all.last_mut() {
                *last -= 1e-12 * (end - start);
            }
            all.push(pair[0]);
        }
        let step = (pair[1] - pair[0]) / steps as f64;
        all.extend((1..steps).map(|i| pair[0] + step * i as f64));
        all.push(pair[1]);
    }
    all
}

fn mid(knots: &KnotVector) -> f64 {
    let (start, end) = knots.domain();
    0.5 * (start + end)
}

/// Strokes along the two principal directions and, where K < 0, along the asymptotic ones.
fn direction_strokes(grids: &[JetGrid]) -> [LineSet; 2] {
    let total: usize = grids.iter().map(|g| g.jets.len()).sum();
    let step = ((total as f64 / STROKES).sqrt().ceil() as usize).max(1);
    let (mut principal, mut asymptotic) = (Vec::new(), Vec::new());
    for grid in grids {
        // Strokes keep off the border by half a step, also on a patch smaller than one step.
        let places = |n: usize| (step.min(n) / 2..n).step_by(step);
        for i in places(grid.rows) {
            for j in places(grid.columns) {
                let at = |i: usize, j: usize| grid.jets[i * grid.columns + j];
                let jet = at(i, j);
                let next = at(if i + 1 < grid.rows { i + 1 } else { i.saturating_sub(1) }, j);
                let length = 0.36 * step as f64 * jet.position().distance(next.position());
                let Ok(second) = jet.second_form() else { continue };
                let stroke = |into: &mut Vec<Vec<DVec3>>, direction: DVec2| {
                    let half = jet.tangent(direction).normalize_or_zero() * length;
                    let ends = [jet.position() - half, jet.position() + half];
                    if ends.iter().all(|p| p.is_finite()) {
                        into.push(ends.to_vec());
                    }
                };
                if let Ok(p) = principal_curvatures(jet.first_form(), second) {
                    stroke(&mut principal, p.direction1);
                    stroke(&mut principal, p.direction2);
                }
                if let Ok(Some(pair)) = asymptotic_directions(jet.first_form(), second) {
                    pair.iter().for_each(|d| stroke(&mut asymptotic, *d));
                }
            }
        }
    }
    let set = |id, label, lines| LineSet::new(id, label, LineRole::Directions, lines);
    [
        set("principal", "principal directions", principal),
        set("asymptotic", "asymptotic directions", asymptotic),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::surfaces;

    #[test]
    fn a_torus_keeps_its_curvatures_and_lines() {
        let torus = surfaces::torus_patch(5, 6);
        let view = spline_view("torus", &[&torus], Some(&[&torus]), "m").unwrap();
        let ids: Vec<&str> = view.fields().iter().map(|f| f.id.as_str()).collect();
        assert_eq!(ids, ["H", "K", "kappa1", "kappa2", "deviation"]);
        assert!(view.field("deviation").unwrap().values.iter().all(|d| *d == 0.0));
        assert!(view.positions().len() < 20_000 && view.positions().len() > 6_000);
        let lines: Vec<&str> = view.lines().iter().map(|l| l.id.as_str()).collect();
        assert_eq!(lines, ["principal", "asymptotic", "knots", "control-net"]);
    }

    #[test]
    fn parameters_keep_the_ends_and_double_creases() {
        let degree = bspline::Degree::new(2).unwrap();
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        let knots = KnotVector::new(degree, knots).unwrap();
        let t = parameters(&knots, 4);
        assert_eq!(t.len(), 6);
        assert_eq!((t[0], t[5]), (0.0, 2.0));
        assert!(t[2] < 1.0 && t[3] == 1.0 && t[3] - t[2] < 1e-11);
    }

    #[test]
    fn a_pole_is_drawn_with_a_normal_from_just_inside() {
        let cone = |u: f64, v: f64| {
            let mut jet = SurfaceJet::default();
            let (sin, cos) = v.sin_cos();
            jet.derivatives[0] = DVec3::new(u * cos, u * sin, u);
            jet.derivatives[1] = DVec3::new(cos, sin, 1.0);
            jet.derivatives[2] = DVec3::new(-u * sin, u * cos, 0.0);
            jet
        };
        let jets = (0..20).map(|k| {
            let (u, v) = (f64::from(k / 5) / 3.0, f64::from(k % 5) / 4.0);
            regular(cone(u, v), false, || cone(u + INSIDE, v))
        });
        let grid = JetGrid { jets: jets.collect(), rows: 4, columns: 5, ..JetGrid::default() };
        assert!(grid.jets.iter().all(|jet| jet.normal().is_ok()));
        let view = jets_view("cone", &[grid], "").unwrap();
        assert_eq!(view.triangles().len(), 24);
        assert_eq!(view.positions()[0], DVec3::ZERO);
    }
}
