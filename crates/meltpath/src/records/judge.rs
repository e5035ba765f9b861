//! What can be said of records.

use std::fmt::Write as _;

use meltpath_base::{Check, Fact, Limit, Measure, Reporter, Status};
use meltpath_deposition::process_map::feeds_may_differ;
use meltpath_perception::arc::steady::{Mean, Poles};

use super::file::Records;
use super::found::{PER_MINUTE, Recorded, Response};
use super::line::ends;

/// Most voltage over current, Ω: arcs of this process have 0.05 to 0.3; exchanged columns 3 and more.
const RESISTANCE: f64 = 1.0;
/// Most energy per volume, J/mm³: twice the most of the beads of Rouchon 2022, table 2.5 (38.9). A wrong unit is beyond it.
const MOST_ENERGY: f64 = 80.0;
/// Most of the steady time without arc or without samples, %: what it hides moves a mean by a hundredth of itself at most, if the arc
/// was as far off as out.
const LOST: f64 = 1.0;
/// Most samples at one end of a channel's range, %: means move by less than a hundredth where they would lie twice as far off.
const CLIPPED: f64 = 0.5;
/// Tenths of a bead may scatter by so much, %: a mean of what changes more says little of any part of it.
const STEADY: f64 = 10.0;
/// Least and most wire fed over wire set, %: installations of the source feed 3.5 to 26 % more than is set.
const FED: [f64; 2] = [70.0, 130.0];
/// How far the distance by the voltage may be from the one that is told, mm: ours, the acceptance case AC-44.
const DISTANCE: f64 = 1.5;
/// How far a mean may be from the lines, %: what the uncertainty of the line that ships leaves open over its distances.
const STRAIGHT: f64 = 5.0;
/// Slower samples, s, show no pulse and no short circuit.
const SLOW: f64 = 1e-3;
/// Samples of a cycle that show it.
const SHOWN: f64 = 8.0;
/// Steel: 12.6 J/mm³ melt it (Rouchon 2022, section 2.2). Densities, kg/m³.
const STEEL: ([f64; 2], f64) = ([7000.0, 8500.0], 12.6);

/// Checks of records, of which what is written hangs.
pub(super) const OF_DISTANCE: [&str; 3] = ["distance", "straight", "falling"];

