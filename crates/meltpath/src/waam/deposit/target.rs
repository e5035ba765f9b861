//! What the build is compared with: the finished part, and the part with its allowance, on the grid of the height map.
//!
//! The allowance is measured horizontally and vertically apart: the envelope at a height is the union of the part's
//! sections from the allowance of upward faces below it to the allowance of sides above it, each grown by the allowance of
//! sides. Where both are one, it contains the exact offset of the part and exceeds it only at edges, by at most 0.41 × the
//! allowance.

use meltpath_base::{Cancelled, Observer, Reporter};
use meltpath_geometry::boolean::{PlanarError, difference};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::offset::{Join, outset};
use meltpath_geometry::raster::{Grid, Mask, rasterise};
use meltpath_geometry::section::{Slice, SliceError, SlicePlan, slice};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_geometry::{Plane, Region};
use rayon::prelude::*;

use super::stock::{self, SurfacePoint, points, reach};
use crate::stages::part::Part;

/// Metal beyond the finished part, for machining.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allowance {
    /// Over sides, horizontally, mm.
    pub side: f64,
    /// Over faces that look up, vertically, mm.
    pub top: f64,
}

meltpath_base::passes_on! {
    /// Why a target could not be made.
    pub enum TargetError {
        /// Cancelled.
        Cancelled(Cancelled),
        /// The part could not be cut.
        Slice(SliceError),
        /// The part could not be grown by its allowance.
        Planar(PlanarError),
    }
}

/// One slab of the part, between two heights.
#[derive(Debug, Clone)]
pub struct Level {
    /// Lower face, mm.
    pub bottom: f64,
    /// Upper face, mm.
    pub top: f64,
    /// Cells of the finished part at mid-height.
    pub part: Mask,
    /// Cells of the part with its allowance.
    pub envelope: Mask,
}

/// The finished part, ready to be compared with what was built.
#[derive(Debug, Clone)]
pub struct Target {
    /// Slabs from the plate up to the top of the envelope.
    pub levels: Vec<Level>,
    /// Points spread over the surface that can be machined: not the base, not faces that look down.
    pub surface: Vec<SurfacePoint>,
    /// Volume of the finished part, mm³: what several of its shells cover counts once, as in the slabs.
    pub volume: f64,
    /// Metal asked for beyond the finished part.
    pub allowance: Allowance,
    /// What of the part lies beyond the height map, where no metal is.
    pub beyond: Option<Beyond>,
}

/// The part of a finished part that lies beyond a height map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beyond {
    /// Its volume, mm³.
    pub volume: f64,
    /// Its place farthest from the map, mm.
    pub at: DVec3,
    /// The height of the part, mm.
    pub height: f64,
}

impl Target {
    /// The target of a part that stands on z = 0, on the grid of `map`, in slabs one cell thick.
    ///
    /// # Errors
    /// [`TargetError`].
    pub fn new(
        part: &Part,
        allowance: Allowance,
        map: &HeightMap,
        reporter: &Reporter,
        observer: &dyn Observer,
    ) -> Result<Self, TargetError> {
        let mesh = &part.mesh;
        let grid = Grid {
            origin: map.origin,
            cell: map.cell,
            nx: map.nx,
            ny: map.ny,
        };
        let top = mesh.bounds().map_or(0.0, |(_, hi)| hi.z);
        let count = (top / map.cell).ceil().max(1.0) as usize;
        // slabs that fill the part exactly, so that its volume is not counted beyond its top
        let thickness = top / count as f64;
        let middle = |i: usize| (i as f64 + 0.5) * thickness;
        let plan = SlicePlan::new(Plane::horizontal(0.0), (0..count).map(middle).collect());
        let slices = slice(mesh, &plan, reporter, observer)?;
        let join = Join::Round {
            arc_tolerance: 0.1 * map.cell,
        };
        let masks: Vec<(Mask, Mask)> = slices
            .par_iter()
            .map(|s| {
                let grown = outset(&s.regions, allowance.side, join)?;
                Ok((rasterise(&s.regions, &grid), rasterise(&grown, &grid)))
            })
            .collect::<Result<_, PlanarError>>()?;
        observer.check()?;
        let (low, high) = map.bounds();
        let areas = slices
            .par_iter()
            .map(|s| area_beyond(&s.regions, low, high));
        let areas: Vec<f64> = areas.collect::<Result<_, PlanarError>>()?;
        let away = |p: &DVec3| {
            let p = p.truncate();
            (low - p).max(p - high).max_element()
        };
        let farthest = mesh
            .vertices
            .iter()
            .max_by(|a, b| away(a).total_cmp(&away(b)));
        let volume = thickness * areas.iter().sum::<f64>();
        let beyond = farthest.filter(|_| volume > 0.0).map(|at| Beyond {
            volume,
            at: *at,
            height: top,
        });
        let slabs = |length: f64| (length / thickness).round() as usize;
        let (below, above) = (slabs(allowance.top), slabs(allowance.side));
        let levels = (0..count + below)
            .into_par_iter()
            .map(|i| {
                let around = i.saturating_sub(below)..(i + above + 1).min(count);
                Level {
                    bottom: i as f64 * thickness,
                    top: (i + 1) as f64 * thickness,
                    part: masks.get(i).map(|m| m.0.clone()).unwrap_or_default(),
                    envelope: masks[around]
                        .iter()
                        .fold(Mask::default(), |all, m| all.union(&m.1)),
                }
            })
            .collect();
        Ok(Target {
            levels,
            surface: machined(points(mesh, map.cell), map.cell),
            volume: match part.loose_edges {
                0 => part.volume,
                // an open surface encloses what its sections show
                _ => thickness * slices.iter().map(Slice::area).sum::<f64>(),
            },
            allowance,
            beyond,
        })
    }
}

