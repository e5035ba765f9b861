//! A batch of steps over the columns of voxels: heating step by step, cooling when next looked at.

use super::ground::{Below, Ground};
use crate::charts::neighbourhood::Neighbourhood;
use crate::charts::rates::{Between, Rates, Ring, Warmth};

/// One voxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Voxel {
    /// What the charts heated it by, J/mm³; the ground comes on top.
    pub(super) enthalpy: f32,
    /// Highest enthalpy, ground included.
    pub(super) highest: f32,
    /// Time spent above the timed temperature, s.
    pub(super) above: f32,
    /// When it last fell through it, s since the layer began; NaN before.
    pub(super) fell: f32,
    /// Rate at which it did, J/(mm³·s).
    pub(super) rate: f32,
    pub(super) powder: bool,
}

impl Voxel {
    /// At the start temperature, before anything happened to it.
    pub(super) fn fresh(powder: bool) -> Self {
        Voxel {
            enthalpy: 0.0,
            highest: 0.0,
            above: 0.0,
            fell: f32::NAN,
            rate: 0.0,
            powder,
        }
    }
}

/// What all voxels of a column share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    /// Time its voxels are up to date for, s.
    pub(super) since: f64,
    /// Share of powder it cools by: that of when the beam left it, and the charts that heated it.
    pub(super) between: Between,
    pub(super) set: u8,
    /// The ground it stands on.
    pub(super) below: Below,
    /// The warmest that ground was, mean over the depth of the heated zone, J/mm³.
    pub(super) warmest: f32,
    /// When the beam was nearest last, s, and whether it has gone away since.
    nearest: f64,
    receding: bool,
    /// Square of the distance of the beam, mm².
    square: f64,
}

impl Column {
    /// At the start temperature.
    pub(super) fn fresh(between: Between, set: u8) -> Self {
        Column {
            since: f64::NEG_INFINITY,
            between,
            set,
            below: Below::NOTHING,
            warmest: 0.0,
            nearest: f64::NEG_INFINITY,
            receding: false,
            square: f64::INFINITY,
        }
    }
}

/// A beam at rest for one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub(super) time: f64,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) set: u8,
}

/// What a batch of steps needs to heat columns on any thread.
pub(super) struct Batch<'a> {
    pub(super) steps: &'a [Step],
    pub(super) rates: &'a [Rates],
    pub(super) around: &'a Neighbourhood,
    pub(super) ground: Option<&'a Ground>,
    /// Depths of the planes, mm.
    pub(super) depths: &'a [f32],
    pub(super) dt: f64,
    pub(super) fusion: f32,
    pub(super) timed: f32,
}

