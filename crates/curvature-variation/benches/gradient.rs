//! Energy and gradient of closed surfaces of growing size, with 16 and 64 samples a patch.
//!
//! The numbers in `docs/benchmarks/curvature-variation.md` come from here. The cube-spheres have
//! eight vertices of valence 3, whose patches take 256 samples; the torus has none, the theta
//! graph four of valence 6.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use curvature_variation::{Energy, Quadrature, SurfaceEnergy, Workspace};
use fixtures::quad_graphs;
use geom_core::{DVec3, PolyMesh};
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface, refine};

const COARSE: Quadrature = Quadrature { regular: 4, extraordinary: 16 };
const NORMAL: Quadrature = Quadrature { regular: 8, extraordinary: 16 };

struct Case {
    evaluator: SurfaceEnergy,
    x: Vec<f64>,
    work: Workspace,
    gradient: Vec<f64>,
}

impl Case {
    fn new(mesh: &PolyMesh, quadrature: Quadrature) -> Self {
        let surface = SubdivisionSurface::new(mesh, &Creases::none(), Blend::Smooth)
            .expect("regular rings around extraordinary vertices");
        let x: Vec<f64> = mesh.positions().iter().flat_map(|p| p.to_array()).collect();
        Self {
            evaluator: SurfaceEnergy::new(&surface, mesh.vertex_count(), quadrature),
            work: Workspace::default(),
            gradient: vec![0.0; x.len()],
            x,
        }
    }

    fn run(&mut self, energy: &Energy) -> f64 {
        self.evaluator.gradient(energy, &self.x, None, &mut self.work, &mut self.gradient)
    }
}

fn sphere(n: usize) -> PolyMesh {
    quad_graphs::ellipsoid(n, DVec3::new(1.0, 1.3, 1.7))
}

fn theta(levels: usize) -> PolyMesh {
    (0..levels).fold(quad_graphs::theta_graph(3), |mesh, _| {
        refine(&mesh, &Creases::none()).expect("a small mesh").mesh
    })
}

fn gradient(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("energy and gradient");
    group.sample_size(20);
    let meshes = [sphere(9), sphere(19), sphere(38), sphere(76), theta(3)];
    let energy = Energy::mehlum_tarrou();
    for (quadrature, samples) in [(COARSE, 16), (NORMAL, 64)] {
        for mesh in &meshes {
            let mut case = Case::new(mesh, quadrature);
            let id = BenchmarkId::new(format!("{samples} samples"), mesh.vertex_count());
            group.bench_function(id, |b| b.iter(|| case.run(&energy)));
        }
    }
    // The torus of nearest size, and terms that need one more pass or the principal directions.
    for text in ["mehlum_tarrou", "mvs_cross", "sqrt", "0.92*bending + 0.08*mehlum_tarrou"] {
        let energy: Energy = text.parse().expect("an energy");
        let mut case = Case::new(&quad_graphs::torus(96, 89, 1.0, 0.5), NORMAL);
        group.bench_function(format!("torus of 8544, {text}"), |b| b.iter(|| case.run(&energy)));
    }
    group.finish();
}

criterion_group!(benches, gradient);
criterion_main!(benches);
