//! The tuning file as a person writes it: one struct a table, nothing resolved.

use std::path::PathBuf;

use meltpath_base::quantity::{NotNegative, Positive};
use meltpath_base::{Angle, Ratio, Time};
use meltpath_control::export::AntiWindup;
use serde::{Deserialize, Serialize};
use toml::Spanned;

use crate::job::TextError;

/// A tuning file, as written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TuneFile {
    /// Head: a name in `data/scan-heads`, or a TOML file of your own.
    pub head: Spanned<String>,
    /// The axes that are tuned; default X and Y.
    pub axes: Option<Spanned<Vec<AxisName>>>,
    /// Motors in place of the head's, by axis: files with the lines that `meltpath identify` prints.
    #[serde(default)]
    pub motor: Motors,
    /// `[cascade]`.
    #[serde(default)]
    pub cascade: CascadeTable,
    /// `[h-infinity]`.
    #[serde(default, rename = "h-infinity")]
    pub hinf: HinfTable,
    /// `[robust]`.
    #[serde(default)]
    pub robust: RobustTable,
    /// `[compare]`.
    #[serde(default)]
    pub compare: CompareTable,
    /// `[export]`.
    #[serde(default)]
    pub export: ExportTable,
}

/// An axis of the head.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisName {
    /// The first mirror.
    X,
    /// The second mirror.
    Y,
    /// The dynamic focus.
    Z,
}

impl AxisName {
    /// Its letter in files.
    pub fn letter(self) -> char {
        match self {
            AxisName::X => 'x',
            AxisName::Y => 'y',
            AxisName::Z => 'z',
        }
    }
}

/// `[motor]`: files of identified motors.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motors {
    /// Of X.
    pub x: Option<Spanned<PathBuf>>,
    /// Of Y.
    pub y: Option<Spanned<PathBuf>>,
    /// Of Z.
    pub z: Option<Spanned<PathBuf>>,
}

/// `[cascade]`: the step-by-step synthesis and its refinement.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CascadeTable {
    /// Times of the first maximum of the step responses of current, speed and position.
    pub first_maximum: Option<[Positive<Time>; 3]>,
    /// Phase margins of current, speed and position; default 65, 65, 75 deg.
    pub margin: Option<[Positive<Angle>; 3]>,
    /// Whether and how a swarm refines the gains; default on the simulated axis.
    pub refine: RefineTable,
}

/// `[cascade.refine]`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RefineTable {
    /// What the gains are refined for.
    pub on: RefineOn,
    /// The record (`.csv`, `.parquet`, `.mat`) of a multi-step: channels `set-point` and `angle`.
    pub record: Option<Spanned<PathBuf>>,
    /// Its mapping.
    pub mapping: Option<Spanned<PathBuf>>,
    /// How much bandwidth and stiffness feedback alone may lose on the simulated axis; default 10 %.
    pub slower: Option<NotNegative<Ratio>>,
    /// Particles; default 20.
    pub particles: Option<usize>,
    /// Moves of each; default 40.
    pub iterations: Option<usize>,
}

/// What gains are refined for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RefineOn {
    /// Least error of the simulated axis, friction and limits included, on the multi-step without pre-filter.
    #[default]
    Tracking,
    /// Least difference to a recorded angle: the model's gains become those of the real drive.
    Record,
    /// Not at all.
    Nothing,
}

/// `[h-infinity]`: three weights, by their templates, or a bandwidth.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HinfTable {
    /// Moves the thesis' weights to this bandwidth, such as `"3000 rad/s"`; default that of the position loop.
    pub bandwidth: Option<Spanned<String>>,
    /// Template of the sensitivity (W1).
    pub sensitivity: Option<Spanned<TemplateTable>>,
    /// Template from set-point to current, in A per degree (W2).
    pub command: Option<Spanned<TemplateTable>>,
    /// Template, with the first, of the response to a disturbance (W3).
    pub disturbance: Option<Spanned<TemplateTable>>,
    /// Most nearly cancelling pairs that are removed; default 1.
    pub pairs: Option<usize>,
}

