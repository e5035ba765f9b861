//! Walks the tree of a TOML file by its declaration: everything wrong is found at once, each with its place.

use std::ops::Range;
use std::slice::Iter;

use toml::de::{DeTable, DeValue};

use super::{Bounds, Fallback, Key, Kind, Problem, Setting, Table, Under, Value, syntax};
use crate::provenance::Provenance;
use crate::resolved::{Origin, Resolved};

/// A value in the file, with its place.
pub type Node<'a> = toml::Spanned<DeValue<'a>>;

/// Which key is read.
#[derive(Debug, Clone, Copy)]
pub struct Place<'a> {
    /// Its dotted name; empty for the whole file.
    pub name: &'a str,
    /// Which numbers it takes.
    pub bounds: Bounds,
}

/// What was found while reading.
#[derive(Debug, Default)]
pub struct Reader {
    /// Everything wrong.
    pub problems: Vec<Problem>,
    /// Every value written and every default.
    pub provenance: Provenance,
    /// The dotted names of keys that are written with a value that does not read.
    pub wrong_keys: Vec<String>,
    /// How deep in defaults, which have no place in the file.
    in_default: usize,
}

impl Reader {
    /// The tree of a file; what a damaged file seems to say beyond the damage would be guessed.
    fn tree<'t>(&mut self, text: &'t str) -> Option<Node<'t>> {
        let (tree, errors) = DeTable::parse_recoverable(text);
        for error in &errors {
            let told = syntax::problem(text, error.message(), error.span());
            // of one value the parser tells several things; what to write is said once
            let again =
                |p: &Problem| told.fix.is_some() && (&p.span, &p.fix) == (&told.span, &told.fix);
            if !self.problems.iter().any(again) {
                self.problems.push(told);
            }
        }
        let span = tree.span();
        let node = toml::Spanned::new(span, DeValue::Table(tree.into_inner()));
        errors.is_empty().then_some(node)
    }

    pub(super) fn document<T: Value>(
        &mut self,
        text: &str,
        under: Option<&Under<'_>>,
    ) -> Option<T> {
        let mut node = self.tree(text)?;
        if let (Some(under), DeValue::Table(table)) = (under, node.get_mut()) {
            under.fill(table);
        }
        let place = Place {
            name: "",
            bounds: Bounds::any(),
        };
        T::read(&node, &place, self)
    }

    pub(super) fn peek<T: Value>(&mut self, text: &str, path: &[&str]) -> Option<T> {
        let tree = self.tree(text)?;
        let mut node = &tree;
        for key in path {
            node = node.get_ref().as_table()?.get(*key)?;
        }
        let place = Place {
            name: &path.join("."),
            bounds: Bounds::any(),
        };
        T::read(node, &place, self)
    }

    /// A table of which nothing is written.
    pub(super) fn defaults<T: Value>(&mut self, name: &str) -> Option<T> {
        let place = Place {
            name,
            bounds: Bounds::any(),
        };
        let node = toml::Spanned::new(0..0, DeValue::Table(DeTable::new()));
        T::read(&node, &place, self)
    }

    /// The place of a node in the file; none in a default.
    pub fn span(&self, node: &Node<'_>) -> Option<Range<usize>> {
        (self.in_default == 0).then(|| node.span())
    }

    /// Something is wrong with a node.
    pub fn wrong(&mut self, node: &Node<'_>, problem: Problem) {
        let span = self.span(node);
        self.problems.push(problem.at(span));
    }

    /// A node of another type than wanted.
    pub fn unexpected(&mut self, node: &Node<'_>, place: &Place<'_>, wanted: &str) {
        let found = match node.get_ref() {
            DeValue::String(_) => "a text",
            DeValue::Integer(_) => "a whole number",
            DeValue::Float(n) if n.as_str().parse::<f64>().is_ok_and(f64::is_finite) => {
                "a number with a point"
            }
            DeValue::Float(n) => &format!("{}, which is no value", n.as_str()),
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        let message = format!("{} is {wanted}; what is written is {found}", place.name);
        self.wrong(node, Problem::new(message));
    }

    /// A whole number, as it is `written`, that is none from zero to `most`.
    pub(super) fn not_counted(
        &mut self,
        node: &Node<'_>,
        place: &Place<'_>,
        written: &str,
        most: f64,
    ) {
        let message = format!(
            "{} is {written}: it must be a whole number from zero to {most}",
            place.name
        );
        self.wrong(node, Problem::new(message));
    }

    /// Refuses a number that its key does not take; `show` tells numbers as files write them.
    pub fn within(
        &mut self,
        number: f64,
        node: &Node<'_>,
        place: &Place<'_>,
        show: impl Fn(f64) -> String,
    ) -> Option<()> {
        let span = self.span(node);
        self.hold(number, &span, place, show)
    }

    /// Refuses a number written at `span` that its key does not take; `show` tells numbers as files write them.
    pub fn hold(
        &mut self,
        number: f64,
        span: &Option<Range<usize>>,
        place: &Place<'_>,
        show: impl Fn(f64) -> String,
    ) -> Option<()> {
        if place.bounds.hold(number) {
            return Some(());
        }
        let must = match place.bounds {
            b if b == Bounds::positive() => "above zero".to_owned(),
            b if b == Bounds::not_negative() => "zero or above: it must not be negative".to_owned(),
            b => b.words(&show),
        };
        let message = format!("{} is {}: it must be {must}", place.name, show(number));
        self.problems.push(Problem::new(message).at(span.clone()));
        None
    }

    /// Which of the words is written.
    pub fn word(&mut self, node: &Node<'_>, place: &Place<'_>, words: &[&str]) -> Option<usize> {
        let quoted: Vec<String> = words.iter().map(|w| format!("\"{w}\"")).collect();
        let known = quoted.join(", ");
        let Some(written) = node.get_ref().as_str() else {
            self.unexpected(node, place, &format!("one of {known}"));
            return None;
        };
        let found = words.iter().position(|w| *w == written);
        if found.is_none() {
            let near = nearest(written, words.iter().copied());
            let problem = Problem {
                fix: near.map(|w| format!("\"{w}\"")),
                ..Problem::new(format!(
                    "{} is one of {known}, not \"{written}\"",
                    place.name
                ))
            };
            let help = near.map(|w| format!("did you mean \"{w}\"?"));
            self.wrong(node, Problem { help, ..problem });
        }
        found
    }

    /// Which of the words a table's key `by` has, where the tables differ by it; what is wrong with it is told.
    pub fn chosen<T: Value>(&mut self, node: &Node<'_>, place: &Place<'_>, by: &str) -> Option<T> {
        let Some(entries) = node.get_ref().as_table() else {
            self.unexpected(node, place, "a table");
            return None;
        };
        let name = format!("{}.{by}", place.name);
        if let Some(node) = entries.get(by) {
            let place = Place {
                name: &name,
                bounds: Bounds::any(),
            };
            T::read(node, &place, self)
        } else {
            self.wrong(node, Problem::new(format!("{name} is missing")));
            None
        }
    }

    fn record<T: Value>(&mut self, setting: &Setting<T>, origin: Origin) {
        if !matches!(T::KIND, Kind::Table(_)) {
            let value = Resolved::new(setting.value.json(), origin);
            self.provenance.parameter(&setting.name, &value);
        }
    }
}

