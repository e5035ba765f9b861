//! How near the wire's tip passes over metal and plate while nothing is fed.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::HeightMap;

use super::record::{Moment, TubeDistance};

/// The nearest pass of each travel over metal and plate. Where a bead ends and the next begins the tip comes down to the metal: a bead's width around both
/// is left out.
#[derive(Debug, Default)]
pub(super) struct Passing {
    /// Where the bead before ended.
    from: Option<DVec2>,
    /// Where it passed over them since.
    since: Vec<TubeDistance>,
    /// The nearest pass of each travel before.
    least: Vec<TubeDistance>,
}

impl Passing {
    /// The tip stands somewhere without wire.
    pub(super) fn pass(&mut self, map: &HeightMap, width: f64, at: Moment) {
        let plan = at.tool.truncate();
        let from = *self.from.get_or_insert(plan);
        let height = map.height(plan);
        if map.cell_at(plan).is_some() && from.distance(plan) > width {
            self.since.push(TubeDistance {
                distance: at.tool.z - height,
                tool: at.tool,
                time: at.time,
                command: at.command,
            });
        }
    }

    /// A bead begins there, or nothing comes any more.
    pub(super) fn arrive(&mut self, at: Option<DVec2>, width: f64) {
        self.from = None;
        let aside = |p: &TubeDistance| at.is_none_or(|at| at.distance(p.tool.truncate()) > width);
        let since = self.since.drain(..).filter(aside);
        let least = since.min_by(|a, b| a.distance.total_cmp(&b.distance));
        self.least.extend(least);
    }

    /// The nearest pass of each travel.
    pub(super) fn least(self) -> Vec<TubeDistance> {
        self.least
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec3;

    use super::*;

    #[test]
    fn a_travel_is_judged_between_the_ends_of_beads() {
        let mut map = HeightMap::new(DVec2::ZERO, DVec2::new(100.0, 4.0), 1.0, 0.0).unwrap();
        map.z.fill(3.0);
        let mut passing = Passing::default();
        // down at both ends, 2 mm over the metal between, but for a place where it dips into it
        for x in 0..=100 {
            let z = match x {
                0..=5 | 95..=100 => 3.0,
                50 => 2.5,
                _ => 5.0,
            };
            let at = Moment {
                tool: DVec3::new(f64::from(x), 2.0, z),
                time: f64::from(x),
                command: 7,
            };
            passing.pass(&map, 6.0, at);
        }
        passing.arrive(Some(DVec2::new(100.0, 2.0)), 6.0);
        let least = passing.least();
        assert_eq!(least.len(), 1);
        assert_eq!((least[0].distance, least[0].tool.x), (-0.5, 50.0));
    }
}
