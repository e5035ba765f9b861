//! The job of a wire-arc build.

mod surface;

pub use surface::{
    SurfaceBaseTable, SurfacePasses, SurfaceSpeeds, SurfaceStrategyChoice, SurfaceTable,
    SurfaceTorch,
};

use meltpath_base::quantity::Auto;
use meltpath_base::settings::{File, Json, Kind, Node, Place, Problem, Reader, Value, broken};
use meltpath_base::{Angle, BeadWidths, Frequency, Length, Ratio, Speed, Time, choice, table};

use meltpath_programs::Dialect;
use meltpath_toolpath::WeaveShape;

use super::common::{
    Direction, OneOrMany, PartUnit, ProcessTable, SubstrateTable, TargetTable, ToolpathForm,
};

/// Layer heights from the first layer on; the last one repeats.
pub type LayerHeights = OneOrMany<Length>;

/// Fastest wire feed and travel that a cell has, mm/s: 60 m/min.
const FASTEST: f64 = 1e3;

/// Longest pause, s.
const DAY: f64 = 86_400.0;

table! {
    /// Wire and arc by robot: a part, the process, how layers are filled, the cell, and the limits of the verdict.
    pub struct WaamJob {
        /// The part file: STEP, STL or 3MF.
        part: File => required;
        /// Unit of a part file that carries none (STL).
        part_unit: PartUnit => default("mm", "of files that carry none");
        /// The direction of the part file that points up in the build.
        build_direction: Direction => default([0.0, 0.0, 1.0], "+Z of the part file");
        /// Which process the job is for.
        process: ProcessTable => required;
        /// Wire, gas, source and bead.
        waam: WaamTable => required;
        /// How the part is cut into layers.
        layers: LayersTable => default({}, "from the growth model");
        /// How layers are filled.
        fill: FillTable => default({}, "contours outside, zigzag inside");
        /// A wall one bead thick along a surface in space, instead of flat layers; `layers.height` is the distance between its passes.
        surface: SurfaceTable => none("flat layers");
        /// A body that is there already, out of which the part grows in layers that follow it, instead of flat ones: a repair, a boss on a pipe.
        onto: OntoTable => none("flat layers");
        /// The cell and how it is driven.
        machine: MachineTable => default({}, "the cell that ships");
        /// The plate the part is built on.
        substrate: SubstrateTable => default({}, "the part with 25 mm around it");
        /// What the build must cover.
        target: TargetTable => default({}, "a blank to be machined");
        /// Limits of the verdict.
        checks: ChecksTable => default({}, "usual limits");
        /// Resolution.
        simulation: SimulationTable => default({}, "far below a bead");
        /// What is written besides the report.
        output: OutputTable => default({}, "a program for the cell");
    }

    /// Wire, gas, source and bead.
    pub struct WaamTable {
        /// Wire: a name in `data/wires`, or a TOML file of your own.
        wire: String => required;
        /// Shielding gas: a name in `data/gases`, or a TOML file of your own.
        gas: String => required;
        /// Transfer mode, such as `cmt`; wire, gas and mode together select the process map.
        mode: String => required;
        /// Process map: a name in `data/process-maps`, or a TOML file of your own.
        map: String => computed("the one for wire, mode and gas: `WIRE-MODE-GAS`");
        /// Weld pool: a name in `data/pools`, or a TOML file of your own.
        pool: String => computed("the one for wire, mode and gas; else the nearest that was measured, told");
        /// How far the bead stays behind the torch at corners: a name in `data/pools`, or a TOML file of your own, of which `[[pursuit]]` counts.
        pursuit: String => computed("that of `pool` where it tells any; else that of wire, mode and gas; else the nearest that was measured, told");
        /// Electric energy per volume: a name in `data/energy`, or a TOML file of your own.
        energy: String => computed("the first that knows wire and mode; else it cannot be said");
        /// Deposited metal over fed metal.
        efficiency: Ratio where up_to(1.0) => computed("the process map's: 100 % with the seed map, 95 % otherwise");
        /// How the welding source is set and what it was seen to feed.
        source: SourceTable => default({}, "as measured with the process map");
        /// The bead: two of the four values, or the height alone.
        bead: BeadTable => default({}, "wire feed and travel speed in the middle of the map");
    }

    /// How the welding source is set and what it was seen to feed.
    pub struct SourceTable {
        /// Whether the wire feed follows the contact tube distance.
        feed_response: FeedResponseChoice => default("auto", "where the process map says how");
        /// Setting of the penetration stabiliser: the greatest change to the programmed wire feed; `"0 m/min"` holds the feed.
        penetration_stabiliser: Speed where within(0.0, FASTEST) => computed("as measured with the process map");
        /// Wire really fed over wire programmed, at the first layer's contact tube distance, measured on your own installation.
        feed_factor: Ratio where within(0.2, 5.0) => computed("that of the process map");
    }

    /// The bead: two of the four values, or the height alone.
    pub struct BeadTable {
        /// Programmed wire feed speed (WFS).
        wire_feed: Speed where up_to(FASTEST) => computed("the process map");
        /// Travel speed (TS).
        travel_speed: Speed where up_to(FASTEST) => computed("the process map");
        /// Width of a single bead.
        width: Length where up_to(100.0) => computed("the process map");
        /// Height of a single bead.
        height: Length where up_to(100.0) => computed("the process map");
        /// How the torch swings about the path of each bead. Nothing measured says how wide and high a woven bead is: the verdict cannot say of its metal.
        weave: WeaveTable => none("the torch goes along its path");
    }

    /// How the torch swings about the path of each bead.
    pub struct WeaveTable {
        /// How it swings.
        shape: WeaveShape => default("sine", "as most controllers weave");
        /// Swings a second, without the dwells.
        frequency: Frequency where within(0.6, 126.0) => required;
        /// From the path to one side.
        amplitude: Length where up_to(50.0) => required;
        /// How long the torch stays on the left while it goes on.
        dwell_left: Time where within(0.0, 10.0) => default("0 s", "it turns at once");
        /// How long the torch stays on the right while it goes on.
        dwell_right: Time where within(0.0, 10.0) => default("0 s", "it turns at once");
        /// Width of the woven bead that the plan assumes: measure it on a trial.
        bead_width: Length where up_to(100.0) => computed("the width of the bead that is not woven and the swing to both sides");
    }

    /// How the part is cut into layers.
    pub struct LayersTable {
        /// Layer height: one height, or a list of heights of which the last one repeats.
        height: Auto<LayerHeights> where up_to(100.0) => default("auto", "from the growth model");
        /// Build this many layers.
        count: u32 where within(1.0, 1e6) => none("as many as the part needs");
        /// Pause after each layer.
        pause: Time where within(0.0, DAY) => default("0 s", "no pause");
        /// When the next layer begins.
        until: LayerRelease => default("pause", "after the pause");
    }

    /// How layers are filled.
    pub struct FillTable {
        /// Strategy.
        strategy: FillStrategy => default("hybrid", "contour outside, few arc stops inside; left out, another where the plan is expected to fail with it");
        /// Contours round a hybrid fill.
        contours: u32 => default(1, "one hides the turns of the zigzag");
        /// Distance between neighbouring beads: a length, or bead widths as `"0.70 w"`.
        stepover: Auto<Stepover> where up_to(100.0) => default("auto", "tangent overlap, 0.738 of the bead's width");
        /// How the stepover is kept.
        spacing: Spacing => default("adjust", "fills the width exactly; left out, \"exact\" where the plan is expected to fail with it");
        /// Direction of raster and zigzag lines in the first layer.
        angle: Angle => computed("raster: the direction with the fewest lines; else 0 deg");
        /// Turn of that direction from layer to layer.
        turn: Angle => computed("90 deg, so that gaps and reversals do not stack; raster: none");
        /// Distance from a contour at which a zigzag inside it turns back, over the stepover.
        reversal: Ratio where within(0.0, 2.0) => computed("28 % with adapted speeds, which take metal from the turns; else 100 %, where metal is in balance; left out, another where the plan is expected to fail with it");
        /// Order of contours or lines.
        order: FillOrder => computed("contours inside-out; lines alternate-layers");
        /// Start points of closed beads.
        starts: Starts => default("spread", "start defects do not stack");
        /// Travel speeds along beads.
        speeds: Speeds => computed("adapted for hybrid and zigzag fills, whose links and turns lie near other beads; else constant");
    }

    /// A body that is there already.
    pub struct OntoTable {
        /// The body as it is now, in the coordinates of the part file: STEP, STL or 3MF.
        body: File => required;
        /// Further parts, each of which grows out of the body and of the parts before it, in a direction of its own: branches, bosses on a trunk.
        then: Vec<File> => default([], "the part alone");
        /// The top of what grows, where layers are to go from the body to it: so many everywhere, thicker where there is more between the
        /// two, and laid the slower. Faces of a STEP part, by the numbers that `meltpath inspect` shows, or "auto".
        top: Auto<Vec<u32>> => none("layers at one distance from the body, of which the last end where the part does");
        /// Where the torch points from.
        torch: TorchChoice => default("tangent", "across the layers, as beads were measured");
        /// Greatest lean of the torch against the vertical; beyond it the torch is turned back.
        tilt: Angle where within(0.0, std::f64::consts::PI) => none("no bound");
        /// Angle by which the wire points ahead along the travel: above zero it pushes, below zero it drags.
        lead: Angle where within(-1.0, 1.0) => default("0 deg", "the wire along the torch's rule");
    }

    /// The cell and how it is driven.
    pub struct MachineTable {
        /// Cell: a name in `data/cells`, or a TOML file of your own.
        cell: String => default("arcmate-120ic", "the cell that ships");
        /// Robot with torch and table: a name in `data/robots`, or a TOML file of your own. With it reach, joint speeds, collisions and
        /// CONFIG are checked, and the rotation about the wire is chosen.
        robot: String => none("reach, collisions and CONFIG are not checked");
        /// Where the origin of the part lies on the robot's table (in the flange where the robot holds the part): x, y, z.
        place: [Length; 3] => none("where the robot's file puts the part");
        /// What holds the plate, the body of [onto], or the cylinder that a surface begins on, over the table: shafts, pedestals, clamps.
        holders: Vec<HolderTable> => default([], "nothing but the table");
        /// What track and positioner of the robot's file do while the torch moves.
        external: ExternalChoice => default("standing", "they rest");
        /// Smoothing at via points (FANUC CNT): 0 % stops at each point.
        smoothing: Ratio where within(0.0, 1.0) => default("50 %", "CNT50, the reference of Rouchon 2022; left out, 25 % where walls are expected to fail with it");
        /// Contact tube to work distance at the first layer.
        ctwd: Length where up_to(100.0) => computed("the cell's nominal distance");
    }

    /// Something round with flat ends that holds a part, in the coordinates of the part file.
    pub struct HolderTable {
        /// The middle of the end where it begins: x, y, z.
        from: [Length; 3] => required;
        /// The middle of the other end: x, y, z.
        to: [Length; 3] => required;
        /// Its radius.
        radius: Length where up_to(1e4) => required;
    }

    /// Limits of the verdict.
    pub struct ChecksTable {
        /// Largest lack of metal against the finished part, share of its volume.
        lack: Ratio where within(0.0, 1.0) => default("0.5 %", "a usual limit for a blank to be machined");
        /// Largest excess over part + allowance, share of the part's volume.
        excess: Ratio where within(0.0, 100.0) => default("30 %", "a usual limit for a blank to be machined");
        /// Smallest machining stock over the finished part.
        stock_min: Length where within(-1000.0, 1000.0) => default("0.3 mm", "a usual limit for a blank to be machined");
        /// Largest difference between a layer's mean height and its planned height.
        height_error: Length where up_to(1000.0) => computed("what brings the contact tube to checks.ctwd_min or checks.ctwd_max");
        /// Largest peak-to-valley height of a layer over its inner area.
        flatness: Length where up_to(1000.0) => default("1.5 mm", "a usual limit for a blank to be machined");
        /// Smallest contact tube to work distance, at any place.
        ctwd_min: Length where up_to(100.0) => default("8 mm", "nearer, spatter and the arc reach the contact tube");
        /// Largest contact tube to work distance, at any place: as far as the torch's gas covers the pool.
        ctwd_max: Length where up_to(100.0) => default("20 mm", "usual reach of the gas; ask the maker of the torch");
        /// How far beyond the distances at which the wire feed was measured its law is taken to hold; of a stretch farther out and longer than the pool the verdict cannot say.
        ctwd_beyond: Length where within(0.0, 100.0) => default("0.5 mm", "the scatter of such a measurement");
        /// Largest thickness of a layer beyond its mean, taken over a bead's width of path, share of it.
        accumulation: Ratio where up_to(100.0) => default("50 %", "a usual limit for a blank to be machined");
        /// Largest shift of a layer over the one below, in bead widths.
        overhang: Ratio where up_to(100.0) => default("25 %", "a usual limit for a blank to be machined");
        /// Largest deviation of the distance between passes on a surface from the layer height, share of it.
        spacing: Ratio where up_to(100.0) => default("10 %", "the scatter of bead heights, three times its usual 3 %");
        /// Largest angle between torch and vertical along a surface.
        tilt: Angle where within(0.0, std::f64::consts::PI) => none("what `[tilt]` of the process map says of beads as large; without it the tilt is told and cannot be judged");
        /// Smallest distance of torch and arm from the part as it grows, the table and the arm itself.
        clearance: Length where within(0.0, 1000.0) => default("2 mm", "a nozzle that comes nearer touches sooner or later");
        /// Smallest distance of a joint of the robot from its limits.
        joint_margin: Angle where within(0.0, 3.2) => default("2 deg", "the robot never stands exactly where its file says");
    }

    /// Resolution.
    pub struct SimulationTable {
        /// Cell of the height map; along a surface, side of the voxels, a twelfth of the bead's width at most.
        cell: Length where within(0.05, 10.0) => default("0.5 mm", "a thirteenth of a usual bead");
        /// Chord error of the mesh made of a B-rep part.
        chord_error: Length where within(1e-4, 10.0) => default("0.02 mm", "far below a bead's scatter");
    }

    /// What is written besides the report.
    pub struct OutputTable {
        /// Dialects of the programs that a run writes into `program/`; `[]` for none.
        programs: Vec<Dialect> => none("what the controller of the cell reads");
        /// The plan for other software, `toolpath.build.3mf`: every bead with the torch at each point.
        toolpath: ToolpathForm => none("not written");
    }
}

