//! Round trips through every format that is read and written.

use exchange::{
    Field, Group, LengthUnit, Mesh, Model, NamedSurface, decode_model, encode_model, read_glb,
    read_json, surface_mesh, write_compas, write_geomdl, write_glb,
};
use fixtures::surfaces::{self, Shape};
use geom_core::DVec3;
use std::path::{Path, PathBuf};

fn surfaces() -> Vec<NamedSurface> {
    let named = |name: &str, surface| NamedSurface::new(name, surface);
    vec![
        named("roof", Shape::Roof.surface(9, 8, 4, 3)),
        named("tube", Shape::Tube.surface(9, 8, 3, 4)),
        named("torus", surfaces::torus_patch(3, 2)),
    ]
}

/// Two groups of quads, triangles and a pentagon, with a polyline and fields.
fn mesh() -> Mesh {
    let positions = (0..9).map(|k| {
        let (i, j) = (f64::from(k / 3), f64::from(k % 3));
        DVec3::new(i, j, 0.1 * i * j + 1.0 / 3.0)
    });
    let faces: [&[u32]; 4] = [&[0, 3, 4, 1], &[1, 4, 5], &[1, 5, 2], &[3, 6, 7, 8, 5, 4]];
    let mut mesh = Mesh::new(positions.collect(), faces);
    mesh.name = "patch work".to_owned();
    mesh.groups = vec![Group::new("mold a"), Group::new("mold b")];
    mesh.face_groups = vec![0, 1, 1, 0];
    let values = (0..9).map(|k| f64::from(k) / 7.0).collect();
    mesh.vertex_fields = vec![Field { name: "K".into(), values }];
    mesh
}

fn there_and_back(name: &str, model: &Model) -> Model {
    let path = Path::new(name);
    let bytes = encode_model(path, model).unwrap();
    decode_model(&exchange::extension_of(path), bytes).unwrap()
}

#[test]
fn surfaces_are_bit_equal_in_json() {
    let surfaces = surfaces();
    let model = Model { surfaces: surfaces.clone(), ..Model::default() };
    assert_eq!(read_json(&write_geomdl(&surfaces)).unwrap().surfaces, surfaces);
    assert_eq!(read_json(&write_compas(&model)).unwrap().surfaces, surfaces);
    for name in ["a.json", "a.compas.json", "a.ron", "a.stp"] {
        assert_eq!(there_and_back(name, &model).surfaces, surfaces, "{name}");
    }
}

#[test]
fn meshes_are_bit_equal_in_text_formats_and_ply() {
    let mesh = mesh();
    let model = Model::of_mesh(mesh.clone(), LengthUnit::Millimetre);
    let ply = there_and_back("a.ply", &model);
    assert_eq!(ply, model);
    let plain = |m: &Mesh| (m.positions.clone(), m.faces.clone());
    let obj = there_and_back("a.obj", &model).meshes.remove(0);
    assert_eq!(plain(&obj), plain(&mesh));
    assert_eq!((obj.groups, obj.face_groups), (mesh.groups.clone(), mesh.face_groups.clone()));
    let json = there_and_back("a.json", &model).meshes.remove(0);
    assert_eq!(plain(&json), plain(&mesh));
}

#[test]
fn glb_keeps_triangles_materials_and_values() {
    let mut mesh = mesh();
    mesh.push_polyline(&[DVec3::ZERO, DVec3::ONE, DVec3::X]);
    mesh.vertex_fields[0].values.extend([0.0; 3]);
    let bytes = write_glb(&[mesh.clone()], &LengthUnit::Centimetre);
    let model = read_glb(&bytes).unwrap();
    assert_eq!(model.unit, LengthUnit::Metre);
    let again = &model.meshes[0];
    assert_eq!(again.faces.len(), 2 + 1 + 1 + 4);
    assert_eq!(again.groups[..2], mesh.groups[..]);
    assert_eq!(again.lines.len(), 2);
    for (p, q) in again.positions.iter().zip(&mesh.positions) {
        assert!(p.distance(*q * 0.01) < 1e-8, "{p} {q}");
    }
}

