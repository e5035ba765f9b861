//! Looking into files: parts, programs, plans, robot cells.

mod cell;
mod controller;
mod picture;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use meltpath_base::output::{OutputError, write_file};
use meltpath_base::{Cancelled, Observer, Reporter};
use meltpath_data::{find, robots};
use meltpath_geometry::math::DVec3;
use meltpath_programs::toolpath_3mf::{Reader, ToolpathFileError};
use meltpath_programs::{Becomes, Dialect, becomes};
use meltpath_report::picture::write_png;

use crate::cancel::cancellable;
use crate::data::{Cell, DataFileError, DataText};
use crate::job::PartUnit;
use crate::stages::part::{self, PartError};
use crate::stages::sheet;
use crate::waam::{self, WaamError, read_toolpath};

/// How a part file is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct How {
    /// Unit of a file that carries none.
    pub unit: PartUnit,
    /// Chord error of the mesh made of a STEP file, mm.
    pub chord: f64,
}

meltpath_base::passes_on! {
    /// Why a file cannot be looked into.
    pub enum InspectError {
        /// The person stopped it.
        Cancelled(Cancelled),
        /// A part.
        Part[PartError],
        /// A plan.
        Plan(WaamError),
        /// A robot, or a controller's cell.
        Robot(DataFileError),
        /// The picture.
        Output(OutputError);

        /// A program.
        #[error("cannot read {}: {message}", .path.display())]
        Program {
            /// The file.
            path: PathBuf,
            /// What is wrong.
            message: String,
        },
    }
}

cancellable!(InspectError:
    PartError => Part, PartError::Cancelled(c) => c;
);

/// What a file holds, in lines of words. Warnings go to `reporter`.
///
/// # Errors
/// [`InspectError`] where the file cannot be read or is of no known kind.
pub fn inspect(
    path: &Path,
    how: How,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<String>, InspectError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    match extension.as_str() {
        _ if Dialect::of_extension(&extension).is_some() => program(path),
        "melt" => plan(path),
        "toml" => robot(path),
        "urdf" | "xacro" => urdf(path),
        "" if is_shipped_robot(path) => robot(path),
        _ => inspect_part(path, how, reporter, observer),
    }
}

fn inspect_part(
    path: &Path,
    how: How,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<String>, InspectError> {
    let faces = if part::is_step(path) {
        sheet::faces(path, how.chord, observer)?
    } else {
        Vec::new()
    };
    let marks = toolpath(path);
    let part = match part::load(path, how.unit, DVec3::Z, how.chord, reporter, observer) {
        // a sheet has no volume, and faces all the same
        Err(PartError::Empty { .. }) if !faces.is_empty() => return Ok(faces),
        Err(PartError::Cancelled(c)) => return Err(c.into()),
        // a toolpath may lie beside any shape
        Err(_) if !marks.is_empty() => return Ok(marks),
        loaded => loaded?,
    };
    let size = part.mesh.bounds().map_or(DVec3::ZERO, |(lo, hi)| hi - lo);
    let volume = match part.loose_edges {
        0 => format!("volume {:.2} cm³", part.volume / 1000.0),
        loose => format!(
            "volume not known: the mesh is open ({loose} loose edges); close it in CAD and export it as one solid"
        ),
    };
    let mut lines = vec![format!(
        "{}: {:.2} x {:.2} x {:.2} mm, {volume}",
        part.name, size.x, size.y, size.z,
    )];
    lines.extend(part.findings);
    lines.extend(faces);
    lines.extend(marks);
    Ok(lines)
}

/// What the toolpath of a 3MF package is; nothing where there is none.
fn toolpath(path: &Path) -> Vec<String> {
    let is_package = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("3mf"));
    let Some(file) = is_package.then(|| File::open(path).ok()).flatten() else {
        return Vec::new();
    };
    match Reader::new(BufReader::new(file)) {
        Ok(reader) => {
            let names = reader.profiles().into_iter().map(|p| p.name);
            let told = format!(
                "toolpath: {}, {} layers, profiles {}",
                reader.kind().name(),
                reader.layer_count(),
                names.collect::<Vec<_>>().join(", ")
            );
            vec![told]
        }
        // the part's own reader tells what is wrong with the package
        Err(ToolpathFileError::None | ToolpathFileError::Package(_)) => Vec::new(),
        Err(other) => vec![format!("its toolpath cannot be read: {other}")],
    }
}

