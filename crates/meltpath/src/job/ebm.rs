//! The job of an electron-beam simulation: a beam path over powder, and the temperatures wanted.

use meltpath_base::quantity::{NotNegative, Positive};
use meltpath_base::{Angle, Current, Length, Ratio, Speed, Temperature, Time, Voltage};
use meltpath_thermal::material::file::{DensityReading, PorosityReading};
use serde::Deserialize;
use toml::Spanned;

use super::{PartUnit, ProcessTable, TextError};

/// An electron-beam job, as written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EbmJob {
    /// The beam path: CSV or Parquet with the columns `t_s,x_mm,y_mm,U_V,I_A,I_f_A,on`; relative to the job file. In its
    /// place `[hatch]` draws the region.
    #[serde(default)]
    pub path: Option<Spanned<String>>,
    /// The part: STEP, STL or 3MF, relative to the job file; `[hatch]` draws the section that `[section]` names.
    #[serde(default)]
    pub part: Option<Spanned<String>>,
    /// Unit of a part file that carries none (STL); default mm.
    #[serde(default)]
    pub part_unit: PartUnit,
    /// The direction of the part file that points up in the build; default +Z.
    #[serde(default)]
    pub build_direction: Option<[f64; 3]>,
    /// `[section]`.
    #[serde(default)]
    pub section: SectionTable,
    /// `[process]`.
    pub process: ProcessTable,
    /// `[ebm]`.
    #[serde(default)]
    pub ebm: EbmTable,
    /// `[charts]`.
    #[serde(default)]
    pub charts: ChartsTable,
    /// `[simulation]`.
    #[serde(default)]
    pub simulation: EbmSimulationTable,
    /// `[region]`.
    #[serde(default)]
    pub region: RegionTable,
    /// `[hatch]`.
    #[serde(default)]
    pub hatch: Option<HatchTable>,
    /// `[modulation]`.
    #[serde(default)]
    pub modulation: Option<ModulationTable>,
    /// `[window]`.
    #[serde(default)]
    pub window: WindowTable,
    /// `[optimise]`.
    #[serde(default)]
    pub optimise: Option<OptimiseTable>,
    /// `[judge]`.
    #[serde(default)]
    pub judge: Option<JudgeTable>,
    /// `[checks]`.
    #[serde(default)]
    pub checks: EbmChecksTable,
}

/// `[section]`: which layer of `part` is drawn.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SectionTable {
    /// Height on the part, as designed, of the last layer; default half the part's.
    pub height: Option<Spanned<NotNegative<Length>>>,
    /// Which of the separate areas of that layer, the largest first; default 1.
    pub island: Option<Spanned<u32>>,
    /// What the part is drawn larger by, in the plane and along the build direction; default the material's, since parts
    /// shrink on cooling.
    pub scaling: Option<[Positive<Ratio>; 2]>,
}

/// What lies under the first layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ground {
    /// Dense metal.
    #[default]
    Metal,
    /// Powder: the part hangs over.
    Powder,
}

/// `[ebm]`: beam, powder, material.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EbmTable {
    /// Material: a name in `data/materials`; default `ti6al4v-ebm`.
    pub material: Option<Spanned<String>>,
    /// How the thesis' porosity law is read (erratum E1); default `physical`.
    pub porosity: Option<PorosityReading>,
    /// Which of the thesis' density cells are used (erratum E2); default `corrected`.
    pub density: Option<DensityReading>,
    /// Focus calibration: a name in `data/focus`; default `a1-beraud-2016`.
    pub focus: Option<Spanned<String>>,
    /// Beam diameter whatever the focus, in place of a calibration.
    pub diameter: Option<Positive<Length>>,
    /// Share of the beam power that becomes heat; default 90 %.
    pub efficiency: Option<Positive<Ratio>>,
    /// How deep the beam enters; default 100 µm.
    pub penetration: Option<Positive<Length>>,
    /// Thickness of a layer; default 50 µm.
    pub layer: Option<Positive<Length>>,
    /// How often the path is drawn, a fresh layer each; default once.
    pub layers: Option<u32>,
    /// What lies under the first layer; default metal.
    pub ground: Ground,
}