/// The area of regions beyond a rectangle, mm².
fn area_beyond(regions: &[Region], low: DVec2, high: DVec2) -> Result<f64, PlanarError> {
    let inside = |p: &DVec2| p.cmpge(low).all() && p.cmple(high).all();
    if regions.iter().flat_map(|r| &r.outer).all(inside) {
        return Ok(0.0);
    }
    let beyond = difference(regions, &[Region::rectangle(low, high)])?;
    Ok(beyond.iter().map(Region::area).sum())
}

/// The build against the target.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    /// Volume of the finished part that has no metal, mm³.
    pub lack: f64,
    /// Volume of metal beyond part + allowance, mm³.
    pub excess: f64,
    /// Where the tallest column of lack stands, and its height, mm.
    pub lack_at: Option<(DVec3, f64)>,
    /// Where the tallest column of excess stands, and its height, mm.
    pub excess_at: Option<(DVec3, f64)>,
    /// Smallest machining stock over the finished surface, mm (negative: metal is missing), and where: over faces that look up more than
    /// sideways, and over those that look sideways.
    pub stock: [Option<(f64, SurfacePoint)>; 2],
}

/// Compares the heights of `map` over its plate, each as `shifted` makes it, with the target: what an error of growth would
/// do.
pub fn compare(
    map: &HeightMap,
    target: &Target,
    shifted: impl Fn(f64) -> f64 + Sync,
) -> Comparison {
    let map = HeightMap {
        z: map
            .z
            .iter()
            .map(|z| map.base + shifted(z - map.base))
            .collect(),
        ..map.clone()
    };
    let area = map.cell * map.cell;
    let columns: Vec<ColumnSums> = (0..map.ny)
        .into_par_iter()
        .map(|iy| row(&map, target, iy))
        .collect();
    let mut result = Comparison::default();
    if let Some(Beyond { volume, at, height }) = target.beyond {
        result.lack = volume;
        result.lack_at = Some((at, height));
    }
    for sums in columns {
        result.lack += sums.lack * area;
        result.excess += sums.excess * area;
        keep_larger(&mut result.lack_at, sums.lack_at);
        keep_larger(&mut result.excess_at, sums.excess_at);
    }
    result.stock = least_stock(&map, target);
    result
}

#[derive(Default)]
struct ColumnSums {
    lack: f64,
    excess: f64,
    lack_at: Option<(DVec3, f64)>,
    excess_at: Option<(DVec3, f64)>,
}

fn keep_larger(best: &mut Option<(DVec3, f64)>, other: Option<(DVec3, f64)>) {
    if let Some((_, height)) = other
        && best.is_none_or(|(_, h)| height > h)
    {
        *best = other;
    }
}

