//! What a page and its figures consist of, without a browser.

use crate::common;
use report::{EnergyHistory, Histogram, Report, Seam, SeamTable, Series};

fn full_report() -> Report {
    let mut report = common::tori();
    report.status = "iteration_limit".into();
    report.warnings.push("trims were left out".into());
    report.histograms.push(Histogram {
        id: "kinks".into(),
        title: "Kinks along seams".into(),
        quantity: "kink".into(),
        unit: "°".into(),
        series: vec![Series { name: "before".into(), values: vec![0.1, 0.2] }],
        tolerance: Some(0.15),
    });
    let terms = vec![Series { name: "alignment".into(), values: vec![1.0, 0.1, 0.01] }];
    report.energies = Some(EnergyHistory { terms, marks: vec![] });
    report.seams = Some(SeamTable {
        columns: vec!["kink [°]".into()],
        tolerances: vec![Some(0.15)],
        rows: vec![Seam {
            label: "panel 1 – panel 2".into(),
            stage: "after".into(),
            location: report.stages[1].positions()[7],
            size: 0.5,
            path: report.stages[1].positions()[5..9].to_vec(),
            values: vec![0.2],
        }],
        ..SeamTable::default()
    });
    report.option("levels", "10x8");
    report
}

#[test]
fn the_page_holds_every_part() {
    let page = full_report().to_html();
    let parts = [
        "<!doctype html>",
        "iteration limit",
        "trims were left out",
        "Kinks along seams",
        "Energies per iteration",
        "Worst seams",
        "data-seam=\"0\"",
        "class=\"beyond\">0.2<",
        "<th scope=\"row\">levels</th><td>10x8</td>",
        "<th scope=\"row\">area</th><td>106.6</td>",
        "id=\"stage-1\"",
    ];
    for part in parts {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn nothing_is_loaded_from_elsewhere() {
    let page = full_report().to_html();
    let page = page.replace("http://www.w3.org/2000/svg", "");
    for forbidden in ["http://", "https://", "src=", "href=", "@import", "url(http"] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
    assert!(page.contains("default-src 'none'"));
}

#[test]
fn pages_repeat_for_any_number_of_threads() {
    let in_pool = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (full_report().to_html(), full_report().figures().unwrap()))
    };
    let first = in_pool(1);
    assert!(first == in_pool(4));
}

#[test]
fn what_changes_from_run_to_run_stands_in_one_block() {
    let mut other = full_report();
    other.command_line = "umbilic analyze elsewhere.ron --threads 8".into();
    other.metrics.insert("seconds".into(), 0.75.into());
    other.run.insert("threads".into(), 8.into());
    let (a, b) = (full_report().to_html(), other.to_html());
    let differing = a.lines().zip(b.lines()).filter(|(a, b)| a != b).collect::<Vec<_>>();
    assert_eq!(a.lines().count(), b.lines().count());
    assert_eq!(differing.len(), 1);
    assert!(differing[0].0.contains("id=\"run\""));
}

#[test]
fn text_cannot_break_out_of_the_page() {
    let attack = "</script><script>alert(1)</script><img src=x onerror=alert(2)>";
    let mut report = full_report();
    report.title = attack.into();
    report.warnings.push(attack.into());
    report.command_line = attack.into();
    report.run.insert(attack.into(), attack.into());
    report.option(attack, attack);
    let page = report.to_html();
    assert!(!page.contains("<script>alert") && !page.contains("<img"));
}

#[test]
fn figures_are_named_after_what_they_show() {
    let figures = full_report().figures().unwrap();
    let names: Vec<&str> = figures.iter().map(|f| f.name.as_str()).collect();
    let want = [
        "histogram-kinks.svg",
        "energies.svg",
        "before-diagram.svg",
        "after-diagram.svg",
        "before-h.png",
        "before-k.png",
        "before-quarters.png",
        "after-h.png",
        "after-k.png",
        "after-quarters.png",
    ];
    assert_eq!(names, want);
    let picture = &figures[names.iter().position(|n| *n == "after-k.png").unwrap()];
    let mut reader = png::Decoder::new(std::io::Cursor::new(&picture.bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let colours: std::collections::BTreeSet<&[u8]> = pixels.chunks(3).collect();
    assert!(colours.len() > 200, "{} colours", colours.len());
}

#[test]
fn a_demo_sized_page_stays_below_three_megabytes() {
    let mut report = full_report();
    // 900 panels of 50 triangles twice over make 90,000 triangles; a torus of 213² vertices too.
    report.stages =
        vec![common::torus("before", 3.0, 1.0, 150), common::torus("after", 3.0, 1.0, 150)];
    let size = report.to_html().len();
    assert!(size < 3_000_000, "{size} bytes");
}

#[test]
fn a_report_without_surfaces_is_a_page_of_tables() {
    let page = Report::new("Nothing to see", "umbilic").to_html();
    assert!(page.contains("Nothing to see") && !page.contains("<canvas"));
}