/// `[charts]`: temperature histories under a beam at rest.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ChartsTable {
    /// Chart files to use, relative to the job file; settings they do not serve are computed.
    pub files: Vec<Spanned<String>>,
    /// Heating stops here; default 2800 °C, the thesis' choice. Above it temperatures are told apart badly.
    pub stop: Option<Temperature>,
    /// Cooling starts from the pool whose hottest point has this temperature; default 2800 °C.
    pub cooling_from: Option<Temperature>,
    /// Spacing of the charts; default 25 µm.
    pub spacing: Option<Positive<Length>>,
    /// What the ground keeps of earlier lines; default nothing, the thesis' model.
    pub memory: Option<ChartMemory>,
}

/// What the ground under a chart simulation keeps of earlier beam positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChartMemory {
    /// Nothing.
    #[default]
    None,
    /// Their heat, spread in the ground.
    Ground,
}

/// `[simulation]`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EbmSimulationTable {
    /// Edge of a voxel in the plane; default 57 µm.
    pub voxel: Option<Positive<Length>>,
    /// Time step; default 2.5 µs.
    pub step: Option<Positive<Time>>,
    /// Powder beyond the path; default 0.5 mm.
    pub margin: Option<Positive<Length>>,
    /// Pictures in time; default 24.
    pub frames: Option<u32>,
    /// Places through which sections are drawn, besides the hottest one.
    pub sections: Vec<[Length; 2]>,
}

/// `[region]`: which voxels of the last layer are judged.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RegionTable {
    /// Corners of the contour; default the convex hull of the path.
    pub contour: Vec<[Length; 2]>,
    /// Corners of each hole.
    pub holes: Vec<Vec<[Length; 2]>>,
    /// Corners of the metal below the first layer, where the ground is powder: what the part hangs over from.
    pub supported: Vec<[Length; 2]>,
    /// How far inside the contour voxels must lie; default 0.2 mm.
    pub inside: Option<NotNegative<Length>>,
}

/// `[hatch]`: how the beam fills the region, in place of a file of its path.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HatchTable {
    /// What is drawn; default `lines`.
    pub strategy: HatchStrategy,
    /// Distance between neighbouring lines or spots; default 0.125 mm.
    pub spacing: Option<Positive<Length>>,
    /// Angle of the lines in the first layer; default 0°.
    pub angle: Option<Angle>,
    /// Turn of the lines from layer to layer; default 90°.
    pub turn: Option<Angle>,
    /// Contours before the interior of lines; default none.
    pub contours: Option<u32>,
    /// How far beyond the contour is drawn, so that the rim is as hot as the middle; default not at all. What melts there is not of the
    /// part: draw it smaller by as much, or machine it off.
    pub overrun: Option<NotNegative<Length>>,
    /// Edge of an island; default 2 mm.
    pub island: Option<Positive<Length>>,
    /// Speed of the beam; default 980 mm/s.
    pub speed: Option<Positive<Speed>>,
    /// Time on a spot; default what a line spends on the spacing.
    pub dwell: Option<Positive<Time>>,
    /// Speed from the end of a line to the start of the next, beam off; default no time at all.
    pub jump: Option<Positive<Speed>>,
    /// Accelerating voltage; default 60 kV.
    pub voltage: Option<Positive<Voltage>>,
    /// Beam current; default 5 mA.
    pub current: Option<Positive<Current>>,
    /// Current of the focus coil; default 4 mA.
    pub focus: Option<Current>,
}

/// What a hatch draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HatchStrategy {
    /// Parallel lines joined at their ends, each against the one before.
    #[default]
    Lines,
    /// Parallel lines, all in the same direction, the beam off between them.
    OneWay,
    /// Offsets of the contour, from the outside to the inside.
    Contours,
    /// One curve from the contour to the middle.
    Spiral,
    /// A checkerboard: squares of lines, those of one colour first, lines turned by 90° from square to square.
    Islands,
    /// Spots on a grid, each four columns from the one before.
    Spots,
    /// Nested contours, farther apart where `[modulation]` wants less energy.
    Modulated,
}

/// `[modulation]`: less energy near powder. `modulated` hatches follow it by their spacing, all others by their speed.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ModulationTable {
    /// Share of the hatch's energy at contact with powder beside, along each axis; default 80 %.
    pub across: Option<Positive<Ratio>>,
    /// Distance from which nothing is taken off; default 1 mm.
    pub across_length: Option<Positive<Length>>,
    /// Share at contact with powder below; default 60 %.
    pub along: Option<Positive<Ratio>>,
    /// Thickness of metal from which nothing is taken off; default 1 mm.
    pub along_length: Option<Positive<Length>>,
}

