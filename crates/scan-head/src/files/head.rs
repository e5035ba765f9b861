//! A head's file.

use crate::files::axis::{AxisTable, read_axis, tuning};
use crate::files::figure::{ANGLE, Figure, HERTZ, HeadFileError, LENGTH, NONE, Reading, read};
use crate::head::scan_head::ScanHead;
use crate::optics::beam::GaussianBeam;
use crate::optics::focus::{FocusProjection, Lenses};
use crate::optics::geometry::{Geometry, PathSign, ThreeAxis, TwoAxis};
use serde::Deserialize;

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

/// The plate of squares on which recipes are compared, as a head's file states it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// Squares in a row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
    /// From square to square along a row, mm.
    pub column_pitch: f64,
    /// From row to row, mm.
    pub row_pitch: f64,
    /// Side of a square, mm.
    pub side: f64,
    /// From the outer to the inner contour, mm.
    pub contour_distance: f64,
    /// From hatch line to hatch line, mm.
    pub hatch: f64,
    /// From the outer contour to the ends of the hatch lines, mm.
    pub inset: f64,
}

/// What a head's file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct HeadData {
    /// The head.
    pub head: ScanHead,
    /// The plate on which recipes are compared on this head.
    pub plate: Plate,
    /// How fast the loops of X, Y and Z are tuned, where the file says so: times of the first maximum of current, speed and
    /// position, s.
    pub tuning: [Option<[f64; 3]>; 3],
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
    let plate = Plate {
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
