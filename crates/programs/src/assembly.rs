//! Putting instructions and points into programs of limited size, with a main program that calls them.

use meltpath_geometry::math::DVec3;

use crate::cell::CellProgramming;
use crate::held::{Holds, Standing};
use crate::krl;
use crate::positioner::Positioner;
use crate::program::{
    Attribute, Axis, CommentMark, Coordinates, Dialect, Group, Instruction, Position, PositionRef,
    Program,
};
use crate::rapid;
use crate::reserved::is_reserved;
use crate::track::Track;

/// Longest comment that the controller shows.
const COMMENT: usize = 32;

/// Programs under construction.
#[derive(Debug)]
pub struct Assembly<'a> {
    cell: &'a CellProgramming,
    dialect: Dialect,
    name: String,
    comment: String,
    done: Vec<Part>,
    current: Part,
    /// Instructions that every program begins with.
    head: usize,
    /// What carries the arm, and what turns the part.
    track: Option<&'a Track>,
    positioner: Option<&'a Positioner>,
    /// Where everything stands while the robot holds the part; nothing where it holds the torch.
    standing: Option<Standing>,
}

/// A program that a main program calls.
#[derive(Debug, Default)]
struct Part {
    program: Program,
    /// What the main program does before it.
    before: Vec<Instruction>,
    /// Its layer, where programs are cut at layers.
    layer: Option<u32>,
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

/// The [`name`] of a program, with `P_` before it where it is a word of the dialect.
fn own_name(title: &str, dialect: Dialect, length: usize) -> String {
    let plain = name(title, length);
    if is_reserved(dialect, &plain) {
        name(&format!("P_{plain}"), length)
    } else {
        plain
    }
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
    /// Begins programs called after `title`, and `variant` where they are not the whole of it.
    pub fn new(
        cell: &'a CellProgramming,
        dialect: Dialect,
        (title, variant): (&str, &str),
        comment: &str,
    ) -> Self {
        let name = own_name(title, dialect, *cell.name_length);
        let mut assembly = Assembly {
            cell,
            dialect,
            name: named(&name, variant, *cell.name_length),
            comment: comment.to_owned(),
            done: Vec::new(),
            current: Part::default(),
            head: 0,
            track: None,
            positioner: None,
            standing: None,
        };
        assembly.begin();
        assembly
    }

    /// With a track and a positioner that move with the arm; to be called before anything is added.
    #[must_use]
    pub fn coordinated(
        mut self,
        (track, positioner): (Option<&'a Track>, Option<&'a Positioner>),
    ) -> Self {
        (self.track, self.positioner) = (track, positioner);
        self.begin();
        self
    }

    /// With the part on the robot, where that is said; to be called before anything is added.
    #[must_use]
    pub fn standing(mut self, standing: Option<Standing>) -> Self {
        self.standing = standing;
        self.begin();
        self
    }

    /// The mechanical units that move with the arm, as an ABB calls them.
    fn units(&self) -> Vec<&'a String> {
        let track = self.track.and_then(|t| t.unit.as_ref());
        let positioner = self.positioner.and_then(|p| p.unit.as_ref());
        track.into_iter().chain(positioner).collect()
    }

    /// What every program begins with.
    fn empty(&self) -> Program {
        let numbers = (*self.cell.user_frame, *self.cell.tool_frame);
        let frames = [
            Instruction::UserFrame(numbers.0),
            Instruction::ToolFrame(numbers.1),
        ];
        let (application, opening) = match self.dialect {
            Dialect::FanucLs => (self.cell.application.value.clone(), Vec::new()),
            Dialect::Krl => (Vec::new(), krl::opening()),
            Dialect::Rapid => {
                let active = self
                    .units()
                    .into_iter()
                    .map(|unit| Instruction::Raw(format!("ActUnit {unit}")));
                (Vec::new(), active.collect())
            }
            _ => (Vec::new(), Vec::new()),
        };
        let all = opening.into_iter().chain(frames).chain(self.held());
        Program {
            dialect: self.dialect,
            application,
            instructions: all.collect(),
            ..Program::default()
        }
    }

