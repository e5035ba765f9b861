//! Process map files: what they may hold, and the maps that come with the program.

use meltpath_base::settings::{Datum, Json, Kind, Node, Place, Problem, Problems, Reader, Value};
use meltpath_base::{Length, Pure, Reporter, Speed, choice, settings, table};

use super::grid::GridPart;
use super::import::{MeasuredBead, check_beads};
use super::{Grid, Law, M_PER_MIN, ProcessMap, ProcessMapError, RelativeSigma, Surface};
use crate::consumable::{Wire, lookup};
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

choice! {
    /// The law of a map.
    pub enum MapKind {
        /// w = c·V_f^p·V_r^q: the table `width`.
        PowerLaw = "power-law",
        /// Sizes measured on a grid of settings: the table `grid`.
        Grid = "grid",
        /// Measured beads, through which a quadratic surface is laid: the table `beads`.
        Surface = "surface",
    }
}

/// A size in mm, or `nan` where nothing was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size(f64);

impl Value for Size {
    const KIND: Kind = Kind::Number;

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let word = node.get_ref().as_float().map(|n| n.as_str().to_owned());
        match word.as_deref() {
            Some("nan" | "+nan" | "-nan") => Some(Size(f64::NAN)),
            _ => f64::read(node, place, reader).map(Size),
        }
    }

    fn json(&self) -> Json {
        self.0.into()
    }
}

table! {
    /// Bead sizes against settings, for a wire, a gas and a mode.
    pub struct MapFile {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Identifier: `wire-mode-gas` where it ships.
        id: String => required;
        /// Wire it was made with.
        wire: String => required;
        /// Gas it was made with.
        gas: String => required;
        /// Transfer mode it was made with.
        mode: String => required;
        /// Its law.
        kind: MapKind => required;
        /// Share of the fed metal that stays in the bead.
        efficiency: Datum<Pure> where positive => required;
        /// Wire fed over wire programmed.
        feed_factor: Datum<Pure> where positive => required;
        /// Where it holds.
        validity: ValidityTable => required;
        /// Relative standard uncertainties of what it predicts.
        relative_sigma: SigmaTable => required;
        /// The width of a power law.
        width: PowerLawTable => none("the law is another");
        /// Sizes measured on a grid.
        grid: GridTable => none("the law is another");
        /// Measured beads.
        beads: BeadsTable => none("the law is another");
        /// What the source feeds at other contact tube distances.
        feed_response: MeasuredResponse => none("not measured: the feed is that of the reference distance");
    }

    /// Where a map holds.
    pub struct ValidityTable {
        /// Least and greatest wire feed.
        wire_feed: [Speed; 2] where positive => required;
        /// Least and greatest travel speed.
        travel_speed: [Speed; 2] where positive => required;
        /// Document.
        source: String => required;
        /// Page of it.
        page: String => required;
        /// How it was read or derived.
        note: String => none("nothing to add");
    }

    /// w = coefficient · V_f^feed_exponent · V_r^travel_exponent, speeds in m/min.
    pub struct PowerLawTable {
        /// Width at 1 m/min of both.
        coefficient: Datum<Length> where positive => required;
        /// Exponent of the wire feed.
        feed_exponent: Datum<Pure> => required;
        /// Exponent of the travel speed.
        travel_exponent: Datum<Pure> => required;
    }

    /// Relative standard uncertainties of what a map predicts, as numbers: 0.075 for 7.5 %.
    pub struct SigmaTable {
        /// Of the width.
        width: f64 where positive => required;
        /// Of the height.
        height: f64 where positive => required;
        /// Of the section.
        area: f64 where positive => required;
        /// Document.
        source: String => required;
        /// Page of it.
        page: String => required;
        /// How it was read or derived.
        note: String => none("nothing to add");
    }

    /// Sizes measured on a grid of settings: a row of sizes for each wire feed, `nan` where nothing was measured.
    pub struct GridTable {
        /// Wire feeds in m/min, rising.
        wire_feed: Vec<f64> where positive => required;
        /// Travel speeds in m/min, rising.
        travel_speed: Vec<f64> where positive => required;
        /// Widths in mm.
        width: Vec<Vec<Size>> where positive => required;
        /// Heights in mm.
        height: Vec<Vec<Size>> where positive => required;
        /// Document.
        source: String => required;
        /// Page of it.
        page: String => required;
    }

    /// Measured beads for a quadratic surface.
    pub struct BeadsTable {
        /// Wire feed and travel speed in m/min, width and height in mm.
        rows: Vec<[f64; 4]> where positive => required;
        /// Document.
        source: String => required;
        /// Page of it.
        page: String => required;
    }
}

