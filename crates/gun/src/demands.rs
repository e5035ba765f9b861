//! What a path asks of a gun that it cannot do, with the first place of each; and what nobody knows of it though the path needs it.

use std::fmt;

use meltpath_geometry::math::DVec2;
use meltpath_toolpath::MotionBlock;

use crate::machine::{Between, Change, Machine, Points};
use crate::stretch::{Stretch, stretches};

/// Relative difference from which two powers or speeds are two.
const DIFFERENT: f64 = 2e-3;
/// Cosine of the angle up to which two lines are one: a degree.
const STRAIGHT: f64 = 0.999_85;

/// What a gun may be asked for in vain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// Less power than it has at least.
    LeastPower,
    /// More power than it has.
    GreatestPower,
    /// Another current where it cannot change.
    Current,
    /// Another speed where it cannot change.
    Speed,
    /// A beam faster than any of it.
    GreatestSpeed,
    /// Rest on a point.
    Rest,
    /// Rest for a shorter time than it can.
    LeastDwell,
}

impl What {
    /// What is asked for.
    pub fn words(self) -> &'static str {
        match self {
            What::LeastPower => "less power than the gun's least",
            What::GreatestPower => "more power than the gun's greatest",
            What::Current => "another current where the gun cannot change it",
            What::Speed => "another speed where the gun cannot change it",
            What::GreatestSpeed => "a beam faster than the gun's greatest speed",
            What::Rest => "rest on a point, of which the gun knows none",
            What::LeastDwell => "a shorter rest than the gun's least",
        }
    }

    /// What to do.
    pub fn remedy(self) -> &'static str {
        match self {
            What::LeastPower | What::GreatestPower => "a power within the gun's range",
            What::Current => {
                "one current where the gun can have only one, or a gun that changes it"
            }
            What::Speed => "one speed where the gun can have only one, or a gun that changes it",
            What::GreatestSpeed => "slower lines or jumps",
            What::Rest => "lines in place of points",
            What::LeastDwell => "longer rests, with less power",
        }
    }
}

/// Something that a path asks for in vain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// What.
    pub what: What,
    /// At how many places.
    pub places: usize,
    /// When first, s.
    pub time: f64,
    /// Where first, mm.
    pub at: [f64; 2],
    /// What is asked there, and what the gun can or has before: W, mm/s or s.
    pub values: [f64; 2],
}

impl fmt::Display for Demand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [asked, can] = self.values;
        let [x, y] = self.at;
        let values = match self.what {
            What::LeastPower | What::GreatestPower => format!("{asked:.0} W for {can:.0} W"),
            What::Current => format!("{asked:.0} W after {can:.0} W"),
            What::GreatestSpeed => format!("{asked:.0} mm/s for {can:.0} mm/s"),
            What::Speed => format!("{asked:.0} mm/s after {can:.0} mm/s"),
            What::Rest => format!("{:.0} µs", 1e6 * asked),
            What::LeastDwell => format!("{:.1} µs for {:.1} µs", 1e6 * asked, 1e6 * can),
        };
        write!(
            f,
            "{}, at {} place{}, first {values} at x {x:.2}, y {y:.2} mm after {:.6} s",
            self.what.words(),
            self.places,
            if self.places == 1 { "" } else { "s" },
            self.time
        )
    }
}

/// What a path asks of a gun.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Demands {
    /// In vain.
    pub vain: Vec<Demand>,
    /// Figures of the gun's file that nobody knows though the path leans on them.
    pub unknown: Vec<&'static str>,
}

impl Demands {
    fn vain(&mut self, what: What, stretch: &Stretch, values: [f64; 2]) {
        match self.vain.iter_mut().find(|d| d.what == what) {
            Some(demand) => demand.places += 1,
            None => self.vain.push(Demand {
                what,
                places: 1,
                time: stretch.time,
                at: stretch.from.to_array(),
                values,
            }),
        }
    }

    fn unknown(&mut self, what: &'static str) {
        if !self.unknown.contains(&what) {
            self.unknown.push(what);
        }
    }
}

/// What lies between two lit stretches.
fn place(before: &Stretch, dark: bool, next: &Stretch) -> Change {
    let way = |s: &Stretch| s.to - s.from;
    // a point is no line
    let bend = |a: DVec2, b: DVec2| {
        let lengths = a.length() * b.length();
        lengths == 0.0 || a.dot(b) < STRAIGHT * lengths
    };
    if dark {
        Change::BetweenPasses
    } else if bend(way(before), way(next)) {
        Change::BetweenLines
    } else {
        Change::Anywhere
    }
}

fn differ(a: f64, b: f64) -> bool {
    (a - b).abs() > DIFFERENT * a.max(b)
}

