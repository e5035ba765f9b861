//! Programs from RAPID: the routines of a module. Never panics; what it does not know it keeps and lists.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::Weave;

use super::data::{self, Value, WeldData, Zigzag};
use super::statements::{Statement, statements};
use crate::collected::{Collected, scaled};
use crate::orientation::pose;
use crate::parsed::{ParseError, Parsed, decoded};
use crate::program::{
    ArcAction, ArcWord, Attribute, Coordinates, Dialect, Instruction, MotionInstruction,
    MotionKind, PositionRef, Section, Speed, TOOL, Termination, USER_FRAME,
};
use crate::scan::{
    arguments, duration, finite, identifier, routine_name, strip_prefix, strip_word, tidy,
};

/// The data that a module declares.
#[derive(Default)]
struct Declared {
    targets: BTreeMap<String, Coordinates>,
    speeds: BTreeMap<String, f64>,
    zones: BTreeMap<String, f64>,
    welds: BTreeMap<String, WeldData>,
    zigzags: BTreeMap<String, Zigzag>,
    /// Where tools are in the flange, and objects in the base.
    tools: BTreeMap<String, Pose>,
    objects: BTreeMap<String, Pose>,
}

impl Declared {
    /// Where a tool and an object lie, as far as the module says it; the controller's own lie at flange and base.
    fn lie(&self, [tool, object]: [&str; 2]) -> [Option<Pose>; 2] {
        let at = |known: &BTreeMap<String, Pose>, name: &str, own| {
            let name = name.to_ascii_lowercase();
            let said = known.get(&name).copied();
            said.or_else(|| (name == own).then_some(Pose::IDENTITY))
        };
        [
            at(&self.tools, tool, "tool0"),
            at(&self.objects, object, "wobj0"),
        ]
    }
}

/// Reads the routines of a module, in their order. `values` is how many values of an `arcdata` mean something in this cell.
///
/// # Errors
/// [`ParseError`] where the text has no module or no routine, or a routine does not end.
pub fn read(bytes: &[u8], values: usize) -> Result<Vec<Parsed>, ParseError> {
    let text = decoded(bytes);
    let all = statements(&text);
    let no = |wanted| ParseError::Other {
        dialect: "ABB",
        wanted,
    };
    if !all.iter().any(|s| strip_word(&s.text, "MODULE").is_some()) {
        return Err(no("MODULE"));
    }
    let (mut known, mut rest) = (Declared::default(), Vec::new());
    let mut reader = Reader {
        open: None,
        skipped: None,
        done: Vec::new(),
    };
    let kept: Vec<bool> = all
        .iter()
        .map(|s| declared(&mut known, &s.text, values) == Some(true))
        .collect();
    for (s, kept) in all.iter().zip(kept) {
        if kept && reader.open.is_none() && reader.skipped.is_none() {
            rest.push(format!("{};", tidy(&s.text)));
        }
        reader.statement(s, &known);
    }
    if reader.open.is_some() {
        let line = all.last().map_or(0, |s| s.line);
        return Err(ParseError::Unended {
            line,
            wanted: "ENDPROC",
        });
    }
    let lines: Vec<&str> = text.lines().collect();
    let done = reader.done.into_iter();
    let mut parsed: Vec<Parsed> = done.map(|r| r.out.finish(&lines)).collect();
    let first = parsed.first_mut().ok_or_else(|| no("PROC"))?;
    if !rest.is_empty() {
        first.program.sections.push(Section {
            name: "DATA".to_owned(),
            lines: rest,
        });
    }
    Ok(parsed)
}

