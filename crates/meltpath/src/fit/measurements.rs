//! The file of measurements: what was built, with which beam, and how large it became.

use std::path::{Path, PathBuf};

use meltpath_base::quantity::{NotNegative, Positive, QuantityError, Unit, parse};
use meltpath_base::{Length, Ratio, Speed};
use meltpath_gun::focus::{FocusCalibration, FocusError, stuck_grains};
use meltpath_thermal::calibration::coupon::{BeamSetting, Coupon};
use serde::Deserialize;

use crate::ebm::focus;

const CURRENT: &[Unit] = &[scaled("mA", 1e-3), scaled("A", 1.0)];
const VOLTAGE: &[Unit] = &[scaled("kV", 1e3), scaled("V", 1.0)];

const fn scaled(symbol: &'static str, factor: f64) -> Unit {
    Unit::new(symbol, factor)
}

/// Why measurements cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MeasurementsError {
    /// The file does not open.
    #[error("cannot open the measurements `{}`: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not TOML, an unknown key, a value without its unit.
    #[error("the measurements `{}` do not read: {message}", .path.display())]
    Text {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Values that contradict each other.
    #[error("`{}`, {what}: {message}", .path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Which measurement.
        what: String,
        /// What is wrong.
        message: String,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    material: Option<String>,
    focus: Option<String>,
    layer: Option<Positive<Length>>,
    layers: Option<u32>,
    spacing: Option<Positive<Length>>,
    #[serde(default)]
    prior: PriorTable,
    #[serde(default)]
    strut: Vec<StrutTable>,
    #[serde(default)]
    wall: Vec<WallTable>,
    #[serde(default)]
    porosity: Vec<PorosityTable>,
    predict: Option<PredictTable>,
}

