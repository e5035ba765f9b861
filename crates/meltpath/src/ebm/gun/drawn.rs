//! What the job's gun makes of the paths, and what the verdict says of it.

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};
use meltpath_gun::demands::{Demand, demands};
use meltpath_gun::follow::{Followed, Misplaced, follow};
use meltpath_melt_strategy::error::StrategyError;
use meltpath_thermal::beam::BeamPath;

use crate::ebm::error::EbmError;
use crate::ebm::plan::{Plan, Window};

const ID: &str = "gun";
/// Share of the heat that may be drawn where it is not asked for, or be lacking where it is.
const MISPLACED: f64 = 0.01;
const TITLE: &str = "path that the gun can draw";

/// What a gun makes of the paths of a job.
#[derive(Debug, Clone)]
pub struct AtGun {
    /// Its name.
    pub name: String,
    /// What the paths ask for in vain, with the layer (from 1) of the first place.
    pub vain: Vec<(Demand, u32)>,
    /// What nobody knows of it though the paths lean on it.
    pub unknown: Vec<&'static str>,
    /// How far the deflection is behind, s, where that is known.
    pub lag: Option<f64>,
    /// The last layer as it is drawn.
    pub drawn: Followed,
}

/// What the job's gun makes of the layers' paths, of which `last` is the last; `None` where the job names none.
pub(in crate::ebm) fn examined(plan: &Plan, last: &BeamPath) -> Option<AtGun> {
    let machine = plan.settings.gun.as_ref()?;
    let mut vain: Vec<(Demand, u32)> = Vec::new();
    let mut unknown = Vec::new();
    for (path, layer) in plan.lower.iter().chain([last]).zip(1..) {
        let found = demands(&path.motion(), machine);
        for demand in found.vain {
            match vain.iter_mut().find(|(d, _)| d.what == demand.what) {
                Some((first, _)) => first.places += demand.places,
                None => vain.push((demand, layer)),
            }
        }
        let new = found.unknown.into_iter();
        let new: Vec<_> = new.filter(|what| !unknown.contains(what)).collect();
        unknown.extend(new);
    }
    Some(AtGun {
        name: machine.name.clone(),
        vain,
        unknown,
        lag: machine.lag,
        drawn: follow(&last.motion(), machine, plan.gun.voltage),
    })
}

/// A path as the job's gun draws it; as it is where the job names none.
///
/// # Errors
/// A path that no beam draws.
pub(in crate::ebm) fn drawn(plan: &Plan, path: &BeamPath) -> Result<BeamPath, EbmError> {
    let Some(machine) = &plan.settings.gun else {
        return Ok(path.clone());
    };
    let drawn = follow(&path.motion(), machine, plan.gun.voltage);
    Ok(BeamPath::of(&[drawn.motion]).map_err(StrategyError::from)?)
}

/// The plan with every path as the gun draws it: what the solver judges.
///
/// # Errors
/// As [`drawn`].
pub(in crate::ebm) fn plan_as_drawn(plan: &Plan) -> Result<Plan, EbmError> {
    let of = |path: &BeamPath| drawn(plan, path);
    Ok(Plan {
        path: of(&plan.path)?,
        lower: plan.lower.iter().map(of).collect::<Result<_, _>>()?,
        window: match &plan.window {
            Window::Good { path, width } => Window::Good {
                path: Box::new(of(path)?),
                width: *width,
            },
            Window::Fixed(window) => Window::Fixed(*window),
        },
        ..plan.clone()
    })
}

/// What the gun would be asked for in vain, or would not draw, one line each, before anything runs.
pub(in crate::ebm) fn foretold(plan: &Plan) -> Vec<String> {
    let Some(found) = examined(plan, &plan.path) else {
        return Vec::new();
    };
    let vain = found.vain.iter();
    let mut lines: Vec<String> = vain
        .map(|(demand, layer)| {
            let remedy = demand.what.remedy();
            format!("gun: {demand}, layer {layer}; {remedy}")
        })
        .collect();
    let lost = losses(&found).into_iter();
    lines.extend(lost.map(|l| format!("gun: {}; {}", l.why, l.remedy)));
    if !found.unknown.is_empty() {
        lines.push(format!("gun: nobody knows {}", found.unknown.join(", ")));
    }
    lines
}

/// What the gun makes otherwise than the last layer's path asks for, beyond what may be.
struct Loss {
    places: usize,
    why: String,
    first: [f64; 2],
    remedy: String,
}

