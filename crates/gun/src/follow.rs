//! What a gun makes of the path it is asked for: its deflection lags and settles, its current climbs, its jumps take time.
//!
//! The deflection is a linear system of second order, driven along each axis by where the beam should be; the current goes at most as
//! fast as its slew, and nears its set value exponentially within its bandwidth. Both are solved exactly from step to step: how a line
//! is cut moves nothing. Steps are as short as a straight piece needs to stay within a tolerance of the curve.

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_toolpath::{MotionBlock, Times};

use crate::jumps::ordered;
use crate::machine::{Between, Machine};
use crate::short::{Short, short};
use crate::stretch::{Stretch, stretches};

/// Greatest distance between the curve that is drawn and the straight pieces in its place, mm.
const TOLERANCE: f64 = 1e-3;
/// Share of what is asked that the current may be off, above or below, where a stretch ends.
const REACHED: f64 = 0.05;
/// Lags after which the place of the beam says nothing any more of where it was asked to be.
const MEMORY: f64 = 12.0;

/// What a gun drew of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    /// The beam as it is drawn.
    pub motion: MotionBlock,
    /// Greatest distance of the lit beam from the line it is drawing, with those joined to it that came just before, mm, and where it
    /// is then: lines drawn before a jump are none that it should be on.
    pub beside: (f64, [f64; 2]),
    /// Greatest distance of the lit beam from where it was asked to be at that time, mm.
    pub behind: f64,
    /// Ends and corners of lit lines that the beam does not come to.
    pub short: Short,
    /// Stretches at whose end the current is still far from what is asked, below or above, and where the first of them ends.
    pub unreached: (usize, Option<[f64; 2]>),
    /// Time that jumps take beyond what was asked, s.
    pub waited: f64,
    /// Heat that lines ask for, J.
    pub asked: f64,
    /// Heat that is drawn where the path asks for none: in jumps and pauses.
    pub stray: Misplaced,
    /// Heat that lines get too much or lack while the current is further off than stretches may end.
    pub off: Misplaced,
}

/// Heat of the beam that is not where the path asks for it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Misplaced {
    /// Stretches that have some of it.
    pub stretches: usize,
    /// How much, J.
    pub heat: f64,
    /// How long that takes in all, with more than a twentieth of the line's current, s.
    pub time: f64,
    /// Where the first of them begins, mm.
    pub first: Option<[f64; 2]>,
}

impl Misplaced {
    /// Adds `heat` (J) of `time` s in a stretch that begins at `from`.
    fn add(&mut self, heat: f64, time: f64, from: DVec2, begins: &mut bool) {
        self.stretches += usize::from(std::mem::take(begins));
        self.heat += heat;
        self.time += time;
        self.first.get_or_insert(from.to_array());
    }
}

impl Followed {
    /// Misplaced heat as a share of what all lines ask for.
    pub fn share(&self, of: &Misplaced) -> f64 {
        of.heat / self.asked.max(f64::MIN_POSITIVE)
    }
}

/// What `machine` at `voltage` V makes of a motion. What it does not tell is taken as perfect.
///
/// ```
/// use meltpath_geometry::math::DVec3;
/// use meltpath_gun::follow::follow;
/// use meltpath_toolpath::{MotionBlock, Times};
/// let text = "schema = 1\nname = \"mine\"\nsource = \"its log\"\n[deflection]\nlag = { value = \"20 µs\", source = \"its log\" }";
/// let line = MotionBlock {
///     times: Times::Each(vec![0.0, 0.01]),
///     position: vec![DVec3::ZERO, DVec3::X * 10.0],
///     power: vec![0.0, 300.0],
///     spot: vec![0.4, 0.4],
///     ..MotionBlock::default()
/// };
/// let drawn = follow(&line, &meltpath_gun::machine::parse(text).unwrap(), 60e3);
/// // 1000 mm/s for 20 µs
/// assert!((drawn.behind - 0.02).abs() < 1e-9 && drawn.beside.0 < 1e-9);
/// ```
pub fn follow(motion: &MotionBlock, machine: &Machine, voltage: f64) -> Followed {
    let (asked, waited) = ordered(&stretches(motion), machine.jump);
    let mut pen = Pen::new(motion, machine, &asked, voltage);
    for n in 0..asked.len() {
        pen.draw(&asked, n);
    }
    let drawn = MotionBlock {
        times: Times::Each(pen.times),
        ..pen.motion
    };
    Followed {
        short: short(&asked, &drawn, machine.lag.unwrap_or(0.0)),
        motion: drawn,
        beside: pen.beside,
        behind: pen.behind,
        unreached: pen.unreached,
        waited,
        asked: pen.asked,
        stray: pen.stray,
        off: pen.off,
    }
}

