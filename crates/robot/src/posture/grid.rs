//! The values of track and positioner that are tried where a way is chosen wide: steps from where they rest, and where the positioner lays
//! the torch level.

use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

use super::chain::{Chain, Leg};
use super::level::{Level, Stand};
use super::task::Task;
use crate::cell::{Cell, External};

/// Steps of track (mm) and positioner (rad).
pub(super) const STEPS: [f64; 3] = [250.0, TAU / 18.0, TAU / 12.0];
/// Between key places so far apart the axes may go two steps, mm.
pub(super) const LONG: f64 = 80.0;
/// From one place that lies level to the next each axis of a positioner may turn so far while the arc burns, rad.
const WITH_ARC: f64 = 0.28 * TAU;
/// And so far from one to the next in a travel: ways on which they turn more broke when they were followed.
const IN_TRAVEL: f64 = 0.45 * TAU;

/// Where track and positioner stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Cube {
    /// So many steps from where they rest.
    Steps([i16; 3]),
    /// So many steps of the track, and the positioner lies level in one of two ways, its axes so many turns from there; a second axis that
    /// may stand anywhere so many steps from rest.
    Level(u8, [i16; 3]),
}

/// A key place, for the axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Site {
    /// How the positioner lies level.
    stands: [Option<Stand>; 2],
    /// Length since the key place before, mm.
    pub(super) gone: f64,
    /// Whether the arc burns on the way here.
    pub(super) burns: bool,
}

/// The values that are tried.
pub(super) struct Grid {
    pub(super) rest: External,
    /// Between which values each axis is led; nothing for those that the cell lacks.
    rooms: [Option<[f64; 2]>; 3],
    level: Option<Level>,
}

impl Grid {
    pub(super) fn of(task: &Task<'_>) -> Self {
        let cell: &Cell = task.cell;
        let External(mut rest) = task.values.external();
        let rooms = std::array::from_fn(|i| cell.external_room(i));
        for (value, room) in rest.iter_mut().zip(rooms) {
            // an axis may rest at its very end, where no way shall be
            if let Some([low, high]) = room {
                *value = value.clamp(low, high);
            }
        }
        let rest = External(rest);
        Grid {
            rest,
            rooms,
            level: Level::of(task, rest),
        }
    }

    /// A place on the way, at the second of two lengths.
    pub(super) fn site(&self, chain: &Chain, [from, to]: [f64; 2]) -> Site {
        let between = |leg: &&Leg| leg.begin < to && leg.begin + leg.length > from;
        Site {
            stands: self
                .level
                .as_ref()
                .map_or([None; 2], |l| l.at(chain.at(to).0)),
            gone: to - from,
            burns: chain.legs.iter().filter(between).any(|l| l.time.is_some()),
        }
    }

    /// How far the axes turn from one level place to the next, rad; nothing where one of them has none.
    pub(super) fn turning(from: &Site, to: &Site) -> f64 {
        let of = |a: Option<Stand>, b: Option<Stand>| {
            let (a, b) = (a?, b?);
            let wrapped = |d: f64| (d - TAU * (d / TAU).round()).abs();
            let second = a.second.zip(b.second).map_or(0.0, |(a, b)| wrapped(b - a));
            Some(wrapped(b.first - a.first).max(second))
        };
        let both = [0, 1].map(|i| of(from.stands[i], to.stands[i]).unwrap_or(0.0));
        both[0].max(both[1])
    }

    pub(super) fn value(&self, site: &Site, cube: Cube) -> External {
        let stepped = |steps: [i16; 3]| -> [f64; 3] {
            std::array::from_fn(|i| self.rest.0[i] + STEPS[i] * f64::from(steps[i]))
        };
        match cube {
            Cube::Steps(steps) => External(stepped(steps)),
            Cube::Level(way, steps) => {
                let [track, _, last] = stepped(steps);
                let turned = |from: f64, i: usize| from + TAU * f64::from(steps[i]);
                match site.stands[usize::from(way)] {
                    Some(stand) => External([
                        track,
                        turned(stand.first, 1),
                        stand.second.map_or(last, |second| turned(second, 2)),
                    ]),
                    None => self.rest,
                }
            }
        }
    }

