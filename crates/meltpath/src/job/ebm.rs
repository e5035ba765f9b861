//! The job of an electron-beam simulation: a beam path over powder, and the temperatures wanted.

mod check;
mod rings;
mod search;

use meltpath_base::settings::{File, Many};
use meltpath_base::{
    Angle, Current, Length, Pressure, Ratio, Speed, Temperature, TemperatureDifference, Time,
    Voltage, choice, table,
};
use meltpath_thermal::material::file::{DensityReading, PorosityReading, PowderReading};

use super::common::{Direction, PartUnit, ProcessTable};

/// Corners of a contour, three or more.
pub type Ring = Many<[Length; 2], 3>;

/// A place: x, y, and z where it is not the build plane.
pub type Point = Many<Length, 2, 3>;

/// Fastest beam that any gun draws, mm/s: 100 km/s.
const FASTEST: f64 = 1e8;

/// Widest beam that melts, mm.
const WIDEST: f64 = 10.0;

/// Longest dwell, s.
const DAY: f64 = 86_400.0;

table! {
    /// Electron beam over powder: a beam path, or a region or part that is hatched, and the temperatures wanted.
    pub struct EbmJob {
        /// The beam path: CSV or Parquet with the columns `t_s,x_mm,y_mm,U_V,I_A,I_f_A,on`.
        path: File => none("`[hatch]` draws the region or the part");
        /// The part: STEP, STL or 3MF; `[hatch]` draws the section that `[section]` names.
        part: File => none("`[region]` is drawn");
        /// Unit of a part file that carries none (STL).
        part_unit: PartUnit => default("mm", "of files that carry none");
        /// The direction of the part file that points up in the build.
        build_direction: Direction => default([0.0, 0.0, 1.0], "+Z of the part file");
        /// Which process the job is for.
        process: ProcessTable => required;
        /// Which layer of `part` is drawn.
        section: SectionTable => default({}, "the middle of the part");
        /// Beam, powder, material.
        ebm: EbmTable => default({}, "the thesis' machine and material");
        /// Temperature histories under a beam at rest.
        charts: ChartsTable => default({}, "computed by the run");
        /// How the simulation is carried out.
        simulation: SimulationTable => default({}, "fine enough for the usual beam");
        /// Which voxels of the last layer are judged.
        region: RegionTable => default({}, "all that is drawn");
        /// How the beam fills the region, in place of a file of its path.
        hatch: HatchTable => none("the beam follows `path`");
        /// Less energy near powder. `modulated` hatches follow it by their spacing, all others by their speed.
        modulation: ModulationTable => none("the same energy everywhere");
        /// Highest temperatures that are wanted.
        window: WindowTable => default({}, "that of Ti6Al4V in Béraud 2016");
        /// Changes of the beam along the path, and of the path's order.
        optimise: OptimiseTable => none("the path is drawn as given");
        /// Currents of the path, or of the better one, corrected on the judge's solver until the whole section lies in the window.
        correct: CorrectTable => none("the currents are those of the path");
        /// The path, or the better one, on a solver over the whole section. What it costs, `meltpath doctor` tells.
        judge: JudgeTable => default({}, "a solver decides over the whole section");
        /// Limits of the verdict.
        checks: ChecksTable => default({}, "usual limits");
    }

    /// Which layer of `part` is drawn.
    pub struct SectionTable {
        /// Height on the part, as designed, of the last layer.
        height: Length where not_negative => none("half the part's");
        /// Which of the separate areas of that layer, the largest first.
        island: u32 => default(1, "the largest");
        /// What the part is drawn larger by, in the plane and along the build direction.
        scaling: [Ratio; 2] where within(0.0, 1.0) => computed("the material's: parts shrink on cooling");
    }

    /// Beam, powder, material.
    pub struct EbmTable {
        /// Material: a name in `data/materials`, or a TOML file of your own.
        material: String => default("ti6al4v-ebm", "the material of Béraud 2016");
        /// How the thesis' porosity law is read (erratum E1).
        porosity: PorosityReading => default("physical", "erratum E1: the printed law is no porosity");
        /// Which of the thesis' density cells are used (erratum E2).
        density: DensityReading => default("corrected", "erratum E2: the printed cells are exchanged");
        /// How powder conducts, below and beside what is drawn.
        powder_conductivity: PowderReading => default("by-density", "the law of Béraud 2016");
        /// Focus calibration of the gun: a name in `data/focus`, or a TOML file of your own.
        focus: String => default("a1-beraud-2016", "the machine of Béraud 2016");
        /// The machine's gun: a name in `data/guns`, or a TOML file of your own. The solver of `[judge]` draws the path as it draws it.
        gun: String => none("a beam that is where the path says, with the power it says");
        /// Temperature of the bed when the beam comes to a layer: what preheating leaves.
        preheat: Temperature => computed("the material's start temperature");
        /// Beam diameter whatever the focus, in place of a calibration.
        diameter: Length where up_to(WIDEST) => none("that of the focus calibration");
        /// Share of the beam power that becomes heat.
        efficiency: Ratio where up_to(1.0) => default("90 %", "Zäh and Lutzmann, quoted in Béraud 2016");
        /// How deep the beam enters.
        penetration: Length where within(0.001, 1.0) => default("0.1 mm", "Béraud 2016, eq. 3.2.2");
        /// Thickness of a layer.
        layer: Length where up_to(2.0) => default("0.05 mm", "step of the table in Béraud 2016");
        /// How often the path is drawn, a fresh layer each.
        layers: u32 where within(1.0, 1e6) => default(1, "the path is drawn once");
        /// What lies under the first layer; a part says it itself.
        ground: Ground => default("metal", "dense metal everywhere");
        /// What leaves the build plane as vapour, on the solver; charts know of none.
        evaporation: Vapour => default("free", "what the material's law and the chamber's gas let go");
        /// Pressure of the gas in the chamber: vapour leaves freely from a saturation of five times that on, and none below it.
        chamber: Pressure where not_negative => default("0.2 Pa", "helium while an electron beam melts");
        /// Temperature of the heat shield above the build plane.
        shield: Temperature => default("300 °C", "measured by Neira Arce, quoted in Béraud 2016, section 3.2.2.1");
    }

    /// Temperature histories under a beam at rest.
    pub struct ChartsTable {
        /// Whether charts show the path before the solver of `[judge]` decides.
        preview: ChartPreview => computed("drawn, a first look in seconds; none where [optimise] looks on the judge's solver");
        /// Chart files to use; settings they do not serve are computed.
        files: Vec<File> => default([], "all are computed");
        /// Heating stops here; above it temperatures are told apart badly.
        stop: Temperature where within(0.0, 1e5) => default("2800 °C", "Béraud 2016, section 3.2.2.3");
        /// Cooling starts from the pool whose hottest point has this temperature.
        cooling_from: Temperature where within(0.0, 1e5) => default("2800 °C", "Béraud 2016, section 3.2.2.3");
        /// Spacing of the charts.
        spacing: Length where positive => default("0.025 mm", "converged within 2 °C of mean error");
        /// What the ground keeps of earlier lines.
        memory: ChartMemory => default("ground", "without it a fast hatch reads 500 to 1300 °C too low");
    }

    /// How the simulation is carried out.
    pub struct SimulationTable {
        /// Edge of a voxel in the plane.
        voxel: Length where positive => default("0.057 mm", "voxels of the thesis' large cases");
        /// Time step.
        step: Time where positive => default("2.5e-6 s", "melting takes 0.03 ms at 300 W");
        /// Powder beyond the path.
        margin: Length where positive => default("0.5 mm", "Béraud 2016, section 3.2.2.1");
        /// Pictures in time.
        frames: u32 where within(1.0, 500.0) => default(24, "enough to see the beam move");
        /// Places through which sections are drawn, besides the hottest one.
        sections: Vec<[Length; 2]> => default([], "the hottest alone");
    }

    /// Which voxels of the last layer are judged.
    pub struct RegionTable {
        /// Corners of the contour.
        contour: Ring => none("the section of the part, or the convex hull of the path");
        /// Corners of each hole.
        holes: Vec<Ring> => default([], "no holes");
        /// Corners of the metal below the first layer, where the ground is powder: what the region hangs over from.
        supported: Ring => none("no metal below powder");
        /// How far inside the contour voxels must lie that are counted on charts and learned from; `[judge]` counts the whole section.
        inside: Length where not_negative => default("0.2 mm", "rims melt with what lies beside them");
    }

    /// How the beam fills the region, in place of a file of its path.
    pub struct HatchTable {
        /// What is drawn.
        strategy: HatchStrategy => default("lines", "Béraud 2016");
        /// Distance between neighbouring lines or spots.
        spacing: Length where positive => default("0.125 mm", "49 J/mm³ at the thesis' beam (erratum E22)");
        /// Angle of the lines in the first layer.
        angle: Angle => default("0 deg", "along x");
        /// Turn of the lines from layer to layer.
        turn: Angle => default("90 deg", "crossed layers: what one leaves cold the next one crosses");
        /// Contours before the interior of lines.
        contours: u32 => default(0, "lines alone");
        /// How far beyond the contour is drawn, so that the rim is as hot as the middle; draw the part smaller by as much, or machine it off.
        overrun: Length where not_negative => default("0 mm", "up to the contour");
        /// Edge of an island.
        island: Length where positive => default("2 mm", "of the order of what stays hot behind the beam");
        /// Speed of the beam.
        speed: Speed where up_to(FASTEST) => default("980 mm/s", "Béraud 2016, table 3.3.2");
        /// Time on a spot.
        dwell: Time where up_to(DAY) => computed("what a line at that speed spends on the spacing");
        /// Speed from the end of a line to the start of the next, beam off.
        jump: Speed where up_to(FASTEST) => none("no time at all");
        /// Accelerating voltage.
        voltage: Voltage where up_to(1e6) => default("60 kV", "Béraud 2016, table 3.3.2");
        /// Beam current.
        current: Current where up_to(10.0) => default("5 mA", "Béraud 2016, table 3.3.2");
        /// Current of the focus coil.
        focus: Current => default("4 mA", "Béraud 2016, table 3.3.2");
    }

    /// Less energy near powder: a starting value to be tuned, since those of Béraud 2016 are lost.
    pub struct ModulationTable {
        /// Share of the hatch's energy at contact with powder beside, along each axis.
        across: Ratio where positive => default("80 %", "a starting value to be tuned: those of Béraud 2016 are lost");
        /// Distance from which nothing is taken off.
        across_length: Length where positive => default("1 mm", "powder is felt 1 to 2 mm away (Béraud 2016, section 2.2.1.1)");
        /// Share at contact with powder below.
        along: Ratio where positive => default("60 %", "a starting value to be tuned: those of Béraud 2016 are lost");
        /// Thickness of metal from which nothing is taken off.
        along_length: Length where positive => default("1 mm", "powder is felt 1 to 2 mm away (Béraud 2016, section 2.2.1.1)");
    }

    /// Highest temperatures that are wanted: two limits, or a width about the middle of a body known to be good.
    pub struct WindowTable {
        /// Lower limit.
        low: Temperature where within(0.0, 1e5) => default("2700 °C", "Béraud 2016, section 3.3.2.1, on the scale of the thesis' simulator");
        /// Upper limit.
        high: Temperature where within(0.0, 1e5) => default("2760 °C", "Béraud 2016, section 3.3.2.1, on the scale of the thesis' simulator");
        /// With which model the limits were found: temperatures of another say nothing on the judge's solver.
        model: WindowModel => none("the thesis', where no limits are written; limits without it decide nothing");
        /// Path of a body known to be good, simulated alike; the window is centred on its middle.
        good: File => none("`low` and `high`, or `body`");
        /// Width and height of a rectangle that `[hatch]` makes well: the body known to be good in place of a path.
        body: [Length; 2] where positive => none("`low` and `high`, or `good`");
        /// Width of the window about a good body.
        width: TemperatureDifference where within(1.0, 250.0) => default("60 K", "the thesis' window, 2700 to 2760 °C");
    }

    /// Changes of the beam along the path, and of the path's order.
    pub struct OptimiseTable {
        /// How.
        method: OptimiseMethod => required;
        /// What is changed.
        change: Change => default("speed", "what every machine can change");
        /// What the temperatures are taken from.
        solver: OptimiseSolver => computed("judge; charts where nothing judges, for accelerate and pid, where the window has no place on the judge's solver, and where looking there takes more than an hour of one core");
        /// How often along the path the machine can change it.
        controller: ControllerKind => default("continuous", "as often as wanted");
        /// Orders of the lines to try.
        orders: Vec<OrderChoice> => default([], "as given");
        /// Strategies of `[hatch]` to try.
        strategies: Vec<HatchStrategy> => default([], "its own alone");
        /// Rounds of learning.
        rounds: u32 where within(0.0, 200.0) => computed("12, after which the share hardly grows; none after `predictive`");
        /// Drift of the power, either way, with which every path is drawn too, on the judge's solver: what it is worth is the least of the three.
        robust: Ratio where up_to(0.2) => none("a path is worth what it does with the power as set");
        /// Slowest and fastest speed, as shares of the path's own. A current or a time on spots is divided by them, a diameter multiplied.
        speeds: [Ratio; 2] where positive => default(["60 %", "300 %"], "what a deflection follows easily");
        /// Length of a piece of one speed.
        piece: Length where positive => computed("0.1 mm, a quarter of the usual spot, on the judge's solver; 0.25 mm, four voxels, on charts; a cell on even ones");
        /// Edge of a cell with `solver = "reference"`; the judge's are `judge.cell`, and twice that while a path is looked for.
        cell: Length where positive => default("0.0625 mm", "half the thesis' distance of lines");
        /// Planes of cells in a layer with `solver = "reference"`; temperatures are means over the layer.
        planes: u32 where within(1.0, 16.0) => default(1, "a plane a layer; 2 show whether a share holds, 4 cost eight times the time");
        /// Longest step with `solver = "reference"`.
        step: Time where positive => default("8e-6 s", "half of it moves shares by less than a point");
    }

    /// Currents corrected round by round: the rise that a place lacks or has too much is what the current there is changed by.
    pub struct CorrectTable {
        /// Rounds on cells twice as large as the judge's.
        rounds: u32 where within(0.0, 200.0) => default(8, "after which the share hardly grows");
        /// Rounds on the judge's own cells, beginning with the best of those; each costs as much as six of them.
        finest: u32 where within(0.0, 50.0) => default(1, "what finer cells see differently is corrected once");
        /// Aims besides the middle of the window that are tried once on the coarse cells, from the best round: further out at the rim, a quarter of the window hotter, both, a quarter colder.
        aims: u32 where within(0.0, 4.0) => default(4, "what powder, overheating and shape cost each other");
        /// Drift of the power, either way, with which every path is drawn too: what it is worth is the least of the three.
        robust: Ratio where up_to(0.2) => none("a path is worth what it does with the power as set");
        /// Share of what places ask for that a round does.
        gain: Ratio where up_to(1.0) => default("60 %", "heat that piles up answers more than the power does: all of it swings from round to round");
        /// Over what length currents are evened out, along and across lines; pieces of one current are as long.
        reach: Length where positive => default("0.1 mm", "a quarter of the usual spot: the standard deviation of its beam");
        /// Least and greatest current, as shares of the path's own.
        currents: [Ratio; 2] where positive => default(["30 %", "200 %"], "as far as a focus calibration usually holds");
        /// How often along the path the machine can change it.
        controller: ControllerKind => default("continuous", "as often as wanted");
    }

    /// The path, and the better one, on the solver that charts are made with.
    pub struct JudgeTable {
        /// Which solver.
        solver: JudgeSolver => default("reference", "charts alone decide nothing");
        /// Two corners of the rectangle that is judged, the lower left one first.
        part: [[Length; 2]; 2] => none("the whole path");
        /// How far beyond that rectangle the finest cells reach; elsewhere the path is drawn on cells of at most 0.13 mm.
        beyond: Length where not_negative => default("0.75 mm", "six lines of the thesis");
        /// Edge of the finest cells in the plane.
        cell: Length where positive => default("0.03125 mm", "a quarter of the thesis' distance of lines");
        /// Planes of cells in a layer.
        planes: u32 where within(1.0, 16.0) => default(1, "a plane a layer; the judge tells what twice as many change");
        /// Longest time step; shorter where stability needs it.
        step: Time where positive => default("2e-5 s", "as long as is stable; the judge tells what half of it changes");
        /// How deep below the build plane temperatures are read.
        depth: Length where not_negative => computed("half the layer: neither the surface nor the layer below");
        /// What the ground is.
        ground: JudgeGround => default("half-space", "metal or powder as far as heat goes while the layer is drawn");
        /// Thickness of the start plate, where the ground is one.
        plate: Length where positive => default("10 mm", "a usual start plate");
        /// What a layer keeps of those before it, where `ebm.layers` draws several.
        memory: LayerMemory => default("heat", "what the layers before left warm is warm");
        /// Time from the end of a layer's path to the beginning of the next one's, the beam off.
        between: Time where within(0.0, DAY) => default("10 s", "a rake and a preheating: an estimate, read yours from the machine's log");
        /// Temperature of a fresh layer of powder when its path begins; at most 100 K below the material's start temperature.
        powder: Temperature => computed("the material's start temperature: every layer is preheated");
        /// Places whose temperature is kept in time: x, y, and z where it is not the build plane.
        places: Vec<Point> => default([], "the charts' hottest");
        /// Time between two of these temperatures.
        every: Time where positive => default("5e-5 s", "a voxel at 980 mm/s");
    }

    /// Limits of the verdict.
    pub struct ChecksTable {
        /// Least share of the section in the window.
        in_window: Ratio where within(0.0, 1.0) => default("50 %", "half of the metal");
        /// Drift of the power, either way and after the window was set, with which as much of the section is to stay in it.
        drift: Ratio where within(0.0, 0.05) => none("not asked: the fact `power-drift` tells what the window bears");
        /// Greatest share of the section that stays powder.
        unmelted: Ratio where within(0.0, 1.0) => default("1 %", "powder left inside is a hole");
        /// Greatest share of the section over metal that does not melt down to the layer below.
        unfused: Ratio where within(0.0, 1.0) => default("1 %", "a layer that does not melt into the one below is a crack");
        /// How far beyond the contour metal may melt and not be counted.
        rim: Length where not_negative => default("0.1 mm", "a few grains: what sticks to faces anyway");
        /// Greatest area molten beyond that rim, as a share of the section's.
        outside: Ratio where not_negative => default("1 %", "as much as may stay powder inside");
        /// Greatest distance from the contour at which metal melts.
        farthest: Length where not_negative => default("0.2 mm", "half the usual spot: a line on the contour melts as far");
        /// Greatest share of one hole of the region that melts; what lies within the rim counts, too.
        holes: Ratio where within(0.0, 1.0) => default("50 %", "ours: half of a hole left open; set what yours must keep");
    }
}

