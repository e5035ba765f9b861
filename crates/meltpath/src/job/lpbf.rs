//! The job of a laser scan head: recipes compared on a plate of squares or on layers of a file.

use meltpath_base::quantity::{NotNegative, Positive};
use meltpath_base::{Length, Ratio, Speed, Temperature, Time};
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::{ProcessTable, TextError};

/// A scan-head job, as written. Defaults are resolved, with their reasons, by the pipeline.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LpbfJob {
    /// `[process]`.
    pub process: ProcessTable,
    /// `[lpbf]`.
    pub lpbf: LpbfTable,
    /// `[plate]`.
    #[serde(default)]
    pub plate: PlateTable,
    /// `[layers]`.
    #[serde(default)]
    pub layers: LayersTable,
    /// `[checks]`.
    #[serde(default)]
    pub checks: LpbfChecksTable,
    /// `[optimise]`: search a faster recipe; none unless written.
    pub optimise: Option<OptimiseTable>,
    /// `[heat]`: what the marked path melts; none unless written.
    pub heat: Option<HeatTable>,
    /// `[output]`.
    #[serde(default)]
    pub output: LpbfOutputTable,
}

/// `[optimise]`: what a recipe search may change, beginning with the first recipe; the bounds are those of `[checks]`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OptimiseTable {
    /// Slowest and fastest contour; default half to three times that of the recipe.
    pub contour_speed: Option<[Positive<Speed>; 2]>,
    /// Slowest and fastest fill; default half to three times that of the recipe.
    pub fill_speed: Option<[Positive<Speed>; 2]>,
    /// Waits after marks to try; default none, a third, two thirds and all of the recipe's.
    pub mark_waits: Option<Vec<NotNegative<Time>>>,
    /// Factors on the jump speeds to try; default 100 %, 150 % and 200 %.
    pub jump_factors: Option<Vec<Positive<Ratio>>>,
    /// Factors on the first filter of the mirrors to try; default 100 % and 50 %.
    pub filter_factors: Option<Vec<Positive<Ratio>>>,
    /// Least fill rate; default that of `[checks]`, else two points below the first recipe's own.
    pub fill_rate: Option<NotNegative<Ratio>>,
}

/// `[heat]`: what the first square or layer of each recipe melts through, as commanded and as marked.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeatTable {
    /// Material: a name in `data/materials`, or a TOML file of your own; default `in625-laser`.
    pub material: Option<Spanned<String>>,
    /// Share of the laser's power that becomes heat; default the material's.
    pub absorptivity: Option<Spanned<Positive<Ratio>>>,
    /// Depth to which the metal must have been liquid; default 40 µm.
    pub layer: Option<Positive<Length>>,
    /// Temperature of the bed; default 20 °C.
    pub preheat: Option<Temperature>,
    /// Edge of the map's cells; default a quarter of the spot.
    pub cell: Option<Positive<Length>>,
    /// Marks followed at most, from the first on; default 3 m.
    pub marks: Option<Positive<Length>>,
}

/// `[lpbf]`: head and recipes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LpbfTable {
    /// Head: a name in `data/scan-heads`, or a TOML file of your own.
    pub head: Spanned<String>,
    /// Recipes: names in `data/recipes`, or TOML files of your own; the others are compared with the first.
    pub recipes: Vec<Spanned<String>>,
    /// Laser delays; default tuned.
    #[serde(default)]
    pub delays: DelayChoice,
    /// Controller of the axes: `cascade` (the head's own, default), `h-infinity`, or the `controllers.json` of a tuning.
    pub controller: Option<Spanned<String>>,
    /// Pre-filter of the head; default on with the cascade, off otherwise.
    pub prefilter: Option<PreFilterChoice>,
    /// What is made of the path being known ahead; default nothing.
    #[serde(default)]
    pub path: PathChoice,
    /// Layers to execute instead of a plate: a CLI file (text or binary) or a vector list (`.csv`).
    pub layers: Option<Spanned<String>>,
}

/// What is made of the path being known ahead.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathChoice {
    /// Nothing: set-points go out as they come.
    #[default]
    AsCommanded,
    /// The faster mirror's set-points are filtered so that both mirrors respond alike.
    Synchronised,
    /// Both mirrors' set-points are filtered over past and coming ones so that they arrive without lag.
    Preview,
}

/// Whether set-points go through the head's pre-filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PreFilterChoice {
    /// The head's.
    On,
    /// None.
    Off,
    /// The head's first average alone: acceleration is bounded, jerk is not.
    FirstOnly,
    /// The head's, both mirrors with the averages of the one that lags more.
    Alike,
}

/// `[layers]`: which layers of `lpbf.layers` are run, and where they lie.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LayersTable {
    /// First and last layer, as numbered in the file, from 1; default the one layer that marks most.
    pub range: Option<[u32; 2]>,
    /// The point of the file that lies at the centre of the field; default its origin.
    pub origin: Option<[Length; 2]>,
    /// Hatch distance, for the surface to fill; default the median distance of neighbouring lines.
    pub hatch: Option<Positive<Length>>,
}

/// `[output]`: what is written beside the report.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LpbfOutputTable {
    /// The whole marked path of each recipe, every sample with its power; default none.
    pub motion: Option<MotionForm>,
}

/// The form of a marked path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionForm {
    /// Comma-separated values.
    Csv,
    /// Apache Parquet.
    Parquet,
}

/// Which laser delays a run uses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DelayChoice {
    /// Tuned on two squares for each recipe.
    #[default]
    Tuned,
    /// The recipe's own.
    Recipe,
}

