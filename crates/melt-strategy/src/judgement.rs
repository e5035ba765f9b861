//! The reference solver as judge of a beam path: how large a share of the metal meets the aim, and by how much that share
//! moves when cell, step or power do.
//!
//! A share of voxels in a window of 60 K hangs on the tail of a distribution; one that moves by more than [`CONVERGED`] with
//! half the cell, half the step, twice the planes, a larger ground or 5 % of the power is told as not converged
//! (docs/theory/sources.md).

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;

use crate::bed::{Body, Domain, Reading, Resolution};
use meltpath_thermal::beam::{BeamError, BeamPath, BeamPoint};
use meltpath_thermal::grid::sample::Sample;
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::solver::SolverError;
use meltpath_thermal::solver::run::{Sink, draw};
use meltpath_thermal::solver::watch::{Freezing, Watch, Watched, Watcher};

/// Largest change of a share that is called converged.
pub const CONVERGED: f64 = 0.05;
/// Change of the power that a share must bear.
pub const POWER: f64 = 0.05;
/// How long the ground remembers a beam, s.
const MEMORY: f64 = 0.04;

/// One run of the judge and how it differs from the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// As asked.
    Base,
    /// Half the cell in the plane, with the shorter step that it needs.
    HalfCell,
    /// Twice as many planes in a layer.
    MorePlanes,
    /// Half the step.
    HalfStep,
    /// The ground held at the start temperature twice as deep.
    Deeper,
    /// And twice as far beside the path.
    Wider,
    /// Less power.
    LessPower,
    /// More power.
    MorePower,
}

impl Variant {
    /// All, the one as asked first.
    pub const ALL: [Variant; 8] = [
        Variant::Base,
        Variant::HalfCell,
        Variant::MorePlanes,
        Variant::HalfStep,
        Variant::Deeper,
        Variant::Wider,
        Variant::LessPower,
        Variant::MorePower,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Variant::Base => "as set",
            Variant::HalfCell => "half the cell",
            Variant::MorePlanes => "twice the planes",
            Variant::HalfStep => "half the step",
            Variant::Deeper => "the ground twice as deep",
            Variant::Wider => "the ground twice as wide",
            Variant::LessPower => "5 % less power",
            Variant::MorePower => "5 % more power",
        }
    }
}

impl Resolution {
    /// The resolution of a variant of this one; `step` is the step that this one really took, s.
    #[must_use]
    pub fn of(&self, variant: Variant, step: f64) -> Self {
        match variant {
            Variant::Base => *self,
            Variant::HalfCell => Resolution {
                cell: 0.5 * self.cell,
                ..*self
            },
            Variant::MorePlanes => Resolution {
                planes: 2 * self.planes,
                ..*self
            },
            Variant::Deeper => Resolution {
                domain: Domain {
                    below: 2.0 * self.domain.below,
                    ..self.domain
                },
                ..*self
            },
            Variant::Wider => Resolution {
                domain: Domain {
                    beside: 2.0 * self.domain.beside,
                    ..self.domain
                },
                ..*self
            },
            Variant::HalfStep => Resolution {
                step: 0.5 * step,
                ..*self
            },
            Variant::LessPower => Resolution {
                power: self.power * (1.0 - POWER),
                ..*self
            },
            Variant::MorePower => Resolution {
                power: self.power * (1.0 + POWER),
                ..*self
            },
        }
    }
}

/// What a run gave.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Highest temperatures of the last layer, K.
    pub highest: Field,
    /// The step taken, s.
    pub step: f64,
    /// What the solver lost of the heat, as a share of what the beam brought.
    pub residual: f64,
    /// Updates of cells.
    pub updates: u64,
    /// What was seen besides, where something was to be looked at.
    pub watched: Option<Watched>,
}

/// The same path with x and y exchanged.
fn turned(path: &BeamPath) -> Result<BeamPath, BeamError> {
    let points = path.points().iter().map(|p| BeamPoint {
        x: p.y,
        y: p.x,
        ..*p
    });
    BeamPath::new(points.collect())
}