/// Takes in a declaration: whether it is kept verbatim; nothing where the statement is none.
fn declared(known: &mut Declared, text: &str, values: usize) -> Option<bool> {
    let rest = strip_word(text, "LOCAL")
        .or_else(|| strip_word(text, "TASK"))
        .unwrap_or(text)
        .trim_start();
    let rest = ["CONST", "PERS", "VAR"]
        .iter()
        .find_map(|w| strip_word(rest, w))?
        .trim_start();
    let (kind, rest) = rest.split_once(char::is_whitespace)?;
    let (name, text) = rest.split_once(":=").unwrap_or((rest, ""));
    let name = name.trim().to_ascii_lowercase();
    let value = data::value(text);
    let value = value.as_ref();
    let read = match kind.to_ascii_lowercase().as_str() {
        "robtarget" => put(&mut known.targets, name, value.and_then(data::target)),
        "jointtarget" => put(&mut known.targets, name, value.and_then(data::joints)),
        "speeddata" => put(&mut known.speeds, name, value.and_then(data::speed)),
        "zonedata" => put(&mut known.zones, name, value.and_then(data::zone)),
        "welddata" => {
            let weld = value.and_then(|v| data::weld(v, values));
            put(&mut known.welds, name, weld)
        }
        // these stay, as their masses and what the module says beside them are the controller's
        "tooldata" => {
            put(&mut known.tools, name, value.and_then(data::tool));
            None
        }
        "wobjdata" => {
            put(&mut known.objects, name, value.and_then(data::object));
            None
        }
        "weavedata" => put(&mut known.zigzags, name, value.and_then(data::zigzag)),
        _ => None,
    };
    Some(read.is_none())
}

fn put<T>(map: &mut BTreeMap<String, T>, name: String, value: Option<T>) -> Option<()> {
    map.insert(name, value?);
    Some(())
}

struct Routine {
    out: Collected,
    /// Tools and work objects by their number.
    tools: Vec<String>,
    objects: Vec<String>,
    /// Frame and tool in which a target is used first.
    used: BTreeMap<String, (Option<u32>, Option<u32>)>,
    /// What is laid with while the arc burns.
    arc: Option<String>,
    /// The weave that is on.
    weave: Option<Weave>,
    /// Configurations count.
    monitored: bool,
}

struct Reader {
    open: Option<Routine>,
    /// The end of a piece that is no routine.
    skipped: Option<&'static str>,
    done: Vec<Routine>,
}

impl Reader {
    fn statement(&mut self, s: &Statement, known: &Declared) {
        let text = s.text.as_str();
        if let Some(end) = self.skipped {
            if text.eq_ignore_ascii_case(end) {
                self.skipped = None;
            }
            return;
        }
        let Some(routine) = &mut self.open else {
            let head = strip_word(text, "LOCAL").map_or(text, str::trim_start);
            if let Some(name) = strip_word(head, "PROC").and_then(routine_name) {
                self.open = Some(Routine {
                    out: Collected::new(Dialect::Rapid, name),
                    tools: Vec::new(),
                    objects: Vec::new(),
                    used: BTreeMap::new(),
                    arc: None,
                    weave: None,
                    monitored: true,
                });
                return;
            }
            let pieces = [
                ("FUNC", "ENDFUNC"),
                ("TRAP", "ENDTRAP"),
                ("RECORD", "ENDRECORD"),
            ];
            self.skipped = pieces
                .iter()
                .find(|(w, _)| strip_word(head, w).is_some())
                .map(|(_, end)| *end);
            return;
        };
        routine.out.line = s.line;
        if text.eq_ignore_ascii_case("ENDPROC") {
            self.done.extend(self.open.take());
        } else {
            routine.statement(text, known);
        }
    }
}

/// A number for a name, from 1.
fn numbered(all: &mut Vec<String>, name: &str) -> u32 {
    let known = all.iter().position(|n| n.eq_ignore_ascii_case(name));
    let at = known.unwrap_or_else(|| {
        all.push(name.to_owned());
        all.len() - 1
    });
    at as u32 + 1
}

/// An argument and the switches behind it, each with its backslash.
fn switches(argument: &str) -> (&str, Vec<&str>) {
    let mut parts = argument.split('\\');
    let head = parts.next().unwrap_or_default().trim();
    (head, parts.map(str::trim).collect())
}

fn switch<'a>(all: &[&'a str], name: &str) -> Option<&'a str> {
    all.iter().find_map(|s| {
        strip_prefix(s, name)?
            .trim_start()
            .strip_prefix(":=")
            .map(str::trim)
    })
}

