//! Where a pool of conduction ends: the laws of the material, and what its surface tension holds against the recoil of vapour.

use meltpath_base::{Fact, Measure, Reporter};
use meltpath_melt_strategy::judgement::Variant;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::criteria::{Classes, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::material::pool_limit::pool_limit;

use crate::ebm::settings::{Good, Settings};

/// What ends at a temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// The laws of the material.
    Laws,
    /// The pool's surface under the beam: vapour presses harder than the tension of a surface curved by this radius, mm, holds, Pa.
    Surface {
        /// Half the widest spot of the path.
        radius: f64,
        /// Pressure that the tension holds.
        pressure: f64,
    },
}

/// An end that a path passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    /// What ends.
    pub end: End,
    /// Where, K.
    pub kelvin: f64,
    /// The hottest place of the surface of the run that gets hottest, K, and which run that is.
    pub hottest: (f64, Variant),
    /// That of the run as set, K.
    pub as_set: f64,
    /// Share of the section whose surface is hotter than the end, the largest of these runs.
    pub share: f64,
}

/// Highest temperatures of the build plane in a run.
#[derive(Debug, Clone, Copy)]
pub(in crate::ebm) struct Surface<'a> {
    /// Which run.
    pub(in crate::ebm) variant: Variant,
    /// K.
    pub(in crate::ebm) highest: &'a Field,
}

/// What is known of the ends of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct Ends {
    /// Those that it passes, the one that comes first on top.
    pub passed: Vec<Passed>,
    /// Whether the material tells where vapour moves the pool.
    pub known: bool,
    /// The hottest place of the surface, K, in the run as set, with the largest change of the runs that show whether it is solved.
    pub hottest: [f64; 2],
}

