//! A wall on a surface, planned, written, driven, laid and judged.

use meltpath_base::{Check, Fact, Observer, Reporter};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::VoxelsError;
use meltpath_planning::surface::SurfacePoint;
use meltpath_programs::TextFile;
use meltpath_robot::Summary;
use meltpath_robot::collision::Metal;

use super::grow::{Grown, drive};
use super::plan::{SurfacePlan, plan};
use super::{Asked, judge, metal};
use crate::stages::sheet::{self, Sheet};
use crate::waam::drive::columns;
use crate::waam::drive::film::Film;
use crate::waam::drive::reach;
use crate::waam::drive::record::Sample;
use crate::waam::error::WaamError;
use crate::waam::judge::checks::{borrowed_check, fixed_torch_check, planned, range_check};
use crate::waam::loaded::{Loaded, written};
use crate::waam::plan::planned::read_back;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Everything about a wall on a surface.
pub(crate) struct Wall {
    pub(crate) sheet: Sheet,
    pub(crate) plan: SurfacePlan,
    pub(crate) commands: Commands,
    pub(crate) samples: Vec<Sample>,
    /// Its metal, or why there is no room for it.
    pub(crate) grown: Result<Grown, VoxelsError>,
    pub(super) summary: Summary,
    pub(super) files: Vec<TextFile>,
    pub(super) checks: Vec<Check>,
    pub(super) facts: Vec<Fact>,
    /// What is shown of the robot.
    pub(super) film: Film,
}

/// The surface of a job, read and placed.
pub(in crate::waam) fn load_sheet(
    loaded: &Loaded,
    asked: &Asked,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Sheet, WaamError> {
    let settings = &loaded.settings;
    let how = sheet::How {
        unit: settings.part_unit,
        up: settings.up,
        chord_error: settings.chord_error,
        faces: asked.faces.as_deref(),
    };
    Ok(sheet::load(&settings.part, how, reporter, observer)?)
}

/// Plans, writes, drives and judges.
pub(super) fn wall(
    loaded: &Loaded,
    asked: &Asked,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Wall, WaamError> {
    let settings = &loaded.settings;
    let sheet = load_sheet(loaded, asked, reporter, observer)?;
    observer.stage("plan", 0);
    let mut plan = plan(&sheet, asked, settings)?;
    observer.check()?;
    let told = (reporter, observer);
    let (programs, commands) = read_back(&loaded.name, &mut plan.toolpath, settings, told)?;
    let driven = drive(&commands, &plan, settings, reporter, observer)?;
    observer.stage("robot", 0);
    let columns = columns(&plan, settings)?;
    let along = reach::along(&programs.parsed, &commands, settings, &columns, observer);
    observer.check()?;
    let turned = reach::turned(along.as_ref(), &commands);
    let mut checks = judge::checks(&plan, asked, settings, turned.as_ref());
    checks.extend(metal::checks(
        &driven.grown,
        (&plan, asked),
        &commands,
        settings,
    ));
    checks.extend(borrowed_check(settings));
    checks.extend(range_check(planned(&plan.toolpath), settings));
    let (files, check) = written(loaded, &plan.toolpath, (&programs, &commands), observer)?;
    checks.push(check);
    checks.extend(reach::checks(along.as_ref(), &commands, settings));
    checks.extend(fixed_torch_check(settings));
    let mut facts = judge::facts(&plan, asked, settings, &driven.summary, turned.as_ref());
    if let Ok(grown) = &driven.grown {
        facts.extend(metal::facts(grown, asked, &commands, settings));
    }
    facts.extend(reach::facts(along.as_ref(), &commands, settings));
    Ok(Wall {
        sheet,
        plan,
        commands,
        samples: driven.samples,
        grown: driven.grown,
        summary: driven.summary,
        files,
        checks,
        facts,
        film: reach::film(along),
    })
}

/// The wall as it has grown after each pass, in columns that reach down to the plate: no less than its metal.
fn columns(plan: &SurfacePlan, settings: &Settings) -> Result<Vec<(u32, Metal)>, WaamError> {
    if settings.robot.as_ref().is_none_or(|r| r.shapes.is_none()) {
        return Ok(Vec::new());
    }
    let half = 0.5 * settings.bead.width.value;
    // a wall that leans reaches over its middle by half of its thickness
    let top = |p: &SurfacePoint| p.position + half * p.normal.z.abs() * DVec3::Z;
    let pairs = plan.passes.iter().flat_map(|p| {
        let pairs = p.points.windows(2);
        pairs.map(|pair| (p.number, [top(&pair[0]), top(&pair[1])]))
    });
    Ok(columns::columns(&pairs.collect::<Vec<_>>(), (half, 0.0))?)
}
