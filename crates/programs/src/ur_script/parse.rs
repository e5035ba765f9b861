//! A program from script. Never panics; what it does not know it keeps and lists.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;

use super::variables::{Script, numbers, pose_numbers, pose_of};
use super::words::ScriptWords;
use crate::acceleration::Acceleration;
use crate::collected::{Collected, scaled};
use crate::orientation::wpr_of_rotation_vector;
use crate::parsed::{ParseError, Parsed, decoded, trimmed};
use crate::program::{
    Axis, Coordinates, Dialect, Instruction, MotionKind, PositionRef, Speed, SpeedUnit, Termination,
};
use crate::scan::{called, duration, finite, first_word, routine_name, strip_prefix, tidy};
use crate::unrolled::{Statement, unrolled};

/// Speed of a move along a path that says none, m/s: that of the script manual.
const USUAL_SPEED: f64 = 0.25;

/// What a `movep` does beside going straight: how it does so is the controller's.
const PROCESS: &str = "movep, which keeps its speed round corners,";

/// The argument of a `movec` that says how it turns the tool.
const MODE: &str = "mode";

/// Reads the functions of a script, first what runs: the lines that stand outside of all functions where they move or call, else the last one; `words`
/// say what switches the arc.
///
/// # Errors
/// [`ParseError`] where no function begins, or one does not end.
pub fn read(bytes: &[u8], words: Option<&ScriptWords>) -> Result<Vec<Parsed>, ParseError> {
    let text = decoded(bytes);
    let lines: Vec<&str> = trimmed(&text).collect();
    let (mut done, mut outside) = (Vec::new(), Vec::new());
    let mut at = 0;
    while let Some(line) = lines.get(at) {
        at += 1;
        let beside = opens(line) && matches!(first_word(line), "thread" | "sec");
        let Some(name) = begins(line).or(beside.then_some("")) else {
            outside.push((at as u32, (*line).to_owned()));
            continue;
        };
        let body = body(&lines[at..]).ok_or(ParseError::Unended {
            line: lines.len() as u32,
            wanted: "end",
        })?;
        let numbered = (at as u32 + 1..).zip(body.iter().map(|l| (*l).to_owned()));
        let statements = unrolled(&Script(words), &BTreeMap::new(), numbered.collect());
        at += body.len() + 1;
        if !beside {
            done.push(Reader::new(name, words).read(&statements).finish(&lines));
        }
    }
    if done.is_empty() {
        return Err(ParseError::Other {
            dialect: "Universal Robots",
            wanted: "def",
        });
    }
    let mut name = "script".to_owned();
    while done.iter().any(|p: &Parsed| p.program.name == name) {
        name.push('_');
    }
    let statements = unrolled(&Script(words), &BTreeMap::new(), outside);
    let outside = Reader::new(&name, words).read(&statements).finish(&lines);
    if outside.program.instructions.iter().any(moves) {
        done.push(outside);
    }
    // without lines outside of them a script runs its last function
    done.rotate_right(1);
    Ok(done)
}

/// Whether an instruction moves, lays metal, or calls what may.
fn moves(instruction: &Instruction) -> bool {
    matches!(
        instruction,
        Instruction::Motion(_) | Instruction::Arc(_) | Instruction::Call { .. }
    )
}

/// The name of the function that a line begins.
fn begins(line: &str) -> Option<&str> {
    let rest = line.strip_prefix("def ")?;
    line.ends_with(':').then(|| routine_name(rest))?
}

/// The lines of a function up to its end.
fn body<'l, 't>(lines: &'l [&'t str]) -> Option<&'l [&'t str]> {
    let mut depth = 0_u32;
    let end = lines.iter().position(|line| {
        depth += u32::from(opens(line.split('#').next().unwrap_or_default().trim()));
        let ends = *line == "end" && depth == 0;
        if *line == "end" {
            depth = depth.saturating_sub(1);
        }
        ends
    })?;
    lines.get(..end)
}

/// Whether a line begins a block.
fn opens(line: &str) -> bool {
    let word = first_word(line);
    line.ends_with(':') && matches!(word, "if" | "while" | "for" | "def" | "thread" | "sec")
}

