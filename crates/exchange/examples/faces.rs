//! Lists the faces of files: what each surface is, whether it is trimmed, and its area.
//! usage: cargo run -p exchange --example faces -- FILE..

#![allow(clippy::print_stdout, reason = "an example prints")]

fn main() {
    for path in std::env::args().skip(1) {
        match exchange::read_model(path.as_ref()) {
            Err(error) => println!("{path}: {error}"),
            Ok(model) => {
                println!("{path}: {} faces in {}", model.surfaces.len(), model.unit);
                model.warnings.iter().for_each(|w| println!("  warning: {w}"));
                for (k, named) in model.surfaces.iter().enumerate() {
                    let s = &named.surface;
                    let loops: Vec<usize> = named
                        .trim
                        .iter()
                        .flat_map(|t| t.loops())
                        .map(|l| l.curves().len())
                        .collect();
                    println!(
                        "  {k} `{}` degree {} x {}, {} x {} points, curves of loops {loops:?}, area {:.9e}",
                        named.name,
                        s.degree_u(),
                        s.degree_v(),
                        s.n_u(),
                        s.n_v(),
                        named.curvature_statistics().area
                    );
                }
            }
        }
    }
}