/// What is wrong between the keys of a map.
fn between_keys(map: &MapFile) -> Vec<Problem> {
    let (table, written) = match *map.kind {
        MapKind::PowerLaw => ("width", map.width.is_some()),
        MapKind::Grid => ("grid", map.grid.is_some()),
        MapKind::Surface => ("beads", map.beads.is_some()),
    };
    let missing = || {
        let message = format!(
            "a map of the kind \"{}\" needs a table [{table}]",
            map.kind.word()
        );
        map.kind.problem(message)
    };
    let v = &map.validity;
    let ranges = [&v.wire_feed, &v.travel_speed].into_iter();
    let turned = ranges
        .filter(|range| range[1].0 <= range[0].0)
        .map(|range| {
            let problem = range.problem(format!("{} must rise", range.name));
            problem.help("write the least and then the greatest speed")
        });
    (!written)
        .then(missing)
        .into_iter()
        .chain(turned)
        .chain(map.feed_response.as_ref().and_then(MeasuredResponse::check))
        .collect()
}

/// The law of a map's tables; a bead's area is `per_ratio` times its feed ratio, mm².
fn law(
    file: &str,
    map: &MapFile,
    per_ratio: f64,
    reporter: &Reporter,
) -> Result<Law, ProcessMapError> {
    if let Some(w) = &*map.width
        && *map.kind == MapKind::PowerLaw
    {
        return Ok(Law::PowerLaw {
            coefficient: w.coefficient.0,
            feed_exponent: w.feed_exponent.0,
            travel_exponent: w.travel_exponent.0,
        });
    }
    if let Some(g) = &*map.grid
        && *map.kind == MapKind::Grid
    {
        let sizes = |rows: &[Vec<Size>]| rows.iter().flatten().map(|s| s.0).collect();
        let (feeds, travels) = (g.wire_feed.value.clone(), g.travel_speed.value.clone());
        let uneven = [(&g.width, GridPart::Width), (&g.height, GridPart::Height)]
            .into_iter()
            .find(|(rows, _)| rows.iter().any(|row| row.len() != travels.len()));
        let grid = match uneven {
            Some((_, part)) => Err((
                part,
                "a row for each wire feed has a size for each travel speed".to_owned(),
            )),
            None => Grid::new(feeds, travels, sizes(&g.width), sizes(&g.height)),
        };
        let grid = grid.map_err(|(part, told)| {
            let problem = match part {
                GridPart::WireFeed => g.wire_feed.problem(told),
                GridPart::TravelSpeed => g.travel_speed.problem(told),
                GridPart::Width => g.width.problem(told),
                GridPart::Height => g.height.problem(told),
            };
            Problems::from(problem)
        })?;
        check_beads(&grid.beads(), per_ratio, reporter);
        return Ok(Law::Grid(grid));
    }
    let rows = map.beads.iter().flat_map(|b| b.rows.iter());
    let beads: Vec<MeasuredBead> = rows
        .map(|r| MeasuredBead {
            wire_feed: r[0],
            travel_speed: r[1],
            width: r[2],
            height: r[3],
        })
        .collect();
    check_beads(&beads, per_ratio, reporter);
    Ok(Law::Surface(fitted(file, map, &beads, reporter)?))
}

/// The quadratic surface through measured beads; warns where it explains them badly.
fn fitted(
    file: &str,
    map: &MapFile,
    beads: &[MeasuredBead],
    reporter: &Reporter,
) -> Result<Surface, Problems> {
    let (surface, width, height) = Surface::fit(beads).ok_or_else(|| {
        let message = format!(
            "a quadratic surface does not pass through {} beads",
            beads.len()
        );
        let help = "measure six beads or more, at settings that span it";
        map.beads.problem(message).help(help)
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
    /// [`ProcessMapError::Content`]: everything wrong, with its place in the file.
    pub fn parse(
        file: &str,
        text: &str,
        wire: &Wire,
        reporter: &Reporter,
    ) -> Result<Self, ProcessMapError> {
        let map = settings::parse(text, between_keys)?;
        let range = |r: &[Speed; 2]| (r[0].0 / M_PER_MIN, r[1].0 / M_PER_MIN);
        let validity = Validity {
            wire_feed: range(&map.validity.wire_feed),
            travel_speed: range(&map.validity.travel_speed),
            source: format!("{}, {}", *map.validity.source, *map.validity.page),
        };
        let per_ratio = map.efficiency.0 * map.feed_factor.0 * wire.section();
        let law = law(file, &map, per_ratio, reporter)?;
        let sigma = &map.relative_sigma;
        let relative_sigma = RelativeSigma {
            width: *sigma.width,
            height: *sigma.height,
            area: *sigma.area,
        };
        Ok(ProcessMap {
            id: map.id.value,
            wire: map.wire.value,
            gas: map.gas.value,
            mode: map.mode.value,
            wire_section: wire.section(),
            efficiency: map.efficiency.value,
            feed_factor: map.feed_factor.value,
            feed_response: map.feed_response.value,
            validity,
            law,
            relative_sigma,
        })
    }

    /// A map that comes with the program: `WIRE-MODE-GAS`.
    ///
    /// # Errors
    /// [`ProcessMapError::Data`] listing the maps there are.
    pub fn builtin(id: &str) -> Result<Self, ProcessMapError> {
        let text = lookup("process map", id, meltpath_data::process_maps::ALL)?;
        let map = settings::parse::<MapFile>(text, |_| Vec::new())?;
        Self::parse(id, text, &Wire::builtin(&map.wire)?, &Reporter::new())
    }
}
