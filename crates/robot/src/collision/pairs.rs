//! Which bodies are looked at against which: neighbours always touch.

use std::f64::consts::TAU;

use super::bodies::{Body, bars, forearm};
use crate::cell::{Arrangement, Cell, Shapes, Values};

/// Links of an arm.
const LINKS: usize = 6;

/// Places of each joint between two bodies at which they are held against each other, to learn whether they are neighbours.
const TURNS: u32 = 24;

/// What comes no nearer than it goes away, mm, keeps its distance: rounding, and places between those of the joints.
const SAME: f64 = 0.5;

/// Pairs of bodies that may come near each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pairs {
    arrangement: Arrangement,
    /// Whether nozzle and torch are looked at against each link.
    torch: [[bool; LINKS]; 2],
    /// The link that ends at the wrist.
    forearm: u8,
}

impl Pairs {
    /// Of a cell's bodies. A torch at the flange is a neighbour of the links at the wrist that it touches, or whose distance it keeps, however the
    /// joints between stand; one that stands by itself is no link's neighbour.
    pub fn new(cell: &Cell, shapes: &Shapes) -> Self {
        let forearm = forearm(cell, shapes);
        let torch = [Body::Nozzle, Body::Torch].map(|body| {
            std::array::from_fn(|i| match (cell.arrangement, i + 1) {
                (Arrangement::PartOnRobot, _) | (_, ..=3) => true,
                (_, LINKS) => false,
                (_, link) => !are_neighbours(cell, shapes, body, link),
            })
        });
        Pairs {
            arrangement: cell.arrangement,
            torch,
            forearm,
        }
    }

    /// Whether two bodies may come near each other.
    pub(super) fn may_touch(&self, a: Body, b: Body) -> bool {
        let (a, b) = (a.min(b), a.max(b));
        let on_robot = self.arrangement == Arrangement::TorchOnRobot;
        match (a, b) {
            (Body::Nozzle, Body::Link(n)) => self.with(0, n),
            (Body::Torch, Body::Link(n)) => self.with(1, n),
            // the base stands beside table and part
            (Body::Link(0), Body::Link(b)) => b >= 4,
            (Body::Link(a), Body::Link(b)) => {
                a <= 2 && b >= 5 || a == 1 && b == self.forearm && b > 3
            }
            (Body::Link(0), Body::Metal | Body::Table) => false,
            // what the flange holds is the wrist's neighbour
            (Body::Link(n), Body::Metal) => on_robot || n <= self.forearm,
            (Body::Nozzle | Body::Torch, Body::Metal) => true,
            // the arm stands beside its table by its first links
            (Body::Link(n), Body::Table) => n >= 3 && on_robot,
            (_, Body::Table) => on_robot,
            _ => false,
        }
    }

    fn with(&self, torch: usize, link: u8) -> bool {
        if link == 0 {
            return self.arrangement == Arrangement::TorchOnRobot;
        }
        let link = usize::from(link).checked_sub(1);
        link.and_then(|n| self.torch[torch].get(n).copied())
            .unwrap_or(false)
    }
}

/// Whether what the flange holds touches a link, or keeps its distance, however the joints between them stand: no motion brings them together.
fn are_neighbours(cell: &Cell, shapes: &Shapes, body: Body, link: usize) -> bool {
    let joints = cell.arm.chain.joints.get(link..).unwrap_or_default();
    let count = TURNS.pow(joints.len() as u32);
    let apart = |mut n: u32| {
        let mut values = Values::default();
        for (angle, joint) in values.arm[link..].iter_mut().zip(joints) {
            let room = (joint.limits.high - joint.limits.low).min(TAU);
            *angle = joint.limits.low + room * f64::from(n % TURNS) / f64::from(TURNS - 1);
            n /= TURNS;
        }
        let all = bars(cell, shapes, &values);
        let of = |body: Body| all.iter().filter(move |c| c.body == body);
        let other = Body::Link(link as u8);
        let each = of(body)
            .flat_map(|a| of(other).map(move |b| a.in_base.apart(&b.in_base, f64::INFINITY)));
        each.fold(f64::INFINITY, f64::min)
    };
    let [least, most] = (0..count)
        .map(apart)
        .fold([f64::INFINITY, 0.0], |[l, m], d| [l.min(d), d.max(m)]);
    most <= 0.0 || most - least <= SAME
}
