//! The reference heads, plates and recipes, as they ship.

use meltpath_planning::powder::plate::SquarePlate;
use meltpath_scan_head::axis::galvanometer::Galvanometer;
use meltpath_scan_head::files;
use meltpath_scan_head::head::job::prepare;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::scan_head::ScanHead;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_scan_head::measures::contour_error::PathErrors;
use meltpath_scan_head::measures::dark_way::LightReach;
use meltpath_scan_head::measures::fill_rate::{FillMode, FillRate};

/// A head's file, its plate as one that is planned.
pub(crate) struct HeadData {
    pub(crate) head: ScanHead,
    pub(crate) plate: SquarePlate,
    pub(crate) tuning: [Option<[f64; 3]>; 3],
}

fn data(text: &str) -> HeadData {
    let data = files::parse_head(text).unwrap();
    let stated = data.plate;
    HeadData {
        head: data.head,
        plate: SquarePlate {
            columns: stated.columns.0 as u32,
            rows: stated.rows.0 as u32,
            column_pitch: stated.column_pitch.0,
            row_pitch: stated.row_pitch.0,
            side: stated.side.0,
            contour_distance: stated.contour_distance.0,
            hatch: stated.hatch.0,
            inset: stated.inset.0,
        },
        tuning: data.tuning,
    }
}

pub(crate) fn two_axis_data() -> HeadData {
    data(meltpath_data::scan_heads::TWO_AXIS_150.text)
}

pub(crate) fn three_axis_data() -> HeadData {
    data(meltpath_data::scan_heads::THREE_AXIS_350.text)
}

/// What a head makes of a plate.
pub(crate) fn job_of(plate: &SquarePlate, recipe: &Recipe) -> ScanJob {
    let path = plate.toolpath().unwrap();
    prepare(&path.layers, recipe).unwrap()
}

/// What is measured of a plate: how far from its path a head goes, and what it fills.
pub(crate) fn measured(plate: &SquarePlate, period: f64) -> (PathErrors, FillRate) {
    let modes = [FillMode::SampledPoints { every: 1 }, FillMode::SweptSpot];
    let fill = FillRate::of_rectangles(plate.fill_areas(), 0.07, &modes);
    (
        PathErrors::new(2e-3, period, LightReach::of(0.065, 0.03)),
        fill,
    )
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
    two_axis().mirrors[1].motor().unwrap().motor.clone()
}

/// The first square of a plate, at the centre of the field.
pub(crate) fn one(plate: SquarePlate) -> SquarePlate {
    SquarePlate {
        columns: 1,
        rows: 1,
        ..plate
    }
}