/// `[window]`: highest temperatures that are wanted.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WindowTable {
    /// Lower limit; default 2700 °C, on the scale of the thesis' simulator.
    pub low: Option<Temperature>,
    /// Upper limit; default 2760 °C.
    pub high: Option<Temperature>,
    /// Path of a body known to be good, simulated alike; the window is centred on its middle instead.
    pub good: Option<Spanned<String>>,
    /// Width and height of a rectangle that `[hatch]` makes well: the body known to be good in place of a path.
    pub body: Option<[Positive<Length>; 2]>,
    /// Width of that window, in K; default `60 K`.
    pub width: Option<Spanned<Temperature>>,
}

/// `[optimise]`: change the beam along the path, and the path's order.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OptimiseTable {
    /// How.
    pub method: OptimiseMethod,
    /// What is changed; default the speed.
    #[serde(default)]
    pub change: Change,
    /// What the temperatures are taken from; default charts.
    #[serde(default)]
    pub solver: OptimiseSolver,
    /// How often along the path the machine can change it; default as often as wanted.
    #[serde(default)]
    pub controller: ControllerKind,
    /// Orders of the lines to try; default as given.
    #[serde(default)]
    pub orders: Vec<OrderChoice>,
    /// Strategies of `[hatch]` to try; default its own.
    #[serde(default)]
    pub strategies: Vec<HatchStrategy>,
    /// Rounds of learning; default 12, and none after `predictive`.
    #[serde(default)]
    pub rounds: Option<u32>,
    /// Slowest and fastest speed, as shares of the path's own; default 60 % and 300 %. Where the current or the time on spots
    /// is changed it is divided by them, where the diameter is changed it is multiplied.
    #[serde(default)]
    pub speeds: Option<[Positive<Ratio>; 2]>,
    /// Length of a piece of one speed; default 0.25 mm on charts, a cell on the reference solver.
    #[serde(default)]
    pub piece: Option<Positive<Length>>,
    /// Edge of a cell of the reference solver; default 62.5 µm.
    #[serde(default)]
    pub cell: Option<Positive<Length>>,
    /// Planes of cells in a layer of the reference solver, 1 to 16; default 1. Temperatures are means over the layer.
    #[serde(default)]
    pub planes: Option<Spanned<u32>>,
    /// Longest step of the reference solver; default 8 µs.
    #[serde(default)]
    pub step: Option<Positive<Time>>,
}

/// Ways to find what the beam does along the path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OptimiseMethod {
    /// Only accelerates, from the temperatures while drawing (Béraud 2016, annex F, repaired).
    Accelerate,
    /// A controller with proportional, integral and derivative action, from the temperature at the beam.
    Pid,
    /// Draws each piece ahead a few times before it decides.
    Predictive,
    /// Draws again and again, and learns from the highest temperatures along the path.
    Learning,
}

/// What is changed along the path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// Speed; where the beam rests, how long.
    #[default]
    Speed,
    /// Time on each spot.
    Dwell,
    /// Beam current, on lines and on spots.
    Current,
    /// Focus current, and with it the beam's diameter.
    Focus,
}

/// What temperatures are taken from while optimising.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OptimiseSolver {
    /// The chart simulation.
    #[default]
    Charts,
    /// The reference solver.
    Reference,
}

/// What a machine's controller can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControllerKind {
    /// Changes speed, current or focus anywhere.
    #[default]
    Continuous,
    /// Changes them from line to line.
    PerLine,
}

/// Orders of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderChoice {
    /// As the path has them.
    AsGiven,
    /// Every second line, then those between.
    EverySecond,
    /// Every third line, then those beside them.
    EveryThird,
    /// Every fourth line.
    EveryFourth,
    /// From the middle outwards, sides in turn.
    FromTheMiddle,
    /// The last line first.
    Backwards,
}

