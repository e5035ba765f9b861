//! What is judged and told of a wall on a surface: how evenly its passes lie, how the torch leans, what no pass reaches.

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};
use meltpath_planning::surface::{
    Distribution, Extreme, SurfacePass, distribution, evenness, nearest_spacing, tilts,
};
use meltpath_robot::Summary;
use meltpath_robot::cell::Arrangement;

use super::plan::{Cut, Ground, SurfacePlan};
use super::under::{base_check, plate_check};
use super::{Asked, onto};
use crate::waam::drive::lean::{self, Turned};
use crate::waam::judge::checks::wire_used;
use crate::waam::judge::facts::times;
use crate::waam::settings::Settings;

fn place(at: &Extreme) -> Place {
    Place {
        layer: Some(at.pass),
        ..Place::at(at.position.to_array())
    }
}

/// The checks of the plan.
pub(super) fn checks(
    plan: &SurfacePlan,
    asked: &Asked,
    settings: &Settings,
    turned: Option<&Turned>,
) -> Vec<Check> {
    let thickness = plan.thickness.as_ref();
    let thickness = thickness.and_then(|t| t.check(&plan.passes, settings));
    let mut checks = match plan.ground {
        Ground::Base(_) => {
            let mut checks = vec![thickness.unwrap_or_else(|| spacing(plan, asked))];
            checks.extend(hanging(&plan.passes));
            checks.push(unreached(plan));
            checks.extend(base_check(plan));
            checks.extend(plate_check(plan, asked.spacing, settings));
            checks.extend(opening(plan));
            checks
        }
        Ground::Body(_) => std::iter::once(onto::stretch(plan, asked))
            .chain(thickness)
            .collect(),
    };
    checks.push(tilt(plan, settings, turned));
    checks
}

/// Distances from the nearest place of the pass before, which is what a bead lies on.
pub(crate) fn nearest(plan: &SurfacePlan, asked: &Asked) -> Option<Distribution> {
    nearest_spacing(&plan.passes, asked.spacing)
}

fn spacing(plan: &SurfacePlan, asked: &Asked) -> Check {
    const ID: &str = "spacing";
    const TITLE: &str =
        "distance between passes: largest deviation from the layer height, share of it";
    let Some(d) = nearest(plan, asked) else {
        return Check::not_checked(ID, TITLE, "there is one pass");
    };
    let share = |at: &Extreme| 100.0 * (at.value - asked.spacing).abs() / asked.spacing;
    let worst = if share(&d.least) > share(&d.greatest) {
        d.least
    } else {
        d.greatest
    };
    Check::judge(
        ID,
        TITLE,
        Measure::exact(share(&worst), "%"),
        Limit::AtMost(100.0 * asked.spacing_limit),
    )
    .because(&format!(
        "{:.3} to {:.3} mm, {:.3} mm set",
        d.least.value, d.greatest.value, asked.spacing
    ))
    .at(place(&worst))
    .remedy(
        "surface.strategy = \"distance\"; or surface.speeds = \"adapted\", so that the bead is as high as the distance; or a larger checks.spacing, where it may be uneven",
    )
}

/// Passes with nothing below them; `None` where there are none.
fn hanging(passes: &[SurfacePass]) -> Option<Check> {
    let free = |pass: &SurfacePass, i: usize| {
        let from = pass.points.get(i)?.from;
        Some(f64::from(u8::from(from.is_none())))
    };
    let d = distribution(passes, free)?;
    if d.greatest.value == 0.0 {
        return None;
    }
    let check = Check::judge(
        "hanging",
        "passes with nothing below them within ten layer heights, share of their length",
        Measure::exact(100.0 * d.mean, "%"),
        Limit::AtMost(0.0),
    );
    let check = Check {
        status: Status::Fail,
        ..check
    };
    Some(
        check
            .at(place(&d.greatest))
            .remedy("surface.strategy = \"distance\", a base below that place, or the part turned"),
    )
}

/// How many passes a count of layers leaves out.
fn cut_words(Cut { count, all }: Cut) -> String {
    format!("{count} of {all} passes, by layers.count: the surface over them is not built")
}

fn unreached(plan: &SurfacePlan) -> Check {
    let check = Check::judge(
        "unreached",
        "area of the surface that no pass reaches",
        Measure::exact(plan.unreached.abs(), "mm²"),
        Limit::AtMost(0.0),
    );
    let check = match plan.cut {
        Some(cut) => check.because(&format!("{}, and does not count here", cut_words(cut))),
        None => check,
    };
    check.remedy(
        "a base that the whole surface hangs together with, or the pieces as jobs of their own",
    )
}

/// The widest opening that the wall keeps where it closes; `None` where it keeps none.
fn opening(plan: &SurfacePlan) -> Option<Check> {
    let widest = plan
        .openings
        .iter()
        .max_by(|a, b| a.width.total_cmp(&b.width))?;
    let passes: f64 = plan.openings.iter().map(|o| o.length).sum();
    let why = format!(
        "{} of the wall's ends stay open: {passes:.0} mm of passes shorter than four pools are not laid",
        plan.openings.len()
    );
    let place = Place {
        layer: Some(widest.pass),
        ..Place::at(widest.position.to_array())
    };
    Some(
        Check::judge(
            "opening",
            "opening that stays where passes become shorter than four pools",
            Measure::exact(widest.width, "mm"),
            Limit::AtMost(0.0),
        )
        .because(&why)
        .at(place)
        .remedy("a part that ends in an opening at least so wide, as for a pipe; or layers.count below that pass, and the end closed otherwise"),
    )
}

