//! What a scan-head job executes: a plate of squares, or layers read from a file of other software.

use std::path::Path;

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_programs::{cli, vectors};
use meltpath_scan_head::head::job::{Given, JobBuilder, Recipe, ScanJob, ScanJobError, VectorKind};
use meltpath_scan_head::plate::SquarePlate;
use meltpath_toolpath::{Profile, Toolpath};

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
    source: Source,
    /// Positions of the chosen layers in the file, from 0.
    chosen: Vec<usize>,
    /// The point of the file that lies at the centre of the field, mm.
    origin: DVec2,
    /// Hatch distance, mm, where the job says it.
    pub hatch: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
enum Source {
    Cli(cli::LayerFile),
    Vectors(Vec<vectors::Layer>),
}

/// A layer within a job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerSpan {
    /// Its first vector.
    pub first: u32,
    /// Its number in the file, from 1; 1 for a plate.
    pub number: u32,
    /// Its height, mm.
    pub height: f64,
}

/// A job of one recipe with its layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// The vectors.
    pub job: ScanJob,
    /// The layers, first executed first.
    pub layers: Vec<LayerSpan>,
}

impl Source {
    fn count(&self) -> usize {
        match self {
            Source::Cli(file) => file.layers.len(),
            Source::Vectors(layers) => layers.len(),
        }
    }

    fn number(&self, k: usize) -> u32 {
        match self {
            Source::Cli(_) => k as u32 + 1,
            Source::Vectors(layers) => layers[k].number,
        }
    }

    /// Length of the marks of a layer, mm.
    fn marked(&self, k: usize) -> f64 {
        match self {
            Source::Cli(file) => file.layers[k]
                .items
                .iter()
                .map(|item| match item {
                    cli::Item::Polyline { points, .. } => {
                        points.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>()
                    }
                    cli::Item::Hatches { lines, .. } => {
                        lines.iter().map(|[a, b]| a.distance(*b)).sum()
                    }
                })
                .sum(),
            Source::Vectors(layers) => layers[k]
                .vectors
                .windows(2)
                .filter(|w| matches!(w[1].kind, vectors::Kind::Contour | vectors::Kind::Fill))
                .map(|w| w[0].end.distance(w[1].end))
                .sum(),
        }
    }
}

/// Reads a layer file (`.cli`) or vector list (`.csv`) and chooses its layers. What is wrong comes back in words.
///
/// # Errors
/// A message that names the file, the place in it and what to write.
pub fn read(path: &Path, shown: &str, table: &LayersTable) -> Result<LayerSet, String> {
    let bytes = std::fs::read(path)
        .map_err(|e| format!("cannot read the layers {}: {e}", path.display()))?;
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let source = match extension.as_str() {
        "cli" => Source::Cli(cli::parse(&bytes).map_err(|e| format!("\"{shown}\": {e}"))?),
        "csv" => {
            let text = String::from_utf8(bytes)
                .map_err(|_| format!("\"{shown}\" is not text in UTF-8: export it as such"))?;
            Source::Vectors(vectors::parse(&text).map_err(|e| format!("\"{shown}\": {e}"))?)
        }
        other => {
            return Err(format!(
                "\"{shown}\" ends in \"{other}\": layers are read from .cli files and from vector lists (.csv)"
            ));
        }
    };
    let count = source.count();
    let marked: Vec<f64> = (0..count).map(|k| source.marked(k)).collect();
    let longest = (0..count)
        .max_by(|&a, &b| marked[a].total_cmp(&marked[b]).then(b.cmp(&a)))
        .filter(|&k| marked[k] > 0.0)
        .ok_or_else(|| format!("\"{shown}\" marks nothing in any of its {count} layers"))?;
    let chosen: Vec<usize> = match table.range {
        None => vec![longest],
        Some([first, last]) => (0..count)
            .filter(|&k| (first..=last).contains(&source.number(k)) && marked[k] > 0.0)
            .collect(),
    };
    if chosen.is_empty() {
        let [first, last] = table.range.unwrap_or_default();
        return Err(format!(
            "none of the layers {first} to {last} of \"{shown}\" marks anything; it holds the layers {} to {}",
            source.number(0),
            source.number(count - 1)
        ));
    }
    Ok(LayerSet {
        file: shown.to_owned(),
        chosen,
        origin: table
            .origin
            .map_or(DVec2::ZERO, |o| DVec2::from_array(o.map(|l| l.0))),
        hatch: table.hatch.map(|h| h.0.0),
        source,
    })
}

