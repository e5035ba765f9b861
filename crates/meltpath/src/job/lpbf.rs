//! The job of a laser scan head: recipes compared on a plate of squares or on layers of a file.

use meltpath_base::settings::{File, Many, Problem, broken};
use meltpath_base::{Angle, Length, Ratio, Speed, Temperature, Time, choice, table};
use toml::Spanned;

use super::common::{Direction, PartUnit, ProcessTable, ToolpathForm};

table! {
    /// Laser scan head: recipes compared on a plate of squares, on layers of other software, or on layers of a part.
    pub struct LpbfJob {
        /// The part: STEP, STL or 3MF; `[hatch]` draws the layers that `[section]` names.
        part: File => none("a plate of squares, or the file `lpbf.layers`");
        /// Unit of a part file that carries none (STL).
        part_unit: PartUnit => default("mm", "of files that carry none");
        /// The direction of the part file that points up in the build.
        build_direction: Direction => default([0.0, 0.0, 1.0], "+Z of the part file");
        /// Which process the job is for.
        process: ProcessTable => required;
        /// Head and recipes.
        lpbf: LpbfTable => required;
        /// Which squares are run.
        plate: PlateTable => default({}, "a representative block");
        /// Which layers of `lpbf.layers` are run, and where they lie.
        layers: LayersTable => default({}, "the layer that marks most");
        /// Which layers of `part` are marked, and where they lie.
        section: SectionTable => default({}, "the middle of the part");
        /// How layers of `part` are filled; speeds, powers, waits, jumps and sky-writing are those of each recipe.
        hatch: HatchTable => default({}, "a contour and parallel lines");
        /// Limits of the verdict.
        checks: ChecksTable => default({}, "usual limits");
        /// Search of a faster recipe within `[checks]`, beginning with the first recipe.
        optimise: OptimiseTable => none("no search");
        /// What a square, or the layer that melts the least, of each recipe melts through, as commanded and as marked.
        heat: HeatTable => none("not told");
        /// What is written beside the report.
        output: OutputTable => default({}, "nothing");
    }

    /// Head and recipes.
    pub struct LpbfTable {
        /// Head: a name in `data/scan-heads` (`two-axis-150`, `three-axis-350`), or a TOML file of your own.
        head: String => required;
        /// Recipes: names in `data/recipes` (`industrial`, `uniform`, `doubled`), or TOML files of your own; the others are compared
        /// with the first.
        recipes: Many<Spanned<String>, 1> => required;
        /// Laser delays.
        delays: DelayChoice => default("tuned", "tuned on two squares");
        /// Controller of the axes: `cascade` (the head's own), `h-infinity`, or the `controllers.json` of a tuning.
        controller: String => default("cascade", "the head's own");
        /// Whether set-points go through the head's pre-filter.
        prefilter: PreFilterChoice => computed("on behind the cascade, off otherwise");
        /// What is made of the path being known ahead.
        path: PathChoice => default("as-commanded", "set-points go out as they come");
        /// Layers to execute instead of a plate: a CLI file (text or binary), a vector list (`.csv`) or a planar 3MF toolpath (`.3mf`).
        layers: File => none("a plate of squares");
    }

    /// Which squares are run.
    pub struct PlateTable {
        /// How much of the plate.
        extent: PlateExtent => default("block", "minutes instead of hours");
        /// Columns and rows of the block.
        block: [u32; 2] where within(1.0, 1e6) => computed("2 and 2, a representative block; the whole plate's with extent = \"whole\"");
        /// Side of a square.
        side: Length where positive => computed("the head's reference plate");
        /// Hatch distance.
        hatch: Length where within(0.001, 10.0) => computed("the head's reference plate");
    }

    /// Which layers of `lpbf.layers` are run, and where they lie.
    pub struct LayersTable {
        /// First and last layer, as numbered in the file, from 1.
        range: [u32; 2] where within(1.0, 4e9) => computed("the layer that marks most");
        /// The point of the file that lies at the centre of the field.
        origin: [Length; 2] => default(["0 mm", "0 mm"], "the file's own origin");
        /// Hatch distance, for the surface to fill.
        hatch: Length where positive => none("the median distance of neighbouring lines");
    }

    /// Which layers of `part` are marked, and where they lie.
    pub struct SectionTable {
        /// Height on the part, as designed, of the last layer.
        height: Length where not_negative => none("half the part's");
        /// Thickness of a layer.
        layer: Length where positive => default("0.04 mm", "a usual layer");
        /// How many layers are marked: the one at that height, and those below that carry it.
        layers: u32 where within(1.0, 1e6) => default(1, "the layer at that height");
        /// Which of the separate areas of the last layer, the largest first.
        island: u32 => none("all of them");
        /// What the part is drawn larger by, in the plane and along the build direction.
        scaling: [Ratio; 2] where positive => default(["100 %", "100 %"], "as designed");
        /// The point of the part's plane that lies at the centre of the field.
        origin: [Length; 2] => computed("the middle of the last layer");
    }

    /// How layers of `part` are filled; speeds, powers, waits, jumps and sky-writing are those of each recipe.
    pub struct HatchTable {
        /// What is drawn.
        strategy: LaserHatch => default("lines", "what most machines do");
        /// Distance between neighbouring lines.
        spacing: Length where positive => computed("the hatch distance of the head's reference plate");
        /// Angle of the lines in the first layer.
        angle: Angle => default("0 deg", "along x");
        /// Turn of the lines from layer to layer.
        turn: Angle => default("67 deg", "directions come back after 360 layers only");
        /// Contours before the lines inside them.
        contours: u32 where within(0.0, 1000.0) => computed("1 before lines, none before islands");
        /// Edge of an island.
        island: Length where positive => default("5 mm", "a usual chessboard");
    }

    /// Limits of the verdict.
    pub struct ChecksTable {
        /// Contour error that counts as good.
        contour_error: Length where positive => default("0.03 mm", "the accepted deviation of parts");
        /// Least share of the way along contours within it.
        contour_share: Ratio where within(0.0, 1.0) => default("95 %", "a usual limit");
        /// Least fill rate (surface under the swept spot), of the worst layer or square.
        fill_rate: Ratio where within(0.0, 1.0) => none("told, not judged");
        /// Least share of the surface that is melted through, with `[heat]`.
        fusion: Ratio where within(0.0, 1.0) => default("98 %", "a usual limit");
    }

    /// What a recipe search may change, beginning with the first recipe; the bounds are those of `[checks]`.
    pub struct OptimiseTable {
        /// Slowest and fastest contour.
        contour_speed: [Speed; 2] where positive => computed("half to three times that of the recipe");
        /// Slowest and fastest fill.
        fill_speed: [Speed; 2] where positive => computed("half to three times that of the recipe");
        /// Waits after marks to try.
        mark_waits: Many<Time, 1> where not_negative => computed("none, a third, two thirds and all of the recipe's");
        /// Factors on the jump speeds to try.
        jump_factors: Many<Ratio, 1> where positive => default(["100 %", "150 %", "200 %"], "up to twice");
        /// Factors on the first filter of the mirrors to try.
        filter_factors: Many<Ratio, 1> where positive => default(["100 %", "50 %"], "whole and half");
        /// Least fill rate, on the small job and on the whole one.
        fill_rate: Ratio where within(0.0, 1.0) => none("that of `[checks]`, else two points below the first recipe's own");
    }

    /// What a square, or the layer that melts the least, of each recipe melts through, as commanded and as marked.
    pub struct HeatTable {
        /// Material: a name in `data/materials`, or a TOML file of your own.
        material: String => default("in625-laser", "the material that ships for lasers");
        /// Share of the laser's power that becomes heat.
        absorptivity: Ratio where up_to(1.0) => computed("the material's");
        /// Depth to which the metal must have been liquid.
        layer: Length where positive => computed("the thickness of the layers: by the heights in the file of the layers, else `section.layer`, whose default is a usual layer");
        /// Temperature of the bed.
        preheat: Temperature => default("20 °C", "a bed that is not heated");
        /// Edge of the map's cells.
        cell: Length where positive => computed("a quarter of the spot");
        /// Room round the marks that is looked at: what melts beyond it is not told.
        margin: Length where positive => default("0.3 mm", "several spots: pools end before");
        /// Marks followed at most, from the first on.
        marks: Length where positive => default("3 m", "seconds of computing");
    }

    /// What is written beside the report.
    pub struct OutputTable {
        /// The whole marked path of each recipe, every sample with its power.
        motion: MotionForm => none("not written");
        /// What each recipe marks, for other software: `toolpath-1.build.3mf`, …
        toolpath: ToolpathForm => none("not written");
    }
}

