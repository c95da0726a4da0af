//! Integrals over a whole subdivision surface and their gradients.

use crate::density::Density;
use crate::functional::{Coefficients, Energy, Functional};
use crate::guides::Guides;
use crate::kernel::{DensityRun, GRADIENT_LEN, PatchRun, Task};
use crate::rules::{Quadrature, SeparableRule, Table};
use pulp::Arch;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use subdiv_catmull_clark::{BasisId, SubdivisionSurface};

/// Patches a worker takes at a time, so that sums do not depend on how the work was divided.
const RUN: usize = 16;

pub(crate) enum Rule {
    Separable(SeparableRule),
    /// Shared by the groups of one basis.
    Table(Arc<Table>),
}

/// Patches with one basis and one multiplicity.
pub(crate) struct Group {
    pub(crate) rule: Rule,
    pub(crate) basis: BasisId,
    /// Control points per patch.
    pub(crate) per_patch: usize,
    /// Control points, patch after patch.
    pub(crate) controls: Vec<u32>,
    /// How many copies of every patch the surface has.
    pub(crate) multiplicity: f64,
    first_patch: usize,
    /// Patches of one run: a worker's share, whose gradients are added up as they come.
    run: usize,
    /// Slot of every control point among those of its run.
    places: Vec<u16>,
    /// First slot of every run among those of all groups, and where the last one ends.
    run_starts: Vec<u32>,
}

impl Group {
    pub(crate) fn patches(&self) -> usize {
        self.controls.len() / self.per_patch
    }
}

/// Evaluates energies of a subdivision surface, given its control points as a flat list of
/// coordinates.
///
/// Every run of patches writes its own gradient; the vertices then collect them in a fixed order, so
/// the result is the same to the last bit for any number of threads.
pub struct SurfaceEnergy {
    arch: Arch,
    groups: Vec<Group>,
    guides: Guides,
    vertex_count: usize,
    patch_count: usize,
    slot_count: usize,
    // For every vertex its slots, one per run that touches it, compressed:
    // `slots[starts[v]..starts[v + 1]]`.
    starts: Vec<u32>,
    slots: Vec<u32>,
    // Factor of a slot's gradient: the multiplicity of its patch.
    slot_factors: Vec<f64>,
}

/// Buffers of [`SurfaceEnergy`], kept between evaluations.
#[derive(Default)]
pub struct Workspace {
    integrals: Vec<[f64; 2]>,
    gradients: Vec<f64>,
    // Vertices and coefficients of guides.
    points: Vec<f64>,
}

/// Values of all functionals on one surface.
#[derive(Clone, Debug, PartialEq)]
pub struct EnergyTable {
    values: Vec<(Functional, f64)>,
}

impl EnergyTable {
    /// The values when every length is `factor` times what it was.
    pub(crate) fn scale_lengths(&mut self, factor: f64) {
        for (functional, value) in &mut self.values {
            *value *= factor.powi(functional.length_power());
        }
    }

    /// The value of a functional; for a weighted Mehlum-Tarrou energy from its two parts.
    #[must_use]
    pub fn get(&self, functional: Functional) -> f64 {
        if let Functional::MehlumTarrou { w1, w3 } = functional {
            return w1 * self.get(Functional::F1) + w3 * self.get(Functional::F3);
        }
        self.values.iter().find(|(f, _)| *f == functional).map_or(f64::NAN, |(_, value)| *value)
    }

    /// The value of a weighted sum.
    #[must_use]
    pub fn total(&self, energy: &Energy) -> f64 {
        energy.combine(|functional| self.get(functional))
    }

    /// Values in the order of [`Functional::ALL`].
    pub(crate) fn of(values: Vec<(Functional, f64)>) -> Self {
        Self { values }
    }

    /// Nothing has been computed: all values are NaN.
    pub(crate) fn unknown() -> Self {
        Self { values: Functional::ALL.map(|f| (f, f64::NAN)).to_vec() }
    }

