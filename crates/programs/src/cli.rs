//! The common layer interface (CLI) of powder-bed machines: layers of polylines and hatches, as text or binary, read and written
//! layer by layer.
//!
//! Source: "Common Layer Interface (CLI), version 2.0", Brite-EuRam BE2578. Lengths are mm in memory; files count in their own
//! unit. Aligned binary files (`$$ALIGN`) are refused; of text alignment means nothing. A layer file holds shape alone: no speeds, powers or jumps; arcs become
//! chords.

mod ascii;
mod binary;
mod contents;

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::io::{BufRead, Read, Write};

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_toolpath::{Layer, Pass, Role};

pub use contents::CliError;
use contents::{Filling, Item, header_error};

/// Distance between an arc and the chords in its place, mm.
const CHORD_ERROR: f64 = 1e-3;
/// Longest header that is read, bytes.
const LONGEST_HEADER: u64 = 1 << 24;

/// How the geometry of a layer file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// As text.
    Ascii,
    /// In little-endian commands of 32-bit reals.
    Binary,
}

/// Reads a layer file, text or binary: an iterator over its layers. Contours and open lines are passes with the role of a
/// contour and profile 0, every hatch line is a pass of a fill with profile 1.
///
/// ```
/// let text = "$$HEADERSTART\n$$ASCII\n$$UNITS/0.01\n$$VERSION/200\n$$HEADEREND\n$$GEOMETRYSTART\n$$LAYER/5.0\n\
///     $$HATCHES/1,1,0,0,100,50\n$$GEOMETRYEND\n";
/// let mut file = meltpath_programs::cli::Reader::new(text.as_bytes()).unwrap();
/// let layer = file.next().unwrap().unwrap();
/// assert_eq!(layer.height, 0.05);
/// assert_eq!(layer.pass(0).points[1].x, 1.0);
/// ```
#[derive(Debug)]
pub struct Reader<R> {
    /// Names of parts.
    pub parts: BTreeMap<u32, String>,
    unit: f64,
    /// The layers that the header tells.
    told: Option<u64>,
    body: Body<R>,
    filling: Filling,
    state: State,
}

/// How far the reading is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Layers,
    /// The last layer was given: what the header tells is still to be compared.
    Counted,
    Over,
}

#[derive(Debug)]
enum Body<R> {
    Ascii(ascii::Commands<R>),
    Binary(binary::Cursor<R>),
}

impl<R: BufRead> Reader<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// [`CliError`].
    pub fn new(mut from: R) -> Result<Self, CliError> {
        const END: &[u8] = b"$$HEADEREND";
        let mut head = Vec::new();
        let mut limited = from.by_ref().take(LONGEST_HEADER);
        while !head.ends_with(END) {
            if limited.read_until(b'D', &mut head)? == 0 {
                return Err(header_error(
                    "$$HEADEREND is missing: this is no layer file",
                ));
            }
        }
        let bytes = head.len();
        head.truncate(bytes - END.len());
        let (mut unit, mut form, mut parts) = (None, None, BTreeMap::new());
        let (mut told, mut aligned) = (None, false);
        let mut commands = ascii::Commands::new(head.as_slice(), 0);
        while let Some(command) = commands.next()? {
            let (name, arguments) = command.split();
            match name {
                "UNITS" => {
                    let u: f64 = arguments
                        .parse()
                        .map_err(|_| header_error("$$UNITS is no number"))?;
                    if !(u > 0.0 && u.is_finite()) {
                        return Err(header_error("$$UNITS must be above zero"));
                    }
                    unit = Some(u);
                }
                "LAYERS" => {
                    let count = arguments.parse::<f64>().ok();
                    let whole = count.filter(|n| n.fract() == 0.0 && *n >= 0.0);
                    told = Some(whole.ok_or_else(|| {
                        header_error("$$LAYERS is no whole number: write how many layers follow")
                    })? as u64);
                }
                "ASCII" => form = Some(Form::Ascii),
                "BINARY" => form = Some(Form::Binary),
                "ALIGN" => aligned = true,
                "LABEL" => {
                    let label = arguments.split_once(',').and_then(|(id, name)| {
                        let name = name.trim().trim_matches('"').to_owned();
                        Some((id.trim().parse().ok()?, name))
                    });
                    let (part, name) =
                        label.ok_or_else(|| header_error("a $$LABEL is not \"number,name\""))?;
                    parts.insert(part, name);
                }
                _ => {}
            }
        }
        let body = match form {
            Some(Form::Ascii) => Body::Ascii(ascii::Commands::new(from, commands.lines())),
            Some(Form::Binary) if aligned => {
                return Err(header_error(
                    "$$ALIGN: aligned binary files are not read; export without alignment",
                ));
            }
            Some(Form::Binary) => Body::Binary(binary::Cursor::new(from, bytes)),
            None => return Err(header_error("neither $$ASCII nor $$BINARY is written")),
        };
        Ok(Reader {
            parts,
            unit: unit.ok_or_else(|| header_error("$$UNITS is missing"))?,
            told,
            body,
            filling: Filling::default(),
            state: State::Layers,
        })
    }
}

