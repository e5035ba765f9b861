//! Typed access to the attributes of an instance: every wrong kind is an error with its place.

use super::StepError;
use super::error::EntityPlace;
use super::exchange::{Exchange, Record, Run, Value};

/// One record of an instance: a simple instance has one, a complex instance several.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entity<'a> {
    file: &'a Exchange<'a>,
    position: usize,
    record: &'a Record,
    /// Attributes that a simple instance inherits before its own part: see [`Entity::part`].
    skip: usize,
}

/// A list attribute.
#[derive(Debug, Clone, Copy)]
pub(super) struct List<'a> {
    owner: Entity<'a>,
    attribute: usize,
    values: &'a [Value],
}

impl<'a> Entity<'a> {
    /// The instance at a position of the file's table, seen through its first record.
    pub(super) fn at(file: &'a Exchange<'a>, position: usize) -> Option<Self> {
        let instance = file.instances.get(position)?;
        Some(Self {
            file,
            position,
            record: file.records(instance).first()?,
            skip: 0,
        })
    }

    /// The instance number.
    pub(super) fn id(&self) -> u64 {
        self.file.instances[self.position].id
    }

    /// Every record of the instance.
    fn records(&self) -> &'a [Record] {
        self.file.records(&self.file.instances[self.position])
    }

    /// Where the instance stands and what it is.
    pub(super) fn place(&self) -> EntityPlace {
        let words: Vec<&str> = self
            .records()
            .iter()
            .map(|r| self.file.word(r.keyword))
            .collect();
        EntityPlace {
            keyword: words.join("+"),
            id: self.id(),
            line: self.file.line(self.file.instances[self.position].offset),
        }
    }

    /// Entity type of the record.
    pub(super) fn keyword(&self) -> &'a str {
        self.file.word(self.record.keyword)
    }

    /// Whether the instance is several records.
    pub(super) fn is_complex(&self) -> bool {
        self.records().len() > 1
    }

    /// Whether one of the records has this type.
    pub(super) fn has(&self, keyword: &str) -> bool {
        self.records()
            .iter()
            .any(|r| self.file.word(r.keyword) == keyword)
    }

    /// The part `keyword` of a complex instance, with attributes counted from its own first; for a
    /// simple instance (which inherits `skip` attributes before that part) the instance itself.
    pub(super) fn part(&self, keyword: &str, skip: usize) -> Option<Self> {
        if !self.is_complex() {
            return Some(Self { skip, ..*self });
        }
        self.exact(keyword)
    }

    /// The record of a complex or simple instance with exactly this type.
    pub(super) fn exact(&self, keyword: &str) -> Option<Self> {
        let record = self
            .records()
            .iter()
            .find(|r| self.file.word(r.keyword) == keyword)?;
        Some(Self {
            record,
            skip: 0,
            ..*self
        })
    }

    /// How many attributes are written.
    pub(super) fn attributes(&self) -> usize {
        self.file
            .values(self.record.attributes)
            .len()
            .saturating_sub(self.skip)
    }

    fn value(&self, attribute: usize) -> Value {
        self.file
            .values(self.record.attributes)
            .get(attribute + self.skip)
            .copied()
            .unwrap_or(Value::Omitted)
    }

    /// The error of attribute `attribute` (from 0) not being what it must be.
    pub(super) fn wrong(&self, attribute: usize, expected: &'static str) -> StepError {
        StepError::Attribute {
            entity: self.place(),
            attribute: attribute + self.skip + 1,
            expected,
        }
    }

    /// The error of geometry that means nothing.
    pub(super) fn degenerate(&self, what: impl Into<String>) -> StepError {
        StepError::Degenerate {
            entity: self.place(),
            what: what.into(),
        }
    }

    /// The error of an entity type that is not read.
    pub(super) fn unsupported(&self, role: &'static str, remedy: &'static str) -> StepError {
        StepError::Unsupported {
            entity: self.place(),
            role,
            remedy,
        }
    }

    /// The error of endless nesting.
    pub(super) fn cyclic(&self) -> StepError {
        StepError::Cyclic {
            entity: self.place(),
        }
    }

    /// A number.
    pub(super) fn real(&self, attribute: usize) -> Result<f64, StepError> {
        self.number(self.value(attribute))
            .ok_or_else(|| self.wrong(attribute, "a number"))
    }

    fn number(&self, value: Value) -> Option<f64> {
        match value {
            Value::Real(v) => Some(v),
            Value::Integer(v) => Some(v as f64),
            Value::Typed(run) => match *self.file.values(run) {
                [Value::Real(v)] => Some(v),
                [Value::Integer(v)] => Some(v as f64),
                _ => None,
            },
            _ => None,
        }
    }

    /// A number above zero.
    pub(super) fn positive(&self, attribute: usize) -> Result<f64, StepError> {
        let value = self.real(attribute)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(self.wrong(attribute, "a number above 0"))
        }
    }

    /// A small whole number, such as a degree.
    pub(super) fn count(&self, attribute: usize) -> Result<usize, StepError> {
        match self.value(attribute) {
            Value::Integer(v) => usize::try_from(v).ok(),
            _ => None,
        }
        .ok_or_else(|| self.wrong(attribute, "a whole number"))
    }

    /// `.T.` or `.F.`.
    pub(super) fn flag(&self, attribute: usize) -> Result<bool, StepError> {
        match self.enumeration(attribute) {
            Some("T") => Ok(true),
            Some("F") => Ok(false),
            _ => Err(self.wrong(attribute, ".T. or .F.")),
        }
    }

    /// An enumeration, without its dots.
    pub(super) fn enumeration(&self, attribute: usize) -> Option<&'a str> {
        match self.value(attribute) {
            Value::Enumeration(span) => Some(self.file.word(span)),
            _ => None,
        }
    }

    /// A string, decoded; empty if omitted.
    pub(super) fn text(&self, attribute: usize) -> String {
        match self.value(attribute) {
            Value::Text(span) => decode(self.file.bytes(span)),
            _ => String::new(),
        }
    }

    /// The instance that an attribute refers to.
    pub(super) fn reference(&self, attribute: usize) -> Result<Self, StepError> {
        match self.value(attribute) {
            Value::Reference(id) => self.follow(id),
            _ => Err(self.wrong(attribute, "a reference")),
        }
    }

    /// The instance that an attribute refers to, or `None` if it is omitted.
    pub(super) fn optional(&self, attribute: usize) -> Result<Option<Self>, StepError> {
        match self.value(attribute) {
            Value::Omitted | Value::Derived => Ok(None),
            _ => self.reference(attribute).map(Some),
        }
    }

    fn follow(&self, id: u64) -> Result<Self, StepError> {
        self.file
            .find(id)
            .and_then(|position| Self::at(self.file, position))
            .ok_or_else(|| StepError::Missing {
                from: self.place(),
                id,
            })
    }

    /// A list or set.
    pub(super) fn list(&self, attribute: usize) -> Result<List<'a>, StepError> {
        match self.value(attribute) {
            Value::List(run) => Ok(List::new(*self, attribute, run)),
            _ => Err(self.wrong(attribute, "a list")),
        }
    }

    /// A list or set of references.
    pub(super) fn references(&self, attribute: usize) -> Result<Vec<Self>, StepError> {
        self.list(attribute)?.references()
    }
}

