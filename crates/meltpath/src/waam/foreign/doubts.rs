//! What keeps the metal of a program whose plan may be unknown from being decided about.

use std::collections::BTreeMap;
use std::path::Path;

use meltpath_robot::command::Source;

use crate::waam::judge::doubt::{self, Doubt};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;
use crate::waam::surface::Shape;

/// Beads may begin so far from the plate, mm, before it is asked where the plate lies: a third of the usual distance of the contact tube.
const FROM_THE_PLATE: f64 = 5.0;

/// Everything that keeps the metal from being decided about.
pub(super) fn doubts(job: Option<&Path>, commands: &Commands, settings: &Settings) -> Vec<Doubt> {
    let all = [
        job.is_none().then(no_job),
        doubt::of_gaps(&commands.gaps),
        (!commands.weaves.is_empty()).then(doubt::of_weaves),
        settings
            .surface
            .as_ref()
            .map(|asked| of_surface(&asked.shape)),
        turning(commands),
        doubt::of_torch(commands),
        uneven(commands, settings),
        doubt::of_bead(settings),
        doubt::of_cells(settings),
    ];
    all.into_iter().flatten().collect()
}

/// Nobody says where the plate lies, and the beads begin far from where a plate at 0 would be.
pub(super) fn far_from_plate(commands: &Commands, settings: &Settings) -> Option<Doubt> {
    let laid = commands
        .commands
        .iter()
        .filter(|c| matches!(c.source, Source::On { .. }));
    let lowest = laid.map(|c| c.target.z).fold(f64::INFINITY, f64::min);
    let far = settings.plate_height.is_none() && lowest.abs() > FROM_THE_PLATE;
    far.then(|| Doubt {
        reason: format!(
            "the lowest bead lies at z = {lowest:.1} mm of its user frame, and nobody says where the plate lies: 0 mm was taken"
        ),
        remedy: "tell the height of the plate in the user frame: substrate.height".to_owned(),
    })
}

/// The model of the bead was measured on a part that lay still and level.
fn turning(commands: &Commands) -> Option<Doubt> {
    commands.turns.then(|| Doubt {
        reason: "a positioner turns the part: metal is laid in the frame of the part as if it lay level and still, as beads were measured".to_owned(),
        remedy: "compare what was laid with the surface that the report shows".to_owned(),
    })
}

/// A layer has one height, which beads that go up and down do not.
fn uneven(commands: &Commands, settings: &Settings) -> Option<Doubt> {
    let mut ends = BTreeMap::<u32, (f64, f64)>::new();
    let laid = commands.commands.iter().zip(&commands.layer_of_command);
    for (c, layer) in laid.filter(|(c, _)| matches!(c.source, Source::On { .. })) {
        let z = c.target.z;
        let (low, high) = ends.entry(*layer).or_insert((z, z));
        (*low, *high) = (low.min(z), high.max(z));
    }
    // a turn of a spiral rises by as much
    let least = settings.bead.height.value;
    let (layer, (low, high)) = ends
        .into_iter()
        .find(|(_, (low, high))| high - low > 1.01 * least)?;
    Some(Doubt {
        reason: format!(
            "the beads of layer {layer} lie between z = {low:.1} and {high:.1} mm: layers are judged by one height, and no bead on a slope was measured to hold the model to"
        ),
        remedy:
            "simulate level beads, or compare the surface that the report shows with what was laid"
                .to_owned(),
    })
}

/// Metal is laid in columns from the plate up here, which layers that are not flat do not stand on.
fn of_surface(shape: &Shape) -> Doubt {
    let [what, run] = match shape {
        Shape::Wall(_) => [
            "a wall along a surface",
            "run the job itself: that lays the wall along its surface",
        ],
        Shape::Onto(_) => [
            "layers on a body",
            "run the job itself: that lays the layers on their body",
        ],
    };
    Doubt {
        reason: format!(
            "the job builds {what}, and what is read is laid as if it stood on the plate: layers are judged by one height"
        ),
        remedy: run.to_owned(),
    }
}

/// Without a job nobody says which wire, gas and mode lay the metal.
fn no_job() -> Doubt {
    Doubt {
        reason: "wire, gas and mode are not known: no job was given, and those of a new job stand in for them".to_owned(),
        remedy: "name your job with --job".to_owned(),
    }
}
