//! Scan heads as data files: every number with its unit and its source.
//!
//! The numbers of the two reference heads are reconstructed (docs/theory/sources.md, reference heads): the thesis does not print
//! its motors' parameters.

use meltpath_base::quantity::{self, QuantityError, Unit};
use serde::Deserialize;

use crate::axis::chain::{Axis, Encoder};
use crate::axis::control::{
    AngleUnit, CascadeGains, Controller, CurrentGains, FeedForward, Limits, SpeedSource,
};
use crate::axis::friction::Friction;
use crate::axis::galvanometer::{Galvanometer, Mode};
use crate::axis::prefilter::{Kernel, PreFilter};
use crate::head::job::{LaserDelays, Recipe, SkyWriting};
use crate::head::scan_head::ScanHead;
use crate::measures::energy::PowerLaw;
use crate::optics::beam::GaussianBeam;
use crate::optics::focus::{FocusProjection, Lenses};
use crate::optics::geometry::{Geometry, PathSign, ThreeAxis, TwoAxis};
use crate::plate::SquarePlate;

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
    plate: PlateTable,
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
#[expect(clippy::large_enum_variant, reason = "read once and taken apart")]
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
        /// `traced` (default) or `printed`: the sign of K1 tan 2θx in eq. 2.39.
        #[serde(default)]
        path_sign: PathSign,
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FocusTable {
    objective: Figure,
    moving: Figure,
    cam_radius: Figure,
    /// `exact` (default) or `thesis`: eq. 2.49.
    #[serde(default)]
    projection: FocusProjection,
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
struct PlateTable {
    columns: Figure,
    rows: Figure,
    column_pitch: Figure,
    row_pitch: Figure,
    side: Figure,
    contour_distance: Figure,
    hatch: Figure,
    inset: Figure,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecipeFile {
    name: String,
    contour_speed: Figure,
    fill_speed: Figure,
    contour_jump_speed: Figure,
    fill_jump_speed: Figure,
    power: Figure,
    jump_wait: Figure,
    mark_wait: Figure,
    polygon_wait: Figure,
    laser_on_delay: Figure,
    laser_off_delay: Figure,
    /// The power follows the spot's speed, down to this.
    power_down_to: Option<Figure>,
    /// Sky-writing: time at the line's speed before and after each line of a fill.
    run_in: Option<Figure>,
    run_out: Option<Figure>,
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
    friction: Option<FrictionTable>,
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
    tuning: Option<TuningTable>,
}

/// Friction beyond the printed law of `coulomb` and `bias`, which is zero then.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", tag = "kind")]
enum FrictionTable {
    /// T_P as stiction: at rest up to T_C + T_P.
    Karnopp { stiction: Figure, rest: Figure },
    /// Bristles.
    Lugre {
        stiction: Figure,
        stribeck: Figure,
        stiffness: Figure,
        damping: Figure,
    },
}

/// Times of the first maximum of each loop's step response.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TuningTable {
    current: Figure,
    speed: Figure,
    position: Figure,
}

/// The figures of a motor alone, as an identification prints them; what is missing stays as it was.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorFile {
    resistance: Option<Figure>,
    inductance: Option<Figure>,
    torque_constant: Option<Figure>,
    back_emf: Option<Figure>,
    inertia: Option<Figure>,
    viscous: Option<Figure>,
    coulomb: Option<Figure>,
    bias: Option<Figure>,
    mode: Option<Vec<ModeTable>>,
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
const STIFFNESS: &[Unit] = &[unit("N·m/rad", 1.0)];
const TORQUE: &[Unit] = &[unit("N·m", 1.0), unit("µN·m", 1e-6)];
const NONE: &[Unit] = &[unit("1", 1.0)];
const CURRENT_GAIN: &[Unit] = &[unit("V/A", 1.0)];
const SPEED_GAIN: &[Unit] = &[unit("A·s/deg", 1.0)];
const RATE: &[Unit] = &[unit("1/s", 1.0)];
const SPEED: &[Unit] = &[unit("mm/s", 1.0), unit("m/s", 1e3)];
const POWER: &[Unit] = &[unit("W", 1.0)];
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

/// What a head's file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadData {
    /// The head.
    pub head: ScanHead,
    /// The plate on which recipes are compared on this head.
    pub plate: SquarePlate,
    /// How fast the loops of X, Y and Z are tuned, where the file says so: times of the first maximum of current, speed and
    /// position, s.
    pub tuning: [Option<[f64; 3]>; 3],
}

