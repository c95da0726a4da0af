//! What readers see as text, kept so that a change of a word is noticed.

use crate::common;
use glam::DVec3;
use report::{
    EnergyHistory, FaceGroups, Histogram, LineRole, LineSet, Report, ScalarField, Series,
    SurfaceView,
};

#[test]
fn refusals_say_what_where_and_how_to_mend() {
    let (p, n) = ([DVec3::ZERO, DVec3::X, DVec3::Y], [DVec3::Z; 3]);
    let new = |p: &[DVec3], n: &[DVec3], t: &[[u32; 3]]| {
        SurfaceView::new("roof", p.to_vec(), n.to_vec(), t.to_vec())
    };
    let sound = || new(&p, &n, &[[0, 1, 2]]).unwrap();
    let field = |count: usize| ScalarField::mean_curvature(vec![0.0; count], "m");
    let groups = |of: Vec<u32>, names: usize| FaceGroups {
        names: vec![String::new(); names],
        ..FaceGroups::numbered("molds", "mold", of)
    };
    let line = |p: DVec3| LineSet::new("seams", "seams", LineRole::Curves, vec![vec![p]]);
    let refused = [
        new(&p, &n, &[]),
        new(&p, &n[..2], &[[0, 1, 2]]),
        new(&[DVec3::ZERO, DVec3::NAN, DVec3::Y], &n, &[[0, 1, 2]]),
        new(&p, &[DVec3::Z, DVec3::Z, 2.0 * DVec3::Z], &[[0, 1, 2]]),
        new(&p, &n, &[[0, 1, 2], [0, 1, 3]]),
        sound().with_field(field(2)),
        sound().with_field(field(3)).unwrap().with_field(field(3)),
        sound().with_groups(groups(vec![0, 0], 1)),
        sound().with_groups(groups(vec![2], 2)),
        sound().with_lines(line(DVec3::INFINITY)),
    ];
    let sentences: Vec<String> = refused.into_iter().map(|r| r.unwrap_err().to_string()).collect();
    insta::assert_snapshot!(sentences.join("\n"));
}

/// The texts of an SVG file in their order, after its first line.
fn texts(svg: &[u8]) -> String {
    let svg = std::str::from_utf8(svg).unwrap();
    let document = roxmltree::Document::parse(svg).unwrap();
    let texts = document.descendants().filter(|node| node.has_tag_name("text"));
    let lines = texts.map(|node| node.text().unwrap_or_default());
    let head = svg.lines().next().unwrap_or_default();
    [head].into_iter().chain(lines).collect::<Vec<_>>().join("\n")
}

fn full_report() -> Report {
    let mut report = common::tori();
    let series = |name: &str, values: &[f64]| Series { name: name.into(), values: values.to_vec() };
    report.status = "iteration_limit".into();
    report.warnings.push("trims were left out".into());
    report.histograms.push(Histogram {
        id: "kinks".into(),
        title: "Kinks along seams".into(),
        quantity: "kink".into(),
        unit: "°".into(),
        series: vec![series("before", &[0.1, 0.2, 0.4]), series("after", &[0.02, 0.03])],
        tolerance: Some(0.15),
    });
    let terms =
        vec![series("alignment", &[1.0, 0.1, 0.01]), series("fairness", &[0.0, 2e-4, 3e-4])];
    report.energies = Some(EnergyHistory { terms, marks: vec![(1, "14x10".into())] });
    report.option("levels", "10x8");
    report
}

#[test]
fn plots_say_this() {
    let figures = full_report().figures().unwrap();
    let plots = figures.iter().filter(|f| f.name.ends_with(".svg"));
    let plots: Vec<String> = plots.map(|f| format!("# {}\n{}", f.name, texts(&f.bytes))).collect();
    insta::assert_snapshot!(plots.join("\n\n"));
}

/// How the parts of a page begin that are left out.
const CUT: [&str; 4] = ["<style", "<section class=\"explorer\"", "<svg", "<script"];

#[test]
fn the_page_says_this_around_its_plots() {
    let page = full_report().to_html();
    // What the style, the viewer, the plots, the data and the script consist of is checked elsewhere.
    let mut rest = page.as_str();
    let mut text = String::new();
    while let Some(at) = CUT.iter().filter_map(|start| rest.find(start)).min() {
        let tag = rest[at + 1..].split(|c: char| !c.is_ascii_alphabetic()).next().unwrap();
        let end = at + rest[at..].find(&format!("</{tag}>")).unwrap();
        text += &rest[..at];
        text += &format!("<{tag}>…");
        rest = &rest[end..];
    }
    // Hashes of the script and the style change with them.
    let mut parts = (text + rest).split("'sha256-").map(str::to_owned).collect::<Vec<_>>();
    for part in parts.iter_mut().skip(1) {
        *part = format!("'…{}", &part[part.find('\'').unwrap()..]);
    }
    insta::assert_snapshot!(parts.concat());
}
