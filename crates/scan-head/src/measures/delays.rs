//! Tuning of the laser's delays: how much is marked where nothing was asked, how much is missing, against both delays.
//!
//! Source: Rasoanarivo 2020, § 2.6.1 (by trial and error on the simulator); the measures and the search are
//! ours (docs/theory/sources.md). Light for the shortest mark: SCANLAB RTC4 manual, rev. 1.3, p. 24: the laser-off delay is the longer. A stuck axis may leave the whole path beside its mark, which no delay cures: what counts is light
//! and marks farther than the spot's radius from where the chain's own path runs steadily. The gate does not act on the mirrors: one run is enough for every pair of delays.

#![expect(
    clippy::cast_possible_wrap,
    reason = "numbers of samples are far below 2^63"
)]

use meltpath_geometry::math::DVec2;

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::gate::{Chain, Chains};
use crate::head::recipe::LaserDelays;
use crate::head::vector::ScanJob;
use crate::measures::segment::distance_to_segment;
use meltpath_toolpath::Role;

/// Records the point hit at every sample: for runs of a few squares.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HitRecord {
    /// Points hit, mm.
    pub hits: Vec<DVec2>,
}

impl HeadSink for HitRecord {
    fn block(&mut self, block: &HeadBlock) {
        self.hits.extend_from_slice(&block.hit);
    }
}

/// Length marked where nothing was asked, and length asked but not marked, at starts and ends of chains, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayScore {
    /// The delays.
    pub delays: LaserDelays,
    /// Lit path farther than the spot's radius from any mark, light of starts, mm.
    pub spurious_start: f64,
    /// The same, light of ends, mm.
    pub spurious_end: f64,
    /// Marks farther than the spot's radius from any lit point, at starts, mm.
    pub missing_start: f64,
    /// The same, at ends, mm.
    pub missing_end: f64,
}

impl DelayScore {
    /// All that is marked wrongly, mm.
    pub fn spurious(&self) -> f64 {
        self.spurious_start + self.spurious_end
    }

    /// All that is missing, mm.
    pub fn missing(&self) -> f64 {
        self.missing_start + self.missing_end
    }
}

/// What one end of a chain would cost for each delay, in samples relative to its commanded start or end.
#[derive(Debug, Clone, Default)]
struct EndCost {
    /// Before or after which relative sample the light is spurious, and how long the path is there.
    spurious: Vec<(i64, f64)>,
    /// Relative samples between which a piece of the mark can be reached, and how long the piece is.
    reached: Vec<(i64, i64, f64)>,
}

/// A tuning: the costs of every delay.
#[derive(Debug, Clone)]
pub struct DelayTuning {
    period: f64,
    starts: EndCost,
    ends: EndCost,
    longest: i64,
    /// The longest delay that is tried, samples.
    tried: i64,
    /// Length of all marks, mm.
    marked: f64,
}

/// Share of the marks' length that may stay dark at starts for the sake of no spurious light: beyond, a delay cures less than it costs.
const MOST_DARK: f64 = 0.25;
/// A path may run this many radii beside its mark.
const BESIDE: f64 = 4.0;
/// A cost this near to the least, as a share of its range, is the least: tails of settling are long.
const NEARLY: f64 = 0.01;
/// Spacing of the points of marks that are looked for, mm.
const PIECE: f64 = 5e-3;

