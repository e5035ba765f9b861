//! The file of measurements: what was built, with which beam, and how large it became.

use std::path::Path;

use meltpath_base::settings::{self, Many, Problem, Setting};
use meltpath_base::{Current, Length, Ratio, Speed, Voltage, table};
use meltpath_gun::Gun;
use meltpath_gun::focus::{FocusCalibration, stuck_grains};
use meltpath_thermal::calibration::coupon::{BeamSetting, Coupon};
use meltpath_thermal::charts::ChartSettings;

use crate::ebm::cost::charts::{ChartCost, cost};
use crate::ebm::cost::lever::{self, Need, refused};
use crate::ebm::gun::focus;
use crate::job::{JobError, Problems, text_of};
use crate::machine::Machine;

/// Charts of one beam that a fit computes: where it begins, sixteen places over what was believed, four in each of four rounds about the best,
/// that itself, and four places for a prediction.
const DRAWN: f64 = 38.0;
/// Bytes of a plane of the voxels of a body, two millimetres wide.
const VOXELS: f64 = 54.0 * 50.0 * 50.0;

/// Efficiencies and widths that can be.
pub(super) const BOUNDS: [[f64; 2]; 2] = [[0.3, 1.0], [0.4, 2.0]];

/// Layers that show a body's size.
pub(super) const LAYERS: u32 = 5;
/// Spacing of charts, mm, by default.
const SPACING: f64 = 0.025;
/// Charts are drawn again at this share of their spacing; at half of it where that is no finer than the default's, which costs as much as the fit.
const SHARE: f64 = 0.7;

/// Spacing of the charts by which those of a fit are judged, mm.
pub(super) fn finer(spacing: f64) -> f64 {
    (SHARE * spacing).min((0.5 * spacing).max(SPACING))
}

table! {
    /// Measured bodies, and the beams that they were built with.
    pub struct MeasurementsFile {
        /// Material: a name in `data/materials`, or a TOML file of your own.
        material: String => default("ti6al4v-ebm", "the material of Béraud 2016");
        /// Focus calibration: a name in `data/focus`, or a TOML file of your own.
        focus: String => default("a1-beraud-2016", "the machine of Béraud 2016");
        /// Thickness of a layer.
        layer: Length where positive => default("0.05 mm", "step of the table in Béraud 2016");
        /// Layers drawn of each body.
        layers: u32 where within(1.0, 100.0) => default(5, "enough to see the size");
        /// Spacing of the charts.
        spacing: Length where positive => default("0.025 mm", "converged within 2 °C of mean error");
        /// What is believed of the beam before.
        prior: PriorTable => default({}, "the calibration, and a usual efficiency");
        /// Struts drawn as circles.
        strut: Vec<StrutTable> => default([], "none was measured");
        /// Thin walls, one line a layer.
        wall: Vec<WallTable> => default([], "none was measured");
        /// Blocks whose pores were measured.
        porosity: Vec<PorosityTable> => default([], "none was measured");
        /// What the fitted beam is used for.
        predict: PredictTable => none("nothing is predicted");
    }

    /// What is believed of the beam before.
    pub struct PriorTable {
        /// Share of the beam's power that becomes heat.
        efficiency: Ratio where within(0.3, 1.0) => default("90 %", "Zäh and Lutzmann, quoted in Béraud 2016");
        /// Its standard uncertainty.
        efficiency_sigma: Ratio where up_to(1.0) => default("10 %", "a guess");
        /// Diameter of the spot as a share of the calibrated one.
        width: Ratio where within(0.4, 2.0) => default("100 %", "the calibration");
        /// Its standard uncertainty.
        width_sigma: Ratio where up_to(2.0) => default("15 %", "a guess");
    }

    /// A strut, drawn as circles.
    pub struct StrutTable {
        /// Its diameter as measured.
        measured: Length where positive => required;
        /// Standard uncertainty of the measurement.
        sigma: Length where positive => required;
        /// Radii of its circles, in the order drawn.
        radii: Many<Length, 1> where positive => required;
        /// Beam current of each circle.
        currents: Many<Current, 1> => required;
        /// Acceleration voltage.
        voltage: Voltage => required;
        /// Focus current.
        focus: Current => required;
        /// Speed of the beam.
        speed: Speed where positive => required;
        /// How far a circle is drawn beyond its start.
        overlap: Length where not_negative => default("0.4 mm", "Béraud 2016, section 3.3.1");
    }

    /// A thin wall, one line a layer.
    pub struct WallTable {
        /// Its thickness as measured.
        measured: Length where positive => required;
        /// Standard uncertainty of the measurement.
        sigma: Length where positive => required;
        /// The largest grain of the powder: stuck grains are part of the thickness.
        largest_grain: Length where positive => none("the thickness was measured without stuck grains");
        /// Beam current.
        current: Current => required;
        /// Acceleration voltage.
        voltage: Voltage => required;
        /// Focus current.
        focus: Current => required;
        /// Speed of the beam.
        speed: Speed where positive => required;
    }

    /// A block whose pores were measured.
    pub struct PorosityTable {
        /// Its share of pores as measured.
        measured: Ratio where not_negative => required;
        /// Standard uncertainty of the measurement.
        sigma: Ratio where positive => required;
        /// Beam current.
        current: Current => required;
        /// Acceleration voltage.
        voltage: Voltage => required;
        /// Focus current.
        focus: Current => required;
        /// Speed of the beam.
        speed: Speed where positive => required;
        /// Distance between its lines.
        spacing: Length where positive => required;
    }

    /// What the fitted beam is used for.
    pub struct PredictTable {
        /// Diameter wanted of a strut like the last one measured.
        diameter: Length where positive => required;
    }
}