choice! {
    /// What is made of the path being known ahead.
    pub enum PathChoice {
        AsCommanded "as-commanded" => "Nothing: set-points go out as they come.",
        Synchronised "synchronised" => "The faster mirror's set-points are filtered so that both mirrors respond alike.",
        Preview "preview" =>
            "Both mirrors' set-points are filtered over past and coming ones so that they arrive without lag, behind any controller and \
             pre-filter; they start 1.5 ms before the path, which is smoothed where the drives need it.",
    }

    /// Whether set-points go through the head's pre-filter.
    pub enum PreFilterChoice {
        On "on" => "The head's.",
        Off "off" => "None.",
        FirstOnly "first-only" => "The head's first average alone: acceleration is bounded, jerk is not.",
        Alike "alike" => "The head's, both mirrors with the averages of the one that lags more.",
    }

    /// What a laser's hatch draws.
    pub enum LaserHatch {
        Lines "lines" => "Parallel lines, each against the one before, the laser off between them.",
        OneWay "one-way" => "Parallel lines, all in the same direction.",
        Islands "islands" =>
            "A checkerboard: squares of lines, those of one colour first, lines turned by 90° from square to square.",
    }

    /// The form of a marked path.
    pub enum MotionForm {
        Csv "csv" => "Comma-separated values.",
        Parquet "parquet" => "Apache Parquet.",
    }

    /// Which laser delays a run uses.
    pub enum DelayChoice {
        Tuned "tuned" => "Tuned on two squares for each recipe.",
        Recipe "recipe" => "The recipe's own.",
    }

    /// How much of the plate is run.
    pub enum PlateExtent {
        Block "block" => "A block of squares at the centre of the field.",
        Whole "whole" => "Every square of the head's reference plate.",
    }
}

