//! An exported controller run sample by sample in the arithmetic of its word, as the C code does.

use super::{AntiWindup, Exported, Law, Word};

/// The arithmetic of a word: a sum of products, rounded as the C code does.
trait Arithmetic {
    type Signal: Copy + Default + PartialOrd;
    type Coefficient: Copy;
    fn coefficient(&self, x: f64) -> Self::Coefficient;
    fn signal(&self, x: f64) -> Self::Signal;
    fn value(&self, x: Self::Signal) -> f64;
    fn sum<const N: usize>(&self, terms: [(Self::Coefficient, Self::Signal); N]) -> Self::Signal;
    fn dot(&self, terms: impl Iterator<Item = (Self::Coefficient, Self::Signal)>) -> Self::Signal;
}

#[derive(Debug, Clone, Copy)]
struct DoubleWord;
#[derive(Debug, Clone, Copy)]
struct SingleWord;
#[derive(Debug, Clone, Copy)]
struct FixedWord {
    coefficient: u32,
    signal: u32,
}

macro_rules! floating {
    ($word:ty, $float:ty) => {
        impl Arithmetic for $word {
            type Signal = $float;
            type Coefficient = $float;
            fn coefficient(&self, x: f64) -> $float {
                x as $float
            }
            fn signal(&self, x: f64) -> $float {
                x as $float
            }
            fn value(&self, x: $float) -> f64 {
                f64::from(x)
            }
            #[inline]
            fn sum<const N: usize>(&self, terms: [($float, $float); N]) -> $float {
                self.dot(terms.into_iter())
            }
            #[inline]
            fn dot(&self, mut terms: impl Iterator<Item = ($float, $float)>) -> $float {
                // from the first product on, as C adds: starting from zero would lose the sign of a zero
                let first = terms.next().map_or(0.0, |(k, x)| k * x);
                terms.fold(first, |sum, (k, x)| sum + k * x)
            }
        }
    };
}

floating!(DoubleWord, f64);
floating!(SingleWord, f32);

impl Arithmetic for FixedWord {
    type Signal = i32;
    type Coefficient = i64;
    fn coefficient(&self, x: f64) -> i64 {
        Word::Fixed {
            coefficient: self.coefficient,
            signal: self.signal,
        }
        .integer(x)
    }
    fn signal(&self, x: f64) -> i32 {
        // `as` cuts to the range of the word
        (x * f64::from(2u32).powi(self.signal.cast_signed())).round() as i32
    }
    fn value(&self, x: i32) -> f64 {
        f64::from(x) * 0.5f64.powi(self.signal.cast_signed())
    }
    #[inline]
    fn sum<const N: usize>(&self, terms: [(i64, i32); N]) -> i32 {
        self.dot(terms.into_iter())
    }
    #[inline]
    fn dot(&self, terms: impl Iterator<Item = (i64, i32)>) -> i32 {
        let sum = terms.fold(0i64, |sum, (k, x)| {
            sum.wrapping_add(k.wrapping_mul(i64::from(x)))
        });
        let rounded = if self.coefficient == 0 {
            sum
        } else {
            sum.wrapping_add(1 << (self.coefficient - 1)) >> self.coefficient
        };
        rounded.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }
}

/// The law in the numbers of a word.
#[derive(Debug, Clone)]
struct Machine<W: Arithmetic> {
    word: W,
    law: MachineLaw<W::Coefficient>,
    limit: Option<W::Signal>,
    lowest: W::Signal,
    follows: bool,
    one: W::Coefficient,
    minus_one: W::Coefficient,
    state: Vec<W::Signal>,
    next: Vec<W::Signal>,
}

#[derive(Debug, Clone)]
enum MachineLaw<C> {
    Sections {
        gain: C,
        /// b0 b1 b2 −a1 −a2.
        sections: Vec<[C; 5]>,
    },
    StateSpace {
        update: Vec<Vec<C>>,
        output: Vec<C>,
        follow: Vec<C>,
    },
}

