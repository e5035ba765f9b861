//! What a scan-head job executes: a plate of squares, layers of a file of other software, or layers of a part.

use std::borrow::Cow;

use meltpath_planning::powder::plate::{PlateError, SquarePlate};
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::job::{Planned, prepare, prepare_layers};
use meltpath_scan_head::head::prepared::Layers;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::vector::{ScanJob, ScanJobError};
use meltpath_scan_head::measures::fill_rate::{FillMode, FillRate};
use meltpath_scan_head::measures::outline::Outlines;

use crate::lpbf::plan::file_layers::FileLayers;
use crate::lpbf::plan::section::Section;
use meltpath_toolpath::Role;

/// Longest piece of a layer on which delays are tuned, s of machine.
const TUNED_TIME: f64 = 4.0;

/// What is executed.
#[derive(Debug, Clone, PartialEq)]
pub enum Work {
    /// Squares.
    Plate(SquarePlate),
    /// Layers.
    Layers(Box<LayerSet>),
}

/// Where layers come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A file of other software.
    File(FileLayers),
    /// A part.
    Part(Section),
}

/// The layers that are executed.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerSet {
    /// Their file, as the job names it.
    pub file: String,
    /// Where they come from.
    pub source: Source,
    /// Hatch distance, mm, where it is known.
    pub hatch: Option<f64>,
}

impl LayerSet {
    /// Layers that are executed and layers of the file or part.
    pub fn counts(&self) -> [usize; 2] {
        match &self.source {
            Source::File(file) => file.counts,
            Source::Part(part) => part.counts,
        }
    }

    /// The numbers of the first and last layer that are executed.
    pub fn numbers(&self) -> [u32; 2] {
        match &self.source {
            Source::File(file) => file.numbers,
            Source::Part(part) => part.numbers,
        }
    }
}

fn refused(e: &PlateError) -> ScanJobError {
    ScanJobError::Value {
        what: e.what,
        value: e.value,
        wanted: e.wanted,
    }
}

impl Work {
    /// The layers as they are planned, whatever the recipe, each made when it is asked for.
    ///
    /// # Errors
    /// [`HeadError`].
    pub(in crate::lpbf) fn planned(&self) -> Result<Planned<'_>, HeadError> {
        Ok(match self {
            Work::Plate(plate) => {
                let path = plate.toolpath().map_err(|e| refused(&e))?;
                Box::new(path.layers.into_iter().map(|l| Ok(Cow::Owned(l))))
            }
            Work::Layers(set) => match &set.source {
                Source::File(file) => file.layers()?,
                Source::Part(part) => part.layers(),
            },
        })
    }

    /// The layers of a recipe, each made when it is asked for.
    ///
    /// # Errors
    /// [`HeadError`].
    pub fn layers<'a>(&'a self, recipe: &'a Recipe) -> Result<Layers<'a>, HeadError> {
        Ok(prepare_layers(self.planned()?, recipe)?)
    }

    /// What measures how a spot of diameter `spot` mm fills it; `hatch` is the distance of lines, mm, where the layers do not say it.
    pub(in crate::lpbf) fn fill(&self, hatch: f64, spot: f64, modes: &[FillMode]) -> FillRate {
        match self {
            Work::Plate(plate) => FillRate::of_rectangles(plate.fill_areas(), spot, modes),
            Work::Layers(set) => {
                let outlines = match &set.source {
                    Source::File(_) => Outlines::OfContours { spot },
                    Source::Part(section) => section.outlines(),
                };
                FillRate::of_layers(set.hatch.unwrap_or(hatch), outlines, spot, modes)
            }
        }
    }

    /// What shapes the marks of a file and is not followed, in words.
    pub(in crate::lpbf) fn not_followed(&self) -> &[String] {
        match self {
            Work::Layers(set) => match &set.source {
                Source::File(file) => &file.not_followed,
                Source::Part(_) => &[],
            },
            Work::Plate(_) => &[],
        }
    }

    /// The small job on which delays are tuned: two squares, or up to 4 s of the first layer round the start of its fill.
    ///
    /// # Errors
    /// [`HeadError`].
    pub fn tuning_job(&self, recipe: &Recipe) -> Result<ScanJob, HeadError> {
        match self {
            Work::Plate(plate) => {
                let two = SquarePlate {
                    columns: 2,
                    rows: 1,
                    ..*plate
                };
                prepare(&two.toolpath().map_err(|e| refused(&e))?.layers, recipe)
            }
            Work::Layers(_) => {
                let first = self.layers(recipe)?.next();
                let first = first.ok_or(ScanJobError::Empty)??;
                Ok(round_the_fill(first.job))
            }
        }
    }

    /// Of the first layer of a job, what is shown and heated: the first square, or all of it.
    pub fn shown(&self, first: &ScanJob) -> ScanJob {
        match self {
            Work::Plate(_) => {
                let vectors = first.vectors.iter().take_while(|v| v.block == 0);
                first.slice(0..vectors.count())
            }
            Work::Layers(_) => first.clone(),
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
                let [first, last] = layers.numbers();
                let [chosen, all] = layers.counts();
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
    let fill = job.vectors.iter().position(|v| v.kind == Role::Fill);
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
    if piece.vectors.iter().any(|v| v.kind.deposits()) {
        piece
    } else {
        job
    }
}
