//! The data that ships, and files of the user's own: found by name, read by their declarations, refused with their places.

use std::path::{Path, PathBuf};

use meltpath_base::settings::{self, Problem, Problems, Setting};
use meltpath_base::table;
use meltpath_data::{File, cells, find, names};
use meltpath_programs::CellProgramming;
use meltpath_robot::controller::Controller;

/// Why a data file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DataFileError {
    /// None of that name ships, and it is no file.
    #[error("there is no {what} \"{name}\"; known are {known}; or name a TOML file of your own")]
    Unknown {
        /// What was looked for.
        what: &'static str,
        /// What was asked.
        name: String,
        /// What ships.
        known: String,
    },
    /// A file that cannot be read.
    #[error("cannot read the {what} {}: {source}", .path.display())]
    Io {
        /// What was looked for.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// What is written in it is wrong.
    #[error(transparent)]
    Content(#[from] Problems),
}

impl DataFileError {
    /// As problems of the key that names the file; those of its content keep their place in it.
    pub fn at<T>(self, key: &Setting<T>) -> Vec<Problem> {
        match self {
            DataFileError::Content(problems) => problems.0,
            DataFileError::Unknown { .. } | DataFileError::Io { .. } => {
                vec![key.problem(self.to_string())]
            }
        }
    }
}

/// Whether a name means a file of the user's own.
pub fn is_file(name: &str) -> bool {
    Path::new(name)
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// The text of a data file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataText {
    /// What it was called by.
    pub name: String,
    /// What is written in it.
    pub text: String,
    /// The file, where it is the user's own.
    pub file: Option<PathBuf>,
}

impl DataText {
    /// The text called `name`: of a file that ships, or, where the name ends in `.toml`, of one relative to `folder`.
    ///
    /// # Errors
    /// [`DataFileError`] listing what ships, or saying why the file cannot be read.
    pub fn load(
        what: &'static str,
        name: &str,
        shipped: &'static [File],
        folder: &Path,
    ) -> Result<Self, DataFileError> {
        let (text, file) = match find(shipped, name) {
            Some(shipped) => (shipped.text.to_owned(), None),
            None if is_file(name) => {
                let path = folder.join(name);
                let text = std::fs::read_to_string(&path).map_err(|source| DataFileError::Io {
                    what,
                    path: path.clone(),
                    source,
                })?;
                (text, Some(path))
            }
            None => {
                return Err(DataFileError::Unknown {
                    what,
                    name: name.to_owned(),
                    known: names(shipped),
                });
            }
        };
        Ok(DataText {
            name: name.to_owned(),
            text,
            file,
        })
    }

    /// What `read` makes of it.
    ///
    /// # Errors
    /// [`DataFileError::Content`], each problem with its place in the file.
    pub fn read<T>(
        &self,
        read: impl FnOnce(&str) -> Result<T, Problems>,
    ) -> Result<T, DataFileError> {
        let name = match &self.file {
            Some(file) => file.display().to_string(),
            None => self.name.clone(),
        };
        Ok(read(&self.text).map_err(|problems| problems.of_file(&name, &self.text))?)
    }
}

table! {
    /// A robot cell: how its controller interpolates, how its programs look.
    pub struct Cell {
        /// The robot.
        robot: Robot => required;
        /// How its controller interpolates.
        motion: Controller => required;
        /// How its programs look.
        program: CellProgramming => required;
    }

    /// What the robot is.
    pub struct Robot {
        /// Its name.
        name: String => required;
        /// Its controller.
        controller: String => required;
        /// Who says so.
        source: String => required;
    }
}

impl Cell {
    /// The cell `name`: one that ships, or, where the name ends in `.toml`, a file relative to `folder`.
    ///
    /// ```
    /// use meltpath::data::Cell;
    /// let here = std::path::Path::new(".");
    /// assert_eq!(*Cell::load("arcmate-120ic", here).unwrap().robot.controller, "R-30iB");
    /// assert!(Cell::load("nowhere", here).unwrap_err().to_string().contains("arcmate-120ic"));
    /// ```
    ///
    /// # Errors
    /// [`DataFileError`] listing what ships, or saying what is wrong with the file.
    pub fn load(name: &str, folder: &Path) -> Result<Self, DataFileError> {
        let text = DataText::load("cell", name, cells::ALL, folder)?;
        text.read(|text| settings::parse(text, |cell: &Cell| cell.motion.check()))
    }
}
