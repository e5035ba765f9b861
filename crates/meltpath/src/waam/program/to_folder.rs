//! The programs of a plan by themselves, written into a folder.

use std::path::Path;

use meltpath_base::output::OutputFolder;
use meltpath_base::{Observer, Place, Reporter};
use meltpath_geometry::Mesh;
use meltpath_programs::{TextFile, laid_from};
use meltpath_toolpath::Toolpath;

use crate::waam::drive::division;
use crate::waam::drive::hold;
use crate::waam::drive::no_way;
use crate::waam::drive::site::Site;
use crate::waam::error::WaamError;
use crate::waam::loaded::{Loaded, load};
use crate::waam::plan::mend::settle;
use crate::waam::plan::other_job;
use crate::waam::program::wanted::{Torch, Wanted};
use crate::waam::program::{self, ProgramStageError, Programs, toolpath_file};
use crate::waam::run::{load_part, read_toolpath};
use crate::waam::settings::Settings;
use crate::waam::surface::wall;

/// Lengths laid that differ by less, in relation, are the same.
const SAME_LENGTH: f64 = 1e-3;

/// Programs that were written into a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrittenPrograms {
    /// The names of the files.
    pub files: Vec<String>,
    /// Whether the robot of the job holds the torch along all of them, as far as that was looked for; true where the job names none.
    pub held: bool,
}

/// Writes the programs of a plan, read back, into a new folder: in the dialects that the job asks for, else in the cell's own.
///
/// # Errors
/// [`WaamError`]; nothing is written then.
pub fn program_to_folder(
    job: &Path,
    toolpath: &Path,
    out: &Path,
    wanted: Wanted,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<WrittenPrograms, WaamError> {
    let mut loaded = load(job, reporter)?;
    let toolpath = read_toolpath(toolpath)?;
    // a surface is no part that beads reach as far as
    let part = match loaded.settings.surface {
        Some(_) => None,
        None => Some(load_part(&loaded, reporter, observer)?),
    };
    // the plan may have chosen how corners are smoothed
    let open = !loaded.job.machine.smoothing.is_written();
    if let Some(part) = part.as_ref().filter(|_| open) {
        settle(&mut loaded, part, &Reporter::new(), observer)?;
    }
    let settings = &loaded.settings;
    other_job::tell(&toolpath, part.as_ref(), settings, reporter);
    let standing = match &settings.surface {
        Some(asked) => {
            // what is to be told of it was told when it was planned
            let placed = wall::placed(&loaded, asked, &Reporter::new(), observer)?;
            Some(placed.standing)
        }
        None => None,
    };
    let site = Site {
        settings,
        standing: standing.as_ref(),
    };
    not_judged(settings, wanted, reporter);
    let mut files = Vec::new();
    let (mut way, mut held) = (None, true);
    for dialect in settings.dialects() {
        let programs = hold::write(
            &loaded.name,
            &toolpath,
            (dialect, wanted),
            site,
            way.as_ref(),
            (reporter, observer),
        )?;
        way = way.or_else(|| programs.chosen.way.clone());
        observer.check()?;
        faithful(&programs, &toolpath, wanted, settings)?;
        if let Some(told) = division::fact(&programs.chosen.divisions) {
            reporter.warn(
                "beads-whole",
                format!(
                    "no way of the robot holds the beads of this plan as they are: {}",
                    told.reason
                ),
                "plan anew with the robot in the job: `meltpath plan` divides them",
            );
        }
        not_held(&programs, settings, reporter);
        held &= programs.chosen.not_held.is_none() && programs.chosen.divisions.is_empty();
        for file in programs.files {
            if !files.iter().any(|f: &TextFile| f.name == file.name) {
                files.push(file);
            }
        }
    }
    // a part of a plan, or a plan without arc, is no toolpath
    let whole = loaded.settings.toolpath.is_some() && wanted == Wanted::WHOLE;
    let package = if whole {
        let (name, mesh) = built(&loaded, observer)?;
        Some(toolpath_file::packed(
            &toolpath,
            (&name, &mesh),
            &loaded.settings,
        )?)
    } else {
        None
    };
    let folder = OutputFolder::create(out)?;
    for file in &files {
        folder.write(&file.name, |w| w.write_all(file.text.as_bytes()))?;
    }
    if let Some(bytes) = &package {
        folder.write(toolpath_file::NAME, |w| w.write_all(bytes))?;
    }
    folder.commit()?;
    let package = package.map(|_| toolpath_file::NAME.to_owned());
    Ok(WrittenPrograms {
        files: files.into_iter().map(|f| f.name).chain(package).collect(),
        held,
    })
}

/// Tells that the way of the robot along programs is not judged by writing them.
fn not_judged(settings: &Settings, wanted: Wanted, reporter: &Reporter) {
    if settings.robot.is_some() {
        reporter.warn(
            "arm-not-judged",
            if wanted == Wanted::WHOLE {
                "reach, speeds and collisions of these programs are not judged here"
            } else {
                "the arm goes a way of its own along these programs: reach, speeds and collisions are not judged here, and what a run of the whole says does not hold for them"
            },
            "meltpath simulate PROGRAM --job JOB, and a dry run",
        );
    }
}

/// Tells where the robot does not hold the torch along programs.
fn not_held(programs: &Programs, settings: &Settings, reporter: &Reporter) {
    if let (Some(not), Some(cell)) = (&programs.chosen.not_held, &settings.robot) {
        let (reason, remedy) = no_way::not_held(not, cell);
        reporter.warn_at(
            "not-reached",
            format!("the robot does not hold the torch along these programs: {reason}"),
            Place::at(not.position.to_array()),
            &remedy,
        );
    }
}

/// What a job builds, with its name.
fn built(loaded: &Loaded, observer: &dyn Observer) -> Result<(String, Mesh), WaamError> {
    // what is to be told of it was told when it was planned
    let silent = Reporter::new();
    if let Some(asked) = &loaded.settings.surface {
        return wall::built(loaded, asked, &silent, observer);
    }
    let part = load_part(loaded, &silent, observer)?;
    Ok((part.name, part.mesh))
}

/// Refuses programs that do not read back as they were written, or that do not lay what was asked for.
fn faithful(
    programs: &Programs,
    toolpath: &Toolpath,
    wanted: Wanted,
    settings: &Settings,
) -> Result<(), ProgramStageError> {
    let burns = match wanted.torch {
        Torch::Dry => programs.parsed.iter().any(program::burns),
        Torch::Burns => {
            let silent = Reporter::new();
            let commands =
                program::commands(&programs.parsed, &programs.schedules, settings, &silent)?;
            let planned = laid_from(toolpath, wanted.from)?;
            let off = (commands.arc_length - planned).abs();
            !commands.gaps.is_empty() || off > SAME_LENGTH * planned
        }
    };
    if burns || !programs.stable {
        return Err(ProgramStageError::Unfaithful);
    }
    Ok(())
}
