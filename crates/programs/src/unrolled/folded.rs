//! A statement with numbers in the places of what is known.

use super::{Language, Run, base_of, names};
use crate::collected::scaled;
use crate::scan::arguments;

/// Parts within parts that are looked at.
const DEEPEST: usize = 48;

impl<L: Language> Run<'_, L> {
    /// A statement whose arguments are numbers where they are known, and places where they were set.
    pub(super) fn folded(&self, text: &str) -> String {
        let known = |name: &str| {
            let key = self.memory.names.key(name);
            let base = base_of(&key);
            let values = &self.memory.names.values;
            let from = values.range(base.to_owned()..);
            let mut near = from.take_while(|(k, _)| k.starts_with(base));
            self.changed.contains(base) || near.any(|(k, _)| base_of(k) == base)
        };
        if !names(text).any(known) {
            return text.to_owned();
        }
        // the first word says what is done, whatever variable has its name
        let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$');
        let (verb, rest) = text.split_at(text.find(|c| !part(c)).unwrap_or(text.len()));
        if verb.is_empty() || !(rest.is_empty() || rest.starts_with(' ')) {
            return self.part(text, DEEPEST);
        }
        match rest.trim() {
            "" => text.to_owned(),
            rest => format!("{verb} {}", self.part(rest, DEEPEST)),
        }
    }

    /// The parts between commas.
    fn list(&self, text: &str, depth: usize) -> String {
        let parts = arguments(text);
        let parts: Vec<String> = parts.into_iter().map(|p| self.part(p, depth)).collect();
        parts.join(",")
    }

    /// The name of a place that was set, in numbers: what data say of it does not hold any more.
    fn place(&self, text: &str) -> Option<String> {
        let key = self.memory.names.key(text.trim());
        let set = self.changed.contains(&key) && !self.memory.names.values.contains_key(&key);
        set.then(|| match self.place_of(&key) {
            Some(place) => self.language.written(&place),
            None => format!("{}?", text.trim()),
        })
    }

    fn part(&self, text: &str, depth: usize) -> String {
        let Some(depth) = depth.checked_sub(1) else {
            return text.to_owned();
        };
        if let Some(place) = self.place(text) {
            return place;
        }
        let hangs = names(text).next().is_some();
        if hangs && let Some(number) = self.memory.number(text) {
            return scaled(number, 1.0).to_string();
        }
        if arguments(text).len() > 1 {
            return self.list(text, depth);
        }
        // a name in front: of an argument, of a component, of a statement
        for sign in [":=", "=", " "] {
            if let Some((name, rest)) = text.split_once(sign)
                && !rest.trim().is_empty()
                && name
                    .chars()
                    .all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '\\' | '.' | '$'))
            {
                let place = self.place(name).filter(|_| sign == " ");
                let name = place.as_deref().unwrap_or(name);
                return format!("{name}{sign}{}", self.part(rest, depth));
            }
        }
        let Some(open) = text.find(['(', '[', '{']) else {
            return text.to_owned();
        };
        let Some(close) = closing(text, open) else {
            return text.to_owned();
        };
        let (head, inner, tail) = (&text[..=open], &text[open + 1..close], &text[close..]);
        let tail = match tail.get(1..) {
            Some(rest) if !rest.is_empty() => format!("{}{}", &tail[..1], self.part(rest, depth)),
            _ => tail.to_owned(),
        };
        format!("{head}{}{tail}", self.list(inner, depth))
    }
}

/// Where the bracket closes that opens at a place.
fn closing(text: &str, open: usize) -> Option<usize> {
    let (mut depth, mut quoted) = (0_i32, false);
    for (i, c) in text.char_indices().skip_while(|(i, _)| *i < open) {
        quoted ^= c == '"';
        match c {
            '(' | '[' | '{' if !quoted => depth += 1,
            ')' | ']' | '}' if !quoted => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some(i);
        }
    }
    None
}
