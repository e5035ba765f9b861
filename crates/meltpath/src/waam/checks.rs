//! Checks of the plan and of the program, and the values that a verdict tells without a limit.

use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_deposition::assembly::{AssemblyBead, growth};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::Fact;
use meltpath_toolpath::Toolpath;

use super::judge::{LayerOutcome, told};
use super::plan::Plan;
use super::program::{Commands, Programs};
use super::settings::Settings;
use super::simulate::Simulation;

/// Coverage and overhang.
pub(super) fn plan_checks(plan: &Plan, settings: &Settings) -> Vec<Check> {
    let width = settings.bead.width.value;
    let worst = plan.overhangs.iter().max_by(|a, b| {
        a.shift
            .unwrap_or(f64::MAX)
            .total_cmp(&b.shift.unwrap_or(f64::MAX))
    });
    let share = worst.map_or(0.0, |o| {
        o.shift.map_or(f64::INFINITY, |s| 100.0 * s / width)
    });
    let mut overhang = Check::judge(
        "overhang",
        "overhang: shift of a layer over the one below, in bead widths",
        Measure::exact(share, "%"),
        Limit::AtMost(100.0 * settings.limits.overhang),
    );
    if let Some(o) = worst {
        let place = Place {
            position: Some(o.place.to_array()),
            layer: Some(o.slice as u32 + 1),
            ..Place::default()
        };
        overhang = overhang.at(place).remedy("turn the part (build_direction), or thicken it below: the height map is not valid where beads hang over");
        if o.shift.is_none() {
            overhang.status = Status::Fail;
            "a piece of the layer has nothing below it".clone_into(&mut overhang.reason);
        }
    }
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
    let mut coverage = told(
        "coverage",
        "area that no bead covers",
        uncovered,
        "%",
        &format!(
            "{uncovered:.2} % of the layers' area over {} regions; the metal that flows there is in the lack above",
            plan.coverage.len()
        ),
    );
    if let Some((layer, gap)) = gap {
        coverage.place = Some(Place {
            position: Some(gap.place.to_array()),
            layer: Some(layer),
            ..Place::default()
        });
        coverage.reason = format!("{}; largest place {:.1} mm²", coverage.reason, gap.area);
    }
    vec![overhang, coverage, assembly(plan, settings)]
}

/// Whether the beads fit on the plate, which is centred under them; `None` where the job gives no plate.
pub(super) fn plate_check(plan: &Plan, settings: &Settings) -> Option<Check> {
    let plate = DVec2::from_array(settings.plate?);
    let points = plan.toolpath.passes().flat_map(|p| p.flatten(0.05).0);
    let (lo, hi) = points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| {
        (lo.min(p.truncate()), hi.max(p.truncate()))
    });
    let beyond = 0.5 * (hi - lo + DVec2::splat(settings.bead.width.value) - plate).max_element();
    let check = Check::judge(
        "plate",
        "beads beyond the edge of the plate",
        Measure::exact(beyond.max(0.0), "mm"),
        Limit::AtMost(0.0),
    );
    Some(check.remedy("a larger substrate.size"))
}

/// Layers of the assembly that the plan is compared with: edges install themselves in five (Rouchon 2022, § 4.3).
const ASSEMBLED: u32 = 5;

/// Growth by the polynomial assembly of beads: a second opinion, independent of the simulated deposit.
fn assembly(plan: &Plan, settings: &Settings) -> Check {
    const ID: &str = "assembly";
    const TITLE: &str = "growth of a layer by the assembly of sections";
    let bead = AssemblyBead {
        width: settings.bead.width.value,
        height: settings.bead.height.value,
    };
    // single beads make a wall, all others a strip wide enough that its middle does not see its edges
    let beads = if plan.single > 0.5 { 1 } else { 6 };
    let planned = plan.height.value;
    match growth(bead, beads, settings.stepover.value, ASSEMBLED) {
        Ok(g) => {
            let what = if beads == 1 {
                "a wall of single beads".to_owned()
            } else {
                format!(
                    "{beads} beads {:.2} mm apart, whose edges lie {:.1} mm lower after {ASSEMBLED} layers",
                    settings.stepover.value, g.edge_lag
                )
            };
            let refused = g.degenerate.map_or(String::new(), |n| {
                format!("; the model degenerates from layer {n} on")
            });
            let words = format!(
                "{:.2} mm a layer for {what} ({planned:.2} mm planned){refused}",
                g.layer
            );
            told(ID, TITLE, g.layer, "mm", &words)
        }
        Err(e) => Check::not_checked(ID, TITLE, &e.to_string()),
    }
}

/// The program parses back to what was planned, and the arc burns on beads alone.
pub(super) fn program_check(
    programs: &Programs,
    toolpath: &Toolpath,
    commands: &Commands,
) -> Check {
    let planned = toolpath.deposited_length();
    let off = 100.0 * (commands.arc_length - planned).abs() / planned;
    let check = Check::judge(
        "program",
        "program: length with arc against the plan",
        Measure::exact(off, "%"),
        Limit::AtMost(0.1),
    )
    .remedy("this is a fault of the program writer; please report it with the job");
    if programs.stable {
        check
    } else {
        Check {
            status: Status::Fail,
            reason: "the program does not read back as it was written".to_owned(),
            ..check
        }
    }
}

