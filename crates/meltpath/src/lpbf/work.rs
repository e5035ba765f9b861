//! What a scan-head job executes: a plate of squares, or layers read from a file of other software.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use meltpath_geometry::math::DVec2;
use meltpath_planning::powder::plate::{PlateError, SquarePlate};
use meltpath_programs::{cli, vectors};
use meltpath_scan_head::head::job::{Prepared, prepare};
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::vector::{ScanJob, ScanJobError, VectorKind};
use meltpath_toolpath::Layer;

use crate::job::lpbf::LayersTable;

/// Longest piece of a layer on which delays are tuned, s of machine.
const TUNED_TIME: f64 = 4.0;

/// What is executed.
#[derive(Debug, Clone, PartialEq)]
pub enum Work {
    /// Squares.
    Plate(SquarePlate),
    /// Layers of a file.
    Layers(LayerSet),
}

/// The layers of a file that are executed.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerSet {
    /// The file, as the job names it.
    pub file: String,
    /// Those that are executed; what the job puts at the centre of the field lies at zero.
    layers: Vec<Layer>,
    /// Layers of the file.
    count: usize,
    /// Hatch distance, mm, where the job says it.
    pub hatch: Option<f64>,
}

/// The layers of a file, one after the other; what is wrong in words.
fn layers(path: &Path) -> Result<Box<dyn Iterator<Item = Result<Layer, String>>>, String> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let from = File::open(path).map_err(|e| format!("cannot read the layers: {e}"))?;
    let from = BufReader::new(from);
    match extension.as_str() {
        "cli" => {
            let layers = cli::Reader::new(from).map_err(|e| e.to_string())?;
            Ok(Box::new(layers.map(|l| l.map_err(|e| e.to_string()))))
        }
        "csv" => {
            let layers = vectors::Reader::new(from).map_err(|e| e.to_string())?;
            Ok(Box::new(layers.map(|l| l.map_err(|e| e.to_string()))))
        }
        other => Err(format!(
            "it ends in \"{other}\": layers are read from .cli files and from vector lists (.csv)"
        )),
    }
}

/// Reads a layer file (`.cli`) or vector list (`.csv`) and chooses its layers, one layer in memory at a time and those that are
/// chosen. What is wrong comes back in words.
///
/// # Errors
/// A message that names the file, the place in it and what to write.
pub fn read(path: &Path, shown: &str, table: &LayersTable) -> Result<LayerSet, String> {
    let named = |what: String| format!("\"{shown}\": {what}");
    let (mut count, mut longest) = (0, 0.0);
    let mut numbers: Option<(u32, u32)> = None;
    let mut chosen: Vec<Layer> = Vec::new();
    for layer in layers(path).map_err(named)? {
        let layer = layer.map_err(named)?;
        count += 1;
        numbers = Some((numbers.map_or(layer.number, |n| n.0), layer.number));
        let marked = layer.deposited_length();
        match *table.range {
            None if marked > longest => chosen = vec![layer],
            Some([first, last]) if marked > 0.0 && (first..=last).contains(&layer.number) => {
                chosen.push(layer);
            }
            _ => {}
        }
        longest = marked.max(longest);
    }
    if longest <= 0.0 {
        return Err(format!(
            "\"{shown}\" marks nothing in any of its {count} layers"
        ));
    }
    if chosen.is_empty() {
        let [first, last] = table.range.unwrap_or_default();
        let (lowest, highest) = numbers.unwrap_or_default();
        return Err(format!(
            "none of the layers {first} to {last} of \"{shown}\" marks anything; it holds the layers {lowest} to {highest}"
        ));
    }
    let origin = DVec2::from_array(table.origin.map(|l| l.0)).extend(0.0);
    for layer in &mut chosen {
        layer.translate(-origin);
    }
    Ok(LayerSet {
        file: shown.to_owned(),
        layers: chosen,
        count,
        hatch: table.hatch.map(|h| h.0),
    })
}

impl LayerSet {
    /// Layers that are executed and layers of the file.
    pub fn counts(&self) -> (usize, usize) {
        (self.layers.len(), self.count)
    }

    /// The numbers of the first and last layer that are executed.
    pub fn numbers(&self) -> (u32, u32) {
        let number = |layer: Option<&Layer>| layer.map_or(0, |l| l.number);
        (number(self.layers.first()), number(self.layers.last()))
    }
}

/// What a head makes of a plate.
fn of_plate(plate: &SquarePlate, recipe: &Recipe) -> Result<Prepared, ScanJobError> {
    let refused = |e: PlateError| ScanJobError::Value {
        what: e.what,
        value: e.value,
        wanted: e.wanted,
    };
    let path = plate.toolpath().map_err(refused)?;
    prepare(&path.layers, recipe)
}

impl Work {
    /// The job of a recipe.
    ///
    /// # Errors
    /// [`ScanJobError`].
    pub fn job(&self, recipe: &Recipe) -> Result<Prepared, ScanJobError> {
        match self {
            Work::Plate(plate) => of_plate(plate, recipe),
            Work::Layers(set) => prepare(&set.layers, recipe),
        }
    }

    /// The small job on which delays are tuned: two squares, or up to 4 s of the first layer round the start of its fill.
    ///
    /// # Errors
    /// [`ScanJobError`].
    pub fn tuning_job(&self, recipe: &Recipe) -> Result<ScanJob, ScanJobError> {
        match self {
            Work::Plate(plate) => {
                let two = SquarePlate {
                    columns: 2,
                    rows: 1,
                    ..*plate
                };
                of_plate(&two, recipe).map(|p| p.job)
            }
            Work::Layers(set) => {
                let prepared = prepare(&set.layers, recipe)?;
                let until = prepared
                    .layers
                    .get(1)
                    .map_or(prepared.job.vectors.len(), |l| l.first as usize);
                let job = prepared.job.slice(0..until);
                Ok(round_the_fill(job))
            }
        }
    }

    /// What is executed, in words.
    pub fn words(&self) -> String {
        match self {
            Work::Plate(plate) => format!(
                "{} squares of {} mm · hatch {} mm",
                plate.squares(),
                plate.side,
                plate.hatch
            ),
            Work::Layers(layers) => {
                let (first, last) = layers.numbers();
                let (chosen, all) = layers.counts();
                if chosen == 1 {
                    format!("layer {first} of {all} of {}", layers.file)
                } else {
                    format!(
                        "{chosen} layers of {all}, {first} to {last}, of {}",
                        layers.file
                    )
                }
            }
        }
    }
}

/// At most [`TUNED_TIME`] of a job, half of it before the first fill.
fn round_the_fill(job: ScanJob) -> ScanJob {
    let time = |i: usize| job.length_of(i) / job.vectors[i].speed + job.vectors[i].wait;
    let fill = job.vectors.iter().position(|v| v.kind == VectorKind::Fill);
    let middle = fill.unwrap_or(0);
    let (mut from, mut before) = (middle, 0.0);
    while from > 0 && before < 0.5 * TUNED_TIME {
        from -= 1;
        before += time(from);
    }
    let (mut to, mut all) = (middle, before);
    while to < job.vectors.len() && all < TUNED_TIME {
        all += time(to);
        to += 1;
    }
    let piece = job.slice(from..to);
    if piece.vectors.iter().any(|v| v.kind.is_mark()) {
        piece
    } else {
        job
    }
}
