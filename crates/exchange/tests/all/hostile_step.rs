//! STEP files that crash or mislead other readers: each is refused with a line and a reason, or
//! read as what it is, and none takes long.

use exchange::read_step;
use std::time::{Duration, Instant};

const BASE: &str = "ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));
ENDSEC;
DATA;
#21=GEOMETRIC_SET('',(#30));
#30=B_SPLINE_SURFACE_WITH_KNOTS('skin',2,2,((#40,#41,#42),(#43,#44,#45),(#46,#47,#48)),.UNSPECIFIED.,.F.,.F.,.U.,(3,3),(3,3),(0.,1.),(0.,1.),.UNSPECIFIED.);
#40=CARTESIAN_POINT('',(0.,0.,0.));
#41=CARTESIAN_POINT('',(0.,1.,0.5));
#42=CARTESIAN_POINT('',(0.,2.,0.));
#43=CARTESIAN_POINT('',(1.,0.,0.5));
#44=CARTESIAN_POINT('',(1.,1.,1.));
#45=CARTESIAN_POINT('',(1.,2.,0.5));
#46=CARTESIAN_POINT('',(2.,0.,0.));
#47=CARTESIAN_POINT('',(2.,1.,0.5));
#48=CARTESIAN_POINT('',(2.,2.,0.));
ENDSEC;
END-ISO-10303-21;
";

/// What other readers have crashed on, hung on or swallowed.
const LIMIT: Duration = Duration::from_secs(5);

fn message(text: &[u8]) -> String {
    let begin = Instant::now();
    let message = read_step(text).unwrap_err().to_string();
    assert!(begin.elapsed() < LIMIT, "{message} took {:?}", begin.elapsed());
    assert!(message.len() < 400, "{message}");
    message
}

#[test]
fn the_base_is_sound() {
    assert_eq!(read_step(BASE.as_bytes()).unwrap().surfaces[0].name, "skin");
}

#[test]
fn faulty_numbers_and_counts() {
    let cases = [
        ("(0.,1.,0.5)", "(0.,NAN,0.5)", "line 10: expected a finite number, found `NAN`"),
        ("(0.,1.,0.5)", "(0.,1E999,0.5)", "line 10: expected a finite number, found `1E999`"),
        ("(0.,1.,0.5)", "(0.,,0.5)", "line 10: expected a finite number"),
        ("(0.,1.,0.5)", "(0.,1.)", "line 10: a point with 2 coordinates"),
        ("(0.,1.,0.5)", "(0.,1.,2.,3.)", "line 10: a point with more than 3"),
        ("'skin',2,2", "'skin',2147483647,2", "line 8: degree 2147483647 is not between 1 and 15"),
        ("'skin',2,2", "'skin',-1,2", "line 8: degree -1 is not between"),
        ("'skin',2,2", "'skin',0,2", "line 8: degree 0 is not between"),
        ("'skin',2,2", "'skin',99999999999999999999,2", "line 8: expected a whole number"),
        ("'skin',2,2", "'skin',5,2", "line 8: the multiplicities in u add up to 6, but 3"),
        (
            "(3,3),(3,3)",
            "(2000000000,3),(3,3)",
            "line 8: the multiplicities in u add up to 2000000003",
        ),
        ("(3,3),(3,3)", "(-3,9),(3,3)", "line 8: multiplicity -3 of a knot"),
        (
            "(3,3),(3,3)",
            "(9223372036854775807,3),(3,3)",
            "line 8: multiplicity 9223372036854775807",
        ),
        ("(3,3),(3,3)", "(),(3,3)", "line 8: the multiplicities in u add up to 0"),
        ("(3,3),(3,3)", "(6),(3,3)", "line 8: more knots for 1 multiplicities"),
        ("(0.,1.),(0.,1.)", "(1.,0.),(0.,1.)", "line 8: #30: knot 2 is 1 and the next 0"),
        ("(0.,1.),(0.,1.)", "(1.,1.),(0.,1.)", "line 8: #30: the domain [1, 1] has no length"),
        ("(0.,1.),(0.,1.)", "(0.,INF),(0.,1.)", "line 8: expected a finite number, found `INF`"),
        ("(0.,1.),(0.,1.)", "(0.),(0.,1.)", "line 8: 1 knots for 2 multiplicities"),
        ("(#46,#47,#48)", "(#46,#47)", "line 8: row 3 of the net has 2 entries, row 1 has 3"),
        ("(#46,#47,#48)", "()", "line 8: row 3 of the net has 0 entries"),
        ("((#40,#41,#42),(#43,#44,#45),(#46,#47,#48))", "()", "line 8: the net is empty"),
    ];
    for (from, to, want) in cases {
        assert!(BASE.contains(from), "{from}");
        let message = message(BASE.replacen(from, to, 1).as_bytes());
        assert!(message.starts_with(want), "{message}, not {want}");
    }
}