/// The ends that `path` passes in any of the runs that show whether it is solved: as set, with twice the cell, the planes, half the step,
/// more ground. Where these disagree the path is not known to stay below. `section` tallies what is judged.
pub(in crate::ebm) fn ends(
    settings: &Settings,
    path: &BeamPath,
    surfaces: &[Surface<'_>],
    section: impl Fn(&Field, &Classes) -> Tally,
) -> Ends {
    let material = &settings.material;
    let radius = widest(std::iter::once(path));
    let pool = pool_limit(material, radius, settings.job.ebm.chamber.0);
    let surface_ends = pool.map(|limit| {
        let pressure = limit.pressure;
        (End::Surface { radius, pressure }, limit.kelvin)
    });
    let solved = surfaces.iter().filter(|s| !s.variant.is_of_power());
    let solved: Vec<(f64, &Surface<'_>)> = solved.map(|s| (s.highest.largest().0, s)).collect();
    let as_set = solved.first().map_or(f64::NAN, |(kelvin, _)| *kelvin);
    let changes = solved.iter().map(|(kelvin, s)| {
        let other = &solved[s.variant.compared().min(solved.len() - 1)];
        (kelvin - other.0).abs()
    });
    let change = changes.fold(0.0, f64::max);
    let hottest = solved.iter().max_by(|a, b| a.0.total_cmp(&b.0));
    let hottest = hottest.map_or((as_set, Variant::Base), |(kelvin, s)| (*kelvin, s.variant));
    let above = |(end, kelvin): (End, f64)| {
        let classes = Classes {
            melting: kelvin,
            window: [kelvin, f64::INFINITY],
        };
        let share = |(_, s): &(f64, &Surface<'_>)| {
            let tally = section(s.highest, &classes);
            tally.molten() as f64 / tally.voxels.max(1) as f64
        };
        Passed {
            end,
            kelvin,
            hottest,
            as_set,
            share: solved.iter().map(share).fold(0.0, f64::max),
        }
    };
    let all = [Some((End::Laws, material.range[1])), surface_ends];
    let mut passed: Vec<Passed> = all
        .into_iter()
        .flatten()
        .filter(|(_, kelvin)| hottest.0 > *kelvin)
        .map(above)
        .collect();
    passed.sort_by(|a, b| a.kelvin.total_cmp(&b.kelvin));
    Ends {
        passed,
        known: pool.is_some(),
        hottest: [as_set, change],
    }
}

/// The first end of a pool of conduction under the widest spot of some paths, K.
pub(super) fn first_end(settings: &Settings, paths: &[BeamPath]) -> f64 {
    let pool = pool_limit(
        &settings.material,
        widest(paths.iter()),
        settings.job.ebm.chamber.0,
    );
    let laws = settings.material.range[1];
    pool.map_or(laws, |limit| limit.kelvin.min(laws))
}

/// Half the widest spot of the lit beam of some paths, mm.
fn widest<'a>(paths: impl Iterator<Item = &'a BeamPath>) -> f64 {
    let points = paths.flat_map(BeamPath::points);
    let on = points.filter(|p| p.is_on());
    0.5 * on.map(|p| p.spot).fold(0.0, f64::max)
}

impl Passed {
    /// What is passed, by how much and where.
    pub fn words(&self, material: &str) -> String {
        let what = match self.end {
            End::Laws => format!("the laws of {material} end"),
            End::Surface { .. } => "a still pool ends".to_owned(),
        };
        let (hottest, variant) = self.hottest;
        let run = match variant {
            Variant::Base => String::new(),
            variant => format!(
                " with {} ({:.0} °C as set)",
                variant.words(),
                self.as_set - CELSIUS
            ),
        };
        format!(
            "the surface reaches {:.0} °C{run}, {:.0} K above {:.0} °C, where {what}; {:.1} % of the section are hotter than that",
            hottest - CELSIUS,
            hottest - self.kelvin,
            self.kelvin - CELSIUS,
            100.0 * self.share
        )
    }

    /// Where a still pool ends, and why.
    pub fn fact(&self) -> Option<Fact> {
        let End::Surface { radius, pressure } = self.end else {
            return None;
        };
        let words = format!(
            "the recoil of vapour passes there the {:.1} kPa that surface tension holds over the beam's radius of {radius:.2} mm, and heat is no longer conducted through a still pool",
            1e-3 * pressure
        );
        let place = Measure::exact(self.kelvin - CELSIUS, "°C");
        let title = "temperature of the surface at which a still pool ends";
        Some(Fact::new("pool-end", title, place, &words))
    }
}

impl Ends {
    /// How hot the build plane itself gets.
    pub fn fact(&self) -> Option<Fact> {
        let [kelvin, change] = self.hottest;
        let value = Measure::new(kelvin - CELSIUS, change, "°C");
        let words = "the build plane itself, by the heat that enters its uppermost cells; with what the runs of the judge change of it";
        kelvin
            .is_finite()
            .then(|| Fact::new("surface", "hottest place of the surface", value, words))
    }
}

/// Warns where a window lies above the end of a pool of conduction under the widest spot of `path`: whatever the path, no verdict
/// could say that it is reached.
pub(in crate::ebm) fn tell_of_window(
    settings: &Settings,
    path: &BeamPath,
    [low, high]: [f64; 2],
    reporter: &Reporter,
) {
    let radius = widest(std::iter::once(path));
    let Some(limit) = pool_limit(&settings.material, radius, settings.job.ebm.chamber.0) else {
        return;
    };
    if low >= limit.kelvin {
        reporter.warn(
            "window-beyond-pool",
            format!(
                "the window, {:.0} to {:.0} °C, lies above {:.0} °C, where vapour pushes the melt of {} aside under this beam: no path can be judged in it",
                low - CELSIUS,
                high - CELSIUS,
                limit.kelvin - CELSIUS,
                settings.material.name
            ),
            match settings.window {
                Good::Limits { .. } => "a lower window.low",
                Good::Path { .. } | Good::Body { .. } => {
                    "a good body, and the path, drawn with less current, faster, or with lines further apart"
                }
            },
        );
    }
}

/// Warns where the reference solver leaves the range of the laws: by the hottest temperature of the path that the verdict is of, K, and
/// of the path as given where that is another.
pub(in crate::ebm) fn tell(
    hottest: Option<(f64, Option<f64>)>,
    settings: &Settings,
    reporter: &Reporter,
) {
    let material = &settings.material;
    let Some((own, given)) = hottest else {
        return;
    };
    let most = own.max(given.unwrap_or(own));
    if most <= material.range[1] {
        return;
    }
    let of_given = given.map_or(String::new(), |given| {
        format!(", that of the path as given {:.0} °C", given - CELSIUS)
    });
    reporter.warn(
        "laws-extrapolated-reference",
        format!(
            "on the reference solver the hottest cell reaches {:.0} °C{of_given}; the laws of {} are meant up to {:.0} °C",
            own - CELSIUS,
            material.name,
            material.range[1] - CELSIUS
        ),
        "shares compare strategies on one scale; read no boiling or evaporation from them",
    );
}
