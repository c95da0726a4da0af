//! Which panels share a mold: clusters in curvature, by the published grid or by shape.

use crate::fit::residuals::{sample_mold_rows, sample_residual};
use crate::layout::panels::PanelSet;
use crate::mold::shape::{MAX_PARAMETERS, Mold, MoldType};
use crate::pulse::Pulse;
use gp_solver::choices;
use numerics::{PIVOT_RATIO, add_normal_row, factor_semidefinite, solve_semidefinite};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Second coordinate of the curvature diagram in which the grid clusters; the first is `H`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DiagramAxis {
    /// `sign(K) √|K|`.
    #[default]
    SignedRoot,
    /// `√(H² − K)`, half the difference of the principal curvatures.
    HalfDifference,
}

choices!(DiagramAxis { SignedRoot = "signed_root", HalfDifference = "half_difference" });

/// Panels grouped by mold.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clusters {
    /// The cluster of each panel.
    pub(crate) labels: Vec<usize>,
    /// Whether the panel's frame is to be turned half round to match its cluster.
    pub(crate) turned: Vec<bool>,
    /// Number of clusters; none is empty.
    pub(crate) count: usize,
}

/// The published clustering: cells of the finest uniform grid over the curvature diagram of which
/// at most `count` are occupied (Pellis et al. 2021, Sec. 4.2).
///
/// The paper names `(H, √K)`, which does not exist for `K < 0`; `axis` says what stands for it.
pub(crate) fn grid(
    curvatures: &[[f64; 2]],
    count: usize,
    axis: DiagramAxis,
    pulse: &Pulse<'_>,
) -> Option<Clusters> {
    let second = |[h, k]: [f64; 2]| match axis {
        DiagramAxis::SignedRoot => k.signum() * k.abs().sqrt(),
        DiagramAxis::HalfDifference => (h * h - k).max(0.0).sqrt(),
    };
    let points: Vec<[f64; 2]> = curvatures.iter().map(|&c| [c[0], second(c)]).collect();
    let bound =
        |k: usize, f: fn(f64, f64) -> f64| points.iter().map(|p| p[k]).fold(points[0][k], f);
    let low = [0, 1].map(|k| bound(k, f64::min));
    let high = [0, 1].map(|k| bound(k, f64::max));
    let n = points.len();
    let mut best = Clusters { labels: vec![0; n], turned: vec![false; n], count: 1 };
    // The number of occupied cells is not monotone in the fineness, so the search goes on a while
    // beyond the first grid that has too many.
    for fineness in 1..4 * n.max(1) {
        if pulse.is_stopped() {
            return None;
        }
        let cell = |p: &[f64; 2]| {
            [0, 1].map(|k| {
                let width = high[k] - low[k];
                let share = if width > 0.0 { (p[k] - low[k]) / width } else { 0.0 };
                ((share * fineness as f64) as usize).min(fineness - 1)
            })
        };
        let mut names: HashMap<[usize; 2], usize> = HashMap::new();
        let labels: Vec<usize> = points
            .iter()
            .map(|p| {
                let fresh = names.len();
                *names.entry(cell(p)).or_insert(fresh)
            })
            .collect();
        if names.len() <= count {
            best.labels = labels;
            best.count = names.len();
        } else if names.len() as f64 > 1.6 * count as f64 {
            break;
        }
    }
    Some(best)
}

/// A panel's shape as a point such that distances between points are distances between the best
/// cubics of the panels, in height and slope over a typical panel. The first three coordinates
/// are even under a half turn of the frame, the other four odd.
pub(crate) type Feature = [f64; MAX_PARAMETERS];

const EVEN: usize = 3;

