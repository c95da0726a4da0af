//! Views, histograms and the seam table of a paneling.

use crate::failure::{Failure, refused};
use paneling::{PanelSet, Paneling};
use report::{
    FaceGroups, Histogram, LineRole, LineSet, Report, ScalarField, Seam, SeamTable, Series,
    SurfaceView,
};

/// Rows of the seam table.
const WORST: usize = 16;

/// A view of the panels on their molds.
///
/// Every panel has one value per field: the curvatures of the design at its middle, which its mold
/// was chosen by, and its worst kink, gap and deviation.
pub(crate) fn panel_view(
    name: &str,
    set: &PanelSet,
    paneling: &Paneling,
    length_unit: &str,
) -> Result<SurfaceView, Failure> {
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    let (mut of_panel, mut of_mold, mut panel_of_vertex) = (Vec::new(), Vec::new(), Vec::new());
    for p in 0..set.len() {
        let mesh = paneling.panel_mesh(set, p);
        let base = positions.len() as u32;
        for t in mesh.triangles {
            triangles.push(t.map(|v| v + base));
            of_panel.push(p as u32);
            of_mold.push(paneling.labels[p] as u32);
        }
        panel_of_vertex.extend(std::iter::repeat_n(p, mesh.positions.len()));
        positions.extend(mesh.positions);
        normals.extend(mesh.normals);
    }
    let worst = paneling.measures.worst_of_panels();
    let spread = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        panel_of_vertex.iter().map(|&p| of(p)).collect()
    };
    let h = ScalarField::mean_curvature(spread(&|p| set.curvatures()[p][0]), length_unit);
    let k = ScalarField::gaussian_curvature(spread(&|p| set.curvatures()[p][1]), length_unit);
    let kink = spread(&|p| worst[p][0].to_degrees());
    let kink = ScalarField::magnitude("kink", "worst kink of a panel", "°", kink);
    let gap = spread(&|p| worst[p][1]);
    let gap = ScalarField::magnitude("gap", "worst gap of a panel", length_unit, gap);
    let deviation = spread(&|p| paneling.measures.deviations[p]);
    let deviation = ScalarField::magnitude(
        "panel-deviation",
        "deviation from the design",
        length_unit,
        deviation,
    );

    let kinds = |m: usize| format!("mold {m} ({})", paneling.molds[m].kind.name());
    let names = (0..paneling.molds.len()).map(kinds).collect();
    let molds = FaceGroups {
        id: "molds".to_owned(),
        label: "molds".to_owned(),
        of_triangle: of_mold,
        names,
    };
    let borders = (0..set.len()).map(|p| {
        let border = set.border(p);
        border.iter().chain(border.first()).copied().collect()
    });
    let mut seams = LineSet::new("seams", "seams of the design", LineRole::Mesh, borders.collect());
    seams.visible = true;
    SurfaceView::new(name, positions, normals, triangles)
        .and_then(|v| v.with_groups(molds))
        .and_then(|v| v.with_groups(FaceGroups::numbered("panels", "panel", of_panel)))
        .and_then(|v| v.with_field(k))
        .and_then(|v| v.with_field(h))
        .and_then(|v| v.with_field(kink))
        .and_then(|v| v.with_field(gap))
        .and_then(|v| v.with_field(deviation))
        .and_then(|v| v.with_lines(seams))
        .map_err(refused)
}

/// The page of one paneling: the panels on their molds, kinks, gaps and the worst seams. `bounds` as
/// of [`seam_table`].
pub(crate) fn paneling_report(
    set: &PanelSet,
    paneling: &Paneling,
    bounds: [Option<f64>; 2],
    length_unit: &str,
) -> Result<Report, Failure> {
    let mut report = super::new("Panels and molds");
    report.length_unit = length_unit.to_owned();
    report.stages.push(panel_view("panels", set, paneling, length_unit)?);
    report.histograms.push(kink_histogram(&[("panels", paneling)], bounds[0]));
    report.histograms.push(gap_histogram(&[("panels", paneling)], bounds[1], length_unit));
    report.seams = Some(seam_table("panels", set, paneling, bounds, length_unit));
    Ok(report)
}

/// Kinks of several panelings at all samples of all seams, in degrees.
pub(crate) fn kink_histogram(
    panelings: &[(&str, &Paneling)],
    tolerance_deg: Option<f64>,
) -> Histogram {
    let series = panelings.iter().map(|(name, paneling)| {
        let kinks = paneling.measures.seams.iter().flat_map(|s| s.kinks);
        Series { name: (*name).to_owned(), values: kinks.map(f64::to_degrees).collect() }
    });
    Histogram {
        id: "kinks".to_owned(),
        title: "Kinks along seams".to_owned(),
        quantity: "kink".to_owned(),
        unit: "°".to_owned(),
        series: series.collect(),
        tolerance: tolerance_deg,
    }
}

/// Gaps of several panelings at all samples of all seams.
pub(crate) fn gap_histogram(
    panelings: &[(&str, &Paneling)],
    tolerance: Option<f64>,
    length_unit: &str,
) -> Histogram {
    let series = panelings.iter().map(|(name, paneling)| {
        let gaps = paneling.measures.seams.iter().flat_map(|s| s.gaps);
        Series { name: (*name).to_owned(), values: gaps.collect() }
    });
    Histogram {
        id: "gaps".to_owned(),
        title: "Gaps along seams".to_owned(),
        quantity: "gap".to_owned(),
        unit: length_unit.to_owned(),
        series: series.collect(),
        tolerance,
    }
}

/// The seams with the largest kinks, and those with the largest gaps, each once. `bounds` are the
/// largest kink in degrees and the largest gap that were asked for.
pub(crate) fn seam_table(
    stage: &str,
    set: &PanelSet,
    paneling: &Paneling,
    bounds: [Option<f64>; 2],
    length_unit: &str,
) -> SeamTable {
    let mut chosen = paneling.measures.worst_kinks(WORST - WORST / 4);
    let gaps = paneling.measures.worst_gaps(WORST);
    let further = gaps.into_iter().filter(|s| !chosen.contains(s)).collect::<Vec<_>>();
    chosen.extend(further);
    chosen.truncate(WORST);
    let rows = chosen.into_iter().map(|s| {
        let (seam, measure) = (&set.seams()[s], &paneling.measures.seams[s]);
        let path = set.seam_points(seam).to_vec();
        let (a, b) = (path[0], path[path.len() - 1]);
        let worst = (0..path.len()).max_by(|&i, &j| measure.kinks[i].total_cmp(&measure.kinks[j]));
        Seam {
            label: format!("panels {} and {}", measure.panels[0], measure.panels[1]),
            stage: stage.to_owned(),
            location: path[worst.unwrap_or(0)],
            size: 2.0 * a.distance(b),
            path,
            values: vec![measure.max_kink().to_degrees(), measure.max_gap()],
        }
    });
    let gap =
        if length_unit.is_empty() { "gap".to_owned() } else { format!("gap [{length_unit}]") };
    SeamTable {
        title: format!("Worst seams of {stage}"),
        columns: vec!["kink [°]".to_owned(), gap],
        tolerances: bounds.to_vec(),
        rows: rows.collect(),
    }
}