struct Reader<'w> {
    out: Collected,
    words: Option<&'w ScriptWords>,
    /// The values of the arc that is on.
    arc: Option<String>,
    /// Tools by their number, as `set_tcp` says them; the one that stands before any line says so is empty.
    tools: Vec<String>,
    /// The one that is on.
    tool: u32,
    /// The frame of the last target.
    frame: u32,
}

/// The number of the part's frame, and that of the base, in which poses are that name none.
const PART: u32 = 1;
pub(crate) const BASE: u32 = 2;

/// An argument of a call.
enum Said<'a> {
    No,
    Number(f64),
    /// A variable or an expression.
    Other(&'a str),
}

/// The argument called `name`, or the one at its place among those without a name.
fn said<'a>(all: &[&'a str], name: &str, place: usize) -> Said<'a> {
    let named = all
        .iter()
        .find_map(|a| strip_prefix(a, name)?.trim_start().strip_prefix('='));
    let plain = |a: &&str| !a.contains('=');
    let placed = || {
        let before = all.get(..=place)?;
        before.iter().all(plain).then(|| before[place])
    };
    match named.map(str::trim).or_else(placed) {
        None => Said::No,
        Some(text) => finite(text).map_or(Said::Other(text), Said::Number),
    }
}

/// What arguments say that is none of these, which follow the places in this order; `mode=0` turns the tool as it is taught, as without.
fn further(all: &[&str], known: &[&str]) -> Vec<String> {
    let unknown = |(place, text): (usize, &&str)| {
        let by_place = known.get(place).copied();
        let (name, value) = match text.split_once('=') {
            Some((name, value)) => (Some(name.trim()), value.trim()),
            None => (by_place, *text),
        };
        let plain = name != Some(MODE) || finite(value) == Some(0.0);
        let read = plain && name.is_some_and(|name| known.contains(&name));
        (!read).then(|| match name {
            Some(MODE) => format!("{MODE}={value}"),
            _ => tidy(text),
        })
    };
    all.iter().enumerate().filter_map(unknown).collect()
}

fn degrees(joints: [f64; 6]) -> [f64; 6] {
    joints.map(|j| scaled(j.to_degrees(), 1.0))
}

/// Where a tool stands, mm and degrees.
fn place(xyz: [f64; 3], wpr_degrees: [f64; 3]) -> Coordinates {
    Coordinates::Cartesian {
        config: String::new(),
        xyz: xyz.map(|v| scaled(v, 1.0)),
        wpr_degrees,
        external: Vec::new(),
    }
}

/// The place of a pose `p[…]` or of a sum of poses.
fn plain(text: &str) -> Option<Coordinates> {
    let [x, y, z, a, b, c] = pose_numbers(text)?;
    let wpr_degrees = wpr_of_rotation_vector([a, b, c])?;
    Some(place([x, y, z].map(|v| 1000.0 * v), wpr_degrees))
}

/// Where the joints of `[…]` stand.
fn joints(text: &str) -> Option<Coordinates> {
    let all = numbers::<6>(text)?;
    Some(Coordinates::Joint(Axis::joints(degrees(all))))
}

impl<'w> Reader<'w> {
    fn new(name: &str, words: Option<&'w ScriptWords>) -> Self {
        Reader {
            out: Collected::new(Dialect::UrScript, name),
            words,
            arc: None,
            tools: Vec::new(),
            tool: 1,
            frame: PART,
        }
    }

    fn read(mut self, statements: &[Statement]) -> Collected {
        let lines: Vec<&str> = statements.iter().map(|s| &*s.1).collect();
        let mut at = 0;
        while let Some((number, line)) = statements.get(at) {
            self.out.line = *number;
            // the lines of the arc count as one
            let taken = self.arc_lines(&lines[at..]);
            if taken == 0 {
                self.statement(line);
            }
            at += taken.max(1);
        }
        self.out
    }

    /// Takes in the lines that switch the arc; how many they are.
    fn arc_lines(&mut self, lines: &[&str]) -> usize {
        let Some(words) = self.words else { return 0 };
        let Some((taken, word)) = words.arc().read(lines, &mut self.arc) else {
            return self.out.broken(words.arc(), lines);
        };
        self.out.switch(word);
        taken
    }

