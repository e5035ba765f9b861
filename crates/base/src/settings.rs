//! Settings declared once: a key's name, type, unit, range, default with its reason and one sentence stand in one place, as plain
//! data; files are read, the reference and the schema written, and provenance recorded from it.
//!
//! ```
//! use meltpath_base::{Length, Speed, settings};
//! meltpath_base::table! {
//!     /// How the beam fills the region.
//!     pub struct Hatch {
//!         /// Distance between neighbouring lines.
//!         spacing: Length where positive => default("0.125 mm", "49 J/mm³ at the usual beam");
//!         /// Speed of the beam.
//!         speed: Speed where positive => required;
//!     }
//! }
//! let read = settings::read::<Hatch>("speed = \"900 mm/s\"\n");
//! assert_eq!(read.settings.unwrap().spacing.0, 0.125);
//! let read = settings::read::<Hatch>("spacin = \"0,1 mm\"\nspacing = \"0,1 mm\"\n");
//! assert_eq!(read.problems.len(), 3); // an unknown key, a comma, a missing key
//! assert_eq!(read.problems[0].fix.as_deref(), Some("spacing"));
//! ```

mod declare;
mod listing;
mod ranged;
mod read;
mod reference;
mod schema;
mod sourced;
mod syntax;
mod under;
mod values;

use std::fmt;
use std::ops::{Deref, DerefMut, Range};
use std::sync::Arc;

pub use serde::{Serialize, Serializer};
pub use serde_json::Value as Json;

use crate::provenance::Provenance;
use crate::quantity::Unit;
use crate::resolved::{Origin, Resolved};

pub use listing::{listing, rounded};
pub use ranged::Ranged;
pub use read::{Keys, Node, Place, Reader, nearest};
pub use reference::reference;
pub use schema::schema;
pub use sourced::{Amount, Datum, Sourced, UnitOf};
pub use under::Under;
pub use values::{File, Many, quantity};

/// A table of settings.
#[derive(Debug, Clone, Copy)]
pub struct Table {
    /// What it is for.
    pub text: &'static str,
    /// Its keys, in the order of the reference.
    pub keys: &'static [Key],
}

/// A key of a table.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Its name in files.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub text: &'static str,
    /// What may be written.
    pub kind: Kind,
    /// Which numbers may be written, in internal units.
    pub bounds: Bounds,
    /// What holds where it is not written.
    pub fallback: Fallback,
}

/// What may be written for a key.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// A number with a unit, in quotes.
    Quantity {
        /// What it is, such as `length`.
        what: &'static str,
        /// The units, the usual one first.
        units: &'static [Unit],
    },
    /// A whole number from zero on.
    Count,
    /// A number without a unit.
    Number,
    /// A name, or a file of one's own.
    Text,
    /// A file, relative to the one it is named in.
    File,
    /// One of these words.
    Choice(&'static [Word]),
    /// This word, in place of what else may be written.
    Only(&'static str),
    /// One or the other.
    Either(&'static Kind, &'static Kind),
    /// Several of a kind.
    List {
        /// The kind.
        of: &'static Kind,
        /// How many at least.
        least: usize,
        /// How many at most.
        most: usize,
    },
    /// A table of its own.
    Table(Table),
    /// A number in a table with its source: the key `value`, what it means and who says so.
    Figure(Table),
    /// A unit's symbol.
    Unit(&'static [Unit]),
    /// A table whose keys are chosen by whoever writes the file, each of the same kind.
    Named(&'static Kind),
    /// One of several tables, as the word of a key says.
    OneOf {
        /// The key.
        by: &'static str,
        /// The words, each with its table.
        tables: &'static [(&'static str, Kind)],
    },
}

/// A word that may be written, and what it means.
#[derive(Debug, Clone, Copy)]
pub struct Word {
    /// As written.
    pub word: &'static str,
    /// What it means.
    pub text: &'static str,
}

/// Which numbers may be written, in internal units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The least.
    pub low: f64,
    /// Whether the least itself is excluded.
    pub above: bool,
    /// The greatest.
    pub high: f64,
}

impl Bounds {
    /// Any number.
    pub const fn any() -> Self {
        Self::within(f64::NEG_INFINITY, f64::INFINITY)
    }

    /// Above zero.
    pub const fn positive() -> Self {
        Bounds {
            above: true,
            ..Self::within(0.0, f64::INFINITY)
        }
    }

    /// Zero or above.
    pub const fn not_negative() -> Self {
        Self::within(0.0, f64::INFINITY)
    }

    /// Above zero, up to `high`.
    pub const fn up_to(high: f64) -> Self {
        Bounds {
            above: true,
            ..Self::within(0.0, high)
        }
    }

