//! Process map files: what they may hold, and what is wrong between their keys.

use meltpath_base::settings::{Datum, Json, Kind, Node, Place, Problem, Reader, Value};
use meltpath_base::{Length, Pure, Speed, choice, table};

use super::import::Oddity;
use crate::electric::lines::MeasuredLines;
use crate::feed_response::MeasuredResponse;

choice! {
    /// The law of a map.
    pub enum MapKind {
        PowerLaw "power-law" => "w = c·V_f^p·V_r^q: the table `width`, or laid through measured beads.",
        Grid "grid" => "Sizes measured on a grid of settings, read between its nodes: the table `grid`.",
        Surface "surface" => "A quadratic surface through measured beads.",
        GaussianProcess "gaussian-process" => "A power law with a Gaussian process around it, through measured beads.",
        Best "best" => "Of all these the one that errs least on measured beads that are left out.",
    }
}

/// A size in mm, or `nan` where nothing was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size(
    /// The number.
    pub f64,
);

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
        efficiency: Datum<Pure> where within(0.01, 1.0) => required;
        /// Wire fed over wire programmed.
        feed_factor: Datum<Pure> where positive => computed("the mean of `beads.measured_feed` over the feed that was set");
        /// Where it holds.
        validity: ValidityTable => required;
        /// Relative standard uncertainties of what it predicts.
        relative_sigma: SigmaTable => computed("what leaving out each measured bead shows; of the section what feed factor and wire diameter leave open");
        /// The width of a power law.
        width: PowerLawTable => none("the law is laid through measured beads");
        /// Sizes measured on a grid.
        grid: GridTable => none("the law is another");
        /// Measured beads.
        beads: BeadsTable => none("the law is another");
        /// Laws of the layers of thin walls, read as beads.
        walls: WallsTable => none("the law is another");
        /// What is odd about measured beads and meant so; it stops the import otherwise.
        accept: Vec<Oddity> => default([], "odd beads are mistakes, usually");
        /// What the source does not tell and was assumed, each in a sentence.
        assumed: Vec<String> => default([], "nothing");
        /// What the source feeds at other contact tube distances.
        feed_response: MeasuredResponse => none("not measured: the feed is that of the reference distance");
        /// Voltage, current and wire feed over the contact tube distance.
        electric: MeasuredLines => none("not measured: how the energy changes with the distance is not told");
        /// How far leaning pools were seen to stay.
        tilt: TiltTable => none("not measured: whether a pool that leans stays cannot be said");
    }

    /// How far pools of this wire, gas and mode lean against gravity and stay, as it was seen on beads. A pool stays at an angle where a larger
    /// one did: weight grows with size faster than what holds it.
    pub struct TiltTable {
        /// Section of the bead in mm², and the greatest angle in deg between torch and vertical at which it stayed.
        rows: Vec<[f64; 2]> where positive => required;
        /// Document.
        source: String => required;
        /// Page of it.
        page: String => required;
        /// How it was read or derived.
        note: String => none("nothing to add");
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
        /// Wire feed that was measured with each row, m/min: the first column is what was set.
        measured_feed: Vec<f64> where positive => none("the feed that was set, times the feed factor");
        /// Document.
        source: String => required;
        /// Page of it.
        page: String => required;
    }

    /// Laws of the layers of thin walls: ln Δh = a·ln v + b, Δh in mm, v in mm/s. A wall is taken as nine tenths as wide as its single
    /// bead; the laws hold over the travel speeds of `[validity]`.
    pub struct WallsTable {
        /// Wire feed in m/min, a and b.
        rows: Vec<[f64; 3]> => required;
        /// Document.
        source: String => required;
        /// Page of it.
        page: String => required;
    }
}

/// What is wrong between the keys of a map.
pub(super) fn between_keys(map: &MapFile) -> Vec<Problem> {
    let measured = map.beads.is_some() || map.walls.is_some();
    let missing = match *map.kind {
        MapKind::PowerLaw if map.width.is_none() && !measured => "[width], [beads] or [walls]",
        MapKind::Grid if map.grid.is_none() => "[grid]",
        MapKind::Surface | MapKind::GaussianProcess if !measured => "[beads] or [walls]",
        MapKind::Best if !measured && map.grid.is_none() => "[beads], [walls] or [grid]",
        _ => "",
    };
    let word = map.kind.word();
    let mut problems = Vec::new();
    if !missing.is_empty() {
        let message = format!("a map of the kind \"{word}\" needs a table {missing}");
        problems.push(map.kind.problem(message));
    }
    if map.width.is_some() && *map.kind == MapKind::PowerLaw && map.relative_sigma.is_none() {
        let message = "a power law that is given does not show how well it predicts";
        let help = "add a table [relative_sigma], or give its beads instead of its numbers";
        problems.push(map.width.problem(message).help(help));
    }
    let v = &map.validity;
    let ranges = [&v.wire_feed, &v.travel_speed].into_iter();
    problems.extend(
        ranges
            .filter(|range| range[1].0 <= range[0].0)
            .map(|range| {
                let problem = range.problem(format!("{} must rise", range.name));
                problem.help("write the least and then the greatest speed")
            }),
    );
    if let Some(tilt) = &*map.tilt {
        if tilt.rows.is_empty() {
            problems.push(tilt.rows.problem("no bead is written"));
        }
        if let Some([_, angle]) = tilt.rows.iter().find(|r| r[1] > 180.0) {
            let message = format!("a torch cannot lean by {angle} deg: at most 180 deg, overhead");
            problems.push(tilt.rows.problem(message));
        }
    }
    problems.extend(map.feed_response.as_ref().and_then(MeasuredResponse::check));
    problems.extend(map.electric.as_ref().and_then(MeasuredLines::check));
    if map
        .walls
        .as_ref()
        .is_some_and(|w| w.rows.iter().any(|r| r[0] <= 0.0))
    {
        problems.push(
            map.walls
                .problem("the wire feed of a wall's law must be above 0 m/min"),
        );
    }
    if let Some(beads) = &*map.beads
        && let Some(feeds) = &*beads.measured_feed
        && feeds.len() != beads.rows.len()
    {
        let message = format!(
            "{} measured feeds beside {} rows: there must be one for each",
            feeds.len(),
            beads.rows.len()
        );
        problems.push(beads.measured_feed.problem(message));
    }
    problems
}
