//! What a module declares: targets, speeds, zones, weld data, weaves, and where tools and work objects lie.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::data::{self, Lies, SeamData, WeldData, Zigzag};
use super::statements::Statement;
use crate::collected::scaled;
use crate::held::{Held, Holds};
use crate::orientation::pose;
use crate::program::Coordinates;
use crate::scan::{arguments, finite, identifier, strip_word, tidy};

/// The data that a module declares, or that count in one of its routines.
#[derive(Clone, Default)]
pub(super) struct Declared {
    /// What a routine declares for itself: constants with their values, other data with nothing.
    pub(super) own: BTreeMap<String, Option<String>>,
    pub(super) targets: BTreeMap<String, Coordinates>,
    pub(super) speeds: BTreeMap<String, f64>,
    /// How fast these let the tool turn, °/s.
    pub(super) turns: BTreeMap<String, f64>,
    pub(super) zones: BTreeMap<String, f64>,
    pub(super) welds: BTreeMap<String, WeldData>,
    pub(super) seams: BTreeMap<String, SeamData>,
    pub(super) zigzags: BTreeMap<String, Zigzag>,
    tools: BTreeMap<String, Lies>,
    objects: BTreeMap<String, Lies>,
    /// The kind of each name that is declared; nothing where it is declared as two.
    kinds: BTreeMap<String, Option<String>>,
    /// Constant numbers.
    pub(super) numbers: BTreeMap<String, f64>,
    /// Tools and objects whose places are no plain numbers: line and text of their declarations.
    pub(super) unread: BTreeMap<String, (u32, String)>,
}

/// Kinds of data that no move and no source is told by.
const APART: [&str; 13] = [
    "bool",
    "string",
    "iodev",
    "clock",
    "errnum",
    "intnum",
    "btnres",
    "errstr",
    "rawbytes",
    "socketdev",
    "tpnum",
    "listitem",
    "btndata",
];

impl Declared {
    /// What counts in a routine: what it declares itself hides data of the module.
    pub(super) fn within(&self, body: &[Statement], values: usize) -> Cow<'_, Declared> {
        let named = |s: &Statement| declaration(&s.text).map(|said| said.owned());
        let own: BTreeMap<String, Option<String>> = body.iter().filter_map(named).collect();
        if own.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut known = self.clone();
        for name in own.keys() {
            known.hide(name);
        }
        for s in body {
            data::constant(&mut known.numbers, &s.text);
        }
        for s in body {
            declared(&mut known, s, values);
        }
        known.own = own;
        Cow::Owned(known)
    }

    fn hide(&mut self, name: &str) {
        self.targets.remove(name);
        self.speeds.remove(name);
        self.turns.remove(name);
        self.zones.remove(name);
        self.welds.remove(name);
        self.seams.remove(name);
        self.zigzags.remove(name);
        self.tools.remove(name);
        self.objects.remove(name);
        self.kinds.remove(name);
        self.numbers.remove(name);
        self.unread.remove(name);
    }

    /// The names that are declared as `bool` alone.
    pub(super) fn truths(&self) -> BTreeSet<String> {
        let kinds = self.kinds.iter();
        let truths = kinds.filter(|(_, kind)| kind.as_deref() == Some("bool"));
        truths.map(|(name, _)| name.clone()).collect()
    }

    /// Whether a statement declares or sets what moves, sources and their data are not made of: texts, files, truths, clocks. What hangs on them is
    /// told where it stands.
    pub(super) fn lays_nothing(&self, text: &str) -> bool {
        // a function may do anything
        let outside: String = text.split('"').step_by(2).collect();
        if outside.contains('(') {
            return false;
        }
        let declares = ["VAR", "CONST", "PERS"]
            .iter()
            .find_map(|w| strip_word(text, w));
        let kind = if let Some(rest) = declares {
            Some(identifier(rest.trim_start()).0.to_ascii_lowercase())
        } else {
            let (name, rest) = identifier(text);
            let known = self.kinds.get(&name.to_ascii_lowercase());
            let sets = rest.trim_start().starts_with(":=");
            known.filter(|_| sets).cloned().flatten()
        };
        kind.is_some_and(|kind| APART.contains(&&*kind))
    }

    /// Where a tool and an object lie, as far as the module says it; the controller's own lie at flange and base.
    pub(super) fn lie(&self, [tool, object]: [&str; 2]) -> [Option<Lies>; 2] {
        let lies = |known: &BTreeMap<String, Lies>, name: &str, (own, held)| {
            let name = name.to_ascii_lowercase();
            let at = Some(Pose::IDENTITY);
            let said = known.get(&name).copied();
            said.or_else(|| (name == own).then_some(Lies { held, at }))
        };
        [
            lies(&self.tools, tool, ("tool0", Held::ByRobot)),
            lies(&self.objects, object, ("wobj0", Held::Standing)),
        ]
    }

    /// Where the objects lie that the module declares in plain numbers, in the base.
    pub(super) fn standing(&self) -> BTreeMap<String, Pose> {
        let stands = self
            .objects
            .iter()
            .filter(|(_, lies)| lies.held == Held::Standing);
        stands
            .filter_map(|(name, lies)| Some((name.clone(), lies.at?)))
            .collect()
    }

    /// What the robot holds with a tool and an object; nothing where the module says it of neither. Where it says it of one the other
    /// must be so on the controller.
    pub(super) fn holds(&self, names: [&str; 2]) -> Option<Holds> {
        match self.lie(names).map(|lies| lies.map(|l| l.held)) {
            [Some(tool), Some(object)] => Some(Holds::of(tool, object)),
            [Some(Held::ByRobot), None] | [None, Some(Held::Standing)] => Some(Holds::Torch),
            [Some(Held::Standing), None] | [None, Some(Held::ByRobot)] => Some(Holds::Part),
            [None, None] => None,
        }
    }
}

