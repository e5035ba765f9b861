//! An exported controller with the feed-forward beside it, as a drive calls it once a sample: set-point and measured value in,
//! cut output out. C source and MAT variables; both in double precision whatever the word, so that the feed-forward is the one
//! that was judged.

use std::fmt::Write as _;

use super::mat::mat_variable;
use super::{Exported, Word};
use meltpath_numerics::Matrix;

/// What stands beside the law: the set-point differentiated twice through s/(1 + τ s), backward, times a gain, added to the law's
/// output. The sum is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// Output per second derivative of the set-point.
    pub gain: f64,
    /// τ, s.
    pub filter: f64,
    /// Sample time of the drive, s.
    pub period: f64,
    /// The law acts once in so many samples of the drive.
    pub every: u32,
    /// Units of the law's input in one of the set-point.
    pub per_unit: f64,
    /// The sum is cut to ± this.
    pub limit: f64,
}

impl Beside {
    /// What is kept of a derivative, and what a difference counts: τ/(τ + T) and 1/(τ + T).
    fn factors(&self) -> [f64; 2] {
        let length = self.filter + self.period;
        [self.filter / length, 1.0 / length]
    }
}

impl Exported {
    /// [`Exported::to_c`], behind it a state, a start and a function `NAME_drive` of set-point and measured value.
    pub fn to_c_beside(&self, beside: &Beside) -> String {
        let mut out = self.to_c();
        // writing to a String cannot fail
        let _ = write_drive(&mut out, self, beside);
        out
    }

    /// [`Exported::to_mat`] with `Tff` (s), `kff` (output per second derivative of the set-point) and `tauff` (s).
    pub fn to_mat_beside(&self, beside: &Beside) -> Vec<u8> {
        let mut out = self.to_mat();
        for (name, value) in [
            ("Tff", beside.period),
            ("kff", beside.gain),
            ("tauff", beside.filter),
        ] {
            mat_variable(&mut out, name, &Matrix::diagonal(&[value]));
        }
        out
    }
}

fn write_drive(out: &mut String, export: &Exported, beside: &Beside) -> std::fmt::Result {
    let name = &export.name;
    let [keep, slope] = beside.factors();
    let (gain, limit, per_unit) = (beside.gain, beside.limit, beside.per_unit);
    writeln!(
        out,
        "\ntypedef struct {{\n    {name}_state law;\n    uint32_t count;\n    double output, set_point, speed, acceleration;\n}} {name}_drive_state;\n\n\
         /* At rest at a set-point. */\n\
         void {name}_start({name}_drive_state *s, double set_point) {{\n    {name}_reset(&s->law);\n    s->count = 0;\n    \
         s->output = 0;\n    s->set_point = set_point;\n    s->speed = 0;\n    s->acceleration = 0;\n}}\n"
    )?;
    let acts = match export.word {
        Word::Double => format!("{name}_step(&s->law, error)"),
        Word::Single => format!("{name}_step(&s->law, (float)error)"),
        Word::Fixed { signal, .. } => {
            let scale = f64::from(2u32).powi(signal.cast_signed());
            writeln!(
                out,
                "/* A number with {signal} bits after the point, rounded to the nearest and cut to the word. */\n\
                 static int32_t {name}_signal(double x) {{\n    double v = x * {scale:e};\n    \
                 if (v >= INT32_MAX) return INT32_MAX;\n    if (v <= INT32_MIN) return INT32_MIN;\n    \
                 int32_t whole = (int32_t)v;\n    double rest = v - whole;\n    \
                 return rest >= 0.5 ? whole + 1 : rest <= -0.5 ? whole - 1 : whole;\n}}\n"
            )?;
            let back = 0.5f64.powi(signal.cast_signed());
            format!("{name}_step(&s->law, {name}_signal(error)) * {back:e}")
        }
    };
    writeln!(
        out,
        "/* Once every {:e} s: the law{} and the feed-forward. */\n\
         double {name}_drive({name}_drive_state *s, double set_point, double measured) {{\n    \
         if (s->count == 0) {{\n        double error = (set_point - measured) * {per_unit:e};\n        \
         s->output = {acts};\n        s->count = {};\n    }}\n    s->count -= 1;\n    \
         double before = s->speed;\n    \
         s->speed = {keep:e} * s->speed + {slope:e} * (set_point - s->set_point);\n    \
         s->set_point = set_point;\n    \
         s->acceleration = {keep:e} * s->acceleration + {slope:e} * (s->speed - before);\n    \
         double sum = s->output + {gain:e} * s->acceleration;\n    \
         return sum > {limit:e} ? {limit:e} : sum < -{limit:e} ? -{limit:e} : sum;\n}}",
        beside.period,
        if beside.every == 1 {
            String::new()
        } else {
            format!(", once in {} calls,", beside.every)
        },
        beside.every,
    )
}
