//! GLB files as other programs write them, and scenes that would outgrow the memory.

use exchange::{Group, LengthUnit, Mesh, read_glb, write_glb};
use geom_core::{DVec3, assert_close};
use serde_json::{Value, json};

fn glb(scene: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = scene.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    let total = 28 + text.len() + binary.len();
    file.extend((total as u32).to_le_bytes());
    for (kind, part) in [(b"JSON", &text[..]), (b"BIN\0", binary)] {
        file.extend((part.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(part);
    }
    file
}

fn floats(list: &[f32]) -> Vec<u8> {
    list.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Three vertices of 16 bytes (position and colour), three indices, changes of two vertices.
fn binary() -> Vec<u8> {
    let mut bytes = Vec::new();
    for (p, color) in [
        ([0.0, 0.0, 0.0], [255, 0, 0, 255]),
        ([1.0, 0.0, 0.0], [0, 255, 0, 255]),
        ([0.0, 1.0, 0.0], [0, 0, 51, 255]),
    ] {
        bytes.extend(floats(&p));
        bytes.extend(color);
    }
    bytes.extend([0, 1, 2, 0]);
    // At 52: the numbers of two vertices, then at 56 their new places.
    bytes.extend([0, 2, 0, 0]);
    bytes.extend(floats(&[0.0, 0.0, 5.0, 0.0, 2.0, 0.0]));
    bytes
}

fn scene() -> Value {
    json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": 80 }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48, "byteStride": 16 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 4 },
            { "buffer": 0, "byteOffset": 52, "byteLength": 4 },
            { "buffer": 0, "byteOffset": 56, "byteLength": 24 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 0, "byteOffset": 12, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4" },
            { "bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR" },
        ],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "COLOR_0": 1 }, "indices": 2 }] }],
        "nodes": [
            { "children": [1], "scale": [2.0, 2.0, 2.0] },
            { "mesh": 0, "name": "leaf", "translation": [0.0, 0.5, 0.0] },
        ],
        "scenes": [{ "nodes": [0] }],
        "scene": 0,
    })
}

#[test]
fn node_trees_strides_and_normalised_colours() {
    let mesh = read_glb(&glb(&scene(), &binary())).unwrap().meshes.remove(0);
    assert_eq!((mesh.name.as_str(), mesh.faces.get(0)), ("leaf", &[0, 1, 2][..]));
    // y up became z up, moved by half a metre and doubled.
    let wanted = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 0.0, 3.0]].map(DVec3::from_array);
    assert_eq!(mesh.positions, wanted);
    assert_eq!(mesh.colors[..2], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_close(f64::from(mesh.colors[2][2]), 0.2, 1e-7);
}

#[test]
fn sparse_accessors_change_some_vertices() {
    let mut changed = scene();
    changed["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": 2, "componentType": 5121 },
        "values": { "bufferView": 3 },
    });
    let read = |scene: &Value| read_glb(&glb(scene, &binary()));
    let mesh = read(&changed).unwrap().meshes.remove(0);
    let wanted = [[0.0, -10.0, 1.0], [2.0, 0.0, 1.0], [0.0, 0.0, 5.0]].map(DVec3::from_array);
    assert_eq!(mesh.positions, wanted);
    // Without data of its own the rest is zero.
    changed["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    changed["accessors"][0]["sparse"]["count"] = 1.into();
    let mesh = read(&changed).unwrap().meshes.remove(0);
    assert_eq!(mesh.positions[1], DVec3::new(0.0, 0.0, 1.0));
    changed["accessors"][0]["sparse"]["values"]["byteOffset"] = 16.into();
    let error = read(&changed).unwrap_err().to_string();
    assert_eq!(error, "accessor 0 has changes outside the data; export the scene again");
}

#[test]
fn instances_that_outgrow_the_budget_are_refused_before_they_are_built() {
    let n = 3000_u32;
    let corners: Vec<u8> = (0..3 * n).flat_map(|k| (k % 3).to_le_bytes()).collect();
    let mut bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    bytes.extend(&corners);
    let node = json!({ "mesh": 0 });
    let scene = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": bytes.len() }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": corners.len() },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5125, "count": 3 * n, "type": "SCALAR" },
        ],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "nodes": vec![node; 3000],
        "scenes": [{ "nodes": (0..3000).collect::<Vec<u32>>() }],
    });
    let file = glb(&scene, &bytes);
    assert!(file.len() < 200_000);
    let error = read_glb(&file).unwrap_err().to_string();
    assert_eq!(
        error,
        "the scene places its meshes 3000 times, which takes 206 MB where 32 are allowed; export \
         every mesh once, or fewer instances"
    );
}

#[test]
fn groups_of_one_mesh_count_their_common_vertices_once() {
    let (groups, vertices) = (200_u32, 20_000_u32);
    let at = |k: u32| f64::from(k);
    let positions = (0..vertices).map(|k| DVec3::new(at(k), at(k % 7), at(k % 3))).collect();
    let faces: Vec<[u32; 3]> = (0..groups).map(|k| [k, k + 1, k + 2]).collect();
    let mut mesh = Mesh::new(positions, faces.iter().map(|f| &f[..]));
    mesh.groups = (0..groups).map(|k| Group::new(format!("mold {k}"))).collect();
    mesh.face_groups = (0..groups).collect();
    let model = read_glb(&write_glb(&[mesh], &LengthUnit::Metre)).unwrap();
    let [read] = &model.meshes[..] else { panic!("one mesh") };
    assert_eq!((read.groups.len(), read.faces.len()), (200, 200));
}

#[test]
fn a_megabyte_of_empty_nodes_is_refused() {
    let nodes = vec![json!({}); 333_333];
    let scene = json!({ "asset": { "version": "2.0" }, "nodes": nodes });
    let error = read_glb(&glb(&scene, &[])).unwrap_err().to_string();
    assert!(error.contains("objects describe the scene; join its meshes"), "{error}");
}

#[test]
fn models_far_from_the_origin_keep_their_place() {
    // A roof at national-grid coordinates, in millimetres.
    let middle = DVec3::new(512_345_678.901, 5_401_234_567.89, 123_456.789);
    let corners = [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y].map(|p| middle + 1e4 * p);
    let mesh = Mesh::new(corners.to_vec(), [[0_u32, 1, 2, 3]]);
    let back = read_glb(&write_glb(&[mesh], &LengthUnit::Millimetre)).unwrap().meshes.remove(0);
    for (p, q) in back.positions.iter().zip(corners) {
        // Metres: a micrometre at five thousand kilometres.
        assert!(p.distance(q * 1e-3) < 2e-6, "{p} for {q}");
    }
}
