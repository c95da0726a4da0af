//! `cargo xtask regress`: run the scenes, compare their metrics with what is expected, and the files
//! they write with what the metrics say.

use crate::scene::{Expectation, NamedScene, all, look_up};
use crate::shell::{Outcome, build_umbilic, read, root, umbilic, write};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Runs the scenes named (all if none is) and returns those skipped, each with the reason.
pub(crate) fn run(names: &[&str]) -> Outcome<Vec<String>> {
    let scenes = all()?;
    if let Some(unknown) = names.iter().find(|n| !scenes.iter().any(|s| s.name == **n)) {
        return Err(format!("there is no scene {unknown} under fixtures/regress"));
    }
    build_umbilic()?;
    let (mut skipped, mut wanted) = (Vec::new(), Vec::new());
    for scene in scenes.iter().filter(|s| names.is_empty() || names.contains(&s.name.as_str())) {
        match missing_folder(scene) {
            Some(reason) => skipped.push(format!("regress {}: {reason}", scene.name)),
            None => wanted.push(scene),
        }
    }
    let (mut missed, mut untrue) = (0, Vec::new());
    for shown in side_by_side(&wanted)? {
        missed += shown.missed;
        untrue.extend(shown.untrue);
    }
    match (missed, untrue.is_empty()) {
        (0, true) => Ok(skipped),
        (0, false) => Err(format!("files and metrics differ in {}", untrue.join(", "))),
        (_, true) => Err(format!("{missed} values are not as expected")),
        (_, false) => Err(format!(
            "{missed} values are not as expected, files and metrics differ in {}",
            untrue.join(", ")
        )),
    }
}

/// How a scene came out.
#[derive(Default)]
struct Shown {
    /// Values that are not as expected.
    missed: usize,
    /// The name, if its files are not what its metrics say.
    untrue: Option<String>,
}

/// Runs scenes on two threads, which together keep two cores busy where one alone waits for a
/// factorisation.
fn side_by_side(scenes: &[&NamedScene]) -> Outcome<Vec<Shown>> {
    let next = AtomicUsize::new(0);
    let work = || -> Outcome<Vec<Shown>> {
        let mut shown = Vec::new();
        while let Some(scene) = scenes.get(next.fetch_add(1, Ordering::Relaxed)) {
            shown.push(show(scene)?);
        }
        Ok(shown)
    };
    let halves = std::thread::scope(|scope| {
        let other = scope.spawn(work);
        let own = work();
        [own, other.join().unwrap_or_else(|_| Err("a scene could not be run".to_owned()))]
    });
    let [own, other] = halves;
    let mut all = own?;
    all.extend(other?);
    Ok(all)
}

/// Runs one scene and prints what came of it.
fn show(scene: &NamedScene) -> Outcome<Shown> {
    let start = Instant::now();
    let metrics = measure(scene)?;
    let mut text = format!("{} ({:.2} s)\n", scene.name, start.elapsed().as_secs_f64());
    let mut shown = Shown::default();
    for (key, wanted) in &scene.scene.expect {
        let got = look_up(&metrics, key);
        let holds = wanted.holds(got);
        shown.missed += usize::from(!holds);
        let got = got.map_or_else(|| "nothing".to_owned(), Value::to_string);
        let verdict = if holds { "ok  " } else { "MISS" };
        text += &format!("  {verdict} {key}: wanted {wanted}, got {got}\n");
    }
    if let Some(said) = differences(scene)? {
        text += &format!("  MISS verify: the files are not what the metrics say\n{said}\n");
        shown.untrue = Some(scene.name.clone());
    }
    // In one piece, since two scenes are shown at once.
    print!("{text}");
    Ok(shown)
}

/// What the program says of a scene whose files are not what its metrics claim.
fn differences(scene: &NamedScene) -> Outcome<Option<String>> {
    let metrics = scratch(scene).join("metrics.json");
    let mut command = umbilic();
    command.arg("verify").arg(&metrics);
    let output = command.output().map_err(|e| format!("{}: {e}", scene.name))?;
    match output.status.code() {
        Some(0) => Ok(None),
        Some(1) => {
            let text = String::from_utf8_lossy(&output.stdout);
            let lines = text.lines().filter(|line| line.contains("DIFFERS"));
            Ok(Some(lines.collect::<Vec<_>>().join("\n")))
        }
        _ => {
            let said = String::from_utf8_lossy(&output.stderr);
            Err(format!("{}: verify ended with {}: {said}", scene.name, output.status))
        }
    }
}

