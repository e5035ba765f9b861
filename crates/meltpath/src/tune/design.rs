//! One axis designed in every way asked for, and each way tried on the same signal and the same scattered motors.

use super::error::{StepError, TuneError, step};

use super::file::{Choice, ExportForm};
use super::refinement;
use super::settings::{AxisTask, Settings};
use super::trial::{Trial, errors_kept, short_signal, trial};
use meltpath_base::{Observer, Reporter};
use meltpath_control::export::Exported;
use meltpath_perception::{Mapping, read};
use meltpath_scan_head::axis::chain::Axis;
use meltpath_scan_head::axis::control::{
    AngleUnit, CascadeGains, Controller, CurrentGains, FeedForward, SampledController, SampledForm,
};
use meltpath_scan_head::servo::compare::{Draw, monte_carlo};
use meltpath_scan_head::servo::h_infinity::{
    Form, HInfinityServo, LoopQuality, design as synthesise, quality, with_modes,
};
use meltpath_scan_head::servo::model::{Loop, LoopFigures, ServoModel};
use meltpath_scan_head::servo::refine::Refined;
use meltpath_scan_head::servo::robust::{RobustDesign, RobustError, search};
use meltpath_scan_head::servo::synthesis::{Tuned, tune};
use rayon::prelude::*;

/// Factors on the modes for which the distance to the critical point is drawn.
const SWEEP: usize = 25;

/// A controller and what became of it.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) choice: Choice,
    pub(crate) name: &'static str,
    pub(crate) controller: Controller,
    /// Without the pre-filter, and with it where the head has one.
    pub(crate) bare: Trial,
    pub(crate) filtered: Option<Trial>,
    pub(crate) draws: Vec<Draw>,
    /// First amplitude of the signal, rad.
    pub(crate) amplitude: f64,
    /// Factor on the modes, distance to the critical point (0 where unstable).
    pub(crate) sweep: Vec<(f64, f64)>,
    /// The smallest of them within the spread.
    pub(crate) least_distance: Option<f64>,
}

impl Candidate {
    /// Scattered motors that ran away or ring.
    pub(crate) fn lost(&self) -> usize {
        self.draws.len() - self.errors_kept().len()
    }

    /// Root mean square and largest error (rad) of the others, in ascending order.
    pub(crate) fn errors_kept(&self) -> Vec<(f64, f64)> {
        errors_kept(&self.draws, self.amplitude)
    }
}

/// All that was designed for an axis.
#[derive(Debug, Clone)]
pub(crate) struct AxisResult {
    pub(crate) task: AxisTask,
    pub(crate) tuned: Tuned,
    /// The position loop after the synthesis.
    pub(crate) position: Option<LoopFigures>,
    pub(crate) refined: Option<Refined>,
    /// The gains that the comparison uses: refined where they were.
    pub(crate) gains: CascadeGains,
    pub(crate) h_infinity: HInfinityServo,
    /// Its loop on its own motor, continuous and sampled.
    pub(crate) quality: [LoopQuality; 2],
    pub(crate) robust: Option<RobustDesign>,
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) choice: Choice,
    pub(crate) set_points: Vec<f64>,
    pub(crate) export: Option<Exported>,
    pub(crate) as_exported: Option<Trial>,
}

impl AxisResult {
    /// The candidate that leaves.
    pub(crate) fn chosen(&self) -> &Candidate {
        let found = self.candidates.iter().find(|c| c.choice == self.choice);
        // the cascade is always first
        found.unwrap_or(&self.candidates[0])
    }

    /// The feed-forward of the H-infinity structure.
    pub(crate) fn feed_forward(&self) -> FeedForward {
        self.tuned.gains.feed_forward
    }
}

/// The record that gains are refined on: set-points and angles, rad.
pub(crate) fn record(
    settings: &Settings,
    reporter: &Reporter,
) -> Result<Option<Vec<[f64; 2]>>, TuneError> {
    let Some([record, mapping]) = &settings.record else {
        return Ok(None);
    };
    let map = Mapping::load(mapping)?;
    let found = read(record, &map, reporter)?;
    let period = settings.data.head.period;
    if (found.period / period - 1.0).abs() > 1e-3 {
        return Err(TuneError::Sampling {
            found: 1e6 * found.period,
            wanted: 1e6 * period,
        });
    }
    let set_points = found.channel("set-point")?;
    let angles = found.channel("angle")?;
    Ok(Some(
        set_points
            .iter()
            .zip(angles)
            .map(|(&s, &a)| [s, a])
            .collect(),
    ))
}

