//! The moving local height map: columns along the torch axis about the pool, read from the voxels as the pool comes.

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::{Column, Columns, HeightMap, Voxels};

use super::TURN;
use crate::deposit::Station;
use crate::deposit::levelling::{Frozen, LocalBead, MoltenZone};

/// What is known of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Known {
    Nothing,
    /// Metal within reach.
    Ground,
    /// None within reach.
    Void,
}

/// How far a column is looked at, mm above the patch's plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    /// As deep as this.
    pub(super) low: f64,
    /// From here down, if that is in the air.
    pub(super) from: f64,
    /// The air is looked for up to here.
    pub(super) ceiling: f64,
    /// Height that stands for columns without metal: deeper than the melt runs.
    pub(super) void: f64,
}

/// Columns about the pool, all along one direction.
#[derive(Debug)]
pub(super) struct Patch {
    pub(super) columns: Columns,
    pub(super) map: HeightMap,
    pub(super) zone: MoltenZone,
    known: Vec<Known>,
    /// Whether any column is void.
    has_void: bool,
    /// Stamps alone: height of each column before its first stamp, the stamped cells, and the travel at the last stamp of each.
    before: Vec<f64>,
    stamped: Vec<u32>,
    last: Vec<f64>,
    /// Half its width, mm.
    half: f64,
}

impl Patch {
    /// A patch `half` mm to each side of `centre`, along `axis`, its rows along `ahead`; `None` where they do not span a frame.
    pub(super) fn new(
        voxels: &Voxels,
        (centre, axis, ahead): (DVec3, DVec3, DVec3),
        half: f64,
    ) -> Option<Self> {
        let up = axis.try_normalize()?;
        let across = |d: DVec3| (d - d.dot(up) * up).try_normalize();
        let x = across(ahead)
            .or_else(|| across(DVec3::X))
            .or_else(|| across(DVec3::Y))?;
        let side = voxels.cell();
        // a patch in line with the voxels has its columns on theirs
        let columns = Columns {
            origin: voxels.centre_near(centre),
            axes: [x, up.cross(x), up],
            side,
        };
        let cells = (half / side).ceil();
        let corner = DVec2::splat(-(cells + 0.5) * side);
        let map = HeightMap::new(corner, -corner, side, 0.0).ok()?;
        let count = map.z.len();
        Some(Patch {
            columns,
            zone: MoltenZone::new(&map),
            map,
            known: vec![Known::Nothing; count],
            has_void: false,
            before: vec![0.0; count],
            stamped: Vec::new(),
            last: vec![f64::NEG_INFINITY; count],
            half: cells * side,
        })
    }

    pub(super) fn local(&self, p: DVec3) -> DVec3 {
        self.columns.local(p)
    }

    /// Whether the pool at `p` with this axis wants another patch: turned away, or within `margin` mm of the border.
    pub(super) fn is_left(&self, p: DVec3, axis: DVec3, margin: f64) -> bool {
        let at = self.local(p).truncate().abs();
        at.max_element() > self.half - margin
            || axis.cross(self.columns.axes[2]).length() > TURN.sin()
            || axis.dot(self.columns.axes[2]) <= 0.0
    }

    /// Reads what is not known yet of the columns between two corners.
    pub(super) fn read(&mut self, voxels: &Voxels, (lo, hi): (DVec2, DVec2), window: &Window) {
        let (xs, ys) = self.map.cells_within(lo, hi);
        for iy in ys {
            for ix in xs.clone() {
                let i = self.map.index(ix, iy);
                if self.known[i] != Known::Nothing {
                    continue;
                }
                let p = self.map.centre(ix, iy);
                let within = (window.low, window.from, window.ceiling);
                if let Some(column) = voxels.column(&self.columns, (p.x, p.y), within) {
                    self.known[i] = Known::Ground;
                    self.zone.book(&mut self.map, i, &column);
                } else {
                    self.known[i] = Known::Void;
                    self.has_void = true;
                    self.map.z[i] = window.void;
                }
                self.before[i] = self.map.z[i];
            }
        }
    }

    /// Whether at least half of what is under a point is void.
    pub(super) fn is_void(&self, p: DVec2) -> bool {
        let Some((ix, iy)) = self.map.cell_at(p) else {
            return true;
        };
        self.known[self.map.index(ix, iy)] != Known::Ground
    }

