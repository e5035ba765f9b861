//! Every key of a table with its value and where that comes from, section by section, for people.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::{Fallback, Json, Key, Kind, Table};
use crate::provenance::Provenance;

/// The keys of `table` in the order of their declaration, then what else `provenance` holds; one line each, sections headed by
/// their names.
pub fn listing(table: &Table, provenance: &Provenance) -> Vec<String> {
    let mut left = provenance.parameters.clone();
    let mut lines = Vec::new();
    section("", table, &mut left, &mut lines);
    if !left.is_empty() {
        lines.extend([String::new(), "[also used]".to_owned()]);
        lines.extend(left.iter().map(|(name, value)| line(name, value)));
    }
    lines
}

fn section(name: &str, table: &Table, left: &mut BTreeMap<String, Json>, lines: &mut Vec<String>) {
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
            let used = left.keys().any(|k| k.starts_with(&prefix));
            match key.fallback {
                Fallback::None(meaning) if !used => inner.push((full, None, meaning)),
                _ => inner.push((full, Some(of), "")),
            }
            continue;
        }
        own.push(match (left.remove(&full), key.fallback) {
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
            Some(of) => section(&full, of, left, lines),
            None => lines.extend([String::new(), format!("[{full}] not written: {meaning}")]),
        }
    }
}

/// A parameter of the provenance with its origin.
fn line(name: &str, parameter: &Json) -> String {
    let mut line = format!(
        "{name} = {}",
        rounded(parameter.get("value").unwrap_or(&Json::Null))
    );
    if let Some(sigma) = parameter.get("sigma").filter(|s| !s.is_null()) {
        // writing to a String cannot fail
        let _ = write!(line, " ± {}", rounded(sigma));
    }
    let origin = parameter.get("origin");
    let part = |key: &str| origin.and_then(|o| o.get(key)).and_then(Json::as_str);
    let what = part("what").unwrap_or_default();
    line + &match part("kind") {
        Some("job") => "    (the job)".to_owned(),
        Some(kind) => format!("    ({kind}: {what})"),
        None => String::new(),
    }
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
    let short = |number: f64| -> f64 { format!("{number:.4e}").parse().unwrap_or(number) };
    match value {
        Json::String(text) => match text
            .split_once(' ')
            .map(|(n, unit)| (n.parse::<f64>(), unit))
        {
            Some((Ok(number), unit)) => format!("{} {unit}", short(number)),
            _ => text.clone(),
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
