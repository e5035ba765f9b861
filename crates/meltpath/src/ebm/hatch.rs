//! From a region and a few numbers to the beam's path: planning makes the passes, the beam follows them.

mod patterns;

use meltpath_base::quantity::Positive;
use meltpath_base::{Length, Provenance, Ratio, Reporter, Speed, Time};
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::offset::{Join, outset};
use meltpath_geometry::{Plane, Region};
use meltpath_planning::powder::modulation::{Modulation, Ramp, hatch_energy};
use meltpath_planning::powder::nested::EnergyField;
use meltpath_planning::{
    ContourOrder, FillSettings, Layer, LayerDirection, LineAngle, LineDirection, LineOrder,
    PassIds, PlanError, Spacing, StartPoints, Strategy, plan_layer,
};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::passes::{Defaults, PassesError, beam_path};
use meltpath_toolpath::{Move, Pass, Profile, Toolpath};

use super::region::Below;
use crate::job::ebm::{HatchStrategy, HatchTable, ModulationTable};

/// Corners of what is drawn beyond the contour: as sharp as the part's, but for needles.
const CORNERS: Join = Join::Miter { limit: 4.0 };

/// Why a region cannot be hatched.
#[derive(Debug, thiserror::Error)]
pub enum HatchError {
    /// Planning.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The region.
    #[error("the region cannot be enlarged or cut into islands: {0}")]
    Region(#[from] PlanarError),
    /// The beam.
    #[error(transparent)]
    Passes(#[from] PassesError),
    /// Contours that follow a modulation which is not there.
    #[error("modulated contours need the table [modulation]")]
    NotModulated,
    /// A region smaller than a line.
    #[error("no line fits into the region: it is narrower than the spacing of {spacing} mm")]
    Nothing {
        /// The spacing, mm.
        spacing: f64,
    },
    /// More islands or spots than a layer can hold.
    #[error("{what} of {size} mm are too small for a region of {width:.0} x {height:.0} mm")]
    TooSmall {
        /// What.
        what: &'static str,
        /// Their size, mm.
        size: f64,
        /// The region's width, mm.
        width: f64,
        /// The region's height, mm.
        height: f64,
    },
}

/// Less energy near powder, and where powder lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Modulated {
    /// The law; nominal is what the hatch brings.
    pub law: Modulation,
    /// What lies below the first layer.
    pub below: Below,
}

impl Modulated {
    /// From the job's table, for a hatch that brings `nominal` J/mm³.
    pub fn resolve(
        table: &ModulationTable,
        nominal: f64,
        below: Below,
        r: &mut Provenance,
    ) -> Self {
        let start = Modulation::STARTING;
        let why = "a starting value to be tuned: those of Béraud 2016 are lost";
        let mut ramp = |name: &str, least: Option<f64>, length: Option<f64>, default: Ramp| Ramp {
            least: r
                .written_or(
                    &format!("modulation.{name}"),
                    least.map(Ratio),
                    Ratio(default.least),
                    why,
                )
                .0,
            length: r
                .written_or(
                    &format!("modulation.{name}_length"),
                    length.map(Length),
                    Length(default.length),
                    "powder is felt 1 to 2 mm away (Béraud 2016, section 2.2.1.1)",
                )
                .0,
        };
        let share = |v: Option<Positive<Ratio>>| v.map(|v| v.0.0);
        let length = |v: Option<Positive<Length>>| v.map(|v| v.0.0);
        Modulated {
            law: Modulation {
                nominal,
                across: ramp(
                    "across",
                    share(table.across),
                    length(table.across_length),
                    start.across,
                ),
                along: ramp(
                    "along",
                    share(table.along),
                    length(table.along_length),
                    start.along,
                ),
            },
            below,
        }
    }

    /// Wanted energy in layer `number` (from 1), `layer` mm thick.
    fn field(&self, region: &Region, number: u32, layer: f64, cell: f64) -> EnergyField {
        let drawn = f64::from(number - 1) * layer;
        let depth = |p: DVec2| {
            if self.below.is_metal(p.to_array()) {
                f64::INFINITY
            } else {
                drawn
            }
        };
        EnergyField::new(region, &self.law, cell, &depth)
    }
}

/// A hatch with every value resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Hatch {
    /// What is drawn.
    pub strategy: HatchStrategy,
    /// Distance between lines or spots, mm.
    pub spacing: f64,
    /// Angle of the lines in the first layer, and turn from layer to layer, rad.
    pub angles: [f64; 2],
    /// Contours before the interior.
    pub contours: u32,
    /// How far beyond the contour is drawn, mm.
    pub overrun: f64,
    /// Edge of an island, mm.
    pub island: f64,
    /// Speed, mm/s.
    pub speed: f64,
    /// Time on a spot, s.
    pub dwell: f64,
    /// Power, W.
    pub power: f64,
    /// What lies between passes, voltage and focus.
    pub beam: Defaults,
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// Less energy near powder.
    pub modulation: Option<Modulated>,
}

