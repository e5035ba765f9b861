//! What leaves: the chosen controllers for drives and for whole jobs, and the responses as tables.

use meltpath_base::number::significant;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_control::export::{Beside, Word};
use meltpath_report::series::name_in_files;
use meltpath_scan_head::axis::control::{AngleUnit, CurrentGains, FeedForward};
use meltpath_scan_head::servo::compare::TrackingError;
use meltpath_scan_head::servo::file::{AxisController, ControllerFile, SCHEMA, StoredLaw};
use serde_json::json;

use super::design::AxisResult;
use super::settings::Settings;
use crate::outcome::json as write_json;

/// Most rows of a table of responses.
const ROWS: usize = 40_000;

pub(super) fn write(
    folder: &OutputFolder,
    settings: &Settings,
    results: &[AxisResult],
) -> Result<(), OutputError> {
    let file = ControllerFile {
        schema: SCHEMA.to_owned(),
        head: settings.data.head.name.clone(),
        axes: results.iter().map(stored).collect(),
    };
    // plain structs of numbers and strings: their JSON exists
    let value = serde_json::to_value(&file).unwrap_or_default();
    write_json(folder, "controllers.json", &value)?;
    for result in results {
        let letter = result.task.name.letter();
        if let Some(export) = &result.export {
            let beside = beside(result, settings);
            let mut value = serde_json::to_value(export).unwrap_or_default();
            let current = result.tuned.gains.current;
            value["input"] = json!("error of the angle, deg");
            value["output"] = json!("set-point of the current, A");
            value["current_regulator"] = json!({
                "gain_V_per_A": current.gain,
                "integral_time_s": current.integral_time,
                "period_s": beside.period,
            });
            // added to the output; the sum is cut
            value["feed_forward"] = json!({
                "gain_A_s2_per_rad": beside.gain,
                "filter_s": beside.filter,
                "period_s": beside.period,
                "limit_A": beside.limit,
            });
            write_json(folder, &format!("controller-{letter}.json"), &value)?;
            folder.write(&format!("controller-{letter}.c"), |w| {
                w.write_all(acts_through(result, &export.name, &beside).as_bytes())?;
                w.write_all(export.to_c_beside(&beside).as_bytes())
            })?;
            folder.write(&format!("controller-{letter}.mat"), |w| {
                w.write_all(&export.to_mat_beside(&beside))
            })?;
        }
        responses(folder, settings, result)?;
    }
    let value = serde_json::to_value(results.iter().map(summary).collect::<Vec<_>>());
    write_json(folder, "tuning.json", &value.unwrap_or_default())
}

/// The feed-forward that the exported controller was judged with.
fn beside(result: &AxisResult, settings: &Settings) -> Beside {
    let forward = result.feed_forward();
    Beside {
        gain: forward.acceleration_gain(),
        filter: forward.filter,
        period: settings.data.head.period,
        every: *settings.file.export.every,
        per_unit: AngleUnit::Degree.per_radian(),
        limit: result.task.axis.limits.current,
    }
}

/// What the drive is to call and to be set to, as a comment of C.
fn acts_through(result: &AxisResult, name: &str, beside: &Beside) -> String {
    let every = match beside.every {
        1 => String::new(),
        n => format!(", which acts once in {n} calls"),
    };
    let word = match result.export.as_ref().map(|e| e.word) {
        Some(Word::Fixed { signal, .. }) => {
            format!(";\n   error and set-point in units of 2^-{signal} deg and 2^-{signal} A")
        }
        _ => String::new(),
    };
    format!(
        "/* Call {name}_drive once every {period:e} s (T): set-point and measured angle in rad, the set-point of the current in A.\n   \
         Call {name}_start before, with the set-point in rad. This is what was designed and judged: the law{every}, and the\n   \
         feed-forward of current {share} J/Kc s^2/(1 + {filter} us s)^2, J/Kc = {inertia:e} A s^2/rad.\n   \
         {name}_step alone is the law without the feed-forward: the error of the angle in deg, the current in A{word}.\n   \
         Without the feed-forward the loop is as stable and follows worse than was told.\n   \
         Set the drive's current regulator, K (1 + 1/(T_i s)), to\n   \
         {regulator};\n   \
         with another one the loop is not the one that was designed and judged. It is backward Euler at every T:\n   \
         integral += K T/T_i error, voltage = K error + integral, cut to the supply's +-{voltage} V; the integral stands still\n   \
         while the voltage is cut and the error would take it further. */\n\n",
        period = beside.period,
        share = significant(result.feed_forward().current, 5),
        filter = significant(1e6 * beside.filter, 5),
        inertia = result.feed_forward().inertia_over_torque,
        regulator = current_words(&result.tuned.gains.current).replace(", T =", ", T_i ="),
        voltage = significant(result.task.axis.limits.voltage, 4),
    )
}

