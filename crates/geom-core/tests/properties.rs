//! What holds for any surface point, any triangles and any mesh.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use geom_core::{
    DMat3, DVec2, DVec3, PolyMesh, QuadGrid, SurfaceJet, ThirdOrder, TriMesh, VertexId,
    asymptotic_directions, closest_barycentric, closest_on_segment, gradient_norm_squared,
    isolines, normal_curvature, principal_curvatures, vertex_curvatures,
};
use proptest::collection::vec;
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

fn near(got: f64, wanted: f64, bound: f64) -> Result<(), TestCaseError> {
    let off = (got - wanted).abs();
    prop_assert!(off <= bound, "got {got}, wanted {wanted}: off by {off:e}, allowed {bound:e}");
    Ok(())
}

/// Derivatives up to order three at a regular point: the tangents are at least 60° apart.
fn any_jet() -> impl Strategy<Value = SurfaceJet> {
    (vec(-0.25..0.25_f64, 6), vec(-2.0..2.0_f64, 21)).prop_map(|(tangents, higher)| {
        let vector = |v: &[f64]| DVec3::from_slice(v);
        let mut jet = SurfaceJet::default();
        jet.derivatives[1] = DVec3::X + vector(&tangents[..3]);
        jet.derivatives[2] = DVec3::Y + vector(&tangents[3..]);
        for (slot, value) in jet.derivatives[3..10].iter_mut().zip(higher.chunks_exact(3)) {
            *slot = vector(value);
        }
        jet
    })
}

/// A rotation from any four numbers that are not all small.
fn any_rotation() -> impl Strategy<Value = DMat3> {
    (vec(-1.0..1.0_f64, 3), 0.0..TAU).prop_filter_map("an axis", |(axis, angle)| {
        let axis = DVec3::from_slice(&axis);
        (axis.length() > 0.1).then(|| DMat3::from_axis_angle(axis.normalize(), angle))
    })
}

fn mapped(jet: &SurfaceJet, map: impl Fn(DVec3) -> DVec3) -> SurfaceJet {
    SurfaceJet { derivatives: jet.derivatives.map(map) }
}

/// The derivatives up to order two after the change of parameters whose own derivatives are these
/// (`u` and `v` by `p`, `q`, `pp`, `pq`, `qq`).
fn reparametrised(jet: &SurfaceJet, u: [f64; 5], v: [f64; 5]) -> SurfaceJet {
    let first = |k: usize| u[k] * jet.d(1, 0) + v[k] * jet.d(0, 1);
    let second = |a: usize, b: usize, k: usize| {
        u[a] * u[b] * jet.d(2, 0)
            + (u[a] * v[b] + v[a] * u[b]) * jet.d(1, 1)
            + v[a] * v[b] * jet.d(0, 2)
            + first(k)
    };
    let mut out = SurfaceJet::default();
    let values = [first(0), first(1), second(0, 0, 2), second(0, 1, 3), second(1, 1, 4)];
    out.derivatives[1..6].copy_from_slice(&values);
    out
}

/// `n_u × n_v` points of a rumpled sheet, in space, closed or not in either direction.
#[derive(Clone, Debug)]
struct Sheet {
    n: [u32; 2],
    closed: [bool; 2],
    points: Vec<DVec3>,
}

impl Sheet {
    /// Corners of the quads, counter-clockwise with u to the right and v upwards.
    fn quads(&self) -> Vec<[u32; 4]> {
        let [n_u, n_v] = self.n;
        let cells = |k: usize| if self.closed[k] { self.n[k] } else { self.n[k] - 1 };
        let at = |i: u32, j: u32| (i % n_u) * n_v + j % n_v;
        let quad = |i, j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        (0..cells(0)).flat_map(|i| (0..cells(1)).map(move |j| quad(i, j))).collect()
    }

    fn triangles(&self) -> Vec<[u32; 3]> {
        self.quads().iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect()
    }
}

fn any_sheet(closed: impl Strategy<Value = [bool; 2]>) -> impl Strategy<Value = Sheet> {
    // Three at least, so that no two vertices have two edges between them.
    (3..6_u32, 3..6_u32, closed, vec(-1.0..1.0_f64, 75)).prop_map(|(n_u, n_v, closed, bumps)| {
        let at = |k: u32| {
            let (i, j) = (f64::from(k / n_v), f64::from(k % n_v));
            let bump = DVec3::from_slice(&bumps[3 * k as usize..]);
            3.0 * DVec3::new(i, j, 0.0) + bump
        };
        Sheet { n: [n_u, n_v], closed, points: (0..n_u * n_v).map(at).collect() }
    })
}

