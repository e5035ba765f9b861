//! The operator's sheet: what to set, what to check, in which order things happen.

use meltpath_programs::Dialect;
use meltpath_report::sheet::{OperatorSheet, Setting};
use meltpath_report::table::{Cell, Table};
use meltpath_robot::cell::Arrangement;

use crate::job::waam::LayerRelease;
use crate::waam::deposit::simulate::Simulation;
use crate::waam::judge::checks::wire_used;
use crate::waam::settings::Settings;

/// m/min per mm/s.
const PER_MINUTE: f64 = 0.06;

/// The sheet of a build.
pub fn operator_sheet(
    settings: &Settings,
    simulation: &Simulation,
    programs: &[String],
) -> OperatorSheet {
    let bead = &settings.bead;
    let cell = &settings.cell.program;
    let main = programs.first().map_or("", String::as_str);
    let (lo, hi) = simulation.deposit.map.bounds();
    let plate = settings.plate.map_or_else(
        || {
            format!(
                "at least {:.0} x {:.0} x {:.0} mm",
                (hi - lo).x,
                (hi - lo).y,
                settings.plate_thickness
            )
        },
        |[l, w]| format!("{l:.0} x {w:.0} x {:.0} mm", settings.plate_thickness),
    );
    let mass = wire_used(simulation.deposit.wire, settings).value;
    OperatorSheet {
        settings: vec![
            Setting::new(
                "Wire",
                &format!("{}, {}", *settings.wire.name, *settings.wire.standard),
                &format!("{mass:.2} kg are used"),
            ),
            Setting::new(
                "Gas",
                &settings.gas.name,
                &format!("{:.0} L/min", settings.gas.flow.0),
            ),
            Setting::new(
                "Transfer mode",
                &settings.mode.to_uppercase(),
                "synergy of this wire, at the source",
            ),
            Setting::new(
                "Wire feed (WFS)",
                &format!("{:.2} m/min", bead.wire_feed * PER_MINUTE),
                "programmed, at the source; it cannot change while the arc burns",
            ),
            Setting::new(
                "Travel speed (TS)",
                &format!("{:.3} m/min", bead.travel_speed * PER_MINUTE),
                "in the program",
            ),
            Setting::new(
                "Contact tube to work (CTWD)",
                &format!("{:.1} mm", settings.ctwd),
                "at the first layer: the tool frame ends at the wire's tip",
            ),
            Setting::new(
                "Smoothing",
                &smoothing(settings),
                "in the program",
            ),
            Setting::new(
                "User frame, tool frame",
                &format!("UF {}, UT {}", *cell.user_frame, *cell.tool_frame),
                &format!("the part's origin on the plate's surface; {}", tool(settings)),
            ),
            Setting::new(
                "Plate",
                &plate,
                "clamped, its top at z = 0 of the user frame",
            ),
            Setting::new(
                "Main program",
                main,
                &format!("{} program files in all", programs.len()),
            ),
        ],
        before: [
            "Plate clean, clamped, earthed",
            "User frame and tool frame checked against the sheet",
            "CONFIG of the first position checked at the controller",
            match settings.robot {
                Some(_) => "Dry run without arc at low speed: cables and fixtures are not checked by meltpath",
                None => "Dry run without arc at low speed: reach and collisions are not checked by meltpath",
            },
            "Gas flow, wire on the spool, contact tube new",
        ]
        .map(str::to_owned)
        .to_vec(),
        order: order(settings, simulation),
        during: [
            "After layers 1, 2 and 5: measure the height and compare it with the table",
            "Contact tube distance within its limits; stop when it is not",
            "Start and end of beads: no lack, no heap",
        ]
        .map(str::to_owned)
        .to_vec(),
    }
}

/// What the tool frame holds: the turn about the wire counts where the program chooses it.
fn tool(settings: &Settings) -> String {
    let Some(robot) = &settings.robot else {
        return "the torch".to_owned();
    };
    let tip = robot.carrier_from_torch.then(robot.torch_from_wire_tip);
    let [x, y, z] = tip.position.to_array();
    let [w, p, r] = tip.wpr().to_array().map(f64::to_degrees);
    let what = match robot.arrangement {
        Arrangement::TorchOnRobot => "the torch in the flange",
        Arrangement::PartOnRobot => "the standing torch",
    };
    format!("{what}, x {x:.2} y {y:.2} z {z:.2} mm, W {w:.2} P {p:.2} R {r:.2} deg")
}

fn order(settings: &Settings, simulation: &Simulation) -> Table {
    let mut table = Table::new(
        "Order of layers",
        &[
            "layer",
            "beads",
            "arc time",
            "planned top (mm)",
            "predicted top (mm)",
            "CTWD (mm)",
            "pause after",
        ],
    );
    table.rows = simulation
        .layers
        .iter()
        .map(|l| {
            vec![
                Cell::Number(f64::from(l.layer)),
                Cell::Number(f64::from(l.beads)),
                Cell::Duration(l.arc_time),
                if l.planned_top.is_finite() {
                    Cell::Fixed(l.planned_top, 1)
                } else {
                    Cell::Empty
                },
                l.mean_top.map_or(Cell::Empty, |t| Cell::Fixed(t, 1)),
                Cell::Fixed(l.ctwd_mean, 1),
                if settings.until == LayerRelease::Cooled {
                    Cell::text(&format!("{:.0} s, then until cooled", settings.pause))
                } else if settings.pause > 0.0 {
                    Cell::Duration(settings.pause)
                } else {
                    Cell::text("none")
                },
            ]
        })
        .collect();
    table
}

/// Smoothing inside a bead, in the controller's words.
fn smoothing(settings: &Settings) -> String {
    match settings.cell.program.blend.as_ref() {
        Some(full) if settings.judged() != Dialect::FanucLs => {
            format!("{:.1} mm before corners", full.0 * settings.smoothing)
        }
        _ => format!("CNT{:.0}", 100.0 * settings.smoothing),
    }
}
