//! What a scan-head job means: head, plate and recipes, each value with its origin.

use std::path::Path;

use meltpath_base::quantity::Positive;
use meltpath_base::{Origin, Provenance, Ratio, Resolved, Speed};
use meltpath_data::{File, find, names, recipes, scan_heads};
use meltpath_planning::powder::plate::SquarePlate;
use meltpath_scan_head::files::{self, HeadData, HeadFileError, Plate};
use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::search::Bounds;
use toml::Spanned;

use super::heat::{self, HeatSettings};
use super::work::{self, Work};
use crate::job::TextError;
use crate::job::lpbf::{
    DelayChoice, LpbfChecksTable, LpbfJob, MotionForm, OptimiseTable, PathChoice, PlateExtent,
};

/// A resolved scan-head job.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The head, and the reference plate it comes with.
    pub data: HeadData,
    /// What is run.
    pub work: Work,
    /// The recipes, the one to compare with first.
    pub recipes: Vec<Recipe>,
    /// Which delays.
    pub delays: DelayChoice,
    /// Contour error that counts as good, mm.
    pub contour_error: f64,
    /// Least share of contour points within it.
    pub contour_share: f64,
    /// Least fill rate.
    pub fill_rate: Option<f64>,
    /// Axes whose controller was made for another motor.
    pub foreign: Vec<char>,
    /// What is made of the path being known ahead.
    pub path: PathChoice,
    /// The recipe search, where the job asks for one.
    pub search: Option<Bounds>,
    /// The form in which whole marked paths are written.
    pub motion: Option<MotionForm>,
    /// What the heat engine is told, where the job asks for it.
    pub heat: Option<HeatSettings>,
    /// Every value with its origin.
    pub provenance: Provenance,
}

/// The text of a data file: one that ships, or the user's own.
pub(crate) fn data_text(
    what: &str,
    name: &Spanned<String>,
    shipped: &'static [File],
    folder: &Path,
) -> Result<String, TextError> {
    let failed = |message: String| TextError {
        span: Some(name.span()),
        message,
        help: None,
    };
    let wanted = name.get_ref().as_str();
    if let Some(file) = find(shipped, wanted) {
        return Ok(file.text.to_owned());
    }
    if crate::data::is_file(wanted) {
        let path = folder.join(wanted);
        return std::fs::read_to_string(&path)
            .map_err(|e| failed(format!("cannot read the {what} {}: {e}", path.display())));
    }
    Err(failed(format!(
        "there is no {what} \"{wanted}\"; known are {}; or name a TOML file of your own",
        names(shipped)
    )))
}

