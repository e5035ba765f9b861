//! Whole jobs with another controller than the head's own: H-infinity for its motors, or a file that a tuning exported.

use std::path::Path;

use meltpath_base::Provenance;
use meltpath_base::settings::{Problem, Setting};
use meltpath_scan_head::axis::chain::Axis;
use meltpath_scan_head::axis::control::{AngleUnit, Controller, SampledController, SampledForm};
use meltpath_scan_head::axis::error::AxisError;
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::prepared::Layers;
use meltpath_scan_head::head::ready::ReadyHead;
use meltpath_scan_head::head::scan_head::ScanHead;
use meltpath_scan_head::servo::file::ControllerFile;
use meltpath_scan_head::servo::h_infinity::{HInfinityTargets, design};
use meltpath_scan_head::servo::model::{Loop, ServoModel};
use meltpath_scan_head::servo::preview::{PreviewDesign, preview, synchronise};

use crate::job::lpbf::{PathChoice, PreFilterChoice};

/// The controller of the head's own file.
pub(crate) const OWN: &str = "cascade";
/// H-infinity with the thesis' weights moved to each motor.
pub(crate) const HINF: &str = "h-infinity";

/// Puts the wanted controllers into a head. `tuning` tells how fast its loops are meant to be. Returns the axes whose controller was
/// made for another motor.
///
/// # Errors
/// [`Problem`] with the place in the job.
pub fn apply(
    head: &mut ScanHead,
    tuning: &[Option<[f64; 3]>; 3],
    wanted: &Setting<String>,
    prefilter: &Setting<Option<PreFilterChoice>>,
    folder: &Path,
    provenance: &mut Provenance,
) -> Result<Vec<char>, Problem> {
    let name = wanted.as_str();
    let failed = |message: String| wanted.problem(message);
    let path = Path::new(name);
    let is_file = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("json"));
    let others = match name {
        OWN => Vec::new(),
        HINF => {
            let period = head.period;
            for (axis, (letter, times)) in
                head.mirrors.iter_mut().zip(['X', 'Y'].iter().zip(tuning))
            {
                let told =
                    |e: String| failed(format!("{letter} axis: no H-infinity controller: {e}"));
                let unknown = || told(AxisError::DataSheet.to_string());
                let axis = axis.driven_mut().ok_or_else(unknown)?;
                axis.controller = h_infinity(axis, *times, period).map_err(told)?;
            }
            Vec::new()
        }
        _ if is_file => {
            let shown = path.display();
            let text = std::fs::read_to_string(folder.join(path))
                .map_err(|e| failed(format!("cannot read the controllers {shown}: {e}")))?;
            let file: ControllerFile = serde_json::from_str(&text)
                .map_err(|e| failed(format!("{shown} is no file of axis controllers: {e}")))?;
            file.apply(head)
                .map_err(|e| failed(format!("{shown}: {e}")))?
        }
        _ => {
            return Err(failed(format!(
                "there is no controller \"{name}\"; known are \"{OWN}\", \"{HINF}\"; or name the controllers.json of a tuning"
            )));
        }
    };
    let usual = if name == OWN {
        PreFilterChoice::On
    } else {
        PreFilterChoice::Off
    };
    match prefilter.or_computed(provenance, usual) {
        PreFilterChoice::On => {}
        PreFilterChoice::FirstOnly => head.filter_acceleration(),
        PreFilterChoice::Alike => head.filter_alike(),
        PreFilterChoice::Off => {
            for axis in head.driven_mirrors() {
                axis.prefilter = None;
            }
            if let Some(axis) = head.focus.as_mut().and_then(|(axis, _)| axis.driven_mut()) {
                axis.prefilter = None;
            }
        }
    }
    Ok(others)
}

/// The time within which changes of the mirrors' speeds add up for the drives, s.
const TOGETHER: f64 = 0.5e-3;

/// A head made ready for a job, with the filters of its mirrors' set-points that a choice asks for.
///
/// # Errors
/// [`HeadError`].
pub fn ready_for(
    ready: &ReadyHead,
    path: PathChoice,
    job: Layers<'_>,
) -> Result<ReadyHead, HeadError> {
    let head = ready.head();
    let axes =
        || -> Result<_, AxisError> { Ok([head.mirrors[0].motor()?, head.mirrors[1].motor()?]) };
    let design = PreviewDesign::default();
    let previews = match path {
        PathChoice::AsCommanded => return Ok(ready.clone()),
        PathChoice::Synchronised => axes().and_then(|axes| synchronise(axes, head.period, &design)),
        PathChoice::Preview => {
            let changes = ready.speed_changes(job, TOGETHER)?;
            axes().and_then(|axes| preview(axes, head.period, changes, &design))
        }
    };
    let named = |source| HeadError::Axis { axis: 'X', source };
    Ok(ready.clone().with_previews(previews.map_err(named)?))
}

/// An H-infinity controller for an axis: the thesis' weights at the bandwidth that its position loop is meant to have, with the
/// current regulator and the feed-forward of its cascade.
fn h_infinity(axis: &Axis, times: Option<[f64; 3]>, period: f64) -> Result<Controller, String> {
    let Controller::Cascade(gains) = &axis.controller else {
        return Err("the head's file has no cascade to take the current regulator from".to_owned());
    };
    let unit = AngleUnit::Degree;
    let own = || {
        ServoModel::new(&axis.motor, gains)
            .figures(Loop::Position)
            .map(|f| f.crossover.omega)
    };
    let bandwidth = times
        .map(|t| 3.0 / t[2])
        .or_else(own)
        .ok_or("its position loop has no crossover")?;
    let targets = HInfinityTargets::for_motor(&axis.motor, unit, bandwidth, period)
        .map_err(|e| e.to_string())?;
    let servo = design(&axis.motor, &gains.current, unit, &targets).map_err(|e| e.to_string())?;
    Ok(Controller::Sampled(SampledController {
        form: SampledForm::Designed(servo.sampled),
        unit,
        every: 1,
        current: gains.current,
        feed_forward: gains.feed_forward,
    }))
}
