//! The data that ships, and files of the user's own: found by name, read by their declarations, refused with their places.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use meltpath_base::settings::{self, Problem, Problems, Setting};
use meltpath_base::{Reporter, table};
use meltpath_data::{File, cells};
use meltpath_programs::CellProgramming;
use meltpath_robot::cell as robot;
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

/// The folder of data files of one's own that every job finds by their names: `MELTPATH_DATA` where that is set, else `meltpath` in
/// the folder of settings (`XDG_CONFIG_HOME`, else `~/.config`; `%APPDATA%` on Windows).
fn user_folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    if let Some(folder) = set("MELTPATH_DATA") {
        return Some(folder.into());
    }
    let settings = if cfg!(windows) {
        set("APPDATA").map(PathBuf::from)
    } else {
        let home = || std::env::home_dir().map(|home| home.join(".config"));
        set("XDG_CONFIG_HOME").map(PathBuf::from).or_else(home)
    };
    settings.map(|folder| folder.join("meltpath"))
}

/// Where files of one kind are looked for by name before those that ship: `data` beside the job, then the folder of the user.
fn own_folders(shipped: &[File], folder: &Path) -> Vec<PathBuf> {
    let Some(kind) = shipped.first().map(|file| file.kind) else {
        return Vec::new();
    };
    let all = [Some(folder.join("data")), user_folder()];
    all.into_iter()
        .flatten()
        .map(|own| own.join(kind))
        .collect()
}

/// The file of the user's own that a job in `folder` finds by `name`, whatever its kind; with its kind and name, `wires/mine.toml`.
pub(crate) fn own_file(name: &str, folder: &Path) -> Option<(String, PathBuf)> {
    if name.contains(['/', '\\']) || is_file(name) {
        return None;
    }
    meltpath_data::FOLDERS.iter().find_map(|shipped| {
        let kind = shipped.first()?.kind;
        let file = own_folders(shipped, folder).into_iter().find_map(|own| {
            let file = own.join(format!("{name}.toml"));
            file.is_file().then_some(file)
        })?;
        Some((format!("{kind}/{name}.toml"), file))
    })
}

/// The text of a data file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataText {
    /// What it was called by.
    pub name: String,
    /// Its folder, such as `wires`.
    pub kind: &'static str,
    /// What is written in it.
    pub text: String,
    /// The file, where it is the user's own.
    pub file: Option<PathBuf>,
}

/// Every data file of a kind that a job in `folder` finds by its name, in the order of the names: of two of a name the one that wins,
/// beside the job before the user's folder before those that ship.
pub fn known(shipped: &'static [File], folder: &Path) -> Vec<DataText> {
    let mut all = BTreeMap::new();
    for file in shipped {
        let found = DataText {
            name: file.name.to_owned(),
            kind: file.kind,
            text: file.text.to_owned(),
            file: None,
        };
        all.insert(file.name.to_owned(), found);
    }
    for own in own_folders(shipped, folder).into_iter().rev() {
        // a folder that is not there holds nothing
        for entry in std::fs::read_dir(own).into_iter().flatten().flatten() {
            let path = entry.path();
            let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned());
            if let Some(name) = stem.filter(|_| is_file(&path.to_string_lossy()))
                && let Ok(text) = std::fs::read_to_string(&path)
            {
                let found = DataText {
                    name: name.clone(),
                    kind: shipped[0].kind,
                    text,
                    file: Some(path),
                };
                all.insert(name, found);
            }
        }
    }
    all.into_values().collect()
}

impl DataText {
    /// The text called `name`: where the name ends in `.toml`, of that file, relative to `folder`; else the one that wins by that name
    /// ([`known`]).
    ///
    /// # Errors
    /// [`DataFileError`] listing what is known, or saying why the file cannot be read.
    pub fn load(
        what: &'static str,
        name: &str,
        shipped: &'static [File],
        folder: &Path,
    ) -> Result<Self, DataFileError> {
        if is_file(name) {
            let path = folder.join(name);
            let text = crate::text_file::read(&path).map_err(|source| DataFileError::Io {
                what,
                path: path.clone(),
                source,
            })?;
            return Ok(DataText {
                name: name.to_owned(),
                kind: shipped.first().map_or("", |file| file.kind),
                text,
                file: Some(path),
            });
        }
        let mut all = known(shipped, folder);
        match all.iter().position(|found| found.name == name) {
            Some(at) => Ok(all.swap_remove(at)),
            None => Err(DataFileError::Unknown {
                what,
                name: name.to_owned(),
                known: all
                    .iter()
                    .map(|f| format!("\"{}\"", f.name))
                    .collect::<Vec<_>>()
                    .join(", "),
            }),
        }
    }

    /// Where it comes from, for people.
    pub fn origin(&self) -> String {
        match &self.file {
            Some(file) => file.display().to_string(),
            None => "shipped with meltpath".to_owned(),
        }
    }

    /// Warns where a file of one's own, found by its name, takes the place of one that ships.
    pub fn warn(&self, shipped: &[File], reporter: &Reporter) {
        if let Some(file) = &self.file
            && shipped.iter().any(|f| f.name == self.name)
        {
            reporter.warn(
                "data-file-hides-shipped",
                format!(
                    "\"{}\" is {}, not the one that ships with meltpath",
                    self.name,
                    file.display()
                ),
                "give your own file a name of its own, unless this is meant",
            );
        }
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

impl DataText {
    /// The robot of a robot's file, with what it takes from the files beside it.
    ///
    /// # Errors
    /// [`DataFileError::Content`].
    pub fn robot(&self) -> Result<robot::Cell, DataFileError> {
        self.read(|text| match self.file.as_deref().and_then(Path::parent) {
            Some(folder) => robot::read_beside(text, folder),
            None => robot::read(text),
        })
    }
}

table! {
    /// A robot cell: how its controller interpolates, how its programs look.
    pub struct Cell {
        /// The robot.
        robot: Robot => required;
        /// How its controller interpolates.
        motion: Controller => none("speeds at corners are not known: what follows from them cannot be said");
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
        Self::of(&DataText::load("cell", name, cells::ALL, folder)?)
    }

    /// The cell of a file.
    ///
    /// # Errors
    /// [`DataFileError::Content`].
    pub fn of(text: &DataText) -> Result<Self, DataFileError> {
        text.read(|text| {
            settings::parse(text, |cell: &Cell| {
                cell.motion
                    .as_ref()
                    .map_or_else(Vec::new, Controller::check)
            })
        })
    }
}