impl LayerSet {
    /// Layers that are executed and layers of the file.
    pub fn counts(&self) -> (usize, usize) {
        (self.chosen.len(), self.source.count())
    }

    /// The numbers of the first and last layer that are executed.
    pub fn numbers(&self) -> (u32, u32) {
        let at = |k: Option<&usize>| k.map_or(0, |&k| self.source.number(k));
        (at(self.chosen.first()), at(self.chosen.last()))
    }

    fn job(&self, recipe: &Recipe) -> Result<Prepared, ScanJobError> {
        let origin = self.origin.extend(0.0);
        let paths: Vec<Toolpath> = match &self.source {
            Source::Cli(file) => self
                .chosen
                .iter()
                .map(|&k| self.toolpath(file, k))
                .collect(),
            Source::Vectors(_) => Vec::new(),
        };
        let start = match &self.source {
            Source::Cli(_) => paths
                .first()
                .and_then(|t| t.passes.first())
                .map_or(DVec3::ZERO, |p| p.points[0]),
            Source::Vectors(layers) => layers[self.chosen[0]].vectors[0].end - origin,
        };
        let mut builder = JobBuilder::new(recipe, start);
        let mut spans = Vec::with_capacity(self.chosen.len());
        for (n, &k) in self.chosen.iter().enumerate() {
            let first = builder.count() as u32;
            let height = match &self.source {
                Source::Cli(file) => {
                    let path = &paths[n];
                    // even where it stands there already: light never lasts from layer to layer
                    if n > 0
                        && let Some(pass) = path.passes.first()
                    {
                        builder.vector(VectorKind::Jump, pass.points[0], Given::default());
                    }
                    builder.passes(path);
                    file.layers[k].height
                }
                Source::Vectors(layers) => {
                    let layer = &layers[k];
                    for v in layer.vectors.iter().skip(usize::from(n == 0)) {
                        builder.block(v.part);
                        let given = Given {
                            speed: v.speed,
                            power: v.power,
                            wait: v.wait,
                        };
                        builder.vector(kind(v.kind), v.end - origin, given);
                    }
                    layer.height
                }
            };
            spans.push(LayerSpan {
                first,
                number: self.source.number(k),
                height,
            });
        }
        Ok(Prepared {
            job: builder.finish()?,
            layers: spans,
        })
    }

    /// The passes of a layer in the plane of the field: the platform goes down, the focus stays.
    fn toolpath(&self, file: &cli::LayerFile, k: usize) -> Toolpath {
        let one = cli::LayerFile {
            labels: Vec::new(),
            layers: vec![cli::Layer {
                height: 0.0,
                items: file.layers[k].items.clone(),
            }],
        };
        let mut path = one.to_toolpath(Profile::default(), Profile::default());
        let origin = self.origin.extend(0.0);
        path.passes.retain(|p| p.points.len() > 1);
        for pass in &mut path.passes {
            for point in &mut pass.points {
                *point -= origin;
            }
        }
        path
    }
}

fn kind(kind: vectors::Kind) -> VectorKind {
    match kind {
        vectors::Kind::Start | vectors::Kind::Jump => VectorKind::Jump,
        vectors::Kind::Contour => VectorKind::Contour,
        vectors::Kind::Fill => VectorKind::Fill,
        vectors::Kind::Connection => VectorKind::Connection,
        vectors::Kind::Run => VectorKind::Run,
    }
}

impl Work {
    /// The job of a recipe.
    ///
    /// # Errors
    /// [`ScanJobError`].
    pub fn job(&self, recipe: &Recipe) -> Result<Prepared, ScanJobError> {
        match self {
            Work::Plate(plate) => Ok(Prepared {
                job: plate.job(recipe)?,
                layers: vec![LayerSpan {
                    first: 0,
                    number: 1,
                    height: 0.0,
                }],
            }),
            Work::Layers(layers) => layers.job(recipe),
        }
    }

    /// The small job on which delays are tuned: two squares, or up to 4 s of the first layer round the start of its fill.
    ///
    /// # Errors
    /// [`ScanJobError`].
    pub fn tuning_job(&self, recipe: &Recipe) -> Result<ScanJob, ScanJobError> {
        match self {
            Work::Plate(plate) => SquarePlate {
                columns: 2,
                rows: 1,
                ..*plate
            }
            .job(recipe),
            Work::Layers(layers) => {
                let prepared = layers.job(recipe)?;
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
