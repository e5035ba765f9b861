//! The reference of a table in Markdown, made from its declaration.

use std::fmt::Write as _;

use super::{Bounds, Fallback, Key, Kind, Table};
use crate::quantity::Unit;

/// Every key of a table: what it is, what may be written, what holds where it is not.
pub fn reference(table: &Table) -> String {
    let mut out = String::new();
    section("", table, &mut out);
    out
}

fn section(name: &str, table: &Table, out: &mut String) {
    let (inner, own): (Vec<&Key>, Vec<&Key>) = table
        .keys
        .iter()
        .partition(|k| tables_of(&k.kind).is_some());
    // writing to a String cannot fail
    if !own.is_empty() {
        out.push_str(
            "| key | meaning | written as | where it is not written |\n|---|---|---|---|\n",
        );
        for key in own {
            let _ = writeln!(
                out,
                "| `{}` | {} | {} | {} |",
                key.name,
                cell(key.text),
                cell(&written_as(&key.kind, key.bounds)),
                cell(&fallback(key.fallback))
            );
        }
    }
    for key in inner {
        let Some((heading, tables)) = tables_of(&key.kind) else {
            continue;
        };
        let full = match name {
            "" => key.name.to_owned(),
            _ => format!("{name}.{}", key.name),
        };
        let absent = match key.fallback {
            Fallback::None(meaning) => format!(" Not written: {meaning}."),
            Fallback::Required => " Required.".to_owned(),
            Fallback::Default { .. } | Fallback::Computed(_) => String::new(),
        };
        let shown = heading.replace('*', &full);
        let _ = writeln!(out, "\n### `{shown}`\n\n{}{absent}\n", key.text.trim());
        for (words, of) in tables {
            if !words.is_empty() {
                let _ = writeln!(out, "\n`{words}`: {}\n", of.text.trim());
            }
            section(&full, of, out);
        }
    }
}

/// How a table is headed, `*` standing for its name, and what it holds: one table, or one for each word of a key.
fn tables_of(kind: &Kind) -> Option<(&'static str, Vec<(String, &Table)>)> {
    match kind {
        Kind::Table(table) => Some(("[*]", vec![(String::new(), table)])),
        Kind::List {
            of: Kind::Table(table),
            ..
        } => Some(("[[*]]", vec![(String::new(), table)])),
        Kind::Named(Kind::Table(table)) => Some(("[*.NAME]", vec![(String::new(), table)])),
        Kind::OneOf { by, tables } => {
            let each = tables.iter().filter_map(|(word, kind)| match kind {
                Kind::Table(table) => Some((format!("{by} = \"{word}\""), table)),
                _ => None,
            });
            Some(("[*]", each.collect()))
        }
        _ => None,
    }
}

fn cell(text: &str) -> String {
    text.trim().replace('|', "\\|")
}

fn fallback(fallback: Fallback) -> String {
    match fallback {
        Fallback::Required => "required".to_owned(),
        Fallback::Default { toml, why } => format!("`{toml}`: {why}"),
        Fallback::Computed(relation) => format!("computed: {relation}"),
        Fallback::None(meaning) => meaning.to_owned(),
    }
}

/// What may be written for a key, in words.
fn written_as(kind: &Kind, bounds: Bounds) -> String {
    let bounded = |words: String, show: &dyn Fn(f64) -> String| match bounds.words(show) {
        limits if limits.is_empty() => words,
        limits => format!("{words}, {limits}"),
    };
    match kind {
        Kind::Quantity { what, units } => {
            let words = format!("{what} ({})", symbols(units));
            bounded(words, &|n| in_unit(n, units))
        }
        Kind::Count => bounded("whole number".to_owned(), &|n| n.to_string()),
        Kind::Number => bounded("number".to_owned(), &|n| n.to_string()),
        Kind::Text => "text".to_owned(),
        Kind::File => "file".to_owned(),
        Kind::Only(word) => format!("`\"{word}\"`"),
        Kind::Choice(words) => {
            let shown: Vec<String> = words
                .iter()
                .map(|w| format!("`\"{}\"`: {}", w.word, w.text.trim().trim_end_matches('.')))
                .collect();
            shown.join("; ")
        }
        Kind::Either(one, other) => {
            format!(
                "{}; or {}",
                written_as(one, bounds),
                written_as(other, bounds)
            )
        }
        Kind::List { of, least, most } => {
            let count = match (*least, *most) {
                (0, usize::MAX) => "list".to_owned(),
                (l, usize::MAX) => format!("list of {l} or more"),
                (l, m) if l == m => format!("list of {l}"),
                (l, m) => format!("list of {l} to {m}"),
            };
            format!("{count}: {}", written_as(of, bounds))
        }
        Kind::Table(table) => {
            let keys: Vec<String> = table.keys.iter().map(|k| format!("`{}`", k.name)).collect();
            format!("table of {}", keys.join(", "))
        }
        Kind::Figure(table) => figure(table, bounds),
        Kind::Unit(units) => symbols(units),
        Kind::Named(of) => format!(
            "table with keys of your choice, each: {}",
            written_as(of, bounds)
        ),
        Kind::OneOf { by, tables } => {
            let words: Vec<String> = tables.iter().map(|(w, _)| format!("`\"{w}\"`")).collect();
            format!("table whose `{by}` is {}", words.join(" or "))
        }
    }
}

fn symbols(units: &[Unit]) -> String {
    let shown: Vec<&str> = units.iter().map(|u| u.symbol).collect();
    shown.join(", ")
}

fn in_unit(number: f64, units: &[Unit]) -> String {
    match units.first() {
        Some(unit) if number == 0.0 && unit.offset == 0.0 => "zero".to_owned(),
        Some(unit) => unit.show(number),
        None => number.to_string(),
    }
}

/// A number with its source: what it is, and its bounds.
fn figure(table: &Table, bounds: Bounds) -> String {
    let kind = |name: &str| table.keys.iter().find(|k| k.name == name).map(|k| &k.kind);
    let (value, unit) = (kind("value"), kind("unit"));
    let words = match (value, unit) {
        (Some(value), Some(Kind::Unit(units))) => {
            let plain = written_as(value, Bounds::any());
            let words = format!("{plain}, `unit` {}", symbols(units));
            match bounds.words(|n| in_unit(n, units)) {
                limits if limits.is_empty() => words,
                limits => format!("{words}, {limits}"),
            }
        }
        (Some(value), _) => written_as(value, bounds),
        (None, _) => String::new(),
    };
    if kind("low").is_some() {
        return format!(
            "{words}; with its source, and `low` and `high` where it is known as a range"
        );
    }
    format!("{words}; with its source")
}
