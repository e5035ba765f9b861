//! What a simulated build tells beside its checks.

use meltpath_base::{Fact, Measure};
use meltpath_robot::Summary;

use crate::job::waam::LayerRelease;
use crate::waam::deposit::simulate::Simulation;
use crate::waam::deposit::tube;
use crate::waam::judge::checks::{programmed, wire_used};
use crate::waam::judge::{LayerOutcome, energy};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// What the simulated build tells: size, wire, energy, times.
pub(crate) fn build_facts(
    simulation: &Simulation,
    commands: &Commands,
    settings: &Settings,
) -> Vec<Fact> {
    let exact = |id, title, value, unit| Fact::new(id, title, Measure::exact(value, unit), "");
    let mut facts = vec![
        exact("layers", "layers", simulation.layers.len() as f64, ""),
        exact(
            "height-built",
            "highest place",
            simulation.deposit.map.maximum(),
            "mm",
        ),
        exact("arc-starts", "arc starts", simulation.arc_starts as f64, ""),
        Fact::new(
            "wire-mass",
            "wire used",
            wire_used(simulation.deposit.wire, settings),
            &format!(
                "{:.1} m of {}",
                simulation.deposit.wire / 1000.0,
                *settings.wire.name
            ),
        ),
        wire_feed(simulation, commands, settings),
        energy::of_arc(simulation, commands, settings),
    ];
    facts.extend(times(&simulation.summary, settings));
    let distances = simulation.ctwd.iter().map(|p| p.at.distance).collect();
    facts.extend(tube::distribution(&simulation.layers, distances));
    facts.extend(energy::of_layers(simulation, commands, settings));
    facts
}

/// How long a program takes.
pub(crate) fn times(summary: &Summary, settings: &Settings) -> Vec<Fact> {
    let minutes =
        |id, title, seconds: f64| Fact::new(id, title, Measure::exact(seconds / 60.0, "min"), "");
    vec![
        minutes("time-arc", "time with arc", summary.arc_time),
        minutes("time-travel", "time of travels", summary.travel_time),
        waited(
            minutes("time-pause", "time of pauses", summary.pause_time),
            settings,
        ),
        waited(
            minutes("time-total", "time in all", summary.total_time),
            settings,
        ),
    ]
}

/// A time of a program; what it waits for an input is not in it.
pub(crate) fn waited(time: Fact, settings: &Settings) -> Fact {
    match settings.until {
        LayerRelease::Cooled => Fact {
            reason: "without what it waits until layers have cooled".to_owned(),
            ..time
        },
        LayerRelease::Pause => time,
    }
}

/// Wire feed as delivered, layer by layer: the source answers to the contact tube distance.
fn wire_feed(simulation: &Simulation, commands: &Commands, settings: &Settings) -> Fact {
    const PER_MINUTE: f64 = 0.06;
    let feed = |l: &&LayerOutcome| PER_MINUTE * l.wire / l.arc_time;
    let fed = || simulation.layers.iter().filter(|l| l.arc_time > 0.0);
    let total: f64 = fed().map(|l| l.wire).sum();
    let time: f64 = fed().map(|l| l.arc_time).sum();
    let mean = if time > 0.0 {
        PER_MINUTE * total / time
    } else {
        0.0
    };
    let (least, greatest) = fed()
        .map(|l| feed(&l))
        .fold((f64::MAX, f64::MIN), |(a, b), f| (a.min(f), b.max(f)));
    let (slowest, fastest) = programmed(commands, settings)
        .map(|s| PER_MINUTE * s.wire_feed)
        .fold((f64::MAX, f64::MIN), |(a, b), f| (a.min(f), b.max(f)));
    // what differs in no digit that is shown is one feed
    let asked = match [slowest, fastest].map(|f| format!("{f:.2}")) {
        [slow, fast] if slow == fast => slow,
        [slow, fast] => format!("{slow} to {fast}"),
    };
    let why = match settings.deposit.feed_response {
        Some(r) => format!(
            "the source feeds {:.1} % less per mm of contact tube distance lost",
            100.0 * r.slope
        ),
        None => "the same at any contact tube distance".to_owned(),
    };
    Fact::new(
        "wire-feed",
        "wire feed delivered, mean",
        Measure::exact(mean, "m/min"),
        &format!("{least:.2} to {greatest:.2} over the layers, {asked} programmed: {why}"),
    )
}
