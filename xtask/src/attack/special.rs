//! Files built to hurt, and files that are no files.

use super::lab::Lab;
use crate::shell::Outcome;
use std::fs;

/// Formats and what is written to a file of each.
fn built() -> Vec<(&'static str, Vec<u8>)> {
    let nested = |open: &str, count: usize| open.repeat(count).into_bytes();
    let mut fan = String::from("v 0 0 0\n");
    for k in 0..3000 {
        let angle = f64::from(k) * 0.002;
        fan += &format!("v {} {} 0\n", angle.cos(), angle.sin());
    }
    let mut gon = fan.clone() + "f";
    (2..3000).for_each(|k| gon += &format!(" {k}"));
    (2..2999).for_each(|k| fan += &format!("f 1 {k} {}\n", k + 1));
    let far = "v 1e300 0 0\nv -1e300 0 0\nv 0 1e300 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n";
    let point = "v 1 1 1\nv 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3 4\n";
    vec![
        ("ron", nested("(", 100_000)),
        ("ron", nested("[", 100_000)),
        ("json", nested("[", 100_000)),
        ("json", nested("{\"a\":", 50_000)),
        ("step", b"ISO-10303-21;\nDATA;\n".repeat(1000)),
        ("step", [b"ISO-10303-21;\nDATA;\n#1=A(".to_vec(), nested("(", 100_000)].concat()),
        (
            "step",
            b"ISO-10303-21;HEADER;ENDSEC;DATA;#1=PLANE('',#1);ENDSEC;END-ISO-10303-21;".to_vec(),
        ),
        ("obj", fan.into_bytes()),
        ("obj", gon.into_bytes()),
        ("obj", far.as_bytes().to_vec()),
        ("obj", point.as_bytes().to_vec()),
        ("obj", b"f 1 2 3\n".repeat(1000)),
        ("obj", Vec::new()),
        ("off", b"OFF\n4294967295 4294967295 0\n".to_vec()),
        (
            "ply",
            b"ply\nformat ascii 1.0\nelement vertex 4294967295\nproperty double x\nend_header\n"
                .to_vec(),
        ),
        ("stl", [vec![b' '; 80], vec![0xff; 4]].concat()),
        ("glb", [&b"glTF\x02\0\0\0\xff\xff\xff\xff\xff\xff\xff\xffJSON"[..], &[0xff; 64]].concat()),
        ("3dm", b"3D Geometry File Format        5".to_vec()),
    ]
}

const COMMANDS: &[&str] = &["analyze", "convert", "fit", "hnet", "fair", "weingarten", "panel"];

pub(super) fn all(lab: &mut Lab) -> Outcome {
    for (extension, bytes) in built() {
        let path = lab.folder.join(format!("hostile.{extension}"));
        fs::write(&path, bytes).map_err(|e| format!("{}: {e}", path.display()))?;
        for command in COMMANDS {
            let mut arguments = vec![(*command).to_owned(), path.display().to_string()];
            lab.name_output(&mut arguments, "a.obj");
            if *command == "fair" {
                arguments.extend(["--levels", "0", "--iterations", "1"].map(str::to_owned));
            }
            lab.attempt(&arguments, Some(&path))?;
        }
    }
    for no_file in ["fixtures", "/dev/null", "no-such-file.obj", "", "-"] {
        for command in COMMANDS {
            let mut arguments = vec![(*command).to_owned(), no_file.to_owned()];
            lab.name_output(&mut arguments, "a.obj");
            lab.attempt(&arguments, None)?;
        }
    }
    Ok(())
}
