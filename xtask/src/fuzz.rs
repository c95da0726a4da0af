//! `cargo xtask fuzz`: coverage-guided fuzzing of the readers and the solver with libFuzzer.

use crate::shell::{Outcome, check, read, root, target};
use exchange::{decode_model, encode_model};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What `cargo fuzz` passes to rustc, without the sanitizer: that one needs a nightly compiler, and
/// code without `unsafe` has little for it to find.
const FLAGS: [&str; 8] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Ccodegen-units=1",
    "-Cdebug-assertions",
    "--cfg=fuzzing",
];

/// One allocation may not exceed this, the process not the next; both in megabytes. The readers
/// promise 64 + 16 times the size of the file, and inputs are at most [`LONGEST`].
const ALLOCATION_MB: usize = 128;
const PROCESS_MB: usize = 512;
/// Longest input in bytes.
const LONGEST: usize = 65536;

/// Fuzzes each target (all if none is named) for `seconds`, on one core.
pub(crate) fn run(seconds: &str, names: &[&str]) -> Outcome {
    if seconds.parse::<u32>().is_err() {
        return Err(format!("`{seconds}` is not a number of seconds; try `cargo xtask fuzz 60`"));
    }
    let targets = targets()?;
    if let Some(unknown) = names.iter().find(|n| !targets.iter().any(|t| t == *n)) {
        return Err(format!("there is no target {unknown}; use one of {}", targets.join(", ")));
    }
    let host = host()?;
    let folder = target().join("fuzz");
    let mut build = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    // With a target named, build scripts and procedural macros go without the flags.
    build.args(["build", "--release", "--bins", "--target", &host]);
    build.current_dir(root().join("fuzz")).env("CARGO_TARGET_DIR", &folder);
    check({
        build.env("CARGO_ENCODED_RUSTFLAGS", FLAGS.join("\x1f"));
        build
    })?;
    let mut found = Vec::new();
    for target in targets.iter().filter(|t| names.is_empty() || names.contains(&t.as_str())) {
        let seeds = folder.join("seeds").join(target);
        write_seeds(target, &seeds)?;
        let corpus = make(&root().join("fuzz/corpus").join(target))?;
        let artifacts = make(&root().join("fuzz/artifacts").join(target))?;
        let mut fuzz = Command::new(folder.join(&host).join("release").join(target));
        fuzz.args([&corpus, &seeds]);
        fuzz.arg(format!("-max_total_time={seconds}"));
        fuzz.arg(format!("-max_len={LONGEST}"));
        fuzz.arg(format!("-malloc_limit_mb={ALLOCATION_MB}"));
        fuzz.arg(format!("-rss_limit_mb={PROCESS_MB}"));
        fuzz.arg(format!("-artifact_prefix={}/", artifacts.display()));
        fuzz.args(["-timeout=60", "-print_final_stats=1"]);
        println!("== {target}");
        if check(fuzz).is_err() {
            found.push(target.clone());
        }
    }
    if found.is_empty() {
        return Ok(());
    }
    Err(format!("findings in {}; the inputs are under fuzz/artifacts", found.join(", ")))
}

/// The names of the files in `fuzz/fuzz_targets`.
fn targets() -> Outcome<Vec<String>> {
    let folder = root().join("fuzz/fuzz_targets");
    let entries = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let stem = |path: PathBuf| path.file_stem().map(|s| s.to_string_lossy().into_owned());
    let mut names: Vec<String> = entries.flatten().filter_map(|entry| stem(entry.path())).collect();
    names.sort();
    Ok(names)
}

/// The machine rustc builds for by itself.
fn host() -> Outcome<String> {
    let output = Command::new("rustc").arg("-vV").current_dir(root()).output();
    let output = output.map_err(|e| format!("rustc could not start: {e}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| "rustc does not tell its host".to_owned())
}

/// What targets that are no formats begin with.
const OPTION_SEEDS: &[(&str, &str)] = &[
    ("creases", "(edges: [((0, 1), 2.0), ((1, 2), 9.5)], corners: [0, 3])"),
    (
        "fix",
        "(vertices: [0, 1], limit_points: [(3, (0.0, 1.0, 2.0)), (4, None)], \
         tangent_planes: [(3, (0.0, 0.0, 1.0))], weights: [(6, 10.0)], clamp_boundary: true)",
    ),
    ("energy", "0.92*bending + 0.08 mehlum_tarrou(1, 2) - f1"),
    (
        "checkpoint",
        "{\"schema\":2,\"method\":\"fair\",\"fingerprint\":0,\"stage\":0,\"iteration\":1,\
         \"numbers\":{\"y\":[0.5],\"damping\":[0.01],\"initial_energy\":[2.5]},\
         \"counts\":{\"state\":[1,0,1,3,1]}}",
    ),
    ("cage", "\u{1}\u{2}\u{3}\u{4}\u{5}"),
    ("solver", "\u{8}\u{1}\u{0}\u{10}\u{8}\u{2}"),
];

/// Files to begin with: fixtures of the format, and fixtures written in the format.
fn write_seeds(target: &str, folder: &Path) -> Outcome {
    make(folder)?;
    let put = |name: String, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(|e| format!("{}: {e}", path.display()))
    };
    if let Some((name, text)) = OPTION_SEEDS.iter().find(|(name, _)| *name == target) {
        return put(format!("{name}.ron"), text.as_bytes());
    }
    // The name of a program cannot begin with a digit.
    let format = if target == "rhino" { "3dm" } else { target };
    if target == "rhino" {
        let path = root().join("fixtures/rhino/rhino8.3dm");
        let bytes = fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        put("rhino8.3dm".to_owned(), &bytes)?;
    }
    if target == "off" {
        let cube = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
        put("tetrahedron.off".to_owned(), cube.as_bytes())?;
        let coloured =
            "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n3 0 1 2\n";
        put("coloured.off".to_owned(), coloured.as_bytes())?;
    }
    for name in
        ["plane.ron", "torus-patch.ron", "tube.ron", "saddle.step", "grid.obj", "quads/cube.obj"]
    {
        let path = root().join("fixtures").join(name);
        let extension = exchange::extension_of(&path);
        let stem = name.replace(['/', '.'], "-");
        let bytes = read(&path)?.into_bytes();
        if extension == format {
            put(format!("{stem}.{format}"), &bytes)?;
            continue;
        }
        let model = decode_model(&extension, bytes).map_err(|e| format!("{name}: {e}"))?;
        // What the format cannot hold gives no seed.
        if let Ok(bytes) = encode_model(Path::new(&format!("seed.{format}")), &model) {
            put(format!("{stem}.{format}"), &bytes[..bytes.len().min(LONGEST)])?;
        }
    }
    Ok(())
}

fn make(folder: &Path) -> Outcome<PathBuf> {
    fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    Ok(folder.to_path_buf())
}
