//! Which places without metal are pores of the voxels, and which are lack.
//!
//! Layers of a body lie in other directions than the voxels and than each other, and metal laid in columns along one direction leaves
//! slits beside metal laid along another. Melt would fill them, as it does in the height map of flat layers, where there are none.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::Voxels;

/// Share of a voxel from which it is metal.
const SOLID: f64 = 0.5;
/// Pores are so many voxels thin, at most.
const THIN: u32 = 2;

/// The metal, and the air that is open to the outside.
pub(super) struct Solid<'a> {
    pub(super) metal: &'a Voxels,
    low: DVec3,
    count: [usize; 3],
    open: Vec<bool>,
}

impl<'a> Solid<'a> {
    pub(super) fn new(metal: &'a Voxels) -> Self {
        let (low, high) = metal.bounds();
        let count = ((high - low) / metal.cell()).round().to_array();
        let count = count.map(|n| n as usize);
        let mut solid = Solid {
            metal,
            low,
            count,
            open: vec![false; count.iter().product()],
        };
        solid.let_in_air();
        solid
    }

    /// Fills in from the sides of the box, to each of the 26 voxels about one: what hangs together by a corner is open.
    fn let_in_air(&mut self) {
        let [nx, ny, nz] = self.count;
        let on_side = |&[x, y, z]: &[usize; 3]| {
            [(x, nx), (y, ny), (z, nz)]
                .iter()
                .any(|(i, n)| *i == 0 || i + 1 == *n)
        };
        let all = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        let mut front: Vec<[usize; 3]> = all.filter(on_side).filter(|c| self.enters(*c)).collect();
        while let Some(from) = front.pop() {
            let near = from.map(|i| i.saturating_sub(1)..i + 2);
            let [xs, ys, zs] = near;
            for z in zs {
                for y in ys.clone() {
                    for x in xs.clone() {
                        if self.enters([x, y, z]) {
                            front.push([x, y, z]);
                        }
                    }
                }
            }
        }
    }

    /// Whether air comes newly into a voxel.
    fn enters(&mut self, [x, y, z]: [usize; 3]) -> bool {
        let [nx, ny, nz] = self.count;
        let inside = x < nx && y < ny && z < nz;
        let index = (z * ny + y) * nx + x;
        let centre =
            self.low + self.metal.cell() * (DVec3::new(x as f64, y as f64, z as f64) + 0.5);
        let new = inside && !self.open[index] && self.metal.sample(centre) < SOLID;
        if new {
            self.open[index] = true;
        }
        new
    }

    /// Whether no way through the air leads out of a place.
    fn enclosed(&self, p: DVec3) -> bool {
        let at = ((p - self.low) / self.metal.cell()).floor();
        let [nx, ny, nz] = self.count;
        let inside =
            at.min_element() >= 0.0 && at.x < nx as f64 && at.y < ny as f64 && at.z < nz as f64;
        let [x, y, z] = at.to_array().map(|i| i as usize);
        inside && !self.open[(z * ny + y) * nx + x]
    }

    /// Whether there is metal at a place, or a pore: one no wider along the growth than two voxels, or an enclosed one no wider than that
    /// in a direction across it. Pores between beads are no more in the model than on flat layers.
    pub(super) fn closed(&self, p: DVec3, growing: DVec3) -> bool {
        let solid = |p: DVec3| self.metal.sample(p) >= SOLID;
        let beside =
            |way: DVec3| (1..=THIN).any(|n| solid(p + f64::from(n) * self.metal.cell() * way));
        let thin = |way: DVec3| beside(way) && beside(-way);
        let (u, v) = growing.any_orthonormal_pair();
        let across = [u, v, (u + v).normalize(), (u - v).normalize()];
        solid(p) || thin(growing) || (self.enclosed(p) && across.into_iter().any(thin))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of 20 mm with a slit 1 mm wide and 4 mm deep, its top at `top`.
    fn slit(top: f64, width: f64) -> Voxels {
        let cell = 0.5;
        let mut voxels = Voxels::new(DVec3::splat(-12.0), DVec3::splat(12.0), cell).unwrap();
        let half = 0.5 * width;
        let mut fill = |low: [f64; 3], high: [f64; 3]| {
            let (low, high) = (DVec3::from_array(low), DVec3::from_array(high));
            voxels.fill_box(low, high).unwrap();
        };
        fill([-10.0, -10.0, -10.0], [-half, 10.0, 10.0]);
        fill([half, -10.0, -10.0], [10.0, 10.0, 10.0]);
        fill([-half, -10.0, -10.0], [half, -5.0, 10.0]);
        fill([-half, 5.0, -10.0], [half, 10.0, 10.0]);
        fill([-half, -5.0, -10.0], [half, 5.0, top - 4.0]);
        if top < 10.0 {
            fill([-half, -5.0, top], [half, 5.0, 10.0]);
        }
        voxels
    }

    #[test]
    fn a_slit_is_a_pore_where_it_is_enclosed_and_thin() {
        let pore = |top: f64, width: f64| {
            let voxels = slit(top, width);
            voxels.sanity_check().unwrap();
            let middle = DVec3::new(0.0, 0.0, top - 2.0);
            Solid::new(&voxels).closed(middle, DVec3::Z)
        };
        assert!(pore(4.0, 1.0));
        // open to the top it is a groove; wide it is a hole
        assert!(!pore(10.0, 1.0));
        assert!(!pore(4.0, 4.0));
        let voxels = slit(4.0, 1.0);
        let solid = Solid::new(&voxels);
        assert!(solid.closed(DVec3::new(5.0, 0.0, 0.0), DVec3::Z));
        assert!(!solid.closed(DVec3::new(0.0, 0.0, 11.0), DVec3::Z));
    }
}
