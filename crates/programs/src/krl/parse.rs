//! A program from KRL. Never panics; what it does not know it keeps and lists.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_toolpath::Weave;

use super::arc::{Form, WeldData};
use super::data::turned_round;
use super::entries::{Entry, Listed, entry};
use super::list::{List, Told, capital, holds, list};
use super::tables::{self, Tables};
use super::variables::{Krl, constants};
use super::words::KrlWords;
use crate::acceleration::Acceleration;
use crate::collected::Collected;
use crate::held::Holds;
use crate::modal::{SetSpeed, Sets};
use crate::parsed::{ParseError, Parsed, Unread, decoded, trimmed};
use crate::program::{Coordinates, Dialect, Instruction, Section};
use crate::said_frames::{SetFrame, Which};
use crate::scan::{bracket, finite, number, routine_name, strip_prefix, strip_word, uncommented};
use crate::unrolled::{Statement, unrolled};

/// Reads the routines of a `.src` with its `.dat`, the first of which is the one that the file is called after. `arc_values` is how many
/// of ArcTech's channels mean something in this cell, `words` what else it says of ArcTech.
///
/// # Errors
/// [`ParseError`] where no routine begins, or one does not end.
pub fn read(
    source: &[u8],
    data: Option<&[u8]>,
    arc_values: usize,
    words: Option<&KrlWords>,
) -> Result<Vec<Parsed>, ParseError> {
    let told = Told {
        values: arc_values,
        amplitude: words.and_then(|w| *w.weave_amplitude),
        job_mode: words.map(|w| w.job_mode.as_str()),
    };
    let list = data.map_or_else(List::default, |data| list(&decoded(data), told));
    let text = decoded(source);
    let lines: Vec<&str> = trimmed(&text).collect();
    let code: Vec<&str> = lines.iter().map(|line| uncommented(line)).collect();
    let several = tables::several(&list, &code);
    let mut reader = Reader {
        list: &list,
        several: &several,
        done: Vec::new(),
        open: None,
        application: Vec::new(),
        misnamed: None,
    };
    let constants = constants(&list, &code);
    let mut at = 0;
    while let Some(line) = lines.get(at) {
        at += 1;
        reader.line(at as u32, line);
        if reader.open.is_some() {
            let body = lines[at..]
                .iter()
                .take_while(|l| !l.eq_ignore_ascii_case("END"));
            let numbered = (at as u32 + 1..).zip(body.map(|l| (*l).to_owned()));
            let body: Vec<Statement> = numbered.collect();
            at += body.len();
            for (n, line) in unrolled(&Krl(&list), &constants, body) {
                reader.line(n, &line);
            }
        }
        if let (Some(line), true) = (lines.get(at), reader.open.is_some()) {
            at += 1;
            reader.line(at as u32, line);
        }
    }
    if reader.open.is_some() {
        return Err(ParseError::Unended {
            line: lines.len() as u32,
            wanted: "END",
        });
    }
    if let Some((line, name)) = reader.misnamed {
        return Err(ParseError::Name { line, name });
    }
    if reader.done.is_empty() {
        return Err(ParseError::Other {
            dialect: "KUKA",
            wanted: "DEF",
        });
    }
    let done = reader.done.into_iter();
    let mut parsed: Vec<Parsed> = done.map(|r| r.finish(&lines)).collect();
    if let Some(first) = parsed.first_mut() {
        first.program.application = reader.application;
        if !list.rest.is_empty() {
            first.program.sections.push(Section {
                name: "DAT".to_owned(),
                lines: list.rest.iter().map(|(_, line)| line.clone()).collect(),
            });
        }
        let told = |(line, text): &(u32, String)| Unread {
            line: *line,
            text: text.clone(),
        };
        first.unread.extend(list.unread().map(told));
        let set = |l: &Listed| {
            Some(SetFrame {
                at: None,
                which: l.entry.0,
                number: l.entry.1,
                pose: l.pose?,
                line: l.line,
                text: l.text.clone(),
            })
        };
        let set = list.entries.iter().filter_map(set);
        first.program.said_frames.set.splice(0..0, set);
    }
    Ok(parsed)
}

/// How a move goes.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Verb {
    Joint,
    Straight,
    Round,
}

