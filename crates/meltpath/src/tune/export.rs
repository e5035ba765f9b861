//! What leaves: the chosen controllers for drives and for whole jobs, and the responses as tables.

use meltpath_base::number::significant;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_report::series::name_in_files;
use meltpath_scan_head::axis::control::{AngleUnit, CurrentGains};
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
            let mut value = serde_json::to_value(export).unwrap_or_default();
            let current = result.tuned.gains.current;
            value["current_regulator"] = json!({
                "gain_V_per_A": current.gain,
                "integral_time_s": current.integral_time,
            });
            write_json(folder, &format!("controller-{letter}.json"), &value)?;
            folder.write(&format!("controller-{letter}.c"), |w| {
                w.write_all(acts_through(result).as_bytes())?;
                w.write_all(export.to_c().as_bytes())
            })?;
            folder.write(&format!("controller-{letter}.mat"), |w| {
                w.write_all(&export.to_mat())
            })?;
        }
        responses(folder, settings, result)?;
    }
    let value = serde_json::to_value(results.iter().map(summary).collect::<Vec<_>>());
    write_json(folder, "tuning.json", &value.unwrap_or_default())
}

/// What the drive is to be set to, as a comment of C.
fn acts_through(result: &AxisResult) -> String {
    format!(
        "/* Its output is the set-point of the current. Set the drive's current regulator, K (1 + 1/(T s)), to\n   {};\n   with another one the loop is not the one that was designed and judged. */\n\n",
        current_words(&result.tuned.gains.current)
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
