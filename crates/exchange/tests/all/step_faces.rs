//! Faces of STEP files as CAD systems write them: areas in closed form, or as Open CASCADE 7.9
//! measures them (`cargo xtask judges` compares all of them again).

use exchange::{LengthUnit, Model, NamedSurface, read_model, read_step, write_step};
use geom_core::{BoundingBox, DVec3, assert_close};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> Model {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/step");
    read_model(&folder.join(name)).unwrap()
}

fn area(named: &NamedSurface) -> f64 {
    named.curvature_statistics().area
}

fn total(model: &Model) -> f64 {
    model.surfaces.iter().map(area).sum()
}

fn bounds(model: &Model) -> BoundingBox {
    let all = model.surfaces.iter().filter_map(|s| s.curvature_statistics().bounding_box);
    BoundingBox::of(all.flat_map(|b| [b.min, b.max])).unwrap()
}

/// Compares areas without regard to the order of the faces.
#[track_caller]
fn assert_areas(model: &Model, wanted: &[f64], rel_tol: f64) {
    let mut found: Vec<f64> = model.surfaces.iter().map(area).collect();
    let mut wanted = wanted.to_vec();
    found.sort_by(f64::total_cmp);
    wanted.sort_by(f64::total_cmp);
    assert_eq!(found.len(), wanted.len(), "{:?}", model.warnings);
    for (found, wanted) in found.iter().zip(&wanted) {
        assert_close(found / wanted, 1.0, rel_tol);
    }
}

#[test]
fn a_torus_is_exact() {
    let model = fixture("analytic-torus.step");
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    let [torus] = &model.surfaces[..] else { panic!("{} surfaces", model.surfaces.len()) };
    assert!(torus.trim.is_none());
    assert_close(area(torus) / (4.0 * PI * PI * 50.0 * 20.0), 1.0, 1e-12);
    for (u, v) in [(0.3, 1.0), (2.0, 4.5), (5.9, 6.2)] {
        let p = torus.surface.point(u, v);
        assert_close((p.x.hypot(p.y) - 50.0).hypot(p.z), 20.0, 1e-13);
    }
}

#[test]
fn an_extrusion_is_as_long_as_its_vector() {
    let model = fixture("extrusion.step");
    let surface = &model.surfaces[0].surface;
    assert_eq!((surface.n_u(), surface.n_v()), (4, 2));
    assert_eq!(surface.control_point(1, 1), DVec3::new(30.0, 10.0, 2.0));
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
}

#[test]
fn inches_with_a_bare_measure_are_inches() {
    let model = fixture("inch-untyped-measure.step");
    assert_eq!(model.unit, LengthUnit::Inch);
    assert_close(bounds(&model).size().x, 30.0, 1e-12);
    let typed = fixture("two-units.step");
    assert_eq!(typed.unit, LengthUnit::Millimetre);
    assert_eq!(typed.warnings, ["the file mixes units of length (mm, in); all is given in mm"]);
    let sizes: Vec<f64> = typed
        .surfaces
        .iter()
        .map(|s| s.curvature_statistics().bounding_box.unwrap().size().x)
        .collect();
    assert_close(sizes[1] / sizes[0], 25.4, 1e-12);
}

#[test]
fn a_surface_at_a_distance_is_moved_and_its_basis_left_out() {
    let model = fixture("offset-surface-face.step");
    let [moved] = &model.surfaces[..] else { panic!("{} surfaces", model.surfaces.len()) };
    assert_eq!(
        model.warnings,
        ["1 surfaces at a distance are fitted to within 1e-6 of their size"]
    );
    let basis = &fixture("latin1-name.step").surfaces[0].surface;
    let size = 30.0 * 2.0_f64.sqrt();
    for k in 0..=100 {
        let (u, v) = (0.37 * f64::from(k) % 1.0, f64::from(k) / 100.0);
        let jet = basis.jet(u, v, 1);
        let wanted = jet.position() + 5.0 * jet.normal().unwrap();
        assert_close(moved.surface.point(u, v).distance(wanted), 0.0, 2e-6 * size);
    }
}

#[test]
fn a_vertex_loop_is_no_trim() {
    let model = fixture("vertex-loop-sphere.step");
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    assert!(model.surfaces[0].trim.is_none());
    assert_close(total(&model) / (4.0 * PI * 2500.0), 1.0, 1e-9);
}

#[test]
fn raw_latin_1_is_read() {
    assert_eq!(fixture("latin1-name.step").surfaces[0].name, "Dach ü");
}

#[test]
fn a_hole_in_a_spline_is_left_out_of_the_area() {
    for name in ["bicubic-hole.step", "bicubic-hole-bare.step"] {
        let model = fixture(name);
        assert!(model.warnings.is_empty(), "{:?}", model.warnings);
        let trim = model.surfaces[0].trim.as_ref().unwrap();
        assert_eq!(trim.loops().len(), 2, "{name}");
        // Open CASCADE 7.9 measures 798.56220245 of the file with parameter curves.
        assert_close(total(&model) / 798.562_202_45, 1.0, 1e-8);
    }
}

#[test]
fn a_bracket_has_the_faces_that_it_was_made_of() {
    let model = fixture("bracket.step");
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    // A box of 30 x 20 x 10 with a hole of radius 4 and two edges rounded by 2.
    let wanted = [
        144.0,
        548.876_11,
        29.132_741,
        299.141_593,
        60.548_668,
        280.0,
        200.0,
        251.327_412,
        509.734_518,
    ];
    assert_areas(&model, &wanted, 1e-6);
    let (bounds, size) = (bounds(&model), DVec3::new(30.0, 20.0, 10.0));
    assert_close(bounds.min.length() + bounds.max.distance(size), 0.0, 1e-9);
    let volume: f64 = model
        .surfaces
        .iter()
        .map(|s| s.surface.cone_volume(s.trim.as_ref(), DVec3::new(1.0, 2.0, 3.0)))
        .sum();
    assert_close(volume / 5_472.359_917_73, 1.0, 1e-7);
}

