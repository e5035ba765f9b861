//! Focus calibrations that ship, from `meltpath_data::focus`.

use meltpath_base::quantity::QuantityError;
use meltpath_base::{Length, quantity};
use meltpath_data::{find, focus, names};
use meltpath_gun::focus::{FocusCalibration, FocusError, FocusPiece};
use serde::Deserialize;

/// Why a calibration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FocusFileError {
    /// None of that name.
    #[error("there is no focus calibration \"{name}\"; known are {known}")]
    Unknown {
        /// What was asked.
        name: String,
        /// What ships.
        known: String,
    },
    /// Not TOML, or an unknown key.
    #[error("the focus calibration does not read: {0}")]
    Syntax(#[from] toml::de::Error),
    /// A value without its unit.
    #[error("the focus calibration: {0}")]
    Quantity(#[from] QuantityError),
    /// Pieces that do not follow each other.
    #[error(transparent)]
    Pieces(#[from] FocusError),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[expect(dead_code, reason = "read to be required")]
    schema: u32,
    name: String,
    source: String,
    #[expect(dead_code, reason = "for the reader of the file")]
    uncertainty: String,
    piece: Vec<Piece>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Piece {
    from: String,
    to: String,
    intercept: Length,
    slope: String,
}

const CURRENT: &[quantity::Unit] = &[
    quantity::Unit::new("mA", 1e-3),
    quantity::Unit::new("A", 1.0),
];
const SLOPE: &[quantity::Unit] = &[quantity::Unit::new("µm/mA", 1.0)];

/// The calibration `name` and where it comes from.
///
/// # Errors
/// [`FocusFileError`].
///
/// ```
/// let (focus, _) = meltpath::ebm::focus::builtin("a1-beraud-2016").unwrap();
/// assert!((focus.diameter(4e-3).unwrap() - 0.41367).abs() < 1e-9);
/// ```
pub fn builtin(name: &str) -> Result<(FocusCalibration, String), FocusFileError> {
    let shipped = find(focus::ALL, name).ok_or_else(|| FocusFileError::Unknown {
        name: name.to_owned(),
        known: names(focus::ALL),
    })?;
    let file: File = toml::from_str(shipped.text)?;
    let pieces = file
        .piece
        .iter()
        .map(|p| {
            Ok(FocusPiece {
                range: [
                    quantity::parse(&p.from, "current", CURRENT)?,
                    quantity::parse(&p.to, "current", CURRENT)?,
                ],
                intercept: p.intercept.0,
                // a µm per mA is a mm per A
                slope: quantity::parse(&p.slope, "slope", SLOPE)?,
            })
        })
        .collect::<Result<Vec<_>, FocusFileError>>()?;
    Ok((
        FocusCalibration::new(pieces)?,
        format!("{}: {}", file.name, file.source),
    ))
}
