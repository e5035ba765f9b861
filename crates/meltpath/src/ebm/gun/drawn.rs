//! What the job's gun makes of the paths, and what the verdict says of it.

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};
use meltpath_gun::demands::{Demand, demands};
use meltpath_gun::follow::{Followed, Misplaced, follow};
use meltpath_melt_strategy::error::StrategyError;
use meltpath_thermal::beam::BeamPath;
use meltpath_toolpath::MotionBlock;

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
    /// The layers as they are drawn, the lowest first; only the last one with its path.
    pub drawn: Vec<Followed>,
}

impl AtGun {
    /// The layers with their numbers, from 1.
    fn layers(&self) -> impl Iterator<Item = (u32, &Followed)> {
        (1..).zip(&self.drawn)
    }

    /// The layer of which something is the most.
    fn worst(&self, of: impl Fn(&Followed) -> f64) -> Option<(u32, &Followed)> {
        // of equals the first
        let layers = self.layers().collect::<Vec<_>>().into_iter().rev();
        layers.max_by(|a, b| of(a.1).total_cmp(&of(b.1)))
    }

    /// A layer in words.
    fn named(&self, layer: u32) -> String {
        match self.drawn.len() {
            1 => "the layer".to_owned(),
            all => format!("layer {layer} (the worst of {all})"),
        }
    }
}

