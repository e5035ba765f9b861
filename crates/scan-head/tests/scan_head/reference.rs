//! The reference heads, plates and recipes, as they ship.

use meltpath_scan_head::axis::galvanometer::Galvanometer;
use meltpath_scan_head::files::{self, HeadData};
use meltpath_scan_head::head::job::Recipe;
use meltpath_scan_head::head::scan_head::ScanHead;
use meltpath_scan_head::plate::SquarePlate;

pub(crate) fn two_axis_data() -> HeadData {
    files::parse_head(meltpath_data::scan_heads::TWO_AXIS_150.text).unwrap()
}

pub(crate) fn three_axis_data() -> HeadData {
    files::parse_head(meltpath_data::scan_heads::THREE_AXIS_350.text).unwrap()
}

pub(crate) fn two_axis() -> ScanHead {
    two_axis_data().head
}

pub(crate) fn three_axis() -> ScanHead {
    three_axis_data().head
}

/// Recipes 1, 2 and 3.
pub(crate) fn recipes() -> [Recipe; 3] {
    [
        meltpath_data::recipes::INDUSTRIAL.text,
        meltpath_data::recipes::UNIFORM.text,
        meltpath_data::recipes::DOUBLED.text,
    ]
    .map(|text| files::parse_recipe(text).unwrap())
}

/// The two-axis reference motor.
pub(crate) fn motor() -> Galvanometer {
    two_axis().mirrors[1].motor.clone()
}

/// The first square of a plate, at the centre of the field.
pub(crate) fn one(plate: SquarePlate) -> SquarePlate {
    SquarePlate {
        columns: 1,
        rows: 1,
        ..plate
    }
}