/// What should be known of records.
pub(super) fn warn(records: &Records, beads: &[Recorded], reporter: &Reporter) {
    // pulses that many samples show are there, however slow the samples
    let shown = |b: &Recorded| b.steady.cycle.is_some_and(|c| c >= SHOWN * b.steady.usual);
    let slow = beads.iter().find(|b| b.steady.usual > SLOW && !shown(b));
    if let Some(bead) = slow {
        reporter.warn(
            "slow-samples",
            format!(
                "{}: a sample each {:.3} s shows no pulses: where the logger wrote means of voltage and current, their product is not the mean power of a pulsed arc",
                bead.setting.file, bead.steady.usual
            ),
            "for pulsed transfer record at 10 kHz or more, or take the mean power of the source's display",
        );
    }
    for bead in beads {
        let name = &bead.setting.file;
        let steady = &bead.steady;
        let turned = match steady.poles {
            Poles::Positive => None,
            Poles::Negative => Some("voltage and current are negative: taken without their sign"),
            Poles::Alternating => {
                Some("the current turns round: means are those of its size and of the voltage's")
            }
        };
        if let Some(turned) = turned {
            let remedy = "nothing, where the electrode is negative or the arc alternates";
            reporter.warn("poles", format!("{name}: {turned}"), remedy);
        }
        for [from, to] in &steady.out {
            reporter.warn(
                "arc-out",
                format!("{name}: no arc from {from:.2} to {to:.2} s; left out of the means"),
                "look at the bead there: no metal was laid",
            );
        }
        if steady.dark > 0.0 {
            reporter.warn(
                "arc-out",
                format!(
                    "{name}: no arc for {:.2} s in short breaks, which are not left out of the means",
                    steady.dark
                ),
                "look at the bead there, and write from and to of a piece that burns",
            );
        }
        if steady.unfed > 0.0 {
            reporter.warn(
                "samples-missing",
                format!(
                    "{name}: no wire feed is written for {:.2} s; its mean is of the rest",
                    steady.unfed
                ),
                "look at the logger, or write from and to of a piece with feed",
            );
        }
        if steady.missing > 0.0 {
            reporter.warn(
                "samples-missing",
                format!(
                    "{name}: {:.2} s are without samples; left out of the means",
                    steady.missing
                ),
                "look at the logger",
            );
        }
        if let (Some(feed), true) = (
            steady.feed,
            bead.circuit.is_none() && records.circuit.is_some(),
        ) && bead.setting.distance.is_some()
        {
            let message = format!(
                "{name}: by the circuit no arc burns steadily at {:.2} m/min, {:.2} V and this distance",
                0.06 * feed.value,
                steady.voltage.value
            );
            let remedy = "its constants are of another voltage: name your own, circuit = \"my-circuit.toml\"";
            reporter.warn("no-arc-by-circuit", message, remedy);
        }
    }
    let near = records.file.least_distance.0;
    let first = beads
        .iter()
        .find(|b| b.setting.distance.is_some_and(|d| d < near));
    if let (Some(bead), Some(distance)) = (first, first.and_then(|b| b.setting.distance)) {
        let layer = bead.setting.layer;
        let layer = layer.map_or_else(String::new, |n| format!(" (layer {n})"));
        reporter.warn(
            "contact-tube-near",
            format!(
                "{}{layer}: the contact tube was {distance:.2} mm from the work, below {near} mm",
                bead.setting.file
            ),
            "lift the torch by as much as the wall grows: layers.height of the job is that growth",
        );
    }
}

/// Tells a feed factor that is another than that of the process map beside: either changed, or the feed that was set is not the one written.
pub(super) fn warn_of_map(
    records: &Records,
    beads: &[Recorded],
    response: Option<&Response>,
    reporter: &Reporter,
) {
    let Some(known) = records.map.as_ref().and_then(|(map, _)| map.fed()) else {
        return;
    };
    let all: Vec<f64> = beads
        .iter()
        .filter_map(|b| Some(b.factor()?.value))
        .collect();
    let mean = || {
        let [least, greatest] = ends(all.iter().copied());
        let value = all.iter().sum::<f64>() / all.len() as f64;
        (!all.is_empty()).then_some([value, (greatest - least) / 4.0])
    };
    let by_line = response.map(|r| r.feed.value.map(|v| v / r.programmed));
    let Some([fed, sigma]) = by_line.or_else(mean) else {
        return;
    };
    let most = feeds_may_differ([sigma, known.uncertainty.unwrap_or(0.0)]);
    if (fed - known.0).abs() > most {
        reporter.warn(
            "feed-beside-map",
            format!(
                "the records fed {:.1} % of what was set, and their process map says {:.1} %: more apart than both leave open ({:.1} %)",
                100.0 * fed,
                100.0 * known.0,
                100.0 * most
            ),
            "look at wire_feed of the records, which is what was set; where it is right, the source feeds otherwise than when the map was made: write feed_factor in the job",
        );
    }
}

