//! Energy per length along the marked path, and laser power that follows the spot's speed.
//!
//! Source: Rasoanarivo 2020, § 2.1 and perspectives: current machines do not modulate the power, so slow corners and waits under
//! light burn in.

use meltpath_geometry::math::DVec2;
use serde::{Deserialize, Serialize};

use crate::head::job::{ScanJob, VectorKind};
use crate::head::scan_head::{HeadBlock, HeadSink};
use crate::measures::contour_error::Histogram;

/// What the laser's power follows while a mark is lit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum PowerLaw {
    /// Nothing: the mark's own power, as on current machines.
    #[default]
    Constant,
    /// The spot's speed over that of the mark: the same energy a millimetre wherever it is slower. Never more than the mark's
    /// power.
    WithSpeed {
        /// The least power the laser keeps up, W.
        least: f64,
    },
}

impl PowerLaw {
    /// The power, W, of a spot at `speed` mm/s on a mark of its own `power` and `commanded` speed.
    ///
    /// ```
    /// use meltpath_scan_head::measures::energy::PowerLaw;
    /// let law = PowerLaw::WithSpeed { least: 30.0 };
    /// assert_eq!(law.power(300.0, 1000.0, 500.0), 150.0);
    /// assert_eq!(law.power(300.0, 1000.0, 10.0), 30.0);
    /// assert_eq!(law.power(300.0, 1000.0, 1200.0), 300.0);
    /// assert_eq!(PowerLaw::Constant.power(300.0, 1000.0, 10.0), 300.0);
    /// ```
    pub fn power(self, power: f64, commanded: f64, speed: f64) -> f64 {
        match self {
            PowerLaw::Constant => power,
            PowerLaw::WithSpeed { least } => {
                (power * speed / commanded).clamp(least.min(power), power)
            }
        }
    }
}

/// Power and speed of the mark whose light is on: after its end the off-delay goes on at its power.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Light {
    power: f64,
    speed: f64,
    last: Option<DVec2>,
    /// Of the last mark.
    kind: Option<VectorKind>,
}

impl Light {
    /// At the next sample: the power in it, W, and how far the spot moved, mm.
    pub(crate) fn step(
        &mut self,
        law: PowerLaw,
        job: &ScanJob,
        block: &HeadBlock,
        k: usize,
    ) -> (f64, f64) {
        let v = &job.vectors[block.command.vector[k] as usize];
        if v.kind.is_mark() {
            (self.power, self.speed, self.kind) = (v.power, v.speed, Some(v.kind));
        }
        let moved = self.last.map_or(0.0, |l| l.distance(block.hit[k]));
        self.last = Some(block.hit[k]);
        let power = if self.speed > 0.0 {
            law.power(self.power, self.speed, moved / block.period)
        } else {
            0.0
        };
        (power * block.lit[k], moved)
    }
}

/// Energy per length of pieces of the lit path, each one spot long, over power and speed of its mark: 1 where the spot runs at its
/// speed, more where it is slow or waits under light.
#[derive(Debug, Clone)]
pub struct EnergyAlong<'a> {
    job: &'a ScanJob,
    law: PowerLaw,
    spot: f64,
    light: Light,
    energy: f64,
    length: f64,
    nominal: f64,
    /// Of pieces of contours.
    pub contour: Histogram,
    /// Of pieces of fills.
    pub fill: Histogram,
}

/// Width of a bin of energy ratios.
const BIN: f64 = 0.01;

impl<'a> EnergyAlong<'a> {
    /// Along the marks of `job`, in pieces of `spot` mm.
    pub fn new(job: &'a ScanJob, law: PowerLaw, spot: f64) -> Self {
        EnergyAlong {
            job,
            law,
            spot,
            light: Light::default(),
            energy: 0.0,
            length: 0.0,
            nominal: 0.0,
            contour: Histogram::new(BIN, 10_000),
            fill: Histogram::new(BIN, 10_000),
        }
    }

    /// Ends a piece; light that hardly moves acts on one spot.
    fn close(&mut self) {
        if self.nominal > 0.0 && self.energy > 0.0 {
            let ratio = self.energy / (self.length.max(self.spot) * self.nominal);
            match self.light.kind {
                Some(VectorKind::Contour) => self.contour.add(ratio),
                _ => self.fill.add(ratio),
            }
        }
        (self.energy, self.length) = (0.0, 0.0);
    }
}

impl HeadSink for EnergyAlong<'_> {
    fn block(&mut self, block: &HeadBlock) {
        for k in 0..block.len() {
            let (power, moved) = self.light.step(self.law, self.job, block, k);
            if block.lit[k] <= 0.0 {
                self.close();
                continue;
            }
            if self.light.speed > 0.0 {
                self.nominal = self.light.power / self.light.speed;
            }
            self.energy += power * block.period;
            self.length += moved * block.lit[k];
            if self.length >= self.spot {
                self.close();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::head::interpolation::CommandBlock;
    use crate::head::job::Vector;
    use meltpath_geometry::math::DVec3;

    /// Median and 99 % of the energy ratios of a spot that runs so many mm a sample of 10 µs on a fill of 1000 mm/s and 200 W.
    fn ratios(law: PowerLaw, steps: &[f64]) -> [f64; 2] {
        let job = ScanJob {
            start: DVec3::ZERO,
            vectors: vec![Vector {
                kind: VectorKind::Fill,
                end: DVec3::X * 10.0,
                speed: 1000.0,
                power: 200.0,
                wait: 0.0,
                block: 0,
            }],
        };
        let mut at = DVec2::ZERO;
        let hit: Vec<DVec2> = steps
            .iter()
            .map(|step| {
                at.x += step;
                at
            })
            .collect();
        let n = hit.len();
        let mut along = EnergyAlong::new(&job, law, 0.07);
        along.block(&HeadBlock {
            period: 1e-5,
            command: CommandBlock {
                first: 0,
                position: hit.iter().map(|p| p.extend(0.0)).collect(),
                vector: vec![0; n],
                moving: vec![true; n],
            },
            lit: vec![1.0; n],
            hit,
            ..HeadBlock::default()
        });
        assert_eq!(along.contour.total(), 0);
        [along.fill.quantile(0.5), along.fill.quantile(0.99)]
    }

    #[test]
    fn slow_and_waiting_light_brings_more_energy_and_power_with_speed_takes_it_back() {
        let near = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
            assert!((a - c).abs() < 0.02 && (b - d).abs() < 0.02, "{a} {b}");
        };
        let with = PowerLaw::WithSpeed { least: 0.0 };
        near(ratios(PowerLaw::Constant, &[0.01; 2000]), [1.0, 1.0]);
        near(ratios(PowerLaw::Constant, &[0.005; 2000]), [2.0, 2.0]);
        near(ratios(with, &[0.005; 2000]), [1.0, 1.0]);
        // now and then 30 periods at rest: some of the 60 pieces hold several times the energy
        let mut waits = vec![0.01; 490];
        for k in 0..5 {
            waits.splice(100 * k..100 * k, [0.0; 30]);
        }
        let [median, most] = ratios(PowerLaw::Constant, &waits);
        assert!((median - 1.0).abs() < 0.02 && most > 3.0, "{median} {most}");
        // the least power the laser keeps up goes on at rest
        let [_, least] = ratios(PowerLaw::WithSpeed { least: 50.0 }, &waits);
        assert!(least > 1.5 && least < most, "{least}");
    }
}
