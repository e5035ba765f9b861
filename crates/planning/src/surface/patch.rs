//! Passes on a piece of a parametric surface that is built along one of its parameters.
//! Source: Campocasso 2017, § III.C and III.D, eq. 2 and 3, written for any surface.

use std::collections::BTreeMap;

use meltpath_geometry::brep::surface::Surface;
use meltpath_geometry::math::{DVec2, DVec3};

use super::error::SurfaceError;
use super::pass::{SurfacePass, SurfacePoint};
use super::{MOST_PASSES, SurfaceSettings, SurfaceStrategy};

/// One of the two parameters of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// The first.
    U,
    /// The second.
    V,
}

/// A piece of a surface between two values of each parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch<'a> {
    /// The surface.
    pub surface: &'a Surface,
    /// The parameter along which the wall grows.
    pub growth: Parameter,
    /// Its value at the base and at the end; the second may be the smaller one.
    pub along: [f64; 2],
    /// Range of the other parameter; a whole period makes closed passes.
    pub across: [f64; 2],
}

/// Steps of the other parameter, at most: a power of two, so that halves are whole.
const COLUMNS: u32 = 1 << 20;
/// Steps of the other parameter, at least.
const FIRST: u32 = 1 << 13;
/// Steps in which a root along the growth is looked for, at most.
const STEPS: f64 = 4096.0;

/// Passes on a piece of a surface, by number; pieces of one pass follow one another.
///
/// # Errors
/// [`SurfaceError`]: settings out of range, no room for a pass, a fold (planes), a pole (constant distance).
pub fn plan_patch(
    patch: &Patch<'_>,
    settings: &SurfaceSettings,
) -> Result<Vec<SurfacePass>, SurfaceError> {
    settings.check()?;
    for [from, to] in [patch.along, patch.across] {
        if !(from.is_finite() && to.is_finite() && from != to) {
            return Err(SurfaceError::Range { from, to });
        }
    }
    let mut columns = Columns {
        patch,
        settings,
        rule: Rule::Distance,
        known: BTreeMap::new(),
    };
    columns.rule = match settings.strategy {
        SurfaceStrategy::Distance => Rule::Distance,
        SurfaceStrategy::Parameter => Rule::Parameter(columns.even_parameters()?),
        SurfaceStrategy::Planes { direction } => {
            let direction = direction.normalize();
            let start = |i: u32| direction.dot(patch.point(patch.along[0], columns.across(i)));
            let base = first_columns().map(start).fold(f64::INFINITY, f64::min);
            Rule::Planes { direction, base }
        }
    };
    columns.passes()
}

fn first_columns() -> impl DoubleEndedIterator<Item = u32> {
    (0..=COLUMNS / FIRST).map(|i| i * FIRST)
}

impl Patch<'_> {
    fn uv(&self, s: f64, t: f64) -> DVec2 {
        match self.growth {
            Parameter::U => DVec2::new(s, t),
            Parameter::V => DVec2::new(t, s),
        }
    }

    /// The point at a value of the parameter along which the wall grows, and one of the other.
    pub fn point(&self, s: f64, t: f64) -> DVec3 {
        self.surface.point(self.uv(s, t))
    }

    /// The point and its derivative towards the end of the build, by a share of the range.
    fn derivative(&self, s: f64, t: f64) -> [DVec3; 2] {
        let [p, du, dv] = self.surface.tangents(self.uv(s, t));
        let d = match self.growth {
            Parameter::U => du,
            Parameter::V => dv,
        };
        [p, d * (self.along[1] - self.along[0])]
    }

    /// Whether the other parameter runs through a whole period.
    fn is_closed(&self) -> bool {
        let [u, v] = self.surface.periods(1e-9);
        let period = match self.growth {
            Parameter::U => v,
            Parameter::V => u,
        };
        let range = (self.across[1] - self.across[0]).abs();
        period.is_some_and(|p| (range - p).abs() < 1e-9 * p)
    }

    /// The share of the range, after `from`, at which `f` first rises through zero; `None` where it does not. `f` gives its value and
    /// its derivative by the share; `step` is how far two of its roots lie apart, at least.
    fn root(from: f64, step: f64, f: impl Fn(f64) -> [f64; 2]) -> Option<f64> {
        let mut low = from;
        let mut high;
        loop {
            if low >= 1.0 {
                return None;
            }
            high = (low + step).min(1.0);
            if f(high)[0] >= 0.0 {
                break;
            }
            low = high;
        }
        // Newton's steps where they stay between, halves where they do not
        let mut x = high;
        for _ in 0..80 {
            let [value, slope] = f(x);
            if value < 0.0 {
                low = x;
            } else {
                high = x;
            }
            let newton = x - value / slope;
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            if (next - x).abs() <= 1e-15 {
                break;
            }
            x = next;
        }
        Some(x)
    }
}

/// Where along its growth a column has its passes, in shares of the range.
type Column = Vec<Option<f64>>;

