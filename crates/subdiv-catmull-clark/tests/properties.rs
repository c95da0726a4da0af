//! What holds for any control mesh: polygons of any valence, open and closed, with creases.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use geom_core::{DMat3, DVec3, PolyMesh, VertexId};
use proptest::collection::vec;
use proptest::prelude::*;
use subdiv_catmull_clark::{
    Blend, Creases, INFINITE_SHARPNESS, SubdivisionSurface, limit_frames, refine,
};

fn near(got: DVec3, wanted: DVec3, bound: f64) -> Result<(), TestCaseError> {
    let off = got.distance(wanted);
    prop_assert!(off <= bound, "got {got}, wanted {wanted}: off by {off:e}, allowed {bound:e}");
    Ok(())
}

/// Faces of a mesh and its number of vertices, at most [`MOST`].
#[derive(Clone, Debug)]
struct Polygons {
    count: usize,
    faces: Vec<Vec<u32>>,
    euler: i64,
}

const MOST: usize = 16;

impl Polygons {
    /// A prism over an `n`-gon: valence 3, two large faces.
    fn prism(n: u32) -> Self {
        let mut faces: Vec<Vec<u32>> =
            (0..n).map(|k| vec![k, (k + 1) % n, n + (k + 1) % n, n + k]).collect();
        faces.push((0..n).rev().collect());
        faces.push((n..2 * n).collect());
        Self { count: 2 * n as usize, faces, euler: 2 }
    }

    /// A double pyramid over an `n`-gon: triangles, two vertices of valence `n`.
    fn double_pyramid(n: u32) -> Self {
        let side = |k: u32| [vec![k, (k + 1) % n, n], vec![(k + 1) % n, k, n + 1]];
        Self { count: n as usize + 2, faces: (0..n).flat_map(side).collect(), euler: 2 }
    }

    /// A pyramid over an `n`-gon without its base: open.
    fn tent(n: u32) -> Self {
        let faces = (0..n).map(|k| vec![k, (k + 1) % n, n]).collect();
        Self { count: n as usize + 1, faces, euler: 1 }
    }

    /// A torus of four by four quads.
    fn torus() -> Self {
        let at = |i: u32, j: u32| 4 * (i % 4) + j % 4;
        let quad = |k: u32| {
            let (i, j) = (k / 4, k % 4);
            vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
        };
        Self { count: 16, faces: (0..16).map(quad).collect(), euler: 0 }
    }

    fn mesh(&self, points: Vec<DVec3>) -> PolyMesh {
        PolyMesh::new(points, &self.faces).unwrap()
    }
}

fn any_polygons() -> impl Strategy<Value = Polygons> {
    prop_oneof![
        (3..8_u32).prop_map(Polygons::prism),
        (3..9_u32).prop_map(Polygons::double_pyramid),
        (3..9_u32).prop_map(Polygons::tent),
        Just(Polygons::torus()),
    ]
}

/// A mesh with any positions at all, and creases on some of its edges.
fn any_control() -> impl Strategy<Value = (Polygons, PolyMesh, Creases)> {
    let sharpness = prop_oneof![
        5 => Just(0.0),
        1 => 0.1..3.0_f64,
        1 => Just(INFINITE_SHARPNESS),
    ];
    (any_polygons(), vec(-1.0..1.0_f64, 3 * MOST), vec(sharpness, 8)).prop_map(
        |(polygons, coordinates, sharp)| {
            let points = coordinates.chunks_exact(3).take(polygons.count);
            let mesh = polygons.mesh(points.map(DVec3::from_slice).collect());
            let mut creases = Creases::none();
            for (h, s) in mesh.edges().step_by(3).zip(sharp) {
                creases.set(mesh.origin(h), mesh.target(h), s);
            }
            (polygons, mesh, creases)
        },
    )
}

/// A linear map far from singular, and a shift.
fn any_affine() -> impl Strategy<Value = (DMat3, DVec3)> {
    (vec(-0.4..0.4_f64, 9), vec(-3.0..3.0_f64, 3)).prop_map(|(m, t)| {
        let m: [f64; 9] = m.try_into().expect("nine entries");
        (DMat3::IDENTITY + DMat3::from_cols_array(&m), DVec3::from_slice(&t))
    })
}

fn moved(mesh: &PolyMesh, map: impl Fn(DVec3) -> DVec3) -> PolyMesh {
    let mut out = mesh.clone();
    out.positions_mut().iter_mut().for_each(|p| *p = map(*p));
    out
}

