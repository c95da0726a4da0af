//! Assemblies, elementary and derived surfaces that mislead or exhaust other readers.

use exchange::{Model, ReadError, read_step};
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(5);

fn fixture(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/step");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn read(text: &str) -> Result<Model, ReadError> {
    let begin = Instant::now();
    let read = read_step(text.as_bytes());
    assert!(begin.elapsed() < LIMIT, "took {:?}", begin.elapsed());
    read
}

#[track_caller]
fn refused(text: &str, want: &str) {
    let message = read(text).unwrap_err().to_string();
    assert!(message.contains(want), "{message}");
    assert!(message.len() < 400, "{message}");
}

/// The torus, with more entities.
fn torus_with(more: &str) -> String {
    fixture("analytic-torus.step").replace("ENDSEC;\nEND-", &format!("{more}ENDSEC;\nEND-"))
}

/// Representations that show the next one so many times each, the last of them `#306`.
fn nested(depth: usize, times: usize, last: &str) -> String {
    let mut more = String::from("#1000=AXIS2_PLACEMENT_3D('',#1,#2,#3);\n");
    for level in 0..depth {
        let (id, next) = (2000 + 100 * level, 2000 + 100 * (level + 1));
        let shown = if level + 1 == depth { last.to_owned() } else { format!("#{next}") };
        writeln!(more, "#{}=REPRESENTATION_MAP(#1000,{shown});", id + 1).unwrap();
        let items: Vec<String> = (0..times).map(|k| format!("#{}", id + 2 + k)).collect();
        for item in &items {
            writeln!(more, "{item}=MAPPED_ITEM('',#{},#1000);", id + 1).unwrap();
        }
        writeln!(more, "#{id}=SHAPE_REPRESENTATION('',({}),#903);", items.join(",")).unwrap();
    }
    torus_with(&more)
}

#[test]
fn parts_that_double_at_every_level_stay_within_the_memory() {
    refused(&nested(40, 2, "#306"), "need more memory than a file of this size may take");
    // Also where nothing is shown in the end.
    let empty = nested(40, 2, "#1500")
        .replace("ENDSEC;\nEND-", "#1500=SHAPE_REPRESENTATION('',(#1000),#903);\nENDSEC;\nEND-");
    refused(&empty, "need more memory than a file of this size may take");
    assert_eq!(read(&nested(3, 2, "#306")).unwrap().surfaces.len(), 8);
}

#[test]
fn nesting_ends_at_64_and_circles_are_refused() {
    refused(&nested(80, 1, "#306"), "nested too deeply");
    // A circle hangs on nothing; the torus beside it is read.
    assert_eq!(read(&nested(3, 1, "#2000")).unwrap().surfaces.len(), 1);
    let mut chain = String::new();
    for k in 0..100 {
        writeln!(chain, "#{}=OFFSET_SURFACE('',#{},1.,.F.);", 1000 + k, 1001 + k).unwrap();
    }
    let end = "#1100=OFFSET_SURFACE('',#100,1.,.F.);\n";
    let text = torus_with(&(chain + end)).replace("'t',(#302),#100", "'t',(#302),#1000");
    refused(&text, "surfaces are nested too deeply");
    let circle = "#1000=OFFSET_SURFACE('',#1001,1.,.F.);\n\
        #1001=RECTANGULAR_TRIMMED_SURFACE('',#1000,0.,1.,0.,1.,.T.,.T.);\n";
    let text = torus_with(circle).replace("'t',(#302),#100", "'t',(#302),#1000");
    refused(&text, "surfaces are nested too deeply");
}

#[test]
fn senseless_measures_are_refused() {
    let torus = fixture("analytic-torus.step");
    for (from, to) in [
        ("#4,50.,20.)", "#4,-50.,20.)"),
        ("#4,50.,20.)", "#4,50.,0.)"),
        ("#4,50.,20.)", "#4,NAN,20.)"),
        ("#4,50.,20.)", "#4,50.)"),
        ("TOROIDAL_SURFACE('',#4", "TOROIDAL_SURFACE('',#5"),
        ("DIRECTION('',(0.,0.,1.))", "DIRECTION('',(0.,1.))"),
    ] {
        assert!(torus.contains(from));
        let message = read(&torus.replace(from, to)).unwrap_err().to_string();
        assert!(message.starts_with("line "), "{to}: {message}");
    }
    // A radius of the whole range of numbers leaves it when the surface is made.
    assert!(read(&torus.replace("#4,50.,20.)", "#4,1.E308,1.E308)")).is_err());
    // Axes without a direction, or along one another, fall back to others.
    let flat = torus.replace("(1.,0.,0.)", "(0.,0.,1.)");
    assert_eq!(read(&flat).unwrap().surfaces.len(), 1);
}

#[test]
fn damaged_parts_are_read_or_refused_in_time() {
    // Numbers and letters changed one at a time, by a fixed sequence.
    let mut state = 7_u64;
    let mut random = |below: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % below
    };
    for (name, rounds) in [
        ("analytic-torus.step", 400),
        ("offset-surface-face.step", 60),
        ("vertex-loop-sphere.step", 200),
        ("bracket.step", 100),
        ("bicubic-hole.step", 60),
        ("assembly.step", 30),
    ] {
        let seed = fixture(name).into_bytes();
        let data = seed.windows(5).position(|w| w == b"DATA;").unwrap();
        for _ in 0..rounds {
            let mut bytes = seed.clone();
            for _ in 0..1 + random(3) {
                let at = data + random(seed.len() - data);
                bytes[at] = b"0123456789.,#()'$*E-"[random(20)];
            }
            let begin = Instant::now();
            let read = read_step(&bytes);
            assert!(begin.elapsed() < LIMIT, "{name} took {:?}", begin.elapsed());
            if let Err(error) = read {
                assert!(error.to_string().len() < 1000, "{error}");
            }
        }
    }
}