    /// What programs say where the robot holds the part, in dialects that have words for it.
    fn held(&self) -> Vec<Instruction> {
        let told = match (&self.standing, self.dialect, self.cell.rapid.as_ref()) {
            (Some(standing), Dialect::Krl, _) => {
                let numbers = (*self.cell.user_frame, *self.cell.tool_frame);
                krl::standing(standing, numbers)
            }
            (Some(standing), Dialect::Rapid, Some(words)) => rapid::standing(standing, words),
            // its data say where part and torch are
            (Some(_), Dialect::Val3, _) => return vec![Instruction::Holds(Holds::Part)],
            _ => return Vec::new(),
        };
        let remark = |text| Instruction::Comment {
            mark: CommentMark::Remark,
            text,
        };
        let told = told.into_iter().map(remark);
        told.chain([Instruction::Holds(Holds::Part)]).collect()
    }

    fn begin(&mut self) {
        self.current.program = self.empty();
        self.head = self.current.program.instructions.len();
    }

    /// Whether a main program calls others: a script calls no other file, and a project has one of data.
    fn calls_others(&self) -> bool {
        !matches!(self.dialect, Dialect::UrScript | Dialect::Val3)
    }

    /// Whether the current program takes `lines` more instructions and `points` more positions.
    pub fn takes(&self, lines: usize, points: usize) -> bool {
        let program = &self.current.program;
        !self.calls_others()
            || (program.instructions.len() + lines <= *self.cell.lines_per_program
                && program.positions.len() + points <= *self.cell.points_per_program)
    }

    /// Ends the current program and begins the next; nothing where the current one is empty.
    pub fn cut(&mut self) {
        if self.current.program.instructions.len() > self.head {
            let layer = self.current.layer;
            let full = std::mem::take(&mut self.current);
            self.done.push(full);
            self.begin();
            self.current.layer = layer;
        }
    }

    /// Begins a program of its own for a layer, before which the main program does `before`.
    pub fn layer(&mut self, layer: u32, before: Vec<Instruction>) {
        if self.calls_others() {
            self.cut();
            self.current.layer = Some(layer);
            self.current.before = before;
        } else {
            self.current.program.instructions.extend(before);
        }
    }

    /// Adds an instruction.
    pub fn push(&mut self, instruction: Instruction) {
        self.current.program.instructions.push(instruction);
    }