/// Designs and compares.
pub(crate) fn design(
    task: &AxisTask,
    settings: &Settings,
    record: Option<&[[f64; 2]]>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<AxisResult, TuneError> {
    let letter = task.name.letter();
    let motor = &task.axis.motor;
    let period = settings.data.head.period;
    let filter = task.own.map_or(period, |g| g.feed_forward.filter);
    observer.stage("synthesis in frequency", 0);
    let tuned =
        tune(motor, &task.targets, filter).map_err(step(letter, "synthesis in frequency"))?;
    let position = ServoModel::new(motor, &tuned.gains).figures(Loop::Position);
    let refined = refinement::refined(task, settings, &tuned.gains, record, observer)?;
    let gains = match &refined {
        Some(found) => refinement::kept(task, settings, &tuned.gains, found, reporter, observer)?,
        None => tuned.gains,
    };
    observer.stage("H-infinity", 0);
    let current = tuned.gains.current;
    let unit = AngleUnit::Degree;
    let h_infinity =
        synthesise(motor, &current, unit, &task.h_infinity).map_err(step(letter, "H-infinity"))?;
    let loop_of = |form| {
        quality(
            motor,
            &current,
            unit,
            &h_infinity,
            form,
            1.0,
            task.axis.delay,
        )
    };
    let quality = [
        loop_of(Form::Continuous).map_err(step(letter, "H-infinity"))?,
        loop_of(Form::Sampled).map_err(step(letter, "H-infinity"))?,
    ];
    let robust = robust(task, settings, &tuned, reporter, observer)?;
    let set_points = task
        .signal
        .samples(period)
        .map_err(step(letter, "comparison"))?;
    let every = (settings.period / period).round() as u32;
    let state_space = |servo: &HInfinityServo| {
        Controller::Sampled(SampledController {
            form: SampledForm::Designed(servo.sampled.clone()),
            unit,
            every,
            current,
            feed_forward: tuned.gains.feed_forward,
        })
    };
    let mut ways: Vec<(Choice, &'static str, Controller, Option<&HInfinityServo>)> = vec![
        (Choice::Cascade, "cascade", Controller::Cascade(gains), None),
        (
            Choice::HInfinity,
            "H-infinity",
            state_space(&h_infinity),
            Some(&h_infinity),
        ),
    ];
    if let Some(found) = &robust {
        let law = state_space(&found.servo);
        ways.push((Choice::Robust, "robust", law, Some(&found.servo)));
    }
    let mut candidates = Vec::new();
    for (choice, name, controller, servo) in ways {
        let sweep =
            sweep(task, settings, &gains, &current, servo).map_err(step(letter, "comparison"))?;
        let mut found = candidate(task, settings, &set_points, controller, observer)?;
        found.choice = choice;
        found.name = name;
        found.least_distance = sweep.iter().map(|p| p.1).reduce(f64::min);
        found.sweep = sweep;
        candidates.push(found);
    }
    let fallback = if robust.is_some() {
        Choice::Robust
    } else {
        Choice::HInfinity
    };
    let choice = settings.file.export.controller.unwrap_or(fallback);
    let mut result = AxisResult {
        task: task.clone(),
        tuned,
        position,
        refined,
        gains,
        h_infinity,
        quality,
        robust,
        candidates,
        choice,
        set_points,
        export: None,
        as_exported: None,
    };
    if choice == Choice::Robust && result.robust.is_none() {
        result.choice = Choice::HInfinity;
    }
    leave(&mut result, settings)?;
    Ok(result)
}

/// Exports the chosen controller and runs the signal with it as exported.
fn leave(result: &mut AxisResult, settings: &Settings) -> Result<(), TuneError> {
    let letter = result.task.name.letter();
    let Controller::Sampled(designed) = &result.chosen().controller else {
        return Ok(());
    };
    let SampledForm::Designed(system) = &designed.form else {
        return Ok(());
    };
    let limit = Some(settings.limit.unwrap_or(result.task.axis.limits.current));
    let name = format!("controller_{letter}");
    let export = match *settings.file.export.form {
        ExportForm::Sections => {
            Exported::sections(&name, system, settings.word, limit, settings.anti_windup)
        }
        ExportForm::StateSpace => {
            Exported::state_space(&name, system, settings.word, limit, settings.anti_windup)
        }
    }
    .map_err(step(letter, "export"))?;
    let controller = Controller::Sampled(SampledController {
        form: SampledForm::Exported(export.clone()),
        ..designed.clone()
    });
    let axis = Axis {
        controller,
        prefilter: None,
        ..result.task.axis.clone()
    };
    let trial = trial(&axis, &result.set_points, settings)
        .map_err(step(letter, "export, simulated as exported"))?;
    result.as_exported = Some(trial);
    result.export = Some(export);
    Ok(())
}

fn robust(
    task: &AxisTask,
    settings: &Settings,
    tuned: &Tuned,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Option<RobustDesign>, TuneError> {
    let Some(spread) = &settings.spread else {
        return Ok(None);
    };
    let letter = task.name.letter();
    match search(
        &task.axis.motor,
        &tuned.gains.current,
        AngleUnit::Degree,
        spread,
        task.h_infinity.crossover,
        settings.robust_changes,
        settings.period,
        &settings.robust_swarm,
        observer,
    ) {
        Ok(found) => Ok(Some(found)),
        Err(e @ RobustError::OutOfReach { .. }) => {
            reporter.warn(
                "robust-out-of-reach",
                format!("{}: {e}", letter.to_ascii_uppercase()),
                "more iterations, a smaller robust.mode_shift, or a lower bandwidth",
            );
            Ok(None)
        }
        Err(e) => Err(step(letter, "search for a spread of motors")(e)),
    }
}

fn candidate(
    task: &AxisTask,
    settings: &Settings,
    set_points: &[f64],
    controller: Controller,
    observer: &dyn Observer,
) -> Result<Candidate, TuneError> {
    let letter = task.name.letter();
    let bare = Axis {
        controller: controller.clone(),
        prefilter: None,
        ..task.axis.clone()
    };
    let with = task.axis.prefilter.map(|filter| Axis {
        prefilter: Some(filter),
        ..bare.clone()
    });
    let failed = "comparison on the multi-step";
    let (one, two) = rayon::join(
        || trial(&bare, set_points, settings),
        || {
            with.as_ref()
                .map(|axis| trial(axis, set_points, settings))
                .transpose()
        },
    );
    let draws = if *settings.file.compare.draws == 0 {
        Vec::new()
    } else {
        // what scatters is how the axis arrives
        let samples = short_signal(task, settings).map_err(step(letter, failed))?;
        monte_carlo(
            &bare,
            &samples,
            settings.data.head.period,
            &settings.scatter,
            *settings.file.compare.draws,
            *settings.file.compare.seed,
            observer,
        )
        .map_err(step(letter, "scattered motors"))?
    };
    Ok(Candidate {
        choice: Choice::Cascade,
        name: "",
        controller,
        bare: one.map_err(step(letter, failed))?,
        filtered: two.map_err(step(letter, failed))?,
        draws,
        amplitude: task.signal.amplitude,
        sweep: Vec::new(),
        least_distance: None,
    })
}

/// Distance to the critical point over moved modes: of the sampled loop, or of the cascade's continuous outer loop.
fn sweep(
    task: &AxisTask,
    settings: &Settings,
    gains: &CascadeGains,
    current: &CurrentGains,
    servo: Option<&HInfinityServo>,
) -> Result<Vec<(f64, f64)>, StepError> {
    let Some(spread) = &settings.spread else {
        return Ok(Vec::new());
    };
    let (low, high) = (
        spread.mode_shifts.first().copied().unwrap_or(1.0),
        spread.mode_shifts.last().copied().unwrap_or(1.0),
    );
    (0..SWEEP)
        .into_par_iter()
        .map(|k| {
            let shift = low + (high - low) * k as f64 / (SWEEP - 1) as f64;
            let distance = if let Some(servo) = servo {
                let found = quality(
                    &task.axis.motor,
                    current,
                    AngleUnit::Degree,
                    servo,
                    Form::Sampled,
                    shift,
                    task.axis.delay,
                )?;
                (found.stable, found.modulus_margin)
            } else {
                let moved = with_modes(&task.axis.motor, shift);
                let model = ServoModel::new(&moved, gains);
                let closed = model.closed_loop()?;
                let stable = closed
                    .is_stable()
                    .map_err(meltpath_control::SystemError::from)?;
                let modulus = model
                    .figures(Loop::Position)
                    .map_or(1.0, |f| f.margins.modulus.value);
                (stable, modulus)
            };
            Ok((shift, if distance.0 { distance.1 } else { 0.0 }))
        })
        .collect()
}
