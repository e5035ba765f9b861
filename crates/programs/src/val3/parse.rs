//! A program from VAL3. Never panics; what it does not know it keeps and lists.

use super::data::{Data, Descriptor, PART, TORCH, whole};
use super::words::Val3Words;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use crate::acceleration::Acceleration;
use crate::collected::Collected;
use crate::collected::indexed;
use crate::held::Holds;
use crate::orientation;
use crate::parsed::{ParseError, Parsed, decoded};
use crate::program::{
    Coordinates, Dialect, Instruction, JOINTS_AT, MotionKind, PositionRef, Speed, TOOL,
    Termination, USER_FRAME,
};
use crate::said_frames::Which;
use crate::scan::{called, duration, first_word, routine_name, strip_word, tidy};

/// Reads a program with the data of its project; `words` say what switches the arc.
///
/// # Errors
/// [`ParseError`] where the text has no program, or it does not end.
pub fn read(
    source: &[u8],
    data: Option<&[u8]>,
    words: Option<&Val3Words>,
) -> Result<Vec<Parsed>, ParseError> {
    let text = decoded(source);
    let none = || ParseError::Other {
        dialect: "Stäubli",
        wanted: "<Program name=…> with its code",
    };
    let (_, name) = text.split_once("<Program name=\"").ok_or_else(none)?;
    let (name, _) = name.split_once('"').ok_or_else(none)?;
    let name = routine_name(name).ok_or_else(none)?;
    let (head, code) = text.split_once("<![CDATA[").ok_or_else(none)?;
    let mut reader = Reader {
        out: Collected::new(Dialect::Val3, name),
        words,
        data: match data {
            Some(data) => Data::read(&decoded(data))?,
            None => Data::default(),
        },
        frames: Vec::new(),
        tools: Vec::new(),
        holds: Holds::Torch,
        arc: None,
        queued: false,
        waited: false,
        depth: 0,
    };
    let first = head.matches('\n').count() as u32 + 1;
    let lines: Vec<&str> = code.lines().map(str::trim).collect();
    let mut at = 0;
    while let Some(line) = lines.get(at) {
        reader.out.line = first + at as u32;
        let ends = line.split("]]>").next().unwrap_or_default().trim();
        if ends.eq_ignore_ascii_case("end") && reader.depth == 0 {
            let all: Vec<&str> = text.lines().collect();
            return Ok(vec![reader.out.finish(&all)]);
        }
        if line.contains("]]>") {
            break;
        }
        let taken = reader.arc_lines(lines.get(at..).unwrap_or_default());
        if taken == 0 {
            reader.statement(line);
        }
        at += taken.max(1);
    }
    Err(ParseError::Unended {
        line: first + at as u32,
        wanted: "end",
    })
}

/// Share of their speeds, %, below which joints may be what holds a bead's speed: a rule of our own. At 5 % a joint of 100 deg/s moves a tool
/// half a metre from it by 44 mm/s, several times a bead's speed.
const SLOW: f64 = 5.0;

struct Reader<'w> {
    out: Collected,
    words: Option<&'w Val3Words>,
    data: Data,
    /// Frames and tools by their number.
    frames: Vec<String>,
    tools: Vec<String>,
    /// What the robot held along the last move.
    holds: Holds,
    /// The values of the arc that is on.
    arc: Option<String>,
    /// Moves were told that may not have ended.
    queued: bool,
    /// The arm stopped behind the last move, and nothing was done there yet.
    waited: bool,
    /// Blocks that are open.
    depth: u32,
}

/// A number for a name, from 1.
fn numbered(all: &mut Vec<String>, name: &str) -> u32 {
    indexed(all, whole(name)) as u32 + 1
}

