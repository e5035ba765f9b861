//! Vector lists: the moves of a scan head as comma-separated values, one straight move a line, read and written layer by layer.
//!
//! The form is this project's: a heading line, then one line for each vector with where it ends. `kind`, `x [mm]` and `y [mm]` are
//! needed; `z [mm]`, `speed [mm/s]`, `power [W]`, `wait [s]`, `part`, `layer` and `height [mm]` are not, and may be blank in any
//! line. The first vector of each layer is a `start`. Commas, semicolons or tabs separate; `#` begins a comment.

use std::collections::BTreeSet;
use std::io::{self, BufRead, Write};

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Channel, Layer, Move, Pass, PassHead, PassId, PassWriter, Role};

/// Distance between an arc and the vectors in its place, mm.
const CHORD_ERROR: f64 = 5e-4;

/// Why a vector list cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line} of the vector list: {what}")]
pub struct VectorListError {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong, and what to write.
    pub what: String,
}

/// Why a layer cannot be written as a vector list.
#[derive(Debug, thiserror::Error)]
pub enum VectorWriteError {
    /// The system refused.
    #[error("the vector list cannot be written: {0}")]
    Io(#[from] io::Error),
    /// A spot is no vector.
    #[error("layer {layer}: pass {pass} stays on spots, which a vector list cannot hold")]
    Spot {
        /// The layer.
        layer: u32,
        /// The pass.
        pass: u32,
    },
    /// The vectors of a layer must follow one another.
    #[error("layer {layer} comes again: a vector list holds each layer once; number it anew")]
    Again {
        /// The layer.
        layer: u32,
    },
}

/// Where the head stands when a layer begins.
const START: &str = "start";

/// Words for what vectors are for.
const KINDS: [(Role, &str); 5] = [
    (Role::Contour, "contour"),
    (Role::Fill, "fill"),
    (Role::Jump, "jump"),
    (Role::Connection, "connection"),
    (Role::Run, "run"),
];

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

/// The columns and their headings.
const COLUMNS: [&str; 10] = [
    "kind",
    "x [mm]",
    "y [mm]",
    "z [mm]",
    "speed [mm/s]",
    "power [W]",
    "wait [s]",
    "part",
    "layer",
    "height [mm]",
];

/// Where each column stands in a line.
#[derive(Debug)]
struct Heading {
    separator: char,
    at: [Option<usize>; COLUMNS.len()],
    columns: usize,
}

impl Heading {
    fn parse(line: &str) -> Result<Self, String> {
        let separator = [';', '\t', ',']
            .into_iter()
            .find(|&c| line.contains(c))
            .unwrap_or(',');
        let mut at = [None; COLUMNS.len()];
        let mut columns = 0;
        for (k, field) in line.split(separator).enumerate() {
            let field = field.trim().trim_matches('"');
            let Some(column) = COLUMNS.iter().position(|&c| c == field) else {
                return Err(format!(
                    "there is no column \"{field}\"; there are {}",
                    COLUMNS.join(", ")
                ));
            };
            if at[column].replace(k).is_some() {
                return Err(format!("the column \"{field}\" comes twice"));
            }
            columns = k + 1;
        }
        for (needed, place) in COLUMNS.iter().zip(&at).take(3) {
            if place.is_none() {
                return Err(format!("the heading has no column \"{needed}\""));
            }
        }
        Ok(Heading {
            separator,
            at,
            columns,
        })
    }
}

/// The fields of a line, by column.
struct Fields<'a>([Option<&'a str>; COLUMNS.len()]);

impl Fields<'_> {
    fn number(&self, column: usize) -> Result<Option<f64>, String> {
        let Some(text) = self.0[column] else {
            return Ok(None);
        };
        let name = COLUMNS[column];
        let value: f64 = text
            .parse()
            .map_err(|_| format!("\"{text}\" in the column \"{name}\" is no number"))?;
        if value.is_finite() {
            Ok(Some(value))
        } else {
            Err(format!(
                "{text} in the column \"{name}\" must be a finite number"
            ))
        }
    }

    /// A number that must not be below zero, or must be above it.
    fn at_least(&self, column: usize, above_zero: Bound) -> Result<Option<f64>, String> {
        let value = self.number(column)?;
        match (value, above_zero) {
            (Some(v), Bound::Above) if v <= 0.0 => {
                Err(format!("{} is {v}; it must be above zero", COLUMNS[column]))
            }
            (Some(v), Bound::From) if v < 0.0 => Err(format!(
                "{} is {v}; it must not be negative",
                COLUMNS[column]
            )),
            _ => Ok(value),
        }
    }

    fn count(&self, column: usize) -> Result<Option<u32>, String> {
        self.0[column]
            .map(|text| {
                text.parse().map_err(|_| {
                    format!(
                        "\"{text}\" in the column \"{}\" is no whole number from 0 on",
                        COLUMNS[column]
                    )
                })
            })
            .transpose()
    }
}

