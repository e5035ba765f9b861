//! Vector lists written layer by layer.

use std::collections::BTreeSet;
use std::io::{self, Write};

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Channel, Layer, Move, Pass, PassPlace, Role};

use super::words::{COLUMNS, START};

/// Distance between an arc and the vectors in its place, mm.
const CHORD_ERROR: f64 = 5e-4;

/// Why a layer cannot be written as a vector list.
#[derive(Debug, thiserror::Error)]
pub enum VectorWriteError {
    /// The system refused.
    #[error("the vector list cannot be written: {0}")]
    Io(#[from] io::Error),
    /// A spot is no vector.
    #[error("{pass} stays on spots, which a vector list cannot hold")]
    Spot {
        /// The pass.
        pass: PassPlace,
    },
    /// The vectors of a layer must follow one another.
    #[error("layer {layer} comes again: a vector list holds each layer once; number it anew")]
    Again {
        /// The layer.
        layer: u32,
    },
}

/// The word of a role: what deposits elsewhere than along a contour is a fill, what does not is a jump.
fn word(role: Role) -> &'static str {
    match role {
        Role::Contour | Role::Skin => "contour",
        Role::Fill | Role::Support => "fill",
        Role::Jump | Role::Travel => "jump",
        Role::Connection => "connection",
        Role::Run => "run",
    }
}

/// Writes a vector list layer by layer, with every column. Arcs become vectors that stay within half a micrometre of them; what
/// the list has no column for is left out.
#[derive(Debug)]
pub struct Writer<W> {
    to: W,
    seen: BTreeSet<u32>,
}

impl<W: Write> Writer<W> {
    /// Writes the heading.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(mut to: W) -> io::Result<Self> {
        writeln!(to, "{}", COLUMNS.join(","))?;
        let seen = BTreeSet::new();
        Ok(Writer { to, seen })
    }

    /// Writes a layer; nothing where it has no pass.
    ///
    /// # Errors
    /// [`VectorWriteError`].
    pub fn layer(&mut self, layer: &Layer) -> Result<(), VectorWriteError> {
        let Some(first) = layer.get(0) else {
            return Ok(());
        };
        if !self.seen.insert(layer.number) {
            let layer = layer.number;
            return Err(VectorWriteError::Again { layer });
        }
        let mut at = first.points[0];
        let stands = first.head.role == Role::Jump && first.points.get(1) == Some(&at);
        let values = |channel| first.value(channel, 0).filter(|_| stands);
        let values = [Channel::Speed, Channel::Power, Channel::Dwell].map(values);
        self.row(START, at, values, first.head.part, layer)?;
        for (number, pass) in layer.passes().enumerate() {
            if pass.points[0] != at {
                self.row("jump", pass.points[0], [None; 3], pass.head.part, layer)?;
            }
            let done = usize::from(stands && number == 0);
            self.moves(&pass, done, layer)?;
            at = pass.points[pass.move_count()];
        }
        Ok(())
    }

    /// The moves of a pass from number `first` on.
    fn moves(
        &mut self,
        pass: &Pass<'_>,
        first: usize,
        layer: &Layer,
    ) -> Result<(), VectorWriteError> {
        let (word, part) = (word(pass.head.role), pass.head.part);
        for i in first..pass.move_count() {
            if let Move::Spot { .. } = pass.move_at(i) {
                return Err(VectorWriteError::Spot { pass: pass.place() });
            }
            let [speed, power, wait] = [Channel::Speed, Channel::Power, Channel::Dwell]
                .map(|channel| pass.value(channel, i));
            if let Some(arc) = pass.arc(i) {
                let n = arc.chords(CHORD_ERROR);
                for k in 1..n {
                    let on = arc.at(k as f64 / n as f64);
                    self.row(word, on, [speed, power, None], part, layer)?;
                }
            }
            self.row(word, pass.points[i + 1], [speed, power, wait], part, layer)?;
        }
        Ok(())
    }

    fn row(
        &mut self,
        word: &str,
        end: DVec3,
        values: [Option<f64>; 3],
        part: u32,
        layer: &Layer,
    ) -> io::Result<()> {
        let [speed, power, wait] = values.map(|v| v.map_or_else(String::new, |v| v.to_string()));
        writeln!(
            self.to,
            "{word},{},{},{},{speed},{power},{wait},{part},{},{}",
            end.x, end.y, end.z, layer.number, layer.height
        )
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// What the writer says.
    pub fn finish(mut self) -> io::Result<()> {
        self.to.flush()
    }
}
