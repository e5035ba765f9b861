//! How the spot runs in light, as the head drew it: where it stands, and where it is slowest over its own length.
//!
//! What a head is asked for is not what its mirrors do: light that is on while they settle, turn back or set off heats one place.

use std::collections::VecDeque;

use meltpath_base::Status;
use meltpath_geometry::math::DVec2;
use meltpath_scan_head::head::block::{HeadBlock, HeadSink};
use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::measures::light::Light;
use meltpath_thermal::pool::keyhole::FULL_KEYHOLE;
use meltpath_toolpath::Role;

use super::boiling::{Boiling, by_law, status};
use super::settings::HeatSettings;
use super::standing::{Cause, Standing};

/// A spot slower than this share of its mark's speed stands.
const STANDS: f64 = 0.05;
/// By what share the spot may run off the speed of its mark before that is told.
const OFF: f64 = 0.1;
/// Differences of figures that are none.
const ALIKE: f64 = 1e-6;

/// The stretch of light, a spot's length or more, on which the spot runs nearest to a keyhole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slow {
    /// What a steady mark of that speed and power does.
    pub boiling: Boiling,
    /// The spot's speed there, and that of its mark, mm/s.
    pub speeds: [f64; 2],
}

impl Slow {
    /// Whether the spot runs otherwise than its mark is commanded.
    pub(super) fn is_off(&self) -> bool {
        let [speed, commanded] = self.speeds;
        (speed / commanded - 1.0).abs() > OFF
    }

    /// What it is worth: laws are those of steady marks, and say of a short stretch that it may be bad, not that it is.
    pub(super) fn status(&self) -> Status {
        if self.is_off() && by_law(&self.boiling) >= FULL_KEYHOLE {
            return Status::CannotSay;
        }
        status(&self.boiling)
    }
}

/// What was found of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pace {
    /// Where the spot runs nearest to a keyhole.
    pub slowest: Option<Slow>,
    /// Where it stands in light and heats the most.
    pub standing: Option<Standing>,
}

/// Light along a way.
#[derive(Debug, Clone, Copy, Default)]
struct Stretch {
    /// s.
    time: f64,
    /// mm.
    way: f64,
    /// J.
    energy: f64,
}

impl Stretch {
    fn add(&mut self, other: &Stretch, sign: f64) {
        self.time += sign * other.time;
        self.way += sign * other.way;
        self.energy += sign * other.energy;
    }
}

/// Looks at the pace of the spot while a run streams.
#[derive(Debug, Clone)]
pub struct LitPace<'a> {
    settings: &'a HeatSettings,
    law: PowerLaw,
    light: Light,
    /// The last spot's length of light, sample by sample, and all of it.
    samples: VecDeque<Stretch>,
    whole: Stretch,
    /// Light in which the spot stands now.
    still: Stretch,
    /// Where the spot is.
    place: DVec2,
    layer: u32,
    /// Power, power over the root of the speed and over the speed of the worst: with less of all three nothing boils more.
    known: [f64; 3],
    found: Pace,
}

impl<'a> LitPace<'a> {
    /// Of a spot whose power follows a law.
    pub(in crate::lpbf) fn new(settings: &'a HeatSettings, law: PowerLaw) -> Self {
        LitPace {
            settings,
            law,
            light: Light::default(),
            samples: VecDeque::new(),
            whole: Stretch::default(),
            still: Stretch::default(),
            place: DVec2::ZERO,
            layer: 0,
            known: [0.0; 3],
            found: Pace::default(),
        }
    }

    /// What was found.
    pub(in crate::lpbf) fn found(&self) -> Pace {
        self.found
    }

    fn dark(&mut self) {
        // light that went less than a spot acts on one
        if self.whole.time > 0.0 && self.whole.way < self.settings.spot {
            self.judge(self.settings.spot);
        }
        self.still = Stretch::default();
        self.begin();
    }

    fn begin(&mut self) {
        self.samples.clear();
        self.whole = Stretch::default();
    }

    /// A sample in light, at a speed.
    fn lit(&mut self, sample: Stretch, speed: f64) {
        if speed < STANDS * self.light.speed {
            self.still.add(&sample, 1.0);
        } else {
            self.still = Stretch::default();
        }
        // a shorter rest is one of the speed over a spot's length
        if self.still.time > self.settings.spot / self.light.speed {
            self.stands();
            self.begin();
            return;
        }
        self.samples.push_back(sample);
        self.whole.add(&sample, 1.0);
        while let Some(first) = self.samples.front().copied()
            && self.whole.way - first.way >= self.settings.spot
        {
            self.whole.add(&first, -1.0);
            self.samples.pop_front();
        }
        if self.whole.way >= self.settings.spot {
            self.judge(self.whole.way);
        }
    }

    fn stands(&mut self) {
        let Stretch { time, energy, .. } = self.still;
        let power = energy / time;
        if power <= 0.0 {
            return;
        }
        let standing = Standing {
            place: self.place.to_array(),
            layer: Some(self.layer),
            ..Standing::of(
                self.settings,
                (power, self.light.speed),
                (time, Cause::Motion),
            )
        };
        let before = self.found.standing;
        self.found.standing = before
            .into_iter()
            .chain([standing])
            .max_by(Standing::hotter);
    }

