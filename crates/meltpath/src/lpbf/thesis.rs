//! What the thesis prints for its own heads and recipes, to stand beside what a run gives, and what of ours was fitted to it.
//!
//! Source: Rasoanarivo 2020, tables 3.1, § 2.6.1 and 3.2; its two-axis figures come from a bench, those of three axes from its simulator.

use meltpath_scan_head::head::job::Recipe;
use meltpath_scan_head::head::scan_head::ScanHead;

use super::settings::Settings;
use super::work::Work;

/// Which controllers drive the mirrors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Structure {
    /// The cascade of the head's file.
    Conventional,
    /// H-infinity with the thesis' weights.
    HInfinity,
    /// Those of a file.
    Other,
}

/// What is printed of one recipe on one head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Printed {
    /// Squares of its plate.
    pub(super) squares: u32,
    /// Time of one layer of them, s.
    pub(super) time: f64,
    /// Limit, µm, and share of contour points below it, %.
    pub(super) shares: [(f64, f64); 3],
    /// Fill rate, %.
    pub(super) fill: f64,
    /// Where most tracking errors of X and Y on marks lie, deg.
    pub(super) tracking: [&'static str; 2],
    /// Delays of the laser, µs.
    pub(super) delays: Option<[f64; 2]>,
}

/// The thesis' figures for a recipe of its speeds, on a plate of squares and a head of its number of axes.
pub(super) fn printed(settings: &Settings, recipe: &Recipe) -> Option<Printed> {
    let (head, structure) = (&settings.data.head, settings.structure);
    if recipe.sky_writing.is_some() || !matches!(settings.work, Work::Plate(_)) {
        return None;
    }
    let speeds = [
        recipe.contour_speed,
        recipe.fill_speed,
        recipe.contour_jump_speed,
        recipe.fill_jump_speed,
    ];
    let number = [
        [1500.0, 1000.0, 4500.0, 6000.0],
        [1500.0, 1500.0, 6000.0, 6000.0],
        [3000.0, 3000.0, 12_000.0, 12_000.0],
    ]
    .iter()
    .position(|s| *s == speeds)?;
    let three = head.focus.is_some();
    let (below, fill, tracking): ([f64; 3], f64, [&str; 2]) = match (three, structure, number) {
        (true, Structure::Conventional, 0) => {
            ([93.51, 98.3, 99.32], 97.16, ["0.008–0.010", "0.008–0.010"])
        }
        (true, Structure::Conventional, 1) => {
            ([93.53, 96.94, 99.36], 96.75, ["0.010–0.014", "0.012–0.014"])
        }
        (true, Structure::Conventional, _) => {
            ([87.58, 91.56, 94.67], 91.33, ["0.024–0.026", "0.028–0.030"])
        }
        (true, Structure::HInfinity, 0) => {
            ([93.67, 98.66, 99.68], 98.06, ["0.004–0.006", "0.004–0.008"])
        }
        (true, Structure::HInfinity, 1) => {
            ([95.17, 96.37, 99.02], 98.09, ["0.006–0.008", "0.008–0.010"])
        }
        (true, Structure::HInfinity, _) => {
            ([91.67, 93.73, 95.38], 91.55, ["0.014–0.016", "0.016–0.018"])
        }
        (false, Structure::Conventional, 0) => {
            ([37.85, 90.55, 96.59], 68.47, ["0.020–0.030", "0.020–0.030"])
        }
        (false, Structure::Conventional, 1) => (
            [47.56, 91.9, 96.9],
            54.28,
            ["over 80 % above 0.04", "over 80 % above 0.04"],
        ),
        (false, Structure::HInfinity, 0) => ([85.65, 95.68, 98.33], 70.11, ["0–0.010", "0–0.010"]),
        (false, Structure::HInfinity, 1) => (
            [84.2, 94.35, 96.97],
            56.41,
            ["99 % below 0.04", "99 % below 0.04"],
        ),
        _ => return None,
    };
    let (squares, times, limits): (u32, [f64; 3], [f64; 3]) = if three {
        (300, [354.326, 263.441, 131.928], [10.0, 20.0, 30.0])
    } else {
        (100, [118.014, 87.714, f64::NAN], [100.0, 200.0, 300.0])
    };
    Some(Printed {
        squares,
        time: times[number],
        shares: [0, 1, 2].map(|k| (limits[k], below[k])),
        fill,
        tracking,
        delays: match (three, structure, number) {
            (true, Structure::Conventional, 0) => Some([395.0, 107.0]),
            (true, Structure::Conventional, 1) => Some([341.0, 53.0]),
            _ => None,
        },
    })
}

/// What a figure of the shipped heads owes to the thesis' own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fitted {
    /// The waits, the hatch and the inset come from the printed times.
    Time,
    /// The pre-filter's length, and on two axes the friction, were chosen with the printed errors in view.
    Tracking,
    /// The hatch comes from the printed times; the rate itself was not fitted.
    Fill,
    /// On two axes the friction, on which contours hang, was chosen with the printed tracking errors in view.
    Contours,
    /// Nothing.
    Not,
}

impl Fitted {
    /// In words, for a head.
    pub(super) fn words(self, head: &ScanHead) -> &'static str {
        match (self, head.focus.is_some()) {
            (Fitted::Time, _) => "fitted: waits, hatch and inset come from the printed times",
            (Fitted::Tracking, true) => {
                "fitted: the pre-filter was chosen with the printed errors in view"
            }
            (Fitted::Tracking, false) => {
                "fitted: pre-filter and friction were chosen with the printed errors in view"
            }
            (Fitted::Fill, _) => "the hatch comes from the printed times; the rate was not fitted",
            (Fitted::Contours, false) => {
                "not fitted, but their friction was, to the printed tracking errors"
            }
            (Fitted::Contours, true) | (Fitted::Not, _) => "not fitted",
        }
    }
}
