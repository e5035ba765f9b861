//! Metal laid from any side, and what it stands on: rods along beads and closed meshes, in one tree of boxes that knows since when each is there.

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::math::DVec3;

use super::distance::{Bounds, Segment, between};
use super::form::Form;

/// Things in one leaf.
const LEAF: usize = 4;

/// A line with a radius around it, mm: a piece of a bead, or of what holds the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rod {
    /// Its ends.
    pub ends: [DVec3; 2],
    /// Its radius.
    pub radius: f64,
}

impl Rod {
    /// The distance of a point from it, mm; below zero inside.
    pub fn to_point(&self, p: DVec3) -> f64 {
        let [a, b] = self.ends;
        between(&Segment { a, b }, &Segment { a: p, b: p }) - self.radius
    }
}

/// Something solid, or a piece of its skin.
#[derive(Debug, Clone, Copy)]
enum Shape {
    Rod(Rod),
    Triangle([DVec3; 3]),
}

#[derive(Debug, Clone, Copy)]
struct Item {
    /// There from this time on.
    since: u32,
    shape: Shape,
}

/// A box around items of the order from `first` on, or around the boxes of two nodes.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds,
    /// The earliest of its items.
    since: u32,
    kind: Kind,
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    Leaf {
        first: usize,
        count: usize,
    },
    /// The one of the two that comes next, and the number of the other.
    Fork(usize),
}

/// Solid bodies, each there from a time on.
#[derive(Debug)]
pub struct Solids {
    items: Vec<Item>,
    /// The first is the root.
    nodes: Vec<Node>,
    /// Which side of a mesh is inside, and the box around it.
    bodies: Vec<(Bounds, Distance)>,
}

impl Solids {
    /// Of closed meshes, which are there from the begin, and of rods with the time from which on each is there.
    pub fn new(meshes: &[Mesh], rods: impl IntoIterator<Item = (u32, Rod)>) -> Self {
        let triangles = meshes.iter().flat_map(|mesh| {
            let all = 0..mesh.triangles.len();
            all.map(|t| Item {
                since: 0,
                shape: Shape::Triangle(mesh.corners(t)),
            })
        });
        let rods = rods.into_iter().map(|(since, rod)| Item {
            since,
            shape: Shape::Rod(rod),
        });
        let mut items: Vec<Item> = triangles.chain(rods).collect();
        let mut nodes = Vec::with_capacity(items.len());
        let count = items.len();
        if count > 0 {
            build(&mut items, 0, &mut nodes);
        }
        let body = |mesh: &Mesh| {
            let (low, high) = mesh.bounds()?;
            Some((Bounds { low, high }, Distance::new(mesh)))
        };
        Solids {
            items,
            nodes,
            bodies: meshes.iter().filter_map(body).collect(),
        }
    }

    /// The distance of a body from what is there at a time, mm, where it is less than `most`; else no less than `most`. Zero or less
    /// where it lies in something.
    pub(super) fn distance(&self, form: &Form<'_>, time: u32, most: f64) -> f64 {
        if self.nodes.is_empty() {
            return most;
        }
        let mut least = most;
        let far = |node: usize| form.at_least_to(&self.nodes[node].bounds);
        let mut stack = vec![(far(0), 0)];
        while let Some((box_distance, node)) = stack.pop() {
            let Node { since, kind, .. } = self.nodes[node];
            if box_distance >= least || since > time {
                continue;
            }
            match kind {
                Kind::Fork(other) => {
                    let (a, b) = ((far(node + 1), node + 1), (far(other), other));
                    stack.extend(if a.0 < b.0 { [b, a] } else { [a, b] });
                }
                Kind::Leaf { first, count } => {
                    let there = self.items[first..first + count].iter();
                    let there = there.filter(|i| i.since <= time);
                    least = there.fold(least, |least, i| least.min(i.shape.distance(form, least)));
                }
            }
        }
        // a mesh is hollow: what crosses its skin nowhere lies in it as a whole or not at all
        if least > 0.0 && self.holds(form.point()) {
            return 0.0;
        }
        least
    }

    /// Whether a point lies in a mesh.
    fn holds(&self, p: DVec3) -> bool {
        let here = Segment { a: p, b: p };
        let within = |(bounds, body): &(Bounds, Distance)| {
            bounds.at_least_to(&here) <= 0.0 && body.foot(p).is_some_and(|f| f.distance < 0.0)
        };
        self.bodies.iter().any(within)
    }
}