#[derive(Clone, Copy)]
enum Bound {
    Above,
    From,
}

/// A vector as its line says it.
#[derive(Debug)]
struct Row {
    line: usize,
    word: String,
    /// `None` for a start.
    role: Option<Role>,
    end: DVec3,
    values: [(Channel, Option<f64>); 3],
    part: u32,
    layer: Option<u32>,
    height: Option<f64>,
}

/// Reads a vector list: an iterator over its layers. A vector continues the pass of the one before where role and part are the
/// same. Each layer begins with a jump that goes nowhere: where the head stands. What a line leaves blank the pass leaves
/// unsaid.
///
/// ```
/// use meltpath_toolpath::Channel;
/// let text = "kind,x [mm],y [mm],speed [mm/s]\nstart,0,0,\ncontour,10,0,1500\ncontour,10,10,\n";
/// let mut list = meltpath_programs::vectors::Reader::new(text.as_bytes()).unwrap();
/// let layer = list.next().unwrap().unwrap();
/// let contour = layer.pass(1);
/// assert_eq!(contour.value(Channel::Speed, 0), Some(1500.0));
/// assert_eq!(contour.value(Channel::Speed, 1), None);
/// ```
#[derive(Debug)]
pub struct Reader<R> {
    lines: Lines<R>,
    heading: Heading,
    ahead: Option<Row>,
    seen: BTreeSet<u32>,
    number: u32,
    passes: u32,
}

/// Lines without comments, those with something in them.
#[derive(Debug)]
struct Lines<R> {
    from: R,
    line: usize,
    text: String,
}

impl<R: BufRead> Lines<R> {
    /// The next line that says something is in `text`; false where there is none.
    fn advance(&mut self) -> Result<bool, VectorListError> {
        loop {
            self.text.clear();
            let read = self.from.read_line(&mut self.text);
            self.line += 1;
            let read = read.map_err(|e| match e.kind() {
                io::ErrorKind::InvalidData => {
                    self.wrong("this is not text in UTF-8: export it as such")
                }
                _ => self.wrong(&format!("it cannot be read: {e}")),
            })?;
            if read == 0 {
                self.line -= 1;
                return Ok(false);
            }
            let said = self.text.split('#').next().unwrap_or("").trim_end();
            let said = said.trim_start_matches('\u{feff}').to_owned();
            if !said.trim().is_empty() {
                self.text = said;
                return Ok(true);
            }
        }
    }

    fn wrong(&self, what: &str) -> VectorListError {
        VectorListError {
            line: self.line,
            what: what.to_owned(),
        }
    }
}

impl<R: BufRead> Reader<R> {
    /// Reads the heading and the first line.
    ///
    /// # Errors
    /// [`VectorListError`] with the line and what to write.
    pub fn new(from: R) -> Result<Self, VectorListError> {
        let mut lines = Lines {
            from,
            line: 0,
            text: String::new(),
        };
        if !lines.advance()? {
            lines.line = 1;
            return Err(lines.wrong("the file is empty"));
        }
        let heading = Heading::parse(&lines.text).map_err(|what| lines.wrong(&what))?;
        let at = lines.line;
        let mut reader = Reader {
            lines,
            heading,
            ahead: None,
            seen: BTreeSet::new(),
            number: 1,
            passes: 0,
        };
        reader.ahead = reader.row()?;
        if reader.ahead.is_none() {
            reader.lines.line = at;
            let what = "no vector follows the heading; the first is a `start`";
            return Err(reader.lines.wrong(what));
        }
        Ok(reader)
    }

    fn row(&mut self) -> Result<Option<Row>, VectorListError> {
        if !self.lines.advance()? {
            return Ok(None);
        }
        let row = row(&self.heading, &self.lines.text, self.lines.line);
        row.map(Some).map_err(|what| self.lines.wrong(&what))
    }