/// One measured body.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// In words.
    pub name: String,
    /// What was built.
    pub coupon: Coupon,
    /// Its size, mm, or its share of pores.
    pub value: f64,
    /// Its standard uncertainty.
    pub sigma: f64,
}

/// The file, resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurements {
    /// Name of the material.
    pub material: String,
    /// Where the focus calibration comes from.
    pub calibrated: String,
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// Layers drawn of each body.
    pub layers: u32,
    /// Spacing of the charts, mm.
    pub spacing: f64,
    /// Efficiency and its standard uncertainty before.
    pub efficiency: [f64; 2],
    /// Factor on the calibrated diameter and its standard uncertainty before.
    pub width: [f64; 2],
    /// The measurements.
    pub all: Vec<Measurement>,
    /// Diameter wanted of a strut like the last one measured, mm.
    pub wanted: Option<f64>,
}

/// The beam of a measurement; what is wrong with it is told at its focus current.
fn beam(
    calibration: &FocusCalibration,
    name: &str,
    [voltage, current]: [f64; 2],
    focus: &Setting<Current>,
) -> Result<BeamSetting, Problem> {
    let gun = Gun {
        voltage,
        focus: calibration.clone(),
        coil: focus.0,
    };
    let spot = calibration.diameter(gun.coil);
    Ok(BeamSetting {
        power: gun.power(current),
        spot: spot.map_err(|e| focus.problem(format!("{name}: {e}")))?,
    })
}

/// A strut, with a beam for each of its circles.
fn strut(
    s: &StrutTable,
    (name, focus): (String, &FocusCalibration),
) -> Result<Measurement, Problem> {
    let (radii, currents) = (s.radii.len(), s.currents.len());
    if radii != currents {
        let message = format!("{name}: it has {radii} radii and {currents} currents");
        let help = "give one current for each circle, in the order drawn";
        return Err(s.currents.problem(message).help(help));
    }
    let circle = |(radius, current): (&Length, &Current)| {
        let beam = beam(focus, &name, [s.voltage.0, current.0], &s.focus)?;
        Ok((radius.0, beam))
    };
    let circles = s.radii.iter().zip(s.currents.iter()).map(circle);
    Ok(Measurement {
        coupon: Coupon::Strut {
            circles: circles.collect::<Result<_, Problem>>()?,
            speed: s.speed.0,
            overlap: s.overlap.0,
        },
        name,
        value: s.measured.0,
        sigma: s.sigma.0,
    })
}

