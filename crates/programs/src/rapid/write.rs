//! A program to RAPID.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use meltpath_toolpath::Weave;

use super::data::{WeldData, written, written_weave, written_weld};
use super::words::RapidWords;
use crate::collected::indexed;
use crate::held::Holds;
use crate::program::{
    ArcAction, Coordinates, Instruction, MotionInstruction, MotionKind, PositionRef, Program,
    Speed, SpeedUnit, TOOL, Termination, USER_FRAME,
};
use crate::written::{
    BETWEEN_MOVES, ENDING, GOES_ON, JUMP, Lines, TextFile, UNIT, WriteError, robot_places, short,
};

/// Speeds of reorientation (deg/s), of linear (mm/s) and of turning external axes (deg/s): those of ABB's predefined speeds.
const OTHER_SPEEDS: &str = "500,5000,1000";

/// The module of a program, with `\n` line ends: 1 µm and 0.0001°.
///
/// # Errors
/// [`WriteError`] where a number is not finite, or RAPID has no words for something.
pub fn write(program: &Program, words: &RapidWords) -> Result<Vec<TextFile>, WriteError> {
    let out = Lines::new(program, "    ")?;
    let data = program.sections.iter().flat_map(|s| &s.lines);
    let raw = program.instructions.iter().filter_map(|i| match i {
        Instruction::Raw(text) => Some(text),
        _ => None,
    });
    // a text that does not end would swallow the lines behind it
    if let Some(text) = data.chain(raw).find(|t| t.matches('"').count() % 2 == 1) {
        return Err(WriteError::Text {
            program: program.name.clone(),
            what: "a declaration or instruction",
            text: text.clone(),
        });
    }
    let mut writer = Writer {
        out,
        words,
        names: program
            .positions
            .iter()
            .map(|p| (p.index, p.name()))
            .collect(),
        arc: None,
        lists: robot_places(program, |g| (g.frame, g.tool)),
        speeds: Vec::new(),
        zones: Vec::new(),
        welds: Vec::new(),
        weave: None,
        weaves: Vec::new(),
    };
    for (at, instruction) in program.instructions.iter().enumerate() {
        writer.out.at = at;
        writer.instruction(instruction)?;
    }
    if writer.arc.is_some() {
        return Err(writer.out.no_words(GOES_ON));
    }
    let mut text = format!("MODULE m{}\n", program.name);
    // writing to a String cannot fail
    for position in &program.positions {
        if let Some((kind, value)) = position.robot().and_then(|g| written(&g.coordinates)) {
            let name = position.name();
            let _ = writeln!(text, "  LOCAL CONST {kind} {name}:={value};");
        }
    }
    for (i, speed) in writer.speeds.iter().enumerate() {
        let _ = writeln!(
            text,
            "  LOCAL CONST speeddata sp{}:=[{speed},{OTHER_SPEEDS}];",
            i + 1
        );
    }
    for (i, zone) in writer.zones.iter().enumerate() {
        let _ = writeln!(
            text,
            "  LOCAL CONST zonedata zn{}:=[FALSE,{zone},{zone},{zone},{zone},{zone},{zone}];",
            i + 1
        );
    }
    for (i, weld) in writer.welds.iter().enumerate() {
        let _ = writeln!(text, "  LOCAL PERS welddata wd{}:={weld};", i + 1);
    }
    for (i, weave) in writer.weaves.iter().enumerate() {
        let _ = writeln!(text, "  LOCAL PERS weavedata wv{}:={weave};", i + 1);
    }
    for line in program.sections.iter().flat_map(|s| &s.lines) {
        let _ = writeln!(text, "  {line}");
    }
    let _ = writeln!(text, "  PROC {}()", program.name);
    let switch = if monitored(program) { "On" } else { "Off" };
    let _ = writeln!(text, "    ConfJ\\{switch};\n    ConfL\\{switch};");
    text += &writer.out.text;
    text += "  ENDPROC\nENDMODULE\n";
    Ok(vec![TextFile {
        name: format!("{}.mod", program.name),
        text,
    }])
}

/// Whether every position says how the arm stands.
fn monitored(program: &Program) -> bool {
    let mut all = program.positions.iter().flat_map(|p| &p.groups).peekable();
    all.peek().is_some()
        && all.all(|g| match &g.coordinates {
            Coordinates::Cartesian { config, .. } => !config.is_empty(),
            _ => true,
        })
}

