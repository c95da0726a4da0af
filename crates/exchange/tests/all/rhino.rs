//! Rhino's files: what is written comes back to the last bit, and files that openNURBS wrote are
//! read with their areas in closed form (`cargo xtask judges` lets rhino3dm read ours).

use bspline::{
    ArcSpans, BsplineCurve, BsplineSurface, Degree, KnotVector, Trim, TrimCurve, TrimLoop,
};
use exchange::{
    Group, LengthUnit, Mesh, Model, NamedSurface, PointGrid, decode_model, encode_model, read_3dm,
    read_model, write_3dm,
};
use fixtures::surfaces;
use geom_core::{DVec3, assert_close};
use std::f64::consts::{PI, TAU};
use std::path::Path;

fn fixture(name: &str) -> Model {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/rhino");
    read_model(&folder.join(name)).unwrap()
}

/// A surface of degrees 3 and 2 with sines for heights.
fn wavy(knots_u: KnotVector) -> BsplineSurface {
    let knots_v = KnotVector::clamped_uniform(Degree::new(2).unwrap(), 5).unwrap();
    let n = knots_u.control_count();
    let point = |k: usize| {
        let (u, v) = (TAU * (k / 5) as f64 / n as f64, (k % 5) as f64);
        DVec3::new(u.cos() * (2.0 + 0.3 * v), u.sin() * (2.0 - 0.1 * v), v + (3.0 * u).sin() / 7.0)
    };
    BsplineSurface::new(knots_u, knots_v, (0..5 * n).map(point).collect(), None).unwrap()
}

fn open() -> BsplineSurface {
    wavy(KnotVector::clamped_uniform(Degree::new(3).unwrap(), 7).unwrap())
}

fn again(model: &Model) -> Model {
    let bytes = write_3dm(model).unwrap();
    assert_eq!(bytes, write_3dm(model).unwrap());
    read_3dm(&bytes).unwrap()
}

/// A square with a round hole, the hole with its curve in space.
fn with_hole(named: NamedSurface) -> NamedSurface {
    let surface = &named.surface;
    let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
    let at = |s: f64, t: f64| DVec3::new(u0 + s * (u1 - u0), v0 + t * (v1 - v0), 0.0);
    let corners = [at(0.1, 0.1), at(0.9, 0.1), at(0.9, 0.8), at(0.1, 0.8)];
    let line = |k: usize| {
        let parameters = BsplineCurve::segment(corners[k], corners[(k + 1) % 4], 0.0, 1.0);
        TrimCurve { parameters: parameters.unwrap(), edge: None }
    };
    let outer = TrimLoop::new((0..4).map(line).collect(), 0.0).unwrap();
    let (x, y) = (DVec3::X * 0.2 * (u1 - u0), DVec3::Y * 0.2 * (v1 - v0));
    let circle = BsplineCurve::arc(at(0.5, 0.45), x, y, ArcSpans::new(0.0, TAU)).unwrap();
    let edge = surface.curve_on(&circle, 1e-9).unwrap().0;
    let hole = TrimCurve { parameters: circle, edge: Some(edge) };
    let hole = TrimLoop::new(vec![hole], 0.0).unwrap();
    NamedSurface { trim: Some(Trim::new(vec![outer, hole]).unwrap()), ..named }
}

#[test]
fn splines_names_layers_and_colours_come_back() {
    let mut saddle = NamedSurface::new("Dach é 屋", open());
    saddle.layer = "mold 3".into();
    saddle.color = Some([1.0, 0.0, 1.0]);
    let tube = NamedSurface {
        layer: "tubes".into(),
        ..NamedSurface::new(
            "tube",
            wavy(
                KnotVector::periodic(Degree::new(3).unwrap(), &[0.0, 0.7, 1.0, 2.5, 3.0, 3.3])
                    .unwrap(),
            ),
        )
    };
    let model = Model { unit: LengthUnit::Foot, surfaces: vec![saddle, tube], ..Model::default() };
    assert_eq!(again(&model), model);
}

#[test]
fn rational_control_points_keep_all_but_the_last_bit() {
    let cap = surfaces::sphere_cap(3, 2);
    let back = again(&Model::of_surface("cap", cap.clone(), LengthUnit::Metre));
    let back = &back.surfaces[0].surface;
    assert_eq!((back.knots_u(), back.knots_v()), (cap.knots_u(), cap.knots_v()));
    assert_eq!(back.weights(), cap.weights());
    for (p, q) in back.control_points().iter().zip(cap.control_points()) {
        for (a, b) in p.to_array().into_iter().zip(q.to_array()) {
            assert!(a == b || a == b.next_up() || a == b.next_down(), "{a} for {b}");
        }
    }
}