/// A wall, less the grains that stick to it.
fn wall(w: &WallTable, (name, focus): (String, &FocusCalibration)) -> Result<Measurement, Problem> {
    let grains = w.largest_grain.map_or(0.0, |g| stuck_grains(g.0));
    if w.measured.0 <= grains {
        let message = format!(
            "{name}: it is {:.3} mm thick, of which {grains:.4} mm are stuck grains: nothing is left; was it measured without them?",
            w.measured.0
        );
        return Err(w.measured.problem(message));
    }
    Ok(Measurement {
        coupon: Coupon::Wall {
            beam: beam(focus, &name, [w.voltage.0, w.current.0], &w.focus)?,
            speed: w.speed.0,
        },
        name,
        value: w.measured.0 - grains,
        sigma: w.sigma.0,
    })
}

/// A block whose pores were measured.
fn block(
    p: &PorosityTable,
    (name, focus): (String, &FocusCalibration),
) -> Result<Measurement, Problem> {
    Ok(Measurement {
        coupon: Coupon::Block {
            beam: beam(focus, &name, [p.voltage.0, p.current.0], &p.focus)?,
            speed: p.speed.0,
            spacing: p.spacing.0,
        },
        name,
        value: p.measured.0,
        sigma: p.sigma.0,
    })
}

/// What does not go together in a file.
fn check(file: &MeasurementsFile) -> Vec<Problem> {
    let none = file.strut.is_empty() && file.wall.is_empty() && file.porosity.is_empty();
    let alone = file.predict.is_some() && file.strut.is_empty();
    settings::broken([
        (
            none,
            Problem::new("the file: give at least one [[strut]], [[wall]] or [[porosity]]"),
        ),
        (
            alone,
            file.predict.problem(
                "predict: a diameter is predicted for struts like the last one measured, and there is none",
            ),
        ),
    ])
}

