//! What holds whatever the input: moved, scaled, mirrored, renumbered, swapped.

use crate::common::{catenoid, corner_data, enneper, exact_net};
use asymptotic_bezier::{
    AsymptoticNet, CornerData, Curvatures, Error, Joins, NetCurve, Options, Solution, Wish, solve,
};
use geom_core::{DMat3, DVec3};
use gp_solver::OptionValue;
use proptest::prelude::*;

fn solved(input: impl Into<asymptotic_bezier::Input>, options: &Options) -> Solution {
    solve(&input.into(), options, &mut ()).unwrap()
}

fn quads(net: &AsymptoticNet) -> Vec<[usize; 4]> {
    net.faces().iter().map(|f| [0, 1, 3, 2].map(|c| net.face_corner(f, c))).collect()
}

/// A window of a surface that is neither flat nor near its singular points.
fn window() -> impl Strategy<Value = [f64; 4]> {
    (0.2..0.6_f64, 0.4..0.8_f64, -0.5..-0.1_f64, 0.4..0.8_f64)
        .prop_map(|(p, w, q, h)| [p, p + w, q, q + h])
}

fn corner_window() -> impl Strategy<Value = CornerData> {
    let data = (window(), any::<bool>()).prop_map(|(window, which)| match which {
        true => corner_data(catenoid, window),
        false => corner_data(enneper, window),
    });
    data.prop_filter("no side inflects", |data| is_uninflected(data.clone()))
}

/// Whether no curve has an inflection, which data would have to declare.
fn is_uninflected(input: impl Into<asymptotic_bezier::Input>) -> bool {
    let solved = solve(&input.into(), &Options::default(), &mut ());
    !matches!(solved, Err(Error::InflectionParity { .. }))
}