choice! {
    /// Whether the wire feed follows the contact tube distance.
    pub enum FeedResponseChoice {
        Auto "auto" => "Where the process map says how.",
        Off "off" => "Always the same feed.",
    }

    /// What track and positioner do while the torch moves.
    pub enum ExternalChoice {
        Standing "standing" => "They rest.",
        Free "free" => "They move together with the arm, so that it reaches, and the part lies under a torch that points down.",
    }

    /// When the next layer begins.
    pub enum LayerRelease {
        Pause "pause" => "After the pause.",
        Cooled "cooled" =>
            "After the pause, once the cell's input tells that the layer has cooled (`program.cooled` of the cell file). How long that takes is \
             not simulated.",
    }

    /// Filling strategies.
    pub enum FillStrategy {
        Raster "raster" => "Parallel lines, one arc start each.",
        Zigzag "zigzag" => "Back and forth with few arc stops.",
        Contour "contour" => "Offsets of the boundary.",
        Spiral "spiral" => "One bead that winds from offset to offset.",
        Hybrid "hybrid" => "Contours outside, zigzag inside.",
    }

    /// How a stepover is kept.
    pub enum Spacing {
        Adjust "adjust" => "Adjusted so that the beads fill the width exactly.",
        Exact "exact" => "Kept as written; the width may not be filled exactly.",
    }

    /// Order of beads in a layer.
    pub enum FillOrder {
        InsideOut "inside-out" => "Contours from the inside to the outside.",
        OutsideIn "outside-in" => "Contours from the outside to the inside.",
        OneWay "one-way" => "Lines all in one direction.",
        AlternateBeads "alternate-beads" => "Lines in alternate directions.",
        AlternateLayers "alternate-layers" => "Lines in one direction, reversed each layer.",
        CentreOut "centre-out" => "Lines from the centre outwards.",
    }

    /// Where the torch points from, along layers on a body.
    pub enum TorchChoice {
        Tangent "tangent" => "Along the wall, in the direction in which it grows.",
        Half "half" => "Halfway between that and the direction in which the build begins.",
        Fixed "fixed" => "Along the direction in which the build begins.",
    }

    /// Where closed beads start.
    pub enum Starts {
        Spread "spread" => "Spread over the contour from layer to layer.",
        Aligned "aligned" => "At the same place in each layer.",
    }

    /// Travel speeds along the beads of a layer.
    pub enum Speeds {
        Constant "constant" => "One speed for every bead.",
        Adapted "adapted" =>
            "Faster where a bead has less room beside it, slower where it has more (0.8 to 2 times the travel speed), so that every \
             place gets as much metal.",
    }
}

