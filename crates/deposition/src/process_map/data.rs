//! Process maps from their files, and those that come with the program.

use meltpath_base::settings::{Datum, Problem, Problems};
use meltpath_base::{Pure, Reporter, Speed, settings};

use super::file::{MapFile, between_keys};
use super::measured::{Measured, law};
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

/// The feed factor: as written, or the mean of the feeds that were measured.
fn feed_factor(map: &MapFile) -> Result<Datum<Pure>, Problem> {
    if let Some(written) = &*map.feed_factor {
        return Ok(written.clone());
    }
    let beads = map.beads.as_ref();
    let Some((beads, feeds)) = beads.and_then(|b| Some((b, b.measured_feed.as_ref()?))) else {
        let problem = Problem::new("the map does not say how much wire is fed");
        return Err(problem.help("add feed_factor, wire fed over wire programmed, with its uncertainty; or beads.measured_feed"));
    };
    let ratios = feeds
        .iter()
        .zip(beads.rows.iter())
        .map(|(fed, row)| fed / row[0]);
    let n = feeds.len() as f64;
    let mean = ratios.clone().sum::<f64>() / n;
    let squares = ratios.map(|r| (r - mean).powi(2)).sum::<f64>();
    Ok(Datum {
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
        let map = settings::parse(text, between_keys)?;
        let range = |r: &[Speed; 2]| (r[0].0 / M_PER_MIN, r[1].0 / M_PER_MIN);
        let validity = Validity {
            wire_feed: range(&map.validity.wire_feed),
            travel_speed: range(&map.validity.travel_speed),
            source: format!("{}, {}", *map.validity.source, *map.validity.page),
        };
        let feed_factor = feed_factor(&map).map_err(Problems::from)?;
        let area = sigma_of_area(&map, &feed_factor, wire).map_err(Problems::from)?;
        let beads = Measured::of(&map, feed_factor.0, wire);
        beads.check(file, &map, reporter)?;
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
