//! Where the beads of a map lie, and what its file says of where it holds: rows outside that are mistakes, a range far beyond the rows is
//! extrapolation.

use std::fmt;

use meltpath_base::settings::Problem;

use super::file::MapFile;
use super::import::MeasuredBead;

/// A written range may go beyond the rows by so much, as a factor: a tenth. Ours: laws through beads err no more there than between them.
const BEYOND: f64 = 1.1;
/// Rows may lie outside the written range by what rounding makes of other units.
const ROUNDING: f64 = 1.005;
/// m/min in one mm/s.
const PER_MM_S: f64 = 0.06;

/// The settings of a map's beads, m/min.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Least and greatest wire feed.
    pub wire_feed: (f64, f64),
    /// Least and greatest travel speed.
    pub travel_speed: (f64, f64),
    /// Least and greatest wire feed over travel speed.
    pub ratio: (f64, f64),
}

fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, 0.0), |(low, high), v| {
        (v.min(low), v.max(high))
    })
}

fn within(x: f64, (low, high): (f64, f64), share: f64) -> bool {
    x >= low / share && x <= high * share
}

impl Region {
    /// That of measured beads; nothing where there are none.
    pub(super) fn of(beads: &[MeasuredBead]) -> Option<Region> {
        (!beads.is_empty()).then(|| Region {
            wire_feed: ends(beads.iter().map(|b| b.wire_feed)),
            travel_speed: ends(beads.iter().map(|b| b.travel_speed)),
            ratio: ends(beads.iter().map(|b| b.wire_feed / b.travel_speed)),
        })
    }

    /// Whether settings, m/min, lie where beads were measured, or a little beyond.
    pub fn contains(&self, vf: f64, vr: f64) -> bool {
        within(vf, self.wire_feed, BEYOND)
            && within(vr, self.travel_speed, BEYOND)
            && within(vf / vr, self.ratio, BEYOND)
    }

    /// Whether written ranges of wire feed and travel speed, m/min, go beyond the beads by more than a little.
    pub(super) fn is_exceeded(&self, [wire_feed, travel_speed]: [(f64, f64); 2]) -> bool {
        let beyond = |written: (f64, f64), rows: (f64, f64)| {
            !(within(written.0, rows, BEYOND) && within(written.1, rows, BEYOND))
        };
        beyond(wire_feed, self.wire_feed) || beyond(travel_speed, self.travel_speed)
    }
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.2} to {:.2} m/min wire feed, {:.2} to {:.2} m/min travel, {:.1} to {:.1} of one over the other",
            self.wire_feed.0,
            self.wire_feed.1,
            self.travel_speed.0,
            self.travel_speed.1,
            self.ratio.0,
            self.ratio.1
        )
    }
}

/// A speed of a file's rows: the row, from 1, which speed, and m/min.
type Told = (usize, &'static str, f64);

/// The first speed outside the range that is written for it, and how many rows have one.
fn outside(map: &MapFile, speeds: impl Iterator<Item = Told>) -> Option<(Told, usize)> {
    let range = |which: &str| {
        let written = match which {
            "wire feed" => &map.validity.wire_feed,
            _ => &map.validity.travel_speed,
        };
        (written[0].0 * PER_MM_S, written[1].0 * PER_MM_S)
    };
    let all: Vec<Told> = speeds
        .filter(|(_, which, value)| !within(*value, range(which), ROUNDING))
        .collect();
    let mut rows: Vec<usize> = all.iter().map(|(row, ..)| *row).collect();
    rows.dedup();
    all.first().map(|first| (*first, rows.len()))
}

/// Rows that lie outside what the same file says of where it holds: one of the two is wrong, most often the unit.
pub(super) fn rows_outside(map: &MapFile) -> Vec<Problem> {
    let problem = |((row, which, value), rows): (Told, usize), at: &dyn Fn(String) -> Problem| {
        let written = match which {
            "wire feed" => &map.validity.wire_feed,
            _ => &map.validity.travel_speed,
        };
        let (low, high) = (written[0].0 * PER_MM_S, written[1].0 * PER_MM_S);
        let others = match rows {
            1 => String::new(),
            n => format!(" ({n} rows lie outside)"),
        };
        let by_unit = value * PER_MM_S;
        let help = if within(by_unit, (low, high), ROUNDING) {
            format!("rows are in m/min: {value} mm/s are {by_unit:.3} m/min")
        } else {
            "mend the row; or write in [validity] what was measured".to_owned()
        };
        at(format!(
            "row {row}: {which} {value} m/min is outside the range that [validity] writes, {low:.3} to {high:.3} m/min{others}"
        ))
        .help(help)
    };
    let mut problems = Vec::new();
    if let Some(beads) = &*map.beads {
        let rows = (1..).zip(beads.rows.iter());
        let speeds = rows.flat_map(|(n, r)| [(n, "wire feed", r[0]), (n, "travel speed", r[1])]);
        let found = outside(map, speeds);
        problems.extend(found.map(|found| problem(found, &|told| beads.rows.problem(told))));
    }
    if let Some(walls) = &*map.walls {
        let speeds = (1..)
            .zip(walls.rows.iter())
            .map(|(n, r)| (n, "wire feed", r[0]));
        let found = outside(map, speeds.filter(|(.., feed)| *feed > 0.0));
        problems.extend(found.map(|found| problem(found, &|told| walls.rows.problem(told))));
    }
    if let Some(grid) = &*map.grid {
        let feeds = (1..).zip(grid.wire_feed.iter());
        let found = outside(map, feeds.map(|(n, v)| (n, "wire feed", *v)));
        problems.extend(found.map(|found| problem(found, &|told| grid.wire_feed.problem(told))));
        let travels = (1..).zip(grid.travel_speed.iter());
        let found = outside(map, travels.map(|(n, v)| (n, "travel speed", *v)));
        problems.extend(found.map(|found| problem(found, &|told| grid.travel_speed.problem(told))));
    }
    problems
}