/// The record that is worst in what `of` tells of it, of those of which it tells something.
fn worst(beads: &[Recorded], of: impl Fn(&Recorded) -> Option<f64>) -> Option<(&Recorded, f64)> {
    let all = beads.iter().filter_map(|b| Some((b, of(b)?)));
    all.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// A check of the record that is worst.
fn check(
    [id, title]: [&str; 2],
    found: Option<(&Recorded, Measure)>,
    limit: Limit,
    [otherwise, remedy]: [&str; 2],
) -> Check {
    match found {
        None => Check::not_checked(id, title, otherwise),
        Some((bead, value)) => Check::judge(id, title, value, limit)
            .because(&bead.setting.file)
            .remedy(remedy),
    }
}

fn percent(mean: Mean) -> f64 {
    100.0 * mean.scatter / mean.value
}

/// Least energy that an arc can spend on the wire, J/mm³.
fn melting(records: &Records) -> Option<f64> {
    let ([low, high], energy) = STEEL;
    let density = records.wire.density.0;
    let steel = (low..=high).contains(&density).then_some(energy);
    records.file.melting_energy.map(|e| e.0).or(steel)
}

/// The checks.
pub(super) fn checks(
    records: &Records,
    beads: &[Recorded],
    response: Option<&Response>,
) -> Vec<Check> {
    let mut checks = of_samples(beads);
    checks.extend(of_wire(records, beads));
    checks.push(distance(records, beads));
    checks.push(straight(beads, response));
    checks.extend(falling(response));
    checks
}

fn exact<'a>(found: Option<(&'a Recorded, f64)>, unit: &str) -> Option<(&'a Recorded, Measure)> {
    found.map(|(bead, value)| (bead, Measure::exact(value, unit)))
}

/// What the samples of each record are held against.
fn of_samples(beads: &[Recorded]) -> Vec<Check> {
    let resistance = worst(beads, |b| {
        Some(b.steady.voltage.value / b.steady.current.value)
    });
    let lost = worst(beads, |b| {
        let out: f64 = b.steady.out.iter().map(|[a, b]| b - a).sum();
        let [from, to] = b.steady.used;
        let dark = b.steady.dark;
        Some(100.0 * (out + dark + b.steady.missing.max(b.steady.unfed)) / (to - from))
    });
    let clipped = worst(beads, |b| Some(100.0 * b.steady.clipped));
    let scatter = worst(beads, |b| {
        let s = &b.steady;
        let all = [Some(s.voltage), Some(s.current), s.feed];
        all.into_iter().flatten().map(percent).reduce(f64::max)
    });
    vec![
        check(
            ["columns", "most voltage over current"],
            exact(resistance, "Ω"),
            Limit::AtMost(RESISTANCE),
            [
                "",
                "look at the columns and their units: voltage and current are exchanged, or one is in another unit",
            ],
        ),
        check(
            [
                "whole",
                "most of a bead without arc or without samples of voltage, current or feed",
            ],
            exact(lost, "%"),
            Limit::AtMost(LOST),
            [
                "",
                "lay that bead again, or write from and to of a piece without break",
            ],
        ),
        check(
            [
                "range",
                "most samples at one end of what a channel can show",
            ],
            exact(clipped, "%"),
            Limit::AtMost(CLIPPED),
            [
                "",
                "record with a channel of more range, and look whether it is connected: what lies beyond is cut off, and means are wrong by it",
            ],
        ),
        check(
            [
                "steady",
                "most scatter along a bead, of voltage, current and feed",
            ],
            exact(scatter, "%"),
            Limit::AtMost(STEADY),
            [
                "",
                "write longer ignition and end; or records of beads at one distance",
            ],
        ),
    ]
}

