//! Exact evaluation against closed forms, refinement, and finite differences.

use geom_core::{DVec3, PolyMesh, VertexId};
use subdiv_catmull_clark::{
    Blend, Creases, INFINITE_SHARPNESS, JET_ORDERS, MAX_VALENCE, Patch, SubdivisionError,
    SubdivisionSurface, check_valences, limit_frames, refine, refinements_needed,
};

fn grid(n: u32, lift: impl Fn(f64, f64) -> f64) -> PolyMesh {
    let at = |i, j| i * (n + 1) + j;
    let positions = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| (f64::from(i), f64::from(j))))
        .map(|(x, y)| DVec3::new(x, y, lift(x, y)))
        .collect();
    let faces: Vec<[u32; 4]> = (0..n)
        .flat_map(|i| (0..n).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]))
        .collect();
    PolyMesh::new(positions, &faces).expect("a manifold")
}

/// A disc of `n` sectors of `m × m` quads around one vertex of valence `n`.
fn star(n: u32, m: u32) -> PolyMesh {
    let mut positions = vec![DVec3::new(0.1, -0.2, 0.3)];
    let per_sector = m * (m + 1);
    // Sector j holds points (a, b), a in 1..=m along its first spoke, b in 0..=m.
    let index = |j: u32, a: u32, b: u32| -> u32 {
        let j = j % n;
        if a == 0 && b == 0 {
            0
        } else if a == 0 {
            // On the next spoke.
            1 + ((j + 1) % n) * per_sector + (b - 1) * (m + 1)
        } else {
            1 + j * per_sector + (a - 1) * (m + 1) + b
        }
    };
    for j in 0..n {
        for a in 1..=m {
            for b in 0..=m {
                let angle = std::f64::consts::TAU * f64::from(j) / f64::from(n);
                let next = std::f64::consts::TAU * f64::from(j + 1) / f64::from(n);
                let p = f64::from(a) * DVec3::new(angle.cos(), angle.sin(), 0.0)
                    + f64::from(b) * DVec3::new(next.cos(), next.sin(), 0.0);
                let wave = 0.3 * (1.3 * p.x + 0.4).sin() * (0.9 * p.y - 0.2).cos();
                positions.push(p + DVec3::new(0.05 * wave, -0.1 * wave, wave));
            }
        }
    }
    let mut faces = Vec::new();
    for j in 0..n {
        for a in 0..m {
            for b in 0..m {
                faces.push([
                    index(j, a, b),
                    index(j, a + 1, b),
                    index(j, a + 1, b + 1),
                    index(j, a, b + 1),
                ]);
            }
        }
    }
    PolyMesh::new(positions, &faces).expect("a manifold")
}

fn patch_at(mesh: &PolyMesh, surface: &SubdivisionSurface, v: u32) -> Patch {
    surface
        .patches()
        .iter()
        .find(|p| mesh.origin(p.corner) == VertexId(v))
        .expect("a patch at the vertex")
        .clone()
}

fn check_by_differences(mesh: &PolyMesh, surface: &SubdivisionSurface, patch: &Patch, tol: f64) {
    let h = 1e-4;
    for (u, v) in [(0.31, 0.17), (0.62, 0.83), (0.11, 0.57), (0.77, 0.29)] {
        let at = |u, v| surface.evaluate(mesh.positions(), patch, u, v).derivatives;
        let jet = at(u, v);
        let (du, dv) = ((at(u + h, v), at(u - h, v)), (at(u, v + h), at(u, v - h)));
        for (k, &(i, j)) in JET_ORDERS.iter().enumerate() {
            if i + j == 0 {
                continue;
            }
            let (from, pair) = if i > 0 { ((i - 1, j), &du) } else { ((i, j - 1), &dv) };
            let at = JET_ORDERS.iter().position(|&o| o == from).expect("a lower order");
            let want = (pair.0[at] - pair.1[at]) / (2.0 * h);
            let got = jet[k];
            assert!(
                got.distance(want) < tol * (1.0 + want.length()),
                "derivative ({i}, {j}) at ({u}, {v}): {got} against {want}"
            );
        }
    }
}

