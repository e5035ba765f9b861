//! The judgement of a scan-head run: contours, dark marks, fills, fusion; each with the friction that the head's file states and,
//! where it states a range, with the least and the most of it.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Reporter, Status};
use meltpath_scan_head::axis::chain::Axis;
use meltpath_scan_head::axis::control::Controller;
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::gate::Darkness;
use meltpath_scan_head::head::head_axis::HeadAxis;
use meltpath_scan_head::head::recipe::{LaserDelays, Recipe};
use meltpath_scan_head::head::survey::Survey;
use meltpath_scan_head::measures::contour_error::PathErrors;
use meltpath_scan_head::measures::fill_share::FillShare;
use meltpath_scan_head::measures::stray_light::StrayLight;
use meltpath_scan_head::search::longest_stray;

use super::defocus;
use super::friction::{ends, over_the_range, unless_guessed};
use super::heat::{self, RecipeHeat};
use super::paced;
use super::plan::Plan;
use super::result::{AtEnd, JUDGED, RecipeResult, fill_words};
use super::settings::Settings;
use super::strays;
use crate::identify::of_motor;
use crate::job::lpbf::{DelayChoice, PathChoice};

/// What keeps the spot nearer to contours. Slower ones do not: there friction weighs more.
fn contour_remedy(settings: &Settings) -> String {
    if settings.data.head.left_out.is_some() {
        return "slower contours or longer waits at their corners; or a shorter tracking delay, by another tuning of the head".to_owned();
    }
    let cascade = |axis: &Axis| matches!(axis.controller, Controller::Cascade(_));
    let controller = if settings
        .data
        .head
        .mirrors
        .iter()
        .filter_map(HeadAxis::driven)
        .any(cascade)
    {
        "lpbf.controller = \"h-infinity\", which rejects friction"
    } else {
        "a controller tuned on this head (`meltpath tune`)"
    };
    // a preview is made for the axes' lag: with more friction than it knows of the spot strays farther than without
    let helps = *settings.job.lpbf.path != PathChoice::Preview && ends(&settings.data).is_none();
    if helps {
        format!("{controller}, or lpbf.path = \"preview\"")
    } else {
        controller.to_owned()
    }
}

/// Marks that no light reaches; `None` where all are lit.
fn dark_check(
    number: usize,
    recipe: &str,
    delays: LaserDelays,
    darkness: &Darkness,
) -> Option<Check> {
    let Darkness { chains, dark, .. } = darkness;
    let (layer, start) = darkness.first_dark?;
    let reason = format!(
        "of {chains}: the laser-on delay, {:.0} µs, lasts as long as they and the laser-off delay, {:.0} µs",
        1e6 * delays.on,
        1e6 * delays.off
    );
    let place = Place {
        layer: Some(layer),
        ..Place::at(start.to_array())
    };
    let check = Check::judge(
        &format!("dark-{number}"),
        &format!("{recipe}: marks between jumps that stay dark"),
        Measure::exact(*dark as f64, ""),
        Limit::AtMost(0.0),
    );
    Some(check.because(&reason).at(place).remedy(
        "lpbf.delays = \"tuned\"; or a laser-on delay no longer than the laser-off delay, with a wait after jumps in its stead",
    ))
}

/// What is known before anything is run: what no mark of a file comes near, marks that run otherwise than commanded, and those that the recipes'
/// own delays leave dark; tuned delays leave none.
pub(super) fn foretold(plan: &Plan, surveys: &[Survey]) -> Result<Vec<String>, HeadError> {
    let undecided = |c: &&Check| c.status != Status::Pass;
    let enclosed = plan.enclosed.checks.iter().filter(undecided).cloned();
    let mut lines: Vec<String> = enclosed.map(words).collect();
    lines.extend(plan.left_out.iter().cloned().map(words));
    for (k, (recipe, survey)) in plan.settings.recipes.iter().zip(surveys).enumerate() {
        let (number, name) = (k + 1, recipe.name.as_str());
        let paced = [
            defocus::check(&plan.settings, number, name, survey),
            paced::slowed(number, name, survey),
            paced::too_fast(number, name, survey),
        ];
        lines.extend(paced.into_iter().flatten().map(words));
    }
    if *plan.settings.job.lpbf.delays == DelayChoice::Tuned {
        return Ok(lines);
    }
    let period = plan.settings.data.head.period;
    for (k, recipe) in plan.settings.recipes.iter().enumerate() {
        let darkness = Darkness::of(plan.work.layers(recipe)?, recipe.delays, period)?;
        let dark = dark_check(k + 1, &recipe.name, recipe.delays, &darkness);
        lines.extend(dark.map(words));
    }
    Ok(lines)
}

