//! What a plan is expected to fail, before program and machine: its beads as drawn, laid in coarse steps, and judged by the checks of
//! the run. The torch takes the time that the controller's dwells cost it, and its path is the plan's; ignition, corners cut by
//! smoothing and the program's roundings are left out. It never says "pass".

use std::fmt::Write as _;

use meltpath_base::{Check, Fact, Observer, Reporter, Status};
use meltpath_deposition::deposit::{self, Deposition, LayerRecord, Levelling, Mode};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_toolpath::{Channel, MotionBlock, MotionSink, Pass, Times};

use super::checks::{borrowed_check, overhang_check, plate_check};
use super::error::WaamError;
use super::judge::{LayerOutcome, TubePlace};
use super::metal::{self, Laid};
use super::plan::{Plan, PlanStageError};
use super::settings::Settings;
use super::simulate::{CtwdPoint, SimulateError, outcome};
use super::standing::Standing;
use crate::stages::part::Part;

/// Travel between two solutions of the pool, mm, and longest step along the path.
const STEP: f64 = 1.0;

/// The checks that the plan is expected to fail, or to be unable to tell; what is expected to pass or to come near its limit is not
/// among them.
pub(super) fn foretell(
    part: &Part,
    plan: &Plan,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Vec<Check>, WaamError> {
    observer.stage("foretell", 0);
    let coarse = Settings {
        deposit: deposit::Settings {
            mode: Mode::Build(Levelling {
                step: STEP,
                ..Levelling::default()
            }),
            stamp: STEP,
            ..settings.deposit
        },
        ..settings.clone()
    };
    let quiet = Reporter::new();
    let (layers, ctwd, map) = lay(plan, &coarse, observer)?;
    let laid = Laid {
        layers: &layers,
        ctwd: &ctwd,
        map: &map,
    };
    let mut checks = metal::checks(&laid, (part, plan), &coarse, (&quiet, observer))?;
    checks.extend(borrowed_check(settings));
    checks.push(overhang_check(plan, settings));
    checks.extend(plate_check(plan, settings));
    checks.retain(|c| matches!(c.status, Status::Fail | Status::CannotSay));
    Ok(checks)
}

/// The plan's beads, laid one after the other.
fn lay(
    plan: &Plan,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<(Vec<LayerOutcome>, Vec<CtwdPoint>, HeightMap), WaamError> {
    let map = plan.plate(settings)?;
    let planned = plan
        .planned_layers(&map, settings)
        .map_err(PlanStageError::Planar)?;
    let passes: Vec<Pass<'_>> = plan.toolpath.passes().collect();
    let (mut layers, mut ctwd) = (Vec::new(), Vec::new());
    let on_layer = |record: &LayerRecord, map: &HeightMap| {
        let plan = planned.iter().find(|p| p.layer == record.layer);
        let tube = record
            .tube
            .map(|ends| ends.map(|at| TubePlace { at, pass: None }));
        layers.push(LayerOutcome {
            tube,
            ..outcome(record, map, plan)
        });
        ctwd.extend(record.path.iter().map(|p| (p.time, p.ctwd)));
    };
    let mut deposition = Deposition::new(map, settings.bead_model, settings.pool, settings.deposit)
        .map_err(SimulateError::from)?
        .with_layers(passes.iter().map(|p| p.layer).collect())
        .on_layer(on_layer);
    let mut time = 0.0;
    for (number, pass) in passes.iter().enumerate() {
        observer.check()?;
        let block = motion(pass, number as u32, time, settings);
        time = block.time(block.len() - 1);
        deposition.block(&block);
    }
    let deposit = deposition.finish();
    Ok((layers, ctwd, deposit.map))
}

/// A pass as the torch would travel it without a machine: at the plan's speeds, standing where the machine stands. The wire of the
/// first sample is none: a bead begins.
fn motion(pass: &Pass<'_>, number: u32, start: f64, settings: &Settings) -> MotionBlock {
    let bead = &settings.bead_model;
    let nominal = settings.bead.travel_speed;
    let per_length = bead.area / (bead.wire_section * bead.efficiency);
    let mut block = MotionBlock::default();
    let mut times = Vec::new();
    let mut time = start;
    // a place, the length of bead fed since the place before
    let mut go = |at, fed: f64| {
        time += fed / nominal;
        times.push(time);
        block.position.push(at);
        block.wire.push(fed * per_length);
        block.command.push(number);
    };
    go(pass.points[0], 0.0);
    let standing = Standing::of(&settings.controller, settings.smoothing, nominal);
    let places = standing.places(pass);
    let mut stops = places.iter().peekable();
    let (points, along) = pass.flatten(0.05);
    let ends: Vec<(f64, f64)> = (0..pass.move_count())
        .scan(0.0, |end, i| {
            *end += pass.move_length(i);
            let speed = pass.value(Channel::Speed, i).unwrap_or(nominal);
            Some((*end, nominal / speed))
        })
        .collect();
    for (p, l) in points.windows(2).zip(along.windows(2)) {
        while let Some((_, stood)) = stops.next_if(|s| s.0 <= l[0] + 1e-6) {
            go(p[0], *stood);
        }
        let pieces = ((l[1] - l[0]) / STEP).ceil().max(1.0);
        let middle = 0.5 * (l[0] + l[1]);
        let of_move = ends.partition_point(|e| e.0 < middle);
        let slow = ends.get(of_move).map_or(1.0, |e| e.1);
        for k in 1..=pieces as u32 {
            let at = p[0].lerp(p[1], f64::from(k) / pieces);
            go(at, slow * (l[1] - l[0]) / pieces);
        }
    }
    let last = points.last().copied().unwrap_or(pass.points[0]);
    for (_, stood) in stops {
        go(last, *stood);
    }
    block.times = Times::Each(times);
    block
}

/// What was foretold, for the verdict.
pub(super) fn fact(foretold: &[Check]) -> Fact {
    let ids: Vec<&str> = foretold.iter().map(|c| c.id.as_str()).collect();
    let words = if ids.is_empty() {
        "no check".to_owned()
    } else {
        ids.join(", ")
    };
    Fact::words(
        "foretold",
        "expected from the plan to fail or to stay undecided",
        &words,
    )
}

/// A line for each check that is expected to fail or to be undecided.
pub(super) fn lines(foretold: &[Check]) -> Vec<String> {
    if foretold.is_empty() {
        return vec!["foretold: no check is expected to fail".to_owned()];
    }
    foretold.iter().map(line).collect()
}

fn line(check: &Check) -> String {
    let mut text = format!("foretold: {}: {}", check.status.words(), check.title);
    // the times in reasons are those of a program
    let (means, found) = match &check.value {
        Some(_) => (
            ", about ",
            Check {
                reason: String::new(),
                ..check.clone()
            },
        ),
        None => (": ", check.clone()),
    };
    text.push_str(means);
    text.push_str(&found.line());
    if let Some(place) = &check.place {
        // writing to a String cannot fail
        let _ = write!(text, " ({place})");
    }
    if let Some(remedy) = &check.remedy {
        text.push_str("; ");
        text.push_str(remedy);
    }
    text
}