fn program(path: &Path) -> Result<Vec<String>, InspectError> {
    let wrong = |message: String| InspectError::Program {
        path: path.to_path_buf(),
        message,
    };
    // what arc words mean is a cell's business: here they are only counted
    let cell = Cell::load("arcmate-120ic", Path::new(""))?;
    let all =
        waam::program::files::parse_file(path, &cell.program).map_err(|e| wrong(e.to_string()))?;
    let mut lines = Vec::new();
    for parsed in &all {
        let p = &parsed.program;
        lines.push(format!(
            "program {}: {} instructions, {} positions",
            p.name,
            p.instructions.len(),
            p.positions.len()
        ));
        lines.extend(parsed.unread.iter().map(|u| {
            let what = match becomes(p.dialect, u.text.trim()) {
                Becomes::Executed => "is executed as far as its values are known",
                Becomes::Passed => "lays no metal",
                Becomes::Told => "is kept but not simulated",
            };
            format!("line {} {what}: {}", u.line, u.text.trim())
        }));
    }
    Ok(lines)
}

/// The robot file that says what a URDF says.
fn urdf(path: &Path) -> Result<Vec<String>, InspectError> {
    let wrong = |message: String| InspectError::Program {
        path: path.to_path_buf(),
        message,
    };
    let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
    if text.contains("xacro:") {
        let help = "it is a macro file: make the URDF with `xacro FILE`";
        return Err(wrong(help.to_owned()));
    }
    let toml = meltpath_robot::cell::from_urdf(&text).map_err(|e| wrong(e.to_string()))?;
    Ok(toml.lines().map(str::to_owned).collect())
}

fn is_shipped_robot(path: &Path) -> bool {
    let name = path.to_str();
    !path.exists() && name.is_some_and(|name| find(robots::ALL, name).is_some())
}

/// A robot with its cell: one that ships, or a file of one's own.
fn robot(path: &Path) -> Result<Vec<String>, InspectError> {
    let name = path.display().to_string();
    let text = DataText::load("robot", &name, robots::ALL, Path::new(""))?;
    if is_controller(&text.text) {
        return Ok(controller::lines(&Cell::load(&name, Path::new(""))?));
    }
    Ok(cell::lines(&text.robot()?))
}

/// The reach of a robot as a picture, into a new file (PNG).
///
/// # Errors
/// [`InspectError`] where the file is no robot, cannot be read, or the picture's name is taken.
pub fn picture(path: &Path, out: &Path) -> Result<(), InspectError> {
    let name = path.display().to_string();
    let text = DataText::load("robot", &name, robots::ALL, Path::new(""))?;
    let cell = text.robot()?;
    let image = picture::reach(&cell);
    write_file(out, |to| write_png(&image, to))?;
    Ok(())
}

/// Whether a TOML file says how a controller interpolates.
fn is_controller(text: &str) -> bool {
    text.parse::<toml::Table>()
        .is_ok_and(|t| t.contains_key("motion"))
}

fn plan(path: &Path) -> Result<Vec<String>, InspectError> {
    let toolpath = read_toolpath(path)?;
    let mut layers = BTreeMap::<(u32, u32), (usize, f64)>::new();
    for pass in toolpath.passes() {
        let (count, length) = layers.entry((pass.head.part, pass.layer)).or_default();
        *count += 1;
        *length += pass.length();
    }
    let mut lines = vec![format!(
        "plan: {} beads, {:.1} m, in {} layers",
        toolpath.pass_count(),
        toolpath.deposited_length() / 1000.0,
        layers.len()
    )];
    for p in &toolpath.profiles {
        lines.push(format!(
            "profile {}: {:.3} m/min travel, {:.2} m/min wire, bead {:.2} x {:.2} mm",
            p.name,
            p.speed * 0.06,
            p.wire_feed * 0.06,
            p.width,
            p.height
        ));
    }
    for ((_, layer), (count, length)) in layers {
        lines.push(format!("layer {layer}: {count} beads, {length:.0} mm"));
    }
    Ok(lines)
}
