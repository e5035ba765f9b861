//! What earlier beam positions left in the ground: the slowly varying enthalpy on which the charts' histories stand.
//!
//! The heat of the path is superposed as spreading Gaussians on a body with constant properties ([`crate::pool::history`],
//! Carslaw and Jaeger 1959, chapter X) and read as enthalpy, so that no joule depends on a heat capacity. A column reads it
//! when the beam comes near: all heat laid down before then is the ground's, all laid down from then on the chart's.

use crate::material::Material;
use crate::material::medium::{Body, Medium};
use crate::pool::history::{History, Lump, Memory, PER_AGE};
use crate::pool::moving_source::depth_variance;
use crate::solver::source::Depth;

/// Shares of a Gaussian's height below which it does not count, as its exponent.
const FAR: f64 = 12.0;

/// Enthalpy of the ground under one column, from when the beam came near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Below {
    /// When the column read it, s.
    read: f64,
    /// At the surface then and a while later, without what is laid down in between, J/mm³.
    surface: [f32; 2],
    /// Fall with depth: the exponent per mm².
    fall: f32,
    /// Mean over the depth of the heated zone, as a share of the surface's.
    pub(super) mean: f32,
}

impl Below {
    /// Cold ground.
    pub(super) const NOTHING: Below = Below {
        read: 0.0,
        surface: [0.0; 2],
        fall: 0.0,
        mean: 1.0,
    };

    /// At the surface at `time` s, J/mm³; `later` s lie between the two readings.
    #[inline]
    pub(super) fn at(&self, time: f64, later: f64) -> f32 {
        let [now, then] = self.surface;
        if now <= 0.0 {
            return 0.0;
        }
        let x = ((time - self.read) / later) as f32;
        if then < now {
            // spreading heat falls with a power of time
            now / (1.0 + (now / then.max(1e-6 * now) - 1.0) * x)
        } else {
            now + (then - now) * x.clamp(0.0, 1.0)
        }
    }

    /// Mean over the depth of the heated zone when it was read, J/mm³.
    pub(super) fn mean(&self) -> f32 {
        self.surface[0] * self.mean
    }

    /// How much of the surface's enthalpy there is at a depth, mm.
    #[inline]
    pub(super) fn share(&self, depth: f32) -> f32 {
        (-self.fall * depth * depth).exp()
    }

    /// This ground at `time` s with a share `new` of `other`, read then; `later` s lie between the two readings of both.
    pub(super) fn mixed(&self, other: &Below, new: f64, time: f64, later: f64) -> Self {
        let (ours, theirs) = ((1.0 - new) as f32, new as f32);
        let surface = [time, time + later].map(|t| ours * self.at(t, later));
        let sum: [f32; 2] = std::array::from_fn(|n| surface[n] + theirs * other.surface[n]);
        if sum[0] <= 0.0 {
            return Below {
                read: time,
                ..Below::NOTHING
            };
        }
        let part = surface[0] / sum[0];
        let both = |a: f32, b: f32| part * a + (1.0 - part) * b;
        Below {
            read: time,
            surface: sum,
            fall: both(self.fall, other.fall),
            mean: both(self.mean, other.mean),
        }
    }

    /// Whether there is any.
    pub(super) fn is_cold(&self) -> bool {
        self.surface[0] <= 0.0
    }
}

/// The heat of the path so far.
#[derive(Debug, Clone)]
pub(super) struct Ground {
    history: History,
    /// Heat of a quantum that is being filled, and when it began, s.
    open: Option<(f64, Lump)>,
    quantum: f64,
    medium: Medium,
    depth: f64,
    /// Depth at which the fall with depth is read, mm.
    reach: f64,
    /// Time in which heat spreads by the beam's own width, s.
    pub(super) away: f64,
}

/// A beam at rest for a step, as the ground sees it.
pub(super) struct Deposit {
    /// Heat, J.
    pub(super) heat: f64,
    /// Middle of the step, s.
    pub(super) time: f64,
    /// Where, mm.
    pub(super) centre: [f64; 2],
    /// Variance of the beam across, mm².
    pub(super) variance: f64,
}

