//! What has been fed along the bead lately, and how the bead differs from the nominal one there.

use super::{DepositError, Mode, Settings};
use crate::bead::{BeadModel, PoolModel, PursuitLength};

/// Bounds of the local feed over the nominal one: outside, the laws of bead and pool are not known.
const FEED_RATIO: std::ops::RangeInclusive<f64> = 0.5..=1.5;

/// How the bead differs from the nominal one here.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalFeed {
    /// Feed per length over the nominal one.
    pub(crate) ratio: f64,
    /// Width over the nominal one.
    pub(crate) wide: f64,
}

/// Low-passed volume fed, volume asked for and travel: the local feed per length over the time the pool takes to pass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Feeding {
    fed: f64,
    asked: f64,
    gone: f64,
}

impl Feeding {
    /// At the start of a bead: the nominal feed.
    pub(crate) fn new(bead: &BeadModel, pool: &PoolModel) -> Self {
        let length = pool.length();
        Feeding {
            fed: bead.area * length,
            asked: bead.area * length,
            gone: length,
        }
    }

    /// `volume` was fed over `travel` mm where `asked` was meant, mm³.
    pub(crate) fn pass(
        &mut self,
        (bead, pool): (&BeadModel, &PoolModel),
        travel: f64,
        (asked, volume): (f64, f64),
    ) {
        let forget = (-travel.max(asked / bead.area) / pool.length()).exp();
        self.fed = self.fed * forget + volume;
        self.asked = self.asked * forget + asked;
        self.gone = self.gone * forget + travel;
    }

    /// How the bead differs from the nominal one: by the torch's speed, and by what the source feeds.
    pub(crate) fn local(&self, bead: &BeadModel) -> LocalFeed {
        let within = |r: f64| r.clamp(*FEED_RATIO.start(), *FEED_RATIO.end());
        let slower = within(self.asked / (bead.area * self.gone.max(1e-9)));
        let fed = within(self.fed / self.asked);
        LocalFeed {
            ratio: within(slower * fed),
            wide: slower.powf(bead.width_exponent) * fed.powf(bead.feed_exponent),
        }
    }
}

/// Checks the sizes that a deposition starts from.
///
/// # Errors
/// [`DepositError::Size`] naming the first that is not positive and finite.
pub(crate) fn check_sizes(
    bead: &BeadModel,
    pool: &PoolModel,
    settings: &Settings,
) -> Result<(), DepositError> {
    let mut sizes = vec![
        ("the bead's width", bead.width),
        ("the bead's area", bead.area),
        ("the wire's section", bead.wire_section),
        ("the deposition efficiency", bead.efficiency),
        ("the pool's front length", pool.front),
        ("the pool's rear length", pool.rear),
        ("the pool's half width", pool.half_width),
        ("the longest stamp", settings.stamp),
        ("the record step", settings.record_step),
        ("the accumulation limit", settings.accumulation),
    ];
    if let PursuitLength::Fixed(length) = pool.pursuit {
        sizes.push(("the pursuit length", length));
    }
    if let Mode::Build(levelling) = settings.mode {
        sizes.extend([
            ("the wall ratio", levelling.wall_ratio),
            ("the wetting length", levelling.wetting_length),
            ("the support drop", levelling.support),
            ("the cliff drop", levelling.cliff),
            ("the levelling step", levelling.step),
            ("the move that counts as balance", levelling.settled),
        ]);
    }
    for (what, value) in sizes {
        if !(value.is_finite() && value > 0.0) {
            return Err(DepositError::Size { what, value });
        }
    }
    if !(pool.offset.is_finite() && pool.offset >= 0.0) {
        let (what, value) = ("the pool's offset (or 0)", pool.offset);
        return Err(DepositError::Size { what, value });
    }
    Ok(())
}
