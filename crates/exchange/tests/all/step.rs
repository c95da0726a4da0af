//! STEP files: what is written comes back bit-equal, and files of other programs are understood.

use bspline::{BsplineSurface, Degree, KnotVector};
use exchange::{LengthUnit, Model, NamedSurface, read_model, read_step, write_step};
use fixtures::surfaces::{self, Shape};
use geom_core::DVec3;
use proptest::prelude::*;
use std::path::PathBuf;

fn reread(model: &Model) -> Model {
    read_step(write_step(model).unwrap().as_bytes()).unwrap()
}

#[test]
fn fixtures_come_back_bit_equal_without_warnings() {
    let surfaces = [
        ("roof", Shape::Roof.surface(14, 14, 4, 4)),
        ("tube, closed", Shape::Tube.surface(14, 12, 4, 4)),
        ("cap 'α'", surfaces::sphere_cap(4, 4)),
        ("", surfaces::torus_patch(3, 2)),
    ];
    let surfaces = surfaces.map(|(name, surface)| NamedSurface::new(name, surface));
    let model = Model { unit: LengthUnit::Foot, surfaces: surfaces.into(), ..Model::default() };
    assert_eq!(reread(&model), model);
}

#[test]
fn closed_and_pinched_surfaces_have_sound_borders() {
    // A cone: one side is a point, two sides are the same curve.
    let degree = |d| Degree::new(d).unwrap();
    let ring = [(1.0, 0.0), (0.0, 1.5), (-1.0, 0.0), (0.0, -1.5), (1.0, 0.0)];
    let points = ring
        .iter()
        .flat_map(|&(x, y)| [DVec3::new(x, y, 0.0), DVec3::new(0.0, 0.0, 2.0)])
        .collect();
    let (u, v) = (
        KnotVector::clamped_uniform(degree(2), 5).unwrap(),
        KnotVector::clamped_uniform(degree(1), 2).unwrap(),
    );
    let cone = BsplineSurface::new(u, v, points, None).unwrap();
    let model = Model::of_surface("cone", cone, LengthUnit::Metre);
    let text = write_step(&model).unwrap();
    assert_eq!(text.matches("=EDGE_CURVE(").count(), 2, "the seam and the base");
    assert_eq!(text.matches("=ORIENTED_EDGE(").count(), 3);
    assert_eq!(text.matches("=VERTEX_POINT(").count(), 2);
    assert_eq!(reread(&model), model);
}

fn any_model() -> impl Strategy<Value = Model> {
    let direction = (1_usize..=6, 0_usize..5, any::<bool>());
    (direction.clone(), direction, any::<bool>(), any::<u64>()).prop_map(
        |(u, v, rational, seed)| {
            let knots = |(d, more, periodic): (usize, usize, bool)| {
                let degree = Degree::new(d).unwrap();
                if periodic {
                    KnotVector::periodic_uniform(degree, d + 1 + more).unwrap()
                } else {
                    KnotVector::clamped_uniform(degree, d + 1 + more).unwrap()
                }
            };
            let (u, v) = (knots(u), knots(v));
            let mut state = seed | 1;
            let mut number = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                let mantissa = (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                mantissa * 10_f64.powi((state % 30) as i32 - 15)
            };
            let count = u.control_count() * v.control_count();
            let points = (0..count).map(|_| DVec3::new(number(), number(), number())).collect();
            let weights = (0..count).map(|_| number().abs() + 1e-9).collect();
            let surface = BsplineSurface::new(u, v, points, rational.then_some(weights)).unwrap();
            Model::of_surface("any", surface, LengthUnit::Inch)
        },
    )
}

proptest! {
    #[test]
    fn any_surface_comes_back_bit_equal(model in any_model()) {
        let mut again = reread(&model);
        // A surface that closes both ways is a solid, which is turned over to have its normal
        // outside.
        let surface = &model.surfaces[0].surface;
        let closed = surface.knots_u().is_periodic() && surface.knots_v().is_periodic();
        if closed && again.surfaces[0].surface != *surface {
            again.surfaces[0].surface = again.surfaces[0].surface.swapped();
        }
        prop_assert_eq!(&again.surfaces, &model.surfaces);
        prop_assert_eq!(&again.unit, &model.unit);
        let text = exchange::write_scene(&model).unwrap();
        prop_assert_eq!(exchange::read_scene(&text).unwrap(), model);
    }
}

#[test]
fn an_unclamped_surface_that_only_closes_is_not_made_periodic() {
    let degree = Degree::new(2).unwrap();
    let knots = KnotVector::new(degree, (0..9).map(f64::from).collect()).unwrap();
    let line = KnotVector::clamped_uniform(Degree::new(1).unwrap(), 2).unwrap();
    let points: Vec<DVec3> =
        (0..12).map(|k| DVec3::new(f64::from(k / 2), f64::from(k % 2), f64::from(k * k))).collect();
    let surface = BsplineSurface::new(knots, line, points, None).unwrap();
    let model = Model::of_surface("open", surface, LengthUnit::Kilometre);
    assert_eq!(reread(&model), model);
}

fn models() -> Option<PathBuf> {
    let folder = std::env::var_os("UMBILIC_MODELS").map(PathBuf::from).filter(|p| p.is_dir());
    if folder.is_none() {
        eprintln!("SKIPPED files_of_other_programs: UMBILIC_MODELS names no folder");
    }
    folder
}

#[test]
fn files_of_other_programs() {
    let Some(folder) = models() else { return };
    let read = |name: &str| read_model(&folder.join(name)).unwrap();
    let bezier = read("bezier-metre.step");
    assert_eq!((bezier.unit, bezier.surfaces.len()), (LengthUnit::Metre, 1));
    assert_eq!(bezier.surfaces[0].surface.point(0.5, 0.5), DVec3::new(1.0, 1.0, 0.5));
    let rational = read("rational-bilinear.step");
    let surface = &rational.surfaces[0].surface;
    assert_eq!(surface.weights(), Some(&[1.0, 2.0, 1.0, 0.5][..]));
    let middle = DVec3::new(3.0, 5.0, 3.0) / 4.5;
    assert!(surface.point(0.5, 0.5).distance(middle) < 1e-15);
}
