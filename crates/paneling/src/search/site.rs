//! What every attempt of a run works on.

use crate::error::Error;
use crate::fit::clustering::{self, Clusters, Feature};
use crate::fit::state::Fit;
use crate::layout::panels::PanelSet;
use crate::mold::prices::PriceList;
use crate::mold::shape::{Mold, MoldType, blank};
use crate::options::{Clustering, MAX_DEVIATION, MoldRule, Options, SheetSize};
use crate::pulse::Pulse;
use crate::seam::unknowns::{Hinge, SeamOptions, Seams, Weights};
use crate::search::bounds::Bounds;
use gp_solver::Fingerprint;

/// A seam step that lowers the energy by less than this share is the last; and the last before
/// seams are weighed anew.
const SEAM_STALL: f64 = 3e-2;
const BOUNDED_STALL: f64 = 0.1;
/// Kinks and gaps beyond this share of their bounds pay so much more.
const LIMIT: f64 = 0.95;
const HINGE_WEIGHT: f64 = 100.0;
/// Area of a blank where panels do not lie on it yet: a panel has about 4 in its own size.
const USUAL_BLANK: f64 = 12.0;

/// Panels, prices and settings of a run. Lengths are in units of the panel size.
pub(crate) struct Site<'a> {
    pub(crate) options: &'a Options,
    pub(crate) prices: &'a PriceList,
    pub(crate) rule: MoldRule,
    /// The types of molds, from the simplest to the most general; at least one.
    pub(crate) types: Vec<MoldType>,
    /// The panels.
    pub(crate) set: PanelSet,
    /// Curvatures of the panels in units of the model: the published grid clusters by these.
    curvatures: &'a [[f64; 2]],
    pub(crate) seam: SeamOptions,
    /// The same towards bounds, if these are the rule.
    bounded: SeamOptions,
    pub(crate) incident: Vec<Vec<(usize, usize)>>,
    /// Lengths here per length of the model.
    pub(crate) unit: f64,
}

impl<'a> Site<'a> {
    pub(crate) fn new(
        panels: &'a PanelSet,
        prices: &'a PriceList,
        options: &'a Options,
    ) -> Result<Self, Error> {
        options.check()?;
        let (mut rule, types, unit) = (options.rule()?, options.types(), 1.0 / panels.size);
        prices.check(&types)?;
        if let MoldRule::Bounds(bounds) = &mut rule {
            let deviation = bounds.max_deviation.unwrap_or(MAX_DEVIATION * panels.extent);
            bounds.max_deviation = Some(deviation / panels.size);
            bounds.max_gap = bounds.max_gap.map(|g| g / panels.size);
        }
        if let MoldRule::Count(molds) = rule
            && (molds == 0 || molds > panels.len())
        {
            return Err(Error::MoldCount { molds, panels: panels.len() });
        }
        if let Some(SheetSize { width, height }) = options.panel_max {
            let limit = [width.max(height), width.min(height)];
            for panel in 0..panels.len() {
                let size = panels.breadths(panel);
                if size[0] > limit[0] || size[1] > limit[1] {
                    let [u, v] = panels.middles[panel];
                    return Err(Error::PanelTooLarge { panel, u, v, size, limit });
                }
            }
        }
        let set = panels.scaled(unit);
        let incident = set.incident_seams();
        let seam = SeamOptions {
            steps: options.seam_steps,
            gap_weight: 1.0,
            design_weight: 0.1,
            stall: SEAM_STALL,
            hinge: None,
        };
        let bounded = match rule {
            MoldRule::Bounds(Bounds { max_kink, max_gap, .. }) => {
                let limit = |bound: Option<f64>| bound.map_or(f64::INFINITY, |b| LIMIT * b);
                let [kink, gap] = [max_kink, max_gap].map(limit);
                let hinge = Some(Hinge { kink, gap, weight: HINGE_WEIGHT });
                SeamOptions { stall: BOUNDED_STALL, hinge, ..seam }
            }
            MoldRule::PerRoot(_) | MoldRule::Count(_) => seam,
        };
        let curvatures = panels.curvatures();
        Ok(Self { options, prices, rule, types, set, curvatures, seam, bounded, incident, unit })
    }

    /// The bounds, if these are the rule.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        match self.rule {
            MoldRule::Bounds(bounds) => Some(bounds),
            MoldRule::PerRoot(_) | MoldRule::Count(_) => None,
        }
    }

    /// The most general type.
    pub(crate) fn general(&self) -> MoldType {
        self.types[self.types.len() - 1]
    }

    /// The seam step with these weights, `towards` bounds or without regard to them.
    pub(crate) fn seams<'s>(&'s self, weights: &'s Weights, towards: bool) -> Seams<'s> {
        let options = if towards { &self.bounded } else { &self.seam };
        Seams { set: &self.set, options, weights, incident: &self.incident }
    }

    /// The shapes of all panels; `None` if asked to stop.
    pub(crate) fn features(&self, pulse: &Pulse<'_>) -> Option<Vec<Feature>> {
        clustering::features(&self.set, self.options.slope_weight, pulse)
    }

    /// Groups the panels; `None` if asked to stop.
    pub(crate) fn cluster(
        &self,
        features: &[Feature],
        clustering: Clustering,
        molds: usize,
        pulse: &Pulse<'_>,
    ) -> Option<Clusters> {
        match clustering {
            Clustering::Own => clustering::shapes(features, molds, 20, pulse),
            Clustering::Cover => clustering::cover(features, molds, pulse),
            Clustering::Grid => {
                clustering::grid(self.curvatures, molds, self.options.diagram_axis, pulse)
            }
        }
    }

    /// A first fit of these clusters with one type of molds; `None` if asked to stop.
    pub(crate) fn first_fit(
        &self,
        clusters: &Clusters,
        kind: MoldType,
        pulse: &Pulse<'_>,
    ) -> Option<Fit> {
        let kinds = vec![kind; clusters.count];
        Fit::new(&self.set, clusters, &kinds, self.options.slope_weight, pulse)
    }

    /// Total cost of molds and panels.
    pub(crate) fn cost(&self, fit: &Fit) -> f64 {
        let of = |(mold, members): (&Mold, &Vec<usize>)| {
            let border = members
                .iter()
                .flat_map(|&p| self.set.border(p).iter().map(move |x| fit.poses[p].to_local(*x)));
            let area = blank(border) / (self.unit * self.unit);
            self.prices.cost(mold.kind, members.len(), area)
        };
        fit.molds.iter().zip(&fit.members).map(of).sum()
    }

    /// About what a mold of a type and so many panels on it cost, before they are fitted.
    pub(crate) fn price(&self, kind: MoldType, panels: usize) -> f64 {
        self.prices.cost(kind, panels, USUAL_BLANK / (self.unit * self.unit))
    }

    /// Of everything a run depends on.
    pub(crate) fn fingerprint(&self) -> u64 {
        let mut of = Fingerprint::new().numbers(&[self.unit]);
        let samples = [&self.set.samples, &self.set.edges];
        for point in samples.into_iter().flat_map(|s| s.points.iter().chain(&s.normals)) {
            of = of.numbers(&point.to_array());
        }
        for seam in &self.set.seams {
            of = of.counts(seam.panels.map(|p| p as u64));
        }
        // Sheets are cut when all is done.
        let options = Options { sheet: None, ..self.options.clone() };
        of.text(&format!("{options:?} {:?}", self.prices)).finish()
    }
}
