//! The electric energy of the arc.

use meltpath_base::{Fact, Measure};

use crate::waam::deposit::simulate::Simulation;
use crate::waam::judge::LayerOutcome;
use crate::waam::judge::checks::{programmed, wire_sigma};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Means of voltage and current hold where their product is this near to the energy that beads had, in its standard uncertainties.
const FAR: f64 = 3.0;

/// A layer, and the energy per volume of wire with which it was laid, J/mm³.
type OfLayer<'a> = (&'a LayerOutcome, f64);

/// The energies of layers by the map's feed, voltage and current over the contact tube distance; `None` of a map without, else why nothing can
/// be said.
fn by_distance<'a>(
    simulation: &'a Simulation,
    commands: &Commands,
    settings: &Settings,
) -> Option<Result<Vec<OfLayer<'a>>, &'static str>> {
    let lines = settings.map.electric.as_ref()?.lines();
    if !programmed(commands, settings).all(|s| lines.of_feed(s.wire_feed)) {
        return Some(Err(
            "the map's voltage and current were measured at another wire feed",
        ));
    }
    let fed = simulation.layers.iter().filter(|l| l.arc_time > 0.0);
    let section = settings.wire.section();
    if let (None, Some(beads)) = (lines.power, &settings.energy) {
        let off = lines.energy(lines.reference, section) - beads.mean;
        if off.abs() > FAR * beads.sigma {
            return Some(Err(
                "the product of the map's mean voltage and mean current, where they were measured, is not the energy that beads had: of a pulsed arc it is too low (write `power` in [electric])",
            ));
        }
    }
    let known = |l: &'a LayerOutcome| {
        let distance = l.ctwd_mean;
        lines
            .covers(distance)
            .then(|| (l, lines.energy(distance, section)))
    };
    let all: Option<Vec<OfLayer<'a>>> = fed.map(known).collect();
    Some(all.ok_or(
        "the contact tube leaves the distances at which the map's voltage and current were measured",
    ))
}

/// Electric energy, as the energy per volume of wire fed follows the contact tube distance, layer by layer; where that is not known, from the
/// mean that was measured for the transfer mode, whose uncertainty it has either way.
pub(super) fn of_arc(simulation: &Simulation, commands: &Commands, settings: &Settings) -> Fact {
    const ID: &str = "energy";
    const TITLE: &str = "electric energy of the arc";
    let Some(per_volume) = &settings.energy else {
        let words = format!(
            "cannot say: no energy per volume was measured on {} in mode {}",
            *settings.wire.name, settings.mode
        );
        return Fact::words(ID, TITLE, &words);
    };
    let by_distance = by_distance(simulation, commands, settings).and_then(Result::ok);
    let of_layers = by_distance.and_then(|layers| {
        let wire: f64 = layers.iter().map(|(l, _)| l.wire).sum();
        let spent: f64 = layers.iter().map(|(l, energy)| l.wire * energy).sum();
        (wire > 0.0).then(|| spent / wire)
    });
    let known = format!("{} J/mm³ of wire ({})", per_volume.mean, per_volume.source);
    let (per, words) = match of_layers {
        Some(mean) => (
            mean,
            format!("at {mean:.1} J/mm³ of wire by its contact tube distances; beads had {known}"),
        ),
        None => (per_volume.mean, format!("at {known}")),
    };
    let volume = simulation.deposit.wire * settings.wire.section();
    let mean = per * volume * 1e-6;
    let share = (per_volume.sigma / per_volume.mean).hypot(wire_sigma(settings));
    Fact::new(ID, TITLE, Measure::new(mean, mean * share, "MJ"), &words)
}

/// How the energy per volume changes with the contact tube distance from the first layer to the last, where the process map holds voltage
/// and current over the distance at the wire feed that is set.
pub(super) fn of_layers(
    simulation: &Simulation,
    commands: &Commands,
    settings: &Settings,
) -> Option<Fact> {
    const ID: &str = "energy-per-volume";
    const TITLE: &str = "electric energy per volume of wire, first and last layer";
    let layers = match by_distance(simulation, commands, settings)? {
        Ok(layers) => layers,
        Err(why) => return Some(Fact::words(ID, TITLE, &format!("cannot say: {why}"))),
    };
    let last = layers.last().filter(|_| layers.len() > 1);
    let told = |(layer, energy): &OfLayer<'_>| {
        let (number, distance) = (layer.layer, layer.ctwd_mean);
        format!("{energy:.1} J/mm³ in layer {number} at {distance:.1} mm")
    };
    let words: Vec<String> = [Some(layers.first()?), last]
        .into_iter()
        .flatten()
        .map(told)
        .collect();
    let words = format!(
        "{}: by the map's feed, voltage and current over the distance",
        words.join(", ")
    );
    Some(Fact::words(ID, TITLE, &words))
}