choice! {
    /// What lies under the first layer.
    pub enum Ground {
        Metal "metal" => "Dense metal.",
        Powder "powder" => "Powder: the region hangs over.",
        Cake "cake" => "Metal below the region, sintered powder beside it: a layer in the middle of an upright part.",
    }

    /// With which model the limits of a window were found.
    pub enum WindowModel {
        Solver "solver" => "The judge's solver, with this job's surface, cells and depth: a window of an earlier job of the same machine and metal.",
        Thesis "thesis" => "The simulator of Béraud 2016: charts without vapour and without memory of the ground. Of the solver's temperatures it says nothing.",
    }

    /// What leaves the build plane as vapour.
    pub enum Vapour {
        Free "free" => "As much as the gas in the chamber lets go, by the material's law.",
        None "none" => "Nothing.",
    }

    /// What a layer keeps of those before it.
    pub enum LayerMemory {
        Heat "heat" => "Their heat, and what of them is metal.",
        Metal "metal" => "What of them is metal: every layer starts at the start temperature.",
    }

    /// What the ground is that the solver draws on; it is at the start temperature before the first layer.
    pub enum JudgeGround {
        HalfSpace "half-space" => "So deep and wide that nothing is felt of its end.",
        Plate "plate" => "The layers on a plate from which nothing flows: loose powder lies below.",
        ThesisBox "thesis-box" =>
            "Held at the start temperature 0.5 mm below, and beside by as much or a little more (Béraud 2016, section 3.2.2.1).",
    }

    /// What the ground under a chart simulation keeps of earlier beam positions.
    pub enum ChartMemory {
        None "none" => "Nothing: a voxel knows its own history only (Béraud 2016).",
        Ground "ground" => "Their heat, spread in the ground.",
    }

    /// What charts do for a path.
    pub enum ChartPreview {
        Drawn "drawn" => "They draw it.",
        None "none" => "Nothing: none is computed.",
    }

    /// What a hatch draws.
    pub enum HatchStrategy {
        Lines "lines" => "Parallel lines joined at their ends, each against the one before.",
        OneWay "one-way" => "Parallel lines, all in the same direction, the beam off between them.",
        Contours "contours" => "Offsets of the contour, from the outside to the inside.",
        Spiral "spiral" => "One curve from the contour to the middle.",
        Islands "islands" =>
            "A checkerboard: squares of lines, those of one colour first, lines turned by 90° from square to square.",
        Spots "spots" => "Spots on a grid, each four columns from the one before.",
        Modulated "modulated" => "Nested contours, farther apart where `[modulation]` wants less energy.",
    }

    /// Ways to find what the beam does along the path.
    pub enum OptimiseMethod {
        Accelerate "accelerate" => "Only accelerates, from the temperatures while drawing (Béraud 2016, annex F, repaired).",
        Pid "pid" => "A controller with proportional, integral and derivative action, from the temperature at the beam.",
        Predictive "predictive" => "Draws each piece ahead a few times before it decides.",
        Learning "learning" => "Draws again and again, and learns from the highest temperatures along the path.",
    }

    /// What is changed along the path.
    pub enum Change {
        Speed "speed" => "Speed; where the beam rests, how long.",
        Dwell "dwell" => "Time on each spot.",
        Current "current" => "Beam current, on lines and on spots.",
        Focus "focus" => "Focus current, and with it the beam's diameter.",
    }

    /// What temperatures are taken from while optimising.
    pub enum OptimiseSolver {
        Judge "judge" => "The judge's solver for whole layers, on cells twice as large as its own, over the whole section, shape first.",
        Charts "charts" => "The chart simulation, inside the contour: what Béraud 2016 does.",
        Reference "reference" => "The reference solver on even cells, inside the contour, the ground held half a millimetre below.",
    }

    /// What a machine's controller can do.
    pub enum ControllerKind {
        Continuous "continuous" => "Changes speed, current or focus anywhere.",
        PerLine "per-line" => "Changes them from line to line.",
    }

    /// Orders of lines.
    pub enum OrderChoice {
        AsGiven "as-given" => "As the path has them.",
        EverySecond "every-second" => "Every second line, then those between.",
        EveryThird "every-third" => "Every third line, then those beside them.",
        EveryFourth "every-fourth" => "Every fourth line.",
        FromTheMiddle "from-the-middle" => "From the middle outwards, sides in turn.",
        Backwards "backwards" => "The last line first.",
    }

    /// What a path is judged on.
    pub enum JudgeSolver {
        Reference "reference" => "Finite volumes in enthalpy, explicit in time, finest where metal is molten.",
        None "none" => "None: charts preview, and the verdict cannot say.",
    }
}