/// `[judge]`: the path, and the one with better speeds, on the solver that charts are made with.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JudgeTable {
    /// Which solver.
    pub solver: JudgeSolver,
    /// Two corners of the rectangle that is judged; default the whole path.
    #[serde(default)]
    pub part: Option<Spanned<[[Length; 2]; 2]>>,
    /// How far beyond that rectangle the path is drawn too, so that its rim is as warm as in the whole; default 0.75 mm.
    #[serde(default)]
    pub beyond: Option<NotNegative<Length>>,
    /// Edge of a cell in the plane; default 62.5 µm.
    #[serde(default)]
    pub cell: Option<Positive<Length>>,
    /// Planes of cells in a layer, 1 to 16; default 1. Temperatures are means over the layer.
    #[serde(default)]
    pub planes: Option<Spanned<u32>>,
    /// Longest time step; default 4 µs. Shorter where stability asks for it.
    #[serde(default)]
    pub step: Option<Positive<Time>>,
    /// Places whose temperature is kept in time: x, y, and z where it is not the build plane; default the charts' hottest.
    #[serde(default)]
    pub places: Vec<Spanned<Vec<Length>>>,
    /// Time between two of these temperatures; default 50 µs.
    #[serde(default)]
    pub every: Option<Positive<Time>>,
}

/// What a path is judged on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JudgeSolver {
    /// Finite volumes in enthalpy, explicit in time.
    Reference,
}

/// `[checks]`: limits.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EbmChecksTable {
    /// Least share of the molten voxels of the region in the window; default 50 %.
    pub in_window: Option<NotNegative<Ratio>>,
    /// Greatest share of the region that stays powder; default 1 %.
    pub unmelted: Option<NotNegative<Ratio>>,
}

impl EbmJob {
    /// Values that contradict each other.
    ///
    /// # Errors
    /// [`TextError`].
    pub(super) fn check(&self) -> Result<(), TextError> {
        let wrong = |message: &str, help: &str| {
            Err(TextError {
                span: None,
                message: message.to_owned(),
                help: Some(help.to_owned()),
            })
        };
        if self.ebm.focus.is_some() && self.ebm.diameter.is_some() {
            return wrong(
                "ebm.focus and ebm.diameter both say how wide the beam is",
                "keep one of them",
            );
        }
        if self.path.is_some() == self.hatch.is_some() {
            return wrong(
                "the beam needs either `path` or the table [hatch]",
                "name a file of the beam's path, or let [hatch] draw the region",
            );
        }
        let planes = [
            (
                "optimise.planes",
                self.optimise.as_ref().and_then(|o| o.planes.as_ref()),
            ),
            (
                "judge.planes",
                self.judge.as_ref().and_then(|j| j.planes.as_ref()),
            ),
        ];
        for (key, value) in planes {
            if let Some(value) = value.filter(|v| !(1..=16).contains(v.get_ref())) {
                return Err(TextError {
                    span: Some(value.span()),
                    message: format!("{key} is {}: a layer has 1 to 16 planes of cells", value.get_ref()),
                    help: Some("2 show whether a share holds; four times as many cost eight times the time and more".to_owned()),
                });
            }
        }
        let overruns = self.hatch.as_ref().and_then(|h| h.overrun);
        if self.modulation.is_some() && overruns.is_some() {
            return wrong(
                "hatch.overrun draws beyond the contour, where [modulation] has no energy to give",
                "keep one of them",
            );
        }
        if self.modulation.is_some() && self.hatch.is_none() {
            return wrong(
                "[modulation] changes what [hatch] draws, which is not there",
                "let [hatch] draw the region",
            );
        }
        if !self.region.supported.is_empty() && self.ebm.ground == Ground::Metal {
            return wrong(
                "region.supported says where metal lies below, and the ground is metal everywhere",
                "write ground = \"powder\" under [ebm], or leave region.supported out",
            );
        }
        if self.hatch.is_some() && self.region.contour.is_empty() && self.part.is_none() {
            return wrong(
                "[hatch] has nothing to fill",
                "name a part: part = \"bracket.step\", or give the corners of the region: contour = [[\"0 mm\", \"0 mm\"], …] under [region]",
            );
        }
        self.check_part(&wrong)?;
        if let Some(o) = &self.optimise {
            let online = matches!(o.method, OptimiseMethod::Accelerate | OptimiseMethod::Pid);
            if online && (o.solver == OptimiseSolver::Reference || o.change != Change::Speed) {
                return wrong(
                    "optimise.method accelerate and pid change the speed, on charts",
                    "use learning or predictive for current and focus, and on the reference solver",
                );
            }
            if matches!(o.change, Change::Current | Change::Focus)
                && o.solver == OptimiseSolver::Charts
            {
                return wrong(
                    "optimise.change current and focus need the reference solver",
                    "write solver = \"reference\" under [optimise]: charts know only the settings they were made for",
                );
            }
            if let (Change::Dwell, Some(hatch)) = (o.change, &self.hatch) {
                let mut drawn = o.strategies.iter().chain([&hatch.strategy]);
                if drawn.any(|s| *s != HatchStrategy::Spots) {
                    return wrong(
                        "optimise.change = \"dwell\" changes the time on spots, and [hatch] or optimise.strategies draw lines",
                        "write strategy = \"spots\" under [hatch] and no other under optimise.strategies, or change speed or current",
                    );
                }
            }
            if !o.strategies.is_empty() && self.hatch.is_none() {
                return wrong(
                    "optimise.strategies are those of [hatch], which is not there",
                    "let [hatch] draw the region, or try optimise.orders",
                );
            }
        }
        let window = &self.window;
        if window.body.is_some() && (window.good.is_some() || self.hatch.is_none()) {
            return wrong(
                "window.body is drawn by [hatch], and takes the place of window.good",
                "write [hatch], or name a path as window.good",
            );
        }
        if window.body.is_some() && (window.low.is_some() || window.high.is_some()) {
            return wrong(
                "window.body and window.low or window.high both place the window",
                "keep window.body with window.width, or the two limits",
            );
        }
        if window.good.is_some() && (window.low.is_some() || window.high.is_some()) {
            return wrong(
                "window.good and window.low or window.high both place the window",
                "keep window.good with window.width, or the two limits",
            );
        }
        if let (Some(low), Some(high)) = (window.low, window.high)
            && low >= high
        {
            return wrong("window.low is not below window.high", "exchange them");
        }
        if let Some(width) = &window.width
            && !(1.0..250.0).contains(&width.get_ref().0)
        {
            return Err(TextError {
                span: Some(width.span()),
                message: "window.width is a difference of 1 to 250 K".to_owned(),
                help: Some("write it in kelvin: \"60 K\"".to_owned()),
            });
        }
        if let Some(part) = self.judge.as_ref().and_then(|j| j.part.as_ref()) {
            let [a, b] = part.get_ref();
            if (0..2).any(|n| a[n].0 >= b[n].0) {
                return Err(TextError {
                    span: Some(part.span()),
                    message: "judge.part has no area".to_owned(),
                    help: Some("write its lower left corner, then its upper right one".to_owned()),
                });
            }
        }
        let places = self.judge.iter().flat_map(|j| &j.places);
        if let Some(place) = places
            .into_iter()
            .find(|p| ![2, 3].contains(&p.get_ref().len()))
        {
            return Err(TextError {
                span: Some(place.span()),
                message: format!(
                    "a place of judge.places has {} values",
                    place.get_ref().len()
                ),
                help: Some(
                    "write x and y, and z where it is not the build plane: [\"1 mm\", \"2 mm\"]"
                        .to_owned(),
                ),
            });
        }
        let few = |ring: &Vec<_>| ring.len() < 3;
        let contour = &self.region.contour;
        if (!contour.is_empty() && few(contour))
            || self.region.holes.iter().any(few)
            || (!self.region.supported.is_empty() && few(&self.region.supported))
        {
            return wrong(
                "region.contour, region.supported or one of region.holes has fewer than three corners",
                "give at least three",
            );
        }
        Ok(())
    }