pub(super) struct Routine<'a> {
    pub(super) out: Collected,
    /// Frames that it sets.
    pub(super) tables: Tables<'a>,
    pub(super) speed: Option<SetSpeed>,
    pub(super) joint_speed: Option<f64>,
    pub(super) distance: Option<f64>,
    pub(super) frames: (Option<u32>, Option<u32>),
    /// A program that was called may have selected others since.
    pub(super) called: (bool, bool),
    /// Base and tool were selected by lines of their own, whatever the data of positions say.
    pub(super) direct: (bool, bool),
    /// Frames in others of which it is not known where they lie, as lines write them.
    pub(super) unknown: Vec<String>,
    /// What the robot holds, where a line says it.
    pub(super) holds: Option<Holds>,
    /// What it holds at each position that is used, at its first use.
    pub(super) used: BTreeMap<String, Holds>,
    /// What ArcTech does with the next move, and the name of its weld data.
    pub(super) form: Option<(Form, String)>,
    /// Triggers of the form to come, with their text.
    pub(super) triggers: Vec<(Form, String, String)>,
    /// The form of the last move, whose line after it is to come.
    pub(super) after: Option<(Form, String)>,
    /// Weld data that are on.
    pub(super) weld: Option<WeldData>,
    /// The weave that is on.
    pub(super) weave: Option<Weave>,
    /// What the lines before say of how quickly moves gain their speed.
    pub(super) acceleration: Option<Acceleration>,
}

struct Reader<'a> {
    list: &'a List,
    several: &'a BTreeSet<Entry>,
    done: Vec<Collected>,
    open: Option<Routine<'a>>,
    application: Vec<String>,
    /// The first routine whose name is none, and its line.
    misnamed: Option<(u32, String)>,
}

impl Reader<'_> {
    fn line(&mut self, n: u32, line: &str) {
        let Some(routine) = &mut self.open else {
            let header = strip_word(line, "GLOBAL").map_or(line, str::trim_start);
            if let Some(name) = strip_word(header, "DEF").and_then(routine_name) {
                self.open = Some(Routine {
                    out: Collected::new(Dialect::Krl, name),
                    tables: Tables::new(self.list, self.several),
                    speed: None,
                    joint_speed: None,
                    distance: None,
                    frames: (None, None),
                    called: (false, false),
                    direct: (false, false),
                    unknown: Vec::new(),
                    holds: None,
                    used: BTreeMap::new(),
                    form: None,
                    triggers: Vec::new(),
                    after: None,
                    weld: None,
                    weave: None,
                    acceleration: None,
                });
            } else if let Some(name) = strip_word(header, "DEF") {
                let name = name.split('(').next().unwrap_or_default().trim();
                self.misnamed.get_or_insert((n, name.to_owned()));
            } else if line.starts_with('&') && self.done.is_empty() {
                self.application.push(line.to_owned());
            }
            return;
        };
        routine.out.line = n;
        if line.eq_ignore_ascii_case("END") {
            self.done.extend(self.open.take().map(|r| r.out));
        } else {
            routine.statement(line, self.list);
        }
    }
}

/// What stands behind `name =`.
pub(super) fn assigned<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    strip_prefix(line, name)?
        .trim_start()
        .strip_prefix('=')
        .map(str::trim)
}

/// The arguments of a call of `name`.
pub(super) fn called<'a>(line: &'a str, name: &str) -> Option<Vec<&'a str>> {
    let inner = strip_prefix(line, name)?
        .trim_start()
        .strip_prefix('(')?
        .strip_suffix(')')?;
    Some(inner.split(',').map(str::trim).collect())
}

/// Machine and base of `EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,BASE_DATA[1])`.
fn coupled_base(value: &str) -> Option<(u32, u32)> {
    let all = called(value, "EK")?;
    let [root, kind, base] = all[..] else {
        return None;
    };
    let machine = |text: &str, field: &str| {
        let rest = strip_prefix(text, "MACHINE_DEF")?;
        let (number, rest) = bracket(rest.trim_start())?;
        let same = rest.trim().eq_ignore_ascii_case(field);
        same.then(|| number.trim().parse::<u32>().ok())?
    };
    let number = machine(root, ".ROOT")?;
    let same = machine(kind, ".MECH_TYPE")? == number;
    same.then_some((number, entry(base, "BASE_DATA")?))
}