/// A template: gain at rest, gain far above, and where it crosses one.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TemplateTable {
    /// Gain at rest.
    pub low: f64,
    /// Gain far above.
    pub high: f64,
    /// Where it is one, such as `"3000 rad/s"`.
    pub crossover: String,
}

/// `[robust]`: the search for a controller that serves a spread of motors.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RobustTable {
    /// How far the modes may move to either side; default 10 %, `"0 %"` for no search.
    pub mode_shift: Option<NotNegative<Ratio>>,
    /// The longest loop delay that is served; default half a sample.
    pub delay: Option<NotNegative<Time>>,
    /// Distance to the critical point kept everywhere; default 0.5.
    pub modulus_margin: Option<f64>,
    /// Largest gain of the closed loop; default 1.5.
    pub resonance: Option<f64>,
    /// States of the controller; default 5.
    pub order: Option<usize>,
    /// Particles; default 16.
    pub particles: Option<usize>,
    /// Moves of each; default 20.
    pub iterations: Option<usize>,
}

/// `[compare]`: the signal on which controllers are compared, and how far motors scatter.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CompareTable {
    /// First amplitude of the multi-step; default 90 % of the travel.
    pub amplitude: Option<Positive<Angle>>,
    /// Number of amplitudes, each half of the one before; default 10.
    pub levels: Option<u32>,
    /// Speed between steps; default `"1150 deg/s"`.
    pub slope: Option<Spanned<String>>,
    /// Time at each step; default 60 ms.
    pub hold: Option<Positive<Time>>,
    /// Scattered motors; default 40, 0 for none.
    pub draws: Option<usize>,
    /// Scatter of the resistance; default 20 %.
    pub resistance: Option<NotNegative<Ratio>>,
    /// Scatter of the inertia; default 5 %.
    pub inertia: Option<NotNegative<Ratio>>,
    /// Scatter of the modes' frequencies; default 5 %.
    pub modes: Option<NotNegative<Ratio>>,
    /// Longest additional delay; default half a sample.
    pub delay: Option<NotNegative<Time>>,
    /// Largest standard deviation of the sensor's noise; default 0.0005 deg.
    pub noise: Option<NotNegative<Angle>>,
    /// Seed; default 1.
    pub seed: Option<u64>,
}

/// Which controller leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Choice {
    /// The gains of the cascade, refined where they were.
    Cascade,
    /// The H-infinity controller of the three weights.
    HInfinity,
    /// The one found for the spread of motors.
    Robust,
}

/// In which form.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExportForm {
    /// Second-order sections.
    #[default]
    Sections,
    /// State space.
    StateSpace,
}

/// How numbers are held on the drive.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WordName {
    /// Double precision.
    Double,
    /// Single precision.
    #[default]
    Single,
    /// 32-bit integers.
    Fixed,
}

/// `[export]`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExportTable {
    /// Which controller; default the robust one where it was found, else H-infinity.
    pub controller: Option<Choice>,
    /// The form; default sections.
    pub form: ExportForm,
    /// The word; default single precision.
    pub word: WordName,
    /// Bits after the point of coefficients and of signals, for fixed words; default 22 and 22.
    pub bits: Option<[u32; 2]>,
    /// Current at which the output is cut, such as `"5 A"`; default the drive's peak current.
    pub limit: Option<Spanned<String>>,
    /// What the states do meanwhile; default they follow.
    pub anti_windup: AntiWindup,
    /// The controller acts once in so many samples of the head; default 1.
    pub every: Option<u32>,
}
/// Reads a tuning file's text.
///
/// # Errors
/// [`TextError`] with the place.
pub fn read(text: &str) -> Result<TuneFile, TextError> {
    toml::from_str(text).map_err(|e| TextError {
        span: e.span(),
        message: e.message().to_owned(),
        help: None,
    })
}
