//! Rational approximation of a delay.

use crate::polynomial::Polynomial;

/// Numerator and denominator of the Padé approximant of exp(−delay·s) of order `order` over `order`.
///
/// Golub and Van Loan, 9.3.1: c_k = (2q − k)! q! / ((2q)! k! (q − k)!).
pub fn pade(delay: f64, order: usize) -> (Polynomial, Polynomial) {
    let mut coefficients = vec![1.0];
    for k in 1..=order {
        let previous = coefficients[k - 1];
        coefficients
            .push(previous * delay * (order + 1 - k) as f64 / ((2 * order + 1 - k) * k) as f64);
    }
    let signed = coefficients
        .iter()
        .enumerate()
        .map(|(k, c)| if k % 2 == 1 { -c } else { *c });
    let up: Vec<f64> = signed.rev().collect();
    let down: Vec<f64> = coefficients.iter().rev().copied().collect();
    (Polynomial::new(up), Polynomial::new(down))
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    #[test]
    fn all_pass_with_the_right_phase() {
        let (up, down) = pade(1e-3, 3);
        for omega in [10.0, 1000.0, 3000.0] {
            let s = Complex64::new(0.0, omega);
            let z = up.at(s) / down.at(s);
            assert!((z.norm() - 1.0).abs() < 1e-14);
            let exact = Complex64::cis(-omega * 1e-3);
            // error term of the approximant: 2 (q!)²/((2q)!(2q+1)!)·x^(2q+1), halved for safety upwards
            assert!((z - exact).norm() < 2e-5 * (omega * 1e-3).powi(7) + 1e-14);
        }
    }
}
