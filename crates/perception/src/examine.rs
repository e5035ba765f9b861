//! Looks at a record before anything is concluded from it: limits that were hit, channels that stand still, channels that
//! look exchanged. What it finds are warnings: a record may be odd and right.

use std::collections::BTreeSet;

use meltpath_base::Reporter;

use crate::record::{Channel, Record};

/// A signal with fewer levels than this is a drawn one (a binary sequence, a staircase) and may sit on its extremes.
const LEVELS: usize = 16;

/// Share of the samples on an extreme beyond which a channel is said to saturate.
const SATURATED: f64 = 0.005;

/// Rounds of one extreme in a row that chance does not explain.
const RUN: usize = 4;

/// Examines a record; findings go to `reporter`.
pub fn examine(record: &Record, reporter: &Reporter) {
    for channel in &record.channels {
        still(channel, reporter);
        saturated(channel, record.period, reporter);
    }
    exchanged(record, reporter);
}

fn still(channel: &Channel, reporter: &Reporter) {
    let Some(&first) = channel.samples.first() else {
        return;
    };
    if channel.samples.iter().all(|v| *v == first) {
        reporter.warn(
            "channel-still",
            format!(
                "channel \"{}\" is {first} {} throughout",
                channel.name, channel.unit
            ),
            "check the wire and the column in the mapping",
        );
    }
}

/// Several samples in a row on the greatest or least value of a signal that has many values.
fn saturated(channel: &Channel, period: f64, reporter: &Reporter) {
    let mut levels = BTreeSet::new();
    for v in &channel.samples {
        levels.insert(v.to_bits());
        if levels.len() >= LEVELS {
            break;
        }
    }
    if levels.len() < LEVELS {
        return;
    }
    let least = channel
        .samples
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    let most = channel
        .samples
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    for extreme in [least, most] {
        let (mut inside, mut first, mut run) = (0usize, None, 0usize);
        for (i, v) in channel.samples.iter().enumerate() {
            if *v == extreme {
                run += 1;
                if run == RUN {
                    inside += RUN;
                    first = first.or(Some(i + 1 - RUN));
                } else if run > RUN {
                    inside += 1;
                }
            } else {
                run = 0;
            }
        }
        let share = inside as f64 / channel.samples.len() as f64;
        if let (Some(first), true) = (first, share > SATURATED) {
            reporter.warn(
                "channel-saturated",
                format!(
                    "channel \"{}\" rests on its extreme {extreme} {} for {:.1} % of the record, first at {:.4} s",
                    channel.name,
                    channel.unit,
                    100.0 * share,
                    first as f64 * period
                ),
                "lower the excitation or widen the sensor's range, and record again",
            );
        }
    }
}

/// Power of the steps from sample to sample over the power of the signal: an angle, which integrates, is far smoother than
/// the current that drives it, and that than a binary voltage.
pub fn roughness(samples: &[f64]) -> f64 {
    if samples.len() < 2 {
        return 0.0;
    }
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let power: f64 = samples.iter().map(|v| (v - mean) * (v - mean)).sum();
    let steps: f64 = samples
        .windows(2)
        .map(|w| (w[1] - w[0]) * (w[1] - w[0]))
        .sum();
    if power > 0.0 { steps / power } else { 0.0 }
}

/// An angle rougher than a voltage or a current of the same record.
fn exchanged(record: &Record, reporter: &Reporter) {
    let of = |unit: &'static str| record.channels.iter().filter(move |c| c.unit == unit);
    for angle in of("rad") {
        let own = roughness(&angle.samples);
        for other in of("A").chain(of("V")) {
            let its = roughness(&other.samples);
            // a drawn set-point in radians is rough too: only what was measured integrates
            let drawn = angle.name.contains("set") || angle.name.contains("reference");
            if its > 0.0 && own > its && !drawn {
                reporter.warn(
                    "channels-exchanged",
                    format!(
                        "the angle \"{}\" jumps more from sample to sample than \"{}\" ({own:.2e} against {its:.2e} of its power): the columns look exchanged",
                        angle.name, other.name
                    ),
                    "check the columns in the mapping",
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(channels: &[(&str, &str, Vec<f64>)]) -> Record {
        Record {
            period: 1e-4,
            channels: channels
                .iter()
                .map(|(name, unit, samples)| Channel {
                    name: (*name).to_owned(),
                    unit: (*unit).to_owned(),
                    samples: samples.clone(),
                })
                .collect(),
        }
    }

    fn codes(record: &Record) -> Vec<String> {
        let reporter = Reporter::new();
        examine(record, &reporter);
        reporter.warnings().iter().map(|w| w.code.clone()).collect()
    }

    #[test]
    fn roughness_is_the_power_of_the_steps_over_that_of_the_signal() {
        // about its mean of 102 the ramp has 4 + 1 + 0 + 1 + 4, its steps 4
        let ramp = [100.0, 101.0, 102.0, 103.0, 104.0];
        assert!((roughness(&ramp) - 0.4).abs() < 1e-15);
        // alternating samples: each of the three steps has four times the power of a sample
        assert!((roughness(&[1.0, -1.0, 1.0, -1.0]) - 3.0).abs() < 1e-15);
        assert_eq!((roughness(&[7.0; 5]), roughness(&[7.0])), (0.0, 0.0));
    }

    #[test]
    fn how_long_and_from_when_a_channel_saturates() {
        let mut samples: Vec<f64> = (0..200).map(|i| (0.37 * f64::from(i)).sin()).collect();
        // too short to count, then five and seven samples on the greatest value
        samples[20..23].fill(2.0);
        samples[50..55].fill(2.0);
        samples[120..127].fill(2.0);
        let reporter = Reporter::new();
        examine(&record(&[("current", "A", samples)]), &reporter);
        let warnings = reporter.warnings();
        assert_eq!(warnings.len(), 1);
        let message = &warnings[0].message;
        assert!(
            message.contains("extreme 2 A for 6.0 % of the record, first at 0.0050 s"),
            "{message}"
        );
    }

    #[test]
    fn what_is_wrong_is_named_and_what_is_right_is_not() {
        let wave = |f: f64, limit: f64| -> Vec<f64> {
            (0..2000)
                .map(|i| (f * f64::from(i)).sin().clamp(-limit, limit))
                .collect()
        };
        let binary: Vec<f64> = (0..2000)
            .map(|i| if i % 7 < 3 { 1.0 } else { -1.0 })
            .collect();
        let good = [
            ("voltage", "V", binary.clone()),
            ("current", "A", wave(0.5, 2.0)),
            ("angle", "rad", wave(0.01, 2.0)),
        ];
        assert_eq!(codes(&record(&good)), Vec::<String>::new());
        assert_eq!(
            codes(&record(&[("current", "A", wave(0.05, 0.9))])),
            ["channel-saturated", "channel-saturated"]
        );
        assert_eq!(
            codes(&record(&[("current", "A", vec![0.25; 50])])),
            ["channel-still"]
        );
        let swapped = [
            ("current", "A", wave(0.01, 2.0)),
            ("angle", "rad", wave(0.5, 2.0)),
        ];
        assert_eq!(codes(&record(&swapped)), ["channels-exchanged"]);
    }
}