impl DelayTuning {
    /// From one run's hits. `reach` s is the longest delay considered, `radius` mm the spot's.
    pub fn new(job: &ScanJob, hits: &[DVec2], period: f64, reach: f64, radius: f64) -> Self {
        let longest = (reach / period).ceil() as i64;
        let mut tuning = DelayTuning {
            period,
            starts: EndCost::default(),
            ends: EndCost::default(),
            longest,
            tried: (reach / period + 1e-9).floor() as i64,
            marked: job.length(Role::Contour) + job.length(Role::Fill),
        };
        let chains = Chains::all(job, period);
        let ends = vector_ends(job, period);
        for (c, chain) in chains.iter().enumerate() {
            let marks: Vec<(DVec2, DVec2)> = (chain.first..=chain.last)
                .map(|i| {
                    (
                        job.start_of(i as usize).truncate(),
                        job.vectors[i as usize].end.truncate(),
                    )
                })
                .collect();
            // light may fall on the neighbouring chains' marks too: they were asked for
            let near: Vec<(DVec2, DVec2)> = chains[c.saturating_sub(1)..(c + 2).min(chains.len())]
                .iter()
                .flat_map(|n| n.first..=n.last)
                .map(|i| {
                    (
                        job.start_of(i as usize).truncate(),
                        job.vectors[i as usize].end.truncate(),
                    )
                })
                .collect();
            let next = chains.get(c + 1).map_or(hits.len() as u64, |n| n.start);
            let (start, end) = (chain.start as i64, chain.end as i64);
            let half = i64::midpoint(start, end);
            let off = |k: i64| {
                let p = hits[k as usize];
                near.iter()
                    .map(|&(a, b)| distance_to_segment(p, a, b))
                    .fold(f64::MAX, f64::min)
            };
            let last = hits.len() as i64;
            let cost = |from: i64, to: i64, origin: i64, radius: f64, out: &mut EndCost| {
                for k in from.max(1)..to.min(last) {
                    if off(k) > radius {
                        let length = hits[k as usize].distance(hits[k as usize - 1]);
                        out.spurious.push((k - origin, length));
                    }
                }
            };
            // where the path runs steadily: the middle third of the first and of the last vector
            let steady = |from: i64, to: i64| {
                let third = (to - from) / 3;
                let mut all: Vec<f64> = (from + third..=to - third)
                    .filter(|k| *k < last)
                    .map(off)
                    .collect();
                all.sort_by(f64::total_cmp);
                all.get(all.len() / 2)
                    .copied()
                    .unwrap_or(0.0)
                    .min(BESIDE * radius)
            };
            let first_end = ends[chain.first as usize] as i64;
            let last_start = if chain.last == chain.first {
                start
            } else {
                ends[chain.last as usize - 1] as i64
            };
            let at_start = radius + steady(start, first_end);
            let at_end = radius + steady(last_start, end);
            cost(
                start,
                half.min(start + longest),
                start,
                at_start,
                &mut tuning.starts,
            );
            // whatever the off-delay, light before the middle of the chain belongs to its start
            let until = (end + longest).min(next as i64);
            cost(
                half.max(end - longest),
                until,
                end,
                at_end,
                &mut tuning.ends,
            );
            let radii = (at_start, at_end);
            tuning.pieces(chain, &marks, &ends, hits, radii);
        }
        tuning
    }

    /// Which samples reach the first and the last millimetres of a chain.
    fn pieces(
        &mut self,
        chain: &Chain,
        marks: &[(DVec2, DVec2)],
        ends: &[u64],
        hits: &[DVec2],
        radii: (f64, f64),
    ) {
        let (Some(&first), Some(&last)) = (marks.first(), marks.last()) else {
            return;
        };
        let longest = self.longest;
        let mut side = |(a, b): (DVec2, DVec2), at_start: bool, from: u64, to: u64| {
            let length = a.distance(b);
            let speed = length / (to - from).max(1) as f64;
            let radius = if at_start { radii.0 } else { radii.1 };
            let span = (speed * longest as f64).min(0.5 * length);
            let n = (span / PIECE).ceil() as usize;
            for i in 0..n {
                let s = (i as f64 + 0.5) / n as f64 * span;
                let target =
                    if at_start { a } else { b }.lerp(if at_start { b } else { a }, s / length);
                let commanded = if at_start {
                    from as f64 + s / speed
                } else {
                    to as f64 - s / speed
                };
                let origin = if at_start { chain.start } else { chain.end } as i64;
                let window = (commanded as i64 - longest).max(0)
                    ..(commanded as i64 + 2 * longest).min(hits.len() as i64);
                // the first and the last sample that reach the point while the chain may be lit
                let mut reached = window.filter(|&k| hits[k as usize].distance(target) <= radius);
                let piece = span / n as f64;
                let out = if at_start {
                    &mut self.starts
                } else {
                    &mut self.ends
                };
                match reached.next() {
                    None => out.reached.push((i64::MAX, i64::MIN, piece)),
                    Some(k) => {
                        let until = reached.next_back().unwrap_or(k);
                        out.reached.push((k - origin, until - origin, piece));
                    }
                }
            }
        };
        let start_end = ends[chain.first as usize];
        side(first, true, chain.start, start_end);
        let last_start = if chain.last == 0 {
            0
        } else {
            ends[chain.last as usize - 1]
        };
        side(last, false, last_start.max(chain.start), chain.end);
    }

    /// The costs of a pair of delays.
    pub fn score(&self, delays: LaserDelays) -> DelayScore {
        let on = (delays.on / self.period).round() as i64;
        let off = (delays.off / self.period).round() as i64;
        let sum = |list: &[(i64, f64)], wanted: &dyn Fn(i64) -> bool| {
            list.iter()
                .filter(|(k, _)| wanted(*k))
                .map(|(_, l)| l)
                .sum::<f64>()
                .max(0.0)
        };
        let lost = |list: &[(i64, i64, f64)], lost: &dyn Fn(i64, i64) -> bool| {
            list.iter()
                .filter(|(a, b, _)| lost(*a, *b))
                .map(|(_, _, l)| l)
                .sum::<f64>()
                .max(0.0)
        };
        DelayScore {
            delays,
            spurious_start: sum(&self.starts.spurious, &|k| k > on),
            spurious_end: sum(&self.ends.spurious, &|k| k <= off),
            missing_start: lost(&self.starts.reached, &|_, b| b <= on),
            missing_end: lost(&self.ends.reached, &|a, _| a > off),
        }
    }

