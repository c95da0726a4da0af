//! Rigid motion, scale, role swap, reversal.

use crate::common;
use crate::common::reference_set;
use asymptotic_bezier::{
    BoundaryOptions, CornerData, Curvatures, Patch, PatchOptions, Place, Quadrilateral, fill_patch,
    solve_quadrilateral,
};
use geom_core::{DMat3, DVec3};
use proptest::prelude::*;

fn solved(data: &CornerData) -> (Quadrilateral, Patch) {
    let quad = solve_quadrilateral(data, &BoundaryOptions::default()).unwrap();
    let filled = fill_patch(&quad.boundary, &PatchOptions::default(), Place::Patch(0)).unwrap();
    (quad, filled.patch)
}

fn largest(a: &Patch, b: impl Fn(usize, usize) -> DVec3) -> f64 {
    let n = a.degree();
    let all = (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j)));
    all.map(|(i, j)| (a.point(i, j) - b(i, j)).length()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn control_points_follow_motions_and_scales(
        angles in prop::array::uniform3(-3.0..3.0_f64),
        shift in prop::array::uniform3(-2.0..2.0_f64),
        log_scale in -3.0..3.0_f64,
        set in 0..3_usize,
    ) {
        let data = reference_set(["A", "B", "C"][set]).data;
        let scale = 10.0_f64.powf(log_scale);
        let rotation = DMat3::from_rotation_x(angles[0]) * DMat3::from_rotation_y(angles[1]) * DMat3::from_rotation_z(angles[2]);
        let map = |p: DVec3| (rotation * p + DVec3::from_array(shift)) * scale;
        let mut moved = data.map_points(map);
        if let Curvatures::Signed(k) = &mut moved.curvatures {
            k.iter_mut().flatten().for_each(|k| *k /= scale);
        }
        let (quad, patch) = solved(&data);
        let (moved_quad, moved_patch) = solved(&moved);
        let error = largest(&moved_patch, |i, j| map(patch.point(i, j))) / scale;
        prop_assert!(error < 1e-10, "{error:e}");
        for (a, b) in quad.torsions.iter().zip(moved_quad.torsions) {
            prop_assert!((a - b * scale).abs() < 1e-10);
        }
    }
}

#[test]
fn swapped_roles_and_reversed_parameters_give_the_same_surface() {
    for name in ["A", "B", "C", "G"] {
        let data = reference_set(name).data;
        let (quad, patch) = solved(&data);
        let n = patch.degree();
        let (swapped_quad, swapped) = solved(&data.swapped());
        let error = largest(&swapped, |i, j| patch.point(j, i));
        assert!(error < 1e-10, "{name} swapped: {error:e}");
        // Torsion is a property of the curves; the families have exchanged their names.
        assert!((swapped_quad.torsions[1] + quad.torsions[2]).abs() < 1e-10);
        let (_, reversed) = solved(&data.reversed_u());
        let error = largest(&reversed, |i, j| patch.point(n - i, j));
        assert!(error < 1e-10, "{name} reversed: {error:e}");
    }
}

/// A net moved rigidly and scaled, with joins of all kinds.
#[test]
fn joined_patches_follow_motions_and_scales() {
    use asymptotic_bezier::{AsymptoticNet, GridshellOptions, Joins, NetCurve, fill_net};
    let net = common::exact_net(common::catenoid, [0.2, 1.4, -0.1, 0.9], [2, 2]);
    let turn = DMat3::from_rotation_x(0.4) * DMat3::from_rotation_z(1.1);
    let (shift, scale) = (DVec3::new(0.3, -1.2, 0.7), 37.0);
    let map = |p: DVec3| (turn * p + shift) * scale;
    let curves = net.curves().iter().map(|c| NetCurve {
        arms: c.arms.map(|a| turn * a * scale),
        curvatures: c.curvatures.map(|k| k / scale),
        ..*c
    });
    let quads: Vec<[usize; 4]> =
        net.faces().iter().map(|f| [0, 1, 3, 2].map(|c| net.face_corner(f, c))).collect();
    let positions = net.positions().iter().map(|p| map(*p)).collect();
    let moved = AsymptoticNet::new(positions, &quads, curves.collect()).unwrap();
    for joins in [Joins::G1, Joins::C1, Joins::G2] {
        let options = GridshellOptions { joins, ..Default::default() };
        let (here, there) =
            (fill_net(&net, &options).unwrap(), fill_net(&moved, &options).unwrap());
        for (a, b) in here.patches.iter().zip(&there.patches) {
            let error = largest(&b.patch, |i, j| map(a.patch.point(i, j))) / scale;
            assert!(error < 1e-10, "{joins:?}: {error:e}");
        }
    }
}