/// Values without limit.
pub(super) fn told_checks(simulation: &Simulation, settings: &Settings) -> Vec<Check> {
    let s = &simulation.summary;
    let mass = wire_mass(simulation, settings);
    let sigma = settings
        .map
        .feed_factor
        .uncertainty
        .map_or(0.0, |u| mass * u / settings.map.feed_factor.value);
    let minutes = |t: f64| t / 60.0;
    let mut wire = told(
        "wire-mass",
        "wire used",
        mass,
        "kg",
        &format!(
            "{mass:.3} ± {sigma:.3} kg, {:.1} m of {}",
            simulation.deposit.wire / 1000.0,
            settings.wire.name
        ),
    );
    wire.value = Some(Measure::new(mass, sigma, "kg"));
    vec![
        told(
            "arc-starts",
            "arc starts",
            simulation.arc_starts as f64,
            "",
            &format!("{} ignitions", simulation.arc_starts),
        ),
        wire,
        wire_feed(simulation, settings),
        energy(simulation, settings),
        told(
            "time-arc",
            "time with arc",
            minutes(s.arc_time),
            "min",
            &format!("{:.1} min", minutes(s.arc_time)),
        ),
        told(
            "time-travel",
            "time of travels",
            minutes(s.travel_time),
            "min",
            &format!("{:.1} min", minutes(s.travel_time)),
        ),
        told(
            "time-pause",
            "time of pauses",
            minutes(s.pause_time),
            "min",
            &format!("{:.1} min", minutes(s.pause_time)),
        ),
        told(
            "time-total",
            "time in all",
            minutes(s.total_time),
            "min",
            &format!("{:.1} min", minutes(s.total_time)),
        ),
    ]
}

/// Wire feed as delivered, layer by layer: the source answers to the contact tube distance.
fn wire_feed(simulation: &Simulation, settings: &Settings) -> Check {
    const PER_MINUTE: f64 = 0.06;
    let feed = |l: &&LayerOutcome| PER_MINUTE * l.wire / l.arc_time;
    let fed = || simulation.layers.iter().filter(|l| l.arc_time > 0.0);
    let total: f64 = fed().map(|l| l.wire).sum();
    let time: f64 = fed().map(|l| l.arc_time).sum();
    let mean = if time > 0.0 {
        PER_MINUTE * total / time
    } else {
        0.0
    };
    let (least, greatest) = fed()
        .map(|l| feed(&l))
        .fold((f64::MAX, f64::MIN), |(a, b), f| (a.min(f), b.max(f)));
    let why = match settings.deposit.feed_response {
        Some(r) => format!(
            "the source feeds {:.1} % less per mm of contact tube distance lost",
            100.0 * r.slope
        ),
        None => "the same at any contact tube distance".to_owned(),
    };
    told(
        "wire-feed",
        "wire feed delivered",
        mean,
        "m/min",
        &format!(
            "{mean:.2} m/min in the mean, {least:.2} to {greatest:.2} over the layers, {:.2} programmed: {why}",
            PER_MINUTE * settings.bead.wire_feed
        ),
    )
}

/// Mass of the wire used, kg.
pub(super) fn wire_mass(simulation: &Simulation, settings: &Settings) -> f64 {
    simulation.deposit.wire * settings.wire.section() * 1e-9 * settings.wire.density.value
}

/// Electric energy, from the energy per volume measured for the transfer mode.
fn energy(simulation: &Simulation, settings: &Settings) -> Check {
    let Some(per_volume) = &settings.energy else {
        return Check::not_checked(
            "energy",
            "electric energy of the arc",
            "no energy per volume is known for this transfer mode",
        );
    };
    let volume = simulation.deposit.wire * settings.wire.section();
    let megajoule = |per: f64| per * volume * 1e-6;
    let (mean, sigma) = (megajoule(per_volume.mean), megajoule(per_volume.sigma));
    let mut check = told(
        "energy",
        "electric energy of the arc",
        mean,
        "MJ",
        &format!(
            "{mean:.2} ± {sigma:.2} MJ at {} J/mm³ ({})",
            per_volume.mean, per_volume.source
        ),
    );
    check.value = Some(Measure::new(mean, sigma, "MJ"));
    check
}

/// Figures that stand at the top of the report.
pub(super) fn facts(simulation: &Simulation, settings: &Settings) -> Vec<Fact> {
    let s = &simulation.summary;
    let minutes = |t: f64| format!("{:.0} min", t / 60.0);
    vec![
        Fact::new("Layers", &simulation.layers.len().to_string()),
        Fact::new(
            "Height",
            &format!("{:.1} mm", simulation.deposit.map.maximum()),
        ),
        Fact::new(
            "Wire",
            &format!("{:.2} kg", wire_mass(simulation, settings)),
        ),
        Fact::new("Arc time", &minutes(s.arc_time)),
        Fact::new("Total time", &minutes(s.total_time)),
        Fact::new("Arc starts", &simulation.arc_starts.to_string()),
    ]
}