impl<W: Arithmetic> Machine<W> {
    fn new(export: &Exported, word: W, states: usize) -> Self {
        let k = |x: f64| word.coefficient(x);
        let row = |r: &Vec<f64>| -> Vec<W::Coefficient> { r.iter().map(|&x| k(x)).collect() };
        let law = match &export.law {
            Law::Sections { gain, sections } => MachineLaw::Sections {
                gain: k(*gain),
                sections: sections
                    .iter()
                    .map(|s| [s.b[0], s.b[1], s.b[2], -s.a[0], -s.a[1]].map(k))
                    .collect(),
            },
            Law::StateSpace {
                update,
                output,
                follow,
            } => MachineLaw::StateSpace {
                update: update.iter().map(row).collect(),
                output: row(output),
                follow: row(follow),
            },
        };
        let (one, minus_one) = (k(1.0), k(-1.0));
        let limit = export.limit.map(|l| word.signal(l));
        let lowest = word.signal(-export.limit.unwrap_or(0.0));
        Machine {
            law,
            limit,
            lowest,
            follows: export.anti_windup == AntiWindup::Conditioned,
            one,
            minus_one,
            state: vec![W::Signal::default(); states],
            next: vec![W::Signal::default(); states],
            word,
        }
    }

    #[inline]
    fn cut(limit: Option<W::Signal>, lowest: W::Signal, v: W::Signal) -> W::Signal {
        match limit {
            Some(l) if v > l => l,
            Some(_) if v < lowest => lowest,
            _ => v,
        }
    }

    fn step(&mut self, input: f64) -> f64 {
        let u = self.word.signal(input);
        let (limit, lowest) = (self.limit, self.lowest);
        let word = &self.word;
        let out = match &self.law {
            MachineLaw::Sections { gain, sections } => {
                let mut u = word.sum([(*gain, u)]);
                let count = sections.len();
                for (k, s) in sections.iter().enumerate() {
                    let (m0, m1) = (self.state[2 * k], self.state[2 * k + 1]);
                    let v = word.sum([(s[0], u), (self.one, m0)]);
                    let last = k + 1 == count;
                    let y = if last { Self::cut(limit, lowest, v) } else { v };
                    let fed = if last && !self.follows { v } else { y };
                    self.state[2 * k] = word.sum([(s[1], u), (s[3], fed), (self.one, m1)]);
                    self.state[2 * k + 1] = word.sum([(s[2], u), (s[4], fed)]);
                    u = y;
                }
                if count == 0 {
                    Self::cut(limit, lowest, u)
                } else {
                    u
                }
            }
            MachineLaw::StateSpace {
                update,
                output,
                follow,
            } => {
                let state = &self.state;
                let all = |row: &[W::Coefficient]| -> Vec<(W::Coefficient, W::Signal)> {
                    row.iter()
                        .copied()
                        .zip(state.iter().copied().chain([u]))
                        .collect()
                };
                let v = word.dot(all(output).into_iter());
                let y = Self::cut(limit, lowest, v);
                let beyond = word.sum([(self.one, y), (self.minus_one, v)]);
                for (i, row) in update.iter().enumerate() {
                    self.next[i] = word.dot(all(row).into_iter().chain([(follow[i], beyond)]));
                }
                y
            }
        };
        if matches!(self.law, MachineLaw::StateSpace { .. }) {
            std::mem::swap(&mut self.state, &mut self.next);
        }
        self.word.value(out)
    }
}

/// An exported controller with its states.
#[derive(Debug, Clone)]
pub struct RunningExport(AnyMachine);

#[derive(Debug, Clone)]
enum AnyMachine {
    Double(Machine<DoubleWord>),
    Single(Machine<SingleWord>),
    Fixed(Machine<FixedWord>),
}

impl RunningExport {
    /// One sample in, one sample out.
    pub fn step(&mut self, input: f64) -> f64 {
        match &mut self.0 {
            AnyMachine::Double(m) => m.step(input),
            AnyMachine::Single(m) => m.step(input),
            AnyMachine::Fixed(m) => m.step(input),
        }
    }
}

impl Exported {
    /// At rest, in the arithmetic of the word.
    pub fn running(&self) -> RunningExport {
        let states = match &self.law {
            Law::Sections { sections, .. } => 2 * sections.len(),
            Law::StateSpace { update, .. } => update.len(),
        };
        RunningExport(match self.word {
            Word::Double => AnyMachine::Double(Machine::new(self, DoubleWord, states)),
            Word::Single => AnyMachine::Single(Machine::new(self, SingleWord, states)),
            Word::Fixed {
                coefficient,
                signal,
            } => {
                let word = FixedWord {
                    coefficient,
                    signal,
                };
                AnyMachine::Fixed(Machine::new(self, word, states))
            }
        })
    }
}