/// The cubic nearest to a panel in its principal frame, and the Gram matrix of the fit (lower
/// triangle).
pub(crate) fn best_cubic(set: &PanelSet, p: usize, slope_weight: f64) -> (Feature, [Feature; 7]) {
    let flat = Mold::flat(MoldType::Cubic);
    let (points, normals) = set.panel_samples(p);
    let to_local = set.frames[p].rotation.transpose();
    let (mut a, mut b) = ([[0.0; 7]; 7], [0.0; 7]);
    for (x, n) in points.iter().zip(normals) {
        let local = to_local * (*x - set.frames[p].origin);
        let r = sample_residual(&flat, slope_weight, local, to_local * *n);
        for (row, r) in sample_mold_rows(&flat, slope_weight, local).iter().zip(r) {
            add_normal_row(&mut a, &mut b, row, -r);
        }
    }
    let gram = a;
    // Panels with few samples across may not determine all seven.
    for (i, row) in a.iter_mut().enumerate() {
        row[i] *= 1.0 + 1e-9;
    }
    factor_semidefinite(&mut a, PIVOT_RATIO);
    solve_semidefinite(&a, &mut b);
    (b, gram)
}

/// The shapes of all panels (lengths in units of the panel size); `None` if asked to stop.
pub(crate) fn features(
    set: &PanelSet,
    slope_weight: f64,
    pulse: &Pulse<'_>,
) -> Option<Vec<Feature>> {
    let fitted = pulse.map(set.len(), 1, |p| best_cubic(set, p, slope_weight))?;
    // The metric: the mean Gram matrix, without the odd cross terms that a centred panel lacks.
    let mut metric = [[0.0; 7]; 7];
    for (_, gram) in &fitted {
        for i in 0..7 {
            for j in 0..=i {
                if (i < EVEN) == (j < EVEN) {
                    metric[i][j] += gram[i][j] / fitted.len() as f64;
                }
            }
        }
    }
    factor_semidefinite(&mut metric, PIVOT_RATIO);
    let whiten = |c: &Feature| {
        let mut out = [0.0; 7];
        for j in 0..7 {
            for i in j..7 {
                let l = metric[i][j];
                out[j] += if l.is_finite() { l * c[i] } else { 0.0 };
            }
        }
        out
    };
    Some(fitted.iter().map(|(c, _)| whiten(c)).collect())
}

/// Squared distance of two shapes over the better of the two half turns, and whether it turns.
pub(crate) fn distance(a: &Feature, b: &Feature) -> (f64, bool) {
    let mut sum = 0.0;
    let mut cross = 0.0;
    for i in 0..EVEN {
        sum += (a[i] - b[i]).powi(2);
    }
    for i in EVEN..7 {
        sum += a[i] * a[i] + b[i] * b[i];
        cross += a[i] * b[i];
    }
    ((sum - 2.0 * cross.abs()).max(0.0), cross < 0.0)
}

/// k-means in shape space with exactly `count` clusters, none empty. Deterministic: the seeding
/// draws from a fixed sequence. `None` if asked to stop.
pub(crate) fn shapes(
    features: &[Feature],
    count: usize,
    iterations: usize,
    pulse: &Pulse<'_>,
) -> Option<Clusters> {
    let n = features.len();
    let mut centers = seeds(features, count, pulse)?;
    let mut nearest: Vec<(usize, f64, bool)> = Vec::new();
    for _ in 0..iterations {
        if pulse.is_stopped() {
            return None;
        }
        nearest = assign(features, &centers);
        fill_empty(&mut nearest, count);
        let moved = centers_of(features, &nearest, count);
        if moved == centers {
            break;
        }
        centers = moved;
    }
    debug_assert_eq!(nearest.len(), n);
    Some(Clusters {
        labels: nearest.iter().map(|x| x.0).collect(),
        turned: nearest.iter().map(|x| x.2).collect(),
        count,
    })
}

/// Most shapes that are considered as molds by [`cover`], as a multiple of the molds wanted and at
/// least [`LEAST_CANDIDATES`].
const CANDIDATES_PER_MOLD: usize = 4;
const LEAST_CANDIDATES: usize = 2000;
/// Halvings of the tolerance.
const HALVINGS: usize = 24;

