//! Free-form geometry in OBJ files.

use exchange::{read_model, read_obj};
use geom_core::{DVec3, assert_close};
use std::f64::consts::PI;
use std::path::Path;

#[test]
fn a_spline_surface_is_read_with_u_first() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/read");
    let model = read_model(&folder.join("freeform-surface.obj")).unwrap();
    assert_eq!((model.surfaces.len(), model.meshes.len()), (1, 0));
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    let surface = &model.surfaces[0].surface;
    assert_eq!(surface.point(1.0, 0.0), DVec3::new(30.0, 0.0, 0.0));
    assert_eq!(surface.control_point(1, 2), DVec3::new(10.0, 20.0, 0.0));
}

/// A square of side 4 in the plane, its parameters its coordinates.
const SQUARE: &str = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 4 4 0\n";

#[test]
fn trims_and_holes_are_planar_curves_by_number() {
    // The hole is a circle of radius 1 about the middle: four rational quadratic arcs.
    let (w, mut text) = (0.5_f64.sqrt(), String::from(SQUARE));
    for (k, (x, y)) in [(3, 2), (3, 3), (2, 3), (1, 3), (1, 2), (1, 1), (2, 1), (3, 1), (3, 2)]
        .into_iter()
        .enumerate()
    {
        text += &format!("vp {x} {y} {}\n", if k % 2 == 0 { 1.0 } else { w });
    }
    text += "vp 0 0\nvp 4 0\nvp 4 4\nvp 0 4\ncstype rat bspline\ndeg 2\ncurv2 1 2 3 4 5 6 7 8 9\n\
             parm u 0 0 0 1 1 2 2 3 3 4 4 4\nend\ncstype bspline\ndeg 1\ncurv2 10 11 12 13 10\n\
             parm u 0 0 1 2 3 4 4\nend\ng roof\ncstype bspline\ndeg 1 1\nsurf 0 4 0 4 1 2 3 4\n\
             parm u 0 0 4 4\nparm v 0 0 4 4\ntrim 0 4 -1\nhole 4 0 1\nend\n";
    let model = read_obj(&text).unwrap();
    let named = &model.surfaces[0];
    assert_eq!((named.name.as_str(), model.meshes.len()), ("roof", 0));
    assert_eq!(named.trim.as_ref().unwrap().loops().len(), 2);
    assert_close(named.curvature_statistics().area, 16.0 - PI, 1e-9);
}

#[test]
fn bezier_pieces_weights_and_ranges() {
    // A quarter of a cylinder of radius 1 and height 2, of which the lower half counts.
    let w = 0.5_f64.sqrt();
    let text = format!(
        "v 1 0 0 1\nv 1 1 0 {w}\nv 0 1 0 1\nv 1 0 2 1\nv 1 1 2 {w}\nv 0 1 2 1\ncstype rat bezier\n\
         deg 2 1\nsurf 0 1 0 0.5 1 2 3 4 5 6\nparm u 0 1\nparm v 0 1\nend\n"
    );
    let area = read_obj(&text).unwrap().surfaces[0].curvature_statistics().area;
    assert_close(area, 0.5 * PI, 1e-12);
}

#[test]
fn curves_become_polylines() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nl 1 2\ng arch\ncstype bspline\ndeg 2\ncurv 0 1 1 2 3\n\
                parm u 0 0 0 1 1 1\nend\n";
    let model = read_obj(text).unwrap();
    assert_eq!(model.warnings, ["1 curves became polylines with 16 pieces per knot span"]);
    let arch = &model.meshes[1];
    assert_eq!((arch.name.as_str(), arch.positions.len()), ("arch", 17));
    assert_eq!(arch.positions[8], DVec3::new(0.75, 0.25, 0.0));
}

#[test]
fn faults_name_the_line_and_other_kinds_are_told() {
    let with = |rest: &str| format!("{SQUARE}cstype bspline\ndeg 1 1\n{rest}");
    let cases = [
        ("surf 0 1 0 1 1 2 3 9\nend\n", "line 7: `9` names none of the 4 before this line"),
        (
            "surf 0 1 0 1 1 2 3 4\nparm u 0 0 1 1\nparm v 0 0 1 1 1\nend\n",
            "line 7: the knots need 2 x 3 vertices, 4 are there",
        ),
        ("surf 0 1 0 1 1 2 3 4\nparm w 0 0 1 1\n", "line 8: parm without u or v"),
        ("surf 0 1 0 1 1 2 3 4\ntrim 0 1 1\n", "line 8: `1` names none of the 0"),
        ("surf 0 nan 0 1 1 2 3 4\n", "line 7: `nan` is not a finite number"),
    ];
    for (text, wanted) in cases {
        let error = read_obj(&with(text)).unwrap_err().to_string();
        assert!(error.starts_with(wanted), "{error}, not {wanted}");
    }
    let other =
        read_obj(&format!("{SQUARE}cstype cardinal\ndeg 3\ncurv 0 1 1 2 3 4\nend\n")).unwrap();
    assert_eq!(other.warnings, ["line 8: free-form `cardinal` geometry is left out"]);
}