/// The feed-forward beside an exported controller, in words.
pub(crate) fn forward_words(forward: &FeedForward) -> String {
    format!(
        "{} A per rad/s² of the set-point, through a filter of {} µs twice",
        significant(forward.acceleration_gain(), 4),
        significant(1e6 * forward.filter, 4)
    )
}

/// A current regulator in words.
pub(crate) fn current_words(current: &CurrentGains) -> String {
    format!(
        "K = {} V/A, T = {} µs",
        significant(current.gain, 5),
        significant(1e6 * current.integral_time, 5)
    )
}

fn stored(result: &AxisResult) -> AxisController {
    let law = match &result.export {
        Some(export) => StoredLaw::Exported {
            export: export.clone(),
            unit: AngleUnit::Degree,
            current: result.tuned.gains.current,
            feed_forward: result.feed_forward(),
        },
        None => StoredLaw::Cascade {
            gains: result.gains,
        },
    };
    AxisController {
        axis: result.task.name.letter(),
        design: result.chosen().name.to_owned(),
        motor: result.task.axis.motor.clone(),
        law,
    }
}

/// The figures of an axis for other programs.
fn summary(result: &AxisResult) -> serde_json::Value {
    let candidates: Vec<_> = result
        .candidates
        .iter()
        .map(|c| {
            json!({
                "controller": c.choice,
                "rms_deg": c.bare.error.rms().to_degrees(),
                "largest_deg": c.bare.error.largest().to_degrees(),
                "rms_with_prefilter_deg": c.filtered.as_ref().map(|t| t.error.rms().to_degrees()),
                "least_distance": c.closest().map(|s| s.distance),
                "lost": c.lost(),
                "draws": c.draws,
            })
        })
        .collect();
    let degrees = |e: Option<f64>| e.map(f64::to_degrees);
    json!({
        "axis": result.task.name,
        "exported": result.choice,
        "targets": result.task.targets,
        "synthesis": result.tuned.gains,
        "refined": result.refined.as_ref().map(|r| json!({
            "gains": r.gains,
            "gained": r.gained,
            "held": r.held,
            "runs": r.runs.iter().map(|run| json!({
                "name": run.name,
                "rms_before_deg": degrees(run.before.as_ref().map(TrackingError::rms)),
                "rms_after_deg": degrees(run.after.as_ref().map(TrackingError::rms)),
            })).collect::<Vec<_>>(),
        })),
        "cascade": result.gains,
        "h_infinity": {
            "targets": result.task.h_infinity,
            "level": result.h_infinity.level,
            "controller": result.h_infinity.simplified,
            "loops": result.quality,
        },
        "robust": result.robust.as_ref().map(|r| json!({
            "targets": r.targets,
            "controller": r.servo.simplified,
            "loops": r.loops,
        })),
        "candidates": candidates,
    })
}

/// Set-points and angles of the comparison.
fn responses(
    folder: &OutputFolder,
    settings: &Settings,
    result: &AxisResult,
) -> Result<(), OutputError> {
    let name = format!("multi-step-{}.csv", result.task.name.letter());
    let every = result.set_points.len().div_ceil(ROWS).max(1);
    folder.write(&name, |w| {
        write!(w, "time_s,set_point_deg")?;
        for c in &result.candidates {
            let name = c.name.to_lowercase();
            write!(w, ",{}", name_in_files(&name, "deg"))?;
            if c.filtered.is_some() {
                let name = format!("{name} with pre-filter");
                write!(w, ",{}", name_in_files(&name, "deg"))?;
            }
        }
        writeln!(w)?;
        for (k, s) in result.set_points.iter().enumerate().step_by(every) {
            write!(
                w,
                "{:.7},{:.6}",
                k as f64 * settings.data.head.period,
                s.to_degrees()
            )?;
            for c in &result.candidates {
                write!(w, ",{:.6}", c.bare.record.angle[k].to_degrees())?;
                if let Some(t) = &c.filtered {
                    write!(w, ",{:.6}", t.record.angle[k].to_degrees())?;
                }
            }
            writeln!(w)?;
        }
        Ok(())
    })
}
