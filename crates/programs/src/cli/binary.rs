//! The binary form: little-endian commands right after the header, short (16-bit units) or long (32-bit reals).

use meltpath_geometry::math::DVec2;

use super::{CliError, Direction, Item, Layer, LayerFile, finite, header};

const LAYER_LONG: u16 = 127;
const LAYER_SHORT: u16 = 128;
const POLYLINE_SHORT: u16 = 129;
const POLYLINE_LONG: u16 = 130;
const HATCHES_SHORT: u16 = 131;
const HATCHES_LONG: u16 = 132;

/// Walks through the bytes and knows where it stands.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    offset: usize,
}

impl Cursor<'_> {
    fn fail(&self, what: &str) -> CliError {
        CliError::Binary {
            byte: self.offset + self.at,
            what: what.to_owned(),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], CliError> {
        let piece = self
            .bytes
            .get(self.at..self.at + N)
            .and_then(|p| p.try_into().ok());
        let piece = piece.ok_or_else(|| self.fail("the file ends inside a command"))?;
        self.at += N;
        Ok(piece)
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
        let each = if long { 8 } else { 4 };
        let room = (self.bytes.len() - self.at) / each;
        if !(0.0..=room as f64).contains(&count) {
            return Err(self.fail("more points than the file has room for"));
        }
        let mut points = Vec::with_capacity(count as usize);
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

/// The layers of the bytes behind the header, which end at byte `offset` of the file.
pub(super) fn geometry(bytes: &[u8], unit: f64, offset: usize) -> Result<Vec<Layer>, CliError> {
    let mut cursor = Cursor {
        bytes,
        at: 0,
        offset,
    };
    let mut layers: Vec<Layer> = Vec::new();
    while cursor.at < bytes.len() {
        let command = u16::from_le_bytes(cursor.take()?);
        let item = match command {
            LAYER_LONG | LAYER_SHORT => {
                let height = if command == LAYER_LONG {
                    cursor.real()?
                } else {
                    cursor.short()?
                };
                layers.push(Layer {
                    height: height * unit,
                    items: Vec::new(),
                });
                continue;
            }
            POLYLINE_SHORT | POLYLINE_LONG => {
                let long = command == POLYLINE_LONG;
                let mut next = || if long { cursor.long() } else { cursor.short() };
                let (part, direction, count) = (next()?, next()?, next()?);
                let direction = Direction::from_code(direction)
                    .ok_or_else(|| cursor.fail("the direction of a polyline must be 0, 1 or 2"))?;
                let points = cursor.points(count, long, unit)?;
                Item::Polyline {
                    part: part as u32,
                    direction,
                    points,
                }
            }
            HATCHES_SHORT | HATCHES_LONG => {
                let long = command == HATCHES_LONG;
                let mut next = || if long { cursor.long() } else { cursor.short() };
                let (part, count) = (next()?, next()?);
                let points = cursor.points(2.0 * count, long, unit)?;
                let lines = points.chunks_exact(2).map(|l| [l[0], l[1]]).collect();
                Item::Hatches {
                    part: part as u32,
                    lines,
                }
            }
            other => return Err(cursor.fail(&format!("command {other} is not known"))),
        };
        let fail = cursor.fail("an item before the first layer");
        layers.last_mut().ok_or(fail)?.items.push(item);
    }
    Ok(layers)
}

/// The file in binary form with long commands: coordinates become 32-bit reals, in mm.
///
/// # Errors
/// [`CliError::Value`] where a coordinate or a number of points does not fit.
pub fn write_binary(file: &LayerFile) -> Result<Vec<u8>, CliError> {
    finite(file)?;
    let mut out = header(file, "BINARY").into_bytes();
    let whole = |what, value: usize| {
        i32::try_from(value).map_err(|_| CliError::Value {
            what,
            value: value as f64,
        })
    };
    for layer in &file.layers {
        out.extend(LAYER_LONG.to_le_bytes());
        out.extend(real(layer.height)?);
        for item in &layer.items {
            let points: Vec<DVec2> = match item {
                Item::Polyline {
                    part,
                    direction,
                    points,
                } => {
                    out.extend(POLYLINE_LONG.to_le_bytes());
                    out.extend(whole("a part's number", *part as usize)?.to_le_bytes());
                    out.extend(i32::from(direction.code()).to_le_bytes());
                    out.extend(whole("a number of points", points.len())?.to_le_bytes());
                    points.clone()
                }
                Item::Hatches { part, lines } => {
                    out.extend(HATCHES_LONG.to_le_bytes());
                    out.extend(whole("a part's number", *part as usize)?.to_le_bytes());
                    out.extend(whole("a number of lines", lines.len())?.to_le_bytes());
                    lines.iter().flatten().copied().collect()
                }
            };
            for p in points {
                out.extend(real(p.x)?);
                out.extend(real(p.y)?);
            }
        }
    }
    Ok(out)
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
