//! Vector lists read layer by layer.

use std::collections::BTreeSet;
use std::io::{self, BufRead};

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Channel, Layer, PassHead, PassId, PassWriter, Role};

use super::words::{COLUMNS, KINDS, START};

/// Fastest spot that mirrors draw, mm/s.
const FASTEST: f64 = 1e6;
/// Strongest laser, W.
const STRONGEST: f64 = 1e6;
/// Places nearer to each other, mm, are the same.
const SAME: f64 = 1e-9;
/// Longest wait, s.
const LONGEST: f64 = 3600.0;

/// Why a vector list cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line} of the vector list: {what}")]
pub struct VectorListError {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong, and what to write.
    pub what: String,
}

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
            // `speed [mm/s]` is `speed_mm_s`, as lists were headed before
            let name = field.replace(" [", "_").replace('/', "_").replace(']', "");
            let Some(column) = COLUMNS.iter().position(|&c| c == name) else {
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

    /// A number that must not be below zero, or must be above it, and not absurdly great.
    fn at_least(&self, column: usize, bound: Bound, most: f64) -> Result<Option<f64>, String> {
        let value = self.number(column)?;
        let wrong =
            |wanted: String| value.map(|v| format!("{} is {v}; it must {wanted}", COLUMNS[column]));
        let problem = match (value, bound) {
            (Some(v), Bound::Above) if v <= 0.0 => wrong("be above zero".to_owned()),
            (Some(v), Bound::From) if v < 0.0 => wrong("not be negative".to_owned()),
            (Some(v), _) if v > most => wrong(format!("be at most {most}")),
            _ => None,
        };
        problem.map_or(Ok(value), Err)
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

impl Row {
    /// Whether it gives a power and does not mark.
    fn is_unlit_power(&self) -> bool {
        let [_, (_, power), _] = self.values;
        !self.role.is_some_and(Role::deposits) && power.is_some_and(|power| power > 0.0)
    }

    /// Whether it is a mark without length from here, on which the light does not wait.
    fn is_nothing(&self, from: DVec3) -> bool {
        let marks = self.role.is_some_and(Role::deposits);
        let [.., (_, wait)] = self.values;
        marks && self.end == from && wait.is_none_or(|wait| wait == 0.0)
    }
}

/// Reads a vector list: an iterator over its layers. Marks without length on which the light does not wait are nothing. A vector continues the pass of the one before where role and part are the
/// same. Each layer begins with a jump that goes nowhere: where the head stands. What a line leaves blank the pass leaves
/// unsaid.
///
/// ```
/// use meltpath_toolpath::Channel;
/// let text = "kind,x_mm,y_mm,speed_mm_s\nstart,0,0,\ncontour,10,0,1500\ncontour,10,10,\n";
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
    unlit: UnlitPower,
}

/// Powers above zero of vectors that do not mark: the laser is off on them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct UnlitPower {
    /// The first line with one; 0 where there is none.
    pub line: usize,
    /// How many lines have one.
    pub lines: usize,
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
            unlit: UnlitPower::default(),
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
        let row = row.map_err(|what| self.lines.wrong(&what))?;
        if row.is_unlit_power() {
            self.unlit.lines += 1;
            if self.unlit.line == 0 {
                self.unlit.line = row.line;
            }
        }
        Ok(Some(row))
    }

    /// Powers of vectors that do not mark, as far as the list is read.
    pub fn unlit_power(&self) -> UnlitPower {
        self.unlit
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
            if row.is_nothing(at) {
                continue;
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

/// The line of a vector list, from 1, whose vector of a layer ends at a place, mm; `None` where there is none.
pub fn line_of<R: BufRead>(from: R, layer: u32, end: DVec3) -> Option<usize> {
    let mut reader = Reader::new(from).ok()?;
    let mut number = reader.number;
    let mut row = reader.ahead.take();
    while let Some(here) = row {
        number = here.layer.unwrap_or(number);
        if number == layer && here.end.distance(end) < SAME {
            return Some(here.line);
        }
        row = reader.row().ok()?;
    }
    None
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
    if all.len() < heading.columns {
        return Err(format!(
            "{} fields under a heading of {}: what a vector leaves unsaid stays blank between its separators; or the file was cut off here",
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
    // a mark without power would light nothing
    let power = match role {
        Some(role) if role.deposits() => Bound::Above,
        _ => Bound::From,
    };
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
            (Channel::Speed, fields.at_least(4, Bound::Above, FASTEST)?),
            (Channel::Power, fields.at_least(5, power, STRONGEST)?),
            (Channel::Dwell, fields.at_least(6, Bound::From, LONGEST)?),
        ],
        part: fields.count(7)?.unwrap_or(0),
        layer: fields.count(8)?,
        height: fields.number(9)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks without length light nothing, but for those on which the light waits.
    #[test]
    fn marks_without_length_are_nothing_unless_the_light_waits() {
        let text = "kind,x_mm,y_mm,wait_s\nstart,1,1,\nfill,1,1,\nfill,1,1,0\nfill,5,1,\nfill,5,1,\nfill,5,1,0.001\n";
        let mut list = Reader::new(text.as_bytes()).unwrap();
        let layer = list.next().unwrap().unwrap();
        let lines: Vec<_> = layer.passes().skip(1).map(|p| p.points.to_vec()).collect();
        let [from, to] = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(5.0, 1.0, 0.0)];
        assert_eq!(lines, [vec![from, to, to]]);
        assert!(list.next().is_none());
    }
}
