//! Names and numbers from files nobody has looked at: pages and figures stay whole.

use glam::DVec3;
use proptest::collection::vec;
use proptest::prelude::*;
use report::{
    EnergyHistory, FaceGroups, Figure, Histogram, RelationCurve, Report, ScalarField, Seam,
    SeamTable, Series, SurfaceView,
};

/// Text with everything that has a meaning somewhere, and any other character.
fn hostile() -> impl Strategy<Value = String> {
    let traps = prop::sample::select(vec![
        "</script>",
        "<!--",
        "-->",
        "]]>",
        "&amp;",
        "&",
        "\"",
        "'",
        "<",
        "..",
        "/",
        "\\",
        "\0",
        "\u{1b}[31m",
        "\u{ffff}",
        "\u{202e}",
        "\r\n",
        "e\u{301}",
        "☃",
        "κ₁",
        "%",
        "{}",
        "\u{1f3db}",
    ]);
    let piece = prop_oneof![traps.prop_map(str::to_owned), any::<char>().prop_map(String::from)];
    vec(piece, 1..12).prop_map(|pieces| pieces.concat())
}

/// Any number a computer has, most of them usual.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -10.0..10.0_f64, 1 => any::<f64>(), 1 => Just(0.0)]
}

fn figure<'f>(figures: &'f [Figure], start: &str) -> &'f Figure {
    figures.iter().find(|f| f.name.starts_with(start)).expect(start)
}

/// Reads a figure by an independent parser of XML, and checks every number in it.
fn parsed(figure: &Figure) -> roxmltree::Document<'_> {
    let text = std::str::from_utf8(&figure.bytes).unwrap();
    let document = roxmltree::Document::parse(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    let [width, height] = ["width", "height"]
        .map(|name| document.root_element().attribute(name).unwrap().parse::<f64>().unwrap());
    for node in document.descendants().filter(roxmltree::Node::is_element) {
        for attribute in node.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            let numbers: Vec<&str> = match name {
                "d" | "viewBox" | "transform" => {
                    value.split(|c: char| !"0123456789.+-eE".contains(c)).collect()
                }
                "x" | "y" | "x1" | "x2" | "y1" | "y2" | "width" | "height" | "font-size" => {
                    vec![value]
                }
                _ => continue,
            };
            for number in numbers.iter().filter(|n| n.chars().any(|c| c.is_ascii_digit())) {
                assert!(number.parse::<f64>().is_ok_and(f64::is_finite), "{name}={value}");
            }
            assert!(!value.contains("NaN") && !value.contains("inf"), "{name}={value}");
            let (most, number) = match name {
                "x" | "x1" | "x2" => (width, value),
                "y" | "y1" | "y2" => (height, value),
                _ => continue,
            };
            let number: f64 = number.parse().unwrap();
            assert!((-1.0..=most + 1.0).contains(&number), "{name}={value} of {most}");
        }
    }
    document
}

fn with_histogram(title: &str, name: &str, unit: &str, series: Vec<Vec<f64>>) -> Report {
    let series = series.into_iter().map(|values| Series { name: name.to_owned(), values });
    let histogram = Histogram {
        id: name.to_owned(),
        title: title.to_owned(),
        quantity: name.to_owned(),
        unit: unit.to_owned(),
        series: series.collect(),
        tolerance: None,
    };
    Report { histograms: vec![histogram], ..Report::new(title, "") }
}

/// What a parser of XML hands back for `text`: what no document may hold is the sign for it.
fn readable(text: &str) -> String {
    let allowed = |c: char| match c {
        '\t' | '\n' | '\r' => c,
        '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => '\u{fffd}',
        c => c,
    };
    text.chars().map(allowed).collect()
}

/// A page with `text` in every place that takes some.
fn page_of(text: &str) -> Report {
    let t = || text.to_owned();
    let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    let view = SurfaceView::new(t(), points.clone(), vec![DVec3::Z; 3], vec![[0, 1, 2]])
        .and_then(|view| view.with_field(ScalarField::signed(text, text, text, vec![0.5; 3])))
        .and_then(|view| {
            let (of_triangle, names) = (vec![0], vec![t()]);
            view.with_groups(FaceGroups { id: t(), label: t(), of_triangle, names })
        })
        .unwrap();
    let mut report = with_histogram(text, text, text, vec![vec![1.0, 2.0]]);
    report.command_line = t();
    report.status = t();
    report.length_unit = t();
    report.warnings = vec![t()];
    report.relations = vec![RelationCurve { name: t(), points: vec![] }];
    let terms = vec![Series { name: t(), values: vec![1.0] }];
    report.energies = Some(EnergyHistory { terms, marks: vec![(0, t())] });
    report.seams = Some(SeamTable {
        title: format!("seams {text}"),
        columns: vec![t()],
        tolerances: vec![None],
        rows: vec![Seam {
            label: t(),
            stage: t(),
            location: DVec3::ZERO,
            size: 1.0,
            path: points,
            values: vec![1.0],
        }],
    });
    report.options = vec![(t(), t())];
    report.metrics.insert(format!("m {text}"), t().into());
    report.run.insert(t(), t().into());
    report.stages.push(view);
    report
}

