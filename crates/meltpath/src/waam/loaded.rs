//! A job file with its resolved values, and what every run of it names and writes.

use std::path::{Path, PathBuf};

use meltpath_base::output::OutputFolder;
use meltpath_base::settings::Problem;
use meltpath_base::{Check, Observer, Provenance, Reporter};
use meltpath_geometry::Mesh;
use meltpath_programs::TextFile;
use meltpath_toolpath::{Toolpath, storage};

use super::error::WaamError;
use super::program::{Commands, Programs};
use super::settings::{Settings, resolve};
use crate::inputs;
use crate::job::{self, Job, JobError, WaamJob, Written};
use crate::outcome::record_inputs;
use crate::waam::drive::hold;
use crate::waam::drive::other_way::Otherwise;
use crate::waam::drive::site::Site;
use crate::waam::judge::checks::program_check;
use crate::waam::program::toolpath_file;
use crate::waam::program::wanted::Wanted;
use crate::waam::settings::named::absent_part;
use crate::waam::surface::Shape;

/// Warnings of one kind that a verdict tells one by one.
pub(super) const SHOWN_WARNINGS: usize = 3;

/// What is built, with its name for people.
pub(super) type Named<'a> = (&'a str, &'a Mesh);

/// A job file with its resolved values.
pub(super) struct Loaded {
    pub(super) path: PathBuf,
    pub(super) text: String,
    pub(super) name: String,
    pub(super) settings: Settings,
    /// As written.
    pub(super) job: Written<WaamJob>,
}

impl Loaded {
    /// Records the files that the job was read from.
    pub(super) fn record(&self, provenance: &mut Provenance) -> Result<(), WaamError> {
        record_inputs(provenance, &[&self.path, &self.settings.part])?;
        if let Some(Shape::Onto(onto)) = self.settings.surface.as_ref().map(|asked| &asked.shape) {
            for file in std::iter::once(&onto.body).chain(&onto.then) {
                record_inputs(provenance, &[file])?;
            }
        }
        for named in self.settings.robot.iter().flat_map(|r| &r.files) {
            record_inputs(provenance, &[&named.file])?;
        }
        if let Some(Shape::Wall(wall)) = self.settings.surface.as_ref().map(|asked| &asked.shape)
            && let Some(file) = &wall.field
        {
            record_inputs(provenance, &[file])?;
        }
        for data in &self.settings.own {
            if let Some(file) = data.file.as_deref() {
                record_inputs(provenance, &[file])?;
            }
        }
        Ok(())
    }

    /// Writes what a run keeps beside its results: its inputs, its path, its programs.
    pub(super) fn keep(
        &self,
        folder: &OutputFolder,
        (toolpath, part): (&Toolpath, Named<'_>),
        programs: &[TextFile],
    ) -> Result<(), WaamError> {
        inputs::write(folder, &self.path, &self.text, &self.settings.own)?;
        if let Some(robot) = &self.settings.robot {
            inputs::write_beside(folder, &self.settings.own, &robot.files)?;
        }
        folder.write("toolpath.melt", |w| storage::write(toolpath, w))?;
        if self.settings.toolpath.is_some() {
            let bytes = toolpath_file::packed(toolpath, part, &self.settings)?;
            folder.write(toolpath_file::NAME, |w| w.write_all(&bytes))?;
        }
        for file in programs {
            folder.write(&format!("program/{}", file.name), |w| {
                w.write_all(file.text.as_bytes())
            })?;
        }
        Ok(())
    }
}

/// The job, read and resolved.
pub(super) fn load(path: &Path, reporter: &Reporter) -> Result<Loaded, WaamError> {
    let (job, text) = job::load(path)?;
    let Job::Waam(job) = job else {
        return Err(other_process(path, &text));
    };
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let absent = absent_part(&job, &folder);
    let settings = match (resolve(&job, &folder, reporter), absent) {
        (Ok(settings), None) => settings,
        (settings, absent) => {
            let mut problems = settings.err().map_or_else(Vec::new, |e| e.0);
            problems.splice(0..0, absent);
            return Err(JobError::in_file(path, &text, problems).into());
        }
    };
    Ok(Loaded {
        path: path.to_path_buf(),
        name: job_name(path, &job),
        text,
        settings,
        job: *job,
    })
}

/// A job of another process where a wire-arc one is needed.
pub(super) fn other_process(path: &Path, text: &str) -> WaamError {
    let place = text.find("[process]").map(|at| at..at + 9);
    let problem = Problem::new("this command is for wire-arc jobs")
        .at(place)
        .help("`meltpath run` takes jobs of every process");
    JobError::in_file(path, text, problem).into()
}

/// A name for people: the part's, or the folder's where the job file has none of its own.
fn job_name(path: &Path, job: &WaamJob) -> String {
    let stem = |p: &Path| p.file_stem().map(|s| s.to_string_lossy().into_owned());
    let own = stem(path).filter(|s| s != "job");
    // a job that is named from within its folder has the folder's name all the same
    let folder = || {
        let whole = std::path::absolute(path).ok()?;
        let name = whole.parent()?.file_name()?;
        Some(name.to_string_lossy().into_owned())
    };
    own.or_else(folder)
        .or_else(|| stem(Path::new(&**job.part)))
        .unwrap_or_else(|| "job".to_owned())
}

/// What a run of these settings is of, in a line; `what` is the part or the program.
pub(super) fn subtitle(what: &str, settings: &Settings) -> String {
    format!(
        "{what} · wire {} · {} · {} · cell {}",
        *settings.wire.name,
        *settings.gas.name,
        settings.mode.to_uppercase(),
        settings.cell_name
    )
}

/// Files of programs that were written and read back.
pub(super) struct WrittenFiles {
    pub(super) files: Vec<TextFile>,
    /// Whether they lay what the plan does.
    pub(super) check: Check,
    /// Those along which the arm goes otherwise than along the one that is judged.
    pub(super) otherwise: Otherwise,
}

/// The files that the job asks for, those for other controllers than the one that is judged too, each read back; and their check.
pub(super) fn written(
    loaded: &Loaded,
    toolpath: &Toolpath,
    (own, commands): (&Programs, &Commands),
    (site, observer): (Site<'_>, &dyn Observer),
) -> Result<WrittenFiles, WaamError> {
    let settings = site.settings;
    let (mut files, mut further) = (Vec::new(), Vec::new());
    let mut otherwise = Otherwise::default();
    for &dialect in &settings.programs {
        if dialect == settings.judged() {
            files.extend_from_slice(&own.files);
            continue;
        }
        // what is to be told of the plan is told by those that are judged
        let silent = Reporter::new();
        let programs = hold::write(
            &loaded.name,
            toolpath,
            (dialect, Wanted::WHOLE),
            site,
            own.chosen.way.as_ref(),
            (&silent, observer),
        )?;
        otherwise.look(own, &programs, settings);
        let commands = programs.commands(settings, &silent)?;
        otherwise.look_where(&commands, dialect);
        files.extend_from_slice(&programs.files);
        further.push((programs, commands));
    }
    let all: Vec<_> = std::iter::once((own, commands))
        .chain(further.iter().map(|(p, c)| (p, c)))
        .collect();
    Ok(WrittenFiles {
        files,
        check: program_check(&all, toolpath),
        otherwise,
    })
}
