//! Programs from RAPID: the routines of a module. Never panics; what it does not know it keeps and lists.

use std::collections::BTreeMap;

use meltpath_toolpath::Weave;

use super::data::{self, Value, WeldData};
use super::declared::{Declared, declared, displaced, is_pose};
use super::statements::{Statement, outside, statements};
use super::variables;
use super::variants::{Variants, has_parameters};
use super::verbs::{Path, Stage, verb};
use crate::collected::Collected;
use crate::held::Holds;
use crate::parsed::{ParseError, Parsed, decoded};
use crate::program::{
    ArcAction, ArcWord, Attribute, Coordinates, Dialect, Instruction, MotionInstruction,
    MotionKind, PositionRef, Section, Speed, TOOL, Termination, USER_FRAME, Unsaid,
};
use crate::scan::{
    arguments, duration, identifier, is_variable, routine_name, strip_prefix, strip_word, tidy,
};

/// Reads the routines of a module, `main` first, the others in their order. `arc_values` is how many values of an `arcdata` mean something in this cell.
///
/// # Errors
/// [`ParseError`] where the text has no module or no routine, or a routine does not end.
pub fn read(bytes: &[u8], arc_values: usize) -> Result<Vec<Parsed>, ParseError> {
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
    let outside = outside(&all);
    let of_module = || all.iter().zip(&outside).filter(|(_, outside)| **outside);
    for (s, _) in of_module() {
        data::constant(&mut known.numbers, &s.text);
    }
    let kept: Vec<bool> = all
        .iter()
        .zip(&outside)
        .map(|(s, outside)| *outside && declared(&mut known, s, arc_values) == Some(true))
        .collect();
    let constants = variables::constants(&known.numbers, of_module().map(|(s, _)| s), &all);
    let mut variants = Variants::of(&all);
    let mut at = 0;
    while let Some(s) = all.get(at) {
        let outside = reader.open.is_none() && reader.skipped.is_none();
        if outside && kept.get(at) == Some(&true) {
            rest.push(format!("{};", tidy(&s.text)));
        }
        reader.statement(s, &known);
        at += 1;
        if outside && reader.open.is_some() {
            let body = all.get(at..).unwrap_or_default();
            let body = body
                .split(|s| s.text.eq_ignore_ascii_case("ENDPROC"))
                .next();
            let body = body.unwrap_or_default();
            at += body.len();
            let given = has_parameters(&s.text);
            let known = known.within(body, arc_values);
            for s in variables::run_through(&known, &constants, (&s.text, body)) {
                if given {
                    reader.statement(&s, &known);
                } else {
                    reader.executed(&s, &known, &mut variants);
                }
            }
        }
    }
    if reader.open.is_some() {
        let line = all.last().map_or(0, |s| s.line);
        return Err(ParseError::Unended {
            line,
            wanted: "ENDPROC",
        });
    }
    while let Some(variant) = variants.waiting.pop_front() {
        reader.open = Some(Routine::new(&variant.name));
        let known = known.within(&variant.body, arc_values);
        for s in variables::run_through(&known, &constants, ("", &variant.body)) {
            reader.executed(&s, &known, &mut variants);
        }
        reader.done.extend(reader.open.take());
    }
    // what is called with arguments is run with them alone
    let copied = |r: &Routine| {
        variants
            .copied
            .contains(&r.out.program.name.to_ascii_lowercase())
    };
    reader.done.retain(|r| !copied(r));
    let lines: Vec<&str> = text.lines().collect();
    let done = reader.done.into_iter();
    let mut parsed: Vec<Parsed> = done.map(|r| r.out.finish(&lines)).collect();
    for routine in &mut parsed {
        routine.program.said_frames.declared = known.standing();
    }
    // what the controller begins with, wherever it stands
    parsed.sort_by_key(|p| !p.program.name.eq_ignore_ascii_case("main"));
    let first = parsed.first_mut().ok_or_else(|| no("PROC"))?;
    if !rest.is_empty() {
        first.program.sections.push(Section {
            name: "DATA".to_owned(),
            lines: rest,
        });
    }
    Ok(parsed)
}

