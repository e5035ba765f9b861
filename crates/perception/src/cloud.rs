//! Clouds of points as scanners and profile cameras write them.

mod ply;
mod wrong;

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::io::stl::read_stl;
use meltpath_geometry::math::DVec3;

pub use wrong::Wrong;

/// Points of a surface, in the unit of their file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cloud {
    /// The points, in the order of the file.
    pub points: Vec<DVec3>,
    /// Points of the file that are no numbers: scanners write where they saw nothing.
    pub unseen: usize,
}

/// Why a cloud cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CloudError {
    /// The file does not open or read.
    #[error("cannot read `{file}`: {message}")]
    File {
        /// Which file.
        file: String,
        /// What was said.
        message: String,
    },
    /// A kind of file that is not read.
    #[error(
        "`{file}` is no cloud of points that can be read: write it as .ply or .stl, or as .xyz, .asc, .pts, .txt or .csv with x, y, z in each line"
    )]
    Kind {
        /// Which file.
        file: String,
    },
    /// What a file holds.
    #[error("`{file}`, {wrong}")]
    Content {
        /// Which file.
        file: String,
        /// What is wrong.
        wrong: Wrong,
    },
}

/// Kinds of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// PLY, text or binary.
    Ply,
    /// Lines of x, y, z.
    Lines,
}

impl Cloud {
    /// Reads a cloud by its file's extension: PLY (text or binary), the corners of an STL, or lines of x, y, z.
    ///
    /// # Errors
    /// [`CloudError`].
    pub fn read(path: &Path) -> Result<Self, CloudError> {
        let file = path.display().to_string();
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        let kind = match extension.to_lowercase().as_str() {
            "stl" => return corners(path, file),
            "ply" => Kind::Ply,
            "xyz" | "asc" | "pts" | "txt" | "csv" => Kind::Lines,
            _ => return Err(CloudError::Kind { file }),
        };
        let bytes = std::fs::read(path).map_err(|e| CloudError::File {
            file: file.clone(),
            message: e.to_string(),
        })?;
        Cloud::parse(kind, &bytes).map_err(|wrong| CloudError::Content { file, wrong })
    }

    /// The cloud of a file's bytes.
    ///
    /// # Errors
    /// [`Wrong`].
    pub fn parse(kind: Kind, bytes: &[u8]) -> Result<Self, Wrong> {
        let points = match kind {
            Kind::Ply => ply::points(bytes)?,
            Kind::Lines => lines(&String::from_utf8_lossy(bytes))?,
        };
        let all = points.len();
        let points: Vec<DVec3> = points.into_iter().filter(|p| p.is_finite()).collect();
        Ok(Cloud {
            unseen: all - points.len(),
            points,
        })
    }
}

/// The corners of a scan that was made a mesh.
fn corners(path: &Path, file: String) -> Result<Cloud, CloudError> {
    let read = File::open(path)
        .map_err(|e| e.to_string())
        .and_then(|opened| {
            let length = opened.metadata().ok().map(|m| m.len());
            read_stl(BufReader::new(opened), length, &Reporter::new(), &Silent)
                .map_err(|e| e.to_string())
        });
    let points = read.map_err(|message| CloudError::File { file, message })?;
    Ok(Cloud {
        points: points.mesh.vertices,
        unseen: 0,
    })
}

/// Points of lines of numbers between blanks, commas, semicolons or tabs: x, y, z first, or where a line of names before them says. What
/// else stands before the first point, and after `#` or `//`, is left out.
fn lines(text: &str) -> Result<Vec<DVec3>, Wrong> {
    let mut points = Vec::new();
    let mut columns = [0, 1, 2];
    for (n, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') || line.starts_with("//") {
            continue;
        }
        // decimal commas stand between semicolons
        let line = if line.contains(';') {
            line.replace(',', ".")
        } else {
            line.to_owned()
        };
        let cells = line.split([' ', '\t', ',', ';']).filter(|c| !c.is_empty());
        let cells: Vec<&str> = cells.collect();
        let value = |column: usize| cells.get(column)?.parse::<f64>().ok();
        match columns.map(value) {
            [Some(x), Some(y), Some(z)] => points.push(DVec3::new(x, y, z)),
            _ if points.is_empty() => columns = named(&cells).unwrap_or(columns),
            _ => {
                return Err(Wrong {
                    place: format!("line {}", n + 1),
                    message:
                        "no x, y, z there: take the line out, or write nan for what was not seen"
                            .to_owned(),
                });
            }
        }
    }
    Ok(points)
}

/// The columns called x, y and z: by that letter alone, or followed by what is no letter (`x_mm`, `X[mm]`).
fn named(cells: &[&str]) -> Option<[usize; 3]> {
    let is = |cell: &&str, name: char| {
        let mut letters = cell.trim_matches(['"', '\'']).chars();
        letters
            .next()
            .is_some_and(|c| c.eq_ignore_ascii_case(&name))
            && letters.next().is_none_or(|c| !c.is_alphabetic())
    };
    let at = |name| cells.iter().position(|cell| is(cell, name));
    Some([at('x')?, at('y')?, at('z')?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, text: &[u8]) -> Result<Cloud, CloudError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        Cloud::read(&path)
    }

    #[test]
    fn lines_between_blanks_commas_and_semicolons() {
        let wanted = vec![DVec3::new(1.0, 2.5, -3.0), DVec3::new(4.0, 5.0, 6e-1)];
        for (name, text) in [
            ("a.xyz", "1 2.5 -3\n4  5\t6e-1\n"),
            ("a.pts", "2\n1 2.5 -3 120 0 0 0\n4 5 0.6 121 0 0 0\n"),
            ("a.csv", "x,y,z\n1,2.5,-3\n4,5,0.6\n"),
            (
                "a.csv",
                "n,intensity,\"x_mm\",Y,z[mm]\n1,9,1,2.5,-3\n2,9,4,5,0.6\n",
            ),
            ("a.TXT", "# scan\nX;Y;Z\n1;2,5;-3\n4;5;0,6\n"),
        ] {
            assert_eq!(
                read(name, text.as_bytes()).unwrap().points,
                wanted,
                "{name}"
            );
        }
    }

    #[test]
    fn a_mesh_gives_its_corners() {
        let facet = "solid scan\nfacet normal 0 0 1\nouter loop\nvertex 1 2.5 -3\nvertex 4 5 0.6\nvertex 0 0 0\nendloop\nendfacet\nendsolid\n";
        let cloud = read("a.stl", facet.as_bytes()).unwrap();
        assert_eq!(cloud.points.len(), 3);
        assert!((cloud.points[1] - DVec3::new(4.0, 5.0, 0.6)).length() < 1e-6);
        assert!(
            read("a.stl", b"solid")
                .unwrap_err()
                .to_string()
                .contains("a.stl")
        );
    }

    #[test]
    fn what_was_not_seen_is_counted() {
        let cloud = read("a.xyz", b"1 2 3\nnan nan nan\n4 5 6\n").unwrap();
        assert_eq!((cloud.points.len(), cloud.unseen), (2, 1));
    }

    #[test]
    fn a_line_without_a_point_is_told_by_its_number() {
        let error = read("a.xyz", b"1 2 3\n4 5\n").unwrap_err().to_string();
        assert!(error.contains("line 2"), "{error}");
        let kind = read("a.las", b"").unwrap_err().to_string();
        assert!(kind.contains(".ply"), "{kind}");
    }
}