/// Squares of a block that a run may have: more than any plate.
const MOST_SQUARES: u64 = 100_000;

impl LpbfJob {
    /// Values that do not go together.
    pub(super) fn check(&self) -> Vec<Problem> {
        let (lpbf, plate, layers) = (&self.lpbf, &self.plate, &self.layers);
        let [first, last] = layers.range.unwrap_or_default();
        let mut found = self.check_part();
        found.extend(broken([
            (
                lpbf.layers.is_written() && plate.says_something(),
                plate
                    .problem("the job has both layers and a plate")
                    .help("leave out [plate], or lpbf.layers"),
            ),
            (
                !lpbf.layers.is_written() && layers.says_something(),
                layers
                    .problem("[layers] without a file")
                    .help("name it in [lpbf]: layers = \"part.cli\"; or leave out [layers]"),
            ),
            (
                last < first,
                layers
                    .range
                    .problem(format!("layers {first} to {last} are none"))
                    .help("give the first and the last layer, from 1 on: range = [1, 10]"),
            ),
            (
                self.optimise.is_written() && *lpbf.path != PathChoice::AsCommanded,
                self.optimise
                    .problem("the recipe search runs the path as commanded")
                    .help("leave out [optimise], or lpbf.path"),
            ),
            (
                plate.block.is_some_and(|[columns, rows]| {
                    u64::from(columns) * u64::from(rows) > MOST_SQUARES
                }),
                plate
                    .block
                    .problem(format!("the block has more than {MOST_SQUARES} squares"))
                    .help("a plate of 400 mm has some 10,000 squares of 4 mm"),
            ),
            (
                plate.block.is_written() && *plate.extent == PlateExtent::Whole,
                plate
                    .block
                    .problem("the plate is both a block and whole")
                    .help("leave out plate.block, or extent = \"whole\""),
            ),
        ]));
        let ranges = self
            .optimise
            .iter()
            .flat_map(|o| [&o.contour_speed, &o.fill_speed]);
        let crossed = ranges.filter(|r| r.is_some_and(|[low, high]| low > high));
        found.extend(crossed.map(|range| {
            let message = format!("{} leaves nothing to try", range.name);
            range
                .problem(message)
                .help("give speeds from slowest to fastest")
        }));
        found
    }

