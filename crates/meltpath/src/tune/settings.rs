//! What a tuning file means: every value with its origin.

use std::path::{Path, PathBuf};

use meltpath_base::quantity::{NotNegative, Unit, parse};
use meltpath_base::{Origin, Provenance, Ratio, Resolved};
use meltpath_control::export::{AntiWindup, Word};
use meltpath_control::hinf::Template;
use meltpath_numerics::swarm::Swarm;
use meltpath_scan_head::axis::chain::Axis;
use meltpath_scan_head::axis::control::{AngleUnit, CascadeGains, Controller};
use meltpath_scan_head::files::{self, HeadData};
use meltpath_scan_head::servo::compare::{MultiStep, Scatter};
use meltpath_scan_head::servo::h_infinity::{Changes, HinfTargets, Weights};
use meltpath_scan_head::servo::model::{Loop, ServoModel};
use meltpath_scan_head::servo::refine::LOSS;
use meltpath_scan_head::servo::robust::Spread;
use meltpath_scan_head::servo::synthesis::{Target, Targets};
use toml::Spanned;

use super::file::{
    AxisName, Choice, ExportForm, RefineOn, RobustTable, TemplateTable, TuneFile, WordName,
};
use crate::job::TextError;
use crate::lpbf::settings::data_text;

/// What is asked of one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisTask {
    /// Which axis.
    pub name: AxisName,
    /// The axis as the head has it, with the motor that is tuned for.
    pub axis: Axis,
    /// Its own gains, where it has a cascade.
    pub own: Option<CascadeGains>,
    /// What the loops are to reach.
    pub targets: Targets,
    /// What the H-infinity controller is to reach.
    pub hinf: HinfTargets,
    /// The signal of the comparison.
    pub signal: MultiStep,
}

/// A resolved tuning file.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The head.
    pub data: HeadData,
    /// What is asked, one entry an axis.
    pub tasks: Vec<AxisTask>,
    /// What gains are refined for, by which swarm, on which record and mapping.
    pub refine: RefineOn,
    /// What feedback alone may lose in the refinement.
    pub refine_loss: f64,
    /// The swarm of the refinement.
    pub refine_swarm: Swarm,
    /// Record and mapping.
    pub record: Option<[PathBuf; 2]>,
    /// The motors that the robust controller serves; none for no search.
    pub spread: Option<Spread>,
    /// How the robust controller is made smaller.
    pub robust_changes: Changes,
    /// The swarm of the search.
    pub robust_swarm: Swarm,
    /// Scatter of motors.
    pub scatter: Scatter,
    /// Number of scattered motors.
    pub draws: usize,
    /// Seed.
    pub seed: u64,
    /// Which controller leaves.
    pub choice: Option<Choice>,
    /// Form, word, what is done while cut.
    pub form: ExportForm,
    /// Word.
    pub word: Word,
    /// The cut, A.
    pub limit: Option<f64>,
    /// What the states do while cut.
    pub anti_windup: AntiWindup,
    /// Sample time of the controllers, s.
    pub period: f64,
    /// Every value with its origin.
    pub provenance: Provenance,
}

const fn unit(symbol: &'static str, factor: f64) -> Unit {
    Unit {
        symbol,
        factor,
        offset: 0.0,
    }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const PULSATION: &[Unit] = &[
    unit("rad/s", 1.0),
    unit("Hz", std::f64::consts::TAU),
    unit("kHz", 1e3 * std::f64::consts::TAU),
];
const ANGULAR_SPEED: &[Unit] = &[unit("deg/s", DEGREE), unit("rad/s", 1.0)];
const CURRENT: &[Unit] = &[unit("A", 1.0), unit("mA", 1e-3)];

fn at(span: std::ops::Range<usize>, message: String) -> TextError {
    TextError {
        span: Some(span),
        message,
        help: None,
    }
}

fn quantity(text: &Spanned<String>, what: &'static str, units: &[Unit]) -> Result<f64, TextError> {
    let value = parse(text.get_ref(), what, units).map_err(|e| at(text.span(), e.to_string()))?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err(at(text.span(), format!("the {what} must be above zero")))
    }
}

