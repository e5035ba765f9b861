//! An exported controller as variables in a level-4 MAT file.

use meltpath_numerics::Matrix;

use super::{Exported, Law};

impl Exported {
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
}

/// One variable.
pub(super) fn mat_variable(out: &mut Vec<u8>, name: &str, matrix: &Matrix) {
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
