//! Triangles that fold to nothing at a pole.

use std::collections::BTreeMap;

use super::Filler;
use crate::brep::tessellate::outline::Node;
use crate::math::DVec2;

impl Filler<'_> {
    /// Triangles between two lines from one point to the same pole: in space both lines are one,
    /// and what lies between them is folded flat.
    pub(super) fn folded(&self, triangles: &[[u32; 3]]) -> Vec<usize> {
        // places along a pole that a point is joined to: least, most, triangles on the pole itself
        let mut fans: BTreeMap<(u32, usize), [usize; 3]> = BTreeMap::new();
        for t in triangles {
            for k in 0..3 {
                let (x, a, b) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                if self.on_pole.contains_key(&x) {
                    continue;
                }
                let ends = [self.on_pole.get(&a), self.on_pole.get(&b)];
                for &&(row, place) in ends.iter().flatten() {
                    let fan = fans.entry((x, row)).or_insert([place, place, 0]);
                    fan[0] = fan[0].min(place);
                    fan[1] = fan[1].max(place);
                }
                if let [Some((row, _)), Some((other, _))] = ends
                    && row == other
                    && let Some(fan) = fans.get_mut(&(x, *row))
                {
                    fan[2] += 1;
                }
            }
        }
        let mut folded = Vec::new();
        let place = |l: u32| self.warp.warp(self.uv[l as usize]);
        for ((x, row), [least, most, flat]) in fans {
            if flat >= most - least {
                continue;
            }
            let corners = [x, self.poles[row][least], self.poles[row][most]].map(place);
            let side = |a: DVec2, b: DVec2, p: DVec2| (b - a).perp_dot(p - a);
            let turn = side(corners[0], corners[1], corners[2]).signum();
            let within: Vec<usize> = (0..triangles.len())
                .filter(|&i| {
                    let c = triangles[i].map(place).iter().sum::<DVec2>() / 3.0;
                    (0..3).all(|k| turn * side(corners[k], corners[(k + 1) % 3], c) > 0.0)
                })
                .collect();
            // a hole of the face in there would be lost: then the fold stays
            let inner = within
                .iter()
                .flat_map(|&i| triangles[i])
                .filter(|&l| l != x && !self.on_pole.contains_key(&l))
                .all(|l| matches!(self.nodes[l as usize], Node::Own(_)));
            if inner {
                folded.extend(within);
            }
        }
        folded.sort_unstable();
        folded.dedup();
        folded
    }
}