/// Puts the figures of a motor's file, such as `meltpath identify` prints them, in place of those of a motor.
///
/// # Errors
/// [`HeadFileError`] with the place in the file.
pub fn parse_motor(text: &str, motor: &Galvanometer) -> Result<Galvanometer, HeadFileError> {
    let file: MotorFile = toml::from_str(text).map_err(|e| HeadFileError::Form(e.to_string()))?;
    let r = Reading { table: "motor" };
    let or = |key: &'static str, figure: &Option<Figure>, units: &[Unit], old: f64| match figure {
        Some(figure) => r.get(key, figure, units),
        None => Ok(old),
    };
    let mut out = motor.clone();
    out.resistance = or("resistance", &file.resistance, RESISTANCE, out.resistance)?;
    out.inductance = or("inductance", &file.inductance, INDUCTANCE, out.inductance)?;
    out.torque_constant = or(
        "torque_constant",
        &file.torque_constant,
        TORQUE_CONSTANT,
        out.torque_constant,
    )?;
    out.back_emf = or("back_emf", &file.back_emf, BACK_EMF, out.back_emf)?;
    out.inertia = or("inertia", &file.inertia, INERTIA, out.inertia)?;
    out.viscous = or("viscous", &file.viscous, VISCOUS, out.viscous)?;
    if let Friction::Coulomb { coulomb, bias } = &mut out.friction {
        *coulomb = or("coulomb", &file.coulomb, TORQUE, *coulomb)?;
        *bias = or("bias", &file.bias, TORQUE, *bias)?;
    }
    let rigid = out.torque_constant / out.inertia;
    if let Some(modes) = &file.mode {
        out.modes = modes
            .iter()
            .map(|m| mode(&r, m, rigid))
            .collect::<Result<_, _>>()?;
    } else {
        let before = motor.torque_constant / motor.inertia;
        for m in &mut out.modes {
            m.gain *= rigid / before;
        }
    }
    out.check()
        .map_err(|e| HeadFileError::Form(e.to_string()))?;
    Ok(out)
}

/// A mode whose gain is told over that of the rigid body, `rigid` rad/s² per A.
fn mode(r: &Reading, m: &ModeTable, rigid: f64) -> Result<Mode, HeadFileError> {
    Ok(Mode {
        omega: std::f64::consts::TAU * read!(r, m, frequency, HERTZ),
        damping: read!(r, m, damping, NONE),
        gain: read!(r, m, gain_ratio, NONE) * rigid,
    })
}

fn tuning(name: &str, axis: &AxisTable) -> Result<Option<[f64; 3]>, HeadFileError> {
    let Some(t) = &axis.tuning else {
        return Ok(None);
    };
    let r = Reading { table: name };
    Ok(Some([
        read!(r, t, current, TIME),
        read!(r, t, speed, TIME),
        read!(r, t, position, TIME),
    ]))
}

/// Reads a head's TOML text.
///
/// # Errors
/// [`HeadFileError`] with the place in the file.
pub fn parse_head(text: &str) -> Result<HeadData, HeadFileError> {
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
                projection: lenses.projection,
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
    let head = ScanHead {
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
    };
    let p = Reading { table: "plate" };
    let plate = SquarePlate {
        columns: read!(p, file.plate, columns, NONE).round() as u32,
        rows: read!(p, file.plate, rows, NONE).round() as u32,
        column_pitch: read!(p, file.plate, column_pitch, LENGTH),
        row_pitch: read!(p, file.plate, row_pitch, LENGTH),
        side: read!(p, file.plate, side, LENGTH),
        contour_distance: read!(p, file.plate, contour_distance, LENGTH),
        hatch: read!(p, file.plate, hatch, LENGTH),
        inset: read!(p, file.plate, inset, LENGTH),
    };
    let tuning = [
        tuning("x.tuning", &file.x)?,
        tuning("y.tuning", &file.y)?,
        file.z
            .as_ref()
            .map_or(Ok(None), |z| tuning("z.tuning", z))?,
    ];
    Ok(HeadData {
        head,
        plate,
        tuning,
    })
}