/// Resolves a tuning file that lies in `folder`.
///
/// # Errors
/// [`TextError`] with the place in the file.
pub fn resolve(file: &TuneFile, folder: &Path) -> Result<Settings, TextError> {
    let mut told = Provenance::new();
    told.model(
        "synthesis in frequency, weights, refinement, comparison",
        "Rasoanarivo 2020, § 2.2.2, § 2.2.3, chapter 3",
    );
    told.model(
        "search for a spread of motors, transfer of the weights to other motors",
        "this program",
    );
    let head = &file.head;
    let data = files::parse_head(&data_text(
        "scan head",
        head,
        meltpath_data::scan_heads::ALL,
        folder,
    )?)
    .map_err(|e| {
        at(
            head.span(),
            format!("\"{}\" is not sound: {e}", head.get_ref()),
        )
    })?;
    told.parameter("head", &Resolved::new(data.head.name.clone(), Origin::Job));
    let every = told.written_or(
        "export.every",
        file.export.every,
        1,
        "every sample of the head",
    );
    if every == 0 {
        return Err(plain(
            "export.every is 0: the controller acts once in 1, 2, … samples",
        ));
    }
    let period = f64::from(every) * data.head.period;
    let names = match &file.axes {
        Some(axes) if axes.get_ref().is_empty() => {
            return Err(at(
                axes.span(),
                "no axis is named: [\"x\", \"y\"]".to_owned(),
            ));
        }
        Some(axes) => axes.get_ref().clone(),
        None => vec![AxisName::X, AxisName::Y],
    };
    let mut tasks = Vec::new();
    for name in names {
        tasks.push(task(name, file, &data, folder, period, &mut told)?);
    }
    let refine = told.written_or(
        "cascade.refine.on",
        (file.cascade.refine.on != RefineOn::default()).then_some(file.cascade.refine.on),
        RefineOn::Tracking,
        "least error of the simulated axis",
    );
    let record = match (
        refine,
        &file.cascade.refine.record,
        &file.cascade.refine.mapping,
    ) {
        (RefineOn::Record, Some(record), Some(mapping)) => Some([
            folder.join(record.get_ref()),
            folder.join(mapping.get_ref()),
        ]),
        (RefineOn::Record, ..) => {
            return Err(plain(
                "cascade.refine.on = \"record\" needs cascade.refine.record and cascade.refine.mapping",
            ));
        }
        (_, Some(one), _) | (_, _, Some(one)) => {
            return Err(at(
                one.span(),
                "a record is refined on with on = \"record\"".to_owned(),
            ));
        }
        _ => None,
    };
    let refine_swarm = Swarm {
        particles: told.written_or(
            "cascade.refine.particles",
            file.cascade.refine.particles,
            20,
            "twice the unknowns and more",
        ),
        iterations: told.written_or(
            "cascade.refine.iterations",
            file.cascade.refine.iterations,
            40,
            "a few seconds",
        ),
        ..Swarm::default()
    };
    let refine_loss = told.written_or(
        "cascade.refine.slower",
        file.cascade.refine.slower.map(|r| r.0.0),
        LOSS,
        "no less than the rule from first maximum to crossover leaves open",
    );
    if refine_loss >= 1.0 {
        return Err(plain(
            "cascade.refine.slower is 100 % or more: feedback cannot lose all of its bandwidth",
        ));
    }
    let half = 0.5 * data.head.period;
    let (spread, robust_changes, robust_swarm) = robust(&file.robust, half, &mut told);
    let c = &file.compare;
    let share = |told: &mut Provenance, key: &str, written: &Option<NotNegative<Ratio>>, d: f64| {
        told.written_or(
            key,
            written.map(|r| r.0.0),
            d,
            "a production's spread, a guess",
        )
    };
    let scatter = Scatter {
        resistance: share(&mut told, "compare.resistance", &c.resistance, 0.2),
        inertia: share(&mut told, "compare.inertia", &c.inertia, 0.05),
        modes: share(&mut told, "compare.modes", &c.modes, 0.05),
        delay: told.written_or(
            "compare.delay",
            c.delay.map(|t| t.0.0),
            half,
            "half a sample",
        ),
        noise: told.written_or(
            "compare.noise",
            c.noise.map(|a| a.0.0),
            0.0005 * DEGREE,
            "a fiftieth of the accuracy of a laboratory head",
        ),
    };
    let e = &file.export;
    let [coefficient, signal] = e.bits.unwrap_or([22, 22]);
    let word = match e.word {
        WordName::Double => Word::Double,
        WordName::Single => Word::Single,
        WordName::Fixed => Word::Fixed {
            coefficient,
            signal,
        },
    };
    if e.bits.is_some() && e.word != WordName::Fixed {
        return Err(plain(
            "export.bits are those of a fixed word: word = \"fixed\"",
        ));
    }
    if e.controller == Some(Choice::Robust) && spread.is_none() {
        return Err(plain(
            "export.controller = \"robust\", but robust.mode_shift = \"0 %\" asks for no search",
        ));
    }
    let limit = e
        .limit
        .as_ref()
        .map(|l| quantity(l, "current", CURRENT))
        .transpose()?;
    Ok(Settings {
        tasks,
        refine,
        refine_loss,
        refine_swarm,
        record,
        spread,
        robust_changes,
        robust_swarm,
        scatter,
        draws: told.written_or("compare.draws", c.draws, 40, "a few seconds"),
        seed: told.written_or("compare.seed", c.seed, 1, "any"),
        choice: e.controller,
        form: e.form,
        word,
        limit,
        anti_windup: e.anti_windup,
        period,
        provenance: told,
        data,
    })
}

