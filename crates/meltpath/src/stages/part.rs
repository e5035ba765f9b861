//! The part: read from its file, examined, repaired where needed, turned and set down on the plate.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use meltpath_base::{Cancelled, Observer, Reporter};
use meltpath_geometry::Mesh;
use meltpath_geometry::brep::{BrepModel, TessellateError, Tolerance, tessellate};
use meltpath_geometry::diagnosis::{Defect, DiagnosisOptions, diagnose};
use meltpath_geometry::io::read_mesh;
use meltpath_geometry::math::{DAffine3, DQuat, DVec3};
use meltpath_geometry::repair::{RepairOptions, repair as repair_mesh};
use meltpath_geometry::step;
use meltpath_geometry::union::union_volume;

use crate::job::PartUnit;

/// A part ready for planning.
#[derive(Debug, Clone)]
pub struct Part {
    /// Its name for people: the file's.
    pub name: String,
    /// Its surface, mm: build direction up, lowest point on z = 0.
    pub mesh: Mesh,
    /// Volume, mm³: what several shells cover counts once. Of an open surface it is not known, and this is what its triangles sum up to.
    pub volume: f64,
    /// Edges of the surface that have one triangle only: where it is open.
    pub loose_edges: u64,
    /// What was found and repaired, in words.
    pub findings: Vec<String>,
}

/// Why a part cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PartError {
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The file cannot be opened.
    #[error("cannot open the part {}: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file cannot be read as what it claims to be.
    #[error("cannot use the part {}: {reason}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What its reader said.
        reason: String,
    },
    /// No reader for the file.
    #[error("cannot read {}: meltpath reads STEP (.step, .stp), STL (.stl) and 3MF (.3mf); export the part as one of these", .0.display())]
    Format(PathBuf),
    /// Nothing solid in the file.
    #[error("the part {} has no volume{}", .path.display(), hint(*.thin))]
    Empty {
        /// The file.
        path: PathBuf,
        /// Whether it has a surface all the same.
        thin: f64,
    },
    /// Far too large for the process.
    #[error("the part {} is {:.0} x {:.0} x {:.0} mm: wrong unit? {}", .path.display(), .size.x, .size.y, .size.z, unit_hint(.path))]
    Size {
        /// The file.
        path: PathBuf,
        /// Extents, mm.
        size: DVec3,
    },
    /// Shells that cross where inside and outside have to be told apart.
    #[error("shells of {} cross each other, so that no distance from its surface can be told: unite them in CAD, and export one solid", .0.display())]
    Overlap(PathBuf),
    /// A surface that has edges where inside and outside have to be told apart: how many are left.
    #[error("the surface of {} is open ({} loose edges are left), so that nobody can tell where there is metal: close the scan, with sides and bottom, in the software that made it (`meltpath inspect` tells what is open)", .0.display(), .1)]
    NotClosed(PathBuf, u64),
    /// A surface of no triangle.
    #[error("the part {} has no surface: no triangle has an area", .0.display())]
    NoSurface(PathBuf),
    /// A closed surface where a wall is asked for.
    #[error("the surface of {} is closed, and a wall one bead thick stands on one of its sides: name the faces of a STEP file (surface.faces; `meltpath inspect` lists them), or export that side alone as a sheet", .0.display())]
    Closed(PathBuf),
    /// Faces of a file that has none.
    #[error("{} holds triangles, and no faces with numbers: {remedy}, or give the part as STEP", .path.display())]
    NoFaces {
        /// The file.
        path: PathBuf,
        /// What does without numbers.
        remedy: &'static str,
    },
    /// A face that is not there.
    #[error("the part {} has no face {number}: they run from 1 to {count}; `meltpath inspect` lists them", .path.display())]
    NoFace {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        number: u32,
        /// How many there are.
        count: u32,
    },
}

/// What tells the unit of a file.
fn unit_hint(path: &Path) -> &'static str {
    match ending(path).as_str() {
        "stl" => "An STL carries none: say `part_unit = \"mm\"`, \"cm\", \"m\" or \"in\"",
        _ => "The file tells it: export the part anew in the unit that it was drawn in",
    }
}