impl Hatch {
    /// The hatch of a job's table for layers `layer` mm thick, not modulated; every value is recorded with its origin.
    pub fn resolve(table: &HatchTable, layer: f64, r: &mut Provenance) -> Self {
        let thesis = "Béraud 2016, table 3.3.2";
        let mm = |v: f64| Length(v);
        r.written_or(
            "hatch.strategy",
            Some(format!("{:?}", table.strategy).to_lowercase()),
            String::new(),
            "",
        );
        let spacing = table.spacing.map(|s| s.0);
        let spacing = r.written_or(
            "hatch.spacing",
            spacing,
            mm(0.125),
            "49 J/mm³ at the thesis' beam (erratum E22)",
        );
        let angle = table.angle;
        let angle = r.written_or("hatch.angle", angle, meltpath_base::Angle(0.0), "along x");
        let turn = r.written_or(
            "hatch.turn",
            table.turn,
            meltpath_base::Angle(std::f64::consts::FRAC_PI_2),
            "crossed layers: what one leaves cold the next one crosses",
        );
        let contours = r.written_or("hatch.contours", table.contours, 0, "lines alone");
        let overrun = r.written_or(
            "hatch.overrun",
            table.overrun.map(|o| o.0),
            mm(0.0),
            "up to the contour",
        );
        let island = table.island.map(|s| s.0);
        let island = r.written_or(
            "hatch.island",
            island,
            mm(2.0),
            "of the order of what stays hot behind the beam",
        );
        let speed = table.speed.map(|s| s.0);
        let speed = r.written_or("hatch.speed", speed, Speed(980.0), thesis).0;
        let dwell = r.written_or(
            "hatch.dwell",
            table.dwell.map(|d| d.0),
            Time(spacing.0 / speed),
            "what a line at that speed spends on the spacing",
        );
        let jump = table.jump.map(|j| j.0.0);
        let jump = jump.map_or(f64::INFINITY, |v| {
            r.written_or("hatch.jump", Some(Speed(v)), Speed(v), "").0
        });
        let voltage = table.voltage.map(|v| v.0);
        let voltage = r.written_or(
            "hatch.voltage",
            voltage,
            meltpath_base::Voltage(60e3),
            thesis,
        );
        let current = table.current.map(|v| v.0);
        let current = r.written_or(
            "hatch.current",
            current,
            meltpath_base::Current(5e-3),
            thesis,
        );
        let focus = r.written_or(
            "hatch.focus",
            table.focus,
            meltpath_base::Current(4e-3),
            thesis,
        );
        Hatch {
            strategy: table.strategy,
            spacing: spacing.0,
            angles: [angle.0, turn.0],
            contours,
            overrun: overrun.0,
            island: island.0,
            speed,
            dwell: dwell.0,
            power: voltage.0 * current.0,
            beam: Defaults {
                voltage: voltage.0,
                focus: focus.0,
                jump,
                // far below a voxel
                chord_error: 2e-3,
            },
            layer,
            modulation: None,
        }
    }

    /// Energy per volume far from powder, J/mm³.
    pub fn energy(&self) -> f64 {
        hatch_energy(self.power, self.speed, self.spacing, self.layer)
    }

    /// The same beam and distances with straight lines, not modulated.
    #[must_use]
    pub fn of_lines(&self) -> Self {
        Hatch {
            strategy: HatchStrategy::Lines,
            contours: 0,
            modulation: None,
            ..self.clone()
        }
    }