pub(super) struct Routine {
    out: Collected,
    /// Tools and work objects by their number.
    tools: Vec<String>,
    objects: Vec<String>,
    /// Frame and tool in which a target is used first.
    used: BTreeMap<String, (Option<u32>, Option<u32>)>,
    /// What is laid with while the arc burns.
    arc: Option<String>,
    /// The seam data that the arc was struck with.
    pub(super) seam: Option<String>,
    /// The weave that is on.
    weave: Option<Weave>,
    /// Configurations count along joint moves, and along paths.
    bind: [bool; 2],
    /// Those of the move being read do.
    monitored: bool,
    /// What the robot holds, as the lines before say it.
    holds: Option<Holds>,
}

struct Reader {
    open: Option<Routine>,
    /// The end of a piece that is no routine.
    skipped: Option<&'static str>,
    done: Vec<Routine>,
}

impl Reader {
    /// A statement of a routine that was run through: one that calls a routine with arguments runs a copy of it.
    fn executed(&mut self, s: &Statement, known: &Declared, variants: &mut Variants<'_>) {
        if let (Some(routine), Some(name)) = (&mut self.open, variants.called(&s.text, &known.own))
        {
            routine.out.line = s.line;
            routine.out.call(&name, "");
            return;
        }
        self.statement(s, known);
    }

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
                self.open = Some(Routine::new(name));
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

/// The speed of a move, mm/s, where it is known; else what its words leave: weld data of the controller where it lays metal by such.
fn speed_of(known: Option<f64>, (path, lays): (Path, bool), words: &str) -> Speed {
    match known {
        Some(value) => Speed::path(value),
        None if path == Path::Joint => Speed::Maximum,
        None if lays => Speed::Weld,
        None => Speed::Other(tidy(words)),
    }
}

impl Routine {
    fn new(name: &str) -> Self {
        Routine {
            out: Collected::new(Dialect::Rapid, name),
            tools: Vec::new(),
            objects: Vec::new(),
            used: BTreeMap::new(),
            arc: None,
            seam: None,
            weave: None,
            bind: [true; 2],
            monitored: true,
            holds: None,
        }
    }

    fn statement(&mut self, text: &str, known: &Declared) {
        if let Some(comment) = text.strip_prefix('!') {
            return self.out.remark(comment);
        }
        if self.acts(text, known).is_none() {
            let label = text.strip_suffix(':').is_some_and(is_variable);
            if label || known.lays_nothing(text) {
                self.out.pass(text);
            } else {
                self.out.keep(text);
            }
        }
    }