    /// Where a run may begin: within half a turn of rest, lying level within a whole one.
    pub(super) fn all(&self, site: &Site) -> Vec<Cube> {
        let mut all = Vec::new();
        self.steps_near(self.rest, [f64::INFINITY, PI, PI], &mut all);
        self.level_near(site, self.rest, [f64::INFINITY, PI, TAU], &mut all);
        all
    }

    /// Where the way leads on from `from`.
    pub(super) fn beside(&self, site: &Site, from: (Cube, External)) -> Vec<Cube> {
        let mut beside = Vec::new();
        self.steps_near(from.1, Self::reach(site, false), &mut beside);
        let level = matches!(from.0, Cube::Level(..));
        self.level_near(site, from.1, Self::reach(site, level), &mut beside);
        beside
    }

    /// Whether the way leads from one place of the axes to another.
    pub(super) fn leads(site: &Site, from: (Cube, External), to: (Cube, External)) -> bool {
        let level = matches!((from.0, to.0), (Cube::Level(..), Cube::Level(..)));
        let reach = Self::reach(site, level);
        (0..3).all(|i| (to.1.0[i] - from.1.0[i]).abs() <= reach[i] + 1e-9)
    }

    /// How far the axes may go on the way to a place: a step or none; more where the way is long, and from level to level.
    fn reach(site: &Site, level: bool) -> [f64; 3] {
        let turned = if site.gone < LONG { 1.0 } else { 2.0 };
        let track = (1.0 + (site.gone / STEPS[0]).floor()) * STEPS[0];
        let [_, first, second] = STEPS.map(|s| turned * s);
        match (level, site.burns) {
            (false, _) => [track, first, second],
            (true, true) => [track, WITH_ARC, WITH_ARC],
            (true, false) => [track, IN_TRAVEL, IN_TRAVEL],
        }
    }

    /// The numbers of steps of an axis, counted from a value, that lie near another and within its limits.
    fn within(
        &self,
        axis: usize,
        (zero, step): (f64, f64),
        near: f64,
        reach: f64,
    ) -> RangeInclusive<i16> {
        let Some([low, high]) = self.rooms[axis] else {
            return 0..=0;
        };
        let [low, high] = [low.max(near - reach), high.min(near + reach)];
        // what is far beyond is come to by stepping on, not by beginning there
        let number = |value: f64| value.clamp(-1000.0, 1000.0) as i16;
        number(((low - zero) / step - 1e-9).ceil())..=number(((high - zero) / step + 1e-9).floor())
    }

    fn steps_near(&self, External(near): External, reach: [f64; 3], found: &mut Vec<Cube>) {
        let range = |i: usize| self.within(i, (self.rest.0[i], STEPS[i]), near[i], reach[i]);
        for a in range(0) {
            for b in range(1) {
                found.extend(range(2).map(|c| Cube::Steps([a, b, c])));
            }
        }
    }

