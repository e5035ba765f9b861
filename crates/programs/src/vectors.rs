//! Vector lists: the moves of a scan head as comma-separated values, one straight move a line.
//!
//! The form is this project's: a heading line, then one line for each vector with where it ends. `kind`, `x [mm]` and `y [mm]` are
//! needed; `z [mm]`, `speed [mm/s]`, `power [W]`, `wait [s]`, `part`, `layer` and `height [mm]` are not, and may be blank in any
//! line. The first vector of each layer is a `start`. Commas, semicolons or tabs separate; `#` begins a comment.

use std::fmt::Write as _;

use meltpath_geometry::math::DVec3;

/// Why a vector list cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line} of the vector list: {what}")]
pub struct VectorListError {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong, and what to write.
    pub what: String,
}

/// What a vector is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Where the head stands when a layer begins.
    Start,
    /// Marks a contour.
    Contour,
    /// Marks a line of a fill.
    Fill,
    /// Goes elsewhere, laser off.
    Jump,
    /// Goes from one line of a fill to the next, laser off.
    Connection,
    /// Runs up to or out of a line, laser off.
    Run,
}

/// The kinds and their words.
const KINDS: [(Kind, &str); 6] = [
    (Kind::Start, "start"),
    (Kind::Contour, "contour"),
    (Kind::Fill, "fill"),
    (Kind::Jump, "jump"),
    (Kind::Connection, "connection"),
    (Kind::Run, "run"),
];

impl Kind {
    /// Its word in the file.
    pub fn word(self) -> &'static str {
        KINDS.iter().find(|(k, _)| *k == self).map_or("", |k| k.1)
    }
}

/// One vector, from where the last one ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vector {
    /// What it is for.
    pub kind: Kind,
    /// Where it ends: x and y in the plane, z the height of the focus over it, mm.
    pub end: DVec3,
    /// Speed, mm/s, where the file says it.
    pub speed: Option<f64>,
    /// Laser power, W, where the file says it.
    pub power: Option<f64>,
    /// Wait at its end, s, where the file says it.
    pub wait: Option<f64>,
    /// Number of the part.
    pub part: u32,
}

/// The vectors of a layer; the first is its [`Kind::Start`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layer {
    /// Its number in the file.
    pub number: u32,
    /// Height of its top, mm; 0 where the file does not say it.
    pub height: f64,
    /// The vectors in order.
    pub vectors: Vec<Vector>,
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

/// Reads a vector list.
///
/// # Errors
/// [`VectorListError`] with the line and what to write.
///
/// ```
/// let text = "kind,x [mm],y [mm],speed [mm/s]\nstart,0,0,\ncontour,10,0,1500\ncontour,10,10,\n";
/// let layers = meltpath_programs::vectors::parse(text).unwrap();
/// assert_eq!(layers[0].vectors[1].speed, Some(1500.0));
/// assert_eq!(layers[0].vectors[2].speed, None);
/// ```
pub fn parse(text: &str) -> Result<Vec<Layer>, VectorListError> {
    let mut lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(k, l)| (k + 1, l.split('#').next().unwrap_or("").trim_end()))
        .filter(|(_, l)| !l.trim().is_empty());
    let wrong = |line: usize| move |what: String| VectorListError { line, what };
    let (line, first) = lines
        .next()
        .ok_or_else(|| wrong(1)("the file is empty".to_owned()))?;
    let heading = Heading::parse(first).map_err(wrong(line))?;
    let mut layers: Vec<Layer> = Vec::new();
    for (line, text) in lines {
        take(&heading, text, &mut layers).map_err(wrong(line))?;
    }
    if layers.is_empty() {
        return Err(wrong(line)(
            "no vector follows the heading; the first is a `start`".to_owned(),
        ));
    }
    Ok(layers)
}

/// One line.
fn take(heading: &Heading, line: &str, layers: &mut Vec<Layer>) -> Result<(), String> {
    let all: Vec<&str> = line
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
    let kind = KINDS
        .iter()
        .find(|(_, w)| *w == word)
        .map(|(k, _)| *k)
        .ok_or_else(|| {
            let known = KINDS.map(|(_, w)| w).join(", ");
            format!("\"{word}\" is no kind of vector; there are {known}")
        })?;
    let needed = |column: usize| -> Result<f64, String> {
        fields
            .number(column)?
            .ok_or_else(|| format!("the column \"{}\" is blank", COLUMNS[column]))
    };
    let vector = Vector {
        kind,
        end: DVec3::new(needed(1)?, needed(2)?, fields.number(3)?.unwrap_or(0.0)),
        speed: fields.at_least(4, Bound::Above)?,
        power: fields.at_least(5, Bound::From)?,
        wait: fields.at_least(6, Bound::From)?,
        part: fields.count(7)?.unwrap_or(0),
    };
    let number = fields
        .count(8)?
        .or_else(|| layers.last().map(|l| l.number))
        .unwrap_or(1);
    let height = fields.number(9)?;
    let new = layers.last().is_none_or(|l| l.number != number);
    if new {
        if kind != Kind::Start {
            return Err(format!(
                "layer {number} begins with a `{word}`: it must begin with a `start` that says where the head stands"
            ));
        }
        if layers.iter().any(|l| l.number == number) {
            return Err(format!(
                "layer {number} comes again: its vectors must follow one another"
            ));
        }
        layers.push(Layer {
            number,
            height: height.unwrap_or(0.0),
            vectors: Vec::new(),
        });
    } else if kind == Kind::Start {
        return Err(format!(
            "layer {number} has a second `start`; go there by a `jump`"
        ));
    }
    let Some(layer) = layers.last_mut() else {
        return Ok(());
    };
    if height.is_some_and(|h| h != layer.height) {
        return Err(format!("layer {number} has two heights"));
    }
    layer.vectors.push(vector);
    Ok(())
}

/// Writes a vector list with every column.
pub fn write(layers: &[Layer]) -> String {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    let or_blank = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
    for layer in layers {
        for v in &layer.vectors {
            let (word, end) = (v.kind.word(), v.end);
            // writing into a string does not fail
            let _ = writeln!(
                text,
                "{word},{},{},{},{},{},{},{},{},{}",
                end.x,
                end.y,
                end.z,
                or_blank(v.speed),
                or_blank(v.power),
                or_blank(v.wait),
                v.part,
                layer.number,
                layer.height
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
            let error = parse(text).unwrap_err();
            assert_eq!(error.line, line, "{error}");
            assert!(error.what.contains(words), "{error}");
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(
            numbers in prop::collection::vec((-200.0..200.0f64, -200.0..200.0f64, 1usize..6, prop::option::of(1.0..9e3f64), 0u32..3), 1..40)
        ) {
            let mut layers = Vec::new();
            for (k, chunk) in numbers.chunks(7).enumerate() {
                let mut layer = Layer { number: k as u32 + 1, height: 0.03 * k as f64, vectors: Vec::new() };
                for (i, &(x, y, kind, speed, part)) in chunk.iter().enumerate() {
                    let kind = if i == 0 { Kind::Start } else { KINDS[kind].0 };
                    layer.vectors.push(Vector { kind, end: DVec3::new(x, y, 0.0), speed, power: speed, wait: speed, part });
                }
                layers.push(layer);
            }
            prop_assert_eq!(parse(&write(&layers)).unwrap(), layers);
        }

        #[test]
        fn nothing_panics(text in "(kind,x \\[mm\\],y \\[mm\\]\n)?[a-z0-9,.;#\n -]{0,200}") {
            let _ = parse(&text);
        }
    }
}