fn plain(message: &str) -> TextError {
    TextError {
        span: None,
        message: message.to_owned(),
        help: None,
    }
}

fn robust(
    table: &RobustTable,
    half: f64,
    told: &mut Provenance,
) -> (Option<Spread>, Changes, Swarm) {
    let shift = told.written_or(
        "robust.mode_shift",
        table.mode_shift.map(|r| r.0.0),
        0.1,
        "a mode moves by some percent with temperature, mounting and mirror",
    );
    let delay = told.written_or(
        "robust.delay",
        table.delay.map(|t| t.0.0),
        half,
        "half a sample",
    );
    let spread = Spread {
        mode_shifts: vec![
            1.0 - shift,
            1.0 - 0.5 * shift,
            1.0,
            1.0 + 0.5 * shift,
            1.0 + shift,
        ],
        delays: if delay > 0.0 {
            vec![0.0, delay]
        } else {
            vec![0.0]
        },
        modulus_margin: told.written_or(
            "robust.modulus_margin",
            table.modulus_margin,
            0.5,
            "the usual distance",
        ),
        resonance: told.written_or("robust.resonance", table.resonance, 1.5, "3.5 dB"),
    };
    let order = told.written_or(
        "robust.order",
        table.order,
        5,
        "integrator, lead and a broad notch",
    );
    let swarm = Swarm {
        particles: told.written_or(
            "robust.particles",
            table.particles,
            16,
            "twice the unknowns",
        ),
        iterations: told.written_or("robust.iterations", table.iterations, 20, "some seconds"),
        ..Swarm::default()
    };
    let wanted = (shift > 0.0).then_some(spread);
    (wanted, Changes::Balanced { order }, swarm)
}

