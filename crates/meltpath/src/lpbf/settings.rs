//! What a scan-head job means: head, plate and recipes, each value with its origin.

use std::path::Path;

use meltpath_base::settings::{Many, Problem, Setting, Value};
use meltpath_base::{Origin, Provenance, Ratio, Resolved, Speed, Time};
use meltpath_data::scan_heads;
use meltpath_scan_head::files::{self, HeadData};
use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::search::Bounds;

use super::heat::{self, HeatSettings};
use crate::data::{DataFileError, DataText};
use crate::job::lpbf::{ChecksTable, LpbfJob, OptimiseTable};
use crate::job::{Problems, Written};
use crate::tune::choose;

/// A resolved scan-head job.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The job: values that need no resolving are read there.
    pub job: LpbfJob,
    /// The head, and the reference plate it comes with.
    pub data: HeadData,
    /// The recipes, the one to compare with first.
    pub recipes: Vec<Recipe>,
    /// Axes whose controller was made for another motor.
    pub foreign: Vec<char>,
    /// The recipe search, where the job asks for one.
    pub search: Option<Bounds>,
    /// What the heat engine is told, where the job asks for it.
    pub heat: Option<HeatSettings>,
    /// Every value with its origin.
    pub provenance: Provenance,
}

/// The recipes that a job names: everything wrong with any of them is told.
fn recipes(job: &LpbfJob, folder: &Path) -> Result<Vec<Recipe>, Vec<Problem>> {
    let (mut recipes, mut problems) = (Vec::new(), Vec::new());
    for name in job.lpbf.recipes.iter() {
        let shipped = meltpath_data::recipes::ALL;
        let recipe = DataText::load("recipe", name.get_ref(), shipped, folder)
            .and_then(|text| text.read(files::parse_recipe));
        match recipe {
            Ok(recipe) => recipes.push(recipe),
            Err(DataFileError::Content(found)) => problems.extend(found.0),
            Err(error) => problems.push(Problem::new(error.to_string()).at(name.span())),
        }
    }
    if problems.is_empty() {
        Ok(recipes)
    } else {
        Err(problems)
    }
}

/// The head that a job or a tuning names.
///
/// # Errors
/// What is wrong with the name, or everything wrong in the file.
pub(crate) fn head_data(head: &Setting<String>, folder: &Path) -> Result<HeadData, Vec<Problem>> {
    DataText::load("scan head", head, scan_heads::ALL, folder)
        .and_then(|text| text.read(files::parse_head))
        .map_err(|e| e.at(head))
}

/// What is wrong with the files that a job names in tables of which no key is `wrong`.
pub(crate) fn named(
    job: &Written<LpbfJob>,
    folder: &Path,
    wrong: impl Fn(&str) -> bool,
) -> Vec<Problem> {
    if wrong("lpbf.") {
        return Vec::new();
    }
    let head = head_data(&job.lpbf.head, folder).err();
    let recipes = recipes(job, folder).err();
    head.into_iter().chain(recipes).flatten().collect()
}

