//! Outlines of parts typical of wire-arc deposition, as regions of the plane. All lengths mm.

use std::f64::consts::{PI, TAU};

use crate::{
    math::DVec2,
    region::{Region, Ring},
};

/// A point at `radius` and `angle` (rad) around the origin.
fn polar(radius: f64, angle: f64) -> DVec2 {
    radius * DVec2::from_angle(angle)
}

/// A regular polygon with a vertex on the +x axis, counter-clockwise.
pub(super) fn polygon(centre: DVec2, radius: f64, sides: u32) -> Ring {
    let sides = sides.max(3);
    (0..sides)
        .map(|k| centre + polar(radius, TAU * f64::from(k) / f64::from(sides)))
        .collect()
}

/// The ring run the other way.
pub(super) fn reversed(ring: Ring) -> Ring {
    ring.into_iter().rev().collect()
}

/// A ring from coordinate pairs.
fn outline(points: &[[f64; 2]]) -> Region {
    Region {
        outer: points.iter().map(|&p| DVec2::from(p)).collect(),
        holes: Vec::new(),
    }
}

/// A rectangle from the origin to (`length`, `width`).
pub fn plate(length: f64, width: f64) -> Region {
    outline(&[[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]])
}

/// A ring about the origin as two polygons of `segments` sides.
pub fn ring(outer_radius: f64, inner_radius: f64, segments: u32) -> Region {
    Region {
        outer: polygon(DVec2::ZERO, outer_radius, segments),
        holes: vec![reversed(polygon(DVec2::ZERO, inner_radius, segments))],
    }
}

/// A cross about the origin: two bars of `span` by `width`.
pub fn cross(span: f64, width: f64) -> Region {
    let (s, w) = (0.5 * span, 0.5 * width);
    outline(&[
        [w, -w],
        [s, -w],
        [s, w],
        [w, w],
        [w, s],
        [-w, s],
        [-w, w],
        [-s, w],
        [-s, -w],
        [-w, -w],
        [-w, -s],
        [w, -s],
    ])
}

/// A T: a head of `span` by `width` on a stem of the same width; `height` over all.
pub fn tee(span: f64, height: f64, width: f64) -> Region {
    let (s, w) = (0.5 * span, 0.5 * width);
    outline(&[
        [-w, 0.0],
        [w, 0.0],
        [w, height - width],
        [s, height - width],
        [s, height],
        [-s, height],
        [-s, height - width],
        [-w, height - width],
    ])
}

/// An L with legs `length` and `height`, both of `width`.
pub fn ell(length: f64, height: f64, width: f64) -> Region {
    outline(&[
        [0.0, 0.0],
        [length, 0.0],
        [length, width],
        [width, width],
        [width, height],
        [0.0, height],
    ])
}

/// A star about the origin with `points` tips at `outer_radius` and roots at `inner_radius`.
pub fn star(points: u32, outer_radius: f64, inner_radius: f64) -> Region {
    let points = points.max(2);
    let ring = (0..2 * points).map(|k| {
        let radius = if k % 2 == 0 {
            outer_radius
        } else {
            inner_radius
        };
        polar(radius, PI * f64::from(k) / f64::from(points))
    });
    Region {
        outer: ring.collect(),
        holes: Vec::new(),
    }
}

/// A gear-like wheel: `teeth` trapezoidal teeth between `root_radius` and `tip_radius`, with a round bore.
pub fn gear(teeth: u32, root_radius: f64, tip_radius: f64, bore_radius: f64) -> Region {
    let teeth = teeth.max(3);
    let pitch = TAU / f64::from(teeth);
    let outer = (0..teeth).flat_map(|k| {
        let start = pitch * f64::from(k);
        [
            polar(root_radius, start),
            polar(root_radius, start + 0.40 * pitch),
            polar(tip_radius, start + 0.55 * pitch),
            polar(tip_radius, start + 0.85 * pitch),
        ]
    });
    Region {
        outer: outer.collect(),
        holes: vec![reversed(polygon(DVec2::ZERO, bore_radius, 96))],
    }
}

/// A honeycomb panel: `columns` by `rows` hexagonal cells of inscribed diameter `cell` between walls of
/// `wall`, in a rectangular frame at least one wall thick.
pub fn honeycomb(columns: u32, rows: u32, cell: f64, wall: f64) -> Region {
    let (columns, rows) = (columns.max(1), rows.max(1));
    let pitch = cell + wall;
    let rise = pitch * 0.75_f64.sqrt();
    let circumradius = cell / 3.0_f64.sqrt();
    let mut holes = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let shift = if row % 2 == 0 { 0.5 } else { 1.0 };
            let centre = DVec2::new(
                wall + pitch * (f64::from(column) + shift),
                wall + circumradius + rise * f64::from(row),
            );
            // a vertex upwards: flat sides face the neighbours of the row
            holes.push(
                (0..6)
                    .rev()
                    .map(|k| centre + polar(circumradius, TAU * (f64::from(k) + 0.5) / 6.0))
                    .collect(),
            );
        }
    }
    let width = pitch * (f64::from(columns) + if rows > 1 { 0.5 } else { 0.0 }) + 2.0 * wall;
    let height = rise * f64::from(rows - 1) + 2.0 * circumradius + 2.0 * wall;
    Region {
        holes,
        ..plate(width, height)
    }
}

