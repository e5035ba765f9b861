//! What keeps a simulated program from deciding about metal: lines that were not simulated, a wire that nobody named.

use std::fmt::Write as _;

use meltpath_base::{Check, Limit, Measure, Place, Reporter, Status};
use meltpath_deposition::section::Section;
use meltpath_geometry::Pose;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_programs::{Dialect, Gap};
use meltpath_robot::command::{Kind, Source};

use crate::waam::judge::LayerOutcome;
use crate::waam::plan::Lean;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Lines of one reason that are told by their numbers.
const SHOWN_LINES: usize = 12;

/// A reason why nothing of the metal can be said.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::waam) struct Doubt {
    /// Why.
    pub(in crate::waam) reason: String,
    /// What to do about it.
    pub(in crate::waam) remedy: String,
}

/// Where a gap is: the program, and the line as the controller numbers it.
fn place(gap: &Gap) -> Place {
    Place {
        file: Some(gap.program.clone()),
        line: Some(gap.line),
        ..Place::default()
    }
}

/// The doubt that lines which were not simulated leave; none where all were.
pub(in crate::waam) fn of_gaps(gaps: &[Gap]) -> Option<Doubt> {
    let first = gaps.first()?;
    let more = match gaps.len() {
        1 => String::new(),
        n => format!(", and {} more", n - 1),
    };
    Some(Doubt {
        reason: format!(
            "not the whole program was simulated: {}, line {}, \"{}\" ({}){more}",
            first.program, first.line, first.text, first.why
        ),
        remedy: first.why.remedy().to_owned(),
    })
}

/// The doubt that a controller leaves of which nobody says how it goes round corners, or another than the program's.
pub(in crate::waam) fn of_corners(dialect: Dialect, settings: &Settings) -> Option<Doubt> {
    let own = *settings.cell.program.dialect;
    let reason = if settings.cell.motion.is_none() {
        "the cell has no corner model: how fast its controller goes round corners is not known"
            .to_owned()
    } else if dialect != own {
        format!(
            "the program is written in {}, and the corner model of the cell is that of a controller that reads {}",
            dialect.name(),
            own.name()
        )
    } else {
        return of_speeds([settings.bead.travel_speed], settings);
    };
    Some(Doubt {
        reason,
        remedy: "name the cell of this controller (program.dialect of its file says which), and write its [motion]: meltpath measure makes it from a log of a dry run".to_owned(),
    })
}

/// How far beyond the speeds at which a corner model was identified it still counts, as a share.
const BEYOND: f64 = 0.1;

/// The doubt that a corner model leaves which was identified at other speeds than those of beads, mm/s: of the first of them.
pub(in crate::waam) fn of_speeds(
    beads: impl IntoIterator<Item = f64>,
    settings: &Settings,
) -> Option<Doubt> {
    let speeds = settings.cell.motion.as_ref()?.speeds.as_ref()?;
    let [low, high] = speeds.each_ref().map(|s| s.0);
    let known = low * (1.0 - BEYOND)..=high * (1.0 + BEYOND);
    let speed = beads.into_iter().find(|speed| !known.contains(speed))?;
    Some(Doubt {
        reason: format!(
            "the cell's corner model was identified at {low:.1} to {high:.1} mm/s (motion.speeds), and beads go at {speed:.1} mm/s"
        ),
        remedy: "log a dry run at the speed of the beads, too, and measure it (meltpath measure)"
            .to_owned(),
    })
}

/// The doubt that a bead leaves whose width and height do not hold the metal that is fed: which of them is wrong nobody knows.
pub(in crate::waam) fn of_bead(settings: &Settings) -> Option<Doubt> {
    const OFF: f64 = 0.3;
    let bead = &settings.bead;
    let section = Section::Parabola.area(bead.width.value, bead.height.value);
    let off = section / bead.area.value - 1.0;
    (off.abs() > OFF).then(|| Doubt {
        reason: format!(
            "width and height of the bead hold {section:.2} mm², the metal fed {:.2} mm²: one of them is not so",
            bead.area.value
        ),
        remedy: "waam.efficiency and waam.source.feed_factor as they were measured, the map's wire diameter, or a map of beads of your own".to_owned(),
    })
}

/// The doubt that cells leave which are coarse beside the bead.
pub(in crate::waam) fn of_cells(settings: &Settings) -> Option<Doubt> {
    const CELLS: f64 = 5.0;
    let (cell, width) = (settings.cell_size, settings.bead.width.value);
    (CELLS * cell > width).then(|| Doubt {
        reason: format!("cells of {cell} mm are coarse beside beads {width:.1} mm wide"),
        remedy: format!(
            "simulation.cell = \"{:.1} mm\" or less",
            (width / CELLS * 10.0).floor() / 10.0
        ),
    })
}