/// What the arc does at a move.
#[derive(Clone, Copy, PartialEq)]
enum Stage {
    Start,
    Goes,
    End,
}

/// How a move goes.
#[derive(Clone, Copy, PartialEq)]
enum Path {
    Joint,
    Straight,
    Round,
}

/// A verb: how the move goes, and the arc.
fn verb(name: &str) -> Option<(Path, Option<Stage>)> {
    Some(match name.to_ascii_uppercase().as_str() {
        "MOVEJ" | "MOVEABSJ" => (Path::Joint, None),
        "MOVEL" => (Path::Straight, None),
        "MOVEC" => (Path::Round, None),
        "ARCLSTART" => (Path::Straight, Some(Stage::Start)),
        "ARCL" => (Path::Straight, Some(Stage::Goes)),
        "ARCLEND" => (Path::Straight, Some(Stage::End)),
        "ARCCSTART" => (Path::Round, Some(Stage::Start)),
        "ARCC" => (Path::Round, Some(Stage::Goes)),
        "ARCCEND" => (Path::Round, Some(Stage::End)),
        _ => return None,
    })
}

/// `Offs(p10,0,0,50)`, along the axes of the work object, or `RelTool(p10,0,0,-50)`, along those of the tool, of a target that is known
/// by lengths that are numbers; nothing where it is none of these.
fn displaced(text: &str, known: &Declared) -> Option<Coordinates> {
    let (name, rest) = identifier(text);
    let tool = name.eq_ignore_ascii_case("RelTool");
    if !tool && !name.eq_ignore_ascii_case("Offs") {
        return None;
    }
    let inner = rest.trim().strip_prefix('(')?.strip_suffix(')')?;
    let all = arguments(inner);
    let [target, lengths @ ..] = &all[..] else {
        return None;
    };
    let lengths: Option<Vec<f64>> = lengths.iter().map(|v| finite(v)).collect();
    let [x, y, z] = lengths?[..] else {
        return None;
    };
    let listed = known.targets.get(&target.to_ascii_lowercase()).cloned();
    let mut place = listed.or_else(|| data::target(&data::value(target)?))?;
    if let Coordinates::Cartesian {
        xyz, wpr_degrees, ..
    } = &mut place
    {
        let at = pose(DVec3::from_array(*xyz), *wpr_degrees);
        let mut by = DVec3::new(x, y, z);
        if tool {
            by = at.orientation * by;
        }
        *xyz = (at.position + by).to_array().map(|v| scaled(v, 1.0));
        return Some(place);
    }
    None
}

impl Routine {
    fn statement(&mut self, text: &str, known: &Declared) {
        if let Some(comment) = text.strip_prefix('!') {
            return self.out.remark(comment);
        }
        if self.acts(text, known).is_none() {
            self.out.keep(text);
        }
    }

    fn acts(&mut self, text: &str, known: &Declared) -> Option<()> {
        let (name, rest) = identifier(text);
        if let Some((path, stage)) = verb(name) {
            return self.motion(path, stage, rest, known);
        }
        match name.to_ascii_uppercase().as_str() {
            "CONFJ" | "CONFL" => {
                let on = strip_prefix(rest.trim(), "\\On").is_some();
                self.monitored = on;
                return Some(());
            }
            "WAITTIME" => {
                let seconds = duration(arguments(rest).last()?)?;
                self.out.push(Instruction::Wait(seconds));
                return Some(());
            }
            "RETURN" if rest.is_empty() => {
                self.out.push(Instruction::End);
                return Some(());
            }
            "EXIT" | "BREAK" | "STOP" | "VAR" | "CONST" | "PERS" | "ELSE" | "ENDIF" | "ENDFOR"
            | "ENDWHILE" | "ENDTEST" | "DEFAULT" | "ERROR" | "UNDO" | "BACKWARD" | "RETRY"
            | "TRYNEXT" | "RAISE" | "ACTUNIT" | "DEACTUNIT" | "PDISPON" | "PDISPOFF"
            | "TPERASE" => return None,
            _ => {}
        }
        // a name alone calls a routine
        (rest.is_empty() && !name.is_empty()).then(|| self.out.call(name, ""))
    }

