//! What the judge draws on: the ground, how far it reaches, what happens from layer to layer.

use meltpath_melt_strategy::bed::{Body, Domain, Reading};
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::{Face, State};

use crate::ebm::plan::region::Below;
use crate::ebm::plan::{Plan, Window};
use crate::ebm::settings::{Judge, Settings};
use crate::job::ebm::JudgeGround;

/// A half space ends so many times `√(αt)` below and beside: what its end sends back is some 4e-4 of what arrives there.
const REACH: f64 = 2.5;

/// Where heat is remembered over many layers the half space ends here at the latest, mm: what is steady there falls with the
/// distance, and the judge tells what twice as much ground changes.
const FAR: f64 = 32.0;

/// What the region is drawn on, with `ground` from [`ground`].
pub(in crate::ebm) fn body<'a>(
    settings: &'a Settings,
    ground: &'a (dyn Fn([f64; 2]) -> State + Sync),
) -> Body<'a> {
    let start = settings.material.start;
    let judging = settings.judge.as_ref();
    Body {
        material: &settings.material,
        beam: &settings.beam,
        layer: settings.job.ebm.layer.0,
        reading: judging.map_or(Reading::LayerMean, |j| Reading::Depth(j.depth)),
        ground,
        surface: match judging.and_then(|j| j.between) {
            Some(_) => held(settings.surface, start),
            None => settings.surface,
        },
        beyond: match judging.map(|j| j.ground) {
            Some(JudgeGround::Plate) => Face::Insulated,
            _ => Face::Imposed(start),
        },
        between: judging.and_then(|j| j.between),
        kept: None,
    }
}

/// The same surface where layers follow each other: preheating gives back what the bed radiates at the start temperature, so that
/// what is hotter radiates what it does above that.
fn held(surface: Surface, start: f64) -> Surface {
    match surface {
        Surface::Insulated => surface,
        Surface::Radiating { surroundings } => Surface::Radiating {
            surroundings: surroundings.max(start),
        },
        Surface::Evaporating {
            surroundings,
            ambient,
        } => Surface::Evaporating {
            surroundings: surroundings.max(start),
            ambient,
        },
    }
}

/// How far the ground reaches that is drawn on: for the longest of the paths that are judged, or for all layers with what lies
/// between them where heat is remembered.
pub(in crate::ebm) fn domain(plan: &Plan, judging: &Judge) -> Domain {
    let material = &plan.settings.material;
    let diffusivity =
        material.conductivity(material.solidus) / material.heat_capacity(material.solidus - 1.0);
    let reach = |time: f64| (REACH * (diffusivity * time).sqrt()).max(Domain::NARROW.below);
    let time = |path: &BeamPath| path.end() - path.begin();
    let longest = plan.drawn().into_iter().map(time).fold(0.0, f64::max);
    let longest = reach(longest);
    let far = match judging.between {
        Some(between) if !plan.lower.is_empty() => {
            let layers = plan.lower.len() as f64;
            let own: f64 = plan.lower.iter().chain([&plan.path]).map(time).sum();
            let good = match &plan.window {
                Window::Good { path, .. } => (layers + 1.0) * time(path),
                Window::Fixed(_) => 0.0,
            };
            let all = own.max(good) + layers * between.time;
            reach(all).min(longest.max(FAR))
        }
        _ => longest,
    };
    match judging.ground {
        JudgeGround::HalfSpace => Domain {
            below: far,
            beside: far,
        },
        JudgeGround::Plate => Domain {
            // counted from the build plane: the judged layer lies on it, too
            below: judging.plate + (plan.lower.len() + 1) as f64 * plan.settings.job.ebm.layer.0,
            beside: far,
        },
        JudgeGround::ThesisBox => Domain::NARROW,
    }
}

/// What lies under the first layer at a place of the region.
pub(in crate::ebm) fn ground(below: &Below) -> impl Fn([f64; 2]) -> State + Sync {
    move |point| {
        if below.is_metal(point) {
            State::Dense
        } else {
            State::Powder
        }
    }
}