    fn statement(&mut self, line: &str) {
        let Some(line) = self.out.said(line, "#") else {
            return;
        };
        if self.acts(line).is_some() {
            return;
        }
        let arc = self.words.map(ScriptWords::arc);
        self.out.keep_beside(arc, line);
    }

    fn acts(&mut self, line: &str) -> Option<()> {
        if let Some(all) = called(line, "set_tcp") {
            self.tool(&all.join(","));
            // a script says no tool of its own where it is written: the line stays
            return None;
        }
        if let Some(all) = called(line, "sleep") {
            self.out.push(Instruction::Wait(duration(all.first()?)?));
            return Some(());
        }
        if let Some(all) = called(line, "movej") {
            return self.joint(&all);
        }
        for (name, process) in [("movel", false), ("movep", true)] {
            if let Some(all) = called(line, name) {
                let rest = all.get(1..)?;
                let time = said(rest, "t", 2);
                let (speed, radius) = (Self::speed(rest, &time)?, said(rest, "r", 3));
                let target = self.target(all.first()?);
                self.path(MotionKind::Linear, target, speed, &radius);
                self.accelerates(rest, &time);
                self.says(further(rest, &["a", "v", "t", "r"]));
                if let Some(motion) = self.out.last_move().filter(|_| process) {
                    motion.extra.push(PROCESS.to_owned());
                }
                return Some(());
            }
        }
        if let Some(all) = called(line, "movec") {
            let rest = all.get(2..)?;
            let (speed, radius) = (Self::speed(rest, &Said::No)?, said(rest, "r", 2));
            let via = self.target(all.first()?);
            let target = self.target(all.get(1)?);
            self.path(MotionKind::Circular { via }, target, speed, &radius);
            self.accelerates(rest, &Said::No);
            self.says(further(rest, &["a", "v", "r", MODE]));
            return Some(());
        }
        if line == "return" {
            self.out.push(Instruction::End);
            return Some(());
        }
        let (name, inner) = line.split_once('(')?;
        let inner = inner.strip_suffix(')')?;
        let known = self.out.program.name != name && inner.is_empty();
        let plain = name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
        let call = known && plain && !matches!(name, "sync" | "halt" | "end_force_mode");
        call.then(|| self.out.call(name, ""))
    }

    /// The pose of `pose_trans(part, p[…])` in the part, or of `p[…]` or two poses in numbers in the base; and the number of that frame.
    fn pose(&self, text: &str) -> Option<(Coordinates, u32)> {
        let Some(all) = called(text, "pose_trans") else {
            return Some((plain(text)?, BASE));
        };
        let [part, pose] = all[..] else { return None };
        if self.words.is_none_or(|w| tidy(&w.part) == tidy(part)) {
            return Some((plain(pose)?, PART));
        }
        let both = pose_of(part)?.then(pose_of(pose)?);
        let wpr_degrees = both.wpr().to_array().map(|v| scaled(v.to_degrees(), 1.0));
        Some((place(both.position.to_array(), wpr_degrees), BASE))
    }

    /// The targets to come are in another frame.
    fn frame(&mut self, number: u32) {
        let said = match number {
            PART => self.words.and_then(|w| pose_of(&w.part)),
            _ => Some(Pose::IDENTITY),
        };
        let user = &mut self.out.program.said_frames.user;
        user.extend(said.map(|pose| (number, pose)));
        if self.frame != number {
            self.frame = number;
            self.out.push(Instruction::UserFrame(number));
        }
    }

    fn target(&mut self, text: &str) -> PositionRef {
        match self.pose(text) {
            Some((place, frame)) => {
                self.frame(frame);
                self.out.place(place, (Some(frame), Some(self.tool)))
            }
            None => match joints(text) {
                Some(place) => self.out.place(place, (Some(self.frame), Some(self.tool))),
                None => PositionRef::Unresolved(tidy(text)),
            },
        }
    }