#[test]
fn faulty_structure() {
    let cases = [
        ("#48=", "#49=", "line 8: #48 is named here and defined nowhere"),
        ("#48=CARTESIAN_POINT", "#48=DIRECTION", "line 8: #48 is not a point"),
        ("('',(#30))", "('',(#21))", "line 7: #21 contains itself"),
        ("#41=", "#40=", "line 10: #40 is defined twice"),
        ("ISO-10303-21", "ISO-10303-22", "line 1: the file does not begin with ISO-10303-21"),
        ("END-ISO-10303-21;", "", "line 20: the file ends before END-ISO-10303-21"),
        (
            "#42=CARTESIAN_POINT('',(0.,2.,0.));",
            "nonsense;",
            "line 11: `nonsense;` is not an instance",
        ),
        ("#42=", "#x=", "line 11: expected a reference"),
        ("#42=", "#99999999999999999999=", "line 11: expected a reference"),
        ("(0.,2.,0.));", "(0.,2.,0.);", "line 11: a `;` inside brackets"),
        ("(0.,2.,0.));", "(0.,2.,0.)));", "line 11: a `)` without its `(`"),
        ("'',(0.,2.,0.)", "',(0.,2.,0.)", "line"),
        ("B_SPLINE_SURFACE_WITH_KNOTS", "PLANE", "the file has no surface"),
        ("#40,#41", "#40;#41", "line 8: a `;` inside brackets"),
        ("#40,#41", "#40 #41", "line 8: expected `,`"),
        ("'skin',2", "2", "line 8: expected a text in quotes"),
    ];
    for (from, to, want) in cases {
        assert!(BASE.contains(from), "{from}");
        let message = message(BASE.replacen(from, to, 1).as_bytes());
        assert!(message.starts_with(want), "{message}, not {want}");
    }
}

#[test]
fn every_truncation_is_refused() {
    let end = BASE.find("END-ISO").unwrap();
    for cut in 0..end {
        let message = message(&BASE.as_bytes()[..cut]);
        assert!(message.starts_with("line"), "{cut}: {message}");
    }
}

#[test]
fn every_single_byte_may_change() {
    for at in 0..BASE.len() {
        for byte in [b'(', b')', b'\'', b'#', b';', b'9', b',', 0, 0xff] {
            let mut text = BASE.as_bytes().to_vec();
            text[at] = byte;
            if let Err(error) = read_step(&text) {
                assert!(error.to_string().len() < 400, "{at}: {error}");
            }
        }
    }
}

#[test]
fn deep_and_endless_files() {
    let parentheses = BASE.replacen("(0.,2.,0.)", &"(".repeat(200_000), 1);
    assert!(message(parentheses.as_bytes()).contains("deeper than 64"));
    let comment = BASE.replacen("#42=", "/* no end #42=", 1);
    assert!(message(comment.as_bytes()).starts_with("line"));
    assert!(message(b"").starts_with("line 1"));
    assert!(message(&[0xff; 1000]).starts_with("line 1"));
    // Hashes that are no references, faulty points and texts must not cost a walk each.
    let line = format!("#50=THING({});\n", "#x,".repeat(300_000));
    let hashes = BASE.replacen("#40=", &format!("{line}#40="), 1);
    let begin = Instant::now();
    assert!(read_step(hashes.as_bytes()).is_ok());
    let many: String =
        (100..60_000).map(|k| format!("#{k}=CARTESIAN_POINT('',(0.,1.));\n")).collect();
    assert!(read_step(BASE.replacen("#40=", &format!("{many}#40="), 1).as_bytes()).is_ok());
    assert!(begin.elapsed() < LIMIT, "{:?}", begin.elapsed());
}

