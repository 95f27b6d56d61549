//! The call graph: who calls whom, cycles, and the chain that takes the most stack.

use std::collections::BTreeSet;

/// A graph of calls. Nodes are functions by their place in a list.
#[derive(Clone, Debug)]
pub struct Graph {
    /// Stack of each [bytes]: its frame, and the bytes that a call itself pushes.
    pub cost: Vec<u64>,
    /// Callees of each.
    pub callees: Vec<BTreeSet<usize>>,
}

/// Functions and chains of calls below a function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Below {
    /// Everything that can run, the function among it.
    pub reached: BTreeSet<usize>,
    /// Groups of functions that call each other in a circle, and functions that call themselves.
    pub cycles: Vec<Vec<usize>>,
    /// The chain of calls that takes the most stack, from the function on; empty where there are
    /// cycles, which have no such chain.
    pub chain: Vec<usize>,
}

impl Graph {
    /// Looks at everything that `entry` leads to. Cost: linear in functions and calls.
    pub fn below(&self, entry: usize) -> Below {
        let components = self.components(entry);
        let reached = components.iter().flatten().copied().collect();
        let is_cycle = |group: &&Vec<usize>| {
            group.len() > 1 || group.iter().any(|f| self.callees[*f].contains(f))
        };
        let cycles: Vec<_> = components.iter().filter(is_cycle).cloned().collect();
        let chain = if cycles.is_empty() { self.deepest(entry, &components) } else { Vec::new() };
        Below { reached, cycles, chain }
    }

    /// Tarjan's strongly connected components, callees before their callers. Without recursion: an
    /// image is data, and data must not exhaust the stack.
    fn components(&self, entry: usize) -> Vec<Vec<usize>> {
        let count = self.callees.len();
        let (mut index, mut low) = (vec![usize::MAX; count], vec![0; count]);
        let (mut open, mut is_open) = (Vec::new(), vec![false; count]);
        let (mut components, mut next) = (Vec::new(), 0);
        let mut work = vec![(entry, self.callees[entry].iter())];
        (index[entry], low[entry]) = (next, next);
        next += 1;
        open.push(entry);
        is_open[entry] = true;
        while let Some((node, callees)) = work.last_mut() {
            let node = *node;
            match callees.next() {
                Some(&callee) if index[callee] == usize::MAX => {
                    (index[callee], low[callee]) = (next, next);
                    next += 1;
                    open.push(callee);
                    is_open[callee] = true;
                    work.push((callee, self.callees[callee].iter()));
                }
                Some(&callee) if is_open[callee] => low[node] = low[node].min(index[callee]),
                Some(_) => {}
                None => {
                    work.pop();
                    if let Some((caller, _)) = work.last() {
                        low[*caller] = low[*caller].min(low[node]);
                    }
                    if low[node] == index[node] {
                        let at = open.iter().rposition(|f| *f == node).unwrap_or(0);
                        let mut group = open.split_off(at);
                        group.iter().for_each(|f| is_open[*f] = false);
                        group.sort_unstable();
                        components.push(group);
                    }
                }
            }
        }
        components
    }

    /// The costliest chain; every component is one function, callees come first.
    fn deepest(&self, entry: usize, components: &[Vec<usize>]) -> Vec<usize> {
        let mut depth = vec![0_u64; self.callees.len()];
        let mut next = vec![None; self.callees.len()];
        for &node in components.iter().flatten() {
            // The first of equals, so that a report does not depend on chance.
            let worst = self.callees[node].iter().rev().max_by_key(|callee| depth[**callee]);
            next[node] = worst.copied();
            depth[node] = self.cost[node].saturating_add(worst.map_or(0, |callee| depth[*callee]));
        }
        std::iter::successors(Some(entry), |node| next[*node]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(functions: &[(u64, &[usize])]) -> Graph {
        Graph {
            cost: functions.iter().map(|(cost, _)| *cost).collect(),
            callees: functions.iter().map(|(_, to)| to.iter().copied().collect()).collect(),
        }
    }

    #[test]
    fn the_deepest_chain_is_not_the_longest() {
        let graph = graph(&[(8, &[1, 3]), (8, &[2]), (8, &[]), (32, &[4]), (0, &[]), (999, &[0])]);
        let below = graph.below(0);
        assert_eq!((below.chain, below.cycles.len()), (vec![0, 3, 4], 0));
        assert_eq!(below.reached, (0..5).collect());
    }

    #[test]
    fn shared_callees_are_counted_once_a_chain() {
        // Twenty layers of two functions, each calling both of the next: 2^20 chains.
        let layers = 20;
        let callees = |i: usize| {
            let next = 2 * (i / 2 + 1);
            if next < 2 * layers { vec![next, next + 1] } else { vec![] }
        };
        let all: Vec<Vec<usize>> = (0..2 * layers).map(callees).collect();
        let cost = |i: usize| 1 + (i as u64 & 1);
        let functions: Vec<_> = all.iter().enumerate().map(|(i, to)| (cost(i), &to[..])).collect();
        let chain = graph(&functions).below(0).chain;
        assert_eq!(chain.len(), layers);
        assert_eq!(chain.iter().map(|f| cost(*f)).sum::<u64>(), 1 + 2 * (layers as u64 - 1));
    }

    #[test]
    fn recursion_is_found_where_it_can_be_reached() {
        let graph = graph(&[(1, &[1]), (1, &[2]), (1, &[3]), (1, &[1]), (1, &[4]), (1, &[])]);
        let below = graph.below(0);
        assert_eq!((below.cycles, below.chain), (vec![vec![1, 2, 3]], vec![]));
        assert_eq!(graph.below(4).cycles, vec![vec![4]]);
        assert_eq!(graph.below(5), Below { reached: [5].into(), cycles: vec![], chain: vec![5] });
    }
}
