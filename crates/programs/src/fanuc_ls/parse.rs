//! A program from text. Never panics; what it does not know it keeps and lists.

use super::{line, positions};
use crate::parsed::{ParseError, Parsed, Unread, decoded};
use crate::program::{Attribute, Instruction, Program, Section};
use crate::scan::{strip_prefix, tidy};

/// Reads a program from the bytes of a file: UTF-8, else the Latin-1 of older controllers.
///
/// # Errors
/// [`ParseError`].
pub fn read(bytes: &[u8]) -> Result<Parsed, ParseError> {
    parse(&decoded(bytes))
}

/// The sections of a file.
enum Part {
    Attributes,
    Application,
    Main,
    Positions,
    Other,
}

/// Reads a program.
///
/// # Errors
/// [`ParseError`] with the line.
///
/// ```
/// let text = "/PROG DEMO\n/MN\n   1:L P[1] 75.0cm/min CNT50 ;\n/POS\nP[1]{\n GP1:\n\tUF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n\
///     \tX = 1.0 mm, Y = 2.0 mm, Z = 3.0 mm,\n\tW = 180.0 deg, P = 0.0 deg, R = 0.0 deg\n};\n/END\n";
/// let parsed = meltpath_programs::fanuc_ls::parse(text).unwrap();
/// assert_eq!(parsed.program.name, "DEMO");
/// assert_eq!(parsed.program.positions.len(), 1);
/// ```
pub fn parse(text: &str) -> Result<Parsed, ParseError> {
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = Reader {
        parsed: Parsed {
            program: Program::default(),
            lines: Vec::new(),
            unread: Vec::new(),
        },
        attributes: String::new(),
        statement: None,
        positions: String::new(),
        positions_line: 0,
    };
    let (mut part, mut number, mut begun) = (Part::Other, 0, false);
    for line in text.lines() {
        number += 1;
        let section = line.trim_start().strip_prefix('/');
        // in /MN a line may begin with // only after its number
        if let Some(header) = section.filter(|h| h.starts_with(|c: char| c.is_ascii_alphabetic())) {
            reader.close_statement();
            let header = header.trim();
            let name = header.split_whitespace().next().unwrap_or_default();
            match name.to_ascii_uppercase().as_str() {
                "PROG" if begun => return Err(ParseError::SecondProgram { line: number }),
                "PROG" => {
                    begun = true;
                    let mut words = header.split_whitespace().skip(1);
                    let program = &mut reader.parsed.program;
                    words
                        .next()
                        .unwrap_or_default()
                        .clone_into(&mut program.name);
                    program.kind = words.collect::<Vec<_>>().join(" ");
                    part = Part::Other;
                }
                _ if !begun => return Err(ParseError::NotAProgram),
                "ATTR" => part = Part::Attributes,
                "APPL" => part = Part::Application,
                "MN" => part = Part::Main,
                "POS" => {
                    part = Part::Positions;
                    reader.positions_line = number + 1;
                }
                "END" => return reader.finish(),
                _ => {
                    part = Part::Other;
                    reader.parsed.program.sections.push(Section {
                        name: tidy(header),
                        lines: Vec::new(),
                    });
                    reader.unread(number, line);
                }
            }
        } else if begun {
            reader.line(&part, number, line);
        } else if !line.trim().is_empty() {
            return Err(ParseError::NotAProgram);
        }
    }
    if begun {
        Err(ParseError::CutOff { line: number })
    } else {
        Err(ParseError::NotAProgram)
    }
}

struct Reader {
    parsed: Parsed,
    attributes: String,
    /// The statement being read, with its line in the file.
    statement: Option<(u32, String)>,
    positions: String,
    positions_line: u32,
}

impl Reader {
    fn unread(&mut self, line: u32, text: &str) {
        self.parsed.unread.push(Unread {
            line,
            text: tidy(text),
        });
    }

    fn line(&mut self, part: &Part, number: u32, line: &str) {
        match part {
            Part::Attributes => {
                self.attributes.push_str(line);
                self.attributes.push('\n');
            }
            Part::Application => {
                let line = line.trim_end();
                if !line.is_empty() {
                    self.parsed.program.application.push(line.to_owned());
                }
            }
            Part::Main => self.statement_line(number, line),
            Part::Positions => {
                self.positions.push_str(line);
                self.positions.push('\n');
            }
            Part::Other => {
                if let Some(section) = self.parsed.program.sections.last_mut() {
                    section.lines.push(line.trim_end().to_owned());
                } else if !line.trim().is_empty() {
                    self.unread(number, line);
                }
            }
        }
    }

    /// A line of `/MN`: `  12:L P[1] ...    ;`, or `    :  ...` that goes on with the statement before.
    fn statement_line(&mut self, number: u32, line: &str) {
        let trimmed = line.trim();
        let (before, content) = trimmed.split_once(':').unwrap_or(("", trimmed));
        let numbered = !before.is_empty() && before.bytes().all(|b| b.is_ascii_digit());
        let goes_on = trimmed.starts_with(':') && self.statement.is_some();
        let content = if numbered || trimmed.starts_with(':') {
            content
        } else {
            trimmed
        };
        if goes_on {
            if let Some((_, text)) = &mut self.statement {
                text.push(' ');
                text.push_str(content);
            }
        } else {
            self.close_statement();
            if trimmed.is_empty() {
                return;
            }
            self.statement = Some((number, content.to_owned()));
        }
        if content.trim_end().ends_with(';') {
            self.close_statement();
        }
    }

    fn close_statement(&mut self) {
        let Some((number, text)) = self.statement.take() else {
            return;
        };
        let text = text.trim_end();
        let text = text.strip_suffix(';').unwrap_or(text);
        let instruction = line::parse(text);
        if let Instruction::Raw(raw) = &instruction {
            let raw = raw.clone();
            self.unread(number, &raw);
        }
        self.parsed.program.instructions.push(instruction);
        self.parsed.lines.push(number);
    }

    fn finish(mut self) -> Result<Parsed, ParseError> {
        self.parsed.program.attributes = attributes(&self.attributes);
        let positions = positions::parse(&self.positions, self.positions_line)?;
        let mut seen = std::collections::BTreeSet::new();
        for position in &positions {
            if !seen.insert(position.index) {
                return Err(ParseError::RepeatedPosition {
                    index: position.index,
                });
            }
        }
        self.parsed.program.positions = positions;
        Ok(self.parsed)
    }
}

/// The entries of `/ATTR`: `KEY = VALUE;`, and the task description `TCD: KEY = VALUE, ...;` over several lines.
fn attributes(text: &str) -> Vec<Attribute> {
    let mut statements = vec![String::new()];
    for line in text.lines() {
        if let Some(statement) = statements.last_mut() {
            statement.push_str(line);
            statement.push(' ');
        }
        if line.trim_end().ends_with(';') {
            statements.push(String::new());
        }
    }
    let attribute = |statement: &String| {
        let statement = tidy(statement);
        let statement = statement.trim_end_matches([';', ' ']);
        if statement.is_empty() {
            return None;
        }
        let (key, value) = if let Some(rest) = strip_prefix(statement, "TCD:") {
            ("TCD", rest)
        } else {
            statement.split_once('=').unwrap_or((statement, ""))
        };
        Some(Attribute {
            key: key.trim().to_owned(),
            value: value.trim().to_owned(),
        })
    };
    statements.iter().filter_map(attribute).collect()
}
