//! Whether what a body is built on stands where the job says, and its holders leave room for the beads.

use meltpath_base::{Check, Limit, Measure, Status};
use meltpath_geometry::distance::Union;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_robot::cell::{Arrangement, Cell, Table};

use crate::waam::drive::bead_pieces::{BeadPiece, pieces};
use crate::waam::drive::site::Site;
use crate::waam::drive::solids::Standing;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;
use crate::waam::settings::holder::Holder;

/// What lies no farther over the table stands on it, mm.
const STANDS: f64 = 0.5;
/// Rounding of a place, mm.
const SAME: f64 = 1e-6;
/// A place that is looked for is told to this, mm.
const TOLD: f64 = 1e-3;

/// The checks of what stands there; none where the job names no robot, or flat layers stand on their plate.
pub(in crate::waam) fn checks(site: Site<'_>, commands: &Commands) -> Vec<Check> {
    let settings = site.settings;
    let (Some(standing), Some(cell)) = (site.standing, &settings.robot) else {
        return Vec::new();
    };
    let holders = beside_beads(standing, commands, settings);
    on_table(standing, settings, cell)
        .into_iter()
        .chain(holders)
        .collect()
}

/// How the plate of flat layers lies on the table; `corners` are those of what it carries, mm in the part frame.
pub(in crate::waam) fn plate_on_table(corners: &[DVec2; 2], settings: &Settings) -> Option<Check> {
    let cell = settings.robot.as_ref()?;
    let [low, high] = *corners;
    let corners = [
        low,
        high,
        DVec2::new(low.x, high.y),
        DVec2::new(high.x, low.y),
    ];
    let (lowest, beyond) = over_table(
        &corners.map(|c| c.extend(-settings.plate_thickness)),
        settings,
        cell,
    )?;
    let check = standing_check("the plate: its lowest place over the table", lowest);
    let place = "a place on the table (machine.place: `meltpath reach` finds one), or the table's true size in the robot's file (shapes.table)";
    Some(match check.status {
        Status::Fail => check
            .because("it reaches into the table, and so do beads")
            .remedy("a place that much higher: machine.place"),
        _ if lowest > STANDS => Check {
            status: Status::CannotSay,
            ..check
        }
        .because(
            "nothing is named that holds it there, and what does is not looked at in collisions",
        )
        .remedy("a lower place: machine.place"),
        _ if beyond.middle > 0.0 => Check {
            status: Status::CannotSay,
            ..check
        }
        .because(&off_table(&beyond))
        .remedy(place),
        _ if beyond.farthest > STANDS => check.because(&over_edge(&beyond)),
        _ => check,
    })
}

/// The lowest of places in the part frame over the table, mm, the plate below them taken off, and how far those that stand on it lie beyond
/// its edge; `None` without a table, or where the part does not stand on one.
fn over_table(places: &[DVec3], settings: &Settings, cell: &Cell) -> Option<(f64, Beyond)> {
    let table = cell.shapes.as_ref()?.table?;
    if cell.arrangement != Arrangement::TorchOnRobot {
        return None;
    }
    let corners = || places.iter().map(|p| cell.carrier_from_part.point(*p));
    let bottom = corners().map(|p| p.z).fold(f64::INFINITY, f64::min);
    // the table begins under the plate
    let lowest = bottom + settings.plate_thickness;
    if !lowest.is_finite() {
        return None;
    }
    let lowest = if lowest.abs() < SAME { 0.0 } else { lowest };
    let feet = corners().filter(|p| p.z < bottom + STANDS);
    Some((lowest, beyond(feet.map(DVec3::truncate), &table)))
}

fn standing_check(title: &str, lowest: f64) -> Check {
    let measure = Measure::exact(lowest, "mm");
    Check::judge("standing", title, measure, Limit::AtLeast(0.0))
}

fn off_table(beyond: &Beyond) -> String {
    format!(
        "the middle of what stands on the table lies {:.0} mm beyond its edge: it would tip",
        beyond.middle
    )
}

fn over_edge(beyond: &Beyond) -> String {
    format!("it hangs {:.0} mm over the table's edge", beyond.farthest)
}

