//! Height maps and other fields over a plan grid as VTK image data.

use std::io::Write;

use super::VtkError;
use super::appended::{Document, Values, titled};
use crate::scene::{Grid, SceneError};

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

impl Field<'_> {
    fn len(&self) -> usize {
        match self.values {
            Values::Float32(v) => v.len(),
            Values::Float64(v) => v.len(),
            Values::Int64(v) => v.len(),
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
    if let Some(field) = fields.iter().find(|f| f.len() != cells) {
        return Err(VtkError::Scene(SceneError::Count {
            what: format!("\"{}\" of the height image", field.name),
            expected: cells,
            found: field.len(),
            element: "cell",
        }));
    }
    let extent = format!("0 {} 0 {} 0 0", grid.nx - 1, grid.ny - 1);
    let mut document = Document::new("ImageData");
    document.xml(&format!(
        "<ImageData WholeExtent=\"{extent}\" Origin=\"{} {} {z}\" Spacing=\"{2} {2} {2}\">\n<Piece Extent=\"{extent}\">\n<PointData>",
        grid.origin.x, grid.origin.y, grid.cell
    ));
    for field in fields {
        document.array(&titled(field.name, field.unit), field.values);
    }
    document.xml("</PointData>\n</Piece>");
    Ok(document.write(out)?)
}
