//! Hatches of a beam, an electron beam's or a laser hatch, and where the turning points of a hatch lie: regions of a layer filled by lines, contours, islands or spots, of one power, spot and speed.

use meltpath_base::Reporter;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::offset::{Join, outset};
use meltpath_geometry::{Plane, Region};
use meltpath_toolpath::{Channel, Layer, Profile, Toolpath};

use crate::fill::{
    ContourOrder, FillSettings, LayerDirection, LineAngle, LineDirection, Spacing, StartPoints,
    Strategy,
};
use crate::fill::{PassIds, passes_alone};
use crate::powder::error::HatchError;
use crate::powder::modulation::{Modulation, hatch_energy};
use crate::powder::nested::EnergyField;
use crate::powder::patterns::{islands, nested, spots};

/// Corners of what is drawn beyond the contour: as sharp as the part's, but for needles.
const CORNERS: Join = Join::Miter { limit: 4.0 };

/// Distances between lines that regions are filled with, mm.
const SPACINGS: [f64; 2] = [0.005, 1000.0];

/// What fills a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Lines to and fro.
    Lines,
    /// Lines that all run one way.
    OneWay,
    /// Contours, the outer ones first.
    Contours,
    /// Contours joined into spirals.
    Spiral,
    /// Lines in the squares of a chessboard, crossed from colour to colour.
    Islands,
    /// Spots on which the beam rests.
    Spots,
    /// Contours that lie nearer together where more energy is wanted.
    Modulated,
}

/// What the beam does from line to line, where lines run to and fro.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turns {
    /// It stays on: lines are joined at their ends.
    Joined,
    /// It is off: each line begins anew.
    Apart,
}

/// Less energy near powder, and where powder lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Modulated {
    /// The law; nominal is what the hatch brings.
    pub law: Modulation,
    /// Metal below the first layer; `None` where it lies everywhere.
    pub below: Option<Vec<Region>>,
}

impl Modulated {
    /// Wanted energy in layer `number` (from 1), `layer` mm thick.
    fn field(&self, region: &Region, number: u32, layer: f64, cell: f64) -> EnergyField {
        let drawn = f64::from(number - 1) * layer;
        let depth = |p: DVec2| match &self.below {
            Some(metal) if !metal.iter().any(|m| m.contains(p)) => drawn,
            _ => f64::INFINITY,
        };
        EnergyField::new(region, &self.law, cell, &depth)
    }
}

/// How regions are hatched.
#[derive(Debug, Clone, PartialEq)]
pub struct Hatch {
    /// What fills them.
    pub pattern: Pattern,
    /// What the beam does from line to line.
    pub turns: Turns,
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
    /// Diameter of the spot, mm; 0 where the machine has its own.
    pub spot: f64,
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// Greatest distance between an arc and the lines in its place, mm.
    pub chord_error: f64,
    /// Less energy near powder.
    pub modulation: Option<Modulated>,
}

impl Hatch {
    /// Energy per volume far from powder, J/mm³.
    pub fn energy(&self) -> f64 {
        hatch_energy(self.power, self.speed, self.spacing, self.layer)
    }

    /// The same beam and distances with straight lines, not modulated.
    #[must_use]
    pub fn of_lines(&self) -> Self {
        Hatch {
            pattern: Pattern::Lines,
            contours: 0,
            modulation: None,
            ..self.clone()
        }
    }

    /// Distances that lines can have.
    fn check(&self) -> Result<(), HatchError> {
        let [low, high] = SPACINGS;
        if (low..=high).contains(&self.spacing) {
            return Ok(());
        }
        Err(HatchError::Spacing {
            spacing: self.spacing,
            low,
            high,
        })
    }