/// `CONST robtarget p10:=…`
struct Declaration<'t> {
    constant: bool,
    kind: &'t str,
    /// In small letters.
    name: String,
    /// Its value as it is written; empty where there is none.
    value: &'t str,
}

impl Declaration<'_> {
    /// The name, with the value of a constant.
    fn owned(&self) -> (String, Option<String>) {
        let value = self.constant.then(|| self.value.trim().to_owned());
        (self.name.clone(), value)
    }
}

/// What a statement declares; nothing where it does not.
fn declaration(text: &str) -> Option<Declaration<'_>> {
    let rest = strip_word(text, "LOCAL")
        .or_else(|| strip_word(text, "TASK"))
        .unwrap_or(text)
        .trim_start();
    let (word, rest) = ["CONST", "PERS", "VAR"]
        .iter()
        .find_map(|w| Some((*w, strip_word(rest, w)?)))?;
    let (kind, rest) = rest.trim_start().split_once(char::is_whitespace)?;
    let (name, value) = rest.split_once(":=").unwrap_or((rest, ""));
    Some(Declaration {
        constant: word == "CONST",
        kind,
        name: name.trim().to_ascii_lowercase(),
        value,
    })
}

/// The name that a statement declares, in small letters.
pub(super) fn name_declared(text: &str) -> Option<String> {
    declaration(text).map(|said| said.name)
}

/// Takes in a declaration: whether it is kept verbatim; nothing where the statement is none.
pub(super) fn declared(known: &mut Declared, s: &Statement, values: usize) -> Option<bool> {
    let Declaration {
        kind,
        name,
        value: text,
        ..
    } = declaration(&s.text)?;
    let other = Some(kind.to_ascii_lowercase());
    let said = known
        .kinds
        .entry(name.clone())
        .or_insert_with(|| other.clone());
    if *said != other {
        *said = None;
    }
    let value = data::value(text).map(|value| value.with(&known.numbers));
    let value = value.as_ref();
    let framed = value.is_some_and(data::says_places);
    if matches!(kind.to_ascii_lowercase().as_str(), "tooldata" | "wobjdata") && !framed {
        let told = (s.line, tidy(&s.text));
        known.unread.insert(name.clone(), told);
    }
    let read = match kind.to_ascii_lowercase().as_str() {
        "robtarget" => put(&mut known.targets, name, value.and_then(data::target)),
        "jointtarget" => put(&mut known.targets, name, value.and_then(data::joints)),
        "speeddata" => {
            put(&mut known.turns, name.clone(), value.and_then(data::turns));
            put(&mut known.speeds, name, value.and_then(data::speed))
        }
        "zonedata" => put(&mut known.zones, name, value.and_then(data::zone)),
        "welddata" => {
            let weld = value.and_then(|v| data::weld(v, values));
            put(&mut known.welds, name, weld)
        }
        // it stays, with what it says of the gas
        "seamdata" => {
            let seam = value.and_then(|v| data::seam(v, values));
            put(&mut known.seams, name, seam);
            None
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

/// `Offs(p10,0,0,50)`, along the axes of the work object, or `RelTool(p10,0,0,-50)`, along those of the tool, of a target that is known
/// by lengths that are numbers; nothing where it is none of these.
pub(super) fn displaced(text: &str, known: &Declared) -> Option<Coordinates> {
    within(text, known, DEEPEST)
}

/// Displacements of displaced targets are followed as deep.
const DEEPEST: usize = 6;

fn within(text: &str, known: &Declared, depth: usize) -> Option<Coordinates> {
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
    let inner = || within(target, known, depth.checked_sub(1)?);
    let place = listed.or_else(|| data::target(&data::value(target)?));
    let mut place = place.or_else(inner)?;
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

/// Whether a target is known to be told by place and orientation.
pub(super) fn is_pose(text: &str, known: &Declared) -> bool {
    let listed = known.targets.get(&text.to_ascii_lowercase());
    match listed {
        Some(place) => matches!(place, Coordinates::Cartesian { .. }),
        None => {
            !text.starts_with('[') || data::value(text).is_some_and(|v| data::target(&v).is_some())
        }
    }
}