impl Ground {
    /// Ground under beams of `variance` mm² or wider that move at any speed, in steps of `step` s.
    pub(super) fn new(
        material: &Material,
        body: Body,
        variance: f64,
        depth: Depth,
        reach: f64,
    ) -> Self {
        let diffusivity = effective_diffusivity(material);
        let quantum = variance / (2.0 * diffusivity) / PER_AGE;
        Ground {
            history: History::new(Memory::Folded, PER_AGE * quantum, diffusivity, variance),
            open: None,
            quantum,
            medium: Medium {
                // in enthalpy: as if a joule in a cubic millimetre were a degree
                conductivity: diffusivity,
                diffusivity,
                ambient: material.start,
                body,
            },
            depth: depth_variance(depth),
            reach,
            away: variance / (2.0 * diffusivity),
        }
    }

    /// How much of what a column holds is the ground's when the beam comes back `time` s after it was nearest: the share of
    /// spreading in the variance of heat that was laid down then.
    pub(super) fn share(&self, time: f64) -> f64 {
        if time.is_finite() {
            time / (time + self.away)
        } else {
            1.0
        }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.history = History::new(
            Memory::Folded,
            self.history.youngest,
            self.medium.diffusivity,
            self.away * 2.0 * self.medium.diffusivity,
        );
        self.open = None;
    }

    /// Adds the next step of the beam.
    pub(super) fn add(&mut self, deposit: &Deposit) {
        let Deposit {
            heat,
            time,
            centre,
            variance,
        } = *deposit;
        let lump = Lump::new(heat, time, centre, variance);
        self.open = match self.open.take() {
            Some((begun, sum)) if time - begun < self.quantum => Some((begun, sum.with(&lump))),
            Some((_, full)) => {
                self.history.push(full);
                self.history.fold(time);
                Some((time, lump))
            }
            None => Some((time, lump)),
        };
    }

    /// What a column at `place` reads at `time` s.
    pub(super) fn below(&self, place: [f64; 2], time: f64) -> Below {
        let mut surface = [0.0_f64; 2];
        let mut deep = 0.0;
        let mut see = |lump: &Lump| {
            for (n, sum) in surface.iter_mut().enumerate() {
                let age = (time - lump.time).max(0.0) + n as f64 * self.away;
                let spread = 2.0 * self.medium.diffusivity * age;
                let v = lump.variance.map(|v| v + spread);
                let (dx, dy) = (place[0] - lump.centre[0], place[1] - lump.centre[1]);
                let exponent = 0.5 * (dx * dx / v[0] + dy * dy / v[1]);
                if exponent > FAR {
                    continue;
                }
                let flat = lump.heat * (-exponent).exp()
                    / (2.0 * std::f64::consts::PI * (v[0] * v[1]).sqrt());
                let below = self.depth + spread;
                *sum += flat * self.medium.along_depth(0.0, below);
                if n == 0 {
                    deep += flat * self.medium.along_depth(self.reach, below);
                }
            }
        };
        self.history.each(|lump, _| see(lump));
        if let Some((_, lump)) = &self.open {
            see(lump);
        }
        let share = if surface[0] > 0.0 {
            (deep / surface[0]).clamp(1e-6, 1.0)
        } else {
            1.0
        };
        // mean of share^(x²) over 0 to 1, by Simpson's rule on four pieces
        let at = |x: f64| share.powf(x * x);
        let mean = (at(0.0) + 4.0 * at(0.25) + 2.0 * at(0.5) + 4.0 * at(0.75) + share) / 12.0;
        Below {
            read: time,
            surface: surface.map(|s| s as f32),
            fall: (-share.ln() / (self.reach * self.reach)) as f32,
            mean: mean as f32,
        }
    }
}