/// A check that is foretold, in one line.
fn words(check: Check) -> String {
    let words = (check.status.words(), &check.title, check.line());
    let place = check.place.map(|p| format!(" ({p})"));
    let remedy = check.remedy.map(|r| format!("; {r}"));
    format!(
        "foretold: {}: {}: {}{}{}",
        words.0,
        words.1,
        words.2,
        place.unwrap_or_default(),
        remedy.unwrap_or_default()
    )
}

/// Judges every recipe.
pub(super) fn checks(plan: &Plan, results: &[RecipeResult<'_>], reporter: &Reporter) -> Vec<Check> {
    let settings = &plan.settings;
    let motors = ['x', 'y', 'z'].into_iter().zip(settings.data.misfits);
    let motors = motors.filter_map(|(axis, over)| Some(of_motor(axis, over?)));
    let mut checks: Vec<Check> = motors.collect();
    let known = |check: Check, r: &RecipeResult<'_>| {
        paced::unless_slowed(unless_guessed(check, settings), r.survey)
    };
    for (k, r) in results.iter().enumerate() {
        let (number, name) = (k + 1, r.recipe.name.as_str());
        let contours = |errors: &PathErrors| contours(settings, number, name, errors);
        let check = contours(&r.errors);
        let check = over_the_range(check, r, |end| Some(contours(&end.errors)));
        checks.push(known(check, r));
        checks.extend(defocus::check(settings, number, name, r.survey));
        checks.extend(paced::slowed(number, name, r.survey));
        checks.extend(paced::too_fast(number, name, r.survey));
        checks.extend(dark_check(number, name, r.delays, &r.darkness));
        let unlit = |errors: &PathErrors| unlit(settings, number, name, errors);
        let check = unlit(&r.errors).map(|c| over_the_range(c, r, |end| unlit(&end.errors)));
        checks.extend(check.map(|c| known(c, r)));
        let stray = |errors: &PathErrors| stray(settings, number, r.recipe, &errors.stray);
        let check = over_the_range(stray(&r.errors), r, |end| Some(stray(&end.errors)));
        checks.push(known(check, r));
        let limit = *settings.job.checks.fill_rate;
        checks.extend(limit.map(|limit| {
            let id = format!("fill-{number}");
            let title = r.fill_title();
            let check = fill_check(plan, r, (&id, &title), limit.0);
            let wide = |check| defocus::unless_wide(check, settings, r.survey);
            check.map_or_else(
                || nothing_filled(&id, &title),
                |check| wide(known(check, r)),
            )
        }));
    }
    if let Some(heat) = &settings.heat {
        for (k, r) in results.iter().enumerate() {
            let fused = |melted: &RecipeHeat, reporter: &Reporter| {
                heat::check(heat, k + 1, &r.recipe.name, melted, reporter)
            };
            checks.extend(r.heat.as_ref().map(|melted| {
                let check = fused(melted, reporter);
                // what is to be warned of is the recipe's own, whatever the friction
                let ends = over_the_range(check, r, |end| {
                    Some(fused(end.heat.as_ref()?, &Reporter::new()))
                });
                defocus::unless_wide(known(ends, r), settings, r.survey)
            }));
            let name = &r.recipe.name;
            if let Some(melted) = &r.heat {
                let keyhole = |melted: &RecipeHeat| heat::keyhole_check(heat, k + 1, name, melted);
                let again = heat::again_check(heat, k + 1, name, melted.warm.as_ref());
                let dwell = |melted: &RecipeHeat| heat::dwell_check(k + 1, name, melted);
                let mut of_ends = r.ends.iter().flatten().filter_map(|end| end.heat.as_ref());
                let stands = dwell(melted).or_else(|| of_ends.find_map(dwell));
                let dug = of_light(keyhole(melted), r, |melted| Some(keyhole(melted)));
                let stands = stands.map(|c| of_light(c, r, dwell));
                let all = std::iter::once(dug).chain(stands).chain(again);
                let known = all.map(|c| paced::unless_slowed(c, r.survey));
                checks.extend(known.map(|c| defocus::unless_wide(c, settings, r.survey)));
            }
        }
    } else {
        checks.push(Check::not_checked(
            "melt-pool",
            "fusion of the powder",
            "the job does not ask for it: fast recipes may not melt well; add [heat]",
        ));
    }
    checks
}