/// The doubt that woven beads leave: the model of the bead was measured on beads that are not woven.
pub(in crate::waam) fn of_weaves() -> Doubt {
    Doubt {
        reason: "beads are woven: metal is laid along the woven path, but no woven bead was measured to hold the model to".to_owned(),
        remedy: "compare the section of a woven bead with the one that the report shows".to_owned(),
    }
}

/// The doubt that waits leave among the lines by which the cell switches the arc of planned beads: whether it burns meanwhile is not known. Times
/// that the arc's own words say (ArcTech's data, `T=` of a Yaskawa) are read back with the program, and their metal is laid.
pub(in crate::waam) fn of_standing(settings: &Settings) -> Option<Doubt> {
    let program = &settings.cell.program;
    let lines = |start: &[String], end: &[String]| [start, end].map(waits);
    let [start, end] = match settings.judged() {
        Dialect::UrScript => {
            let words = program.script.as_ref()?;
            lines(&words.arc_start, &words.arc_end)
        }
        Dialect::Inform => {
            let words = program.inform.as_ref()?;
            lines(&words.arc_start, &words.arc_end)
        }
        Dialect::Val3 => {
            let words = program.val3.as_ref()?;
            lines(&words.arc_start, &words.arc_end)
        }
        Dialect::FanucLs | Dialect::Krl | Dialect::Rapid => return None,
    };
    (start + end > 0.0).then(|| Doubt {
        reason: format!(
            "by the cell's words the program stands {start:.2} s where the arc starts and {end:.2} s where it ends: metal that is laid meanwhile is not in the plan"
        ),
        remedy: "let the source see to start and crater, without waits in arc_start and arc_end; or weigh a built bead"
            .to_owned(),
    })
}

/// How long lines of an arc wait, s.
fn waits(lines: &[String]) -> f64 {
    let of = |line: &String| {
        // an output that pulses makes nothing wait
        let rest = ["sleep(", "delay(", "TIMER T="]
            .iter()
            .find_map(|word| line.split_once(word).map(|(_, rest)| rest))?;
        let number = rest
            .split(|c: char| !(c.is_ascii_digit() || c == '.'))
            .next()?;
        number.parse::<f64>().ok()
    };
    // a sum of nothing is a zero below zero
    lines.iter().filter_map(of).sum::<f64>() + 0.0
}

/// The torch may lean so far from the vertical across its bead before the bead is lopsided, rad: 10°, as along surfaces.
pub(in crate::waam) const ASIDE: f64 = 0.175;
/// It may point so far ahead or back before a bead's height is no longer that of an upright one, rad: 15°, as was tried.
pub(in crate::waam) const AHEAD: f64 = 0.262;

/// The doubt that a torch leaves which leans from the vertical by more than any bead was tried at, where a program of others says so.
pub(in crate::waam) fn of_torch(commands: &Commands) -> Option<Doubt> {
    // share of what was tried
    let lean = |down: DVec3, ahead: DVec3| {
        let along = down.dot(ahead);
        let across = (down - along * ahead).truncate().length();
        // beyond the horizontal no bead was tried at all
        let least = if down.z < 0.0 { 0.0 } else { f64::INFINITY };
        (along.abs().asin() / AHEAD)
            .max(across.min(1.0).asin() / ASIDE)
            .max(least)
    };
    let mut worst: Option<(f64, DVec3, Place)> = None;
    let mut from = commands.start;
    for (i, command) in commands.commands.iter().enumerate() {
        if matches!(command.kind, Kind::Wait { .. }) {
            continue;
        }
        if matches!(command.source, Source::On { .. }) {
            let chord = command.target - from.position;
            let arc = match command.kind {
                Kind::Arc { via } => Arc::through(from.position, via, command.target),
                _ => None,
            };
            let ahead = |t: f64| {
                let way = arc.as_ref().map_or(chord, |arc| arc.tangent(t));
                way.truncate().normalize_or_zero().extend(0.0)
            };
            for (orientation, at, ahead) in [
                (from.orientation, from.position, ahead(0.0)),
                (command.orientation, command.target, ahead(1.0)),
            ] {
                let down = orientation * DVec3::Z;
                let over = lean(down, ahead);
                if over > worst.as_ref().map_or(1.0, |w| w.0) {
                    worst = Some((over, down, commands.place(i as u32, at)));
                }
            }
        }
        from = Pose {
            position: command.target,
            orientation: command.orientation,
        };
    }
    let (_, down, place) = worst?;
    let angle = (-down.z).clamp(-1.0, 1.0).acos().to_degrees();
    let at = place.position.unwrap_or_default();
    Some(Doubt {
        reason: format!(
            "the torch (z of the tool frame) leans by {angle:.1} deg from straight down (layer {}, at {:.1}, {:.1}, {:.1} mm): metal is laid as by an upright one, and beads were tried up to {:.0} deg across and {:.0} deg along their path",
            place.layer.unwrap_or(0),
            at[0],
            at[1],
            at[2],
            ASIDE.to_degrees(),
            AHEAD.to_degrees()
        ),
        remedy: "where the tool frame of the controller is turned, write the program in one whose z goes along the wire into the part; a wall that leans is judged as a job with [surface]; or build and measure a short piece"
            .to_owned(),
    })
}