    /// Whether the column of a cell found no metal.
    pub(super) fn was_void(&self, cell: usize) -> bool {
        self.known[cell] == Known::Void
    }

    /// Puts an imaginary ground at height `z` under void columns within `reach` of a point: metal is laid there and hangs free.
    pub(super) fn hang(&mut self, p: DVec2, reach: f64, z: f64) {
        if !self.has_void {
            return;
        }
        let (xs, ys) = self.map.cells_within(p - reach, p + reach);
        for iy in ys {
            for ix in xs.clone() {
                let i = self.map.index(ix, iy);
                if self.known[i] == Known::Void
                    && self.map.z[i] < z
                    && self.map.centre(ix, iy).distance(p) <= reach
                {
                    let at = Column {
                        top: z,
                        cover: 1.0,
                        foot: z,
                    };
                    self.zone.book(&mut self.map, i, &at);
                    self.before[i] = z;
                }
            }
        }
    }

    /// Surface that the bead finds at a point, mm above the patch's plane.
    pub(super) fn ground(&self, p: DVec2) -> f64 {
        self.zone.ground_at(&self.map, p)
    }

    /// How far `p` is over the surface that the bead finds, along a direction `axis` that leans from the columns, mm: to the next metal
    /// below it, or up to the air where it is in metal; as far as `reach` either way. Columns on the way are read.
    pub(super) fn over(
        &mut self,
        voxels: &Voxels,
        (p, axis): (DVec3, DVec3),
        window: &Window,
        reach: f64,
    ) -> f64 {
        let (p, axis) = (self.local(p), self.local(self.columns.origin + axis));
        let margin = DVec2::splat(2.0 * self.columns.side);
        let mut height = |over: f64| {
            let at = p - over * axis;
            let (lo, hi) = (at.truncate() - margin, at.truncate() + margin);
            self.read(voxels, (lo, hi), window);
            at.z - self.ground(at.truncate())
        };
        let mut last = height(0.0);
        let step = if last > 0.0 { 0.5 } else { -0.5 } * voxels.cell();
        let mut over = 0.0_f64;
        while over.abs() < reach {
            let next = height(over + step);
            if (next > 0.0) != (last > 0.0) {
                return over + step * last / (last - next);
            }
            (over, last) = (over + step, next);
        }
        over
    }

    /// Surface as it is now on the axis through `p`.
    pub(super) fn surface(&self, p: DVec3) -> DVec3 {
        let at = self.local(p).truncate();
        self.columns.point(at.extend(self.map.height(at)))
    }

    /// Takes over the melt of an earlier patch, which lies along `trail`.
    pub(super) fn resume(
        &mut self,
        earlier: &Patch,
        laws: (&crate::deposit::Levelling, &LocalBead),
        trail: &[Station],
    ) {
        let melt = earlier.zone.melt(&earlier.map);
        if melt.0 <= 0.0 {
            return;
        }
        let columns = self.columns;
        let surface = |p: DVec2, floor: f64| {
            let mut z = floor;
            for _ in 0..4 {
                let there = earlier.local(columns.point(p.extend(z)));
                z += earlier.zone.surface_at(&earlier.map, there.truncate())? - there.z;
            }
            Some(z)
        };
        self.zone.resume(&mut self.map, laws, trail, surface, melt);
    }

    /// Notes the cells that a stamp was laid on at `travelled`.
    pub(super) fn note_stamp(&mut self, cells: impl Iterator<Item = u32>, travelled: f64) {
        for i in cells {
            let last = &mut self.last[i as usize];
            if *last == f64::NEG_INFINITY {
                self.stamped.push(i);
            }
            *last = travelled;
        }
    }

    /// The columns that no stamp has reached since `until`.
    pub(super) fn settled_stamps(&mut self, until: f64) -> Vec<Frozen> {
        let mut settled = Vec::new();
        let (before, last, z) = (&mut self.before, &mut self.last, &self.map.z);
        self.stamped.retain(|&i| {
            let c = i as usize;
            let stays = last[c] >= until;
            if !stays {
                settled.push(Frozen {
                    cell: c,
                    floor: before[c],
                    top: z[c],
                    cover: 1.0,
                });
                before[c] = z[c];
                last[c] = f64::NEG_INFINITY;
            }
            stays
        });
        settled
    }
}
