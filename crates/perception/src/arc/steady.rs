//! Where an arc burns steadily in a record, and the means over it.

use super::ArcError;
use super::range::{clipped, worse};
use super::samples::Samples;

/// An arc is out where its current stays below that of an arc for so long, s: some three cycles of short-circuit transfer.
const OUT: f64 = 0.05;
/// Current below that of an arc is no arc, shorter than [`OUT`] too, where the voltage is above its mean (below it the wire touches the pool) for so
/// long, s: poles that turn round are quicker.
const DARK: f64 = 2e-3;
/// Parts into which the steady time is cut to see how steady it is.
const PARTS: usize = 10;
/// Samples needed, two a part.
const LEAST: usize = 2 * PARTS;
/// Least steady time, s: some thirty cycles of transfer.
const SHORTEST: f64 = 0.5;
/// Pulses change the current by more than this share of its mean.
const SWING: f64 = 0.2;
/// An arc that changes its direction has so large a share of its samples the other way round.
const TURNED: f64 = 0.02;

/// What is taken as steady.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Left out after the ignition, s.
    pub ignition: f64,
    /// Left out before the arc ends, s.
    pub end: f64,
    /// Least current of an arc, A.
    pub arc_current: f64,
}

/// A mean over the steady time, and the standard deviation of the means of its tenths.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// How far its tenths are from it.
    pub scatter: f64,
}

/// How the poles lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Poles {
    /// Voltage and current are positive.
    Positive,
    /// Both are negative, and taken without their sign.
    Negative,
    /// They turn round, and are taken without their sign.
    Alternating,
}

/// What a record holds where its arc burns steadily.
#[derive(Debug, Clone, PartialEq)]
pub struct Steady {
    /// From ignition to end, s.
    pub burns: [f64; 2],
    /// What is used of it, s.
    pub used: [f64; 2],
    /// Stretches of it without arc, s.
    pub out: Vec<[f64; 2]>,
    /// Time within it that no sample covers, s.
    pub missing: f64,
    /// Further time within it in which no current of an arc flows, however short each break, s.
    pub dark: f64,
    /// Time of its tenths in which no wire feed was written though the record has some, s.
    pub unfed: f64,
    /// Share of samples at one end of what a channel can show: of voltage or current, whichever is more.
    pub clipped: f64,
    /// Samples in it.
    pub samples: usize,
    /// The usual time between two samples, s.
    pub usual: f64,
    /// Voltage, V.
    pub voltage: Mean,
    /// Current, A.
    pub current: Mean,
    /// Wire feed, mm/s, where it was recorded.
    pub feed: Option<Mean>,
    /// Mean of the products of voltage and current, W.
    pub power: Mean,
    /// How the poles lie.
    pub poles: Poles,
    /// Usual time of a cycle of its pulses, s, as far as samples show them: the current goes up and down by more than a fifth of its mean.
    pub cycle: Option<f64>,
}

/// Sums of a part, each with the time that it covers.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    time: f64,
    voltage: f64,
    current: f64,
    power: f64,
    feed: f64,
    fed_time: f64,
}

/// Stretches of samples, from and to, in which the current of an arc flows; shorter breaks than an arc that is out are none.
fn burning(samples: &Samples, threshold: f64) -> Vec<[usize; 2]> {
    let mut all: Vec<[usize; 2]> = Vec::new();
    for k in 0..samples.times.len() {
        // not true of what is no number
        if samples.current[k].abs() < threshold || !samples.current[k].is_finite() {
            continue;
        }
        match all.last_mut() {
            Some([_, last]) if dark(samples, *last, k) <= OUT => *last = k,
            _ => all.push([k, k]),
        }
    }
    all
}

/// Time between two samples with arc in which samples show none, s: where nothing was written nothing is known.
fn dark(samples: &Samples, from: usize, to: usize) -> f64 {
    let known = (from + 1..to).filter(|k| samples.current[*k].is_finite());
    known.map(|k| samples.weight(k)).sum()
}

