//! What the program says and how its files begin, kept so that a change of a word is noticed.
//! After a change that is meant, `INSTA_UPDATE=always cargo test -p cli --test program` writes
//! the files anew; their difference is what a reader of the change looks at.

use crate::common::{message, umbilic, write_into};
use std::fs;

/// The text with every number as `#` and no padding, so that it depends neither on the processor
/// nor on how fast it is. Digits within a word, as in `G1` or `p95`, belong to it.
pub(crate) fn redacted(text: &str) -> String {
    let line = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        format!("{}{}", if line.starts_with(' ') { "  " } else { "" }, words.join(" "))
    };
    without_numbers(text, |_| true).lines().map(line).collect::<Vec<_>>().join("\n")
}

/// The text with every number that is not whole as `#`: coordinates and sizes, but no versions,
/// codes and names.
fn without_fractions(text: &str) -> String {
    without_numbers(text, |number| number.contains('.'))
}

fn without_numbers(text: &str, is_redacted: impl Fn(&str) -> bool) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let is_within_word = kept.ends_with(|k: char| k.is_alphanumeric() || k == '_');
        let length = if is_within_word { 0 } else { number_length(rest) };
        let (token, after) = rest.split_at(length.max(c.len_utf8()));
        kept.push_str(if length > 0 && is_redacted(token) { "#" } else { token });
        rest = after;
    }
    kept
}

/// How many bytes at the start are a number: sign, digits, fraction, exponent.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        bytes[from.min(bytes.len())..].iter().take_while(|b| b.is_ascii_digit()).count()
    };
    let sign = usize::from(matches!(bytes.first(), Some(b'-' | b'+')));
    let whole = digits(sign);
    if whole == 0 {
        return 0;
    }
    let mut end = sign + whole;
    if bytes.get(end) == Some(&b'.') && digits(end + 1) > 0 {
        end += 1 + digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'-' | b'+')));
        if digits(end + 1 + sign) > 0 {
            end += 1 + sign + digits(end + 1 + sign);
        }
    }
    end
}

#[test]
fn numbers_are_told_from_words() {
    let text = "kinks:  0.5°, p95 1.2e-13; (-3,+4.) G1\n   22 vertices    7E+5 to 14x10, t2_3 5";
    assert_eq!(redacted(text), "kinks: #°, p95 #; (#,#.) G1\n  # vertices # to #x10, t2_3 #");
    assert_eq!(without_fractions("#12=P(-1.5E-3,2) 10303-21"), "#12=P(#,2) 10303-21");
}

#[test]
fn help_texts() {
    let mut command = cli::command().term_width(100);
    command.build();
    insta::assert_snapshot!("help", command.render_long_help().to_string());
    for command in command.get_subcommands_mut().filter(|c| c.get_name() != "help") {
        let name = format!("help_{}", command.get_name());
        insta::assert_snapshot!(name, command.render_long_help().to_string());
    }
}

/// What a run that is refused says, in lines that begin with its arguments.
fn refusal(folder: &tempfile::TempDir, arguments: &str) -> String {
    let dir = folder.path().display().to_string();
    let arguments_here = arguments.replace("DIR", &dir);
    let output = umbilic(&arguments_here.split(' ').collect::<Vec<_>>());
    let said = message(&output).replace(&dir, "DIR");
    assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
    format!("$ umbilic {arguments}\n{said}")
}

