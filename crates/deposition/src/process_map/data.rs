//! Process maps from their files, and those that come with the program.

use meltpath_base::settings::{Datum, Problem, Problems};
use meltpath_base::{Pure, Reporter, Speed, settings};

use super::file::{BeadsTable, MapFile, MapKind, between_keys};
use super::measured::{Measured, law};
use super::region::{Region, rows_outside};
use super::{M_PER_MIN, ProcessMap, ProcessMapError, RelativeSigma};
use crate::consumable::{Wire, lookup};

/// Region in which a map holds, m/min, with its source.
#[derive(Debug, Clone, PartialEq)]
pub struct Validity {
    /// Least and greatest wire feed, m/min.
    pub wire_feed: (f64, f64),
    /// Least and greatest travel speed, m/min.
    pub travel_speed: (f64, f64),
    /// Where this comes from.
    pub source: String,
}

impl Validity {
    pub(crate) fn contains(&self, vf: f64, vr: f64) -> bool {
        let within = |x: f64, (lo, hi): (f64, f64)| x >= lo - 1e-9 && x <= hi + 1e-9;
        within(vf, self.wire_feed) && within(vr, self.travel_speed)
    }
}

/// Tells a range of validity that goes far beyond the beads.
fn tell_beyond(file: &str, measured: Option<Region>, validity: &Validity, reporter: &Reporter) {
    let written = [validity.wire_feed, validity.travel_speed];
    let Some(region) = measured.filter(|region| region.is_exceeded(written)) else {
        return;
    };
    reporter.warn(
        "validity-beyond-beads",
        format!(
            "{file}: [validity] goes beyond the beads by more than a tenth; they were measured at {region}. What lies beyond is extrapolated, and the check range cannot say there"
        ),
        "write in [validity] what was measured, or measure beads there",
    );
}

/// By how much two feed factors of these standard uncertainties may differ, by chance and by rounding, and be of one feed: twice the
/// uncertainty of their difference and 0.005. Ours, without a source.
pub fn feeds_may_differ([a, b]: [f64; 2]) -> f64 {
    2.0 * a.hypot(b) + 0.005
}

/// The feed factor: as written, or the mean of the feeds that were measured. Where both are there they must agree, and the written one
/// is used, which is told.
fn feed_factor(map: &MapFile, file: &str, reporter: &Reporter) -> Result<Datum<Pure>, Problem> {
    let beads = map.beads.as_ref();
    let measured = beads.and_then(measured_factor);
    let Some(written) = &*map.feed_factor else {
        let missing = || {
            let problem = Problem::new("the map does not say how much wire is fed");
            problem.help("add feed_factor, wire fed over wire programmed, with its uncertainty; or beads.measured_feed")
        };
        return measured.ok_or_else(missing);
    };
    let Some(measured) = measured else {
        return Ok(written.clone());
    };
    let sigma = |factor: &Datum<Pure>| factor.uncertainty.unwrap_or(0.0);
    let most = feeds_may_differ([sigma(written), sigma(&measured)]);
    let told = format!(
        "feed_factor says {}, and the rows of beads.measured_feed {:.3} over what was set",
        written.0, measured.0
    );
    if (written.0 - measured.0).abs() > most {
        let problem = map.feed_factor.problem(format!(
            "{told}: they differ by more than their uncertainty leaves open ({most:.3})"
        ));
        return Err(problem.help(
            "take out the one that is wrong: without feed_factor it is the mean of the rows",
        ));
    }
    reporter.warn(
        "two-feed-factors",
        format!("{file}: {told}: they agree, and feed_factor is used"),
        "take one of them out",
    );
    Ok(written.clone())
}

/// The mean of the feeds that were measured over those that were set, with their scatter.
fn measured_factor(beads: &BeadsTable) -> Option<Datum<Pure>> {
    let feeds = beads.measured_feed.as_ref()?;
    let ratios = feeds
        .iter()
        .zip(beads.rows.iter())
        .map(|(fed, row)| fed / row[0]);
    let n = feeds.len() as f64;
    let mean = ratios.clone().sum::<f64>() / n;
    let squares = ratios.map(|r| (r - mean).powi(2)).sum::<f64>();
    Some(Datum {
        value: Pure(mean),
        uncertainty: Some((squares / (n - 1.0).max(1.0)).sqrt()),
        source: beads.source.value.clone(),
        page: beads.page.value.clone(),
        note: Some("mean and scatter of the feeds measured over those set".to_owned()),
    })
}

