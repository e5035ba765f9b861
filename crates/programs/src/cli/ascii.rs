//! The text form: commands that begin with `$$`, comments between double slashes.

use std::fmt::Write as _;

use meltpath_geometry::math::DVec2;

use super::{CliError, Direction, Item, Layer, LayerFile, finite, header};

/// A command, and how many line ends stand before it.
pub(super) struct Command<'a> {
    text: &'a str,
    lines: usize,
}

impl<'a> Command<'a> {
    /// Its name and its arguments.
    pub(super) fn split(&self) -> (&'a str, &'a str) {
        let (name, arguments) = self.text.split_once('/').unwrap_or((self.text, ""));
        // a comment that begins right after a command without arguments leaves its slash
        (
            name.trim(),
            arguments.split("//").next().unwrap_or("").trim(),
        )
    }
}

/// The commands of a text.
pub(super) fn commands(text: &str) -> impl Iterator<Item = Command<'_>> {
    let mut lines = 0;
    text.split("$$").enumerate().filter_map(move |(k, piece)| {
        let before = lines;
        lines += piece.matches('\n').count();
        (k > 0).then_some(Command {
            text: piece,
            lines: before,
        })
    })
}

/// The layers of a text whose first line has `lines_before` lines before it.
pub(super) fn geometry(text: &str, unit: f64, lines_before: usize) -> Result<Vec<Layer>, CliError> {
    let mut layers: Vec<Layer> = Vec::new();
    for command in commands(text) {
        let (name, arguments) = command.split();
        let line = lines_before + command.lines + 1;
        let fail = |what: &str| CliError::Text {
            line,
            what: what.to_owned(),
        };
        let numbers = || -> Result<Vec<f64>, CliError> {
            let parse = |n: &str| {
                n.trim()
                    .parse::<f64>()
                    .ok()
                    .filter(|v| v.is_finite())
                    .ok_or_else(|| fail(&format!("\"{}\" is no number", n.trim())))
            };
            arguments.split(',').map(parse).collect()
        };
        match name {
            "LAYER" => {
                let height = numbers()?[0] * unit;
                layers.push(Layer {
                    height,
                    items: Vec::new(),
                });
            }
            "POLYLINE" => {
                let n = numbers()?;
                let [part, direction, count, points @ ..] = n.as_slice() else {
                    return Err(fail("a $$POLYLINE needs part, direction, count and points"));
                };
                let direction = Direction::from_code(*direction)
                    .ok_or_else(|| fail("the direction of a $$POLYLINE must be 0, 1 or 2"))?;
                let points = pairs(points, *count, 2, unit)
                    .ok_or_else(|| fail("the points of a $$POLYLINE are not as many as it says"))?;
                let item = Item::Polyline {
                    part: number(*part),
                    direction,
                    points,
                };
                layers
                    .last_mut()
                    .ok_or_else(|| fail("a $$POLYLINE before the first $$LAYER"))?
                    .items
                    .push(item);
            }
            "HATCHES" => {
                let n = numbers()?;
                let [part, count, points @ ..] = n.as_slice() else {
                    return Err(fail("$$HATCHES need part, count and lines"));
                };
                let points = pairs(points, *count, 4, unit)
                    .ok_or_else(|| fail("the lines of $$HATCHES are not as many as they say"))?;
                let lines = points.chunks_exact(2).map(|l| [l[0], l[1]]).collect();
                let item = Item::Hatches {
                    part: number(*part),
                    lines,
                };
                layers
                    .last_mut()
                    .ok_or_else(|| fail("$$HATCHES before the first $$LAYER"))?
                    .items
                    .push(item);
            }
            "GEOMETRYEND" => return Ok(layers),
            "GEOMETRYSTART" | "HEADEREND" => {}
            other => {
                return Err(fail(&format!(
                    "the command $${} is not known",
                    other.chars().take(20).collect::<String>()
                )));
            }
        }
    }
    Err(CliError::Header {
        what: "$$GEOMETRYEND is missing: the file is cut off".to_owned(),
    })
}

/// An identifier; numbers outside its range saturate.
fn number(value: f64) -> u32 {
    value as u32
}

/// Points in mm where there are `each` numbers for each of `count`.
fn pairs(numbers: &[f64], count: f64, each: usize, unit: f64) -> Option<Vec<DVec2>> {
    let wanted = count * each as f64;
    (numbers.len() as f64 == wanted).then(|| {
        numbers
            .chunks_exact(2)
            .map(|p| DVec2::new(p[0], p[1]) * unit)
            .collect()
    })
}

/// The file as text, in mm with every digit.
///
/// # Errors
/// [`CliError::Value`] where a coordinate is not finite.
pub fn write_ascii(file: &LayerFile) -> Result<String, CliError> {
    finite(file)?;
    let mut text = header(file, "ASCII");
    text.push_str("\n$$GEOMETRYSTART\n");
    let put = |text: &mut String, p: &DVec2| {
        // writing into a string does not fail
        let _ = write!(text, ",{},{}", p.x, p.y);
    };
    for layer in &file.layers {
        let _ = writeln!(text, "$$LAYER/{}", layer.height);
        for item in &layer.items {
            match item {
                Item::Polyline {
                    part,
                    direction,
                    points,
                } => {
                    let _ = write!(
                        text,
                        "$$POLYLINE/{part},{},{}",
                        direction.code(),
                        points.len()
                    );
                    for p in points {
                        put(&mut text, p);
                    }
                }
                Item::Hatches { part, lines } => {
                    let _ = write!(text, "$$HATCHES/{part},{}", lines.len());
                    for p in lines.iter().flatten() {
                        put(&mut text, p);
                    }
                }
            }
            text.push('\n');
        }
    }
    text.push_str("$$GEOMETRYEND\n");
    Ok(text)
}