/// The keys of a table, read in the order of their declaration.
#[derive(Debug)]
pub struct Keys<'n, 'a> {
    entries: &'n DeTable<'a>,
    /// Where the table stands.
    span: Option<Range<usize>>,
    name: &'n str,
    rest: Iter<'static, Key>,
}

/// A key, its setting as far as it is known, and where it is written.
type Next<'n, 'a, T> = (&'static Key, Setting<Option<T>>, Option<&'n Node<'a>>);

impl<'n, 'a> Keys<'n, 'a> {
    /// Opens a table: its unknown keys are told.
    pub fn open<T: Value>(
        node: &'n Node<'a>,
        place: &Place<'n>,
        reader: &mut Reader,
    ) -> Option<Self> {
        let (Kind::Table(Table { keys, .. }) | Kind::Figure(Table { keys, .. })) = T::KIND else {
            return None;
        };
        let Some(entries) = node.get_ref().as_table() else {
            reader.unexpected(node, place, "a table");
            return None;
        };
        for key in entries.keys() {
            let written = key.get_ref().as_ref();
            if keys.iter().all(|k| k.name != written) {
                reader
                    .problems
                    .push(unknown(place.name, written, keys).at(key.span()));
            }
        }
        // of the whole file no place is to blame
        let span = reader.span(node).filter(|_| !place.name.is_empty());
        Some(Keys {
            entries,
            span,
            name: place.name,
            rest: keys.iter(),
        })
    }

    fn next<T>(&mut self) -> Option<Next<'n, 'a, T>> {
        let key = self.rest.next()?;
        let name = match self.name {
            "" => key.name.to_owned(),
            table => format!("{table}.{}", key.name),
        };
        let setting = Setting {
            name,
            value: None,
            span: None,
            relation: match key.fallback {
                Fallback::Computed(relation) => relation,
                _ => "",
            },
        };
        Some((key, setting, self.entries.get(key.name)))
    }

    fn written<T: Value>(
        key: &Key,
        setting: &mut Setting<Option<T>>,
        node: &Node<'_>,
        reader: &mut Reader,
    ) {
        let place = Place {
            name: &setting.name,
            bounds: key.bounds,
        };
        setting.value = T::read(node, &place, reader);
        setting.span = reader.span(node);
        if setting.value.is_none() {
            reader.wrong_keys.push(setting.name.clone());
        }
        if let Some(value) = &setting.value
            && !matches!(T::KIND, Kind::Table(_))
        {
            let value = Resolved::new(value.json(), Origin::Job);
            reader.provenance.parameter(&setting.name, &value);
        }
    }

    /// The next key, which must be written.
    pub fn required<T: Value>(&mut self, reader: &mut Reader) -> Option<Setting<T>> {
        let (key, mut setting, node) = self.next()?;
        if let Some(node) = node {
            Self::written(key, &mut setting, node, reader);
        } else {
            let problem = Problem::new(format!("{} is missing", setting.name));
            let help = format!("add it: {}", key.text.trim());
            let problem = problem.help(help).at(self.span.clone());
            reader.problems.push(problem);
        }
        filled(setting)
    }

    /// The next key, which has a default.
    pub fn default<T: Value>(&mut self, reader: &mut Reader) -> Option<Setting<T>> {
        let (key, mut setting, node) = self.next()?;
        if let Some(node) = node {
            Self::written(key, &mut setting, node, reader);
        }
        if setting.value.is_some() {
            return filled(setting);
        }
        let Fallback::Default { toml, why } = key.fallback else {
            return None;
        };
        let place = Place {
            name: &setting.name,
            bounds: key.bounds,
        };
        reader.in_default += 1;
        setting.value = match DeValue::parse(toml) {
            Ok(node) => T::read(&node, &place, reader),
            Err(e) => {
                reader.problems.push(Problem::new(format!(
                    "the default of {}: {e}",
                    setting.name
                )));
                None
            }
        };
        reader.in_default -= 1;
        let setting = filled(setting)?;
        // a value that is written but wrong is neither the job's nor the default
        if setting.span.is_none() {
            reader.record(&setting, Origin::Default(why.to_owned()));
        }
        Some(setting)
    }

    /// The next key, which a relation gives where it is not written.
    pub fn computed<T: Value>(&mut self, reader: &mut Reader) -> Option<Setting<Option<T>>> {
        let (key, mut setting, node) = self.next()?;
        if let Some(node) = node {
            Self::written(key, &mut setting, node, reader);
        }
        Some(setting)
    }

    /// The next key, which may be absent.
    pub fn none<T: Value>(&mut self, reader: &mut Reader) -> Option<Setting<Option<T>>> {
        self.computed(reader)
    }
}

/// The setting of a key that has a value.
pub(super) fn filled<T>(setting: Setting<Option<T>>) -> Option<Setting<T>> {
    Some(Setting {
        value: setting.value?,
        name: setting.name,
        span: setting.span,
        relation: setting.relation,
    })
}

fn unknown(table: &str, written: &str, keys: &[Key]) -> Problem {
    let within = match table {
        "" => String::new(),
        table => format!(" in [{table}]"),
    };
    let message = format!("there is no key `{written}`{within}");
    let names = || keys.iter().map(|k| k.name);
    if let Some(near) = nearest(written, names()) {
        Problem {
            fix: Some(near.to_owned()),
            ..Problem::new(message).help(format!("did you mean `{near}`?"))
        }
    } else {
        let known: Vec<&str> = names().collect();
        Problem::new(message).help(format!("known here are {}", known.join(", ")))
    }
}

/// The word nearest to what is written, if one is near: at most a third of its letters differ.
pub fn nearest<'w>(written: &str, words: impl Iterator<Item = &'w str>) -> Option<&'w str> {
    words
        .map(|w| (distance(written, w), w))
        .filter(|(d, w)| *d <= (w.chars().count() / 3).max(1))
        .min_by_key(|(d, _)| *d)
        .map(|(_, w)| w)
}