fn hint(area: f64) -> &'static str {
    if area > 0.0 {
        ": its surface encloses nothing; export a solid, or build along the sheet ([surface] of a job)"
    } else {
        ""
    }
}

/// Extents beyond these, mm, are a wrong unit and not a part.
const SMALLEST: f64 = 1.0;
const LARGEST: f64 = 20_000.0;

/// Reads, examines, repairs and places the part.
///
/// `unit` applies to files that carry none; `up` is the direction of the file that points up; `chord_error` (mm) bounds the
/// mesh made of a B-rep.
///
/// # Errors
/// [`PartError`], naming the file and what to do.
pub fn load(
    path: &Path,
    unit: PartUnit,
    up: DVec3,
    chord_error: f64,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Part, PartError> {
    let mut part = read(path, unit, chord_error, reporter, observer)?;
    place(&mut part.mesh, up);
    Ok(part)
}

/// Reads, examines and repairs a part in the coordinates of its file.
pub(super) fn read(
    path: &Path,
    unit: PartUnit,
    chord_error: f64,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Part, PartError> {
    if unit != PartUnit::Millimetre && ending(path) != "stl" {
        reporter.warn(
            "unit-of-file",
            format!(
                "part_unit is not taken: {} tells its own unit",
                name_of(path)
            ),
            "leave part_unit out; where the part is too large or too small, export it anew",
        );
    }
    let mut mesh = if is_step(path) {
        let model = step_model(path, reporter, observer)?;
        meshed(&model, chord_error, path, reporter, observer)?
    } else {
        read_triangles(path, unit, reporter, observer)?
    };
    let Repaired {
        findings,
        volume,
        loose_edges,
    } = repair(&mut mesh, reporter, observer)?;
    if volume <= 0.0 || volume.is_nan() {
        return Err(PartError::Empty {
            path: path.to_path_buf(),
            thin: mesh.area(),
        });
    }
    check_size(&mesh, path)?;
    Ok(Part {
        name: name_of(path),
        mesh,
        volume,
        loose_edges,
        findings,
    })
}

/// The name of a file for people.
pub(super) fn name_of(path: &Path) -> String {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned());
    name.unwrap_or_default()
}

fn ending(path: &Path) -> String {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    ending.unwrap_or_default()
}

/// Whether a file is STEP by its name.
pub(crate) fn is_step(path: &Path) -> bool {
    matches!(ending(path).as_str(), "step" | "stp")
}

/// Refuses what is far too large or too small for the process.
pub(super) fn check_size(mesh: &Mesh, path: &Path) -> Result<(), PartError> {
    let size = mesh.bounds().map_or(DVec3::ZERO, |(lo, hi)| hi - lo);
    if size.max_element() > LARGEST || size.max_element() < SMALLEST {
        return Err(PartError::Size {
            path: path.to_path_buf(),
            size,
        });
    }
    Ok(())
}

/// The triangles of a file that holds triangles, mm.
pub(super) fn read_triangles(
    path: &Path,
    unit: PartUnit,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Mesh, PartError> {
    match ending(path).as_str() {
        "stl" => {
            let mut mesh = read_mesh_file(path, unit, reporter, observer)?;
            for v in &mut mesh.vertices {
                *v *= unit.millimetres();
            }
            Ok(mesh)
        }
        "3mf" => read_mesh_file(path, PartUnit::Millimetre, reporter, observer),
        _ => Err(PartError::Format(path.to_path_buf())),
    }
}

fn read_mesh_file(
    path: &Path,
    unit: PartUnit,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Mesh, PartError> {
    let quiet = Reporter::new();
    // a stated unit answers the reader's suspicion about the unit
    let to = if unit == PartUnit::Millimetre {
        reporter
    } else {
        &quiet
    };
    let meshes = read_mesh(path, to, observer).map_err(|e| failed(path, &e))?;
    let several = meshes.len();
    let mut all = Mesh::default();
    for named in meshes {
        let offset = all.vertices.len() as u32;
        all.vertices.extend(named.mesh.vertices);
        all.triangles
            .extend(named.mesh.triangles.iter().map(|t| t.map(|v| v + offset)));
    }
    if several > 1 {
        reporter.warn(
            "part-objects",
            format!("the part file holds {several} objects; they are built together, as one part"),
            "",
        );
    }
    Ok(all)
}

fn failed(path: &Path, reason: &dyn std::error::Error) -> PartError {
    PartError::Read {
        path: path.to_path_buf(),
        reason: reason.to_string(),
    }
}

/// The solids and shells of a STEP file.
pub(super) fn step_model(
    path: &Path,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<BrepModel, PartError> {
    observer.stage("read STEP", 0);
    let file = File::open(path).map_err(|source| PartError::Open {
        path: path.to_path_buf(),
        source,
    })?;
    step::read(BufReader::new(file), reporter).map_err(|e| failed(path, &e))
}

/// Their mesh.
pub(super) fn meshed(
    model: &BrepModel,
    chord_error: f64,
    path: &Path,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Mesh, PartError> {
    let tolerance = Tolerance {
        chord: chord_error,
        ..Tolerance::default()
    };
    tessellate(model, &tolerance, reporter, observer).map_err(|e| match e {
        TessellateError::Cancelled(c) => PartError::Cancelled(c),
        other => failed(path, &other),
    })
}

/// What is left of a mesh after its repair.
struct Repaired {
    /// In words, with what was done.
    findings: Vec<String>,
    /// Its volume, mm³.
    volume: f64,
    /// Edges with one triangle only.
    loose_edges: u64,
}

/// Repairs the mesh, looks at what is left, and says both in words.
fn repair(
    mesh: &mut Mesh,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Repaired, PartError> {
    let actions = repair_mesh(mesh, &RepairOptions::default(), reporter, observer)?;
    let diagnosis = diagnose(mesh, &DiagnosisOptions::default(), observer)?;
    diagnosis.warn(reporter);
    let loose_edges = diagnosis.count(Defect::LooseEdge);
    let mut findings = vec![format!(
        "{} triangles, {} shells, area {:.1} mm², {}",
        diagnosis.triangles,
        diagnosis.shells.len(),
        diagnosis.area,
        match loose_edges {
            0 => format!("volume {:.1} mm³", diagnosis.volume),
            _ => "volume not known".to_owned(),
        }
    )];
    findings.extend(actions.iter().map(|a| format!("repaired: {a}")));
    findings.extend(
        diagnosis
            .findings
            .iter()
            .map(|f| format!("found: {} {}", f.count, f.defect)),
    );
    let mut volume = diagnosis.volume;
    let may_overlap = diagnosis.shells.len() > 1 || diagnosis.count(Defect::Intersection) > 0;
    if loose_edges == 0 && may_overlap {
        let union = union_volume(mesh);
        // what the columns cannot tell from the sum of the shells is that sum
        if (union.volume - volume).abs() > SURE * union.sigma {
            findings.push(format!(
                "shells overlap: what several cover counts once, volume {:.1} ± {:.1} mm³",
                union.volume, union.sigma
            ));
            volume = union.volume;
        }
    }
    Ok(Repaired {
        findings,
        volume,
        loose_edges,
    })
}

/// Beyond so many standard uncertainties the volume of a union is another than the sum of its shells.
const SURE: f64 = 4.0;

/// Turns `up` to +Z and sets the lowest point on z = 0: the build from the coordinates of the file.
pub(super) fn place(mesh: &mut Mesh, up: DVec3) -> DAffine3 {
    let turn = DQuat::from_rotation_arc(up.normalize_or(DVec3::Z), DVec3::Z);
    for v in &mut mesh.vertices {
        *v = turn * *v;
    }
    let lowest = mesh.bounds().map_or(0.0, |(lo, _)| lo.z);
    for v in &mut mesh.vertices {
        v.z -= lowest;
    }
    DAffine3::from_rotation_translation(turn, -lowest * DVec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_base::Silent;
    use meltpath_geometry::io::stl::write_stl;
    use meltpath_geometry::shapes;

    fn stl(mesh: &Mesh) -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("part.STL");
        let mut bytes = Vec::new();
        write_stl(mesh, "part", &mut bytes).unwrap();
        std::fs::write(&path, bytes).unwrap();
        (dir, path)
    }

    fn read(path: &Path, unit: PartUnit, up: DVec3) -> Result<Part, PartError> {
        load(path, unit, up, 0.02, &Reporter::new(), &Silent)
    }

    #[test]
    fn a_part_is_turned_and_set_down() {
        let mut mesh = shapes::thin_wall(60.0, 10.0, 20.0);
        for v in &mut mesh.vertices {
            *v += DVec3::new(100.0, 200.0, -300.0);
        }
        let (_dir, path) = stl(&mesh);
        let part = read(&path, PartUnit::Millimetre, DVec3::Y).unwrap();
        let (lo, hi) = part.mesh.bounds().unwrap();
        assert!(lo.z.abs() < 1e-9 && (hi.z - 10.0).abs() < 1e-4, "{lo} {hi}");
        assert!((part.volume - 12_000.0).abs() < 0.1);
    }

    #[test]
    fn units_and_formats_are_told() {
        let (_dir, path) = stl(&shapes::thin_wall(0.06, 0.01, 0.02));
        let part = read(&path, PartUnit::Metre, DVec3::Z).unwrap();
        assert!((part.volume - 12_000.0).abs() < 1.0, "{}", part.volume);
        assert!(matches!(
            read(&path, PartUnit::Millimetre, DVec3::Z),
            Err(PartError::Size { .. })
        ));
        assert!(matches!(
            read(Path::new("x.iges"), PartUnit::Millimetre, DVec3::Z),
            Err(PartError::Format(_))
        ));
        assert!(
            read(Path::new("absent.stl"), PartUnit::Millimetre, DVec3::Z)
                .unwrap_err()
                .to_string()
                .contains("absent.stl")
        );
    }

    /// Two walls that cross: the part is as large as what they cover together.
    #[test]
    fn shells_that_overlap_count_once() {
        let mut mesh = shapes::thin_wall(60.0, 10.0, 20.0);
        let count = mesh.vertices.len() as u32;
        let across = shapes::thin_wall(10.0, 60.0, 20.0);
        mesh.vertices.extend(&across.vertices);
        mesh.triangles
            .extend(across.triangles.iter().map(|t| t.map(|v| v + count)));
        let (_dir, path) = stl(&mesh);
        let part = read(&path, PartUnit::Millimetre, DVec3::Z).unwrap();
        assert!((part.volume - 22_000.0).abs() < 100.0, "{}", part.volume);
        let told = part.findings.iter().any(|f| f.contains("counts once"));
        assert!(told, "{:?}", part.findings);
    }

    /// What an open surface encloses nobody knows.
    #[test]
    fn an_open_part_has_no_volume_that_is_known() {
        let mut mesh = shapes::thin_wall(60.0, 10.0, 20.0);
        let whole = mesh.clone();
        let x = |v: u32| whole.vertices[v as usize].x;
        let least = whole.bounds().unwrap().0.x;
        mesh.triangles
            .retain(|t| t.iter().any(|v| x(*v) > least + 1.0));
        let (_dir, path) = stl(&mesh);
        let part = read(&path, PartUnit::Millimetre, DVec3::Z).unwrap();
        assert_eq!(part.loose_edges, 4);
        assert!(part.findings[0].ends_with("volume not known"));
        let how = crate::inspect::How {
            unit: PartUnit::Millimetre,
            chord: 0.02,
        };
        let lines = crate::inspect::inspect(&path, how, &Reporter::new(), &Silent).unwrap();
        assert!(lines[0].contains("volume not known: the mesh is open (4 loose edges)"));
    }

    #[test]
    fn an_inside_out_part_is_repaired_and_told() {
        let mut mesh = shapes::thin_wall(60.0, 10.0, 20.0);
        for t in &mut mesh.triangles {
            t.swap(1, 2);
        }
        let (_dir, path) = stl(&mesh);
        let part = read(&path, PartUnit::Millimetre, DVec3::Z).unwrap();
        assert!(part.volume > 0.0);
        assert!(
            part.findings.iter().any(|f| f.contains("inside out")),
            "{:?}",
            part.findings
        );
    }
}
