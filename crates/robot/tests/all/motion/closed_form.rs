//! Closed forms of the two-filter model at one isolated corner: what the streaming simulation is held to.
//!
//! Exact when both segments last longer than T_1 + T_2. Derived from Rouchon 2022, eq. 3.2-3.3; checked against the
//! simulation to 1e-4. `t1 >= t2 > 0` throughout, s.

/// Share of the incoming (and of the outgoing) velocity that is left in the middle of a corner: the step response of the
/// cascade `dwell / 2` before its centre.
pub(crate) fn velocity_share(t1: f64, t2: f64, dwell: f64) -> f64 {
    let (delta, p, q) = (0.5 * dwell, 0.5 * (t1 - t2), 0.5 * (t1 + t2));
    if delta <= p {
        0.5 - delta / t1
    } else if delta <= q {
        (q - delta).powi(2) / (2.0 * t1 * t2)
    } else {
        0.0
    }
}

/// Time integral of `velocity_share` from the corner's middle on, s: distance still to go per unit of speed.
pub(crate) fn remaining_time(t1: f64, t2: f64, dwell: f64) -> f64 {
    let (delta, p, q) = (0.5 * dwell, 0.5 * (t1 - t2), 0.5 * (t1 + t2));
    let tail = |d: f64| (q - d).powi(3) / (6.0 * t1 * t2);
    if delta < p {
        tail(p) + 0.5 * (p - delta) - (p * p - delta * delta) / (2.0 * t1)
    } else if delta <= q {
        tail(delta)
    } else {
        0.0
    }
}

/// Lowest speed over the travel speed at a corner turning by `angle` rad (0 = straight) with a dwell of `dwell` s:
/// `2 cos(α/2) G(T_D/2)`. Independent of the travel speed.
pub(crate) fn minimum_speed_ratio(t1: f64, t2: f64, dwell: f64, angle: f64) -> f64 {
    2.0 * (0.5 * angle).cos() * velocity_share(t1, t2, dwell)
}

/// Distance from the programmed corner to the path, mm, at a travel speed of `speed` mm/s: `2 sin(α/2) V M(T_D/2)`.
pub(crate) fn corner_deviation(t1: f64, t2: f64, dwell: f64, angle: f64, speed: f64) -> f64 {
    2.0 * (0.5 * angle).sin() * speed * remaining_time(t1, t2, dwell)
}

/// Duration of the transition round a corner, s, whatever its angle and speed.
pub(crate) fn transition_duration(t1: f64, t2: f64, dwell: f64) -> f64 {
    t1 + t2 + dwell
}

const T1: f64 = 0.132;
const T2: f64 = 0.084;

#[test]
fn known_values() {
    assert!((remaining_time(T1, T2, 0.0) - 18.727e-3).abs() < 1e-6);
    assert!((remaining_time(T1, T2, 0.0495) - 8.673e-3).abs() < 1e-6);
    assert!((transition_duration(T1, T2, 0.0) - 0.216).abs() < 1e-15);
}

#[test]
fn the_remaining_time_is_the_integral_of_the_share() {
    for dwell in [0.0, 0.03, 0.048, 0.06, 0.15, 0.216] {
        let n = 20_000;
        let (a, b) = (0.5 * dwell, 0.5 * (T1 + T2));
        let step = (b - a) / f64::from(n);
        let sum: f64 = (0..n)
            .map(|i| velocity_share(T1, T2, 2.0 * (a + (f64::from(i) + 0.5) * step)) * step)
            .sum();
        assert!((sum - remaining_time(T1, T2, dwell)).abs() < 1e-9);
    }
}