/// Letters to put in, take out or exchange on the way from one word to the other (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let exchanged = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = exchanged.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
#[expect(
    unreachable_pub,
    dead_code,
    reason = "tables are declared public, and tests use a part of them"
)]
mod tests {
    use crate::settings::{listing, read, rounded};
    use crate::{Length, Origin, Provenance, Ratio, Resolved, choice, table};

    choice! {
        /// A strategy.
        pub enum Strategy {
            Lines "lines" => "Lines.",
            Spots "spots" => "Spots.",
        }
    }

    table! {
        /// A job.
        pub struct Job {
            /// The hatch.
            hatch: Hatch => default({}, "as usual");
            /// The judge.
            judge: Judge => none("not judged");
        }

        /// A hatch.
        pub struct Hatch {
            /// What is drawn.
            strategy: Strategy => default("lines", "simple");
            /// Distances.
            spacing: [Length; 2] where positive => default(["1 mm", "2 mm"], "wide");
            /// A share.
            share: Ratio where within(0.0, 1.0) => computed("what is left");
        }

        /// A judge.
        pub struct Judge {
            /// How many.
            planes: u32 where within(1.0, 16.0) => required;
        }
    }

    #[test]
    fn every_problem_has_its_place() {
        let text = "[hatch]\nstrategy = \"spot\"\nspacing = [1, \"2 mm\", \"3 mm\"]\nshare = \"101 %\"\n[judge]\nplanes = 17\n[jude]\n";
        let found = read::<Job>(text);
        // a judge that does not read is none
        assert!(
            found
                .settings
                .is_some_and(|job| job.judge.is_none() && job.judge.is_written())
        );
        let told: Vec<(&str, String)> = found
            .problems
            .iter()
            .map(|p| (&text[p.span.clone().unwrap()], p.message.clone()))
            .collect();
        let places: Vec<&str> = told.iter().map(|t| t.0).collect();
        assert_eq!(
            places,
            [
                "\"spot\"",
                "[1, \"2 mm\", \"3 mm\"]",
                "1",
                "\"101 %\"",
                "17",
                "jude"
            ],
            "{told:?}"
        );
        assert!(told[3].1.contains("0 % to 100 %"), "{}", told[3].1);
        assert!(told[4].1.contains("1 to 16"), "{}", told[4].1);
        assert_eq!(found.problems[5].fix.as_deref(), Some("judge"));
        // and none of them is listed as if it were not written
        let super::Kind::Table(table) = <Job as super::Value>::KIND else {
            panic!("a table")
        };
        assert_eq!(
            listing(&table, &found.provenance, &found.wrong_keys),
            [
                "",
                "[hatch]",
                "strategy: wrong: see below",
                "spacing: wrong: see below",
                "share: wrong: see below",
                "",
                "[judge]",
                "planes: wrong: see below",
            ]
        );
        let found = read::<Job>("judge = 3\n");
        let lines = listing(&table, &found.provenance, &found.wrong_keys);
        assert_eq!(lines.last().unwrap(), "[judge] wrong: see below");
    }