    /// The last stretch of light, of a length.
    fn judge(&mut self, way: f64) {
        let Stretch { time, energy, .. } = self.whole;
        let (speed, power) = (way / time, energy / time);
        let strengths = [power, power / speed.sqrt(), power / speed];
        let mut both = strengths.iter().zip(&self.known);
        if both.all(|(here, known)| *here <= known * (1.0 + ALIKE)) {
            return;
        }
        let kind = self.light.kind.unwrap_or(Role::Fill);
        let end = (self.place.to_array(), Some(self.layer));
        let Some(boiling) = Boiling::of(self.settings, kind, [power, speed], end) else {
            return;
        };
        let slow = Slow {
            boiling,
            speeds: [speed, self.light.speed],
        };
        let rank = |s: &Slow| (s.status(), by_law(&s.boiling));
        let worse = self.found.slowest.is_none_or(|before| {
            let (old, new) = (rank(&before), rank(&slow));
            new.0.cmp(&old.0).then(new.1.total_cmp(&old.1)).is_gt()
        });
        if worse {
            self.known = strengths;
            self.found.slowest = Some(slow);
        }
    }
}

impl HeadSink for LitPace<'_> {
    fn block(&mut self, block: &HeadBlock) {
        for k in 0..block.len() {
            let (power, moved) = self.light.step(self.law, block, k);
            let lit = block.lit[k];
            if lit <= 0.0 || self.light.speed <= 0.0 {
                self.dark();
                continue;
            }
            self.place = block.hit[k];
            self.layer = block
                .vector(k)
                .map_or(self.layer, |(layer, _)| layer.number);
            let sample = Stretch {
                time: lit * block.period,
                way: lit * moved,
                energy: power * block.period,
            };
            self.lit(sample, moved / block.period);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_thermal::material::file::{Readings, read};
    use meltpath_thermal::material::medium::{Body, Medium};

    fn settings() -> HeatSettings {
        let text = meltpath_data::materials::IN625_LASER.text;
        let material = read(text, Readings::default()).unwrap();
        HeatSettings {
            medium: Medium::effective(&material, 293.15, Body::HalfSpace).unwrap(),
            material,
            absorptivity: 0.33,
            layer: 0.03,
            depths: std::collections::BTreeMap::new(),
            cell: 0.01,
            spot: 0.1,
            margin: 0.1,
            marks: 1e9,
            share: 0.9,
        }
    }

    /// What is found of a mark of 1000 mm/s and 200 W in light at some speeds, each for so many samples of 10 µs.
    fn found(settings: &HeatSettings, pieces: &[(f64, usize)]) -> Pace {
        let mut pace = LitPace::new(settings, PowerLaw::Constant);
        (pace.light.power, pace.light.speed) = (200.0, 1000.0);
        for (speed, samples) in pieces {
            let sample = Stretch {
                time: 1e-5,
                way: speed * 1e-5,
                energy: 200.0 * 1e-5,
            };
            (0..*samples).for_each(|_| pace.lit(sample, *speed));
        }
        pace.dark();
        pace.found()
    }

    #[test]
    fn the_slowest_spot_long_stretch_decides() {
        let settings = settings();
        let speed = |pieces: &[(f64, usize)]| found(&settings, pieces).slowest.unwrap();
        let steady = speed(&[(1000.0, 200)]);
        assert!(!steady.is_off() && (steady.speeds[0] - 1000.0).abs() < 1e-6);
        assert_eq!(steady.status(), status(&steady.boiling));
        // 0.1 mm at a tenth of the speed, in the middle of a mark
        let slow = speed(&[(1000.0, 100), (100.0, 100), (1000.0, 100)]);
        assert!((slow.speeds[0] - 100.0).abs() < 1.0, "{slow:?}");
        assert!(by_law(&slow.boiling) > FULL_KEYHOLE && by_law(&steady.boiling) < FULL_KEYHOLE);
        assert_eq!(slow.status(), Status::CannotSay);
        // half a spot of it counts half, and so does a mark that is no longer
        let short = speed(&[(1000.0, 100), (100.0, 50), (1000.0, 100)]);
        assert!((short.speeds[0] - 182.0).abs() < 10.0, "{short:?}");
        let alone = speed(&[(100.0, 50)]);
        assert!((alone.speeds[0] - 200.0).abs() < 1.0, "{alone:?}");
    }

    #[test]
    fn light_on_a_spot_that_stands_is_found() {
        let settings = settings();
        let still = found(&settings, &[(1000.0, 100), (20.0, 44)])
            .standing
            .unwrap();
        assert_eq!(still.cause, Cause::Motion);
        assert!((still.wait - 0.44e-3).abs() < 1e-9, "{still:?}");
        assert!(still.number.unwrap() > 1.0);
        // a rest as short as the mark takes over its own spot is a slow stretch
        let short = found(&settings, &[(1000.0, 100), (0.0, 9), (1000.0, 100)]);
        assert_eq!(short.standing, None);
        assert!(short.slowest.unwrap().speeds[0] < 600.0);
    }
}