/// Greedy covering: the shapes of some panels become molds such that every panel is within a
/// tolerance of one, and the tolerance is the smallest for which `count` suffice. Molds that are
/// left go to the panels that are worst off. `None` if asked to stop.
pub(crate) fn cover(features: &[Feature], count: usize, pulse: &Pulse<'_>) -> Option<Clusters> {
    let wanted = LEAST_CANDIDATES.max(CANDIDATES_PER_MOLD * count);
    let step = features.len().div_ceil(wanted).max(1);
    let candidates: Vec<Feature> = features.iter().copied().step_by(step).collect();
    // Only shapes within the largest tolerance that is needed have to be remembered; equal shapes
    // differ by rounding.
    let square = |x: &Feature| x.iter().map(|v| v * v).sum::<f64>();
    let rounding = 1e-13 * features.iter().map(square).fold(f64::MIN_POSITIVE, f64::max);
    let mut high = spread(features, vec![features[0]], count, rounding, pulse)?.1.max(rounding);
    let (reached, mut chosen) = loop {
        let reached = reached_by(features, &candidates, high, pulse)?;
        if let Some(chosen) = greedy_cover(&reached, features.len(), count, high) {
            break (reached, chosen);
        }
        high *= 2.0;
    };
    let mut low = 0.0;
    for _ in 0..HALVINGS {
        if pulse.is_stopped() {
            return None;
        }
        let middle = 0.5 * (low + high);
        match greedy_cover(&reached, features.len(), count, middle) {
            Some(found) => (chosen, high) = (found, middle),
            None => low = middle,
        }
    }
    let centers = chosen.iter().map(|&c| candidates[c]).collect();
    let (centers, _) = spread(features, centers, count, rounding, pulse)?;
    let mut nearest = assign(features, &centers);
    fill_empty(&mut nearest, centers.len());
    Some(Clusters {
        labels: nearest.iter().map(|x| x.0).collect(),
        turned: nearest.iter().map(|x| x.2).collect(),
        count: centers.len(),
    })
}

/// Shapes a candidate may stand for, nearest first: distance and number.
type Reached = Vec<(f64, u32)>;

fn reached_by(
    features: &[Feature],
    candidates: &[Feature],
    limit: f64,
    pulse: &Pulse<'_>,
) -> Option<Vec<Reached>> {
    let near = |center: &Feature| {
        let all = features.iter().zip(0..).map(|(x, p)| (distance(x, center).0, p));
        let mut near: Reached = all.filter(|(d, _)| *d <= limit).collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near
    };
    pulse.map(candidates.len(), 1, |c| near(&candidates[c]))
}

/// Adds centers, each the shape furthest from those before, until there are `count` or no shape is
/// further than `enough`; the second value is how far the furthest shape is then.
fn spread(
    features: &[Feature],
    mut centers: Vec<Feature>,
    count: usize,
    enough: f64,
    pulse: &Pulse<'_>,
) -> Option<(Vec<Feature>, f64)> {
    let mut distances: Vec<f64> = assign(features, &centers).iter().map(|x| x.1).collect();
    loop {
        let further = |a: usize, b: usize| if distances[b] > distances[a] { b } else { a };
        let furthest = (0..distances.len()).fold(0, further);
        if centers.len() >= count || distances[furthest] <= enough {
            return Some((centers, distances[furthest]));
        }
        if pulse.is_stopped() {
            return None;
        }
        let center = features[furthest];
        distances
            .par_iter_mut()
            .with_min_len(2048)
            .zip(features)
            .for_each(|(d, x)| *d = d.min(distance(x, &center).0));
        centers.push(center);
    }
}

/// The candidates that cover all `shapes` shapes within the tolerance, each the one that covers
/// most of what is left (the first of several); `None` if `count` do not suffice.
///
/// What a candidate would cover only ever gets less, so its last count is an upper bound, and only
/// the candidate with the largest bound has to be counted again.
fn greedy_cover(
    reached: &[Reached],
    shapes: usize,
    count: usize,
    tolerance: f64,
) -> Option<Vec<usize>> {
    let within = |c: usize| {
        let near = &reached[c];
        near[..near.partition_point(|(d, _)| *d <= tolerance)].iter().map(|(_, p)| *p as usize)
    };
    let bounds = (0..reached.len()).map(|c| (within(c).len(), Reverse(c)));
    let mut bounds: BinaryHeap<(usize, Reverse<usize>)> = bounds.collect();
    let mut open = vec![true; shapes];
    let mut left = shapes;
    let mut chosen = Vec::new();
    while left > 0 {
        let (bound, Reverse(c)) = bounds.pop()?;
        let gain = within(c).filter(|&p| open[p]).count();
        if gain == 0 {
            continue;
        }
        if gain < bound {
            bounds.push((gain, Reverse(c)));
            continue;
        }
        if chosen.len() == count {
            return None;
        }
        within(c).for_each(|p| open[p] = false);
        left -= gain;
        chosen.push(c);
    }
    Some(chosen)
}