    /// From `low` to `high`, both included.
    pub const fn within(low: f64, high: f64) -> Self {
        Bounds {
            low,
            above: false,
            high,
        }
    }

    /// Whether a number lies in them.
    pub fn hold(self, number: f64) -> bool {
        let low_enough = if self.above {
            number > self.low
        } else {
            number >= self.low
        };
        low_enough && number <= self.high
    }

    /// In words, numbers told by `show`; empty where anything goes.
    pub fn words(self, show: impl Fn(f64) -> String) -> String {
        match (
            self.low.is_finite(),
            self.above || self.low != 0.0,
            self.high.is_finite(),
        ) {
            (false, _, false) => String::new(),
            (false, _, true) => format!("at most {}", show(self.high)),
            (true, ..) if self.low == self.high => show(self.low),
            (true, true, false) if !self.above => format!("at least {}", show(self.low)),
            (true, true, false) => format!("above {}", show(self.low)),
            (true, false, false) => "zero or above".to_owned(),
            (true, _, true) if self.above => {
                format!("above {}, at most {}", show(self.low), show(self.high))
            }
            (true, _, true) => format!("{} to {}", show(self.low), show(self.high)),
        }
    }
}

/// What holds where a key is not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fallback {
    /// It must be written.
    Required,
    /// A value.
    Default {
        /// As it would be written.
        toml: &'static str,
        /// Why this one.
        why: &'static str,
    },
    /// A value that a relation gives: which.
    Computed(&'static str),
    /// Nothing: what that means.
    None(&'static str),
}

/// Something wrong in a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Problem {
    /// The byte range concerned, where known.
    pub span: Option<Range<usize>>,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// What to write in place of the range, where that mends it.
    pub fix: Option<String>,
    /// The file, where it is not the one that is read, but one that it names.
    pub file: Option<Arc<FileText>>,
}

/// A file and what it holds, to show places in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileText {
    /// Its name.
    pub name: String,
    /// Its content.
    pub text: String,
}

impl FileText {
    /// Line and column of a byte, from 1.
    pub fn place(&self, byte: usize) -> (usize, usize) {
        let before = self.text.get(..byte).unwrap_or(&self.text);
        let line = before.rsplit('\n').next().unwrap_or_default();
        (1 + before.matches('\n').count(), 1 + line.chars().count())
    }
}

/// Everything wrong with a file.
#[derive(Debug, Clone, PartialEq, Default, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct Problems(
    /// Each.
    pub Vec<Problem>,
);

impl Problems {
    /// Problems of a file that another one names.
    #[must_use]
    pub fn of_file(mut self, name: &str, text: &str) -> Self {
        let file = Arc::new(FileText {
            name: name.to_owned(),
            text: text.to_owned(),
        });
        for problem in &mut self.0 {
            problem.file.get_or_insert_with(|| Arc::clone(&file));
        }
        self
    }
}

impl From<Problem> for Problems {
    fn from(problem: Problem) -> Self {
        Problems(vec![problem])
    }
}

impl From<Vec<Problem>> for Problems {
    fn from(problems: Vec<Problem>) -> Self {
        Problems(problems)
    }
}

impl Problem {
    /// A problem without a place.
    pub fn new(message: impl Into<String>) -> Self {
        Problem {
            message: message.into(),
            ..Self::default()
        }
    }

    /// With its place in the file, if there is one.
    #[must_use]
    pub fn at(self, span: impl Into<Option<Range<usize>>>) -> Self {
        Problem {
            span: span.into(),
            ..self
        }
    }

    /// With what to do about it.
    #[must_use]
    pub fn help(self, help: impl Into<String>) -> Self {
        Problem {
            help: Some(help.into()),
            ..self
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, &self.span) {
            (Some(file), Some(span)) => {
                let (line, column) = file.place(span.start);
                write!(f, "{}:{line}:{column}: ", file.name)?;
            }
            (Some(file), None) => write!(f, "{}: ", file.name)?,
            (None, _) => {}
        }
        f.write_str(&self.message)?;
        match &self.help {
            Some(help) => write!(f, "; {help}"),
            None => Ok(()),
        }
    }
}

/// The problems of the rules that are broken: each with whether it is, and what to tell then.
pub fn broken<const N: usize>(rules: [(bool, Problem); N]) -> Vec<Problem> {
    let broken = rules.into_iter().filter(|(broken, _)| *broken);
    broken.map(|(_, problem)| problem).collect()
}

/// The value of a key, its name and its place: written, or the default.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting<T> {
    /// The dotted name, such as `hatch.spacing`.
    pub name: String,
    /// The value.
    pub value: T,
    /// Where it is written; nowhere for a default.
    pub span: Option<Range<usize>>,
    /// The relation that gives it where nobody wrote it.
    relation: &'static str,
}

