//! The branches of a medial axis that matter: corner branches pruned, the rest as chains between junctions.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::medial::{MedialAxis, Node};

/// A branch of the axis that ends in a corner grows faster than this with the way (the sine of half the corner's
/// angle): corners up to 60° count as narrowing sections, wider ones as corners.
const CORNER_SLOPE: f64 = 0.5;

/// A pruned axis.
pub(crate) struct Skeleton {
    pub(crate) nodes: Vec<Node>,
    /// Live neighbours of each node.
    links: Vec<Vec<u32>>,
}

/// One end of a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// The section ends.
    Dead,
    /// Other chains meet here.
    Junction,
    /// The radius leaves the range asked for upwards: the section widens.
    Wide,
    /// The radius leaves the range downwards: the section tapers off.
    Narrow,
}

/// A stretch of the axis.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    pub(crate) nodes: Vec<Node>,
    pub(crate) ends: [End; 2],
}

impl Chain {
    pub(crate) fn is_closed(&self) -> bool {
        self.nodes.len() > 3
            && self.nodes.first().map(|n| n.position) == self.nodes.last().map(|n| n.position)
    }

    fn reverse(&mut self) {
        self.nodes.reverse();
        self.ends.reverse();
    }
}

/// Which part of the axis is wanted.
struct Range<'a> {
    low: f64,
    high: f64,
    wide: &'a dyn Fn(DVec2) -> bool,
}

impl Skeleton {
    /// The axis without the branches that run into corners.
    pub(crate) fn new(axis: MedialAxis) -> Self {
        let mut links = vec![Vec::new(); axis.nodes.len()];
        for &(a, b) in &axis.edges {
            links[a as usize].push(b);
            links[b as usize].push(a);
        }
        for l in &mut links {
            l.sort_unstable();
            l.dedup();
        }
        let mut skeleton = Skeleton {
            nodes: axis.nodes,
            links,
        };
        while skeleton.prune() {}
        skeleton
    }

    /// Removes the branches that end in corners; whether there were any.
    fn prune(&mut self) -> bool {
        let leaves: Vec<u32> = (0..self.nodes.len() as u32)
            .filter(|&i| self.links[i as usize].len() == 1)
            .collect();
        // judged together before any is cut: the two corners of a wall's end go together
        let mut corners = Vec::new();
        for leaf in leaves {
            let mut branch = vec![leaf];
            let mut length = 0.0;
            loop {
                let at = branch[branch.len() - 1];
                let before = branch.len().checked_sub(2).map(|i| branch[i]);
                if branch.len() > 1 && self.links[at as usize].len() != 2 {
                    break;
                }
                let Some(&next) = self.links[at as usize].iter().find(|&&n| Some(n) != before)
                else {
                    break;
                };
                length += self.distance(at, next);
                branch.push(next);
            }
            let (tip, root) = (branch[0], branch[branch.len() - 1]);
            let growth = self.nodes[root as usize].radius - self.nodes[tip as usize].radius;
            if branch.len() > 1 && growth > CORNER_SLOPE * length {
                corners.push(branch);
            }
        }
        for pair in corners.iter().flat_map(|branch| branch.windows(2)) {
            self.links[pair[0] as usize].retain(|&n| n != pair[1]);
            self.links[pair[1] as usize].retain(|&n| n != pair[0]);
        }
        !corners.is_empty()
    }

    fn distance(&self, a: u32, b: u32) -> f64 {
        self.nodes[a as usize]
            .position
            .distance(self.nodes[b as usize].position)
    }

    /// The largest radius anywhere, and the node that has it.
    pub(crate) fn widest(&self) -> Option<Node> {
        self.nodes
            .iter()
            .copied()
            .max_by(|a, b| a.radius.total_cmp(&b.radius))
    }

    /// Every live edge once: mean radius and length.
    pub(crate) fn edges(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.links.iter().enumerate().flat_map(move |(a, links)| {
            links
                .iter()
                .filter(move |&&b| a < b as usize)
                .map(move |&b| {
                    let radius = 0.5 * (self.nodes[a].radius + self.nodes[b as usize].radius);
                    (radius, self.distance(a as u32, b))
                })
        })
    }

    /// The chains along which the radius lies between `low` and `high`, cut at junctions. Where it is above `high` the
    /// chain goes on if the place is not `wide` in earnest.
    pub(crate) fn chains(&self, low: f64, high: f64, wide: &dyn Fn(DVec2) -> bool) -> Vec<Chain> {
        let range = Range { low, high, wide };
        let mut done = vec![false; self.nodes.len()];
        let mut chains = Vec::new();
        let degree = |i: u32| self.links[i as usize].len();
        for start in 0..self.nodes.len() as u32 {
            if degree(start) == 2 || degree(start) == 0 {
                continue;
            }
            for &first in &self.links[start as usize] {
                let path = self.walk(start, first);
                let last = path[path.len() - 1];
                // each chain from one of its two ends only
                if (last, path[path.len() - 2]) < (start, first) && degree(last) != 2 {
                    continue;
                }
                for &i in &path {
                    done[i as usize] = true;
                }
                let end = |i: u32| {
                    if degree(i) == 1 {
                        End::Dead
                    } else {
                        End::Junction
                    }
                };
                self.clip(&path, [end(start), end(last)], &range, &mut chains);
            }
        }
        // what is left are closed loops
        for start in 0..self.nodes.len() as u32 {
            if done[start as usize] || degree(start) != 2 {
                continue;
            }
            let path = self.walk(start, self.links[start as usize][0]);
            for &i in &path {
                done[i as usize] = true;
            }
            let before = chains.len();
            self.clip(&path, [End::Junction; 2], &range, &mut chains);
            // a loop that is only partly in range: its first and last piece are one
            if let [first, .., last] = &mut chains[before..]
                && first.ends[0] == End::Junction
                && last.ends[1] == End::Junction
            {
                let mut joined = last.clone();
                joined.nodes.extend(first.nodes.iter().skip(1));
                joined.ends[1] = first.ends[1];
                *first = joined;
                chains.pop();
            }
        }
        chains
    }

