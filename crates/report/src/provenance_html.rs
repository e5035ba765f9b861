//! The provenance of a run as tables: inputs, parameters with their origin, models with their source.

use meltpath_base::Provenance;
use serde_json::Value;

use crate::number::significant;
use crate::table::{Cell, Table};

/// The tables as HTML, the long one folded.
pub(crate) fn provenance(p: &Provenance) -> String {
    let mut inputs = Table::new("Inputs", &["file", "SHA-256"]);
    inputs.rows = p
        .inputs
        .iter()
        .map(|(name, hash)| vec![Cell::text(name), Cell::text(hash)])
        .collect();
    let mut models = Table::new("Models", &["model", "source"]);
    models.rows = p
        .models
        .iter()
        .map(|(name, source)| vec![Cell::text(name), Cell::text(source)])
        .collect();
    let mut parameters = Table::new("", &["parameter", "value", "uncertainty", "origin"]);
    parameters.rows = p
        .parameters
        .iter()
        .map(|(name, resolved)| {
            vec![
                Cell::text(name),
                Cell::Text(plain(&resolved["value"])),
                Cell::Text(plain(&resolved["sigma"])),
                Cell::Text(origin(&resolved["origin"])),
            ]
        })
        .collect();
    let written = p
        .parameters
        .values()
        .filter(|v| v["origin"]["kind"] == "job")
        .count();
    format!(
        "<p>meltpath {}.</p>{}{}<details><summary>{} parameters, {written} of them written in the job</summary>{}</details>",
        crate::escape::escape(&p.meltpath),
        inputs.to_html(),
        models.to_html(),
        p.parameters.len(),
        parameters.to_html(),
    )
}

fn plain(value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) => number
            .as_f64()
            .map_or_else(|| number.to_string(), |v| significant(v, 6)),
        other => other.to_string(),
    }
}

fn origin(value: &Value) -> String {
    let kind = value["kind"].as_str().unwrap_or("unknown");
    match value["what"].as_str() {
        Some(what) if !what.is_empty() => format!("{kind}: {what}"),
        _ => kind.to_owned(),
    }
}
