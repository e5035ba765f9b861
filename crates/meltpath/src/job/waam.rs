//! The job of a wire-arc build.

use meltpath_base::quantity::{Auto, NotNegative, Positive};
use meltpath_base::{Angle, Length, Ratio, Speed};
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::{LayersTable, PartUnit, ProcessTable, SubstrateTable, TargetTable, TextError};

/// A wire-arc job, as written. Defaults are resolved, with their reasons, by the pipeline.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaamJob {
    /// The part file: STEP, STL or 3MF; relative to the job file.
    pub part: Spanned<String>,
    /// Unit of a part file that carries none (STL); default mm.
    #[serde(default)]
    pub part_unit: PartUnit,
    /// The direction of the part file that points up in the build; default +Z.
    #[serde(default)]
    pub build_direction: Option<[f64; 3]>,
    /// `[process]`.
    pub process: ProcessTable,
    /// `[waam]`.
    pub waam: WaamTable,
    /// `[layers]`.
    #[serde(default)]
    pub layers: LayersTable,
    /// `[fill]`.
    #[serde(default)]
    pub fill: FillTable,
    /// `[machine]`.
    #[serde(default)]
    pub machine: MachineTable,
    /// `[substrate]`.
    #[serde(default)]
    pub substrate: SubstrateTable,
    /// `[target]`.
    #[serde(default)]
    pub target: TargetTable,
    /// `[checks]`.
    #[serde(default)]
    pub checks: ChecksTable,
    /// `[simulation]`.
    #[serde(default)]
    pub simulation: SimulationTable,
    /// `[output]`.
    #[serde(default)]
    pub output: OutputTable,
}

/// `[waam]`: the process.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaamTable {
    /// Wire: a name in `data/wires`.
    pub wire: Spanned<String>,
    /// Shielding gas: a name in `data/gases`.
    pub gas: Spanned<String>,
    /// Transfer mode, such as `cmt`.
    pub mode: Spanned<String>,
    /// A process map of your own (TOML, relative to the job file) instead of the one that ships.
    #[serde(default)]
    pub map: Option<Spanned<String>>,
    /// Deposited metal over fed metal; default 100 % with the seed map, 95 % otherwise.
    #[serde(default)]
    pub efficiency: Option<Positive<Ratio>>,
    /// `[waam.source]`.
    #[serde(default)]
    pub source: SourceTable,
    /// The bead; default wire feed and travel speed in the middle of the map.
    #[serde(default)]
    pub bead: Option<Spanned<BeadTable>>,
}

/// `[waam.source]`: how the welding source is set and what it was seen to feed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SourceTable {
    /// Whether the wire feed follows the contact tube distance; default `auto`.
    pub feed_response: FeedResponseChoice,
    /// Setting of the penetration stabiliser: the greatest change to the programmed wire feed; default as measured with the
    /// process map; 0 holds the feed.
    pub penetration_stabiliser: Option<NotNegative<Speed>>,
    /// Wire really fed over wire programmed, at the first layer's contact tube distance, measured on your own installation;
    /// default that of the process map.
    pub feed_factor: Option<Positive<Ratio>>,
}

/// Whether the wire feed follows the contact tube distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeedResponseChoice {
    /// Where the process map says how.
    #[default]
    Auto,
    /// Always the same feed.
    Off,
}

/// `[waam.bead]`: two of the four values, or the height alone.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BeadTable {
    /// Programmed wire feed speed (WFS).
    pub wire_feed: Option<Positive<Speed>>,
    /// Travel speed (TS).
    pub travel_speed: Option<Positive<Speed>>,
    /// Width of a single bead.
    pub width: Option<Positive<Length>>,
    /// Height of a single bead.
    pub height: Option<Positive<Length>>,
}

/// `[fill]`: how layers are filled.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FillTable {
    /// Strategy; default hybrid.
    pub strategy: Option<FillStrategy>,
    /// Contours round a hybrid fill; default 1.
    pub contours: Option<u32>,
    /// Distance between neighbouring beads: `"auto"` (tangent overlap), a length, or bead widths as `"0.70 w"`.
    pub stepover: Auto<Stepover>,
    /// How the stepover is kept; default `adjust`.
    pub spacing: Option<Spacing>,
    /// Direction of raster and zigzag lines in the first layer; default the one with the fewest lines.
    pub angle: Option<Angle>,
    /// Turn of that direction from layer to layer; default 90° for zigzag and hybrid, 0° for raster.
    pub turn: Option<Angle>,
    /// Order of contours or lines; default `inside-out` for contours, `one-way` lines alternate per layer.
    pub order: Option<FillOrder>,
    /// Start points of closed beads; default `spread`.
    pub starts: Option<Starts>,
    /// Travel speeds along beads; default adapted for hybrid and zigzag fills, constant for the others.
    pub speeds: Option<Speeds>,
}

