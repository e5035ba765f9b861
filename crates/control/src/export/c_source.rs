//! An exported controller as C99 source without dependencies.

use std::fmt::Write as _;

use super::{AntiWindup, Exported, Law, Word};
use crate::sections::SecondOrder;

impl Exported {
    /// C99 source without dependencies: a state structure, a reset and a step function. In floating point it is to be
    /// compiled without contraction into fused operations (`-ffp-contract=off`), to give the bits of [`Exported::running`].
    pub fn to_c(&self) -> String {
        let mut out = String::new();
        // writing to a String cannot fail
        let _ = Source::new(self).write(&mut out);
        out
    }
}

/// A product in a sum: coefficient and signal, as written.
type Term = (String, String);

/// The words of the source that depend on the controller's name and word.
struct Source<'a> {
    export: &'a Exported,
    /// Type of a signal.
    signal: &'static str,
    /// The output limit as a literal.
    cut: String,
    /// The coefficients one and minus one, for a signal as it stands in the width of a sum.
    one: String,
    minus_one: String,
}

impl<'a> Source<'a> {
    fn new(export: &'a Exported) -> Self {
        let limit = export.limit.unwrap_or(0.0);
        let literal = |x: f64| literal(export.word, x);
        let (signal, cut, one, minus_one) = match export.word {
            Word::Double => ("double", literal(limit), literal(1.0), literal(-1.0)),
            Word::Single => ("float", literal(limit), literal(1.0), literal(-1.0)),
            Word::Fixed {
                coefficient,
                signal,
            } => (
                "int32_t",
                format!("{}", (limit * f64::from(1u32 << signal)).round()),
                format!("(INT64_C(1) << {coefficient})"),
                format!("-(INT64_C(1) << {coefficient})"),
            ),
        };
        Source {
            export,
            signal,
            cut,
            one,
            minus_one,
        }
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let (name, signal) = (&self.export.name, self.signal);
        writeln!(
            out,
            "/* {name}: one step every {:e} s. */",
            self.export.period
        )?;
        writeln!(out, "#include <stdint.h>\n#include <string.h>\n")?;
        if let Word::Fixed {
            coefficient,
            signal,
        } = self.export.word
        {
            self.rounding(out, coefficient, signal)?;
        }
        let states = self.export.transition(false).rows();
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
        match &self.export.law {
            Law::Sections { gain, sections } => self.sections(out, *gain, sections),
            Law::StateSpace {
                update,
                output,
                follow,
            } => self.state_space(out, update, output, follow),
        }
    }

    /// The function that rounds a sum of fixed-point products once, and cuts it to a signal.
    fn rounding(&self, out: &mut String, coefficient: u32, signal: u32) -> std::fmt::Result {
        writeln!(
            out,
            "/* Signals carry {signal} bits after the point, coefficients {coefficient}. */"
        )?;
        let half = 1i64 << (coefficient.max(1) - 1);
        writeln!(
            out,
            "static int32_t {}_round(int64_t sum) {{\n    \
             int64_t r = {};\n    \
             return r > INT32_MAX ? INT32_MAX : r < INT32_MIN ? INT32_MIN : (int32_t)r;\n}}\n",
            self.export.name,
            if coefficient == 0 {
                "sum".to_owned()
            } else {
                format!("(sum + INT64_C({half})) >> {coefficient}")
            }
        )
    }

    fn number(&self, x: f64) -> String {
        literal(self.export.word, x)
    }

    fn sum(&self, terms: &[Term]) -> String {
        let products: Vec<String> = terms.iter().map(|(k, x)| format!("{k} * {x}")).collect();
        if matches!(self.export.word, Word::Fixed { .. }) {
            format!("{}_round({})", self.export.name, products.join(" + "))
        } else {
            products.join(" + ")
        }
    }

    /// `to`, which is `from` cut to the limit.
    fn limited(&self, out: &mut String, from: &str, to: &str) -> std::fmt::Result {
        let (signal, cut) = (self.signal, &self.cut);
        if self.export.limit.is_some() {
            writeln!(
                out,
                "    {signal} {to} = {from} > {cut} ? {cut} : {from} < -{cut} ? -{cut} : {from};"
            )
        } else {
            writeln!(out, "    {signal} {to} = {from};")
        }
    }

    fn sections(&self, out: &mut String, gain: f64, sections: &[SecondOrder]) -> std::fmt::Result {
        let signal = self.signal;
        let c = |x: f64| self.number(x);
        writeln!(
            out,
            "    {signal} u0 = {};",
            self.sum(&[(c(gain), "u".into())])
        )?;
        for (k, s) in sections.iter().enumerate() {
            let (u, m0, m1) = (
                format!("u{k}"),
                format!("s->x[{}]", 2 * k),
                format!("s->x[{}]", 2 * k + 1),
            );
            let v = format!("v{k}");
            let first = [(c(s.b[0]), u.clone()), (self.one.clone(), m0.clone())];
            writeln!(out, "    {signal} {v} = {};", self.sum(&first))?;
            let next = format!("u{}", k + 1);
            let last = k + 1 == sections.len();
            if last {
                self.limited(out, &v, &next)?;
            } else {
                writeln!(out, "    {signal} {next} = {v};")?;
            }
            let fed = if last && self.export.anti_windup == AntiWindup::None {
                v
            } else {
                next
            };
            let second = [
                (c(s.b[1]), u.clone()),
                (c(-s.a[0]), fed.clone()),
                (self.one.clone(), m1.clone()),
            ];
            writeln!(out, "    {m0} = {};", self.sum(&second))?;
            let third = [(c(s.b[2]), u), (c(-s.a[1]), fed)];
            writeln!(out, "    {m1} = {};", self.sum(&third))?;
        }
        if sections.is_empty() {
            self.limited(out, "u0", "y")?;
            writeln!(out, "    return y;\n}}")
        } else {
            writeln!(out, "    return u{};\n}}", sections.len())
        }
    }

    fn state_space(
        &self,
        out: &mut String,
        update: &[Vec<f64>],
        output: &[f64],
        follow: &[f64],
    ) -> std::fmt::Result {
        let (n, signal) = (update.len(), self.signal);
        let terms = |row: &[f64]| -> Vec<Term> {
            row.iter()
                .enumerate()
                .map(|(j, &k)| {
                    let x = if j < n {
                        format!("s->x[{j}]")
                    } else {
                        "u".into()
                    };
                    (self.number(k), x)
                })
                .collect()
        };
        writeln!(out, "    {signal} v = {};", self.sum(&terms(output)))?;
        self.limited(out, "v", "y")?;
        let beyond = [
            (self.one.clone(), "y".into()),
            (self.minus_one.clone(), "v".into()),
        ];
        writeln!(out, "    {signal} cut = {};", self.sum(&beyond))?;
        writeln!(out, "    {signal} next[{}];", n.max(1))?;
        for (i, row) in update.iter().enumerate() {
            let mut all = terms(row);
            all.push((self.number(follow[i]), "cut".into()));
            writeln!(out, "    next[{i}] = {};", self.sum(&all))?;
        }
        if n > 0 {
            writeln!(out, "    memcpy(s->x, next, sizeof next);")?;
        }
        writeln!(out, "    return y;\n}}")
    }
}

/// A coefficient as C writes it.
fn literal(word: Word, x: f64) -> String {
    match word {
        Word::Double => format!("{x:e}"),
        Word::Single => format!("{:e}f", x as f32),
        Word::Fixed { .. } => format!("INT64_C({})", word.integer(x)),
    }
}
