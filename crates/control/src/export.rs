//! A sampled controller as it leaves for a drive: second-order sections or state space, a word length, a cut output with
//! anti-windup; written as JSON (by `serde`), C and MAT, and run here in the very arithmetic of the C code.
//!
//! Anti-windup by conditioning: the states follow the output that went out (R. Hanus et al., Automatica 23 (1987) 729–739).
//! In sections the one with the slowest pole comes last and is the only one that sees the cut.

mod c_source;
mod drive;
mod mat;
mod running;

use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::domain::Domain;
use crate::sections::{SecondOrder, Sections};
use crate::state_space::StateSpace;
use crate::zero_pole::ZeroPoleGain;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::eigenvalues;

pub use drive::Beside;
pub use running::RunningExport;

/// How numbers are held on the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind", deny_unknown_fields)]
pub enum Word {
    /// IEEE double precision.
    Double,
    /// IEEE single precision.
    Single,
    /// 32-bit integers, sums in 64 bits, rounded once and cut to 32.
    Fixed {
        /// Bits after the point of coefficients, at most 30.
        coefficient: u32,
        /// Bits after the point of signals and states, at most 30.
        signal: u32,
    },
}

/// What the states do while the output is cut.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AntiWindup {
    /// They run on.
    None,
    /// They follow the output that went out.
    #[default]
    Conditioned,
}

/// The law itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind", deny_unknown_fields)]
pub enum Law {
    /// A gain, then sections in series (transposed direct form II), the one with the slowest pole last.
    Sections {
        /// Gain.
        gain: f64,
        /// Sections.
        sections: Vec<SecondOrder>,
    },
    /// x⁺ = A x + B u + L (cut − y), y = C x + D u, row by row.
    StateSpace {
        /// One row a state: A, then B.
        update: Vec<Vec<f64>>,
        /// C, then D.
        output: Vec<f64>,
        /// L, zero without anti-windup.
        follow: Vec<f64>,
    },
}

/// A controller of one input and one output, as exported.
///
/// ```
/// use meltpath_control::export::{AntiWindup, Exported, Word};
/// use meltpath_control::{discretise::{discretise, Hold}, TransferFunction};
/// let pi = TransferFunction::new([1.0, 50.0], [1.0, 0.0]).unwrap().to_state_space().unwrap();
/// let sampled = discretise(&pi, 1e-3, Hold::First).unwrap();
/// let export = Exported::sections("pi", &sampled, Word::Single, Some(2.0), AntiWindup::Conditioned).unwrap();
/// let mut runs = export.running();
/// let out: Vec<f64> = (0..2000).map(|k| runs.step(if k < 1000 { 1.0 } else { -1.0 })).collect();
/// assert_eq!(out[999], 2.0);                       // cut
/// assert!(out[1000] < 1.0);                        // and back at once: no windup
/// assert!(export.to_c().contains("pi_step"));
/// let json = serde_json::to_string(&export).unwrap();
/// assert_eq!(serde_json::from_str::<Exported>(&json).unwrap(), export);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exported {
    /// Version of this layout.
    pub schema: u32,
    /// Name: a C identifier.
    pub name: String,
    /// Sample time, s.
    pub period: f64,
    /// How numbers are held.
    pub word: Word,
    /// The output is cut to ± this; none where it is free.
    pub limit: Option<f64>,
    /// What the states do meanwhile.
    pub anti_windup: AntiWindup,
    /// The law, in coefficients before rounding to the word.
    pub law: Law,
}

/// Why a controller cannot be exported.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// Not a C identifier.
    #[error("\"{name}\" is not a C identifier: a letter, then letters, digits and underscores")]
    Name {
        /// What was given.
        name: String,
    },
    /// More than one channel.
    #[error(
        "a controller with {inputs} inputs and {outputs} outputs: only one of each is exported"
    )]
    Channels {
        /// Inputs.
        inputs: usize,
        /// Outputs.
        outputs: usize,
    },
    /// A limit that is none.
    #[error("the output limit {limit} is not positive")]
    Limit {
        /// What was given.
        limit: f64,
    },
    /// A row of another length than its states ask for.
    #[error(
        "{what} has {found} coefficient{}, {states} state{} and the input need {needed}: export it again",
        if *found == 1 { "" } else { "s" },
        if *states == 1 { "" } else { "s" }
    )]
    Shape {
        /// Which row.
        what: &'static str,
        /// Its length.
        found: usize,
        /// States of the law.
        states: usize,
        /// The length that fits.
        needed: usize,
    },
    /// The word does not hold a number.
    #[error(
        "{what} {value} does not fit a fixed-point word with {fraction} bits after the point (largest {largest}): take fewer bits after the point, or scale the controller"
    )]
    Word {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Bits after the point.
        fraction: u32,
        /// Largest number that fits.
        largest: f64,
    },
    /// Rounding to the word makes the controller itself unstable.
    #[error(
        "rounded to its word the controller has a pole of modulus {modulus}, {before} before: take a longer word, or sections instead of state space"
    )]
    Unstable {
        /// Largest pole modulus after rounding.
        modulus: f64,
        /// And before.
        before: f64,
    },
    /// No direct gain, or zeros outside the unit circle.
    #[error(
        "the states cannot follow a cut output: the controller {why}; export sections, or without anti-windup"
    )]
    Following {
        /// What it lacks.
        why: &'static str,
    },
    /// The system.
    #[error(transparent)]
    System(#[from] SystemError),
}

