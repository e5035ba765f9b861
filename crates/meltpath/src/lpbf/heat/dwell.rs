//! Whether a lit beam that stands boils what is below it.
//!
//! Laws of keyholes are those of beams that move: of one that stands and boils, how deep it digs is not said.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Reporter, Status};
use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::vector::ScanJob;

use super::RecipeHeat;
use super::beam::while_it_stands;
use super::boiling::BOILING;
use super::standing::Cause;

const REMEDY: &str = "no wait between marks (polygon_wait = \"0 ms\"), or power that follows the speed (power_down_to of the recipe); waits at some corners alone stand in the file of the layers";

const SETTLES: &str = "light that goes off before the spot stands: a shorter laser-off delay (lpbf.delays = \"tuned\"), or power that follows the speed (power_down_to of the recipe)";

/// Share of the energy from which on waits are told to bring most of it.
const MOST: f64 = 0.5;

/// Whether what is below the standing beam boils; nothing where none stands.
pub(in crate::lpbf) fn check(number: usize, recipe: &str, heat: &RecipeHeat) -> Option<Check> {
    let standing = heat.standing?;
    let id = format!("dwell-{number}");
    let title = format!("{recipe}: boiling number where the lit beam stands");
    let (how, remedy) = match standing.cause {
        Cause::Wait => ("between marks", REMEDY),
        Cause::Motion => ("as simulated", SETTLES),
    };
    let told = format!(
        "{} W stand for {} ms {how}",
        significant(standing.power, 3),
        significant(1e3 * standing.wait, 3)
    );
    let Some(boils) = standing.number else {
        let why = format!("{told}; the material's file has no boiling point");
        return Some(Check::not_checked(&id, &title, &why));
    };
    let (status, why) = match boils {
        n if n <= BOILING[0] => (Status::Pass, "the surface is far from boiling"),
        n if n <= BOILING[1] => (
            Status::Warn,
            "the surface is near boiling and vapour deepens the pool",
        ),
        _ => (
            Status::CannotSay,
            "the surface boils, and the vapour digs for as long as the beam stands: how deep, and which pore stays, is not computed",
        ),
    };
    let check = Check {
        status,
        value: Some(Measure {
            sigma: None,
            ..Measure::exact(boils, "")
        }),
        limit: Some(Limit::AtMost(BOILING[1])),
        ..Check::not_checked(&id, &title, &format!("{told}: {why}"))
    };
    let [x, y] = standing.place;
    let place = Place {
        layer: standing.layer,
        ..Place::at([x, y, 0.0])
    };
    Some(check.at(place).remedy(remedy))
}

/// Tells waits in the light that bring more energy than the marks do.
pub(in crate::lpbf) fn told(recipe: &str, (job, law): (&ScanJob, PowerLaw), reporter: &Reporter) {
    let (mut standing, mut moving) = (0.0, 0.0);
    for (i, v) in job.vectors.iter().enumerate() {
        standing += v.wait * while_it_stands(v, job.vectors.get(i + 1), law);
        if v.kind.deposits() {
            moving += v.power * job.length_of(i) / v.speed;
        }
    }
    let share = standing / (standing + moving);
    if share > MOST {
        reporter.warn(
            "waits-in-the-light",
            format!(
                "{recipe}: {:.0} % of the energy is that of waits from mark to mark, in which the lit beam stands",
                100.0 * share
            ),
            "polygon_wait of the recipe stands at every vertex of a curve, shallow ones too: none for curves of short chords",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use meltpath_scan_head::head::vector::Vector;
    use meltpath_toolpath::Role;

    fn square(wait: f64) -> ScanJob {
        let ends = [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
        let vectors = ends.map(|(x, y)| Vector {
            kind: Role::Contour,
            end: DVec3::new(x, y, 0.0),
            speed: 1000.0,
            power: 200.0,
            wait,
            block: 0,
        });
        ScanJob {
            start: DVec3::ZERO,
            vectors: vectors.to_vec(),
        }
    }

    #[test]
    fn waits_that_bring_most_of_the_energy_are_told() {
        let said = |wait: f64, law: PowerLaw| {
            let reporter = Reporter::new();
            told("own", (&square(wait), law), &reporter);
            reporter.warnings().len()
        };
        // three waits, four sides of a millisecond
        assert_eq!(said(1.5e-3, PowerLaw::Constant), 1);
        assert_eq!(said(1.0e-3, PowerLaw::Constant), 0);
        assert_eq!(said(1.5e-3, PowerLaw::WithSpeed { least: 0.0 }), 0);
    }
}