/// How high the lowest of what stands there lies over the table.
fn on_table(standing: &Standing, settings: &Settings, cell: &Cell) -> Option<Check> {
    let all = standing.meshes.iter().flat_map(|m| &m.vertices);
    let places: Vec<DVec3> = all.copied().collect();
    let (lowest, beyond) = over_table(&places, settings, cell)?;
    let check = standing_check(
        "what the part is built on: its lowest place over the table",
        lowest,
    );
    Some(match check.status {
        Status::Fail => check
            .because("it reaches into the table")
            .remedy("a place that much higher (machine.place), or shorter machine.holders"),
        _ if lowest > STANDS => Check {
            status: Status::CannotSay,
            ..check
        }
        .because(
            "nothing is named that holds it there, and what does is not looked at in collisions",
        )
        .remedy("what holds it, as machine.holders; or a lower place (machine.place)"),
        _ if beyond.middle > 0.0 => Check {
            status: Status::CannotSay,
            ..check
        }
        .because(&off_table(&beyond))
        .remedy("a place on the table (machine.place: `meltpath reach` finds one), or its true size in the robot's file (shapes.table)"),
        _ if !standing
            .holders
            .iter()
            .all(|h| holds(h, standing, 0.5 * settings.bead.width.value)) => Check {
            status: Status::CannotSay,
            ..check
        }
        .because("a holder touches nothing of the part or the body: what holds them is not named")
        .remedy("machine.holders that reach the body"),
        _ if beyond.farthest > STANDS => check.because(&over_edge(&beyond)),
        _ => check,
    })
}

/// How far the middle of what stands on a table, and its farthest place, lie beyond the edge, mm; below zero inside.
struct Beyond {
    middle: f64,
    farthest: f64,
}

fn beyond(feet: impl Iterator<Item = DVec2>, table: &Table) -> Beyond {
    let half = 0.5 * DVec2::from_array(table.size);
    let edge = |p: DVec2| (p.abs() - half).max_element();
    let none = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    let [low, high] = feet.fold(none, |[low, high], p| [low.min(p), high.max(p)]);
    Beyond {
        middle: edge(0.5 * (low + high)),
        farthest: edge(low).max(edge(high)),
    }
}

/// Whether a holder comes within `near` mm of something beside holders: a cylinder's length beyond its beads is not known. Along its axis
/// it is looked at in steps.
fn holds(holder: &Holder, standing: &Standing, near: f64) -> bool {
    const STEPS: u32 = 64;
    // the meshes of holders come last, one each
    let others = standing.meshes.len().saturating_sub(standing.holders.len());
    let held = Union::new(&standing.meshes[..others]);
    let [a, b] = holder.ends;
    (0..=STEPS).any(|k| {
        let p = a.lerp(b, f64::from(k) / f64::from(STEPS));
        let foot = held.foot(p);
        foot.is_some_and(|foot| holder.to_point(foot.point) < near)
    })
}

/// How far holders stay away from beads.
fn beside_beads(standing: &Standing, commands: &Commands, settings: &Settings) -> Option<Check> {
    if standing.holders.is_empty() {
        return None;
    }
    let half = 0.5 * settings.bead.width.value;
    let nearest = |piece: BeadPiece| {
        let each = standing.holders.iter().map(|h| nearest(h, piece.ends));
        let least = each.min_by(|a, b| a.0.total_cmp(&b.0));
        least.map(|(distance, at)| (distance - half, at, piece.command))
    };
    let all = pieces(commands).filter_map(nearest);
    let (least, at, command) = all.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let check = Check::judge(
        "holders",
        "what holds the part: its least distance from a bead",
        Measure::exact(least, "mm"),
        Limit::AtLeast(0.0),
    );
    let check = check.at(commands.place(command, rounded(at)));
    Some(match check.status {
        Status::Fail => check
            .because("metal would be laid into what holds the part")
            .remedy("shorter or slimmer machine.holders, or elsewhere"),
        _ => check,
    })
}

/// A place without the digits that looking for it leaves.
fn rounded(p: DVec3) -> DVec3 {
    // adding zero takes the sign from a zero
    (p / TOLD).round() * TOLD + 0.0
}

/// The least distance of a straight line from a holder, mm, and where on the line: along it the distance is convex, so that thirds find it.
fn nearest(holder: &Holder, [a, b]: [DVec3; 2]) -> (f64, DVec3) {
    const THIRDS: u32 = 40;
    let at = |t: f64| holder.to_point(a.lerp(b, t));
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..THIRDS {
        let third = (high - low) / 3.0;
        if at(low + third) <= at(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    let ends = [0.0, 1.0].map(|t| (at(t), t));
    let middle = 0.5 * (low + high);
    let nearest = ends.into_iter().fold((at(middle), middle), |least, end| {
        if end.0 < least.0 { end } else { least }
    });
    (nearest.0, a.lerp(b, nearest.1))
}