/// `[prior]`: what is believed before.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct PriorTable {
    efficiency: Option<Positive<Ratio>>,
    efficiency_sigma: Option<Positive<Ratio>>,
    width: Option<Positive<Ratio>>,
    width_sigma: Option<Positive<Ratio>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StrutTable {
    measured: Positive<Length>,
    sigma: Positive<Length>,
    radii: Vec<Positive<Length>>,
    currents: Vec<String>,
    voltage: String,
    focus: String,
    speed: Positive<Speed>,
    overlap: Option<NotNegative<Length>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WallTable {
    measured: Positive<Length>,
    sigma: Positive<Length>,
    largest_grain: Option<Positive<Length>>,
    current: String,
    voltage: String,
    focus: String,
    speed: Positive<Speed>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PorosityTable {
    measured: NotNegative<Ratio>,
    sigma: Positive<Ratio>,
    current: String,
    voltage: String,
    focus: String,
    speed: Positive<Speed>,
    spacing: Positive<Length>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PredictTable {
    diameter: Positive<Length>,
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

meltpath_base::passes_on! {
    enum BeamValueError {
        Quantity(QuantityError),
        Focus(FocusError),
    }
}

fn beam(
    calibration: &FocusCalibration,
    [voltage, current, focus]: [&str; 3],
) -> Result<BeamSetting, BeamValueError> {
    let power = parse(voltage, "voltage", VOLTAGE)? * parse(current, "current", CURRENT)?;
    let coil = parse(focus, "focus current", CURRENT)?;
    Ok(BeamSetting {
        power,
        spot: calibration.diameter(coil)?,
    })
}

/// An error at a place of the file.
type Wrong<'a> = &'a dyn Fn(&str, String) -> MeasurementsError;
/// Measurements of one kind.
type Found = Result<Vec<Measurement>, MeasurementsError>;

/// The struts, each with a beam for each of its circles.
fn struts(file: &File, calibration: &FocusCalibration, wrong: Wrong<'_>) -> Found {
    let mut all = Vec::new();
    for (n, s) in file.strut.iter().enumerate() {
        let name = format!("strut {}", n + 1);
        if s.radii.is_empty() || s.radii.len() != s.currents.len() {
            let message = format!(
                "it has {} radii and {} currents: give one current for each circle, in the order drawn",
                s.radii.len(),
                s.currents.len()
            );
            return Err(wrong(&name, message));
        }
        let circles = s
            .radii
            .iter()
            .zip(&s.currents)
            .map(|(r, c)| Ok((r.0.0, beam(calibration, [&s.voltage, c, &s.focus])?)))
            .collect::<Result<Vec<_>, BeamValueError>>()
            .map_err(|e| wrong(&name, e.to_string()))?;
        all.push(Measurement {
            name,
            coupon: Coupon::Strut {
                circles,
                speed: s.speed.0.0,
                overlap: s.overlap.map_or(0.4, |o| o.0.0),
            },
            value: s.measured.0.0,
            sigma: s.sigma.0.0,
        });
    }
    Ok(all)
}

/// The walls, less the grains that stick to them.
fn walls(file: &File, calibration: &FocusCalibration, wrong: Wrong<'_>) -> Found {
    let mut all = Vec::new();
    for (n, w) in file.wall.iter().enumerate() {
        let name = format!("wall {}", n + 1);
        let grains = w.largest_grain.map_or(0.0, |g| stuck_grains(g.0.0));
        if w.measured.0.0 <= grains {
            let message = format!(
                "it is {:.3} mm thick, of which {grains:.4} mm are stuck grains: nothing is left; was it measured without them?",
                w.measured.0.0
            );
            return Err(wrong(&name, message));
        }
        all.push(Measurement {
            coupon: Coupon::Wall {
                beam: beam(calibration, [&w.voltage, &w.current, &w.focus])
                    .map_err(|e| wrong(&name, e.to_string()))?,
                speed: w.speed.0.0,
            },
            name,
            value: w.measured.0.0 - grains,
            sigma: w.sigma.0.0,
        });
    }
    Ok(all)
}

/// The blocks whose pores were measured.
fn blocks(file: &File, calibration: &FocusCalibration, wrong: Wrong<'_>) -> Found {
    let mut all = Vec::new();
    for (n, p) in file.porosity.iter().enumerate() {
        let name = format!("porosity {}", n + 1);
        all.push(Measurement {
            coupon: Coupon::Block {
                beam: beam(calibration, [&p.voltage, &p.current, &p.focus])
                    .map_err(|e| wrong(&name, e.to_string()))?,
                speed: p.speed.0.0,
                spacing: p.spacing.0.0,
            },
            name,
            value: p.measured.0.0,
            sigma: p.sigma.0.0,
        });
    }
    Ok(all)
}

/// Reads a file of measurements.
///
/// # Errors
/// [`MeasurementsError`].
pub fn read(path: &Path) -> Result<Measurements, MeasurementsError> {
    let text = std::fs::read_to_string(path).map_err(|source| MeasurementsError::Open {
        path: path.to_path_buf(),
        source,
    })?;
    let file: File = toml::from_str(&text).map_err(|e| MeasurementsError::Text {
        path: path.to_path_buf(),
        message: e.to_string(),
    })?;
    let wrong = |what: &str, message: String| MeasurementsError::Value {
        path: path.to_path_buf(),
        what: what.to_owned(),
        message,
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let focus = file.focus.as_deref().unwrap_or("a1-beraud-2016");
    let (calibration, calibrated) =
        focus::load(focus, folder).map_err(|e| wrong("focus", e.to_string()))?;
    let mut all = struts(&file, &calibration, &wrong)?;
    all.extend(walls(&file, &calibration, &wrong)?);
    all.extend(blocks(&file, &calibration, &wrong)?);
    if all.is_empty() {
        let message = "give at least one [[strut]], [[wall]] or [[porosity]]".to_owned();
        return Err(wrong("the file", message));
    }
    if file.predict.is_some() && file.strut.is_empty() {
        let message =
            "a diameter is predicted for struts like the last one measured, and there is none"
                .to_owned();
        return Err(wrong("predict", message));
    }
    let share = |v: Option<Positive<Ratio>>, default: f64| v.map_or(default, |v| v.0.0);
    Ok(Measurements {
        material: file.material.unwrap_or_else(|| "ti6al4v-ebm".to_owned()),
        calibrated,
        layer: file.layer.map_or(0.05, |l| l.0.0),
        layers: file.layers.unwrap_or(5).clamp(1, 100),
        spacing: file.spacing.map_or(0.025, |s| s.0.0),
        efficiency: [
            share(file.prior.efficiency, 0.9),
            share(file.prior.efficiency_sigma, 0.1),
        ],
        width: [
            share(file.prior.width, 1.0),
            share(file.prior.width_sigma, 0.15),
        ],
        all,
        wanted: file.predict.map(|p| p.diameter.0.0),
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
        assert!(told("[prior]\nefficiency = \"90\"\n").contains("needs a unit"));
        let strut = format!(
            "[[strut]]\nmeasured = \"657 µm\"\nsigma = \"50 µm\"\nradii = [\"0.2 mm\"]\ncurrents = [\"2 mA\", \"2.4 mA\"]\n{BEAM}"
        );
        assert!(told(&strut).contains("strut 1: it has 1 radii and 2 currents"));
        let wall = format!(
            "[[wall]]\nmeasured = \"200 µm\"\nsigma = \"20 µm\"\nlargest_grain = \"163 µm\"\ncurrent = \"5 mA\"\n{BEAM}"
        );
        assert!(told(&wall).contains("stuck grains"));
        let unit = wall.replace("5 mA", "5");
        assert!(told(&unit.replace("200 µm", "500 µm")).contains("wall 1"));
        assert!(told(&wall.replace("sigma = \"20 µm\"", "sigma = \"0 µm\"")).contains("sigma"));
    }
}