#[test]
fn regular_patch_is_the_b_spline() {
    // Control heights x² give the limit x² + 1/3 of the uniform cubic B-spline.
    let mesh = grid(5, |x, _| x * x);
    let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).unwrap();
    let patch = &surface.patches()[12];
    let jet = surface.evaluate(mesh.positions(), patch, 0.25, 0.5).derivatives;
    assert!((jet[0] - DVec3::new(2.25, 2.5, 2.25 * 2.25 + 1.0 / 3.0)).length() < 1e-14);
    assert!((jet[1] - DVec3::new(1.0, 0.0, 4.5)).length() < 1e-13);
    assert!((jet[3] - DVec3::new(0.0, 0.0, 2.0)).length() < 1e-13);
}

#[test]
fn every_valence_matches_differences_and_refinement() {
    for n in [3, 5, 6, 7, 8, 12, 13, 20] {
        let mesh = star(n, 4);
        for blend in [Blend::None, Blend::Smooth, Blend::Flat] {
            let surface = SubdivisionSurface::new(&mesh, &Creases::none(), blend).unwrap();
            let patch = patch_at(&mesh, &surface, 0);
            let tol = if blend == Blend::Flat { 2e-3 } else { 2e-5 };
            check_by_differences(&mesh, &surface, &patch, tol);
            let ones = vec![DVec3::ONE; mesh.vertex_count()];
            let jet = surface.evaluate(&ones, &patch, 0.3, 0.2).derivatives;
            assert!(jet[0].distance(DVec3::ONE) < 1e-12, "valence {n}");
            assert!(jet[1..10].iter().all(|d| d.length() < 1e-10), "valence {n}");
        }
        // Without a blend the limit surface does not change under refinement.
        let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::None).unwrap();
        let fine = refine(&mesh, &Creases::none()).unwrap();
        let finer = SubdivisionSurface::new(&fine.mesh, &fine.creases, Blend::None).unwrap();
        let (a, b) = (patch_at(&mesh, &surface, 0), patch_at(&fine.mesh, &finer, 0));
        for (u, v) in [(0.3, 0.9), (0.01, 0.02), (0.5, 0.5)] {
            let coarse = surface.evaluate(mesh.positions(), &a, 0.5 * u, 0.5 * v).derivatives[0];
            let fine = finer.evaluate(fine.mesh.positions(), &b, u, v).position();
            // The first sector may be a different one; compare distances to the limit point.
            let limit = surface.evaluate(mesh.positions(), &a, 0.0, 0.0).derivatives[0];
            assert!(coarse.distance(limit).is_finite() && fine.is_finite());
            assert!(coarse.distance(fine) < 1e-12, "valence {n}: {coarse} against {fine}");
        }
    }
}

#[test]
fn high_valences_are_exact() {
    for n in [40, 64, MAX_VALENCE as u32] {
        let mesh = star(n, 2);
        let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::None).unwrap();
        let patch = patch_at(&mesh, &surface, 0);
        // Two explicit refinements, by other code.
        let fine = refine(&mesh, &Creases::none()).unwrap().mesh;
        let fine = refine(&fine, &Creases::none()).unwrap().mesh;
        let finer = SubdivisionSurface::new(&fine, &Creases::none(), Blend::None).unwrap();
        let near = patch_at(&fine, &finer, 0);
        for (u, v) in [(0.3, 0.9), (1e-6, 2e-6), (1.0, 1.0), (0.0, 0.0)] {
            let coarse = surface.evaluate(mesh.positions(), &patch, u / 4.0, v / 4.0).position();
            let want = finer.evaluate(fine.positions(), &near, u, v).position();
            assert!(coarse.distance(want) < 1e-13 * 4.0, "valence {n}: {coarse} against {want}");
        }
        let smooth = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).unwrap();
        check_by_differences(&mesh, &smooth, &patch_at(&mesh, &smooth, 0), 1e-4);
        let ones = vec![DVec3::ONE; mesh.vertex_count()];
        for (u, v) in [(0.3, 0.2), (0.01, 0.02), (0.9, 0.8)] {
            let jet = smooth.evaluate(&ones, &patch_at(&mesh, &smooth, 0), u, v).derivatives;
            assert!(jet[0].distance(DVec3::ONE) < 1e-11, "valence {n}");
            assert!(jet[1..10].iter().all(|d| d.length() < 1e-8), "valence {n}: {jet:?}");
        }
    }
}

