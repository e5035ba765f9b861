//! How hot the build plane itself is: cells tell the mean over their height, and under a beam the surface is hotter.
//!
//! By [`Depth::lift`](crate::solver::source::Depth::lift), with the heat that arrived on each uppermost cell during its step and what it
//! gives to the one below; less a third of the cell of what vapour takes from a surface as hot as that. Powder that has not melted
//! is as hot as its cell.

use crate::solver::steam::Lift;
use meltpath_numerics::vector::Loop;

/// Hottest surface that is tabled, K.
pub(super) const HOTTEST: f64 = 9000.0;

/// What the surface of a tile's uppermost cells knows.
#[derive(Debug, Clone)]
pub(crate) struct Skin {
    /// Heat that arrived since the last look, J/mm².
    pub(crate) arrived: Vec<f32>,
    /// Whether any did.
    pub(crate) lit: bool,
    /// `θ` of the surface at the last look, before vapour took its share, and the highest so far; W/mm.
    pub(crate) theta: Vec<f32>,
    pub(crate) peak: Vec<f32>,
}

impl Skin {
    /// Of a tile of `cells` columns.
    pub(crate) fn new(cells: usize) -> Self {
        Skin {
            arrived: vec![0.0; cells],
            lit: false,
            theta: vec![0.0; cells],
            peak: vec![0.0; cells],
        }
    }

    /// What arrives from now on is that of another step.
    pub(crate) fn forget(&mut self) {
        self.arrived.fill(0.0);
        self.lit = false;
    }

    /// The highest begin anew.
    pub(crate) fn begin_anew(&mut self) {
        self.peak.fill(0.0);
    }
}

/// Looks at the surface of a tile.
pub(crate) struct LookAtSkin<'a> {
    pub(crate) skin: &'a mut Skin,
    pub(crate) lift: Lift<f32>,
    /// `θ` of the uppermost cells, and of those below.
    pub(crate) theta: [&'a [f32]; 2],
    /// Shares of the metal's conductivity of the uppermost cells.
    pub(crate) share: &'a [f32],
}

impl Loop for LookAtSkin<'_> {
    #[inline(always)]
    fn run(self) {
        let LookAtSkin {
            skin,
            lift,
            theta: [top, below],
            share,
        } = self;
        let cells = top.len();
        let (arrived, face, peak) = (
            &skin.arrived[..cells],
            &mut skin.theta[..cells],
            &mut skin.peak[..cells],
        );
        let (below, share) = (&below[..cells], &share[..cells]);
        for n in 0..cells {
            let theta = top[n] + lift.of(arrived[n], top[n], below[n], share[n]);
            face[n] = theta;
            peak[n] = if theta > peak[n] { theta } else { peak[n] };
        }
        skin.forget();
    }
}