    #[test]
    fn an_uncertain_value_is_rounded_by_its_uncertainty() {
        let table = super::Table {
            text: "",
            keys: &[],
        };
        let mut provenance = Provenance::new();
        let job = Origin::Job;
        let width = Resolved::new("6.532812 mm", job.clone()).with_sigma("0.48996 mm");
        provenance.parameter("a", &width);
        provenance.parameter("b", &Resolved::new(23.14, job.clone()).with_sigma(0.775));
        provenance.parameter("c", &Resolved::new("1 m", job).with_sigma("3 mm"));
        assert_eq!(
            listing(&table, &provenance, &[])[2..],
            [
                "a = 6.53 ± 0.49 mm    (the job)",
                "b = 23.14 ± 0.78    (the job)",
                "c = 1 m ± 3 mm    (the job)",
            ]
        );
    }

    #[test]
    fn values_keep_their_origin_and_are_listed_by_section() {
        let found = read::<Job>("[hatch]\nstrategy = \"spots\"\n");
        let mut provenance = found.provenance;
        let job = found.settings.unwrap();
        let share = job
            .hatch
            .share
            .or_computed(&mut provenance, Ratio(1.0 / 3.0));
        assert_eq!(share, Ratio(1.0 / 3.0));
        let super::Kind::Table(table) = <Job as super::Value>::KIND else {
            panic!("a table")
        };
        assert_eq!(
            listing(&table, &provenance, &[]),
            [
                "",
                "[hatch]",
                "strategy = spots    (the job)",
                "spacing = [1 mm, 2 mm]    (default: wide)",
                "share = 33.333 %    (computed: what is left)",
                "",
                "[judge] not written: not judged",
            ]
        );
        assert_eq!(rounded(&0.1_f32.into()), "0.1");
    }

    /// Where a whole number belongs, one with a point and NaN are told apart.
    #[test]
    fn what_has_no_value_is_told_as_it_is_written() {
        for (written, said) in [
            ("nan", "what is written is nan, which is no value"),
            ("-inf", "what is written is -inf, which is no value"),
            ("1.5", "a number with a point"),
        ] {
            let problems = read::<Job>(&format!("[judge]\nplanes = {written}\n")).problems;
            let all: Vec<String> = problems.iter().map(|p| p.message.clone()).collect();
            assert!(all.iter().any(|m| m.contains(said)), "{all:?}");
        }
    }

    proptest::proptest! {
        #[test]
        fn no_text_panics(text in "[a-z=\\[\\]\\{\\}\"0-9., %\n]{0,80}") {
            let _ = read::<Job>(&text);
        }
    }
}
