//! What a bead will cover, from the motion alone: its axis behind the torch, how wide it is there, and how long it is fed. The same laws
//! as those of the deposit, without its metal: quick enough for a plan.

use meltpath_geometry::math::{DVec2, DVec3};

use super::Settings;
use super::feeding::Feeding;
use crate::bead::{BeadModel, PoolModel};
use crate::pursuit::Pursuit;

/// A place of a bead's axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnAxis {
    /// Where it is in plan, mm.
    pub centre: DVec2,
    /// Width of the bead on a plate over the nominal one: the torch's speed changes it.
    pub wide: f64,
}

/// Follows one bead from its arc start on.
///
/// The source is taken to feed what is asked for. A torch that slows down lays a wider bead by the width exponent of the [`BeadModel`], over
/// the time the pool takes to pass (Rouchon 2022, perspective P2; law of our own), and its axis cuts corners as the pool does (eq. 3.4).
///
/// ```
/// use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
/// use meltpath_deposition::deposit::Settings;
/// use meltpath_deposition::deposit::footprint::Footprint;
/// use meltpath_geometry::math::DVec3;
///
/// let bead = BeadModel { width: 7.0, area: 9.0, wire_section: 0.785, efficiency: 1.0, width_exponent: 0.5, feed_exponent: 0.5 };
/// let pool = PoolModel { front: 3.5, rear: 10.0, half_width: 3.5, offset: 1.5, pursuit: PursuitLength::Fixed(4.0) };
/// let mut footprint = Footprint::new(DVec3::ZERO, (bead, pool), &Settings::default());
/// // 0.1 mm on, with the wire of that way
/// let on = footprint.feed(DVec3::new(0.1, 0.0, 0.0), 0.1 * 9.0 / 0.785).unwrap();
/// assert!((on.centre.x + 1.4).abs() < 1e-9 && (on.wide - 1.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone)]
pub struct Footprint {
    bead: BeadModel,
    pool: PoolModel,
    settings: Settings,
    feeding: Feeding,
    torch: DVec3,
    /// From when the torch has moved on.
    pursuit: Option<Pursuit>,
}

impl Footprint {
    /// The arc starts at `start`, mm.
    pub fn new(start: DVec3, (bead, pool): (BeadModel, PoolModel), settings: &Settings) -> Self {
        Footprint {
            bead,
            pool,
            settings: *settings,
            feeding: Feeding::new(&bead, &pool),
            torch: start,
            pursuit: None,
        }
    }

    /// The torch goes on to `to`, mm, a small part of the pool's length, while `wire` mm are fed; where the bead's axis is then. `None` as
    /// long as it has not moved.
    pub fn feed(&mut self, to: DVec3, wire: f64) -> Option<OnAxis> {
        let way = (to - self.torch).truncate();
        let asked = wire * self.bead.wire_section * self.bead.efficiency;
        let laws = (&self.bead, &self.pool);
        self.feeding.pass(laws, way.length(), (asked, asked));
        let plan = |p: DVec3| p.truncate().extend(0.0);
        if self.pursuit.is_none() {
            let heading = way.try_normalize()?.extend(0.0);
            let (law, mode) = (self.pool.pursuit, self.settings.pursuit);
            self.pursuit = Some(Pursuit::new(plan(self.torch), heading, law, mode));
        }
        self.torch = to;
        let pursuit = self.pursuit.as_mut()?;
        pursuit.follow(plan(to));
        let local = self.feeding.local(&self.bead);
        let pool = self.pool.at_feed(local.ratio, local.wide);
        Some(OnAxis {
            centre: to.truncate() - pool.offset * pursuit.heading().truncate(),
            wide: local.wide,
        })
    }
}
