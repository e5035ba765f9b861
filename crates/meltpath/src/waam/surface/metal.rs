//! What is judged and told of the metal of a wall on a surface: by the limits of flat layers, along the torch instead of up.
//!
//! Metal is laid in voxels of two sizes: what they differ by is part of every uncertainty.

use std::f64::consts::PI;

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};
use meltpath_deposition::workpiece::{Laid, Loose, Support};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::VoxelsError;
use meltpath_planning::surface::{Torch, TorchRule, axes_along};

use super::grow::{Grown, Metal, outcomes, tube_place};
use super::plan::{Ground, SurfacePlan};
use super::{Asked, Shape, onto};
use crate::job::waam::{SurfaceSpeeds, SurfaceStrategyChoice};
use crate::waam::deposit::tube;
use crate::waam::judge::checks::planned;
use crate::waam::judge::doubt::{self, AHEAD, ASIDE, Doubt};
use crate::waam::judge::{TubePlace, layer_checks};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// A bead may hang free over this share of its width.
const FREE: f64 = 0.5;

/// The checks of the metal.
pub(super) fn checks(
    grown: &Result<Grown, VoxelsError>,
    plan: &SurfacePlan,
    commands: &Commands,
    settings: &Settings,
) -> Vec<Check> {
    let grown = match grown {
        Ok(grown) => grown,
        Err(why) => return vec![without_room(why)],
    };
    let of = |metal: &Metal| -> Result<Vec<Check>, VoxelsError> {
        let laid = &metal.laid;
        let growth = settings.growth_error(plan.single());
        let layers = outcomes(metal, commands, settings, plan);
        let ctwd: Vec<TubePlace> = laid.path.iter().map(|p| tube_place(p, commands)).collect();
        let mut checks = layer_checks(&layers, &growth, &settings.limits, &settings.remedies);
        checks.extend(tube::checks(&layers, &ctwd, &growth, settings));
        checks.push(loose(laid, commands, FREE * settings.bead.width.value));
        if let Ground::Body(pieces) = &plan.ground {
            checks.extend(onto::part_checks(&laid.voxels, pieces, &growth, settings)?);
        }
        Ok(checks)
    };
    let (fine, coarse) = match (of(&grown.fine), of(&grown.coarse)) {
        (Ok(fine), Ok(coarse)) => (fine, coarse),
        (Err(why), _) | (_, Err(why)) => return vec![without_room(&why)],
    };
    let fine = fine.into_iter();
    let mut checks: Vec<Check> = fine
        .map(|check| converged(check, &coarse, (&plan.ground, settings)))
        .collect();
    doubt::undecided(&mut checks, &doubts(grown, plan, settings));
    checks
}

/// Metal that would not fit in memory.
fn without_room(why: &VoxelsError) -> Check {
    let title = "metal along the surface: contact tube distance, height, what hangs";
    let check = Check {
        status: Status::CannotSay,
        ..Check::not_checked("metal", title, &why.to_string())
    };
    check.remedy(
        "lay fewer passes (layers.count), or a part of the surface at a time (surface.faces)",
    )
}

/// The longest stretch of bead with no metal under it, or none under a quarter of its width.
fn loose(laid: &Laid, commands: &Commands, limit: f64) -> Check {
    const TITLE: &str = "metal that hangs free: longest stretch of bead with no metal under it";
    let longest = |a: &&Loose, b: &&Loose| a.length.total_cmp(&b.length);
    let found = laid.loose.iter().max_by(longest);
    let length = found.map_or(0.0, |l| l.length);
    let check = Check::judge(
        "loose",
        TITLE,
        Measure::exact(length, "mm"),
        Limit::AtMost(limit),
    );
    let Some(found) = found else { return check };
    let all: f64 = laid.loose.iter().map(|l| l.length).sum();
    let what = match found.support {
        Support::None => "no metal within reach of the arc",
        Support::Partial | Support::Metal => "none under a quarter of its width",
    };
    let at = |v: &[u32]| v.get(found.command as usize).copied();
    let bead = commands.bead_of_command.get(found.command as usize);
    check
        .because(&format!("{what}; {all:.1} mm in all"))
        .at(Place {
            layer: at(&commands.layer_of_command),
            bead: bead.copied().flatten(),
            ..Place::at(found.position.to_array())
        })
}