/// The deflection: its natural frequency (rad/s) and damping.
#[derive(Clone, Copy)]
struct Deflection {
    frequency: f64,
    damping: f64,
}

impl Deflection {
    /// Deviation from a straight line and its rate after `time` s.
    fn after(self, [off, rate]: [DVec2; 2], time: f64) -> [DVec2; 2] {
        let (w, a) = (self.frequency, self.frequency * self.damping);
        let (cosine, sine) = if (self.damping - 1.0).abs() < 1e-6 {
            let fade = (-w * time).exp();
            (fade, fade * time)
        } else if self.damping < 1.0 {
            let turn = w * (1.0 - self.damping * self.damping).sqrt();
            let fade = (-a * time).exp();
            (
                fade * (turn * time).cos(),
                fade * (turn * time).sin() / turn,
            )
        } else {
            let part = w * (self.damping * self.damping - 1.0).sqrt();
            let (slow, fast) = ((-(a - part) * time).exp(), (-(a + part) * time).exp());
            (0.5 * (slow + fast), 0.5 * (slow - fast) / part)
        };
        [
            cosine * off + sine * (rate + a * off),
            cosine * rate - sine * (a * rate + w * w * off),
        ]
    }

    /// A step over which a straight piece stays within the tolerance, s: the acceleration never exceeds what the energy of the
    /// deviation allows, and that only falls.
    fn step(self, [off, rate]: [DVec2; 2]) -> f64 {
        let w = self.frequency;
        let energy = (w * w * off.length_squared() + rate.length_squared()).sqrt();
        let acceleration = w * (1.0 + 2.0 * self.damping) * energy;
        (8.0 * TOLERANCE / acceleration).sqrt()
    }
}

/// The supply of the current, in units of power at one voltage: W, W/s, s.
#[derive(Clone, Copy)]
struct Supply {
    slew: f64,
    settling: f64,
}

impl Supply {
    /// The power after `time` s on its way from `now` to `asked`, and its mean meanwhile.
    fn after(self, now: f64, asked: f64, time: f64) -> [f64; 2] {
        let lack = asked - now;
        // beyond this the slew is what holds
        let near = self.slew * self.settling;
        let climbing = if self.slew.is_finite() {
            ((lack.abs() - near) / self.slew).clamp(0.0, time)
        } else {
            0.0
        };
        let climbed = if climbing > 0.0 {
            lack.signum() * self.slew * climbing
        } else {
            0.0
        };
        let mut sum = (now + 0.5 * climbed) * climbing;
        let (left, rest) = (lack - climbed, time - climbing);
        if rest <= 0.0 {
            return [now + climbed, sum / time];
        }
        if self.settling == 0.0 {
            return [asked, (sum + asked * rest) / time];
        }
        let fade = (-rest / self.settling).exp();
        sum += asked * rest - left * self.settling * (1.0 - fade);
        [asked - left * fade, sum / time]
    }

