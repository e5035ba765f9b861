//! Putting instructions and points into programs of limited size, with a main program that calls them.

use meltpath_geometry::math::DVec3;

use crate::cell::CellProgramming;
use crate::krl;
use crate::program::{
    Attribute, CommentMark, Coordinates, Dialect, Group, Instruction, Position, PositionRef,
    Program,
};

/// Longest comment that the controller shows.
const COMMENT: usize = 32;

/// Programs under construction.
#[derive(Debug)]
pub struct Assembly<'a> {
    cell: &'a CellProgramming,
    dialect: Dialect,
    name: String,
    comment: String,
    done: Vec<Program>,
    current: Program,
    /// Instructions that every program begins with.
    head: usize,
}

/// A name that the controller takes: capital letters, digits and `_`, a letter first, no longer than `length`.
///
/// ```
/// use meltpath_programs::assembly::name;
/// assert_eq!(name("ribbed bracket-2.step", 32), "RIBBED_BRACKET_2_STEP");
/// assert_eq!(name("2nd", 8), "P2ND");
/// assert_eq!(name("flange with holes", 8), "FLANGE_W");
/// ```
pub fn name(text: &str, length: usize) -> String {
    let mut name = String::new();
    for c in text.chars() {
        let c = if c.is_ascii_alphanumeric() { c } else { '_' };
        if c != '_' || (!name.is_empty() && !name.ends_with('_')) {
            name.push(c.to_ascii_uppercase());
        }
    }
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name.insert(0, 'P');
    }
    name.truncate(length);
    name.trim_end_matches('_').to_owned()
}

/// A comment as long as the controller shows, on one line.
pub fn comment(text: &str) -> Instruction {
    let text = text.chars().filter(|c| c.is_ascii() && !c.is_control());
    Instruction::Comment {
        mark: CommentMark::Remark,
        text: text.take(COMMENT).collect(),
    }
}

impl<'a> Assembly<'a> {
    /// Begins programs called after `title`.
    pub fn new(cell: &'a CellProgramming, dialect: Dialect, title: &str, comment: &str) -> Self {
        let mut assembly = Assembly {
            cell,
            dialect,
            name: name(title, *cell.name_length),
            comment: comment.to_owned(),
            done: Vec::new(),
            current: Program::default(),
            head: 0,
        };
        assembly.begin();
        assembly
    }

    fn begin(&mut self) {
        self.current = empty(self.cell, self.dialect);
        self.head = self.current.instructions.len();
    }

    /// Whether the current program takes `lines` more instructions and `points` more positions.
    pub fn takes(&self, lines: usize, points: usize) -> bool {
        // a script calls no other file, and a project has one of data
        matches!(self.dialect, Dialect::UrScript | Dialect::Val3)
            || (self.current.instructions.len() + lines <= *self.cell.lines_per_program
                && self.current.positions.len() + points <= *self.cell.points_per_program)
    }

    /// Ends the current program and begins the next; nothing where the current one is empty.
    pub fn cut(&mut self) {
        if self.current.instructions.len() > self.head {
            let full = std::mem::take(&mut self.current);
            self.done.push(full);
            self.begin();
        }
    }

    /// Adds an instruction.
    pub fn push(&mut self, instruction: Instruction) {
        self.current.instructions.push(instruction);
    }

    /// Adds a point of the part, mm, with W, P, R in degrees.
    pub fn point(&mut self, position: DVec3, wpr_degrees: [f64; 3]) -> PositionRef {
        let index = self.current.positions.len() as u32 + 1;
        self.current.positions.push(Position {
            index,
            comment: None,
            groups: vec![Group {
                number: 1,
                frame: Some(*self.cell.user_frame),
                tool: Some(*self.cell.tool_frame),
                coordinates: Coordinates::Cartesian {
                    config: match self.dialect {
                        Dialect::FanucLs => self.cell.config.value.clone(),
                        _ => String::new(),
                    },
                    xyz: position.to_array(),
                    wpr_degrees,
                    external: Vec::new(),
                },
            }],
        });
        PositionRef::point(index)
    }

    /// The programs, main first; one alone where all fits.
    pub fn finish(mut self) -> Vec<Program> {
        self.cut();
        let mut parts = std::mem::take(&mut self.done);
        if parts.is_empty() {
            parts.push(std::mem::take(&mut self.current));
        }
        let (cell, comment) = (self.cell, &self.comment);
        let attributes = |program: &Program| match self.dialect {
            Dialect::FanucLs => attributes(cell, comment, program),
            _ => Vec::new(),
        };
        if let [only] = &mut parts[..] {
            only.name = self.name;
            only.attributes = attributes(only);
            return parts;
        }
        let digits = parts.len().to_string().len().max(2);
        let room = cell.name_length.saturating_sub(digits + 1);
        let stem = self.name.get(..room).unwrap_or(&self.name);
        let stem = stem.trim_end_matches('_');
        for (i, part) in parts.iter_mut().enumerate() {
            part.name = format!("{stem}_{:0digits$}", i + 1);
            part.attributes = attributes(part);
        }
        let mut main = Program {
            name: self.name.clone(),
            ..empty(cell, self.dialect)
        };
        main.instructions
            .extend(parts.iter().map(|p| Instruction::Call {
                program: p.name.clone(),
                arguments: String::new(),
            }));
        main.attributes = attributes(&main);
        parts.insert(0, main);
        parts
    }
}

/// What every program begins with.
fn empty(cell: &CellProgramming, dialect: Dialect) -> Program {
    let frames = [
        Instruction::UserFrame(*cell.user_frame),
        Instruction::ToolFrame(*cell.tool_frame),
    ];
    let (application, opening) = match dialect {
        Dialect::FanucLs => (cell.application.value.clone(), Vec::new()),
        Dialect::Krl => (Vec::new(), krl::opening()),
        _ => (Vec::new(), Vec::new()),
    };
    Program {
        dialect,
        application,
        instructions: opening.into_iter().chain(frames).collect(),
        ..Program::default()
    }
}

/// The header; the controller fills sizes and dates in when it loads the program.
fn attributes(cell: &CellProgramming, comment: &str, program: &Program) -> Vec<Attribute> {
    let lines = program.instructions.len().to_string();
    let text: String = comment
        .chars()
        .filter(|c| c.is_ascii() && !c.is_control() && !matches!(c, '"' | ';'))
        .take(16)
        .collect();
    let entries = [
        ("OWNER", cell.owner.as_str()),
        ("COMMENT", &format!("\"{text}\"")),
        ("PROG_SIZE", "0"),
        ("FILE_NAME", ""),
        ("VERSION", "0"),
        ("LINE_COUNT", &lines),
        ("MEMORY_SIZE", "0"),
        ("PROTECT", "READ_WRITE"),
        (
            "TCD",
            "STACK_SIZE = 0, TASK_PRIORITY = 50, TIME_SLICE = 0, BUSY_LAMP_OFF = 0, ABORT_REQUEST = 0, PAUSE_REQUEST = 0",
        ),
        ("DEFAULT_GROUP", &cell.default_group),
        ("CONTROL_CODE", "00000000 00000000"),
    ];
    let attribute = |(key, value): (&str, &str)| Attribute {
        key: key.to_owned(),
        value: value.to_owned(),
    };
    entries.into_iter().map(attribute).collect()
}