/// The means over the steady time of a record.
///
/// Each sample counts by the time to the next; samples without voltage or current, and the time of an arc that is out, count for nothing.
///
/// # Errors
/// [`ArcError`]: no arc, too short a time, a power that is negative, wire that is not fed.
pub fn steady(file: &str, samples: &Samples, cut: Cut) -> Result<Steady, ArcError> {
    let file = || file.to_owned();
    let burning = burning(samples, cut.arc_current);
    let (Some([first, _]), Some([_, last])) = (burning.first(), burning.last()) else {
        let sizes = samples.current.iter().filter(|i| i.is_finite());
        return Err(ArcError::NoArc {
            file: file(),
            threshold: cut.arc_current,
            greatest: sizes.fold(0.0, |most, i| most.max(i.abs())),
        });
    };
    let time = |k: usize| samples.times[k];
    let burns = [time(*first), time(*last) + samples.weight(*last)];
    let used = [burns[0] + cut.ignition, burns[1] - cut.end];
    // true of what is no number, too
    if (used[1] - used[0])
        .partial_cmp(&SHORTEST)
        .is_none_or(std::cmp::Ordering::is_lt)
    {
        return Err(ArcError::Short {
            file: file(),
            burns: burns[1] - burns[0],
            ignition: cut.ignition,
            end: cut.end,
        });
    }
    let breaks = burning
        .windows(2)
        .map(|w| [time(w[0][1] + 1), time(w[1][0])]);
    let within = breaks.map(|[a, b]| [a.max(used[0]), b.min(used[1])]);
    let out: Vec<[f64; 2]> = within.filter(|[a, b]| b > a).collect();
    let inside = |k: usize| (used[0]..used[1]).contains(&time(k));
    let lit = |k: usize| !out.iter().any(|[a, b]| (*a..*b).contains(&time(k)));
    let taken: Vec<usize> = (*first..=*last)
        .filter(|k| inside(*k) && lit(*k) && samples.is_whole(*k))
        .collect();
    if taken.len() < LEAST {
        return Err(ArcError::Few {
            file: file(),
            count: taken.len(),
            least: LEAST,
        });
    }
    let poles = poles(samples, &taken, cut.arc_current);
    let parts = parts(samples, &taken, used, poles);
    let of = |of: fn(&Part) -> [f64; 2]| mean(&parts, of);
    let power = of(|p| [p.power, p.time]);
    let (voltage, current) = (of(|p| [p.voltage, p.time]), of(|p| [p.current, p.time]));
    // true of what is no number, too
    if power
        .value
        .partial_cmp(&0.0)
        .is_none_or(std::cmp::Ordering::is_le)
    {
        let sign = if poles == Poles::Negative { -1.0 } else { 1.0 };
        return Err(ArcError::Sign {
            file: file(),
            power: power.value,
            voltage: sign * voltage.value,
            current: sign * current.value,
        });
    }
    let feed = samples.feed.as_ref().map(|_| of(|p| [p.feed, p.fed_time]));
    if let Some(feed) = feed.filter(|f| {
        f.value
            .partial_cmp(&0.0)
            .is_none_or(std::cmp::Ordering::is_le)
    }) {
        return Err(ArcError::NotFed {
            file: file(),
            feed: feed.value,
        });
    }
    let holes = (*first..*last).filter(|k| inside(*k) && lit(*k));
    let empty = |k: usize| {
        if samples.is_whole(k) {
            0.0
        } else {
            samples.weight(k)
        }
    };
    let clipped = [&samples.voltage, &samples.current].map(|c| clipped(c, &taken));
    let unfed = parts
        .iter()
        .filter(|p| feed.is_some() && p.time > 0.0 && p.fed_time == 0.0);
    Ok(Steady {
        burns,
        used,
        dark: dark_between(samples, &taken, cut.arc_current, (poles, voltage.value)),
        unfed: unfed.map(|p| p.time).sum(),
        clipped: worse(clipped),
        missing: holes.map(|k| samples.gap(k) + empty(k)).sum(),
        out,
        samples: taken.len(),
        usual: samples.usual,
        voltage,
        current,
        feed,
        power,
        poles,
        cycle: cycle(samples, &taken),
    })
}

/// Time in which samples that count show no current of an arc, and more than the mean voltage, s.
fn dark_between(
    samples: &Samples,
    taken: &[usize],
    threshold: f64,
    (poles, voltage): (Poles, f64),
) -> f64 {
    let dark =
        |k: &usize| samples.current[*k].abs() < threshold && samples.voltage[*k].abs() > voltage;
    let runs = taken.chunk_by(|a, b| dark(a) == dark(b));
    let times = runs
        .filter(|run| dark(&run[0]))
        .map(|run| run.iter().map(|k| samples.weight(*k)).sum::<f64>());
    // current that turns round passes through none
    times
        .filter(|time| *time > DARK && poles != Poles::Alternating)
        .sum()
}