    /// A step over which one mean stands for the power, s; infinite where it stands still.
    fn step(self, now: f64, asked: f64) -> f64 {
        let lack = (asked - now).abs();
        let at_once = self.slew.is_infinite() && self.settling == 0.0;
        if at_once || lack <= 1e-6 * asked.max(now) {
            return f64::INFINITY;
        }
        let climb = if self.slew.is_finite() {
            lack / self.slew
        } else {
            0.0
        };
        ((climb + 3.0 * self.settling) / 12.0).max(1e-7)
    }
}

/// Draws stretches one after the other.
struct Pen<'a> {
    machine: &'a Machine,
    deflection: Option<Deflection>,
    supply: Supply,
    motion: MotionBlock,
    times: Vec<f64>,
    height: f64,
    /// Where the beam is, mm, and its velocity, mm/s.
    at: [DVec2; 2],
    /// The power that the supply gives, W.
    power: f64,
    /// The first of the stretches that the place of the beam still remembers.
    since: usize,
    beside: (f64, [f64; 2]),
    behind: f64,
    unreached: (usize, Option<[f64; 2]>),
    stray: Misplaced,
    off: Misplaced,
    /// Heat that lines ask for, J.
    asked: f64,
    /// Power of the last line, W.
    last: f64,
}

impl<'a> Pen<'a> {
    fn new(motion: &MotionBlock, machine: &'a Machine, asked: &[Stretch], voltage: f64) -> Self {
        let start = motion.position.first().copied().unwrap_or(DVec3::ZERO);
        let lag = machine.lag.filter(|lag| *lag > 0.0);
        let first = asked.iter().find(|s| s.is_lit());
        let ready = machine.between != Some(Between::Ramped);
        let mut pen = Pen {
            machine,
            deflection: lag.map(|lag| Deflection {
                frequency: 2.0 * machine.damping / lag,
                damping: machine.damping,
            }),
            supply: Supply {
                slew: machine.slew.map_or(f64::INFINITY, |slew| slew * voltage),
                settling: machine.settling.unwrap_or(0.0),
            },
            motion: MotionBlock::default(),
            times: Vec::new(),
            height: start.z,
            at: [start.truncate(), DVec2::ZERO],
            power: first.filter(|_| ready).map_or(0.0, |s| s.power),
            since: 0,
            beside: (0.0, [0.0; 2]),
            behind: 0.0,
            unreached: (0, None),
            stray: Misplaced::default(),
            off: Misplaced::default(),
            asked: 0.0,
            last: 0.0,
        };
        if !motion.is_empty() {
            let spot = motion.spot.first().copied().unwrap_or_default();
            pen.put(motion.time(0), 0.0, spot);
        }
        pen
    }

    /// The beam is where it is now at `time`, and was this strong and wide on its way.
    fn put(&mut self, time: f64, power: f64, spot: f64) {
        self.times.push(time);
        self.motion.position.push(self.at[0].extend(self.height));
        self.motion.power.push(power);
        self.motion.spot.push(spot);
    }

    fn draw(&mut self, asked: &[Stretch], n: usize) {
        let stretch = &asked[n];
        let spot = stretch.spot * self.machine.widening(stretch.power);
        if stretch.takes == 0.0 {
            if self.deflection.is_none() {
                self.at[0] = stretch.to;
                self.put(stretch.time, 0.0, spot);
            }
            return;
        }
        let (wanted, lit) = self.wanted(asked, n);
        let mut done = 0.0;
        let mut begins = true;
        while done < stretch.takes {
            let left = stretch.takes - done;
            let step = left
                .min(self.deviation(stretch, done))
                .min(self.supply.step(self.power, wanted));
            // what would be left over is no step of its own
            let step = if left - step < 1e-6 * stretch.takes {
                left
            } else {
                step
            };
            done = if step == left {
                stretch.takes
            } else {
                done + step
            };
            let before = self.at[0];
            self.go(stretch, done, step);
            let [now, mean] = self.supply.after(self.power, wanted, step);
            self.power = now;
            let time = stretch.time + done;
            self.put(time, if lit { mean } else { 0.0 }, spot);
            let from = stretch.from;
            if stretch.is_lit() {
                self.last = stretch.power;
                self.asked += stretch.power * step;
                let off = (mean - stretch.power).abs();
                if off > REACHED * stretch.power {
                    self.off.add(off * step, step, from, &mut begins);
                }
            } else if lit && mean > 0.0 {
                // the tail of a fall has little heat, however long it is
                let on = if mean > REACHED * self.last {
                    step
                } else {
                    0.0
                };
                self.stray.add(mean * step, on, from, &mut begins);
            }
            if stretch.is_lit() {
                self.look(asked, n, done, before);
            }
        }
        let goes_on = asked
            .get(n + 1)
            .is_some_and(|s| s.is_lit() && s.power == stretch.power);
        let off = (self.power - stretch.power).abs();
        if stretch.is_lit() && !goes_on && off > REACHED * stretch.power {
            self.unreached.0 += 1;
            self.unreached.1.get_or_insert(stretch.to.to_array());
        }
    }