/// The same field with x and y exchanged.
fn turned_field(field: &Field) -> Field {
    let grid = &field.grid;
    let [nx, ny] = grid.cells;
    // rows of the turned grid run along the old y
    let old = |n: usize| (n / (nx * ny) * ny + n % ny) * nx + n / ny % nx;
    Field {
        values: (0..field.values.len())
            .map(|n| field.values[old(n)])
            .collect(),
        grid: Grid {
            origin: DVec3::new(grid.origin.y, grid.origin.x, grid.origin.z),
            cells: [ny, nx],
            edge: [grid.edge[1], grid.edge[0]],
            heights: grid.heights.clone(),
        },
    }
}

fn turned_place([x, y, z]: [f64; 3]) -> [f64; 3] {
    [y, x, z]
}

/// What was seen with x and y exchanged.
fn turned_watched(seen: Watched) -> Watched {
    Watched {
        freezing: Freezing {
            above: turned_field(&seen.freezing.above),
            fell: turned_field(&seen.freezing.fell),
            rate: turned_field(&seen.freezing.rate),
        },
        samples: seen
            .samples
            .into_iter()
            .map(|s| Sample {
                place: turned_place(s.place),
                ..s
            })
            .collect(),
        outside: seen.outside.into_iter().map(turned_place).collect(),
    }
}

/// Cells of a plane, in mm², that are awake in the mean: the width along x, and along y what the beam has passed within
/// [`MEMORY`].
fn awake_area(path: &BeamPath) -> f64 {
    const SAMPLES: usize = 400;
    let duration = path.end() - path.begin();
    let places: Vec<BeamPoint> = (0..SAMPLES)
        .map(|n| path.at(path.begin() + duration * n as f64 / SAMPLES as f64))
        .collect();
    let span = |values: &mut dyn Iterator<Item = f64>| {
        let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |e, v| {
            [e[0].min(v), e[1].max(v)]
        });
        ends[1] - ends[0] + 2.0 * Domain::THESIS.beside
    };
    let back = (MEMORY / duration * SAMPLES as f64).ceil() as usize;
    let along: f64 = (0..SAMPLES)
        .map(|n| span(&mut places[n.saturating_sub(back)..=n].iter().map(|p| p.y)))
        .sum();
    span(&mut places.iter().map(|p| p.x)) * along / SAMPLES as f64
}

/// Draws `lower` layers and then `path` on `body`, each on a fresh layer, from the start temperature.
/// Rows that are as at the start sleep, see [`meltpath_thermal::solver::Solver::let_rows_sleep`]; x and y are exchanged where fewer cells
/// are awake then.
///
/// # Errors
/// [`SolverError`].
pub fn judge(
    body: &Body<'_>,
    lower: &[BeamPath],
    path: &BeamPath,
    resolution: &Resolution,
    observer: &dyn Observer,
) -> Result<Drawn, SolverError> {
    watched(body, lower, path, resolution, None, observer)
}

/// The same, and what `watch` asks for.
///
/// # Errors
/// [`SolverError`].
pub fn watched(
    body: &Body<'_>,
    lower: &[BeamPath],
    path: &BeamPath,
    resolution: &Resolution,
    watch: Option<&Watch>,
    observer: &dyn Observer,
) -> Result<Drawn, SolverError> {
    let others: Vec<BeamPath> = lower.iter().filter_map(|p| turned(p).ok()).collect();
    let areas = |lower: &[BeamPath], path: &BeamPath| {
        lower.iter().map(awake_area).sum::<f64>() + awake_area(path)
    };
    let fewer = turned(path)
        .ok()
        .filter(|other| others.len() == lower.len() && areas(&others, other) < areas(lower, path));
    let Some(path) = fewer else {
        return draw_rows(body, lower, path, resolution, watch, observer);
    };
    let ground = |[x, y]: [f64; 2]| (body.ground)([y, x]);
    let turned = Body {
        ground: &ground,
        ..*body
    };
    let watch = watch.map(|w| Watch {
        places: w.places.iter().map(|p| turned_place(*p)).collect(),
        ..*w
    });
    let drawn = draw_rows(
        &turned,
        &others,
        &path,
        resolution,
        watch.as_ref(),
        observer,
    )?;
    Ok(Drawn {
        highest: turned_field(&drawn.highest),
        watched: drawn.watched.map(turned_watched),
        ..drawn
    })
}

