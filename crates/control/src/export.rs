//! A sampled controller as it leaves for a drive: second-order sections or state space, a word length, a cut output with
//! anti-windup; written as JSON (by `serde`), C and MAT, and run here in the very arithmetic of the C code.
//!
//! Anti-windup by conditioning: the states follow the output that went out (R. Hanus et al., Automatica 23 (1987) 729–739).
//! In sections the one with the slowest pole comes last and is the only one that sees the cut.

mod running;

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::domain::Domain;
use crate::sections::{SecondOrder, Sections};
use crate::state_space::StateSpace;
use crate::zero_pole::ZeroPoleGain;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::eigenvalues;

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
        Exported {
            schema: 1,
            name: name.to_owned(),
            period,
            word,
            limit,
            anti_windup,
            law: Law::Sections { gain, sections },
        }
        .proven()
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
        Exported {
            schema: 1,
            name: name.to_owned(),
            period,
            word,
            limit,
            anti_windup,
            law: Law::StateSpace {
                update: (0..n).map(|i| row(&s.a, s.b[(i, 0)], i)).collect(),
                output: row(&s.c, s.d[(0, 0)], 0),
                follow,
            },
        }
        .proven()
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

    /// Checks that the word holds the controller.
    fn proven(self) -> Result<Self, ExportError> {
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

    /// Variables for MATLAB and its kin: a level-4 MAT file with `Ts`, `limit` (infinite where free), and `g` and `sos` (rows
    /// b0 b1 b2 1 a1 a2) or `A`, `B`, `C`, `D`, `L`; coefficients as rounded to the word.
    pub fn to_mat(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let value = |x: f64| self.word.rounded(x);
        let scalar = |x: f64| Matrix::from_fn(1, 1, |_, _| x);
        mat_variable(&mut out, "Ts", &scalar(self.period));
        mat_variable(
            &mut out,
            "limit",
            &scalar(self.limit.unwrap_or(f64::INFINITY)),
        );
        match &self.law {
            Law::Sections { gain, sections } => {
                mat_variable(&mut out, "g", &scalar(value(*gain)));
                let sos = Matrix::from_fn(sections.len(), 6, |i, j| match j {
                    0..=2 => value(sections[i].b[j]),
                    3 => 1.0,
                    _ => value(sections[i].a[j - 4]),
                });
                mat_variable(&mut out, "sos", &sos);
            }
            Law::StateSpace {
                update,
                output,
                follow,
            } => {
                let n = update.len();
                let parts = [
                    ("A", Matrix::from_fn(n, n, |i, j| value(update[i][j]))),
                    ("B", Matrix::from_fn(n, 1, |i, _| value(update[i][n]))),
                    ("C", Matrix::from_fn(1, n, |_, j| value(output[j]))),
                    ("D", scalar(value(output[n]))),
                    ("L", Matrix::from_fn(n, 1, |i, _| value(follow[i]))),
                ];
                for (name, matrix) in &parts {
                    mat_variable(&mut out, name, matrix);
                }
            }
        }
        out
    }

    /// C99 source without dependencies: a state structure, a reset and a step function. In floating point it is to be
    /// compiled without contraction into fused operations (`-ffp-contract=off`), to give the bits of [`Exported::running`].
    pub fn to_c(&self) -> String {
        let mut out = String::new();
        // writing to a String cannot fail
        let _ = self.write_c(&mut out);
        out
    }

    fn write_c(&self, out: &mut String) -> std::fmt::Result {
        let name = &self.name;
        let (signal, number): (&str, fn(&Word, f64) -> String) = match self.word {
            Word::Double => ("double", |_, x| format!("{x:e}")),
            Word::Single => ("float", |_, x| format!("{:e}f", x as f32)),
            Word::Fixed { .. } => ("int32_t", |w, x| format!("INT64_C({})", w.integer(x))),
        };
        let c = |x: f64| number(&self.word, x);
        writeln!(out, "/* {name}: one step every {:e} s. */", self.period)?;
        writeln!(out, "#include <stdint.h>\n#include <string.h>\n")?;
        let (cut, shift) = match self.word {
            Word::Fixed {
                coefficient,
                signal,
            } => {
                writeln!(
                    out,
                    "/* Signals carry {signal} bits after the point, coefficients {coefficient}. */"
                )?;
                let half = 1i64 << (coefficient.max(1) - 1);
                writeln!(
                    out,
                    "static int32_t {name}_round(int64_t sum) {{\n    \
                     int64_t r = {};\n    \
                     return r > INT32_MAX ? INT32_MAX : r < INT32_MIN ? INT32_MIN : (int32_t)r;\n}}\n",
                    if coefficient == 0 {
                        "sum".to_owned()
                    } else {
                        format!("(sum + INT64_C({half})) >> {coefficient}")
                    }
                )?;
                let whole = (self.limit.unwrap_or(0.0) * f64::from(1u32 << signal)).round();
                (format!("{whole}"), format!("{coefficient}"))
            }
            _ => (c(self.limit.unwrap_or(0.0)), String::new()),
        };
        let fixed = matches!(self.word, Word::Fixed { .. });
        let sum = |terms: &[(String, String)]| -> String {
            let products: Vec<String> = terms.iter().map(|(k, x)| format!("{k} * {x}")).collect();
            if fixed {
                format!("{name}_round({})", products.join(" + "))
            } else {
                products.join(" + ")
            }
        };
        // a signal as it stands, in the width of a sum
        let one = if fixed {
            format!("(INT64_C(1) << {shift})")
        } else {
            c(1.0)
        };
        let states = self.transition(false).rows();
        writeln!(
            out,
            "typedef struct {{\n    {signal} x[{}];\n}} {name}_state;\n",
            states.max(1)
        )?;
        writeln!(
            out,
            "void {name}_reset({name}_state *s) {{\n    memset(s, 0, sizeof *s);\n}}\n"
        )?;
        writeln!(out, "{signal} {name}_step({name}_state *s, {signal} u) {{")?;
        let limit = |out: &mut String, from: &str, to: &str| -> std::fmt::Result {
            if self.limit.is_some() {
                writeln!(
                    out,
                    "    {signal} {to} = {from} > {cut} ? {cut} : {from} < -{cut} ? -{cut} : {from};"
                )
            } else {
                writeln!(out, "    {signal} {to} = {from};")
            }
        };
        match &self.law {
            Law::Sections { gain, sections } => {
                writeln!(out, "    {signal} u0 = {};", sum(&[(c(*gain), "u".into())]))?;
                for (k, s) in sections.iter().enumerate() {
                    let (u, m0, m1) = (
                        format!("u{k}"),
                        format!("s->x[{}]", 2 * k),
                        format!("s->x[{}]", 2 * k + 1),
                    );
                    let v = format!("v{k}");
                    writeln!(
                        out,
                        "    {signal} {v} = {};",
                        sum(&[(c(s.b[0]), u.clone()), (one.clone(), m0.clone())])
                    )?;
                    let next = format!("u{}", k + 1);
                    let last = k + 1 == sections.len();
                    if last {
                        limit(out, &v, &next)?;
                    } else {
                        writeln!(out, "    {signal} {next} = {v};")?;
                    }
                    let fed = if last && self.anti_windup == AntiWindup::None {
                        v
                    } else {
                        next
                    };
                    writeln!(
                        out,
                        "    {m0} = {};",
                        sum(&[
                            (c(s.b[1]), u.clone()),
                            (c(-s.a[0]), fed.clone()),
                            (one.clone(), m1.clone())
                        ])
                    )?;
                    writeln!(
                        out,
                        "    {m1} = {};",
                        sum(&[(c(s.b[2]), u), (c(-s.a[1]), fed)])
                    )?;
                }
                if sections.is_empty() {
                    limit(out, "u0", "y")?;
                    writeln!(out, "    return y;\n}}")
                } else {
                    writeln!(out, "    return u{};\n}}", sections.len())
                }
            }
            Law::StateSpace {
                update,
                output,
                follow,
            } => {
                let n = update.len();
                let terms = |row: &[f64]| -> Vec<(String, String)> {
                    row.iter()
                        .enumerate()
                        .map(|(j, &k)| {
                            let x = if j < n {
                                format!("s->x[{j}]")
                            } else {
                                "u".into()
                            };
                            (c(k), x)
                        })
                        .collect()
                };
                writeln!(out, "    {signal} v = {};", sum(&terms(output)))?;
                limit(out, "v", "y")?;
                let minus = if fixed {
                    format!("-(INT64_C(1) << {shift})")
                } else {
                    c(-1.0)
                };
                let beyond = sum(&[(one.clone(), "y".into()), (minus, "v".into())]);
                writeln!(out, "    {signal} cut = {beyond};")?;
                writeln!(out, "    {signal} next[{}];", n.max(1))?;
                for (i, row) in update.iter().enumerate() {
                    let mut all = terms(row);
                    all.push((c(follow[i]), "cut".into()));
                    writeln!(out, "    next[{i}] = {};", sum(&all))?;
                }
                if n > 0 {
                    writeln!(out, "    memcpy(s->x, next, sizeof next);")?;
                }
                writeln!(out, "    return y;\n}}")
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
    if let Some(limit) = limit
        && !(limit > 0.0 && limit.is_finite())
    {
        return Err(ExportError::Limit { limit });
    }
    match controller.domain {
        Domain::Sampled { period } => Ok(period),
        Domain::Continuous => Err(ExportError::System(SystemError::Domains {
            one: controller.domain,
            two: Domain::Sampled { period: f64::NAN },
        })),
    }
}

fn mat_variable(out: &mut Vec<u8>, name: &str, matrix: &Matrix) {
    let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    for field in [
        0,
        size(matrix.rows()),
        size(matrix.columns()),
        0,
        size(name.len() + 1),
    ] {
        out.extend(field.to_le_bytes());
    }
    out.extend(name.bytes());
    out.push(0);
    for j in 0..matrix.columns() {
        for i in 0..matrix.rows() {
            out.extend(matrix[(i, j)].to_le_bytes());
        }
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