#[test]
fn sampled_surfaces_carry_exact_normals_and_curvatures() {
    let cap = surfaces::sphere_cap(4, 3);
    let model = Model::of_surface("cap", cap, LengthUnit::Metre);
    let bytes = encode_model(Path::new("cap.glb"), &model).unwrap();
    let mesh = read_glb(&bytes).unwrap().meshes.remove(0);
    let names: Vec<&str> = mesh.vertex_fields.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["H", "K", "K1", "K2"]);
    let (h, k) = (&mesh.vertex_fields[0].values, &mesh.vertex_fields[1].values);
    assert!(h.iter().all(|h| (h + 1.0).abs() < 1e-6) && k.iter().all(|k| (k - 1.0).abs() < 1e-6));
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        assert!(p.distance(*n) < 1e-6, "on the unit sphere the normal is the position");
    }
    assert_eq!(mesh.colors.len(), mesh.positions.len());
}

#[test]
fn a_closed_surface_is_sampled_without_a_seam() {
    let tube = surface_mesh("tube", &Shape::Tube.surface(9, 8, 3, 4), Some((12, 5)));
    assert_eq!((tube.positions.len(), tube.faces.len()), (12 * 6, 12 * 5));
    assert_eq!(tube.to_poly_mesh().unwrap().boundary_loops().len(), 2);
}

#[test]
fn formats_refuse_what_they_cannot_hold() {
    let model = Model::of_mesh(mesh(), LengthUnit::Millimetre);
    for name in ["a.step", "a.ron", "a.svg", "a.dxf", "a.off", "a"] {
        let error = encode_model(Path::new(name), &model).unwrap_err().to_string();
        assert!(error.contains("cannot hold") || error.contains("no writer"), "{name}: {error}");
    }
    let error = encode_model(Path::new("a.step"), &model).unwrap_err().to_string();
    assert_eq!(error, "STEP cannot hold meshes; choose another extension, or fit surfaces first");
    let mut far = mesh();
    far.positions[3].x = -1e300;
    let model = Model::of_mesh(far, LengthUnit::Millimetre);
    let error = encode_model(Path::new("a.glb"), &model).unwrap_err().to_string();
    assert!(error.starts_with("GLB cannot hold coordinates of 1e38 and beyond"), "{error}");
}

#[test]
fn json_faults_name_place_and_mend() {
    let surface = write_geomdl(&surfaces()[..1]);
    let closed = write_geomdl(&surfaces()[1..2]);
    let model = Model::of_mesh(mesh(), LengthUnit::Millimetre);
    let mesh = write_compas(&model);
    let cases = [
        (surface.replace("\"size_u\":9", "\"size_u\":8"), "surface 1: the knots need 9"),
        (
            surface.replace("\"degree_u\":4", "\"degree_u\":40"),
            "surface 1: degree 40 is not between",
        ),
        (surface.replace("\"size_u\":9", "\"size_u\":\"9\""), "line 1: column"),
        // The open knots of a closed direction, for more points than they can have.
        (closed.replace("\"size_u\":12", "\"size_u\":28"), "surface 1: the knots need 12"),
        (surface.replace("\"surface\"", "\"curve\""), "a geomdl file of type `curve`"),
        (surface[..400].to_owned(), "line 1: column"),
        (mesh.replace("[0,3,4,1]", "[0,3,4,99]"), "item 1: face 0 names vertex 99"),
        (mesh.replace("[0,3,4,1]", "[0,3]"), "item 1: face 0 has 2 corners"),
        (mesh.replace("datastructures/Mesh", "geometry/Box"), "the file has neither"),
        ("[".repeat(100_000), "line 1: the nesting is deeper than 64"),
        ("{}".to_owned(), "line 1: column 2: missing field `dtype`"),
        (String::new(), "line 1: column 0: EOF"),
    ];
    for (text, want) in cases {
        let message = read_json(&text).unwrap_err().to_string();
        assert!(message.starts_with(want), "{message}, not {want}");
    }
}

