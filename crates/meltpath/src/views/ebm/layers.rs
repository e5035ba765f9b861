//! The heat of layers that stand on each other: what each is laid on, and where its heat goes.

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_melt_strategy::layer_heat::LayerHeat;
use meltpath_report::table::{Cell, Table};
use meltpath_thermal::material::CELSIUS;

use crate::ebm::simulate::Outcome;
use crate::views::write_csv;

/// The layers of the judge.
const LAYERS: &str = "series/layers-reference.csv";

/// The layers of the path that the run judges; none where it is one alone.
fn layers(outcome: &Outcome) -> Option<&[LayerHeat]> {
    let judged = outcome.judged.as_ref()?;
    let layers = &judged.better.as_ref().unwrap_or(&judged.given).layers;
    (layers.len() > 1).then_some(layers)
}

/// The table of the report.
pub(super) fn table(outcome: &Outcome) -> Option<Table> {
    let layers = layers(outcome)?;
    let table = Table::of(
        "Layer after layer",
        (1_u32..).zip(layers).map(|(number, layer)| {
            let heat = &layer.ledger;
            [
                ("layer", Cell::Fixed(f64::from(number), 0)),
                (
                    "laid on, in the mean (°C)",
                    Cell::Fixed(layer.before[0] - CELSIUS, 1),
                ),
                ("at most (°C)", Cell::Fixed(layer.before[1] - CELSIUS, 1)),
                ("from the beam (J)", Cell::Fixed(heat.absorbed, 2)),
                ("vapour (J)", Cell::Fixed(heat.evaporated, 2)),
                ("radiated (J)", Cell::Fixed(heat.radiated, 2)),
                ("conducted away (J)", Cell::Fixed(heat.conducted, 2)),
                ("stayed (J)", Cell::Fixed(heat.net(), 2)),
                (
                    "error of the heat (%)",
                    Cell::Fixed(100.0 * layer.residual, 4),
                ),
            ]
        }),
    );
    Some(table.noted("Run as set. What a layer is laid on: temperatures of the top within the extent of the paths before its powder lies there. Heat from the beginning of a layer's path to the beginning of the next one's, of the last layer to the end of its path. Where layers keep their heat a place radiates what it does above the start temperature."))
}

/// Writes them.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write(folder: &OutputFolder, outcome: &Outcome) -> Result<(), OutputError> {
    let Some(layers) = layers(outcome) else {
        return Ok(());
    };
    let of = |f: &dyn Fn(&LayerHeat) -> f64| layers.iter().map(f).collect::<Vec<f64>>();
    write_csv(
        folder,
        LAYERS,
        &[
            ("layer", "", (1..=layers.len()).map(|n| n as f64).collect()),
            ("mean_before", "°C", of(&|l| l.before[0] - CELSIUS)),
            ("highest_before", "°C", of(&|l| l.before[1] - CELSIUS)),
            ("absorbed", "J", of(&|l| l.ledger.absorbed)),
            ("evaporated", "J", of(&|l| l.ledger.evaporated)),
            ("radiated", "J", of(&|l| l.ledger.radiated)),
            ("conducted", "J", of(&|l| l.ledger.conducted)),
            ("stayed", "J", of(&|l| l.ledger.net())),
            ("error", "", of(&|l| l.residual)),
        ],
    )
}
