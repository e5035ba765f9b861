//! The reference of a table in Markdown, made from its declaration.

use std::fmt::Write as _;

use super::{Bounds, Fallback, Key, Kind, Table};

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
        .partition(|k| matches!(k.kind, Kind::Table(_)));
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
        let Kind::Table(of) = &key.kind else { continue };
        let full = match name {
            "" => key.name.to_owned(),
            _ => format!("{name}.{}", key.name),
        };
        let absent = match key.fallback {
            Fallback::None(meaning) => format!(" Not written: {meaning}."),
            Fallback::Required => " Required.".to_owned(),
            Fallback::Default { .. } | Fallback::Computed(_) => String::new(),
        };
        let _ = writeln!(out, "\n### `[{full}]`\n\n{}{absent}\n", key.text.trim());
        section(&full, of, out);
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
            let shown: Vec<&str> = units.iter().map(|u| u.symbol).collect();
            let words = format!("{what} ({})", shown.join(", "));
            bounded(words, &|n| match (n, units.first()) {
                (0.0, Some(unit)) if unit.offset == 0.0 => "zero".to_owned(),
                (n, Some(unit)) => unit.show(n),
                (n, None) => n.to_string(),
            })
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
    }
}
