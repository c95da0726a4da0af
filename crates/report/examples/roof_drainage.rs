//! Where does rain stand on a roof? Colours a shell roof by its slope, marks what is flatter than
//! 2°, and writes a page with a 3D view, pictures and plots into a folder.
//!
//! Run with `cargo run -p report --example roof_drainage -- FOLDER`, then open `FOLDER/roof.html`.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::PathBuf;

use glam::DVec3;
use report::{FaceGroups, Histogram, LineRole, LineSet, Report, ScalarField, Series, SurfaceView};

/// Length and width of the roof in metres, points along each.
const SIDES: [f64; 2] = [24.0, 16.0];
const POINTS: [usize; 2] = [97, 65];
/// Rain stands on what is flatter, in degrees.
const FLATTEST: f64 = 2.0;

/// Height and slopes dz/dx, dz/dy of the roof: a low vault with waves along it.
fn roof(x: f64, y: f64) -> (f64, f64, f64) {
    let (w, wave, vault) = (TAU / 12.0, 0.12, 0.012);
    let z = 4.0 - vault * y * y + wave * (w * x).cos() + 0.004 * x * y;
    (z, -wave * w * (w * x).sin() + 0.004 * y, -2.0 * vault * y + 0.004 * x)
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "roof-report".to_owned()));
    std::fs::create_dir_all(&folder)?;

    let place = |i: usize, k: usize| SIDES[k] * (i as f64 / (POINTS[k] - 1) as f64 - 0.5);
    let (mut positions, mut normals, mut slopes) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..POINTS[0] {
        for j in 0..POINTS[1] {
            let (x, y) = (place(i, 0), place(j, 1));
            let (z, zx, zy) = roof(x, y);
            positions.push(DVec3::new(x, y, z));
            normals.push(DVec3::new(-zx, -zy, 1.0).normalize());
            slopes.push(zx.hypot(zy).atan().to_degrees());
        }
    }
    let triangles = SurfaceView::grid_triangles(POINTS[0], POINTS[1]);
    let is_flat = |t: &[u32; 3]| t.iter().all(|v| slopes[*v as usize] < FLATTEST);
    let drainage = FaceGroups {
        id: "drainage".to_owned(),
        label: "drainage".to_owned(),
        of_triangle: triangles.iter().map(|t| u32::from(is_flat(t))).collect(),
        names: vec!["rain runs off".to_owned(), format!("flatter than {FLATTEST}°")],
    };
    let eaves = [0, POINTS[1] - 1]
        .map(|j| (0..POINTS[0]).map(|i| positions[i * POINTS[1] + j]).collect::<Vec<DVec3>>());

    let mut report = Report::new("Where does rain stand on this roof?", "");
    report.length_unit = "m".to_owned();
    let flat = slopes.iter().filter(|slope| **slope < FLATTEST).count();
    report.warnings.push(format!("{flat} of {} points lie too flat", slopes.len()));
    report.histograms.push(Histogram {
        id: "slope".to_owned(),
        title: "Slope of the roof".to_owned(),
        quantity: "slope".to_owned(),
        unit: "°".to_owned(),
        series: vec![Series { name: "roof".to_owned(), values: slopes.clone() }],
        tolerance: Some(FLATTEST),
    });
    report.stages.push(
        SurfaceView::new("roof", positions, normals, triangles)?
            .with_field(ScalarField::magnitude("slope", "slope against the horizon", "°", slopes))?
            .with_groups(drainage)?
            .with_lines(LineSet::new("eaves", "eaves", LineRole::Curves, eaves.to_vec()))?,
    );
    std::fs::write(folder.join("roof.html"), report.to_html())?;
    for figure in report.figures()? {
        std::fs::write(folder.join(figure.name), figure.bytes)?;
    }
    Ok(())
}