/// Resolves a job written in `folder`.
///
/// # Errors
/// [`TextError`] with the place in the job.
pub fn resolve(job: &LpbfJob, folder: &Path) -> Result<Settings, TextError> {
    let at = |name: &Spanned<String>| {
        let span = name.span();
        let shown = name.get_ref().clone();
        move |e: HeadFileError| TextError {
            span: Some(span),
            message: format!("\"{shown}\" is not sound: {e}"),
            help: None,
        }
    };
    let head_name = &job.lpbf.head;
    let mut data = files::parse_head(&data_text("scan head", head_name, scan_heads::ALL, folder)?)
        .map_err(at(head_name))?;
    let mut recipes = Vec::with_capacity(job.lpbf.recipes.len());
    for name in &job.lpbf.recipes {
        let recipe = files::parse_recipe(&data_text("recipe", name, recipes::ALL, folder)?)
            .map_err(at(name))?;
        recipe.check().map_err(|e| TextError {
            span: Some(name.span()),
            message: format!("\"{}\" is not sound: {e}", name.get_ref()),
            help: None,
        })?;
        recipes.push(recipe);
    }
    let mut provenance = Provenance::new();
    let foreign = crate::tune::choose::apply(
        &mut data.head,
        &data.tuning,
        job.lpbf.controller.as_ref(),
        job.lpbf.prefilter,
        folder,
        &mut provenance,
    )?;
    let path = provenance.written_or(
        "lpbf.path",
        (job.lpbf.path != PathChoice::default()).then_some(job.lpbf.path),
        PathChoice::default(),
        "set-points go out as they come",
    );
    provenance.model(
        "laser scan head",
        "Rasoanarivo 2020, chapter 2; heads and recipes from data files with their sources",
    );
    let work = match &job.lpbf.layers {
        Some(name) => {
            let path = folder.join(name.get_ref());
            let read = work::read(&path, name.get_ref(), &job.layers);
            Work::Layers(read.map_err(|message| TextError {
                span: Some(name.span()),
                message,
                help: None,
            })?)
        }
        None => Work::Plate(plate(job, data.plate)),
    };
    let origin = |written: bool, default: &str| {
        if written {
            Origin::Job
        } else {
            Origin::Default(default.to_owned())
        }
    };
    let c = &job.checks;
    let contour_error = c.contour_error.map_or(0.03, |l| l.0.0);
    let contour_share = c.contour_share.map_or(0.95, |r| r.0.0);
    let mut tell = |name: &str, value: serde_json::Value, origin: Origin| {
        provenance.parameter(name, &Resolved::new(value, origin));
    };
    tell("lpbf.head", data.head.name.clone().into(), Origin::Job);
    tell(
        "lpbf.delays",
        format!("{:?}", job.lpbf.delays).to_lowercase().into(),
        origin(
            job.lpbf.delays != DelayChoice::default(),
            "tuned on two squares",
        ),
    );
    match &work {
        Work::Plate(plate) => {
            let block = || {
                origin(
                    job.plate.block.is_some() || job.plate.extent == PlateExtent::Whole,
                    "a representative block of 2 x 2",
                )
            };
            let reference = |written| origin(written, "the head's reference plate");
            tell("plate.columns", plate.columns.into(), block());
            tell("plate.rows", plate.rows.into(), block());
            tell(
                "plate.side",
                plate.side.into(),
                reference(job.plate.side.is_some()),
            );
            tell(
                "plate.hatch",
                plate.hatch.into(),
                reference(job.plate.hatch.is_some()),
            );
        }
        Work::Layers(layers) => {
            let (first, last) = layers.numbers();
            tell("lpbf.layers", layers.file.clone().into(), Origin::Job);
            tell(
                "layers.range",
                vec![first, last].into(),
                origin(job.layers.range.is_some(), "the layer that marks most"),
            );
            let at = job.layers.origin.map_or([0.0; 2], |o| o.map(|l| l.0));
            tell(
                "layers.origin",
                at.to_vec().into(),
                origin(job.layers.origin.is_some(), "the file's own origin"),
            );
            if let Some(hatch) = layers.hatch {
                tell("layers.hatch", hatch.into(), Origin::Job);
            }
        }
    }
    tell(
        "checks.contour_error",
        contour_error.into(),
        origin(
            c.contour_error.is_some(),
            "30 µm: the accepted deviation of parts",
        ),
    );
    tell(
        "checks.contour_share",
        contour_share.into(),
        origin(c.contour_share.is_some(), "95 %"),
    );
    for r in &recipes {
        for (key, value) in [
            ("contour_speed", r.contour_speed),
            ("fill_speed", r.fill_speed),
            ("contour_jump_speed", r.contour_jump_speed),
            ("fill_jump_speed", r.fill_jump_speed),
            ("mark_wait", r.mark_wait),
            ("jump_wait", r.jump_wait),
            ("polygon_wait", r.polygon_wait),
        ] {
            tell(
                &format!("recipe.{}.{key}", r.name),
                value.into(),
                Origin::Data(r.name.clone()),
            );
        }
        let sky = r.sky_writing;
        for (key, value) in [
            (
                "power_down_to",
                match r.power_law {
                    PowerLaw::Constant => None,
                    PowerLaw::WithSpeed { least } => Some(least),
                },
            ),
            ("run_in", sky.map(|s| s.run_in)),
            ("run_out", sky.map(|s| s.run_out)),
        ] {
            if let Some(value) = value {
                tell(
                    &format!("recipe.{}.{key}", r.name),
                    value.into(),
                    Origin::Data(r.name.clone()),
                );
            }
        }
    }
    let search = job
        .optimise
        .as_ref()
        .map(|table| bounds(table, &recipes[0], contour_error, contour_share, c));
    if let Some(b) = &search {
        let written = |written: bool, default: &str| origin(written, default);
        let o = job.optimise.as_ref();
        let given = |has: fn(&OptimiseTable) -> bool| o.is_some_and(has);
        for (name, value, origin) in [
            (
                "contour_speed",
                b.contour_speed.to_vec(),
                written(
                    given(|o| o.contour_speed.is_some()),
                    "half to three times the recipe's",
                ),
            ),
            (
                "fill_speed",
                b.fill_speed.to_vec(),
                written(
                    given(|o| o.fill_speed.is_some()),
                    "half to three times the recipe's",
                ),
            ),
            (
                "mark_waits",
                b.mark_waits.clone(),
                written(
                    given(|o| o.mark_waits.is_some()),
                    "none to all of the recipe's",
                ),
            ),
            (
                "jump_factors",
                b.jump_factors.clone(),
                written(given(|o| o.jump_factors.is_some()), "up to twice"),
            ),
            (
                "filter_factors",
                b.filter_factors.clone(),
                written(given(|o| o.filter_factors.is_some()), "whole and half"),
            ),
        ] {
            tell(&format!("optimise.{name}"), value.into(), origin);
        }
    }
    let heat = match &job.heat {
        None => None,
        Some(table) => Some(heat::resolve(
            table,
            c.fusion.map(|r| r.0.0),
            2.0 * data.head.beam.waist,
            folder,
            &mut provenance,
        )?),
    };
    Ok(Settings {
        heat,
        search,
        data,
        work,
        recipes,
        delays: job.lpbf.delays,
        contour_error,
        contour_share,
        fill_rate: c.fill_rate.map(|r| r.0.0),
        foreign,
        path,
        motion: job.output.motion,
        provenance,
    })
}

