//! Which values of a function on the cut surface are free, real and whole.
//!
//! Across each piece of the cuts a function goes over into plus or minus itself and a whole number.
//! Around every vertex these steps must close up: that ties the copies of a vertex to one real
//! number, makes some whole numbers follow from others, and puts singular vertices on whole numbers.

use std::collections::BTreeMap;

use crate::cut::Cut;
use crate::error::Error;
use crate::singular::Singular;
use crate::surface::Surface;

/// A sum of whole multiples of whole numbers.
type Whole = BTreeMap<u32, i64>;

fn add(to: &mut Whole, factor: i64, what: &Whole) {
    for (&k, &c) in what {
        let sum = to.entry(k).or_insert(0);
        *sum += factor * c;
        if *sum == 0 {
            to.remove(&k);
        }
    }
}

/// A value on the cut surface: plus or minus a real unknown, and whole multiples of whole ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Value {
    pub(crate) real: Option<(u32, f64)>,
    pub(crate) whole: Vec<(u32, f64)>,
}

/// The unknowns of one function, which are the same for both.
#[derive(Clone, Debug)]
pub(crate) struct Unknowns {
    pub(crate) reals: usize,
    pub(crate) wholes: usize,
    /// A real unknown to hold at zero if nothing else says where zero is.
    pub(crate) held: Option<usize>,
    /// Per sheet (see [`Cut::sheets`]).
    pub(crate) values: Vec<Value>,
    /// What is added across each segment, from left to right.
    pub(crate) steps: Vec<Vec<(u32, f64)>>,
}

/// `value[a] = sign · value[parent] + whole`
struct Forest {
    parent: Vec<u32>,
    sign: Vec<i64>,
    whole: Vec<Whole>,
}

impl Forest {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect(), sign: vec![1; n], whole: vec![Whole::new(); n] }
    }

    /// The root, with everything on the way hung directly to it.
    fn find(&mut self, a: u32) -> u32 {
        let mut path = Vec::new();
        let mut root = a;
        while self.parent[root as usize] != root {
            path.push(root);
            root = self.parent[root as usize];
        }
        for &b in path.iter().rev() {
            let (b, p) = (b as usize, self.parent[b as usize] as usize);
            if p as u32 != root {
                let above = self.whole[p].clone();
                let sign = self.sign[b];
                add(&mut self.whole[b], sign, &above);
                self.sign[b] *= self.sign[p];
                self.parent[b] = root;
            }
        }
        root
    }
}

impl Unknowns {
    pub(crate) fn new(surface: &Surface, cut: &Cut, singular: &[Singular]) -> Result<Self, Error> {
        let mut forest = Forest::new(cut.sheet_count);
        // Sums that must vanish; and roots twice which is a sum.
        let (mut zero, mut twice): (Vec<Whole>, Vec<(u32, Whole)>) = (Vec::new(), Vec::new());
        for (number, segment) in cut.segments.iter().enumerate() {
            let sign = i64::from(segment.sign);
            for &(f, k) in &segment.sides {
                let (f, k) = (f as usize, k as usize);
                let g = surface.across[f][k] as usize;
                let l = surface.same_side(f, k, g);
                let ends = [(k, (l + 1) % 3), ((k + 1) % 3, l)];
                for (own, other) in ends {
                    // Right = sign · left + step.
                    let (a, b) = (cut.sheets[f][own], cut.sheets[g][other]);
                    let (root_a, root_b) = (forest.find(a), forest.find(b));
                    let (a, b) = (a as usize, b as usize);
                    let mut rest = Whole::from([(number as u32, 1)]);
                    add(&mut rest, sign, &forest.whole[a].clone());
                    add(&mut rest, -1, &forest.whole[b].clone());
                    let (sign_a, sign_b) = (forest.sign[a], forest.sign[b]);
                    // sign_b · root_b = sign · sign_a · root_a + rest
                    let own_b = |rest: &Whole| {
                        let mut turned = Whole::new();
                        add(&mut turned, sign_b, rest);
                        turned
                    };
                    if root_a != root_b {
                        forest.parent[root_b as usize] = root_a;
                        forest.sign[root_b as usize] = sign_b * sign * sign_a;
                        forest.whole[root_b as usize] = own_b(&rest);
                    } else if sign_b == sign * sign_a {
                        if !rest.is_empty() {
                            zero.push(rest);
                        }
                    } else {
                        twice.push((root_a, own_b(&rest)));
                    }
                }
            }
        }
        // Roots that are whole: those above, and singular vertices with whole turns.
        let mut whole_roots: BTreeMap<u32, u32> = BTreeMap::new();
        let number_of = |root: u32, roots: &mut BTreeMap<u32, u32>| {
            let next = (cut.segments.len() + roots.len()) as u32;
            *roots.entry(root).or_insert(next)
        };
        let mut rows = zero;
        for (old, sum) in twice {
            // It may hang on another root by now: 2 (sign · root + whole) = sum.
            let root = forest.find(old);
            let sign = if root == old { 1 } else { forest.sign[old as usize] };
            let own = number_of(root, &mut whole_roots);
            let mut row = Whole::from([(own, 2 * sign)]);
            if root != old {
                add(&mut row, 2, &forest.whole[old as usize].clone());
            }
            add(&mut row, -1, &sum);
            rows.push(row);
        }
        for s in singular {
            if let Some(&(f, k)) = surface.star(s.vertex).first() {
                let root = forest.find(cut.sheets[f as usize][k as usize]);
                number_of(root, &mut whole_roots);
            }
        }
        let count = cut.segments.len() + whole_roots.len();
        let (free, wholes) = eliminate(rows, count)?;
        let expand = |sum: &Whole| -> Vec<(u32, f64)> {
            let mut out = Whole::new();
            for (&k, &c) in sum {
                add(&mut out, c, &free[k as usize]);
            }
            out.into_iter().map(|(k, c)| (k, c as f64)).collect()
        };
        let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
        let mut values = Vec::with_capacity(cut.sheet_count);
        // Whether all copies of every real unknown have the same sign: then adding a constant to it all
        // changes nothing.
        let mut signs: Vec<f64> = Vec::new();
        let mut floats = whole_roots.is_empty();
        for a in 0..cut.sheet_count as u32 {
            let root = forest.find(a);
            let (sign, mut sum) = (forest.sign[a as usize], forest.whole[a as usize].clone());
            let real = match whole_roots.get(&root) {
                Some(&own) => {
                    add(&mut sum, sign, &Whole::from([(own, 1)]));
                    None
                }
                None => {
                    let next = numbers.len() as u32;
                    let number = *numbers.entry(root).or_insert(next);
                    if number as usize == signs.len() {
                        signs.push(sign as f64);
                    }
                    floats &= signs[number as usize] == sign as f64;
                    Some((number, sign as f64))
                }
            };
            values.push(Value { real, whole: expand(&sum) });
        }
        // In the middle, so that the net is as symmetric as the surface and meets the border by chance.
        let middle = middle(surface);
        let held = surface.star(middle).first().and_then(|&(f, k)| {
            let sheet = cut.sheets[f as usize][k as usize] as usize;
            let value: &Value = &values[sheet];
            value.real.map(|(number, _)| number as usize)
        });
        let steps = (0..cut.segments.len() as u32).map(|k| expand(&Whole::from([(k, 1)])));
        Ok(Self {
            reals: numbers.len(),
            wholes,
            held: if floats { held } else { None },
            values,
            steps: steps.collect(),
        })
    }
}