    /// Frame and tool of a move, by their numbers.
    fn frames(
        &mut self,
        tool: &str,
        object: Option<&str>,
        known: &Declared,
    ) -> (Option<u32>, Option<u32>) {
        let object = object.unwrap_or("wobj0");
        let (of_tool, of_object) = (
            numbered(&mut self.tools, tool),
            numbered(&mut self.objects, object),
        );
        self.out.program.name_frame(TOOL, of_tool, tool);
        self.out.program.name_frame(USER_FRAME, of_object, object);
        let [in_flange, in_base] = known.lie([tool, object]);
        let said = &mut self.out.program.said_frames;
        said.tool.extend(in_flange.map(|pose| (of_tool, pose)));
        said.user.extend(in_base.map(|pose| (of_object, pose)));
        (Some(of_object), Some(of_tool))
    }

    fn position(
        &mut self,
        text: &str,
        frames: (Option<u32>, Option<u32>),
        known: &Declared,
    ) -> PositionRef {
        if text.starts_with('[') {
            let value = data::value(text);
            let place = value
                .as_ref()
                .and_then(|v| data::target(v).or_else(|| data::joints(v)));
            if let Some(place) = place {
                let place = self.unmonitored(place);
                return self.out.place(place, frames);
            }
            return PositionRef::Unresolved(tidy(text));
        }
        if let Some(place) = displaced(text, known) {
            let place = self.unmonitored(place);
            return self.out.place(place, frames);
        }
        let found = known.targets.get(&text.to_ascii_lowercase()).cloned();
        let found = found.map(|place| self.unmonitored(place));
        // a target that is used in two frames is two positions
        let first = self.used.entry(text.to_ascii_lowercase()).or_insert(frames);
        let mut key = text.to_owned();
        if *first != frames {
            let (frame, tool) = frames;
            key = format!("{text}_{}_{}", frame.unwrap_or(0), tool.unwrap_or(0));
            while known.targets.contains_key(&key.to_ascii_lowercase()) {
                key.push('_');
            }
        }
        let named = self.out.named(&key, frames, || found);
        named.unwrap_or_else(|| PositionRef::Unresolved(tidy(text)))
    }

    fn unmonitored(&self, mut place: Coordinates) -> Coordinates {
        if let Coordinates::Cartesian { config, .. } = &mut place
            && !self.monitored
        {
            config.clear();
        }
        place
    }

