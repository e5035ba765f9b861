//! A program from script. Never panics; what it does not know it keeps and lists.

use super::words::ScriptWords;
use crate::collected::{Collected, scaled};
use crate::orientation::wpr_of_rotation_vector;
use crate::parsed::{ParseError, Parsed, decoded, trimmed};
use crate::program::{
    Axis, Coordinates, Dialect, Instruction, MotionKind, PositionRef, Speed, Termination,
};
use crate::scan::{self, called, duration, finite, first_word, routine_name, strip_prefix, tidy};

/// Frame and tool of every position: script has one of each at a time.
const FRAMES: (Option<u32>, Option<u32>) = (Some(1), Some(1));

/// Reads the functions of a script, the last one first, which is what runs; `words` say what switches the arc.
///
/// # Errors
/// [`ParseError`] where no function begins, or one does not end.
pub fn read(bytes: &[u8], words: Option<&ScriptWords>) -> Result<Vec<Parsed>, ParseError> {
    let text = decoded(bytes);
    let lines: Vec<&str> = trimmed(&text).collect();
    let mut done = Vec::new();
    let mut open: Option<Reader> = None;
    let mut at = 0;
    while let Some(line) = lines.get(at) {
        let Some(reader) = &mut open else {
            if let Some(name) = begins(line) {
                open = Some(Reader {
                    out: Collected::new(Dialect::UrScript, name),
                    words,
                    depth: 0,
                    arc: None,
                });
            }
            at += 1;
            continue;
        };
        reader.out.line = at as u32 + 1;
        if *line == "end" && reader.depth == 0 {
            done.extend(open.take().map(|r| r.out.finish()));
            at += 1;
            continue;
        }
        // the lines of the arc count as one
        let taken = reader.arc_lines(&lines[at..]);
        if taken == 0 {
            reader.statement(line);
        }
        at += taken.max(1);
    }
    if open.is_some() {
        return Err(ParseError::Unended {
            line: lines.len() as u32,
            wanted: "end",
        });
    }
    if done.is_empty() {
        return Err(ParseError::Other {
            dialect: "Universal Robots",
            wanted: "def",
        });
    }
    // a script runs its last function
    done.rotate_right(1);
    Ok(done)
}

/// The name of the function that a line begins.
fn begins(line: &str) -> Option<&str> {
    let rest = line.strip_prefix("def ")?;
    line.ends_with(':').then(|| routine_name(rest))?
}

struct Reader<'w> {
    out: Collected,
    words: Option<&'w ScriptWords>,
    /// Blocks that are open.
    depth: u32,
    /// The values of the arc that is on.
    arc: Option<String>,
}

/// The numbers of a list in brackets.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let inner = text.strip_prefix('[')?.strip_suffix(']')?;
    scan::numbers(inner)?.try_into().ok()
}

/// A named argument, or the one at its place.
fn option(all: &[&str], name: &str) -> Option<f64> {
    all.iter()
        .find_map(|a| finite(strip_prefix(a, name)?.trim_start().strip_prefix('=')?))
}

impl Reader<'_> {
    /// Takes in the lines that switch the arc; how many they are.
    fn arc_lines(&mut self, lines: &[&str]) -> usize {
        let Some(words) = self.words else { return 0 };
        let Some((taken, word)) = words.arc().read(lines, &mut self.arc) else {
            return 0;
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
        match first_word(line) {
            "if" | "while" | "for" | "def" | "thread" | "sec" if line.ends_with(':') => {
                self.depth += 1;
            }
            "end" => self.depth = self.depth.saturating_sub(1),
            _ => {}
        }
        self.out.keep(line);
    }

    fn acts(&mut self, line: &str) -> Option<()> {
        if let Some(all) = called(line, "sleep") {
            self.out.push(Instruction::Wait(duration(all.first()?)?));
            return Some(());
        }
        if let Some(all) = called(line, "movej") {
            return self.joint(&all);
        }
        for (name, process) in [("movel", false), ("movep", true)] {
            if let Some(all) = called(line, name) {
                // movep keeps its speed round corners: how is the controller's
                if process {
                    return None;
                }
                let target = self.target(all.first()?);
                return self.path(MotionKind::Linear, target, all.get(1..)?);
            }
        }
        if let Some(all) = called(line, "movec") {
            let via = self.target(all.first()?);
            let target = self.target(all.get(1)?);
            return self.path(MotionKind::Circular { via }, target, all.get(2..)?);
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

    /// The pose in the part of `pose_trans(part, p[…])` or `p[…]`.
    fn pose(&self, text: &str) -> Option<Coordinates> {
        let pose = match called(text, "pose_trans") {
            Some(all) => {
                let [part, pose] = all[..] else { return None };
                // another frame than the part's is not known
                let own = self.words.is_none_or(|w| tidy(&w.part) == tidy(part));
                own.then_some(pose)?
            }
            None => text,
        };
        let [x, y, z, a, b, c] = numbers(pose.strip_prefix('p')?)?;
        Some(Coordinates::Cartesian {
            config: String::new(),
            xyz: [x, y, z].map(|v| scaled(v, 1000.0)),
            wpr_degrees: wpr_of_rotation_vector([a, b, c])?,
            external: Vec::new(),
        })
    }

    fn target(&mut self, text: &str) -> PositionRef {
        match self.pose(text) {
            Some(place) => self.out.place(place, FRAMES),
            None => PositionRef::Unresolved(tidy(text)),
        }
    }

    fn path(&mut self, kind: MotionKind, target: PositionRef, rest: &[&str]) -> Option<()> {
        // a time in place of a speed
        if option(rest, "t").is_some_and(|t| t > 0.0) {
            return None;
        }
        let speed = option(rest, "v").filter(|v| *v > 0.0);
        let termination = match option(rest, "r") {
            Some(r) if r > 0.0 => Termination::Blend(scaled(r, 1000.0)),
            _ => Termination::Fine,
        };
        let speed = speed.map_or(Speed::Weld, |v| Speed::path(scaled(v, 1000.0)));
        self.out.push_move(kind, target, speed, termination);
        Some(())
    }

    fn joint(&mut self, all: &[&str]) -> Option<()> {
        let to = *all.first()?;
        let degrees = |joints: [f64; 6]| joints.map(|j| scaled(j.to_degrees(), 1.0));
        let place = if let Some(inner) = called(to, "get_inverse_kin") {
            let [pose, near] = inner[..] else { return None };
            let mut place = self.pose(pose)?;
            if let Coordinates::Cartesian { config, .. } = &mut place {
                *config = degrees(numbers(near)?).map(|j| j.to_string()).join(",");
            }
            place
        } else if let Some(joints) = numbers::<6>(to) {
            Coordinates::Joint(Axis::joints(degrees(joints)))
        } else {
            self.pose(to)?
        };
        let target = self.out.place(place, FRAMES);
        let share = option(all, "v").map(|v| scaled(100.0 * v / std::f64::consts::PI, 1.0));
        // five digits of a speed make hundredths of its share
        let share = share
            .map(|s| (s * 1e2).round() / 1e2)
            .filter(|s| *s > 0.0 && *s <= 100.0);
        let speed = share.map_or(Speed::Maximum, Speed::share);
        self.out
            .push_move(MotionKind::Joint, target, speed, Termination::Fine);
        Some(())
    }
}