impl Exported {
    /// As sections in series.
    ///
    /// # Errors
    /// [`ExportError`].
    pub fn sections(
        name: &str,
        controller: &StateSpace,
        word: Word,
        limit: Option<f64>,
        anti_windup: AntiWindup,
    ) -> Result<Self, ExportError> {
        let period = checked(name, controller, limit)?;
        let zpk = ZeroPoleGain::from_state_space(controller, 0, 0)?;
        let found = Sections::from_zero_pole(&zpk)?;
        let mut sections = found.sections;
        // the slowest pole is where the denominator at z = 1 is smallest
        let slowest = (0..sections.len()).min_by(|&i, &j| {
            let rest = |k: usize| (1.0 + sections[k].a[0] + sections[k].a[1]).abs();
            rest(i).total_cmp(&rest(j))
        });
        if let Some(k) = slowest {
            let last = sections.remove(k);
            sections.push(last);
        }
        let gain = found.gain;
        let law = Law::Sections { gain, sections };
        Exported::of(name, period, (word, limit, anti_windup), law)
    }

    /// As state space.
    ///
    /// # Errors
    /// [`ExportError`].
    pub fn state_space(
        name: &str,
        controller: &StateSpace,
        word: Word,
        limit: Option<f64>,
        anti_windup: AntiWindup,
    ) -> Result<Self, ExportError> {
        let period = checked(name, controller, limit)?;
        let s = controller.balanced_scaling();
        let n = s.order();
        let follow = if limit.is_some() && anti_windup == AntiWindup::Conditioned {
            let direct = s.d[(0, 0)];
            if direct == 0.0 {
                return Err(ExportError::Following {
                    why: "has no direct gain",
                });
            }
            let l = s.b.scaled(1.0 / direct);
            // while cut, the states run with A − L C
            let cut = eigenvalues(&(&s.a - &l * &s.c)).map_err(SystemError::from)?;
            if cut.iter().any(|z| z.norm() >= 1.0) {
                return Err(ExportError::Following {
                    why: "has zeros outside the unit circle",
                });
            }
            l.entries().to_vec()
        } else {
            vec![0.0; n]
        };
        let row = |a: &Matrix, b: f64, i: usize| -> Vec<f64> {
            a.row_slice(i).iter().copied().chain([b]).collect()
        };
        let law = Law::StateSpace {
            update: (0..n).map(|i| row(&s.a, s.b[(i, 0)], i)).collect(),
            output: row(&s.c, s.d[(0, 0)], 0),
            follow,
        };
        Exported::of(name, period, (word, limit, anti_windup), law)
    }

    /// A law with how its numbers are held and what is done while the output is cut.
    fn of(
        name: &str,
        period: f64,
        (word, limit, anti_windup): (Word, Option<f64>, AntiWindup),
        law: Law,
    ) -> Result<Self, ExportError> {
        let exported = Exported {
            schema: 1,
            name: name.to_owned(),
            period,
            word,
            limit,
            anti_windup,
            law,
        };
        exported.proven()
    }

    /// The sum of the absolute coefficients of each sum of products.
    fn sums(&self) -> Vec<f64> {
        let total = |row: &[f64]| row.iter().map(|x| x.abs()).sum::<f64>();
        match &self.law {
            Law::Sections { sections, .. } => sections
                .iter()
                .flat_map(|s| {
                    [
                        s.b[0].abs() + 1.0,
                        s.b[1].abs() + s.a[0].abs() + 1.0,
                        s.b[2].abs() + s.a[1].abs(),
                    ]
                })
                .collect(),
            Law::StateSpace {
                update,
                output,
                follow,
            } => update
                .iter()
                .zip(follow)
                .map(|(row, f)| total(row) + f.abs())
                .chain([total(output)])
                .collect(),
        }
    }