/// What the finer voxels say; what the coarser ones differ by is part of its uncertainty.
fn converged(fine: Check, coarse: &[Check], (ground, settings): (&Ground, &Settings)) -> Check {
    let advice = match ground {
        Ground::Base(_) => remedy(&fine.id, settings.surface.as_ref()),
        Ground::Body(_) => onto::remedy(&fine.id, settings.surface.as_ref()).to_owned(),
    };
    let other = coarse.iter().find(|c| c.id == fine.id);
    let other = other.and_then(|c| c.value.as_ref());
    let (Some(value), Some(limit)) = (&fine.value, fine.limit) else {
        return fine.remedy(advice);
    };
    // what only the finer ones tell has not been tried on others
    let apart = other.map_or(f64::INFINITY, |o| (o.value - value.value).abs());
    let sigma = value.sigma.unwrap_or(0.0).hypot(apart);
    let measure = Measure::new(value.value, sigma, &value.unit);
    let judged = Check::judge(&fine.id, &fine.title, measure, limit);
    let status = match fine.status {
        Status::CannotSay => Status::CannotSay,
        _ => judged.status,
    };
    let check = Check {
        value: judged.value,
        status,
        ..fine
    };
    let check = if judged.reason.is_empty() || check.reason.contains(&judged.reason) {
        check
    } else {
        check.because(&judged.reason)
    };
    check.remedy(advice)
}

/// What mends a check of the metal: of all that would, what the job does not do already.
fn remedy(id: &str, asked: Option<&Asked>) -> String {
    const CORRECTED: &str = "the height corrected at the machine every few passes";
    let uneven = |asked: &Asked| match &asked.shape {
        Shape::Wall(wall) => {
            wall.strategy != SurfaceStrategyChoice::Distance
                && wall.speeds == SurfaceSpeeds::Constant
        }
        Shape::Onto(_) => true,
    };
    let height = asked.is_none_or(|asked| !asked.grows);
    let height = height.then_some("layers.height = \"auto\"");
    let follows = asked.is_some_and(
        |asked| matches!(&asked.shape, Shape::Wall(wall) if wall.speeds == SurfaceSpeeds::Adapted),
    );
    let height = if follows {
        Some("surface.grows of what a pass of this wall grows")
    } else {
        height
    };
    let even = asked.is_none_or(uneven);
    let even = even.then_some("surface.strategy = \"distance\", whose passes lie evenly");
    let tangent = asked.is_none_or(|asked| asked.torch != TorchRule::Tangent);
    let tangent = tangent.then_some("surface.torch = \"tangent\"");
    let all = match id {
        "height" => [height, Some(CORRECTED), None],
        "flatness" => {
            let longer = "an open wall longer than the part, whose ends are cut off";
            [even, Some(longer), Some(CORRECTED)]
        }
        "accumulation" => {
            let smoother = "more machine.smoothing where the torch waits at corners";
            [Some(smoother), None, None]
        }
        "loose" => {
            let lower = "a smaller layers.height, or the bead begun on metal";
            [tangent, Some(lower), None]
        }
        "ctwd-known" => {
            let known =
                "the wire feed measured at that distance, in [feed_response] of the process map";
            [height, even, Some(known)]
        }
        _ => {
            let farther = "a machine.ctwd farther from the limit";
            [height, even, Some(farther)]
        }
    };
    all.into_iter().flatten().collect::<Vec<_>>().join("; or ")
}

/// What keeps the metal from being decided about.
fn doubts(grown: &Grown, plan: &SurfacePlan, settings: &Settings) -> Vec<Doubt> {
    let speeds = || doubt::of_speeds(planned(&plan.toolpath).map(|s| s.speed), settings);
    let corners = doubt::of_corners(settings.judged(), settings).or_else(speeds);
    let room = (grown.fine.laid.beside > 0.0 || grown.coarse.laid.beside > 0.0).then(|| Doubt {
        reason: format!(
            "{:.1} mm³ of metal found no room in memory",
            grown.fine.laid.beside.max(grown.coarse.laid.beside)
        ),
        remedy:
            "lay fewer passes (layers.count), or a part of the surface at a time (surface.faces)"
                .to_owned(),
    });
    lean(plan)
        .into_iter()
        .chain(room)
        .chain(corners)
        .chain(doubt::of_standing(settings))
        .collect()
}