    /// All functionals in the order of [`Functional::ALL`].
    pub fn iter(&self) -> impl Iterator<Item = (Functional, f64)> + '_ {
        self.values.iter().copied()
    }

    /// All values under the names of their functionals.
    #[must_use]
    pub fn by_name(&self) -> BTreeMap<&'static str, f64> {
        self.iter().map(|(functional, value)| (functional.name(), value)).collect()
    }
}

impl SurfaceEnergy {
    /// Evaluates all patches of a surface.
    #[must_use]
    pub fn new(surface: &SubdivisionSurface, vertex_count: usize, quadrature: Quadrature) -> Self {
        Self::with_multiplicities(surface, vertex_count, quadrature, &[])
    }

    /// Evaluates only patches whose multiplicity is not zero, and counts each that many times;
    /// with an empty list every patch counts once.
    pub(crate) fn with_multiplicities(
        surface: &SubdivisionSurface,
        vertex_count: usize,
        quadrature: Quadrature,
        multiplicities: &[u32],
    ) -> Self {
        let mut keys: Vec<(BasisId, u32)> = Vec::new();
        let key = |i: usize| -> (BasisId, u32) {
            let patch = &surface.patches()[i];
            (patch.basis, multiplicities.get(i).copied().unwrap_or(1))
        };
        for i in 0..surface.patches().len() {
            if key(i).1 > 0 && !keys.contains(&key(i)) {
                keys.push(key(i));
            }
        }
        // The costly patches first, so that no worker is left with them at the end.
        keys.sort_by_key(|&(basis, multiplicity)| {
            (surface.regular_basis() == Some(basis), basis, multiplicity)
        });
        let mut tables: Vec<(BasisId, Arc<Table>)> = keys
            .iter()
            .map(|k| k.0)
            .filter(|&b| surface.regular_basis() != Some(b))
            .collect::<std::collections::BTreeSet<_>>()
            .into_par_iter()
            .map(|b| (b, Arc::new(Table::new(surface, b, quadrature.nodes(surface, b)))))
            .collect();
        tables.sort_by_key(|t| t.0);
        let evaluated = (0..surface.patches().len()).filter(|&i| key(i).1 > 0);
        let controls = evaluated.flat_map(|i| surface.patches()[i].controls.iter().copied());
        let mut this = Self {
            arch: Arch::new(),
            guides: Guides::new(surface, controls),
            groups: Vec::with_capacity(keys.len()),
            vertex_count,
            patch_count: 0,
            slot_count: 0,
            starts: Vec::new(),
            slots: Vec::new(),
            slot_factors: Vec::new(),
        };
        for &wanted in &keys {
            let (basis, multiplicity) = wanted;
            let rule = if surface.regular_basis() == Some(basis) {
                match SeparableRule::new(surface, basis, quadrature.regular) {
                    Some(rule) => Rule::Separable(rule),
                    None => Rule::Table(Arc::new(Table::new(surface, basis, quadrature.regular))),
                }
            } else {
                let at = tables.partition_point(|t| t.0 < basis);
                Rule::Table(Arc::clone(&tables[at].1))
            };
            let mut controls = Vec::new();
            for (i, patch) in surface.patches().iter().enumerate() {
                if key(i) == wanted {
                    controls.extend_from_slice(&patch.controls);
                }
            }
            let per_patch = match &rule {
                Rule::Separable(_) => 16,
                Rule::Table(table) => table.controls,
            };
            let patches = controls.len() / per_patch;
            let run = if matches!(rule, Rule::Separable(_)) { RUN } else { 1 };
            this.groups.push(Group {
                rule,
                basis,
                per_patch,
                controls,
                multiplicity: f64::from(multiplicity),
                first_patch: this.patch_count,
                run,
                places: Vec::new(),
                run_starts: Vec::new(),
            });
            this.patch_count += patches;
        }
        this.list_slots();
        this
    }