struct Writer<'a> {
    out: Lines<'a>,
    words: &'a RapidWords,
    names: BTreeMap<u32, String>,
    /// The arc word that is on.
    arc: Option<String>,
    /// Frame and tool of each position.
    lists: BTreeMap<u32, (Option<u32>, Option<u32>)>,
    speeds: Vec<String>,
    zones: Vec<String>,
    welds: Vec<String>,
    /// The weave that is on.
    weave: Option<Weave>,
    weaves: Vec<String>,
}

/// The name of a value among those declared; it is added where it is new.
fn declared(all: &mut Vec<String>, prefix: &str, value: String) -> String {
    format!("{prefix}{}", indexed(all, value) + 1)
}

impl Writer<'_> {
    fn instruction(&mut self, instruction: &Instruction) -> Result<(), WriteError> {
        match instruction {
            Instruction::Motion(motion) => self.motion(motion)?,
            Instruction::Wait(_) if self.arc.is_some() => {
                return Err(self.out.no_words((
                    "a wait with the arc on",
                    "plan without dwells in beads: the seam data of the controller fill the crater",
                )));
            }
            Instruction::Arc(_) => return Err(self.out.no_words(BETWEEN_MOVES)),
            // moves name it
            Instruction::Weave(weave) => self.weave = *weave,
            Instruction::Wait(seconds) => {
                self.out.line(&format!("WaitTime {};", short(*seconds, 3)));
            }
            Instruction::Holds(Holds::Part) => self.stands()?,
            // moves name their work object and tool
            Instruction::UserFrame(_)
            | Instruction::ToolFrame(_)
            | Instruction::Holds(_)
            | Instruction::Blank => {}
            Instruction::Call { program, arguments } if arguments.is_empty() => {
                self.out.line(&format!("{program};"));
            }
            Instruction::Call { program, arguments } => {
                self.out.line(&format!("{program} {arguments};"));
            }
            Instruction::Comment { text, .. } => self.out.line(&format!("!{text}")),
            Instruction::End => self.out.line("RETURN;"),
            Instruction::Raw(text) if super::statements::ends_itself(text) => self.out.line(text),
            Instruction::Raw(text) => self.out.line(&format!("{text};")),
            Instruction::Label { .. } | Instruction::Jump(_) => {
                return Err(self.out.no_words(JUMP));
            }
        }
        Ok(())
    }

    /// Ends the program where the controller's data say otherwise than that the torch stands.
    fn stands(&mut self) -> Result<(), WriteError> {
        let next = self.out.coming().iter().find_map(|i| match i {
            Instruction::Motion(motion) => Some(&motion.target),
            _ => None,
        });
        let (tool, object) = self.named(next);
        if tool == "tool0" || object == "wobj0" {
            return Err(self.out.no_words((
                "a torch that stands, with tool0 or wobj0,",
                "name data of the controller: program.rapid.tool and program.rapid.work_object of the cell file",
            )));
        }
        let line = format!("IF {tool}.robhold OR NOT {object}.robhold EXIT;");
        self.out.line(&line);
        Ok(())
    }

    /// Tool and work object that a position is told with, by their names.
    fn named(&self, target: Option<&PositionRef>) -> (String, String) {
        let (frame, tool) = match target {
            Some(PositionRef::Point { index, .. }) => {
                self.lists.get(index).copied().unwrap_or_default()
            }
            Some(PositionRef::Unresolved(_)) | None => (None, None),
        };
        let named = |what: &str, number: Option<u32>, else_: &str| {
            let key = format!("{what} {}", number.unwrap_or(0));
            self.out.program.attribute(&key).unwrap_or(else_).to_owned()
        };
        (
            named(TOOL, tool, &self.words.tool),
            named(USER_FRAME, frame, &self.words.work_object),
        )
    }

    /// Tool and work object of a move.
    fn tool(&self, motion: &MotionInstruction) -> String {
        let (tool, object) = self.named(Some(&motion.target));
        let object = if object == "wobj0" {
            String::new()
        } else {
            format!("\\WObj:={object}")
        };
        format!("{tool}{object}{}", motion.extra.concat())
    }

    fn motion(&mut self, motion: &MotionInstruction) -> Result<(), WriteError> {
        let target = self.out.place(&self.names, &motion.target)?;
        let zone = match &motion.termination {
            Termination::Fine => "fine".to_owned(),
            Termination::Blend(distance) => declared(&mut self.zones, "zn", short(*distance, 3)),
            Termination::Other(word) => word.clone(),
            Termination::Cnt(_) | Termination::CntRegister(_) => {
                return Err(self.out.no_words(ENDING));
            }
        };
        let millimetres = match &motion.speed {
            Speed::Maximum | Speed::Weld | Speed::Other(_) => None,
            given => match given.given_in(SpeedUnit::MillimetrePerSecond) {
                Some(value) => Some(value),
                None => return Err(self.out.no_words(UNIT)),
            },
        };
        let speed = match millimetres {
            Some(value) => declared(&mut self.speeds, "sp", short(value, 3)),
            None => "vmax".to_owned(),
        };
        let tool = self.tool(motion);
        let before = self.arc.clone();
        let after = match motion.arc.as_ref().map(|w| w.action) {
            Some(ArcAction::End) => None,
            Some(ArcAction::Start) => motion.arc.as_ref().map(|w| w.arguments.clone()),
            None => before.clone(),
        };
        let path = match &motion.kind {
            MotionKind::Joint if before.is_none() && after.is_none() => {
                let joint = self.is_joint(&motion.target);
                let verb = if joint { "MoveAbsJ" } else { "MoveJ" };
                self.out
                    .line(&format!("{verb} {target},{speed},{zone},{tool};"));
                return Ok(());
            }
            MotionKind::Linear => ("L", target),
            MotionKind::Circular { via } => (
                "C",
                format!("{},{target}", self.out.place(&self.names, via)?),
            ),
            MotionKind::Joint | MotionKind::CircleArc => {
                return Err(self.out.no_words((
                    "this kind of move",
                    "write it straight, or round with its via point",
                )));
            }
        };
        let (letter, targets) = path;
        let stage = match (&before, &after) {
            (None, None) => {
                let word = motion.arc.as_ref();
                if word.is_some() {
                    return Err(self.out.no_words(GOES_ON));
                }
                self.out
                    .line(&format!("Move{letter} {targets},{speed},{zone},{tool};"));
                return Ok(());
            }
            (None, Some(_)) => "Start",
            (Some(_), Some(_)) => "",
            (Some(_), None) => "End",
        };
        // a move is laid with its own weld data; the first is struck with those of the next
        let (arguments, laid, weave) = match before {
            Some(arguments) => (arguments, millimetres, self.weave),
            None => (
                after.clone().unwrap_or_default(),
                self.next_speed(),
                self.out.coming_weave(self.weave),
            ),
        };
        let weave = weave.zip(laid).map_or_else(String::new, |(weave, speed)| {
            let value = written_weave(&weave, speed, *self.words.weave_type);
            format!("\\Weave:={}", declared(&mut self.weaves, "wv", value))
        });
        let weld = self.weld(arguments, laid)?;
        let seam = self
            .out
            .program
            .attribute("SEAM")
            .unwrap_or(&self.words.seam);
        let line =
            format!("Arc{letter}{stage} {targets},{speed},{seam},{weld}{weave},{zone},{tool};");
        self.out.line(&line);
        self.arc = after;
        Ok(())
    }

    fn is_joint(&self, reference: &PositionRef) -> bool {
        let PositionRef::Point { index, .. } = reference else {
            return false;
        };
        let mut found = self
            .out
            .program
            .positions
            .iter()
            .filter(|p| p.index == *index);
        found.any(|p| {
            p.robot()
                .is_some_and(|g| matches!(g.coordinates, Coordinates::Joint(_)))
        })
    }

    fn next_speed(&self) -> Option<f64> {
        self.out.coming().iter().find_map(|i| match i {
            Instruction::Motion(m) => m.speed.given_in(SpeedUnit::MillimetrePerSecond),
            _ => None,
        })
    }

    fn weld(&mut self, arguments: String, speed: Option<f64>) -> Result<String, WriteError> {
        let Some(speed) = speed else {
            return Err(self.out.no_words(GOES_ON));
        };
        let Some(value) = written_weld(&WeldData { arguments, speed }) else {
            return Err(self.out.no_words((
                "an arc word of other than at most nine numbers",
                "list what arcdata holds (sched, mode, voltage, wirefeed, …) as the values of the cell's [[program.schedule]]",
            )));
        };
        Ok(declared(&mut self.welds, "wd", value))
    }
}
