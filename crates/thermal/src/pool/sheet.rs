//! Where a pool is looked for: nodes on the build plane, or a plane at some depth, and on the plane below the path; sums of
//! Gaussians over them.

use crate::material::medium::{Body, Medium};
use crate::numeric::fast_exp::exp_not_positive;
use crate::pool::MeltPool;
use meltpath_numerics::vector::{Level, Loop};

/// A Gaussian of a given spread at a given place: heat over heat capacity, centre, variances in the plane and in depth.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub(crate) weight: f64,
    pub(crate) centre: [f64; 2],
    pub(crate) variance: [f64; 2],
    pub(crate) depth_variance: f64,
}

const ALONG: usize = 48;
const ACROSS: usize = 32;
const DOWN: usize = 16;

/// Nodes along the travel, across it, and down.
pub(crate) struct Sheet {
    centre: [f64; 2],
    direction: [f64; 2],
    /// Reach behind, ahead, to each side, down, mm.
    pub(crate) size: [f64; 4],
    along: [f64; ALONG],
    across: [f64; ACROSS],
    down: [f64; DOWN],
    /// Depth of the horizontal plane, mm: 0 is the build plane.
    level: f64,
}

/// Rises of temperature on the nodes of a sheet, K.
pub(crate) struct Sums {
    /// On the horizontal plane.
    top: Vec<[f64; ACROSS]>,
    /// Below the path.
    below: Vec<[f64; DOWN]>,
}

impl Sheet {
    pub(crate) fn new(centre: [f64; 2], direction: [f64; 2], size: [f64; 4]) -> Self {
        let spaced =
            |n: usize, i: usize, from: f64, to: f64| from + (to - from) * i as f64 / (n - 1) as f64;
        Sheet {
            centre,
            direction,
            size,
            along: std::array::from_fn(|i| spaced(ALONG, i, -size[0], size[1])),
            across: std::array::from_fn(|i| spaced(ACROSS, i, -size[2], size[2])),
            down: std::array::from_fn(|i| spaced(DOWN, i, 0.0, size[3])),
            level: 0.0,
        }
    }

    /// The sheet with its horizontal plane at `depth` mm below the build plane.
    pub(crate) fn at_depth(self, depth: f64) -> Self {
        Sheet {
            level: depth,
            ..self
        }
    }

    /// The corners of the horizontal plane, mm.
    pub(crate) fn corners(&self) -> [[f64; 2]; 4] {
        let [behind, ahead, side, _] = self.size;
        [
            [-behind, -side],
            [ahead, -side],
            [ahead, side],
            [-behind, side],
        ]
        .map(|[a, b]| {
            let [ux, uy] = self.direction;
            [
                self.centre[0] + a * ux - b * uy,
                self.centre[1] + a * uy + b * ux,
            ]
        })
    }

    /// Rise at a point of the horizontal plane, between its nodes; none beside the sheet.
    pub(crate) fn rise(&self, sums: &Sums, point: [f64; 2]) -> Option<f64> {
        let (dx, dy) = (point[0] - self.centre[0], point[1] - self.centre[1]);
        let [ux, uy] = self.direction;
        let [behind, ahead, side, _] = self.size;
        let place = |at: f64, from: f64, to: f64, n: usize| {
            let share = (at - from) / (to - from) * (n - 1) as f64;
            let below = share.floor().min((n - 2) as f64);
            (share >= 0.0 && share <= (n - 1) as f64).then_some((below as usize, share - below))
        };
        let (i, a) = place(dx * ux + dy * uy, -behind, ahead, ALONG)?;
        let (j, b) = place(dy * ux - dx * uy, -side, side, ACROSS)?;
        let row = |i: usize| (1.0 - b) * sums.top[i][j] + b * sums.top[i][j + 1];
        Some((1.0 - a) * row(i) + a * row(i + 1))
    }

