//! From irregular triangles to hyperbolic nets.

use fixtures::saddle_meshes::{self, SaddleMesh};
use geom_core::{PolyMesh, TriMesh};
use hyperbolic_nets::{Input, QuadNet};
use quad_remesh::{Options, Solution, Status, solve};

fn remeshed(mesh: &SaddleMesh, edge: f64) -> Solution {
    let options = Options { edge_length: Some(edge), ..Options::default() };
    solve(&mesh.positions, &mesh.triangles, &options, &mut ()).expect("a net")
}

/// What is asked of a net and of the hyperbolic net it becomes.
struct Bounds {
    /// Largest and mean distance, in edges.
    distance: [f64; 2],
    misalignment_deg: f64,
    /// Shortest and longest edge over the one asked for.
    edges: [f64; 2],
}

const CLEAN: Bounds = Bounds { distance: [0.1, 0.03], misalignment_deg: 2.0, edges: [0.4, 2.5] };
const NOISY: Bounds = Bounds { distance: [0.2, 0.07], misalignment_deg: 6.0, ..CLEAN };

/// Remeshes and solves; `singular` are the valences of irregular inner vertices.
fn check(mesh: &SaddleMesh, clean: &SaddleMesh, edge: f64, singular: &[usize], bounds: &Bounds) {
    let solution = remeshed(mesh, edge);
    let net = &solution.result;
    let inner = net.vertices().filter(|&v| !net.is_boundary_vertex(v));
    let mut valences: Vec<usize> = inner.map(|v| net.valence(v)).filter(|n| *n != 4).collect();
    valences.sort_unstable();
    let reference = TriMesh::new(clean.positions.clone(), clean.triangles.clone()).expect("sound");
    let quads = QuadNet::new(net).expect("two families");
    let input = Input::near_mesh(&quads, &reference);
    let hnet = hyperbolic_nets::solve(&input, &hyperbolic_nets::Options::default(), &mut ());
    let hnet = hnet.expect("near asymptotic");
    let m = &hnet.metrics;
    let [most, mean] = bounds.distance;
    assert_eq!(valences, singular);
    assert_eq!(solution.status, Status::Converged);
    assert!(m.kink_max_deg <= 1e-9 && m.folds == 0, "{m:?}");
    assert!(m.shape_parameter_min >= 0.85 && m.shape_parameter_max <= 1.18, "{m:?}");
    assert!(m.deviation_max_edges <= most, "{m:?}");
    assert!(m.deviation_mean_percent / m.deviation_max_percent * m.deviation_max_edges <= mean);
    assert!(hnet.gates.misalignment.to_degrees() <= bounds.misalignment_deg);
    let r = &solution.metrics;
    let [short, long] = bounds.edges;
    assert!(r.edge_ratio_min >= short && r.edge_ratio_max <= long, "{r:?}");
    assert!(r.angle_min_deg >= 20.0, "{r:?}");
    let area: f64 = (0..reference.triangles().len())
        .map(|t| reference.corners(t))
        .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
        .sum();
    let least = 1.0 - 0.75 * edge * border(&solution.surface) / area;
    assert!(r.covered_share >= least, "{} {least}", r.covered_share);
}

fn border(mesh: &PolyMesh) -> f64 {
    let length = |h| mesh.position(mesh.origin(h)).distance(mesh.position(mesh.target(h)));
    mesh.edges().filter(|&h| mesh.is_boundary_edge(h)).map(length).sum()
}

fn on(mesh: SaddleMesh, edge: f64, singular: &[usize]) {
    check(&mesh, &mesh, edge, singular, &CLEAN);
}

fn noisy(mesh: SaddleMesh, edge: f64, share: f64, singular: &[usize]) {
    let rough = mesh.clone().noisy(share * edge, 1);
    check(&rough, &mesh, edge, singular, &NOISY);
}

#[test]
fn enneper() {
    on(saddle_meshes::enneper(1, 0.85, 4_000), 0.14, &[]);
}