/// How the passes of a column follow one another.
enum Rule {
    Distance,
    Parameter(Vec<f64>),
    Planes { direction: DVec3, base: f64 },
}

/// The passes at values of the other parameter, each found once.
struct Columns<'a> {
    patch: &'a Patch<'a>,
    settings: &'a SurfaceSettings,
    rule: Rule,
    known: BTreeMap<u32, Column>,
}

impl Columns<'_> {
    fn across(&self, i: u32) -> f64 {
        let [from, to] = self.patch.across;
        from + (to - from) * (f64::from(i) / f64::from(COLUMNS))
    }

    fn along(&self, share: f64) -> f64 {
        let [from, to] = self.patch.along;
        from + (to - from) * share
    }

    /// The share at which the surface is `spacing` from where it was at `share`.
    fn next(&self, share: f64, i: u32) -> Result<Option<f64>, SurfaceError> {
        let t = self.across(i);
        let [from, d] = self.patch.derivative(self.along(share), t);
        let spacing = self.settings.spacing;
        if d.length() * 1e6 < spacing {
            return Err(SurfaceError::Pole { at: from });
        }
        let step = (0.25 * spacing / d.length()).clamp(1.0 / STEPS, 1.0 / 64.0);
        Ok(Patch::root(share, step, |share| {
            let [p, d] = self.patch.derivative(self.along(share), t);
            let way = p - from;
            let distance = way.length();
            [
                distance - spacing,
                way.dot(d) / distance.max(f64::MIN_POSITIVE),
            ]
        }))
    }

    /// Shares at which lines of the parameter lie: the widest place of each has the distance that is asked for.
    fn even_parameters(&self) -> Result<Vec<f64>, SurfaceError> {
        let mut shares = Vec::new();
        let mut share = 0.0;
        loop {
            let mut least: Option<f64> = None;
            for i in (0..=COLUMNS).step_by(FIRST as usize / 8) {
                if let Some(next) = self.next(share, i)? {
                    least = Some(least.map_or(next, |l: f64| l.min(next)));
                }
            }
            let Some(next) = least else { return Ok(shares) };
            shares.push(next);
            self.count(shares.len())?;
            share = next;
        }
    }

    fn count(&self, passes: usize) -> Result<(), SurfaceError> {
        if passes > MOST_PASSES {
            return Err(SurfaceError::TooMany {
                spacing: self.settings.spacing,
                most: MOST_PASSES,
            });
        }
        Ok(())
    }

    fn find(&mut self, i: u32) -> Result<&Column, SurfaceError> {
        if !self.known.contains_key(&i) {
            let column = self.column(i)?;
            self.known.insert(i, column);
        }
        Ok(&self.known[&i])
    }

    fn column(&self, i: u32) -> Result<Column, SurfaceError> {
        let mut column = Vec::new();
        match &self.rule {
            Rule::Distance => {
                let mut share = 0.0;
                while let Some(next) = self.next(share, i)? {
                    column.push(Some(next));
                    self.count(column.len())?;
                    share = next;
                }
            }
            Rule::Parameter(shares) => column.extend(shares.iter().copied().map(Some)),
            Rule::Planes { direction, base } => {
                let t = self.across(i);
                let over = |share: f64, height: f64| {
                    let [p, d] = self.patch.derivative(self.along(share), t);
                    [direction.dot(p) - height, direction.dot(d)]
                };
                self.rises(i, *direction)?;
                let mut share = 0.0;
                loop {
                    let height = base + (column.len() + 1) as f64 * self.settings.spacing;
                    if over(0.0, height)[0] > 0.0 {
                        column.push(None);
                    } else if let Some(next) = Patch::root(share, 1.0 / 64.0, |s| over(s, height)) {
                        column.push(Some(next));
                        share = next;
                    } else {
                        break;
                    }
                    self.count(column.len())?;
                }
            }
        }
        Ok(column)
    }

    /// Whether a column rises from base to end.
    fn rises(&self, i: u32, direction: DVec3) -> Result<(), SurfaceError> {
        let t = self.across(i);
        let mut before = f64::NEG_INFINITY;
        for k in 0..=256 {
            let p = self.patch.point(self.along(f64::from(k) / 256.0), t);
            let height = direction.dot(p);
            if height < before - 1e-9 * (1.0 + p.length()) {
                return Err(SurfaceError::Fold { at: p });
            }
            before = height;
        }
        Ok(())
    }

    fn has(&mut self, i: u32, pass: usize) -> Result<Option<f64>, SurfaceError> {
        Ok(self.find(i)?.get(pass).copied().flatten())
    }

    fn position(&self, share: f64, i: u32) -> DVec3 {
        self.patch.point(self.along(share), self.across(i))
    }

    /// All passes, each as its pieces.
    fn passes(&mut self) -> Result<Vec<SurfacePass>, SurfaceError> {
        let mut count = 0;
        for i in first_columns() {
            count = count.max(self.find(i)?.len());
        }
        if count == 0 {
            return Err(self.too_small());
        }
        let closed = self.patch.is_closed();
        let mut passes = Vec::new();
        for pass in 0..count {
            let mut pieces = self.pieces(pass)?;
            // a piece that runs over the seam of a closed surface is one
            let over = pieces.len() > 1
                && closed
                && pieces[0].first().is_some_and(|p| p.0 == 0)
                && pieces
                    .last()
                    .and_then(|p| p.last())
                    .is_some_and(|p| p.0 == COLUMNS);
            if over {
                let first = pieces.remove(0);
                if let Some(last) = pieces.last_mut() {
                    last.extend(first.into_iter().skip(1));
                }
            }
            for piece in pieces.into_iter().filter(|p| p.len() > 1) {
                passes.push(self.pass(pass, &piece, closed)?);
            }
        }
        Ok(passes)
    }

    fn too_small(&self) -> SurfaceError {
        let reach = first_columns().map(|i| self.position(0.0, i).distance(self.position(1.0, i)));
        SurfaceError::TooSmall {
            spacing: self.settings.spacing,
            reach: reach.fold(0.0, f64::max),
        }
    }

    /// The columns and shares of the pieces of a pass.
    fn pieces(&mut self, pass: usize) -> Result<Vec<Vec<(u32, f64)>>, SurfaceError> {
        let mut pieces: Vec<Vec<(u32, f64)>> = Vec::new();
        let mut run: Vec<(u32, f64)> = Vec::new();
        let mut before = 0;
        for i in first_columns() {
            let here = self.has(i, pass)?;
            let last = run.last().copied();
            match (last, here) {
                (Some(a), Some(b)) => self.refine(pass, a, (i, b), &mut run)?,
                (None, Some(b)) => {
                    if i > 0 {
                        let edge = self.edge(pass, i, before)?;
                        run.push(edge);
                        if edge.0 != i {
                            self.refine(pass, edge, (i, b), &mut run)?;
                        }
                    } else {
                        run.push((i, b));
                    }
                }
                (Some(a), None) => {
                    let edge = self.edge(pass, a.0, i)?;
                    if edge.0 != a.0 {
                        self.refine(pass, a, edge, &mut run)?;
                    }
                    pieces.push(std::mem::take(&mut run));
                }
                (None, None) => {}
            }
            before = i;
        }
        if !run.is_empty() {
            pieces.push(run);
        }
        Ok(pieces)
    }

    /// The last column with a pass on the way from one that has it to one that has not.
    fn edge(&mut self, pass: usize, with: u32, without: u32) -> Result<(u32, f64), SurfaceError> {
        let (mut with, mut without) = (with, without);
        while with.abs_diff(without) > 1 {
            let middle = with.midpoint(without);
            if self.has(middle, pass)?.is_some() {
                with = middle;
            } else {
                without = middle;
            }
        }
        Ok((with, self.has(with, pass)?.unwrap_or(1.0)))
    }

    /// Adds the points after `a` up to `b`, as many as the chord error asks for.
    fn refine(
        &mut self,
        pass: usize,
        a: (u32, f64),
        b: (u32, f64),
        run: &mut Vec<(u32, f64)>,
    ) -> Result<(), SurfaceError> {
        let middle = a.0.midpoint(b.0);
        if let Some(share) = self.has(middle, pass)?
            && middle != a.0
            && middle != b.0
        {
            let [from, to] = [a, b].map(|(i, s)| self.position(s, i));
            let way = to - from;
            let off = self.position(share, middle) - from;
            let x = (off.dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            if off.distance(x * way) > self.settings.chord_error {
                self.refine(pass, a, (middle, share), run)?;
                return self.refine(pass, (middle, share), b, run);
            }
        }
        run.push(b);
        Ok(())
    }

    fn pass(
        &mut self,
        pass: usize,
        piece: &[(u32, f64)],
        closed: bool,
    ) -> Result<SurfacePass, SurfaceError> {
        let mut points = Vec::with_capacity(piece.len());
        for &(i, share) in piece {
            let before = match pass {
                0 => Some(0.0),
                _ => self.has(i, pass - 1)?,
            };
            let uv = self.patch.uv(self.along(share), self.across(i));
            let [position, d] = self.patch.derivative(self.along(share), self.across(i));
            points.push(SurfacePoint {
                position,
                normal: self.patch.surface.normal(uv),
                growth: d.normalize_or_zero(),
                from: before.map(|b| self.position(b, i)),
            });
        }
        let whole = closed && piece[0].0 == 0 && piece[piece.len() - 1].0 == COLUMNS;
        if whole {
            // the seam is met twice, with the last bits of two angles
            let first = points[0];
            if let Some(last) = points.last_mut() {
                *last = first;
            }
        }
        Ok(SurfacePass {
            number: pass as u32 + 1,
            points,
        })
    }
}
