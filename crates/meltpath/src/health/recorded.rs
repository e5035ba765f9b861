//! The two stages of a health test from the files of a bench.

use std::path::Path;

use meltpath_base::Reporter;
use meltpath_perception::{Mapping, read};
use meltpath_scan_head::axis::chain::AxisRecord;
use meltpath_scan_head::health::bench::{Km0Stage1, first_stage};
use meltpath_scan_head::health::signal::Km0Samples;
use meltpath_scan_head::identification::record::Excitation;

use super::{HealthError, Subject};
use crate::identify::bench;

/// Share of the travel from which on a motor may stand at its stop.
const STOP: f64 = 0.98;

/// Tells a record whose motor left its travel: what is found from it is the stop's.
fn at_a_stop(subject: &Subject, (stage, angle): (&str, &[f64]), reporter: &Reporter) {
    let travel = subject.data.travel;
    let beyond = angle.iter().filter(|a| a.abs() >= STOP * travel).count();
    if beyond > 0 {
        let farthest = angle.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        reporter.warn(
            "at-a-stop",
            format!(
                "the {stage} stage's angle stands at or beyond the end of the travel (±{:.2} deg) for {:.1} % of the record, up to {:.2} deg: what is found there is the stop's, not the motor's",
                travel.to_degrees(),
                100.0 * beyond as f64 / angle.len() as f64,
                farthest.to_degrees()
            ),
            "write the signal anew with `meltpath health --signal`, play it from the middle of the travel, and look at the zero of the angle in the mapping",
        );
    }
}

/// Both stages from files.
pub(super) fn recorded(
    subject: &Subject,
    signal: &Km0Samples,
    [first, second]: [&Path; 2],
    mapping: &Path,
    reporter: &Reporter,
) -> Result<(Km0Stage1, AxisRecord), HealthError> {
    let mapping = Mapping::load(mapping)?;
    let one = read(first, &mapping, reporter)?;
    let bench = bench(&one)?;
    let excitation = match one.channel("set-point") {
        Ok(s) if s.iter().any(|v| *v != s[0]) => Excitation::SetPoint(s),
        _ => Excitation::Voltage,
    };
    at_a_stop(subject, ("first", bench.angle), reporter);
    let found = first_stage(&bench, excitation)?;
    let two = read(second, &mapping, reporter)?;
    if (two.period / subject.period - 1.0).abs() > 1e-3 {
        return Err(HealthError::Period {
            path: second.to_path_buf(),
            head: subject.head.clone(),
            found: two.period,
            wanted: subject.period,
        });
    }
    at_a_stop(subject, ("second", two.channel("angle")?), reporter);
    let begin = if let Ok(set_points) = two.channel("set-point") {
        signal.align(set_points)?
    } else {
        reporter.warn(
            "no-set-point",
            "the second stage has no channel \"set-point\": it is taken to begin with its signal",
            "record the set-points too",
        );
        0
    };
    let response = AxisRecord {
        reference: signal.set_points.clone(),
        angle: two.channel("angle")?[begin..].to_vec(),
        current: two.channel("current")?[begin..].to_vec(),
        voltage: Vec::new(),
    };
    Ok((found, response))
}