/// A stepover as written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stepover {
    /// A length.
    Length(Length),
    /// A number of bead widths.
    Widths(BeadWidths),
}

impl Value for Stepover {
    const KIND: Kind = Kind::Either(&Length::KIND, &BeadWidths::KIND);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        match node.get_ref().as_str() {
            Some(text) if text.trim().ends_with('w') => {
                BeadWidths::read(node, place, reader).map(Stepover::Widths)
            }
            _ => Length::read(node, place, reader).map(Stepover::Length),
        }
    }

    fn json(&self) -> Json {
        match self {
            Stepover::Length(length) => length.json(),
            Stepover::Widths(widths) => widths.json(),
        }
    }
}

impl WaamJob {
    /// Values that do not go together.
    pub(super) fn check(&self) -> Vec<Problem> {
        let bead = &self.waam.bead;
        let given = bead.given();
        let height_alone = given == 1 && bead.height.is_written();
        let (least, most) = (&self.checks.ctwd_min, &self.checks.ctwd_max);
        let surface = self.surface.is_some();
        let onto = self.onto.is_some();
        let several = matches!(&*self.layers.height, Auto::Value(list) if list.len() > 1);
        let flat = |written: bool, problem: Problem| {
            let help = "leave it out, or leave [surface] out for flat layers";
            (surface && written, problem.help(help))
        };
        // the key that is written; both may be
        let wrong = if least.is_written() { least } else { most };
        let mut problems = broken([
            (
                !matches!(given, 0 | 2) && !height_alone,
                bead.problem(format!("the bead has {given} of its four values"))
                    .help("give two of wire_feed, travel_speed, width, height; or height alone"),
            ),
            flat(
                self.fill.is_written(),
                self.fill.problem(
                    "[fill] is of flat layers: passes on a surface follow surface.strategy",
                ),
            ),
            flat(
                self.target.is_written(),
                self.target
                    .problem("[target] is of solid parts: a wall on a surface is one bead thick"),
            ),
            (
                (surface || onto) && several,
                self.layers
                    .height
                    .problem("layers that are not flat have one height, and several are written")
                    .help("write one height, or \"auto\""),
            ),
            (
                surface && onto,
                self.onto
                    .problem("[surface] and [onto] stand together: a wall one bead thick along a surface, or layers on a body")
                    .help("take one of them out"),
            ),
            (
                matches!(self.onto.as_ref().map(|t| &*t.top), Some(Some(Auto::Value(faces))) if faces.is_empty()),
                self.onto
                    .problem("onto.top names no face")
                    .help("write top = \"auto\" for what of the part looks away from the body, or leave it out for layers at one distance from the body"),
            ),
            (
                self.onto.as_ref().is_some_and(|t| !t.then.is_empty() && matches!(&*t.top, Some(Auto::Value(_)))),
                self.onto
                    .problem("onto.top names faces, and onto.then further parts: faces have the numbers of one file")
                    .help("write top = \"auto\", which is what of each part looks away from what it grows out of; or leave it out"),
            ),
            (
                !self.machine.holders.is_empty() && !surface && !onto,
                self.machine
                    .holders
                    .problem("machine.holders is of layers that are not flat: flat ones stand on their plate")
                    .help("leave it out, or build along a surface or onto a body: [surface], [onto]"),
            ),
            (
                self.machine.holders.iter().any(|h| *h.from == *h.to),
                self.machine
                    .holders
                    .problem("one of machine.holders ends where it begins")
                    .help("write the middles of both of its ends: from, to"),
            ),
            (
                !self.machine.holders.is_empty() && !self.machine.robot.is_written(),
                self.machine
                    .holders
                    .problem("machine.holders is written, but no robot whose torch could touch them")
                    .help("name the robot: machine.robot"),
            ),
            (
                least.0 > most.0,
                wrong
                    .problem(format!(
                        "checks.ctwd_min is {}, checks.ctwd_max {}: no distance lies between them",
                        **least, **most
                    ))
                    .help("write the nearer distance in ctwd_min, the farther one in ctwd_max"),
            ),
        ]);
        problems.extend(self.of_surface());
        problems
    }