/// Filling strategies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FillStrategy {
    /// Parallel lines, one arc start each.
    Raster,
    /// Back and forth with few arc stops.
    Zigzag,
    /// Offsets of the boundary.
    Contour,
    /// One bead that winds from offset to offset.
    Spiral,
    /// Contours outside, zigzag inside.
    Hybrid,
}

/// How a stepover is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spacing {
    /// Adjusted so that the beads fill the width exactly.
    #[default]
    Adjust,
    /// Kept as written; the width may not be filled exactly.
    Exact,
}

/// Order of beads in a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FillOrder {
    /// Contours from the inside to the outside.
    InsideOut,
    /// Contours from the outside to the inside.
    OutsideIn,
    /// Lines all in one direction.
    OneWay,
    /// Lines in alternate directions.
    AlternateBeads,
    /// Lines in one direction, reversed each layer.
    AlternateLayers,
    /// Lines from the centre outwards.
    CentreOut,
}

/// Where closed beads start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Starts {
    /// Spread over the contour from layer to layer.
    #[default]
    Spread,
    /// At the same place in each layer.
    Aligned,
}

/// Travel speeds along the beads of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Speeds {
    /// One speed for every bead.
    Constant,
    /// Faster where a bead has less room beside it, slower where it has more, so that every place gets as much metal.
    Adapted,
}

/// `[machine]`: the cell and how it is driven.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MachineTable {
    /// Cell: a name in `data/cells`, or a TOML file of your own; default `arcmate-120ic`.
    pub cell: Option<Spanned<String>>,
    /// Smoothing at via points (FANUC CNT); default 50 %.
    pub smoothing: Option<Ratio>,
    /// Contact tube to work distance at the first layer; default 15 mm.
    pub ctwd: Option<Positive<Length>>,
}

/// `[checks]`: the limits of the verdict.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ChecksTable {
    /// Largest lack of metal against the finished part, share of its volume; default 0.5 %.
    pub lack: Option<NotNegative<Ratio>>,
    /// Largest excess over part + allowance, share of the part's volume; default 30 %.
    pub excess: Option<NotNegative<Ratio>>,
    /// Smallest machining stock over the finished part; default 0.3 mm.
    pub stock_min: Option<Length>,
    /// Largest difference between a layer's mean height and its planned height; default 1 mm.
    pub height_error: Option<Positive<Length>>,
    /// Largest peak-to-valley height of a layer over its inner area; default 1.5 mm.
    pub flatness: Option<Positive<Length>>,
    /// Smallest contact tube to work distance; default 8 mm.
    pub ctwd_min: Option<Positive<Length>>,
    /// Largest contact tube to work distance; default 20 mm.
    pub ctwd_max: Option<Positive<Length>>,
    /// Largest local thickness of a layer beyond its mean, share of it; default 100 %.
    pub accumulation: Option<Positive<Ratio>>,
    /// Largest shift of a layer over the one below, in bead widths; default 25 %.
    pub overhang: Option<Positive<Ratio>>,
}

/// `[simulation]`: resolution.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SimulationTable {
    /// Cell of the height map; default 0.5 mm.
    pub cell: Option<Positive<Length>>,
    /// Chord error of a B-rep part's mesh; default 0.02 mm.
    pub chord_error: Option<Positive<Length>>,
}

/// `[output]`: what is written besides the report.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutputTable {
    /// Program dialects.
    pub programs: Vec<Dialect>,
}

impl Default for OutputTable {
    fn default() -> Self {
        OutputTable {
            programs: vec![Dialect::FanucLs],
        }
    }
}

/// Program dialects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dialect {
    /// FANUC TP, text form (`.ls`).
    FanucLs,
}

/// A stepover as written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stepover {
    /// A length.
    Length(Length),
    /// A number of bead widths.
    Widths(f64),
}

impl<'de> Deserialize<'de> for Stepover {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        let text = String::deserialize(d).map_err(|e| {
            D::Error::custom(format!(
                "a stepover is \"auto\", \"4.8 mm\" or \"0.70 w\": {e}"
            ))
        })?;
        let widths = text
            .trim()
            .strip_suffix('w')
            .map(|n| n.trim().parse::<f64>());
        let stepover = match widths {
            Some(Ok(n)) => Stepover::Widths(n),
            Some(Err(_)) => {
                return Err(D::Error::custom(format!(
                    "\"{text}\" is not a number of bead widths: write for example \"0.70 w\""
                )));
            }
            None => Length::parse(&text)
                .map(Stepover::Length)
                .map_err(|e| D::Error::custom(format!("{e}, or bead widths as \"0.70 w\"")))?,
        };
        let number = match stepover {
            Stepover::Length(l) => l.0,
            Stepover::Widths(n) => n,
        };
        if number > 0.0 && number.is_finite() {
            Ok(stepover)
        } else {
            Err(D::Error::custom(format!(
                "the stepover \"{text}\" must be above zero"
            )))
        }
    }
}