/// The folder a scene writes to.
fn scratch(scene: &NamedScene) -> PathBuf {
    root().join("target/regress").join(&scene.name)
}

/// Rewrites the `CloseTo` values of one scene to what it measures now, keeping their tolerances.
pub(crate) fn bless(name: &str) -> Outcome {
    let scenes = all()?;
    let scene =
        scenes.iter().find(|s| s.name == name).ok_or(format!("there is no scene {name}"))?;
    build_umbilic()?;
    let metrics = measure(scene)?;
    let mut text = read(&scene.path)?;
    for (key, wanted) in &scene.scene.expect {
        let Expectation::CloseTo(_, tolerance) = wanted else { continue };
        let got = look_up(&metrics, key).and_then(Value::as_f64);
        let got = got.ok_or(format!("{name}: the metrics have no number {key}"))?;
        text = replace_close_to(&text, key, got, *tolerance)
            .ok_or(format!("{name}: no CloseTo for {key} on a line of its own"))?;
    }
    write(&scene.path, &text)
}

/// The text with the `CloseTo(…)` behind `"key":` replaced.
fn replace_close_to(text: &str, key: &str, value: f64, tolerance: f64) -> Option<String> {
    let at = text.find(&format!("\"{key}\""))?;
    let open = at + text[at..].find("CloseTo(")?;
    let close = open + text[open..].find(')')? + 1;
    Some(format!("{}CloseTo({value:?}, {tolerance:?}){}", &text[..open], &text[close..]))
}

/// Exit code of a result that failed where it was looked at more closely.
const FAILED: i32 = 4;

fn folder_of(need: &str) -> Option<PathBuf> {
    let variable = format!("UMBILIC_{}", need.to_uppercase());
    std::env::var_os(variable).map(PathBuf::from).filter(|path| path.is_dir())
}

fn missing_folder(scene: &NamedScene) -> Option<String> {
    let need = scene.scene.needs.as_deref()?;
    let missing = folder_of(need).is_none();
    missing.then(|| format!("UMBILIC_{} names no folder", need.to_uppercase()))
}

/// Runs one scene in a scratch folder under `target` and reads the metrics it wrote.
fn measure(scene: &NamedScene) -> Outcome<Value> {
    let out = scratch(scene);
    let _ = std::fs::remove_dir_all(&out);
    std::fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    let metrics = out.join("metrics.json");
    let mut command = umbilic();
    command.args(scene.scene.args.iter().map(|argument| fill_in(argument, &out)));
    command.arg("-q").arg("--metrics").arg(&metrics);
    let output = command.output().map_err(|e| format!("{}: {e}", scene.name))?;
    // A scene may show what is said of a result that failed.
    let is_shown = output.status.code() == Some(FAILED)
        && scene.scene.args.iter().any(|argument| argument == "--keep-failed");
    if !output.status.success() && !is_shown {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{}: umbilic ended with {}: {said}", scene.name, output.status));
    }
    serde_json::from_str(&read(&metrics)?).map_err(|e| format!("{}: {e}", metrics.display()))
}

fn fill_in(argument: &str, out: &Path) -> String {
    let mut filled = argument.replace("{out}", &out.to_string_lossy());
    for need in ["models", "reference"] {
        if let Some(folder) = folder_of(need) {
            filled = filled.replace(&format!("{{{need}}}"), &folder.to_string_lossy());
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::replace_close_to;

    #[test]
    fn blessing_changes_the_value_and_keeps_the_tolerance() {
        let text = "expect: {\"a\": AtMost(1.0), \"b\": CloseTo(2.0, 0.1)}";
        let blessed = replace_close_to(text, "b", 3.5, 0.1).unwrap();
        assert_eq!(blessed, "expect: {\"a\": AtMost(1.0), \"b\": CloseTo(3.5, 0.1)}");
    }
}
