//! The solver for whole layers: fine where the beam is and heat bends, coarser around, remembering the whole path.
//!
//! The plan is covered by tiles of 16 x 16 columns of cells; each is on one of several levels, cells twice as large from one to
//! the next coarser (a quadtree, neighbours at most one level apart). All planes are shared, but finer levels have the highest
//! of them alone: under finer tiles lies the trunk of the coarser one that they were. Every level takes two steps, a short one
//! near the beam and where it is hottest, a longer one elsewhere. Shorter steps go first, with what they see of cells that go
//! slower as these were when their step began; what they give to them is added up and taken at its end, so that no heat is
//! lost. Laws, surface, source and the sums in a cell are those of [`crate::solver`], which this one is held against on its
//! own finest cells.

mod around;
mod bell;
mod beneath;
mod conduct;
mod cool;
mod cut;
mod draw;
mod ground;
mod matter;
mod offsets;
mod pace;
mod rim;
mod set_pace;
mod sharing;
mod skin;
mod step;
mod tile;
mod tree;
mod watching;

use meltpath_base::Cancelled;

use crate::grid::{Field, Grid, GridError};
use crate::material::Material;
use crate::material::enthalpy::{CurveError, Enthalpy, Formulas};
use crate::solver::ledger::Ledger;
use crate::solver::steam::BeforeVapour;
use crate::solver::surface::{Losses, Surface};
use crate::solver::watch::{Freezing, Watched};
use crate::solver::{Face, State};
use meltpath_numerics::vector;
use tile::{FOLLOWED, Liquidus, N, PLANE, Shown, Tile};
use tree::Tree;

pub use ground::{Cooled, Ground};
pub use matter::{Frame, Matter};

/// How `θ` may bend from cell to cell, as kelvins of the solid's conductivity at the solidus: a tile that bends more is divided,
/// four that bend less than a quarter of it become one (an eighth where metal that may melt grows hotter).
pub const BEND: f64 = 300.0;
/// Cells of a level go this many of their edges deep at least; below, those of the next coarser one lie. Ours: five to ten, and cells
/// as deep as the ground, gave the same highest temperatures (docs/theory/heat.md).
const DEEP: f64 = 6.0;
/// Tiles no warmer than this above the start temperature sleep where their neighbours do, K.
const COLD: f64 = 2.0;

/// What a layer is drawn on.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Two corners of what the cells must cover, mm.
    pub covered: [[f64; 2]; 2],
    /// Edge of the finest cells, mm.
    pub cell: f64,
    /// Levels of coarser cells above the finest.
    pub coarser: usize,
    /// Heights of the planes of cells, bottom first; those of the layer are equal.
    pub heights: Vec<f64>,
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// How deep what becomes of the metal is kept, mm, whole planes as high as the layer's.
    pub tracked: f64,
    /// The build plane.
    pub top: Surface,
    /// The lower face, and beside.
    pub beyond: Face,
    /// Longest step of the finest level, s.
    pub step: f64,
    /// Two corners of where the finest cells are worth their cost, mm; elsewhere the beam is drawn on cells of at most 0.13 mm.
    pub focus: Option<[[f64; 2]; 2]>,
    /// How `θ` may bend, see [`BEND`].
    pub bend: f64,
}

impl Setup {
    /// The tiles of the coarsest level, and the finest columns.
    fn frame(&self) -> ([usize; 2], Frame) {
        let root = self.cell * (N << self.coarser) as f64;
        let size = [0, 1].map(|a| self.covered[1][a] - self.covered[0][a]);
        let roots = size.map(|s| ((s / root - 1e-6).ceil().max(1.0)) as usize);
        let origin = [0, 1].map(|a| self.covered[0][a] - 0.5 * (roots[a] as f64 * root - size[a]));
        let frame = Frame {
            origin,
            cells: roots.map(|n| n * (N << self.coarser)),
            edge: self.cell,
        };
        (roots, frame)
    }

    /// The lowest plane of each level, coarsest first: a level's is above that of the next coarser one, or both have all planes.
    fn bases(&self) -> Vec<usize> {
        let mut bases = vec![0; self.coarser + 1];
        let (_, height) = self.planes_of_layer();
        let tracked = (self.tracked / height).round() as usize;
        let mut above = (self.heights.len() + 1).saturating_sub(tracked);
        for level in (1..=self.coarser).rev() {
            let edge = self.cell * f64::from(1_u32 << (self.coarser - level));
            let deep = DEEP * edge - 1e-9;
            let mut depth = 0.0;
            let holds = self.heights.iter().rposition(|height| {
                depth += height;
                depth >= deep
            });
            above = holds.unwrap_or(0).min(above.saturating_sub(1));
            bases[level] = above;
        }
        bases
    }

