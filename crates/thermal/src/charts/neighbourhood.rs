//! Share of powder round a column of voxels: how much of the cylinder that the beam heats is not yet metal.
//!
//! Béraud 2016, eq. 3.2.8 and annex E; the cylinder is flush with the build plane (erratum E29), so the share belongs to
//! the column. Kept by counting: a voxel that melts changes the count of every column whose cylinder holds it.

/// Columns within a radius, and powder voxels counted in them.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbourhood {
    cells: [usize; 2],
    planes: usize,
    /// Half the extent of the disc in x for each row offset `−rows..=rows`.
    reach: Vec<usize>,
    powder: Vec<u32>,
    all: Vec<u32>,
}

impl Neighbourhood {
    /// Discs of `radius` mm on a grid of columns of `edge` mm; `powder` tells for each column how many of its `planes`
    /// voxels are powder.
    pub fn new(
        cells: [usize; 2],
        edge: [f64; 2],
        radius: f64,
        planes: usize,
        powder: &[u32],
    ) -> Self {
        let rows = (radius / edge[1]).ceil() as usize;
        let within = |dx: usize, dy: usize| {
            (dx as f64 * edge[0]).hypot(dy as f64 * edge[1]) < radius || (dx, dy) == (0, 0)
        };
        let widest = (radius / edge[0]).ceil() as usize;
        let reach: Vec<usize> = (0..=rows)
            .take_while(|dy| within(0, *dy))
            .map(|dy| (0..=widest).take_while(|dx| within(*dx, dy)).count() - 1)
            .collect();
        let mut counts = Neighbourhood {
            cells,
            planes,
            reach,
            powder: vec![0; cells[0] * cells[1]],
            all: vec![0; cells[0] * cells[1]],
        };
        counts.count(powder);
        counts
    }

    /// Counts anew, after many voxels have changed.
    pub fn count(&mut self, powder: &[u32]) {
        self.powder.fill(0);
        self.all.fill(0);
        for (column, here) in powder.iter().enumerate() {
            let planes = self.planes as u32;
            self.each_around(column, |counts, n| {
                counts.powder[n] += here;
                counts.all[n] += planes;
            });
        }
    }

    fn each_around(&mut self, column: usize, mut see: impl FnMut(&mut Self, usize)) {
        let [nx, ny] = self.cells;
        let (i, j) = (column % nx, column / nx);
        for row in j.saturating_sub(self.reach.len() - 1)..(j + self.reach.len()).min(ny) {
            let reach = self.reach[row.abs_diff(j)];
            for at in i.saturating_sub(reach)..(i + reach + 1).min(nx) {
                see(self, row * nx + at);
            }
        }
    }

    /// `voxels` powder voxels of a column have become metal.
    pub fn melted(&mut self, column: usize, voxels: u32) {
        self.each_around(column, |counts, n| counts.powder[n] -= voxels);
    }

    /// Share of powder round a column.
    pub fn share(&self, column: usize) -> f64 {
        f64::from(self.powder[column]) / f64::from(self.all[column])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn ebm_a12_share_of_powder() {
        let share = |per_column: u32| {
            let counts = Neighbourhood::new([20, 20], [0.05, 0.05], 0.386, 7, &[per_column; 400]);
            counts.share(210)
        };
        assert_eq!(share(0), 0.0);
        assert_eq!(share(7), 1.0);
        // one powder layer of 50 µm over metal, 350 µm deep
        assert!((share(1) - 1.0 / 7.0).abs() < 1e-12);
    }

    proptest! {
        /// The double loop of annex E over all voxels, and the counts kept while voxels melt.
        #[test]
        fn ebm_a13_counts_are_those_of_the_double_loop(
            cells in (3..9_usize, 3..9_usize), radius in 0.04..0.4_f64, ratio in 0.6..1.6_f64,
            melting in prop::collection::vec((0..81_usize, 0..3_u32), 0..40),
        ) {
            let [nx, ny] = [cells.0, cells.1];
            let edge = [0.05, 0.05 * ratio];
            let planes = 3;
            let mut powder = vec![planes as u32; nx * ny];
            let mut kept = Neighbourhood::new([nx, ny], edge, radius, planes, &powder);
            for (column, voxels) in melting {
                let column = column % (nx * ny);
                let voxels = voxels.min(powder[column]);
                powder[column] -= voxels;
                kept.melted(column, voxels);
            }
            let centre = |c: usize| [(c % nx) as f64 * edge[0], (c / nx) as f64 * edge[1]];
            for a in 0..nx * ny {
                let (mut sum, mut all) = (0, 0);
                for (b, here) in powder.iter().enumerate() {
                    let (p, q) = (centre(a), centre(b));
                    let near = |p: [f64; 2], q: [f64; 2]| p == q || (p[0] - q[0]).hypot(p[1] - q[1]) < radius - 1e-12;
                    prop_assert_eq!(near(p, q), near(q, p));
                    // a distance within rounding of the radius may fall on either side
                    prop_assume!(((p[0] - q[0]).hypot(p[1] - q[1]) - radius).abs() > 1e-9);
                    if near(p, q) {
                        sum += here;
                        all += planes as u32;
                    }
                }
                prop_assert_eq!((kept.powder[a], kept.all[a]), (sum, all));
            }
        }
    }
}
