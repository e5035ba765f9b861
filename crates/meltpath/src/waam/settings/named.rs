//! The files that a wire-arc job names: what is wrong with them.

use std::path::Path;

use meltpath_base::settings::Problem;
use meltpath_base::{Provenance, Reporter};

use super::{machine, process};
use crate::job::WaamJob;
use crate::job::waam::{OntoTable, SurfaceTable};

/// What is wrong with the files that a job names in tables of which no key is `wrong`.
pub(crate) fn problems(job: &WaamJob, folder: &Path, wrong: impl Fn(&str) -> bool) -> Vec<Problem> {
    let reporter = Reporter::new();
    let mut found = Vec::new();
    if !wrong("part") {
        found.extend(absent_part(job, folder));
    }
    if !wrong("waam.") {
        let process = process::load(&job.waam, folder, &reporter);
        found.extend(process.err().unwrap_or_default());
    }
    if !wrong("machine.") {
        let machine = machine::load(&job.machine, folder, &reporter, &mut Provenance::new());
        found.extend(machine.err().unwrap_or_default());
    }
    found
}

/// Why the part, or the body that it grows out of, cannot be opened, at its key.
pub(in crate::waam) fn absent_part(job: &WaamJob, folder: &Path) -> Option<Problem> {
    let absent = |name: &str, what: &str| {
        let file = folder.join(name);
        let error = std::fs::metadata(&file).err()?;
        Some(format!("cannot open {what} {}: {error}", file.display()))
    };
    let part = absent(&job.part, "the part").map(|why| job.part.problem(why));
    let of_body = |onto: &OntoTable| {
        let then = || onto.then.iter().find_map(|file| absent(file, "a part"));
        let body = absent(&onto.body, "the body").map(|why| onto.body.problem(why));
        body.or_else(|| then().map(|why| onto.then.problem(why)))
    };
    let of_surface = |surface: &SurfaceTable| {
        let why = absent(surface.field.value.as_ref()?, "the directions of the torch")?;
        Some(surface.field.problem(why))
    };
    part.or_else(|| of_body(job.onto.as_ref()?))
        .or_else(|| of_surface(job.surface.as_ref()?))
}