fn losses(found: &AtGun) -> Vec<Loss> {
    let mut all = Vec::new();
    let (unreached, first) = found.drawn.unreached;
    if let Some(first @ [x, y]) = first {
        all.push(Loss {
            places: unreached,
            why: format!(
                "the current is more than 5 % off its set value where {unreached} stretches of the last layer end, first at x {x:.2}, y {y:.2} mm"
            ),
            first,
            remedy: "longer pieces of one current, or a change that is smaller".to_owned(),
        });
    }
    all.extend(cut_short(found));
    let told = |heat: &Misplaced| {
        let share = found.drawn.share(heat);
        (share > MISPLACED).then_some((*heat, 100.0 * share, heat.first?))
    };
    if let Some((heat, share, first @ [x, y])) = told(&found.drawn.stray) {
        all.push(Loss {
            places: heat.stretches,
            why: format!(
                "{share:.1} % of the heat that lines ask for is drawn besides, in jumps and pauses, {:.3} ms of them: the beam is on there; first from x {x:.2}, y {y:.2} mm",
                1e3 * heat.time
            ),
            first,
            remedy: "a gun that blanks its beam between lines (current.between), lines that are joined at their ends (hatch.strategy), or jumps outside the part".to_owned(),
        });
    }
    if let Some((heat, share, first @ [x, y])) = told(&found.drawn.off) {
        all.push(Loss {
            places: heat.stretches,
            why: format!(
                "the current is more than 5 % off what lines ask for during {:.3} ms of them, by {share:.1} % of their heat; first from x {x:.2}, y {y:.2} mm",
                1e3 * heat.time
            ),
            first,
            remedy: "lines that begin before the part, so that the current is there in time, or currents that change less".to_owned(),
        });
    }
    all
}

/// Lines that the beam does not draw to their ends.
fn cut_short(found: &AtGun) -> Option<Loss> {
    let short = found.drawn.short;
    let first @ [x, y] = short.first?;
    let lines = if short.lines == 1 {
        "1 line".to_owned()
    } else {
        format!("{} lines", short.lines)
    };
    let half = 0.5 * short.spot;
    let slower = found.lag.map_or(String::new(), |lag| {
        format!(
            ": up to {:.0} mm/s the beam is less than that behind",
            half / lag
        )
    });
    Some(Loss {
        places: short.lines,
        why: format!(
            "where {lines} of the last layer end or turn the beam stays more than half its spot away, by {:.0} µm at most, and leaves the rest of them undrawn; first at x {x:.2}, y {y:.2} mm",
            1e3 * short.farthest
        ),
        first,
        remedy: format!("slower lines{slower}"),
    })
}

/// Whether the gun can draw the paths.
pub(in crate::ebm) fn check(found: Option<&AtGun>) -> Check {
    let Some(found) = found else {
        let why = "no gun is named (ebm.gun): the beam is taken to be where the path says, with the power it says";
        return Check::not_checked(ID, TITLE, why);
    };
    let lost = losses(found);
    let places: usize = found.vain.iter().map(|(d, _)| d.places).sum();
    let places = places + lost.iter().map(|l| l.places).sum::<usize>();
    let value = Measure::exact(places as f64, "places");
    let mut check = Check::judge(ID, TITLE, value, Limit::AtMost(0.0));
    let mut remedies: Vec<&str> = Vec::new();
    for (demand, layer) in &found.vain {
        let [x, y] = demand.at;
        check = check.because(&demand.to_string());
        check.place.get_or_insert(Place {
            position: Some([x, y, 0.0]),
            ..Place::layer(*layer)
        });
        remedies.push(demand.what.remedy());
    }
    for loss in &lost {
        let [x, y] = loss.first;
        check = check.because(&loss.why);
        check.place.get_or_insert(Place::at([x, y, 0.0]));
        remedies.push(&loss.remedy);
    }
    if !found.unknown.is_empty() {
        check.status = check.status.max(Status::CannotSay);
        check = check.because(&format!(
            "nobody knows of {}: {}",
            found.name,
            found.unknown.join(", ")
        ));
        remedies.push(
            "what your machine's log or maker tells of it in a gun file of your own (ebm.gun, meltpath schema gun)",
        );
    }
    check.remedy(remedies.join("; "))
}

/// How far the drawn path lies from the planned one.
pub(in crate::ebm) fn facts(found: Option<&AtGun>) -> Vec<Fact> {
    let Some(found) = found else {
        return Vec::new();
    };
    let drawn = &found.drawn;
    let waited = Measure::exact(drawn.waited, "s");
    let title = "time that jumps of the last layer take beyond the plan";
    let mut facts = vec![Fact::new("gun-jumps", title, waited, "")];
    for (id, title, heat) in [
        (
            "gun-stray",
            "heat drawn in jumps and pauses, of what lines ask for",
            &drawn.stray,
        ),
        (
            "gun-off",
            "heat that lines lack or have too much, of what they ask for",
            &drawn.off,
        ),
    ] {
        if heat.stretches > 0 {
            let value = Measure::exact(100.0 * drawn.share(heat), "%");
            let told = format!(
                "last layer, {:.3} ms in {} stretches",
                1e3 * heat.time,
                heat.stretches
            );
            facts.push(Fact::new(id, title, value, &told));
        }
    }
    if found.lag.is_some() {
        let (beside, [x, y]) = drawn.beside;
        let title = "farthest of the drawn beam from the line it draws";
        let value = Measure::exact(1e3 * beside, "µm");
        let fact = Fact::new("gun-beside", title, value, "last layer, beam on");
        facts.push(fact.at(Place::at([x, y, 0.0])));
        let title = "farthest of the drawn beam behind its plan";
        let value = Measure::exact(1e3 * drawn.behind, "µm");
        let fact = Fact::new("gun-behind", title, value, "last layer, beam on");
        facts.push(fact);
    }
    facts
}
