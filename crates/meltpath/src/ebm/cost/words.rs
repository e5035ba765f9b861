//! Times and sizes as people read them.

use meltpath_base::number::significant;

/// Days from which on time is told in years.
const YEARS: f64 = 1000.0;

/// A time of computing.
pub(crate) fn time(seconds: f64) -> String {
    let days = seconds / 86_400.0;
    if seconds < 90.0 {
        format!("{:.0} s", seconds.max(1.0))
    } else if seconds < 5400.0 {
        format!("{:.0} min", seconds / 60.0)
    } else if days < 2.0 {
        format!("{:.0} h", seconds / 3600.0)
    } else if days < YEARS {
        format!("{days:.0} days")
    } else {
        format!("{} years", significant(days / 365.25, 2))
    }
}

/// Bytes.
pub(crate) fn memory(bytes: f64) -> String {
    if bytes < 1e9 {
        format!("{:.0} MB", (1e-6 * bytes).max(1.0))
    } else if bytes < 1e12 {
        format!("{:.1} GB", 1e-9 * bytes)
    } else {
        format!("{} TB", significant(1e-12 * bytes, 3))
    }
}