    /// Heights of the uppermost plane and of the one below, mm; twice the same where there is but one.
    fn uppermost(&self) -> [f64; 2] {
        let mut from_above = self.heights.iter().rev().copied();
        let height = from_above.next().unwrap_or(self.layer);
        [height, from_above.next().unwrap_or(height)]
    }

    fn planes_of_layer(&self) -> (usize, f64) {
        let [height, _] = self.uppermost();
        ((self.layer / height).round().max(1.0) as usize, height)
    }

    /// The ground without layers.
    pub fn ground(&self, material: &Material, ground: &dyn Fn([f64; 2]) -> State) -> Matter {
        let fresh = material.relative_density(material.start) as f32;
        let (_, height) = self.planes_of_layer();
        Matter::new(self.frame().1, [height, self.tracked], fresh, ground)
    }
}

meltpath_base::passes_on! {
    /// Why the solver refused.
    pub enum LevelsError {
        /// The material.
        Curve(CurveError),
        /// The cells.
        Grid(GridError),
        /// Stopped from outside.
        Cancelled(Cancelled);

        /// A beam without size.
        #[error("the beam diameter is {0} mm: it must be finite and above zero")]
        Diameter(f64),
        /// The beam is outside what is covered.
        #[error(
            "at {time:.6} s the beam at ({x:.3}, {y:.3}) mm leaves {share:.1} % of its power outside what the solver covers: its spot or its depth (ebm.penetration) is too large for the ground that is drawn"
        )]
        Outside {
            /// When, s.
            time: f64,
            /// Where, mm.
            x: f64,
            /// Where, mm.
            y: f64,
            /// Share of the power outside, %.
            share: f64,
        },
        /// Layers that do not lie on each other.
        #[error(
            "the layer does not lie on the coarsest cells of the one below: both need the same corners, cells, levels and thickness of a layer"
        )]
        Moved,
    }
}

/// One level of tiles.
#[derive(Debug, Clone)]
struct Level {
    /// Edge of a cell, mm.
    edge: f64,
    /// Of slow tiles and of quick ones.
    rates: [pace::Rate; 2],
    /// The lowest plane of its cells.
    base: usize,
    tiles: Vec<Tile>,
    shown: Vec<Shown>,
    /// Where in `tiles` a tile is, by its place; [`NOWHERE`] where it is not on this level.
    index: Vec<u32>,
}

const NOWHERE: u32 = u32::MAX;

/// A layer that is being drawn.
#[derive(Debug, Clone)]
#[expect(
    clippy::struct_field_names,
    reason = "the levels are what it is made of"
)]
pub struct Levels {
    setup: Setup,
    material: Material,
    curve: Enthalpy,
    formulas: Formulas<f32>,
    losses: Losses<f32>,
    depths: Vec<f64>,
    tree: Tree,
    levels: Vec<Level>,
    matter: Matter,
    record: matter::Record,
    offsets: offsets::Offsets,
    bell: bell::Bell,
    pace: pace::Pace,
    /// Temperatures of the build plane, and [`Depth::lift`](crate::solver::source::Depth::lift) of the last beam.
    surface: BeforeVapour,
    lift: f64,
    register: vector::Level,
    liquidus: Liquidus,
    time: f64,
    ledger: Ledger,
    stored_at_start: f64,
    updates: u64,
    watching: watching::Watching,
}

