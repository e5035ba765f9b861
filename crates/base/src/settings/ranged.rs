//! Numbers of data files that are known as a range: the value, the least and the most that it may be.

use std::ops::{Deref, DerefMut};

use super::read::filled;
use super::sourced::{NOTE, PAGE, SOURCE, key, uncertainty};
use super::{
    Bounds, Fallback, Json, Keys, Kind, Node, Place, Problem, Reader, Setting, Sourced, Table,
    Value,
};
use crate::quantity::Quantity;

/// How many standard deviations to either side an uncertainty stands for, where no range is written.
const DEVIATIONS: f64 = 2.0;

/// A number with its source, and the range in which it may lie.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranged<Q> {
    /// The value and who says so.
    pub figure: Sourced<Q>,
    /// The least and the most, where the file tells them.
    pub range: Option<[Q; 2]>,
}

impl<Q> Deref for Ranged<Q> {
    type Target = Sourced<Q>;

    fn deref(&self) -> &Sourced<Q> {
        &self.figure
    }
}

impl<Q> DerefMut for Ranged<Q> {
    fn deref_mut(&mut self) -> &mut Sourced<Q> {
        &mut self.figure
    }
}

impl<Q: Quantity> Ranged<Q> {
    /// The least and the most, in internal units: the value itself where no range is told.
    pub fn ends(&self) -> [f64; 2] {
        match &self.range {
            Some([low, high]) => [low.number(), high.number()],
            None => [self.figure.value.number(); 2],
        }
    }

    /// Whether nobody measured it, as its source says, and no range tells how far off it may be.
    pub fn is_bare_guess(&self) -> bool {
        self.range.is_none() && self.figure.source.to_lowercase().contains("guess")
    }
}

impl<Q: Quantity + Value> Value for Ranged<Q> {
    const KIND: Kind = Kind::Figure(Table {
        text: "A number with its unit, the range in which it may lie, and where both come from.",
        keys: &[
            key("value", "Number and unit.", Q::KIND, Fallback::Required),
            key(
                "low",
                "The least that it may be, with its unit.",
                Q::KIND,
                Fallback::None("with `uncertainty`: twice that below the value; else no range"),
            ),
            key(
                "high",
                "The most that it may be, with its unit.",
                Q::KIND,
                Fallback::None("with `uncertainty`: twice that above the value; else no range"),
            ),
            uncertainty(Q::KIND),
            SOURCE,
            PAGE,
            NOTE,
        ],
    });

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let mut keys = Keys::open::<Self>(node, place, reader)?;
        let value: Option<Setting<Q>> = keys.required(reader);
        let low: Option<Setting<Option<Q>>> = keys.none(reader);
        let high: Option<Setting<Option<Q>>> = keys.none(reader);
        let uncertainty: Option<Setting<Option<Q>>> = keys.none(reader);
        let source = keys.required(reader);
        let page = keys.none(reader);
        let _note: Option<Setting<Option<String>>> = keys.none(reader);
        let (value, uncertainty) = (value?, uncertainty?.value);
        reader.hold(value.number(), &value.span, place, show::<Q>)?;
        let range = match written(low?, high?, place.bounds, reader)? {
            Some([low, high]) => Some(around(&value, [low, high], place, reader)?),
            None => uncertainty
                .as_ref()
                .map(|sigma| by_deviations(value.value, *sigma, place.bounds)),
        };
        Some(Ranged {
            figure: Sourced {
                value: value.value,
                uncertainty,
                source: source?.value,
                page: page?.value,
            },
            range,
        })
    }

    fn json(&self) -> Json {
        self.figure.json()
    }
}

fn show<Q: Quantity>(number: f64) -> String {
    Q::from_number(number).to_string()
}

/// Both ends as they are written; neither, where none is. What is wrong with them is told.
#[expect(
    clippy::option_option,
    reason = "the outer one says whether the file reads, the inner one whether a range is written"
)]
fn written<Q: Quantity>(
    low: Setting<Option<Q>>,
    high: Setting<Option<Q>>,
    bounds: Bounds,
    reader: &mut Reader,
) -> Option<Option<[Setting<Q>; 2]>> {
    let [one, other] = [(&low, &high), (&high, &low)]
        .map(|(here, there)| (here.is_written() && !there.is_written()).then_some((here, there)));
    if let Some((here, there)) = one.or(other) {
        let problem = Problem::new(format!("{} is missing", there.name));
        let help = "a range needs both ends: write low and high, or neither";
        reader
            .problems
            .push(problem.help(help).at(here.span.clone()));
        return None;
    }
    if !low.is_written() {
        return Some(None);
    }
    let (low, high) = (filled(low)?, filled(high)?);
    for end in [&low, &high] {
        let place = Place {
            name: &end.name,
            bounds,
        };
        reader.hold(end.number(), &end.span, &place, show::<Q>)?;
    }
    Some(Some([low, high]))
}

/// The range round a value; refused where it is none, or does not hold the value.
fn around<Q: Quantity>(
    value: &Setting<Q>,
    [low, high]: [Setting<Q>; 2],
    place: &Place<'_>,
    reader: &mut Reader,
) -> Option<[Q; 2]> {
    let [least, most] = [&low, &high].map(|end| end.number());
    let problem = if least > most {
        let message = format!(
            "{} is {}, above {}, {}",
            low.name, low.value, high.name, high.value
        );
        let help =
            "low is the least and high the most that it may be: exchange them, or correct one";
        Problem::new(message).help(help).at(low.span.clone())
    } else if !(least..=most).contains(&value.number()) {
        let message = format!(
            "{} is {}, outside of its own range, {} to {}",
            place.name, value.value, low.value, high.value
        );
        let help = "the value lies between low and high: widen the range, or correct the value";
        Problem::new(message).help(help).at(value.span.clone())
    } else {
        return Some([low.value, high.value]);
    };
    reader.problems.push(problem);
    None
}

/// What an uncertainty alone stands for, as far as the key takes it.
fn by_deviations<Q: Quantity>(value: Q, sigma: Q, bounds: Bounds) -> [Q; 2] {
    let wide = DEVIATIONS * sigma.number().abs();
    let ends = [value.number() - wide, value.number() + wide];
    ends.map(|end| Q::from_number(end.clamp(bounds.low, bounds.high)))
}
