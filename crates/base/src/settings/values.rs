//! What keys may hold: quantities, counts, texts, lists, and values that are left to meltpath.

use std::collections::BTreeMap;
use std::ops::Deref;

use toml::de::DeValue;

use super::{Json, Kind, Node, Place, Problem, Reader, Value};
use crate::quantity::{Auto, Quantity, QuantityError, accepted, in_first_unit, parse, with_unit};

/// A file, relative to the one it is named in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File(
    /// As written.
    pub String,
);

impl Deref for File {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

/// Reads a quantity: a bare number is answered with one that has a unit, and is welcome where nothing but a number is meant.
pub fn quantity<Q: Quantity>(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Q> {
    if Q::UNITS.iter().all(|unit| unit.symbol == "1") {
        let bare = match node.get_ref() {
            DeValue::String(text) => text.trim().parse().ok(),
            _ => number(node),
        };
        if let Some(number) = bare.filter(|n: &f64| n.is_finite()) {
            let show = |n: f64| Q::from_number(n).to_string();
            reader.within(number, node, place, show)?;
            return Some(Q::from_number(number));
        }
    }
    let fix = match node.get_ref() {
        DeValue::String(text) => match parse(text, Q::WHAT, Q::UNITS) {
            Ok(number) => {
                let show = |n: f64| Q::from_number(n).to_string();
                reader.within(number, node, place, show)?;
                return Some(Q::from_number(number));
            }
            Err(QuantityError::Comma { written, .. }) => {
                let message = format!(
                    "{} is \"{text}\": numbers carry a decimal point",
                    place.name
                );
                let (fixed, help) = (format!("\"{written}\""), format!("write \"{written}\""));
                let fix = parse(&written, Q::WHAT, Q::UNITS).is_ok().then_some(fixed);
                reader.wrong(
                    node,
                    Problem {
                        fix,
                        ..Problem::new(message).help(help)
                    },
                );
                return None;
            }
            Err(QuantityError::Unit { .. }) if text.trim().parse::<f64>().is_ok() => {
                with_unit(text.trim(), Q::UNITS)
            }
            Err(e) => {
                reader.wrong(node, Problem::new(format!("{}: {e}", place.name)));
                return None;
            }
        },
        DeValue::Integer(n) => with_unit(n.as_str(), Q::UNITS),
        DeValue::Float(n) => with_unit(n.as_str(), Q::UNITS),
        _ => {
            let wanted = format!(
                "a {} in quotes, such as \"{}\"",
                Q::WHAT,
                in_first_unit("1", Q::UNITS)
            );
            reader.unexpected(node, place, &wanted);
            return None;
        }
    };
    let message = format!("{} needs a unit, one of {}", place.name, accepted(Q::UNITS));
    let problem = Problem::new(message).help(format!("write for example \"{fix}\""));
    reader.wrong(
        node,
        Problem {
            fix: Some(format!("\"{fix}\"")),
            ..problem
        },
    );
    None
}

/// A number in the file, and whether it is a whole one.
fn number(node: &Node<'_>) -> Option<f64> {
    match node.get_ref() {
        DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix())
            .ok()
            .map(|n| n as f64),
        DeValue::Float(n) => n.as_str().parse().ok(),
        _ => None,
    }
}

macro_rules! counts {
    ($($name:ident),+) => {$(
        impl Value for $name {
            const KIND: Kind = Kind::Count;

            #[allow(clippy::cast_lossless, reason = "one body for all widths")]
            fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
                let whole = node.get_ref().as_integer();
                let count = whole.and_then(|n| $name::from_str_radix(n.as_str(), n.radix()).ok());
                let Some(count) = count else {
                    match whole {
                        Some(n) => reader.not_counted(node, place, n.as_str(), $name::MAX as f64),
                        None => reader.unexpected(node, place, "a whole number from zero on"),
                    }
                    return None;
                };
                reader.within(count as f64, node, place, |n| n.to_string())?;
                Some(count)
            }

            fn json(&self) -> Json {
                (*self).into()
            }
        }
    )+};
}
counts!(u32, u64, usize);

impl Value for f64 {
    const KIND: Kind = Kind::Number;

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let Some(number) = number(node).filter(|n| n.is_finite()) else {
            not_a_number(node, place, reader);
            return None;
        };
        reader.within(number, node, place, |n| n.to_string())?;
        Some(number)
    }

    fn json(&self) -> Json {
        (*self).into()
    }
}

/// Something else where a number belongs; a number in quotes, with a comma, a unit or a percent sign, is answered with the number.
fn not_a_number(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) {
    let written = node.get_ref().as_str().unwrap_or_default().trim();
    let pointed = written.replacen(',', ".", 1);
    let digits = pointed
        .find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)))
        .unwrap_or(pointed.len());
    let (number, unit) = pointed.split_at(digits);
    let meant = match (number.parse::<f64>(), unit.trim()) {
        (Ok(share), "%") => Some((share / 100.0).to_string()),
        (Ok(_), _) => Some(number.to_owned()),
        (Err(_), _) => None,
    };
    let Some(fix) = meant else {
        reader.unexpected(node, place, "a number");
        return;
    };
    let message = format!("{} is a number, not the text \"{written}\"", place.name);
    let problem = Problem::new(message).help(format!("write {fix}"));
    reader.wrong(
        node,
        Problem {
            fix: Some(fix),
            ..problem
        },
    );
}