#[test]
fn glb_faults_name_place_and_mend() {
    let good = write_glb(&[mesh()], &LengthUnit::Metre);
    let text_end = 20 + u32::from_le_bytes(good[12..16].try_into().unwrap()) as usize;
    let text = String::from_utf8(good[20..text_end].to_vec()).unwrap();
    // The JSON is padded with blanks, so a longer replacement needs its own lengths.
    let change = |from: &str, to: &str| {
        assert!(text.contains(from), "{from} in {text}");
        let mut json = text.replace(from, to).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut file = good[..12].to_vec();
        file.extend((json.len() as u32).to_le_bytes());
        file.extend(b"JSON");
        file.extend(&json);
        file.extend(&good[text_end..]);
        let total = file.len() as u32;
        file[8..12].copy_from_slice(&total.to_le_bytes());
        file
    };
    let mut cases = vec![
        (b"glTF".to_vec(), "byte 0: not a GLB"),
        (Vec::new(), "byte 0: not a GLB"),
        (good[..60].to_vec(), "byte 8: the header announces more"),
        (
            change("\"count\":9", "\"count\":4000000000"),
            "accessor 0 has 4000000000 items outside its",
        ),
        (change("\"bufferView\":0", "\"bufferView\":77"), "`accessors[0].bufferview`: index out"),
        (change("\"POSITION\":0", "\"POSITION\":50"), "accessor 50 is named and not there"),
        (change("\"mesh\":0", "\"mesh\":3"), "`nodes[0].mesh`: index out"),
        (
            change("\"mesh\":0", "\"mesh\":0,\"children\":[0]"),
            "node 0 has two parents or is its own",
        ),
        (change("\"nodes\":[1]", "\"nodes\":[4]"), "`scenes[0].nodes[0]`: index out"),
        (change("\"VEC3\"", "\"VEC9\""), "`accessors[0].type`: "),
        (change("\"componentType\":5126", "\"componentType\":1"), "`accessors[0].componenttype`: "),
        (
            change("\"asset\"", "\"extensionsRequired\":[\"KHR_draco\"],\"asset\""),
            "the file needs the extension KHR_draco",
        ),
        (change("\"scale\":[1.0", "\"scale\":[1e999"), "line 1: column"),
    ];
    let mut outside = good.clone();
    let indices = outside.len() - 4;
    outside[indices..].copy_from_slice(&77_u32.to_le_bytes());
    cases.push((outside, "accessor"));
    for (bytes, want) in cases {
        let message = read_glb(&bytes).unwrap_err().to_string();
        assert!(message.starts_with(want), "{message}, not {want}");
    }
}

#[test]
fn meshes_of_other_programs() {
    let folder = std::env::var_os("UMBILIC_MODELS").map(PathBuf::from).filter(|p| p.is_dir());
    let Some(folder) = folder else {
        eprintln!("SKIPPED meshes_of_other_programs: UMBILIC_MODELS names no folder");
        return;
    };
    let read = |name: &str| exchange::read_model(&folder.join(name)).unwrap().meshes.remove(0);
    for (name, vertices, faces) in [("knet1.obj", 441, 400), ("enneper2.obj", 961, 900)] {
        let mesh = read(name);
        assert_eq!((mesh.positions.len(), mesh.faces.len()), (vertices, faces), "{name}");
        assert!(mesh.to_poly_mesh().unwrap().is_quad_mesh());
    }
    // Free-form curves of degree 1.
    assert_eq!(read("saddle.obj").lines.len(), 40);
    for (name, want) in [("hdr.ply", "byte 178: 4000000000 elements"), ("idx.obj", "line 4: `9999")]
    {
        let error = exchange::read_model(&folder.join("hostile").join(name)).unwrap_err();
        assert!(error.to_string().starts_with(want), "{name}: {error}");
    }
}

#[test]
fn files_that_other_readers_take_are_taken() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/read");
    let read = |name: &str| exchange::read_model(&folder.join(name));
    let net = &read("tokens-over-lines.off").unwrap().meshes[0];
    assert_eq!((net.positions.len(), net.faces.len()), (25, 16));
    assert_eq!(net.faces.get(15), [18, 19, 24, 23]);
    assert!(!read("upper-case-magic.ply").unwrap().meshes[0].positions.is_empty());
    let twice = read("dupvert.ply").unwrap_err().to_string();
    assert_eq!(
        twice,
        "line 7: declared before: `element vertex 3`; give every kind of element once"
    );
}