impl Levels {
    /// A layer of fresh powder on `matter`, all at the start temperature.
    ///
    /// # Errors
    /// [`LevelsError::Curve`] and [`LevelsError::Grid`].
    pub fn new(setup: Setup, material: Material, mut matter: Matter) -> Result<Self, LevelsError> {
        let curve = Enthalpy::new(&material)?;
        let (roots, frame) = setup.frame();
        let grid = Grid {
            origin: meltpath_geometry::math::DVec3::ZERO,
            cells: frame.cells,
            edge: [setup.cell; 2],
            heights: setup.heights.clone(),
        };
        grid.check()?;
        let (of_layer, height) = setup.planes_of_layer();
        let depth: f64 = setup.heights.iter().sum();
        matter.add(of_layer, (depth / height).ceil() as usize);
        let tracked = (setup.tracked / height).round() as usize;
        let tree = Tree::new(roots, setup.coarser);
        let depths = grid.depths();
        let mut solver = Levels {
            losses: Losses::new(&setup.top, &material, &curve, height),
            surface: BeforeVapour::new(
                setup.top.evaporates(&material),
                &material,
                &curve,
                [height, skin::HOTTEST],
            ),
            lift: 0.0,
            formulas: curve.formulas(),
            levels: levels(&setup, &tree),
            record: matter::Record::new(frame.cells[0] * frame.cells[1], tracked),
            offsets: offsets::Offsets::new(&curve, &material),
            bell: bell::Bell::new(),
            pace: pace::Pace::new(&material, &curve),
            register: vector::Level::widest(),
            liquidus: Liquidus {
                enthalpy: curve.at_liquidus as f32,
                capacity: material.heat_capacity(material.liquidus + 1e-3) as f32,
            },
            depths,
            tree,
            matter,
            setup,
            material,
            curve,
            time: 0.0,
            ledger: Ledger::default(),
            stored_at_start: 0.0,
            updates: 0,
            watching: watching::Watching::default(),
        };
        solver.first_tiles(roots, tracked);
        solver.stored_at_start = solver.stored_absolute();
        Ok(solver)
    }

    /// The state of matter under the next layer, which starts at the start temperature; [`Levels::leave`] keeps heat too.
    pub fn into_matter(mut self) -> Matter {
        self.write_down();
        self.matter
    }

    /// Where the heat went.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Updates of cells so far.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// The longest step of the finest level so far, s.
    pub fn step(&self) -> f64 {
        self.pace.longest
    }

    /// Time since the layer began, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Heat in the domain above its beginning, J.
    pub fn stored(&self) -> f64 {
        self.stored_absolute() - self.stored_at_start
    }

    fn stored_absolute(&self) -> f64 {
        let mut sum = 0.0;
        for level in &self.levels {
            for tile in &level.tiles {
                for (k, height) in self.setup.heights[tile.planes()].iter().enumerate() {
                    let cells = k * PLANE..(k + 1) * PLANE;
                    let of_plane: f64 = tile.enthalpy[cells.clone()]
                        .iter()
                        .zip(&tile.density[cells])
                        .map(|(g, r)| self.offsets.stored(*g, *r))
                        .sum();
                    sum += of_plane * level.edge * level.edge * height;
                }
            }
        }
        sum
    }

    /// Tiles of each level, coarsest first, with those that lie under finer ones.
    pub fn tiles(&self) -> Vec<usize> {
        self.levels.iter().map(|l| l.tiles.len()).collect()
    }

    /// The finest cells of the highest `planes` planes within two corners, mm, and where their first column is.
    fn window(&self, [low, high]: [[f64; 2]; 2], planes: usize) -> (Grid, [usize; 2]) {
        let frame = self.matter.frame;
        let index = |x: f64, a: usize| ((x - frame.origin[a]) / frame.edge).max(0.0);
        let first = [0, 1].map(|a| (index(low[a], a) + 1e-6).floor() as usize);
        let end = [0, 1].map(|a| {
            ((index(high[a], a) - 1e-6).ceil() as usize).clamp(first[a] + 1, frame.cells[a])
        });
        let heights = self.setup.heights[self.setup.heights.len() - planes..].to_vec();
        let corner = [0, 1].map(|a| frame.origin[a] + first[a] as f64 * frame.edge);
        let origin =
            meltpath_geometry::math::DVec3::new(corner[0], corner[1], -heights.iter().sum::<f64>());
        let cells = [end[0] - first[0], end[1] - first[1]];
        (
            Grid {
                origin,
                cells,
                edge: [frame.edge; 2],
                heights,
            },
            first,
        )
    }

    fn field(
        &self,
        values: &[f32],
        grid: &Grid,
        first: [usize; 2],
        of: impl Fn(f32) -> f32,
    ) -> Field {
        let nx = self.matter.frame.cells[0];
        let columns = nx * self.matter.frame.cells[1];
        let kept = values.len() / columns;
        let mut out = Vec::with_capacity(grid.len());
        for k in kept - grid.planes()..kept {
            for j in first[1]..first[1] + grid.cells[1] {
                let row = &values[k * columns + j * nx + first[0]..][..grid.cells[0]];
                out.extend(row.iter().map(|v| of(*v)));
            }
        }
        Field {
            grid: grid.clone(),
            values: out,
        }
    }