impl Reader<'_> {
    /// Takes in the lines that switch the arc, which the arm stands for; how many they are.
    fn arc_lines(&mut self, lines: &[&str]) -> usize {
        let Some(words) = self.words.filter(|_| !self.queued) else {
            return 0;
        };
        let Some((taken, word)) = words.arc().read(lines, &mut self.arc) else {
            return self.out.broken(words.arc(), lines);
        };
        self.stopped();
        self.out.switch(word);
        taken
    }

    /// The last move ends where the arm stops.
    fn stopped(&mut self) {
        self.waited = false;
        if let Some(motion) = self.out.last_move() {
            motion.termination = Termination::Fine;
        }
    }

    fn statement(&mut self, line: &str) {
        if line.eq_ignore_ascii_case("begin") {
            return;
        }
        let Some(line) = self.out.said(line, "//") else {
            return;
        };
        if self.acts(line).is_some() {
            return;
        }
        match first_word(line).to_ascii_lowercase().as_str() {
            "if" | "while" | "for" | "switch" | "do" => self.depth += 1,
            "endif" | "endwhile" | "endfor" | "endswitch" | "until" => {
                self.depth = self.depth.saturating_sub(1);
            }
            _ => {}
        }
        self.out.keep(line);
    }

    fn acts(&mut self, line: &str) -> Option<()> {
        if called(line, "waitEndMove").is_some() {
            (self.queued, self.waited) = (false, true);
            return Some(());
        }
        if let Some(all) = called(line, "delay") {
            let seconds = duration(all.first()?).filter(|_| !self.queued)?;
            self.waited = false;
            self.out.push(Instruction::Wait(seconds));
            return Some(());
        }
        if line.eq_ignore_ascii_case("return") {
            self.out.push(Instruction::End);
            return Some(());
        }
        if let Some(rest) = strip_word(line, "call") {
            let (name, inner) = rest.trim().split_once('(')?;
            let empty = inner.trim().strip_suffix(')')?.trim().is_empty();
            return empty.then(|| self.out.call(name.trim(), ""));
        }
        // what a move returns is of no matter
        let text = line.split_once('=').map_or(line, |(_, right)| right.trim());
        for (verb, kind) in [("movej", MotionKind::Joint), ("movel", MotionKind::Linear)] {
            if let Some(all) = called(text, verb) {
                let [to, tool, how] = all[..] else {
                    return None;
                };
                return self.motion(kind, to, tool, how);
            }
        }
        let all = called(text, "movec")?;
        let [via, to, tool, how] = all[..] else {
            return None;
        };
        self.hold(to, tool);
        let via = self.place(via, tool);
        self.motion(MotionKind::Circular { via }, to, tool, how)
    }

    /// The torch in the part, where a move leads a point of the part that is held to a torch that stands: a tool in [`PART`] to a point of
    /// [`TORCH`].
    fn held(&self, reference: &str, tool: &str) -> Option<Coordinates> {
        let (point, frame) = self.data.point(reference)?;
        let mut place = self.data.held(tool).filter(|_| whole(&frame) == TORCH)?;
        let pose = |xyz: [f64; 3], wpr| orientation::pose(DVec3::from_array(xyz), wpr);
        if let (
            Coordinates::Cartesian {
                config: of_point,
                xyz: to,
                wpr_degrees: turned,
                ..
            },
            Coordinates::Cartesian {
                config,
                xyz,
                wpr_degrees,
                ..
            },
        ) = (point, &mut place)
        {
            *config = of_point;
            if (to, turned) != ([0.0; 3], [0.0; 3]) {
                let torch: Pose = pose(*xyz, *wpr_degrees).then(pose(to, turned).inverse());
                *xyz = torch.position.to_array();
                *wpr_degrees = torch.wpr().to_array().map(f64::to_degrees);
            }
        }
        Some(place)
    }

    /// What the robot holds along a move, told where that changes.
    fn hold(&mut self, to: &str, tool: &str) {
        let of_part = whole(tool) == PART && self.data.joints(to).is_some();
        let holds = if of_part || self.held(to, tool).is_some() {
            Holds::Part
        } else {
            Holds::Torch
        };
        if std::mem::replace(&mut self.holds, holds) != holds {
            self.out.push(Instruction::Holds(holds));
        }
    }

    /// A frame that moves are made in, which lies where `pose` says.
    fn lies(&mut self, which: Which, name: &str, pose: Result<Pose, String>) -> u32 {
        let (all, kind) = match which {
            Which::User => (&mut self.frames, USER_FRAME),
            Which::Tool => (&mut self.tools, TOOL),
        };
        let number = numbered(all, name);
        self.out.program.name_frame(kind, number, &whole(name));
        match pose {
            Ok(pose) => drop(
                self.out
                    .program
                    .said_frames
                    .of_mut(which)
                    .insert(number, pose),
            ),
            Err(why) => self.unread(why),
        }
        number
    }

    fn place(&mut self, reference: &str, tool: &str) -> PositionRef {
        if let Some(place) = self.held(reference, tool) {
            // the part in the flange, the torch in the world
            let part = self.data.frame(PART, "tool");
            let torch = self.data.frame(TORCH, "frame");
            let frames = (
                Some(self.lies(Which::User, PART, part)),
                Some(self.lies(Which::Tool, TORCH, torch)),
            );
            return self.out.place(place, frames);
        }
        let lies = self.data.frame(tool, "tool");
        let of_tool = self.lies(Which::Tool, tool, lies);
        if let Some((place, frame)) = self.data.point(reference) {
            let lies = self.data.frame(&frame, "frame");
            let of_frame = self.lies(Which::User, &frame, lies);
            return self.out.place(place, (Some(of_frame), Some(of_tool)));
        }
        match self.data.joints(reference) {
            Some(place) => self.out.place(place, (None, Some(of_tool))),
            None => PositionRef::Unresolved(tidy(reference)),
        }
    }

    /// Where a frame or a tool lies is not known, which is told where it is used first.
    fn unread(&mut self, why: String) {
        let unread = &mut self.out.program.said_frames.unread;
        if unread.iter().all(|(_, told)| *told != why) {
            unread.push((self.out.line, why));
        }
    }

    fn motion(&mut self, kind: MotionKind, to: &str, tool: &str, how: &str) -> Option<()> {
        let Descriptor {
            share,
            speed,
            turns,
            acceleration,
            termination,
        } = self.data.descriptor(how)?;
        if self.waited {
            self.stopped();
        }
        self.queued = true;
        self.hold(to, tool);
        let target = self.place(to, tool);
        if kind == MotionKind::Joint {
            let speed = Speed::share(share);
            self.out.push_move(kind, target, speed, termination);
            return Some(());
        }
        self.out
            .push_move(kind, target, Speed::path(speed), termination);
        if let Some(motion) = self.out.last_move() {
            motion.turns_at_most(turns);
            if share < SLOW {
                motion.extra.push(format!("{JOINTS_AT}{share}"));
            }
            let words = format!("accel or decel {acceleration} of {how}");
            motion.acceleration = Acceleration::share(acceleration, &words);
        }
        Some(())
    }
}