/// What the job's gun makes of the layers' paths, of which `last` is the last; `None` where the job names none.
pub(in crate::ebm) fn examined(plan: &Plan, last: &BeamPath) -> Option<AtGun> {
    let machine = plan.settings.gun.as_ref()?;
    let mut vain: Vec<(Demand, u32)> = Vec::new();
    let (mut unknown, mut drawn) = (Vec::new(), Vec::new());
    for (path, layer) in plan.lower.iter().chain([last]).zip(1..) {
        let motion = path.motion();
        let found = demands(&motion, machine);
        drawn.push(follow(&motion, machine, plan.gun.voltage));
        // of the layers below figures are enough
        if let [.., before, _] = drawn.as_mut_slice() {
            before.motion = MotionBlock::default();
        }
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
        drawn,
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

/// What the gun makes otherwise than the layers' paths ask for, beyond what may be: told of the worst layer.
struct Loss {
    layer: u32,
    /// In all layers.
    places: usize,
    why: String,
    first: [f64; 2],
    remedy: String,
}

fn losses(found: &AtGun) -> Vec<Loss> {
    let mut all = Vec::new();
    let unreached = found.worst(|drawn| drawn.unreached.0 as f64);
    if let Some((layer, drawn)) = unreached
        && let (stretches, Some(first @ [x, y])) = drawn.unreached
    {
        all.push(Loss {
            layer,
            places: found.drawn.iter().map(|d| d.unreached.0).sum(),
            why: format!(
                "the current is more than 5 % off its set value where {stretches} stretches of {} end, first at x {x:.2}, y {y:.2} mm",
                found.named(layer)
            ),
            first,
            remedy: "longer pieces of one current, or a change that is smaller".to_owned(),
        });
    }
    all.extend(cut_short(found));
    if let Some((layer, heat, share, first @ [x, y])) = misplaced(found, |drawn| &drawn.stray) {
        all.push(Loss {
            layer,
            places: heat.stretches,
            why: format!(
                "{share:.1} % of the heat that lines of {} ask for is drawn besides, in jumps and pauses, {:.3} ms of them: the beam is on there; first from x {x:.2}, y {y:.2} mm",
                found.named(layer),
                1e3 * heat.time
            ),
            first,
            remedy: "a gun that blanks its beam between lines (current.between), lines that are joined at their ends (hatch.strategy), or jumps outside the part".to_owned(),
        });
    }
    if let Some((layer, heat, share, first @ [x, y])) = misplaced(found, |drawn| &drawn.off) {
        all.push(Loss {
            layer,
            places: heat.stretches,
            why: format!(
                "the current is more than 5 % off what lines of {} ask for during {:.3} ms of them, by {share:.1} % of their heat; first from x {x:.2}, y {y:.2} mm",
                found.named(layer),
                1e3 * heat.time
            ),
            first,
            remedy: "lines that begin before the part, so that the current is there in time, or currents that change less".to_owned(),
        });
    }
    all
}

/// Heat that is not where it is asked for, in the layer of which it is the greatest share, where that is beyond what may be: its share in
/// %, where the first of it is, and its places in all layers beyond that.
fn misplaced(
    found: &AtGun,
    of: fn(&Followed) -> &Misplaced,
) -> Option<(u32, Misplaced, f64, [f64; 2])> {
    let share = |drawn: &Followed| drawn.share(of(drawn));
    let (layer, worst) = found.worst(share)?;
    let beyond = found.drawn.iter().filter(|d| share(d) > MISPLACED);
    let stretches: usize = beyond.map(|drawn| of(drawn).stretches).sum();
    let heat = Misplaced {
        stretches,
        ..*of(worst)
    };
    (share(worst) > MISPLACED).then_some((layer, heat, 100.0 * share(worst), heat.first?))
}

/// Lines that the beam does not draw to their ends.
fn cut_short(found: &AtGun) -> Option<Loss> {
    let (layer, drawn) = found.worst(|drawn| drawn.short.lines as f64)?;
    let short = drawn.short;
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
        layer,
        places: found.drawn.iter().map(|d| d.short.lines).sum(),
        why: format!(
            "where {lines} of {} end or turn the beam stays more than half its spot away, by {:.0} µm at most, and leaves the rest of them undrawn; first at x {x:.2}, y {y:.2} mm",
            found.named(layer),
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
        check.place.get_or_insert(Place {
            position: Some([x, y, 0.0]),
            ..Place::layer(loss.layer)
        });
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
    let Some(last) = found.drawn.last() else {
        return Vec::new();
    };
    let waited = Measure::exact(last.waited, "s");
    let title = "time that jumps of the last layer take beyond the plan";
    let mut facts = vec![Fact::new("gun-jumps", title, waited, "")];
    let of: [fn(&Followed) -> &Misplaced; 2] = [|drawn| &drawn.stray, |drawn| &drawn.off];
    for (id, title, of) in [
        (
            "gun-stray",
            "heat drawn in jumps and pauses, of what lines ask for",
            of[0],
        ),
        (
            "gun-off",
            "heat that lines lack or have too much, of what they ask for",
            of[1],
        ),
    ] {
        let worst = found.worst(|drawn| drawn.share(of(drawn)));
        if let Some((layer, drawn)) = worst.filter(|(_, drawn)| of(drawn).stretches > 0) {
            let heat = of(drawn);
            let value = Measure::exact(100.0 * drawn.share(heat), "%");
            let told = format!(
                "{}, {:.3} ms in {} stretches",
                found.named(layer),
                1e3 * heat.time,
                heat.stretches
            );
            facts.push(Fact::new(id, title, value, &told));
        }
    }
    if found.lag.is_some() {
        let told = |layer| format!("{}, beam on", found.named(layer));
        if let Some((layer, drawn)) = found.worst(|drawn| drawn.beside.0) {
            let (beside, [x, y]) = drawn.beside;
            let title = "farthest of the drawn beam from the line it draws";
            let value = Measure::exact(1e3 * beside, "µm");
            let fact = Fact::new("gun-beside", title, value, &told(layer));
            facts.push(fact.at(Place {
                position: Some([x, y, 0.0]),
                ..Place::layer(layer)
            }));
        }
        if let Some((layer, drawn)) = found.worst(|drawn| drawn.behind) {
            let title = "farthest of the drawn beam behind its plan";
            let value = Measure::exact(1e3 * drawn.behind, "µm");
            facts.push(Fact::new("gun-behind", title, value, &told(layer)));
        }
    }
    facts
}
