//! A head's file.

use crate::files::axis::{AxisTable, read_axis, tuning};
use crate::files::figure::Hertz;
use crate::files::friction::KnownDrag;
use crate::files::servo::{ServoTable, read_servos};
use crate::head::head_axis::HeadAxis;
use crate::head::scan_head::ScanHead;
use crate::optics::beam::GaussianBeam;
use crate::optics::focus::{FocusProjection, Lenses};
use crate::optics::geometry::{FTheta, Geometry, PathSign, ThreeAxis, TwoAxis};
use meltpath_base::number::significant;
use meltpath_base::settings::{
    self, Json, Kind, Node, Place, Problem, Problems, Reader, Sourced, Value,
};
use meltpath_base::{Angle, Length, Pure, Time, choice, table};

/// Largest radius of a waist that melts metal, mm: a beam of several millimetres leaves the lens.
const WIDEST: f64 = 2.0;
/// Wavelengths of lasers that melt metal or mark it, mm: from the ultraviolet to carbon dioxide and beyond.
const SHORTEST_WAVE: f64 = 1e-4;
/// The longest.
const LONGEST_WAVE: f64 = 0.02;

table! {
    /// A scan head: its mirrors, its optics, its axes, and the plate on which recipes are compared.
    pub struct HeadFile {
        /// The head.
        head: HeadTable => required;
        /// Where the mirrors stand.
        geometry: GeometryTable => required;
        /// The lenses of a dynamic focus, with the axis `z`.
        focus: FocusTable => none("no dynamic focus");
        /// The beam.
        beam: BeamTable => required;
        /// The plate of squares on which recipes are compared.
        plate: PlateTable => none("3 x 3 squares over half of the field");
        /// Both mirrors' axes by their data sheet, where their motors are not known.
        servo: ServoTable => none("the axes `x` and `y`");
        /// The axis of the X mirror.
        x: AxisTable => none("the head's `servo`");
        /// The axis of the Y mirror.
        y: AxisTable => none("the head's `servo`");
        /// The axis of the dynamic focus.
        z: AxisTable => none("no dynamic focus");
    }

    /// The head as a whole.
    pub struct HeadTable {
        /// Name in words.
        name: String => required;
        /// How often set-points are given.
        sampling: Sourced<Hertz> where positive => required;
        /// Side of the field.
        field: Sourced<Length> where positive => required;
        /// Points of the correction table along a side.
        table_points: usize where within(2.0, 4097.0) => none("no correction table: the exact relation");
        /// The longest laser-on and laser-off delay that its controller takes: delays are tuned up to it, recipes beyond it are refused.
        longest_laser_delay: Sourced<Time> where positive => none("not stated: 1.2 ms");
    }

    /// Two mirrors with perpendicular axes, the beam on both axes.
    pub struct TwoAxisTable {
        /// Which geometry.
        kind: GeometryKind => required;
        /// From the Y mirror's axis to the work plane.
        plane_distance: Sourced<Length> where positive => required;
        /// Between the mirrors.
        mirror_distance: Sourced<Length> where not_negative => required;
    }

    /// Mirrors before an F-theta objective whose distortion the head's controller corrects: the spot moves in proportion to the angles.
    pub struct FThetaTable {
        /// Which geometry.
        kind: GeometryKind => required;
        /// Focal length of the objective.
        focal_length: Sourced<Length> where positive => required;
    }

    /// Two mirrors whose axes lie off their surfaces, and two windows; the beam comes along +x at y = z = 0.
    pub struct ThreeAxisTable {
        /// Which geometry.
        kind: GeometryKind => required;
        /// Origin of the work plane, x.
        plane_x: Sourced<Length> => required;
        /// Origin of the work plane, y.
        plane_y: Sourced<Length> => required;
        /// Origin of the work plane, z: negative.
        plane_z: Sourced<Length> => required;
        /// Axis of the X mirror, x.
        x_axis_x: Sourced<Length> => required;
        /// Axis of the X mirror, y.
        x_axis_y: Sourced<Length> => required;
        /// Angle of the X mirror at rest.
        x_rest: Sourced<Angle> => required;
        /// Tilt of the X mirror's axis.
        x_tilt: Sourced<Angle> => required;
        /// Axis of the Y mirror, y.
        y_axis_y: Sourced<Length> => required;
        /// Axis of the Y mirror, z.
        y_axis_z: Sourced<Length> => required;
        /// Angle of the Y mirror at rest.
        y_rest: Sourced<Angle> => required;
        /// From a mirror's axis to its surface.
        mirror_offset: Sourced<Length> => required;
        /// Thickness of a window.
        window: Sourced<Length> where not_negative => required;
        /// Refractive index of the atmosphere.
        atmosphere_index: Sourced<Pure> where positive => required;
        /// Refractive index of the windows.
        window_index: Sourced<Pure> where positive => required;
        /// Where the objective stands along the beam.
        objective: Sourced<Length> => required;
        /// The sign of K1 tan 2θx in eq. 2.39.
        path_sign: PathSign => default("traced", "as ray tracing shows");
    }

    /// The lens pair of a dynamic focus and its cam.
    pub struct FocusTable {
        /// Image focal length of the fixed objective.
        objective: Sourced<Length> where positive => required;
        /// Image focal length of the moving lens: negative.
        moving: Sourced<Length> => required;
        /// Radius of the cam.
        cam_radius: Sourced<Length> where positive => required;
        /// How a distance along the ray becomes a height.
        projection: FocusProjection => default("exact", "by the ray's vertical component");
    }

    /// The beam.
    pub struct BeamTable {
        /// Radius of the waist.
        waist: Sourced<Length> where up_to(WIDEST) => required;
        /// Wavelength.
        wavelength: Sourced<Length> where within(SHORTEST_WAVE, LONGEST_WAVE) => required;
        /// Beam quality M².
        quality: Sourced<Pure> where within(1.0, 1000.0) => required;
    }

    /// The plate of squares on which recipes are compared.
    pub struct PlateTable {
        /// Squares in a row.
        columns: Sourced<Pure> where within(1.0, 1e4) => required;
        /// Rows.
        rows: Sourced<Pure> where within(1.0, 1e4) => required;
        /// From square to square along a row.
        column_pitch: Sourced<Length> where positive => required;
        /// From row to row.
        row_pitch: Sourced<Length> where positive => required;
        /// Side of a square.
        side: Sourced<Length> where positive => required;
        /// From the outer to the inner contour.
        contour_distance: Sourced<Length> where not_negative => required;
        /// From hatch line to hatch line.
        hatch: Sourced<Length> where positive => required;
        /// From the outer contour to the ends of the hatch lines.
        inset: Sourced<Length> where not_negative => required;
    }
}

