//! The bead that the benches lay.

use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};

pub(crate) const BEAD: BeadModel = BeadModel {
    width: 6.54,
    area: 9.63,
    wire_section: std::f64::consts::FRAC_PI_4,
    efficiency: 1.0,
    width_exponent: 0.345,
    feed_exponent: 0.446,
};
pub(crate) const POOL: PoolModel = PoolModel {
    front: 3.27,
    rear: 9.81,
    half_width: 3.27,
    offset: 1.5,
    pursuit: PursuitLength::Fixed(4.0),
};
