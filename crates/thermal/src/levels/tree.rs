//! Which tiles there are: a quadtree over the plan whose leaves are the tiles, neighbours at most one level apart.

/// Places of tiles on every level, coarsest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tree {
    /// Tiles along x and y of the coarsest level.
    roots: [usize; 2],
    /// Whether a tile of a level is divided; the finest level has none.
    divided: Vec<Vec<bool>>,
}

impl Tree {
    /// Roots alone, of `levels` levels.
    pub(crate) fn new(roots: [usize; 2], levels: usize) -> Self {
        let places = |level: usize| (roots[0] << level) * (roots[1] << level);
        Tree {
            roots,
            divided: (0..levels)
                .map(|level| vec![false; places(level)])
                .collect(),
        }
    }

    /// Tiles along x and y of a level.
    #[inline]
    pub(crate) fn size(&self, level: usize) -> [usize; 2] {
        [self.roots[0] << level, self.roots[1] << level]
    }

    #[inline]
    fn place(&self, level: usize, at: [usize; 2]) -> usize {
        at[1] * self.size(level)[0] + at[0]
    }

    /// Whether the tile is divided into four of the next level.
    #[inline]
    pub(crate) fn is_divided(&self, level: usize, at: [usize; 2]) -> bool {
        let places = self.divided.get(level);
        places.is_some_and(|d| d[self.place(level, at)])
    }

    /// Whether a tile of this level, divided or not, is there.
    #[inline]
    pub(crate) fn is_there(&self, level: usize, at: [usize; 2]) -> bool {
        level == 0 || self.is_divided(level - 1, [at[0] / 2, at[1] / 2])
    }

    /// Asks for a tile of this level at a place; [`Tree::settle`] makes it and what it needs.
    pub(crate) fn want(&mut self, level: usize, at: [usize; 2]) {
        if level > 0 {
            let parent = self.place(level - 1, at.map(|t| t / 2));
            self.divided[level - 1][parent] = true;
        }
    }

    /// Divides what the wanted tiles need: all above them, and what lies beside so far that no two neighbours are more than one
    /// level apart.
    pub(crate) fn settle(&mut self) {
        for level in (1..self.divided.len()).rev() {
            let [nx, ny] = self.size(level);
            for j in 0..ny {
                for i in 0..nx {
                    if !self.divided[level][j * nx + i] {
                        continue;
                    }
                    for y in j.saturating_sub(1)..(j + 2).min(ny) {
                        for x in i.saturating_sub(1)..(i + 2).min(nx) {
                            self.want(level, [x, y]);
                        }
                    }
                }
            }
        }
    }

    /// The place beside a tile, where it is on the plan.
    #[inline]
    pub(crate) fn beside(
        &self,
        level: usize,
        at: [usize; 2],
        way: [isize; 2],
    ) -> Option<[usize; 2]> {
        let size = self.size(level);
        let x = at[0].checked_add_signed(way[0]).filter(|x| *x < size[0])?;
        let y = at[1].checked_add_signed(way[1]).filter(|y| *y < size[1])?;
        Some([x, y])
    }
}

/// Places of the four parts of a tile, row by row.
pub(crate) fn parts(at: [usize; 2]) -> [[usize; 2]; 4] {
    let [x, y] = at.map(|t| 2 * t);
    [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whatever is wanted is there, and neighbours are at most one level apart.
        #[test]
        fn neighbours_are_one_level_apart(places in prop::collection::vec((0..3_usize, 0..16_usize, 0..24_usize), 1..12)) {
            let mut tree = Tree::new([2, 3], 4);
            for (back, x, y) in &places {
                let level = 3 - back;
                tree.want(level, [x >> back, y >> back]);
            }
            tree.settle();
            for (back, x, y) in &places {
                prop_assert!(tree.is_there(3 - back, [x >> back, y >> back]));
            }
            for level in 0..4 {
                let [nx, ny] = tree.size(level);
                for at in (0..nx * ny).map(|n| [n % nx, n / nx]).filter(|at| level > 0 && tree.is_there(level, *at)) {
                    for way in [[-1, 0], [1, 0], [0, -1], [0, 1]] {
                        if let Some(other) = tree.beside(level, at, way) {
                            prop_assert!(tree.is_there(level - 1, other.map(|t| t / 2)));
                        }
                    }
                }
            }
        }
    }
}