/// The doubt that a torch leaves which stands with the arc on, where most metal is laid under it, with the place.
///
/// Distances of the contact tube are read to the surface that a bead finds, and the feed of the wire was measured so: a pool's metal
/// under a torch that moves is in what was measured. A torch that stands lays as much again in the time in which its pool's metal is
/// fed (bead section times pool length); from then on the metal under it is more than any measured bead had there.
pub(in crate::waam) fn of_standing_torch(
    commands: &Commands,
    settings: &Settings,
) -> Option<(Doubt, Place)> {
    let (bead, pool) = (&settings.bead_model, &settings.pool);
    let carried = bead.area * pool.length();
    let mut worst: Option<(f64, f64, Place)> = None;
    let (mut at, mut laid, mut stood) = (commands.start.position, 0.0, 0.0);
    for (i, command) in commands.commands.iter().enumerate() {
        match (command.kind, command.source) {
            (Kind::Wait { time }, Source::On { wire_feed }) => {
                laid += time * wire_feed * bead.wire_section * bead.efficiency;
                stood += time;
                if laid > worst.as_ref().map_or(carried, |w| w.0) {
                    worst = Some((laid, stood, commands.place(i as u32, at)));
                }
            }
            (Kind::Wait { .. }, _) => (laid, stood) = (0.0, 0.0),
            _ => (at, laid, stood) = (command.target, 0.0, 0.0),
        }
    }
    let (laid, stood, place) = worst?;
    let [x, y, z] = place.position.unwrap_or_default();
    let doubt = Doubt {
        reason: format!(
            "the torch stands for {stood:.1} s with the arc on (layer {}, at {x:.1}, {y:.1}, {z:.1} mm) and lays {laid:.0} mm³ under itself, more than the {carried:.0} mm³ of a pool: how near the metal comes to the contact tube meanwhile is not simulated",
            place.layer.unwrap_or(0)
        ),
        remedy: format!(
            "end the arc before it stands, or let it stand for {:.1} s at most",
            stood * carried / laid
        ),
    };
    Some((doubt, place))
}

/// The doubt that metal leaves which leans out over all layers below.
pub(in crate::waam) fn of_lean(lean: &Lean) -> Doubt {
    Doubt {
        reason: format!(
            "from layer {} on beads lie beyond the metal that stands below them (x {:.1}, y {:.1} mm): the simulated metal holds nothing that hangs",
            lean.layer, lean.place.x, lean.place.y
        ),
        remedy: "walls that lean so far are built in practice, but not predicted here: turn the part (build_direction), thicken it below, or build a trial"
            .to_owned(),
    }
}

/// The doubt that layers leave whose beads hang out, by the map of heights: it holds nothing that hangs. A layer's ends and corners that
/// reach over an edge are no layer that hangs.
pub(in crate::waam) fn of_hanging(layers: &[LayerOutcome]) -> Option<Doubt> {
    const SHARE: f64 = 0.1;
    let mut hang = layers.iter().filter(|l| l.hanging > SHARE * l.length);
    let first = hang.next()?;
    Some(Doubt {
        reason: format!(
            "from layer {} on ({} of {} layers) beads hang out by more than a quarter of their width, there over {:.0} of {:.0} mm: the simulated metal holds nothing that hangs",
            first.layer,
            1 + hang.count(),
            layers.len(),
            first.hanging,
            first.length
        ),
        remedy: "lean the part less, turn it (build_direction), thicken it below, or build a trial"
            .to_owned(),
    })
}

/// Whether every line that shapes metal was simulated; each reason with its lines. What was not simulated is warned of, too.
pub(in crate::waam) fn lines_check(gaps: &[Gap], reporter: &Reporter) -> Check {
    for gap in gaps {
        let message = format!(
            "\"{}\" shapes metal and is not simulated: {}",
            gap.text, gap.why
        );
        reporter.warn_at("line-not-simulated", message, place(gap), gap.why.remedy());
    }
    let check = Check::judge(
        "lines",
        "lines of the program that shape metal and were not simulated",
        Measure::exact(gaps.len() as f64, ""),
        Limit::AtMost(0.0),
    );
    let Some(first) = gaps.first() else {
        return check;
    };
    Check {
        status: Status::CannotSay,
        reason: reasons(gaps),
        ..check
    }
    .at(place(first))
    .remedy(first.why.remedy())
}

