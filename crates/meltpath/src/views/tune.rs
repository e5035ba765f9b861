//! What a person sees of a tuning.

mod bode;
mod tables;

use meltpath_base::number::significant;
use meltpath_base::output::OutputFolder;
use meltpath_base::{Fact, Measure, Provenance, Verdict};
use meltpath_report::html::{Report, Section};
use meltpath_scan_head::servo::model::Loop;

use crate::tune::design::AxisResult;
use crate::tune::error::{TuneError, step};
use crate::tune::export::{current_words, forward_words};
use crate::tune::refinement::words;
use crate::tune::settings::Settings;

/// Writes the report, the verdict and the provenance.
pub(crate) fn write(
    folder: &OutputFolder,
    title: &str,
    settings: &Settings,
    results: &[AxisResult],
    verdict: &Verdict,
    provenance: &Provenance,
) -> Result<(), TuneError> {
    let mut all = Vec::new();
    for (k, result) in results.iter().enumerate() {
        let twin = results[..k]
            .iter()
            .find(|r| r.tuned == result.tuned && r.set_points == result.set_points);
        match twin {
            Some(first) => all.push(Section {
                title: format!("{} axis", upper(result)),
                intro: format!(
                    "The same motor, drive and targets as the {} axis: the same controllers.",
                    upper(first)
                ),
                ..Section::default()
            }),
            None => all.extend(sections(result, settings)?),
        }
    }
    let report = Report {
        title: title.to_owned(),
        subtitle: format!(
            "{} · axes {} · controllers every {:.2} µs",
            settings.data.head.name,
            results
                .iter()
                .map(|r| upper(r).to_string())
                .collect::<Vec<_>>()
                .join(", "),
            1e6 * settings.period
        ),
        verdict: verdict.clone(),
        scene: None,
        sections: all,
        sheet: None,
        provenance: provenance.clone(),
    };
    crate::outcome::tell(folder, &report)?;
    Ok(())
}

fn upper(result: &AxisResult) -> char {
    result.task.name.letter().to_ascii_uppercase()
}

/// What is told of an axis beside the checks.
pub(crate) fn facts(result: &AxisResult) -> Vec<Fact> {
    let (chosen, letter) = (result.chosen(), result.task.name.letter());
    let exported = match &result.as_exported {
        Some(_) => format!("{}, order {}", chosen.name, order(result)),
        None => format!(
            "{}, order {}; it leaves as gains: nothing is rounded",
            chosen.name,
            order(result)
        ),
    };
    let error = Measure::exact(chosen.bare.error.rms().to_degrees(), "deg");
    let mut facts = vec![
        Fact::words(
            &format!("{letter}-exported"),
            &format!("{}: controller exported", upper(result)),
            &exported,
        ),
        Fact::new(
            &format!("{letter}-error"),
            &format!("{}: error of the multi-step, rms", upper(result)),
            error,
            "",
        ),
    ];
    facts.extend(current(result));
    facts.extend(forward(result));
    facts
}

/// The feed-forward that an exported controller is judged with.
fn forward(result: &AxisResult) -> Option<Fact> {
    result.export.as_ref()?;
    let letter = result.task.name.letter();
    Some(Fact::words(
        &format!("{letter}-feed-forward"),
        &format!(
            "{}: feed-forward of current beside the exported controller",
            upper(result)
        ),
        &format!(
            "{}: controller_{letter}_drive of the C file holds it",
            forward_words(&result.feed_forward())
        ),
    ))
}

/// The current regulator that an exported controller acts through, and what becomes of it with that of the head.
fn current(result: &AxisResult) -> Option<Fact> {
    result.export.as_ref()?;
    let (own, designed) = (result.task.own, result.tuned.gains.current);
    let designed = current_words(&designed);
    let words = match own.zip(result.with_own_current) {
        Some((own, distance)) => format!(
            "{designed}: set the drive to it; the head's file has {}, with which the distance to the critical point is {}",
            current_words(&own.current),
            significant(distance, 4)
        ),
        None if own.is_some() => format!("{designed}, as the head's file has it"),
        None => format!("{designed}: set the drive to it"),
    };
    Some(Fact::words(
        &format!("{}-current", result.task.name.letter()),
        &format!(
            "{}: current regulator of the exported controller",
            upper(result)
        ),
        &words,
    ))
}

fn order(result: &AxisResult) -> String {
    use meltpath_scan_head::axis::control::{Controller, SampledForm};
    match &result.chosen().controller {
        Controller::Cascade(_) => "of three loops".to_owned(),
        Controller::Sampled(controller) => match &controller.form {
            SampledForm::Designed(system) => system.order().to_string(),
            SampledForm::Exported(_) => "as exported".to_owned(),
        },
    }
}

fn sections(result: &AxisResult, settings: &Settings) -> Result<Vec<Section>, TuneError> {
    let letter = result.task.name.letter();
    let name = upper(result);
    let drawn = "plots";
    let mut by_loop = Vec::new();
    for which in [Loop::Current, Loop::Speed, Loop::Position] {
        by_loop.extend(bode::synthesis(result, which));
    }
    by_loop.extend(bode::steps(result).map_err(step(letter, drawn))?);
    by_loop.push(bode::actions(result));
    let refinement = match &result.refined {
        Some(r) => format!(" {}", words(r, &result.gains)),
        None => String::new(),
    };
    let mut cascade = vec![
        tables::gains(result),
        tables::loops(result),
        tables::steps(result),
    ];
    if let Some(refined) = &result.refined {
        cascade.insert(1, tables::refinement(refined));
    }
    let mut out = vec![
        Section::new(
            format!("{name} axis: cascade, loop by loop"),
            format!(
                "From the inside out: first the integral (or derivative) time, bounded by the phase margin, then the gain for the crossover.{refinement}"
            ),
            by_loop,
            cascade,
        ),
        Section::new(
            format!("{name} axis: H-infinity"),
            "Three templates bound sensitivity, command and the response to disturbances; the controller replaces the speed and position regulators.",
            bode::h_infinity(result).map_err(step(letter, drawn))?,
            vec![tables::h_infinity(result)],
        ),
        Section::new(
            format!("{name} axis: what brings what"),
            format!(
                "Every controller with and without the pre-filter, friction and limits included, on steps of ±{:.3}° and so on, halved {} times, at {:.0} °/s.",
                result.task.signal.amplitude.to_degrees(),
                result.task.signal.levels.saturating_sub(1),
                result.task.signal.slope.to_degrees()
            ),
            bode::responses(result, settings.data.head.period),
            vec![tables::two_by_two(result)],
        ),
    ];
    let mut spread = Section {
        title: format!("{name} axis: motors that differ"),
        intro: format!(
            "Scatter: resistance ±{:.0} %, inertia ±{:.0} %, modes ±{:.0} %, delay up to {:.1} µs, noise up to {:.5}°.",
            100.0 * settings.scatter.resistance,
            100.0 * settings.scatter.inertia,
            100.0 * settings.scatter.modes,
            1e6 * settings.scatter.delay,
            settings.scatter.noise.to_degrees()
        ),
        ..Section::default()
    };
    if settings.mode_shift().is_some() {
        let limit = settings.spread.modulus_margin;
        spread.plots.push(bode::sweep(result, limit));
    }
    if *settings.file.compare.draws > 0 {
        spread.plots.push(bode::scattered(&result.candidates));
        spread.tables.push(tables::scattered(result));
    }
    if !spread.plots.is_empty() {
        out.push(spread);
    }
    Ok(out)
}