    fn acts(&mut self, text: &str, known: &Declared) -> Option<()> {
        let (name, rest) = identifier(text);
        if let Some((path, stage)) = verb(name) {
            let open = stage.is_none() && path != Path::Joint && self.arc.is_some();
            self.motion(path, stage, rest, known)?;
            if open {
                // in no manual that is known here
                self.out.unsaid([Unsaid::PlainMove(path.plain())]);
            }
            return Some(());
        }
        match name.to_ascii_uppercase().as_str() {
            along @ ("CONFJ" | "CONFL") => {
                let on = strip_prefix(rest.trim(), "\\On").is_some();
                self.bind[usize::from(along == "CONFL")] = on;
                return Some(());
            }
            "WAITTIME" => {
                let seconds = duration(arguments(rest).last()?)?;
                self.out.push(Instruction::Wait(seconds));
                return Some(());
            }
            "IF" => return self.stands(rest, known),
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
        let [of_its, of_part] = known.lie([tool, object]);
        let said = &mut self.out.program.said_frames;
        said.tool
            .extend(of_its.and_then(|l| Some((of_tool, l.at?))));
        said.user
            .extend(of_part.and_then(|l| Some((of_object, l.at?))));
        for name in [tool, object] {
            let unread = known.unread.get(&name.to_ascii_lowercase());
            if let Some(told) = unread.filter(|told| !said.unread.contains(told)) {
                said.unread.push(told.clone());
            }
        }
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

    /// What the robot holds along the moves to come, where it is said.
    fn hold(&mut self, said: Option<Holds>) {
        let Some(said) = said.filter(|said| self.holds != Some(*said)) else {
            return;
        };
        self.holds = Some(said);
        self.out.push(Instruction::Holds(said));
    }

    /// `IF tTorch.robhold OR NOT wPart.robhold EXIT`: from there on the torch stands, unless the module says otherwise.
    fn stands(&mut self, rest: &str, known: &Declared) -> Option<()> {
        let words: Vec<&str> = rest.split_whitespace().collect();
        let [tool, or, not, object, exit] = words[..] else {
            return None;
        };
        let same = [(or, "OR"), (not, "NOT"), (exit, "EXIT")];
        let same = same.iter().all(|(a, b)| a.eq_ignore_ascii_case(b));
        let of = |text: &str| {
            let (name, field) = text.split_once('.')?;
            let robhold = field.eq_ignore_ascii_case("robhold");
            robhold.then(|| name.to_owned())
        };
        let names = [of(tool)?, of(object)?];
        let said = known.holds([&names[0], &names[1]]);
        let goes_on = same && said.is_none_or(|said| said == Holds::Part);
        goes_on.then(|| self.hold(Some(Holds::Part)))
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
            // without offsets of external axes, which a line of its own would set
            let told = ["WObj", "SeamName", "Weave", "Track", "NoEOffs"];
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
        // no place is a text
        if target.contains('"') || via.is_some_and(|via| via.contains('"')) {
            return None;
        }
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
        let object = switch(&switches, "WObj").unwrap_or("wobj0");
        if path != Path::Joint || is_pose(target, known) {
            self.hold(known.holds([tool, object]));
        }
        self.monitored = self.bind[usize::from(path != Path::Joint)];
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
        // along a bead it holds, too: weld data tell the speed of the tip alone
        let turns = listed(speed, &known.turns, data::turns);
        // the weld data of a move hold until its end
        let along = match (&laid, stage) {
            (Some(weld), Some(Stage::Goes | Stage::End)) => {
                Some(weld.speed).filter(|s| s.is_finite())
            }
            _ => driven,
        };
        let lays = laid.is_some() && stage != Some(Stage::Start);
        let speed = speed_of(along, (path, lays), speed);
        let termination = match listed(zone, &known.zones, data::zone) {
            Some(distance) if distance > 0.0 => Termination::Blend(distance),
            Some(_) => Termination::Fine,
            None => Termination::Other(zone.to_owned()),
        };
        self.name_seam(seam);
        if stage.is_some() {
            let swings = self.woven(&told, laid.as_ref().map(|weld| weld.speed), known);
            if stage != Some(Stage::Start) {
                self.swing(swings);
            }
        }
        let arc = self.arc(stage, laid);
        let phases = self.phases((stage, seam), arc, known);
        let mut motion = MotionInstruction {
            arc: phases.at_end,
            extra,
            ..MotionInstruction::plain(kind, target, speed, termination)
        };
        motion.turns_at_most(turns);
        self.out.push(Instruction::Motion(motion));
        self.out.unsaid(phases.unsaid);
        phases.more.into_iter().for_each(|more| self.out.push(more));
        if stage == Some(Stage::End) {
            self.swing(None);
        }
        Some(())
    }

    /// The first seam data are those of the program.
    fn name_seam(&mut self, seam: Option<&str>) {
        if let Some(seam) = seam
            && self.out.program.attribute("SEAM").is_none()
        {
            self.out.program.attributes.push(Attribute {
                key: "SEAM".to_owned(),
                value: seam.to_owned(),
            });
        }
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
