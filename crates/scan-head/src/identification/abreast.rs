//! Motors that one record drives side by side, each in a lane of vector registers. A motor alone waits for its own last sample; several
//! fill that time. Each lane has the bits that its motor has alone.

use meltpath_numerics::vector::{Level, Loop};

use crate::identification::drive::{Drive, LATEST, Linear};

/// Lanes: as many as the widest registers have.
const LANES: usize = 8;

/// One value of each lane.
type Lanes<const L: usize> = [f64; L];

/// A motor and the state in which it begins.
pub(super) type Run<'a, const N: usize> = (&'a Drive<N>, [f64; N]);

/// Current (A) and angle (rad) of motors at each sample; the first [`LATEST`] samples may be missing (not a number).
pub(super) struct Responses {
    /// Of each set of motors the current and the angle.
    sets: Vec<[Vec<Lanes<LANES>>; 2]>,
}

impl Responses {
    /// Of motors under held voltages.
    pub(super) fn of<const N: usize>(runs: &[Run<'_, N>], voltage: &[f64]) -> Self {
        let sets = runs.chunks(LANES);
        Responses {
            sets: sets.map(|set| abreast(set, voltage).0).collect(),
        }
    }

    /// What is read of a motor: current (0) or angle (1), A or rad.
    #[inline]
    pub(super) fn at(&self, run: usize, channel: usize, sample: usize) -> f64 {
        self.sets[run / LANES][channel][sample][run % LANES]
    }
}

/// Current and angle of one motor at each sample under held voltages; the first [`LATEST`] samples may be missing (not a number).
pub(super) fn run<const N: usize>(
    drive: &Drive<N>,
    start: &[f64; N],
    voltage: &[f64],
) -> [Vec<f64>; 2] {
    let (read, _) = abreast::<N, 1>(&[(drive, *start)], voltage);
    read.map(|channel| channel.into_iter().flatten().collect())
}

/// The state in which held voltages leave a motor.
pub(super) fn end<const N: usize>(drive: &Drive<N>, start: &[f64; N], voltage: &[f64]) -> [f64; N] {
    let (_, end) = abreast::<N, 1>(&[(drive, *start)], voltage);
    end.map(|[x]| x)
}

/// Current and angle of as many motors as there are lanes, or fewer, and the states in which voltages leave them.
fn abreast<const N: usize, const L: usize>(
    runs: &[Run<'_, N>],
    voltage: &[f64],
) -> ([Vec<Lanes<L>>; 2], [Lanes<L>; N]) {
    let mut read = [(); 2].map(|()| vec![[f64::NAN; L]; voltage.len() + LATEST]);
    let mut end = [[0.0; L]; N];
    let side = Abreast {
        runs,
        voltage,
        read: &mut read,
        end: &mut end,
    };
    match L {
        1 => side.run(),
        _ => Level::widest().run(side),
    }
    for column in &mut read {
        column.truncate(voltage.len());
    }
    (read, end)
}

/// `M` values linear in state, voltage and friction torque, in each lane.
struct Wide<const N: usize, const M: usize, const L: usize> {
    state: [[Lanes<L>; M]; N],
    voltage: [Lanes<L>; M],
    torque: [Lanes<L>; M],
}

impl<const N: usize, const M: usize, const L: usize> Wide<N, M, L> {
    const NONE: Self = Wide {
        state: [[[0.0; L]; M]; N],
        voltage: [[0.0; L]; M],
        torque: [[0.0; L]; M],
    };

    /// Puts one motor's in a lane.
    fn put(&mut self, lane: usize, of: &Linear<N, M>) {
        for (wide, column) in self.state.iter_mut().zip(&of.state) {
            put(wide, lane, column);
        }
        put(&mut self.voltage, lane, &of.voltage);
        put(&mut self.torque, lane, &of.torque);
    }

    #[inline(always)]
    fn of(&self, x: &[Lanes<L>; N], u: f64, torque: &Lanes<L>) -> [Lanes<L>; M] {
        let mut out = [[0.0; L]; M];
        for (column, x) in self.state.iter().zip(x) {
            add(&mut out, column, x);
        }
        add(&mut out, &self.voltage, &[u; L]);
        add(&mut out, &self.torque, torque);
        out
    }
}

fn put<const M: usize, const L: usize>(wide: &mut [Lanes<L>; M], lane: usize, values: &[f64; M]) {
    for (wide, value) in wide.iter_mut().zip(values) {
        wide[lane] = *value;
    }
}

#[inline(always)]
fn add<const M: usize, const L: usize>(
    out: &mut [Lanes<L>; M],
    column: &[Lanes<L>; M],
    by: &Lanes<L>,
) {
    for (out, weight) in out.iter_mut().zip(column) {
        for lane in 0..L {
            out[lane] += weight[lane] * by[lane];
        }
    }
}

#[inline(always)]
fn dot<const N: usize, const L: usize>(a: &[Lanes<L>; N], b: &[Lanes<L>; N]) -> Lanes<L> {
    let mut out = [0.0; L];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..L {
            out[lane] += a[lane] * b[lane];
        }
    }
    out
}

/// What motors do between events.
struct Goes<const N: usize, const L: usize> {
    whole: Wide<N, N, L>,
    seen: Wide<N, 3, L>,
    /// Weights of what ends the regime.
    watched: [Lanes<L>; N],
    torque: Lanes<L>,
    way: Lanes<L>,
    coulomb: Lanes<L>,
    bias: Lanes<L>,
    /// What a turn must leave of the margin: nothing, or less where friction never turns.
    least: Lanes<L>,
}

impl<const N: usize, const L: usize> Goes<N, L> {
    /// Lanes without motors: they stand still.
    const NONE: Self = Goes {
        whole: Wide::NONE,
        seen: Wide::NONE,
        watched: [[0.0; L]; N],
        torque: [0.0; L],
        way: [1.0; L],
        coulomb: [0.0; L],
        bias: [0.0; L],
        least: [f64::NEG_INFINITY; L],
    };

