//! The bead that a job weaves: what can be woven, and how wide and high the plan takes it to be.
//!
//! No woven bead was measured for the models here. The plan takes it as wide as the bead that is not woven and the swing to both sides,
//! or as wide as the job says, and as high as the same metal makes it then. The bounds below are rules of our own.

use meltpath_base::settings::{Problem, Setting};
use meltpath_base::{Length, Origin, Provenance, Reporter, Resolved};
use meltpath_deposition::process_map::{Bead, Estimate};
use meltpath_deposition::section::Section;
use meltpath_robot::controller::Controller;
use meltpath_robot::weave::reached;
use meltpath_toolpath::Weave;

use crate::job::waam::WeaveTable;

/// Farthest swing to one side, widths of the bead: beyond it two beads side by side lay as much.
const FARTHEST: f64 = 1.0;
/// Least share of the swing that the filters of a controller may leave.
const LEAST_REACHED: f64 = 0.5;
/// Share of the swing below which it is told.
const TOLD_BELOW: f64 = 0.95;

/// A bead that is woven.
#[derive(Debug, Clone, Copy)]
pub(super) struct Woven {
    pub(super) weave: Weave,
    /// What the plan takes it for.
    pub(super) bead: Bead,
}

/// The swing that a table says.
fn weave(table: &WeaveTable) -> Weave {
    Weave {
        shape: *table.shape,
        frequency: table.frequency.0 / std::f64::consts::TAU,
        amplitude: table.amplitude.0,
        dwell: [table.dwell_left.0, table.dwell_right.0],
    }
}

/// The woven bead of a job whose straight one is `plain`; nothing where the job does not weave.
///
/// # Errors
/// [`Problem`] where the swing is too wide or too slow to make one bead, or measured narrower than it swings.
pub(super) fn woven(
    table: &Setting<Option<WeaveTable>>,
    plain: &Bead,
) -> Result<Option<Woven>, Problem> {
    let Some(said) = &**table else {
        return Ok(None);
    };
    let weave = weave(said);
    let width = plain.width.value;
    if weave.amplitude > FARTHEST * width {
        let message = format!(
            "{} is {:.2} mm: a bead {width:.2} mm wide swings no farther than its width to each side",
            said.amplitude.name, weave.amplitude
        );
        let help = "swing less, or lay beads side by side (fill.stepover)";
        return Err(said.amplitude.problem(message).help(help));
    }
    let period = 1.0 / weave.frequency + weave.dwell[0] + weave.dwell[1];
    let apart = plain.travel_speed * period;
    if apart > width {
        let message = format!(
            "swings lie {apart:.2} mm apart along the path ({:.1} mm/s, one in {period:.2} s), farther than the bead is wide ({width:.2} mm): they would not run together",
            plain.travel_speed
        );
        let help = "weave faster, dwell less, or travel more slowly (waam.bead.travel_speed)";
        return Err(said.frequency.problem(message).help(help));
    }
    let swings = width + 2.0 * weave.amplitude;
    let wide = said.bead_width.map_or(swings, |w| w.0);
    if !(width..=width + 4.0 * weave.amplitude).contains(&wide) {
        let message = format!(
            "{} is {wide:.2} mm: it lies between {width:.2} mm, the bead that is not woven, and {:.2} mm",
            said.bead_width.name,
            width + 4.0 * weave.amplitude
        );
        let help = "measure a woven bead, or leave the key out";
        return Err(said.bead_width.problem(message).help(help));
    }
    let same = |value: f64, of: Estimate| Estimate {
        value,
        sigma: of.sigma / of.value * value,
    };
    let high = Section::Parabola.height(wide, plain.area.value);
    Ok(Some(Woven {
        weave,
        bead: Bead {
            width: same(wide, plain.width),
            height: same(high, plain.height),
            ..*plain
        },
    }))
}

/// Refuses a swing that the controller's filters would take away, and tells what they leave of it.
///
/// # Errors
/// [`Problem`] where they leave less than half.
fn followed(
    said: &WeaveTable,
    weave: &Weave,
    controller: &Controller,
    reporter: &Reporter,
) -> Result<(), Problem> {
    let share = reached(weave, controller);
    let [t1, t2] = [&controller.t1, &controller.t2].map(|t| 1e3 * t.value.0);
    if share < LEAST_REACHED {
        let message = format!(
            "{:.2} Hz is too fast for this controller: if its filters of {t1:.0} and {t2:.0} ms act on the swing, they leave {:.0} % of it",
            weave.frequency,
            100.0 * share
        );
        let help = "weave more slowly, or identify the controller anew (motion.t1, motion.t2 of the cell file)";
        return Err(said.frequency.problem(message).help(help));
    }
    if share < TOLD_BELOW {
        reporter.warn(
            "weave-damped",
            format!(
                "the controller may draw less of the weave than it is told: {:.2} mm of {:.2} mm to each side, if its filters of {t1:.0} and {t2:.0} ms act on the swing; it is simulated in full",
                share * weave.amplitude,
                weave.amplitude
            ),
            "look at a record of the tool, and give the amplitude that draws what you want",
        );
    }
    Ok(())
}

/// Records what the plan takes a woven bead for, and tells what the controller may leave of the swing.
///
/// # Errors
/// [`Problem`] where its filters would take the swing away.
pub(super) fn tell(
    table: &Setting<Option<WeaveTable>>,
    woven: Option<&Woven>,
    controller: Option<&Controller>,
    (reporter, r): (&Reporter, &mut Provenance),
) -> Result<(), Problem> {
    let (Some(said), Some(woven)) = (&**table, woven) else {
        return Ok(());
    };
    if let Some(controller) = controller {
        followed(said, &woven.weave, controller, reporter)?;
    }
    let rule = "bead that is not woven and the swing to both sides: an assumption of our own, no woven bead was measured";
    let wide = if said.bead_width.is_written() {
        Origin::Job
    } else {
        Origin::Computed(rule.to_owned())
    };
    let (width, height) = (woven.bead.width.value, woven.bead.height.value);
    r.value(&said.bead_width.name, Resolved::new(Length(width), wide));
    let high = "the same metal under a parabola of the woven bead's width";
    let high = Resolved::new(Length(height), Origin::Computed(high.to_owned()));
    r.value("waam.bead.weave.bead_height", high);
    Ok(())
}