/// Angle of the face left of `h` at the vertex `h` leaves.
fn angle(mesh: &PolyMesh, h: geom_core::HalfEdgeId) -> f64 {
    let here = mesh.position(mesh.origin(h));
    let (a, b) = (mesh.target(h), mesh.origin(mesh.prev(h)));
    let (a, b) = (mesh.position(a) - here, mesh.position(b) - here);
    a.cross(b).length().atan2(a.dot(b))
}

/// What the angles around a vertex lack of a full turn, or of half a turn on the border.
fn deficit(mesh: &PolyMesh, v: VertexId) -> f64 {
    let faces = mesh.outgoing_half_edges(v).filter(|h| mesh.face(*h).is_some());
    let sum: f64 = faces.map(|h| angle(mesh, h)).sum();
    if mesh.is_boundary_vertex(v) { PI - sum } else { TAU - sum }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn curvatures_do_not_change_under_rigid_motion(jet in any_jet(), rotation in any_rotation()) {
        let moved = mapped(&jet, |d| rotation * d);
        near(moved.mean_curvature()?, jet.mean_curvature()?, 1e-12)?;
        near(moved.gaussian_curvature()?, jet.gaussian_curvature()?, 1e-12)?;
        let (got, wanted) = (moved.curvature_derivatives()?, jet.curvature_derivatives()?);
        near(got.h_u, wanted.h_u, 1e-11)?;
        near(got.k_v, wanted.k_v, 1e-10)?;
        let (got, wanted) = (ThirdOrder::new(&moved)?, ThirdOrder::new(&jet)?);
        near(got.cubic_norm_squared(), wanted.cubic_norm_squared(), 1e-9)?;
    }

    #[test]
    fn curvatures_scale_with_the_inverse_of_length(jet in any_jet(), log in -6.0..6.0_f64) {
        let s = 10.0_f64.powf(log);
        let scaled = mapped(&jet, |d| s * d);
        near(scaled.mean_curvature()? * s, jet.mean_curvature()?, 1e-12)?;
        near(scaled.gaussian_curvature()? * s * s, jet.gaussian_curvature()?, 1e-12)?;
        near(scaled.curvature_derivatives()?.h_v * s, jet.curvature_derivatives()?.h_v, 1e-11)?;
    }

    #[test]
    fn exchanged_parameters_turn_the_normal(jet in any_jet()) {
        let turned = reparametrised(&jet, [0.0, 1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0]);
        near(turned.mean_curvature()?, -jet.mean_curvature()?, 1e-13)?;
        near(turned.gaussian_curvature()?, jet.gaussian_curvature()?, 1e-13)?;
        prop_assert!((turned.normal()? + jet.normal()?).length() < 1e-14);
    }

    #[test]
    fn curvatures_do_not_depend_on_the_parameters(
        jet in any_jet(), first in vec(-0.4..0.4_f64, 4), second in vec(-2.0..2.0_f64, 6),
    ) {
        let u = [1.0 + first[0], first[1], second[0], second[1], second[2]];
        let v = [first[2], 1.0 + first[3], second[3], second[4], second[5]];
        let other = reparametrised(&jet, u, v);
        near(other.mean_curvature()?, jet.mean_curvature()?, 1e-11)?;
        near(other.gaussian_curvature()?, jet.gaussian_curvature()?, 1e-11)?;
    }

    #[test]
    fn principal_curvatures_obey_euler(jet in any_jet(), theta in 0.0..TAU) {
        let (first, second) = (jet.first_form(), jet.second_form()?);
        let principal = principal_curvatures(first, second)?;
        let (k1, k2) = (principal.k1, principal.k2);
        near(0.5 * (k1 + k2), jet.mean_curvature()?, 1e-12)?;
        near(k1 * k2, jet.gaussian_curvature()?, 1e-11)?;
        let (sin, cos) = theta.sin_cos();
        let direction = principal.direction1 * cos + principal.direction2 * sin;
        near(first.dot(direction, direction), 1.0, 1e-13)?;
        let wanted = k1 * cos * cos + k2 * sin * sin;
        near(normal_curvature(first, second, direction)?, wanted, 1e-12)?;
    }

    #[test]
    fn asymptotic_directions_do_not_bend(jet in any_jet()) {
        let (first, second) = (jet.first_form(), jet.second_form()?);
        let directions = asymptotic_directions(first, second)?;
        prop_assert_eq!(directions.is_some(), jet.gaussian_curvature()? < 0.0);
        for direction in directions.into_iter().flatten() {
            near(first.dot(direction, direction), 1.0, 1e-13)?;
            near(normal_curvature(first, second, direction)?, 0.0, 1e-12)?;
        }
    }

    #[test]
    fn the_first_harmonic_is_the_gradient_of_the_mean_curvature(jet in any_jet()) {
        let shape = ThirdOrder::new(&jet)?;
        let change = jet.curvature_derivatives()?;
        near(shape.mean_curvature(), change.h, 1e-12)?;
        near(shape.gaussian_curvature(), change.k, 1e-11)?;
        let gradient = gradient_norm_squared(jet.first_form(), change.h_u, change.h_v)?;
        near(shape.f1().powi(2), 2.25 * gradient, 1e-9 * (1.0 + gradient))?;
    }

    #[test]
    fn the_inline_derivative_has_two_harmonics(jet in any_jet(), theta in 0.0..TAU) {
        let shape = ThirdOrder::new(&jet)?;
        let (alpha, beta) = (shape.alpha(), shape.beta());
        let wanted =
            shape.f1() * (theta + alpha).cos() + shape.f3() * (3.0 * (theta + alpha + beta)).cos();
        near(shape.inline_derivative(theta), wanted, 1e-11)?;
    }

    #[test]
    fn the_foot_on_a_triangle_is_its_projection(
        c in vec(-1.0..1.0_f64, 9), x in vec(-2.0..2.0_f64, 3),
    ) {
        let corners = [0, 3, 6].map(|k| DVec3::from_slice(&c[k..]));
        let x = DVec3::from_slice(&x);
        let b = closest_barycentric(x, corners);
        near(b.iter().sum(), 1.0, 1e-14)?;
        prop_assert!(b.iter().all(|share| *share >= 0.0));
        let foot: DVec3 = corners.iter().zip(b).map(|(p, share)| share * *p).sum();
        // A convex set lies behind the plane through the foot that faces x.
        for p in corners {
            prop_assert!((x - foot).dot(p - foot) <= 1e-10, "{}", (x - foot).dot(p - foot));
        }
    }

    #[test]
    fn the_foot_on_a_segment_is_its_projection(c in vec(-1.0..1.0_f64, 9)) {
        let [a, b, x] = [0, 3, 6].map(|k| DVec3::from_slice(&c[k..]));
        let t = closest_on_segment(x, a, b);
        prop_assert!((0.0..=1.0).contains(&t));
        let foot = a.lerp(b, t);
        prop_assert!((x - foot).dot(a - foot).max((x - foot).dot(b - foot)) <= 1e-14);
    }

    #[test]
    fn the_tree_finds_the_nearest_of_all_triangles(
        c in vec(-1.0..1.0_f64, 90), order in vec(0..30_u32, 120), x in vec(-2.0..2.0_f64, 3),
    ) {
        let positions: Vec<DVec3> = c.chunks_exact(3).map(DVec3::from_slice).collect();
        let different = |t: &[u32]| t[0] != t[1] && t[1] != t[2] && t[0] != t[2];
        let triangles: Vec<[u32; 3]> = order
            .chunks_exact(3)
            .filter(|t| different(t))
            .map(|t| [t[0], t[1], t[2]])
            .chain([[0, 1, 2]])
            .collect();
        let (mesh, x) = (TriMesh::new(positions, triangles).unwrap(), DVec3::from_slice(&x));
        let nearest = mesh.nearest(x);
        let distance = |t: usize| {
            let corners = mesh.corners(t);
            let b = closest_barycentric(x, corners);
            (corners[0] * b[0] + corners[1] * b[1] + corners[2] * b[2]).distance_squared(x)
        };
        let all: Vec<f64> = (0..mesh.triangles().len()).map(distance).collect();
        let least = all.iter().copied().fold(f64::INFINITY, f64::min);
        prop_assert_eq!(nearest.distance_squared, least);
        prop_assert_eq!(Some(nearest.triangle), all.iter().position(|d| *d == least));
    }

    #[test]
    fn gauss_and_bonnet_hold_on_polyhedra(sheet in any_sheet(any::<[bool; 2]>())) {
        let mesh = PolyMesh::new(sheet.points.clone(), &sheet.triangles()).unwrap();
        // A rectangle, a tube or a torus.
        let wanted = i64::from(sheet.closed == [false, false]);
        prop_assert_eq!(mesh.euler_characteristic(), wanted);
        let total: f64 = mesh.vertices().map(|v| deficit(&mesh, v)).sum();
        near(total, TAU * wanted as f64, 1e-12)?;
        let loops = [1, 2, 2, 0][2 * usize::from(sheet.closed[0]) + usize::from(sheet.closed[1])];
        prop_assert_eq!(mesh.boundary_loops().len(), loops);
    }

    #[test]
    fn walks_around_faces_and_vertices_meet_every_half_edge(
        sheet in any_sheet(any::<[bool; 2]>()),
    ) {
        let mesh = PolyMesh::new(sheet.points.clone(), &sheet.quads()).unwrap();
        let mut seen = vec![0; mesh.half_edge_count()];
        for h in mesh.vertices().flat_map(|v| mesh.outgoing_half_edges(v)) {
            seen[h.index()] += 1;
            prop_assert_eq!(mesh.twin(mesh.twin(h)), h);
            prop_assert_eq!(mesh.prev(mesh.next(h)), h);
            prop_assert_eq!(mesh.target(h), mesh.origin(mesh.next(h)));
        }
        prop_assert!(seen.iter().all(|times| *times == 1));
        prop_assert_eq!(mesh.components().1, 1);
    }

    #[test]
    fn a_grid_is_found_whatever_its_numbers(
        sheet in any_sheet(any::<bool>().prop_map(|u| [u, false])),
        keys in vec(any::<u32>(), 25), turns in vec(0..4_usize, 25),
        face_keys in vec(any::<u32>(), 25),
    ) {
        // Vertices renumbered, faces in another order, each from another corner.
        let count = sheet.points.len();
        let mut number: Vec<u32> = (0..count as u32).collect();
        number.sort_by_key(|v| keys[*v as usize]);
        let mut points = vec![DVec3::ZERO; count];
        for (old, new) in number.iter().enumerate() {
            points[*new as usize] = sheet.points[old];
        }
        let mut faces: Vec<(u32, [u32; 4])> = Vec::new();
        for (f, quad) in sheet.quads().iter().enumerate() {
            let mut quad = quad.map(|v| number[v as usize]);
            quad.rotate_left(turns[f % 25]);
            faces.push((face_keys[f % 25], quad));
        }
        faces.sort_by_key(|(key, _)| *key);
        let faces: Vec<[u32; 4]> = faces.into_iter().map(|(_, quad)| quad).collect();
        let mesh = PolyMesh::new(points, &faces).unwrap();
        let grid = QuadGrid::of(&mesh).unwrap();
        prop_assert_eq!(grid.closed_u, sheet.closed[0]);
        let mut sizes = [grid.n_u, grid.n_v];
        let mut wanted = sheet.n.map(|n| n as usize);
        if !grid.closed_u {
            sizes.sort_unstable();
            wanted.sort_unstable();
        }
        prop_assert_eq!(sizes, wanted);
        // The quads of the grid are those of the mesh, each from its smallest corner.
        let again = Sheet {
            n: [grid.n_u as u32, grid.n_v as u32],
            closed: [grid.closed_u, false],
            points: vec![],
        };
        let canonical = |mut quad: [u32; 4]| {
            let least = (0..4).min_by_key(|k| quad[*k]).unwrap();
            quad.rotate_left(least);
            quad
        };
        let mut found: Vec<[u32; 4]> = again
            .quads()
            .iter()
            .map(|quad| canonical(quad.map(|k| grid.vertices[k as usize].0)))
            .collect();
        let mut wanted: Vec<[u32; 4]> = faces.into_iter().map(canonical).collect();
        found.sort_unstable();
        wanted.sort_unstable();
        prop_assert_eq!(found, wanted);
    }

    #[test]
    fn level_lines_of_a_linear_function_are_straight(
        slope in vec(-1.0..1.0_f64, 2), level in -3.0..3.0_f64,
    ) {
        let slope = DVec2::from_slice(&slope);
        let value = |i: f64, j: f64| slope.dot(DVec2::new(i - 3.0, j - 2.0));
        let values: Vec<f64> = (0..35).map(|k| value(f64::from(k / 5), f64::from(k % 5))).collect();
        let lines = isolines(&values, 7, 5, level);
        prop_assert!(lines.len() <= 1, "{} pieces", lines.len());
        let crosses = values.iter().any(|f| *f >= level) && values.iter().any(|f| *f < level);
        prop_assert_eq!(lines.len() == 1, crosses);
        for [i, j] in lines.iter().flat_map(|line| &line.points) {
            near(value(*i, *j), level, 1e-14)?;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn mesh_curvatures_follow_motion_and_scale(
        heights in vec(-0.2..0.2_f64, 36), rotation in any_rotation(), log in -3.0..3.0_f64,
    ) {
        let sheet = Sheet {
            n: [6, 6],
            closed: [false, false],
            points: (0..36)
                .map(|k| DVec3::new((k / 6) as f64, (k % 6) as f64, heights[k]))
                .collect(),
        };
        let (s, shift) = (10.0_f64.powf(log), DVec3::new(5.0, -7.0, 3.0));
        let moved = sheet.points.iter().map(|p| s * (rotation * *p + shift)).collect();
        let (mesh, moved) = (
            PolyMesh::new(sheet.points.clone(), &sheet.quads()).unwrap(),
            PolyMesh::new(moved, &sheet.quads()).unwrap(),
        );
        let pairs = vertex_curvatures(&mesh).into_iter().zip(vertex_curvatures(&moved));
        for (here, there) in pairs {
            let (here, there) = (here.unwrap(), there.unwrap());
            near(there.mean * s, here.mean, 1e-9)?;
            near(there.gaussian * s * s, here.gaussian, 1e-9)?;
            prop_assert!((there.normal - rotation * here.normal).length() < 1e-9);
        }
    }
}
