//! Energy per length along the marked path, and laser power that follows the spot's speed.
//!
//! Source: Rasoanarivo 2020, § 2.1 and perspectives: current machines do not modulate the power, so slow corners and waits under
//! light burn in.

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::power::PowerLaw;
use crate::measures::histogram::Histogram;
use crate::measures::light::Light;
use meltpath_toolpath::Role;

/// Energy per length of pieces of the lit path, each one spot long, over power and speed of its mark: 1 where the spot runs at its
/// speed, more where it is slow or waits under light.
#[derive(Debug, Clone)]
pub struct EnergyAlong {
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

impl EnergyAlong {
    /// Along marks, in pieces of `spot` mm.
    pub fn new(law: PowerLaw, spot: f64) -> Self {
        EnergyAlong {
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
                Some(Role::Contour) => self.contour.add(ratio),
                _ => self.fill.add(ratio),
            }
        }
        (self.energy, self.length) = (0.0, 0.0);
    }
}

impl HeadSink for EnergyAlong {
    fn block(&mut self, block: &HeadBlock) {
        for k in 0..block.len() {
            let (power, moved) = self.light.step(self.law, block, k);
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
    use crate::head::prepared::Prepared;
    use crate::head::vector::{ScanJob, Vector};
    use meltpath_geometry::math::{DVec2, DVec3};

    /// Median and 99 % of the energy ratios of a spot that runs so many mm a sample of 10 µs on a fill of 1000 mm/s and 200 W.
    fn ratios(law: PowerLaw, steps: &[f64]) -> [f64; 2] {
        let job = ScanJob {
            start: DVec3::ZERO,
            vectors: vec![Vector {
                kind: Role::Fill,
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
        let mut along = EnergyAlong::new(law, 0.07);
        along.block(&HeadBlock {
            period: 1e-5,
            command: CommandBlock {
                first: 0,
                position: hit.iter().map(|p| p.extend(0.0)).collect(),
                vector: vec![0; n],
                moving: vec![true; n],
            },
            layers: vec![std::sync::Arc::new(Prepared::of(job))],
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