/// What each record is held against with its wire.
fn of_wire(records: &Records, beads: &[Recorded]) -> Vec<Check> {
    let energy = |sign: f64| {
        let found = worst(beads, |b| Some(sign * b.energy().value));
        found.map(|(b, _)| {
            (
                b,
                Measure::new(b.energy().value, b.energy().scatter, "J/mm³"),
            )
        })
    };
    let fed = |sign: f64| {
        let found = worst(beads, |b| b.factor().map(|f| sign * f.value));
        found.and_then(|(b, _)| {
            let f = b.factor()?;
            Some((b, Measure::new(100.0 * f.value, 100.0 * f.scatter, "%")))
        })
    };
    let units = "look at the columns, their units and the wire's diameter";
    let melts = melting(records);
    let unknown = "what melts this wire is not told (melting_energy)";
    let mut checks = vec![
        check(
            ["energy-most", "most energy per volume"],
            energy(1.0),
            Limit::AtMost(MOST_ENERGY),
            ["", units],
        ),
        check(
            [
                "energy-least",
                "least energy per volume, beside what melts the wire",
            ],
            energy(-1.0).filter(|_| melts.is_some()),
            Limit::AtLeast(melts.unwrap_or(0.0)),
            [unknown, units],
        ),
    ];
    let otherwise = "no record holds the wire feed (columns.feed)";
    let remedy = "look at the column of the feed and its unit, and at wire_feed";
    for (id, title, sign, limit) in [
        (
            "feed-most",
            "most wire fed over wire set",
            1.0,
            Limit::AtMost(FED[1]),
        ),
        (
            "feed-least",
            "least wire fed over wire set",
            -1.0,
            Limit::AtLeast(FED[0]),
        ),
    ] {
        checks.push(check([id, title], fed(sign), limit, [otherwise, remedy]));
    }
    checks
}

/// The distance by the voltage beside the one that is told.
fn distance(records: &Records, beads: &[Recorded]) -> Check {
    const TEXTS: [&str; 2] = [
        "distance",
        "most that the voltage's contact tube distance differs from the one told",
    ];
    let off = |b: &Recorded| Some((b.told?.distance - b.setting.distance?).abs());
    let own = records.file.distance_uncertainty.0;
    let found = worst(beads, off).and_then(|(b, off)| {
        let sigma = b.told?.sigma.hypot(own);
        Some((b, Measure::new(off, sigma, "mm")))
    });
    let otherwise = if beads.iter().all(|b| b.setting.distance.is_none()) {
        "no record tells its distance"
    } else {
        "no line knows the voltage apart from these records: it takes three distances or more, of one feed that was set, over which the voltage changes; or a process map with a table [electric] of this feed"
    };
    let remedy = "look at the order of the records, their layers and distances";
    check(TEXTS, found, Limit::AtMost(DISTANCE), [otherwise, remedy])
}

/// Whether feed, voltage, current and power follow straight lines.
fn straight(beads: &[Recorded], response: Option<&Response>) -> Check {
    const ID: &str = "straight";
    const TITLE: &str = "most that a mean is off its line over the distance";
    let Some(response) = response.filter(|r| r.of.len() > 2) else {
        return Check::not_checked(
            ID,
            TITLE,
            "two points are always on a line: it takes three records at several distances",
        );
    };
    let lines = [
        response.feed,
        response.voltage,
        response.current,
        response.power,
    ];
    let off = lines.map(|line| 100.0 * line.off / line.value[0].abs());
    let names = ["wire feed", "voltage", "current", "power"];
    let mut worst = 0;
    for k in 1..lines.len() {
        if off[k] > off[worst] {
            worst = k;
        }
    }
    let scatter = |k: &usize| {
        let s = &beads[*k].steady;
        [s.feed.unwrap_or_default(), s.voltage, s.current, s.power][worst].scatter
    };
    let scatter = response.of.iter().map(scatter).fold(0.0, f64::max);
    let sigma = 100.0 * scatter / lines[worst].value[0].abs();
    let value = Measure::new(off[worst], sigma, "%");
    Check::judge(ID, TITLE, value, Limit::AtMost(STRAIGHT))
        .because(names[worst])
        .remedy("look at the plots: leave out what does not belong, or write records of the distances that you use")
}

/// A feed that rises as the contact tube comes nearer, which no stabiliser makes: a mirrored order of the distances follows its own lines as well
/// as the right one does. Nothing is told of a feed that falls or is held.
fn falling(response: Option<&Response>) -> Option<Check> {
    let feed = &response?.feed;
    let [slope, sigma] = feed.slope.map(|s| PER_MINUTE * s);
    let rises = feed.is_sloped() && slope < 0.0;
    rises.then(|| {
        Check::judge(
            "falling",
            "rise of the wire feed per mm that the contact tube comes nearer",
            Measure::new(-slope, sigma, "m/min/mm"),
            Limit::AtMost(0.0),
        )
        .because("no stabiliser does that")
        .remedy("look at the order of the records, their layers and distances")
    })
}

