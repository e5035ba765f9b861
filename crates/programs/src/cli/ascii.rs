//! The text form: commands that begin with `$$`, comments between double slashes.

use std::io::{self, BufRead, Write};

use meltpath_geometry::math::DVec2;
use meltpath_toolpath::Layer;

use super::contents::{CliError, Direction, Filling, Item, header_error};

/// The commands of a text, one after the other.
#[derive(Debug)]
pub(super) struct Commands<R> {
    from: R,
    /// What stands between one `$$` and the next.
    piece: Vec<u8>,
    /// Line ends before the piece that comes next.
    lines: usize,
    begun: bool,
    over: bool,
}

/// A command.
pub(super) struct Command {
    text: String,
    /// Its line, from 1.
    line: usize,
}

impl Command {
    /// Its name and its arguments.
    pub(super) fn split(&self) -> (&str, &str) {
        let (name, arguments) = self.text.split_once('/').unwrap_or((&self.text, ""));
        // a comment that begins right after a command without arguments leaves its slash
        (
            name.trim(),
            arguments.split("//").next().unwrap_or("").trim(),
        )
    }
}

impl<R: BufRead> Commands<R> {
    /// Of a text that `lines` line ends stand before.
    pub(super) fn new(from: R, lines: usize) -> Self {
        Commands {
            from,
            piece: Vec::new(),
            lines,
            begun: false,
            over: false,
        }
    }

    /// Line ends up to where it has read.
    pub(super) fn lines(&self) -> usize {
        self.lines
    }

    /// Reads up to the next `$$` outside of comments, or to the end.
    fn read(&mut self) -> io::Result<()> {
        self.piece.clear();
        loop {
            let read = self.from.read_until(b'$', &mut self.piece)?;
            // a file may end in a single dollar
            if read == 0 || self.piece.last() != Some(&b'$') {
                self.over = true;
                return Ok(());
            }
            if self.from.fill_buf()?.first() == Some(&b'$') {
                self.from.consume(1);
                self.piece.pop();
                if !in_comment(&self.piece) {
                    return Ok(());
                }
                self.piece.extend_from_slice(b"$$");
            }
        }
    }

    /// The next command, if there is any.
    pub(super) fn next(&mut self) -> io::Result<Option<Command>> {
        let ends = |piece: &[u8]| piece.split(|b| *b == b'\n').count() - 1;
        if !self.begun {
            self.begun = true;
            self.read()?;
            self.lines += ends(&self.piece);
        }
        if self.over {
            return Ok(None);
        }
        self.read()?;
        let line = self.lines + 1;
        self.lines += ends(&self.piece);
        let text = self.piece.iter().map(|&b| char::from(b)).collect();
        Ok(Some(Command { text, line }))
    }
}

/// Whether what follows a piece stands in a comment: one ends with double slashes, or with its line.
fn in_comment(piece: &[u8]) -> bool {
    let line = piece.rsplit(|b| *b == b'\n').next().unwrap_or_default();
    let (mut inside, mut rest) = (false, line);
    while let Some(at) = rest.windows(2).position(|pair| pair == b"//") {
        inside = !inside;
        rest = &rest[at + 2..];
    }
    inside
}

/// Reads up to the end of a layer; `None` where the file ends.
pub(super) fn layer<R: BufRead>(
    commands: &mut Commands<R>,
    filling: &mut Filling,
    unit: f64,
) -> Result<Option<Layer>, CliError> {
    while let Some(command) = commands.next()? {
        let (name, arguments) = command.split();
        let fail = |what: &str| CliError::Text {
            line: command.line,
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
                if let Some(before) = filling.begin(height) {
                    return Ok(Some(before));
                }
            }
            "POLYLINE" => {
                let n = numbers()?;
                let [part, direction, count, points @ ..] = n.as_slice() else {
                    return Err(fail("a $$POLYLINE needs part, direction, count and points"));
                };
                if !Direction::is_code(*direction) {
                    return Err(fail("the direction of a $$POLYLINE must be 0, 1 or 2"));
                }
                let points = pairs(points, *count, 2, unit)
                    .ok_or_else(|| fail("the points of a $$POLYLINE are not as many as it says"))?;
                if filling.layer.is_none() {
                    return Err(fail("a $$POLYLINE before the first $$LAYER"));
                }
                filling.polyline(number(*part), points);
            }
            "HATCHES" => {
                let n = numbers()?;
                let [part, count, points @ ..] = n.as_slice() else {
                    return Err(fail("$$HATCHES need part, count and lines"));
                };
                let points = pairs(points, *count, 4, unit)
                    .ok_or_else(|| fail("the lines of $$HATCHES are not as many as they say"))?;
                if filling.layer.is_none() {
                    return Err(fail("$$HATCHES before the first $$LAYER"));
                }
                filling.hatches(number(*part), &points);
            }
            "GEOMETRYEND" => return Ok(None),
            "GEOMETRYSTART" | "HEADEREND" => {}
            other => {
                return Err(fail(&format!(
                    "the command $${} is not known",
                    other.chars().take(20).collect::<String>()
                )));
            }
        }
    }
    Err(header_error(
        "$$GEOMETRYEND is missing: the file is cut off",
    ))
}

/// An identifier; numbers outside its range saturate.
fn number(value: f64) -> u32 {
    value as u32
}

/// Points in mm where there are `each` numbers for each of `count`.
fn pairs(numbers: &[f64], count: f64, each: usize, unit: f64) -> Option<Vec<DVec2>> {
    let wanted = count * each as f64;
    (numbers.len() as f64 == wanted).then(|| {
        let pairs = numbers.as_chunks::<2>().0.iter();
        pairs.map(|&p| DVec2::from_array(p) * unit).collect()
    })
}

/// Writes a layer, in mm with every digit.
pub(super) fn write(to: &mut impl Write, height: f64, items: &[Item]) -> Result<(), CliError> {
    writeln!(to, "$$LAYER/{height}")?;
    for item in items {
        let points = match item {
            Item::Polyline(part, points) => {
                let direction = Direction::of(points).code();
                write!(to, "$$POLYLINE/{part},{direction},{}", points.len())?;
                points
            }
            Item::Hatches(part, ends) => {
                write!(to, "$$HATCHES/{part},{}", ends.len() / 2)?;
                ends
            }
        };
        for p in points {
            write!(to, ",{},{}", p.x, p.y)?;
        }
        writeln!(to)?;
    }
    Ok(())
}
