//! A layer laid out in a plane, its pieces side by side.

use meltpath_geometry::flatten::Flat;
use meltpath_geometry::level::pieces;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::{Mesh, Region};

use super::error::OntoError;

/// A layer laid out in a plane.
pub(super) struct LaidOut {
    pub(super) number: u32,
    pub(super) area: f64,
    pub(super) pieces: Vec<Piece>,
}

/// A piece of a layer, and where the plane has it.
pub(super) struct Piece {
    pub(super) flat: Flat,
    pub(super) shift: DVec2,
}

/// The pieces of a layer side by side in a plane.
pub(super) fn laid_out_in_a_plane(
    number: u32,
    sheet: &Mesh,
    width: f64,
) -> Result<LaidOut, OntoError> {
    let mut laid = Vec::new();
    let mut edge: Option<f64> = None;
    for piece in pieces(sheet) {
        let flat = Flat::new(&piece).map_err(|source| OntoError::Flatten { number, source })?;
        let (low, high) = flat.bounds();
        // the first lies as it is seen, the others well apart from it
        let shift = edge.map_or(0.0, |edge| edge + 4.0 * width - low.x);
        edge = Some(high.x + shift);
        laid.push(Piece {
            flat,
            shift: DVec2::new(shift, 0.0),
        });
    }
    Ok(LaidOut {
        number,
        area: sheet.area(),
        pieces: laid,
    })
}

impl LaidOut {
    pub(super) fn regions(&self) -> Vec<Region> {
        let shifted = |piece: &Piece| {
            let Region {
                mut outer,
                mut holes,
            } = piece.flat.region();
            for p in outer.iter_mut().chain(holes.iter_mut().flatten()) {
                *p += piece.shift;
            }
            Region { outer, holes }
        };
        self.pieces.iter().map(shifted).collect()
    }

    /// Distances on the layer over those in the plane.
    pub(super) fn stretch(&self) -> [(f64, DVec3); 2] {
        let all = self.pieces.iter().map(|p| p.flat.stretch());
        let first = [(f64::INFINITY, DVec3::ZERO), (0.0, DVec3::ZERO)];
        all.fold(first, |[least, greatest], [shrunk, grown]| {
            let (close, wide) = ((1.0 / grown.0, grown.1), (1.0 / shrunk.0, shrunk.1));
            [
                if close.0 < least.0 { close } else { least },
                if wide.0 > greatest.0 { wide } else { greatest },
            ]
        })
    }
}
