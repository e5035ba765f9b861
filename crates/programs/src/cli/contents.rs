//! What layer files say, whatever their form, and what can be wrong with them.

use std::io;

use meltpath_geometry::math::DVec2;
use meltpath_geometry::region::signed_area;
use meltpath_toolpath::{Layer, PassHead, PassId, Role};

/// Why a layer file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The system refused.
    #[error("the layer file cannot be read or written: {0}")]
    Io(#[from] io::Error),
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

/// An error of the header.
pub(super) fn header_error(what: &str) -> CliError {
    CliError::Header {
        what: what.to_owned(),
    }
}

/// Which side of a polyline the solid lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    /// Clockwise: an inner contour.
    Inner,
    /// Counter-clockwise: an outer contour.
    Outer,
    /// An open line.
    Open,
}

impl Direction {
    pub(super) fn code(self) -> u8 {
        match self {
            Direction::Inner => 0,
            Direction::Outer => 1,
            Direction::Open => 2,
        }
    }

    /// Whether a file may say so: the direction itself follows from the points.
    pub(super) fn is_code(code: f64) -> bool {
        [Direction::Inner, Direction::Outer, Direction::Open]
            .into_iter()
            .any(|d| f64::from(d.code()) == code)
    }

    pub(super) fn of(points: &[DVec2]) -> Self {
        match points {
            [first, .., last] if first == last => {
                if signed_area(&points[..points.len() - 1]) > 0.0 {
                    Direction::Outer
                } else {
                    Direction::Inner
                }
            }
            _ => Direction::Open,
        }
    }
}

/// Puts what a file says into layers.
#[derive(Debug, Default)]
pub(super) struct Filling {
    pub(super) layer: Option<Layer>,
    layers: u32,
    passes: u32,
}

impl Filling {
    /// Begins a layer at `height` mm; gives back the one before.
    pub(super) fn begin(&mut self, height: f64) -> Option<Layer> {
        self.layers += 1;
        self.layer.replace(Layer::new(self.layers, height))
    }

    /// Layers that were begun.
    pub(super) fn count(&self) -> u32 {
        self.layers
    }

    fn line(&mut self, part: u32, role: Role, points: impl IntoIterator<Item = DVec2>) {
        let Some(layer) = &mut self.layer else {
            return;
        };
        let head = PassHead {
            id: PassId(self.passes),
            part,
            profile: u16::from(role == Role::Fill),
            role,
            ..PassHead::default()
        };
        let before = layer.len();
        layer.polyline(head, points.into_iter().map(|p| p.extend(0.0)));
        self.passes += (layer.len() - before) as u32;
    }

    /// A contour or open line.
    pub(super) fn polyline(&mut self, part: u32, points: Vec<DVec2>) {
        self.line(part, Role::Contour, points);
    }

    /// Hatch lines, from start to end each.
    pub(super) fn hatches(&mut self, part: u32, ends: &[DVec2]) {
        for &line in ends.as_chunks::<2>().0 {
            self.line(part, Role::Fill, line);
        }
    }
}

/// Something that a layer file says in one command.
pub(super) enum Item {
    Polyline(u32, Vec<DVec2>),
    Hatches(u32, Vec<DVec2>),
}