/// How the poles lie in samples.
fn poles(samples: &Samples, taken: &[usize], threshold: f64) -> Poles {
    let share = |sign: f64| {
        let of_sign = taken
            .iter()
            .filter(|k| sign * samples.current[**k] > threshold);
        of_sign.count() as f64 / taken.len() as f64
    };
    match (share(1.0) > TURNED, share(-1.0) > TURNED) {
        (true, true) => Poles::Alternating,
        (false, true) => Poles::Negative,
        _ => Poles::Positive,
    }
}

/// The mean time from pulse to pulse in samples, s; nothing where fewer than [`PARTS`] are there.
fn cycle(samples: &Samples, taken: &[usize]) -> Option<f64> {
    let size = |k: &usize| samples.current[*k].abs();
    let mean = taken.iter().map(size).sum::<f64>() / taken.len() as f64;
    let (mut high, mut rises) = (None, Vec::new());
    for k in taken {
        let over = size(k) / mean - 1.0;
        let now = (over.abs() > 0.5 * SWING).then_some(over > 0.0).or(high);
        if (high, now) == (Some(false), Some(true)) {
            rises.push(samples.times[*k]);
        }
        high = now;
    }
    let (first, last) = (rises.first()?, rises.last()?);
    (rises.len() > PARTS).then(|| (last - first) / (rises.len() - 1) as f64)
}

/// The sums of each part of the steady time.
fn parts(samples: &Samples, taken: &[usize], used: [f64; 2], poles: Poles) -> Vec<Part> {
    let mut parts = vec![Part::default(); PARTS];
    for &k in taken {
        let share = (samples.times[k] - used[0]) / (used[1] - used[0]);
        let part = &mut parts[((share * PARTS as f64) as usize).min(PARTS - 1)];
        let weight = samples.weight(k);
        let (u, i) = (samples.voltage[k], samples.current[k]);
        // the power keeps its sign: where voltage and current disagree something is wrong
        part.power += weight * u * i;
        let [u, i] = match poles {
            Poles::Positive => [u, i],
            Poles::Negative => [-u, -i],
            Poles::Alternating => [u.abs(), i.abs()],
        };
        part.time += weight;
        part.voltage += weight * u;
        part.current += weight * i;
        let feed = samples.feed.as_ref().and_then(|f| f.get(k));
        if let Some(feed) = feed.filter(|f| f.is_finite()) {
            part.feed += weight * feed;
            part.fed_time += weight;
        }
    }
    parts
}

/// The mean of sums over times, and how far the parts are from it.
fn mean(parts: &[Part], of: fn(&Part) -> [f64; 2]) -> Mean {
    let sums = parts.iter().map(of);
    let [sum, time] = sums.fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    let value = sum / time;
    let of_parts: Vec<f64> = parts
        .iter()
        .map(of)
        .filter(|[_, time]| *time > 0.0)
        .map(|[sum, time]| sum / time)
        .collect();
    let squares: f64 = of_parts.iter().map(|v| (v - value).powi(2)).sum();
    let scatter = (squares / (of_parts.len() as f64 - 1.0).max(1.0)).sqrt();
    // what rounding alone leaves is none
    let none = scatter < 1e-9 * value.abs();
    Mean {
        value,
        scatter: if none { 0.0 } else { scatter },
    }
}

/// A piece of a record for a plot: time, and mean, least and greatest of voltage, current and feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Its middle, s.
    pub time: f64,
    /// Voltage, V.
    pub voltage: [f64; 3],
    /// Current, A.
    pub current: [f64; 3],
    /// Wire feed, mm/s; not a number where it was not recorded.
    pub feed: [f64; 3],
}