    /// Adds a point of the part, mm, with W, P, R in degrees, and where track, mm, and positioner's axes, degrees, stand there.
    pub fn point(&mut self, position: DVec3, wpr_degrees: [f64; 3], axes: &[f64]) -> PositionRef {
        let named = |values: &[f64], name: fn(usize) -> String, unit: &str| -> Vec<Axis> {
            let named = values.iter().enumerate().map(|(i, value)| Axis {
                name: name(i),
                value: *value,
                unit: unit.to_owned(),
            });
            named.collect()
        };
        let (frame, tool) = (Some(*self.cell.user_frame), Some(*self.cell.tool_frame));
        let mut further = None;
        let external = match self.dialect {
            Dialect::Krl => named(axes, |i| format!("E{}", i + 1), ""),
            Dialect::Rapid => named(axes, |i| format!("eax_{}", char::from(b'a' + i as u8)), ""),
            _ => {
                let slides = usize::from(self.track.is_some()).min(axes.len());
                let (track, turning) = axes.split_at(slides);
                further = self.positioner.map(|p| Group {
                    number: *p.group,
                    frame,
                    tool,
                    coordinates: Coordinates::Joint(named(
                        turning,
                        |i| format!("J{}", i + 1),
                        "deg",
                    )),
                });
                named(track, |i| format!("E{}", i + 1), "mm")
            }
        };
        let index = self.current.program.positions.len() as u32 + 1;
        self.current.program.positions.push(Position {
            index,
            comment: None,
            groups: std::iter::once(Group {
                number: 1,
                frame,
                tool,
                coordinates: Coordinates::Cartesian {
                    config: match self.dialect {
                        Dialect::FanucLs => self.cell.config.value.clone(),
                        _ => String::new(),
                    },
                    xyz: position.to_array(),
                    wpr_degrees,
                    external,
                },
            })
            .chain(further)
            .collect(),
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
        let (cell, comment, positioner) = (self.cell, &self.comment, self.positioner);
        let attributes = |program: &Program| match (self.dialect, positioner) {
            (Dialect::FanucLs, _) => attributes(
                comment,
                program,
                cell.owner.as_str(),
                &groups(cell, positioner),
            ),
            (Dialect::Krl, Some(positioner)) => vec![krl::coupled(*positioner.machine)],
            _ => Vec::new(),
        };
        if let [only] = &mut parts[..] {
            let before = std::mem::take(&mut only.before);
            let mut only = std::mem::take(&mut only.program);
            only.instructions.splice(self.head..self.head, before);
            only.name = self.name;
            only.attributes = attributes(&only);
            return vec![only];
        }
        let labels = labels(&parts);
        let mut main = Program {
            name: self.name.clone(),
            ..self.empty()
        };
        let mut programs = Vec::with_capacity(parts.len() + 1);
        for (part, label) in parts.into_iter().zip(labels) {
            let mut program = part.program;
            program.name = named(&self.name, &label, *cell.name_length);
            program.attributes = attributes(&program);
            main.instructions.extend(part.before);
            main.instructions.push(Instruction::Call {
                program: program.name.clone(),
                arguments: String::new(),
            });
            programs.push(program);
        }
        main.attributes = attributes(&main);
        programs.insert(0, main);
        programs
    }
}

/// What tells parts apart in their names: their number, or their layer and their number in it.
fn labels(parts: &[Part]) -> Vec<String> {
    let digits = |greatest: usize, least: usize| greatest.to_string().len().max(least);
    let width = digits(parts.len(), 2);
    let highest = parts.iter().filter_map(|p| p.layer).max().unwrap_or(0);
    let layer_width = digits(highest as usize, 3);
    let mut last = (None, 0);
    let label = |(i, part): (usize, &Part)| {
        let Some(layer) = part.layer else {
            return format!("{:0width$}", i + 1);
        };
        let of_layer = if last.0 == Some(layer) { last.1 + 1 } else { 1 };
        last = (Some(layer), of_layer);
        match of_layer {
            1 => format!("L{layer:0layer_width$}"),
            n => format!("L{layer:0layer_width$}_{n}"),
        }
    };
    parts.iter().enumerate().map(label).collect()
}

/// `name` with what tells it from others behind it, no longer than `length`.
fn named(name: &str, label: &str, length: usize) -> String {
    if label.is_empty() {
        return name.to_owned();
    }
    let room = length.saturating_sub(label.len() + 1);
    let stem = name.get(..room).unwrap_or(name);
    format!("{}_{label}", stem.trim_end_matches('_'))
}

/// The motion groups of the header, the positioner's among them.
fn groups(cell: &CellProgramming, positioner: Option<&Positioner>) -> String {
    let own = positioner.map(|p| *p.group as usize);
    let group = |(i, word): (usize, &str)| match own {
        Some(group) if group == i + 1 => "1".to_owned(),
        _ => word.to_owned(),
    };
    let all = cell.default_group.split(',').enumerate().map(group);
    all.collect::<Vec<_>>().join(",")
}

/// The header; the controller fills sizes and dates in when it loads the program.
fn attributes(comment: &str, program: &Program, owner: &str, groups: &str) -> Vec<Attribute> {
    let lines = program.instructions.len().to_string();
    let text: String = comment
        .chars()
        .filter(|c| c.is_ascii() && !c.is_control() && !matches!(c, '"' | ';'))
        .take(16)
        .collect();
    let entries = [
        ("OWNER", owner),
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
        ("DEFAULT_GROUP", groups),
        ("CONTROL_CODE", "00000000 00000000"),
    ];
    let attribute = |(key, value): (&str, &str)| Attribute {
        key: key.to_owned(),
        value: value.to_owned(),
    };
    entries.into_iter().map(attribute).collect()
}