    /// Highest temperatures since the layer began, K, in the highest planes, between two corners of the plan. The build plane is
    /// at z = 0.
    pub fn highest_temperature(&mut self, corners: [[f64; 2]; 2]) -> Field {
        self.write_down();
        let columns = self.matter.frame.cells[0] * self.matter.frame.cells[1];
        let (grid, first) = self.window(corners, self.record.peak.len() / columns);
        self.field(&self.record.peak, &grid, first, |g| {
            self.curve.temperature(f64::from(g)) as f32
        })
    }

    /// Highest temperatures of the build plane itself since the layer began, K, as [`Self::highest_temperature`] has those of the cells
    /// below it: hotter than these where a beam heats them from above.
    pub fn highest_of_surface(&mut self, corners: [[f64; 2]; 2]) -> Field {
        self.write_down();
        let (grid, first) = self.window(corners, 1);
        let mut surface = self.field(&self.record.skin, &grid, first, |theta| {
            self.surface.temperature(&self.curve, f64::from(theta)) as f32
        });
        let cells = self.highest_temperature(corners).values;
        let top = cells.len() - surface.values.len();
        for (face, cell) in surface.values.iter_mut().zip(&cells[top..]) {
            *face = face.max(*cell);
        }
        surface
    }

    /// What was seen besides; see [`Levels::draw`].
    pub fn watched(&mut self, corners: [[f64; 2]; 2], outside: Vec<[f64; 3]>) -> Watched {
        self.write_down();
        let columns = self.matter.frame.cells[0] * self.matter.frame.cells[1];
        let planes = (self.record.above.len() / columns).min(FOLLOWED);
        let (grid, first) = self.window(corners, planes);
        let field = |values: &[f32]| self.field(values, &grid, first, |v| v);
        Watched {
            freezing: Freezing {
                above: field(&self.record.above),
                fell: field(&self.record.fell),
                rate: field(&self.record.rate),
            },
            samples: self.watching.samples.clone(),
            outside,
        }
    }

    /// Everything that tiles know is in the record.
    fn write_down(&mut self) {
        for (n, level) in self.levels.iter_mut().enumerate() {
            for tile in &mut level.tiles {
                self.record
                    .take(tile, 1 << (self.setup.coarser - n), &mut self.matter);
            }
        }
    }
}

/// The levels, without tiles.
fn levels(setup: &Setup, tree: &Tree) -> Vec<Level> {
    let bases = setup.bases();
    (0..=setup.coarser)
        .map(|level| {
            let [nx, ny] = tree.size(level);
            Level {
                edge: setup.cell * f64::from(1_u32 << (setup.coarser - level)),
                rates: Default::default(),
                base: bases[level],
                tiles: Vec::new(),
                shown: Vec::new(),
                index: vec![NOWHERE; nx * ny],
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A finer level has fewer planes than the next coarser one, or both have all; each goes as deep as it must, and all hold what
        /// is kept.
        #[test]
        fn finer_levels_end_higher(cell in 0.01..0.3_f64, coarser in 0..5_usize, below in 1..16_i32, tracked in 1..5_usize) {
            let mut heights: Vec<f64> = (0..below).map(|k| 0.05 * 1.4_f64.powi(k)).rev().collect();
            heights.extend(vec![0.05; tracked]);
            let setup = Setup {
                covered: [[0.0; 2], [1.0; 2]],
                cell,
                coarser,
                heights: heights.clone(),
                layer: 0.05,
                tracked: 0.05 * tracked as f64,
                top: Surface::Insulated,
                beyond: Face::Insulated,
                step: 1.0,
                focus: None,
                bend: BEND,
            };
            let bases = setup.bases();
            prop_assert_eq!(bases[0], 0);
            for pair in bases.windows(2) {
                prop_assert!(pair[0] < pair[1] || pair == [0, 0], "{:?}", bases);
            }
            for (level, base) in bases.iter().enumerate() {
                prop_assert!(base + tracked <= heights.len());
                let depth: f64 = heights[*base..].iter().sum();
                let edge = cell * f64::from(1_u32 << (coarser - level));
                prop_assert!(*base == 0 || depth > DEEP * edge - 1e-6, "{} {:?}", level, bases);
            }
        }
    }
}
