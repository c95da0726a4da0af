//! Writes a report with every part filled: a bumpy saddle, the same saddle with its bumps smoothed
//! away, and 900 panels; the energies are made up, everything else is measured on the surfaces.
//!
//! Run with `cargo run -p report --example saddle_report -- saddle.html [figures-folder]`.

use std::error::Error;
use std::f64::consts::PI;

use glam::DVec3;
use report::{
    EnergyHistory, FaceGroups, Histogram, LineRole, LineSet, RelationCurve, Report, ScalarField,
    Seam, SeamTable, Series, SurfaceView,
};

/// A graph z(x, y) over [-12, 12]², in metres.
#[derive(Clone, Copy)]
struct Saddle {
    bumps: f64,
}

/// What the example shows of a point of the graph.
struct Point {
    position: DVec3,
    normal: DVec3,
    h: f64,
    k: f64,
}

impl Saddle {
    fn at(self, u: f64, v: f64) -> Point {
        let (x, y) = (24.0 * u - 12.0, 24.0 * v - 12.0);
        let (a, w) = (self.bumps, PI / 6.0);
        let z = x * y / 30.0 - y * y / 90.0 + a * (w * x).sin() * (w * y).cos();
        let zx = y / 30.0 + a * w * (w * x).cos() * (w * y).cos();
        let zy = x / 30.0 - y / 45.0 - a * w * (w * x).sin() * (w * y).sin();
        let wave = -a * w * w * (w * x).sin() * (w * y).cos();
        let (zxx, zyy) = (wave, wave - 1.0 / 45.0);
        let zxy = 1.0 / 30.0 - a * w * w * (w * x).cos() * (w * y).sin();
        let q = 1.0 + zx * zx + zy * zy;
        let h = ((1.0 + zy * zy) * zxx - 2.0 * zx * zy * zxy + (1.0 + zx * zx) * zyy)
            / (2.0 * q.powf(1.5));
        let k = (zxx * zyy - zxy * zxy) / (q * q);
        Point { position: DVec3::new(x, y, z), normal: DVec3::new(-zx, -zy, 1.0) / q.sqrt(), h, k }
    }
}

/// Points of a grid over a rectangle of the parameter domain.
fn sample(surface: Saddle, [u0, u1]: [f64; 2], [v0, v1]: [f64; 2], n: usize) -> Vec<Point> {
    let part = |i: usize| i as f64 / (n - 1) as f64;
    let at = |k: usize| surface.at(u0 + (u1 - u0) * part(k / n), v0 + (v1 - v0) * part(k % n));
    (0..n * n).map(at).collect()
}

fn view(
    name: &str,
    points: &[Point],
    triangles: Vec<[u32; 3]>,
    input: Saddle,
) -> Result<SurfaceView, Box<dyn Error>> {
    let positions = points.iter().map(|p| p.position).collect();
    let normals = points.iter().map(|p| p.normal).collect();
    let field = |f: fn(&Point) -> f64| points.iter().map(f).collect::<Vec<f64>>();
    let deviation = points.iter().map(|p| {
        let (u, v) = ((p.position.x + 12.0) / 24.0, (p.position.y + 12.0) / 24.0);
        (p.position - input.at(u, v).position).length()
    });
    let deviation = deviation.collect();
    Ok(SurfaceView::new(name, positions, normals, triangles)?
        .with_field(ScalarField::mean_curvature(field(|p| p.h), "m"))?
        .with_field(ScalarField::gaussian_curvature(field(|p| p.k), "m"))?
        .with_field(ScalarField::kappa1(field(|p| p.h + (p.h * p.h - p.k).sqrt()), "m"))?
        .with_field(ScalarField::kappa2(field(|p| p.h - (p.h * p.h - p.k).sqrt()), "m"))?
        .with_field(ScalarField::deviation(deviation, "m"))?)
}

fn whole(name: &str, surface: Saddle, input: Saddle) -> Result<SurfaceView, Box<dyn Error>> {
    let points = sample(surface, [0.0, 1.0], [0.0, 1.0], 120);
    let net = sample(surface, [0.0, 1.0], [0.0, 1.0], 13);
    let net: Vec<DVec3> = net.iter().map(|p| p.position + 0.02 * p.normal).collect();
    let strokes = sample(surface, [0.02, 0.98], [0.02, 0.98], 24);
    let strokes = strokes.iter().map(|p| {
        let along = DVec3::new(1.0, 1.0, 0.0);
        let along = (along - p.normal * along.dot(p.normal)).normalize() * 0.35;
        vec![p.position - along, p.position + along]
    });
    let strokes = LineSet::new("strokes", "diagonals", LineRole::Directions, strokes.collect());
    let triangles = SurfaceView::grid_triangles(120, 120);
    Ok(view(name, &points, triangles, input)?
        .with_lines(LineSet::control_net(&net, 13, 13))?
        .with_lines(strokes)?)
}