    /// The layer that begins with `first`.
    fn layer(&mut self, first: &Row) -> Result<Layer, VectorListError> {
        let wrong = |row: &Row, what: String| VectorListError {
            line: row.line,
            what,
        };
        let number = first.layer.unwrap_or(self.number);
        self.number = number;
        if first.role.is_some() {
            let what = format!(
                "layer {number} begins with a `{}`: it must begin with a `{START}` that says where the head stands",
                first.word
            );
            return Err(wrong(first, what));
        }
        if !self.seen.insert(number) {
            let what = format!("layer {number} comes again: its vectors must follow one another");
            return Err(wrong(first, what));
        }
        let mut layer = Layer::new(number, first.height.unwrap_or(0.0));
        let mut pass = (Role::Jump, first.part);
        let mut at = first.end;
        write(&mut layer.begin(self.head(pass), at), first);
        while let Some(row) = self.row()? {
            if row.layer.is_some_and(|n| n != number) {
                self.ahead = Some(row);
                break;
            }
            let Some(role) = row.role else {
                let what = format!("layer {number} has a second `{START}`; go there by a `jump`");
                return Err(wrong(&row, what));
            };
            if row.height.is_some_and(|h| h != layer.height) {
                return Err(wrong(&row, format!("layer {number} has two heights")));
            }
            let same = pass == (role, row.part);
            pass = (role, row.part);
            if !same {
                layer.begin(self.head(pass), at);
            }
            if let Some(mut to) = layer.resume() {
                write(&mut to, &row);
            }
            at = row.end;
        }
        layer.shrink_to_fit();
        Ok(layer)
    }

    fn head(&mut self, (role, part): (Role, u32)) -> PassHead {
        self.passes += 1;
        PassHead {
            id: PassId(self.passes),
            part,
            role,
            ..PassHead::default()
        }
    }
}

impl<R: BufRead> Iterator for Reader<R> {
    type Item = Result<Layer, VectorListError>;

    fn next(&mut self) -> Option<Self::Item> {
        let first = self.ahead.take()?;
        Some(self.layer(&first))
    }
}

/// Appends a vector to a pass.
fn write(to: &mut PassWriter<'_>, row: &Row) {
    to.line_to(row.end);
    for (channel, value) in row.values {
        if let Some(value) = value {
            to.set(channel, value);
        }
    }
}

