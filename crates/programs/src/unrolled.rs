//! What a routine comes to whose variables, conditions and loops are known: the statements that run, in order, with numbers in the places of variables.
//!
//! What hangs on anything else (inputs, what a call sets) stands as it is written, and so do the lines round it: readers keep and tell them.

mod folded;

use std::collections::{BTreeMap, BTreeSet};

use crate::collected::scaled;
use crate::expression::{Memory, Names, Quotient, Spelling};

/// Statements beyond which a routine stands as it is written: what runs longer is taken for endless.
const MOST: usize = 200_000;
/// Blocks within blocks.
const DEEPEST: usize = 64;

/// What a statement does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Step<'t> {
    /// Makes a variable of the routine's own, or several with commas between, with what it holds first.
    Declare(&'t str, Option<&'t str>),
    /// The same of variables of whole numbers: how others are rounded to them hangs on the language.
    DeclareWhole(&'t str, Option<&'t str>),
    /// Gives a variable, or one of its numbers, what an expression says.
    Set(&'t str, &'t str),
    /// Adds what an expression says to a variable.
    Add(&'t str, &'t str),
    /// Counts a variable from one value to another, by a third; by one towards the other where nothing is said.
    For(&'t str, [&'t str; 2], Option<&'t str>),
    While(&'t str),
    /// Goes on until `Until`.
    Repeat,
    Until(&'t str),
    /// Goes on until something leaves it.
    Loop,
    If(&'t str),
    ElseIf(&'t str),
    Else,
    /// Of any block.
    End,
    /// Leaves the innermost loop.
    Leave,
    /// Goes on with the next turn of the innermost loop.
    Again,
    /// A block of which nothing else is known.
    Opens,
    /// Goes on elsewhere.
    Jumps,
    /// Sets no variable.
    Acts,
    /// May set what it names, and what others can see.
    Calls,
}

/// The numbers of a place, each by what follows the place's name: `.trans.z`, `.Z`, `[2]`.
pub(crate) type Place = Vec<(&'static str, f64)>;

/// A language of controllers.
pub(crate) trait Language {
    fn step<'t>(&self, text: &'t str) -> Step<'t>;
    /// The place that an expression stands for whose values are numbers.
    fn place(&self, text: &str) -> Option<Place>;
    /// A place in numbers.
    fn written(&self, place: &[(&'static str, f64)]) -> String;
    /// The place that data declare by a name.
    fn declared(&self, name: &str) -> Option<Place>;
    /// The variables that hold truth values alone, as [`Names::key`] spells them.
    fn truths(&self) -> BTreeSet<String> {
        BTreeSet::new()
    }
    fn spelling(&self) -> Spelling;
    fn quotient(&self) -> Quotient;
}

/// A statement and its line, from 1.
pub(crate) type Statement = (u32, String);

/// What the statements of a routine come to; `constants` are numbers that hold all along. Where a block does not end, or the routine does not, they
/// stand as they are.
pub(crate) fn unrolled<L: Language>(
    language: &L,
    constants: &BTreeMap<String, f64>,
    statements: Vec<Statement>,
) -> Vec<Statement> {
    run_through(language, constants, &statements).unwrap_or(statements)
}

fn run_through<L: Language>(
    language: &L,
    constants: &BTreeMap<String, f64>,
    statements: &[Statement],
) -> Option<Vec<Statement>> {
    let steps: Vec<Step<'_>> = statements.iter().map(|s| language.step(&s.1)).collect();
    let said = |s: &Step<'_>| !matches!(s, Step::Acts | Step::Calls | Step::Opens | Step::End);
    let hangs = !constants.is_empty() || steps.iter().any(said);
    if !hangs || steps.contains(&Step::Jumps) {
        return None;
    }
    let ends = ends(&steps)?;
    let mut run = Run {
        language,
        statements,
        steps: &steps,
        ends: &ends,
        memory: Memory {
            names: Names {
                values: constants.clone(),
                truths: language.truths(),
                spelling: language.spelling(),
                quotient: language.quotient(),
            },
            ..Memory::default()
        },
        constants: constants.keys().cloned().collect(),
        own: BTreeSet::new(),
        whole: BTreeSet::new(),
        places: BTreeMap::new(),
        changed: BTreeSet::new(),
        shared: BTreeSet::new(),
        out: Vec::new(),
        left: MOST,
    };
    run.shared = run.shared();
    // else a loop is left where none is, or goes on for ever
    (run.all(0..statements.len())? == After::Next).then_some(run.out)
}

/// Of each statement that opens a block where the block's next part begins, or where it ends; of others their own.
fn ends(steps: &[Step<'_>]) -> Option<Vec<usize>> {
    let mut ends: Vec<usize> = (0..steps.len()).collect();
    let mut open = Vec::new();
    for (i, step) in steps.iter().enumerate() {
        match step {
            Step::For(..)
            | Step::While(_)
            | Step::Repeat
            | Step::Loop
            | Step::If(_)
            | Step::Opens => open.push(i),
            Step::ElseIf(_) | Step::Else => {
                ends[open.pop()?] = i;
                open.push(i);
            }
            Step::Until(_) | Step::End => ends[open.pop()?] = i,
            _ => {}
        }
        if open.len() > DEEPEST {
            return None;
        }
    }
    open.is_empty().then_some(ends)
}

/// What comes after a block.
#[derive(Clone, Copy, PartialEq)]
enum After {
    Next,
    Leave,
    Again,
}

struct Run<'a, L> {
    language: &'a L,
    statements: &'a [Statement],
    steps: &'a [Step<'a>],
    ends: &'a [usize],
    memory: Memory,
    constants: BTreeSet<String>,
    /// Variables that the routine declares.
    own: BTreeSet<String>,
    /// Those of whole numbers.
    whole: BTreeSet<String>,
    /// What follows the names of places that are known.
    places: BTreeMap<String, Vec<&'static str>>,
    /// Variables that are set in blocks of which nothing is known, such as functions within functions: whenever these run.
    shared: BTreeSet<String>,
    /// Places that were set: their names stand for other numbers than the data say.
    changed: BTreeSet<String>,
    out: Vec<Statement>,
    left: usize,
}

impl<L: Language> Run<'_, L> {
    /// What is set in blocks of which nothing is known.
    fn shared(&self) -> BTreeSet<String> {
        let opens = (0..self.steps.len()).filter(|at| self.steps[*at] == Step::Opens);
        let inside = opens.flat_map(|at| at..self.last(at));
        let set = inside.flat_map(|at| self.set_by(at));
        set.collect()
    }

    /// The variables that a statement sets.
    fn set_by(&self, at: usize) -> Vec<String> {
        let (Step::Declare(names, _)
        | Step::DeclareWhole(names, _)
        | Step::Set(names, _)
        | Step::Add(names, _)
        | Step::For(names, ..)) = self.steps[at]
        else {
            return Vec::new();
        };
        let key = |name: &str| base_of(&self.memory.names.key(name.trim())).to_owned();
        names.split(',').map(key).collect()
    }

    /// Runs statements; nothing where that does not end.
    fn all(&mut self, range: std::ops::Range<usize>) -> Option<After> {
        let mut at = range.start;
        while at < range.end {
            self.left = self.left.checked_sub(1)?;
            let end = self.ends[at];
            match self.steps[at] {
                Step::Declare(names, value) => self.declare(at, names, value),
                Step::DeclareWhole(names, value) => {
                    let keys = self.set_by(at);
                    self.whole.extend(keys);
                    self.declare(at, names, value);
                }
                Step::Set(name, value) => self.set(at, name, value),
                Step::Add(name, by) => self.set(at, name, &format!("{name}+({by})")),
                Step::For(..) | Step::While(_) | Step::Repeat | Step::Loop => {
                    self.turns(at)?;
                    at = end;
                }
                Step::If(_) => {
                    let (after, last) = self.branch(at)?;
                    if after != After::Next {
                        return Some(after);
                    }
                    at = last;
                }
                Step::Leave => return Some(After::Leave),
                Step::Again => return Some(After::Again),
                Step::Acts => self.say(at),
                Step::Calls => self.calls(at),
                Step::Opens
                | Step::Jumps
                | Step::ElseIf(_)
                | Step::Else
                | Step::Until(_)
                | Step::End => {
                    let last = self.last(at);
                    self.verbatim(at..last + 1);
                    at = last;
                }
            }
            at += 1;
        }
        Some(After::Next)
    }

    /// The end of the whole block that a statement opens.
    fn last(&self, mut at: usize) -> usize {
        while self.ends[at] != at {
            at = self.ends[at];
        }
        at
    }

    /// A statement with numbers in the places of variables.
    fn say(&mut self, at: usize) {
        let (line, text) = &self.statements[at];
        let text = self.folded(text);
        self.out.push((*line, text));
    }

    /// A statement that may set what it names, and what others can see.
    fn calls(&mut self, at: usize) {
        self.say(at);
        self.unknown_to_calls(at..at + 1);
    }

    /// Forgets what calls among statements may set.
    fn unknown_to_calls(&mut self, range: std::ops::Range<usize>) {
        let calls = range.filter(|at| {
            matches!(
                self.steps[*at],
                Step::Calls | Step::Declare(..) | Step::DeclareWhole(..) | Step::Set(..)
            )
        });
        let named: BTreeSet<String> = calls
            .flat_map(|at| names(&self.statements[at].1))
            .map(|name| base_of(&self.memory.names.key(name)).to_owned())
            .collect();
        let own = &self.own;
        let kept = |key: &str| own.contains(base_of(key)) && !named.contains(base_of(key));
        let constants = &self.constants;
        let values = &mut self.memory.names.values;
        values.retain(|key, _| constants.contains(key) || kept(key));
    }

    /// A block as it is written; what it sets is not known in it and from then on.
    fn verbatim(&mut self, range: std::ops::Range<usize>) {
        let set: Vec<String> = range.clone().flat_map(|at| self.set_by(at)).collect();
        for key in set {
            self.forget(&key);
            self.changed.insert(key);
        }
        if range.clone().any(|at| self.steps[at] == Step::Calls) {
            // in a loop also what stands before a call comes behind it
            self.unknown_to_calls(range.clone());
        }
        for at in range {
            match self.steps[at] {
                Step::Acts | Step::Calls => self.say(at),
                _ => self.out.push(self.statements[at].clone()),
            }
        }
    }

    fn forget(&mut self, name: &str) {
        let key = self.memory.names.key(name);
        let base = base_of(&key).to_owned();
        self.memory.names.values.retain(|k, _| base_of(k) != base);
    }

    fn declare(&mut self, at: usize, names: &str, value: Option<&str>) {
        for name in names.split(',').map(str::trim) {
            let key = self.memory.names.key(name);
            self.own.insert(key.clone());
            self.constants.remove(&key);
            if let Some(value) = value {
                self.set(at, name, value);
            } else {
                self.forget(name);
                self.changed.insert(key);
            }
        }
    }

    fn set(&mut self, at: usize, name: &str, value: &str) {
        let names = &self.memory.names;
        let key = names.key(name);
        let base = base_of(&key).to_owned();
        self.known_place(&base);
        let value = self.folded(value);
        if let Some(number) = self.memory.number(&value) {
            let element = base != key;
            // one of the numbers of a place that is not known whole stands for nothing
            let rounded = self.whole.contains(&base) && number.fract() != 0.0;
            if !self.shared.contains(&base)
                && !rounded
                && (!element || self.memory.names.values.contains_key(&key))
            {
                // as in decimals: what controllers round is less than their digits tell
                self.memory.names.values.insert(key, scaled(number, 1.0));
                if element {
                    self.changed.insert(base);
                }
                return;
            }
        } else if base == key && !self.shared.contains(&base) {
            let truth = self.memory.names.truths.contains(&base);
            if let Some(holds) = self.memory.condition(&value).filter(|_| truth) {
                self.memory
                    .names
                    .values
                    .insert(key, f64::from(u8::from(holds)));
                return;
            }
            let other = self.memory.names.key(value.trim());
            self.known_place(&other);
            if let Some(place) = self
                .language
                .place(&value)
                .or_else(|| self.place_of(&other))
            {
                self.put(&base, &place);
                self.changed.insert(base);
                return;
            }
        }
        self.forget(name);
        self.changed.insert(base);
        if value.contains('(') {
            self.calls(at);
        } else {
            self.out.push(self.statements[at].clone());
        }
    }

    /// Takes in a place that data declare, where it is not known yet and was not set.
    fn known_place(&mut self, key: &str) {
        if self.changed.contains(key) || self.places.contains_key(key) {
            return;
        }
        if let Some(place) = self.language.declared(key) {
            self.put(key, &place);
        }
    }

    fn put(&mut self, key: &str, place: &[(&'static str, f64)]) {
        self.forget(key);
        for (suffix, value) in place {
            let element = self.memory.names.key(&format!("{key}{suffix}"));
            self.memory.names.values.insert(element, *value);
        }
        let suffixes = place.iter().map(|(suffix, _)| *suffix).collect();
        self.places.insert(key.to_owned(), suffixes);
    }

    /// The numbers of a place; nothing where one of them is not known.
    fn place_of(&self, key: &str) -> Option<Place> {
        let suffixes = self.places.get(key)?;
        let number = |suffix: &&'static str| {
            let value = self.memory.names.value(&format!("{key}{suffix}"))?;
            Some((*suffix, value))
        };
        suffixes.iter().map(number).collect()
    }

    /// From where to where a loop counts, and by how much.
    fn counted(&self, [from, to]: [&str; 2], by: Option<&str>) -> Option<[f64; 3]> {
        let [from, to] = [self.memory.number(from)?, self.memory.number(to)?];
        let by = match by {
            Some(text) => self.memory.number(text)?,
            None if to < from => -1.0,
            None => 1.0,
        };
        let all = [from, to, by];
        let counts = match self.language.quotient() {
            Quotient::Fraction => true,
            // where types tell numbers apart, counters are whole
            Quotient::Unknown => all.iter().all(|v| v.fract() == 0.0),
        };
        (by != 0.0 && counts).then_some(all)
    }

    /// Runs a loop.
    fn turns(&mut self, at: usize) -> Option<()> {
        self.turned(at)?;
        if let Step::For(name, ..) = self.steps[at] {
            // what it stands for behind the loop hangs on the language
            self.forget(name);
        }
        Some(())
    }

    fn turned(&mut self, at: usize) -> Option<()> {
        let end = self.ends[at];
        let body = at + 1..end;
        let counts = match self.steps[at] {
            Step::For(name, range, by) => {
                let Some([from, to, by]) = self.counted(range, by) else {
                    self.verbatim(at..end + 1);
                    return Some(());
                };
                Some((name, from, to, by))
            }
            _ => None,
        };
        let mut count = counts.map(|(_, from, ..)| from);
        loop {
            self.left = self.left.checked_sub(1)?;
            let goes = match (self.steps[at], counts.zip(count)) {
                (_, Some(((name, _, to, by), value))) => {
                    let key = self.memory.names.key(name);
                    self.memory.names.values.insert(key, value);
                    count = Some(scaled(value + by, 1.0));
                    Some((to - value) * by.signum() >= 0.0)
                }
                (Step::While(condition), None) => self.memory.condition(condition),
                _ => Some(true),
            };
            match goes {
                Some(true) => {}
                Some(false) => return Some(()),
                None => {
                    self.verbatim(at..end + 1);
                    return Some(());
                }
            }
            if self.all(body.clone())? == After::Leave {
                return Some(());
            }
            if let Step::Until(condition) = self.steps[end] {
                match self.memory.condition(condition) {
                    Some(true) => return Some(()),
                    Some(false) => {}
                    // it ran once; whether it runs again is not known
                    None => {
                        self.verbatim(at..end + 1);
                        return Some(());
                    }
                }
            }
        }
    }

    /// Runs the part of a condition that holds; where its end is.
    fn branch(&mut self, at: usize) -> Option<(After, usize)> {
        let last = self.last(at);
        let mut part = at;
        loop {
            let holds = match self.steps[part] {
                Step::If(condition) | Step::ElseIf(condition) => self.memory.condition(condition),
                Step::Else => Some(true),
                _ => return Some((After::Next, last)),
            };
            let next = self.ends[part];
            match holds {
                Some(true) => return Some((self.all(part + 1..next)?, last)),
                Some(false) => part = next,
                None => {
                    self.verbatim(at..last + 1);
                    return Some((After::Next, last));
                }
            }
        }
    }
}

/// The variable of which a name is one number: `p10` of `p10.trans.z` and of `p10[2]`.
fn base_of(key: &str) -> &str {
    key.split(['.', '[']).next().unwrap_or(key)
}

/// The names in a text, outside quotes.
fn names(text: &str) -> impl Iterator<Item = &str> {
    let outside = text.split('"').step_by(2);
    let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$');
    let words = outside.flat_map(move |piece| piece.split(move |c| !part(c)));
    words.filter(|w| w.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_'))
}
