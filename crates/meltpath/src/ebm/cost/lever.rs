//! What a job asks for that no machine could do, and which of its settings asks for it.

use std::fmt::Display;
use std::ops::Range;

use meltpath_base::Length;
use meltpath_base::settings::{Problem, Setting};

use super::words::{memory, time};
use crate::ebm::settings::{Judge, Settings};
use crate::job::ebm::EbmJob;

/// The longest that a run is begun for, s of one core: a year. What takes longer is a slip.
pub(crate) const LONGEST: f64 = 365.0 * 86_400.0;
/// Area of a large section, mm².
const LARGE: f64 = 1e4;
/// Duration of the path of a large section, s.
const LONG: f64 = 60.0;

/// A setting that makes something large.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lever {
    span: Option<Range<usize>>,
    /// What it is, in words.
    says: String,
    /// How many times more it asks for than a usual value would.
    times: f64,
    help: String,
}

impl Lever {
    /// A setting that asks for `times` as much as usual.
    pub(crate) fn of<T: Display>(setting: &Setting<T>, times: f64, help: &str) -> Self {
        Lever {
            says: format!("{} is {}", setting.name, setting.value),
            span: setting.span.clone(),
            // a default is never to blame
            times: if setting.is_written() { times } else { 0.0 },
            help: help.to_owned(),
        }
    }

    /// The same of a setting that may be absent.
    pub(crate) fn of_some<T: Display>(
        setting: &Setting<Option<T>>,
        times: f64,
        help: &str,
    ) -> Option<Self> {
        let value = setting.as_ref()?;
        Some(Lever {
            says: format!("{} is {value}", setting.name),
            span: setting.span.clone(),
            times,
            help: help.to_owned(),
        })
    }

    /// What is drawn, which reaches over `size` mm.
    pub(crate) fn of_extent((name, span): (&str, Option<Range<usize>>), size: [f64; 2]) -> Self {
        let [width, height] = size;
        Lever {
            says: format!("{name} reaches over {width:.0} x {height:.0} mm"),
            span,
            times: (width * height / LARGE).max(1.0),
            help: "is it in mm? else a smaller section or region, or larger cells".to_owned(),
        }
    }

    /// A path that takes `seconds` in all, with the beam on for `lit` of them; it asks for `times` as much as a short one.
    pub(crate) fn of_duration(
        span: Option<Range<usize>>,
        [seconds, lit]: [f64; 2],
        times: f64,
    ) -> Self {
        let shown = |s: f64| meltpath_base::number::significant(s, 3);
        Lever {
            says: format!(
                "the beam path takes {} s, with the beam on for {} of them",
                shown(seconds),
                shown(lit)
            ),
            span,
            times,
            help: "are its times in s? leave waits out of it: judge.between is the time from layer to layer".to_owned(),
        }
    }

    /// Whether it asks for more than usual.
    pub(super) fn asks_more(&self) -> bool {
        self.times > 1.0
    }

    /// The same lever where it makes something else `times` as large, which `help` mends too.
    pub(super) fn scale_to(&mut self, times: f64, help: &str) {
        self.times = times;
        self.help.push_str(help);
    }
}

/// What something needs, and what there is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Need {
    /// Bytes, of so many.
    Memory([f64; 2]),
    /// Seconds of one core.
    Time(f64),
}

impl Need {
    /// The need and the bound that it passes, in words; `None` where it passes none.
    fn passed(self) -> Option<[String; 2]> {
        match self {
            Need::Memory([needed, most]) => (needed.is_nan() || needed > most).then(|| {
                [
                    format!("{} of memory", memory(needed)),
                    format!("this machine has {}", memory(most)),
                ]
            }),
            Need::Time(seconds) => (seconds.is_nan() || seconds > LONGEST).then(|| {
                [
                    format!("{} of one core", time(seconds)),
                    "nothing is begun that takes more than a year".to_owned(),
                ]
            }),
        }
    }
}

/// Why `what` is not begun: by the setting that asks for most.
pub(crate) fn refused(
    what: &str,
    need: Need,
    levers: impl IntoIterator<Item = Lever>,
) -> Option<Problem> {
    let [much, bound] = need.passed()?;
    let worst = levers
        .into_iter()
        .reduce(|a, b| if b.times > a.times { b } else { a });
    let asks = format!("{what} would take {much}, and {bound}");
    Some(match worst {
        Some(Lever {
            span, says, help, ..
        }) => Problem::new(format!("{says}: {asks}")).at(span).help(help),
        None => Problem::new(asks),
    })
}