    /// Every on-delay with the off-delay 0, then every off-delay with the on-delay found: the table that was searched.
    fn table(&self, of: impl Fn(f64) -> LaserDelays) -> Vec<DelayScore> {
        (0..=self.tried)
            .map(|k| self.score(of(k as f64 * self.period)))
            .collect()
    }

    /// The tuned delays, and the two tables searched. The on-delay: the shortest with the least spurious light at starts, among those
    /// that leave no more than a quarter of the marks' length dark. The off-delay: the shortest with the least missing at ends. Where
    /// this pair leaves the shortest chain of marks, of `shortest` s, without light, the two meet where least is spurious and missing: every
    /// chain is then lit for as long as it lasts.
    pub fn tune(&self, shortest: f64) -> Tuned {
        let on_table = self.table(|on| LaserDelays { on, off: 0.0 });
        let allowed = MOST_DARK * self.marked + on_table.first().map_or(0.0, |s| s.missing_start);
        let bright = on_table.partition_point(|s| s.missing_start <= allowed);
        let on = least(&on_table[..bright], |s| s.spurious_start).on;
        let off_table = self.table(|off| LaserDelays { on, off });
        let off = least(&off_table, |s| s.missing_end).off;
        // half a sample: chains and delays are whole numbers of samples
        let dark = on - off > shortest - 0.5 * self.period;
        let best = if dark {
            self.meeting(off, on)
        } else {
            self.score(LaserDelays { on, off })
        };
        let held = least(&on_table, |s| s.spurious_start).on > best.delays.on;
        Tuned {
            best,
            held,
            on_table,
            off_table,
        }
    }

    /// The pair of equal delays between `off` and `on`, s, with the least that is spurious or missing.
    fn meeting(&self, off: f64, on: f64) -> DelayScore {
        let [from, to] = [off, on].map(|delay| (delay / self.period).round() as i64);
        let wrong = |s: &DelayScore| s.spurious() + s.missing();
        (from..=to)
            .map(|k| k as f64 * self.period)
            .map(|delay| {
                self.score(LaserDelays {
                    on: delay,
                    off: delay,
                })
            })
            .min_by(|a, b| wrong(a).total_cmp(&wrong(b)))
            .unwrap_or_else(|| self.score(LaserDelays { on: off, off }))
    }

    /// The pairs of delays, in steps of `step` samples, that no other pair beats in both spurious and missing length, by
    /// rising spurious length.
    pub fn pareto(&self, step: usize) -> Vec<DelayScore> {
        // starts depend on the on-delay alone and ends on the off-delay alone: the two fronts are found apart, then joined
        let values: Vec<f64> = (0..=self.tried)
            .step_by(step.max(1))
            .map(|k| k as f64 * self.period)
            .collect();
        let mut all: Vec<DelayScore> = values
            .iter()
            .flat_map(|&on| values.iter().map(move |&off| LaserDelays { on, off }))
            .map(|d| self.score(d))
            .collect();
        all.sort_by(|a, b| {
            (a.spurious(), a.missing(), a.delays.on, a.delays.off)
                .partial_cmp(&(b.spurious(), b.missing(), b.delays.on, b.delays.off))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let mut front: Vec<DelayScore> = Vec::new();
        for score in all {
            if front
                .last()
                .is_none_or(|f| score.missing() < f.missing() - 1e-12)
            {
                front.push(score);
            }
        }
        front
    }
}

/// What a tuning found.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuned {
    /// The delays and their costs.
    pub best: DelayScore,
    /// Whether a longer on-delay would leave less spurious light, and too much of the marks dark or a chain without light.
    pub held: bool,
    /// Costs against the on-delay.
    pub on_table: Vec<DelayScore>,
    /// Costs against the off-delay.
    pub off_table: Vec<DelayScore>,
}

/// The shortest delay whose cost is the least, to [`NEARLY`] of the range.
fn least(table: &[DelayScore], cost: impl Fn(&DelayScore) -> f64) -> LaserDelays {
    let values = || table.iter().map(&cost);
    let (low, high) = (
        values().fold(f64::MAX, f64::min),
        values().fold(0.0, f64::max),
    );
    let enough = low + NEARLY * (high - low);
    table
        .iter()
        .find(|s| cost(s) <= enough)
        .map_or(LaserDelays::default(), |s| s.delays)
}

/// The sample at which each vector ends, waits before it included.
fn vector_ends(job: &ScanJob, period: f64) -> Vec<u64> {
    let mut sample = 0;
    (0..job.vectors.len())
        .map(|i| {
            let (m, w) = job.samples_of(i, period);
            let end = sample + m;
            sample = end + w;
            end
        })
        .collect()
}
