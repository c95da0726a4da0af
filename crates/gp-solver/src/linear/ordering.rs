//! Orderings that keep the band narrow.

use super::SymmetricPattern;

/// Reverse Cuthill-McKee order: `order[k]` is the row that comes `k`-th. A ring of blocks (a net
/// that closes in its longer direction) comes out folded, with about twice the open bandwidth.
pub(crate) fn reverse_cuthill_mckee(pattern: &SymmetricPattern) -> Vec<usize> {
    let n = pattern.size();
    let mut neighbours = vec![Vec::new(); n];
    for j in 0..n {
        for &i in &pattern.rows()[pattern.column_starts()[j] + 1..pattern.column_starts()[j + 1]] {
            let i = i as usize;
            neighbours[i].push(j);
            neighbours[j].push(i);
        }
    }
    let degree: Vec<usize> = neighbours.iter().map(Vec::len).collect();
    for list in &mut neighbours {
        list.sort_by_key(|&i| (degree[i], i));
    }
    let mut by_degree: Vec<usize> = (0..n).collect();
    by_degree.sort_by_key(|&i| (degree[i], i));
    let mut placed = vec![false; n];
    let mut order = Vec::with_capacity(n);
    for &seed in &by_degree {
        if placed[seed] {
            continue;
        }
        let root = peripheral(seed, &neighbours, &degree);
        let begin = order.len();
        order.push(root);
        placed[root] = true;
        let mut head = begin;
        while head < order.len() {
            for &i in &neighbours[order[head]] {
                if !placed[i] {
                    placed[i] = true;
                    order.push(i);
                }
            }
            head += 1;
        }
    }
    order.reverse();
    order
}

/// A row at the far end of its component: the last level of a breadth-first search, twice.
fn peripheral(seed: usize, neighbours: &[Vec<usize>], degree: &[usize]) -> usize {
    let mut root = seed;
    let mut depth = 0;
    for _ in 0..4 {
        let mut level = std::collections::HashMap::from([(root, 0_usize)]);
        let mut queue = vec![root];
        let mut head = 0;
        while head < queue.len() {
            let here = queue[head];
            for &i in &neighbours[here] {
                if !level.contains_key(&i) {
                    level.insert(i, level[&here] + 1);
                    queue.push(i);
                }
            }
            head += 1;
        }
        let last = level[&queue[queue.len() - 1]];
        if last <= depth && depth > 0 {
            break;
        }
        depth = last;
        // Of the farthest rows the one with the fewest neighbours (ties: the lowest number).
        let far = queue.iter().filter(|i| level[i] == last).min_by_key(|&&i| (degree[i], i));
        root = far.copied().unwrap_or(root);
    }
    root
}

/// Half-bandwidth of a pattern under the positions `position[row]`.
pub(crate) fn half_bandwidth(pattern: &SymmetricPattern, position: &[usize]) -> usize {
    let mut kd = 0;
    for j in 0..pattern.size() {
        for &i in &pattern.rows()[pattern.column_starts()[j]..pattern.column_starts()[j + 1]] {
            kd = kd.max(position[i as usize].abs_diff(position[j]));
        }
    }
    kd
}