#[test]
fn what_is_beyond_the_largest_valence_is_refused_with_the_reason() {
    let n = MAX_VALENCE as u32 + 1;
    let error = SubdivisionSurface::new(&star(n, 1), &Creases::none(), Blend::None).unwrap_err();
    assert_eq!(
        error.to_string(),
        "vertex 0 has 201 edges and the surface is evaluated to 200: nearer to such a vertex than \
         the width of a sector nothing is resolved; remesh around it"
    );
    let ring = |n: u32| {
        let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(n);
        let points = (0..n).map(|k| DVec3::new(angle(k).cos(), angle(k).sin(), 0.0));
        PolyMesh::new(points.collect(), &[(0..n).collect::<Vec<u32>>()]).unwrap()
    };
    assert!(check_valences(&ring(200)).is_ok());
    assert!(matches!(
        check_valences(&ring(n)),
        Err(SubdivisionError::Corners { face: 0, corners: 201 })
    ));
    assert!(refine(&ring(n), &Creases::none()).is_ok());
    assert!(matches!(
        refine(&ring(20_000), &Creases::none()),
        Err(SubdivisionError::TooManyWeights { face: 0, corners: 20_000, .. })
    ));
}

#[test]
fn a_huge_sharpness_is_an_infinite_one() {
    let mesh = grid(4, |x, y| 0.2 * x * y);
    let jets = |sharpness: f64| {
        let mut creases = Creases::none();
        creases.set(VertexId(6), VertexId(7), sharpness);
        let surface = SubdivisionSurface::new(&mesh, &creases, Blend::Smooth).unwrap();
        let at = |k: usize| {
            let patch = &surface.patches()[k / 25];
            let (mut u, mut v) = ((k % 5) as f64 / 4.0, (k / 5 % 5) as f64 / 4.0);
            // Patches may begin at another corner of their face.
            let mut side = mesh.face_half_edge(patch.face);
            while side != patch.corner {
                side = mesh.next(side);
                (u, v) = (v, 1.0 - u);
            }
            surface.evaluate(mesh.positions(), patch, u, v)
        };
        (0..16 * 25).map(at).collect::<Vec<_>>()
    };
    let sharp = jets(INFINITE_SHARPNESS);
    assert_eq!(jets(1e6), sharp);
    assert_eq!(jets(4_294_967_296.0), sharp);
    // The largest that is followed step by step: the same points, to rounding.
    for (k, (a, b)) in jets(48.0).iter().zip(&sharp).enumerate() {
        let off = a.position().distance(b.position());
        assert!(off < 1e-13, "sample {k}: off by {off:e}");
    }
}

/// Point, unit normal, mean and Gaussian curvature.
fn shape(jet: &[DVec3; 15]) -> (DVec3, DVec3, f64, f64) {
    let normal = jet[1].cross(jet[2]).normalize();
    let (e, f, g) = (jet[1].dot(jet[1]), jet[1].dot(jet[2]), jet[2].dot(jet[2]));
    let (l, m, q) = (jet[3].dot(normal), jet[4].dot(normal), jet[5].dot(normal));
    let d = e * g - f * f;
    (jet[0], normal, (l * g - 2.0 * m * f + q * e) / (2.0 * d), (l * q - m * m) / d)
}

#[test]
fn blended_surface_is_twice_continuous() {
    for n in [3, 5, 6, 8, 12, 20] {
        let mesh = star(n, 4);
        let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).unwrap();
        let at = |patch: &Patch, u, v| {
            shape(&surface.evaluate(mesh.positions(), patch, u, v).derivatives)
        };
        let check = |a: (DVec3, DVec3, f64, f64), b: (DVec3, DVec3, f64, f64), what: &str| {
            assert!(a.0.distance(b.0) < 1e-11, "valence {n}, {what}: points");
            assert!(a.1.distance(b.1) < 1e-9, "valence {n}, {what}: normals");
            let scale = 1.0 + a.2 * a.2 + a.3.abs();
            let gap = (a.2 - b.2).abs().max((a.3 - b.3).abs());
            assert!(gap < 1e-8 * scale, "valence {n}, {what}: curvatures differ by {gap}");
        };
        let around: Vec<&Patch> =
            surface.patches().iter().filter(|p| mesh.origin(p.corner) == VertexId(0)).collect();
        assert_eq!(around.len(), n as usize);
        for patch in &around {
            let next_corner = mesh.twin(mesh.prev(patch.corner));
            let next = around.iter().find(|p| p.corner == next_corner).unwrap();
            // The ring's outer boundary: the edge u = 1 is an edge of a regular patch.
            let across = mesh.twin(mesh.next(patch.corner));
            let outer =
                surface.patches().iter().find(|p| p.face == mesh.face(across).unwrap()).unwrap();
            let mut turns = 0;
            let mut h = outer.corner;
            while h != across {
                h = mesh.next(h);
                turns += 1;
            }
            for t in [0.05, 0.25, 0.4, 0.9] {
                // The edge u = 0 of one patch is the edge v = 0 of the next one.
                check(at(patch, 0.0, t), at(next, t, 0.0), "between sectors");
                // Along the half-edge of the outer patch the parameter runs the other way.
                let s = 1.0 - t;
                let (u, v) = [(s, 0.0), (1.0, s), (1.0 - s, 1.0), (0.0, 1.0 - s)][turns];
                check(at(patch, 1.0, t), at(outer, u, v), "at the outer boundary");
            }
        }
    }
}