/// Lack and excess of one row of columns, mm of height summed over its cells.
fn row(map: &HeightMap, target: &Target, iy: usize) -> ColumnSums {
    let heights = &map.z[iy * map.nx..(iy + 1) * map.nx];
    let mut lack = vec![0.0; map.nx];
    // metal anywhere in the column, less what lies inside the envelope
    let mut excess: Vec<f64> = heights.iter().map(|z| (z - map.base).max(0.0)).collect();
    for level in &target.levels {
        let thickness = level.top - level.bottom;
        let filled = |z: f64| (z - level.bottom).clamp(0.0, thickness);
        for &(first, past) in level.part.rows.get(iy).into_iter().flatten() {
            for ix in first as usize..past as usize {
                lack[ix] += thickness - filled(heights[ix]);
            }
        }
        for &(first, past) in level.envelope.rows.get(iy).into_iter().flatten() {
            for ix in first as usize..past as usize {
                excess[ix] -= filled(heights[ix]);
            }
        }
    }
    let mut sums = ColumnSums::default();
    for ix in 0..map.nx {
        let at = || map.centre(ix, iy).extend(heights[ix]);
        let over = excess[ix].max(0.0);
        sums.lack += lack[ix];
        sums.excess += over;
        if lack[ix] > 0.0 {
            keep_larger(&mut sums.lack_at, Some((at(), lack[ix])));
        }
        if over > 0.0 {
            keep_larger(&mut sums.excess_at, Some((at(), over)));
        }
    }
    sums
}

/// The smallest distance along the outward normal from the finished surface to the end of the metal, over faces that look up and over those
/// that look sideways.
fn least_stock(map: &HeightMap, target: &Target) -> [Option<(f64, SurfacePoint)>; 2] {
    let reach = reach(target.allowance.side.max(target.allowance.top));
    let solid = |p: DVec3| p.z <= map.height(p.truncate());
    let [aside, up] = stock::least(&target.surface, solid, 0.25 * map.cell, reach);
    [up, aside]
}

/// Those that can be machined, higher than `least`: not the base, not faces that rest on the plate or hang over, whose stock a height map
/// cannot tell.
fn machined(mut points: Vec<SurfacePoint>, least: f64) -> Vec<SurfacePoint> {
    points.retain(|p| p.normal.z >= -0.05 && p.position.z > least);
    points
}

/// The height of the metal round a place, mm: over half of the cells with metal within `radius` it is higher.
pub fn metal_round(map: &HeightMap, at: DVec2, radius: f64) -> Option<f64> {
    let (columns, rows) = map.cells_within(at - radius, at + radius);
    let near = rows.flat_map(|iy| columns.clone().map(move |ix| (ix, iy)));
    let mut heights: Vec<f64> = near
        .filter(|(ix, iy)| map.centre(*ix, *iy).distance(at) <= radius)
        .map(|(ix, iy)| map.z[map.index(ix, iy)])
        .filter(|z| *z > map.base)
        .collect();
    heights.sort_unstable_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied()
}

/// The mean and the spread of heights over the cells of a mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerTop {
    /// Mean height, mm.
    pub mean: f64,
    /// 95th minus 5th percentile, mm: the flatness, free of single cells.
    pub spread: f64,
    /// Greatest height, mm, and its place.
    pub highest: (f64, DVec2),
}

/// Heights of `z` (row-major on the grid of `map`) over `mask`; `None` for an empty mask.
pub fn layer_top(map: &HeightMap, z: &[f64], mask: &Mask) -> Option<LayerTop> {
    let mut heights: Vec<(f64, usize)> = mask
        .cells()
        .map(|(ix, iy)| iy * map.nx + ix)
        .map(|i| (z[i], i))
        .collect();
    heights.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let &(highest, at) = heights.last()?;
    let mean = heights.iter().map(|h| h.0).sum::<f64>() / heights.len() as f64;
    Some(LayerTop {
        mean,
        spread: spread(heights.iter().map(|h| h.0).collect())?,
        highest: (highest, map.centre(at % map.nx, at / map.nx)),
    })
}