/// Two refinements: quads, and a regular ring around every extraordinary vertex.
fn twice(mesh: &PolyMesh, creases: &Creases) -> (PolyMesh, Creases) {
    let once = refine(mesh, creases).unwrap();
    let twice = refine(&once.mesh, &once.creases).unwrap();
    (twice.mesh, twice.creases)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn refinement_keeps_the_topology((polygons, mesh, creases) in any_control()) {
        let fine = refine(&mesh, &creases).unwrap().mesh;
        prop_assert_eq!(mesh.euler_characteristic(), polygons.euler);
        prop_assert_eq!(fine.euler_characteristic(), polygons.euler);
        prop_assert!(fine.is_quad_mesh());
        prop_assert_eq!(fine.boundary_loops().len(), mesh.boundary_loops().len());
        let corners: usize = mesh.faces().map(|f| mesh.face_degree(f)).sum();
        prop_assert_eq!(fine.face_count(), corners);
        for v in mesh.vertices() {
            prop_assert_eq!(fine.valence(v), mesh.valence(v));
        }
    }

    #[test]
    fn new_points_are_convex_combinations((_, mesh, creases) in any_control()) {
        let stencils = refine(&mesh, &creases).unwrap().stencils;
        for row in 0..stencils.rows() {
            let (columns, weights) = stencils.row(row);
            prop_assert!(columns.is_sorted());
            prop_assert!(weights.iter().all(|w| *w >= 0.0), "row {row}: {weights:?}");
            prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn refinement_follows_affine_maps(
        (_, mesh, creases) in any_control(), (map, shift) in any_affine(),
    ) {
        let fine = twice(&mesh, &creases).0;
        let other = twice(&moved(&mesh, |p| map * p + shift), &creases).0;
        for (a, b) in fine.positions().iter().zip(other.positions()) {
            near(*b, map * *a + shift, 1e-13)?;
        }
    }

    #[test]
    fn the_limit_follows_affine_maps_with_any_blend(
        (_, mesh, creases) in any_control(), (map, shift) in any_affine(), pick in any::<usize>(),
        blend in prop_oneof![Just(Blend::Smooth), Just(Blend::Flat), Just(Blend::None)],
        u in 0.0..1.0, v in 0.0..1.0,
    ) {
        let (mesh, creases) = twice(&mesh, &creases);
        let surface = SubdivisionSurface::new(&mesh, &creases, blend).unwrap();
        let patch = &surface.patches()[pick % surface.patches().len()];
        let here = surface.evaluate(mesh.positions(), patch, u, v);
        let other = moved(&mesh, |p| map * p + shift);
        let there = surface.evaluate(other.positions(), patch, u, v);
        near(there.position(), map * here.position() + shift, 1e-12)?;
        // Close to a vertex without blend derivatives grow without bound.
        let size = here.d(1, 0).length() + here.d(0, 1).length();
        near(there.d(1, 0), map * here.d(1, 0), 1e-11 * (1.0 + size))?;
        near(there.d(0, 1), map * here.d(0, 1), 1e-11 * (1.0 + size))?;
    }

    #[test]
    fn limit_points_lie_in_the_hull(
        (_, mesh, creases) in any_control(), direction in vec(-1.0..1.0_f64, 3),
        pick in any::<usize>(), u in 0.0..1.0, v in 0.0..1.0,
    ) {
        let direction = DVec3::from_slice(&direction);
        let reach = mesh.positions().iter().map(|p| p.dot(direction)).fold(f64::MIN, f64::max);
        let (mesh, creases) = twice(&mesh, &creases);
        let surface = SubdivisionSurface::new(&mesh, &creases, Blend::None).unwrap();
        let patch = &surface.patches()[pick % surface.patches().len()];
        let point = surface.evaluate(mesh.positions(), patch, u, v).position();
        prop_assert!(point.dot(direction) <= reach + 1e-13);
        let weights = surface.weights(patch.basis, u, v);
        prop_assert!(weights.row(0).iter().all(|w| *w >= -1e-15));
        prop_assert!((weights.row(0).iter().sum::<f64>() - 1.0).abs() < 1e-13);
    }

    #[test]
    fn refinement_keeps_the_limit((_, mesh, creases) in any_control(), pick in any::<usize>()) {
        let (mesh, creases) = twice(&mesh, &creases);
        let fine = refine(&mesh, &creases).unwrap();
        let coarse = SubdivisionSurface::new(&mesh, &creases, Blend::None).unwrap();
        let finer = SubdivisionSurface::new(&fine.mesh, &fine.creases, Blend::None).unwrap();
        let frames = limit_frames(&fine.mesh, &finer);
        let limit = |v: usize| frames[v].as_ref().unwrap().point(fine.mesh.positions());
        // Old vertices.
        let v = pick % mesh.vertex_count();
        let frame = limit_frames(&mesh, &coarse).swap_remove(v).unwrap();
        near(limit(v), frame.point(mesh.positions()), 1e-13)?;
        // The middle of a face, and of an edge.
        let patch = &coarse.patches()[pick % coarse.patches().len()];
        let at = |u, v| coarse.evaluate(mesh.positions(), patch, u, v).position();
        let first = mesh.vertex_count();
        let centre = first + mesh.edge_count() + patch.face.index();
        near(at(0.5, 0.5), limit(centre), 1e-13)?;
        let mut edges = mesh.edges();
        let edge = edges.position(|h| h == patch.corner || mesh.twin(h) == patch.corner).unwrap();
        near(at(0.5, 0.0), limit(first + edge), 1e-13)?;
    }

    #[test]
    fn the_corner_a_face_begins_with_does_not_matter(
        (polygons, mesh, creases) in any_control(), turns in vec(0..8_usize, 16),
        blend in prop_oneof![Just(Blend::Smooth), Just(Blend::None)],
    ) {
        let mut turned = polygons.clone();
        for (face, turn) in turned.faces.iter_mut().zip(turns) {
            let degree = face.len();
            face.rotate_left(turn % degree);
        }
        let limits = |mesh: &PolyMesh| {
            let (mesh, creases) = twice(mesh, &creases);
            let surface = SubdivisionSurface::new(&mesh, &creases, blend).unwrap();
            let frames = limit_frames(&mesh, &surface);
            let of = |v: usize| {
                let frame = frames[v].as_ref().unwrap();
                (frame.point(mesh.positions()), frame.normal(mesh.positions()))
            };
            (0..polygons.count).map(of).collect::<Vec<_>>()
        };
        let other = turned.mesh(mesh.positions().to_vec());
        for (a, b) in limits(&mesh).into_iter().zip(limits(&other)) {
            near(a.0, b.0, 1e-13)?;
            // No normal where sharp edges meet, or where random points fold the surface.
            if a.1.is_finite() && b.1.is_finite() && !creased(&creases, &mesh) {
                near(a.1, b.1, 1e-6)?;
            }
        }
    }

    #[test]
    fn renumbered_vertices_give_the_same_points(
        (polygons, mesh, creases) in any_control(), keys in vec(any::<u32>(), MOST),
    ) {
        let mut number: Vec<u32> = (0..polygons.count as u32).collect();
        number.sort_by_key(|v| keys[*v as usize]);
        let mut other = polygons.clone();
        other.faces.iter_mut().flatten().for_each(|v| *v = number[*v as usize]);
        let mut points = vec![DVec3::ZERO; polygons.count];
        for (old, new) in number.iter().enumerate() {
            points[*new as usize] = mesh.positions()[old];
        }
        let mut sharp = Creases::none();
        for h in mesh.edges() {
            let (a, b) = (mesh.origin(h), mesh.target(h));
            let [c, d] = [a, b].map(|v| VertexId(number[v.index()]));
            sharp.set(c, d, creases.sharpness(a, b));
        }
        let fine = refine(&mesh, &creases).unwrap().mesh;
        let again = refine(&other.mesh(points), &sharp).unwrap().mesh;
        for (old, new) in number.iter().enumerate() {
            near(again.positions()[*new as usize], fine.positions()[old], 1e-14)?;
        }
        // Half-edges keep their numbers, and with them the new points of edges and faces.
        for k in polygons.count..fine.vertex_count() {
            near(again.positions()[k], fine.positions()[k], 1e-14)?;
        }
    }

    #[test]
    fn bezier_points_give_the_patch(
        (_, mesh, creases) in any_control(), pick in any::<usize>(), u in 0.0..1.0, v in 0.0..1.0,
    ) {
        let (mesh, creases) = twice(&mesh, &creases);
        let surface = SubdivisionSurface::new(&mesh, &creases, Blend::None).unwrap();
        let patches = surface.patches();
        let count = patches.len();
        let bezier = (0..count).map(|k| &patches[(pick % count + k) % count]);
        let mut found = bezier.filter_map(|p| Some((p, surface.bezier(mesh.positions(), p)?)));
        let Some((patch, net)) = found.next() else { return Ok(()) };
        let bernstein = |t: f64| {
            let s = 1.0 - t;
            [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
        };
        let (a, b) = (bernstein(u), bernstein(v));
        let sum: DVec3 = (0..16).map(|k| a[k / 4] * b[k % 4] * net[k / 4][k % 4]).sum();
        near(sum, surface.evaluate(mesh.positions(), patch, u, v).position(), 1e-14)?;
    }
}

fn creased(creases: &Creases, mesh: &PolyMesh) -> bool {
    mesh.edges().any(|h| creases.sharpness(mesh.origin(h), mesh.target(h)) > 0.0)
}
