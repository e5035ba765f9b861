//! Materials from TOML files in which every number carries its unit and its source.

use std::collections::BTreeMap;

use meltpath_base::choice;
use serde::Deserialize;

use crate::material::law::Law;
use crate::material::{
    CELSIUS, Evaporation, LatentShape, Material, Powder, PowderConduction, Roughness,
};

choice! {
    /// How the porosity law of the thesis is read (erratum E1).
    pub enum PorosityReading {
        /// Porosity falls from its initial value to 0 at the solidus.
        Physical = "physical",
        /// The printed law is a relative density.
        PrintedAsDensity = "printed-as-density",
    }

    /// Which density cells of the thesis are used (erratum E2).
    pub enum DensityReading {
        /// Solid and liquid cells exchanged, so that density falls on melting.
        Corrected = "corrected",
        /// As printed.
        Printed = "printed",
    }
}

/// Choices among readings of a damaged source, all visible in the job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readings {
    /// Erratum E1.
    pub porosity: PorosityReading,
    /// Erratum E2.
    pub density: DensityReading,
    /// Initial porosity in place of the file's, 0 to 1; only for [`PorosityReading::Physical`].
    pub initial_porosity: Option<f64>,
    /// Share of the solid's conductivity that fresh powder has, in place of its relative density.
    pub powder_conductivity: Option<f64>,
}

impl Default for Readings {
    fn default() -> Self {
        Readings {
            porosity: PorosityReading::Physical,
            density: DensityReading::Corrected,
            initial_porosity: None,
            powder_conductivity: None,
        }
    }
}