/// What is drawn, with its place in the job.
pub(super) fn subject(job: &EbmJob) -> (&'static str, Option<Range<usize>>) {
    if job.path.is_written() {
        ("the beam path", job.path.span.clone())
    } else if job.part.is_written() {
        ("the section of the part", job.part.span.clone())
    } else {
        ("region.contour", job.region.contour.span.clone())
    }
}

/// What makes the judge's memory large.
pub(super) fn of_room(job: &EbmJob, judge: &Judge) -> Vec<Lever> {
    let table = &job.judge;
    let plate = match *table.ground {
        crate::job::ebm::JudgeGround::Plate => judge.plate / 10.0,
        _ => 0.0,
    };
    vec![
        Lever::of(
            &table.cell,
            (0.031_25 / table.cell.0).powi(2),
            "a larger one; left out it is 0.03125 mm, a quarter of the usual distance of lines",
        ),
        Lever::of(
            &table.planes,
            f64::from(*table.planes),
            "fewer: the judge tells what twice as many change",
        ),
        Lever::of(
            &table.plate,
            plate,
            "is it in mm? a usual plate is 10 mm thick",
        ),
        layer(&job.ebm.layer, 0.05 / job.ebm.layer.0),
    ]
}

/// A layer that is thinner than usual, and makes something `times` as large.
pub(crate) fn layer(layer: &Setting<Length>, times: f64) -> Lever {
    let help = "is it in mm? usual layers are 0.02 to 0.1 mm thick";
    Lever::of(layer, times, help)
}

/// Points of charts that lie nearer together than usual: each makes steps shorter, too.
pub(crate) fn spacing(spacing: &Setting<Length>) -> Lever {
    let help = "a larger one; left out it is 0.025 mm, converged within 2 °C of mean error";
    Lever::of(spacing, (0.025 / spacing.0).powi(3), help)
}

/// Voxels that are smaller than usual.
pub(super) fn voxel(job: &EbmJob) -> Lever {
    let voxel = &job.simulation.voxel;
    let help = "a larger one; left out it is 0.057 mm";
    Lever::of(voxel, (0.057 / voxel.0).powi(2), help)
}

/// A beam that enters deeper than usual.
pub(super) fn penetration(job: &EbmJob) -> Lever {
    let penetration = &job.ebm.penetration;
    let help = "is it in mm? electrons of 60 kV enter steel and titanium by 0.01 to 0.1 mm";
    Lever::of(penetration, penetration.0 / 0.1, help)
}

/// What makes paths long in time, as shares of a large section's.
pub(super) fn of_time(settings: &Settings, [seconds, lit]: [f64; 2]) -> Vec<Lever> {
    let job = &settings.job;
    let mut levers = vec![Lever::of(
        &job.ebm.layers,
        f64::from(*job.ebm.layers),
        "fewer layers: a few show whether the last one is as hot as the one before",
    )];
    let Some(table) = job.hatch.as_ref() else {
        let span = job.path.span.clone();
        levers.push(Lever::of_duration(span, [seconds, lit], seconds / LONG));
        return levers;
    };
    let usual = 0.125 / 980.0;
    let dwell = table.dwell.map_or(0.0, |dwell| dwell.0 / usual);
    levers.extend(Lever::of_some(
        &table.dwell,
        dwell,
        "is it in s? a spot usually takes a fraction of a millisecond to some milliseconds",
    ));
    levers.push(Lever::of(
        &table.speed,
        980.0 / table.speed.0,
        "is it in mm/s? usual lines run at 100 to 10 000 mm/s",
    ));
    levers.extend(Lever::of_some(
        &table.jump,
        table.jump.map_or(0.0, |jump| 980.0 / jump.0),
        "is it in mm/s? left out, jumps take no time",
    ));
    levers.push(Lever::of(
        &table.spacing,
        0.125 / table.spacing.0,
        "a larger one: usual lines lie 0.1 to 0.3 mm apart",
    ));
    levers
}