impl<'a> List<'a> {
    fn new(owner: Entity<'a>, attribute: usize, run: Run) -> Self {
        Self {
            owner,
            attribute,
            values: owner.file.values(run),
        }
    }

    fn wrong(&self, expected: &'static str) -> StepError {
        self.owner.wrong(self.attribute, expected)
    }

    /// Every element as a reference.
    pub(super) fn references(&self) -> Result<Vec<Entity<'a>>, StepError> {
        self.values
            .iter()
            .map(|&value| match value {
                Value::Reference(id) => self.owner.follow(id),
                _ => Err(self.wrong("a list of references")),
            })
            .collect()
    }

    /// The elements that are references; the others are left out.
    pub(super) fn some_references(&self) -> Result<Vec<Entity<'a>>, StepError> {
        self.values
            .iter()
            .filter_map(|&value| match value {
                Value::Reference(id) => Some(self.owner.follow(id)),
                _ => None,
            })
            .collect()
    }

    /// The first number in the list, typed or not.
    pub(super) fn some_number(&self) -> Option<f64> {
        self.values
            .iter()
            .find_map(|&value| self.owner.number(value))
    }

    /// Every element as a number.
    pub(super) fn reals(&self) -> Result<Vec<f64>, StepError> {
        self.values
            .iter()
            .map(|&value| {
                self.owner
                    .number(value)
                    .ok_or_else(|| self.wrong("a list of numbers"))
            })
            .collect()
    }

    /// Every element as a whole number.
    pub(super) fn counts(&self) -> Result<Vec<usize>, StepError> {
        self.values
            .iter()
            .map(|&value| match value {
                Value::Integer(v) => usize::try_from(v).ok(),
                _ => None,
            })
            .map(|v| v.ok_or_else(|| self.wrong("a list of whole numbers")))
            .collect()
    }

    /// Every element as a list.
    pub(super) fn lists(&self) -> Result<Vec<List<'a>>, StepError> {
        self.values
            .iter()
            .map(|&value| match value {
                Value::List(run) => Ok(Self::new(self.owner, self.attribute, run)),
                _ => Err(self.wrong("a list of lists")),
            })
            .collect()
    }
}

