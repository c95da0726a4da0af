//! `umbilic asymptotic` from the outside: nets of other commands, wishes, joins, strips, refusals.

use crate::common::{message, refused, umbilic};
use std::fs;

/// Runs `asymptotic` and returns its metrics object.
fn metrics(args: &[&str]) -> serde_json::Value {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (out, json) = (path("a.step"), path("a.json"));
    let output = umbilic(&[&["asymptotic"], args, &["-o", &out, "--metrics", &json]].concat());
    assert!(output.status.success(), "{args:?}: {}", message(&output));
    let text = fs::read_to_string(&json).expect("metrics");
    let all: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    all["metrics"].clone()
}

#[test]
fn net_files_of_hnet_are_filled_across_their_inflections() {
    let folder = tempfile::tempdir().expect("a folder");
    let net = folder.path().join("net.ron").display().to_string();
    let output = umbilic(&["hnet", "fixtures/nets/scherk.obj", "-o", &net]);
    assert!(output.status.success(), "{}", message(&output));
    let plain = metrics(&[&net, "--from-net"]);
    assert_eq!(plain["patches"], 144);
    assert!(plain["kink_max_deg"].as_f64().expect("a number") < 1e-8);
    assert_eq!(plain["warnings"], 0);
    // Curves from normals have no choice of energy: said, and refused where both are asked for.
    let out = folder.path().join("a.step").display().to_string();
    let jerk = ["asymptotic", &net, "--from-net", "--boundary-energy", "jerk"];
    let output = umbilic(&[&jerk[..], &["-o", &out]].concat());
    assert!(message(&output).contains("--boundary-energy was not used"), "{}", message(&output));
    refused(&[&jerk[..], &["--curves", "normals"]].concat(), "a.step", &["--boundary-energy"]);
    // Curves from curvatures have no way through the inflections.
    refused(
        &["asymptotic", &net, "--from-net", "--curves", "curvatures"],
        "a.step",
        &["net curve", "inflections"],
    );
}

#[test]
fn meshes_along_other_lines_are_refused() {
    // Curvature lines of a torus, and meshes that are only roughly asymptotic.
    let torus = ["asymptotic", "fixtures/quads/torus.obj", "--from-net"];
    refused(&torus, "a.step", &["do not twist", "use a mesh along asymptotic lines"]);
    let rough = ["asymptotic", "fixtures/nets/enneper.obj", "--from-net"];
    refused(&rough, "a.step", &["net curve", "exactly asymptotic"]);
    // Where curves are found nonetheless, their roughness is warned about.
    let warned = metrics(&["fixtures/nets/scherk.obj", "--from-net"]);
    assert_eq!(warned["warnings"], 1);
}

#[test]
fn gaussian_curvature_at_a_corner_is_a_wish_on_the_command_line_and_in_a_config() {
    let data = "fixtures/asymptotic/catenoid.ron";
    let free = metrics(&[data])["strain_energy"].as_f64().expect("a number");
    let by_flag = metrics(&[data, "--gauss", "00=-0.9"]);
    // K = −τ², so the torsion says the same.
    let tau = 0.9_f64.sqrt();
    let by_torsion = metrics(&[data, "--torsion", &format!("00={tau}")]);
    let energy = |m: &serde_json::Value| m["strain_energy"].as_f64().expect("a number");
    assert!((energy(&by_flag) / energy(&by_torsion) - 1.0).abs() < 1e-12);
    assert!(energy(&by_flag) > free);
    let folder = tempfile::tempdir().expect("a folder");
    let config = folder.path().join("wishes.ron").display().to_string();
    fs::write(&config, "(gauss: [\"00=-0.9\"])").expect("written");
    assert_eq!(metrics(&[data, "--config", &config]), by_flag);
    refused(&["asymptotic", data, "--gauss", "00"], "a.step", &["00", "CORNER=NUMBER"]);
    refused(&["asymptotic", data, "--gauss", "22=-1"], "a.step", &["22"]);
    refused(&["asymptotic", data, "--gauss", "00=0.5"], "a.step", &["00"]);
}

#[test]
fn joins_that_cannot_be_had_are_refused_with_what_to_drop() {
    let net = "fixtures/asymptotic/enneper-grid-2.ron";
    refused(
        &["asymptotic", net, "--joins", "c1", "--interior", "coons"],
        "a.step",
        &["C1 and G2 joins need the tangent module and thin plates"],
    );
    refused(
        &["asymptotic", net, "--joins", "g2", "--degree", "5"],
        "a.step",
        &["degree 5", "6..=15"],
    );
}

/// The strips unroll straight: as long as the curves, with one mark per node.
#[test]
fn lamellas_are_as_long_as_their_curves() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path().display().to_string();
    metrics(&["fixtures/asymptotic/enneper-grid-2.ron", "--lamellas", &dir]);
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect("a file");
    let table = read("lamellas.csv");
    let mut lines = table.lines();
    let head: Vec<&str> = lines.next().expect("a head line").split(',').collect();
    assert!(head.iter().any(|h| h.starts_with("length")), "{head:?}");
    // Three lines in either direction.
    assert_eq!(lines.count(), 6);
    assert!(read("lamellas.svg").contains("<svg") && read("lamellas.dxf").contains("POLYLINE"));
    assert!(read("nodes.csv").lines().count() > 9);
}