    /// Pool size, how far it reaches behind, ahead, to the sides and down, and whether it touches the border there.
    pub(crate) fn measure(
        &self,
        sums: &Sums,
        ambient: f64,
        liquidus: f64,
    ) -> (MeltPool, [f64; 4], [bool; 4]) {
        let limit = liquidus - ambient;
        let pool = connected(&sums.top, limit);
        let hottest = sums.top.iter().flatten().copied().fold(0.0, f64::max);
        let cells = pool.iter().flatten().filter(|m| **m).count();
        if cells == 0 {
            let pool = MeltPool {
                hottest: ambient + hottest,
                ..MeltPool::default()
            };
            return (pool, [0.0; 4], [false; 4]);
        }
        // ridges: the largest value across, between nodes, for every place along; and the other way round
        let turned: [[f64; ALONG]; ACROSS] =
            std::array::from_fn(|j| std::array::from_fn(|i| sums.top[i][j]));
        let pool_turned: [[bool; ALONG]; ACROSS] =
            std::array::from_fn(|j| std::array::from_fn(|i| pool[i][j]));
        let (behind, ahead) = extent(&sums.top, &pool, &self.along, limit);
        let (right, left) = extent(&turned, &pool_turned, &self.across, limit);
        let deep: [f64; DOWN] = std::array::from_fn(|k| {
            let level: [f64; ALONG] = std::array::from_fn(|i| sums.below[i][k]);
            // the plane below the path lies between the two middle columns of the surface
            let under: [bool; ALONG] =
                std::array::from_fn(|i| pool[i][ACROSS / 2 - 1] || pool[i][ACROSS / 2]);
            ridge(&level, &under)
        });
        let depth = if deep[0] > limit {
            crossing(&deep, &self.down, limit, 0, 1)
        } else {
            Some(0.0)
        };
        let touched = [
            behind.is_none(),
            ahead.is_none(),
            right.is_none() || left.is_none(),
            depth.is_none(),
        ];
        let at = |end: Option<f64>| end.unwrap_or(0.0);
        let pool = MeltPool {
            length: at(ahead) - at(behind),
            width: at(left) - at(right),
            depth: at(depth),
            hottest: ambient + hottest,
            cells,
        };
        let reach = [-at(behind), at(ahead), at(left).max(-at(right)), at(depth)];
        (pool, reach, touched)
    }

    fn frame(&self) -> Frame {
        Frame {
            centre: self.centre,
            direction: self.direction,
        }
    }
}

/// Origin on the path, x along the travel.
#[derive(Clone, Copy)]
struct Frame {
    centre: [f64; 2],
    direction: [f64; 2],
}

impl Frame {
    /// Place of a node, and its variances along and across the travel. Lumps are aligned with the axes: an oblique travel takes the two
    /// variances that a rotation gives and drops their covariance.
    #[inline(always)]
    fn of(&self, node: &Node) -> ([f64; 2], [f64; 2]) {
        let (dx, dy) = (
            node.centre[0] - self.centre[0],
            node.centre[1] - self.centre[1],
        );
        let [ux, uy] = self.direction;
        let (c, s) = (ux * ux, uy * uy);
        let [vx, vy] = node.variance;
        (
            [dx * ux + dy * uy, dy * ux - dx * uy],
            [c * vx + s * vy, s * vx + c * vy],
        )
    }
}

/// `exp(−(x − centre)²/(2 variance))` at all places.
#[inline(always)]
fn bell<const N: usize>(places: &[f64; N], centre: f64, variance: f64) -> [f64; N] {
    let scale = -0.5 / variance;
    let mut out = [0.0; N];
    for i in 0..N {
        let d = places[i] - centre;
        out[i] = exp_not_positive(scale * d * d);
    }
    out
}