/// Decodes a string of ISO 10303-21, clause 6.4.3: doubled apostrophes and backslashes, and the
/// `\S\`, `\X\`, `\X2\` and `\X4\` directives. What cannot be decoded is kept as it stands.
fn decode(raw: &[u8]) -> String {
    let text = String::from_utf8_lossy(raw).replace("''", "'");
    let mut out = String::with_capacity(text.len());
    let mut rest = text.as_str();
    while let Some(at) = rest.find(['\\', '\n', '\r']) {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        let taken = directive(rest, &mut out);
        if taken == 0 {
            let mut chars = rest.chars();
            // line breaks inside strings mean nothing
            out.extend(chars.next().filter(|c| *c == '\\'));
            rest = chars.as_str();
        } else {
            rest = rest.get(taken..).unwrap_or_default();
        }
    }
    out.push_str(rest);
    out
}

/// Decodes the directive that `rest` begins with and returns its length, 0 if there is none.
fn directive(rest: &str, out: &mut String) -> usize {
    if rest.starts_with("\\\\") {
        out.push('\\');
        return 2;
    }
    if let Some(tail) = rest.strip_prefix("\\S\\") {
        // the character 128 places on in the current part of ISO 8859; part 1 unless a page says otherwise
        return match tail.chars().next().filter(char::is_ascii) {
            Some(c) => {
                out.push(char::from(c as u8 + 128));
                4
            }
            None => 0,
        };
    }
    if rest.starts_with("\\P") && rest.as_bytes().get(3) == Some(&b'\\') {
        return 4;
    }
    if let Some(tail) = rest.strip_prefix("\\X\\") {
        return match tail.get(..2).and_then(|h| u8::from_str_radix(h, 16).ok()) {
            Some(code) => {
                out.push(char::from(code));
                5
            }
            None => 0,
        };
    }
    for (start, width) in [("\\X2\\", 4), ("\\X4\\", 8)] {
        if let Some(tail) = rest.strip_prefix(start) {
            let Some(len) = tail.find("\\X0\\") else {
                return 0;
            };
            let digits = &tail.as_bytes()[..len];
            let units: Option<Vec<u32>> = digits
                .chunks(width)
                .map(|c| u32::from_str_radix(std::str::from_utf8(c).ok()?, 16).ok())
                .collect();
            let Some(units) = units else { return 0 };
            if width == 4 {
                let utf16 = units.iter().map(|&u| u as u16);
                out.extend(
                    char::decode_utf16(utf16).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)),
                );
            } else {
                out.extend(
                    units
                        .iter()
                        .map(|&u| char::from_u32(u).unwrap_or(char::REPLACEMENT_CHARACTER)),
                );
            }
            return start.len() + len + 4;
        }
    }
    0
}

#[cfg(test)]
mod tests {
    use super::decode;

    #[test]
    fn strings_are_decoded() {
        assert_eq!(decode(b"it''s"), "it's");
        assert_eq!(decode(b"a\\\\b"), "a\\b");
        assert_eq!(decode(b"K\\X\\F6rper"), "Körper");
        assert_eq!(decode(b"\\X2\\03C003B1\\X0\\ rad"), "πα rad");
        assert_eq!(decode(b"\\X4\\0001F600\\X0\\"), "\u{1F600}");
        assert_eq!(decode(b"\\S\\D\\S\\"), "Ä\\S\\");
        assert_eq!(decode(b"\\PA\\x"), "x");
        assert_eq!(decode(b"two\r\nlines"), "twolines");
        assert_eq!(decode(b"\\X2\\zz\\X0\\"), "\\X2\\zz\\X0\\");
    }
}