/// Reads a file of measurements.
///
/// # Errors
/// [`JobError`]: everything wrong, each with its place.
pub fn read(path: &Path) -> Result<Measurements, JobError> {
    let text = text_of(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    settings::parse(&text, check)
        .and_then(|file| resolve(&file, folder))
        .map_err(|problems| JobError::in_file(path, &text, problems))
}

/// Why no machine could draw the bodies, by the setting that asks for most.
fn impossible(file: &MeasurementsFile, all: &[Measurement]) -> Option<Problem> {
    let beams = all.iter().flat_map(|m| m.coupon.beams());
    let charts = beams.map(|beam| ChartSettings {
        cell: file.spacing.0,
        layer: file.layer.0,
        ..ChartSettings::for_beam(beam.power, file.prior.width.0 * beam.spot)
    });
    let costs: Vec<ChartCost> = charts.map(|c| cost(&c, 1.0)).collect();
    let bytes = costs.iter().map(|c| c.bytes).fold(0.0, f64::max);
    let again = (file.spacing.0 / finer(file.spacing.0)).powi(5);
    let seconds = (DRAWN + again) * costs.iter().map(|c| c.seconds).sum::<f64>();
    let planes = ChartSettings::for_beam(1.0, 1.0).reach / file.layer.0;
    let voxels = VOXELS * planes;
    let spacing = || [lever::spacing(&file.spacing)];
    let layer = || [lever::layer(&file.layer, 0.05 / file.layer.0)];
    let memory = |bytes| Need::Memory([bytes, Machine::here().bytes]);
    refused("computing charts", memory(bytes), spacing())
        .or_else(|| refused("computing charts", Need::Time(seconds), spacing()))
        .or_else(|| refused("drawing a body", memory(voxels), layer()))
}

/// The measurements of a file that lies in `folder`.
fn resolve(file: &MeasurementsFile, folder: &Path) -> Result<Measurements, Problems> {
    let (calibration, calibrated) =
        focus::load(&file.focus, folder).map_err(|e| e.at(&file.focus))?;
    let name = |kind: &str, n: usize| format!("{kind} {}", n + 1);
    let struts = file.strut.iter().enumerate();
    let struts = struts.map(|(n, s)| strut(s, (name("strut", n), &calibration)));
    let walls = file.wall.iter().enumerate();
    let walls = walls.map(|(n, w)| wall(w, (name("wall", n), &calibration)));
    let blocks = file.porosity.iter().enumerate();
    let blocks = blocks.map(|(n, p)| block(p, (name("porosity", n), &calibration)));
    let (mut all, mut problems) = (Vec::new(), Vec::new());
    for found in struts.chain(walls).chain(blocks) {
        match found {
            Ok(measurement) => all.push(measurement),
            Err(problem) => problems.push(problem),
        }
    }
    if problems.is_empty() {
        problems.extend(impossible(file, &all));
    }
    if !problems.is_empty() {
        return Err(problems.into());
    }
    let prior = &file.prior;
    Ok(Measurements {
        material: file.material.value.clone(),
        calibrated,
        layer: file.layer.0,
        layers: *file.layers,
        spacing: file.spacing.0,
        efficiency: [prior.efficiency.0, prior.efficiency_sigma.0],
        width: [prior.width.0, prior.width_sigma.0],
        all,
        wanted: file.predict.as_ref().map(|p| p.diameter.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> String {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("m.toml");
        std::fs::write(&file, text).unwrap();
        read(&file).unwrap_err().to_string()
    }

    const BEAM: &str = "voltage = \"60 kV\"\nfocus = \"0 mA\"\nspeed = \"470 mm/s\"\n";

    #[test]
    fn bad_measurements_are_named() {
        assert!(told("").contains("at least one"));
        let several = told("colour = 1\n[prior]\nefficiency = \"90\"\n[[wall]]\n");
        for word in ["colour", "needs a unit", "wall.measured is missing"] {
            assert!(several.contains(word), "{word}: {several}");
        }
        let strut = format!(
            "[[strut]]\nmeasured = \"657 µm\"\nsigma = \"50 µm\"\nradii = [\"0.2 mm\"]\ncurrents = [\"2 mA\", \"2.4 mA\"]\n{BEAM}"
        );
        assert!(told(&strut).contains("strut 1: it has 1 radii and 2 currents"));
        let wall = format!(
            "[[wall]]\nmeasured = \"200 µm\"\nsigma = \"20 µm\"\nlargest_grain = \"163 µm\"\ncurrent = \"5 mA\"\n{BEAM}"
        );
        assert!(told(&wall).contains("stuck grains"));
        let unit = wall.replace("5 mA", "5");
        assert!(told(&unit.replace("200 µm", "500 µm")).contains("wall.current"));
        let both = told(&format!("{strut}{wall}"));
        assert!(
            both.contains("strut 1") && both.contains("wall 1"),
            "{both}"
        );
        assert!(told(&wall.replace("sigma = \"20 µm\"", "sigma = \"0 µm\"")).contains("sigma"));
        let sound = wall.replace("200 µm", "500 µm");
        for (slip, said) in [
            (
                "spacing = \"1 nm\"\n",
                "spacing is 0.000001 mm: computing charts would take",
            ),
            ("layer = \"0.001 nm\"\n", "layer is"),
            ("layers = 500\n", "layers"),
            ("[prior]\nefficiency = \"150 %\"\n", "prior.efficiency"),
        ] {
            let told = told(&format!("{slip}{sound}"));
            assert!(told.contains(said), "{told}");
        }
    }
}