/// Puts items, which are those from `first` on, in order, and the nodes over them behind those that are there.
fn build(items: &mut [Item], first: usize, nodes: &mut Vec<Node>) {
    let nothing = Bounds {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };
    let bounds = items.iter().fold(nothing, |all, item| {
        let own = item.shape.bounds();
        Bounds {
            low: all.low.min(own.low),
            high: all.high.max(own.high),
        }
    });
    let since = items.iter().map(|i| i.since).min().unwrap_or(u32::MAX);
    let own = nodes.len();
    let count = items.len();
    nodes.push(Node {
        bounds,
        since,
        kind: Kind::Leaf { first, count },
    });
    if count <= LEAF {
        return;
    }
    let size = bounds.high - bounds.low;
    let axis = (0..3)
        .max_by(|a, b| size[*a].total_cmp(&size[*b]))
        .unwrap_or(0);
    let middle = |item: &Item| {
        let of = item.shape.bounds();
        of.low[axis] + of.high[axis]
    };
    let half = count / 2;
    items.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
    let (low, high) = items.split_at_mut(half);
    build(low, first, nodes);
    let other = nodes.len();
    build(high, first + half, nodes);
    nodes[own].kind = Kind::Fork(other);
}

impl Shape {
    fn bounds(&self) -> Bounds {
        match self {
            Shape::Rod(Rod {
                ends: [a, b],
                radius,
            }) => Bounds {
                low: a.min(*b) - DVec3::splat(*radius),
                high: a.max(*b) + DVec3::splat(*radius),
            },
            Shape::Triangle([a, b, c]) => Bounds {
                low: a.min(*b).min(*c),
                high: a.max(*b).max(*c),
            },
        }
    }

    /// The distance of a body, mm, where it is less than `most`; else no less than `most`.
    fn distance(&self, form: &Form<'_>, most: f64) -> f64 {
        match self {
            Shape::Rod(Rod {
                ends: [a, b],
                radius,
            }) => form.to_rod(&Segment { a: *a, b: *b }, *radius, most),
            Shape::Triangle(corners) => form.to_face(corners, most),
        }
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::shapes::cuboid;
    use meltpath_numerics::random::Random;

    use super::super::round::{Ends, Round};
    use super::*;

    fn segment(random: &mut Random) -> Segment {
        let mut point = || DVec3::from_array(std::array::from_fn(|_| random.between(-40.0, 60.0)));
        let (a, b) = (point(), point());
        // long ones and short ones
        Segment {
            a,
            b: a.lerp(b, random.between(0.0, 1.0)),
        }
    }

    fn thin(line: Segment) -> Form<'static> {
        Form::Round(Round {
            line,
            radius: 0.0,
            ends: Ends::Round,
        })
    }

    /// A box has a distance in closed form, inside too; rods that come later are not there before.
    #[test]
    fn a_box_and_rods_are_as_far_as_their_formulas_say() {
        let mut random = Random::new(5);
        let (low, high) = (DVec3::ZERO, DVec3::new(20.0, 10.0, 30.0));
        let rods: Vec<(u32, Rod)> = (0..200)
            .map(|i| {
                let Segment { a, b } = segment(&mut random);
                let ends = [a, a.lerp(b, 0.1)];
                (1 + i % 7, Rod { ends, radius: 1.5 })
            })
            .collect();
        let solids = Solids::new(&[cuboid(low, high)], rods.iter().copied());
        for _ in 0..2000 {
            let segment = segment(&mut random);
            let time = random.between(0.0, 8.0) as u32;
            let there = rods.iter().filter(|(since, _)| *since <= time);
            let to_rod = |rod: &Rod| {
                let [a, b] = rod.ends;
                between(&segment, &Segment { a, b }) - rod.radius
            };
            let wanted = there
                .map(|(_, rod)| to_rod(rod))
                .fold(Bounds { low, high }.to_segment(&segment), f64::min);
            let thin = thin(segment);
            let found = solids.distance(&thin, time, 1e9);
            // where a segment lies in the box, how deep it lies in a rod is not looked for
            let same = (found.max(0.0) - wanted.max(0.0)).abs();
            assert!(same < 1e-5, "{found} for {wanted} at {time}");
            let half = 0.5 * wanted;
            assert!(half <= 0.0 || solids.distance(&thin, time, half) >= half);
        }
    }

    #[test]
    fn nothing_is_as_far_as_is_asked_for() {
        let mut random = Random::new(1);
        let none = Solids::new(&[], []);
        assert_eq!(none.distance(&thin(segment(&mut random)), 9, 7.0), 7.0);
    }
}