/// 30 x 30 panels; every panel of a mold gets the height offset of its mold, which leaves gaps.
fn panels(surface: Saddle, input: Saddle) -> Result<SurfaceView, Box<dyn Error>> {
    let (panels, n) = (30, 6);
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    let (mut of_panel, mut of_mold) = (Vec::new(), Vec::new());
    for panel in 0..panels * panels {
        let side = |i: usize| {
            let (gap, step) = (0.0006, 1.0 / panels as f64);
            [i as f64 * step + gap, (i + 1) as f64 * step - gap]
        };
        let part = sample(surface, side(panel / panels), side(panel % panels), n);
        let middle = &part[n * n / 2];
        let mold = ((middle.k * 4000.0).floor().abs() as u32 * 5 + (middle.h * 200.0) as u32) % 64;
        let base = points.len() as u32;
        for t in SurfaceView::grid_triangles(n, n) {
            triangles.push(t.map(|v| v + base));
            of_panel.push(panel as u32);
            of_mold.push(mold);
        }
        points.extend(part);
    }
    Ok(view("panels", &points, triangles, input)?
        .with_groups(FaceGroups::numbered("molds", "mold", of_mold))?
        .with_groups(FaceGroups::numbered("panels", "panel", of_panel))?)
}

/// Angle in degrees between normals one panel apart, a stand-in for the kink of a flat panel.
fn kinks(surface: Saddle) -> Vec<f64> {
    let grid = sample(surface, [0.0, 1.0], [0.0, 1.0], 31);
    let angle = |i: usize, j: usize| grid[i].normal.angle_between(grid[j].normal).to_degrees();
    (0..30 * 31).map(|i| angle(i, i + 31) / 20.0).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let page = arguments.next().unwrap_or_else(|| "saddle.html".to_owned());
    let (before, after) = (Saddle { bumps: 0.25 }, Saddle { bumps: 0.0 });

    let mut report = Report::new(
        "Weingarten optimisation of a saddle",
        "umbilic weingarten saddle.ron -o a.step",
    );
    report.status = "converged".to_owned();
    report.length_unit = "m".to_owned();
    report.warnings.push("the energies below are made up to show the plot".to_owned());
    report.stages.push(whole("before", before, before)?);
    report.stages.push(whole("after", after, before)?);
    report.stages.push(panels(after, before)?);
    let line = |i: i32| [-0.006 + 0.001 * f64::from(i), -0.0004 - 0.00005 * f64::from(i)];
    let points = (0..=12).map(line).collect();
    report.relations.push(RelationCurve { name: "relation".to_owned(), points });
    report.histograms.push(Histogram {
        id: "kinks".to_owned(),
        title: "Kinks along seams".to_owned(),
        quantity: "kink".to_owned(),
        unit: "°".to_owned(),
        series: vec![
            Series { name: "before".to_owned(), values: kinks(before) },
            Series { name: "after".to_owned(), values: kinks(after) },
        ],
        tolerance: Some(0.15),
    });
    let fall =
        |from: f64, rate: f64| (0..25).map(|i| from * (-rate * f64::from(i)).exp()).collect();
    report.energies = Some(EnergyHistory {
        terms: vec![
            Series { name: "alignment".to_owned(), values: fall(1.0, 0.7) },
            Series { name: "fairness".to_owned(), values: fall(0.02, 0.05) },
            Series { name: "closeness".to_owned(), values: fall(0.003, -0.02) },
        ],
        marks: vec![(8, "14x10".to_owned()), (16, "18x14".to_owned())],
    });
    let worst = [(0.12, 0.93), (0.9, 0.07), (0.5, 0.5)].map(|(u, v)| {
        let path = (0..12).map(|i| after.at(u, v + 0.003 * f64::from(i)).position).collect();
        Seam {
            label: format!("seam at u = {u}, v = {v}"),
            stage: "panels".to_owned(),
            location: after.at(u, v).position,
            size: 1.5,
            path,
            values: vec![0.3 - 0.2 * v, 0.4 * u],
        }
    });
    report.seams = Some(SeamTable {
        title: String::new(),
        columns: vec!["kink [°]".to_owned(), "gap [mm]".to_owned()],
        tolerances: vec![Some(0.15), None],
        rows: worst.to_vec(),
    });
    report.option("levels", "10x8,14x10,18x14");
    report.option("iterations", 10);
    report.metrics.insert("alignment_rms".to_owned(), 0.003_217.into());
    report.metrics.insert("ms_per_iteration".to_owned(), 7.3.into());
    report.run.insert("threads".to_owned(), 2.into());
    std::fs::write(page, report.to_html())?;
    if let Some(folder) = arguments.next() {
        for figure in report.figures()? {
            std::fs::write(std::path::Path::new(&folder).join(figure.name), figure.bytes)?;
        }
    }
    Ok(())
}
