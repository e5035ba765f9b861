//! Lines as VTK polygonal data.

#![expect(
    clippy::cast_possible_wrap,
    reason = "VTK's indices are signed; counts of what is in memory are far below 2^63"
)]

use std::io::Write;

use super::VtkError;
use super::appended::{Document, Values};
use crate::scene::{LineSet, Scalar};
use crate::series::name_in_files;

/// Writes polylines with their layer (cell data) and scalars (point data) as `.vtp`; mm.
///
/// A polyline of one point stays, as ParaView keeps it.
///
/// # Errors
/// [`VtkError::Scene`] before anything is written; [`VtkError::Io`] when the system refuses.
pub fn write_lines(out: &mut dyn Write, set: &LineSet) -> Result<(), VtkError> {
    set.check()?;
    let connectivity: Vec<i64> = (0..set.points.len() as i64).collect();
    let ends = set.polylines.iter().skip(1).map(|p| p.first as i64);
    let offsets: Vec<i64> = ends
        .chain((!set.polylines.is_empty()).then_some(set.points.len() as i64))
        .collect();
    let layers: Vec<i64> = set.polylines.iter().map(|p| i64::from(p.layer)).collect();
    let mut document = Document::new("PolyData");
    document.xml("<PolyData>");
    document.xml(&format!(
        "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">",
        set.points.len(),
        set.polylines.len()
    ));
    point_data(&mut document, &set.scalars);
    document.xml("<CellData>");
    document.array("layer", Values::Int64(&layers));
    document.xml("</CellData>\n<Points>");
    document.array("Points", Values::Points(&set.points));
    document.xml("</Points>\n<Lines>");
    document.array("connectivity", Values::Int64(&connectivity));
    document.array("offsets", Values::Int64(&offsets));
    document.xml("</Lines>\n</Piece>");
    Ok(document.write(out)?)
}

fn point_data<'a>(document: &mut Document<'a>, scalars: &'a [Scalar]) {
    document.xml("<PointData>");
    for scalar in scalars {
        document.array(
            &name_in_files(&scalar.name, &scalar.unit),
            Values::Float32(&scalar.values),
        );
    }
    document.xml("</PointData>");
}