#[test]
fn wide_blends_are_twice_continuous_everywhere() {
    for (n, rings) in [(3, 2), (3, 4), (5, 3), (8, 2)] {
        let mesh = star(n, 2 * rings + 1);
        let rings = Some(rings as usize);
        let surface =
            SubdivisionSurface::with_rings(&mesh, &Creases::none(), Blend::Smooth, rings).unwrap();
        assert_eq!(surface.blend_rings(), rings.map(|r| [r, r]));
        let positions = surface.control_points(mesh.positions());
        // From the left of a half-edge, at `t` of its length.
        let beside = |h: geom_core::HalfEdgeId, t: f64| {
            let patch = &surface.patches()[mesh.face(h)?.index()];
            let mut corner = patch.corner;
            let mut turns = 0;
            while corner != h {
                corner = mesh.next(corner);
                turns += 1;
            }
            let (u, v) = [(t, 0.0), (1.0, t), (1.0 - t, 1.0), (0.0, 1.0 - t)][turns];
            let fast = surface.evaluate(&positions, patch, u, v);
            let slow = surface.evaluate(mesh.positions(), patch, u, v);
            assert!(fast.position().distance(slow.position()) < 1e-12);
            Some(shape(&fast.derivatives))
        };
        for h in mesh.edges() {
            for t in [0.05, 0.4, 0.9] {
                let (Some(a), Some(b)) = (beside(h, t), beside(mesh.twin(h), 1.0 - t)) else {
                    continue;
                };
                let scale = 1.0 + a.2 * a.2 + a.3.abs();
                let gap = (a.2 - b.2).abs().max((a.3 - b.3).abs()) / scale;
                assert!(a.0.distance(b.0) < 1e-11 && a.1.distance(b.1) < 1e-9 && gap < 1e-8);
            }
        }
        // Frames name vertices only, and those of the blend's inner vertices see the blend.
        for (v, frame) in limit_frames(&mesh, &surface).iter().enumerate() {
            let frame = frame.as_ref().unwrap();
            let h = mesh.outgoing_half_edges(VertexId(v as u32)).find(|&h| mesh.face(h).is_some());
            let Some(want) = h.and_then(|h| beside(h, 0.0)) else { continue };
            assert!(frame.point(mesh.positions()).distance(want.0) < 1e-12, "vertex {v}");
        }
    }
}

/// Three squares glued along their sides to a closed surface of genus 2: all their corners are one
/// vertex, of valence 12, the only one that is not regular.
#[test]
fn a_blend_that_is_asked_to_cover_everything_meets_itself_and_stops() {
    let (n, right, up) = (6, [1, 0, 2], [2, 1, 0]);
    let at = |k: usize, i: u32, j: u32| -> u32 {
        let k = if i == n { right[k] } else { k };
        let k = if j == n { up[k] } else { k };
        match (i % n, j % n) {
            (0, 0) => 0,
            (i, j) => 1 + k as u32 * n * n + i * n + j,
        }
    };
    let mut faces = Vec::new();
    for k in 0..3 {
        for i in 0..n {
            for j in 0..n {
                faces.push([at(k, i, j), at(k, i + 1, j), at(k, i + 1, j + 1), at(k, i, j + 1)]);
            }
        }
    }
    let mut numbers: Vec<u32> = faces.iter().flatten().copied().collect();
    numbers.sort_unstable();
    numbers.dedup();
    for v in faces.iter_mut().flatten() {
        *v = numbers.binary_search(v).expect("listed") as u32;
    }
    let place = |k: usize| DVec3::new((k as f64).sin(), (1.7 * k as f64).cos(), 0.3 * k as f64);
    let mesh = PolyMesh::new((0..numbers.len()).map(place).collect(), &faces).expect("closed");
    assert_eq!(mesh.valence(VertexId(0)), 12);
    let all = Some(usize::MAX);
    let surface = SubdivisionSurface::with_rings(&mesh, &Creases::none(), Blend::Smooth, all);
    let [fewest, most] = surface.expect("a surface").blend_rings().expect("a blend");
    assert!(1 <= fewest && fewest == most && most <= 3, "{most}");
}

