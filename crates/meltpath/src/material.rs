//! Materials of heat: those that ship, from `meltpath_data::materials`, and files of the user's own. One way for
//! electron beams, lasers and fits.

use std::path::{Path, PathBuf};

use meltpath_base::Provenance;
use meltpath_base::settings::Problem;
use meltpath_data::materials;
use meltpath_thermal::material::enthalpy::{CurveError, Enthalpy};
use meltpath_thermal::material::file::{Readings, read, sources};
use meltpath_thermal::material::{CELSIUS, Material};

use crate::data::{DataFileError, DataText};

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

/// The material `name`: one that ships, or, where the name ends in `.toml`, a file relative to `folder`; with `readings` where
/// its source is damaged.
///
/// ```
/// use meltpath::material::load;
/// use meltpath_thermal::material::file::Readings;
/// let here = std::path::Path::new(".");
/// assert!(load("in625-laser", Readings::default(), here).unwrap().material.absorptivity.is_some());
/// let refused = load("gold", Readings::default(), here).unwrap_err().to_string();
/// assert!(refused.contains("known are \"in625-laser\", \"in718-laser\", \"ti6al4v-ebm\""));
/// ```
///
/// # Errors
/// [`DataFileError`] listing what ships, or saying what is wrong with the file.
pub fn load(name: &str, readings: Readings, folder: &Path) -> Result<Loaded, DataFileError> {
    let text = DataText::load("material", name, materials::ALL, folder)?;
    let material = text.read(|text| {
        let material = read(text, readings)?;
        // laws that no solver can use are told here, before anything runs
        Enthalpy::new(&material).map_err(|e| unusable(text, &material, &e))?;
        Ok(material)
    })?;
    let sources = text.read(sources)?;
    Ok(Loaded {
        material,
        file: text.file,
        sources,
    })
}

/// What is wrong with the laws of a material, at the table of the law in its file.
fn unusable(text: &str, material: &Material, error: &CurveError) -> Problem {
    let problem = Problem::new(error.to_string());
    let CurveError::Law {
        celsius, capacity, ..
    } = error
    else {
        return problem;
    };
    let key = if *capacity > 0.0 {
        "conductivity"
    } else {
        "specific_heat"
    };
    let melted = celsius + CELSIUS > material.solidus;
    let tables =
        [if melted { "liquid" } else { "solid" }, "solid"].map(|of| format!("[{key}.{of}]"));
    let place = tables
        .iter()
        .find_map(|table| Some((text.find(table.as_str())?, table.len())));
    let help = "read the signs and units of its numbers again, and `about`, the temperature that they are counted from";
    match place {
        Some((from, length)) => problem.at(Some(from..from + length)).help(help),
        None => problem.help(help),
    }
}