#[test]
fn parts_stand_where_the_assembly_puts_them_in_one_unit() {
    let model = fixture("assembly.step");
    assert_eq!(model.unit, LengthUnit::Inch);
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    assert_eq!(model.surfaces.len(), 24);
    assert_close(total(&model) * 25.4 * 25.4 / 5_493.752_1, 1.0, 1e-6);
    let bounds = bounds(&model);
    let (min, max) = (25.4 * bounds.min, 25.4 * bounds.max);
    assert_close(min.distance(DVec3::new(-41.811_78, -5.0, -16.665_921)), 0.0, 1e-5);
    assert_close(max.distance(DVec3::new(133.379_518, 26.175_789, 22.0)), 0.0, 1e-5);
}

#[test]
fn sweeps_and_cut_solids_have_their_areas() {
    let model = fixture("sweeps-bare.step");
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    // Open CASCADE measures 1601.67 for the sphere, more than the whole has, and 599.109 for the
    // extrusion. A sphere of radius 10 without x > 3, y > -5: 400 π − 10 ∫ α(x) dx over 3 < x < 10
    // with α = 2 acos(−5 / √(100 − x²)), at most 2 π. The extrusion: the length of its profile seen
    // along the vector, times that.
    const SPHERE: f64 = 911.606_375_4;
    let wanted = [
        552.697_846,
        28.274_334,
        28.274_334,
        SPHERE,
        66.906_989,
        233.768_069,
        1_338.496_993,
        458.115_907,
        201.061_93,
        201.061_93,
        958.078_861,
        598.192_853,
    ];
    assert_areas(&model, &wanted, 1e-6);
}

fn models(test: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("UMBILIC_MODELS").map(PathBuf::from).filter(|p| p.is_dir());
    if folder.is_none() {
        eprintln!("SKIPPED {test}: UMBILIC_MODELS names no folder");
    }
    folder
}

#[test]
fn files_of_other_programs_have_all_their_faces() {
    let Some(folder) = models("files_of_other_programs_have_all_their_faces") else { return };
    let read = |name: &str| read_model(&folder.join(name)).unwrap();
    let part = read("abc-0000.step");
    assert_eq!((part.surfaces.len(), &part.unit), (25, &LengthUnit::Metre), "{:?}", part.warnings);
    assert!(part.surfaces.iter().all(|s| s.color.is_some()));
    // In mm², where the part is in metres. Open CASCADE is 4e-6 off for the third sphere with a
    // circular hole; the areas of all four are 2 π R (R + h) with h the height of the circle.
    let wanted = [
        1617.391508,
        1023.669011,
        406.860769,
        9879.170117,
        8760.378319,
        22525.073962,
        1251.9825857,
        3260.414093,
        6116.993521,
        2115.095484,
        43376.155143,
        2528.368511,
        8871.315855,
        15711.857236,
        38576.324118,
        1901.433606,
        41569.382568,
        14839.668289,
        8441.782893,
        37146.484047,
        4230.190968,
        53469.9706,
        32429.278662,
        27072.720332,
        17742.631711,
    ];
    assert_areas(&part, &wanted.map(|a| a * 1e-6), 1e-6);
    let rods = read("linkrods.step");
    assert_eq!(rods.surfaces.len(), 37, "{:?}", rods.warnings);
    assert_close(total(&rods) / 32.151_431_79, 1.0, 1e-5);
    let torus = read("occt-torus.step");
    assert_close(area(&torus.surfaces[0]) / (4.0 * PI * PI * 20.0), 1.0, 1e-12);
}

/// What is written is read again as it was: surfaces, trims, colours, names.
#[track_caller]
fn assert_written_again(model: &Model) {
    let text = write_step(model).unwrap();
    let again = read_step(text.as_bytes()).unwrap();
    assert_eq!(again.surfaces.len(), model.surfaces.len(), "{:?}", again.warnings);
    assert_eq!(again.warnings, Vec::<String>::new());
    for (a, b) in again.surfaces.iter().zip(&model.surfaces) {
        assert_eq!((&a.name, a.color), (&b.name, b.color));
        assert_eq!(a.surface, b.surface);
        assert_eq!(a.trim.is_some(), b.trim.is_some());
        assert_close(area(a) / area(b), 1.0, 1e-8);
    }
    // Written a second time, nothing moves any more.
    let third = write_step(&again).unwrap();
    let differs = third.lines().zip(text.lines()).find(|(a, b)| a != b);
    assert_eq!(differs, None);
}

#[test]
fn trimmed_solids_come_back() {
    for name in ["bracket.step", "bicubic-hole.step", "bicubic-hole-bare.step"] {
        assert_written_again(&Model { warnings: Vec::new(), ..fixture(name) });
    }
}

#[test]
fn a_solid_is_written_as_one() {
    let text = write_step(&fixture("bracket.step")).unwrap();
    assert_eq!(text.matches("=MANIFOLD_SOLID_BREP(").count(), 1);
    assert_eq!(text.matches("=CLOSED_SHELL(").count(), 1);
    assert_eq!(text.matches("=EDGE_CURVE(").count(), 20);
    assert_eq!(text.matches("=OPEN_SHELL(").count(), 0);
}