choice! {
    /// Arrangements of the mirrors.
    pub enum GeometryKind {
        TwoAxis "two-axis" => "Two mirrors, the beam on both axes.",
        FTheta "f-theta" => "An F-theta objective, corrected.",
        ThreeAxis "three-axis" => "Mirrors off their axes, and windows: with a dynamic focus.",
    }
}

/// Where the mirrors stand.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "read once and taken apart")]
pub enum GeometryTable {
    /// Two mirrors.
    TwoAxis(TwoAxisTable),
    /// An objective.
    FTheta(FThetaTable),
    /// With windows.
    ThreeAxis(ThreeAxisTable),
}

impl Value for GeometryTable {
    const KIND: Kind = Kind::OneOf {
        by: "kind",
        tables: &[
            ("two-axis", TwoAxisTable::KIND),
            ("f-theta", FThetaTable::KIND),
            ("three-axis", ThreeAxisTable::KIND),
        ],
    };

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        match reader.chosen(node, place, "kind")? {
            GeometryKind::TwoAxis => TwoAxisTable::read(node, place, reader).map(Self::TwoAxis),
            GeometryKind::FTheta => FThetaTable::read(node, place, reader).map(Self::FTheta),
            GeometryKind::ThreeAxis => {
                ThreeAxisTable::read(node, place, reader).map(Self::ThreeAxis)
            }
        }
    }

    fn json(&self) -> Json {
        Json::Null
    }
}

