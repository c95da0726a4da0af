//! `umbilic hnet` and `umbilic darboux` from the outside: files, exit codes, messages.

use crate::common::{refused, umbilic, write_into};
use std::fs;

/// `n` × `n` quads over the saddle `z = x y`, whose asymptotic lines are the grid.
fn saddle(n: usize) -> String {
    let mut text = String::new();
    for i in 0..=n {
        for j in 0..=n {
            let (x, y) = (i as f64 / n as f64, j as f64 / n as f64);
            text += &format!("v {x} {y} {}\n", x * y);
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j + 1;
            text += &format!("f {} {} {} {}\n", a, a + n + 1, a + n + 2, a + 1);
        }
    }
    text
}

#[test]
fn a_net_is_written_in_every_format_and_read_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let names = ["a.ron", "a.step", "a.obj", "a.glb", "a.csv", "a.dxf", "a.ply", "a.stl"];
    let outs = names.map(path);
    let json = path("a.json");
    let mut args = vec!["hnet", "fixtures/nets/helicoid.obj", "--metrics", &json];
    for out in &outs {
        args.extend(["-o", out]);
    }
    let result = umbilic(&args);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    for out in &outs {
        assert!(fs::metadata(out).expect("a file").len() > 0, "{out}");
    }
    // Nine wire positions in two families on each of 84 panels, and a head line.
    let table = fs::read_to_string(&outs[4]).expect("a table");
    assert_eq!(table.lines().count(), 84 * 2 * 9 + 1);
    let step = fs::read_to_string(&outs[1]).expect("a STEP file");
    assert!(step.contains("RATIONAL_B_SPLINE_SURFACE"));

    let (image, page) = (path("image.glb"), path("image.html"));
    let args =
        ["darboux", &outs[0], "--c", "-0.6", "-o", &image, "--report", &page, "--metrics", &json];
    let result = umbilic(&args);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let text = fs::read_to_string(&json).expect("metrics");
    let all: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(all["command"], "darboux");
    assert_eq!(all["metrics"]["faces"], 84);
    assert!(all["metrics"]["kink_max_deg"].as_f64().expect("a number") < 1e-6);
}

#[test]
fn nets_that_cannot_be_skinned_are_refused_with_a_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| write_into(&folder, name, text);
    let saddle = saddle(4);
    let split = saddle.replace("f 1 6 7 2\n", "f 1 6 7\nf 1 7 2\n");
    let keep = "--input-edges=keep";
    refused(&["hnet", &write("t.obj", &split), keep], "a.ron", &["3 corners", "remesh"]);
    // Three quads around a vertex.
    let odd = "v 0 0 0\nv 1 0 .1\nv 1 1 -.1\nv 0 1 .1\nv -1 1 -.1\nv -1 0 .1\nv 0 -1 0\n\
               f 1 2 3 4\nf 1 4 5 6\nf 1 6 7 2\n";
    refused(&["hnet", &write("o.obj", odd), keep], "a.ron", &["valence"]);
    let flat: String = saddle
        .lines()
        .map(|l| if l.starts_with('v') { l.rsplit_once(' ').map_or(l, |p| p.0).to_owned() + " 0" } else { l.to_owned() } + "\n")
        .collect();
    refused(&["hnet", &write("f.obj", &flat)], "a.ron", &["curv"]);
    refused(&["hnet", "fixtures/nets/absent.obj"], "a.ron", &["absent.obj"]);
    refused(&["hnet", "fixtures/nets/scherk.obj"], "a.iges", &["iges", "step"]);
    let config = write("c.ron", "(fairness: Some(-1.0))");
    refused(
        &["hnet", "fixtures/nets/scherk.obj", "--config", &config],
        "a.ron",
        &["fairness", "positive"],
    );
}

#[test]
fn transformations_that_do_not_exist_are_refused() {
    let net = "fixtures/nets/enneper.obj";
    refused(&["darboux", net, "--c", "1"], "a.glb", &["c = 1", "different from 1"]);
    refused(&["darboux", net, "--c", "nan"], "a.glb", &["finite"]);
    refused(&["darboux", net], "a.glb", &["--c", "--corner", "--cage"]);
    refused(&["darboux", net, "--corner", "9=0,0,0"], "a.glb", &["i=x,y,z"]);
    refused(&["darboux", net, "--corner", "7=2,2,1"], "a.glb", &["corners", "box"]);
    refused(&["darboux", net, "--c", "0.5"], "a.step", &["step", "glb", "ply"]);
    // Points far from the middle have no real image.
    refused(&["darboux", net, "--c", "1.2"], "a.glb", &["real domain"]);
}
