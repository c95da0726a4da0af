//! Memory beyond the control mesh, counted at the allocator.
//!
//! One test in a program of its own: the counters see every thread.
#![expect(unsafe_code, reason = "an allocator cannot be written without; see the proof below")]

use curvature_variation::{
    Energy, Input, Options, Quadrature, SurfaceEnergy, Symmetry, Workspace, solve,
};
use geom_core::DVec3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is handed to the system's allocator unchanged, which keeps the contract of
// `GlobalAlloc`; the counters allocate nothing and do not unwind.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let live = LIVE.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(live, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Most bytes in use during `run` beyond those before it, in MB.
fn peak_mb<T>(run: impl FnOnce() -> T) -> (T, f64) {
    let before = LIVE.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let result = run();
    (result, (PEAK.load(Ordering::Relaxed) - before) as f64 / 1e6)
}

#[test]
fn memory_beyond_the_mesh_stays_within_bounds() {
    let (block, counted) = peak_mb(|| vec![0_u8; 3_000_000]);
    assert!((3.0..3.1).contains(&counted) && block.len() == 3_000_000, "{counted}");
    drop(block);

    let mesh = fixtures::quad_graphs::ellipsoid(38, DVec3::new(1.0, 1.3, 1.7));
    assert_eq!(mesh.vertex_count(), 8_666);
    let energy = Energy::mehlum_tarrou();
    let ((), evaluation) = peak_mb(|| {
        let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).unwrap();
        let evaluator = SurfaceEnergy::new(&surface, mesh.vertex_count(), Quadrature::NORMAL);
        let x: Vec<f64> = mesh.positions().iter().flat_map(|p| p.to_array()).collect();
        let (mut work, mut gradient) = (Workspace::default(), vec![0.0; x.len()]);
        evaluator.gradient(&energy, &x, None, &mut work, &mut gradient);
    });

    // faer's matrix product sets aside twice the last cache, once per thread, and uses a small part
    // of it: a property of the machine, taken before counting.
    let steps = |input: &Input, iterations: usize| {
        let symmetry = Symmetry::None;
        let options = Options { levels: 0, iterations, symmetry, ..Options::default() };
        let result = solve(input, &options, &mut ()).unwrap();
        (result.report.stages[0].solver.clone(), result.levels[0])
    };
    steps(&Input::from(fixtures::quad_graphs::ellipsoid(8, DVec3::new(1.0, 1.3, 1.7))), 1);
    let input = Input::from(mesh);
    let ((report, level), method) = peak_mb(|| steps(&input, 1));
    assert!(report.factorizations > 0 && report.variables == 25_998);
    println!(
        "evaluation {evaluation:.1} MB, with a Gauss-Newton factor {method:.1} MB, {:.1} MB of it factor",
        level.factor_len as f64 * 8e-6
    );
    assert!(evaluation < 20.0 && method < 250.0, "{evaluation} MB, {method} MB");
}