#[test]
fn blends_keep_away_from_boundaries_and_creases() {
    // The boundary is 9 rings away.
    let mesh = star(3, 9);
    let rings = |creases: &Creases, wanted| {
        SubdivisionSurface::with_rings(&mesh, creases, Blend::Smooth, wanted)
            .unwrap()
            .blend_rings()
            .unwrap()
    };
    let mut creases = Creases::none();
    assert_eq!(rings(&creases, Some(1)), [1, 1]);
    assert_eq!(rings(&creases, Some(50)), [4, 4]);
    assert_eq!(rings(&creases, None), [3, 3]);
    // From the spoke's fifth vertex to the sixth.
    creases.set(VertexId(41), VertexId(51), 1.0);
    assert_eq!(rings(&creases, Some(50)), [2, 2]);
}

#[test]
fn flat_spot_has_no_curvature_at_the_vertex() {
    let mesh = star(6, 4);
    let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Flat).unwrap();
    let patch = patch_at(&mesh, &surface, 0);
    let jet = surface.evaluate(mesh.positions(), &patch, 2e-3, 2e-3).derivatives;
    let normal = jet[1].cross(jet[2]).normalize();
    assert!(jet[3].dot(normal).abs() < 1e-9 && jet[5].dot(normal).abs() < 1e-9);
}

#[test]
fn natural_boundary_is_a_cubic_spline_curve() {
    let mesh = grid(4, |x, y| 0.1 * x * x - 0.2 * x * y);
    let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).unwrap();
    for patch in surface.patches() {
        assert!(surface.b_spline_grid(patch.basis).is_some());
        let weights = surface.weights(patch.basis, 0.2, 0.7);
        assert!((weights.row(0).iter().sum::<f64>() - 1.0).abs() < 1e-14);
    }
    // The limit point of a boundary vertex uses the boundary's points alone: (1, 4, 1)/6.
    let frames = limit_frames(&mesh, &surface);
    let point = frames[2].as_ref().unwrap().point(mesh.positions());
    let p = mesh.positions();
    assert!(point.distance((p[1] + 4.0 * p[2] + p[3]) / 6.0) < 1e-14);
    // Corners are interpolated.
    assert!(frames[0].as_ref().unwrap().point(p).distance(p[0]) < 1e-14);
}

#[test]
fn boundary_and_creases_agree_with_deep_refinement() {
    let mesh = star(5, 2);
    let mut creases = Creases::none();
    // A semi-sharp edge and an infinitely sharp one, both meeting the centre.
    let ring: Vec<VertexId> = mesh.ring(VertexId(0)).collect();
    creases.set(VertexId(0), ring[0], 1.6);
    creases.set(VertexId(0), ring[2], INFINITE_SHARPNESS);
    let surface = SubdivisionSurface::new(&mesh, &creases, Blend::Smooth).unwrap();
    let mut level = (mesh.clone(), creases);
    for _ in 0..5 {
        let fine = refine(&level.0, &level.1).unwrap();
        level = (fine.mesh, fine.creases);
    }
    // Old vertices converge to the patch corners by 4⁻⁵ times the second differences.
    let frames = limit_frames(&mesh, &surface);
    for (v, frame) in frames.iter().enumerate() {
        let limit = frame.as_ref().unwrap().point(mesh.positions());
        assert!(limit.distance(level.0.positions()[v]) < 4e-3, "vertex {v}");
    }
    for patch in surface.patches() {
        check_by_differences(&mesh, &surface, patch, 1e-3);
    }
}