#[test]
fn enneper_of_order_two_has_a_vertex_of_valence_six() {
    on(saddle_meshes::enneper(2, 0.95, 4_000), 0.14, &[6]);
}

#[test]
fn enneper_of_order_three_has_a_vertex_of_valence_eight() {
    on(saddle_meshes::enneper(3, 0.75, 4_000), 0.14, &[8]);
}

#[test]
fn enneper_of_order_five_has_a_vertex_of_valence_twelve() {
    // Lines next to a point of index −2 leave it by the cube root of the square of the way to the
    // border, in edges; lines of equal distance at the border cannot come nearer.
    let bounds = Bounds { edges: [0.4, 3.2], ..CLEAN };
    let mesh = saddle_meshes::enneper(5, 0.7, 4_000);
    check(&mesh, &mesh, 0.14, &[12], &bounds);
}

#[test]
fn ring() {
    on(saddle_meshes::bumped_catenoid(4_000), 0.16, &[]);
}

#[test]
fn torus() {
    on(saddle_meshes::torus_inside(4_000, 0.96), 0.2, &[]);
}

#[test]
fn schwarz_p_disc() {
    on(saddle_meshes::schwarz_p_disc(4_000), 0.4, &[6]);
}

#[test]
fn schwarz_p_cell() {
    on(saddle_meshes::schwarz_p_cells(1, 28), 0.36, &[6; 8]);
}

#[test]
fn tower() {
    on(saddle_meshes::scherk_tower(3, 24), 0.3, &[]);
}

#[test]
fn gyroid_cell() {
    let mesh = saddle_meshes::gyroid_cell(22);
    let solution = remeshed(&mesh, 0.4);
    let m = &solution.metrics;
    assert_eq!((m.euler_characteristic, m.surface_euler_characteristic), (-3, -3), "{m:?}");
    check(&mesh, &mesh, 0.4, &vec![6; m.irregular_vertices], &CLEAN);
}

#[test]
fn eight_cells_have_sixty_four_vertices_of_valence_six() {
    let mesh = saddle_meshes::schwarz_p_cells(2, 18);
    let bounds = Bounds { distance: [0.15, 0.03], ..CLEAN };
    check(&mesh, &mesh, 0.45, &[6; 64], &bounds);
}

#[test]
fn coarse_nets_of_a_cell_are_found_or_shortened() {
    let mesh = saddle_meshes::schwarz_p_cells(1, 20);
    for edge in [0.8, 1.2] {
        let options = Options { edge_length: Some(edge), ..Options::default() };
        match solve(&mesh.positions, &mesh.triangles, &options, &mut ()) {
            Ok(solution) => {
                let m = &solution.metrics;
                assert_eq!(m.odd_valence_vertices, 0);
                assert!(m.edge_length <= 1.001 * edge, "{m:?}");
            }
            Err(error) => assert!(error.to_string().contains("or less"), "{error}"),
        }
    }
}

/// The net of a mesh with this many threads, as bytes.
fn bytes(mesh: &SaddleMesh, edge: f64, threads: usize) -> Vec<u8> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let solution = pool.install(|| remeshed(mesh, edge));
    let numbers = solution.result.positions().iter().flat_map(|p| p.to_array());
    let mut bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
    for f in solution.result.faces() {
        bytes.extend(solution.result.face_vertices(f).flat_map(|v| v.0.to_le_bytes()));
    }
    bytes
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let mesh = saddle_meshes::schwarz_p_cells(1, 20).noisy(0.01, 4);
    let one = bytes(&mesh, 0.36, 1);
    assert!(!one.is_empty() && one == bytes(&mesh, 0.36, 2) && one == bytes(&mesh, 0.36, 7));
}

#[test]
fn noisy_enneper() {
    noisy(saddle_meshes::enneper(1, 0.85, 4_000), 0.14, 0.05, &[]);
}

#[test]
fn noisy_cell() {
    noisy(saddle_meshes::schwarz_p_cells(1, 28), 0.36, 0.05, &[6; 8]);
}
