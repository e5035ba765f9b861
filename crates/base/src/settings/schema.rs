//! The JSON Schema of a table, made from its declaration: editors check and complete job files with it.

use serde_json::{Map, json};

use super::{Bounds, Fallback, Json, Key, Kind, Table};

/// The schema of a table, to be a whole document or a part of one.
pub fn schema(table: &Table) -> Json {
    let properties: Map<String, Json> = table
        .keys
        .iter()
        .map(|key| (key.name.to_owned(), property(key)))
        .collect();
    let required: Vec<&str> = table
        .keys
        .iter()
        .filter(|k| k.fallback == Fallback::Required)
        .map(|k| k.name)
        .collect();
    let mut schema = json!({
        "type": "object",
        "description": table.text.trim(),
        "properties": properties,
        "additionalProperties": false,
    });
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    schema
}

fn property(key: &Key) -> Json {
    let mut schema = of_kind(&key.kind, key.bounds);
    let text = key.text.trim();
    let told = match key.fallback {
        Fallback::Required => text.to_owned(),
        Fallback::Default { toml, why } => format!("{text}\n\nDefault {toml}: {why}."),
        Fallback::Computed(relation) => format!("{text}\n\nNot written: {relation}."),
        Fallback::None(meaning) => format!("{text}\n\nNot written: {meaning}."),
    };
    schema["description"] = json!(told);
    if let Fallback::Default { toml, .. } = key.fallback
        && let Ok(value) = toml.parse::<toml::Value>()
    {
        schema["default"] = json!(value);
    }
    schema
}

fn of_kind(kind: &Kind, bounds: Bounds) -> Json {
    match kind {
        Kind::Quantity { units, .. } => {
            let symbols: Vec<String> = units.iter().map(|u| u.symbol.replace('.', "\\.")).collect();
            let number = "[-+]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][-+]?[0-9]+)?";
            let text = |unit: &str| {
                json!({
                    "type": "string",
                    "pattern": format!("^\\s*{number}\\s*({}){unit}\\s*$", symbols.join("|")),
                })
            };
            // where nothing but a number is meant no unit is asked for
            if units.iter().all(|unit| unit.symbol == "1") {
                json!({"anyOf": [{"type": "number"}, text("?")]})
            } else {
                text("")
            }
        }
        Kind::Count => {
            let mut schema = json!({"type": "integer", "minimum": bounds.low.max(0.0)});
            limit(&mut schema, bounds);
            schema
        }
        Kind::Number => {
            let mut schema = json!({"type": "number"});
            limit(&mut schema, bounds);
            schema
        }
        Kind::Text | Kind::File => json!({"type": "string", "minLength": 1}),
        Kind::Only(word) => json!({"const": word}),
        Kind::Choice(words) => {
            let each = words
                .iter()
                .map(|w| json!({"const": w.word, "description": w.text.trim()}));
            json!({"oneOf": each.collect::<Vec<_>>()})
        }
        Kind::Either(one, other) => {
            json!({"anyOf": [of_kind(one, bounds), of_kind(other, bounds)]})
        }
        Kind::List { of, least, most } => {
            let mut schema =
                json!({"type": "array", "items": of_kind(of, bounds), "minItems": least});
            if *most < usize::MAX {
                schema["maxItems"] = json!(most);
            }
            schema
        }
        Kind::Table(table) => schema(table),
        Kind::Figure(table) => figure(table, bounds),
        Kind::Unit(units) => {
            let symbols: Vec<&str> = units.iter().map(|u| u.symbol).collect();
            json!({"enum": symbols})
        }
        Kind::Named(of) => {
            json!({"type": "object", "additionalProperties": of_kind(of, bounds)})
        }
        Kind::OneOf { by, tables } => {
            let each = tables.iter().map(|(word, kind)| {
                let mut schema = of_kind(kind, Bounds::any());
                schema["properties"][by] = json!({"const": word});
                schema
            });
            json!({"oneOf": each.collect::<Vec<_>>()})
        }
    }
}

/// A number with its source. Its bounds are in internal units: they hold for the number as written where its unit is of that size.
fn figure(table: &Table, bounds: Bounds) -> Json {
    let mut found = schema(table);
    let own_unit = table
        .keys
        .iter()
        .any(|k| matches!(k.kind, Kind::Unit(units) if units.iter().all(|u| u.read(1.0) == 1.0)));
    if own_unit && let Some(value) = table.keys.iter().find(|k| k.name == "value") {
        let text = found["properties"]["value"]["description"].take();
        found["properties"]["value"] = of_kind(&value.kind, bounds);
        found["properties"]["value"]["description"] = text;
    }
    found
}

fn limit(schema: &mut Json, bounds: Bounds) {
    if bounds.low.is_finite() {
        let word = if bounds.above {
            "exclusiveMinimum"
        } else {
            "minimum"
        };
        schema[word] = json!(bounds.low);
    }
    if bounds.high.is_finite() {
        schema["maximum"] = json!(bounds.high);
    }
}