    /// Values of `[surface]` that do not go together.
    fn of_surface(&self) -> Vec<Problem> {
        let spiral = self.surface.as_ref();
        let spiral = spiral.filter(|s| *s.passes == SurfacePasses::Spiral);
        broken([
            (
                self.surface.as_ref().is_some_and(|s| s.field.is_written() != (*s.torch == SurfaceTorch::Field)),
                self.surface
                    .problem("surface.torch = \"field\" and surface.field go together: one of them is written")
                    .help("write torch = \"field\" and field = \"directions.csv\", or neither"),
            ),
            (
                spiral.is_some_and(|s| *s.speeds == Some(SurfaceSpeeds::Constant)),
                self.surface
                    .problem("surface.speeds = \"constant\" and surface.passes = \"spiral\": a spiral begins and ends on a ramp, which speeds make")
                    .help("leave surface.speeds out"),
            ),
            (
                spiral.is_some() && (self.layers.pause.is_written() || self.layers.until.is_written()),
                self.layers
                    .problem("layers.pause and layers.until are of layers that end, and the arc of a spiral does not")
                    .help("leave them out, or write surface.passes = \"each\""),
            ),
            (
                self.surface
                    .as_ref()
                    .is_some_and(|s| s.base.radius.is_written() && s.base.profile.is_written()),
                self.surface
                    .problem("surface.base has a radius and a profile: it is a cylinder or a body of revolution")
                    .help("write one of the two"),
            ),
        ])
    }
}