/// What a head's file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadData {
    /// The head.
    pub head: ScanHead,
    /// The plate on which recipes are compared on this head.
    pub plate: PlateTable,
    /// How fast the loops of X, Y and Z are tuned, where the file says so: times of the first maximum of current, speed and
    /// position, s.
    pub tuning: [Option<[f64; 3]>; 3],
    /// What the motors of X, Y and Z leave of the records that they were identified from, over the records' noise, where the file says so.
    pub misfits: [Option<f64>; 3],
    /// How well the friction of X, Y and Z is known; nothing where their motors are not.
    pub drag: [KnownDrag; 3],
    /// The dotted names of what else is a guess by its own source.
    pub guesses: Vec<String>,
}

/// Optical angle to either side beyond which no F-theta objective is taken for one, rad.
const WIDEST_FIELD: f64 = std::f64::consts::FRAC_PI_4;

/// What is wrong between the keys of a head's file.
fn between_keys(file: &HeadFile) -> Vec<Problem> {
    let missing = match (&*file.focus, &*file.z) {
        (Some(_), None) => Some((&file.focus.span, "z")),
        (None, Some(_)) => Some((&file.z.span, "focus")),
        _ => None,
    };
    let focus = missing.map(|(span, table)| {
        let problem = Problem::new("a dynamic focus needs both tables [focus] and [z]");
        problem.help(format!("add [{table}]")).at(span.clone())
    });
    let written = Option::<std::ops::Range<usize>>::is_some;
    let axes = match (&*file.servo, &*file.x, &*file.y) {
        (None, Some(_), Some(_)) => None,
        (Some(_), None, None) if file.z.is_none() => None,
        (Some(_), ..) => Some(
            Problem::new("the axes stand in [servo], and with their motors in [x], [y] or [z]")
                .help("leave out one of the two")
                .at(file.servo.span.clone()),
        ),
        // written, and refused for what stands in them
        (None, ..)
            if written(&file.servo.span) || written(&file.x.span) && written(&file.y.span) =>
        {
            None
        }
        (None, ..) => Some(
            Problem::new("the axes of the mirrors are missing")
                .help("write [x] and [y] with their motors, or [servo] by the data sheet"),
        ),
    };
    let wide = match &*file.geometry {
        GeometryTable::FTheta(g) => {
            let angle = 0.5 * file.head.field.0 / g.focal_length.0;
            (angle > WIDEST_FIELD).then(|| {
                let said = format!(
                    "half the field of {} mm over the focal length of {} mm is an optical angle of {:.0} deg",
                    significant(file.head.field.0, 4),
                    significant(g.focal_length.0, 4),
                    angle.to_degrees()
                );
                file.head.field.problem(said).help(
                    "an F-theta objective bends the beam by some 20 to 30 deg to either side: read field and focal_length again",
                )
            })
        }
        _ => None,
    };
    [&file.x, &file.y]
        .into_iter()
        .filter_map(|axis| axis.as_ref()?.friction_keys().check())
        .chain(wide)
        .chain(focus)
        .chain(axes)
        .collect()
}

