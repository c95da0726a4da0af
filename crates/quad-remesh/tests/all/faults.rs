//! Faulty inputs are mended or refused with what to do.

use fixtures::saddle_meshes;
use geom_core::DVec3;
use quad_remesh::{Error, Options, Solution, Warning, solve};

type Mesh = (Vec<DVec3>, Vec<[u32; 3]>);

/// A saddle of `n × n` cells over the unit square about the origin.
fn saddle(n: u32) -> Mesh {
    graph(n, |x, y| x * x - y * y)
}

fn graph(n: u32, height: impl Fn(f64, f64) -> f64) -> Mesh {
    let at = |k: u32| f64::from(k) / f64::from(n) - 0.5;
    let points = (0..(n + 1) * (n + 1)).map(|k| (at(k / (n + 1)), at(k % (n + 1))));
    let points = points.map(|(x, y)| DVec3::new(x, y, height(x, y))).collect();
    let cells = (0..n * n).map(|k| (n + 1) * (k / n) + k % n);
    (points, cells.flat_map(|a| [[a, a + n + 1, a + n + 2], [a, a + n + 2, a + 1]]).collect())
}

fn remeshed((points, faces): &Mesh) -> Result<Solution, Error> {
    let options = Options { edge_length: Some(0.12), ..Options::default() };
    solve(points, faces, &options, &mut ())
}

/// The net of the sound saddle.
fn sound() -> Solution {
    remeshed(&saddle(24)).expect("a net")
}

fn is_as_sound(solution: &Solution) {
    let (got, want) = (&solution.metrics, &sound().metrics);
    assert_eq!((got.faces, got.vertices), (want.faces, want.vertices));
}

#[test]
fn triangles_that_share_no_vertices_are_welded() {
    let (points, faces) = saddle(24);
    let loose: Vec<DVec3> = faces
        .iter()
        .flatten()
        .enumerate()
        .map(|(k, &v)| points[v as usize] + DVec3::splat(1e-11 * (k % 3) as f64))
        .collect();
    let faces = (0..faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let solution = remeshed(&(loose, faces)).unwrap();
    assert_eq!(solution.warnings, []);
    is_as_sound(&solution);
}

#[test]
fn faces_are_turned_alike() {
    let (points, mut faces) = saddle(24);
    faces.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    let turned = faces.len().div_ceil(3);
    let solution = remeshed(&(points, faces)).unwrap();
    assert_eq!(solution.warnings, [Warning::Turned { faces: turned }]);
    assert!(solution.warnings[0].to_string().contains("turned over"));
    is_as_sound(&solution);
}

#[test]
fn faces_without_area_and_repeated_ones_are_dropped() {
    let (points, mut faces) = saddle(24);
    faces.extend([[0, 0, 1], [0, 1, 2], faces[7], faces[9]]);
    let solution = remeshed(&(points, faces)).unwrap();
    // The corners 0, 1 and 2 are on a line in the plan but not on the saddle.
    let kinds = &solution.warnings;
    assert!(kinds.contains(&Warning::Dropped { faces: 1 }), "{kinds:?}");
    assert!(kinds.contains(&Warning::Repeated { faces: 2 }), "{kinds:?}");
}

#[test]
fn a_fin_is_cut_off() {
    let (mut points, mut faces) = saddle(24);
    // Three faces on one edge.
    let [a, b, _] = faces[500];
    points.push(DVec3::new(0.0, 0.0, 0.2));
    faces.push([b, a, points.len() as u32 - 1]);
    let solution = remeshed(&(points, faces)).unwrap();
    let kinds = &solution.warnings;
    assert!(kinds.iter().any(|w| matches!(w, Warning::Split { .. })), "{kinds:?}");
    assert!(kinds.iter().any(|w| matches!(w, Warning::Parts { .. })), "{kinds:?}");
}

#[test]
fn parts_that_touch_at_a_vertex_are_parted_and_the_largest_stays() {
    let (mut points, mut faces) = saddle(24);
    let far = points.len() as u32;
    points.extend([DVec3::new(-0.6, -0.5, 0.0), DVec3::new(-0.5, -0.6, 0.1)]);
    faces.push([0, far, far + 1]);
    let solution = remeshed(&(points, faces)).unwrap();
    assert_eq!(solution.warnings, [Warning::Split { vertices: 1 }, Warning::Parts { parts: 2 }]);
    is_as_sound(&solution);
}

#[test]
fn polygons_are_cut_into_triangles() {
    let (points, _) = saddle(24);
    let cells = (0..576_u32).map(|k| 25 * (k / 24) + k % 24);
    let quads: Vec<[u32; 4]> = cells.map(|a| [a, a + 25, a + 26, a + 1]).collect();
    let options = Options { edge_length: Some(0.12), ..Options::default() };
    let solution = solve(&points, &quads, &options, &mut ()).unwrap();
    let (got, want) = (solution.metrics.faces as f64, sound().metrics.faces as f64);
    assert!((got - want).abs() < 0.1 * want, "{got} {want}");
}

#[test]
fn a_strip_with_one_side_is_refused() {
    let n = 60_u32;
    let point = |k: u32, s: f64| {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(n);
        let (out, up) = ((angle / 2.0).cos() * s, (angle / 2.0).sin() * s);
        DVec3::new((1.0 + out) * angle.cos(), (1.0 + out) * angle.sin(), up)
    };
    let across = |j: u32| 0.4 * (f64::from(j) / 4.0 - 0.5);
    let points: Vec<DVec3> = (0..n * 5).map(|k| point(k / 5, across(k % 5))).collect();
    let id = |i: u32, j: u32| if i < n { 5 * i + j } else { 4 - j };
    let mut faces = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..4).map(move |j| (i, j))) {
        let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
        faces.extend([[a, b, c], [a, c, d]]);
    }
    let error = remeshed(&(points, faces)).unwrap_err();
    assert!(matches!(error, Error::OneSided { .. }), "{error:?}");
    assert!(error.to_string().ends_with("cut it along a mesh line first"));
}