impl BeadTable {
    /// How many of the four values are written.
    fn given(&self) -> usize {
        let written = [
            self.wire_feed.is_written(),
            self.travel_speed.is_written(),
            self.width.is_written(),
            self.height.is_written(),
        ];
        written.into_iter().filter(|w| *w).count()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::told_where_they_are;
    use super::super::{Job, Written, parse};
    use super::*;

    const WHOLE: &str = include_str!("../../tests/jobs/whole.toml");

    fn waam(text: &str) -> Written<WaamJob> {
        match parse(text).unwrap() {
            Job::Waam(job) => *job,
            Job::Ebm(_) | Job::Lpbf(_) => panic!("a wire-arc job"),
        }
    }

    #[test]
    fn every_table_reads() {
        let job = waam(WHOLE);
        assert_eq!(
            *job.fill.stepover,
            Auto::Value(Stepover::Widths(BeadWidths(0.70)))
        );
        assert_eq!(*job.machine.smoothing, Ratio(0.5));
        let Auto::Value(heights) = &*job.layers.height else {
            panic!("heights are written")
        };
        assert_eq!(heights.len(), 2);
    }

    #[test]
    fn mistakes_are_named_where_they_are() {
        told_where_they_are(
            WHOLE,
            r#"
            strategy = "hybrid" => strategie = "hybrid" => strategie
            strategy = "hybrid" => strategy = "hybird" => did you mean "hybrid"
            wire_feed = "8 m/min" => wire_feed = "-8 m/min" => above 0 m/min
            wire_feed = "8 m/min" => wire_feed = 8 => "8 m/min"
            wire_feed = "8 m/min" => wire_feed = "8,5 m/min" => "8.5 m/min"
            ctwd = "15 mm" => ctwd = "15" => "15 mm"
            stepover = "0.70 w" => stepover = "0.7" => "0.7 mm"
            travel_speed = "0.75 m/min" =>  => 1 of its four
            kind = "waam" => kind = "fdm" => waam
            smoothing = "50 %" => smoothing = "150 %" => 0 % to 100 %
            efficiency = "100 %" => efficiency = "300 %" => at most 100 %
            travel_speed = "0.75 m/min" => travel_speed = "1000000000 m/min" => at most 60 m/min
            pause = "30 s" => pause = "1e300 s" => 0 s to
            ctwd_min = "8 mm" => ctwd_min = "28 mm" => no distance
            build_direction = [0.0, 0.0, 1.0] => build_direction = [0.0, 0.0, 0.0] => no direction"#,
        );
    }

    /// Every mistake of a file is told at once, and what is proposed in its place mends it.
    #[test]
    fn all_mistakes_are_told_and_their_remedies_mend_them() {
        let mut text = WHOLE.to_owned();
        for (wrong, right) in [
            ("strategy = \"hybrid\"", "strategi = \"hybrid\""),
            (
                "travel_speed = \"0.75 m/min\"",
                "travel_speed = \"0,75 m/min\"",
            ),
            ("ctwd = \"15 mm\"", "ctwd = 15"),
            ("starts = \"spread\"", "starts = \"spred\""),
            ("pause = \"30 s\"", "pause = \"30\""),
        ] {
            assert!(text.contains(wrong), "{wrong}");
            text = text.replace(wrong, right);
        }
        let problems = parse(&text).unwrap_err();
        assert_eq!(problems.len(), 5, "{problems:?}");
        for problem in problems.iter().rev() {
            let fix = problem.fix.as_ref().unwrap();
            text.replace_range(problem.span.clone().unwrap(), fix);
        }
        assert_eq!(parse(&text).unwrap(), parse(WHOLE).unwrap());
    }
}
