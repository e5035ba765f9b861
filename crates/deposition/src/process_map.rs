//! From settings to the size of the bead and back ("abaque" in the source): one map per wire, gas and mode.
//! Source: Rouchon 2022, §2.1.2, §2.3; the seed law, the inverse and its ranking are ours.
//!
//! Speeds are mm/s, lengths mm; files and laws are in m/min, as people write and fit them.

mod data;
mod file;
mod grid;
mod import;
mod inverse;
mod kriging;
mod measured;
mod region;

pub use data::{Validity, feeds_may_differ};
pub use file::{MapFile, MapKind, TiltTable};
pub use grid::{Grid, GridPart};
pub use import::Oddity;
pub use inverse::Target;
pub use kriging::Fit;
pub use region::Region;

use meltpath_base::settings::{Datum, Problems};
use meltpath_base::{Origin, Pure, Reporter, Resolved};
use serde::Serialize;

use crate::consumable::DataError;
use crate::electric::lines::MeasuredLines;
use crate::feed_response::{FeedResponse, MeasuredResponse};
use crate::section::Section;

/// mm/s in one m/min.
pub(crate) const M_PER_MIN: f64 = 1000.0 / 60.0;

/// A value with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// One standard deviation.
    pub sigma: f64,
}

impl Estimate {
    fn relative(value: f64, relative: f64) -> Self {
        Estimate {
            value,
            sigma: relative * value.abs(),
        }
    }

    /// As a resolved parameter of origin `origin`.
    pub fn resolved(self, origin: Origin) -> Resolved<f64> {
        Resolved::new(self.value, origin).with_sigma(self.sigma)
    }
}

/// A single bead on a plate as a map predicts it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bead {
    /// Programmed wire feed, mm/s.
    pub wire_feed: f64,
    /// Travel speed, mm/s.
    pub travel_speed: f64,
    /// Width, mm.
    pub width: Estimate,
    /// Height, mm.
    pub height: Estimate,
    /// Section, mm²: by conservation of the metal fed.
    pub area: Estimate,
    /// Whether the settings lie in the map's region of validity.
    pub valid: bool,
}

impl Bead {
    /// The bead as the deposit takes it, with the width law of the map around it.
    pub fn model(&self, map: &ProcessMap) -> crate::bead::BeadModel {
        crate::bead::BeadModel {
            width: self.width.value,
            area: self.area.value,
            wire_section: map.wire_section,
            efficiency: map.efficiency.0,
            width_exponent: map.width_exponent(self.wire_feed, self.travel_speed),
            feed_exponent: map.feed_exponent(self.wire_feed, self.travel_speed),
        }
    }
}

/// Law of a map.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// w = c·V_f^p·V_r^q in m/min and mm, section by conservation, height of the parabola.
    PowerLaw {
        /// c, mm.
        coefficient: f64,
        /// p.
        feed_exponent: f64,
        /// q.
        travel_exponent: f64,
    },
    /// Width and height measured on a grid of settings, bilinear between its nodes.
    Grid(Grid),
    /// Width and height by laws of one form through measured beads.
    Fitted(Box<Fitted>),
}

/// Laws of one form through measured beads.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Of the width, mm.
    pub width: Fit,
    /// Of the height, mm.
    pub height: Fit,
}

/// A law that was tried on measured beads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    /// Its form, in words.
    pub form: &'static str,
    /// Root mean square of the relative errors of beads left out: width and height.
    pub left_out: [f64; 2],
}

/// Relative standard uncertainties of what a map predicts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeSigma {
    /// Of the width.
    pub width: f64,
    /// Of the height.
    pub height: f64,
    /// Of the area.
    pub area: f64,
}

/// Settings to bead size for one wire, gas and mode.
#[derive(Debug, Clone, PartialEq)]
pub struct ProcessMap {
    /// Identifier.
    pub id: String,
    /// Wire it was made with.
    pub wire: String,
    /// Gas it was made with.
    pub gas: String,
    /// Transfer mode it was made with.
    pub mode: String,
    /// Section of that wire, mm².
    pub wire_section: f64,
    /// Share of the wire that ends in the bead.
    pub efficiency: Datum<Pure>,
    /// Wire really fed over wire programmed, k_f.
    pub feed_factor: Datum<Pure>,
    /// What the source feeds at other contact tube distances, where it was measured.
    pub feed_response: Option<MeasuredResponse>,
    /// Voltage, current and wire feed over the contact tube distance, where they were measured.
    pub electric: Option<MeasuredLines>,
    /// How far leaning pools were seen to stay.
    pub tilt: Option<TiltTable>,
    /// Where the map holds, as its file says.
    pub validity: Validity,
    /// Where its beads were measured; nothing where it is given by numbers alone.
    pub measured: Option<Region>,
    /// The law.
    pub law: Law,
    /// How well it predicts; at least, where the law knows more.
    pub relative_sigma: RelativeSigma,
    /// The laws that were tried on measured beads, the one that was taken first.
    pub tried: Vec<Tried>,
    /// What its source does not tell and was assumed.
    pub assumed: Vec<String>,
}

