//! Checks of the plan and of the program, and the facts that a verdict tells beside them.

use std::collections::BTreeSet;

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};
use meltpath_geometry::math::DVec2;
use meltpath_programs::Dialect;
use meltpath_robot::cell::Arrangement;
use meltpath_robot::command::Source;
use meltpath_toolpath::{Channel, Toolpath};

use crate::waam::plan::Plan;
use crate::waam::plan::heights::{ASSEMBLED, EDGE_BEADS, assembled};
use crate::waam::program::{Commands, Programs};
use crate::waam::settings::machine::nominal_distance;
use crate::waam::settings::{Borrowed, Settings};
use crate::waam::surface::held::plate_on_table;

/// How far layers hang over.
pub(crate) fn overhang_check(plan: &Plan, settings: &Settings) -> Check {
    let width = settings.bead.width.value;
    let unsupported = plan.overhangs.iter().find(|o| o.shift.is_none());
    let (shift, found) = match (unsupported, plan.shift) {
        (Some(o), _) => (f64::INFINITY, Some((o.slice, o.place))),
        (None, Some(s)) => (s.shift, Some((s.slice, s.place))),
        (None, None) => (0.0, None),
    };
    let overhang = Check::judge(
        "overhang",
        "overhang: largest shift of a layer over the one below, in bead widths",
        Measure::exact(100.0 * shift / width, "%"),
        Limit::AtMost(100.0 * settings.limits.overhang),
    );
    let Some((slice, place)) = found else {
        return overhang;
    };
    let place = Place {
        position: Some(place.to_array()),
        layer: Some(slice as u32 + 1),
        ..Place::default()
    };
    let mut overhang = overhang.at(place).remedy("turn the part (build_direction), or thicken it below: the height map is not valid where beads hang over");
    if unsupported.is_some() {
        overhang.status = Status::Fail;
        "a piece of the layer has nothing below it".clone_into(&mut overhang.reason);
    }
    overhang
}

/// What is known of the bead from another wire alone: nothing can be said of metal that it lays.
pub(crate) fn borrowed_check(settings: &Settings) -> Option<Check> {
    let Borrowed { pool, pursuit } = &settings.borrowed;
    let wire = &*settings.wire.name;
    let stands_in = |what: &str, from: &String| {
        format!("{what} of {wire} was not measured: that of {from}, another wire, stands in for it")
    };
    let pool_why = pool.as_ref().map(|from| stands_in("the weld pool", from));
    let what = "how far the bead stays behind the torch at corners";
    let pursuit_why = pursuit.as_ref().map(|from| stands_in(what, from));
    let remedy = match (&pool_why, &pursuit_why) {
        (None, None) => return None,
        (Some(_), None) => "measure the pool of this wire by camera, and name its file: waam.pool",
        (None, Some(_)) => {
            "scan beads with corners (`meltpath measure`), and name the file that it writes: waam.pursuit"
        }
        (Some(_), Some(_)) => {
            "measure the pool of this wire by camera, and name its file: waam.pool; scan beads with corners (`meltpath measure`), and name the file that it writes: waam.pursuit"
        }
    };
    let why: Vec<String> = pool_why.into_iter().chain(pursuit_why).collect();
    let why = why.join("; ");
    let title = "properties of the bead taken from another wire";
    let check = Check {
        status: Status::CannotSay,
        ..Check::not_checked("borrowed", title, &why)
    };
    Some(check.remedy(remedy))
}

/// Beads change with the temperature of what they are laid on, which nothing here simulates.
pub(crate) fn heat_check() -> Check {
    Check::not_checked(
        "heat",
        "temperature of the metal between layers",
        "no heat is simulated: beads are taken to be as those that were measured, on metal as cold as theirs was",
    )
    .remedy("pause as long as when the beads were measured (layers.pause), or wait until a layer has cooled (layers.until = \"cooled\")")
}

