//! Which claims can be checked, from what, and how exactly: the one table of it.

/// How far a recomputed value may be from the claim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Share of the claim.
    pub relative: f64,
    /// Share of the model's size, or of the power of it the claim is measured in.
    pub absolute: f64,
    /// The power: 1 for lengths, −1 for curvatures, −2 for Gaussian ones, 0 for angles, counts,
    /// percentages.
    pub power: i32,
    /// The order of the derivatives the claim comes from: what a file cannot hold of a model far
    /// from the origin counts the more. None for whole numbers, which are exact anywhere.
    pub order: Option<i32>,
}

/// What bounds depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Diameter of the smallest ball around the model.
    pub size: f64,
    /// Distance of its centre from the origin.
    pub distance: f64,
    /// Largest number of control points in a direction; 1 for meshes.
    pub count: usize,
}

impl Accuracy {
    const fn new(relative: f64, absolute: f64, power: i32) -> Self {
        let order = Some(if power < 0 { 2 } else { 0 });
        Self { relative, absolute, power, order }
    }

    /// For a claim that comes from derivatives of this order.
    const fn of_order(self, order: i32) -> Self {
        Self { order: Some(order), ..self }
    }

    /// The bound for a claim on a model of this scale.
    ///
    /// Coordinates at the distance `D` from the origin are rounded to `ε D` with `ε = 1.1e-16`; over
    /// the size that is a share, which derivatives of order `k` of a net of `n` control points in a
    /// direction make `n^k` times as large.
    #[must_use]
    pub fn of(self, claimed: f64, scale: &Scale) -> f64 {
        let lost = self.order.map_or(0.0, |order| {
            0.5 * f64::EPSILON * scale.distance / scale.size * (scale.count as f64).powi(order)
        });
        (self.relative + lost) * claimed.abs()
            + (self.absolute + lost) * scale.size.powi(self.power)
    }
}

/// Keys of one command that are recomputed in one way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The command.
    pub command: &'static str,
    /// Dotted keys; `*` stands for any last part.
    pub keys: &'static [&'static str],
    /// What it takes.
    pub from: &'static str,
    /// Accuracy on files of double precision.
    pub double: Accuracy,
    /// Accuracy on files of single precision (GLB, binary STL and PLY); none if they do not do.
    pub single: Option<Accuracy>,
}

const EXACT: Accuracy = Accuracy { relative: 0.0, absolute: 0.0, power: 0, order: None };
const COUNT: (Accuracy, Option<Accuracy>) = (EXACT, Some(EXACT));

const fn row(
    command: &'static str,
    keys: &'static [&'static str],
    from: &'static str,
    (double, single): (Accuracy, Option<Accuracy>),
) -> Row {
    Row { command, keys, from, double, single }
}

/// Only from files of double precision.
const fn only(accuracy: Accuracy) -> (Accuracy, Option<Accuracy>) {
    (accuracy, None)
}

const SPLINE: &str = "the surface (STEP, 3DM, RON, JSON)";
const BOTH: &str = "the surface and the input";

