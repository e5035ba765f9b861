//! Process map files: what they may hold, and the maps that come with the program.

use meltpath_base::{Reporter, Speed};
use serde::Deserialize;

use super::import::{MeasuredBead, check_beads};
use super::{Grid, Law, M_PER_MIN, ProcessMap, ProcessMapError, RelativeSigma, Surface};
use crate::consumable::{DataError, Datum, Wire, lookup, positive, read};
use crate::feed_response::MeasuredResponse;

/// Region in which a map holds, m/min, with its source.
#[derive(Debug, Clone, PartialEq)]
pub struct Validity {
    /// Least and greatest wire feed, m/min.
    pub wire_feed: (f64, f64),
    /// Least and greatest travel speed, m/min.
    pub travel_speed: (f64, f64),
    /// Where this comes from.
    pub source: String,
}

impl Validity {
    pub(crate) fn contains(&self, vf: f64, vr: f64) -> bool {
        let within = |x: f64, (lo, hi): (f64, f64)| x >= lo - 1e-9 && x <= hi + 1e-9;
        within(vf, self.wire_feed) && within(vr, self.travel_speed)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ValidityFile {
    wire_feed: [Speed; 2],
    travel_speed: [Speed; 2],
    source: String,
    page: String,
    #[serde(rename = "note")]
    _note: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PowerLawFile {
    coefficient: Datum,
    feed_exponent: Datum,
    travel_exponent: Datum,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SigmaFile {
    width: f64,
    height: f64,
    area: f64,
    #[serde(rename = "source")]
    _source: String,
    #[serde(rename = "page")]
    _page: String,
    #[serde(rename = "note")]
    _note: Option<String>,
}

/// A table: axes in m/min, one row of sizes in mm per wire feed; `nan` where nothing was measured.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GridFile {
    wire_feed: Vec<f64>,
    travel_speed: Vec<f64>,
    width: Vec<Vec<f64>>,
    height: Vec<Vec<f64>>,
    #[serde(rename = "source")]
    _source: String,
    #[serde(rename = "page")]
    _page: String,
}

/// Measured beads for a quadratic surface; rows are wire feed, travel speed (m/min), width, height (mm).
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BeadsFile {
    rows: Vec<[f64; 4]>,
    #[serde(rename = "source")]
    _source: String,
    #[serde(rename = "page")]
    _page: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    PowerLaw,
    Grid,
    Surface,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFile {
    schema: u32,
    id: String,
    wire: String,
    gas: String,
    mode: String,
    kind: Kind,
    efficiency: Datum,
    feed_factor: Datum,
    validity: ValidityFile,
    relative_sigma: SigmaFile,
    width: Option<PowerLawFile>,
    grid: Option<GridFile>,
    beads: Option<BeadsFile>,
    feed_response: Option<MeasuredResponse>,
}

/// The law of a map's tables; a bead's area is `per_ratio` times its feed ratio, mm².
fn law(
    file: &str,
    map: &MapFile,
    per_ratio: f64,
    reporter: &Reporter,
) -> Result<Law, ProcessMapError> {
    let missing = |table: &str| DataError::Syntax {
        file: file.to_owned(),
        message: format!("this kind of map needs a table [{table}]"),
    };
    Ok(match map.kind {
        Kind::PowerLaw => {
            let w = map.width.as_ref().ok_or_else(|| missing("width"))?;
            Law::PowerLaw {
                coefficient: positive(file, "width.coefficient", w.coefficient.value)?,
                feed_exponent: w.feed_exponent.value,
                travel_exponent: w.travel_exponent.value,
            }
        }
        Kind::Grid => {
            let g = map.grid.as_ref().ok_or_else(|| missing("grid"))?;
            let beads = grid_beads(g);
            check_beads(&beads, per_ratio, reporter);
            let (width, height) = (g.width.concat(), g.height.concat());
            Law::Grid(Grid::new(
                file,
                g.wire_feed.clone(),
                g.travel_speed.clone(),
                width,
                height,
            )?)
        }
        Kind::Surface => {
            let b = map.beads.as_ref().ok_or_else(|| missing("beads"))?;
            let beads: Vec<MeasuredBead> = b
                .rows
                .iter()
                .map(|r| MeasuredBead {
                    wire_feed: r[0],
                    travel_speed: r[1],
                    width: r[2],
                    height: r[3],
                })
                .collect();
            check_beads(&beads, per_ratio, reporter);
            Law::Surface(fitted(file, &beads, reporter)?)
        }
    })
}

/// The quadratic surface through measured beads; warns where it explains them badly.
fn fitted(file: &str, beads: &[MeasuredBead], reporter: &Reporter) -> Result<Surface, DataError> {
    let (surface, width, height) = Surface::fit(beads).ok_or_else(|| DataError::Value {
        file: file.to_owned(),
        what: "number of beads".to_owned(),
        value: beads.len() as f64,
        must: "a quadratic surface needs six beads or more at settings that span it",
    })?;
    for (what, quality) in [("width", width), ("height", height)] {
        if quality.r_squared < 0.9 {
            reporter.warn(
                "process-map-fit",
                format!(
                    "{file}: the quadratic surface of the {what} explains {:.0} % of its variance",
                    100.0 * quality.r_squared
                ),
                "look for wrong rows, or use the measurements as a grid",
            );
        }
    }
    Ok(surface)
}

impl ProcessMap {
    /// Reads a process map file, for the section of `wire`; warns through `reporter` of measured beads whose metal
    /// does not balance.
    ///
    /// # Errors
    /// [`ProcessMapError::Data`] when it does not read, its layout is of another version, a table is missing or a
    /// number is out of range.
    pub fn parse(
        file: &str,
        text: &str,
        wire: &Wire,
        reporter: &Reporter,
    ) -> Result<Self, ProcessMapError> {
        let map: MapFile = read(file, text)?;
        if map.schema != 1 {
            return Err(DataError::Value {
                file: file.to_owned(),
                what: "schema".to_owned(),
                value: f64::from(map.schema),
                must: "this program reads schema 1",
            }
            .into());
        }
        for (what, value) in [
            ("efficiency", map.efficiency.value),
            ("feed_factor", map.feed_factor.value),
            ("relative_sigma.width", map.relative_sigma.width),
            ("relative_sigma.height", map.relative_sigma.height),
            ("relative_sigma.area", map.relative_sigma.area),
        ] {
            positive(file, what, value)?;
        }
        let range = |what: &str, r: [Speed; 2]| -> Result<(f64, f64), DataError> {
            positive(file, what, r[0].0)?;
            positive(file, what, r[1].0 - r[0].0)?;
            Ok((r[0].0 / M_PER_MIN, r[1].0 / M_PER_MIN))
        };
        let validity = Validity {
            wire_feed: range("validity.wire_feed", map.validity.wire_feed)?,
            travel_speed: range("validity.travel_speed", map.validity.travel_speed)?,
            source: format!("{}, {}", map.validity.source, map.validity.page),
        };
        if let Some(response) = &map.feed_response {
            response.check(file)?;
        }
        let per_ratio = map.efficiency.value * map.feed_factor.value * wire.section();
        let law = law(file, &map, per_ratio, reporter)?;
        Ok(ProcessMap {
            id: map.id,
            wire: map.wire,
            gas: map.gas,
            mode: map.mode,
            wire_section: wire.section(),
            efficiency: map.efficiency,
            feed_factor: map.feed_factor,
            feed_response: map.feed_response,
            validity,
            law,
            relative_sigma: RelativeSigma {
                width: map.relative_sigma.width,
                height: map.relative_sigma.height,
                area: map.relative_sigma.area,
            },
        })
    }

    /// A map that comes with the program: `WIRE-MODE-GAS`.
    ///
    /// # Errors
    /// [`ProcessMapError::Data`] listing the maps there are.
    pub fn builtin(id: &str) -> Result<Self, ProcessMapError> {
        let text = lookup("process map", id, meltpath_data::process_maps::ALL)?;
        let wire = wire_of(id, text)?;
        Self::parse(id, text, &wire, &Reporter::new())
    }
}

fn wire_of(file: &str, text: &str) -> Result<Wire, DataError> {
    let map: MapFile = read(file, text)?;
    Wire::builtin(&map.wire)
}

fn grid_beads(g: &GridFile) -> Vec<MeasuredBead> {
    let mut beads = Vec::new();
    for ((vf, widths), heights) in g.wire_feed.iter().zip(&g.width).zip(&g.height) {
        for ((vr, w), h) in g.travel_speed.iter().zip(widths).zip(heights) {
            if w.is_finite() && h.is_finite() {
                beads.push(MeasuredBead {
                    wire_feed: *vf,
                    travel_speed: *vr,
                    width: *w,
                    height: *h,
                });
            }
        }
    }
    beads
}