fn text(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<String> {
    let text = node.get_ref().as_str().filter(|t| !t.trim().is_empty());
    if text.is_none() {
        reader.unexpected(node, place, "a text in quotes");
    }
    text.map(str::to_owned)
}

impl Value for String {
    const KIND: Kind = Kind::Text;

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        text(node, place, reader)
    }

    fn json(&self) -> Json {
        self.as_str().into()
    }
}

impl Value for File {
    const KIND: Kind = Kind::File;

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        text(node, place, reader).map(File)
    }

    fn json(&self) -> Json {
        self.0.as_str().into()
    }
}

impl<T: Value> Value for Auto<T> {
    const KIND: Kind = Kind::Either(&Kind::Only("auto"), &T::KIND);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        match node.get_ref().as_str().map(str::trim) {
            Some("auto") => Some(Auto::Auto),
            _ => T::read(node, place, reader).map(Auto::Value),
        }
    }

    fn json(&self) -> Json {
        match self {
            Auto::Auto => "auto".into(),
            Auto::Value(value) => value.json(),
        }
    }
}

/// The place of a value within a list is kept; 0..0 in a default.
impl<T: Value> Value for toml::Spanned<T> {
    const KIND: Kind = T::KIND;

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let span = reader.span(node).unwrap_or(0..0);
        T::read(node, place, reader).map(|value| toml::Spanned::new(span, value))
    }

    fn json(&self) -> Json {
        self.get_ref().json()
    }
}

/// Several values: how many is told before what they are.
pub(super) fn list<T: Value>(
    node: &Node<'_>,
    place: &Place<'_>,
    reader: &mut Reader,
    least: usize,
    most: usize,
) -> Option<Vec<T>> {
    let Some(nodes) = node.get_ref().as_array() else {
        reader.unexpected(node, place, "a list in brackets");
        return None;
    };
    let count = nodes.len();
    let read: Vec<Option<T>> = nodes.iter().map(|n| T::read(n, place, reader)).collect();
    if !(least..=most).contains(&count) {
        let wanted = match (least, most) {
            (l, m) if l == m => format!("{l}"),
            (l, usize::MAX) => format!("{l} or more"),
            (l, m) => format!("{l} to {m}"),
        };
        let message = format!("{} has {count} values; it takes {wanted}", place.name);
        reader.wrong(node, Problem::new(message));
        return None;
    }
    read.into_iter().collect()
}

/// Several values, at least so many.
#[derive(Debug, Clone, PartialEq)]
pub struct Many<T, const LEAST: usize, const MOST: usize = { usize::MAX }>(
    /// The values.
    pub Vec<T>,
);

impl<T, const LEAST: usize, const MOST: usize> Deref for Many<T, LEAST, MOST> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T: Value, const LEAST: usize, const MOST: usize> Value for Many<T, LEAST, MOST> {
    const KIND: Kind = Kind::List {
        of: &T::KIND,
        least: LEAST,
        most: MOST,
    };

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        list(node, place, reader, LEAST, MOST).map(Many)
    }

    fn json(&self) -> Json {
        self.0.iter().map(Value::json).collect()
    }
}

/// Keys of one's own.
impl<T: Value> Value for BTreeMap<String, T> {
    const KIND: Kind = Kind::Named(&T::KIND);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let Some(entries) = node.get_ref().as_table() else {
            reader.unexpected(node, place, "a table");
            return None;
        };
        let read: Vec<_> = entries
            .iter()
            .map(|(key, node)| {
                let key = key.get_ref().as_ref();
                let name = format!("{}.{key}", place.name);
                let value = T::read(
                    node,
                    &Place {
                        name: &name,
                        ..*place
                    },
                    reader,
                );
                value.map(|value| (key.to_owned(), value))
            })
            .collect();
        read.into_iter().collect()
    }

    fn json(&self) -> Json {
        let each = self.iter().map(|(key, value)| (key.clone(), value.json()));
        Json::Object(each.collect())
    }
}

impl<T: Value> Value for Vec<T> {
    const KIND: Kind = Many::<T, 0>::KIND;

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        list(node, place, reader, 0, usize::MAX)
    }

    fn json(&self) -> Json {
        self.iter().map(Value::json).collect()
    }
}

impl<T: Value, const N: usize> Value for [T; N] {
    const KIND: Kind = Many::<T, N, N>::KIND;

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        list(node, place, reader, N, N)?.try_into().ok()
    }

    fn json(&self) -> Json {
        self.iter().map(Value::json).collect()
    }
}