#[test]
fn infinite_crease_splits_the_surface_like_a_boundary() {
    let mesh = grid(4, |x, y| 0.3 * (x - 2.0).abs() + 0.05 * y * y);
    let mut creases = Creases::none();
    for j in 0..4 {
        creases.set(VertexId(10 + j), VertexId(11 + j), INFINITE_SHARPNESS);
    }
    let surface = SubdivisionSurface::new(&mesh, &creases, Blend::Smooth).unwrap();
    assert!(surface.patches().iter().all(|p| surface.b_spline_grid(p.basis).is_some()));
    let half = PolyMesh::new(
        mesh.positions()[..15].to_vec(),
        &(0..2u32)
            .flat_map(|i| {
                (0..4u32).map(move |j| {
                    let a = i * 5 + j;
                    [a, a + 5, a + 6, a + 1]
                })
            })
            .collect::<Vec<_>>(),
    )
    .unwrap();
    let cut = SubdivisionSurface::new(&half, &Creases::none(), Blend::Smooth).unwrap();
    for (a, b) in surface.patches().iter().zip(cut.patches()) {
        let points = [(0.2, 0.3), (0.9, 0.1)].map(|(u, v)| {
            // The two patches may be turned differently: compare their centroids of four points.
            let mean = |f: &dyn Fn(f64, f64) -> DVec3| {
                (f(u, v) + f(1.0 - v, u) + f(1.0 - u, 1.0 - v) + f(v, 1.0 - u)) / 4.0
            };
            (
                mean(&|u, v| surface.evaluate(mesh.positions(), a, u, v).derivatives[0]),
                mean(&|u, v| cut.evaluate(half.positions(), b, u, v).derivatives[0]),
            )
        });
        for (p, q) in points {
            assert!(p.distance(q) < 1e-13);
        }
    }
}

#[test]
fn limit_frame_of_an_extraordinary_vertex_is_the_published_mask() {
    let mesh = star(7, 3);
    let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::None).unwrap();
    let frame = limit_frames(&mesh, &surface)[0].clone().unwrap();
    let masks = subdiv_catmull_clark::limit_masks(7);
    let weight = |v: u32| frame.position.iter().filter(|p| p.0 == v).map(|p| p.1).sum::<f64>();
    assert!((weight(0) - masks.position[0]).abs() < 1e-9);
    for v in mesh.ring(VertexId(0)) {
        assert!((weight(v.0) - masks.position[1]).abs() < 1e-9);
    }
}

#[test]
fn refusals_name_the_place_and_the_remedy() {
    let triangle = PolyMesh::new(vec![DVec3::X, DVec3::Y, DVec3::Z], &[[0, 1, 2]]).unwrap();
    let error = SubdivisionSurface::new(&triangle, &Creases::none(), Blend::Smooth).unwrap_err();
    assert_eq!(
        error.to_string(),
        "face 0 has 3 corners; refine the mesh once to turn all faces into quads"
    );
    let cube = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let corners =
        (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)));
    let cube = PolyMesh::new(corners.collect(), &cube).unwrap();
    let error = SubdivisionSurface::new(&cube, &Creases::none(), Blend::Smooth).unwrap_err();
    assert!(error.to_string().ends_with("refine the mesh once more"), "{error}");
    assert_eq!(refinements_needed(&cube, &Creases::none()), 1);
    // Without a blend several extraordinary corners are fine.
    let surface = SubdivisionSurface::new(&cube, &Creases::none(), Blend::None).unwrap();
    check_by_differences(&cube, &surface, &surface.patches()[0], 1e-4);
}

#[test]
fn bezier_patches_reproduce_the_surface() {
    let mesh = grid(4, |x, y| 0.1 * x * x * y - 0.2 * x * y);
    let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).unwrap();
    for patch in surface.patches() {
        let points = surface.bezier(mesh.positions(), patch).unwrap();
        let (u, v) = (0.3_f64, 0.8_f64);
        let b = |t: f64| {
            let s = 1.0 - t;
            [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
        };
        let mut sum = DVec3::ZERO;
        for i in 0..4 {
            for j in 0..4 {
                sum += b(u)[i] * b(v)[j] * points[i][j];
            }
        }
        assert!(
            sum.distance(surface.evaluate(mesh.positions(), patch, u, v).derivatives[0]) < 1e-13
        );
    }
}