    fn list_slots(&mut self) {
        let mut vertices: Vec<u32> = Vec::new();
        let mut factors: Vec<f64> = Vec::new();
        // Slot of a vertex in the run that met it last, and that run's first slot.
        let points = self.vertex_count + self.guides.len();
        let mut met = vec![(u32::MAX, 0_u16); points];
        for group in &mut self.groups {
            for controls in group.controls.chunks(group.run * group.per_patch) {
                let first = vertices.len() as u32;
                group.run_starts.push(first);
                for &v in controls {
                    let (run, place) = &mut met[v as usize];
                    if *run != first {
                        (*run, *place) = (first, (vertices.len() - first as usize) as u16);
                        vertices.push(v);
                        factors.push(group.multiplicity);
                    }
                    group.places.push(*place);
                }
            }
            group.run_starts.push(vertices.len() as u32);
        }
        let mut starts = vec![0_u32; points + 1];
        for &v in &vertices {
            starts[v as usize + 1] += 1;
        }
        for v in 0..points {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        self.slots = vec![0; vertices.len()];
        for (slot, &v) in vertices.iter().enumerate() {
            self.slots[next[v as usize] as usize] = slot as u32;
            next[v as usize] += 1;
        }
        self.slot_count = vertices.len();
        self.slot_factors = factors;
        self.starts = starts;
    }

    /// Number of patches that are evaluated.
    #[must_use]
    pub fn patch_count(&self) -> usize {
        self.patch_count
    }

    /// Number of samples of one evaluation.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        self.groups
            .iter()
            .map(|g| {
                g.patches()
                    * match &g.rule {
                        Rule::Separable(rule) => rule.nodes * rule.nodes,
                        Rule::Table(table) => table.samples,
                    }
            })
            .sum()
    }

    pub(crate) fn groups(&self) -> &[Group] {
        &self.groups
    }

    pub(crate) fn guides(&self) -> &Guides {
        &self.guides
    }

    pub(crate) fn arch(&self) -> Arch {
        self.arch
    }

    /// Number of patches of the whole surface, copies included.
    pub(crate) fn weighted_patches(&self) -> f64 {
        self.groups.iter().map(|g| g.multiplicity * g.patches() as f64).sum()
    }

    /// The area.
    #[must_use]
    pub fn area(&self, positions: &[f64], work: &mut Workspace) -> f64 {
        self.pass(positions, Task::Area, work)[0]
    }

    /// Area and gradient of the area.
    pub(crate) fn area_gradient(
        &self,
        positions: &[f64],
        work: &mut Workspace,
        gradient: &mut [f64],
    ) -> f64 {
        let [area, _] = self.pass(positions, Task::Gradient(&Density::default()), work);
        self.gather(work, 0.0, 1.0, gradient);
        area
    }

    /// The energy.
    #[must_use]
    pub fn energy(&self, energy: &Energy, positions: &[f64], work: &mut Workspace) -> f64 {
        let Coefficients { area: c, mut plain, scaled } = energy.coefficients();
        if plain.is_zero() {
            let [area, integral] = self.pass(positions, Task::Energy(&scaled), work);
            return c * area + area * integral;
        }
        let area = self.area(positions, work);
        fix_epsilon(&mut plain, area);
        let density = plain.plus(area, &scaled);
        c * area + self.pass(positions, Task::Energy(&density), work)[1]
    }

    /// As [`Self::energy`], of an energy given by its coefficients, with the regularisation of
    /// [`Functional::Sqrt`] relative to the area `epsilon_area`: to the bit what
    /// [`Self::gradient_of`] returns.
    pub(crate) fn energy_of(
        &self,
        coefficients: Coefficients,
        positions: &[f64],
        epsilon_area: f64,
        work: &mut Workspace,
    ) -> f64 {
        let Coefficients { area: c, mut plain, scaled } = coefficients;
        fix_epsilon(&mut plain, epsilon_area);
        if plain.is_zero() {
            let [area, integral] = self.pass(positions, Task::Energy(&scaled), work);
            c * area + area * integral
        } else if scaled.is_zero() {
            let [area, integral] = self.pass(positions, Task::Energy(&plain), work);
            c * area + integral
        } else {
            let area = self.area(positions, work);
            let density = plain.plus(area, &scaled);
            c * area + self.pass(positions, Task::Energy(&density), work)[1]
        }
    }

