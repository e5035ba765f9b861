//! The binary form: little-endian commands right after the header, short (16-bit units) or long (32-bit reals).

use std::io::{BufRead, ErrorKind, Write};

use meltpath_geometry::math::DVec2;
use meltpath_toolpath::Layer;

use super::contents::{CliError, Direction, Filling, Item};

const LAYER_LONG: u16 = 127;
const LAYER_SHORT: u16 = 128;
const POLYLINE_SHORT: u16 = 129;
const POLYLINE_LONG: u16 = 130;
const HATCHES_SHORT: u16 = 131;
const HATCHES_LONG: u16 = 132;

/// Walks through the bytes and knows where it stands.
#[derive(Debug)]
pub(super) struct Cursor<R> {
    from: R,
    at: usize,
}

impl<R: BufRead> Cursor<R> {
    /// Of bytes that begin at byte `at` of the file.
    pub(super) fn new(from: R, at: usize) -> Self {
        Cursor { from, at }
    }

    fn fail(&self, what: &str) -> CliError {
        CliError::Binary {
            byte: self.at,
            what: what.to_owned(),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], CliError> {
        let mut bytes = [0; N];
        self.from
            .read_exact(&mut bytes)
            .map_err(|e| match e.kind() {
                ErrorKind::UnexpectedEof => self.fail("the file ends inside a command"),
                _ => e.into(),
            })?;
        self.at += N;
        Ok(bytes)
    }

    fn short(&mut self) -> Result<f64, CliError> {
        self.take().map(u16::from_le_bytes).map(f64::from)
    }

    fn long(&mut self) -> Result<f64, CliError> {
        self.take().map(i32::from_le_bytes).map(f64::from)
    }

    fn real(&mut self) -> Result<f64, CliError> {
        let value = f64::from(f32::from_le_bytes(self.take()?));
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.fail("a number that is not finite"))
        }
    }

    fn points(&mut self, count: f64, long: bool, unit: f64) -> Result<Vec<DVec2>, CliError> {
        if count < 0.0 {
            return Err(self.fail("a number of points below zero"));
        }
        // as the file gives them: it may promise more than it holds
        let mut points = Vec::new();
        for _ in 0..count as usize {
            let (x, y) = if long {
                (self.real()?, self.real()?)
            } else {
                (self.short()?, self.short()?)
            };
            points.push(DVec2::new(x, y) * unit);
        }
        Ok(points)
    }
}

/// Reads up to the end of a layer; `None` where the file ends.
pub(super) fn layer<R: BufRead>(
    cursor: &mut Cursor<R>,
    filling: &mut Filling,
    unit: f64,
) -> Result<Option<Layer>, CliError> {
    while !cursor.from.fill_buf()?.is_empty() {
        let command = u16::from_le_bytes(cursor.take()?);
        if matches!(
            command,
            POLYLINE_SHORT | POLYLINE_LONG | HATCHES_SHORT | HATCHES_LONG
        ) && filling.layer.is_none()
        {
            return Err(cursor.fail("an item before the first layer"));
        }
        match command {
            LAYER_LONG | LAYER_SHORT => {
                let height = if command == LAYER_LONG {
                    cursor.real()?
                } else {
                    cursor.short()?
                };
                if let Some(before) = filling.begin(height * unit) {
                    return Ok(Some(before));
                }
            }
            POLYLINE_SHORT | POLYLINE_LONG => {
                let long = command == POLYLINE_LONG;
                let mut next = || if long { cursor.long() } else { cursor.short() };
                let (part, direction, count) = (next()?, next()?, next()?);
                if !Direction::is_code(direction) {
                    return Err(cursor.fail("the direction of a polyline must be 0, 1 or 2"));
                }
                filling.polyline(part as u32, cursor.points(count, long, unit)?);
            }
            HATCHES_SHORT | HATCHES_LONG => {
                let long = command == HATCHES_LONG;
                let mut next = || if long { cursor.long() } else { cursor.short() };
                let (part, count) = (next()?, next()?);
                let ends = cursor.points(2.0 * count, long, unit)?;
                filling.hatches(part as u32, &ends);
            }
            other => return Err(cursor.fail(&format!("command {other} is not known"))),
        }
    }
    Ok(None)
}

/// Writes a layer with long commands: coordinates become 32-bit reals, in mm.
pub(super) fn write(to: &mut impl Write, height: f64, items: &[Item]) -> Result<(), CliError> {
    let whole = |what, value: usize| {
        i32::try_from(value).map_err(|_| CliError::Value {
            what,
            value: value as f64,
        })
    };
    to.write_all(&LAYER_LONG.to_le_bytes())?;
    to.write_all(&real(height)?)?;
    for item in items {
        let (command, part, points) = match item {
            Item::Polyline(part, points) => (POLYLINE_LONG, part, points),
            Item::Hatches(part, ends) => (HATCHES_LONG, part, ends),
        };
        to.write_all(&command.to_le_bytes())?;
        to.write_all(&whole("a part's number", *part as usize)?.to_le_bytes())?;
        let count = match item {
            Item::Polyline(_, points) => {
                let direction = Direction::of(points).code();
                to.write_all(&i32::from(direction).to_le_bytes())?;
                whole("a number of points", points.len())?
            }
            Item::Hatches(_, ends) => whole("a number of lines", ends.len() / 2)?,
        };
        to.write_all(&count.to_le_bytes())?;
        for p in points {
            to.write_all(&real(p.x)?)?;
            to.write_all(&real(p.y)?)?;
        }
    }
    Ok(())
}

fn real(value: f64) -> Result<[u8; 4], CliError> {
    let short = value as f32;
    if short.is_finite() {
        Ok(short.to_le_bytes())
    } else {
        Err(CliError::Value {
            what: "a coordinate",
            value,
        })
    }
}