    fn level_near(
        &self,
        site: &Site,
        External(near): External,
        reach: [f64; 3],
        found: &mut Vec<Cube>,
    ) {
        for (way, stand) in site.stands.iter().enumerate() {
            let Some(stand) = stand else { continue };
            let range = |i: usize, counted: (f64, f64)| self.within(i, counted, near[i], reach[i]);
            let second = match stand.second {
                Some(second) => (second, TAU),
                None => (self.rest.0[2], STEPS[2]),
            };
            for a in range(0, (self.rest.0[0], STEPS[0])) {
                for b in range(1, (stand.first, TAU)) {
                    let way = way as u8;
                    found.extend(range(2, second).map(|c| Cube::Level(way, [a, b, c])));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use meltpath_data::{find, robots};
    use meltpath_geometry::Pose;
    use meltpath_geometry::math::DVec3;

    use super::super::choice::{Carried, lean};
    use super::super::task::{Axes, Rotation};
    use super::*;
    use crate::cell;

    fn cell(axes: &str) -> Cell {
        let text = find(robots::ALL, "abb-irb2600-12-185").unwrap().text;
        let (arm, _) = text.split_once("\n[table]").unwrap();
        let head = "[positioner]\nsource = \"test\"";
        cell::read(&format!("{arm}\n{head}\n{axes}")).unwrap()
    }

    fn task<'a>(
        cell: &'a Cell,
        configurations: &'a BTreeMap<Option<u32>, cell::Stance>,
    ) -> Task<'a> {
        Task {
            cell,
            values: cell.at_rest(),
            axes: Axes::Free,
            start: Pose::IDENTITY,
            commands: &[],
            rotation: Rotation::Free,
            configurations,
        }
    }

    /// Verdicts ask for room at every limit: no axis is led along its very end because it rests there.
    #[test]
    fn axes_that_rest_at_their_end_are_led_off_it() {
        let cell = cell(
            "axes = [{ position = [\"1200 mm\", \"0 mm\", \"700 mm\"], axis = [1, 0, 0] }]\nlow = [\"0 deg\"]\nhigh = [\"90 deg\"]\n",
        );
        assert_eq!(cell.at_rest().external().0[1], 0.0);
        let configurations = BTreeMap::new();
        let task = task(&cell, &configurations);
        let grid = Grid::of(&task);
        let tip = Pose::of_tool(DVec3::ZERO, DVec3::new(0.0, 0.5, 1.0).normalize(), 0.0);
        let site = Site {
            stands: grid.level.as_ref().unwrap().at(tip),
            gone: 0.0,
            burns: true,
        };
        let all = grid.all(&site);
        assert!(all.len() > 3);
        for cube in all {
            let value = grid.value(&site, cube).0[1];
            assert!((2_f64.to_radians()..=88_f64.to_radians()).contains(&value));
        }
    }

    /// Whatever direction a place has, both ways that are told to lay it level do, whichever way the axes lie; one axis leaves of the lean
    /// what no angle of it takes away.
    #[test]
    fn level_places_lie_level() {
        let place = "position = [\"1200 mm\", \"0 mm\", \"700 mm\"]";
        for second in ["[0, 0, 1]", "[0, 0.6, 0.8]"] {
            let cell = cell(&format!(
                "axes = [{{ {place}, axis = [0, 1, 0] }}, {{ {place}, axis = {second} }}]\nlow = [\"-180 deg\", \"-360 deg\"]\nhigh = [\"180 deg\", \"360 deg\"]\n"
            ));
            let configurations = BTreeMap::new();
            let task = task(&cell, &configurations);
            let grid = Grid::of(&task);
            let mut solved = 0;
            for i in 0..12 {
                let (s, c) = (0.5 * f64::from(i) + 0.1).sin_cos();
                let out = DVec3::new(0.5 * c, 0.5 * s, 1.0).normalize();
                let tip = Pose::of_tool(DVec3::ZERO, out, 0.3);
                let stands = grid.level.as_ref().unwrap().at(tip);
                // axes that are not square to one another do not reach all directions
                if stands == [None; 2] {
                    assert_eq!(second, "[0, 0.6, 0.8]");
                    continue;
                }
                solved += 1;
                assert_eq!(stands.iter().flatten().count(), 2);
                let site = Site {
                    stands,
                    gone: 10.0,
                    burns: true,
                };
                let mut found = Vec::new();
                grid.level_near(&site, grid.rest, [f64::INFINITY, PI, TAU], &mut found);
                assert!(found.len() >= 2);
                for cube in found {
                    let carried = Carried::at(&task, grid.value(&site, cube));
                    assert!(lean(&task, &carried, tip) < 1e-6);
                }
            }
            assert!(solved > 2, "{second}: {solved}");
        }
        let cell = cell(&format!(
            "axes = [{{ {place}, axis = [1, 0, 0] }}]\nlow = [\"-90 deg\"]\nhigh = [\"90 deg\"]\n"
        ));
        let configurations = BTreeMap::new();
        let task = task(&cell, &configurations);
        let grid = Grid::of(&task);
        let tip = Pose::of_tool(DVec3::ZERO, DVec3::new(0.3, 0.5, 1.0).normalize(), 0.0);
        let leans = |angle: f64| lean(&task, &Carried::at(&task, External([0.0, angle, 0.0])), tip);
        let [Some(stand), None] = grid.level.as_ref().unwrap().at(tip) else {
            panic!("one way to stand");
        };
        let least = (-900..900)
            .map(|a| leans(f64::from(a) * 1e-3))
            .fold(f64::INFINITY, f64::min);
        assert!(leans(stand.first) <= least && leans(stand.first) > least - 1e-3);
    }
}
