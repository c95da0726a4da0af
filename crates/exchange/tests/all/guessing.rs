//! Files whose names say nothing, or the wrong thing.

use exchange::{LengthUnit, Model, encode_model, read_model, read_model_as};
use fixtures::surfaces;
use std::path::Path;

#[test]
fn every_format_is_known_without_its_extension() {
    let folder = tempfile::tempdir().unwrap();
    let model = Model::of_surface("cap", surfaces::plane(3, 3, 2), LengthUnit::Metre);
    for format in ["ron", "step", "3dm", "obj", "ply", "stl", "glb", "json"] {
        let bytes = encode_model(Path::new(&format!("a.{format}")), &model).unwrap();
        let named = folder.path().join(format!("named.{format}"));
        std::fs::write(&named, &bytes).unwrap();
        let wanted = read_model(&named).unwrap();
        for name in ["plain", "plain.dat"] {
            let path = folder.path().join(name);
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(read_model(&path).unwrap(), wanted, "{format} as {name}");
            assert_eq!(read_model_as(&path, Some(format)).unwrap(), wanted);
        }
        if !matches!(format, "ron" | "json" | "obj") {
            let path = folder.path().join("wrong.obj");
            std::fs::write(&path, &bytes).unwrap();
            let read = read_model(&path).unwrap();
            let said = format!("the content is {} whatever the name says", format.to_uppercase());
            assert_eq!((read.meshes, read.surfaces), (wanted.meshes, wanted.surfaces));
            assert_eq!(read.warnings.last(), Some(&said));
        }
    }
    let path = folder.path().join("plain");
    std::fs::write(&path, "hello").unwrap();
    let error = read_model(&path).unwrap_err().to_string();
    assert!(error.starts_with("no reader for the extension ``; use one of ron"), "{error}");
    let error = read_model_as(&path, Some("doc")).unwrap_err().to_string();
    assert!(error.starts_with("no reader for the extension `doc`"), "{error}");
}