#[test]
fn trims_come_back_with_their_curves_in_space() {
    let whole = NamedSurface::new("hole", open());
    let named = NamedSurface { layer: "trimmed".into(), ..with_hole(whole) };
    let back = again(&Model { surfaces: vec![named.clone()], ..Model::default() });
    let back = &back.surfaces[0];
    assert_eq!(back.surface, named.surface);
    let (got, wanted) = (back.trim.as_ref().unwrap(), named.trim.as_ref().unwrap());
    assert_eq!(got.loops().len(), 2);
    for (got, wanted) in got.loops().iter().zip(wanted.loops()) {
        assert_eq!(got.curves().len(), wanted.curves().len());
        for (got, wanted) in got.curves().iter().zip(wanted.curves()) {
            assert_eq!(got.parameters.knots(), wanted.parameters.knots());
            for (p, q) in
                got.parameters.control_points().iter().zip(wanted.parameters.control_points())
            {
                assert!(p.distance(*q) <= f64::EPSILON * q.length(), "{p} for {q}");
            }
            let edge = got.edge.as_ref().unwrap();
            let start = edge.knots().domain().0;
            // Both run in the same direction.
            let first = got.parameters.control_points()[0];
            assert_close(
                edge.point(start).distance(named.surface.point(first.x, first.y)),
                0.0,
                1e-9,
            );
        }
    }
    let areas = [back, &named].map(|s| s.curvature_statistics().area);
    assert_close(areas[0] / areas[1], 1.0, 1e-12);
}

#[test]
fn islands_become_faces() {
    let line = |a: DVec3, b: DVec3| TrimCurve {
        parameters: BsplineCurve::segment(a, b, 0.0, 1.0).unwrap(),
        edge: None,
    };
    let square = |low: f64, high: f64| {
        let corners = [(low, low), (high, low), (high, high), (low, high)];
        let corners = corners.map(|(u, v)| DVec3::new(u, v, 0.0));
        TrimLoop::new((0..4).map(|k| line(corners[k], corners[(k + 1) % 4])).collect(), 0.0)
            .unwrap()
    };
    let trim = Trim::new(vec![square(0.1, 0.9), square(0.2, 0.8), square(0.3, 0.6)]).unwrap();
    let named = NamedSurface { trim: Some(trim), ..NamedSurface::new("", open()) };
    let back = again(&Model { surfaces: vec![named.clone()], ..Model::default() });
    assert_eq!(back.surfaces.len(), 2);
    let area: f64 = back.surfaces.iter().map(|s| s.curvature_statistics().area).sum();
    assert_close(area / named.curvature_statistics().area, 1.0, 1e-12);
}

#[test]
fn meshes_keep_polygons_positions_and_colours() {
    let positions: Vec<DVec3> = (0..400)
        .map(|k| DVec3::new(0.1 * f64::from(k), (0.7 * f64::from(k)).sin(), 1e5 / 3.0))
        .collect();
    let mut faces: Vec<Vec<u32>> = (0..100).map(|k| vec![k, k + 1, k + 2]).collect();
    faces.extend((100..200).map(|k| vec![k, k + 2, k + 3, k + 1]));
    faces.push((200..400).collect());
    let mut mesh = Mesh::new(positions, faces);
    mesh.name = "panels".into();
    mesh.colors = (0..400).map(|k| [0.0, if k % 2 == 0 { 1.0 } else { 0.0 }, 1.0]).collect();
    let model = Model::of_mesh(mesh, LengthUnit::Inch);
    let back = again(&model);
    assert_eq!((&back.meshes[0], &back.unit), (&model.meshes[0], &model.unit));
}

#[test]
fn groups_become_objects_on_layers() {
    let positions = (0..6).map(|k| DVec3::new(f64::from(k / 2), f64::from(k % 2), 0.1)).collect();
    let mut mesh = Mesh::new(positions, [&[0_u32, 2, 3, 1][..], &[2, 4, 5, 3]]);
    mesh.groups = vec![Group::new("mold 1"), Group::new("mold 2")];
    mesh.face_groups = vec![0, 1];
    mesh.lines.push(&[0, 2, 4]);
    let back = again(&Model::of_mesh(mesh.clone(), LengthUnit::Metre));
    assert_eq!(back.meshes.len(), 3);
    for (k, part) in back.meshes[..2].iter().enumerate() {
        assert_eq!(part.name, mesh.groups[k].name);
        let corners = |m: &Mesh, f: usize| -> Vec<DVec3> {
            m.faces.get(f).iter().map(|&v| m.positions[v as usize]).collect()
        };
        assert_eq!(corners(part, 0), corners(&mesh, k));
    }
    assert_eq!(
        back.meshes[2].polyline(0).collect::<Vec<_>>(),
        mesh.polyline(0).collect::<Vec<_>>()
    );
}