/// Reads a head's TOML text.
///
/// # Errors
/// Everything wrong, with its place in the file.
pub fn parse_head(text: &str) -> Result<HeadData, Problems> {
    let file = settings::parse(text, between_keys)?;
    let focus = file
        .focus
        .as_ref()
        .zip(file.z.as_ref())
        .map(|(lenses, axis)| {
            let lenses = Lenses {
                objective: lenses.objective.0,
                moving: lenses.moving.0,
                cam_radius: lenses.cam_radius.0,
                rest_angle: 0.0,
                projection: *lenses.projection,
            };
            (read_axis(axis).into(), lenses)
        });
    let geometry = geometry(&file.geometry);
    let period = 1.0 / file.head.sampling.0;
    let half_field = 0.5 * file.head.field.0;
    let mirrors = match (&*file.servo, &*file.x, &*file.y) {
        (Some(servo), ..) => {
            read_servos(servo, &geometry, half_field, period)?.map(HeadAxis::Servo)
        }
        (None, Some(x), Some(y)) => [x, y].map(|axis| read_axis(axis).into()),
        // refused between the keys
        (None, ..) => return Err(Problem::new("the axes of the mirrors are missing").into()),
    };
    let head = ScanHead {
        name: file.head.value.name.value.clone(),
        period,
        geometry,
        mirrors,
        focus,
        half_field,
        table: *file.head.table_points,
        left_out: file
            .servo
            .as_ref()
            .map(|s| s.left_out.as_ref().map(|l| l.0)),
        longest_delay: file.head.longest_laser_delay.as_ref().map(|t| t.0),
        beam: GaussianBeam {
            waist: file.beam.waist.0,
            wavelength: file.beam.wavelength.0,
            quality: file.beam.quality.0,
        },
    };
    Ok(HeadData {
        head,
        plate: match &*file.plate {
            Some(plate) => plate.clone(),
            None => usual_plate(half_field)?,
        },
        tuning: [&file.x, &file.y, &file.z].map(|axis| axis.as_ref().and_then(tuning)),
        misfits: [&file.x, &file.y, &file.z]
            .map(|axis| axis.as_ref().and_then(|t| Some(t.misfit.as_ref()?.0))),
        drag: [&file.x, &file.y, &file.z]
            .map(|axis| axis.as_ref().map(|t| t.friction_keys().known()))
            .map(Option::unwrap_or_default),
        guesses: file
            .servo
            .as_ref()
            .into_iter()
            .filter_map(crate::files::servo::guesses)
            .collect(),
    })
}

/// The plate of a head whose file states none: squares on which recipes are compared, over half of the field.
fn usual_plate(half_field: f64) -> Result<PlateTable, Problems> {
    let side = (half_field / 4.0).min(10.0);
    let pitch = 0.5 * (half_field - side);
    let of = |key: &str, value: String| {
        format!("{key} = {{ value = \"{value}\", source = \"choice: half of the field\" }}\n")
    };
    let text = [
        of("columns", "3 1".to_owned()),
        of("rows", "3 1".to_owned()),
        of("column_pitch", format!("{pitch} mm")),
        of("row_pitch", format!("{pitch} mm")),
        of("side", format!("{side} mm")),
        of("contour_distance", "0.1 mm".to_owned()),
        of("hatch", "0.1 mm".to_owned()),
        of("inset", "0.1 mm".to_owned()),
    ];
    settings::parse(&text.concat(), |_: &PlateTable| Vec::new())
}

fn geometry(table: &GeometryTable) -> Geometry {
    match table {
        GeometryTable::TwoAxis(g) => Geometry::TwoAxis(TwoAxis {
            plane_distance: g.plane_distance.0,
            mirror_distance: g.mirror_distance.0,
        }),
        GeometryTable::FTheta(g) => Geometry::FTheta(FTheta {
            focal_length: g.focal_length.0,
        }),
        GeometryTable::ThreeAxis(g) => Geometry::ThreeAxis(ThreeAxis {
            plane: [g.plane_x.0, g.plane_y.0, g.plane_z.0],
            x_axis: [g.x_axis_x.0, g.x_axis_y.0],
            x_rest: g.x_rest.0,
            x_tilt: g.x_tilt.0,
            y_axis: [g.y_axis_y.0, g.y_axis_z.0],
            y_rest: g.y_rest.0,
            mirror_offset: g.mirror_offset.0,
            window: g.window.0,
            atmosphere_index: g.atmosphere_index.0,
            window_index: g.window_index.0,
            objective: g.objective.0,
            path_sign: *g.path_sign,
        }),
    }
}