    /// Nodes from `start` by `first` to the next node that is no mere passage, or round a loop.
    fn walk(&self, start: u32, first: u32) -> Vec<u32> {
        let mut path = vec![start, first];
        while self.links[path[path.len() - 1] as usize].len() == 2 && path[path.len() - 1] != start
        {
            let (before, at) = (path[path.len() - 2], path[path.len() - 1]);
            let links = &self.links[at as usize];
            path.push(if links[0] == before {
                links[1]
            } else {
                links[0]
            });
        }
        path
    }

    /// The stretches of a path with radii in range.
    fn clip(&self, path: &[u32], ends: [End; 2], range: &Range<'_>, out: &mut Vec<Chain>) {
        let node = |i: u32| self.nodes[i as usize];
        let &Range { low, high, wide } = range;
        let inside = |n: Node| n.radius >= low && (n.radius <= high || !wide(n.position));
        let mut current: Option<Chain> = inside(node(path[0])).then(|| Chain {
            nodes: vec![node(path[0])],
            ends: [ends[0], End::Dead],
        });
        for pair in path.windows(2) {
            let (a, b) = (node(pair[0]), node(pair[1]));
            let limit = |r: f64| {
                if r > high {
                    (high, End::Wide)
                } else {
                    (low, End::Narrow)
                }
            };
            let cut = |bound: f64| {
                let t = ((bound - a.radius) / (b.radius - a.radius)).clamp(0.0, 1.0);
                Node {
                    position: a.position.lerp(b.position, t),
                    radius: bound,
                }
            };
            match (current.as_mut(), inside(b)) {
                (Some(chain), true) => chain.nodes.push(b),
                (Some(chain), false) => {
                    let (bound, end) = limit(b.radius);
                    chain.nodes.push(cut(bound));
                    chain.ends[1] = end;
                    out.extend(current.take());
                }
                (None, true) => {
                    let (bound, end) = limit(a.radius);
                    current = Some(Chain {
                        nodes: vec![cut(bound), b],
                        ends: [end, End::Dead],
                    });
                }
                (None, false) => {}
            }
        }
        if let Some(mut chain) = current {
            chain.ends[1] = ends[1];
            out.push(chain);
        }
    }
}

/// Chains joined through junctions where they run on nearly straight: at each junction the straightest pair.
pub(crate) fn joined(mut chains: Vec<Chain>, reach: f64, largest_turn: f64) -> Vec<Chain> {
    loop {
        let mut best: Option<(f64, usize, usize, usize, usize)> = None;
        for i in 0..chains.len() {
            for j in i + 1..chains.len() {
                for (ei, ej) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    if chains[i].ends[ei] != End::Junction || chains[j].ends[ej] != End::Junction {
                        continue;
                    }
                    let ((p, u), (q, v)) = (
                        outward(&chains[i], ei, reach),
                        outward(&chains[j], ej, reach),
                    );
                    if p != q {
                        continue;
                    }
                    let turn = u.angle_to(-v).abs();
                    if turn < largest_turn && best.is_none_or(|b| turn < b.0) {
                        best = Some((turn, i, ei, j, ej));
                    }
                }
            }
        }
        let Some((_, i, ei, j, ej)) = best else {
            return chains;
        };
        let mut second = chains.swap_remove(j);
        let first = &mut chains[i];
        if ei == 0 {
            first.reverse();
        }
        if ej == 1 {
            second.reverse();
        }
        first.nodes.extend(second.nodes.into_iter().skip(1));
        first.ends[1] = second.ends[1];
    }
}

/// The end point of a chain and the unit direction in which it leaves the chain there.
pub(crate) fn outward(chain: &Chain, end: usize, reach: f64) -> (DVec2, DVec2) {
    let nodes: Vec<_> = if end == 0 {
        chain.nodes.iter().collect()
    } else {
        chain.nodes.iter().rev().collect()
    };
    let tip = nodes[0].position;
    let mut away = 0.0;
    let mut from = tip;
    for pair in nodes.windows(2) {
        away += pair[0].position.distance(pair[1].position);
        from = pair[1].position;
        if away >= reach {
            break;
        }
    }
    (tip, (tip - from).normalize_or_zero())
}
