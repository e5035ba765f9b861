//! Layers that are not flat, planned, written, driven, laid and judged.

use std::path::{Path, PathBuf};

use meltpath_base::{Check, Fact, Observer, Reporter};
use meltpath_geometry::Mesh;
use meltpath_geometry::workpiece::VoxelsError;
use meltpath_programs::TextFile;
use meltpath_robot::Summary;

use super::ground::stands;
use super::grow::{Grown, drive};
use super::layers::plan_layers;
use super::pieces::{OntoMeshes, OntoPart};
use super::plan::{SurfacePlan, plan_wall};
use super::{Asked, Shape, WallAsked, held, judge, metal};
use crate::stages::onto::{self, Onto};
use crate::stages::part::Part;
use crate::stages::sheet::{self, Sheet};
use crate::waam::drive::expected::expected;
use crate::waam::drive::film::Film;
use crate::waam::drive::lean;
use crate::waam::drive::reach;
use crate::waam::drive::record::Sample;
use crate::waam::drive::said_frames::undecided;
use crate::waam::drive::site::Site;
use crate::waam::drive::solids::Standing;
use crate::waam::error::WaamError;
use crate::waam::judge::checks::{
    borrowed_check, fixed_torch_check, heat_check, planned, range_check, tool_check,
};
use crate::waam::loaded::{Loaded, written};
use crate::waam::plan::planned::read_back;
use crate::waam::program::Commands;

/// What is laid, with its plan.
pub(crate) struct Placed {
    /// The file's name.
    pub(crate) name: String,
    /// The surface, or the part, in the build.
    pub(crate) mesh: Mesh,
    /// What was found in the files, in words.
    pub(crate) findings: Vec<String>,
    pub(crate) plan: SurfacePlan,
    /// What stands there before anything is laid.
    pub(crate) standing: Standing,
}

/// Everything about layers that are not flat.
pub(crate) struct Wall {
    pub(crate) name: String,
    pub(crate) mesh: Mesh,
    pub(crate) findings: Vec<String>,
    pub(crate) plan: SurfacePlan,
    /// What stands there before anything is laid.
    pub(crate) standing: Standing,
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

/// The files of a job, read and placed.
enum Read<'a> {
    Wall(Sheet, &'a WallAsked),
    Onto(Onto),
}

fn read<'a>(
    loaded: &Loaded,
    asked: &'a Asked,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Read<'a>, WaamError> {
    let settings = &loaded.settings;
    Ok(match &asked.shape {
        Shape::Wall(wall) => {
            let how = sheet::How {
                unit: settings.part_unit,
                up: settings.up,
                chord_error: settings.chord_error,
                faces: wall.faces.as_deref(),
            };
            let sheet = sheet::load(&settings.part, how, reporter, observer)?;
            Read::Wall(sheet, wall)
        }
        Shape::Onto(on) => {
            let how = onto::How {
                unit: settings.part_unit,
                up: settings.up,
                chord_error: settings.chord_error,
                top: on.faces(),
            };
            let parts = std::iter::once(&settings.part).chain(&on.then);
            let parts: Vec<&Path> = parts.map(PathBuf::as_path).collect();
            Read::Onto(onto::load(&parts, &on.body, how, reporter, observer)?)
        }
    })
}

/// What a job builds, with its name.
pub(in crate::waam) fn built(
    loaded: &Loaded,
    asked: &Asked,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(String, Mesh), WaamError> {
    Ok(match read(loaded, asked, reporter, observer)? {
        Read::Wall(sheet, _) => (sheet.name, sheet.mesh),
        Read::Onto(onto) => (onto.name(), onto.whole()),
    })
}

/// What a job lays, read, placed and planned.
pub(in crate::waam) fn placed(
    loaded: &Loaded,
    asked: &Asked,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Placed, WaamError> {
    let settings = &loaded.settings;
    let read = read(loaded, asked, reporter, observer)?;
    observer.stage("plan", 0);
    Ok(match read {
        Read::Wall(sheet, wall) => {
            let plan = plan_wall(&sheet, asked, (wall, settings))?;
            Placed {
                standing: stands(&plan, settings, &sheet.build_from_file),
                plan,
                name: sheet.name,
                mesh: sheet.mesh,
                findings: sheet.findings,
            }
        }
        Read::Onto(onto) => {
            let (name, mesh, findings) = (onto.name(), onto.whole(), onto.findings());
            let mut top = onto.top;
            let part = |part: Part| OntoPart {
                name: part.name,
                mesh: part.mesh,
                // faces are those of the first file
                top: top.take(),
            };
            let meshes = OntoMeshes {
                parts: onto.parts.into_iter().map(part).collect(),
                body: onto.body.mesh,
            };
            let plan = plan_layers(meshes, asked, settings, (reporter, observer))?;
            Placed {
                standing: stands(&plan, settings, &onto.build_from_file),
                plan,
                name,
                mesh,
                findings,
            }
        }
    })
}

/// Plans, writes, drives and judges.
pub(super) fn wall(
    loaded: &Loaded,
    asked: &Asked,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Wall, WaamError> {
    let settings = &loaded.settings;
    let Placed {
        name,
        mesh,
        findings,
        mut plan,
        standing,
    } = placed(loaded, asked, reporter, observer)?;
    observer.check()?;
    let told = (reporter, observer);
    let site = Site {
        settings,
        standing: Some(&standing),
    };
    let (programs, commands) = read_back(&loaded.name, &mut plan.toolpath, site, told)?;
    let driven = drive(&commands, &plan, settings, reporter, observer)?;
    observer.stage("robot", 0);
    let metal = expected(&commands, site);
    let along = reach::along(&programs.parsed, &commands, settings, &metal, observer);
    observer.check()?;
    let turned = reach::turned(along.as_ref(), &commands);
    let mut checks = judge::checks(&plan, asked, settings, turned.as_ref());
    if let (Some(_), Some(tilt)) = (&turned, checks.iter_mut().find(|c| c.id == lean::ID)) {
        *tilt = undecided(tilt.clone(), &commands.elsewhere);
    }
    let tilt = checks.iter_mut().find(|c| c.id == lean::ID);
    if let (Some(slope), Some(tilt)) = (&commands.slope, tilt) {
        *tilt = slope.undecided(tilt.clone());
    }
    checks.extend(metal::checks(&driven.grown, &plan, &commands, settings));
    checks.extend(borrowed_check(settings));
    checks.push(heat_check());
    checks.extend(range_check(planned(&plan.toolpath), settings));
    let written = written(
        loaded,
        &plan.toolpath,
        (&programs, &commands),
        (site, observer),
    )?;
    checks.push(written.check);
    let of_arm = reach::checks(along.as_ref(), (&programs.parsed, &commands), settings).into_iter();
    checks.extend(of_arm.map(|check| written.otherwise.undecided(check, settings)));
    checks.extend(held::checks(site, &commands));
    checks.extend(fixed_torch_check(&settings.dialects(), settings));
    checks.extend(tool_check(settings));
    let of_machine = (&driven.summary, driven.wire());
    let mut facts = judge::facts(&plan, asked, settings, of_machine, turned.as_ref());
    if let Ok(grown) = &driven.grown {
        facts.extend(metal::facts(grown, &plan, &commands, settings));
    }
    facts.extend(reach::facts(along.as_ref(), &commands, settings));
    Ok(Wall {
        name,
        mesh,
        findings,
        plan,
        standing,
        commands,
        samples: driven.samples,
        grown: driven.grown,
        summary: driven.summary,
        files: written.files,
        checks,
        facts,
        film: reach::film(along),
    })
}
