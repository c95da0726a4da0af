//! Writes the example surfaces of the `fixtures` folder as RON scenes, and one as STEP.
//! usage: cargo run -p exchange --example write_fixtures -- [FOLDER]

use bspline::BsplineSurface;
use exchange::{LengthUnit, Model, encode_model, write_files};
use fixtures::surfaces::{self, Shape};
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "fixtures".into()));
    let scenes: [(&str, BsplineSurface); 13] = [
        ("roof", Shape::Roof.surface(14, 14, 4, 4)),
        ("saddle", Shape::Saddle.surface(14, 14, 4, 4)),
        ("near-helical", Shape::Helical.surface(16, 10, 5, 5)),
        ("eggbox", Shape::Eggbox.surface(10, 10, 4, 4)),
        ("vault", Shape::Vault.surface(12, 12, 4, 4)),
        ("eggbox-coarse", Shape::Eggbox.surface(10, 8, 4, 4)),
        ("tube", Shape::Tube.surface(14, 12, 4, 4)),
        ("plane", surfaces::plane(8, 8, 4)),
        ("sphere-cap", surfaces::sphere_cap(4, 4)),
        ("torus-patch", surfaces::torus_patch(4, 4)),
        ("shell", surfaces::shell()),
        ("wing", surfaces::wing()),
        ("hall", surfaces::hall()),
    ];
    let mut files = Vec::new();
    for (name, surface) in scenes {
        let model = Model::of_surface(name, surface, LengthUnit::Metre);
        let mut names = vec![format!("{name}.ron")];
        if name == "saddle" {
            names.push(format!("{name}.step"));
        }
        for name in names {
            let path = folder.join(name);
            files.push((path.clone(), encode_model(&path, &model)?));
        }
    }
    let files: Vec<_> = files.iter().map(|(p, b)| (p.as_path(), b.as_slice())).collect();
    Ok(write_files(&files)?)
}