/// Every reason with its lines, in the order of their first lines.
fn reasons(gaps: &[Gap]) -> String {
    let mut kinds: Vec<(String, Vec<&Gap>)> = Vec::new();
    for gap in gaps {
        let why = gap.why.to_string();
        match kinds.iter_mut().find(|(known, _)| *known == why) {
            Some((_, lines)) => lines.push(gap),
            None => kinds.push((why, vec![gap])),
        }
    }
    let mut text = String::new();
    for (why, lines) in &kinds {
        if !text.is_empty() {
            text.push_str("; ");
        }
        text.push_str(why);
        let mut program = "";
        for (k, gap) in lines.iter().take(SHOWN_LINES).enumerate() {
            // writing to a String cannot fail
            let _ = if gap.program == program {
                write!(text, ", {}", gap.line)
            } else {
                program = &gap.program;
                let before = if k == 0 { " (" } else { ", " };
                write!(text, "{before}{program} line {}", gap.line)
            };
            if k == 0 {
                let _ = write!(text, " \"{}\"", gap.text);
            }
        }
        if lines.len() > SHOWN_LINES {
            let _ = write!(text, " and {} more", lines.len() - SHOWN_LINES);
        }
        text.push(')');
    }
    text
}

/// Takes the decision from checks of the metal: what was simulated is shown, nothing passes or fails by it.
pub(in crate::waam) fn undecided(checks: &mut [Check], doubts: &[Doubt]) {
    let Some(first) = doubts.first() else {
        return;
    };
    let reasons: Vec<&str> = doubts.iter().map(|d| d.reason.as_str()).collect();
    for check in checks.iter_mut().filter(|c| c.status != Status::NotChecked) {
        check.status = Status::CannotSay;
        check.reason = reasons.join("; ");
        check.remedy = Some(first.remedy.clone());
    }
}

/// What keeps the metal from being decided about: `doubts`, and a torch that stands with the arc on where the source feeds by the distance of
/// the contact tube, since how much metal it lays is not known then.
pub(in crate::waam) fn of_metal(
    doubts: &[Doubt],
    standing: Option<&(Doubt, Place)>,
    settings: &Settings,
) -> Vec<Doubt> {
    let response = settings.deposit.feed_response;
    let answers = response.is_some_and(|r| r.slope != 0.0);
    let standing = standing.filter(|_| answers).map(|(doubt, _)| doubt);
    doubts.iter().chain(standing).cloned().collect()
}

/// Takes the decision from checks of the contact tube's distance by a torch that stands with the arc on, beside what else is doubted.
pub(in crate::waam) fn undecided_under_torch(
    checks: &mut [Check],
    doubts: &[Doubt],
    (doubt, place): (Doubt, Place),
) {
    let all = [doubts, &[doubt]].concat();
    for check in checks.iter_mut().filter(|c| c.id.starts_with("ctwd-")) {
        undecided(std::slice::from_mut(check), &all);
        if doubts.is_empty() {
            check.place = Some(place.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_programs::Missing;

    fn gap(line: u32, why: Missing) -> Gap {
        Gap {
            program: "WALL".to_owned(),
            line,
            text: format!("line {line}"),
            why,
        }
    }

    #[test]
    fn every_reason_is_told_with_its_lines() {
        let gaps = [
            gap(12, Missing::Weave),
            gap(14, Missing::Call("CLEAN".to_owned())),
            gap(40, Missing::Weave),
        ];
        let reporter = Reporter::new();
        let check = lines_check(&gaps, &reporter);
        assert_eq!(check.status, Status::CannotSay);
        assert!(
            check.reason.contains("WALL line 12 \"line 12\", 40)"),
            "{}",
            check.reason
        );
        assert!(
            check.reason.contains("program CLEAN is called"),
            "{}",
            check.reason
        );
        assert_eq!(check.place.unwrap().line, Some(12));
        assert_eq!(reporter.warnings().len(), 3);
        assert_eq!(lines_check(&[], &reporter).status, Status::Pass);
    }

    #[test]
    fn doubt_takes_every_decision() {
        let judged = |v| Check::judge("x", "X", Measure::exact(v, "mm"), Limit::AtMost(1.0));
        let mut checks = vec![
            judged(0.5),
            judged(9.0),
            Check::not_checked("r", "R", "no model"),
        ];
        undecided(
            &mut checks,
            &of_gaps(&[gap(3, Missing::Weave)])
                .into_iter()
                .collect::<Vec<_>>(),
        );
        let found: Vec<Status> = checks.iter().map(|c| c.status).collect();
        assert_eq!(
            found,
            [Status::CannotSay, Status::CannotSay, Status::NotChecked]
        );
        assert!(checks[0].reason.contains("WALL, line 3") && checks[0].remedy.is_some());
        undecided(&mut checks, &[]);
        assert!(checks[0].reason.contains("weaving"));
    }
}
