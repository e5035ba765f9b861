//! Robot cells: those that ship, from `meltpath_data::cells`, and files of the user's own.

use std::path::{Path, PathBuf};

use meltpath_data::{cells, find, names};
use meltpath_programs::CellProgramming;
use meltpath_robot::controller::Controller;
use serde::Deserialize;

/// What the robot is.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// Its controller.
    pub controller: String,
    /// Who says so.
    pub source: String,
}

/// A robot cell.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// The robot.
    pub robot: Robot,
    /// How its controller interpolates.
    pub motion: Controller,
    /// How its programs look.
    pub program: CellProgramming,
}

/// Why a cell cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CellFileError {
    /// No cell of that name ships, and it is no file.
    #[error("there is no cell \"{name}\"; known are {known}; or name a TOML file of your own")]
    Unknown {
        /// What was asked.
        name: String,
        /// What ships.
        known: String,
    },
    /// A file that cannot be read.
    #[error("cannot read the cell {}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A cell whose content is wrong.
    #[error("the cell \"{name}\" is not sound: {reason}")]
    Content {
        /// Its name or file.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
}

/// Whether a name means a file of the user's own.
pub fn is_file(name: &str) -> bool {
    Path::new(name)
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

impl Cell {
    /// The cell `name`: one that ships, or, where the name ends in `.toml`, a file relative to `folder`.
    ///
    /// ```
    /// use meltpath::data::Cell;
    /// let here = std::path::Path::new(".");
    /// assert_eq!(Cell::load("arcmate-120ic", here).unwrap().robot.controller, "R-30iB");
    /// assert!(Cell::load("nowhere", here).unwrap_err().to_string().contains("arcmate-120ic"));
    /// ```
    ///
    /// # Errors
    /// [`CellFileError`] listing what ships, or saying what is wrong with the file.
    pub fn load(name: &str, folder: &Path) -> Result<Self, CellFileError> {
        let text = match find(cells::ALL, name) {
            Some(shipped) => shipped.text.to_owned(),
            None if is_file(name) => {
                let path = folder.join(name);
                std::fs::read_to_string(&path)
                    .map_err(|source| CellFileError::Io { path, source })?
            }
            None => {
                return Err(CellFileError::Unknown {
                    name: name.to_owned(),
                    known: names(cells::ALL),
                });
            }
        };
        let content = |reason: String| CellFileError::Content {
            name: name.to_owned(),
            reason,
        };
        let cell: Cell = toml::from_str(&text).map_err(|e| content(e.to_string()))?;
        cell.motion.check().map_err(|e| content(e.to_string()))?;
        cell.program.check().map_err(|e| content(e.to_string()))?;
        Ok(cell)
    }
}