/// Resolves a job written in `folder`: plain values; what is executed is planned from them.
///
/// # Errors
/// Everything wrong, with its place in the job.
pub fn resolve(job: &Written<LpbfJob>, folder: &Path) -> Result<Settings, Problems> {
    let mut r = job.provenance.clone();
    let head = &job.lpbf.head;
    let data = head_data(head, folder);
    let (mut data, recipes) = match (data, recipes(job, folder)) {
        (Ok(data), Ok(recipes)) => (data, recipes),
        (data, recipes) => {
            let mut problems = data.err().unwrap_or_default();
            problems.extend(recipes.err().unwrap_or_default());
            return Err(problems.into());
        }
    };
    let foreign = choose::apply(
        &mut data.head,
        &data.tuning,
        &job.lpbf.controller,
        &job.lpbf.prefilter,
        folder,
        &mut r,
    );
    r.model(
        "laser scan head",
        "Rasoanarivo 2020, chapter 2; heads and recipes from data files with their sources",
    );
    for recipe in &recipes {
        tell(recipe, &mut r);
    }
    let search = job
        .optimise
        .as_ref()
        .map(|table| bounds(table, &recipes[0], &job.checks, &mut r));
    let spot = 2.0 * data.head.beam.waist;
    let layer = job.section.layer.0;
    let heat = match &*job.heat {
        None => {
            r.parameters.remove(&job.checks.fusion.name);
            Ok(None)
        }
        Some(table) => {
            let (share, sizes) = (job.checks.fusion.0, [spot, layer]);
            heat::resolve(table, share, sizes, folder, &mut r).map(Some)
        }
    };
    let (foreign, heat) = match (foreign, heat) {
        (Ok(foreign), Ok(heat)) => (foreign, heat),
        (foreign, heat) => {
            let mut problems: Vec<Problem> = foreign.err().into_iter().collect();
            problems.extend(heat.err().unwrap_or_default().0);
            return Err(problems.into());
        }
    };
    Ok(Settings {
        job: (**job).clone(),
        heat,
        search,
        data,
        recipes,
        foreign,
        provenance: r,
    })
}

/// Notes what a recipe says.
fn tell(recipe: &Recipe, r: &mut Provenance) {
    let sky = recipe.sky_writing;
    let least = match recipe.power_law {
        PowerLaw::Constant => None,
        PowerLaw::WithSpeed { least } => Some(Ratio(least).json()),
    };
    for (key, value) in [
        ("contour_speed", Some(Speed(recipe.contour_speed).json())),
        ("fill_speed", Some(Speed(recipe.fill_speed).json())),
        (
            "contour_jump_speed",
            Some(Speed(recipe.contour_jump_speed).json()),
        ),
        (
            "fill_jump_speed",
            Some(Speed(recipe.fill_jump_speed).json()),
        ),
        ("mark_wait", Some(Time(recipe.mark_wait).json())),
        ("jump_wait", Some(Time(recipe.jump_wait).json())),
        ("polygon_wait", Some(Time(recipe.polygon_wait).json())),
        ("power_down_to", least),
        ("run_in", sky.map(|s| Time(s.run_in).json())),
        ("run_out", sky.map(|s| Time(s.run_out).json())),
    ] {
        if let Some(value) = value {
            let name = format!("recipe.{}.{key}", recipe.name);
            r.parameter(
                &name,
                &Resolved::new(value, Origin::Data(recipe.name.clone())),
            );
        }
    }
}

/// What a recipe search may change. A fill rate that nobody bounds is NaN: two points below the first recipe's own become the bound.
fn bounds(
    table: &OptimiseTable,
    recipe: &Recipe,
    checks: &ChecksTable,
    r: &mut Provenance,
) -> Bounds {
    let about = |own: f64| [Speed(0.5 * own), Speed(3.0 * own)];
    let wait = recipe.mark_wait;
    let waits = [0.0, wait / 3.0, 2.0 * wait / 3.0, wait].map(Time);
    let waits = table.mark_waits.or_computed(r, Many(waits.to_vec()));
    let mut mark_waits: Vec<f64> = waits.iter().map(|t| t.0).collect();
    mark_waits.dedup();
    let factors = |list: &[Ratio]| list.iter().map(|f| f.0).collect();
    let speeds = |range: [Speed; 2]| range.map(|v| v.0);
    Bounds {
        contour_speed: speeds(
            table
                .contour_speed
                .or_computed(r, about(recipe.contour_speed)),
        ),
        fill_speed: speeds(table.fill_speed.or_computed(r, about(recipe.fill_speed))),
        mark_waits,
        jump_factors: factors(&table.jump_factors),
        filter_factors: factors(&table.filter_factors),
        contour_error: checks.contour_error.0,
        contour_share: checks.contour_share.0,
        fill_rate: table
            .fill_rate
            .or(*checks.fill_rate)
            .map_or(f64::NAN, |r| r.0),
    }
}