/// All of it; a key that no row has is not checkable from files.
pub const TABLE: &[Row] = &[
    row("weingarten", &["control_points", "samples"], SPLINE, COUNT),
    row(
        "weingarten",
        &["mean_curvature_min", "mean_curvature_max"],
        SPLINE,
        only(Accuracy::new(1e-9, 1e-9, -1)),
    ),
    row(
        "weingarten",
        &["gaussian_curvature_min", "gaussian_curvature_max"],
        SPLINE,
        only(Accuracy::new(1e-9, 1e-9, -2)),
    ),
    row(
        "weingarten",
        &["alignment_rms", "diagram_area"],
        SPLINE,
        only(Accuracy::new(1e-8, 1e-12, 0).of_order(3)),
    ),
    row("weingarten", &["relation_rms"], SPLINE, only(Accuracy::new(1e-8, 1e-11, 0).of_order(2))),
    row(
        "weingarten",
        &["deviation_*", "boundary_deviation_*"],
        BOTH,
        only(Accuracy::new(1e-9, 1e-11, 0)),
    ),
    row("panel", &["panels"], "the panels (OBJ) or their table (RON, CSV)", only(EXACT)),
    row("panel", &["molds"], "the molds (STEP) or the table (RON, CSV)", only(EXACT)),
    row(
        "panel",
        &["kink_max_deg", "kink_median_deg", "kink_p95_deg", "kink_rms_deg"],
        "the table with its molds (RON) and the input; the largest also from the table (CSV)",
        only(Accuracy::new(1e-8, 1e-8, 0).of_order(1)),
    ),
    row(
        "panel",
        &["gap_max", "gap_median", "gap_p95", "gap_rms"],
        "the panels (OBJ), or the table with its molds (RON) and the input; the largest also from the table (CSV)",
        only(Accuracy::new(1e-8, 1e-13, 1)),
    ),
    row(
        "panel",
        &["gap_max_percent*", "gap_median_percent*", "gap_p95_percent*", "deviation_*"],
        "the panels (OBJ) or the table with its molds (RON), and the input",
        only(Accuracy::new(1e-8, 1e-11, 0)),
    ),
    row(
        "hnet",
        &["faces", "vertices", "irregular_vertices", "odd_valence_vertices"],
        "the net (RON) or the quads (OBJ)",
        COUNT,
    ),
    row(
        "hnet",
        &["star_planarity_max"],
        "the net (RON) or the quads (OBJ)",
        only(Accuracy::new(1e-9, 1e-12, 0)),
    ),
    row("hnet", &["folds"], "the net (RON) or the quads (OBJ)", COUNT),
    row(
        "hnet",
        &["kink_max_deg", "kink_mean_deg"],
        "the net (RON), or the patches (STEP)",
        only(Accuracy::new(1e-9, 1e-9, 0).of_order(1)),
    ),
    row(
        "hnet",
        &["shape_parameter_min", "shape_parameter_max"],
        "the net (RON), or the patches (STEP)",
        only(Accuracy::new(1e-12, 0.0, 0)),
    ),
    row("hnet", &["shape_parameters_distinct"], "the net (RON), or the patches (STEP)", COUNT),
    row("darboux", &["faces", "samples"], "the samples (OBJ, PLY, GLB)", COUNT),
    row(
        "darboux",
        &["kink_max_deg"],
        "the samples (OBJ, PLY), where the image is smooth: at the ends of edges, by circles",
        only(Accuracy::new(1e-6, 1e-6, 0)),
    ),
    row(
        "darboux",
        &["circle_defect_max"],
        "the samples (OBJ, PLY)",
        only(Accuracy::new(1e-6, 1e-12, 1)),
    ),
    row("darboux", &["centroid.*"], "the samples (OBJ, PLY)", only(Accuracy::new(0.0, 1e-13, 1))),
    row("asymptotic", &["patches", "degree"], "the patches (STEP, 3DM, RON, JSON)", COUNT),
    row(
        "asymptotic",
        &["thin_plate_energy", "strain_energy"],
        "the patches (STEP, 3DM, RON, JSON)",
        only(Accuracy::new(1e-9, 0.0, 0)),
    ),
    row(
        "asymptotic",
        &["normal_curvature_max", "min_sine", "positive_gauss_fraction"],
        "the patches (STEP, 3DM, RON, JSON)",
        only(Accuracy::new(1e-9, 1e-9, 0).of_order(2)),
    ),
    row(
        "asymptotic",
        &["kink_max_deg"],
        "the patches (STEP, 3DM, RON, JSON)",
        only(Accuracy::new(1e-9, 1e-9, 0).of_order(1)),
    ),
    row(
        "asymptotic",
        &["mean_jump_max"],
        "the patches (STEP, 3DM, RON, JSON)",
        only(Accuracy::new(1e-9, 1e-8, -1)),
    ),
    row(
        "asymptotic",
        &["gaussian_jump_max"],
        "the patches (STEP, 3DM, RON, JSON)",
        only(Accuracy::new(1e-9, 1e-8, -2)),
    ),
    row("fair", &["vertices", "patches"], "the control mesh (OBJ, PLY, OFF)", COUNT),
    row("fair", &["plain_patches"], "the control mesh (OBJ, PLY, OFF)", COUNT),
    row(
        "fair",
        &["vertex_centroid.*"],
        "the control mesh (OBJ, PLY, OFF)",
        only(Accuracy::new(0.0, 1e-13, 1)),
    ),
    row(
        "fair",
        &["plain_energies.*"],
        "the control mesh (OBJ, PLY, OFF), where it is a regular grid",
        only(Accuracy::new(1e-8, 1e-10, 0).of_order(3)),
    ),
    row(
        "fair",
        &["written_energies.*"],
        "the patches (STEP, 3DM, RON, JSON)",
        only(Accuracy::new(1e-8, 1e-10, 0).of_order(3)),
    ),
    row(
        "fair",
        &["energies.area"],
        "the plain limit of the control mesh (OBJ, PLY, OFF), without the blends",
        only(Accuracy::new(0.03, 0.0, 0)),
    ),
    row("fit", &["control_points", "control_points_u", "control_points_v"], SPLINE, COUNT),
    row("fit", &["degree"], SPLINE, COUNT),
    row("fit", &["points"], "the input", COUNT),
    row(
        "fit",
        &["distance_mean", "distance_rms", "distance_max"],
        BOTH,
        only(Accuracy::new(1e-7, 1e-12, 1)),
    ),
    row("fit", &["distance_max_percent*"], BOTH, only(Accuracy::new(1e-7, 1e-10, 0))),
    row(
        "analyze",
        &["area", "mean_curvature_*", "gaussian_curvature_*"],
        "the input, where it has spline surfaces without singular points",
        only(Accuracy::new(1e-9, 1e-12, 0).of_order(2)),
    ),
    // Near umbilics the root of H² − K halves the digits.
    row(
        "analyze",
        &["principal_curvature_*"],
        "the same",
        only(Accuracy::new(1e-7, 1e-12, 0).of_order(2)),
    ),
    row(
        "analyze",
        &["bounding_box.*"],
        "the input, where it has spline surfaces",
        only(Accuracy::new(0.0, 1e-12, 1)),
    ),
    row(
        "remesh",
        &[
            "faces",
            "vertices",
            "irregular_vertices",
            "odd_valence_vertices",
            "euler_characteristic",
        ],
        "the quads (OBJ, PLY, OFF)",
        COUNT,
    ),
    row(
        "remesh",
        &["edge_length_mean"],
        "the quads (OBJ, PLY, OFF)",
        only(Accuracy::new(1e-12, 1e-14, 1)),
    ),
    row(
        "remesh",
        &["edge_ratio_min", "edge_ratio_max", "angle_min_deg"],
        "the quads (OBJ, PLY, OFF)",
        only(Accuracy::new(1e-9, 1e-12, 0)),
    ),
    row(
        "convert",
        &["surfaces", "control_points", "vertices", "faces"],
        "the output, if it has surfaces where the input has them, and meshes else; not STL and GLB",
        only(EXACT),
    ),
    row("convert", &["centroid.*"], "the same", only(Accuracy::new(0.0, 1e-13, 1))),
];

