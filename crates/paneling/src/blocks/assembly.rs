//! Panels on molds as unknowns.

use crate::fit::residuals::{POSE, moved};
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::shape::{MAX_PARAMETERS, Mold, MoldType};
use glam::DVec3;
use gp_solver::{Group, Variables};

/// Name of the group of poses: six numbers per panel, a displacement `δ` and a rotation `ω` from
/// its base pose. After them a point has the local coordinates `exp(ω) L − δ`, `L` being those in
/// the base pose.
pub const POSES: &str = "poses";
/// Name of the group of molds: seven numbers each, the parameters of [`Mold`]; those the type does
/// not have are fixed.
pub const MOLDS: &str = "molds";

/// The unknowns of the joint seam step of so many panels on molds of these types: groups [`POSES`]
/// and [`MOLDS`].
///
/// ```
/// use paneling::{MoldType, blocks::MOLDS, variables};
/// let variables = variables(4, &[MoldType::Sphere, MoldType::Cubic]);
/// assert_eq!(variables.len(), 6 * 4 + 7 * 2);
/// let molds = variables.group(MOLDS)?;
/// assert!(!variables.fixed()[molds.column(0, 0)] && variables.fixed()[molds.column(0, 1)]);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[must_use]
pub fn variables(panels: usize, kinds: &[MoldType]) -> Variables {
    groups(panels, kinds).0
}

fn groups(panels: usize, kinds: &[MoldType]) -> (Variables, [Group; 2]) {
    let mut variables = Variables::new();
    let poses = variables.add(POSES, panels, POSE);
    let molds = variables.add(MOLDS, kinds.len(), MAX_PARAMETERS);
    for (m, kind) in kinds.iter().enumerate() {
        for i in kind.parameter_count()..MAX_PARAMETERS {
            variables.fix_unknown(molds.column(m, i));
        }
    }
    (variables, [poses, molds])
}

/// Panels on molds as unknowns of a problem: where the poses begin, which mold each panel is on, and
/// the design they are held against. Lengths are in the unit of the panels it is made with.
#[derive(Clone, Debug)]
pub struct Assembly {
    pub(crate) panels: PanelSet,
    pub(crate) labels: Vec<usize>,
    molds: Vec<Mold>,
    bases: Vec<Pose>,
    variables: Variables,
    pose_group: Group,
    mold_group: Group,
}

impl Assembly {
    /// Panels that begin on these molds in these poses; `labels` has the mold of each panel.
    ///
    /// # Panics
    /// If there is not one label and one pose per panel, or a label names no mold.
    #[must_use]
    pub fn new(panels: &PanelSet, molds: &[Mold], labels: &[usize], poses: &[Pose]) -> Self {
        assert_eq!((labels.len(), poses.len()), (panels.len(), panels.len()), "one per panel");
        assert!(labels.iter().all(|&m| m < molds.len()), "every label names a mold");
        let kinds: Vec<MoldType> = molds.iter().map(|m| m.kind).collect();
        let (variables, [pose_group, mold_group]) = groups(panels.len(), &kinds);
        Self {
            panels: panels.clone(),
            labels: labels.to_vec(),
            molds: molds.to_vec(),
            bases: poses.to_vec(),
            variables,
            pose_group,
            mold_group,
        }
    }

    /// The unknowns: groups [`POSES`] and [`MOLDS`].
    #[must_use]
    pub fn variables(&self) -> Variables {
        self.variables.clone()
    }

    /// The unknowns at the start.
    #[must_use]
    pub fn start(&self) -> Vec<f64> {
        let mut x = vec![0.0; self.variables.len()];
        for (m, mold) in self.molds.iter().enumerate() {
            self.mold_group.set(&mut x, m, mold.parameters);
        }
        x
    }

    /// The pose of a panel at `x`.
    #[must_use]
    pub fn pose(&self, x: &[f64], panel: usize) -> Pose {
        moved(&self.bases[panel], &self.step(x, panel))
    }

    /// A mold at `x`.
    #[must_use]
    pub fn mold(&self, x: &[f64], mold: usize) -> Mold {
        Mold { parameters: self.mold_group.get(x, mold), ..self.molds[mold] }
    }

    fn step(&self, x: &[f64], panel: usize) -> [f64; POSE] {
        self.pose_group.get(x, panel)
    }

    /// Number of free parameters of a panel's mold.
    pub(crate) fn parameters(&self, panel: usize) -> usize {
        self.molds[self.labels[panel]].kind.parameter_count()
    }

    /// The unknowns that rows of these panels read: their poses, then the parameters of their molds,
    /// each mold once.
    pub(crate) fn columns(&self, panels: &[usize], columns: &mut Vec<usize>) {
        columns.clear();
        for &p in panels {
            columns.extend(self.pose_group.columns::<POSE>(p));
        }
        for (k, &p) in panels.iter().enumerate() {
            let m = self.labels[p];
            if panels[..k].iter().all(|&q| self.labels[q] != m) {
                columns.extend((0..self.parameters(p)).map(|i| self.mold_group.column(m, i)));
            }
        }
    }

    /// Derivatives in the numbers of a panel's pose at `x`, from those in a further move of the
    /// pose as it is there.
    ///
    /// A change `dω` turns by `J dω` with the left Jacobian `J` of the rotation and moves by
    /// `dδ − J dω × δ`.
    pub(crate) fn row_from_here(&self, x: &[f64], panel: usize, row: &[f64]) -> [f64; POSE] {
        let step = self.step(x, panel);
        let (delta, omega) = (DVec3::from_slice(&step[..3]), DVec3::from_slice(&step[3..]));
        let (along, turn) = (DVec3::from_slice(&row[..3]), DVec3::from_slice(&row[3..POSE]));
        let turn = turn + along.cross(delta);
        let square = omega.length_squared();
        // (1 − cos θ)/θ² and (θ − sin θ)/θ³.
        let (a, b) = if square < 1e-4 {
            (0.5 - square / 24.0 + square * square / 720.0, 1.0 / 6.0 - square / 120.0)
        } else {
            let angle = square.sqrt();
            ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
        };
        let across = omega.cross(turn);
        let turn = turn - a * across + b * omega.cross(across);
        [along.x, along.y, along.z, turn.x, turn.y, turn.z]
    }
}