    /// The toolpath over areas of layer `number`, one after the other. Areas too narrow for a line are left out with a
    /// warning, unless all are.
    ///
    /// # Errors
    /// [`HatchError`].
    pub fn toolpath(
        &self,
        regions: &[Region],
        number: u32,
        reporter: &Reporter,
    ) -> Result<Toolpath, HatchError> {
        let ids = PassIds { part: 0 };
        let mut whole = Toolpath {
            profiles: vec![Profile {
                name: "hatch".to_owned(),
                speed: self.speed,
                power: self.power,
                spot: self.spot,
                ..Profile::default()
            }],
            ..Toolpath::default()
        };
        let mut path = Layer::new(number, 0.0);
        let mut narrow: Vec<f64> = Vec::new();
        let beyond = match self.overrun {
            overrun if overrun > 0.0 => outset(regions, overrun, CORNERS)?,
            _ => Vec::new(),
        };
        let regions = if beyond.is_empty() { regions } else { &beyond };
        for region in regions {
            let drawn = match self.passes(region, number, reporter) {
                Err(HatchError::Nothing { .. }) if regions.len() > 1 => {
                    narrow.push(region.area());
                    continue;
                }
                other => other?,
            };
            for mut pass in drawn.passes() {
                if regions.len() > 1 {
                    pass = pass.alone();
                    pass.head.id = ids.id(number, path.len())?;
                }
                path.push(pass);
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
        whole.layers.push(path);
        Ok(whole)
    }

    /// Passes that fill `region` in layer `number` (from 1).
    fn passes(
        &self,
        region: &Region,
        number: u32,
        reporter: &Reporter,
    ) -> Result<Layer, HatchError> {
        // whole turns say nothing, however many layers add up to them
        let angle =
            (self.angles[0] + self.angles[1] * f64::from(number - 1)) % std::f64::consts::TAU;
        let field = self.modulation.as_ref().map(|m| {
            // a tenth of a spacing: contours stay within a hundredth of it
            m.field(region, number, self.layer, 0.1 * self.spacing)
        });
        let mut path = match self.pattern {
            Pattern::Modulated => {
                let field = field.as_ref().ok_or(HatchError::NotModulated)?;
                nested(field, self.power / (self.speed * self.layer), number)?
            }
            Pattern::Spots => spots(region, self.spacing, self.dwell, angle, number)?,
            Pattern::Islands => self.islands(region, number, angle, reporter)?,
            _ => {
                let strategy = self.fill(angle, self.contours);
                self.plan(std::slice::from_ref(region), strategy, number, reporter)?
            }
        };
        if path.is_empty() {
            return Err(HatchError::Nothing {
                spacing: self.spacing,
            });
        }
        if let (Some(field), true) = (&field, self.pattern != Pattern::Modulated) {
            path = self.slowed(path, field);
        }
        Ok(path)
    }

    /// Islands of one colour after those of the other, their lines crossed.
    fn islands(
        &self,
        region: &Region,
        number: u32,
        angle: f64,
        reporter: &Reporter,
    ) -> Result<Layer, HatchError> {
        let ids = PassIds { part: 0 };
        let turns = [0.0, std::f64::consts::FRAC_PI_2];
        let mut path = Layer::new(number, 0.0);
        for (islands, turn) in islands(region, self.island)?.iter().zip(turns) {
            let strategy = self.fill(angle + turn, 0);
            let lines = self.plan(islands, strategy, number, reporter)?;
            for pass in lines.passes() {
                let mut pass = pass.alone();
                pass.head.id = ids.id(number, path.len())?;
                path.push(pass);
            }
        }
        Ok(path)
    }

    fn fill(&self, angle: f64, contours: u32) -> Strategy {
        let angle = LineAngle::Turning {
            first: angle,
            step: 0.0,
        };
        let order = ContourOrder::OutsideIn;
        match self.pattern {
            Pattern::Contours => Strategy::Contour { order },
            Pattern::Spiral => Strategy::Spiral { order },
            Pattern::OneWay => Strategy::Rimmed {
                contours,
                angle,
                direction: LineDirection::OneWay,
            },
            Pattern::Lines | Pattern::Islands | Pattern::Spots | Pattern::Modulated => {
                match self.turns {
                    Turns::Apart => Strategy::Rimmed {
                        contours,
                        angle,
                        direction: LineDirection::AlternatePerBead,
                    },
                    Turns::Joined if contours > 0 => Strategy::Hybrid {
                        contours,
                        order,
                        angle,
                    },
                    Turns::Joined => Strategy::Zigzag { angle },
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
    ) -> Result<Layer, HatchError> {
        self.check()?;
        let plane = Plane::horizontal(0.0);
        let layer = crate::fill::FillLayer {
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
        Ok(passes_alone(
            layer,
            &settings,
            PassIds { part: 0 },
            reporter,
        )?)
    }

    /// Speed, or time on a spot, so that the energy follows the field; pieces of at most a spacing.
    fn slowed(&self, mut path: Layer, field: &EnergyField) -> Layer {
        let nominal = self.energy();
        let share = |p: DVec3| (field.at(p.truncate()) / nominal).clamp(0.05, 1.0);
        if self.pattern == Pattern::Spots {
            path.set_spot_times(|at, time| time * share(at));
            return path;
        }
        let mut slowed = Layer::new(path.number, path.height);
        for pass in path.passes() {
            let mut to = slowed.begin(pass.head, pass.points[0]);
            let (flat, _) = pass.flatten(self.chord_error);
            for w in flat.windows(2) {
                let pieces = (w[0].distance(w[1]) / self.spacing).ceil().max(1.0) as usize;
                for n in 1..=pieces {
                    let at = |k: f64| w[0].lerp(w[1], k / pieces as f64);
                    to.line_to(at(n as f64));
                    to.set(Channel::Speed, self.speed / share(at(n as f64 - 0.5)));
                }
            }
        }
        slowed
    }
}

#[cfg(test)]
mod tests;