/// The row of a key. `demo` claims what `weingarten` does, and below `panels_after` what `panel`
/// does.
#[must_use]
pub fn row_of(command: &str, key: &str) -> Option<&'static Row> {
    let (command, key) = match (command, key.strip_prefix("panels_after.")) {
        ("demo", Some(rest)) => ("panel", rest),
        ("demo", None) => ("weingarten", key),
        _ => (command, key),
    };
    let fits = |pattern: &str| match pattern.strip_suffix('*') {
        Some(start) => key.starts_with(start),
        None => key == pattern,
    };
    TABLE.iter().find(|row| row.command == command && row.keys.iter().any(|k| fits(k)))
}

/// The table as Markdown, for the guide.
#[must_use]
pub fn markdown() -> String {
    let mut text = String::from(
        "| command | keys | recomputed from | accuracy | single precision |\n|---|---|---|---|---|\n",
    );
    for row in TABLE {
        let keys: Vec<String> = row.keys.iter().map(|k| format!("`{k}`")).collect();
        text += &format!(
            "| {} | {} | {} | {} | {} |\n",
            row.command,
            keys.join(", "),
            row.from,
            words(row.double),
            row.single.map_or_else(|| "no".to_owned(), words)
        );
    }
    text
}

fn words(accuracy: Accuracy) -> String {
    let unit = match accuracy.power {
        0 => String::new(),
        1 => " size".to_owned(),
        -1 => " / size".to_owned(),
        power => format!(" / size^{}", -power),
    };
    match (accuracy.relative > 0.0, accuracy.absolute > 0.0) {
        (false, false) => "exact".to_owned(),
        (true, false) => format!("{:e} relative", accuracy.relative),
        (false, true) => format!("{:e}{unit}", accuracy.absolute),
        (true, true) => format!("{:e} relative + {:e}{unit}", accuracy.relative, accuracy.absolute),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_find_their_rows() {
        assert_eq!(row_of("panel", "kink_max_deg").unwrap().command, "panel");
        assert_eq!(row_of("demo", "panels_after.gap_max").unwrap().command, "panel");
        assert_eq!(row_of("demo", "alignment_rms").unwrap().command, "weingarten");
        assert!(row_of("demo", "panels_before.gap_max").is_none());
        assert!(row_of("fair", "plain_energies.bending").is_some());
        assert!(row_of("fair", "gradient_norm").is_none());
        assert!(row_of("studio", "x").is_none());
    }

    #[test]
    fn bounds_have_the_unit_of_the_claim() {
        let accuracy = Accuracy::new(1e-3, 1e-2, -2);
        let near = Scale { size: 10.0, distance: 0.0, count: 8 };
        assert!((accuracy.of(-5.0, &near) - (5e-3 + 1e-4)).abs() < 1e-15);
        // A thousand sizes away 64 units in the last place are lost of a curvature.
        let far = Scale { distance: 1e4, ..near };
        let lost = accuracy.of(-5.0, &far) - accuracy.of(-5.0, &near);
        assert!((lost / (64e3 * 0.5 * f64::EPSILON * (5.0 + 0.01)) - 1.0).abs() < 1e-3);
        assert_eq!(EXACT.of(7.0, &far), 0.0);
        assert_eq!(words(accuracy), "1e-3 relative + 1e-2 / size^2");
        assert_eq!(words(EXACT), "exact");
    }

    #[test]
    fn the_guide_has_this_table() {
        let guide = include_str!("../../../docs/guide/verify.md");
        assert!(guide.contains(&markdown()), "copy this table:\n{}", markdown());
    }
}
