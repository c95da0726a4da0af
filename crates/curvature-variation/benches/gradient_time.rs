//! Times of one energy with its gradient on a sphere-like mesh: least and median over many
//! evaluations, on one thread and on two, as a table in Markdown.
//!
//! `cargo bench -p curvature-variation --bench gradient_time -- [SIDE] [EVALUATIONS]`: a cube with SIDE × SIDE
//! quads a face (38, the default, has 8,666 vertices and 24 patches of 256 samples) and the torus
//! of nearest size, which has none of those.

use curvature_variation::{Energy, Quadrature, SurfaceEnergy, Workspace};
use fixtures::quad_graphs;
use geom_core::{DVec3, PolyMesh};
use std::error::Error;
use std::io::Write as _;
use std::time::Instant;
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};

fn main() -> Result<(), Box<dyn Error>> {
    let argument = |k: usize, default: usize| -> Result<usize, std::num::ParseIntError> {
        std::env::args().filter(|a| a != "--bench").nth(k).map_or(Ok(default), |text| text.parse())
    };
    let side = argument(1, 38)?.max(2);
    let evaluations = argument(2, 300)?.max(1);
    let mut out = std::io::stdout();
    writeln!(out, "| mesh | vertices | samples | threads | least ms | median ms |")?;
    writeln!(out, "|---|---|---|---|---|---|")?;
    let around = (2.45 * side as f64).round() as usize;
    let meshes: [(&str, PolyMesh); 2] = [
        ("sphere", quad_graphs::ellipsoid(side, DVec3::new(1.0, 1.3, 1.7))),
        ("torus", quad_graphs::torus(around, around, 1.0, 0.5)),
    ];
    let energy = Energy::mehlum_tarrou();
    for (name, mesh) in &meshes {
        let surface = SubdivisionSurface::new(mesh, &Creases::none(), Blend::Smooth)?;
        let x: Vec<f64> = mesh.positions().iter().flat_map(|p| p.to_array()).collect();
        for quadrature in [Quadrature::COARSE, Quadrature::NORMAL] {
            let evaluator = SurfaceEnergy::new(&surface, mesh.vertex_count(), quadrature);
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
                let mut work = Workspace::default();
                let mut gradient = vec![0.0; x.len()];
                let mut times = Vec::with_capacity(evaluations);
                for _ in 0..evaluations {
                    let begin = Instant::now();
                    pool.install(|| {
                        evaluator.gradient(&energy, &x, None, &mut work, &mut gradient)
                    });
                    times.push(1e3 * begin.elapsed().as_secs_f64());
                }
                times.sort_by(f64::total_cmp);
                writeln!(
                    out,
                    "| {name} | {} | {} | {threads} | {:.2} | {:.2} |",
                    mesh.vertex_count(),
                    quadrature.regular * quadrature.regular,
                    times[0],
                    times[times.len() / 2],
                )?;
            }
        }
    }
    Ok(())
}