/// Programs for a torch that stands, in dialects whose words for it are not known here; nothing where all are written with them.
pub(crate) fn fixed_torch_check(dialects: &[Dialect], settings: &Settings) -> Option<Check> {
    let cell = settings.robot.as_ref()?;
    let unknown = dialects
        .iter()
        .filter(|d| !d.has_words_for_a_standing_torch());
    let unknown: BTreeSet<&str> = unknown.map(|d| d.name()).collect();
    if cell.arrangement == Arrangement::TorchOnRobot || unknown.is_empty() {
        return None;
    }
    let names: Vec<&str> = unknown.into_iter().collect();
    let title = "programs for a torch that stands while the robot moves the part";
    let why = format!(
        "{}: positions are those of the wire's tip in the part; in which words and frames this controller leads a part to a tool that stands is not known here, and by plain poses it would hold another speed than the wire's over the part",
        names.join(", ")
    );
    let check = Check {
        status: Status::CannotSay,
        ..Check::not_checked("fixed-torch", title, &why)
    };
    Some(check.remedy("set the tool that stands and the part held by the robot at the controller, and dry-run before the arc burns"))
}

/// A contact tube distance for which the tool frame of the cell is not set, mm: programs lead the wire's tip, and where that is the tool says.
/// Nothing where both agree.
pub(crate) fn tool_check(settings: &Settings) -> Option<Check> {
    /// What a wire is cut to, mm.
    const SAME: f64 = 0.5;
    let (tool, job) = (nominal_distance(&settings.cell), settings.ctwd);
    if (tool - job).abs() <= SAME {
        return None;
    }
    let why = format!(
        "the job works at a contact tube distance of {job:.1} mm, and the cell's tool frame is set at {tool:.1} mm: programs say where the wire's tip goes, and a controller whose tool is as the cell says leads it {:.1} mm {}",
        (tool - job).abs(),
        if tool > job { "too high" } else { "too low" }
    );
    let check = Check {
        status: Status::CannotSay,
        ..Check::not_checked(
            "tool-distance",
            "contact tube distance of the job at the cell's tool frame",
            &why,
        )
    };
    Some(check.remedy("set the controller's tool frame at the job's distance, and write that as program.contact_tube_distance of the cell file; or leave machine.ctwd out"))
}

/// A stretch of bead: wire feed as set and travel speed, mm/s, length, mm, and where it is.
pub(crate) struct Stretch {
    pub(crate) wire_feed: f64,
    pub(crate) speed: f64,
    pub(crate) length: f64,
    pub(crate) place: Place,
}

/// Whether beads are laid at settings that the process map was not made of; `None` where none is.
pub(crate) fn range_check(
    beads: impl Iterator<Item = Stretch>,
    settings: &Settings,
) -> Option<Check> {
    let (mut all, mut outside, mut first) = (0.0, 0.0, None);
    for bead in beads {
        all += bead.length;
        if !settings.map.covers(bead.wire_feed, bead.speed) {
            outside += bead.length;
            first.get_or_insert(bead);
        }
    }
    let first = first?;
    let per_minute = |v: f64| 0.06 * v;
    let check = Check::judge(
        "range",
        "beads laid at settings outside the process map",
        Measure::exact(100.0 * outside / all, "%"),
        Limit::AtMost(0.0),
    );
    let reason = format!(
        "first at {:.2} m/min wire feed and {:.3} m/min travel; {}",
        per_minute(first.wire_feed),
        per_minute(first.speed),
        settings.map.reach_around(first.wire_feed, first.speed)
    );
    let check = Check {
        status: Status::CannotSay,
        reason,
        ..check
    };
    Some(
        check
            .at(first.place)
            .remedy("a waam.bead, or a weld schedule of the program, inside the map; or beads measured there and added to it"),
    )
}