/// The nearest center of every shape.
fn assign(features: &[Feature], centers: &[Feature]) -> Vec<(usize, f64, bool)> {
    features
        .par_iter()
        .with_min_len(64)
        .map(|x| {
            let mut best = (0, f64::INFINITY, false);
            for (c, center) in centers.iter().enumerate() {
                let (d, turned) = distance(x, center);
                if d < best.1 {
                    best = (c, d, turned);
                }
            }
            best
        })
        .collect()
}

fn centers_of(features: &[Feature], nearest: &[(usize, f64, bool)], count: usize) -> Vec<Feature> {
    let mut sums = vec![[0.0; 7]; count];
    let mut sizes = vec![0.0_f64; count];
    for (x, &(c, _, turned)) in features.iter().zip(nearest) {
        for i in 0..7 {
            sums[c][i] += if turned && i >= EVEN { -x[i] } else { x[i] };
        }
        sizes[c] += 1.0;
    }
    for (sum, size) in sums.iter_mut().zip(&sizes) {
        sum.iter_mut().for_each(|v| *v /= size.max(1.0));
    }
    sums
}

/// Gives every empty cluster the panel that is worst off in a cluster of several.
fn fill_empty(nearest: &mut [(usize, f64, bool)], count: usize) {
    let mut sizes = vec![0_usize; count];
    for x in nearest.iter() {
        sizes[x.0] += 1;
    }
    for c in 0..count {
        if sizes[c] > 0 {
            continue;
        }
        let worst = (0..nearest.len()).filter(|&p| sizes[nearest[p].0] > 1).fold(
            None,
            |best: Option<usize>, p| match best {
                Some(b) if nearest[b].1 >= nearest[p].1 => Some(b),
                _ => Some(p),
            },
        );
        if let Some(p) = worst {
            sizes[nearest[p].0] -= 1;
            sizes[c] = 1;
            nearest[p] = (c, 0.0, false);
        }
    }
}