impl<R> Reader<R> {
    /// Other layers than the header tells: what is missing would be built by nobody, what is too much by mistake. A header that tells none
    /// was written before they were counted.
    fn miscounted(&self) -> Option<CliError> {
        let told = self.told.filter(|told| *told > 0)?;
        let held = u64::from(self.filling.count());
        let why = match held.cmp(&told) {
            Ordering::Equal => return None,
            Ordering::Less => "it is cut short",
            Ordering::Greater => "some are not meant, or were added",
        };
        Some(header_error(&format!(
            "$$LAYERS tells {told} layers, the file holds {held}: {why}; export it again, or correct $$LAYERS"
        )))
    }
}

impl<R: BufRead> Iterator for Reader<R> {
    type Item = Result<Layer, CliError>;

    fn next(&mut self) -> Option<Self::Item> {
        match self.state {
            State::Layers => {}
            State::Counted => {
                self.state = State::Over;
                return self.miscounted().map(Err);
            }
            State::Over => return None,
        }
        let next = match &mut self.body {
            Body::Ascii(commands) => ascii::layer(commands, &mut self.filling, self.unit),
            Body::Binary(cursor) => binary::layer(cursor, &mut self.filling, self.unit),
        };
        let next = match next {
            // the last one, where there is any
            Ok(None) => {
                self.state = State::Counted;
                match self.filling.layer.take() {
                    Some(last) => Some(Ok(last)),
                    None => return self.next(),
                }
            }
            other => other.transpose(),
        };
        if matches!(next, Some(Err(_))) {
            self.state = State::Over;
        }
        next.map(|read| {
            read.map(|mut layer| {
                layer.shrink_to_fit();
                layer
            })
        })
    }
}

/// Writes a layer file, layer by layer: contours, skins and supports as polylines, fills as hatches; what deposits nothing is
/// left out, and so are speeds and powers.
#[derive(Debug)]
pub struct Writer<W> {
    to: W,
    form: Form,
}

impl<W: Write> Writer<W> {
    /// Writes the header for files in mm; with the number of layers where it is known.
    ///
    /// # Errors
    /// [`CliError::Io`].
    pub fn new(
        mut to: W,
        form: Form,
        parts: &BTreeMap<u32, String>,
        layers: Option<usize>,
    ) -> Result<Self, CliError> {
        let word = match form {
            Form::Ascii => "ASCII",
            Form::Binary => "BINARY",
        };
        write!(to, "$$HEADERSTART\n$${word}\n$$UNITS/1\n$$VERSION/200\n")?;
        for (id, name) in parts {
            // a comma, a line end or a dollar would not be read back
            let name: String = name
                .chars()
                .filter(|c| !c.is_control() && !"$,\"/".contains(*c))
                .collect();
            writeln!(to, "$$LABEL/{id},{}", name.trim())?;
        }
        if let Some(layers) = layers {
            writeln!(to, "$$LAYERS/{layers}")?;
        }
        write!(to, "$$HEADEREND")?;
        if form == Form::Ascii {
            write!(to, "\n$$GEOMETRYSTART\n")?;
        }
        Ok(Writer { to, form })
    }

    /// Writes a layer.
    ///
    /// # Errors
    /// [`CliError::Value`] where a coordinate is not finite, or a layer is not plane; [`CliError::Io`].
    pub fn layer(&mut self, layer: &Layer) -> Result<(), CliError> {
        let laid = || layer.passes().filter(|p| p.head.role.deposits());
        let z = laid().next().map_or(0.0, |p| p.points[0].z);
        let height = layer.height + z;
        finite(height)?;
        let mut items: Vec<Item> = Vec::new();
        for pass in laid() {
            let (points, _) = pass.flatten(CHORD_ERROR);
            check(&points, z)?;
            let flat = points.iter().map(|p| p.truncate());
            add(&mut items, &pass, flat.collect());
        }
        match self.form {
            Form::Ascii => ascii::write(&mut self.to, height, &items),
            Form::Binary => binary::write(&mut self.to, height, &items),
        }
    }

    /// Writes the end.
    ///
    /// # Errors
    /// [`CliError::Io`].
    pub fn finish(mut self) -> Result<(), CliError> {
        if self.form == Form::Ascii {
            self.to.write_all(b"$$GEOMETRYEND\n")?;
        }
        Ok(self.to.flush()?)
    }
}

/// A pass as an item of its own, or as more hatches of the item before.
fn add(items: &mut Vec<Item>, pass: &Pass<'_>, points: Vec<DVec2>) {
    let part = pass.head.part;
    if pass.head.role != Role::Fill {
        items.push(Item::Polyline(part, points));
        return;
    }
    let lines = points.windows(2).flatten().copied();
    match items.last_mut() {
        Some(Item::Hatches(of, ends)) if *of == part => ends.extend(lines),
        _ => items.push(Item::Hatches(part, lines.collect())),
    }
}

fn finite(value: f64) -> Result<(), CliError> {
    if value.is_finite() {
        return Ok(());
    }
    Err(CliError::Value {
        what: "a coordinate",
        value,
    })
}

/// Every coordinate must be finite, and a layer plane.
fn check(points: &[DVec3], z: f64) -> Result<(), CliError> {
    for p in points {
        p.to_array().into_iter().try_for_each(finite)?;
        if p.z != z {
            return Err(CliError::Value {
                what: "the height of a point over its layer",
                value: p.z - z,
            });
        }
    }
    Ok(())
}