    /// Passes that fill `region` in layer `number` (from 1).
    ///
    /// # Errors
    /// [`HatchError`].
    pub fn passes(
        &self,
        region: &Region,
        number: u32,
        reporter: &Reporter,
    ) -> Result<Toolpath, HatchError> {
        let angle = self.angles[0] + self.angles[1] * f64::from(number - 1);
        let field = self.modulation.as_ref().map(|m| {
            // a tenth of a spacing: contours stay within a hundredth of it
            m.field(region, number, self.layer, 0.1 * self.spacing)
        });
        let mut passes = match self.strategy {
            HatchStrategy::Modulated => {
                let field = field.as_ref().ok_or(HatchError::NotModulated)?;
                self.nested(field, number)?
            }
            HatchStrategy::Spots => self.spots(region, number, angle)?,
            HatchStrategy::Islands => self.islands(region, number, angle, reporter)?,
            _ => {
                let strategy = self.fill(angle, self.contours);
                self.plan(std::slice::from_ref(region), strategy, number, reporter)?
            }
        };
        if passes.is_empty() {
            return Err(HatchError::Nothing {
                spacing: self.spacing,
            });
        }
        if let (Some(field), true) = (&field, self.strategy != HatchStrategy::Modulated) {
            for pass in &mut passes {
                self.slow(pass, field);
            }
        }
        Ok(Toolpath {
            profiles: vec![Profile {
                name: "hatch".to_owned(),
                speed: self.speed,
                power: self.power,
                ..Profile::default()
            }],
            passes,
        })
    }

    /// The beam's path in layer `number`, beginning at time 0.
    ///
    /// # Errors
    /// [`HatchError`].
    pub fn path(
        &self,
        region: &Region,
        number: u32,
        reporter: &Reporter,
    ) -> Result<BeamPath, HatchError> {
        self.path_over(std::slice::from_ref(region), number, reporter)
    }

    /// The beam's path over several areas of layer `number`, one after the other. Areas too narrow for a line are left out with a
    /// warning, unless all are.
    ///
    /// # Errors
    /// [`HatchError`].
    pub fn path_over(
        &self,
        regions: &[Region],
        number: u32,
        reporter: &Reporter,
    ) -> Result<BeamPath, HatchError> {
        let ids = PassIds { part: 0 };
        let mut whole = Toolpath {
            profiles: Vec::new(),
            passes: Vec::new(),
        };
        let mut narrow: Vec<f64> = Vec::new();
        let beyond = match self.overrun {
            overrun if overrun > 0.0 => outset(regions, overrun, CORNERS)?,
            _ => Vec::new(),
        };
        let regions = if beyond.is_empty() { regions } else { &beyond };
        for region in regions {
            let toolpath = match self.passes(region, number, reporter) {
                Err(HatchError::Nothing { .. }) if regions.len() > 1 => {
                    narrow.push(region.area());
                    continue;
                }
                other => other?,
            };
            whole.profiles = toolpath.profiles;
            for mut pass in toolpath.passes {
                if regions.len() > 1 {
                    pass.id = ids.id(number, whole.passes.len())?;
                    pass.neighbours.clear();
                }
                whole.passes.push(pass);
            }
        }
        if narrow.len() == regions.len() {
            return Err(HatchError::Nothing {
                spacing: self.spacing,
            });
        }
        if !narrow.is_empty() {
            reporter.warn(
                "area-not-drawn",
                format!(
                    "layer {number}: {} of its {} areas, {:.3} mm² in all, are narrower than the spacing of {} mm and stay powder",
                    narrow.len(),
                    regions.len(),
                    narrow.iter().sum::<f64>(),
                    self.spacing
                ),
                "a smaller hatch.spacing draws them",
            );
        }
        Ok(beam_path(&whole.passes, &whole.profiles, &self.beam, 0.0)?)
    }

    fn fill(&self, angle: f64, contours: u32) -> Strategy {
        let angle = LineAngle::Turning {
            first: angle,
            step: 0.0,
        };
        let order = ContourOrder::OutsideIn;
        match self.strategy {
            HatchStrategy::Contours => Strategy::Contour { order },
            HatchStrategy::Spiral => Strategy::Spiral { order },
            HatchStrategy::OneWay => Strategy::Raster {
                angle,
                order: LineOrder::Across,
                direction: LineDirection::OneWay,
            },
            HatchStrategy::Lines
            | HatchStrategy::Islands
            | HatchStrategy::Spots
            | HatchStrategy::Modulated => {
                if contours > 0 {
                    Strategy::Hybrid {
                        contours,
                        order,
                        angle,
                    }
                } else {
                    Strategy::Zigzag { angle }
                }
            }
        }
    }