#[test]
fn grids_become_points_and_units_of_their_own_stay() {
    let points: Vec<DVec3> = (0..6).map(|k| DVec3::splat(f64::from(k))).collect();
    let grid = PointGrid { name: "survey".into(), n_u: 3, n_v: 2, points: points.clone() };
    let unit = LengthUnit::Other { name: "fathom".into(), metres: 1.8288 };
    let back = again(&Model { unit: unit.clone(), grids: vec![grid], ..Model::default() });
    assert_eq!((&back.unit, &back.meshes[0].positions), (&unit, &points));
    assert_eq!(back.meshes[0].name, "survey");
}

#[test]
fn files_of_rhino_have_their_areas_in_closed_form() {
    for name in ["rhino5.3dm", "rhino8.3dm"] {
        let model = fixture(name);
        assert_eq!(model.unit, LengthUnit::Inch);
        let area = |wanted: &str| -> f64 {
            let named = model.surfaces.iter().filter(|s| s.name == wanted);
            named.map(|s| s.curvature_statistics().area).sum()
        };
        assert_close(area("cylinder") / (4.0 * PI + 2.0 * PI), 1.0, 1e-12);
        assert_close(area("sphere") / (16.0 * PI), 1.0, 1e-12);
        assert_close(area("box"), 22.0, 1e-12);
        // From radius 1 to 2 over two radians, 3 high.
        assert_close(area("cone") / (3.0 * 10.0_f64.sqrt()), 1.0, 1e-12);
        let roof = &model.surfaces[0];
        assert_eq!((roof.name.as_str(), roof.layer.as_str()), ("Dach é", "shells"));
        assert_eq!(roof.color, Some([1.0, 0.0, 0.0]));
        assert_eq!(roof.surface.knots_u().knots(), [0.0, 0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(roof.surface.control_point(3, 2), DVec3::new(3.0, 2.0, 0.1 * 3.0 * 2.0));
        assert_eq!(model.surfaces.iter().filter(|s| s.trim.is_some()).count(), 2);
        assert!(model.surfaces[1..].iter().all(|s| s.color.is_none()));
        let mesh = model.meshes.iter().find(|m| m.name == "mesh").unwrap();
        assert_eq!(mesh.faces.iter().collect::<Vec<_>>(), [&[0, 1, 2, 3][..], &[1, 4, 2]]);
        assert_eq!((mesh.colors.len(), mesh.normals.len()), (5, 5));
        let chain = model.meshes.iter().find(|m| m.name == "chain").unwrap();
        let end = *chain.positions.last().unwrap();
        assert_close(end.distance(2.0 * DVec3::new(1.0_f64.cos(), 1.0_f64.sin(), 0.0)), 0.0, 1e-12);
        assert_eq!(
            model.warnings,
            [
                "left out: 1 extrusion, 1 text dot; open the file with rhino3dm in Python or with \
                 Rhino and turn them into NURBS surfaces or meshes",
                "1 curve became polylines with 16 pieces per knot span",
            ]
        );
    }
}

#[test]
fn faults_name_the_byte() {
    let good = write_3dm(&Model::of_surface("", open(), LengthUnit::Metre)).unwrap();
    let refused = |bytes: &[u8]| read_3dm(bytes).unwrap_err().to_string();
    assert_eq!(refused(b"solid"), "byte 0: not a 3DM file; save it with Rhino");
    let mut old = good.clone();
    old[24..32].copy_from_slice(b"       4");
    assert_eq!(refused(&old), "byte 24: a 3DM file of version 4; save it as Rhino 5 or later");
    assert!(refused(&good[..good.len() / 2]).contains("bytes are missing"));
    // A coordinate is another, its checksum is not.
    let mut other = good.clone();
    let class = [0xDE, 0xD4, 0xD7, 0x4E];
    let at = other.windows(4).position(|w| w == class).unwrap();
    other[at + 300] ^= 1;
    assert!(refused(&other).contains("the checksum of a part is wrong"), "{}", refused(&other));
    let empty = encode_model(Path::new("a.3dm"), &Model::default()).unwrap_err().to_string();
    assert!(empty.starts_with("3DM cannot hold a model without surfaces"), "{empty}");
    assert!(decode_model("3dm", good).is_ok());
}

#[test]
fn a_bomb_is_refused_before_it_is_unpacked() {
    // A mesh of a million points that are all the same packs to a few thousand bytes.
    let points = vec![DVec3::ONE; 1_000_000];
    let faces: Vec<[u32; 3]> = vec![[0, 1, 999_999]];
    let mut mesh = Mesh::new(points, faces);
    mesh.faces = (0..333_333).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let bytes = write_3dm(&Model::of_mesh(mesh, LengthUnit::Metre)).unwrap();
    let error = read_3dm(&bytes).unwrap_err().to_string();
    assert!(error.contains("more points than fit into memory"), "{error}");
}
