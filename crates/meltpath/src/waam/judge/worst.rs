//! By which of several places a check is judged, where each is known otherwise well.

use meltpath_base::{Limit, Measure};

/// The place at which a limit is broken most surely; where none surely breaks it, the one most likely beyond it: a value well within the limit
/// that is hardly known says less than one near to it that is well known.
pub(in crate::waam) fn worst<T>(
    places: impl Iterator<Item = (T, Measure)>,
    limit: Limit,
) -> Option<(T, Measure)> {
    // whether it surely is beyond, and how far it may be
    let how = |m: &Measure| {
        let sigma = m.sigma.unwrap_or(0.0);
        let beyond = match limit {
            Limit::AtMost(bound) => m.value - bound,
            Limit::AtLeast(bound) => bound - m.value,
        };
        if beyond > sigma {
            (true, beyond - sigma)
        } else {
            (false, beyond + sigma)
        }
    };
    // the first of equals
    places.min_by(|(_, a), (_, b)| {
        let (a, b) = (how(a), how(b));
        b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_surely_fails_goes_before_what_may() {
        let of = |values: &[(f64, f64)]| {
            let all = values.iter().enumerate();
            let all = all.map(|(i, (value, sigma))| (i, Measure::new(*value, *sigma, "mm")));
            worst(all, Limit::AtMost(1.0)).map(|w| w.0)
        };
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[(0.9, 0.0), (0.5, 0.4), (0.6, 0.6)]), Some(2));
        assert_eq!(of(&[(1.1, 0.0), (2.0, 1.5)]), Some(0));
        assert_eq!(of(&[(3.0, 0.5), (2.0, 0.1)]), Some(0));
    }
}