/// Vertices that are so nearly as far from the middle as the nearest count as equally far: on a ring
/// all are, and which of them wins must not be a matter of rounding.
const AS_NEAR: f64 = 1.0 + 1e-9;

/// The vertex nearest to the middle of the surface; of several the first.
fn middle(surface: &Surface) -> usize {
    let weighted = (0..surface.areas.len()).map(|f| surface.centre(f) * surface.areas[f]);
    let middle = weighted.sum::<geom_core::DVec3>() / surface.area();
    let away = |v: usize| surface.positions[v].distance(middle);
    let vertices = || (0..surface.positions.len()).filter(|&v| !surface.star(v).is_empty());
    let least = vertices().map(away).fold(f64::INFINITY, f64::min);
    vertices().find(|&v| away(v) <= AS_NEAR * least).unwrap_or(0)
}

/// Solves the rows, each a sum that vanishes, for some of `count` whole numbers in terms of the
/// others: what each is in those left, and how many are left.
fn eliminate(rows: Vec<Whole>, count: usize) -> Result<(Vec<Whole>, usize), Error> {
    let mut solved: BTreeMap<u32, Whole> = BTreeMap::new();
    let mut open = rows;
    while !open.is_empty() {
        let mut left = Vec::new();
        let mut progress = false;
        for row in std::mem::take(&mut open) {
            let mut sum = Whole::new();
            for (&k, &c) in &row {
                match solved.get(&k) {
                    Some(known) => add(&mut sum, c, known),
                    None => add(&mut sum, c, &Whole::from([(k, 1)])),
                }
            }
            let common = sum.values().fold(0, |d, &c| gcd(d, c.abs()));
            if common == 0 {
                continue;
            }
            sum.values_mut().for_each(|c| *c /= common);
            let pivot = sum.iter().find(|(_, c)| c.abs() == 1).map(|(&k, &c)| (k, c));
            let Some((k, c)) = pivot else {
                left.push(sum);
                continue;
            };
            sum.remove(&k);
            let mut known = Whole::new();
            add(&mut known, -c, &sum);
            for other in solved.values_mut() {
                if let Some(factor) = other.remove(&k) {
                    add(other, factor, &known);
                }
            }
            solved.insert(k, known);
            progress = true;
        }
        if !left.is_empty() && !progress {
            return Err(Error::DoesNotClose);
        }
        open = left;
    }
    let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
    for k in (0..count as u32).filter(|k| !solved.contains_key(k)) {
        numbers.insert(k, numbers.len() as u32);
    }
    let renumbered = |sum: &Whole| sum.iter().map(|(k, &c)| (numbers[k], c)).collect();
    let own = |k: u32| match solved.get(&k) {
        Some(known) => renumbered(known),
        None => Whole::from([(numbers[&k], 1)]),
    };
    Ok(((0..count as u32).map(own).collect(), numbers.len()))
}

fn gcd(a: i64, b: i64) -> i64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_leave_the_numbers_that_are_free() {
        // 2 k₂ = k₀ + k₁, and k₀ = k₃.
        let rows = vec![Whole::from([(0, -1), (1, -1), (2, 2)]), Whole::from([(0, 1), (3, -1)])];
        let (free, left) = eliminate(rows, 4).unwrap();
        assert_eq!(left, 2);
        for values in [[3_i64, 5], [-2, 7]] {
            let k: Vec<i64> = free
                .iter()
                .map(|sum| sum.iter().map(|(k, c)| c * values[*k as usize]).sum())
                .collect();
            assert_eq!(2 * k[2], k[0] + k[1]);
            assert_eq!(k[0], k[3]);
        }
    }

    #[test]
    fn a_common_factor_is_no_obstacle() {
        let (free, left) = eliminate(vec![Whole::from([(0, 2), (1, -4)])], 2).unwrap();
        assert_eq!((left, free[0].clone()), (1, Whole::from([(0, 2)])));
        assert_eq!(eliminate(vec![Whole::from([(0, 2), (1, 3)])], 2), Err(Error::DoesNotClose));
    }
}