/// What `motion` asks of `machine` in vain, or of what nobody knows.
pub fn demands(motion: &MotionBlock, machine: &Machine) -> Demands {
    let mut found = Demands::default();
    let (mut before, mut line): (Option<Stretch>, Option<Stretch>) = (None, None);
    let mut dark = true;
    for stretch in stretches(motion) {
        let way = stretch.from.distance(stretch.to);
        if !stretch.is_lit() {
            if way > 0.0 || stretch.takes > 0.0 {
                dark = true;
            }
            jump(&mut found, machine, &stretch, way);
            continue;
        }
        powers(&mut found, machine, &stretch);
        if dark && machine.between.is_none() && before.is_some() {
            found.unknown("what the beam does between stretches (current.between)");
        }
        if let Some(before) = &before {
            currents(&mut found, machine, before, dark, &stretch);
        }
        if way > 0.0 {
            fastest(&mut found, machine, &stretch, way);
            if let Some(line) = &line {
                speeds(&mut found, machine, line, dark, &stretch);
            }
            if machine.lag.is_none() {
                found.unknown("how far the beam is behind (deflection.lag)");
            }
            line = Some(stretch);
        } else {
            rests(&mut found, machine, &stretch);
        }
        before = Some(stretch);
        dark = false;
    }
    found
}

/// A stretch with the beam off.
fn jump(found: &mut Demands, machine: &Machine, stretch: &Stretch, way: f64) {
    if way == 0.0 {
        return;
    }
    if stretch.takes == 0.0 {
        if machine.jump.is_none() {
            found.unknown("how long a jump takes (deflection.jump)");
        }
    } else {
        fastest(found, machine, stretch, way);
    }
}

fn fastest(found: &mut Demands, machine: &Machine, stretch: &Stretch, way: f64) {
    let speed = way / stretch.takes;
    if let Some(greatest) = machine.greatest_speed.filter(|v| speed > *v * (1.0 + 1e-9)) {
        found.vain(What::GreatestSpeed, stretch, [speed, greatest]);
    }
}

fn powers(found: &mut Demands, machine: &Machine, stretch: &Stretch) {
    let power = stretch.power;
    match machine.least_power {
        Some(least) if power < least * (1.0 - 1e-9) => {
            found.vain(What::LeastPower, stretch, [power, least]);
        }
        Some(_) => {}
        None => found.unknown("the least power (least_power)"),
    }
    match machine.greatest_power {
        Some(greatest) if power > greatest * (1.0 + 1e-9) => {
            found.vain(What::GreatestPower, stretch, [power, greatest]);
        }
        Some(_) => {}
        None => found.unknown("the greatest power (greatest_power)"),
    }
}

fn currents(
    found: &mut Demands,
    machine: &Machine,
    before: &Stretch,
    dark: bool,
    stretch: &Stretch,
) {
    let changes = differ(before.power, stretch.power);
    let ramps = dark && machine.between == Some(Between::Ramped);
    if (changes || ramps) && !machine.knows_current() {
        found.unknown("how fast the current follows (current.slew, current.bandwidth)");
    }
    if !changes {
        return;
    }
    let place = place(before, dark, stretch);
    match machine.current {
        Some(can) if can.allows(place) => {}
        Some(_) => found.vain(What::Current, stretch, [stretch.power, before.power]),
        None if place == Change::BetweenPasses => {}
        None => found.unknown("where the current can change (current.change)"),
    }
}

fn speeds(found: &mut Demands, machine: &Machine, line: &Stretch, dark: bool, stretch: &Stretch) {
    let speed = |s: &Stretch| s.from.distance(s.to) / s.takes;
    let [before, now] = [speed(line), speed(stretch)];
    if !differ(before, now) {
        return;
    }
    let place = place(line, dark, stretch);
    match machine.speed {
        Some(can) if can.allows(place) => {}
        Some(_) => found.vain(What::Speed, stretch, [now, before]),
        None if place == Change::BetweenPasses => {}
        None => found.unknown("where the speed can change (deflection.speed)"),
    }
}

fn rests(found: &mut Demands, machine: &Machine, stretch: &Stretch) {
    match machine.points {
        Some(Points::Timed) => {}
        Some(Points::No) => found.vain(What::Rest, stretch, [stretch.takes, 0.0]),
        None => found.unknown("whether the gun rests on points (points.rest)"),
    }
    match machine.least_dwell {
        Some(least) if stretch.takes < least * (1.0 - 1e-9) => {
            found.vain(What::LeastDwell, stretch, [stretch.takes, least]);
        }
        Some(_) => {}
        None => found.unknown("the least time on a point (points.least_dwell)"),
    }
}
