//! The files that a URDF names: where they lie, and what is in those of meshes.

use std::ffi::OsStr;
use std::fs::File;
use std::io::BufReader;
use std::path::{Component, Path, PathBuf};

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::Mesh;
use meltpath_geometry::io::stl::read_stl;
use meltpath_geometry::math::DVec3;

use super::error::LinkFault;
use super::read::MILLIMETRES;

/// How many folders upward a package is looked for.
const UPWARD: usize = 8;
/// No robot goes farther from the origin of its link, mm.
const FARTHEST: f64 = 20_000.0;

/// A file that is named, and the name by which a copy of it is found beside a copy of what names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// Where it lies.
    pub file: PathBuf,
    /// Its name there; nothing of one that is named by its place on the machine.
    pub copy: Option<PathBuf>,
}

/// The file that `name` means beside `folder`; else the places where it was looked for.
///
/// A name is relative to the folder; where there is none, the same without its way upward. Names of packages lie in the folder, in a folder
/// of the package's name beside it, or upward from there.
pub(super) fn find(name: &str, folder: &Path) -> Result<Named, Vec<PathBuf>> {
    if let Some(package) = ["package://", "model://"]
        .iter()
        .find_map(|scheme| name.strip_prefix(scheme))
    {
        let within = package.split_once('/').map_or(package, |(_, rest)| rest);
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let places = folder.ancestors().take(UPWARD);
        let places = places.flat_map(|p| [p.join(package), p.join(within)]);
        return first(places, Some(downward(Path::new(within))));
    }
    let path = Path::new(name.strip_prefix("file://").unwrap_or(name));
    if path.is_absolute() {
        return first([path.to_owned()], None);
    }
    let below = downward(path);
    let places = [folder.join(path), folder.join(&below)];
    first(places, Some(below))
}

fn first(
    places: impl IntoIterator<Item = PathBuf>,
    copy: Option<PathBuf>,
) -> Result<Named, Vec<PathBuf>> {
    let mut looked: Vec<PathBuf> = Vec::new();
    for file in places {
        if file.is_file() {
            return Ok(Named { file, copy });
        }
        if !looked.contains(&file) {
            looked.push(file);
        }
    }
    Err(looked)
}

/// A path without its way upward.
fn downward(path: &Path) -> PathBuf {
    let down = |c: &Component<'_>| matches!(c, Component::Normal(_));
    path.components().filter(down).collect()
}

/// The mesh of a file, m scaled by `scale`, in mm.
pub(super) fn read(name: &str, scale: DVec3, folder: &Path) -> Result<(Mesh, Named), LinkFault> {
    let extension = Path::new(name).extension().and_then(OsStr::to_str);
    if !extension.is_some_and(|e| e.eq_ignore_ascii_case("stl")) {
        return Err(LinkFault::Format {
            file: name.to_owned(),
        });
    }
    let named = find(name, folder).map_err(|looked| LinkFault::Missing {
        file: name.to_owned(),
        looked,
    })?;
    let wrong = |what: String| LinkFault::Mesh {
        file: named.file.clone(),
        what,
    };
    let opened = File::open(&named.file).and_then(|file| {
        let length = file.metadata()?.len();
        Ok((BufReader::new(file), length))
    });
    let (reader, length) = opened.map_err(|e| wrong(e.to_string()))?;
    // what is odd around the triangles does not matter here
    let read = read_stl(reader, Some(length), &Reporter::new(), &Silent);
    let mut mesh = read.map_err(|e| wrong(e.to_string()))?.mesh;
    for v in &mut mesh.vertices {
        *v *= scale * MILLIMETRES;
    }
    if scale.x * scale.y * scale.z < 0.0 {
        // a mirror turns what is outward inward
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    let far = mesh.vertices.iter().map(|v| v.length()).fold(0.0, f64::max);
    if far > FARTHEST {
        return Err(wrong(format!(
            "it reaches {:.0} m from its origin; meshes of URDFs are in metres, is it in millimetres? Then write scale=\"0.001 0.001 0.001\" in <mesh>",
            far / MILLIMETRES
        )));
    }
    Ok((mesh, named))
}