#[test]
fn many_faces_on_one_surface_take_it_once() {
    let faces: String =
        (100..20_000).map(|k| format!("#{k}=ADVANCED_FACE('f{k}',(),#30,.T.);\n")).collect();
    let begin = Instant::now();
    let model = read_step(BASE.replacen("#40=", &format!("{faces}#40="), 1).as_bytes()).unwrap();
    assert_eq!((model.surfaces.len(), model.surfaces[0].name.as_str()), (1, "f100"));
    assert!(model.warnings[0].starts_with("19899 faces share"), "{:?}", model.warnings);
    assert!(begin.elapsed() < LIMIT, "{:?}", begin.elapsed());
}

#[test]
fn a_dangling_reference_that_nobody_needs_is_a_warning() {
    let text = BASE.replacen("(#30)", "(#30,#77)", 1);
    let model = read_step(text.as_bytes()).unwrap();
    assert_eq!(model.warnings, ["#21 names #77, which is defined nowhere; it was not needed"]);
}

#[test]
fn blanks_comments_and_lower_case_are_allowed() {
    let text = BASE
        .replacen("#30=B", "#30 =\n /* a ; ' comment */ B", 1)
        .replacen("'skin',2", "'it''s \\X2\\03B1\\X0\\' , 2", 1)
        .replacen("(0.,2.,0.)", "( 0. , +2.E+00 , -0.0E-3 )", 1);
    let model = read_step(text.as_bytes()).unwrap();
    assert_eq!(model.surfaces[0].name, "it's α");
    assert_eq!(model.surfaces[0].surface.control_points()[2].y, 2.0);
}

#[test]
fn rational_weights_are_checked() {
    let complex = |weights: &str| {
        BASE.replacen(
            "B_SPLINE_SURFACE_WITH_KNOTS('skin',2,2,((#40,#41,#42),(#43,#44,#45),(#46,#47,#48)),.UNSPECIFIED.,.F.,.F.,.U.,",
            "(BOUNDED_SURFACE()B_SPLINE_SURFACE(2,2,((#40,#41,#42),(#43,#44,#45),(#46,#47,#48)),.UNSPECIFIED.,.F.,.F.,.U.)B_SPLINE_SURFACE_WITH_KNOTS(",
            1,
        )
        .replacen(
            ",.UNSPECIFIED.);\n#40",
            &format!(",.UNSPECIFIED.)RATIONAL_B_SPLINE_SURFACE({weights})REPRESENTATION_ITEM('r'));\n#40"),
            1,
        )
    };
    let model = read_step(complex("((1.,1.,1.),(1.,2.,1.),(1.,1.,1.))").as_bytes()).unwrap();
    assert_eq!(model.surfaces[0].surface.weights().unwrap()[4], 2.0);
    assert_eq!(model.surfaces[0].name, "r");
    let cases = [
        ("((1.,1.,1.),(1.,0.,1.),(1.,1.,1.))", "line 8: #30: weight 4 is 0"),
        ("((1.,1.,1.),(1.,-2.,1.),(1.,1.,1.))", "line 8: #30: weight 4 is -2"),
        ("((1.,1.,1.),(1.,NAN,1.),(1.,1.,1.))", "line 8: expected a finite number"),
        ("((1.,1.,1.),(1.,1.,1.))", "line 8: 2 x 3 weights for 3 x 3 control points"),
        ("((1.,1.),(1.,1.),(1.,1.))", "line 8: 3 x 2 weights for 3 x 3"),
        ("((1.,1.,1.),(1.,1.))", "line 8: row 2 of the net"),
        ("1.", "line 8: expected `(`"),
    ];
    for (weights, want) in cases {
        let message = message(complex(weights).as_bytes());
        assert!(message.starts_with(want), "{message}, not {want}");
    }
}
