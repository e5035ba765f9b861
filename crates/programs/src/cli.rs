//! The common layer interface (CLI) of powder-bed machines: layers of polylines and hatches, as text or binary.
//!
//! Source: "Common Layer Interface (CLI), version 2.0", Brite-EuRam BE2578. Lengths are mm in memory; files count in their own
//! unit. Aligned binary files (`$$ALIGN`) are refused.

mod ascii;
mod binary;

use std::fmt::Write as _;

use meltpath_geometry::math::DVec2;
use meltpath_toolpath::{Pass, PassId, Profile, Role, Tag, Toolpath};

pub use ascii::write_ascii;
pub use binary::write_binary;

/// Why a layer file cannot be read or written.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CliError {
    /// A part of the header is missing or wrong.
    #[error("the header of the layer file: {what}")]
    Header {
        /// What is wrong.
        what: String,
    },
    /// Something in the text of the geometry.
    #[error("line {line} of the layer file: {what}")]
    Text {
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// Something in the binary geometry.
    #[error("byte {byte} of the layer file: {what}")]
    Binary {
        /// The byte, from 0.
        byte: usize,
        /// What is wrong.
        what: String,
    },
    /// A number that the form cannot hold.
    #[error("{what} is {value}, which a layer file cannot hold")]
    Value {
        /// Which number.
        what: &'static str,
        /// That number.
        value: f64,
    },
}

/// Which side of a polyline the solid lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Clockwise: an inner contour.
    Inner,
    /// Counter-clockwise: an outer contour.
    Outer,
    /// An open line.
    Open,
}

impl Direction {
    fn code(self) -> u8 {
        match self {
            Direction::Inner => 0,
            Direction::Outer => 1,
            Direction::Open => 2,
        }
    }

    fn from_code(code: f64) -> Option<Self> {
        [Direction::Inner, Direction::Outer, Direction::Open]
            .into_iter()
            .find(|d| f64::from(d.code()) == code)
    }
}

/// Something in a layer.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A contour or open line.
    Polyline {
        /// The part it belongs to.
        part: u32,
        /// Its direction.
        direction: Direction,
        /// Its points, mm; the last equals the first where it is closed.
        points: Vec<DVec2>,
    },
    /// Hatch lines.
    Hatches {
        /// The part they belong to.
        part: u32,
        /// Start and end of each, mm.
        lines: Vec<[DVec2; 2]>,
    },
}

/// A layer.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layer {
    /// Height of its top, mm.
    pub height: f64,
    /// What it holds, in order.
    pub items: Vec<Item>,
}

/// A layer file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerFile {
    /// Names of parts.
    pub labels: Vec<(u32, String)>,
    /// The layers, lowest first.
    pub layers: Vec<Layer>,
}