impl WaamJob {
    /// Finds what the schema alone cannot: values that do not go together.
    ///
    /// # Errors
    /// [`TextError`] with the place and what to write.
    pub(super) fn check(&self) -> Result<(), TextError> {
        if let Some(bead) = &self.waam.bead {
            let b = bead.get_ref();
            let given = [
                b.wire_feed.is_some(),
                b.travel_speed.is_some(),
                b.width.is_some(),
                b.height.is_some(),
            ]
            .into_iter()
            .filter(|&g| g)
            .count();
            let height_alone = given == 1 && b.height.is_some();
            if given != 2 && !height_alone && given != 0 {
                return Err(TextError {
                    span: Some(bead.span()),
                    message: format!("the bead has {given} of its four values"),
                    help: Some(
                        "give two of wire_feed, travel_speed, width, height; or height alone"
                            .to_owned(),
                    ),
                });
            }
        }
        if let Some(smoothing) = self.machine.smoothing
            && !(0.0..=1.0).contains(&smoothing.0)
        {
            return Err(TextError {
                span: None,
                message: format!("machine.smoothing is {smoothing}"),
                help: Some(
                    "smoothing goes from \"0 %\" (stop at each point) to \"100 %\"".to_owned(),
                ),
            });
        }
        if let Some(d) = self.build_direction
            && (d.iter().any(|c| !c.is_finite()) || d.iter().all(|&c| c == 0.0))
        {
            return Err(TextError {
                span: None,
                message: "build_direction has no direction".to_owned(),
                help: Some("give a vector of the part file, such as [0.0, 0.0, 1.0]".to_owned()),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Job, parse};
    use super::*;

    const WHOLE: &str = include_str!("../../tests/jobs/whole.toml");

    fn waam(text: &str) -> WaamJob {
        match parse(text).unwrap() {
            Job::Waam(job) => *job,
            Job::Ebm(_) | Job::Lpbf(_) => panic!("a wire-arc job"),
        }
    }

    #[test]
    fn every_table_reads() {
        let job = waam(WHOLE);
        assert_eq!(job.fill.stepover, Auto::Value(Stepover::Widths(0.70)));
        assert_eq!(job.machine.smoothing, Some(Ratio(0.5)));
        let Auto::Value(heights) = job.layers.height else {
            panic!("heights are written")
        };
        assert_eq!(heights.0.len(), 2);
    }

    #[test]
    fn mistakes_are_named_where_they_are() {
        for (wrong, right, expected) in [
            (
                "strategy = \"hybrid\"",
                "strategie = \"hybrid\"",
                "strategie",
            ),
            (
                "wire_feed = \"8 m/min\"",
                "wire_feed = \"-8 m/min\"",
                "must be above zero",
            ),
            ("wire_feed = \"8 m/min\"", "wire_feed = 8", "\"8 UNIT\""),
            ("ctwd = \"15 mm\"", "ctwd = \"15\"", "\"mm\""),
            ("stepover = \"0.70 w\"", "stepover = \"0.7\"", "0.70 w"),
            ("travel_speed = \"0.75 m/min\"", "", "one of"),
            ("kind = \"waam\"", "kind = \"fdm\"", "waam"),
        ] {
            assert!(WHOLE.contains(wrong), "{wrong}");
            let text = WHOLE.replace(wrong, right);
            match parse(&text) {
                Err(e) => {
                    let said = format!("{} {}", e.message, e.help.clone().unwrap_or_default());
                    assert!(
                        said.contains(expected)
                            || expected == "one of" && said.contains("1 of its four"),
                        "{said}"
                    );
                    assert!(e.span.is_some(), "{said}");
                }
                Ok(_) => panic!("accepted: {right}"),
            }
        }
    }

    proptest::proptest! {
        #[test]
        fn no_text_panics(at in 0_usize..1000, with in "\\PC{0,6}") {
            let at = at % WHOLE.len();
            if WHOLE.is_char_boundary(at) {
                let _ = parse(&format!("{}{with}{}", &WHOLE[..at], &WHOLE[at..]));
            }
        }
    }
}