/// Reads a recipe's TOML text.
///
/// # Errors
/// [`HeadFileError`] with the place in the file.
pub fn parse_recipe(text: &str) -> Result<Recipe, HeadFileError> {
    let file: RecipeFile = toml::from_str(text).map_err(|e| HeadFileError::Form(e.to_string()))?;
    let r = Reading { table: "recipe" };
    let power = read!(r, file, power, POWER);
    let or_zero = |key, figure: &Option<Figure>| {
        figure
            .as_ref()
            .map_or(Ok(0.0), |figure| r.get(key, figure, TIME))
    };
    let (run_in, run_out) = (
        or_zero("run_in", &file.run_in)?,
        or_zero("run_out", &file.run_out)?,
    );
    Ok(Recipe {
        contour_speed: read!(r, file, contour_speed, SPEED),
        fill_speed: read!(r, file, fill_speed, SPEED),
        contour_jump_speed: read!(r, file, contour_jump_speed, SPEED),
        fill_jump_speed: read!(r, file, fill_jump_speed, SPEED),
        contour_power: power,
        fill_power: power,
        jump_wait: read!(r, file, jump_wait, TIME),
        mark_wait: read!(r, file, mark_wait, TIME),
        polygon_wait: read!(r, file, polygon_wait, TIME),
        delays: LaserDelays {
            on: read!(r, file, laser_on_delay, TIME),
            off: read!(r, file, laser_off_delay, TIME),
        },
        power_law: match &file.power_down_to {
            None => PowerLaw::Constant,
            Some(least) => PowerLaw::WithSpeed {
                least: r.get("power_down_to", least, POWER)?,
            },
        },
        sky_writing: (file.run_in.is_some() || file.run_out.is_some())
            .then_some(SkyWriting { run_in, run_out }),
        name: file.name,
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
            path_sign,
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
            path_sign: *path_sign,
        }),
    })
}

fn friction(r: &Reading, t: &AxisTable) -> Result<Friction, HeadFileError> {
    let coulomb = read!(r, t, coulomb, TORQUE);
    let bias = read!(r, t, bias, TORQUE);
    if t.friction.is_some() && bias != 0.0 {
        return Err(HeadFileError::Form(format!(
            "{}.bias is of the Coulomb law alone: write 0 N·m there, or leave out [{}.friction]",
            r.table, r.table
        )));
    }
    Ok(match &t.friction {
        None => Friction::Coulomb { coulomb, bias },
        Some(FrictionTable::Karnopp { stiction, rest }) => Friction::Karnopp {
            coulomb,
            stiction: r.get("friction.stiction", stiction, TORQUE)?,
            rest: r.get("friction.rest", rest, ANGULAR_SPEED)?,
        },
        Some(FrictionTable::Lugre {
            stiction,
            stribeck,
            stiffness,
            damping,
        }) => Friction::LuGre {
            coulomb,
            stiction: r.get("friction.stiction", stiction, TORQUE)?,
            stribeck: r.get("friction.stribeck", stribeck, ANGULAR_SPEED)?,
            stiffness: r.get("friction.stiffness", stiffness, STIFFNESS)?,
            damping: r.get("friction.damping", damping, VISCOUS)?,
        },
    })
}

fn read_axis(name: &str, t: &AxisTable) -> Result<Axis, HeadFileError> {
    let r = Reading { table: name };
    let kc = read!(r, t, torque_constant, TORQUE_CONSTANT);
    let inertia = read!(r, t, inertia, INERTIA);
    let mut modes = Vec::with_capacity(t.mode.len());
    for m in &t.mode {
        modes.push(mode(&r, m, kc / inertia)?);
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
            friction: friction(&r, t)?,
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