/// Reads a layer file, text or binary.
///
/// # Errors
/// [`CliError`] with the place.
///
/// ```
/// let text = "$$HEADERSTART\n$$ASCII\n$$UNITS/0.01\n$$VERSION/200\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/5.0\n\
///     $$HATCHES/1,1,0,0,100,50\n$$GEOMETRYEND\n";
/// let file = meltpath_programs::cli::parse(text.as_bytes()).unwrap();
/// assert_eq!(file.layers[0].height, 0.05);
/// ```
pub fn parse(bytes: &[u8]) -> Result<LayerFile, CliError> {
    const END: &[u8] = b"$$HEADEREND";
    let header = |what: &str| CliError::Header {
        what: what.to_owned(),
    };
    let at = bytes
        .windows(END.len())
        .position(|w| w == END)
        .ok_or_else(|| header("$$HEADEREND is missing: this is no layer file"))?;
    let (head, rest) = bytes.split_at(at);
    let head: String = head.iter().map(|&b| char::from(b)).collect();
    let body = &rest[END.len()..];
    let (mut unit, mut form, mut labels) = (None, None, Vec::new());
    for command in ascii::commands(&head) {
        let (name, arguments) = command.split();
        match name {
            "UNITS" => {
                let u: f64 = arguments
                    .parse()
                    .map_err(|_| header("$$UNITS is no number"))?;
                if !(u > 0.0 && u.is_finite()) {
                    return Err(header("$$UNITS must be above zero"));
                }
                unit = Some(u);
            }
            "ASCII" => form = Some(Form::Ascii),
            "BINARY" => form = Some(Form::Binary),
            "ALIGN" => {
                return Err(header(
                    "$$ALIGN: aligned files are not read; export without alignment",
                ));
            }
            "LABEL" => {
                let label = arguments.split_once(',').and_then(|(id, name)| {
                    Some((
                        id.trim().parse().ok()?,
                        name.trim().trim_matches('"').to_owned(),
                    ))
                });
                labels.push(label.ok_or_else(|| header("a $$LABEL is not \"number,name\""))?);
            }
            _ => {}
        }
    }
    let unit = unit.ok_or_else(|| header("$$UNITS is missing"))?;
    let layers = match form {
        Some(Form::Ascii) => {
            let lines_before = head.matches('\n').count();
            let text: String = body.iter().map(|&b| char::from(b)).collect();
            ascii::geometry(&text, unit, lines_before)?
        }
        Some(Form::Binary) => binary::geometry(body, unit, at + END.len())?,
        None => return Err(header("neither $$ASCII nor $$BINARY is written")),
    };
    Ok(LayerFile { labels, layers })
}

enum Form {
    Ascii,
    Binary,
}

/// The header common to both forms.
fn header(file: &LayerFile, form: &str) -> String {
    let mut text = format!("$$HEADERSTART\n$${form}\n$$UNITS/1\n$$VERSION/200\n");
    for (id, name) in &file.labels {
        // a comma, a line end or a dollar would not be read back
        let name: String = name
            .chars()
            .filter(|c| !c.is_control() && !"$,\"/".contains(*c))
            .collect();
        // writing into a string does not fail
        let _ = writeln!(text, "$$LABEL/{id},{}", name.trim());
    }
    let _ = write!(text, "$$LAYERS/{}\n$$HEADEREND", file.layers.len());
    text
}

/// Every coordinate must be finite.
fn finite(file: &LayerFile) -> Result<(), CliError> {
    for layer in &file.layers {
        let points = layer.items.iter().flat_map(|item| match item {
            Item::Polyline { points, .. } => points.clone(),
            Item::Hatches { lines, .. } => lines.iter().flatten().copied().collect(),
        });
        for value in points.flat_map(|p| p.to_array()).chain([layer.height]) {
            if !value.is_finite() {
                return Err(CliError::Value {
                    what: "a coordinate",
                    value,
                });
            }
        }
    }
    Ok(())
}

impl LayerFile {
    /// The layers as passes: contours and open lines by their role, every hatch line a pass of its own.
    pub fn to_toolpath(&self, contour: Profile, fill: Profile) -> Toolpath {
        let mut toolpath = Toolpath {
            profiles: vec![contour, fill],
            passes: Vec::new(),
        };
        for (number, layer) in self.layers.iter().enumerate() {
            for item in &layer.items {
                let mut push = |part: u32, role: Role, points: &[DVec2]| {
                    let tag = Tag {
                        part,
                        layer: number as u32 + 1,
                        entity: 0,
                    };
                    let id = PassId(toolpath.passes.len() as u32);
                    let points = points.iter().map(|p| p.extend(layer.height)).collect();
                    let mut pass = Pass::polyline(id, role, tag, points);
                    pass.profile = u32::from(role == Role::Fill);
                    toolpath.passes.push(pass);
                };
                match item {
                    Item::Polyline { part, points, .. } => push(*part, Role::Contour, points),
                    Item::Hatches { part, lines } => {
                        for line in lines {
                            push(*part, Role::Fill, line);
                        }
                    }
                }
            }
        }
        toolpath
    }
}
