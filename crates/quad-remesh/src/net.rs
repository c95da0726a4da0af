//! From cells to a mesh: one part, without ears, manifold.

use std::collections::BTreeMap;

use geom_core::DVec3;

use crate::trace::Cells;

/// Quads that form a manifold.
#[derive(Clone, Debug)]
pub(crate) struct Net {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) quads: Vec<[u32; 4]>,
    /// Cells that were left out.
    pub(crate) dropped: usize,
}

/// Quads across each side of each quad.
type Across = Vec<[Option<usize>; 4]>;

fn across(quads: &[[u32; 4]]) -> Across {
    let mut sides: BTreeMap<(u32, u32), Vec<(usize, usize)>> = BTreeMap::new();
    for (f, q) in quads.iter().enumerate() {
        for k in 0..4 {
            let (a, b) = (q[k], q[(k + 1) % 4]);
            sides.entry((a.min(b), a.max(b))).or_default().push((f, k));
        }
    }
    let mut out = vec![[None; 4]; quads.len()];
    for list in sides.values() {
        if let [(f, k), (g, l)] = list[..] {
            out[f][k] = Some(g);
            out[g][l] = Some(f);
        }
    }
    out
}

/// Keeps the largest part of the cells, without cells that hang on by one side and without corners
/// at which parts only touch.
pub(crate) fn assemble(cells: Cells) -> Net {
    let Cells { positions, quads } = cells;
    let count = quads.len();
    let is_whole = |q: &[u32; 4]| (0..4).all(|i| (0..i).all(|j| q[i] != q[j]));
    let mut kept: Vec<usize> = (0..count).filter(|&f| is_whole(&quads[f])).collect();
    loop {
        let list: Vec<[u32; 4]> = kept.iter().map(|&f| quads[f]).collect();
        let across = across(&list);
        let part = largest_part(&across);
        let touching = touching(&list, &across);
        let stays = |f: usize| {
            let neighbours = across[f].iter().flatten().count();
            part[f] && !touching[f] && (neighbours > 1 || list.len() < 4)
        };
        let next: Vec<usize> = (0..list.len()).filter(|&f| stays(f)).map(|f| kept[f]).collect();
        let done = next.len() == kept.len();
        kept = next;
        if done {
            break;
        }
    }
    let mut numbers = vec![None; positions.len()];
    let mut net = Net { positions: Vec::new(), quads: Vec::new(), dropped: count - kept.len() };
    for &f in &kept {
        net.quads.push(quads[f].map(|v| {
            *numbers[v as usize].get_or_insert_with(|| {
                net.positions.push(positions[v as usize]);
                net.positions.len() as u32 - 1
            })
        }));
    }
    net
}

/// Which quads belong to the largest part that hangs together by sides.
fn largest_part(across: &Across) -> Vec<bool> {
    let mut part = vec![usize::MAX; across.len()];
    let mut sizes = Vec::new();
    for start in 0..across.len() {
        if part[start] != usize::MAX {
            continue;
        }
        let (mut open, mut size) = (vec![start], 0);
        part[start] = sizes.len();
        while let Some(f) = open.pop() {
            size += 1;
            for g in across[f].iter().flatten() {
                if part[*g] == usize::MAX {
                    part[*g] = sizes.len();
                    open.push(*g);
                }
            }
        }
        sizes.push(size);
    }
    let best = (0..sizes.len()).fold(0, |best, k| if sizes[k] > sizes[best] { k } else { best });
    part.into_iter().map(|p| p == best).collect()
}

/// Quads in all but the largest fan at a vertex with several.
fn touching(quads: &[[u32; 4]], across: &Across) -> Vec<bool> {
    let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (f, q) in quads.iter().enumerate() {
        q.iter().for_each(|&v| at.entry(v).or_default().push(f));
    }
    let mut out = vec![false; quads.len()];
    for list in at.values() {
        let mut fans: Vec<Vec<usize>> = Vec::new();
        let mut left = list.clone();
        while let Some(first) = left.pop() {
            let (mut fan, mut next) = (vec![first], 0);
            while next < fan.len() {
                for g in across[fan[next]].iter().flatten() {
                    if let Some(k) = left.iter().position(|h| h == g) {
                        fan.push(left.swap_remove(k));
                    }
                }
                next += 1;
            }
            fans.push(fan);
        }
        let most = fans.iter().map(Vec::len).max().unwrap_or(0);
        let keep = fans.iter().position(|fan| fan.len() == most).unwrap_or(0);
        for (k, fan) in fans.iter().enumerate() {
            if k != keep {
                fan.iter().for_each(|&f| out[f] = true);
            }
        }
    }
    out
}