/// Seeds spread by squared distance (k-means++) from a fixed random sequence.
fn seeds(features: &[Feature], count: usize, pulse: &Pulse<'_>) -> Option<Vec<Feature>> {
    const CHUNK: usize = 2048;
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move || {
        // SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut distances = vec![f64::INFINITY; features.len()];
    let mut centers = vec![features[features.len() / 2]];
    while centers.len() < count {
        if pulse.is_stopped() {
            return None;
        }
        let newest = centers[centers.len() - 1];
        let sums: Vec<f64> = distances
            .par_chunks_mut(CHUNK)
            .zip(features.par_chunks(CHUNK))
            .map(|(d, x)| {
                let mut sum = 0.0;
                for (d, x) in d.iter_mut().zip(x) {
                    *d = d.min(distance(x, &newest).0);
                    sum += *d;
                }
                sum
            })
            .collect();
        let mut target = random() * sums.iter().sum::<f64>();
        let mut chunk = 0;
        while chunk + 1 < sums.len() && target >= sums[chunk] {
            target -= sums[chunk];
            chunk += 1;
        }
        let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(features.len());
        let mut chosen = range.end - 1;
        for p in range {
            if target < distances[p] {
                chosen = p;
                break;
            }
            target -= distances[p];
        }
        centers.push(features[chosen]);
    }
    Some(centers)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(curvatures: &[[f64; 2]], count: usize, axis: DiagramAxis) -> Clusters {
        super::grid(curvatures, count, axis, &Pulse::new(&mut ())).unwrap()
    }

    fn cover(features: &[Feature], count: usize) -> Clusters {
        super::cover(features, count, &Pulse::new(&mut ())).unwrap()
    }

    fn shapes(features: &[Feature], count: usize, iterations: usize) -> Clusters {
        super::shapes(features, count, iterations, &Pulse::new(&mut ())).unwrap()
    }

    #[test]
    fn grid_has_at_most_the_wanted_cells_and_is_as_fine_as_it_can_be() {
        // Points on a line in the diagram: a grid of fineness g has g occupied cells.
        let curvatures: Vec<[f64; 2]> =
            (0..100).map(|i| 0.1 + 0.01 * f64::from(i)).map(|h| [h, h * h]).collect();
        let clusters = grid(&curvatures, 10, DiagramAxis::SignedRoot);
        assert_eq!(clusters.count, 10);
        assert_eq!(clusters.labels[0], 0);
        assert_eq!(clusters.labels[99], 9);
        let flat = grid(&[[0.0, 0.0]; 5], 3, DiagramAxis::SignedRoot);
        assert_eq!(flat.count, 1);
    }

    #[test]
    fn half_turns_are_recognised() {
        let a = [1.0, 2.0, 3.0, 0.4, 0.5, 0.6, 0.7];
        let b = [1.0, 2.0, 3.0, -0.4, -0.5, -0.6, -0.7];
        let (d, turned) = distance(&a, &b);
        assert!(d < 1e-14 && turned);
        assert!(!distance(&a, &a).1);
    }

    #[test]
    fn the_lazy_cover_is_the_greedy_one() {
        let features: Vec<Feature> = (0..400)
            .map(|k| std::array::from_fn(|i| ((k * (i + 3)) as f64 * 0.37).sin()))
            .collect();
        let candidates: Vec<Feature> = features.iter().copied().step_by(3).collect();
        let reached =
            reached_by(&features, &candidates, f64::INFINITY, &Pulse::new(&mut ())).unwrap();
        for tolerance in [0.5, 1.5, 3.0, 6.0] {
            let mut open = vec![true; features.len()];
            let mut greedy = Vec::new();
            while open.contains(&true) {
                let covers = |c: usize, p: usize| {
                    open[p] && distance(&features[p], &candidates[c]).0 <= tolerance
                };
                let gain = |c: usize| (0..features.len()).filter(|&p| covers(c, p)).count();
                let gains: Vec<usize> = (0..candidates.len()).map(gain).collect();
                let best = (0..gains.len()).max_by_key(|&c| (gains[c], Reverse(c))).unwrap();
                if gains[best] == 0 {
                    break;
                }
                let covered: Vec<usize> =
                    (0..features.len()).filter(|&p| covers(best, p)).collect();
                covered.into_iter().for_each(|p| open[p] = false);
                greedy.push(best);
            }
            let is_complete = !open.contains(&true);
            let lazy = greedy_cover(&reached, features.len(), greedy.len(), tolerance);
            assert_eq!(lazy, is_complete.then(|| greedy.clone()));
            if is_complete {
                let fewer = greedy_cover(&reached, features.len(), greedy.len() - 1, tolerance);
                assert_eq!(fewer, None);
            }
        }
    }

    #[test]
    fn a_cover_uses_at_most_the_wanted_number_and_leaves_none_empty() {
        let features: Vec<Feature> = (0..200)
            .map(|k| std::array::from_fn(|i| (k as f64 * 0.01 * (i + 1) as f64).cos()))
            .collect();
        for count in [1, 7, 40, 200] {
            let clusters = cover(&features, count);
            assert!(clusters.count <= count && clusters.count > count / 3, "{}", clusters.count);
            assert!((0..clusters.count).all(|c| clusters.labels.contains(&c)));
        }
        assert_eq!(cover(&[[1.0; 7]; 6], 3).count, 1);
    }

    #[test]
    fn separate_groups_are_found_and_no_cluster_is_empty() {
        let group = |k: usize| (k % 3) as f64;
        let features: Vec<Feature> = (0..60)
            .map(|k| {
                let mut x = [0.0; 7];
                x[0] = 10.0 * group(k) + 0.01 * (k as f64).sin();
                x
            })
            .collect();
        let clusters = shapes(&features, 3, 20);
        for k in 3..60 {
            assert_eq!(clusters.labels[k], clusters.labels[k % 3]);
        }
        let same = shapes(&[[0.0; 7]; 8], 5, 20);
        for c in 0..5 {
            assert!(same.labels.contains(&c), "cluster {c} is empty");
        }
    }
}