    /// Every coefficient.
    fn coefficients(&self) -> Vec<f64> {
        match &self.law {
            Law::Sections { gain, sections } => std::iter::once(*gain)
                .chain(sections.iter().flat_map(|s| s.b.into_iter().chain(s.a)))
                .collect(),
            Law::StateSpace {
                update,
                output,
                follow,
            } => update
                .iter()
                .flatten()
                .chain(output)
                .chain(follow)
                .copied()
                .collect(),
        }
    }

    /// Refuses what a file may say and no program can run: rows that do not fit, numbers that the word does not hold.
    ///
    /// # Errors
    /// [`ExportError::Shape`], [`ExportError::Limit`], [`ExportError::Word`].
    ///
    /// ```
    /// # use meltpath_control::{StateSpace, TransferFunction, discretise::{discretise, Hold}, export::*};
    /// let lag = TransferFunction::new([1.0], [0.1, 1.0]).unwrap().to_state_space().unwrap();
    /// let sampled = discretise(&lag, 1e-3, Hold::First).unwrap();
    /// let mut lag = Exported::state_space("lag", &sampled, Word::Double, None, AntiWindup::None).unwrap();
    /// assert!(lag.check().is_ok());
    /// let Law::StateSpace { output, .. } = &mut lag.law else { unreachable!() };
    /// output.pop();
    /// assert_eq!(lag.check().unwrap_err().to_string(), "the output has 1 coefficient, 1 state and the input need 2: export it again");
    /// ```
    pub fn check(&self) -> Result<(), ExportError> {
        if let Law::StateSpace {
            update,
            output,
            follow,
        } = &self.law
        {
            let states = update.len();
            let rows = update.iter().map(|row| ("a row of the update", row, 1));
            let others = [("the output", output, 1), ("what follows", follow, 0)];
            for (what, row, inputs) in rows.chain(others) {
                if row.len() != states + inputs {
                    return Err(ExportError::Shape {
                        what,
                        found: row.len(),
                        states,
                        needed: states + inputs,
                    });
                }
            }
        }
        if let Some(limit) = self.limit {
            positive(limit)?;
        }
        self.holds()
    }

    /// Whether the word holds the controller's numbers.
    fn holds(&self) -> Result<(), ExportError> {
        if let Word::Fixed {
            coefficient,
            signal,
        } = self.word
        {
            let fits = |what, value: f64, fraction: u32| {
                let largest = largest_fixed(fraction);
                if fraction <= 30 && value.abs() <= largest {
                    Ok(())
                } else {
                    Err(ExportError::Word {
                        what,
                        value,
                        fraction,
                        largest,
                    })
                }
            };
            for value in self.coefficients() {
                fits("the coefficient", value, coefficient)?;
            }
            // 64 bits hold every sum of products when coefficients sum to less than 2³² of their last bits
            for value in self.sums() {
                fits("half the sum of coefficients", 0.5 * value, coefficient)?;
            }
            fits("the output limit", self.limit.unwrap_or(0.0), signal)?;
        }
        Ok(())
    }

    /// Checks that the word holds the controller.
    fn proven(self) -> Result<Self, ExportError> {
        self.holds()?;
        let radius = |rounded: bool| -> Result<f64, SystemError> {
            let poles = eigenvalues(&self.transition(rounded))?;
            Ok(poles.iter().map(|p| p.norm()).fold(0.0, f64::max))
        };
        let (before, modulus) = (radius(false)?, radius(true)?);
        // an integrator may stay on the circle, to rounding
        if modulus > before.max(1.0) + 1e-7 {
            return Err(ExportError::Unstable { modulus, before });
        }
        Ok(self)
    }

