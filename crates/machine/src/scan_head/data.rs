//! Scan heads as data files: every number with its unit and its source.
//!
//! The numbers of the two reference heads are those of the specification *lpbf-scan-head* § 18: the thesis does not print its
//! motors' parameters.

use meltpath_base::quantity::{self, QuantityError, Unit};
use serde::Deserialize;

use super::axis::{Axis, Encoder};
use super::beam::GaussianBeam;
use super::focus::{FocusProjection, Lenses};
use super::friction::Friction;
use super::galvanometer::{Galvanometer, Mode};
use super::geometry::{Geometry, PathSign, ThreeAxis, TwoAxis};
use super::head::ScanHead;
use super::prefilter::{Kernel, PreFilter};
use super::servo_loop::{
    AngleUnit, CascadeGains, Controller, CurrentGains, FeedForward, Limits, SpeedSource,
};

/// Why a head's file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeadFileError {
    /// Its form.
    #[error("{0}")]
    Form(String),
    /// A value.
    #[error("{place}: {source}")]
    Value {
        /// Table and key.
        place: String,
        /// What is wrong with it.
        source: QuantityError,
    },
}

/// A number of a data file: value with unit, and who says so.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Number and unit.
    pub value: String,
    /// One standard deviation, with its unit, where known.
    pub uncertainty: Option<String>,
    /// Who says so, or why it was chosen.
    pub source: String,
    /// Page of the source.
    pub page: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct HeadFile {
    head: HeadTable,
    geometry: GeometryTable,
    focus: Option<FocusTable>,
    beam: BeamTable,
    x: AxisTable,
    y: AxisTable,
    z: Option<AxisTable>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct HeadTable {
    name: String,
    sampling: Figure,
    field: Figure,
    table_points: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", tag = "kind")]
enum GeometryTable {
    TwoAxis {
        plane_distance: Figure,
        mirror_distance: Figure,
    },
    ThreeAxis {
        plane_x: Figure,
        plane_y: Figure,
        plane_z: Figure,
        x_axis_x: Figure,
        x_axis_y: Figure,
        x_rest: Figure,
        x_tilt: Figure,
        y_axis_y: Figure,
        y_axis_z: Figure,
        y_rest: Figure,
        mirror_offset: Figure,
        window: Figure,
        atmosphere_index: Figure,
        window_index: Figure,
        objective: Figure,
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FocusTable {
    objective: Figure,
    moving: Figure,
    cam_radius: Figure,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BeamTable {
    waist: Figure,
    wavelength: Figure,
    quality: Figure,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisTable {
    resistance: Figure,
    inductance: Figure,
    torque_constant: Figure,
    back_emf: Figure,
    inertia: Figure,
    viscous: Figure,
    coulomb: Figure,
    bias: Figure,
    #[serde(default)]
    mode: Vec<ModeTable>,
    current_gain: Figure,
    current_integral_time: Figure,
    speed_gain: Figure,
    speed_integral_time: Figure,
    position_gain: Figure,
    position_derivative_time: Figure,
    feed_forward_speed: Figure,
    feed_forward_current: Figure,
    feed_forward_filter: Figure,
    speed_filter: Option<Figure>,
    supply: Figure,
    peak_current: Figure,
    travel: Figure,
    speed_limit: Figure,
    first_filter: Figure,
    second_filter: Figure,
    encoder_resolution: Figure,
    encoder_noise: Figure,
    loop_delay: Figure,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModeTable {
    frequency: Figure,
    damping: Figure,
    /// K_r Kc/J: the mode's gain over the rigid body's.
    gain_ratio: Figure,
}

const fn unit(symbol: &'static str, factor: f64) -> Unit {
    Unit {
        symbol,
        factor,
        offset: 0.0,
    }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const HERTZ: &[Unit] = &[unit("Hz", 1.0), unit("kHz", 1e3)];
const LENGTH: &[Unit] = &[unit("mm", 1.0), unit("µm", 1e-3), unit("nm", 1e-6)];
const ANGLE: &[Unit] = &[unit("deg", DEGREE), unit("rad", 1.0)];
const ANGULAR_SPEED: &[Unit] = &[unit("deg/s", DEGREE), unit("rad/s", 1.0)];
const TIME: &[Unit] = &[unit("s", 1.0), unit("ms", 1e-3), unit("µs", 1e-6)];
const RESISTANCE: &[Unit] = &[unit("Ω", 1.0)];
const INDUCTANCE: &[Unit] = &[unit("µH", 1e-6), unit("H", 1.0)];
const TORQUE_CONSTANT: &[Unit] = &[unit("N·m/A", 1.0)];
const BACK_EMF: &[Unit] = &[unit("V·s/rad", 1.0)];
const INERTIA: &[Unit] = &[unit("kg·m²", 1.0), unit("g·cm²", 1e-7)];
const VISCOUS: &[Unit] = &[unit("N·m·s/rad", 1.0)];
const TORQUE: &[Unit] = &[unit("N·m", 1.0), unit("µN·m", 1e-6)];
const NONE: &[Unit] = &[unit("1", 1.0)];
const CURRENT_GAIN: &[Unit] = &[unit("V/A", 1.0)];
const SPEED_GAIN: &[Unit] = &[unit("A·s/deg", 1.0)];
const RATE: &[Unit] = &[unit("1/s", 1.0)];
const VOLTAGE: &[Unit] = &[unit("V", 1.0)];
const CURRENT: &[Unit] = &[unit("A", 1.0)];

/// Reads figures of one table and says which one is wrong.
struct Reading<'a> {
    table: &'a str,
}

impl Reading<'_> {
    fn get(
        &self,
        key: &'static str,
        figure: &Figure,
        units: &[Unit],
    ) -> Result<f64, HeadFileError> {
        let failed = |source| HeadFileError::Value {
            place: format!("{}.{key}", self.table),
            source,
        };
        if let Some(u) = &figure.uncertainty {
            quantity::parse(u, key, units).map_err(failed)?;
        }
        quantity::parse(&figure.value, key, units).map_err(failed)
    }
}

macro_rules! read {
    ($reading:expr, $table:expr, $key:ident, $units:expr) => {
        $reading.get(stringify!($key), &$table.$key, $units)?
    };
}

/// Reads a head's TOML text.
///
/// # Errors
/// [`HeadFileError`] with the place in the file.
pub fn parse(text: &str) -> Result<ScanHead, HeadFileError> {
    let file: HeadFile = toml::from_str(text).map_err(|e| HeadFileError::Form(e.to_string()))?;
    let head = Reading { table: "head" };
    let b = Reading { table: "beam" };
    let focus = match (&file.focus, &file.z) {
        (Some(lenses), Some(axis)) => {
            let f = Reading { table: "focus" };
            let lenses = Lenses {
                objective: read!(f, lenses, objective, LENGTH),
                moving: read!(f, lenses, moving, LENGTH),
                cam_radius: read!(f, lenses, cam_radius, LENGTH),
                rest_angle: 0.0,
                projection: FocusProjection::default(),
            };
            Some((read_axis("z", axis)?, lenses))
        }
        (None, None) => None,
        _ => {
            return Err(HeadFileError::Form(
                "a dynamic focus needs both tables [focus] and [z]".to_owned(),
            ));
        }
    };
    Ok(ScanHead {
        name: file.head.name.clone(),
        period: 1.0 / read!(head, file.head, sampling, HERTZ),
        geometry: geometry(&file.geometry)?,
        mirrors: [read_axis("x", &file.x)?, read_axis("y", &file.y)?],
        focus,
        half_field: 0.5 * read!(head, file.head, field, LENGTH),
        table: file.head.table_points,
        beam: GaussianBeam {
            waist: read!(b, file.beam, waist, LENGTH),
            wavelength: read!(b, file.beam, wavelength, LENGTH),
            quality: read!(b, file.beam, quality, NONE),
        },
    })
}

fn geometry(table: &GeometryTable) -> Result<Geometry, HeadFileError> {
    let g = Reading { table: "geometry" };
    Ok(match table {
        GeometryTable::TwoAxis {
            plane_distance,
            mirror_distance,
        } => Geometry::TwoAxis(TwoAxis {
            plane_distance: g.get("plane_distance", plane_distance, LENGTH)?,
            mirror_distance: g.get("mirror_distance", mirror_distance, LENGTH)?,
        }),
        GeometryTable::ThreeAxis {
            plane_x,
            plane_y,
            plane_z,
            x_axis_x,
            x_axis_y,
            x_rest,
            x_tilt,
            y_axis_y,
            y_axis_z,
            y_rest,
            mirror_offset,
            window,
            atmosphere_index,
            window_index,
            objective,
        } => Geometry::ThreeAxis(ThreeAxis {
            plane: [
                g.get("plane_x", plane_x, LENGTH)?,
                g.get("plane_y", plane_y, LENGTH)?,
                g.get("plane_z", plane_z, LENGTH)?,
            ],
            x_axis: [
                g.get("x_axis_x", x_axis_x, LENGTH)?,
                g.get("x_axis_y", x_axis_y, LENGTH)?,
            ],
            x_rest: g.get("x_rest", x_rest, ANGLE)?,
            x_tilt: g.get("x_tilt", x_tilt, ANGLE)?,
            y_axis: [
                g.get("y_axis_y", y_axis_y, LENGTH)?,
                g.get("y_axis_z", y_axis_z, LENGTH)?,
            ],
            y_rest: g.get("y_rest", y_rest, ANGLE)?,
            mirror_offset: g.get("mirror_offset", mirror_offset, LENGTH)?,
            window: g.get("window", window, LENGTH)?,
            atmosphere_index: g.get("atmosphere_index", atmosphere_index, NONE)?,
            window_index: g.get("window_index", window_index, NONE)?,
            objective: g.get("objective", objective, LENGTH)?,
            path_sign: PathSign::default(),
        }),
    })
}

fn read_axis(name: &str, t: &AxisTable) -> Result<Axis, HeadFileError> {
    let r = Reading { table: name };
    let kc = read!(r, t, torque_constant, TORQUE_CONSTANT);
    let inertia = read!(r, t, inertia, INERTIA);
    let mut modes = Vec::with_capacity(t.mode.len());
    for m in &t.mode {
        modes.push(Mode {
            omega: std::f64::consts::TAU * read!(r, m, frequency, HERTZ),
            damping: read!(r, m, damping, NONE),
            gain: read!(r, m, gain_ratio, NONE) * kc / inertia,
        });
    }
    let speed = match &t.speed_filter {
        None => SpeedSource::Rotor,
        Some(filter) => SpeedSource::Derivative {
            filter: r.get("speed_filter", filter, TIME)?,
        },
    };
    Ok(Axis {
        motor: Galvanometer {
            resistance: read!(r, t, resistance, RESISTANCE),
            inductance: read!(r, t, inductance, INDUCTANCE),
            torque_constant: kc,
            back_emf: read!(r, t, back_emf, BACK_EMF),
            inertia,
            viscous: read!(r, t, viscous, VISCOUS),
            modes,
            friction: Friction::Coulomb {
                coulomb: read!(r, t, coulomb, TORQUE),
                bias: read!(r, t, bias, TORQUE),
            },
        },
        controller: Controller::Cascade(CascadeGains {
            current: CurrentGains {
                gain: read!(r, t, current_gain, CURRENT_GAIN),
                integral_time: read!(r, t, current_integral_time, TIME),
            },
            speed_gain: read!(r, t, speed_gain, SPEED_GAIN),
            speed_integral_time: read!(r, t, speed_integral_time, TIME),
            position_gain: read!(r, t, position_gain, RATE),
            position_derivative_time: read!(r, t, position_derivative_time, TIME),
            feed_forward: FeedForward {
                speed: read!(r, t, feed_forward_speed, NONE),
                current: read!(r, t, feed_forward_current, NONE),
                filter: read!(r, t, feed_forward_filter, TIME),
                inertia_over_torque: inertia / kc,
            },
            unit: AngleUnit::Degree,
        }),
        speed,
        limits: Limits {
            voltage: read!(r, t, supply, VOLTAGE),
            current: read!(r, t, peak_current, CURRENT),
        },
        prefilter: Some(PreFilter {
            speed_limit: read!(r, t, speed_limit, ANGULAR_SPEED),
            first: read!(r, t, first_filter, TIME),
            second: Kernel::Box(read!(r, t, second_filter, TIME)),
        }),
        encoder: Encoder {
            resolution: read!(r, t, encoder_resolution, ANGLE),
            noise: read!(r, t, encoder_noise, ANGLE),
        },
        delay: read!(r, t, loop_delay, TIME),
        travel: read!(r, t, travel, ANGLE),
    })
}