/// `[plate]`: which squares are run.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlateTable {
    /// A representative block (default) or the whole plate of the head.
    pub extent: PlateExtent,
    /// Columns and rows of the block; default 2 and 2.
    pub block: Option<[u32; 2]>,
    /// Side of a square; default the head's reference plate.
    pub side: Option<Positive<Length>>,
    /// Hatch distance; default the head's reference plate.
    pub hatch: Option<Positive<Length>>,
}

/// How much of the plate is run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlateExtent {
    /// A block of squares at the centre of the field.
    #[default]
    Block,
    /// Every square of the head's reference plate.
    Whole,
}

/// `[checks]`: the limits of the verdict.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LpbfChecksTable {
    /// Contour error that counts as good; default 30 µm.
    pub contour_error: Option<Positive<Length>>,
    /// Least share of contour points within it; default 95 %.
    pub contour_share: Option<NotNegative<Ratio>>,
    /// Least fill rate (centres of cells under the swept spot); default none: told.
    pub fill_rate: Option<NotNegative<Ratio>>,
    /// Least share of the surface that is melted through; default 98 %.
    pub fusion: Option<NotNegative<Ratio>>,
}

impl LpbfJob {
    /// Finds what the schema alone cannot.
    ///
    /// # Errors
    /// [`TextError`] with what to write.
    pub(super) fn check(&self) -> Result<(), TextError> {
        let plain = |message: &str, help: &str| {
            Err(TextError {
                span: None,
                message: message.to_owned(),
                help: Some(help.to_owned()),
            })
        };
        if self.lpbf.recipes.is_empty() {
            return plain(
                "the job has no recipe",
                "name one or more: recipes = [\"industrial\", \"uniform\"]",
            );
        }
        match (&self.lpbf.layers, &self.layers, &self.plate) {
            (Some(_), _, plate) if *plate != PlateTable::default() => {
                return plain(
                    "the job has both layers and a plate",
                    "leave out [plate], or lpbf.layers",
                );
            }
            (None, layers, _) if *layers != LayersTable::default() => {
                return plain(
                    "[layers] without a file",
                    "name it in [lpbf]: layers = \"part.cli\"; or leave out [layers]",
                );
            }
            _ => {}
        }
        if let Some(o) = &self.optimise {
            let empty = o.mark_waits.as_ref().is_some_and(Vec::is_empty)
                || o.jump_factors.as_ref().is_some_and(Vec::is_empty)
                || o.filter_factors.as_ref().is_some_and(Vec::is_empty);
            let crossed = [o.contour_speed, o.fill_speed]
                .into_iter()
                .flatten()
                .any(|[low, high]| low.0.0 > high.0.0);
            if empty || crossed {
                return plain(
                    "[optimise] leaves nothing to try",
                    "give speeds from slowest to fastest and lists with one value or more",
                );
            }
        }
        if let Some([first, last]) = self.layers.range
            && (first == 0 || last < first)
        {
            return plain(
                &format!("layers {first} to {last} are none"),
                "give the first and the last layer, from 1 on: range = [1, 10]",
            );
        }
        if let Some([columns, rows]) = self.plate.block
            && (columns == 0 || rows == 0)
        {
            return plain(
                "the block has no squares",
                "give columns and rows from 1 on: block = [2, 2]",
            );
        }
        if self.optimise.is_some() && self.lpbf.path != PathChoice::AsCommanded {
            return plain(
                "the recipe search runs the path as commanded",
                "leave out [optimise], or lpbf.path",
            );
        }
        if self.plate.block.is_some() && self.plate.extent == PlateExtent::Whole {
            return plain(
                "the plate is both a block and whole",
                "leave out plate.block, or extent = \"whole\"",
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Job, parse};
    use super::*;

    const WHOLE: &str = "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"three-axis-350\"\nrecipes = [\"industrial\"]\n[plate]\nblock = [3, 1]\nhatch = \"0.09 mm\"\n";

    #[test]
    fn a_job_reads_and_mistakes_are_named() {
        let Job::Lpbf(job) = parse(WHOLE).unwrap() else {
            panic!("a scan-head job")
        };
        assert_eq!(job.plate.block, Some([3, 1]));
        assert_eq!(job.lpbf.delays, DelayChoice::Tuned);
        for (wrong, right, expected) in [
            ("[3, 1]", "[0, 1]", "no squares"),
            ("[\"industrial\"]", "[]", "no recipe"),
            ("\"0.09 mm\"", "0.09", "0.09 UNIT"),
            ("block = [3, 1]", "bloc = [3, 1]", "bloc"),
            (
                "block = [3, 1]",
                "block = [3, 1]\nextent = \"whole\"",
                "both",
            ),
            (
                "[plate]",
                "layers = \"a.cli\"\n[plate]",
                "layers and a plate",
            ),
            (
                "[plate]",
                "[optimise]\nfill_speed = [\"2 m/s\", \"1 m/s\"]\n[plate]",
                "nothing to try",
            ),
            (
                "[plate]\nblock = [3, 1]\nhatch = \"0.09 mm\"",
                "[layers]\nrange = [1, 2]",
                "without a file",
            ),
            (
                "[plate]\nblock = [3, 1]\nhatch = \"0.09 mm\"",
                "layers = \"a.cli\"\n[layers]\nrange = [3, 2]",
                "3 to 2",
            ),
        ] {
            let error = parse(&WHOLE.replace(wrong, right)).unwrap_err();
            assert!(error.message.contains(expected), "{}", error.message);
        }
    }
}