    /// A part is the only work, and what is said of it needs one.
    fn check_part(&self) -> Vec<Problem> {
        let (part, hatch) = (&self.part, &self.hatch);
        let without = |setting: &str, span: &Option<std::ops::Range<usize>>| {
            Problem::new(format!("[{setting}] without a part"))
                .at(span.clone())
                .help("write part = \"bracket.step\" at the top of the job")
        };
        broken([
            (
                part.is_written() && self.lpbf.layers.is_written(),
                self.lpbf
                    .layers
                    .problem("the job has both a part and layers")
                    .help("leave out part, or lpbf.layers"),
            ),
            (
                part.is_written() && self.plate.says_something(),
                self.plate
                    .problem("the job has both a part and a plate")
                    .help("leave out part, or [plate]"),
            ),
            (
                !part.is_written() && self.section.is_written(),
                without("section", &self.section.span),
            ),
            (
                !part.is_written() && hatch.is_written(),
                without("hatch", &hatch.span),
            ),
            (
                *hatch.strategy == LaserHatch::Islands && hatch.contours.is_some_and(|n| n > 0),
                hatch
                    .contours
                    .problem("hatch.contours go before lines, not before islands")
                    .help("leave out hatch.contours, or write strategy = \"lines\""),
            ),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::told_where_they_are;
    use super::super::{Job, parse};
    use super::*;

    const WHOLE: &str = "[process]\nkind = \"lpbf\"\n[lpbf]\nhead = \"three-axis-350\"\nrecipes = [\"industrial\"]\n[plate]\nblock = [3, 1]\nhatch = \"0.09 mm\"\n";

    #[test]
    fn a_job_reads_and_mistakes_are_named() {
        let Job::Lpbf(job) = parse(WHOLE).unwrap() else {
            panic!("a scan-head job")
        };
        assert_eq!(*job.plate.block, Some([3, 1]));
        assert_eq!(*job.lpbf.delays, DelayChoice::Tuned);
        told_where_they_are(
            WHOLE,
            r#"
            [3, 1] => [0, 1] => plate.block is 0
            ["industrial"] => [] => lpbf.recipes has 0 values
            "0.09 mm" => 0.09 => "0.09 mm"
            block = [3, 1] => bloc = [3, 1] => bloc
            block = [3, 1] => block = [3, 1]\nextent = "whole" => both
            [plate] => layers = "a.cli"\n[plate] => layers and a plate
            [process] => part = "a.stl"\n[process] => a part and a plate
            [plate]\nblock = [3, 1]\nhatch = "0.09 mm" => [section]\nheight = "1 mm" => [section] without a part
            [plate]\nblock = [3, 1]\nhatch = "0.09 mm" => [hatch]\nspacing = "0.1 mm" => [hatch] without a part
            [plate] => [optimise]\nfill_speed = ["2 m/s", "1 m/s"]\n[plate] => nothing to try
            [plate]\nblock = [3, 1]\nhatch = "0.09 mm" => [layers]\nrange = [1, 2] => without a file
            [plate]\nblock = [3, 1]\nhatch = "0.09 mm" => layers = "a.cli"\n[layers]\nrange = [3, 2] => 3 to 2"#,
        );
    }
}