fn task(
    name: AxisName,
    file: &TuneFile,
    data: &HeadData,
    folder: &Path,
    period: f64,
    told: &mut Provenance,
) -> Result<AxisTask, TextError> {
    let letter = name.letter();
    let (found, written, place) = match name {
        AxisName::X => (Some(&data.head.mirrors[0]), &file.motor.x, 0),
        AxisName::Y => (Some(&data.head.mirrors[1]), &file.motor.y, 1),
        AxisName::Z => (data.head.focus.as_ref().map(|f| &f.0), &file.motor.z, 2),
    };
    let span = file.axes.as_ref().map(Spanned::span);
    let mut axis = found.cloned().ok_or_else(|| TextError {
        span,
        message: format!("the head \"{}\" has no {letter} axis", data.head.name),
        help: None,
    })?;
    if let Some(path) = written {
        let shown = path.get_ref().display();
        let text = std::fs::read_to_string(folder.join(path.get_ref()))
            .map_err(|e| at(path.span(), format!("cannot read the motor {shown}: {e}")))?;
        axis.motor = files::parse_motor(&text, &axis.motor)
            .map_err(|e| at(path.span(), format!("the motor {shown} is not sound: {e}")))?;
    }
    let own = match &axis.controller {
        Controller::Cascade(gains) => Some(*gains),
        _ => None,
    };
    let targets = loops(letter, file, data.tuning[place], &axis, own, told)?;
    let h = &file.hinf;
    let bandwidth = match &h.bandwidth {
        Some(text) => quantity(text, "bandwidth", PULSATION)?,
        None => targets.position.crossover,
    };
    told.parameter(
        &format!("{letter}.h-infinity.bandwidth"),
        &Resolved::new(
            bandwidth,
            if h.bandwidth.is_some() {
                Origin::Job
            } else {
                Origin::Default("that of the position loop".to_owned())
            },
        ),
    );
    let unit = AngleUnit::Degree;
    let mut hinf = HinfTargets::thesis_like(&axis.motor, unit, bandwidth, period)
        .map_err(|e| plain(&e.to_string()))?;
    let template = |t: &Spanned<TemplateTable>| -> Result<Template, TextError> {
        let table = t.get_ref();
        let crossover = parse(&table.crossover, "crossover", PULSATION)
            .map_err(|e| at(t.span(), e.to_string()))?;
        Template::new(table.low, table.high, crossover).map_err(|e| at(t.span(), e.to_string()))
    };
    match (&h.sensitivity, &h.command, &h.disturbance) {
        (None, None, None) => {}
        (Some(s), Some(c), Some(d)) => {
            hinf.weights = Weights {
                sensitivity: template(s)?,
                command: template(c)?,
                disturbance: template(d)?,
            };
            hinf.command_unit = 1.0;
        }
        _ => {
            return Err(plain(
                "give all three templates of [h-infinity], sensitivity, command and disturbance, or a bandwidth",
            ));
        }
    }
    if let Some(pairs) = h.pairs {
        hinf.changes = Changes::Pairs {
            pairs,
            closeness: 0.2,
        };
    }
    let c = &file.compare;
    let slope = match &c.slope {
        Some(text) => quantity(text, "speed between steps", ANGULAR_SPEED)?,
        None => 1150.0 * DEGREE,
    };
    let signal = MultiStep {
        amplitude: c.amplitude.map_or(0.9 * axis.travel, |a| a.0.0),
        levels: c.levels.unwrap_or(10),
        slope,
        hold: c.hold.map_or(60e-3, |t| t.0.0),
    };
    if signal.amplitude > axis.travel {
        return Err(plain(&format!(
            "compare.amplitude is {:.2} deg, the {letter} axis travels ±{:.2} deg",
            signal.amplitude.to_degrees(),
            axis.travel.to_degrees()
        )));
    }
    Ok(AxisTask {
        name,
        axis,
        own,
        targets,
        hinf,
        signal,
    })
}

/// What the loops of an axis are to reach.
fn loops(
    letter: char,
    file: &TuneFile,
    shipped: Option<[f64; 3]>,
    axis: &Axis,
    own: Option<CascadeGains>,
    told: &mut Provenance,
) -> Result<Targets, TextError> {
    let written = file.cascade.first_maximum.map(|t| t.map(|t| t.0.0));
    let (times, origin) = match (written, shipped, own) {
        (Some(times), ..) => (times, Origin::Job),
        (None, Some(times), _) => (times, Origin::Data("the head's file".to_owned())),
        (None, None, Some(gains)) => {
            let model = ServoModel::new(&axis.motor, &gains);
            let time = |which| model.figures(which).map(|f| 3.0 / f.crossover.omega);
            match (time(Loop::Current), time(Loop::Speed), time(Loop::Position)) {
                (Some(i), Some(w), Some(p)) => (
                    [i, w, p],
                    Origin::Computed("as fast as the head's own loops".to_owned()),
                ),
                _ => {
                    return Err(plain(&format!(
                        "the loops of the {letter} axis have no crossover: give cascade.first_maximum"
                    )));
                }
            }
        }
        (None, None, None) => {
            return Err(plain(&format!(
                "the file of the head does not say how fast the {letter} axis is to be: give cascade.first_maximum, the times of current, speed and position"
            )));
        }
    };
    told.parameter(
        &format!("{letter}.cascade.first_maximum"),
        &Resolved::new(times.to_vec(), origin),
    );
    let margins = told.written_or(
        &format!("{letter}.cascade.margin"),
        file.cascade
            .margin
            .map(|m| m.map(|a| a.0.0.to_degrees()).to_vec()),
        vec![65.0, 65.0, 75.0],
        "deg; Rasoanarivo 2020, § 2.2.2.2",
    );
    let target = |k: usize| Target::from_first_maximum(times[k], margins[k]);
    Ok(Targets {
        current: target(0),
        speed: target(1),
        position: target(2),
        ..Targets::default()
    })
}