    fn motion(
        &mut self,
        path: Path,
        stage: Option<Stage>,
        rest: &str,
        known: &Declared,
    ) -> Option<()> {
        let all: Vec<(&str, Vec<&str>)> =
            arguments(rest.trim_start().trim_start_matches("\\Conc,"))
                .into_iter()
                .map(switches)
                .collect();
        let mut all = all.into_iter();
        let mut extra = Vec::new();
        let mut next = || {
            let (head, switches) = all.next()?;
            let told = ["WObj", "SeamName", "Weave", "Track"];
            let rest = switches
                .iter()
                .filter(|s| told.iter().all(|t| strip_prefix(s, t).is_none()));
            extra.extend(rest.map(|s| format!("\\{}", tidy(s))));
            Some((head, switches))
        };
        let via = match path {
            Path::Round => Some(next()?.0),
            _ => None,
        };
        let (target, _) = next()?;
        let (speed, _) = next()?;
        let (mut seam, mut weld, mut told) = (None, None, Vec::new());
        if stage.is_some() {
            seam = Some(next()?.0);
            let (name, switches) = next()?;
            weld = Some(name);
            told.extend(switches);
        }
        let (zone, _) = next()?;
        let (tool, switches) = next()?;
        told.extend(&switches);
        if next().is_some() || tool.is_empty() {
            return None;
        }
        let frames = self.frames(tool, switch(&switches, "WObj"), known);
        // in the order of the line
        let via = via.map(|via| self.position(via, frames, known));
        let target = self.position(target, frames, known);
        let kind = match (path, via) {
            (Path::Joint, _) => MotionKind::Joint,
            (_, Some(via)) => MotionKind::Circular { via },
            _ => MotionKind::Linear,
        };
        let listed = |name: &str, map: &BTreeMap<String, f64>, read: fn(&Value) -> Option<f64>| {
            let known = map.get(&name.to_ascii_lowercase()).copied();
            known.or_else(|| read(&data::value(name)?))
        };
        let driven = listed(speed, &known.speeds, data::speed);
        let laid = weld.map(|name| {
            let found = known.welds.get(&name.to_ascii_lowercase()).cloned();
            found.unwrap_or_else(|| WeldData {
                arguments: name.to_owned(),
                speed: f64::NAN,
            })
        });
        // the weld data of a move hold until its end
        let speed = match (&laid, stage) {
            (Some(weld), Some(Stage::Goes | Stage::End)) => {
                Some(weld.speed).filter(|s| s.is_finite())
            }
            _ => driven,
        };
        let speed = match speed {
            Some(value) => Speed::path(value),
            None if path == Path::Joint => Speed::Maximum,
            None => Speed::Weld,
        };
        let termination = match listed(zone, &known.zones, data::zone) {
            Some(distance) if distance > 0.0 => Termination::Blend(distance),
            Some(_) => Termination::Fine,
            None => Termination::Other(zone.to_owned()),
        };
        if let Some(seam) = seam
            && self.out.program.attribute("SEAM").is_none()
        {
            self.out.program.attributes.push(Attribute {
                key: "SEAM".to_owned(),
                value: seam.to_owned(),
            });
        }
        if stage.is_some() {
            let swings = self.woven(&told, laid.as_ref().map(|weld| weld.speed), known);
            if stage != Some(Stage::Start) {
                self.swing(swings);
            }
        }
        let arc = self.arc(stage, laid);
        self.out.push(Instruction::Motion(MotionInstruction {
            arc,
            extra,
            ..MotionInstruction::plain(kind, target, speed, termination)
        }));
        if stage == Some(Stage::End) {
            self.swing(None);
        }
        Some(())
    }

    /// The weave of a move that lays metal at a speed, mm/s; what is not known of its path is kept.
    fn woven(&mut self, told: &[&str], speed: Option<f64>, known: &Declared) -> Option<Weave> {
        let zigzag = switch(told, "Weave").and_then(|name| {
            let known = known.zigzags.get(&name.to_ascii_lowercase()).copied();
            known.or_else(|| data::zigzag(&data::value(name)?))
        });
        // a path that is woven in an unknown way or tracked is not the one written
        for word in ["Weave", "Track"] {
            let said = told.iter().any(|s| strip_prefix(s, word).is_some());
            if said && !(word == "Weave" && zigzag.is_some()) {
                self.out.keep(&format!(
                    "\\{word} {}",
                    switch(told, word).unwrap_or_default()
                ));
            }
        }
        let speed = speed.filter(|speed| speed.is_finite());
        zigzag.zip(speed).map(|(zigzag, speed)| zigzag.at(speed))
    }

    /// The weave of the moves to come.
    fn swing(&mut self, weave: Option<Weave>) {
        if weave != self.weave {
            self.weave = weave;
            self.out.push(Instruction::Weave(weave));
        }
    }

    /// What the arc does at the end of the move being read; the move before begins to lay with other data where these differ.
    fn arc(&mut self, stage: Option<Stage>, laid: Option<WeldData>) -> Option<ArcWord> {
        let arguments = laid?.arguments;
        match stage? {
            Stage::Start => {
                self.arc = Some(arguments.clone());
                Some(ArcWord::new(ArcAction::Start, arguments))
            }
            stage => {
                if self.arc.as_ref() != Some(&arguments) {
                    let other = ArcWord::new(ArcAction::Start, arguments.clone());
                    match self.out.last_move() {
                        Some(motion) => motion.arc = Some(other),
                        None => self.out.keep("an arc that no move starts"),
                    }
                }
                if stage == Stage::Goes {
                    self.arc = Some(arguments);
                    return None;
                }
                self.arc = None;
                Some(ArcWord::new(ArcAction::End, arguments))
            }
        }
    }
}
