//! Routines of a module that are called with arguments (`WeldSeam 6;`): each call runs a copy of the routine with the arguments in the places of its parameters.
//!
//! Arguments that the routine may set (`INOUT`, `VAR`, `PERS`) and those that may be missing are not followed: such calls are kept and told.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::declared::name_declared;
use super::statements::Statement;
use crate::scan::{arguments, identifier, is_variable, strip_word, tidy};

/// Copies beyond which calls are kept.
const MOST: usize = 2_000;

/// A routine with parameters.
struct Routine<'s> {
    name: &'s str,
    /// Kind and name of each.
    parameters: Vec<(&'s str, &'s str)>,
    line: u32,
    body: &'s [Statement],
}

/// A copy that is to be read.
pub(super) struct Variant {
    pub(super) name: String,
    pub(super) body: Vec<Statement>,
}

/// The routines with parameters, and the copies that calls ask for.
pub(super) struct Variants<'s> {
    routines: BTreeMap<String, Routine<'s>>,
    known: BTreeSet<String>,
    /// Routines of which there is a copy, in small letters.
    pub(super) copied: BTreeSet<String>,
    pub(super) waiting: VecDeque<Variant>,
}

/// Kinds whose values are followed where the routine is run through.
fn is_followed(kind: &str) -> bool {
    ["num", "robtarget", "bool"]
        .iter()
        .any(|k| k.eq_ignore_ascii_case(kind))
}

/// The head of a routine whose parameters are plain.
fn head(text: &str) -> Option<(&str, Vec<(&str, &str)>)> {
    let text = strip_word(text, "LOCAL").unwrap_or(text).trim_start();
    let (name, rest) = identifier(strip_word(text, "PROC")?.trim());
    let inner = rest.trim().strip_prefix('(')?.strip_suffix(')')?.trim();
    if inner.is_empty() {
        return None;
    }
    let parameter = |text: &'_ str| -> Option<(usize, usize)> {
        let (kind, name) = text.trim().split_once(char::is_whitespace)?;
        let plain = is_variable(kind) && is_variable(name.trim());
        plain.then_some((kind.len(), name.trim().len()))
    };
    let parts = inner.split(',').map(str::trim);
    let all: Option<Vec<(&str, &str)>> = parts
        .map(|part| parameter(part).map(|(k, n)| (&part[..k], &part[part.len() - n..])))
        .collect();
    Some((name, all?))
}

/// Whether a text begins a routine with parameters that can be copied.
pub(super) fn has_parameters(text: &str) -> bool {
    head(text).is_some()
}

/// A text with another one in the places of a name, outside quotes and behind no backslash.
fn replaced(text: &str, name: &str, by: &str) -> String {
    let mut out = String::new();
    let (mut word, mut quoted) = (String::new(), false);
    for c in text.chars().chain(['\0']) {
        if c.is_ascii_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        let fits = !quoted && !out.ends_with(['\\', '.']) && word.eq_ignore_ascii_case(name);
        out += if fits { by } else { &word };
        word.clear();
        quoted ^= c == '"';
        out.extend((c != '\0').then_some(c));
    }
    out
}

impl<'s> Variants<'s> {
    pub(super) fn of(all: &'s [Statement]) -> Self {
        let mut routines = BTreeMap::new();
        for (at, s) in all.iter().enumerate() {
            let Some((name, parameters)) = head(&s.text) else {
                continue;
            };
            let rest = all.get(at + 1..).unwrap_or_default();
            let body = rest
                .split(|s| s.text.eq_ignore_ascii_case("ENDPROC"))
                .next();
            let routine = Routine {
                name,
                parameters,
                line: s.line,
                body: body.unwrap_or_default(),
            };
            routines.insert(name.to_ascii_lowercase(), routine);
        }
        Variants {
            routines,
            known: BTreeSet::new(),
            copied: BTreeSet::new(),
            waiting: VecDeque::new(),
        }
    }

    /// The copy that a statement calls; nothing where it calls none. `own` are the data of the routine that calls: the other one does not know them
    /// by their names, and takes constants by their values.
    pub(super) fn called(
        &mut self,
        text: &str,
        own: &BTreeMap<String, Option<String>>,
    ) -> Option<String> {
        let (word, rest) = identifier(text);
        let routine = self.routines.get(&word.to_ascii_lowercase())?;
        let valued = |given: &str| match own.get(&given.trim().to_ascii_lowercase()) {
            Some(value) => value.clone(),
            None => Some(given.to_owned()),
        };
        let given: Vec<String> = arguments(rest)
            .into_iter()
            .map(valued)
            .collect::<Option<_>>()?;
        // nor does it take data that its own of the same names hide
        let theirs = routine.body.iter().filter_map(|s| name_declared(&s.text));
        let hidden: BTreeSet<String> = theirs.chain(own.keys().cloned()).collect();
        let taken = |text: &String| words(text).any(|w| hidden.contains(&w.to_ascii_lowercase()));
        if given.iter().any(taken) {
            return None;
        }
        let plain = |a: &String| !a.is_empty() && !a.contains(['\\', '?']) && !a.contains(":=");
        if given.len() != routine.parameters.len() || !given.iter().all(plain) {
            return None;
        }
        let name = format!("{}({})", routine.name, tidy(&given.join(",")));
        if self.known.contains(&name) {
            return Some(name);
        }
        if self.known.len() >= MOST {
            return None;
        }
        let pairs = || routine.parameters.iter().zip(&given);
        // what is no variable of the routine's own is written in its places
        let placed: Vec<_> = pairs()
            .filter(|((kind, _), _)| !is_followed(kind))
            .collect();
        let hides = |s: &Statement| placed.iter().any(|((_, name), _)| sets(&s.text, name));
        if routine.body.iter().any(hides) {
            return None;
        }
        let declared = pairs().filter(|((kind, _), _)| is_followed(kind));
        let mut body: Vec<Statement> = declared
            .map(|((kind, name), given)| Statement {
                line: routine.line,
                text: format!("VAR {kind} {name}:={given}"),
            })
            .collect();
        body.extend(routine.body.iter().map(|s| {
            let mut text = s.text.clone();
            for ((_, name), given) in &placed {
                if !text.starts_with('!') {
                    text = replaced(&text, name, given);
                }
            }
            Statement { line: s.line, text }
        }));
        self.copied.insert(word.to_ascii_lowercase());
        self.known.insert(name.clone());
        self.waiting.push_back(Variant {
            name: name.clone(),
            body,
        });
        Some(name)
    }
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
}

/// Whether a statement sets a variable or declares another one of its name.
fn sets(text: &str, name: &str) -> bool {
    let (left, _) = text.split_once(":=").unwrap_or(("", ""));
    !left.contains(['\\', '(']) && words(left).any(|w| w.eq_ignore_ascii_case(name))
}