    /// Another tool is on: the first one that a script names is that of all its moves before.
    fn tool(&mut self, text: &str) {
        let text = tidy(text);
        let moved = !self.out.program.positions.is_empty();
        if self.tools.is_empty() && moved {
            self.tools.push(String::new());
        }
        let known = self.tools.iter().position(|t| *t == text);
        let at = known.unwrap_or_else(|| {
            self.tools.push(text);
            self.tools.len() - 1
        });
        let number = at as u32 + 1;
        if let Some(pose) = self.tools.get(at).and_then(|said| pose_of(said)) {
            self.out.program.said_frames.tool.insert(number, pose);
        }
        if number != self.tool {
            self.tool = number;
            self.out.push(Instruction::ToolFrame(number));
        }
    }

    /// The speed of a move along a path, or its time, which goes before; nothing where a bead's is none that is known.
    fn speed(rest: &[&str], time: &Said<'_>) -> Option<Speed> {
        match *time {
            Said::No | Said::Number(0.0) => {}
            Said::Number(value) if value > 0.0 => {
                return Some(Speed::Value {
                    value,
                    unit: SpeedUnit::Second,
                });
            }
            Said::Number(_) | Said::Other(_) => return None,
        }
        match said(rest, "v", 1) {
            Said::No => Some(Speed::path(scaled(USUAL_SPEED, 1000.0))),
            Said::Number(v) if v > 0.0 => Some(Speed::path(scaled(v, 1000.0))),
            Said::Number(v) => Some(Speed::Other(format!("v={v}"))),
            Said::Other(text) => Some(Speed::Other(format!("v={text}"))),
        }
    }

    fn path(&mut self, kind: MotionKind, target: PositionRef, speed: Speed, radius: &Said<'_>) {
        let termination = match radius {
            Said::Number(r) if *r > 0.0 => Termination::Blend(scaled(*r, 1000.0)),
            Said::Number(_) | Said::No => Termination::Fine,
            Said::Other(text) => Termination::Other(format!("r={text}")),
        };
        self.out.push_move(kind, target, speed, termination);
    }

    /// How quickly the move that was read last gains its speed, where its arguments say it.
    fn accelerates(&mut self, rest: &[&str], time: &Said<'_>) {
        let acceleration = match (said(rest, "a", 0), time) {
            // how it comes to its time is the controller's
            (_, Said::Number(time)) if *time > 0.0 => {
                Some(Acceleration::Words(format!("t={time}")))
            }
            (Said::No, _) => None,
            (Said::Number(a), _) => Some(Acceleration::metres(&a.to_string(), &format!("a={a}"))),
            (Said::Other(text), _) => Some(Acceleration::Words(format!("a={text}"))),
        };
        if let Some(motion) = self.out.last_move() {
            motion.acceleration = acceleration;
        }
    }

    /// What the move that was read last says beside.
    fn says(&mut self, further: Vec<String>) {
        if let Some(motion) = self.out.last_move() {
            motion.extra.extend(further);
        }
    }

    fn joint(&mut self, all: &[&str]) -> Option<()> {
        let to = *all.first()?;
        let place = if let Some(inner) = called(to, "get_inverse_kin") {
            let [pose, near] = inner[..] else { return None };
            let (mut place, frame) = self.pose(pose)?;
            self.frame(frame);
            if let Coordinates::Cartesian { config, .. } = &mut place {
                *config = degrees(numbers(near)?).map(|j| j.to_string()).join(",");
            }
            place
        } else if let Some(joints) = joints(to) {
            joints
        } else {
            let (place, frame) = self.pose(to)?;
            self.frame(frame);
            place
        };
        let target = self.out.place(place, (Some(self.frame), Some(self.tool)));
        let share = match said(all.get(1..)?, "v", 1) {
            Said::Number(v) => Some(scaled(100.0 * v / std::f64::consts::PI, 1.0)),
            Said::No | Said::Other(_) => None,
        };
        // five digits of a speed make hundredths of its share
        let share = share
            .map(|s| (s * 1e2).round() / 1e2)
            .filter(|s| *s > 0.0 && *s <= 100.0);
        let speed = share.map_or(Speed::Maximum, Speed::share);
        self.out
            .push_move(MotionKind::Joint, target, speed, Termination::Fine);
        self.says(further(all.get(1..)?, &["a", "v", "t", "r"]));
        Some(())
    }
}