/// A torch that leans from the wall by more than any bead was tried at.
fn lean(plan: &SurfacePlan) -> Option<Doubt> {
    let angle = |a: DVec3, b: DVec3| a.dot(b).abs().clamp(0.0, 1.0).asin();
    // (how far over what was tried, aside, ahead, pass, place)
    let mut worst: Option<(f64, f64, f64, u32, DVec3)> = None;
    let axes = axes_along(&plan.passes, &plan.torch);
    for (pass, axes) in plan.passes.iter().zip(axes) {
        for (point, axis) in pass.points.iter().zip(axes) {
            let aside = angle(axis, point.normal);
            let ahead = angle(axis, point.normal.cross(point.growth));
            let over = (aside / ASIDE).max(ahead / AHEAD);
            if worst.is_none_or(|w| over > w.0) {
                worst = Some((over, aside, ahead, pass.number, point.position));
            }
        }
    }
    let (_, aside, ahead, number, at) = worst.filter(|w| w.0 > 1.0)?;
    Some(Doubt {
        reason: format!(
            "the torch leans from the wall by {:.1} deg aside and {:.1} deg along the pass (pass {number}, at {:.1}, {:.1}, {:.1} mm): beads were tried up to {:.0} and {:.0} deg",
            aside.to_degrees(),
            ahead.to_degrees(),
            at.x,
            at.y,
            at.z,
            ASIDE.to_degrees(),
            AHEAD.to_degrees()
        ),
        remedy: against_lean(&plan.torch).to_owned(),
    })
}

/// What to do about a torch that leans from the wall.
fn against_lean(torch: &Torch) -> &'static str {
    let free = torch.rule == TorchRule::Tangent && torch.greatest_tilt >= PI && torch.lead == 0.0;
    if free {
        // it stands along the wall: what leans is the pass, as at an end that cuts it off aslant
        "the wall grows aslant of its pass there: another surface.base, or a surface whose ends follow its growth; or build and measure a short piece"
    } else {
        "surface.torch = \"tangent\" without surface.tilt, and a smaller surface.lead, so that the torch stands along the wall; or build and measure a short piece"
    }
}

/// What the metal tells without a limit.
pub(super) fn facts(
    grown: &Grown,
    plan: &SurfacePlan,
    commands: &Commands,
    settings: &Settings,
) -> Vec<Fact> {
    let metal = &grown.fine;
    let laid = &metal.laid;
    let held = laid.voxels.volume() - grown.ground;
    let words = format!(
        "voxels of {:.2} mm hold {held:.1} of {:.1} mm³ fed; {:.1} mm³ lie over places without metal within reach",
        grown.cell, laid.volume, laid.loose_volume
    );
    let balance = Fact::new(
        "metal",
        "metal laid along the torch",
        Measure::exact(1e-3 * laid.volume, "cm³"),
        &words,
    );
    let layers = outcomes(metal, commands, settings, plan);
    let distances = laid.path.iter().map(|p| p.ctwd).collect();
    let tube = tube::distribution(&layers, distances);
    std::iter::once(balance).chain(tube).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::waam::SurfacePasses;
    use crate::waam::surface::{BaseAsked, WallAsked};

    /// What a job does already would mend nothing.
    #[test]
    fn no_remedy_is_what_the_job_says_already() {
        let asked = |grows: bool, strategy: SurfaceStrategyChoice, torch: TorchRule| Asked {
            shape: Shape::Wall(WallAsked {
                faces: None,
                base: BaseAsked {
                    origin: None,
                    direction: None,
                    radius: None,
                    profile: None,
                },
                strategy,
                passes: SurfacePasses::Each,
                speeds: SurfaceSpeeds::Constant,
                grows: 1.2,
                field: None,
            }),
            spacing: 1.2,
            grows,
            torch,
            tilt: None,
            lead: 0.0,
            spacing_limit: 0.1,
        };
        let poor = asked(false, SurfaceStrategyChoice::Planes, TorchRule::Fixed);
        let best = asked(true, SurfaceStrategyChoice::Distance, TorchRule::Tangent);
        for (id, word) in [
            ("height", "layers.height = \"auto\""),
            ("flatness", "surface.strategy"),
            ("loose", "surface.torch"),
            ("ctwd-max", "layers.height"),
            ("ctwd-known", "surface.strategy"),
        ] {
            assert!(remedy(id, Some(&poor)).contains(word), "{id}");
            let left = remedy(id, Some(&best));
            assert!(!left.contains(word) && !left.is_empty(), "{id}: {left}");
        }
    }
}