/// A record in at most `count` pieces of one duration; those without samples are left out.
pub fn pieces(samples: &Samples, count: usize) -> Vec<Piece> {
    let (Some(from), Some(to)) = (samples.times.first(), samples.times.last()) else {
        return Vec::new();
    };
    // no piece shorter than two samples
    let most = ((to - from) / (2.0 * samples.usual)) as usize;
    let count = count.min(most).max(1);
    let width = (to - from) / count as f64;
    let mut found: Vec<Piece> = Vec::with_capacity(count);
    let (mut start, all) = (0, samples.times.len());
    for n in 1..=count {
        let bound = from + n as f64 * width;
        let next = if n == count {
            all
        } else {
            start + samples.times[start..].partition_point(|t| *t < bound)
        };
        let rows = start..next;
        start = next;
        let of = |column: &[f64]| spread(&column[rows.clone()]);
        let voltage = of(&samples.voltage);
        if voltage[0].is_finite() {
            found.push(Piece {
                time: bound - 0.5 * width,
                voltage,
                current: of(&samples.current),
                feed: samples.feed.as_deref().map_or([f64::NAN; 3], of),
            });
        }
    }
    found
}

/// Mean, least and greatest of what is a number.
fn spread(values: &[f64]) -> [f64; 3] {
    let numbers = || values.iter().copied().filter(|v| v.is_finite());
    let mean = numbers().sum::<f64>() / numbers().count() as f64;
    let least = numbers().fold(f64::INFINITY, f64::min);
    let greatest = numbers().fold(f64::NEG_INFINITY, f64::max);
    [mean, least, greatest]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An arc from 1 s to `to`, then nothing until one second later, at 100 Hz.
    fn record(to: f64) -> Samples {
        let times: Vec<f64> = (0..((to + 1.0) * 100.0) as i32)
            .map(|k| f64::from(k) / 100.0)
            .collect();
        let lit = |t: &f64| (1.0..to).contains(t);
        let of = |value: f64| {
            times
                .iter()
                .map(|t| if lit(t) { value } else { 0.0 })
                .collect()
        };
        Samples {
            voltage: of(16.65),
            current: of(190.0),
            feed: Some(of(168.0)),
            usual: 0.01,
            times,
        }
    }

    const CUT: Cut = Cut {
        ignition: 1.0,
        end: 0.5,
        arc_current: 10.0,
    };

    #[test]
    fn ignition_end_and_a_break_are_left_out() {
        let mut samples = record(11.0);
        // an ignition at twice the current, a break of 0.3 s, a gap of samples
        samples.current[100..200].fill(380.0);
        samples.current[500..530].fill(0.0);
        samples.voltage[500..530].fill(60.0);
        for column in [
            &mut samples.times,
            &mut samples.voltage,
            &mut samples.current,
        ] {
            column.drain(700..720);
        }
        samples.feed.as_mut().unwrap().drain(700..720);
        samples.voltage[800] = f64::NAN;
        let found = steady("r", &samples, CUT).unwrap();
        assert!((found.current.value - 190.0).abs() < 1e-9 && found.current.scatter < 1e-9);
        assert!((found.voltage.value - 16.65).abs() < 1e-9, "{found:?}");
        assert!((found.power.value - 16.65 * 190.0).abs() < 1e-6);
        let [from, to] = found.out[0];
        assert!((from - 5.0).abs() < 0.011 && (to - 5.3).abs() < 0.011 && found.out.len() == 1);
        assert!((found.missing - 0.21).abs() < 0.011, "{}", found.missing);
        assert!((found.used[0] - 2.0).abs() < 0.011 && (found.used[1] - 10.5).abs() < 0.011);
        assert_eq!(found.poles, Poles::Positive);
    }

    #[test]
    fn what_cannot_be_used_is_told() {
        let told = |samples: &Samples, words: &[&str]| {
            let error = steady("r.csv", samples, CUT).unwrap_err().to_string();
            assert!(words.iter().all(|w| error.contains(w)), "{error}");
        };
        told(&record(2.5), &["1.50 s", "ignition"]);
        let mut wrong = record(11.0);
        wrong.current.iter_mut().for_each(|i| *i *= -1.0);
        told(&wrong, &["sign", "-1"]);
        wrong.voltage.iter_mut().for_each(|u| *u *= -1.0);
        let turned = steady("r", &wrong, CUT).unwrap();
        assert_eq!(turned.poles, Poles::Negative);
        assert!((turned.current.value - 190.0).abs() < 1e-9);
        wrong.current.fill(0.001);
        told(&wrong, &["no arc", "0.001"]);
        let mut still = record(11.0);
        still.feed.as_mut().unwrap().fill(0.0);
        told(&still, &["no wire"]);
    }

    /// A pulse: the product of the means is not the mean of the products.
    #[test]
    fn pulses_count_by_their_products() {
        let mut samples = record(11.0);
        for k in 0..samples.times.len() {
            if samples.current[k] == 0.0 {
                continue;
            }
            let [u, i] = if k % 2 == 0 {
                [28.0, 400.0]
            } else {
                [18.0, 60.0]
            };
            (samples.voltage[k], samples.current[k]) = (u, i);
        }
        let found = steady("r", &samples, CUT).unwrap();
        assert!(
            (found.power.value - 0.5 * (28.0 * 400.0 + 18.0 * 60.0)).abs() < 5.0,
            "{found:?}"
        );
        assert!((found.voltage.value * found.current.value - 23.0 * 230.0).abs() < 5.0);
        let pieces = pieces(&samples, 50);
        assert_eq!(pieces.len(), 50);
        let middle = pieces[25];
        assert_eq!((middle.current[1], middle.current[2]), (60.0, 400.0));
    }

    /// A pulsed arc of 10 s at 5 kHz with noise, in steps of a converter.
    fn pulsed() -> Samples {
        let noise = |k: i32, step: f64| {
            (f64::from(k) * step).fract() + (f64::from(k) * 3.1 * step).fract() - 1.0
        };
        let times: Vec<f64> = (0..60_000).map(|k| f64::from(k) / 5000.0).collect();
        let high = |k: i32| (k / 20) % 2 == 0;
        let lit = |k: i32| (5000..55_000).contains(&k);
        let of = |[low, most]: [f64; 2], rough: f64, step: f64| {
            let value = |k: i32| if high(k) { most } else { low } + rough * noise(k, step);
            let stepped = |v: f64| (v * 50.0).round() / 50.0;
            (0..60_000)
                .map(|k| if lit(k) { stepped(value(k)) } else { 0.0 })
                .collect()
        };
        Samples {
            voltage: of([18.0, 28.0], 1.5, 0.618_034),
            current: of([60.0, 330.0], 6.0, 0.754_878),
            feed: Some(vec![100.0; times.len()]),
            usual: 2e-4,
            times,
        }
    }

    /// What a channel cuts off, one that is dead, short breaks and a feed that was hardly written are told; an arc that is whole is.
    #[test]
    fn channels_that_end_or_are_dead_are_told() {
        let found = |change: &dyn Fn(&mut Samples)| {
            let mut samples = pulsed();
            change(&mut samples);
            steady("r", &samples, CUT).unwrap()
        };
        let whole = found(&|_| {});
        assert_eq!(
            [whole.clipped, whole.dark, whole.unfed],
            [0.0; 3],
            "{whole:?}"
        );
        let cut = found(&|s| s.current.iter_mut().for_each(|i| *i = i.min(250.0)));
        assert!((cut.clipped - 0.5).abs() < 0.01, "{}", cut.clipped);
        let low = found(&|s| s.voltage.iter_mut().for_each(|u| *u = u.max(17.9)));
        assert!((low.clipped - 0.25).abs() < 0.1, "{}", low.clipped);
        let dead = found(&|s| s.voltage.fill(21.0));
        assert_eq!(dead.clipped, 1.0);
        // 40 ms in 100 without an arc, and without the touch of a short circuit
        let breaks = |volts: f64| {
            found(&move |s| {
                for k in (5000..55_000).filter(|k| k % 500 < 200) {
                    (s.voltage[k], s.current[k]) = (volts, 0.0);
                }
            })
        };
        let share = breaks(55.0);
        assert!(
            (share.dark / (share.used[1] - share.used[0]) - 0.4).abs() < 0.01,
            "{}",
            share.dark
        );
        assert_eq!(breaks(2.0).dark, 0.0);
        let fed = |every: usize, until: usize| {
            found(&move |s| {
                let feed = s.feed.as_mut().unwrap();
                for (k, v) in feed.iter_mut().enumerate() {
                    if k % every != 0 || k > until {
                        *v = f64::NAN;
                    }
                }
            })
        };
        // a slower clock of the feed is no hole; half a second of it is
        assert_eq!(fed(500, 60_000).unfed, 0.0);
        let [few, used] = [fed(1, 12_000).unfed, 8.5];
        assert!((few / used - 0.9).abs() < 0.02, "{few}");
    }
}