impl Routine<'_> {
    fn statement(&mut self, line: &str, list: &List) {
        if line.is_empty() {
            return self.out.push(Instruction::Blank);
        }
        if let Some(text) = line.strip_prefix(';') {
            return self.out.remark(text);
        }
        let line = uncommented(line);
        self.accelerates(line);
        self.tables.declare(line);
        if self.sets_frame(line).is_some() {
            return;
        }
        if self.sets(line, list).is_none() && self.acts(line, list).is_none() {
            self.out.keep(line);
        }
    }

    /// Lines that set something for the moves to come; nothing where this is none.
    fn sets(&mut self, line: &str, list: &List) -> Option<()> {
        if let Some(value) = assigned(line, "$VEL.CP") {
            self.velocity(value, list);
            return Some(());
        }
        let turning = ["$VEL.ORI1", "$VEL.ORI2"].map(|name| assigned(line, name));
        if let Some((which, value)) = (0..).zip(turning).find_map(|(i, v)| Some((i, v?))) {
            let limit = finite(value).filter(|limit| *limit > 0.0)?;
            self.says(Sets::Turning(which, limit));
            return Some(());
        }
        if let Some(value) = assigned(line, "$APO.CDIS") {
            let (distance, _) = number(value)?;
            self.blends(Some(distance));
            return Some(());
        }
        if let Some(value) = assigned(line, "$BASE") {
            let (machine, number) = match coupled_base(value) {
                Some((machine, number)) => (Some(machine), number),
                None => (None, self.selected(Which::User, ("BASE_DATA", value))?),
            };
            self.couple(machine)?;
            if machine.is_some() && self.tables.is_set((Which::User, number)) {
                // it lies on the machine, and where that is the program does not say
                self.unread(line);
            }
            self.frame(number);
            self.direct.0 = true;
            return Some(());
        }
        if let Some(value) = assigned(line, "$TOOL") {
            let number = self.selected(Which::Tool, ("TOOL_DATA", value))?;
            self.tool(number);
            self.direct.1 = true;
            return Some(());
        }
        if let Some(value) = assigned(line, "$IPO_MODE") {
            let said = holds(value)?;
            self.holds = Some(said);
            self.out.push(Instruction::Holds(said));
            return Some(());
        }
        if let Some(value) = assigned(line, "FDAT_ACT") {
            let (frame, tool) = *list.frames.get(&capital(value))?;
            self.hold(list.holds.get(&capital(value)).copied());
            if let Some(n) = frame {
                self.direct.0 = false;
                self.couple(None)?;
                let n = self.numbered((Which::User, n));
                self.frame(n);
            }
            if let Some(n) = tool {
                self.direct.1 = false;
                let n = self.numbered((Which::Tool, n));
                self.tool(n);
            }
            return Some(());
        }
        if let Some(value) = assigned(line, "LDAT_ACT") {
            let name = capital(value);
            self.moves_by(&name, list);
            return Some(());
        }
        if line.to_ascii_uppercase().contains("ARCMAINNG") {
            return self.calls_arc(line);
        }
        let all = called(line, "BAS")?;
        let [which, value] = all[..] else {
            return None;
        };
        match capital(which).as_str() {
            "#CP_PARAMS" | "#VEL_CP" => self.velocity(value, list),
            "#PTP_PARAMS" | "#VEL_PTP" => {
                let (share, _) = number(value)?;
                self.joints(share);
            }
            "#BASE" => {
                let n = self.numbered((Which::User, value.parse().ok()?));
                self.frame(n);
                self.direct.0 = true;
            }
            "#TOOL" => {
                let n = self.numbered((Which::Tool, value.parse().ok()?));
                self.tool(n);
                self.direct.1 = true;
            }
            _ => return None,
        }
        Some(())
    }

    /// What the robot holds, as the data of a move say it.
    pub(super) fn hold(&mut self, said: Option<Holds>) {
        let Some(said) = said else { return };
        let before = self.holds.replace(said).unwrap_or(Holds::Torch);
        if before != said {
            self.out.push(Instruction::Holds(said));
        }
    }

    /// A place of the data list or of a line, as the torch in the part.
    pub(super) fn in_part(&self, place: Coordinates) -> Coordinates {
        match self.holds {
            Some(Holds::Part) => turned_round(place),
            _ => place,
        }
    }

    /// Lines that do something; nothing where this is none.
    fn acts(&mut self, line: &str, list: &List) -> Option<()> {
        let verbs = [
            ("PTP", Verb::Joint),
            ("SPTP", Verb::Joint),
            ("LIN", Verb::Straight),
            ("SLIN", Verb::Straight),
            ("CIRC", Verb::Round),
            ("SCIRC", Verb::Round),
        ];
        for (name, verb) in verbs {
            if let Some(rest) = strip_word(line, name) {
                return self.motion(verb, rest.trim(), list);
            }
        }
        if let Some(rest) = strip_word(line, "WAIT") {
            let (seconds, after) = number(strip_word(rest.trim_start(), "SEC")?.trim())?;
            let plain = after.trim().is_empty() && seconds >= 0.0;
            return plain.then(|| self.out.push(Instruction::Wait(seconds)));
        }
        if line.eq_ignore_ascii_case("RETURN") {
            self.out.push(Instruction::End);
            return Some(());
        }
        let (name, arguments) = line.split_once('(')?;
        let (name, arguments) = (name.trim(), arguments.strip_suffix(')')?);
        let identifier = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let own = ["BAS", "SET_CD_PARAMS", "MsgNotify"]
            .iter()
            .any(|o| o.eq_ignore_ascii_case(name));
        if name.is_empty() || !name.chars().all(identifier) || own {
            return None;
        }
        self.out.call(name, arguments);
        self.called = (true, true);
        Some(())
    }
}