/// Mean conductivity over mean heat capacity of the solid, mm²/s: ground between lines is solid.
fn effective_diffusivity(material: &Material) -> f64 {
    const PIECES: u32 = 64;
    let width = (material.solidus - material.start) / f64::from(PIECES);
    let mean = |law: &dyn Fn(f64) -> f64| -> f64 {
        (0..PIECES)
            .map(|n| law(material.start + (f64::from(n) + 0.5) * width))
            .sum()
    };
    mean(&|t| material.conductivity(t)) / mean(&|t| material.heat_capacity(t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::tests::titanium;

    /// Ground under three lines of 2 mm to and fro, 0.2 mm apart, and the heat laid down, J.
    fn three_lines(body: Body) -> (Ground, f64, f64) {
        let depth = Depth::Falling { penetration: 0.1 };
        let mut ground = Ground::new(&titanium(), body, 0.0107, depth, 0.35);
        let (step, heat) = (2.5e-6, 270.0 * 2.5e-6);
        let count = 2450;
        for n in 0..count {
            let way = 980.0 * step * f64::from(n);
            let (line, along) = ((way / 2.0).floor(), way % 2.0);
            let x = if line % 2.0 == 0.0 {
                along
            } else {
                2.0 - along
            };
            ground.add(&Deposit {
                heat,
                time: (f64::from(n) + 0.5) * step,
                centre: [x, 0.2 * line],
                variance: 0.0107,
            });
        }
        (ground, f64::from(count) * heat, f64::from(count) * step)
    }

    /// What all columns together read.
    fn stored(ground: &Ground, time: f64) -> f64 {
        let edge = 0.05;
        let mut sum = 0.0;
        for i in -40..80 {
            for j in -40..50 {
                let place = [(f64::from(i) + 0.5) * edge, (f64::from(j) + 0.5) * edge];
                let below = ground.below(place, time);
                if !below.is_cold() {
                    // the half of a Gaussian over the depth
                    let thick = 0.5 * (std::f64::consts::PI / f64::from(below.fall)).sqrt();
                    sum += f64::from(below.surface[0]) * thick * edge * edge;
                }
            }
        }
        sum
    }

    /// No joule is invented: all columns together read the heat of the path, to what one Gaussian over the depth in place of
    /// several takes.
    #[test]
    fn columns_read_the_heat_of_the_path() {
        let (ground, heat, end) = three_lines(Body::HalfSpace);
        for later in [1e-3, 5e-3, 2e-2] {
            let share = stored(&ground, end + later) / heat;
            assert!((0.93..1.01).contains(&share), "{later} s: {share}");
        }
        // held cold below, it leaves
        let (cooled, ..) = three_lines(Body::Cooled { thickness: 0.5 });
        let place = [1.0, 0.2];
        let [free, held] = [&ground, &cooled].map(|g| g.below(place, end + 0.05).surface[0]);
        assert!(held < 0.3 * free, "{held} {free}");
    }

    /// Two estimates of what a column holds are mixed, never added.
    #[test]
    fn mixing_lies_between() {
        let (ground, _, end) = three_lines(Body::HalfSpace);
        let (early, late) = (
            ground.below([1.0, 0.2], end + 1e-3),
            ground.below([1.0, 0.5], end + 2e-3),
        );
        let at = end + 2e-3;
        let old = early.at(at, ground.away);
        for new in [0.0, 0.3, 1.0] {
            let mixed = early.mixed(&late, new, at, ground.away);
            let wanted = (1.0 - new as f32) * old + new as f32 * late.surface[0];
            assert!((mixed.at(at, ground.away) / wanted - 1.0).abs() < 1e-5);
            let ends = [early.fall.min(late.fall), early.fall.max(late.fall)];
            assert!((ends[0]..=ends[1]).contains(&mixed.fall));
        }
        assert_eq!(ground.share(0.0), 0.0);
        assert_eq!(ground.share(f64::INFINITY), 1.0);
        assert!((ground.share(ground.away) - 0.5).abs() < 1e-12);
    }
}