    /// The energy and its gradient by the control points' coordinates.
    ///
    /// The regularisation of [`Functional::Sqrt`] is taken relative to the area and held fixed
    /// while differentiating; `epsilon_area` is that area, to be kept during a line search.
    ///
    /// # Panics
    /// If a slice does not hold three numbers per vertex.
    pub fn gradient(
        &self,
        energy: &Energy,
        positions: &[f64],
        epsilon_area: Option<f64>,
        work: &mut Workspace,
        gradient: &mut [f64],
    ) -> f64 {
        let coefficients = energy.coefficients();
        self.gradient_of(coefficients, positions, epsilon_area, work, gradient)
    }

    /// As [`Self::gradient`], of an energy given by its coefficients.
    pub(crate) fn gradient_of(
        &self,
        coefficients: Coefficients,
        positions: &[f64],
        epsilon_area: Option<f64>,
        work: &mut Workspace,
        gradient: &mut [f64],
    ) -> f64 {
        assert_eq!(gradient.len(), 3 * self.vertex_count, "three coordinates per vertex");
        let Coefficients { area: c, mut plain, scaled } = coefficients;
        if plain.root != 0.0 {
            let area = epsilon_area.unwrap_or_else(|| self.area(positions, work));
            fix_epsilon(&mut plain, area);
        }
        if plain.is_zero() {
            let [area, integral] = self.pass(positions, Task::Gradient(&scaled), work);
            self.gather(work, area, integral + c, gradient);
            c * area + area * integral
        } else if scaled.is_zero() {
            let [area, integral] = self.pass(positions, Task::Gradient(&plain), work);
            self.gather(work, 1.0, c, gradient);
            c * area + integral
        } else {
            // d(∫p + A ∫s) = d∫(p + A s) with A held, plus (∫s) dA; ∫s follows from an energy pass
            // of p, which is cheaper than a third set of adjoints.
            let area = self.area(positions, work);
            let plain_integral = self.pass(positions, Task::Energy(&plain), work)[1];
            let density = plain.plus(area, &scaled);
            let [_, integral] = self.pass(positions, Task::Gradient(&density), work);
            let scaled_integral = (integral - plain_integral) / area;
            self.gather(work, 1.0, c + scaled_integral, gradient);
            c * area + integral
        }
    }

    /// All functionals at once.
    #[must_use]
    pub fn table(&self, positions: &[f64], work: &mut Workspace) -> EnergyTable {
        self.table_until(positions, work, &mut || false).unwrap_or_else(EnergyTable::unknown)
    }

    /// As [`Self::table`]; `None` once `stop` says so between two functionals.
    pub(crate) fn table_until(
        &self,
        positions: &[f64],
        work: &mut Workspace,
        stop: &mut dyn FnMut() -> bool,
    ) -> Option<EnergyTable> {
        let area = self.area(positions, work);
        if stop() {
            return None;
        }
        let others = Functional::ALL.into_iter().filter(|f| *f != Functional::Area);
        let (densities, scaled): (Vec<Density>, Vec<bool>) = others
            .map(Functional::density)
            .map(|(mut density, scaled)| {
                fix_epsilon(&mut density, area);
                (density, scaled)
            })
            .unzip();
        let integrals = self.integrals(positions, &densities, work);
        let mut integrals = integrals.into_iter().zip(scaled);
        let mut value = |functional: Functional| match functional {
            Functional::Area => area,
            _ => integrals.next().map_or(f64::NAN, |(i, scaled)| if scaled { area * i } else { i }),
        };
        Some(EnergyTable { values: Functional::ALL.map(|f| (f, value(f))).to_vec() })
    }