/// Why a map cannot answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProcessMapError {
    /// The map itself cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// What is written in its file is wrong.
    #[error(transparent)]
    Content(#[from] Problems),
    /// Not two of the four values, nor the height alone.
    #[error(
        "a bead is set by two of wire_feed, travel_speed, width and height, or by the height alone; given: {given}"
    )]
    Underspecified {
        /// What was given.
        given: String,
    },
    /// A value that makes no sense.
    #[error("{what} {value} is not a positive finite number")]
    Value {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// No settings within the map give this bead.
    #[error(
        "the map \"{map}\" cannot make a bead of {asked}: it makes widths of {:.2} to {:.2} mm and heights of {:.2} to {:.2} mm{}; \
         closest: {:.2} m/min wire feed at {:.3} m/min travel gives {:.2} x {:.2} mm",
        width.0, width.1, height.0, height.1,
        if *with_the_value_given { " with the value given" } else { "" },
        closest.wire_feed / M_PER_MIN, closest.travel_speed / M_PER_MIN, closest.width.value, closest.height.value
    )]
    Unreachable {
        /// Which map.
        map: String,
        /// What was asked.
        asked: String,
        /// The nearest bead that the map makes.
        closest: Box<Bead>,
        /// Least and greatest width, mm.
        width: (f64, f64),
        /// Least and greatest height, mm.
        height: (f64, f64),
        /// Whether these are the limits with one of the settings held as asked.
        with_the_value_given: bool,
    },
}

impl ProcessMap {
    /// The bead at programmed wire feed and travel speed, mm/s.
    ///
    /// ```
    /// use meltpath_deposition::process_map::ProcessMap;
    /// let map = ProcessMap::builtin("x90-ig-1.0-cmt-m14").unwrap();
    /// let bead = map.bead(8000.0 / 60.0, 12.5);
    /// assert!((bead.width.value - 6.54).abs() < 0.02);
    /// assert!((bead.area.value - 9.63).abs() < 0.01 && bead.valid);
    /// ```
    pub fn bead(&self, wire_feed: f64, travel_speed: f64) -> Bead {
        let (vf, vr) = (wire_feed / M_PER_MIN, travel_speed / M_PER_MIN);
        let (width, height) = self.sizes(vf, vr);
        let least = &self.relative_sigma;
        let sigma = |least: f64, fit: fn(&Fitted) -> &Fit| match &self.law {
            Law::Fitted(fitted) => fit(fitted).relative_sigma(vf, vr).max(least),
            Law::PowerLaw { .. } | Law::Grid(_) => least,
        };
        Bead {
            wire_feed,
            travel_speed,
            width: Estimate::relative(width, sigma(least.width, |f| &f.width)),
            height: Estimate::relative(height, sigma(least.height, |f| &f.height)),
            area: Estimate::relative(self.area(vf, vr), least.area),
            valid: self.covers(wire_feed, travel_speed),
        }
    }

    /// Metal per length at settings in m/min, mm².
    fn area(&self, vf: f64, vr: f64) -> f64 {
        self.efficiency.0 * self.feed_factor.0 * self.wire_section * vf / vr
    }

    /// Width and height by the law, mm, at settings in m/min.
    fn sizes(&self, vf: f64, vr: f64) -> (f64, f64) {
        match &self.law {
            Law::PowerLaw {
                coefficient,
                feed_exponent,
                travel_exponent,
            } => {
                let width = coefficient * vf.powf(*feed_exponent) * vr.powf(*travel_exponent);
                (width, Section::Parabola.height(width, self.area(vf, vr)))
            }
            Law::Grid(grid) => grid.at(vf, vr),
            Law::Fitted(fitted) => (fitted.width.at(vf, vr), fitted.height.at(vf, vr)),
        }
    }

    /// The same map where the source feeds `factor` times the programmed wire, as measured on one's own build.
    ///
    /// Under a power law beads are as wide as those of the programmed feed at which the map's source fed as much; sizes in
    /// a table were measured and stay. What the feed factor added to the uncertainty of area and height is taken out.
    #[must_use]
    pub fn with_feed_factor(mut self, factor: f64) -> Self {
        let more = factor / self.feed_factor.0;
        if let Law::PowerLaw {
            coefficient,
            feed_exponent,
            ..
        } = &mut self.law
        {
            *coefficient *= more.powf(*feed_exponent);
        }
        if let Some(uncertainty) = self.feed_factor.uncertainty {
            let part = uncertainty / self.feed_factor.0;
            let rest = |sigma: f64| (sigma * sigma - part * part).max(0.0).sqrt();
            self.relative_sigma.area = rest(self.relative_sigma.area);
            self.relative_sigma.height = rest(self.relative_sigma.height);
        }
        self.feed_factor = Datum {
            value: Pure(factor),
            uncertainty: None,
            source: "measured on the installation".to_owned(),
            page: "-".to_owned(),
            note: None,
        };
        self
    }