    fn plan(
        &self,
        regions: &[Region],
        strategy: Strategy,
        number: u32,
        reporter: &Reporter,
    ) -> Result<Vec<Pass>, HatchError> {
        let plane = Plane::horizontal(0.0);
        let layer = Layer {
            number,
            plane: &plane,
            regions,
        };
        let settings = FillSettings {
            strategy,
            spacing: Spacing::Exact,
            starts: StartPoints::Spread,
            layers: LayerDirection::Same,
            shortest_bead: 0.5 * self.spacing,
            narrowest: 0.2,
            longest_link: 1.5 * self.spacing,
            tolerance: 0.02 * self.spacing,
            ..FillSettings::new(self.spacing, self.spacing)
        };
        Ok(plan_layer(layer, &settings, PassIds { part: 0 }, reporter)?.passes)
    }

    /// Speed, or time on a spot, so that the energy follows the field; pieces of at most a spacing.
    fn slow(&self, pass: &mut Pass, field: &EnergyField) {
        let nominal = self.energy();
        let share = |p: DVec3| (field.at(p.truncate()) / nominal).clamp(0.05, 1.0);
        if self.strategy == HatchStrategy::Spots {
            for (kind, point) in pass.moves.iter_mut().zip(&pass.points[1..]) {
                if let Move::Spot { time } = kind {
                    *time *= share(*point);
                }
            }
            return;
        }
        let (flat, _) = pass.flatten(self.beam.chord_error);
        let mut points: Vec<DVec3> = flat.first().copied().into_iter().collect();
        let mut speeds = Vec::new();
        for w in flat.windows(2) {
            let pieces = (w[0].distance(w[1]) / self.spacing).ceil().max(1.0) as usize;
            for n in 1..=pieces {
                let at = |k: f64| w[0].lerp(w[1], k / pieces as f64);
                points.push(at(n as f64));
                speeds.push(self.speed / share(at(n as f64 - 0.5)));
            }
        }
        pass.moves = vec![Move::Line; speeds.len()];
        pass.points = points;
        pass.channels.speed = Some(speeds);
        pass.neighbours.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ebm::region::Contour;
    use meltpath_thermal::beam::BeamPoint;

    fn hatch(strategy: HatchStrategy) -> Hatch {
        let table = HatchTable {
            strategy,
            ..HatchTable::default()
        };
        Hatch::resolve(&table, 0.05, &mut Provenance::new())
    }

    fn modulated(strategy: HatchStrategy, below: Below) -> Hatch {
        let hatch = hatch(strategy);
        let r = &mut Provenance::new();
        let table = ModulationTable::default();
        let modulation = Modulated::resolve(&table, hatch.energy(), below, r);
        Hatch {
            modulation: Some(modulation),
            ..hatch
        }
    }

    /// A plate that hangs over powder on its right: whatever the strategy, the energy is what the law asks for.
    #[test]
    fn every_strategy_follows_the_modulation() {
        let contour = Contour::rectangle([6.0, 4.0]);
        let region = contour.region();
        let foot = Contour::new(vec![[-4.0, -3.0], [0.0, -3.0], [0.0, 3.0], [-4.0, 3.0]]);
        // mean of F over a width of 6 and of 4 mm, half of it over powder
        let across = |w: f64| (w - 2.0 + 2.0 * 0.9) / w;
        let wanted = 48.98 * across(6.0) * across(4.0) * 0.5 * (1.0 + 0.6);
        for strategy in [
            HatchStrategy::Modulated,
            HatchStrategy::Lines,
            HatchStrategy::OneWay,
            HatchStrategy::Contours,
            HatchStrategy::Spots,
        ] {
            let hatch = modulated(strategy, Below::Areas(vec![foot.clone()]));
            let path = hatch.path(&region, 1, &Reporter::new()).unwrap();
            let found = energy(&path) / (region.area() * 0.05);
            assert!(
                (found / wanted - 1.0).abs() < 0.05,
                "{strategy:?}: {found} {wanted}"
            );
        }
    }

    /// Passes lie farther apart near powder, and the path is shorter than at constant spacing.
    #[test]
    fn ebm_q10_the_modulated_path_is_shorter() {
        let region = Contour::rectangle([8.0, 6.0]).region();
        let length = |h: &Hatch| {
            let passes = h.passes(&region, 1, &Reporter::new()).unwrap();
            passes.deposited_length()
        };
        let some = length(&modulated(HatchStrategy::Modulated, Below::Metal));
        let all = length(&hatch(HatchStrategy::Contours));
        assert!(some < 0.97 * all, "{some} {all}");
    }

    fn energy(path: &BeamPath) -> f64 {
        let of = |w: &[BeamPoint]| w[0].voltage * w[0].current * (w[1].time - w[0].time);
        path.points().windows(2).filter(|w| w[0].on).map(of).sum()
    }

    /// A frame with a hole: every strategy brings the thesis' energy per volume to it and stays inside.
    #[test]
    fn every_strategy_fills_a_region_with_a_hole() {
        let contour = Contour::rectangle([9.0, 7.0]).with_holes(vec![vec![
            [-2.0, -1.5],
            [2.0, -1.5],
            [2.0, 1.5],
            [-2.0, 1.5],
        ]]);
        let region = contour.region();
        for strategy in [
            HatchStrategy::Lines,
            HatchStrategy::OneWay,
            HatchStrategy::Contours,
            HatchStrategy::Spiral,
            HatchStrategy::Islands,
            HatchStrategy::Spots,
        ] {
            let reporter = Reporter::new();
            let hatch = hatch(strategy);
            for layer in 1..=2 {
                let path = hatch.path(&region, layer, &reporter).unwrap();
                let density = energy(&path) / (region.area() * 0.05);
                // lines of islands end half a spacing before each border
                assert!(
                    (density / 48.98 - 1.0).abs() < 0.08,
                    "{strategy:?}, layer {layer}: {density} J/mm³"
                );
                for p in path.points().iter().filter(|p| p.on) {
                    assert!(contour.depth([p.x, p.y]) > -1e-3, "{strategy:?} {p:?}");
                }
            }
        }
    }

    #[test]
    fn spots_lie_apart_in_time() {
        let region = Contour::rectangle([4.0, 4.0]).region();
        let passes = hatch(HatchStrategy::Spots)
            .passes(&region, 1, &Reporter::new())
            .unwrap();
        let points = &passes.passes[0].points[1..];
        assert_eq!(points.len(), 32 * 32);
        let near = points
            .windows(2)
            .filter(|w| w[0].distance(w[1]) < 0.4)
            .count();
        assert_eq!(near, 0);
    }

    #[test]
    fn areas_are_drawn_one_after_the_other_and_slivers_left_out() {
        let square = |x: f64| {
            Contour::new(vec![[x, 0.0], [x + 2.0, 0.0], [x + 2.0, 2.0], [x, 2.0]]).region()
        };
        let sliver = Contour::new(vec![[9.0, 0.0], [14.0, 0.0], [14.0, 0.01], [9.0, 0.01]]);
        let regions = [square(5.0), sliver.region(), square(0.0)];
        let hatch = hatch(HatchStrategy::OneWay);
        let reporter = Reporter::new();
        let path = hatch.path_over(&regions, 3, &reporter).unwrap();
        let right: Vec<bool> = path
            .points()
            .iter()
            .filter(|p| p.on)
            .map(|p| p.x > 4.0)
            .collect();
        assert!(right[0] && !right[right.len() - 1]);
        assert_eq!(right.windows(2).filter(|w| w[0] != w[1]).count(), 1);
        let told = reporter.warnings();
        let left_out = told.iter().filter(|w| w.code == "area-not-drawn");
        let words: Vec<&str> = left_out.map(|w| w.message.as_str()).collect();
        assert!(
            words.len() == 1 && words[0].starts_with("layer 3: 1 of its 3 areas"),
            "{told:?}"
        );
        let none = hatch.path_over(&[sliver.region(), sliver.region()], 3, &reporter);
        assert!(matches!(none, Err(HatchError::Nothing { .. })));
    }

    #[test]
    fn what_cannot_be_filled_is_refused() {
        let sliver = Contour::rectangle([5.0, 0.01]).region();
        let refused = hatch(HatchStrategy::OneWay).path(&sliver, 1, &Reporter::new());
        assert!(
            matches!(refused, Err(HatchError::Nothing { .. })),
            "{refused:?}"
        );
        let wide = Contour::rectangle([5000.0, 5000.0]).region();
        let refused = hatch(HatchStrategy::Spots).path(&wide, 1, &Reporter::new());
        assert!(
            refused
                .unwrap_err()
                .to_string()
                .starts_with("spots of 0.125 mm")
        );
    }
}