/// The stretches of a program.
pub(crate) fn programmed(
    commands: &Commands,
    settings: &Settings,
) -> impl Iterator<Item = Stretch> {
    let factor = settings.feed_factor();
    let starts =
        std::iter::once(commands.start.position).chain(commands.commands.iter().map(|c| c.target));
    let layers = commands.layer_of_command.iter();
    let beads = commands.bead_of_command.iter();
    let moves = commands.commands.iter().zip(starts).zip(layers.zip(beads));
    moves.filter_map(
        move |((command, from), (layer, bead))| match command.source {
            Source::On { wire_feed } if command.target != from => Some(Stretch {
                wire_feed: wire_feed / factor,
                speed: command.speed,
                length: command.target.distance(from),
                place: Place {
                    layer: Some(*layer),
                    bead: *bead,
                    ..Place::at(from.to_array())
                },
            }),
            _ => None,
        },
    )
}

/// The stretches of a plan.
pub(crate) fn planned(toolpath: &Toolpath) -> impl Iterator<Item = Stretch> {
    let profiles = &toolpath.profiles;
    let laid = toolpath.passes().filter(|p| p.head.role.deposits());
    laid.flat_map(move |pass| {
        let profile = profiles.get(usize::from(pass.head.profile));
        let usual = profile.map_or([f64::NAN; 2], |p| [p.wire_feed, p.speed]);
        let of = move |channel, i, usual| pass.value(channel, i).unwrap_or(usual);
        (0..pass.move_count()).map(move |i| Stretch {
            wire_feed: of(Channel::WireFeed, i, usual[0]),
            speed: of(Channel::Speed, i, usual[1]),
            length: pass.move_length(i),
            place: Place {
                layer: Some(pass.layer),
                bead: Some(pass.place().number),
                ..Place::at(pass.points[i].to_array())
            },
        })
    })
}

/// What the plan tells: area without a bead, growth by a second opinion.
pub(crate) fn plan_facts(plan: &Plan, settings: &Settings) -> Vec<Fact> {
    vec![coverage(plan), assembly(plan, settings)]
}

/// Area that no bead covers, and its largest place.
fn coverage(plan: &Plan) -> Fact {
    let area: f64 = plan.coverage.iter().map(|(_, c)| c.area).sum();
    let lack = plan
        .coverage
        .iter()
        .fold(0.0, |sum, (_, c)| sum + c.lack_area);
    let gap = plan
        .coverage
        .iter()
        .flat_map(|(layer, c)| c.gaps.iter().map(move |g| (*layer, g)))
        .max_by(|a, b| a.1.area.total_cmp(&b.1.area));
    let uncovered = if area > 0.0 { 100.0 * lack / area } else { 0.0 };
    let largest = gap.map_or(String::new(), |(_, gap)| {
        format!("; largest place {:.1} mm²", gap.area)
    });
    let fact = Fact::new(
        "coverage",
        "area that no bead covers",
        Measure::exact(uncovered, "%"),
        &format!(
            "of the layers' area, over {} regions; the metal that flows there is in the lack{largest}",
            plan.coverage.len()
        ),
    );
    match gap {
        Some((layer, gap)) => fact.at(Place {
            position: Some(gap.place.to_array()),
            layer: Some(layer),
            ..Place::default()
        }),
        None => fact,
    }
}

/// Whether the beads fit on the plate, which is centred under them, where the job gives one, and how it lies on the table of a robot.
pub(crate) fn plate_checks(plan: &Plan, settings: &Settings) -> impl Iterator<Item = Check> {
    let points = plan.toolpath.passes().flat_map(|p| p.flatten(0.05).0);
    let none = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    let [lo, hi] = points.fold(none, |[lo, hi], p| {
        [lo.min(p.truncate()), hi.max(p.truncate())]
    });
    let size = settings.plate.map_or(hi - lo, DVec2::from_array);
    let (middle, half) = (0.5 * (lo + hi), 0.5 * size);
    let standing = plate_on_table(&[middle - half, middle + half], settings);
    beyond_plate([lo, hi], settings).into_iter().chain(standing)
}