impl Batch<'_> {
    /// Heats one column; returns how many of its voxels became metal and its highest enthalpy afterwards, 0 where the beam
    /// did not reach it. `under` is room for the ground under each voxel.
    pub(super) fn column(
        &self,
        index: usize,
        centre: [f64; 2],
        column: &mut Column,
        voxels: &mut [Voxel],
        under: &mut [Under],
    ) -> (u32, f32) {
        let share = self.around.share(index);
        let mut between: Option<(u8, Between)> = None;
        let mut melted = 0;
        for step in self.steps {
            let rates = &self.rates[usize::from(step.set)];
            let square = (centre[0] - step.x).powi(2) + (centre[1] - step.y).powi(2);
            if square > rates.radius * rates.radius {
                continue;
            }
            let ring = rates.ring(square.sqrt() as f32);
            let left = step.time - column.since > 0.5 * self.dt;
            if left {
                let before = &self.rates[usize::from(column.set)];
                let ground = Standing::of(column, self.ground, before);
                for (k, voxel) in voxels.iter_mut().enumerate() {
                    let under = ground.at(self.depths[k]);
                    cool(before, column, k, voxel, under, step.time, self.timed);
                }
            }
            let back = left || column.receding && square < column.square;
            if let Some(ground) = self.ground.filter(|_| back) {
                let new = ground.share(step.time - column.nearest);
                let read = ground.below(centre, step.time);
                column.below = column.below.mixed(&read, new, step.time, ground.away);
                column.warmest = column.warmest.max(column.below.mean());
                let own = (1.0 - new) as f32;
                for voxel in voxels.iter_mut() {
                    voxel.enthalpy *= own;
                }
            }
            column.receding = !back && square > column.square;
            if !column.receding {
                column.nearest = step.time;
            }
            column.square = square;
            if between.is_none() || back {
                column.since = step.time;
                let ground = Standing::of(column, self.ground, rates);
                for (under, depth) in under.iter_mut().zip(self.depths) {
                    *under = ground.at(*depth);
                }
            }
            let here = match between {
                Some((set, here)) if set == step.set => here,
                _ => rates.between(share),
            };
            between = Some((step.set, here));
            column.set = step.set;
            column.between = here;
            column.since = step.time + self.dt;
            melted += self.step(rates, here, ring, step.time, voxels, under);
        }
        let hottest = if between.is_some() {
            let now = voxels
                .iter()
                .zip(&*under)
                .map(|(v, u)| v.enthalpy + u.enthalpy);
            now.fold(0.0, f32::max)
        } else {
            0.0
        };
        (melted, hottest)
    }

    #[inline]
    fn step(
        &self,
        rates: &Rates,
        between: Between,
        ring: Ring,
        time: f64,
        voxels: &mut [Voxel],
        under: &[Under],
    ) -> u32 {
        let dt = self.dt as f32;
        let mut melted = 0;
        for (k, (voxel, under)) in voxels.iter_mut().zip(under).enumerate() {
            let own = voxel.enthalpy;
            let rate = rates.heating(between, under.warmth, k, ring, own);
            voxel.enthalpy = (own + dt * rate).max(0.0);
            let (g, next) = (own + under.enthalpy, voxel.enthalpy + under.enthalpy);
            if next > voxel.highest {
                voxel.highest = next;
                if voxel.powder && next > self.fusion {
                    voxel.powder = false;
                    melted += 1;
                }
            }
            if next >= self.timed || g >= self.timed {
                // the part of the step spent above
                let (low, high) = (g.min(next), g.max(next));
                let share = if low >= self.timed {
                    1.0
                } else {
                    (high - self.timed) / (high - low)
                };
                voxel.above += share * dt;
                if next < self.timed {
                    voxel.fell = time as f32 + share * dt;
                    voxel.rate = -rate;
                }
            }
        }
        melted
    }
}

/// The ground under a column at one moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Standing {
    surface: f32,
    below: Below,
    /// Where the heated zone's mean lies between the charts' grounds: what carries heat away is the whole zone, as with the
    /// share of powder.
    warmth: Warmth,
}

impl Standing {
    /// When the column was last looked at.
    pub(super) fn of(column: &Column, ground: Option<&Ground>, rates: &Rates) -> Self {
        Standing::when(column, ground, rates, column.since)
    }

    /// At `time` s.
    pub(super) fn when(column: &Column, ground: Option<&Ground>, rates: &Rates, time: f64) -> Self {
        let surface = match ground {
            Some(ground) if !column.below.is_cold() => column.below.at(time, ground.away),
            _ => 0.0,
        };
        Standing {
            surface,
            below: column.below,
            warmth: rates.warmth(surface * column.below.mean),
        }
    }

    /// Under a voxel at a depth, mm.
    #[inline]
    pub(super) fn at(&self, depth: f32) -> Under {
        if self.surface <= 0.0 {
            return Under::default();
        }
        Under {
            enthalpy: self.surface * self.below.share(depth),
            warmth: self.warmth,
        }
    }
}

/// The ground under a voxel.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Under {
    /// Its enthalpy, J/mm³.
    pub(super) enthalpy: f32,
    /// Where the column's lies between the charts.
    pub(super) warmth: Warmth,
}

/// Cools a voxel from when its column was last looked at to `time`; `timed` is the enthalpy whose crossing is timed.
pub(super) fn cool(
    rates: &Rates,
    column: &Column,
    k: usize,
    voxel: &mut Voxel,
    under: Under,
    time: f64,
    timed: f32,
) {
    let g = voxel.enthalpy;
    let passed = time - column.since;
    if g <= 0.0 || passed <= 0.0 {
        return;
    }
    let timed = timed - under.enthalpy;
    let next = rates.cooled(column.between, under.warmth, k, g, passed);
    if g >= timed {
        if next < timed {
            let to_pass = |from: f32| rates.time_to(column.between, under.warmth, k, from, timed);
            let until = to_pass(g);
            let nearly = to_pass(1.01 * timed);
            voxel.above += until as f32;
            voxel.fell = (column.since + until) as f32;
            voxel.rate = 0.01 * timed / nearly.max(1e-9) as f32;
        } else {
            voxel.above += passed as f32;
        }
    }
    voxel.enthalpy = next;
}