/// How flat heights are: 5-95 % of them lie so far apart, mm; `None` where there are none.
pub fn spread(mut heights: Vec<f64>) -> Option<f64> {
    heights.sort_unstable_by(f64::total_cmp);
    let last = heights.len().saturating_sub(1) as f64;
    let at = |share: f64| heights.get((last * share).round() as usize).copied();
    Some(at(0.95)? - at(0.05)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_base::Silent;
    use meltpath_geometry::Mesh;

    const EVEN: Allowance = Allowance {
        side: 2.0,
        top: 2.0,
    };

    fn rectangle(lo: f64, hi: f64) -> Vec<Region> {
        vec![Region::rectangle(DVec2::splat(lo), DVec2::splat(hi))]
    }

    /// A block 20 x 20 x 10 mm with 2 mm of allowance on a map of 40 x 40 mm.
    fn block(built_to: f64) -> (HeightMap, Target) {
        let mut map = HeightMap::new(DVec2::splat(-10.0), DVec2::splat(30.0), 0.5, 0.0).unwrap();
        let grid = Grid {
            origin: map.origin,
            cell: map.cell,
            nx: map.nx,
            ny: map.ny,
        };
        let part = rasterise(&rectangle(0.0, 20.0), &grid);
        let envelope = rasterise(&rectangle(-2.0, 22.0), &grid);
        let levels = (0..12)
            .map(|i| Level {
                bottom: f64::from(i),
                top: f64::from(i + 1),
                part: if i < 10 {
                    part.clone()
                } else {
                    Mask::default()
                },
                envelope: envelope.clone(),
            })
            .collect();
        for (ix, iy) in rasterise(&rectangle(-1.0, 21.0), &grid).cells() {
            let i = map.index(ix, iy);
            map.z[i] = built_to;
        }
        let top = DVec3::new(10.0, 10.0, 10.0);
        let side = DVec3::new(20.0, 10.0, 5.0);
        let surface = vec![
            SurfacePoint {
                position: top,
                normal: DVec3::Z,
            },
            SurfacePoint {
                position: side,
                normal: DVec3::X,
            },
        ];
        (
            map,
            Target {
                levels,
                surface,
                volume: 4000.0,
                allowance: EVEN,
                beyond: None,
            },
        )
    }

    #[test]
    fn a_block_built_right_has_stock_all_over() {
        let (map, target) = block(11.5);
        let c = compare(&map, &target, |h| h);
        assert_eq!((c.lack, c.excess), (0.0, 0.0));
        let (stock, at) = c.stock[1].unwrap();
        assert!(
            (stock - 1.0).abs() < 0.3 && at.position.x == 20.0,
            "{stock}"
        );
    }

    #[test]
    fn a_low_block_lacks_metal_and_a_tall_one_has_too_much() {
        let (map, target) = block(9.0);
        let c = compare(&map, &target, |h| h);
        assert!((c.lack - 400.0).abs() < 1e-9);
        assert!((c.stock[0].unwrap().0 + 1.0).abs() < 0.2);
        let (map, target) = block(13.0);
        let c = compare(&map, &target, |h| h);
        assert!((c.excess - 22.0 * 22.0).abs() < 1e-9, "{}", c.excess);
        assert!((c.excess_at.unwrap().1 - 1.0).abs() < 1e-12);
        // 10 % less growth brings the tall block inside again
        assert_eq!(compare(&map, &target, |h| 0.9 * h).excess, 0.0);
    }

    fn part(mesh: Mesh) -> Part {
        Part {
            name: String::new(),
            volume: mesh.volume(),
            mesh,
            loose_edges: 0,
            findings: Vec::new(),
        }
    }

    /// Shells buried within the part are nothing beside it: lack and excess are shares of what all shells cover.
    #[test]
    fn buried_shells_change_no_share() {
        let dir = tempfile::tempdir().unwrap();
        let map = HeightMap::new(DVec2::splat(-5.0), DVec2::new(65.0, 15.0), 0.5, 0.0).unwrap();
        let volume = |mesh: &Mesh| {
            let path = dir.path().join("part.stl");
            let mut bytes = Vec::new();
            meltpath_geometry::io::stl::write_stl(mesh, "part", &mut bytes).unwrap();
            std::fs::write(&path, bytes).unwrap();
            let unit = crate::job::PartUnit::Millimetre;
            let read = crate::stages::part::load;
            let part = read(&path, unit, DVec3::Z, 0.02, &Reporter::new(), &Silent).unwrap();
            let target = Target::new(&part, EVEN, &map, &Reporter::new(), &Silent).unwrap();
            target.volume
        };
        let shell = |buried: f64| {
            let high = DVec3::new(60.0, 10.0, 20.0);
            let by = DVec3::splat(buried);
            meltpath_geometry::shapes::cuboid(by, high - by)
        };
        let mut five = shell(0.0);
        for k in 1..5 {
            five.add(&shell(0.02 * f64::from(k)));
        }
        let [one, five] = [shell(0.0), five].map(|mesh| volume(&mesh));
        assert!((one - 12_000.0).abs() < 1.0, "{one}");
        assert!((five - one).abs() < 0.01 * one, "{five}");
        // what triangles of an open surface sum up to hangs on where it lies; its sections do not
        let mut open = shell(0.0);
        let lid = |t: &[u32; 3], mesh: &Mesh| t.iter().all(|v| mesh.vertices[*v as usize].z > 19.0);
        let whole = open.clone();
        open.triangles.retain(|t| !lid(t, &whole));
        assert!((volume(&open) - one).abs() < 1e-6 * one);
    }

    /// Half of what has metal stands higher; the bare plate beside it does not count.
    #[test]
    fn metal_stands_round_a_well() {
        let (mut map, _) = block(14.0);
        let well = DVec2::new(2.0, 10.0);
        let (ix, iy) = map.cell_at(well).unwrap();
        let cell = map.index(ix, iy);
        map.z[cell] = 9.0;
        assert_eq!(metal_round(&map, well, 6.0), Some(14.0));
        assert_eq!(metal_round(&map, DVec2::splat(-9.0), 2.0), None);
    }

    #[test]
    fn the_target_of_a_mesh_has_its_volume() {
        let mesh = part(meltpath_geometry::shapes::cone(20.0, 10.0, 12.0));
        let map = HeightMap::new(DVec2::splat(-25.0), DVec2::splat(25.0), 0.25, 0.0).unwrap();
        let target = Target::new(&mesh, EVEN, &map, &Reporter::new(), &Silent).unwrap();
        let volume = |mask: fn(&Level) -> &Mask| -> f64 {
            target
                .levels
                .iter()
                .map(|l| mask(l).count() as f64 * 0.0625 * (l.top - l.bottom))
                .sum()
        };
        let part = volume(|l| &l.part);
        assert!(
            (part - target.volume).abs() < 2e-3 * target.volume,
            "{part} {}",
            target.volume
        );
        // bounds of the envelope: the cone grown by a cylinder lies between the ball offset and the box
        let envelope = volume(|l| &l.envelope);
        let exact_side =
            std::f64::consts::PI / 3.0 * 12.0 * (22.0 * 22.0 + 22.0 * 12.0 + 12.0 * 12.0);
        assert!(
            envelope > exact_side && envelope < 1.35 * exact_side,
            "{envelope} {exact_side}"
        );
        // nothing built: everything lacks
        let c = compare(&map, &target, |h| h);
        assert!((c.lack - part).abs() < 1e-6 * part && c.excess == 0.0);
    }

    /// What lies beyond the map lacks all the same: where no bead came there is no metal.
    #[test]
    fn a_part_beyond_the_map_lacks_all_that_is_not_on_it() {
        let mesh = part(meltpath_geometry::shapes::cone(20.0, 10.0, 12.0));
        for high in [0.0, 10.0, -21.0] {
            let map =
                HeightMap::new(DVec2::splat(-25.0), DVec2::new(high, 25.0), 0.25, 0.0).unwrap();
            let target = Target::new(&mesh, EVEN, &map, &Reporter::new(), &Silent).unwrap();
            let c = compare(&map, &target, |h| h);
            assert!(
                (c.lack - target.volume).abs() < 5e-3 * target.volume,
                "{} {}",
                c.lack,
                target.volume
            );
            let beyond = target.beyond.unwrap();
            assert!(beyond.at.x > 19.0, "{beyond:?}");
        }
    }

    #[test]
    fn points_cover_faces_and_leave_out_the_base() {
        let mesh = Mesh {
            vertices: vec![
                DVec3::ZERO,
                DVec3::X * 10.0,
                DVec3::Y * 10.0,
                DVec3::Z * 10.0,
            ],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        };
        let points = machined(points(&mesh, 1.0), 1.0);
        assert!(points.len() > 100);
        assert!(
            points
                .iter()
                .all(|p| p.normal.z > -0.1 && p.position.z > 1.0)
        );
    }

    #[test]
    fn the_top_of_a_layer_by_percentiles() {
        let (map, _) = block(11.5);
        let grid = Grid {
            origin: map.origin,
            cell: map.cell,
            nx: map.nx,
            ny: map.ny,
        };
        let mut z = map.z.clone();
        z[map.index(40, 40)] = 14.0;
        let top = layer_top(&map, &z, &rasterise(&rectangle(0.0, 20.0), &grid)).unwrap();
        assert_eq!(top.spread, 0.0);
        assert_eq!(top.highest.0, 14.0);
        assert!((top.mean - 11.5).abs() < 0.01);
    }
}
