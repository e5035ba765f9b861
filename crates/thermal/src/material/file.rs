//! Materials from TOML files in which every number carries its unit and its source.

mod powder;
mod units;

use std::collections::BTreeMap;

use meltpath_base::number::significant;
use meltpath_base::settings::{self, Datum, Many, Problem, Problems, UnitOf, broken, nearest};
use meltpath_base::{Density, Pure, Temperature, choice, table};
use toml::de::{DeTable, DeValue};

pub use self::powder::{PowderConductivityTable, PowderReading};
pub use self::units::{
    Conductivity, MolarEnergy, MolarMass, Ra, SpecificEnergy, SpecificHeat, Tension,
};
use crate::material::law::Law;
use crate::material::vapour::{Component, Evaporation};
use crate::material::{CELSIUS, LatentShape, Material, Powder, PowderConduction, Roughness};

choice! {
    /// How the porosity law of the thesis is read (erratum E1).
    pub enum PorosityReading {
        Physical "physical" => "Porosity falls from its initial value to 0 at the solidus.",
        PrintedAsDensity "printed-as-density" => "The printed law is a relative density.",
    }

    /// Which density cells of the thesis are used (erratum E2).
    pub enum DensityReading {
        Corrected "corrected" => "Solid and liquid cells exchanged, so that density falls on melting.",
        Printed "printed" => "As printed.",
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
    /// How powder conducts.
    pub powder: PowderReading,
}

impl Default for Readings {
    fn default() -> Self {
        Readings {
            porosity: PorosityReading::Physical,
            density: DensityReading::Corrected,
            initial_porosity: None,
            powder: PowderReading::ByDensity,
        }
    }
}

table! {
    /// What a material does with heat. Every number names one of `sources`.
    pub struct MaterialFile {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Name in words.
        name: String => required;
        /// Documents, by the names that the numbers call them by.
        sources: BTreeMap<String, String> => required;
        /// Where the laws are meant to hold.
        range: Datum<[Temperature; 2]> where not_negative => required;
        /// Temperature at which powder begins to become dense, and from which enthalpy is counted.
        consolidation: Datum<Temperature> where not_negative => required;
        /// Solidus.
        solidus: Datum<Temperature> where not_negative => required;
        /// Liquidus.
        liquidus: Datum<Temperature> where not_negative => required;
        /// Latent heat of melting.
        latent: LatentTable => required;
        /// Thermal conductivity of the dense metal.
        conductivity: ConductivityLaws => required;
        /// Specific heat.
        specific_heat: SpecificHeatLaws => required;
        /// Density.
        density: DensityTable => required;
        /// Porosity of powder.
        porosity: PorosityTable => required;
        /// Conductivity of powder as it was measured, beside that by its density.
        powder_conductivity: PowderConductivityTable => none("not measured: by its density");
        /// Emissivity.
        emissivity: EmissivityTable => required;
        /// Temperature of the heat shield above the bed; kept beside the laws because sources state them together.
        heat_shield: Datum<Temperature> where not_negative => none("not said");
        /// Loss by evaporation.
        evaporation: EvaporationTable => none("nothing evaporates");
        /// Surface tension of the melt.
        surface_tension: TensionLaw => none("not known: where vapour moves the pool cannot be told");
        /// What parts are built larger by, in the build plane and along the build direction.
        scaling: Datum<[Pure; 2]> where positive => none("1: no shrinkage");
        /// Roughness of what is built.
        roughness: RoughnessTable => none("not known");
        /// Share of a laser's power that becomes heat where the surface stays nearly flat.
        absorptivity: Datum<Pure> where within(0.0, 1.0) => none("not known: no laser material");
    }

    /// Latent heat.
    pub struct LatentTable {
        /// The number, in `unit`.
        value: f64 where not_negative => required;
        /// Its unit.
        unit: UnitOf<SpecificEnergy> => required;
        /// How it is spread between solidus and liquidus.
        shape: LatentShape => default("uniform", "the simplest");
        /// One of `sources`.
        source: String => required;
        /// Where in it.
        page: String => required;
        /// How well it is known, in words.
        uncertainty: String => none("not known");
        /// How it was read or derived.
        note: String => none("nothing to add");
    }

    /// Density, and as a damaged source prints it.
    pub struct DensityTable {
        /// The density.
        corrected: DensityLaws => required;
        /// As printed.
        printed: DensityLaws => none("the source is not damaged");
    }

    /// Porosity of powder.
    pub struct PorosityTable {
        /// Of fresh powder, a share of its volume.
        initial: Datum<Pure> where not_negative => required;
        /// As a damaged source prints it.
        printed: CornersTable => none("the source is not damaged");
    }

    /// A law by its corners, straight between.
    pub struct CornersTable {
        /// Temperature in °C and relative density of each corner, by increasing temperature.
        relative_density: Many<[f64; 2], 2> => required;
        /// Its unit.
        unit: UnitOf<Pure> => required;
        /// One of `sources`.
        source: String => required;
        /// Where in it.
        page: String => required;
        /// How it was read or derived.
        note: String => none("nothing to add");
    }

    /// Emissivities.
    pub struct EmissivityTable {
        /// Of powder.
        powder: Datum<Pure> where within(0.0, 1.0) => required;
        /// Of dense metal.
        dense: Datum<Pure> where within(0.0, 1.0) => required;
    }

    /// Loss by evaporation from the hottest surfaces: the main component, and what else is in the melt.
    pub struct EvaporationTable {
        /// Name of the main component.
        name: String => default("metal", "a single component needs no name");
        /// Boiling point at atmospheric pressure.
        boiling: Datum<Temperature> where positive => required;
        /// Heat of evaporation.
        latent: Datum<SpecificEnergy> where not_negative => required;
        /// Mass of a mole.
        molar_mass: Datum<MolarMass> where positive => required;
        /// Share of the evaporated flux that does not come back, whatever the gas around.
        net_fraction: Datum<Pure> where within(0.0, 1.0) => none("by the pressure of the gas around (Knight 1979)");
        /// What else evaporates.
        besides: Many<ComponentTable, 0, 3> => default([], "a single component");
    }

    /// A component of the melt besides the main one.
    pub struct ComponentTable {
        /// Its name.
        name: String => required;
        /// Its share of the atoms.
        share: Datum<Pure> where within(0.0, 1.0) => required;
        /// Boiling point of the pure component at atmospheric pressure.
        boiling: Datum<Temperature> where positive => required;
        /// Heat of evaporation.
        latent: Datum<SpecificEnergy> where not_negative => required;
        /// Mass of a mole.
        molar_mass: Datum<MolarMass> where positive => required;
        /// Partial molar excess energy E in the melt: the activity coefficient is exp(E/RT).
        excess: Datum<MolarEnergy> => none("0: an ideal melt (Raoult)");
    }

    /// a0 + a1 (T - about), temperatures in °C.
    pub struct TensionLaw {
        /// a0, a1, in `unit` and per kelvin.
        polynomial: Many<f64, 1, 2> => required;
        /// Temperature in °C from which the law counts.
        about: f64 => default(0.0, "laws against °C");
        /// Its unit.
        unit: UnitOf<Tension> => required;
        /// One of `sources`.
        source: String => required;
        /// Where in it.
        page: String => required;
        /// How well it is known, in words.
        uncertainty: String => none("not known");
        /// How it was read or derived.
        note: String => none("nothing to add");
    }

    /// Arithmetic roughness Ra of what is built.
    pub struct RoughnessTable {
        /// Of vertical faces, in the build plane: mean, least, greatest.
        in_plane: Datum<[Ra; 3]> where positive => required;
        /// Of vertical faces, along the build direction: mean, least, greatest.
        along_build: Datum<[Ra; 3]> where positive => required;
        /// Of faces of any direction: least, greatest.
        any_face: Datum<[Ra; 2]> where positive => required;
    }
}

/// Laws of the solid and the liquid: they differ by what they are laws of, and its unit.
macro_rules! laws {
    ($laws:ident, $law:ident, $quantity:ident) => {
        table! {
            /// A law of the solid and one of the liquid.
            pub struct $laws {
                /// Of the solid.
                solid: $law => required;
                /// Of the liquid.
                liquid: $law => required;
            }

            /// a0 + a1 (T - about) + a2 (T - about)² + …, temperatures in °C.
            pub struct $law {
                /// a0, a1, a2, …, in `unit` and per kelvin.
                polynomial: Many<f64, 1> => required;
                /// Temperature in °C from which the law counts; -273.15 for a law against kelvin.
                about: f64 => default(0.0, "laws against °C");
                /// Its unit.
                unit: UnitOf<$quantity> => required;
                /// One of `sources`.
                source: String => required;
                /// Where in it.
                page: String => required;
                /// How well it is known, in words.
                uncertainty: String => none("not known");
                /// How it was read or derived.
                note: String => none("nothing to add");
            }
        }

        as_law!($law);
    };
}
macro_rules! as_law {
    ($law:ident) => {
        impl $law {
            fn law(&self) -> Law {
                let unit = self.unit.unit;
                let internal = |c: &f64| c * unit.factor / unit.divisor;
                Law::Polynomial {
                    about: *self.about + CELSIUS,
                    coefficients: self.polynomial.iter().map(internal).collect(),
                }
            }
        }
    };
}
as_law!(TensionLaw);
laws!(ConductivityLaws, ConductivityLaw, Conductivity);
laws!(SpecificHeatLaws, SpecificHeatLaw, SpecificHeat);
laws!(DensityLaws, DensityLaw, Density);

/// Refuses laws that no metal has, where a slip of the unit made them.
fn plausible(material: &Material, file: &MaterialFile) -> Result<(), Problem> {
    let kelvins = [material.start, material.solidus, material.liquidus + 1.0];
    let beyond = |law: &dyn Fn(f64) -> f64, [low, high]: [f64; 2]| {
        let values = kelvins.map(|k| (k, law(k)));
        // what is not above zero is told where laws are checked
        let slip = |v: f64| v > 0.0 && !(low..=high).contains(&v);
        values.into_iter().find(|(_, v)| slip(*v))
    };
    let told = |what: &str, unit: &str, [low, high]: [f64; 2], (kelvin, value): (f64, f64)| {
        format!(
            "{what} is {} {unit} at {:.0} °C; metals have {low} to {high} {unit}",
            significant(value, 3),
            kelvin - CELSIUS
        )
    };
    let slip = "look at its unit: g/cm³ are thousands of kg/m³, W/(mm·K) thousands of W/(m·K)";
    let (densities, conductivities, heats) = ([400.0, 25e3], [0.5, 1e3], [50.0, 1e4]);
    if let Some(found) = beyond(&|k| material.density(k), densities) {
        let message = told("density", "kg/m³", densities, found);
        return Err(file.density.problem(message).help(slip));
    }
    if let Some(found) = beyond(&|k| 1e3 * material.conductivity(k), conductivities) {
        let message = told("conductivity", "W/(m·K)", conductivities, found);
        return Err(file.conductivity.problem(message).help(slip));
    }
    if let Some(found) = beyond(&|k| material.specific_heat(k), heats) {
        let message = told("specific_heat", "J/(kg·K)", heats, found);
        let help = "look at its unit: kJ/(kg·K) are thousands of J/(kg·K)";
        return Err(file.specific_heat.problem(message).help(help));
    }
    plausible_change(material, file)
}

/// Latent heats that metals have, J/kg: lead melts with 23 kJ/kg, silicon with 1790; mercury boils with 0.3 MJ/kg, carbon with 59.
const MELTING: [f64; 2] = [1e4, 3e6];
const BOILING: [f64; 2] = [1e5, 1e8];
/// Molar masses, kg/mol: from hydrogen to beyond uranium.
const MOLAR: [f64; 2] = [1e-3, 0.3];
/// Surface tensions of melts, N/m: caesium has 0.07, tungsten 2.5.
const TENSION: [f64; 2] = [0.03, 5.0];

/// The same of what melts and boils.
fn plausible_change(material: &Material, file: &MaterialFile) -> Result<(), Problem> {
    let slips = |value: f64, [low, high]: [f64; 2]| value > 0.0 && !(low..=high).contains(&value);
    let told = |what: &str, value: f64, [low, high]: [f64; 2], unit: &str| {
        format!(
            "{what} is {} {unit}; metals have {low:e} to {high:e} {unit}",
            significant(value, 3)
        )
    };
    let heats = "look at its unit: kJ/kg are thousands of J/kg";
    if slips(material.latent, MELTING) {
        let message = told("latent", material.latent, MELTING, "J/kg");
        return Err(file.latent.problem(message).help(heats));
    }
    let tension = material.surface_tension.as_ref();
    if let Some(value) = tension
        .map(|law| law.at(material.liquidus))
        .filter(|v| slips(*v, TENSION))
    {
        let message = told("surface_tension", value, TENSION, "N/m");
        let help = "look at its unit: mN/m are thousandths of N/m";
        return Err(file.surface_tension.problem(message).help(help));
    }
    for c in material
        .evaporation
        .iter()
        .flat_map(|vapour| &vapour.components)
    {
        if slips(c.latent, BOILING) {
            let message = told(
                &format!("the heat of evaporation of {}", c.name),
                c.latent,
                BOILING,
                "J/kg",
            );
            return Err(file.evaporation.problem(message).help(heats));
        }
        if slips(c.molar_mass, MOLAR) {
            let message = told(
                &format!("molar_mass of {}", c.name),
                c.molar_mass,
                MOLAR,
                "kg/mol",
            );
            let help = "look at its unit: g/mol are thousandths of kg/mol";
            return Err(file.evaporation.problem(message).help(help));
        }
    }
    Ok(())
}

/// Reads a material from the text of its file, with the `readings` chosen where its source is damaged.
///
/// # Errors
/// Everything wrong, with its place in the file and what to write.
///
/// ```
/// use meltpath_thermal::material::file::{Readings, read};
/// let text = meltpath_data::materials::TI6AL4V_EBM.text;
/// let titanium = read(text, Readings::default()).unwrap();
/// assert!((titanium.conductivity(1605.0 + 273.15) - 27.0625e-3).abs() < 1e-9);
/// ```
pub fn read(text: &str, readings: Readings) -> Result<Material, Problems> {
    let file = settings::parse(text, |file: &MaterialFile| {
        let mut problems = out_of_order(file);
        if let Ok(tree) = DeTable::parse(text) {
            problems.extend(unlisted_sources(tree.get_ref(), &file.sources));
        }
        problems
    })?;
    let density = match readings.density {
        DensityReading::Corrected => &*file.density.corrected,
        DensityReading::Printed => {
            let missing = || {
                let message = "the reading `density = \"printed\"` needs [density.printed] in the material file";
                file.density.problem(message)
            };
            file.density.printed.as_ref().ok_or_else(missing)?
        }
    };
    let conduction = match readings.powder {
        PowderReading::ByDensity => PowderConduction::Proportional,
        PowderReading::Measured => {
            let measured = file.powder_conductivity.as_ref();
            let missing = "the powder's conductivity is to be \"measured\", and the material file has no [powder_conductivity]";
            let measured = measured.ok_or_else(|| file.conductivity.problem(missing))?;
            measured.law(&file.conductivity.solid.law())?
        }
    };
    let latent = &file.latent;
    let material = Material {
        name: file.name.value.clone(),
        range: file.range.value.value.map(|t| t.0),
        start: file.consolidation.0,
        solidus: file.solidus.0,
        liquidus: file.liquidus.0,
        latent: latent.unit.unit.read(*latent.value.value),
        latent_shape: *latent.shape,
        density_solid: density.solid.law(),
        density_liquid: density.liquid.law(),
        specific_heat_solid: file.specific_heat.solid.law(),
        specific_heat_liquid: file.specific_heat.liquid.law(),
        conductivity_solid: file.conductivity.solid.law(),
        conductivity_liquid: file.conductivity.liquid.law(),
        powder: Powder {
            relative_density: relative_density(&file, readings)?,
            conduction,
            emissivity: file.emissivity.powder.0,
        },
        emissivity: file.emissivity.dense.0,
        evaporation: file.evaporation.as_ref().map(evaporation),
        surface_tension: file.surface_tension.as_ref().map(TensionLaw::law),
        scaling: file
            .scaling
            .as_ref()
            .map_or([1.0; 2], |s| s.map(|share| share.0)),
        roughness: file.roughness.as_ref().map(|r| Roughness {
            in_plane: r.in_plane.map(|ra| ra.0),
            along_build: r.along_build.map(|ra| ra.0),
            any_face: r.any_face.map(|ra| ra.0),
        }),
        absorptivity: file.absorptivity.as_ref().map(|a| a.0),
    };
    plausible(&material, &file)?;
    Ok(material)
}

fn evaporation(table: &EvaporationTable) -> Evaporation {
    let besides = table.besides.iter().map(|c| Component {
        name: c.name.value.clone(),
        share: c.share.0,
        boiling: c.boiling.0,
        latent: c.latent.0,
        molar_mass: c.molar_mass.0,
        excess: c.excess.as_ref().map_or(0.0, |e| e.0),
    });
    let besides: Vec<Component> = besides.collect();
    let main = Component {
        name: table.name.value.clone(),
        share: 1.0 - besides.iter().map(|c| c.share).sum::<f64>(),
        boiling: table.boiling.0,
        latent: table.latent.0,
        molar_mass: table.molar_mass.0,
        excess: 0.0,
    };
    Evaporation {
        components: std::iter::once(main).chain(besides).collect(),
        net_fraction: table.net_fraction.as_ref().map(|share| share.0),
    }
}

/// Sources that the numbers below a table name and `[sources]` does not list.
fn unlisted_sources(table: &DeTable<'_>, listed: &BTreeMap<String, String>) -> Vec<Problem> {
    let mut problems = Vec::new();
    for (key, node) in table {
        match node.get_ref() {
            DeValue::Table(inner) if key.get_ref() != "sources" => {
                problems.extend(unlisted_sources(inner, listed));
            }
            DeValue::String(name) if key.get_ref() == "source" && !listed.contains_key(&**name) => {
                let message = format!("the source \"{name}\" is not listed in [sources]");
                let near = nearest(name, listed.keys().map(String::as_str));
                let help = match near {
                    Some(near) => format!("did you mean \"{near}\"?"),
                    None => format!("add it: [sources] {name} = \"author, title, year\""),
                };
                let fix = near.map(|near| format!("\"{near}\""));
                let problem = Problem::new(message).help(help).at(node.span());
                problems.push(Problem { fix, ..problem });
            }
            _ => {}
        }
    }
    problems
}

/// Temperatures out of their order, and laws that do not reach them.
fn out_of_order(file: &MaterialFile) -> Vec<Problem> {
    let [low, high] = file.range.value.value.map(|t| t.0);
    let (start, solidus, liquidus) = (file.consolidation.0, file.solidus.0, file.liquidus.0);
    let celsius = |kelvin: f64| format!("{:.0} °C", kelvin - CELSIUS);
    let range = format!(
        "`range` is {} to {}: the laws must hold from the consolidation, {}, to above the liquidus, {}",
        celsius(low),
        celsius(high),
        celsius(start),
        celsius(liquidus)
    );
    let order = format!(
        "consolidation {}, solidus {} and liquidus {} must increase; a pure metal, which melts at one temperature, is written with a solidus 1 K below it",
        celsius(start),
        celsius(solidus),
        celsius(liquidus)
    );
    let atoms = file.evaporation.as_ref().map_or(0.0, |e| {
        e.besides.iter().map(|component| component.share.0).sum()
    });
    let boiling = file
        .evaporation
        .as_ref()
        .map_or(f64::INFINITY, |e| e.boiling.0);
    broken([
        (
            boiling <= liquidus,
            file.evaporation.problem(format!(
                "it boils at {}, which is not above the liquidus, {}: is one of them in another unit?",
                celsius(boiling),
                celsius(liquidus)
            )),
        ),
        (
            atoms >= 1.0,
            file.evaporation.problem(format!(
                "the components besides the main one make {:.1} % of the atoms: nothing is left for the main one",
                100.0 * atoms
            )),
        ),
        (
            !(low <= start && liquidus < high),
            file.range.problem(range),
        ),
        (
            !(start < solidus && solidus < liquidus),
            file.solidus.problem(order),
        ),
    ])
}

/// The sources that a material file lists, in the order of their names.
///
/// # Errors
/// Everything wrong with the file.
pub fn sources(text: &str) -> Result<Vec<String>, Problems> {
    let file = settings::parse(text, |_: &MaterialFile| Vec::new())?;
    Ok(file.sources.value.into_values().collect())
}

fn relative_density(file: &MaterialFile, readings: Readings) -> Result<Law, Problem> {
    let entry = &file.porosity;
    match readings.porosity {
        PorosityReading::Physical => {
            let porosity = readings.initial_porosity.unwrap_or(entry.initial.0);
            if !(0.0..0.95).contains(&porosity) {
                let message = format!("initial porosity {porosity}: it is a share from 0 to 0.95");
                return Err(match readings.initial_porosity {
                    Some(_) => Problem::new(message),
                    None => entry.initial.problem(message),
                });
            }
            Ok(Law::Table {
                corners: vec![
                    [file.consolidation.0, 1.0 - porosity],
                    [file.solidus.0, 1.0],
                ],
            })
        }
        PorosityReading::PrintedAsDensity => {
            let missing = "the reading `porosity = \"printed-as-density\"` needs [porosity.printed] in the material file";
            let printed = entry
                .printed
                .as_ref()
                .ok_or_else(|| entry.problem(missing))?;
            let written = printed.relative_density.iter();
            let corners: Vec<_> = written.map(|&[t, v]| [t + CELSIUS, v]).collect();
            if !corners.windows(2).all(|w| w[0][0] < w[1][0]) {
                let message = "the temperatures of the corners must increase";
                return Err(printed.relative_density.problem(message));
            }
            Ok(Law::Table { corners })
        }
    }
}

#[cfg(test)]
mod tests;
