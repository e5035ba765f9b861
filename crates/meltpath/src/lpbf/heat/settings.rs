//! What `[heat]` says, resolved.

use std::collections::BTreeMap;
use std::path::Path;

use meltpath_base::number::significant;
use meltpath_base::settings::{Problem, Problems};
use meltpath_base::{Length, Provenance, Ratio};
use meltpath_thermal::material::file::Readings;
use meltpath_thermal::material::medium::{Body, Medium};
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::pool::fusion::FusionMap;

use crate::job::lpbf::HeatTable;
use crate::material::load;

/// Resolved `[heat]`.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatSettings {
    /// The material.
    pub material: Material,
    /// What stands for it in the engine.
    pub medium: Medium,
    /// Share of the power that becomes heat.
    pub absorptivity: f64,
    /// Depth that must become liquid, mm.
    pub layer: f64,
    /// That of single layers, by their numbers, where a file tells it and the job does not.
    pub depths: BTreeMap<u32, f64>,
    /// Edge of the map's cells, mm.
    pub cell: f64,
    /// Spot diameter (four standard deviations), mm.
    pub spot: f64,
    /// Room round the marks, mm.
    pub margin: f64,
    /// Marks followed at most, mm.
    pub marks: f64,
    /// Least share of the check.
    pub share: f64,
}

impl HeatSettings {
    /// Depth to which a layer must become liquid, mm.
    pub fn depth_of(&self, layer: u32) -> f64 {
        self.depths.get(&layer).copied().unwrap_or(self.layer)
    }
}

/// Resolves `[heat]` of a job in `folder` for a beam of `spot` mm on layers of `layer` mm, whose check wants at least `share`.
///
/// # Errors
/// Everything wrong, with its place.
pub fn resolve(
    table: &HeatTable,
    share: f64,
    [spot, layer]: [f64; 2],
    folder: &Path,
    provenance: &mut Provenance,
) -> Result<HeatSettings, Problems> {
    let named = &table.material;
    let loaded = load(named, Readings::default(), folder).map_err(|e| e.at(named))?;
    loaded.tell(provenance);
    let material = loaded.material;
    let own = table.absorptivity.map(|a| a.0).or(material.absorptivity).ok_or_else(|| {
        let message = format!("\"{}\" says nothing of absorptivity", **named);
        named.problem(message).help(
            "give it in the job: [heat] absorptivity = \"35 %\"; or as [absorptivity] in the material file",
        )
    })?;
    let preheat = table.preheat.0;
    warmed(table, &material)?;
    let medium = Medium::effective(&material, preheat, Body::HalfSpace).map_err(|_| {
        let message = format!(
            "the bed is at {:.0} °C, the material is liquid from {:.0} °C",
            preheat - CELSIUS,
            material.liquidus - CELSIUS
        );
        table
            .preheat
            .problem(message)
            .help("give heat.preheat below it")
    })?;
    let settings = HeatSettings {
        medium,
        absorptivity: table.absorptivity.or_computed(provenance, Ratio(own)).0,
        layer: table.layer.or_computed(provenance, Length(layer)).0,
        depths: BTreeMap::new(),
        cell: table.cell.or_computed(provenance, Length(0.25 * spot)).0,
        spot,
        margin: table.margin.0,
        marks: table.marks.0,
        share,
        material,
    };
    fits(table, &settings)?;
    provenance.model(
        "melt pools of the laser",
        "superposition of moving Gaussians on a half space with mean properties (Carslaw and Jaeger 1959; Eagar and Tsai 1983); \
         conduction only, dense metal, absorptivity constant; keyholes flagged by the normalised enthalpy of King et al. 2014, \
         their depth told by the scaling of Gan et al. 2021 where it was measured",
    );
    Ok(settings)
}

/// Refuses beds below absolute zero, and those that begin to melt.
fn warmed(table: &HeatTable, material: &Material) -> Result<(), Problem> {
    let bed = table.preheat.0;
    let told = if bed < 0.0 {
        let zero = -CELSIUS;
        format!(
            "the bed is at {:.0} °C, below absolute zero, {zero} °C",
            bed - CELSIUS
        )
    } else if bed >= material.solidus {
        format!(
            "the bed is at {:.0} °C, the material begins to melt at {:.0} °C",
            bed - CELSIUS,
            material.solidus - CELSIUS
        )
    } else {
        return Ok(());
    };
    Err(table.preheat.problem(told).help(format!(
        "a bed is solid: give heat.preheat below {:.0} °C",
        material.solidus - CELSIUS
    )))
}

/// Refuses cells of which the margin alone would have more than any map.
fn fits(table: &HeatTable, settings: &HeatSettings) -> Result<(), Problem> {
    let across = 2.0 * settings.margin / settings.cell;
    if across * across <= FusionMap::LARGEST {
        return Ok(());
    }
    // whichever is farther from the spot's own size
    let coarse = settings.margin / settings.spot > settings.spot / settings.cell;
    let message = format!(
        "a map with {} mm beyond the marks in cells of {} mm would have more than {:.0} million cells",
        significant(settings.margin, 3),
        significant(settings.cell, 3),
        1e-6 * FusionMap::LARGEST
    );
    Err(if coarse {
        let help = "is it in mm? a fraction of a millimetre holds what melts beyond the marks";
        table
            .margin
            .problem(format!("heat.margin: {message}"))
            .help(help)
    } else {
        let help = "a larger one; left out it is a quarter of the spot";
        table
            .cell
            .problem(format!("heat.cell: {message}"))
            .help(help)
    })
}
