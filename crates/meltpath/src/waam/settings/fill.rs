//! How layers are filled, as a job's table says, with what it leaves to the bead and its process map.

use meltpath_base::settings::Problem;
use meltpath_base::{Angle, Provenance, Ratio};
use meltpath_deposition::process_map::{Bead, ProcessMap};
use meltpath_planning::{
    ContourOrder, FillSettings, LineAngle, LineDirection, LineOrder, Paces, StartPoints, Strategy,
};

use super::bead::PER_MINUTE;
use crate::job::waam::{FillOrder, FillStrategy, FillTable, Spacing, Speeds, Starts};
use crate::job::{Problems, WaamJob, Written};

/// How layers are filled by a bead at a stepover, mm.
pub(super) fn filled(
    job: &Written<WaamJob>,
    (bead, step): (&Bead, f64),
    map: &ProcessMap,
    r: &mut Provenance,
) -> Result<FillSettings, Problems> {
    let mut fill = FillSettings::new(bead.width.value, step);
    let known = map.validity.travel_speed;
    fill.paces = paces(r, &job.fill, bead.travel_speed, known);
    fill.reversal = reversal(r, &job.fill, fill.paces);
    let fill = fill_settings(r, &job.fill, fill);
    fill.check().map_err(|e| Problem::new(e.to_string()))?;
    Ok(fill)
}

/// How layers are filled with the bead of `bead`, as the job's table says.
fn fill_settings(r: &mut Provenance, table: &FillTable, bead: FillSettings) -> FillSettings {
    let strategy = *table.strategy;
    let quarter = if strategy == FillStrategy::Raster {
        0.0
    } else {
        std::f64::consts::FRAC_PI_2
    };
    let angle = match (*table.angle, *table.turn) {
        // a raster keeps the direction with the fewest lines; zigzags cross from layer to layer, so that gaps and reversals do
        // not stack
        (None, None) if strategy == FillStrategy::Raster => LineAngle::Best,
        _ => LineAngle::Turning {
            first: table.angle.or_computed(r, Angle(0.0)).0,
            step: table.turn.or_computed(r, Angle(quarter)).0,
        },
    };
    let contour_order = match *table.order {
        Some(FillOrder::OutsideIn) => ContourOrder::OutsideIn,
        _ => ContourOrder::InsideOut,
    };
    let planned = match strategy {
        FillStrategy::Raster => Strategy::Raster {
            angle,
            order: if *table.order == Some(FillOrder::CentreOut) {
                LineOrder::CentreOut
            } else {
                LineOrder::Across
            },
            direction: match *table.order {
                Some(FillOrder::OneWay) => LineDirection::OneWay,
                Some(FillOrder::AlternateBeads) => LineDirection::AlternatePerBead,
                _ => LineDirection::AlternatePerLayer,
            },
        },
        FillStrategy::Zigzag => Strategy::Zigzag { angle },
        FillStrategy::Contour => Strategy::Contour {
            order: contour_order,
        },
        FillStrategy::Spiral => Strategy::Spiral {
            order: contour_order,
        },
        // contours last: between finished contours the last line would pile up
        FillStrategy::Hybrid => Strategy::Hybrid {
            contours: *table.contours,
            order: contour_order,
            angle,
        },
    };
    FillSettings {
        strategy: planned,
        spacing: match *table.spacing {
            Spacing::Adjust => meltpath_planning::Spacing::Fill,
            Spacing::Exact => meltpath_planning::Spacing::Exact,
        },
        starts: match *table.starts {
            Starts::Spread => StartPoints::Spread,
            Starts::Aligned => StartPoints::Aligned,
        },
        ..bead
    }
}

/// The speeds that beads may take, about the nominal one, mm/s, within those (m/min) of which the process map knows beads.
fn paces(r: &mut Provenance, table: &FillTable, nominal: f64, known: (f64, f64)) -> Option<Paces> {
    let usual = match *table.strategy {
        FillStrategy::Hybrid | FillStrategy::Zigzag => Speeds::Adapted,
        FillStrategy::Raster | FillStrategy::Contour | FillStrategy::Spiral => Speeds::Constant,
    };
    let known = (known.0 / PER_MINUTE, known.1 / PER_MINUTE);
    match table.speeds.or_computed(r, usual) {
        Speeds::Adapted => Some(Paces::about(nominal, known)),
        Speeds::Constant => None,
    }
}

/// Distance from a contour at which a zigzag turns back, stepovers.
fn reversal(r: &mut Provenance, table: &FillTable, paces: Option<Paces>) -> f64 {
    let usual = match paces {
        Some(_) => FillSettings::NEAR_REVERSAL,
        None => FillSettings::BALANCED_REVERSAL,
    };
    table.reversal.or_computed(r, Ratio(usual)).0
}