/// How far the pool lies from horizontal, as far as the torch shows it.
fn tilt(plan: &SurfacePlan, settings: &Settings, turned: Option<&Turned>) -> Check {
    let (angle, at) = match (turned, leaning(plan, settings)) {
        (Some(turned), _) => return turned.check(settings),
        (None, Leaning::Standing(angle)) => (angle, None),
        (None, Leaning::Along(d)) => (d.greatest.value, Some(place(&d.greatest))),
        (None, Leaning::Nothing) => {
            return Check::not_checked(lean::ID, lean::TITLE, "there is no pass");
        }
    };
    lean::check(angle, at, settings)
}

/// How the torch leans in the world.
pub(crate) enum Leaning {
    /// It stands: the part turns below it.
    Standing(f64),
    /// It leans differently along the passes.
    Along(Distribution),
    /// There is no pass.
    Nothing,
}

/// How the torch leans in the world.
pub(crate) fn leaning(plan: &SurfacePlan, settings: &Settings) -> Leaning {
    if let Some(cell) = &settings.robot
        && cell.arrangement == Arrangement::PartOnRobot
    {
        let axis = cell.frames(&cell.at_rest()).wire_tip.tool_axis();
        return Leaning::Standing(axis.angle_between(meltpath_geometry::math::DVec3::Z));
    }
    tilts(&plan.passes, &plan.torch).map_or(Leaning::Nothing, Leaning::Along)
}

/// How often the arc is struck: passes that go on from the one before do not.
pub(super) fn arc_starts(plan: &SurfacePlan) -> usize {
    let runs = plan.passes.chunk_by(|a, b| b.goes_on_from(a));
    runs.count()
}

/// What a wall on a surface tells without a limit, with the wire that was fed, mm.
pub(super) fn facts(
    plan: &SurfacePlan,
    asked: &Asked,
    settings: &Settings,
    (summary, wire): (&Summary, f64),
    turned: Option<&Turned>,
) -> Vec<Fact> {
    let exact = |id, title, value, unit| Fact::new(id, title, Measure::exact(value, unit), "");
    let used = wire_used(wire, settings);
    let passes = plan.passes.last().map_or(0, |p| p.number);
    let mut facts = vec![
        Fact::new(
            "layers",
            "passes, one over the other",
            Measure::exact(f64::from(passes), ""),
            &plan.cut.map_or_else(String::new, cut_words),
        ),
        exact("arc-starts", "arc starts", arc_starts(plan) as f64, ""),
        exact(
            "length",
            "length of the beads",
            plan.toolpath.deposited_length() / 1000.0,
            "m",
        ),
    ];
    facts.extend(onto::coverage(plan));
    facts.extend(evenness_facts(plan, asked));
    if let Some(turned) = turned {
        facts.push(turned.fact());
    } else if let Leaning::Along(d) = leaning(plan, settings) {
        let [_, middle, high] = d.quantiles.map(f64::to_degrees);
        let words = format!("half of the length below {middle:.1} deg, 95 % below {high:.1} deg");
        let mean = Measure::exact(d.mean.to_degrees(), "deg");
        facts.push(Fact::new(
            "tilt-mean",
            "torch against the vertical, mean",
            mean,
            &words,
        ));
    }
    if let Some(end) = plan.ends.iter().max_by(|a, b| a.left.total_cmp(&b.left)) {
        let left = Measure::exact(end.left, "mm");
        let words = format!(
            "of {} ends of passes at rims, caps and other passes",
            plan.ends.len()
        );
        let fact = Fact::new(
            "left-over",
            "surface left beyond the last pass, at most",
            left,
            &words,
        );
        facts.push(fact.at(Place {
            layer: Some(end.front),
            ..Place::at(end.position.to_array())
        }));
    }
    facts.push(Fact::new("wire-mass", "wire used", used, ""));
    facts.extend(times(summary, settings));
    facts
}

/// How evenly passes lie; nothing where no pass has one before it.
fn evenness_facts(plan: &SurfacePlan, asked: &Asked) -> Vec<Fact> {
    let tolerance = asked.spacing_limit * asked.spacing;
    let Some(even) = evenness(&plan.passes, asked.spacing, tolerance) else {
        return Vec::new();
    };
    let words = |d: &Distribution| {
        let [low, middle, high] = d.quantiles;
        format!(
            "{:.3} to {:.3} mm; 5, 50 and 95 % of the length below {low:.3}, {middle:.3} and {high:.3}",
            d.least.value, d.greatest.value
        )
    };
    let spacing = Measure::exact(even.spacing.mean, "mm");
    let mut facts = vec![
        Fact::new(
            "spacing-laid",
            "distance from the points that passes were laid from, mean",
            spacing,
            &words(&even.spacing),
        )
        .at(place(&even.deviation)),
    ];
    // speeds follow the nearest place already, and the turns of a spiral touch where one goes on from the other
    let told = matches!(plan.ground, Ground::Base(_)) && plan.thickness.is_some();
    if let Some(near) = nearest(plan, asked).filter(|_| !told) {
        let mean = Measure::exact(near.mean, "mm");
        let fact = Fact::new(
            "spacing-nearest",
            "distance from the nearest place of the pass before, mean",
            mean,
            &words(&near),
        );
        facts.push(fact.at(place(&near.least)));
    }
    let title = match plan.thickness {
        Some(_) => "thickest over thinnest place of one layer: travel speeds follow it",
        None => {
            "widest over closest place of one pass: how much the bead's height would have to vary"
        }
    };
    let ratio = Fact::new(
        "thickness-ratio",
        title,
        Measure::exact(even.ratio.value, ""),
        "",
    );
    facts.push(ratio.at(place(&even.ratio)));
    facts
}
