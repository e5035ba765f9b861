//! Height maps, other fields over a plan grid, and volumes of cells as VTK image data.

use std::io::Write;

use meltpath_geometry::math::DVec3;

use super::VtkError;
use super::appended::{Document, Values};
use crate::scene::{Grid, SceneError};
use crate::series::name_in_files;

/// A field over the cells of a grid.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Name, such as `height`.
    pub name: &'a str,
    /// Unit as written for people; empty when the value has none.
    pub unit: &'a str,
    /// One value per cell, row-major; NaN where there is none.
    pub values: Values<'a>,
}

impl<'a> Field<'a> {
    /// A field of numbers.
    pub fn floats(name: &'a str, unit: &'a str, values: &'a [f32]) -> Self {
        let values = Values::Float32(values);
        Field { name, unit, values }
    }

    fn len(&self) -> usize {
        match self.values {
            Values::Float32(v) => v.len(),
            Values::Float64(v) => v.len(),
            Values::Int64(v) => v.len(),
            Values::UInt8(v) => v.len(),
            Values::Points(v) => v.len(),
        }
    }
}

/// Writes fields over a plan grid as `.vti`: the centres of the cells are the points of the image, at height `z`, mm.
/// In ParaView, *Warp By Scalar* on the height shows the surface.
///
/// # Errors
/// [`VtkError::Scene`] before anything is written when a field does not match the grid; [`VtkError::Io`] when the
/// system refuses.
pub fn write_height_image(
    out: &mut dyn Write,
    grid: &Grid,
    z: f64,
    fields: &[Field<'_>],
) -> Result<(), VtkError> {
    if grid.nx < 1 || grid.ny < 1 || !(grid.cell > 0.0 && grid.cell.is_finite()) {
        return Err(VtkError::Scene(SceneError::Grid {
            nx: grid.nx,
            ny: grid.ny,
            cell: grid.cell.to_string(),
        }));
    }
    let cells = grid.nx.saturating_mul(grid.ny);
    check(fields, cells, "height image")?;
    let extent = format!("0 {} 0 {} 0 0", grid.nx - 1, grid.ny - 1);
    let origin = grid.origin.extend(z);
    let spacing = DVec3::splat(grid.cell);
    image(out, (&extent, origin, spacing), "PointData", fields)
}

/// A grid of equal cells in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// Its lowest corner, mm.
    pub origin: DVec3,
    /// Edges of a cell, mm.
    pub spacing: DVec3,
    /// Cells along x, y, z.
    pub cells: [usize; 3],
}

/// Writes fields over the cells of a volume as `.vti`, x fastest, then y, then z; mm. In ParaView, *Slice* and *Threshold*
/// show sections and classes.
///
/// # Errors
/// [`VtkError::Scene`] before anything is written when the volume has no cells or a field does not match it;
/// [`VtkError::Io`] when the system refuses.
pub fn write_volume(
    out: &mut dyn Write,
    volume: &Volume,
    fields: &[Field<'_>],
) -> Result<(), VtkError> {
    let [nx, ny, nz] = volume.cells;
    let edge = volume.spacing;
    if nx < 1 || ny < 1 || nz < 1 || !(edge.min_element() > 0.0 && edge.is_finite()) {
        return Err(VtkError::Scene(SceneError::Grid {
            nx,
            ny,
            cell: format!("{} x {} x {}", edge.x, edge.y, edge.z),
        }));
    }
    let cells = nx.saturating_mul(ny).saturating_mul(nz);
    check(fields, cells, "volume")?;
    let extent = format!("0 {nx} 0 {ny} 0 {nz}");
    image(out, (&extent, volume.origin, edge), "CellData", fields)
}

/// Writes fields `of` the points or the cells of an image: its extent, where it begins and how far its points are apart, mm.
fn image(
    out: &mut dyn Write,
    (extent, origin, spacing): (&str, DVec3, DVec3),
    of: &str,
    fields: &[Field<'_>],
) -> Result<(), VtkError> {
    let mut document = Document::new("ImageData");
    let three = |v: DVec3| format!("{} {} {}", v.x, v.y, v.z);
    document.xml(&format!(
        "<ImageData WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\">\n<Piece Extent=\"{extent}\">\n<{of}>",
        three(origin),
        three(spacing)
    ));
    for field in fields {
        document.array(&name_in_files(field.name, field.unit), field.values);
    }
    document.xml(&format!("</{of}>\n</Piece>"));
    Ok(document.write(out)?)
}

fn check(fields: &[Field<'_>], cells: usize, of: &str) -> Result<(), VtkError> {
    match fields.iter().find(|f| f.len() != cells) {
        Some(field) => Err(VtkError::Scene(SceneError::Count {
            what: format!("\"{}\" of the {of}", field.name),
            expected: cells,
            found: field.len(),
            element: "cell",
        })),
        None => Ok(()),
    }
}