/// What light does, whatever the friction: that of marks as commanded is the same with any.
fn of_light(
    check: Check,
    result: &RecipeResult<'_>,
    judge: impl Fn(&RecipeHeat) -> Option<Check>,
) -> Check {
    let at_end = |end: &AtEnd| judge(end.heat.as_ref()?);
    let same = |end: &AtEnd| {
        at_end(end).is_some_and(|c| (c.status, &c.value) == (check.status, &check.value))
    };
    if result.ends.iter().flatten().all(same) {
        return check;
    }
    over_the_range(check, result, at_end)
}

/// A limit that the job writes, and nothing to hold against it.
fn nothing_filled(id: &str, title: &str) -> Check {
    let why = "checks.fill_rate asks for a fill, and no line of one was marked";
    Check {
        status: Status::CannotSay,
        ..Check::not_checked(id, title, why)
    }
    .remedy(
        "lines that the file lost: hatch the part anew; or no checks.fill_rate for contours alone",
    )
}

/// How near contours come.
fn contours(settings: &Settings, number: usize, recipe: &str, errors: &PathErrors) -> Check {
    let id = format!("contour-{number}");
    if errors.dark().commanded == 0.0 {
        let title = format!("{recipe}: contours");
        return Check::not_checked(&id, &title, "no contour was marked");
    }
    let limits = &settings.job.checks;
    let bound = limits.contour_error.0;
    let below = 100.0 * errors.contour_share(bound, None);
    let left_out = settings.data.head.left_out;
    let found = match left_out.flatten() {
        Some(s) => {
            let strays = 100.0 * errors.contour_share(bound, Some(s));
            Measure::new(strays, 0.5 * (below - strays).abs(), "%")
        }
        None => Measure::exact(below, "%"),
    };
    let strays = match left_out.flatten() {
        Some(_) => ", with what the head's file says that it leaves out",
        None => "",
    };
    let title = format!(
        "{recipe}: way along contours within {:.0} µm{strays}",
        1e3 * bound
    );
    let limit = Limit::AtLeast(100.0 * limits.contour_share.0);
    let check = Check::judge(&id, &title, found, limit);
    let check = check
        .at(Place::at(errors.worst.extend(0.0).to_array()))
        .remedy(contour_remedy(settings));
    match left_out {
        Some(None) => strays::unless_measured(check),
        _ => check,
    }
}

