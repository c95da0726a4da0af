//! Pictures as a reader gets them: where things are, what colour they have, and the same bytes
//! every time.

use crate::common;
use std::path::Path;

use glam::DVec3;
use report::{FaceGroups, Report, ScalarField, SurfaceView};

const WIDTH: usize = 1200;
const HEIGHT: usize = 900;
/// Where the surface's part of the picture begins, as the legend takes the left.
const LEGEND: usize = 250;
const PAPER: [u8; 3] = [0xfb, 0xfa, 0xf8];

struct Picture(Vec<[u8; 3]>);

impl Picture {
    fn read(png: &[u8]) -> Self {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((frame.width as usize, frame.height as usize), (WIDTH, HEIGHT));
        Self(bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
    }

    fn at(&self, x: usize, y: usize) -> [u8; 3] {
        self.0[y * WIDTH + x]
    }
}

/// The picture whose file is called `name`.
fn picture(report: &Report, name: &str) -> Picture {
    let figures = report.figures().unwrap();
    Picture::read(&figures.iter().find(|f| f.name == name).expect(name).bytes)
}

/// A square of side 2 that faces the camera, which looks from azimuth -60° and elevation 28°.
fn facing_square(value: f64) -> SurfaceView {
    let (azimuth, elevation) = (-60_f64.to_radians(), 28_f64.to_radians());
    let (level, up) = (elevation.cos(), elevation.sin());
    let back = DVec3::new(level * azimuth.cos(), level * azimuth.sin(), up);
    let right = DVec3::new(-azimuth.sin(), azimuth.cos(), 0.0);
    let up = back.cross(right);
    let corner = |a: f64, b: f64| a * right + b * up;
    let positions =
        vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    SurfaceView::new("square", positions, vec![back; 4], vec![[0, 1, 2], [0, 2, 3]])
        .and_then(|view| {
            view.with_field(ScalarField {
                range: Some([-1.0, 1.0]),
                ..ScalarField::signed("f", "field", "m", vec![value; 4])
            })
        })
        .and_then(|view| view.with_groups(FaceGroups::numbered("halves", "half", vec![0, 1])))
        .unwrap()
}

fn report_of(view: SurfaceView) -> Report {
    let mut report = Report::new("", "");
    report.length_unit = "m".into();
    report.stages.push(view);
    report
}

#[test]
fn a_square_that_faces_the_camera_fills_its_rectangle_and_no_more() {
    let picture = picture(&report_of(facing_square(0.5)), "square-f.png");
    // 90 % of the height: 45 to 855, and as wide around the middle of what the legend leaves.
    let (left, right, top, bottom) = (725 - 405, 725 + 405, 450 - 405, 450 + 405);
    for y in 0..HEIGHT {
        for x in LEGEND..WIDTH {
            let colour = picture.at(x, y);
            let past = |v: usize, lo: usize, hi: usize, by: usize| v + by < lo || v >= hi + by;
            let outside = past(x, left, right, 2) || past(y, top, bottom, 2);
            let inside = !past(x, left + 2, right - 2, 0) && !past(y, top + 2, bottom - 2, 0);
            if outside {
                assert_eq!(colour, PAPER, "{x} {y}");
            }
            if inside {
                // Half-way to the orange end of the map: red over green over blue.
                assert!(colour[0] > colour[1] && colour[1] > colour[2] + 40, "{x} {y}: {colour:?}");
            }
        }
    }
}

#[test]
fn groups_have_their_colours_in_the_picture_and_in_the_list() {
    let picture = picture(&report_of(facing_square(0.0)), "square-halves.png");
    // The diagonal from lower left to upper right parts the two triangles.
    let (below, above) = (picture.at(900, 700), picture.at(500, 250));
    assert_ne!(below, above);
    let unlit = |lit: [u8; 3]| {
        // Light changes the size of a colour, hardly its direction.
        let size = f64::from(lit.iter().map(|c| u32::from(*c)).sum::<u32>());
        lit.map(|c| f64::from(c) / size)
    };
    let listed: Vec<[f64; 3]> = (0..HEIGHT).map(|y| unlit(picture.at(43, y))).collect();
    for seen in [below, above].map(unlit) {
        let close = |c: &&[f64; 3]| (0..3).all(|k| (c[k] - seen[k]).abs() < 0.02);
        // A swatch of the list is 14 pixels high.
        assert_eq!(listed.iter().filter(close).count(), 14, "{seen:?}");
    }
}

#[test]
fn the_map_has_its_colours_in_order_beside_its_numbers() {
    let picture = picture(&report_of(facing_square(0.0)), "square-f.png");
    let bar: Vec<[u8; 3]> = (0..HEIGHT).map(|y| picture.at(46, y)).collect();
    let [plus, zero, minus] = [[0x66, 0x1f, 0x05], [0xf3, 0xf1, 0xec], [0x10, 0x2c, 0x57]];
    let row = |colour: [u8; 3]| {
        let distance = |c: &[u8; 3]| (0..3).map(|k| c[k].abs_diff(colour[k]) as u32).sum::<u32>();
        let (row, nearest) = bar.iter().enumerate().min_by_key(|(_, c)| distance(c)).unwrap();
        assert!(distance(nearest) < 8, "{nearest:?} {colour:?}");
        row
    };
    assert!(row(plus) < row(zero) && row(zero) < row(minus));
    assert!((row(plus) + row(minus)).abs_diff(2 * row(zero)) < 12);
}

#[test]
fn nothing_is_written_over_the_surface_or_cut_off() {
    let name = "an uncommonly long name of a stage with a Wörterbuch of words, и ещё, καὶ ἄλλα ☃";
    let square = facing_square(0.5);
    let (positions, normals) = (square.positions().to_vec(), square.normals().to_vec());
    let field = ScalarField::signed("f", &name.repeat(3), &name.repeat(2), vec![1234.5; 4]);
    let view = SurfaceView::new(name, positions, normals, square.triangles().to_vec())
        .and_then(|view| view.with_field(field))
        .and_then(|view| {
            let names = vec![name.repeat(2); 4];
            let (id, label, of_triangle) = ("g".into(), name.into(), vec![0, 3]);
            view.with_groups(FaceGroups { id, label, of_triangle, names })
        })
        .unwrap();
    let figures = report_of(view).figures().unwrap();
    let pictures: Vec<&report::Figure> =
        figures.iter().filter(|f| f.name.ends_with(".png")).collect();
    assert_eq!(pictures.len(), 2);
    for file in pictures {
        let picture = Picture::read(&file.bytes);
        // The column between legend and surface, and the margin around the picture, are empty.
        for y in 0..HEIGHT {
            assert!((LEGEND..317).chain(0..30).all(|x| picture.at(x, y) == PAPER), "{y}");
        }
        for x in 0..LEGEND {
            assert!((0..30).chain(HEIGHT - 30..HEIGHT).all(|y| picture.at(x, y) == PAPER), "{x}");
        }
    }
}

/// Two triangles one behind the other, with numbers that need no root to write down.
fn two_triangles() -> SurfaceView {
    let near = [DVec3::new(0.0, -1.0, 0.0), DVec3::new(2.0, -1.0, 0.5), DVec3::new(1.0, 0.0, 2.0)];
    let far = [DVec3::new(0.0, 1.0, 0.0), DVec3::new(2.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 2.5)];
    let values = vec![-2.0, 0.0, 1.0, f64::NAN, 3.0, 0.5];
    let positions = [near, far].concat();
    let view = SurfaceView::new(
        "two triangles",
        positions,
        vec![-DVec3::Y; 6],
        vec![[0, 1, 2], [3, 4, 5]],
    );
    view.and_then(|view| view.with_field(ScalarField::mean_curvature(values, "m")))
        .and_then(|view| view.with_groups(FaceGroups::numbered("parts", "часть ☃", vec![0, 1])))
        .unwrap()
}

/// The expected pictures were drawn on x86-64; another machine, other instructions or another number
/// of threads must give the same pixels.
#[test]
fn a_known_scene_has_the_same_pixels_on_every_machine() {
    let figures = report_of(two_triangles()).figures().unwrap();
    let names = ["two-triangles-h.png", "two-triangles-parts.png"];
    assert_eq!(figures.iter().map(|f| f.name.as_str()).collect::<Vec<_>>(), names);
    let expected = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/all/pictures");
    for figure in figures {
        let got = Picture::read(&figure.bytes);
        let want = std::fs::read(expected.join(&figure.name)).map(|png| Picture::read(&png));
        let differing = match want {
            Ok(want) => got.0.iter().zip(&want.0).filter(|(a, b)| a != b).count(),
            Err(_) => WIDTH * HEIGHT,
        };
        if differing > 0 {
            let drawn = Path::new(env!("CARGO_TARGET_TMPDIR")).join(&figure.name);
            std::fs::write(&drawn, &figure.bytes).unwrap();
            panic!(
                "{differing} pixels of {} differ from the one in tests/all/pictures; if the change is \
                 meant, look at {} and copy it there",
                figure.name,
                drawn.display()
            );
        }
    }
}

#[test]
fn pictures_repeat_for_any_number_of_threads() {
    let drawn = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| common::tori().figures().unwrap())
    };
    let first = drawn(1);
    for threads in [1, 2, 5] {
        assert!(drawn(threads) == first, "{threads} threads");
    }
}
