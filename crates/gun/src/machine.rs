//! What a machine's gun can do: ranges, how fast its current and its deflection follow, what its controller lets change where.

mod file;

use meltpath_base::choice;

pub use file::{GunFile, parse};

choice! {
    /// Where a machine can change the current or the speed of its beam.
    pub enum Change {
        Anywhere "anywhere" => "At any place of a line.",
        BetweenLines "between-lines" => "From one straight line to the next.",
        BetweenPasses "between-passes" => "From one stretch that is drawn without the beam going off to the next.",
    }

    /// What the beam does on its way from one stretch to the next.
    pub enum Between {
        Blanked "blanked" => "It is kept from the powder; the current goes to that of the next stretch meanwhile.",
        Ramped "ramped" => "The current is taken down, and up again where the next stretch begins.",
        On "on" => "It stays on.",
    }

    /// Whether a machine rests on points for a set time.
    pub enum Points {
        Timed "timed" => "It does.",
        No "no" => "It draws lines alone.",
    }
}

/// What a gun can do, as its file tells it. What nobody knows is `None`: it is simulated as if it were perfect, and
/// [`demands`](crate::demands::demands) says where that matters.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Name in words.
    pub name: String,
    /// Who says what no figure says itself.
    pub source: String,
    /// Least power of the beam, W.
    pub least_power: Option<f64>,
    /// Greatest power, W.
    pub greatest_power: Option<f64>,
    /// Where the current can change.
    pub current: Option<Change>,
    /// How fast the current goes at most, A/s.
    pub slew: Option<f64>,
    /// Time constant with which the current nears its set value, s.
    pub settling: Option<f64>,
    /// What the beam does between stretches.
    pub between: Option<Between>,
    /// Where the speed can change.
    pub speed: Option<Change>,
    /// How far in time the beam is behind on a straight line, s.
    pub lag: Option<f64>,
    /// Damping of the deflection: 1 and more overshoot nothing.
    pub damping: f64,
    /// Greatest speed of the beam, mm/s.
    pub greatest_speed: Option<f64>,
    /// From the order to jump until the beam is on again, s.
    pub jump: Option<f64>,
    /// Whether it rests on points.
    pub points: Option<Points>,
    /// Least time on a point, s.
    pub least_dwell: Option<f64>,
    /// How much wider than calibrated the spot is, by increasing power: W, and a factor.
    pub widening: Vec<[f64; 2]>,
}

impl Change {
    /// Whether a machine that changes a value here can change it at `place`.
    pub fn allows(self, place: Change) -> bool {
        match self {
            Change::Anywhere => true,
            Change::BetweenLines => place != Change::Anywhere,
            Change::BetweenPasses => place == Change::BetweenPasses,
        }
    }

    /// Where, in words.
    pub fn words(self) -> &'static str {
        match self {
            Change::Anywhere => "anywhere",
            Change::BetweenLines => "between straight lines",
            Change::BetweenPasses => "between stretches, the beam off",
        }
    }
}

impl Machine {
    /// How much wider than the focus calibration says the spot is at `power` W: in straight lines between what is known, beyond it as
    /// at its end; 1 where nothing is known.
    pub fn widening(&self, power: f64) -> f64 {
        let rows = &self.widening;
        let after = rows.partition_point(|[at, _]| *at <= power);
        match (after.checked_sub(1).map(|n| rows[n]), rows.get(after)) {
            (Some([a, low]), Some([b, high])) => low + (high - low) * (power - a) / (b - a),
            (Some([_, only]), None) => only,
            (None, Some([_, only])) => *only,
            (None, None) => 1.0,
        }
    }

    /// Whether anything is known of how fast the current follows.
    pub fn knows_current(&self) -> bool {
        self.slew.is_some() || self.settling.is_some()
    }
}
