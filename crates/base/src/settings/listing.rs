//! Every key of a table with its value and where that comes from, section by section, for people.

use std::collections::BTreeMap;

use super::{Fallback, Json, Key, Kind, Table};
use crate::number::with_uncertainty;
use crate::provenance::Provenance;

/// What a key says that is written with a value that does not read.
const WRONG: &str = "wrong: see below";

/// The keys of `table` in the order of their declaration, then what else `provenance` holds; one line each, sections headed by
/// their names. `wrong` are the dotted names of keys whose value does not read.
pub fn listing(table: &Table, provenance: &Provenance, wrong: &[String]) -> Vec<String> {
    let mut left = provenance.parameters.clone();
    let mut lines = Vec::new();
    section("", table, &mut left, wrong, &mut lines);
    if !left.is_empty() {
        lines.extend([String::new(), "[also used]".to_owned()]);
        lines.extend(left.iter().map(|(name, value)| line(name, value)));
    }
    lines
}

fn section(
    name: &str,
    table: &Table,
    left: &mut BTreeMap<String, Json>,
    wrong: &[String],
    lines: &mut Vec<String>,
) {
    let dotted = |key: &Key| match name {
        "" => key.name.to_owned(),
        _ => format!("{name}.{}", key.name),
    };
    let mut own = Vec::new();
    let mut inner = Vec::new();
    for key in table.keys {
        let full = dotted(key);
        if let Kind::Table(of) = &key.kind {
            let prefix = format!("{full}.");
            let used = left.keys().chain(wrong).any(|k| k.starts_with(&prefix));
            inner.push(match key.fallback {
                _ if !used && wrong.contains(&full) => (full, None, WRONG.to_owned()),
                Fallback::None(meaning) if !used => (full, None, format!("not written: {meaning}")),
                _ => (full, Some(of), String::new()),
            });
            continue;
        }
        own.push(match (left.remove(&full), key.fallback) {
            _ if wrong.contains(&full) => format!("{}: {WRONG}", key.name),
            (Some(value), _) => line(key.name, &value),
            (None, Fallback::Computed(relation)) => format!("{}: {relation}", key.name),
            (None, Fallback::None(meaning)) => format!("{}: not written: {meaning}", key.name),
            (None, Fallback::Default { .. }) => format!("{}: not used here", key.name),
            (None, Fallback::Required) => format!("{} = ?", key.name),
        });
    }
    // what the data say of this section
    let prefix = format!("{name}.");
    let sections: Vec<&String> = inner.iter().map(|(full, ..)| full).collect();
    let of_data: Vec<String> = left
        .keys()
        .filter(|k| {
            k.starts_with(&prefix) && !sections.iter().any(|s| k.starts_with(&format!("{s}.")))
        })
        .cloned()
        .collect();
    for full in of_data {
        if let Some(value) = left.remove(&full) {
            own.push(line(&full[prefix.len()..], &value));
        }
    }
    if !name.is_empty() && !own.is_empty() {
        lines.extend([String::new(), format!("[{name}]")]);
    }
    lines.extend(own);
    for (full, of, meaning) in inner {
        match of {
            Some(of) => section(&full, of, left, wrong, lines),
            None => lines.extend([String::new(), format!("[{full}] {meaning}")]),
        }
    }
}

/// A parameter of the provenance with its origin.
fn line(name: &str, parameter: &Json) -> String {
    let value = parameter.get("value").unwrap_or(&Json::Null);
    // tables of their own, whose keys follow
    let tables = value.as_array().filter(|all| all.iter().all(Json::is_null));
    if let Some(count) = tables.map(Vec::len).filter(|count| *count > 0) {
        return format!("{name}: {count} written");
    }
    let shown = match parameter.get("sigma").filter(|s| !s.is_null()) {
        Some(sigma) => uncertain(value, sigma),
        None => rounded(value),
    };
    let origin = parameter.get("origin");
    let part = |key: &str| origin.and_then(|o| o.get(key)).and_then(Json::as_str);
    let what = part("what").unwrap_or_default();
    format!("{name} = {shown}")
        + &match part("kind") {
            Some("job") => "    (the job)".to_owned(),
            Some(kind) => format!("    ({kind}: {what})"),
            None => String::new(),
        }
}

/// A value with its standard uncertainty, both with their unit if they have one.
fn uncertain(value: &Json, sigma: &Json) -> String {
    match (number_and_unit(value), number_and_unit(sigma)) {
        (Some((number, unit)), Some((sigma, same))) if unit == same => {
            let both = with_uncertainty(number, sigma);
            format!("{both} {unit}").trim_end().to_owned()
        }
        _ => format!("{} ± {}", rounded(value), rounded(sigma)),
    }
}

/// A number, and its unit where it is told in its text.
fn number_and_unit(value: &Json) -> Option<(f64, &str)> {
    if let Some(number) = value.as_f64() {
        return Some((number, ""));
    }
    let (number, unit) = value.as_str()?.split_once(' ')?;
    Some((number.parse().ok()?, unit))
}

/// A value for people: numbers to five significant digits, units kept.
///
/// ```
/// use meltpath_base::settings::rounded;
/// assert_eq!(rounded(&"8.123456789 m/min".into()), "8.1235 m/min");
/// assert_eq!(rounded(&"x90-ig-1.0".into()), "x90-ig-1.0");
/// assert_eq!(rounded(&vec![0.125, 7.0].into()), "[0.125, 7]");
/// ```
pub fn rounded(value: &Json) -> String {
    let short = |number: f64| -> f64 { crate::number::rounded(number, 5) };
    match value {
        Json::String(text) => match number_and_unit(value) {
            Some((number, unit)) => format!("{} {unit}", short(number)),
            None => text.clone(),
        },
        Json::Number(number) if number.is_f64() => {
            short(number.as_f64().unwrap_or_default()).to_string()
        }
        Json::Array(values) => {
            let shown: Vec<String> = values.iter().map(rounded).collect();
            format!("[{}]", shown.join(", "))
        }
        other => other.to_string(),
    }
}