    /// The law in the coefficients that its word holds, as a system: without the cut, and signals not rounded.
    ///
    /// # Errors
    /// [`ExportError::Shape`], [`ExportError::System`].
    ///
    /// ```
    /// use meltpath_control::export::{AntiWindup, Exported, Word};
    /// use meltpath_control::{discretise::{discretise, Hold}, TransferFunction};
    /// let lag = TransferFunction::new([2.0], [0.1, 1.0]).unwrap().to_state_space().unwrap();
    /// let sampled = discretise(&lag, 1e-3, Hold::First).unwrap();
    /// let word = Word::Fixed { coefficient: 8, signal: 22 };
    /// let export = Exported::sections("lag", &sampled, word, None, AntiWindup::None).unwrap();
    /// // a pole at exp(-0.01) is held as 253/256
    /// assert_eq!(export.held().unwrap().poles().unwrap()[0].re, 253.0 / 256.0);
    /// ```
    pub fn held(&self) -> Result<StateSpace, ExportError> {
        self.check()?;
        let k = |x: f64| self.word.rounded(x);
        let domain = Domain::Sampled {
            period: self.period,
        };
        match &self.law {
            Law::Sections { gain, sections } => {
                let first = StateSpace::constant(Matrix::diagonal(&[k(*gain)]), domain);
                let series = sections.iter().try_fold(first, |so_far, s| {
                    let ([b0, b1, b2], [a1, a2]) = (s.b.map(k), s.a.map(k));
                    let a = [[-a1, 1.0], [-a2, 0.0]];
                    let b = [b1 - a1 * b0, b2 - a2 * b0];
                    so_far.then(&StateSpace::new(
                        Matrix::from_fn(2, 2, |i, j| a[i][j]),
                        Matrix::from_fn(2, 1, |i, _| b[i]),
                        Matrix::from_fn(1, 2, |_, j| [1.0, 0.0][j]),
                        Matrix::diagonal(&[b0]),
                        domain,
                    )?)
                });
                Ok(series?)
            }
            Law::StateSpace { update, output, .. } => {
                let n = update.len();
                Ok(StateSpace::new(
                    Matrix::from_fn(n, n, |i, j| k(update[i][j])),
                    Matrix::from_fn(n, 1, |i, _| k(update[i][n])),
                    Matrix::from_fn(1, n, |_, j| k(output[j])),
                    Matrix::diagonal(&[k(output[n])]),
                    domain,
                )?)
            }
        }
    }

    /// The law's transition matrix, from rounded coefficients or not.
    fn transition(&self, rounded: bool) -> Matrix {
        let value = |x: f64| if rounded { self.word.rounded(x) } else { x };
        match &self.law {
            Law::Sections { sections, .. } => {
                let n = 2 * sections.len();
                // poles are those of each section: the coupling between sections plays no part
                Matrix::from_fn(n, n, |i, j| {
                    let a = sections[i / 2].a;
                    match (i / 2 == j / 2, i % 2, j % 2) {
                        (true, 0, 0) => -value(a[0]),
                        (true, 0, 1) => 1.0,
                        (true, 1, 0) => -value(a[1]),
                        _ => 0.0,
                    }
                })
            }
            Law::StateSpace { update, .. } => {
                let n = update.len();
                Matrix::from_fn(n, n, |i, j| value(update[i][j]))
            }
        }
    }
}

fn checked(name: &str, controller: &StateSpace, limit: Option<f64>) -> Result<f64, ExportError> {
    let mut letters = name.chars();
    let starts = letters
        .next()
        .is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
    if !starts || !letters.all(|c| c.is_ascii_alphanumeric() || c == '_') {
        return Err(ExportError::Name {
            name: name.to_owned(),
        });
    }
    if controller.inputs() != 1 || controller.outputs() != 1 {
        return Err(ExportError::Channels {
            inputs: controller.inputs(),
            outputs: controller.outputs(),
        });
    }
    if let Some(limit) = limit {
        positive(limit)?;
    }
    match controller.domain {
        Domain::Sampled { period } => Ok(period),
        Domain::Continuous => Err(ExportError::System(SystemError::Domains {
            one: controller.domain,
            two: Domain::Sampled { period: f64::NAN },
        })),
    }
}

fn positive(limit: f64) -> Result<(), ExportError> {
    if limit > 0.0 && limit.is_finite() {
        Ok(())
    } else {
        Err(ExportError::Limit { limit })
    }
}

fn largest_fixed(fraction: u32) -> f64 {
    f64::from(i32::MAX) * 0.5f64.powi(fraction.cast_signed())
}

impl Word {
    /// A coefficient as the word holds it.
    pub fn rounded(&self, x: f64) -> f64 {
        match *self {
            Word::Double => x,
            Word::Single => f64::from(x as f32),
            Word::Fixed { coefficient, .. } => {
                let unit = f64::from(2u32).powi(coefficient.cast_signed());
                (x * unit).round() / unit
            }
        }
    }

    /// A coefficient in units of its last bit; itself, rounded, in floating point.
    fn integer(self, x: f64) -> i64 {
        match self {
            Word::Fixed { coefficient, .. } => {
                (x * f64::from(2u32).powi(coefficient.cast_signed())).round() as i64
            }
            _ => x.round() as i64,
        }
    }
}
