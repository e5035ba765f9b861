//! What a scan-head job means: head, plate and recipes, each value with its origin.

use std::path::Path;

use meltpath_base::{Origin, Provenance, Resolved};
use meltpath_machine::scan_head::data::{self, HeadData, HeadFileError};
use meltpath_machine::scan_head::job::Recipe;
use meltpath_machine::scan_head::plate::SquarePlate;
use toml::Spanned;

use crate::job::TextError;
use crate::job::lpbf::{DelayChoice, LpbfJob, PathChoice, PlateExtent};

/// The heads that ship: name and file.
pub const HEADS: &[(&str, &str)] = &[
    (
        "two-axis-150",
        include_str!("../../../../data/scan-heads/two-axis-150.toml"),
    ),
    (
        "three-axis-350",
        include_str!("../../../../data/scan-heads/three-axis-350.toml"),
    ),
];

/// The recipes that ship: name and file.
pub const RECIPES: &[(&str, &str)] = &[
    (
        "industrial",
        include_str!("../../../../data/recipes/industrial.toml"),
    ),
    (
        "uniform",
        include_str!("../../../../data/recipes/uniform.toml"),
    ),
    (
        "doubled",
        include_str!("../../../../data/recipes/doubled.toml"),
    ),
];

/// A resolved scan-head job.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The head, and the reference plate it comes with.
    pub data: HeadData,
    /// The squares that are run.
    pub plate: SquarePlate,
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
    /// Every value with its origin.
    pub provenance: Provenance,
}

/// The text of a data file: one that ships, or the user's own.
pub(crate) fn data_text(
    what: &str,
    name: &Spanned<String>,
    shipped: &[(&str, &str)],
    folder: &Path,
) -> Result<String, TextError> {
    let failed = |message: String| TextError {
        span: Some(name.span()),
        message,
        help: None,
    };
    let wanted = name.get_ref().as_str();
    if let Some((_, text)) = shipped.iter().find(|(n, _)| *n == wanted) {
        return Ok((*text).to_owned());
    }
    if crate::data::is_file(wanted) {
        let path = folder.join(wanted);
        return std::fs::read_to_string(&path)
            .map_err(|e| failed(format!("cannot read the {what} {}: {e}", path.display())));
    }
    let known: Vec<_> = shipped.iter().map(|(n, _)| format!("\"{n}\"")).collect();
    Err(failed(format!(
        "there is no {what} \"{wanted}\"; known are {}; or name a TOML file of your own",
        known.join(", ")
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
    let mut data =
        data::parse(&data_text("scan head", head_name, HEADS, folder)?).map_err(at(head_name))?;
    let mut recipes = Vec::with_capacity(job.lpbf.recipes.len());
    for name in &job.lpbf.recipes {
        let recipe =
            data::parse_recipe(&data_text("recipe", name, RECIPES, folder)?).map_err(at(name))?;
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
    let mut plate = data.plate;
    if job.plate.extent == PlateExtent::Block {
        [plate.columns, plate.rows] = job.plate.block.unwrap_or([2, 2]);
    }
    plate.side = job.plate.side.map_or(plate.side, |s| s.0.0);
    plate.hatch = job.plate.hatch.map_or(plate.hatch, |h| h.0.0);
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
    tell(
        "plate.columns",
        plate.columns.into(),
        origin(job.plate.block.is_some(), "a representative block of 2 x 2"),
    );
    tell(
        "plate.rows",
        plate.rows.into(),
        origin(job.plate.block.is_some(), "a representative block of 2 x 2"),
    );
    tell(
        "plate.side",
        plate.side.into(),
        origin(job.plate.side.is_some(), "the head's reference plate"),
    );
    tell(
        "plate.hatch",
        plate.hatch.into(),
        origin(job.plate.hatch.is_some(), "the head's reference plate"),
    );
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
    }
    Ok(Settings {
        data,
        plate,
        recipes,
        delays: job.lpbf.delays,
        contour_error,
        contour_share,
        fill_rate: c.fill_rate.map(|r| r.0.0),
        foreign,
        path,
        provenance,
    })
}