/// Why a material file was refused.
#[derive(Debug, thiserror::Error)]
pub enum MaterialError {
    /// Not TOML, an unknown key or a missing one.
    #[error("the material file does not read: {0}")]
    Syntax(#[from] toml::de::Error),
    /// A schema this version does not know.
    #[error("the material file has schema {found}: this version reads schema 1")]
    Schema {
        /// What the file says.
        found: u32,
    },
    /// A number in another unit than the one expected.
    #[error("`{key}` is in \"{found}\": write it in \"{expected}\"")]
    Unit {
        /// Key of the number.
        key: &'static str,
        /// Unit in the file.
        found: String,
        /// Unit expected.
        expected: &'static str,
    },
    /// A number whose source the file does not list.
    #[error("`{key}` names the source \"{name}\", which [sources] does not list")]
    Source {
        /// Key of the number.
        key: &'static str,
        /// The source named.
        name: String,
    },
    /// A law with no coefficients, or both forms at once.
    #[error("`{key}` needs `polynomial` with at least one finite coefficient")]
    Law {
        /// Key of the law.
        key: &'static str,
    },
    /// Values that contradict each other or physics.
    #[error("{what}")]
    Value {
        /// What is wrong and what would be right.
        what: String,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Number<T = f64> {
    value: T,
    unit: String,
    source: String,
    #[serde(rename = "page")]
    _page: String,
    #[serde(rename = "uncertainty")]
    _uncertainty: Option<String>,
    #[serde(rename = "note")]
    _note: Option<String>,
    shape: Option<Shape>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "kebab-case")]
enum Shape {
    Triangular,
    Uniform,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LawEntry {
    polynomial: Vec<f64>,
    #[serde(default)]
    about: f64,
    unit: String,
    source: String,
    #[serde(rename = "page")]
    _page: String,
    #[serde(rename = "uncertainty")]
    _uncertainty: Option<String>,
    #[serde(rename = "note")]
    _note: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CornersEntry {
    relative_density: Vec<[f64; 2]>,
    unit: String,
    source: String,
    #[serde(rename = "page")]
    _page: String,
    #[serde(rename = "note")]
    _note: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TwoStates {
    solid: LawEntry,
    liquid: LawEntry,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DensityEntry {
    corrected: TwoStates,
    printed: Option<TwoStates>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PorosityEntry {
    initial: Number,
    printed: Option<CornersEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EmissivityEntry {
    powder: Number,
    dense: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EvaporationEntry {
    boiling: Number,
    latent: Number,
    molar_mass: Number,
    net_fraction: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RoughnessEntry {
    in_plane: Number<[f64; 3]>,
    along_build: Number<[f64; 3]>,
    any_face: Number<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: u32,
    name: String,
    sources: BTreeMap<String, String>,
    range: Number<[f64; 2]>,
    consolidation: Number,
    solidus: Number,
    liquidus: Number,
    latent: Number,
    conductivity: TwoStates,
    specific_heat: TwoStates,
    density: DensityEntry,
    porosity: PorosityEntry,
    emissivity: EmissivityEntry,
    // belongs to the machine's surroundings; kept beside the laws because the thesis states them together
    heat_shield: Option<Number>,
    evaporation: Option<EvaporationEntry>,
    scaling: Option<Number<[f64; 2]>>,
    roughness: Option<RoughnessEntry>,
    absorptivity: Option<Number>,
}

struct Checker<'a> {
    sources: &'a BTreeMap<String, String>,
}

impl Checker<'_> {
    fn entry(
        &self,
        key: &'static str,
        unit: &str,
        source: &str,
        expected: &'static str,
    ) -> Result<(), MaterialError> {
        if unit != expected {
            return Err(MaterialError::Unit {
                key,
                found: unit.to_owned(),
                expected,
            });
        }
        if !self.sources.contains_key(source) {
            return Err(MaterialError::Source {
                key,
                name: source.to_owned(),
            });
        }
        Ok(())
    }

    fn number(
        &self,
        key: &'static str,
        number: &Number,
        expected: &'static str,
    ) -> Result<f64, MaterialError> {
        self.entry(key, &number.unit, &number.source, expected)?;
        let value = number.value;
        if !value.is_finite() || value < 0.0 {
            return Err(MaterialError::Value {
                what: format!("`{key}` is {value}: it must be finite and not negative"),
            });
        }
        Ok(value)
    }

    fn numbers<const N: usize>(
        &self,
        key: &'static str,
        numbers: &Number<[f64; N]>,
        expected: &'static str,
    ) -> Result<[f64; N], MaterialError> {
        self.entry(key, &numbers.unit, &numbers.source, expected)?;
        if numbers.value.iter().any(|v| !v.is_finite() || *v <= 0.0) {
            return Err(MaterialError::Value {
                what: format!(
                    "`{key}` is {:?}: all must be finite and above 0",
                    numbers.value
                ),
            });
        }
        Ok(numbers.value)
    }

    fn law(
        &self,
        key: &'static str,
        law: &LawEntry,
        expected: &'static str,
    ) -> Result<Law, MaterialError> {
        self.entry(key, &law.unit, &law.source, expected)?;
        let finite = law
            .polynomial
            .iter()
            .chain([&law.about])
            .all(|c| c.is_finite());
        if law.polynomial.is_empty() || !finite {
            return Err(MaterialError::Law { key });
        }
        Ok(Law::Polynomial {
            about: law.about + CELSIUS,
            coefficients: law.polynomial.clone(),
        })
    }
}

/// Reads a material from the text of its file, with the `readings` chosen where its source is damaged.
///
/// # Errors
/// [`MaterialError`] naming the key and what to write.
///
/// ```
/// use meltpath_thermal::material::file::{Readings, read};
/// let text = meltpath_data::materials::TI6AL4V_EBM.text;
/// let titanium = read(text, Readings::default()).unwrap();
/// assert!((titanium.conductivity(1605.0 + 273.15) - 27.0625e-3).abs() < 1e-9);
/// ```
pub fn read(text: &str, readings: Readings) -> Result<Material, MaterialError> {
    let file: File = toml::from_str(text)?;
    if file.schema != 1 {
        return Err(MaterialError::Schema { found: file.schema });
    }
    let checker = Checker {
        sources: &file.sources,
    };
    checker.entry("range", &file.range.unit, &file.range.source, "°C")?;
    let kelvin =
        |key, number: &Number| Ok::<_, MaterialError>(checker.number(key, number, "°C")? + CELSIUS);
    let start = kelvin("consolidation", &file.consolidation)?;
    let solidus = kelvin("solidus", &file.solidus)?;
    let liquidus = kelvin("liquidus", &file.liquidus)?;
    if let Some(shield) = &file.heat_shield {
        checker.number("heat_shield", shield, "°C")?;
    }
    let density = match readings.density {
        DensityReading::Corrected => &file.density.corrected,
        DensityReading::Printed => {
            file.density
                .printed
                .as_ref()
                .ok_or_else(|| MaterialError::Value {
                    what: "the reading `density = \"printed\"` needs [density.printed] in the material file".to_owned(),
                })?
        }
    };
    let evaporation = evaporation(&checker, &file)?;
    let scaling = file.scaling.as_ref();
    let scaling = scaling.map_or(Ok([1.0; 2]), |s| checker.numbers("scaling", s, "1"))?;
    let roughness = roughness(&checker, &file)?;
    let absorptivity = match &file.absorptivity {
        None => None,
        Some(a) => Some(checker.number("absorptivity", a, "1")?),
    };
    let material = Material {
        name: file.name.clone(),
        range: file.range.value.map(|t| t + CELSIUS),
        start,
        solidus,
        liquidus,
        latent: checker.number("latent", &file.latent, "J/kg")?,
        latent_shape: match file.latent.shape {
            Some(Shape::Triangular) => LatentShape::Triangular,
            Some(Shape::Uniform) | None => LatentShape::Uniform,
        },
        density_solid: checker.law("density.solid", &density.solid, "kg/m³")?,
        density_liquid: checker.law("density.liquid", &density.liquid, "kg/m³")?,
        specific_heat_solid: checker.law(
            "specific_heat.solid",
            &file.specific_heat.solid,
            "J/(kg·K)",
        )?,
        specific_heat_liquid: checker.law(
            "specific_heat.liquid",
            &file.specific_heat.liquid,
            "J/(kg·K)",
        )?,
        conductivity_solid: checker.law(
            "conductivity.solid",
            &file.conductivity.solid,
            "W/(m·K)",
        )?,
        conductivity_liquid: checker.law(
            "conductivity.liquid",
            &file.conductivity.liquid,
            "W/(m·K)",
        )?,
        powder: Powder {
            relative_density: relative_density(&checker, &file.porosity, readings, start, solidus)?,
            conduction: match readings.powder_conductivity {
                None => PowderConduction::Proportional,
                Some(share) if share > 0.0 && share <= 1.0 => PowderConduction::Ratio(share),
                Some(share) => {
                    return Err(MaterialError::Value {
                        what: format!(
                            "powder_conductivity is {share}: it is a share of the solid's, above 0 and at most 1"
                        ),
                    });
                }
            },
            emissivity: checker.number("emissivity.powder", &file.emissivity.powder, "1")?,
        },
        emissivity: checker.number("emissivity.dense", &file.emissivity.dense, "1")?,
        evaporation,
        scaling,
        roughness,
        absorptivity,
    };
    in_order(&material)?;
    Ok(material)
}

fn evaporation(checker: &Checker<'_>, file: &File) -> Result<Option<Evaporation>, MaterialError> {
    Ok(match &file.evaporation {
        None => None,
        Some(e) => Some(Evaporation {
            boiling: checker.number("evaporation.boiling", &e.boiling, "°C")? + CELSIUS,
            latent: checker.number("evaporation.latent", &e.latent, "J/kg")?,
            molar_mass: checker.number("evaporation.molar_mass", &e.molar_mass, "kg/mol")?,
            net_fraction: checker.number("evaporation.net_fraction", &e.net_fraction, "1")?,
        }),
    })
}

fn roughness(checker: &Checker<'_>, file: &File) -> Result<Option<Roughness>, MaterialError> {
    Ok(match &file.roughness {
        None => None,
        Some(r) => Some(Roughness {
            in_plane: checker.numbers("roughness.in_plane", &r.in_plane, "µm")?,
            along_build: checker.numbers("roughness.along_build", &r.along_build, "µm")?,
            any_face: checker.numbers("roughness.any_face", &r.any_face, "µm")?,
        }),
    })
}

/// Refuses temperatures out of their order, and laws that do not reach them.
fn in_order(material: &Material) -> Result<(), MaterialError> {
    let [low, high] = material.range;
    let (start, solidus, liquidus) = (material.start, material.solidus, material.liquidus);
    if !(low <= start && liquidus < high) {
        return Err(MaterialError::Value {
            what: format!(
                "`range` is {:.0} to {:.0} °C: the laws must hold from the consolidation, {:.0} °C, to above the liquidus, {:.0} °C",
                low - CELSIUS,
                high - CELSIUS,
                start - CELSIUS,
                liquidus - CELSIUS
            ),
        });
    }
    if !(start < solidus && solidus < liquidus) {
        return Err(MaterialError::Value {
            what: format!(
                "consolidation {:.0} °C, solidus {:.0} °C and liquidus {:.0} °C must increase",
                start - CELSIUS,
                solidus - CELSIUS,
                liquidus - CELSIUS
            ),
        });
    }
    Ok(())
}

/// The sources that a material file lists, in the order of their names.
///
/// # Errors
/// [`MaterialError::Syntax`].
pub fn sources(text: &str) -> Result<Vec<String>, MaterialError> {
    let file: File = toml::from_str(text)?;
    Ok(file.sources.into_values().collect())
}

fn relative_density(
    checker: &Checker,
    entry: &PorosityEntry,
    readings: Readings,
    start: f64,
    solidus: f64,
) -> Result<Law, MaterialError> {
    match readings.porosity {
        PorosityReading::Physical => {
            let porosity = match readings.initial_porosity {
                Some(value) => value,
                None => checker.number("porosity.initial", &entry.initial, "1")?,
            };
            if !(0.0..0.95).contains(&porosity) {
                return Err(MaterialError::Value {
                    what: format!("initial porosity {porosity}: it is a share from 0 to 0.95"),
                });
            }
            Ok(Law::Table {
                corners: vec![[start, 1.0 - porosity], [solidus, 1.0]],
            })
        }
        PorosityReading::PrintedAsDensity => {
            let printed = entry.printed.as_ref().ok_or_else(|| MaterialError::Value {
                what: "the reading `porosity = \"printed-as-density\"` needs [porosity.printed] in the material file".to_owned(),
            })?;
            checker.entry("porosity.printed", &printed.unit, &printed.source, "1")?;
            let corners: Vec<_> = printed
                .relative_density
                .iter()
                .map(|&[t, v]| [t + CELSIUS, v])
                .collect();
            if corners.len() < 2 || !corners.windows(2).all(|w| w[0][0] < w[1][0]) {
                return Err(MaterialError::Law {
                    key: "porosity.printed",
                });
            }
            Ok(Law::Table { corners })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TITANIUM: &str = meltpath_data::materials::TI6AL4V_EBM.text;

    #[test]
    fn a_wrong_unit_is_named_with_the_right_one() {
        let text = TITANIUM.replacen("unit = \"J/kg\"", "unit = \"kJ/kg\"", 1);
        let error = read(&text, Readings::default()).unwrap_err().to_string();
        assert_eq!(error, "`latent` is in \"kJ/kg\": write it in \"J/kg\"");
    }

    #[test]
    fn an_unknown_key_and_an_unlisted_source_are_refused() {
        let text = TITANIUM.replacen("[solidus]", "[solidus]\ncolour = 1", 1);
        assert!(matches!(
            read(&text, Readings::default()),
            Err(MaterialError::Syntax(_))
        ));
        let text = TITANIUM.replacen("source = \"iupac-2021\"", "source = \"hearsay\"", 1);
        assert!(matches!(
            read(&text, Readings::default()),
            Err(MaterialError::Source { .. })
        ));
    }

    #[test]
    fn laws_that_do_not_reach_the_melt_are_refused() {
        let text = TITANIUM.replacen("[750.0, 3000.0]", "[750.0, 1650.0]", 1);
        let error = read(&text, Readings::default()).unwrap_err().to_string();
        assert!(error.contains("above the liquidus, 1665 °C"), "{error}");
        assert_eq!(sources(TITANIUM).unwrap().len(), 4);
    }

    #[test]
    fn readings_change_what_they_say() {
        let read = |readings| read(TITANIUM, readings).unwrap();
        let at = 750.0 + CELSIUS;
        let printed = read(Readings {
            porosity: PorosityReading::PrintedAsDensity,
            ..Readings::default()
        });
        assert!((printed.relative_density(at) - 0.3725).abs() < 1e-12);
        let swapped = read(Readings {
            density: DensityReading::Printed,
            ..Readings::default()
        });
        assert!(swapped.density(1700.0 + CELSIUS) > 4100.0);
        assert!((read(Readings::default()).density(at) - 4308.75).abs() < 1e-9);
        let loose = read(Readings {
            powder_conductivity: Some(0.15),
            ..Readings::default()
        });
        let [a, b] = loose.powder_conduction();
        assert!((a + b * 0.62 - 0.15).abs() < 1e-12 && (a + b - 1.0).abs() < 1e-12);
    }
}