    /// A part gives its own region and ground.
    fn check_part(
        &self,
        wrong: &impl Fn(&str, &str) -> Result<(), TextError>,
    ) -> Result<(), TextError> {
        let region = &self.region;
        let drawn = [&region.contour, &region.supported];
        if self.part.is_none() {
            if self.section != SectionTable::default() {
                return wrong(
                    "[section] cuts a part, and none is named",
                    "write part = \"bracket.step\" at the top of the job",
                );
            }
            return Ok(());
        }
        if self.hatch.is_none() {
            return wrong(
                "a part is drawn by [hatch], which is not there",
                "write [hatch], with nothing in it for the thesis' lines",
            );
        }
        if drawn.iter().any(|ring| !ring.is_empty())
            || !region.holes.is_empty()
            || self.ebm.ground == Ground::Powder
        {
            return wrong(
                "the part says what is drawn and where metal lies below; region.contour, region.holes, region.supported or ebm.ground says it again",
                "leave them out, or leave the part out",
            );
        }
        if let Some(up) = self.build_direction
            && !(up.iter().all(|v| v.is_finite()) && up.iter().any(|v| v.abs() > 0.0))
        {
            return wrong(
                "build_direction has no direction",
                "give a vector of the part file, such as [0.0, 0.0, 1.0]",
            );
        }
        Ok(())
    }
}