impl<T> Setting<T> {
    /// Whether the file says it.
    pub fn is_written(&self) -> bool {
        self.span.is_some()
    }

    /// A problem at this key.
    pub fn problem(&self, message: impl Into<String>) -> Problem {
        Problem::new(message).at(self.span.clone())
    }
}

impl<T> Deref for Setting<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for Setting<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Value + Clone> Setting<Option<T>> {
    /// The value written, or what the declared relation gives; recorded either way.
    pub fn or_computed(&self, provenance: &mut Provenance, value: T) -> T {
        let relation = Origin::Computed(self.relation.to_owned());
        self.or_from(provenance, value, relation)
    }

    /// The value written, or one of another origin; recorded either way. One that was put in later keeps the origin that was recorded with it.
    pub fn or_from(&self, provenance: &mut Provenance, value: T, origin: Origin) -> T {
        if let Some(put_in) = &self.value
            && !self.is_written()
            && provenance.parameters.contains_key(&self.name)
        {
            return put_in.clone();
        }
        let (value, origin) = match &self.value {
            Some(written) => (written.clone(), Origin::Job),
            None => (value, origin),
        };
        provenance.parameter(&self.name, &Resolved::new(value.json(), origin));
        value
    }
}

impl<T: Value> Setting<Option<T>> {
    /// The table written, or one of defaults, which are recorded.
    pub fn or_defaults(self, provenance: &mut Provenance) -> Option<T> {
        self.value.or_else(|| {
            let mut reader = Reader::default();
            let table = reader.defaults(&self.name);
            provenance.parameters.extend(reader.provenance.parameters);
            table
        })
    }
}

/// What a key may hold.
pub trait Value: Sized {
    /// What may be written.
    const KIND: Kind;

    /// Reads it; what is wrong goes to the reader.
    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self>;

    /// As recorded in the provenance: text with its unit.
    fn json(&self) -> Json;
}

/// What a file says.
#[derive(Debug, Clone)]
pub struct Read<T> {
    /// The settings, unless something required is missing or wrong. What else is wrong has its default.
    pub settings: Option<T>,
    /// Every value written and every default, with its origin.
    pub provenance: Provenance,
    /// The dotted names of keys that are written with a value that does not read.
    pub wrong_keys: Vec<String>,
    /// Everything wrong, in the order of the file.
    pub problems: Vec<Problem>,
}

/// Reads a file's text.
pub fn read<T: Value>(text: &str) -> Read<T> {
    read_over(text, None)
}

/// Reads a file's text over what holds where it says nothing.
///
/// ```
/// use meltpath_base::{Length, settings};
/// meltpath_base::table! {
///     /// A size.
///     pub struct Size {
///         /// One side.
///         x: Length => required;
///         /// The other.
///         y: Length => required;
///     }
/// }
/// let under = settings::Under { text: "x = \"1 mm\"\ny = \"2 mm\"", span: 0..3, mixed: &[] };
/// let size = settings::read_over::<Size>("x = \"5 mm\"", Some(&under)).settings.unwrap();
/// assert_eq!((size.x.0, size.y.0, size.y.span.clone()), (5.0, 2.0, Some(0..3)));
/// ```
pub fn read_over<T: Value>(text: &str, under: Option<&Under<'_>>) -> Read<T> {
    let mut reader = Reader::default();
    let settings = reader.document(text, under);
    reader
        .problems
        .sort_by_key(|p| p.span.as_ref().map_or(usize::MAX, |s| s.start));
    Read {
        settings,
        provenance: reader.provenance,
        wrong_keys: reader.wrong_keys,
        problems: reader.problems,
    }
}

/// Reads a file's text and checks what `check` says of its values.
///
/// # Errors
/// Everything wrong.
pub fn parse<T: Value>(text: &str, check: impl Fn(&T) -> Vec<Problem>) -> Result<T, Problems> {
    let read = read::<T>(text);
    let mut problems = read.problems;
    problems.extend(read.settings.iter().flat_map(check));
    match read.settings {
        Some(settings) if problems.is_empty() => Ok(settings),
        _ => Err(Problems(problems)),
    }
}

/// Reads one key of a file, or one table, and nothing else: `None` where it is not written.
///
/// # Errors
/// What is wrong with the file as TOML, or with the value.
pub fn peek<T: Value>(text: &str, path: &[&str]) -> Result<Option<T>, Problems> {
    let mut reader = Reader::default();
    let value = reader.peek(text, path);
    if reader.problems.is_empty() {
        Ok(value)
    } else {
        Err(Problems(reader.problems))
    }
}
