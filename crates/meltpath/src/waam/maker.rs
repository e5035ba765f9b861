//! Which controllers read which programs.

use meltpath_programs::Dialect;
use meltpath_robot::cell::Maker;

/// Whether a maker's controllers read this dialect: they count joints as its arms show them.
pub(in crate::waam) fn reads(maker: Maker, dialect: Dialect) -> bool {
    match maker {
        Maker::Fanuc => dialect == Dialect::FanucLs,
        Maker::Kuka => dialect == Dialect::Krl,
        Maker::Abb => dialect == Dialect::Rapid,
        Maker::Yaskawa => dialect == Dialect::Inform,
        Maker::Staubli => dialect == Dialect::Val3,
        Maker::Universal => dialect == Dialect::UrScript,
        // its file counts as its controller does
        Maker::Other => true,
    }
}
