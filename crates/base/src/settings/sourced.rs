//! Numbers of data files, each with who says so: with its unit in the text (`value = "12 ms"`), or beside it
//! (`value = 12.0`, `unit = "ms"`).

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use super::{Bounds, Fallback, Json, Key, Keys, Kind, Node, Place, Reader, Setting, Table, Value};
use crate::quantity::{Quantity, Unit};

pub(super) const fn key(
    name: &'static str,
    text: &'static str,
    kind: Kind,
    fallback: Fallback,
) -> Key {
    Key {
        name,
        text,
        kind,
        bounds: Bounds::any(),
        fallback,
    }
}

pub(super) const fn uncertainty(kind: Kind) -> Key {
    key(
        "uncertainty",
        "One standard deviation, with its unit.",
        kind,
        Fallback::None("not known"),
    )
}

pub(super) const SOURCE: Key = key(
    "source",
    "Who says so, or why it was chosen.",
    Kind::Text,
    Fallback::Required,
);
pub(super) const PAGE: Key = key(
    "page",
    "Page of the source.",
    Kind::Text,
    Fallback::None("not said"),
);
pub(super) const NOTE: Key = key(
    "note",
    "How it was read or derived.",
    Kind::Text,
    Fallback::None("nothing to add"),
);

/// A number with its unit in the text, and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Sourced<Q> {
    /// The value.
    pub value: Q,
    /// One standard deviation, where known.
    pub uncertainty: Option<Q>,
    /// Who says so.
    pub source: String,
    /// Page of the source.
    pub page: Option<String>,
}

impl<Q> Deref for Sourced<Q> {
    type Target = Q;

    fn deref(&self) -> &Q {
        &self.value
    }
}

impl<Q> DerefMut for Sourced<Q> {
    fn deref_mut(&mut self) -> &mut Q {
        &mut self.value
    }
}

impl<Q: Quantity + Value> Value for Sourced<Q> {
    const KIND: Kind = Kind::Figure(Table {
        text: "A number with its unit, and where it comes from.",
        keys: &[
            key("value", "Number and unit.", Q::KIND, Fallback::Required),
            uncertainty(Q::KIND),
            SOURCE,
            PAGE,
            NOTE,
        ],
    });

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let mut keys = Keys::open::<Self>(node, place, reader)?;
        let value: Option<Setting<Q>> = keys.required(reader);
        let uncertainty = keys.none(reader);
        let source = keys.required(reader);
        let page = keys.none(reader);
        let _note: Option<Setting<Option<String>>> = keys.none(reader);
        let value = value?;
        reader.hold(value.number(), &value.span, place, |n| {
            Q::from_number(n).to_string()
        })?;
        Some(Sourced {
            value: value.value,
            uncertainty: uncertainty?.value,
            source: source?.value,
            page: page?.value,
        })
    }

    fn json(&self) -> Json {
        self.value.json()
    }
}

/// A unit of a quantity, as a file names it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitOf<Q> {
    /// The unit.
    pub unit: &'static Unit,
    quantity: PhantomData<Q>,
}

impl<Q: Quantity> Value for UnitOf<Q> {
    const KIND: Kind = Kind::Unit(Q::UNITS);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let symbols: Vec<&str> = Q::UNITS.iter().map(|u| u.symbol).collect();
        let found = reader.word(node, place, &symbols)?;
        Some(UnitOf {
            unit: Q::UNITS.get(found)?,
            quantity: PhantomData,
        })
    }

    fn json(&self) -> Json {
        self.unit.symbol.into()
    }
}

/// What a number beside its unit becomes: a quantity, or several.
pub trait Amount: Sized {
    /// Of which quantity.
    type Quantity: Quantity;
    /// As a file writes it.
    type Written: Value;

    /// From what a file writes.
    fn from_written(written: Self::Written, unit: &Unit) -> Self;

    /// The numbers, in internal units.
    fn numbers(&self) -> Vec<f64>;
}

impl<Q: Quantity> Amount for Q {
    type Quantity = Q;
    type Written = f64;

    fn from_written(written: f64, unit: &Unit) -> Self {
        Q::from_number(unit.read(written))
    }

    fn numbers(&self) -> Vec<f64> {
        vec![self.number()]
    }
}

impl<Q: Quantity, const N: usize> Amount for [Q; N] {
    type Quantity = Q;
    type Written = [f64; N];

    fn from_written(written: [f64; N], unit: &Unit) -> Self {
        written.map(|n| Q::from_number(unit.read(n)))
    }

    fn numbers(&self) -> Vec<f64> {
        self.iter().map(|q| q.number()).collect()
    }
}

/// How well a number is known, as a file tells it: a standard deviation, or words.
enum Doubt {
    Sigma(f64),
    Words,
}

impl Value for Doubt {
    const KIND: Kind = Kind::Either(&Kind::Number, &Kind::Text);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        if node.get_ref().is_str() {
            String::read(node, place, reader).map(|_| Doubt::Words)
        } else {
            f64::read(node, place, reader).map(Doubt::Sigma)
        }
    }

    fn json(&self) -> Json {
        Json::Null
    }
}

/// A number, or several, with the unit beside it and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Datum<A> {
    /// The value.
    pub value: A,
    /// Standard uncertainty in internal units, where a number says it.
    pub uncertainty: Option<f64>,
    /// Document.
    pub source: String,
    /// Page of it.
    pub page: String,
    /// How it was read or derived.
    pub note: Option<String>,
}

impl<A> Deref for Datum<A> {
    type Target = A;

    fn deref(&self) -> &A {
        &self.value
    }
}

impl<A: Amount> Value for Datum<A> {
    const KIND: Kind = Kind::Figure(Table {
        text: "A number, its unit, and where it comes from.",
        keys: &[
            key(
                "value",
                "The number, in `unit`.",
                A::Written::KIND,
                Fallback::Required,
            ),
            key(
                "unit",
                "Its unit.",
                UnitOf::<A::Quantity>::KIND,
                Fallback::Required,
            ),
            Key {
                bounds: Bounds::not_negative(),
                ..key(
                    "uncertainty",
                    "Standard uncertainty in the same unit, or words.",
                    Doubt::KIND,
                    Fallback::None("not known"),
                )
            },
            SOURCE,
            key(
                "page",
                "Page of the source, or where in it.",
                Kind::Text,
                Fallback::Required,
            ),
            NOTE,
        ],
    });

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let mut keys = Keys::open::<Self>(node, place, reader)?;
        let value: Option<Setting<A::Written>> = keys.required(reader);
        let unit: Option<Setting<UnitOf<A::Quantity>>> = keys.required(reader);
        let doubt: Option<Setting<Option<Doubt>>> = keys.none(reader);
        let source = keys.required(reader);
        let page = keys.required(reader);
        let note = keys.none(reader);
        let (value, unit) = (value?, unit?.unit);
        let span = value.span;
        let value = A::from_written(value.value, unit);
        for number in value.numbers() {
            reader.hold(number, &span, place, |n| unit.show(n))?;
        }
        Some(Datum {
            value,
            uncertainty: match doubt?.value {
                Some(Doubt::Sigma(sigma)) => Some(sigma * unit.factor / unit.divisor),
                Some(Doubt::Words) | None => None,
            },
            source: source?.value,
            page: page?.value,
            note: note?.value,
        })
    }

    fn json(&self) -> Json {
        self.value.numbers().into()
    }
}