    /// The power that the supply is asked for, and whether it reaches the powder.
    fn wanted(&self, asked: &[Stretch], n: usize) -> (f64, bool) {
        let stretch = &asked[n];
        if stretch.is_lit() {
            return (stretch.power, true);
        }
        let lit = |s: &&Stretch| s.is_lit();
        match self.machine.between {
            Some(Between::Ramped) => (0.0, true),
            Some(Between::On) => {
                let before = asked[..n].iter().rev().find(lit);
                (before.map_or(0.0, |s| s.power), before.is_some())
            }
            Some(Between::Blanked) | None => {
                let next = asked[n..].iter().find(lit);
                (next.map_or(0.0, |s| s.power), false)
            }
        }
    }

    /// How long the deflection bends no further than the tolerance, s.
    fn deviation(&self, stretch: &Stretch, done: f64) -> f64 {
        self.deflection
            .map_or(f64::INFINITY, |d| d.step(self.off(stretch, done)))
    }

    /// Deviation from the line that the beam settles on, and its rate.
    fn off(&self, stretch: &Stretch, done: f64) -> [DVec2; 2] {
        let velocity = stretch.velocity();
        let lag = self.machine.lag.unwrap_or(0.0);
        let settled = stretch.from + velocity * (done - lag);
        [self.at[0] - settled, self.at[1] - velocity]
    }

    /// Takes the beam over the last `step` s up to `done` s of the stretch.
    fn go(&mut self, stretch: &Stretch, done: f64, step: f64) {
        let Some(deflection) = self.deflection else {
            self.at[0] = if done == stretch.takes {
                stretch.to
            } else {
                stretch.from + stretch.velocity() * done
            };
            return;
        };
        let [off, rate] = deflection.after(self.off(stretch, done - step), step);
        let velocity = stretch.velocity();
        let lag = self.machine.lag.unwrap_or(0.0);
        self.at = [
            stretch.from + velocity * (done - lag) + off,
            velocity + rate,
        ];
    }

    /// How far the lit beam is from where it was asked to be, on its way from `before` to where it is after `done` s.
    fn look(&mut self, asked: &[Stretch], n: usize, done: f64, before: DVec2) {
        let stretch = &asked[n];
        let should = stretch.from + stretch.velocity() * done;
        self.behind = self.behind.max(self.at[0].distance(should));
        let lag = self.machine.lag.unwrap_or(0.0);
        while self.since < n && asked[self.since].end() < stretch.time + done - MEMORY * lag {
            self.since += 1;
        }
        if n > 0 && !asked[n - 1].is_lit() {
            // the line begins after a jump: none drawn before is its own
            self.since = n;
        }
        for share in [0.25, 0.5, 0.75, 1.0] {
            let here = before.lerp(self.at[0], share);
            let near = asked[self.since..=n].iter().filter(|s| s.is_lit());
            let nearest = near.map(|s| s.distance(here)).fold(f64::INFINITY, f64::min);
            if nearest > self.beside.0 {
                self.beside = (nearest, here.to_array());
            }
        }
    }
}
