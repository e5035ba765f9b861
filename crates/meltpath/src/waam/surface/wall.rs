//! A wall on a surface, planned, written, driven, laid and judged.

use meltpath_base::{Check, Fact, Observer, Reporter};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::{HeightMap, VoxelsError};
use meltpath_programs::TextFile;
use meltpath_robot::Summary;
use meltpath_robot::collision::Metal;

use super::grow::{Grown, drive};
use super::plan::{SurfacePlan, plan};
use super::{Asked, judge, metal};
use crate::stages::sheet::{self, Sheet};
use crate::waam::checks::{borrowed_check, fixed_torch_check, planned, range_check};
use crate::waam::error::WaamError;
use crate::waam::film::Moment;
use crate::waam::loaded::{Loaded, written};
use crate::waam::program::{self, Commands};
use crate::waam::reach;
use crate::waam::record::Sample;
use crate::waam::settings::Settings;
use crate::waam::wanted::Wanted;

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
    /// The cell along the build; nothing where no robot is known.
    pub(super) moments: Vec<Moment>,
}

/// The surface of a job, read and placed.
pub(super) fn load_sheet(
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
    let plan = plan(&sheet, asked, settings)?;
    observer.check()?;
    let own = settings.cell.program.dialect.value;
    let programs = reach::write(
        &loaded.name,
        &plan.toolpath,
        (own, Wanted::WHOLE),
        settings,
        reporter,
    )?;
    let commands = program::commands(&programs.parsed, &programs.schedules, settings, reporter)?;
    let driven = drive(&commands, &plan, settings, reporter, observer)?;
    let mut checks = judge::checks(&plan, asked, settings);
    checks.extend(metal::checks(
        &driven.grown,
        (&plan, asked),
        &commands,
        settings,
    ));
    checks.extend(borrowed_check(settings));
    checks.extend(range_check(planned(&plan.toolpath), settings));
    let (files, check) = written(loaded, &plan.toolpath, &programs, &commands)?;
    checks.push(check);
    observer.stage("robot", 0);
    let columns = columns(&plan, settings)?;
    let along = reach::along(&programs.parsed, &commands, settings, &columns);
    checks.extend(reach::checks(along.as_ref(), &commands, settings));
    checks.extend(fixed_torch_check(settings));
    let mut facts = judge::facts(&plan, asked, settings, &driven.summary);
    if let Ok(grown) = &driven.grown {
        facts.extend(metal::facts(grown, asked, &commands, settings));
    }
    facts.extend(reach::facts(along.as_ref(), &commands));
    let moments = reach::moments(along.as_ref(), &driven.samples, &commands);
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
        moments,
    })
}

/// Side of the columns in which the wall stands for collisions, mm.
const COLUMN: f64 = 2.0;

/// The wall as it has grown after each pass, in columns that reach down to the plate: no less than its metal.
fn columns(plan: &SurfacePlan, settings: &Settings) -> Result<Vec<(u32, Metal)>, WaamError> {
    if settings.robot.as_ref().is_none_or(|r| r.shapes.is_none()) {
        return Ok(Vec::new());
    }
    let half = 0.5 * settings.bead.width.value;
    let points = || plan.passes.iter().flat_map(|p| &p.points);
    let (low, high) = points().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
        let p = p.position.truncate();
        (low.min(p), high.max(p))
    });
    let room = DVec2::splat(6.0 * half);
    let mut map = HeightMap::new(low - room, high + room, COLUMN, 0.0)?;
    let mut metal = Vec::new();
    for group in plan.passes.chunk_by(|a, b| a.number == b.number) {
        for pair in group.iter().flat_map(|p| p.points.windows(2)) {
            let [a, b] = [pair[0].position, pair[1].position];
            let steps = (a.distance(b) / (0.5 * COLUMN)).ceil().max(1.0) as u32;
            for i in 0..=steps {
                raise(&mut map, a.lerp(b, f64::from(i) / f64::from(steps)), half);
            }
        }
        metal.push((group[0].number, Metal::of(&map, COLUMN)));
    }
    Ok(metal)
}

/// Raises the cells within `radius` of a point to its height.
fn raise(map: &mut HeightMap, p: DVec3, radius: f64) {
    let at = |x: f64| (x / map.cell).floor().max(0.0) as usize;
    let near = p.truncate() - map.origin;
    let (x0, x1) = (at(near.x - radius), at(near.x + radius));
    let (y0, y1) = (at(near.y - radius), at(near.y + radius));
    for iy in y0..=y1.min(map.ny.saturating_sub(1)) {
        for ix in x0..=x1.min(map.nx.saturating_sub(1)) {
            let index = map.index(ix, iy);
            map.z[index] = map.z[index].max(p.z);
        }
    }
}
