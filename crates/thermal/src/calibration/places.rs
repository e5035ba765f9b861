//! Where a model is asked: over the whole of what was believed, then wherever else is wanted, evenly.

use super::course::{There, numbers};

/// A parameter before the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Its name.
    pub name: String,
    /// Its value and standard uncertainty.
    pub value: f64,
    /// See `value`.
    pub sigma: f64,
    /// Values it may take.
    pub bounds: [f64; 2],
}

/// A model: a prediction for each measurement from the parameters.
pub type Model<'a, E> = dyn FnMut(&[f64]) -> Result<Vec<f64>, E> + 'a;

/// Places over the priors, for each number of the course; the priors' own is one more.
const SPREAD: f64 = 2.7;
/// Places that must be left of the course's freedom.
const SPARE: usize = 3;
/// How far they are spread, in uncertainties of the priors.
pub(super) const LOOKED: f64 = 2.0;
/// How often that is halved where a model does not answer within it, as for a beam that is too weak.
const HALVED: i32 = 3;

/// Places over the priors.
pub(super) fn spread(parameters: usize) -> usize {
    (SPREAD * numbers(parameters) as f64) as usize
}

/// As far as `most` uncertainties about the priors, within their bounds.
pub(super) fn around(priors: &[Prior], most: f64) -> Vec<[f64; 2]> {
    let along = |p: &Prior| {
        let [low, high] = p.bounds;
        let most = most * p.sigma;
        [(p.value - most).max(low), (p.value + most).min(high)]
    };
    priors.iter().map(along).collect()
}

/// Where a model was asked.
pub(super) struct Looked<'a> {
    pub(super) priors: &'a [Prior],
    /// Where it answered; the priors' own place first.
    pub(super) answers: Vec<There>,
    /// Where it did not.
    pub(super) silent: Vec<Vec<f64>>,
}

impl Looked<'_> {
    /// Asks at the priors' own place, where the model must answer, and over what they leave open; nearer where it does not answer there.
    pub(super) fn over_the_priors<E>(
        &mut self,
        sequence: &mut Sequence,
        model: &mut Model<'_, E>,
    ) -> Result<(), E> {
        let own: Vec<f64> = self.priors.iter().map(|p| p.value).collect();
        let there = model(&own)?;
        self.answers.push((own, there));
        let parameters = self.priors.len();
        let mut why = None;
        for halved in 0..=HALVED {
            let domain = around(self.priors, LOOKED * 0.5_f64.powi(halved));
            let places = sequence.places(spread(parameters), &domain, &|_| true);
            why = self.ask(places, model).or(why);
            if self.answers.len() >= numbers(parameters) + SPARE {
                return Ok(());
            }
        }
        // where every place answered there are enough
        why.map_or(Ok(()), Err)
    }

    /// Asks at places; the last reason for no answer.
    pub(super) fn ask<E>(&mut self, places: Vec<Vec<f64>>, model: &mut Model<'_, E>) -> Option<E> {
        let mut last = None;
        for values in places {
            match model(&values) {
                Ok(there) => self.answers.push((values, there)),
                Err(why) => {
                    self.silent.push(values);
                    last = Some(why);
                }
            }
        }
        last
    }

    /// Whether the model does not answer at the nearest place that was asked.
    pub(super) fn is_silent(&self, values: &[f64]) -> bool {
        let away = |place: &Vec<f64>| -> f64 {
            let each = place.iter().zip(values).zip(self.priors);
            each.map(|((a, b), p)| ((a - b) / p.sigma).powi(2)).sum()
        };
        let nearest =
            |all: &mut dyn Iterator<Item = &Vec<f64>>| all.map(away).fold(f64::INFINITY, f64::min);
        let silent = nearest(&mut self.silent.iter());
        silent.is_finite() && silent < nearest(&mut self.answers.iter().map(|a| &a.0))
    }
}

/// Places that fill the unit cube evenly, however many are taken: multiples of the powers of the generalised golden ratio.
pub(super) struct Sequence {
    steps: Vec<f64>,
    taken: u32,
}

impl Sequence {
    pub(super) fn new(dimensions: usize) -> Self {
        // x^(d+1) = x + 1
        let root = |x: f64| (1.0 + x).powf(1.0 / (dimensions as f64 + 1.0));
        let ratio = (0..64).fold(1.5, |x, _| root(x));
        let powers = std::iter::successors(Some(1.0 / ratio), |s| Some(s / ratio));
        let steps = powers.take(dimensions).collect();
        Sequence { steps, taken: 0 }
    }

    fn next(&mut self) -> Vec<f64> {
        self.taken += 1;
        let at = |step: &f64| (0.5 + step * f64::from(self.taken)).fract();
        self.steps.iter().map(at).collect()
    }

    /// The next `count` places in a box, those that are `wanted` first; others where hardly any is.
    pub(super) fn places(
        &mut self,
        count: usize,
        domain: &[[f64; 2]],
        wanted: &dyn Fn(&[f64]) -> bool,
    ) -> Vec<Vec<f64>> {
        /// Tries for each place.
        const TRIES: usize = 300;
        let (mut places, mut others) = (Vec::new(), Vec::new());
        for _ in 0..TRIES * count {
            let shares = self.next().into_iter().zip(domain);
            let place: Vec<f64> = shares
                .map(|(s, [low, high])| low + s * (high - low))
                .collect();
            if wanted(&place) {
                places.push(place);
            } else if others.len() < count {
                others.push(place);
            }
            if places.len() == count {
                break;
            }
        }
        places.extend(others);
        places.truncate(count);
        places
    }
}
