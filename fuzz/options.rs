//! Files and words that options name.

use crate::Input;
use curvature_variation::{Constraints, Energy, Input as Fairing};
use fixtures::quad_graphs::theta_graph;
use geom_core::{BoundingBox, DVec3};
use gp_solver::{Checkpoint, Observer};
use hyperbolic_nets::darboux::{Branch, Freedom, cage_corners, fit_cage};
use subdiv_catmull_clark::{Blend, CreaseList, SubdivisionSurface, refine, refinements_needed};
use std::sync::OnceLock;

/// Refines a mesh with the creases in `bytes`.
///
/// # Panics
/// If creases that fit the mesh cannot be refined to a surface for other reasons than a limit.
pub fn creases(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let text = text.replace("inf", "1e9");
    let Ok(list) = exchange::from_ron::<CreaseList>(&text) else { return };
    let mut mesh = theta_graph(3);
    let Ok(mut creases) = list.for_mesh(&mesh) else { return };
    let needed = refinements_needed(&mesh, &creases);
    assert!(needed <= 8, "{needed} refinements");
    for _ in 0..needed.min(3) {
        let refined = refine(&mesh, &creases).expect("a small mesh");
        (mesh, creases) = (refined.mesh, refined.creases);
    }
    assert!(mesh.positions().iter().all(|p| p.is_finite()));
    if needed <= 3 {
        // A refusal is an answer; a panic is not.
        let _ = SubdivisionSurface::new(&mesh, &creases, Blend::Smooth);
    }
}

/// Fairs a mesh under the constraints in `bytes`, one step.
///
/// # Panics
/// If a result is not finite.
pub fn constraints(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(constraints) = exchange::from_ron::<Constraints>(text) else { return };
    let input = Fairing { constraints, ..theta_graph(3).into() };
    let options = curvature_variation::Options { levels: 0, iterations: 1, ..Default::default() };
    if let Ok(solution) = curvature_variation::solve(&input, &options, &mut ()) {
        assert!(solution.result.positions().iter().all(|p| p.is_finite()));
    }
}

/// The transformation that takes the corners of a box to places in `bytes`.
///
/// # Panics
/// If the map of a fit that is not refused takes a corner to what is no point.
pub fn cage(bytes: &[u8]) {
    let mut input = Input(bytes);
    let bounds = BoundingBox { min: DVec3::splat(-1.0), max: DVec3::new(1.0, 1.5, 2.0) };
    let corners = cage_corners(bounds, 0.05);
    let freedom = if bytes.len() % 2 == 0 { Freedom::Sixteen } else { Freedom::Nineteen };
    let images = corners.map(|p| p + DVec3::from_array([(); 3].map(|()| input.number())));
    if let Ok(fit) = fit_cage(&corners, &images, freedom) {
        assert!(fit.errors.iter().all(|e| e.is_finite()), "{:?}", fit.errors);
        // The middle may have no image; what it has is finite.
        let middle = corners.iter().sum::<DVec3>() / 8.0;
        if let Ok(image) = fit.map.image(middle, Branch::Regular) {
            assert!(image.is_finite(), "{image}");
        }
    }
}

/// A state to go on from, and the last one that was offered.
#[derive(Default)]
pub struct States {
    from: Option<Checkpoint>,
    /// The last state.
    pub last: Option<Checkpoint>,
}

impl Observer for States {
    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        self.last = Some(state());
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.from.take()
    }
}

/// A short run from a state; the one it ends with.
///
/// # Panics
/// If a result is not finite.
pub fn run_from(state: Option<Checkpoint>) -> Option<Checkpoint> {
    let options = curvature_variation::Options { levels: 0, iterations: 2, ..Default::default() };
    let mut states = States { from: state, last: None };
    let solved = curvature_variation::solve(&theta_graph(3).into(), &options, &mut states);
    if let Ok(solution) = solved {
        assert!(solution.result.positions().iter().all(|p| p.is_finite()));
    }
    states.last
}

/// Goes on from a state in `bytes`, whose method and fingerprint are made to fit.
///
/// # Panics
/// As [`run_from`].
pub fn checkpoint(bytes: &[u8]) {
    static WHOLE: OnceLock<Option<Checkpoint>> = OnceLock::new();
    let Ok(mut state) = serde_json::from_slice::<Checkpoint>(bytes) else { return };
    let Some(whole) = WHOLE.get_or_init(|| run_from(None)) else { return };
    state.method.clone_from(&whole.method);
    (state.schema, state.fingerprint) = (whole.schema, whole.fingerprint);
    run_from(Some(state));
}

/// Reads an energy and reads again what it prints.
///
/// # Panics
/// If it prints as another one.
pub fn energy(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(energy) = text.parse::<Energy>() else { return };
    let printed = energy.to_string();
    let again = printed.parse::<Energy>().expect("what we print can be read");
    assert_eq!(again.to_string(), printed);
}