/// What a recipe search may change. A fill rate that nobody bounds is NaN: two points below the first recipe's own become the bound.
fn bounds(
    table: &OptimiseTable,
    recipe: &Recipe,
    contour_error: f64,
    contour_share: f64,
    checks: &LpbfChecksTable,
) -> Bounds {
    let range = |given: Option<[Positive<Speed>; 2]>, own: f64| {
        given.map_or([0.5 * own, 3.0 * own], |r| r.map(|v| v.0.0))
    };
    let factors = |given: &Option<Vec<Positive<Ratio>>>, default: &[f64]| {
        given
            .as_ref()
            .map_or_else(|| default.to_vec(), |l| l.iter().map(|f| f.0.0).collect())
    };
    let wait = recipe.mark_wait;
    let waits = || vec![0.0, wait / 3.0, 2.0 * wait / 3.0, wait];
    let mut mark_waits = table
        .mark_waits
        .as_ref()
        .map_or_else(waits, |l| l.iter().map(|t| t.0.0).collect());
    mark_waits.dedup();
    Bounds {
        contour_speed: range(table.contour_speed, recipe.contour_speed),
        fill_speed: range(table.fill_speed, recipe.fill_speed),
        mark_waits,
        jump_factors: factors(&table.jump_factors, &[1.0, 1.5, 2.0]),
        filter_factors: factors(&table.filter_factors, &[1.0, 0.5]),
        contour_error,
        contour_share,
        fill_rate: table
            .fill_rate
            .or(checks.fill_rate)
            .map_or(f64::NAN, |r| r.0.0),
    }
}

/// The squares that the job asks for, on the plate that the head's file states.
fn plate(job: &LpbfJob, stated: Plate) -> SquarePlate {
    let [columns, rows] = match job.plate.extent {
        PlateExtent::Block => job.plate.block.unwrap_or([2, 2]),
        PlateExtent::Whole => [stated.columns, stated.rows],
    };
    SquarePlate {
        columns,
        rows,
        column_pitch: stated.column_pitch,
        row_pitch: stated.row_pitch,
        side: job.plate.side.map_or(stated.side, |s| s.0.0),
        contour_distance: stated.contour_distance,
        hatch: job.plate.hatch.map_or(stated.hatch, |h| h.0.0),
        inset: stated.inset,
    }
}