    /// Integrals of several densities.
    fn integrals(
        &self,
        positions: &[f64],
        densities: &[Density],
        work: &mut Workspace,
    ) -> Vec<f64> {
        assert_eq!(positions.len(), 3 * self.vertex_count, "three coordinates per vertex");
        let mut points = std::mem::take(&mut work.points);
        let positions = if self.guides.is_empty() {
            positions
        } else {
            self.guides.extend(positions, &mut points);
            &points[..]
        };
        let width = densities.len();
        let mut all = vec![0.0; width * self.patch_count];
        let mut rest = &mut all[..];
        let mut runs = Vec::new();
        for group in &self.groups {
            let (now, after) = std::mem::take(&mut rest).split_at_mut(width * group.patches());
            rest = after;
            let shares = group.controls.chunks(group.run * group.per_patch);
            let places = group.places.chunks(group.run * group.per_patch);
            let now = now.chunks_mut(group.run * width);
            runs.extend(shares.zip(places).zip(now).map(|(share, out)| (group, share, out)));
        }
        let arch = self.arch;
        runs.into_par_iter().for_each(|(group, (controls, places), integrals)| {
            let per_patch = group.per_patch;
            match &group.rule {
                Rule::Table(rule) => {
                    let rule = &**rule;
                    let run =
                        DensityRun { rule, densities, positions, controls, per_patch, integrals };
                    arch.dispatch(run);
                }
                Rule::Separable(rule) => {
                    let mut found = [[0.0; 2]; RUN];
                    let patches = controls.len() / per_patch;
                    for (k, density) in densities.iter().enumerate() {
                        arch.dispatch(PatchRun {
                            rule,
                            task: Task::Energy(density),
                            positions,
                            controls,
                            places,
                            per_patch,
                            integrals: &mut found[..patches],
                            gradients: &mut [],
                        });
                        for (out, [_, integral]) in integrals.chunks_mut(width).zip(found) {
                            out[k] = integral;
                        }
                    }
                }
            }
        });
        let mut totals = vec![0.0; width];
        for group in &self.groups {
            let range = width * group.first_patch..width * (group.first_patch + group.patches());
            for patch in all[range].chunks(width) {
                totals.iter_mut().zip(patch).for_each(|(t, i)| *t += group.multiplicity * i);
            }
        }
        work.points = points;
        totals
    }

    /// `∫ |K| dA`, the scale a Gauss-Bonnet residual is compared with.
    #[must_use]
    pub fn absolute_gaussian(&self, positions: &[f64], work: &mut Workspace) -> f64 {
        let density = Density { absolute: 1.0, ..Density::default() };
        self.pass(positions, Task::Energy(&density), work)[1]
    }

    /// Area and integral of the task's density; a gradient pass leaves the patches' gradients in
    /// the workspace.
    fn pass(&self, positions: &[f64], task: Task<'_>, work: &mut Workspace) -> [f64; 2] {
        assert_eq!(positions.len(), 3 * self.vertex_count, "three coordinates per vertex");
        if self.guides.is_empty() {
            return self.pass_over(positions, task, work);
        }
        let mut points = std::mem::take(&mut work.points);
        self.guides.extend(positions, &mut points);
        let sums = self.pass_over(&points, task, work);
        work.points = points;
        sums
    }

    /// As [`Self::pass`], of all control points.
    fn pass_over(&self, positions: &[f64], task: Task<'_>, work: &mut Workspace) -> [f64; 2] {
        let with_gradient = matches!(task, Task::Gradient(_));
        work.integrals.resize(self.patch_count, [0.0; 2]);
        if with_gradient {
            work.gradients.resize(GRADIENT_LEN * self.slot_count, 0.0);
        }
        let mut integrals = &mut work.integrals[..];
        let mut gradients = if with_gradient { &mut work.gradients[..] } else { &mut [][..] };
        let mut runs = Vec::new();
        for group in &self.groups {
            let patches = group.patches();
            let (now, rest) = std::mem::take(&mut integrals).split_at_mut(patches);
            integrals = rest;
            let width = if with_gradient { GRADIENT_LEN } else { 0 };
            let share = group.run * group.per_patch;
            let shares = group.controls.chunks(share).zip(group.places.chunks(share));
            for ((integrals, share), bounds) in
                now.chunks_mut(group.run).zip(shares).zip(group.run_starts.windows(2))
            {
                let slots = (bounds[1] - bounds[0]) as usize;
                let (now, rest) = std::mem::take(&mut gradients).split_at_mut(width * slots);
                gradients = rest;
                runs.push((group, share, integrals, now));
            }
        }
        let arch = self.arch;
        runs.into_par_iter().for_each(|(group, (controls, places), integrals, gradients)| {
            let per_patch = group.per_patch;
            match &group.rule {
                Rule::Separable(rule) => arch.dispatch(PatchRun {
                    rule,
                    task,
                    positions,
                    controls,
                    places,
                    per_patch,
                    integrals,
                    gradients,
                }),
                Rule::Table(rule) => arch.dispatch(PatchRun {
                    rule: &**rule,
                    task,
                    positions,
                    controls,
                    places,
                    per_patch,
                    integrals,
                    gradients,
                }),
            }
        });
        let mut total = [0.0; 2];
        for group in &self.groups {
            let range = group.first_patch..group.first_patch + group.patches();
            for [a, i] in &work.integrals[range] {
                total[0] += group.multiplicity * a;
                total[1] += group.multiplicity * i;
            }
        }
        total
    }