/// The longest stretch of contours that no light reaches; `None` where no contour is marked.
fn unlit(settings: &Settings, number: usize, recipe: &str, errors: &PathErrors) -> Option<Check> {
    let dark = errors.dark();
    if dark.commanded == 0.0 {
        return None;
    }
    let id = format!("unlit-{number}");
    let title = format!("{recipe}: longest stretch of contours without light");
    // as far as a spot heals, or as the job lets contours be off
    let spot = 2.0 * settings.data.head.beam.waist;
    let most = spot.max(settings.job.checks.contour_error.0);
    let found = Measure::exact(dark.longest.length, "mm");
    let check = Check::judge(&id, &title, found, Limit::AtMost(most));
    if dark.length == 0.0 {
        return Some(strays::unless_wider(check, settings, most));
    }
    let reason = format!(
        "{} mm of {} mm in all lie farther from any light than the spot's diameter",
        significant(dark.length, 3),
        significant(dark.commanded, 4)
    );
    let place = Place {
        layer: Some(dark.longest.layer),
        ..Place::at(dark.longest.from.extend(0.0).to_array())
    };
    let delays = match *settings.job.lpbf.delays {
        DelayChoice::Recipe => "lpbf.delays = \"tuned\"",
        DelayChoice::Tuned => "slower contours, or longer waits after jumps and marks",
    };
    let check = check.because(&reason).at(place).remedy(delays);
    Some(strays::unless_wider(check, settings, most))
}

/// The longest stretch of light far from all marks.
fn stray(settings: &Settings, number: usize, recipe: &Recipe, stray: &StrayLight) -> Check {
    let error = settings.job.checks.contour_error.0;
    let most = longest_stray(&settings.data.head, error, recipe);
    let recipe = &recipe.name;
    let check = Check::judge(
        &format!("stray-{number}"),
        &format!("{recipe}: longest stretch of light where no mark is"),
        Measure::exact(stray.longest.length, "mm"),
        Limit::AtMost(most),
    );
    if stray.length == 0.0 {
        return check;
    }
    let far = stray.length - stray.jumped;
    let parts = [
        (far, "lie farther than the spot's diameter from any mark"),
        (
            stray.jumped,
            "go over marks against them, or at the speed of jumps",
        ),
    ];
    let told = parts.into_iter().filter(|(length, _)| *length > 0.0);
    let told: Vec<String> = told
        .map(|(length, what)| format!("{} mm in all {what}", significant(length, 3)))
        .collect();
    let reason = told.join(", ");
    let place = Place {
        layer: Some(stray.longest.layer),
        ..Place::at(stray.longest.from.extend(0.0).to_array())
    };
    let remedy = match *settings.job.lpbf.delays {
        DelayChoice::Recipe => {
            "lpbf.delays = \"tuned\", or a shorter laser-off and a longer laser-on delay"
        }
        DelayChoice::Tuned => {
            "let the mirrors settle: a longer wait after marks or jumps, slower jumps, or a run up to the lines (run_in)"
        }
    };
    check.because(&reason).at(place).remedy(remedy)
}

/// How much of the surface of a job is reached, against a least share, whatever the friction; `None` where nothing is filled.
pub(super) fn fill_check(
    plan: &Plan,
    result: &RecipeResult<'_>,
    (id, title): (&str, &str),
    least: f64,
) -> Option<Check> {
    let settings = &plan.settings;
    let filled = |fill: &FillShare| {
        let rate = strays::rate(plan, result, fill);
        let found = Measure::new(100.0 * rate.share, 100.0 * rate.doubt, "%");
        let check = Check::judge(id, title, found, Limit::AtLeast(100.0 * least));
        let check = match fill.worst {
            Some(worst) => check.at(Place {
                layer: Some(worst.layer),
                ..Place::at(worst.middle.extend(0.0).to_array())
            }),
            None => check,
        };
        let check = match fill_words(fill) {
            Some(words) => check.because(&words),
            None => check,
        };
        let closer = match settings.job.lpbf.layers.as_ref() {
            Some(_) => "a closer hatch, or the lines that the file lost",
            None => "a closer hatch",
        };
        check.remedy(match *settings.job.lpbf.delays {
            DelayChoice::Recipe => format!("lpbf.delays = \"tuned\", or {closer}"),
            DelayChoice::Tuned => closer.to_owned(),
        })
    };
    let check = filled(&result.fill(JUDGED)?);
    let check = over_the_range(check, result, |end| end.fill.as_ref().map(filled));
    let check = strays::told(plan, result, check);
    Some(match &plan.enclosed.doubt {
        Some(doubt) => doubt.leaves_open(check),
        None => check,
    })
}