/// A spiral wall: Archimedes' spiral of `turns` turns from `inner_radius`, `pitch` between turns, `wall` thick
/// (less than the pitch), with square ends.
pub fn spiral(inner_radius: f64, pitch: f64, wall: f64, turns: f64) -> Region {
    let steps = (turns.abs() * 120.0).ceil().max(2.0) as u32;
    let side = |k: u32, offset: f64| {
        let angle = TAU * turns * f64::from(k) / f64::from(steps);
        polar(inner_radius + pitch * angle / TAU + offset, angle)
    };
    let outside = (0..=steps).map(|k| side(k, 0.5 * wall));
    let inside = (0..=steps).rev().map(|k| side(k, -0.5 * wall));
    Region {
        outer: outside.chain(inside).collect(),
        holes: Vec::new(),
    }
}

/// A truss beam: a frame of `height` with `bays` square bays, each braced by one diagonal; members `member` wide.
pub fn truss(bays: u32, height: f64, member: f64) -> Region {
    let bays = bays.max(1);
    let clear = height - 2.0 * member;
    let bay = clear + member;
    // a diagonal of width m, cut by the bay's corner, takes m·√2 off each leg of the two triangles
    let leg = clear - member * 0.5_f64.sqrt();
    let mut holes = Vec::new();
    for k in 0..bays {
        let (x0, y0) = (member + bay * f64::from(k), member);
        let (x1, y1) = (x0 + clear, y0 + clear);
        let corners = if k % 2 == 0 {
            [
                [[x0, y1], [x0 + leg, y1], [x0, y1 - leg]],
                [[x1, y0], [x1 - leg, y0], [x1, y0 + leg]],
            ]
        } else {
            [
                [[x0, y0], [x0, y0 + leg], [x0 + leg, y0]],
                [[x1, y1], [x1, y1 - leg], [x1 - leg, y1]],
            ]
        };
        holes.extend(corners.map(|c| c.map(DVec2::from).to_vec()));
    }
    Region {
        holes,
        ..plate(2.0 * member + bay * f64::from(bays) - member, height)
    }
}

/// `columns` by `rows` separate islands, alternately squares of `size` and rings, `gap` apart.
pub fn islands(columns: u32, rows: u32, size: f64, gap: f64) -> Vec<Region> {
    let mut all = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let corner = (size + gap) * DVec2::new(f64::from(column), f64::from(row));
            let centre = corner + DVec2::splat(0.5 * size);
            all.push(if (row + column) % 2 == 0 {
                let mut square = plate(size, size);
                square.outer.iter_mut().for_each(|p| *p += corner);
                square
            } else {
                Region {
                    outer: polygon(centre, 0.5 * size, 48),
                    holes: vec![reversed(polygon(centre, 0.25 * size, 48))],
                }
            });
        }
    }
    all
}

/// A star-shaped polygon about the origin with random radii between the two bounds: the same for the same
/// `seed` on every machine.
pub fn random_star(seed: u64, points: u32, inner_radius: f64, outer_radius: f64) -> Region {
    let points = points.max(3);
    let mut state = seed;
    let mut uniform = || {
        // splitmix64 (Steele, Lea & Flood 2014)
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let outer = (0..points).map(|k| {
        let angle = TAU * (f64::from(k) + 0.8 * (uniform() - 0.5)) / f64::from(points);
        polar(
            inner_radius + (outer_radius - inner_radius) * uniform(),
            angle,
        )
    });
    Region {
        outer: outer.collect(),
        holes: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares and rings in turn, each `size` wide, `gap` from the next.
    #[test]
    fn islands_lie_a_gap_apart() {
        let all = islands(3, 2, 10.0, 4.0);
        assert_eq!(all.len(), 6);
        for (i, island) in all.iter().enumerate() {
            let (column, row) = (i % 3, i / 3);
            let corner = 14.0 * DVec2::new(column as f64, row as f64);
            let low = island.outer.iter().copied().reduce(DVec2::min).unwrap();
            let high = island.outer.iter().copied().reduce(DVec2::max).unwrap();
            assert!((low - corner).length() < 1e-9, "{i}: {low}");
            assert!((high - low - 10.0).length() < 1e-9, "{i}: {high}");
            assert_eq!(island.holes.len(), (column + row) % 2);
        }
    }
}