    /// Lets the motor of a lane go that way (0: not at all).
    fn put(&mut self, lane: usize, drive: &Drive<N>, way: f64) {
        let (regime, torque) = drive.regime(way);
        self.whole.put(lane, &regime.whole);
        self.seen.put(lane, &regime.seen);
        put(&mut self.watched, lane, drive.watched(way));
        self.torque[lane] = torque;
        self.way[lane] = way;
        self.coulomb[lane] = drive.coulomb;
        self.bias[lane] = drive.bias;
        self.least[lane] = if drive.turns() {
            0.0
        } else {
            f64::NEG_INFINITY
        };
    }

    /// Below zero once the rotor has turned, or what holds it does not suffice.
    #[inline(always)]
    fn margin(&self, watched: &Lanes<L>) -> Lanes<L> {
        std::array::from_fn(|lane| {
            let held = self.coulomb[lane] - (watched[lane] - self.bias[lane]).abs();
            let slides = self.way[lane] * watched[lane];
            if self.way[lane] == 0.0 { held } else { slides }
        })
    }
}

/// Motors that are driven by voltages.
struct Abreast<'a, const N: usize, const L: usize> {
    runs: &'a [Run<'a, N>],
    voltage: &'a [f64],
    read: &'a mut [Vec<Lanes<L>>; 2],
    end: &'a mut [Lanes<L>; N],
}

impl<const N: usize, const L: usize> Loop for Abreast<'_, N, L> {
    #[inline(always)]
    fn run(self) {
        let Abreast {
            runs,
            voltage,
            read,
            end,
        } = self;
        let mut goes = Goes::<N, L>::NONE;
        let mut x = [[0.0; L]; N];
        let mut zero = [0.0; L];
        for (lane, (drive, start)) in runs.iter().enumerate() {
            let mut state = *start;
            let way = drive.begins(&mut state);
            goes.put(lane, drive, way);
            put(&mut x, lane, &state);
            zero[lane] = drive.zero;
        }
        let late = [0, 1].map(|channel| together::<N>(runs, channel));
        let mut begin = goes.margin(&dot(&goes.watched, &x));
        for (k, &u) in voltage.iter().enumerate() {
            let mut next = goes.whole.of(&x, u, &goes.torque);
            let [middle, mut current, mut angle] = goes.seen.of(&x, u, &goes.torque);
            let middle = goes.margin(&middle);
            let mut after = goes.margin(&dot(&goes.watched, &next));
            // a turn between these points would bend the margin by more than what is left of it
            let mut turns = [0_u64; L];
            for lane in 0..L {
                let least = if after[lane] < middle[lane] {
                    after[lane]
                } else {
                    middle[lane]
                };
                let bend = (begin[lane] - 2.0 * middle[lane] + after[lane]).abs();
                turns[lane] = u64::from(least - bend <= goes.least[lane]);
            }
            if turns.iter().fold(0, |any, turns| any | turns) != 0 {
                for (lane, (drive, _)) in runs.iter().enumerate() {
                    if turns[lane] == 0 {
                        continue;
                    }
                    let mut state = x.map(|x| x[lane]);
                    let Some((readings, way)) = drive.eventful(&mut state, u, goes.way[lane])
                    else {
                        continue;
                    };
                    [current[lane], angle[lane]] = readings;
                    put(&mut next, lane, &state);
                    if way != goes.way[lane] {
                        goes.put(lane, drive, way);
                    }
                }
                after = goes.margin(&dot(&goes.watched, &next));
            }
            for lane in 0..L {
                current[lane] += zero[lane];
            }
            for ((channel, (rows, values)), late) in
                (0..).zip(read.iter_mut().zip([current, angle])).zip(late)
            {
                if let Some(late) = late {
                    rows[k + late] = values;
                } else {
                    for (lane, (drive, _)) in runs.iter().enumerate() {
                        rows[k + drive.late(channel)][lane] = values[lane];
                    }
                }
            }
            (x, begin) = (next, after);
        }
        *end = x;
    }
}

/// The samples by which a channel of all motors is late, if it is the same.
fn together<const N: usize>(runs: &[Run<'_, N>], channel: usize) -> Option<usize> {
    let (first, _) = runs.first()?;
    let late = first.late(channel);
    runs.iter()
        .all(|(drive, _)| drive.late(channel) == late)
        .then_some(late)
}