/// Density along depth at all places.
#[inline(always)]
fn along_depth<const N: usize>(medium: &Medium, places: &[f64; N], spread: f64) -> [f64; N] {
    match medium.body {
        Body::HalfSpace => {
            let norm = 2.0 / (2.0 * std::f64::consts::PI * spread).sqrt();
            bell(places, 0.0, spread).map(|b| norm * b)
        }
        Body::Plate { .. } | Body::Cooled { .. } => places.map(|z| medium.along_depth(z, spread)),
    }
}

/// Adds nodes to sums on `A` × `B` places of the build plane and `A` × `C` below the path.
struct Superpose<'a, const A: usize, const B: usize, const C: usize> {
    frame: Frame,
    along: &'a [f64; A],
    across: &'a [f64; B],
    down: &'a [f64; C],
    nodes: &'a [Node],
    medium: &'a Medium,
    level: f64,
    top: &'a mut [[f64; B]; A],
    below: &'a mut [[f64; C]; A],
}

impl<const A: usize, const B: usize, const C: usize> Loop for Superpose<'_, A, B, C> {
    #[inline(always)]
    fn run(self) {
        for node in self.nodes {
            let ([x, y], [vx, vy]) = self.frame.of(node);
            let weight = node.weight / (2.0 * std::f64::consts::PI * (vx * vy).sqrt());
            let along = bell(self.along, x, vx);
            let across = bell(self.across, y, vy);
            let down = along_depth(self.medium, self.down, node.depth_variance);
            let surface = weight * self.medium.along_depth(self.level, node.depth_variance);
            let middle = weight * exp_not_positive(-0.5 * y * y / vy);
            // beyond 6.5 widths less than 1e-9 of the node is left
            let reach = 6.5 * vx.sqrt();
            let first = self.along.partition_point(|a| *a < x - reach);
            let end = self.along.partition_point(|a| *a <= x + reach);
            let rows = self.top[first..end].iter_mut();
            for ((top, below), along) in rows
                .zip(&mut self.below[first..end])
                .zip(&along[first..end])
            {
                let (on_top, under) = (surface * along, middle * along);
                for (sum, share) in top.iter_mut().zip(&across) {
                    *sum += on_top * share;
                }
                for (sum, share) in below.iter_mut().zip(&down) {
                    *sum += under * share;
                }
            }
        }
    }
}

impl Sums {
    pub(crate) fn new() -> Self {
        Sums {
            top: vec![[0.0; ACROSS]; ALONG],
            below: vec![[0.0; DOWN]; ALONG],
        }
    }

    /// Adds `nodes` to the sums on all nodes of the sheet.
    pub(crate) fn superpose(
        &mut self,
        sheet: &Sheet,
        nodes: &[Node],
        medium: &Medium,
        level: Level,
    ) {
        let frame = sheet.frame();
        // what lies so far away that it adds less than 1e-17 of its peak is left out
        let far = |offset: f64, low: f64, high: f64, variance: f64| {
            let outside = (low - offset).max(offset - high).max(0.0);
            outside * outside > 80.0 * variance
        };
        let close: Vec<Node> = nodes
            .iter()
            .filter(|n| {
                let ([x, y], [vx, vy]) = frame.of(n);
                !(far(x, -sheet.size[0], sheet.size[1], vx)
                    || far(y, -sheet.size[2], sheet.size[2], vy))
            })
            .copied()
            .collect();
        let (mut top, mut below) = ([[0.0; ACROSS]; ALONG], [[0.0; DOWN]; ALONG]);
        level.run(Superpose {
            frame,
            along: &sheet.along,
            across: &sheet.across,
            down: &sheet.down,
            nodes: &close,
            medium,
            level: sheet.level,
            top: &mut top,
            below: &mut below,
        });
        add(&mut self.top, &top);
        add(&mut self.below, &below);
    }
}

