//! What lies on a surface view: scalar fields, groups of triangles, sets of lines.

use glam::DVec3;

/// Whether zero is special in a field, which decides its colour map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldScale {
    /// Positive and negative values differ in kind: a diverging map, symmetric about 0.
    Signed,
    /// A size or distance: a sequential map.
    Magnitude,
}

/// A number at every vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct ScalarField {
    /// Short name, used in links and file names. `H`, `K`, `kappa1` and `kappa2` also feed the
    /// curvature diagram.
    pub id: String,
    /// Name as the reader sees it, such as `mean curvature H`.
    pub label: String,
    /// Unit as the reader sees it, such as `1/m`; empty if there is none.
    pub unit: String,
    /// Which kind of colour map fits.
    pub scale: FieldScale,
    /// Range to start with, in the field's unit; `None` takes the central 98 % of the values.
    pub range: Option<[f64; 2]>,
    /// One value per vertex; NaN where the field does not exist.
    pub values: Vec<f64>,
}

impl ScalarField {
    /// A field whose sign matters.
    pub fn signed(id: &str, label: &str, unit: &str, values: Vec<f64>) -> Self {
        Self::with_scale(id, label, unit, FieldScale::Signed, values)
    }

    /// A size, distance or other field that starts at some lowest value.
    pub fn magnitude(id: &str, label: &str, unit: &str, values: Vec<f64>) -> Self {
        Self::with_scale(id, label, unit, FieldScale::Magnitude, values)
    }

    /// Mean curvature `H`, in 1/`length_unit`.
    pub fn mean_curvature(values: Vec<f64>, length_unit: &str) -> Self {
        Self::signed("H", "mean curvature H", &per(length_unit, ""), values)
    }

    /// Gaussian curvature `K`, in 1/`length_unit`².
    pub fn gaussian_curvature(values: Vec<f64>, length_unit: &str) -> Self {
        Self::signed("K", "Gaussian curvature K", &per(length_unit, "²"), values)
    }

    /// The larger principal curvature, in 1/`length_unit`.
    pub fn kappa1(values: Vec<f64>, length_unit: &str) -> Self {
        Self::signed("kappa1", "principal curvature κ₁", &per(length_unit, ""), values)
    }

    /// The smaller principal curvature, in 1/`length_unit`.
    pub fn kappa2(values: Vec<f64>, length_unit: &str) -> Self {
        Self::signed("kappa2", "principal curvature κ₂", &per(length_unit, ""), values)
    }

    /// Distance to the surface the work started from, in `length_unit`.
    pub fn deviation(values: Vec<f64>, length_unit: &str) -> Self {
        Self::magnitude("deviation", "deviation from the input", length_unit, values)
    }

    fn with_scale(id: &str, label: &str, unit: &str, scale: FieldScale, values: Vec<f64>) -> Self {
        let (id, label, unit) = (id.to_owned(), label.to_owned(), unit.to_owned());
        Self { id, label, unit, scale, range: None, values }
    }
}

fn per(length_unit: &str, power: &str) -> String {
    match length_unit {
        "" => format!("1/length{power}"),
        unit => format!("1/{unit}{power}"),
    }
}

/// A partition of the triangles, such as molds, panels or patches.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceGroups {
    /// Short name, used in links and file names.
    pub id: String,
    /// Name as the reader sees it.
    pub label: String,
    /// Group of each triangle, an index into `names`.
    pub of_triangle: Vec<u32>,
    /// Name of each group.
    pub names: Vec<String>,
}

impl FaceGroups {
    /// Groups called `{singular} 0`, `{singular} 1`, …
    ///
    /// ```
    /// let molds = report::FaceGroups::numbered("molds", "mold", vec![0, 0, 1]);
    /// assert_eq!(molds.names, ["mold 0", "mold 1"]);
    /// ```
    pub fn numbered(id: &str, singular: &str, of_triangle: Vec<u32>) -> Self {
        let count = of_triangle.iter().max().map_or(0, |m| m + 1);
        let names = (0..count).map(|i| format!("{singular} {i}")).collect();
        Self { id: id.to_owned(), label: id.to_owned(), of_triangle, names }
    }
}

/// What a set of lines shows, which decides how it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineRole {
    /// A control net or cage, which need not lie on the surface.
    ControlNet,
    /// Parameter lines, mesh edges or rulings: thin lines on the surface.
    Mesh,
    /// Lines where a field is constant.
    Isolines,
    /// Short strokes along principal or asymptotic directions.
    Directions,
    /// Curves to look at first: seams, data curves, boundaries.
    Curves,
}

/// Lines drawn over a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct LineSet {
    /// Short name, used in links.
    pub id: String,
    /// Name as the reader sees it.
    pub label: String,
    /// What the lines show.
    pub role: LineRole,
    /// Whether they are drawn when the report opens.
    pub visible: bool,
    /// Points of each line, in model units.
    pub polylines: Vec<Vec<DVec3>>,
}

impl LineSet {
    /// Lines that are hidden when the report opens.
    pub fn new(id: &str, label: &str, role: LineRole, polylines: Vec<Vec<DVec3>>) -> Self {
        Self { id: id.to_owned(), label: label.to_owned(), role, visible: false, polylines }
    }

    /// Both families of lines of a grid of `rows` x `columns` points, point `i * columns + j`.
    ///
    /// # Panics
    /// If there are not `rows * columns` points.
    pub fn control_net(points: &[DVec3], rows: usize, columns: usize) -> Self {
        assert_eq!(points.len(), rows * columns, "one point per knot of the grid");
        let along = points.chunks(columns.max(1)).map(<[DVec3]>::to_vec);
        let across = (0..columns).map(|j| (0..rows).map(|i| points[i * columns + j]).collect());
        let polylines = along.chain(across).collect();
        Self::new("control-net", "control net", LineRole::ControlNet, polylines)
    }
}
