//! Materials of heat: those that ship, from `meltpath_data::materials`, and files of the user's own. One way for
//! electron beams, lasers and fits.

use std::path::{Path, PathBuf};

use meltpath_base::Provenance;
use meltpath_data::{find, materials, names};
use meltpath_thermal::material::Material;
use meltpath_thermal::material::enthalpy::Enthalpy;
use meltpath_thermal::material::file::{Readings, read, sources};

/// A material and where it comes from.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The material.
    pub material: Material,
    /// Its file, where it is the user's own.
    pub file: Option<PathBuf>,
    /// The sources that the file lists.
    pub sources: Vec<String>,
}

impl Loaded {
    /// Notes the material, its sources and its file.
    pub fn tell(&self, provenance: &mut Provenance) {
        let from = match &self.file {
            Some(file) => file.display().to_string(),
            None => "shipped with meltpath".to_owned(),
        };
        let words = format!(
            "{} ({from}): {}",
            self.material.name,
            self.sources.join("; ")
        );
        provenance.model("material", &words);
    }
}

/// Why a material cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MaterialFileError {
    /// No material of that name ships, and it is no file.
    #[error(
        "there is no material \"{name}\"; known are {known}; or name a TOML file of your own, such as a changed copy of one in crates/data/materials of the source"
    )]
    Unknown {
        /// What was asked.
        name: String,
        /// What ships.
        known: String,
    },
    /// A file that cannot be read.
    #[error("cannot read the material {}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A material whose content is wrong.
    #[error("the material \"{name}\" is not sound: {reason}")]
    Content {
        /// Its name or file.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
}

/// The material `name`: one that ships, or, where the name ends in `.toml`, a file relative to `folder`; with `readings` where
/// its source is damaged.
///
/// ```
/// use meltpath::material::load;
/// use meltpath_thermal::material::file::Readings;
/// let here = std::path::Path::new(".");
/// assert!(load("in625-laser", Readings::default(), here).unwrap().material.absorptivity.is_some());
/// let refused = load("gold", Readings::default(), here).unwrap_err().to_string();
/// assert!(refused.contains("known are \"ti6al4v-ebm\", \"in625-laser\""));
/// ```
///
/// # Errors
/// [`MaterialFileError`] listing what ships, or saying what is wrong with the file.
pub fn load(name: &str, readings: Readings, folder: &Path) -> Result<Loaded, MaterialFileError> {
    let (text, file) = match find(materials::ALL, name) {
        Some(shipped) => (shipped.text.to_owned(), None),
        None if crate::data::is_file(name) => {
            let path = folder.join(name);
            let text = std::fs::read_to_string(&path).map_err(|source| MaterialFileError::Io {
                path: path.clone(),
                source,
            })?;
            (text, Some(path))
        }
        None => {
            return Err(MaterialFileError::Unknown {
                name: name.to_owned(),
                known: names(materials::ALL),
            });
        }
    };
    let unsound = |reason: String| MaterialFileError::Content {
        name: name.to_owned(),
        reason,
    };
    let material = read(&text, readings).map_err(|e| unsound(e.to_string()))?;
    let sources = sources(&text).map_err(|e| unsound(e.to_string()))?;
    // laws that no solver can use are told here, before anything runs
    Enthalpy::new(&material).map_err(|e| unsound(e.to_string()))?;
    Ok(Loaded {
        material,
        file,
        sources,
    })
}