/// What is told besides.
pub(super) fn facts(
    records: &Records,
    beads: &[Recorded],
    response: Option<&Response>,
) -> Vec<Fact> {
    let mut facts = vec![Fact::new(
        "records",
        "records",
        Measure::exact(beads.len() as f64, ""),
        "",
    )];
    let energies = beads.iter().map(|b| b.energy().value);
    let [least, greatest] = ends(energies.clone());
    let mean = energies.sum::<f64>() / beads.len() as f64;
    let by = if beads.iter().all(|b| b.steady.feed.is_some()) {
        "by the feed that was measured"
    } else {
        "by the feed that was set, where none was measured: the source may feed 3.5 to 26 % more"
    };
    let by_means = beads.iter().map(Recorded::energy_of_means).sum::<f64>() / beads.len() as f64;
    let by_set = beads.iter().map(Recorded::energy_by_set_feed).sum::<f64>() / beads.len() as f64;
    facts.push(Fact::new(
        "energy-per-volume",
        "electric energy per volume of wire, mean of the records",
        Measure::new(mean, (greatest - least) / 4.0, "J/mm³"),
        &format!(
            "{least:.1} to {greatest:.1}, {by}; {by_means:.1} by the product of mean voltage and mean current; {by_set:.1} by the feed that was set"
        ),
    ));
    let Some(response) = response else {
        return facts;
    };
    let per_minute = 0.06;
    let slope = |id, title, [value, sigma]: [f64; 2], scale: f64, unit: &str| {
        let known = if value.abs() > 2.0 * sigma {
            ""
        } else {
            "not told from none"
        };
        Fact::new(
            id,
            title,
            Measure::new(scale * value, scale * sigma, unit),
            known,
        )
    };
    facts.extend([
        slope(
            "feed-slope",
            "change of the wire feed per mm of distance",
            response.feed.slope,
            per_minute,
            "m/min/mm",
        ),
        slope(
            "voltage-slope",
            "change of the voltage per mm of distance",
            response.voltage.slope,
            1.0,
            "V/mm",
        ),
        slope(
            "current-slope",
            "change of the current per mm of distance",
            response.current.slope,
            1.0,
            "A/mm",
        ),
    ]);
    let [fed, sigma] = response.feed.value.map(|v| 100.0 * v / response.programmed);
    let mut told = format!("at {:.1} mm", response.reference);
    if falling(Some(response)).is_none() {
        let _ = write!(
            told,
            "; in a job: [waam.source] feed_factor = \"{fed:.0} %\""
        );
    }
    facts.push(Fact::new(
        "feed-factor",
        "wire fed over wire set at the reference distance",
        Measure::new(fed, sigma, "%"),
        &told,
    ));
    if let Some((growth, lifted)) = records.file.growth.zip(*records.file.layer_height) {
        let rest = records.file.first_distance.map_or(0.0, |d| d.0) - records.file.least_distance.0;
        let by = growth.0 - lifted.0;
        let layer = (rest / by).floor() + 2.0;
        if by > 0.0 && rest > 0.0 {
            facts.push(Fact::new(
                "first-layer-too-near",
                "first layer that is laid below the least distance",
                Measure::exact(layer, ""),
                &format!("the wall grows {by:.3} mm a layer more than the torch is lifted"),
            ));
        }
    }
    facts
}

/// The checks that fail among those that `counts` answers for, by their identifiers.
pub(super) fn failing(checks: &[Check], counts: impl Fn(&str) -> bool) -> Option<String> {
    let failing = checks
        .iter()
        .filter(|c| c.status == Status::Fail && counts(&c.id));
    let ids: Vec<&str> = failing.map(|c| c.id.as_str()).collect();
    (!ids.is_empty()).then(|| ids.join(", "))
}