    /// What the source feeds at other contact tube distances, around a programmed wire feed (mm/s) and with the
    /// penetration stabiliser at `stabiliser` (mm/s; `None`: as measured). `None` where it was not measured.
    pub fn response(&self, wire_feed: f64, stabiliser: Option<f64>) -> Option<FeedResponse> {
        let measured = self.feed_response.as_ref()?;
        let programmed = wire_feed / M_PER_MIN;
        let band = stabiliser.map_or(measured.stabiliser.0, |s| s / M_PER_MIN);
        Some(measured.at(programmed, self.feed_factor.0 * programmed, band))
    }

    /// The greatest angle between torch and vertical, rad, at which a pool of a bead of `area` mm² stays: the greatest at which one as large or
    /// larger was seen to. `None` where none was.
    pub fn greatest_tilt(&self, area: f64) -> Option<f64> {
        let rows = self.tilt.as_ref()?.rows.iter();
        let stayed = rows.filter(|[section, _]| *section >= area).map(|r| r[1]);
        stayed.reduce(f64::max).map(f64::to_radians)
    }

    /// Whether beads at a wire feed and a travel speed, mm/s, lie where the map holds and was measured.
    pub fn covers(&self, wire_feed: f64, travel_speed: f64) -> bool {
        let (vf, vr) = (wire_feed / M_PER_MIN, travel_speed / M_PER_MIN);
        let measured = self.measured.is_none_or(|region| region.contains(vf, vr));
        measured && self.holds(vf, vr)
    }

    /// Where the map holds at the most, in words: by its file, or by its beads where settings, mm/s, lie within what the file says.
    pub fn reach_around(&self, wire_feed: f64, travel_speed: f64) -> String {
        let v = &self.validity;
        let said = v.contains(wire_feed / M_PER_MIN, travel_speed / M_PER_MIN);
        match self.measured.filter(|_| said) {
            Some(region) => format!(
                "the beads of the map {} were measured at {region}: the rest of its range is extrapolated",
                self.id
            ),
            None => format!(
                "the map {} holds from {:.2} to {:.2} m/min wire feed and from {:.2} to {:.2} m/min travel",
                self.id, v.wire_feed.0, v.wire_feed.1, v.travel_speed.0, v.travel_speed.1
            ),
        }
    }

    /// Whether settings (m/min) lie where the map holds.
    fn holds(&self, vf: f64, vr: f64) -> bool {
        let in_law = match &self.law {
            Law::Grid(grid) => grid.covers(vf, vr),
            Law::PowerLaw { .. } | Law::Fitted(_) => true,
        };
        in_law && self.validity.contains(vf, vr)
    }

    /// Warns where a bead lies outside the map's validity, or where its metal does not balance.
    pub fn warn_about(&self, bead: &Bead, reporter: &Reporter) {
        let (vf, vr) = (bead.wire_feed / M_PER_MIN, bead.travel_speed / M_PER_MIN);
        if !bead.valid {
            reporter.warn(
                "outside-process-map",
                format!(
                    "{vf:.2} m/min wire feed at {vr:.3} m/min travel lies outside the map: the bead size is extrapolated; {}",
                    self.reach_around(bead.wire_feed, bead.travel_speed)
                ),
                "choose settings inside the map, or measure beads there and extend it",
            );
        }
        let section = Section::Parabola.area(bead.width.value, bead.height.value);
        let off = section / bead.area.value - 1.0;
        if off.abs() > 0.15 {
            reporter.warn(
                "bead-mass-balance",
                format!(
                    "the map's section (2/3 w h = {section:.2} mm²) and the metal fed ({:.2} mm²) differ by {:.0} %",
                    bead.area.value,
                    100.0 * off
                ),
                "check the wire diameter and the feed factor of the map",
            );
        }
    }

    /// Exponent of the width against feed per length at constant wire feed: −∂ln w/∂ln V_r.
    pub fn width_exponent(&self, wire_feed: f64, travel_speed: f64) -> f64 {
        if let Law::PowerLaw {
            travel_exponent, ..
        } = &self.law
        {
            return -travel_exponent;
        }
        (-self.width_slope(|f| (wire_feed, travel_speed * f))).clamp(0.0, 1.0)
    }

    /// Exponent of the width against the wire feed at constant travel speed: ∂ln w/∂ln V_f.
    pub fn feed_exponent(&self, wire_feed: f64, travel_speed: f64) -> f64 {
        if let Law::PowerLaw { feed_exponent, .. } = &self.law {
            return *feed_exponent;
        }
        self.width_slope(|f| (wire_feed * f, travel_speed))
            .clamp(0.0, 1.0)
    }

    /// Logarithmic slope of the width along a line of settings; 0 outside a table, where there is none: the width stays.
    fn width_slope(&self, settings: impl Fn(f64) -> (f64, f64)) -> f64 {
        let step = 0.02f64;
        let width = |f: f64| {
            let (wire_feed, travel_speed) = settings(f);
            self.sizes(wire_feed / M_PER_MIN, travel_speed / M_PER_MIN)
                .0
        };
        let slope = (width(step.exp()) / width((-step).exp())).ln() / (2.0 * step);
        if slope.is_finite() { slope } else { 0.0 }
    }

    /// Data of the map, as an origin for resolved values.
    pub fn origin(&self) -> Origin {
        Origin::Data(format!("process map {}", self.id))
    }
}
