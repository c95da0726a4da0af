//! Damaged files of every format are read or refused, never a panic; what is read can be written
//! and read again. `UMBILIC_MUTATIONS` sets the number of damaged files per format.

use exchange::{Field, Group, LengthUnit, Mesh, Model, decode_model, encode_model};
use fixtures::surfaces;
use geom_core::DVec3;
use std::path::Path;

/// SplitMix64: seeded, so that a failure comes back.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// Pieces that readers stumble over.
const PIECES: [&[u8]; 18] = [
    b"-1",
    b"0",
    b"4294967295",
    b"99999999999999999999",
    b"1e999",
    b"nan",
    b"(",
    b")",
    b"'",
    b"#",
    b";",
    b"\n",
    b"[",
    b"{",
    b"\"",
    b"\xff\xff\xff\xff",
    b"\0\0\0\0",
    b"/*",
];

fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        match random.below(6) {
            0 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
            1 => bytes.truncate(at),
            2 => {
                let end = (at + 1 + random.below(12)).min(bytes.len());
                bytes.drain(at..end);
            }
            3 => {
                let end = (at + 1 + random.below(60)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            4 => {
                let piece = PIECES[random.below(PIECES.len())];
                bytes.splice(at..at, piece.iter().copied());
            }
            _ => {
                let piece = PIECES[random.below(PIECES.len())];
                let end = (at + piece.len()).min(bytes.len());
                bytes.splice(at..end, piece.iter().copied());
            }
        }
    }
}

fn mesh() -> Model {
    let positions = (0..6).map(|k| DVec3::new(f64::from(k / 2), f64::from(k % 2), 0.1)).collect();
    let mut mesh = Mesh::new(positions, [&[0_u32, 2, 3, 1][..], &[2, 4, 5, 3]]);
    mesh.groups = vec![Group::new("a"), Group::new("b")];
    mesh.face_groups = vec![0, 1];
    mesh.vertex_fields = vec![Field { name: "K".into(), values: vec![0.5; 6] }];
    mesh.lines.push(&[0, 2, 4]);
    Model::of_mesh(mesh, LengthUnit::Metre)
}

#[test]
fn damaged_files_are_read_or_refused() {
    let surface = Model::of_surface("cap", surfaces::sphere_cap(2, 1), LengthUnit::Inch);
    let off = b"OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n".to_vec();
    let seeds = [
        ("ron", encode_model(Path::new("a.ron"), &surface).unwrap()),
        ("step", encode_model(Path::new("a.step"), &surface).unwrap()),
        ("json", encode_model(Path::new("a.json"), &surface).unwrap()),
        ("json", encode_model(Path::new("a.compas.json"), &surface).unwrap()),
        ("json", encode_model(Path::new("a.json"), &mesh()).unwrap()),
        ("3dm", encode_model(Path::new("a.3dm"), &surface).unwrap()),
        ("3dm", encode_model(Path::new("a.3dm"), &mesh()).unwrap()),
        ("3dm", include_bytes!("../../../../fixtures/rhino/rhino8.3dm").to_vec()),
        ("obj", encode_model(Path::new("a.obj"), &mesh()).unwrap()),
        ("ply", encode_model(Path::new("a.ply"), &mesh()).unwrap()),
        ("stl", encode_model(Path::new("a.stl"), &mesh()).unwrap()),
        ("glb", encode_model(Path::new("a.glb"), &mesh()).unwrap()),
        ("off", off),
    ];
    let rounds =
        std::env::var("UMBILIC_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(2000);
    for (extension, seed) in seeds {
        let (mut random, mut read) = (Random(42), 0);
        for round in 0..rounds {
            let mut bytes = seed.clone();
            damage(&mut bytes, &mut random);
            match decode_model(extension, bytes) {
                Err(error) => {
                    assert!(error.to_string().len() < 1000, "{extension} {round}: {error}")
                }
                Ok(model) => {
                    read += 1;
                    let path = format!("b.{extension}");
                    let Ok(again) = encode_model(Path::new(&path), &model) else { continue };
                    if let Err(error) = decode_model(extension, again) {
                        // A GLB or STL file has no loose points.
                        let faces: usize = model.meshes.iter().map(|m| m.faces.len()).sum();
                        assert_eq!(faces, 0, "{extension} {round}: our own file: {error}");
                    }
                }
            }
        }
        assert!(read > 0, "{extension}: no damaged file was read");
    }
}