#[test]
fn error_sentences() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| write_into(&folder, name, text);
    write("triangle.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("book.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
    write("options.ron", "(iterations: many)");
    write("empty.step", "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n");
    let runs = [
        "nothing",
        "analyze",
        "analyze no/such.obj",
        "analyze fixtures",
        "analyze DIR/empty.step",
        "analyze DIR/book.obj",
        "analyze fixtures/roof.ron --threads 0",
        "convert fixtures/roof.ron DIR/a.xyz",
        "convert fixtures/roof.ron DIR/no/such/a.step",
        "convert DIR/triangle.obj DIR/a.step",
        "fit fixtures/grid.obj",
        "fit fixtures/grid.obj -o DIR/a.step --ctrl 5",
        "fit fixtures/grid.obj -o DIR/a.step --ctrl 900x9",
        "fit fixtures/grid.obj -o DIR/a.step --degree 16",
        "fit DIR/triangle.obj -o DIR/a.step",
        "weingarten fixtures/roof.ron -o DIR/a.step --levels 3x9",
        "weingarten fixtures/roof.ron -o DIR/a.step --samples 1x9",
        "weingarten fixtures/roof.ron -o DIR/a.step --relation square",
        "weingarten fixtures/roof.ron -o DIR/a.step --relation gauss",
        "weingarten fixtures/roof.ron -o DIR/a.step --closeness=-1",
        "weingarten fixtures/roof.ron -o DIR/a.step --move 1,2,3",
        "weingarten fixtures/roof.ron -o DIR/a.step --formulation lifted --relation minimal",
        "weingarten fixtures/roof.ron -o DIR/a.step --config DIR/options.ron",
        "weingarten fixtures/roof.ron -o DIR/a.step --resume DIR/none.json",
        "panel fixtures/roof.ron -o DIR/a.csv --panels 3x3 --molds 10",
        "panel fixtures/roof.ron -o DIR/a.csv --max-kink-deg=-1",
        "panel fixtures/roof.ron -o DIR/a.csv --mold-types conic",
        "panel fixtures/roof.ron -o DIR/a.csv --mold-types plane,cubic",
        "panel fixtures/roof.ron -o DIR/a.csv --k 2 --molds 5",
        "panel fixtures/roof.ron -o DIR/a.csv --layout no/such.obj",
        "hnet DIR/triangle.obj -o DIR/a.ron",
        "hnet fixtures/nets/enneper.obj -o DIR/a.xyz",
        "darboux fixtures/nets/enneper.obj -o DIR/a.glb",
        "asymptotic fixtures/roof.ron -o DIR/a.step",
        "asymptotic fixtures/asymptotic/catenoid.ron -o DIR/a.step --degree 2",
        "fair fixtures/quads/theta.obj -o DIR/a.obj --energy bendin",
        "fair fixtures/quads/theta.obj -o DIR/a.obj --fix no/such.ron",
    ];
    let said: Vec<String> = runs.iter().map(|run| refusal(&folder, run)).collect();
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn headers_of_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |end: &str| folder.path().join(format!("panels.{end}")).display().to_string();
    let files = ["step", "csv", "svg", "dxf"].map(path);
    let mut args = vec!["panel", "fixtures/roof.ron", "--panels", "3x2", "--molds", "2", "-q"];
    args.extend(["--mold-types", "cylinder"]);
    args.extend(files.iter().flat_map(|file| ["-o", file]));
    let output = umbilic(&args);
    assert!(output.status.success(), "{}", message(&output));
    let [step, csv, svg, dxf] = files.map(|file| fs::read_to_string(file).expect("a text"));
    // Up to the first entities of the shape.
    let begin = step.lines().take_while(|line| !line.contains("CARTESIAN_POINT"));
    insta::assert_snapshot!(
        "header_step",
        without_fractions(&begin.collect::<Vec<_>>().join("\n"))
    );
    let begin: Vec<&str> = csv.lines().take(2).collect();
    insta::assert_snapshot!("header_csv", without_fractions(&begin.join("\n")));
    // Layers without their lines, and how one panel is labelled.
    let is_shape = |line: &&str| line.starts_with("<polyline") || line.starts_with("<polygon");
    let labels = svg.lines().filter(|line| line.starts_with("<text")).skip(2);
    let labels: Vec<&str> = labels.collect();
    let frame = svg.lines().filter(|line| !is_shape(line) && !labels.contains(line));
    insta::assert_snapshot!("header_svg", without_fractions(&frame.collect::<Vec<_>>().join("\n")));
    let end = dxf.find("ENTITIES").expect("a section of entities") + "ENTITIES".len();
    // Group codes and values stand on lines of their own.
    let lines: Vec<&str> = dxf[..end].lines().map(str::trim).collect();
    let pairs: Vec<String> = lines.chunks(2).map(|pair| pair.join(" ")).collect();
    insta::assert_snapshot!("header_dxf", without_fractions(&pairs.join("\n")));
}