    /// `out = f · ∂∫ + g · ∂A` from the last gradient pass.
    fn gather(&self, work: &Workspace, f: f64, g: f64, out: &mut [f64]) {
        let collect = |v: usize| {
            let mut sum = [0.0; 3];
            for &slot in &self.slots[self.starts[v] as usize..self.starts[v + 1] as usize] {
                let at = GRADIENT_LEN * slot as usize;
                let factor = self.slot_factors[slot as usize];
                for c in 0..3 {
                    sum[c] +=
                        factor * (f * work.gradients[at + c] + g * work.gradients[at + 3 + c]);
                }
            }
            sum
        };
        out.par_chunks_mut(3).with_min_len(256).enumerate().for_each(|(v, out)| {
            out.copy_from_slice(&collect(v));
        });
        self.guides.pull_back(collect, out);
    }
}

// The regularisation is a share of the area so that the functional stays scale invariant.
fn fix_epsilon(density: &mut Density, area: f64) {
    if density.root != 0.0 {
        density.root_epsilon = crate::functional::ROOT_EPSILON / area;
    }
}

/// Coordinates of points as a flat list.
#[must_use]
pub(crate) fn flatten(points: &[geom_core::DVec3]) -> Vec<f64> {
    points.iter().flat_map(|p| p.to_array()).collect()
}

/// Points from a flat list of coordinates.
pub(crate) fn unflatten(coordinates: &[f64]) -> Vec<geom_core::DVec3> {
    coordinates.chunks_exact(3).map(|c| geom_core::DVec3::new(c[0], c[1], c[2])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use subdiv_catmull_clark::{Blend, Creases};

    #[test]
    fn gradient_of_the_barrier_matches_central_differences() {
        let mesh = fixtures::quad_graphs::ellipsoid(3, geom_core::DVec3::new(1.0, 1.2, 1.6));
        let surface = SubdivisionSurface::new(&mesh, &Creases::none(), Blend::Smooth).unwrap();
        let evaluator = SurfaceEnergy::new(&surface, mesh.vertex_count(), Quadrature::COARSE);
        let mut coefficients = Energy::from_functional(Functional::Bending).coefficients();
        coefficients.plain.barrier = 0.7;
        let x = flatten(mesh.positions());
        let mut work = Workspace::default();
        let mut gradient = vec![0.0; x.len()];
        evaluator.gradient_of(coefficients, &x, None, &mut work, &mut gradient);
        let direction: Vec<f64> = (0..x.len()).map(|k| (1.7 * k as f64).sin()).collect();
        let mut at = |h: f64| {
            let y: Vec<f64> = x.iter().zip(&direction).map(|(p, d)| p + h * d).collect();
            evaluator.gradient_of(coefficients, &y, None, &mut work, &mut vec![0.0; x.len()])
        };
        let h = 2e-5;
        let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let want: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        assert!((slope / want - 1.0).abs() < 1e-8, "{slope} against {want}");
    }
}