fn beyond_plate([lo, hi]: [DVec2; 2], settings: &Settings) -> Option<Check> {
    let plate = DVec2::from_array(settings.plate?);
    let beyond = 0.5 * (hi - lo + DVec2::splat(settings.bead.width.value) - plate).max_element();
    let check = Check::judge(
        "plate",
        "beads beyond the edge of the plate",
        Measure::exact(beyond.max(0.0), "mm"),
        Limit::AtMost(0.0),
    );
    Some(check.remedy("a larger substrate.size"))
}

/// Growth by the polynomial assembly of beads: a second opinion, independent of the simulated deposit.
fn assembly(plan: &Plan, settings: &Settings) -> Fact {
    const ID: &str = "assembly";
    const TITLE: &str = "growth of a layer by the assembly of sections";
    // single beads make a wall, all others a strip wide enough that its middle does not see its edges
    let beads = if plan.single > 0.5 { 1 } else { EDGE_BEADS };
    let planned = plan.height.value;
    match assembled(settings, beads) {
        Ok(g) => {
            let what = if beads == 1 {
                "a wall of single beads".to_owned()
            } else {
                let edges = if g.edge_lag < 0.0 { "higher" } else { "lower" };
                format!(
                    "{beads} beads {:.2} mm apart, whose edges lie {:.1} mm {edges} after {ASSEMBLED} layers",
                    settings.stepover.value,
                    g.edge_lag.abs()
                )
            };
            let refused = g.degenerate.map_or(String::new(), |n| {
                format!("; the model degenerates from layer {n} on")
            });
            let words = format!("for {what} ({planned:.2} mm planned){refused}");
            Fact::new(ID, TITLE, Measure::exact(g.layer, "mm"), &words)
        }
        Err(e) => Fact::words(ID, TITLE, &e.to_string()),
    }
}

/// The program parses back to what was planned, and the arc burns on beads alone.
pub(crate) fn program_check(programs: &[(&Programs, &Commands)], toolpath: &Toolpath) -> Check {
    let planned = toolpath.deposited_length();
    let off = |commands: &Commands| 100.0 * (commands.arc_length - planned).abs() / planned;
    let off = programs.iter().map(|(_, c)| off(c)).fold(0.0, f64::max);
    let check = Check::judge(
        "program",
        "program: length with arc against the plan",
        Measure::exact(off, "%"),
        Limit::AtMost(0.1),
    )
    .remedy("this is a fault of the program writer; please report it with the job");
    if programs.iter().all(|(p, c)| p.stable && c.gaps.is_empty()) {
        check
    } else {
        Check {
            status: Status::Fail,
            reason: "the program does not read back as it was written".to_owned(),
            ..check
        }
    }
}

/// Mass of `wire` mm of wire.
pub(crate) fn wire_used(wire: f64, settings: &Settings) -> Measure {
    let density = &settings.wire.density;
    let mass = wire * settings.wire.section() * 1e-9 * density.0;
    let sigma = mass * wire_sigma(settings).hypot(relative(density.0, density.uncertainty));
    Measure::new(mass, sigma, "kg")
}

/// Standard uncertainty of the volume of wire that is fed, as a share of it: by the wire's section, which goes with the square of its
/// diameter, and by what the source feeds of what is set.
pub(super) fn wire_sigma(settings: &Settings) -> f64 {
    let (diameter, factor) = (&settings.wire.diameter, &settings.map.feed_factor);
    let diameter = relative(diameter.0, diameter.uncertainty);
    (2.0 * diameter).hypot(relative(factor.0, factor.uncertainty))
}

/// A standard uncertainty as a share of its value; 0 where none is told.
fn relative(value: f64, uncertainty: Option<f64>) -> f64 {
    uncertainty.map_or(0.0, |u| u / value)
}