/// The molten nodes that hang together with the hottest one: the pool of the beam, without what is still liquid elsewhere.
fn connected(top: &[[f64; ACROSS]], limit: f64) -> [[bool; ACROSS]; ALONG] {
    let mut pool = [[false; ACROSS]; ALONG];
    let mut hottest = (0, 0);
    for (i, row) in top.iter().enumerate() {
        for (j, t) in row.iter().enumerate() {
            if *t > top[hottest.0][hottest.1] {
                hottest = (i, j);
            }
        }
    }
    let mut waiting = vec![hottest];
    while let Some((i, j)) = waiting.pop() {
        if pool[i][j] || top[i][j] <= limit {
            continue;
        }
        pool[i][j] = true;
        for (i, j) in [
            (i.wrapping_sub(1), j),
            (i + 1, j),
            (i, j.wrapping_sub(1)),
            (i, j + 1),
        ] {
            if i < ALONG && j < ACROSS {
                waiting.push((i, j));
            }
        }
    }
    pool
}

/// Largest value of a row among the places that `inside` names and their neighbours, by a parabola through the largest node.
fn ridge<const N: usize>(row: &[f64; N], inside: &[bool; N]) -> f64 {
    let near = |i: usize| inside[i] || (i > 0 && inside[i - 1]) || (i + 1 < N && inside[i + 1]);
    let Some(best) = (0..N)
        .filter(|i| near(*i))
        .max_by(|a, b| row[*a].total_cmp(&row[*b]))
    else {
        return f64::NEG_INFINITY;
    };
    if best == 0 || best + 1 == N {
        return row[best];
    }
    let (a, b, c) = (row[best - 1], row[best], row[best + 1]);
    let bend = a - 2.0 * b + c;
    if bend < 0.0 && b >= a && b >= c {
        b - (c - a) * (c - a) / (8.0 * bend)
    } else {
        b
    }
}

/// Where a pool begins and ends along the rows of `field`; `None` where it reaches the border.
fn extent<const A: usize, const B: usize>(
    field: &[[f64; B]],
    pool: &[[bool; B]; A],
    places: &[f64; A],
    limit: f64,
) -> (Option<f64>, Option<f64>) {
    let molten: Vec<usize> = (0..A).filter(|i| pool[*i].contains(&true)).collect();
    let (Some(&first), Some(&last)) = (molten.first(), molten.last()) else {
        return (None, None);
    };
    // outside the pool the ridge is followed from where it leaves it
    let profile: [f64; A] = std::array::from_fn(|i| ridge(&field[i], &pool[i.clamp(first, last)]));
    (
        crossing(&profile, places, limit, first, -1),
        crossing(&profile, places, limit, last, 1),
    )
}