/// How well the section of a bead is known: as written, else what feed factor and wire diameter leave open.
fn sigma_of_area(map: &MapFile, factor: &Datum<Pure>, wire: &Wire) -> Result<f64, Problem> {
    if let Some(written) = &*map.relative_sigma {
        return Ok(*written.area);
    }
    let Some(feed) = factor.uncertainty else {
        let message = "nothing tells how well the section of a bead is known";
        return Err(map
            .feed_factor
            .problem(message)
            .help("give feed_factor an uncertainty, or add a table [relative_sigma]"));
    };
    let diameter = wire.diameter.uncertainty.unwrap_or(0.0) / wire.diameter.0;
    Ok((feed / factor.0).hypot(2.0 * diameter))
}

impl MapFile {
    /// Wire fed over wire programmed, where the file says it: as written, else as measured with the beads.
    pub fn fed(&self) -> Option<Datum<Pure>> {
        let measured = || self.beads.as_ref().and_then(measured_factor);
        self.feed_factor.value.clone().or_else(measured)
    }
}

impl ProcessMap {
    /// Reads a process map file, for the section of `wire`; warns through `reporter` of what is odd about measured beads and
    /// accepted.
    ///
    /// # Errors
    /// [`ProcessMapError::Content`]: everything wrong, with its place in the file.
    pub fn parse(
        file: &str,
        text: &str,
        wire: &Wire,
        reporter: &Reporter,
    ) -> Result<Self, ProcessMapError> {
        let map = settings::parse(text, |map| {
            let mut problems = between_keys(map);
            if problems.is_empty() {
                problems.extend(rows_outside(map));
            }
            problems
        })?;
        let range = |r: &[Speed; 2]| (r[0].0 / M_PER_MIN, r[1].0 / M_PER_MIN);
        let validity = Validity {
            wire_feed: range(&map.validity.wire_feed),
            travel_speed: range(&map.validity.travel_speed),
            source: format!("{}, {}", *map.validity.source, *map.validity.page),
        };
        let feed_factor = feed_factor(&map, file, reporter).map_err(Problems::from)?;
        let area = sigma_of_area(&map, &feed_factor, wire).map_err(Problems::from)?;
        let beads = Measured::of(&map, feed_factor.0, wire);
        beads.check(file, &map, (wire, area), reporter)?;
        // a law that is given by numbers is not one of its rows
        let given = map.width.is_some() && *map.kind == MapKind::PowerLaw;
        let measured = beads.region().filter(|_| !given);
        tell_beyond(file, measured, &validity, reporter);
        let (law, tried) = law(&map, &beads)?;
        let least = match &*map.relative_sigma {
            Some(written) => [*written.width, *written.height],
            None => [0.0; 2],
        };
        // a grid does not know its uncertainty at a place: what its nodes show holds everywhere
        let shown = match (&law, tried.first()) {
            (super::Law::Grid(_), Some(grid)) => grid.left_out,
            _ => [0.0; 2],
        };
        let relative_sigma = RelativeSigma {
            width: least[0].max(shown[0]),
            height: least[1].max(shown[1]),
            area,
        };
        Ok(ProcessMap {
            id: map.id.value,
            wire: map.wire.value,
            gas: map.gas.value,
            mode: map.mode.value,
            wire_section: wire.section(),
            efficiency: map.efficiency.value,
            feed_factor,
            feed_response: map.feed_response.value,
            electric: map.electric.value,
            tilt: map.tilt.value,
            validity,
            measured,
            law,
            relative_sigma,
            tried,
            assumed: map.assumed.value,
        })
    }

    /// A map that comes with the program: `WIRE-MODE-GAS`.
    ///
    /// # Errors
    /// [`ProcessMapError::Data`] listing the maps there are.
    pub fn builtin(id: &str) -> Result<Self, ProcessMapError> {
        let text = lookup("process map", id, meltpath_data::process_maps::ALL)?;
        let map = settings::parse::<MapFile>(text, |_| Vec::new())?;
        Self::parse(id, text, &Wire::builtin(&map.wire)?, &Reporter::new())
    }
}
