//! The plan as a 3MF toolpath: written for other software and read back, and read from other software.

use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::Path;

use meltpath_base::Ratio;
use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::mesh::NamedMesh;
use meltpath_programs::toolpath_3mf::{Found, read_spatial, write_spatial};
use meltpath_programs::{Gap, Missing};
use meltpath_toolpath::Toolpath;

use crate::waam::program::ProgramStageError;
use crate::waam::settings::Settings;

/// How a run calls it.
pub(in crate::waam) const NAME: &str = "toolpath.build.3mf";
/// Lengths of a bead that differ by less are the same, mm and in relation: the digits of the file, and its lines in place of arcs.
const SAME_LENGTH: (f64, f64) = (2e-3, 1e-3);

/// Whether a file is such a package, by its name.
pub(in crate::waam) fn is_package(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("3mf"))
}

/// The package of a plan for a part, read back.
///
/// # Errors
/// [`ProgramStageError`] where the format has no words for the plan.
pub(in crate::waam) fn packed(
    toolpath: &Toolpath,
    (name, mesh): (&str, &Mesh),
    settings: &Settings,
) -> Result<Vec<u8>, ProgramStageError> {
    let part = NamedMesh {
        name: name.to_owned(),
        mesh: mesh.clone(),
    };
    let smoothing = Ratio(settings.smoothing);
    let bytes = write_spatial(toolpath, part, smoothing, Cursor::new(Vec::new()))?.into_inner();
    let read = read_spatial(Cursor::new(&bytes));
    match read {
        Ok(read)
            if read.found.iter().all(|f| !f.shapes) && lays_the_same(&read.toolpath, toolpath) =>
        {
            Ok(bytes)
        }
        _ => Err(ProgramStageError::Unfaithful),
    }
}

fn lays_the_same(a: &Toolpath, b: &Toolpath) -> bool {
    let lengths = |toolpath: &Toolpath| -> Vec<f64> {
        let beads = toolpath.passes().filter(|p| p.head.role.deposits());
        beads.map(|p| p.length()).collect()
    };
    let (a, mut b) = (lengths(a), lengths(b));
    // shorter than the digits of the file
    b.retain(|length| *length > 1e-3);
    let same = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME_LENGTH.0 + SAME_LENGTH.1 * b;
    a.len() == b.len() && a.iter().zip(&b).all(same)
}

/// The toolpath of a package, counted from the job's plate on, and how much it smooths corners, where it says that. What else it does not say is
/// that of the job's bead, and told.
///
/// # Errors
/// [`ProgramStageError`] where it cannot be read, or lays nothing.
pub(in crate::waam) fn read(
    path: &Path,
    settings: &Settings,
) -> Result<(Toolpath, Option<Ratio>, Vec<Gap>), ProgramStageError> {
    let file = File::open(path).map_err(|source| ProgramStageError::Io {
        path: path.to_path_buf(),
        source,
    })?;
    let found = read_spatial(BufReader::new(file));
    let read = found.map_err(|source| ProgramStageError::ReadToolpath {
        path: path.to_path_buf(),
        source,
    })?;
    let mut toolpath = read.toolpath;
    let bead = &settings.bead;
    for profile in &mut toolpath.profiles {
        for (value, own) in [
            (&mut profile.speed, bead.travel_speed),
            (&mut profile.wire_feed, bead.wire_feed),
            (&mut profile.height, bead.height.value),
            (&mut profile.width, bead.width.value),
        ] {
            if *value == 0.0 {
                *value = own;
            }
        }
    }
    let down = settings.plate_height.unwrap_or(0.0) * DVec3::Z;
    for layer in &mut toolpath.layers {
        layer.translate(-down);
    }
    if toolpath.deposited_length() <= 0.0 {
        return Err(ProgramStageError::NoArc(path.display().to_string()));
    }
    let gaps = read.found.into_iter().map(gap).collect();
    Ok((toolpath, read.smoothing, gaps))
}

fn gap(found: Found) -> Gap {
    Gap {
        text: format!("segment {}, profile {}", found.segment, found.profile),
        program: found.part,
        line: found.segment,
        why: Missing::Profile(found.what),
    }
}