/// What a line says.
fn row(heading: &Heading, text: &str, line: usize) -> Result<Row, String> {
    let all: Vec<&str> = text
        .split(heading.separator)
        .map(|f| f.trim().trim_matches('"'))
        .collect();
    if all.len() > heading.columns {
        return Err(format!(
            "{} fields under a heading of {}",
            all.len(),
            heading.columns
        ));
    }
    let fields = Fields(heading.at.map(|at| {
        at.and_then(|k| all.get(k).copied())
            .filter(|f| !f.is_empty())
    }));
    let word = fields.0[0].unwrap_or("");
    let role = KINDS.iter().find(|(_, w)| *w == word).map(|(r, _)| *r);
    if role.is_none() && word != START {
        let known = KINDS.map(|(_, w)| w).join(", ");
        return Err(format!(
            "\"{word}\" is no kind of vector; there are {START}, {known}"
        ));
    }
    let needed = |column: usize| -> Result<f64, String> {
        fields
            .number(column)?
            .ok_or_else(|| format!("the column \"{}\" is blank", COLUMNS[column]))
    };
    Ok(Row {
        line,
        word: word.to_owned(),
        role,
        end: DVec3::new(needed(1)?, needed(2)?, fields.number(3)?.unwrap_or(0.0)),
        values: [
            (Channel::Speed, fields.at_least(4, Bound::Above)?),
            (Channel::Power, fields.at_least(5, Bound::From)?),
            (Channel::Dwell, fields.at_least(6, Bound::From)?),
        ],
        part: fields.count(7)?.unwrap_or(0),
        layer: fields.count(8)?,
        height: fields.number(9)?,
    })
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
                return Err(VectorWriteError::Spot {
                    layer: layer.number,
                    pass: pass.head.id.0,
                });
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> Result<Vec<Layer>, VectorListError> {
        Reader::new(text.as_bytes())?.collect()
    }

    fn written(layers: &[Layer]) -> String {
        let mut text = Vec::new();
        let mut writer = Writer::new(&mut text).unwrap();
        for layer in layers {
            writer.layer(layer).unwrap();
        }
        writer.finish().unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (text, line, words) in [
            ("", 1, "empty"),
            ("kind,x [mm]\n", 1, "y [mm]"),
            ("kind,x [mm],y [mm],x [mm]\n", 1, "twice"),
            ("kind,x,y\n", 1, "no column \"x\""),
            ("kind,x [mm],y [mm]\n", 1, "no vector"),
            ("kind,x [mm],y [mm]\nfill,0,0\n", 2, "begin with a `start`"),
            ("kind,x [mm],y [mm]\nstart,0,0\nfil,0,0\n", 3, "contour"),
            ("kind,x [mm],y [mm]\nstart,0,\n", 2, "blank"),
            ("kind,x [mm],y [mm]\nstart,0,nan\n", 2, "finite"),
            ("kind,x [mm],y [mm]\nstart,0,0,9\n", 2, "4 fields"),
            (
                "kind,x [mm],y [mm]\nstart,0,0\nstart,1,1\n",
                3,
                "second `start`",
            ),
            (
                "kind;x [mm];y [mm];speed [mm/s]\n# a comment\nstart;0;0;0\n",
                3,
                "above zero",
            ),
            (
                "kind,x [mm],y [mm],wait [s]\nstart,0,0,-1\n",
                2,
                "not be negative",
            ),
            (
                "kind,x [mm],y [mm],layer\nstart,0,0,1\nstart,0,0,2\nstart,0,0,1\n",
                4,
                "comes again",
            ),
        ] {
            let error = read(text).unwrap_err();
            assert_eq!(error.line, line, "{error}");
            assert!(error.what.contains(words), "{error}");
        }
    }

    #[test]
    fn passes_of_planning_are_written_with_jumps_between_them() {
        let mut layer = Layer::new(4, 0.12);
        let mut head = PassHead {
            part: 2,
            role: Role::Contour,
            ..PassHead::default()
        };
        let mut contour = layer.begin(head, DVec3::ZERO);
        contour.arc_to(DVec3::new(1.0, 1.0, 0.0), DVec3::X * 2.0);
        contour.set(Channel::Speed, 700.0);
        head.role = Role::Fill;
        layer.polyline(head, [DVec3::X * 3.0, DVec3::X * 4.0]);
        let read = read(&written(std::slice::from_ref(&layer))).unwrap();
        read[0].sanity_check().unwrap();
        assert_eq!((read[0].number, read[0].height), (4, 0.12));
        let roles: Vec<_> = read[0].passes().map(|p| p.head.role).collect();
        assert_eq!(roles, [Role::Jump, Role::Contour, Role::Jump, Role::Fill]);
        let arc = read[0].pass(1);
        assert!((arc.length() - std::f64::consts::PI).abs() < 1e-2);
        assert!((0..arc.move_count()).all(|i| arc.value(Channel::Speed, i) == Some(700.0)));
        let mut spots = Layer::new(5, 0.0);
        let mut pass = spots.begin(head, DVec3::ZERO);
        pass.go(Move::Spot { time: 1e-3 }, DVec3::ZERO);
        let mut writer = Writer::new(Vec::new()).unwrap();
        assert!(matches!(
            writer.layer(&spots),
            Err(VectorWriteError::Spot { layer: 5, .. })
        ));
        writer.layer(&layer).unwrap();
        assert!(matches!(
            writer.layer(&layer),
            Err(VectorWriteError::Again { layer: 4 })
        ));
    }

    #[test]
    fn lists_are_read_layer_by_layer() {
        let text = "kind,x [mm],y [mm],layer\nstart,0,0,1\nfill,1,0,1\nstart,0,0,2\nfill,1\n";
        let mut reader = Reader::new(text.as_bytes()).unwrap();
        assert_eq!(reader.next().unwrap().unwrap().number, 1);
        assert_eq!(reader.next().unwrap().unwrap_err().line, 5);
        assert!(reader.next().is_none());
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(
            numbers in prop::collection::vec((-200.0..200.0f64, -200.0..200.0f64, 1usize..6, prop::option::of(1.0..9e3f64), 0u32..3), 1..40)
        ) {
            let mut layers = Vec::new();
            for (k, chunk) in numbers.chunks(7).enumerate() {
                let mut layer = Layer::new(k as u32 + 1, 0.03 * k as f64);
                let mut at = DVec3::new(chunk[0].0, chunk[0].1, 0.0);
                for (i, &(x, y, kind, speed, part)) in chunk.iter().enumerate() {
                    let role = if i == 0 { Role::Jump } else { KINDS[kind - 1].0 };
                    let head = PassHead { part, role, ..PassHead::default() };
                    let mut pass = layer.begin(head, at);
                    at = DVec3::new(x, y, 0.0);
                    pass.line_to(at);
                    for channel in [Channel::Speed, Channel::Power, Channel::Dwell] {
                        speed.map(|v| pass.set(channel, v));
                    }
                }
                layers.push(layer);
            }
            let again = read(&written(&layers)).unwrap();
            let vectors = |layers: &[Layer]| -> Vec<_> {
                layers.iter().flat_map(Layer::passes).flat_map(|p| (0..p.move_count()).map(move |i| {
                    let values = Channel::ALL.map(|c| p.value(c, i));
                    (p.layer, p.head.role, p.head.part, p.points[i], p.points[i + 1], values)
                }).collect::<Vec<_>>()).collect()
            };
            prop_assert_eq!(vectors(&again), vectors(&layers));
            for (a, b) in again.iter().zip(&layers) {
                a.sanity_check().unwrap();
                prop_assert_eq!(a.height, b.height);
            }
            prop_assert_eq!(read(&written(&again)).unwrap(), again);
        }

        #[test]
        fn nothing_panics(text in "(kind,x \\[mm\\],y \\[mm\\]\n)?[a-z0-9,.;#\n -]{0,200}") {
            let _ = read(&text);
        }
    }
}