#[test]
fn what_has_no_asymptotic_lines_is_refused_with_its_share() {
    let bowl = graph(24, |x, y| 0.4 * (x * x + y * y));
    let error = remeshed(&bowl).unwrap_err();
    assert!(matches!(error, Error::NotNegativelyCurved { percent, .. } if percent < 1.0));
    let dented = saddle_meshes::dented_saddle(4_000);
    let options = Options { edge_length: Some(0.12), ..Options::default() };
    let solution = solve(&dented.positions, &dented.triangles, &options, &mut ()).unwrap();
    let metrics = &solution.metrics;
    assert!(metrics.negative_share > 0.9 && metrics.negative_share < 0.999, "{metrics:?}");
    assert_eq!((metrics.irregular_vertices, metrics.singular_points), (0, 0));
}

#[test]
fn long_thin_triangles_do_no_harm() {
    // Fifty times as long as wide.
    let (n, m) = (8_u32, 400_u32);
    let at = |k: u32, n: u32| f64::from(k) / f64::from(n) - 0.5;
    let points: Vec<DVec3> = (0..(n + 1) * (m + 1))
        .map(|k| (at(k / (m + 1), n), at(k % (m + 1), m)))
        .map(|(x, y)| DVec3::new(x, y, x * x - y * y))
        .collect();
    let cells = (0..n * m).map(|k| (m + 1) * (k / m) + k % m);
    let faces: Vec<[u32; 3]> =
        cells.flat_map(|a| [[a, a + m + 1, a + m + 2], [a, a + m + 2, a + 1]]).collect();
    let solution = remeshed(&(points, faces)).unwrap();
    assert_eq!(solution.metrics.irregular_vertices, 0);
    assert!(solution.metrics.asymptotic_deviation_mean_deg < 2.0, "{:?}", solution.metrics);
}

#[test]
fn a_number_of_faces_is_met() {
    let mesh = saddle_meshes::enneper(2, 0.95, 3_000);
    for faces in [150, 400] {
        let options = Options { faces: Some(faces), ..Options::default() };
        let solution = solve(&mesh.positions, &mesh.triangles, &options, &mut ()).unwrap();
        let off = (solution.metrics.faces as f64 / faces as f64 - 1.0).abs();
        assert!(off <= 0.1, "{} {faces}", solution.metrics.faces);
    }
}

#[test]
fn the_net_goes_with_the_model_wherever_it_stands() {
    let (points, faces) = saddle(24);
    let base = sound();
    let options = Options { edge_length: Some(0.12 * 1024.0), ..Options::default() };
    let moved: Vec<DVec3> =
        points.iter().map(|p| *p * 1024.0 + DVec3::new(1e6, -2e6, 3e5)).collect();
    let solution = solve(&moved, &faces, &options, &mut ()).unwrap();
    assert_eq!(solution.metrics.faces, base.metrics.faces);
    let (mean, same) = (solution.metrics.edge_length_mean, base.metrics.edge_length_mean);
    assert!((mean / 1024.0 / same - 1.0).abs() < 1e-6, "{mean} {same}");
}

#[test]
fn nonsense_is_refused() {
    let (mut points, faces) = saddle(12);
    let bad = |options: Options| {
        solve(&saddle(12).0, &saddle(12).1, &options, &mut ()).unwrap_err().to_string()
    };
    let length = Options { edge_length: Some(-1.0), ..Options::default() };
    assert!(bad(length).contains("`edge_length` is -1; it must be positive"));
    assert!(bad(Options { faces: Some(0), ..Options::default() }).contains("`faces` is 0"));
    assert!(bad(Options { min_angle: 90.0, ..Options::default() }).contains("`min_angle` is 90"));
    let huge = Options { edge_length: Some(5.0), ..Options::default() };
    assert!(bad(huge).contains("no cell of a net with edges of 5.0000 fits"));
    assert!(matches!(
        solve(&points, &[[0_u32, 1, 999]], &Options::default(), &mut ()),
        Err(Error::NoSuchVertex { vertex: 999, count: 169 })
    ));
    assert!(matches!(
        solve(&points, &[[0_u32, 0, 1]], &Options::default(), &mut ()),
        Err(Error::NoFace)
    ));
    points[3].y = f64::NAN;
    assert!(matches!(
        solve(&points, &faces, &Options::default(), &mut ()),
        Err(Error::NotFinite { vertex: 3 })
    ));
}