/// Where a profile falls through `limit` next to place `from` in the direction of `step`, by a cubic through four places.
fn crossing<const N: usize>(
    profile: &[f64; N],
    places: &[f64; N],
    limit: f64,
    from: usize,
    step: isize,
) -> Option<f64> {
    let mut i = from;
    let next = loop {
        let next = i.checked_add_signed(step).filter(|n| *n < N)?;
        if profile[next] <= limit {
            break next;
        }
        i = next;
    };
    let before = i.checked_add_signed(-step).filter(|n| *n < N).unwrap_or(i);
    let beyond = next
        .checked_add_signed(step)
        .filter(|n| *n < N)
        .unwrap_or(next);
    let nodes: Vec<usize> = [before, i, next, beyond]
        .into_iter()
        .filter(|n| profile[*n].is_finite())
        .collect();
    let mut distinct = nodes;
    distinct.dedup();
    let at = |x: f64| -> f64 {
        distinct
            .iter()
            .map(|&m| {
                let weight: f64 = distinct
                    .iter()
                    .filter(|&&n| n != m)
                    .map(|&n| (x - places[n]) / (places[m] - places[n]))
                    .product();
                weight * profile[m]
            })
            .sum()
    };
    let (mut inside, mut outside) = (places[i], places[next]);
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        if at(middle) > limit {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    Some(0.5 * (inside + outside))
}

fn add<const N: usize>(sums: &mut [[f64; N]], parts: &[[f64; N]]) {
    for (sum, part) in sums.iter_mut().flatten().zip(parts.iter().flatten()) {
        *sum += part;
    }
}

const COARSE_ALONG: usize = 16;
const COARSE: usize = 10;

/// Heat that is smooth over the sheet, on Chebyshev nodes.
pub(crate) struct Smooth {
    frame: Frame,
    /// Smallest variances that these nodes follow to 3e-4 of a Gaussian.
    least: [f64; 3],
    along: [f64; COARSE_ALONG],
    across: [f64; COARSE],
    down: [f64; COARSE],
    level: f64,
    top: [[f64; COARSE]; COARSE_ALONG],
    below: [[f64; COARSE]; COARSE_ALONG],
}

fn chebyshev<const N: usize>(low: f64, high: f64) -> [f64; N] {
    std::array::from_fn(|i| {
        let angle = std::f64::consts::PI * (i as f64 + 0.5) / N as f64;
        0.5 * (low + high) - 0.5 * (high - low) * angle.cos()
    })
}

impl Smooth {
    pub(crate) fn new(sheet: &Sheet) -> Self {
        let [behind, ahead, side, deep] = sheet.size;
        // interpolation on n nodes over ±L of a Gaussian of width s is off by (L/s)^n/(2^(n-1) √n!)
        let least = [0.5 * (behind + ahead) / 3.0, side / 1.6, 0.5 * deep / 1.6];
        Smooth {
            frame: sheet.frame(),
            least: least.map(|s| s * s),
            along: chebyshev(-behind, ahead),
            across: chebyshev(-side, side),
            down: chebyshev(0.0, deep),
            level: sheet.level,
            top: [[0.0; COARSE]; COARSE_ALONG],
            below: [[0.0; COARSE]; COARSE_ALONG],
        }
    }

    /// Whether a node is smooth enough for these few places.
    pub(crate) fn can_take(&self, node: &Node) -> bool {
        let (_, [vx, vy]) = self.frame.of(node);
        vx >= self.least[0] && vy >= self.least[1] && node.depth_variance >= self.least[2]
    }

    /// Adds `nodes` to the sums on the few places.
    pub(crate) fn superpose(&mut self, nodes: &[Node], medium: &Medium, level: Level) {
        level.run(Superpose {
            frame: self.frame,
            along: &self.along,
            across: &self.across,
            down: &self.down,
            nodes,
            medium,
            level: self.level,
            top: &mut self.top,
            below: &mut self.below,
        });
    }

    /// Interpolates to all nodes of the sheet.
    pub(crate) fn spread_over(&self, sheet: &Sheet, sums: &mut Sums) {
        let along = sheet.along.map(|x| lagrange(&self.along, x));
        let across = sheet.across.map(|y| lagrange(&self.across, y));
        let down = sheet.down.map(|z| lagrange(&self.down, z));
        let dot = |u: &[f64; COARSE], v: &[f64; COARSE]| -> f64 {
            u.iter().zip(v).map(|(p, q)| p * q).sum()
        };
        for (i, a) in along.iter().enumerate() {
            let row = |field: &[[f64; COARSE]; COARSE_ALONG]| -> [f64; COARSE] {
                std::array::from_fn(|j| (0..COARSE_ALONG).map(|m| a[m] * field[m][j]).sum())
            };
            let (top, below) = (row(&self.top), row(&self.below));
            for (sum, w) in sums.top[i].iter_mut().zip(&across) {
                *sum += dot(&top, w);
            }
            for (sum, w) in sums.below[i].iter_mut().zip(&down) {
                *sum += dot(&below, w);
            }
        }
    }
}

/// Values at `x` of the Lagrange polynomials on `nodes`.
fn lagrange<const N: usize>(nodes: &[f64; N], x: f64) -> [f64; N] {
    std::array::from_fn(|i| {
        (0..N)
            .filter(|&j| j != i)
            .map(|j| (x - nodes[j]) / (nodes[i] - nodes[j]))
            .product()
    })
}