fn scaled(data: &CornerData, map: impl Fn(DVec3) -> DVec3, scale: f64) -> CornerData {
    let mut out = data.map_points(map);
    if let Curvatures::Signed(k) = &mut out.curvatures {
        k.iter_mut().flatten().for_each(|k| *k /= scale);
    }
    out
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn energies_follow_the_scale_and_measures_do_not(data in corner_window(), log in -2.0..2.0_f64) {
        let scale = 10.0_f64.powf(log);
        let (a, b) = (
            solved(data.clone(), &Options::default()).metrics,
            solved(scaled(&data, |p| p * scale, scale), &Options::default()).metrics,
        );
        prop_assert!((b.strain_energy / (a.strain_energy * scale * scale) - 1.0).abs() < 1e-9);
        prop_assert!((b.thin_plate_energy / (a.thin_plate_energy * scale * scale) - 1.0).abs() < 1e-8);
        prop_assert!((a.min_sine - b.min_sine).abs() < 1e-8);
    }

    #[test]
    fn mirrored_data_give_the_mirror_image(data in corner_window()) {
        let mirror = |p: DVec3| DVec3::new(p.x, p.y, -p.z);
        let (a, b) = (
            solved(data.clone(), &Options::default()),
            solved(data.map_points(mirror), &Options::default()),
        );
        // The normals turn over, and the torsions with them.
        for (s, t) in a.result.boundary.torsions.iter().zip(&b.result.boundary.torsions) {
            prop_assert!((s + t).abs() < 1e-9);
        }
        for (p, q) in a.result.patches[0].patch.points().iter().zip(b.result.patches[0].patch.points()) {
            prop_assert!((mirror(*p) - *q).length() < 1e-9);
        }
    }

    #[test]
    fn swapped_parameters_give_the_same_surface(data in corner_window()) {
        let (a, b) = (
            solved(data.clone(), &Options::default()),
            solved(data.swapped(), &Options::default()),
        );
        let (p, q) = (&a.result.patches[0].patch, &b.result.patches[0].patch);
        for i in 0..=p.degree() {
            for j in 0..=p.degree() {
                prop_assert!((p.point(i, j) - q.point(j, i)).length() < 1e-9);
            }
        }
    }

    #[test]
    fn boundaries_are_asymptotic_with_the_curvature_of_beltrami_and_enneper(data in corner_window()) {
        let m = solved(data, &Options::default()).metrics;
        prop_assert!(m.normal_curvature_max < 1e-9, "{m:?}");
        prop_assert!(m.torsion_defect_max < 1e-6, "{m:?}");
        prop_assert!(m.patches == 1 && m.kink_max_deg == 0.0);
    }

    #[test]
    fn wished_torsions_are_met(data in corner_window(), share in 0.8..1.2_f64) {
        let free = solved(data.clone(), &Options::default()).result.boundary.torsions;
        let wish = share * free[0];
        let torsion = vec![Wish { corner: "00".into(), min: wish, max: wish }].into();
        let met = solved(data, &Options { torsion, ..Options::default() });
        prop_assert_eq!(met.result.boundary.torsions[0], wish);
        let curve = &met.result.boundary.curves[0];
        prop_assert!((curve.jet(0.0).torsion() - wish).abs() < 1e-8 * wish.abs());
    }

    #[test]
    fn the_free_torsions_have_the_least_energy(data in corner_window(), share in 0.7..1.3_f64) {
        let free = solved(data.clone(), &Options::default());
        let wish = share * free.result.boundary.torsions[2];
        let torsion = vec![Wish { corner: "01".into(), min: wish, max: wish }].into();
        let forced = solved(data, &Options { torsion, ..Options::default() });
        let (least, other) = (free.metrics.strain_energy, forced.metrics.strain_energy);
        prop_assert!(other >= least * (1.0 - 1e-12), "{least} {other}");
    }

    #[test]
    fn renumbered_vertices_give_the_same_shell(window in window(), shift in 1_usize..8) {
        let net = exact_net(catenoid, window, [2, 2]);
        prop_assume!(is_uninflected(net.clone()));
        let n = net.positions().len();
        let to = |v: usize| (v + shift) % n;
        let mut positions = vec![DVec3::ZERO; n];
        net.positions().iter().enumerate().for_each(|(v, p)| positions[to(v)] = *p);
        let curves = net.curves().iter().map(|c| NetCurve { ends: c.ends.map(to), ..*c }).collect();
        let faces: Vec<[usize; 4]> = quads(&net).iter().map(|q| q.map(to)).collect();
        let other = AsymptoticNet::new(positions, &faces, curves).unwrap();
        let options = Options { joins: Joins::C1, ..Options::default() };
        let (a, b) = (solved(net, &options), solved(other, &options));
        for (p, q) in a.result.patches.iter().zip(&b.result.patches) {
            for (p, q) in p.patch.points().iter().zip(q.patch.points()) {
                prop_assert!((*p - *q).length() < 1e-8);
            }
        }
    }

    #[test]
    fn joins_follow_motions(
        window in window(),
        angles in prop::array::uniform3(-3.0..3.0_f64),
        shift in prop::array::uniform3(-2.0..2.0_f64),
    ) {
        let net = exact_net(enneper, window, [2, 2]);
        prop_assume!(is_uninflected(net.clone()));
        let turn = DMat3::from_rotation_x(angles[0]) * DMat3::from_rotation_y(angles[1])
            * DMat3::from_rotation_z(angles[2]);
        let map = |p: DVec3| turn * p + DVec3::from_array(shift);
        let curves = net.curves().iter().map(|c| NetCurve { arms: c.arms.map(|a| turn * a), ..*c });
        let positions = net.positions().iter().map(|p| map(*p)).collect();
        let moved = AsymptoticNet::new(positions, &quads(&net), curves.collect()).unwrap();
        let options = Options { joins: Joins::G2, ..Options::default() };
        let (a, b) = (solved(net, &options), solved(moved, &options));
        for (p, q) in a.result.patches.iter().zip(&b.result.patches) {
            for (p, q) in p.patch.points().iter().zip(q.patch.points()) {
                prop_assert!((map(*p) - *q).length() < 1e-7);
            }
        }
    }

    #[test]
    fn joins_cost_energy_and_never_kink(window in window()) {
        let net = exact_net(catenoid, window, [2, 2]);
        prop_assume!(is_uninflected(net.clone()));
        let by = |joins| solved(net.clone(), &Options { joins, degree: Some(7), ..Options::default() });
        let (g1, c1) = (by(Joins::G1).metrics, by(Joins::C1).metrics);
        prop_assert!(c1.thin_plate_energy >= g1.thin_plate_energy * (1.0 - 1e-9));
        prop_assert!(g1.kink_max_deg < 1e-7 && c1.kink_max_deg < 1e-7);
        prop_assert_eq!(c1.continuous_joins, 4);
    }

    #[test]
    fn wishes_print_what_they_read(corner in 0_usize..100, min in -9.0..9.0_f64, width in 0.0..3.0_f64) {
        let wish = Wish { corner: corner.to_string(), min, max: min + width };
        prop_assert_eq!(Wish::read(&wish.print().unwrap()), Ok(wish));
    }

    #[test]
    fn what_is_not_finite_is_refused_not_computed(data in corner_window(), which in 0_usize..12) {
        let mut data = data;
        let points = [&mut data.corners, &mut data.start_points, &mut data.end_points];
        points.into_iter().flatten().nth(which).unwrap().y = f64::NAN;
        let error = solve(&data.into(), &Options::default(), &mut ()).unwrap_err();
        prop_assert!(matches!(error, Error::NotFinite { .. }), "{error}");
    }
}