fn draw_rows(
    body: &Body<'_>,
    lower: &[BeamPath],
    path: &BeamPath,
    resolution: &Resolution,
    watch: Option<&Watch>,
    observer: &dyn Observer,
) -> Result<Drawn, SolverError> {
    let mut bed = body.bed(&[path], lower, resolution, observer)?;
    let solver = &mut bed.solver;
    let mut watcher = watch.map(|w| Watcher::new(w, solver));
    let mut sinks: Vec<&mut dyn Sink<f32>> = Vec::new();
    sinks.extend(watcher.as_mut().map(|w| w as &mut dyn Sink<f32>));
    draw(solver, path, &bed.beam, bed.step, &mut sinks, observer)?;
    let highest = solver.highest_temperature();
    Ok(Drawn {
        watched: watcher.map(Watcher::seen),
        residual: solver.ledger().residual(solver.stored()),
        highest: match body.reading {
            Reading::LayerMean => highest.over_layer(body.layer),
            Reading::Depth(depth) => highest.at_depth(depth),
        },
        step: bed.step,
        updates: solver.updates(),
    })
}

/// A share, or another figure, as asked and with each change.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// The share as asked.
    pub value: f64,
    /// Changes of it, in the order of the variants after the first.
    pub changes: Vec<(Variant, f64)>,
}

impl Share {
    /// The largest change, whichever way.
    pub fn spread(&self) -> f64 {
        self.changes
            .iter()
            .map(|(_, c)| c.abs())
            .fold(0.0, f64::max)
    }

    /// Whether no change moves it by more than [`CONVERGED`].
    pub fn converged(&self) -> bool {
        self.within(CONVERGED)
    }

    /// Whether there are changes and none moves it by more than `most`.
    pub fn within(&self, most: f64) -> bool {
        !self.changes.is_empty() && self.spread() <= most * (1.0 + 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_that_moves_by_more_than_five_points_is_not_converged() {
        let share = |change: f64| Share {
            value: 0.5,
            changes: vec![(Variant::HalfCell, 0.01), (Variant::LessPower, -change)],
        };
        assert!(share(0.049).converged());
        assert!(!share(0.051).converged());
        assert!((share(0.3).spread() - 0.3).abs() < 1e-12);
        // one run alone shows nothing
        let alone = Share {
            changes: Vec::new(),
            ..share(0.0)
        };
        assert!(!alone.converged());
    }

    #[test]
    fn a_field_turned_twice_is_itself() {
        let grid = Grid::covering(DVec3::ZERO, DVec3::new(0.3, 0.2, 0.2), DVec3::splat(0.1));
        let grid = grid.unwrap();
        let values = (0..grid.len()).map(|n| n as f32).collect();
        let field = Field { grid, values };
        let turned = turned_field(&field);
        assert_eq!(turned.at(1, 2, 1), field.at(2, 1, 1));
        assert_eq!(turned_field(&turned), field);
    }

    /// Lines along y are turned, so that their rows fall asleep; the cost is that of the same lines along x.
    #[test]
    fn lines_that_run_along_y_are_turned() {
        let start = BeamPoint {
            time: 0.0,
            x: 0.0,
            y: 0.0,
            power: 300.0,
            spot: 0.4,
        };
        let corners: Vec<[f64; 2]> = (0..80)
            .flat_map(|n| {
                let y = 0.1 * f64::from(n);
                let ends = [[0.0, y], [3.0, y]];
                if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
            })
            .collect();
        let along_x = BeamPath::along(&corners, 980.0, start).unwrap();
        assert!(awake_area(&along_x) < 0.6 * awake_area(&turned(&along_x).unwrap()));
    }

    #[test]
    fn variants_change_one_thing_each() {
        let base = Resolution {
            cell: 0.06,
            planes: 1,
            step: 4e-6,
            domain: Domain::THESIS,
            power: 1.0,
        };
        let half = base.of(Variant::HalfCell, 3e-6);
        assert_eq!((half.cell, half.planes), (0.03, 1));
        let more = base.of(Variant::MorePlanes, 3e-6);
        assert_eq!((more.cell, more.planes), (0.06, 2));
        let [deeper, wider] = [Variant::Deeper, Variant::Wider].map(|v| base.of(v, 3e-6).domain);
        assert_eq!((deeper.below, deeper.beside), (1.0, 0.5));
        assert_eq!((wider.below, wider.beside), (0.5, 1.0));
        // half of the step that was taken, which stability may have shortened
        assert_eq!(base.of(Variant::HalfStep, 3e-6).step, 1.5e-6);
        assert_eq!(base.of(Variant::MorePower, 3e-6).power, 1.05);
    }
}