proptest! {
    #[test]
    fn no_text_adds_a_tag_to_a_page(text in hostile()) {
        let tags = |text: &str| page_of(text).to_html().matches('<').count();
        prop_assert_eq!(tags(&text), tags("harmless"));
    }

    #[test]
    fn histograms_are_well_formed_and_keep_their_title(
        title in hostile(), name in hostile(), unit in hostile(),
        series in vec(vec(number(), 0..40), 1..4),
    ) {
        let figures = with_histogram(&title, &name, &unit, series).figures().unwrap();
        let document = parsed(figure(&figures, "histogram-"));
        let kept = document.root_element().attribute("aria-label").unwrap();
        prop_assert_eq!(kept, readable(&title));
    }

    #[test]
    fn bars_of_a_histogram_count_every_value_once(values in vec(number(), 0..200)) {
        let counted = values.iter().filter(|v| v.abs() <= 1e300).count();
        let figures = with_histogram("t", "n", "", vec![values]).figures().unwrap();
        let document = parsed(figure(&figures, "histogram-n"));
        let bars: Vec<(usize, f64)> = document
            .descendants()
            .filter(|node| node.has_tag_name("rect"))
            .map(|bar| {
                let hint = bar.first_element_child().unwrap().text().unwrap();
                let count = hint.split(' ').next().unwrap().parse().unwrap();
                (count, bar.attribute("height").unwrap().parse().unwrap())
            })
            .collect();
        prop_assert_eq!(bars.iter().map(|bar| bar.0).sum::<usize>(), counted);
        // Heights are as the counts; they are written to two places.
        if let Some(tallest) = bars.iter().max_by_key(|bar| bar.0) {
            for bar in &bars {
                let want = tallest.1 * bar.0 as f64 / tallest.0 as f64;
                prop_assert!((bar.1 - want).abs() < 0.02);
            }
        }
    }

    #[test]
    fn energies_are_well_formed(
        name in hostile(), mark in hostile(), at in 0_usize..40,
        terms in vec(vec(number(), 0..30), 0..5),
    ) {
        let terms = terms.into_iter().map(|values| Series { name: name.clone(), values });
        let marks = vec![(at, mark.clone()), (at / 2, mark)];
        let history = EnergyHistory { terms: terms.collect(), marks };
        let report = Report { energies: Some(history), ..Report::default() };
        parsed(figure(&report.figures().unwrap(), "energies"));
    }
}

proptest! {
    // Each case draws two pictures.
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn figures_of_any_view_are_drawn_under_plain_names(
        text in hostile(), h in vec(number(), 9), k in vec(number(), 9),
        curve in vec([number(), number()], 0..6),
    ) {
        let at = |i: usize| DVec3::new((i / 3) as f64, (i % 3) as f64, 0.1 * i as f64);
        let field = |id: &str, values: &[f64]| ScalarField::signed(id, &text, &text, values.to_vec());
        let triangles = SurfaceView::grid_triangles(3, 3);
        let view = SurfaceView::new(&*text, (0..9).map(at).collect(), vec![DVec3::Z; 9], triangles)
            .and_then(|view| view.with_field(field("H", &h)))
            .and_then(|view| view.with_field(field("K", &k)))
            .unwrap();
        let mut report = Report::new(&*text, &*text);
        report.length_unit = text.clone();
        report.stages = vec![view.clone(), view];
        report.relations = vec![RelationCurve { name: text.clone(), points: curve }];
        let figures = report.figures().unwrap();
        let mut names = std::collections::BTreeSet::new();
        for figure in &figures {
            let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-.".contains(c);
            prop_assert!(figure.name.chars().all(plain) && figure.name.len() < 200);
            prop_assert!(names.insert(&figure.name), "{} twice", figure.name);
            if figure.name.ends_with(".svg") {
                parsed(figure);
            }
        }
        prop_assert_eq!(figures.len(), 6);
    }
}
