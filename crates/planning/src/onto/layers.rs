//! The surfaces through the middles of layers on a body, as far as the part reaches: at distances from the body, or level sets between it
//! and the top.

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::level::{Sampled, piece, rims};
use meltpath_geometry::math::DVec3;
use rayon::prelude::*;

use super::error::OntoError;
use super::field::{Field, Top};
use super::settings::OntoSettings;
use super::shape::Shape;
use super::top::known;

/// Cells of the grid on which layers are found, along a stepover.
const CELLS: f64 = 3.0;
/// Steps of the way from the body to the top in which its rate of growth is looked at.
const LOOKS: usize = 8;
/// How far outside of what is built a point may be told to be, cells.
const FAR: f64 = 4.0;
/// Places across the allowance at which the part is looked for on the level of a point beside it.
const ASIDE: u32 = 4;
/// Most layers between a body and a top.
const MOST_LAYERS: f64 = 16_383.0;

/// A layer through its middle.
pub(super) struct Middle {
    pub(super) sheet: Mesh,
    /// The levels of its bottom and its top.
    pub(super) levels: [f64; 2],
    /// How far its top is from the body, in the mean, mm.
    pub(super) top: f64,
}

/// A part and its body, with the field about what grows.
pub(super) struct Growing<'a> {
    pub(super) field: Field,
    part: Shape,
    /// The height that layers are to have, mm.
    height: f64,
    /// How far the top is from the body, least and greatest, mm.
    apart: [f64; 2],
    /// How far the whole way would be at the rate of growth in even steps of it, mm.
    way: Vec<f64>,
    /// What grows, as it lies half of the least layer over the body.
    foot: Distance,
    level: f64,
    sampled: Sampled,
    settings: OntoSettings<'a>,
}

impl<'a> Growing<'a> {
    /// Finds where the part reaches out of the body by more than half of `height`, the height of its first layer, mm.
    pub(super) fn new(
        part: &Mesh,
        body: &[&Mesh],
        height: f64,
        settings: OntoSettings<'a>,
    ) -> Result<Self, OntoError> {
        let (low, high) = part.bounds().unwrap_or_default();
        let (whole, part, body) = (part, Shape::new([part]), Shape::new(body.iter().copied()));
        touching(whole, &body, height)?;
        let cell = (settings.fill.stepover / CELLS).min(height);
        let room = settings.side.max(settings.over).max(0.0) + 2.0 * cell + height;
        let from_body = |p: DVec3| body.distance(p);
        let around = (low - DVec3::splat(room), high + DVec3::splat(room));
        let mut sampled =
            Sampled::new(around, cell, from_body).map_err(|why| OntoError::of_grid(why, whole))?;
        // most of a body is not grown on: there the part is as far as the body
        let grows = |p: DVec3, d: f64| {
            d > 0.25 * height && {
                let beyond = part.distance(p);
                beyond < cell && d - beyond > 0.4 * height
            }
        };
        sampled.keep(grows, room);
        let level = 0.5 * height;
        let foot = piece(&sampled.surface(level, from_body), |p| part.distance(p));
        if foot.triangles.is_empty() {
            let reach = whole
                .vertices
                .iter()
                .map(|p| body.distance(*p))
                .fold(0.0, f64::max);
            return Err(OntoError::Nothing { reach, height });
        }
        let (mut top, mut apart) = (None, [0.0; 2]);
        if let Some(to) = &settings.top {
            let sizes = (settings.fill.stepover, level, settings.over.max(0.0));
            let found = known(whole, &body, to.sheet, sizes)?;
            apart = found.apart;
            sampled = sampled.map(|p, d| found.top.share(p, d));
            top = Some(found.top);
        }
        let mut growing = Growing {
            foot: Distance::new(&foot),
            field: Field { body, top },
            part,
            height,
            apart,
            way: Vec::new(),
            level,
            sampled,
            settings,
        };
        if let Some(top) = &growing.field.top {
            let sheets = growing.cut(top, &even(LOOKS));
            growing.way = sheets.iter().map(|s| growing.whole(top, s)).collect();
        }
        Ok(growing)
    }

    /// The layers from the body on. Those at a distance from it are as high as `heights` says, the last one repeats.
    /// Layers to the top are as many as beads can lay that grow to `heights`.
    pub(super) fn middles(&self, heights: &[f64]) -> Vec<Middle> {
        match (&self.field.top, &self.settings.top) {
            (Some(top), Some(to)) => {
                let able = to.able_of(heights);
                self.to_top(top, layer_count(self.apart, self.height, able))
            }
            _ => self.at_distance(heights),
        }
    }

    /// Layers between body and top. All have the same thickness in the mean: shares that even steps would make thicker are cut shorter.
    fn to_top(&self, top: &Top, count: u32) -> Vec<Middle> {
        let shares = evened(&self.way, count as usize);
        let mut far = 0.0;
        let mut middles = Vec::new();
        for (ends, sheet) in shares.windows(2).zip(self.cut(top, &shares)) {
            if sheet.triangles.is_empty() {
                break;
            }
            far += (ends[1] - ends[0]) * self.whole(top, &sheet);
            middles.push(Middle {
                levels: [ends[0], ends[1]],
                top: far,
                sheet,
            });
        }
        middles.truncate(self.settings.count.map_or(usize::MAX, |n| n as usize));
        middles
    }

    /// The level sets in the middle between each two shares.
    fn cut(&self, top: &Top, shares: &[f64]) -> Vec<Mesh> {
        let share = |p: DVec3| top.share(p, self.field.body.distance(p));
        let cut = |ends: &[f64]| {
            let whole = self.sampled.surface(0.5 * (ends[0] + ends[1]), share);
            piece(&whole, |p| self.outside(p))
        };
        shares.par_windows(2).map(cut).collect()
    }

    /// How far the whole way would be at the rate of growth on a level set, mean over its area, mm.
    fn whole(&self, top: &Top, sheet: &Mesh) -> f64 {
        let (mut area, mut sum) = (0.0, 0.0);
        for t in 0..sheet.triangles.len() {
            let [a, b, c] = sheet.corners(t);
            let own = 0.5 * (b - a).cross(c - a).length();
            if let Some(at) = top.between(&self.field.body, (a + b + c) / 3.0) {
                area += own;
                sum += own * at.whole;
            }
        }
        if area > 0.0 { sum / area } else { 0.0 }
    }

    /// Layers at distances from the body.
    fn at_distance(&self, heights: &[f64]) -> Vec<Middle> {
        let mut middles = Vec::new();
        let mut bottom = 0.0;
        let all = heights
            .iter()
            .chain(std::iter::repeat(heights.last().unwrap_or(&0.0)));
        for height in all.take(self.settings.count.map_or(usize::MAX, |n| n as usize)) {
            let middle = bottom + 0.5 * height;
            if *height <= 0.0 || middle > self.sampled.greatest() {
                break;
            }
            let from_body = |p| self.field.body.distance(p);
            let whole = self.sampled.surface(middle, from_body);
            let sheet = piece(&whole, |p| self.outside(p));
            if sheet.triangles.is_empty() {
                break;
            }
            let top = bottom + height;
            middles.push(Middle {
                sheet,
                levels: [bottom, top],
                top,
            });
            bottom = top;
        }
        middles
    }

    /// What layers fill of which the last one lies between these levels, as a closed mesh that begins a cell within the body.
    pub(super) fn built(&self, [bottom, end]: [f64; 2]) -> Result<Mesh, OntoError> {
        let cell = self.sampled.cell();
        let beyond = |p: DVec3| {
            let Some(foot) = self.field.body.near.foot(p) else {
                return f64::INFINITY;
            };
            let from_body = foot.distance;
            let (over, at) = if let Some(top) = &self.field.top {
                let [_, apart] = top.apart(p, from_body);
                (from_body - end * apart, p)
            } else {
                // a layer is as wide as in its middle
                let within = from_body.min(0.5 * (bottom + end));
                (from_body - end, foot.point + within * foot.outward)
            };
            // far off nothing is known of how far
            let far = self.outside(at).min(FAR * cell);
            far.max(over).max(-cell - from_body)
        };
        let mesh = self.sampled.map(|p, _| beyond(p)).surface(0.0, beyond);
        if mesh.triangles.is_empty() || !rims(&mesh).is_empty() {
            return Err(OntoError::Open);
        }
        Ok(mesh)
    }

    /// How far a point lies outside of what is laid, mm: the part, raised by what is to lie over it, with its allowance.
    fn outside(&self, p: DVec3) -> f64 {
        let OntoSettings { side, over, .. } = self.settings;
        let Some(foot) = self.field.body.near.foot(p) else {
            return f64::INFINITY;
        };
        let lowered = match &self.field.top {
            // what lies over the top is that of all layers
            Some(top) => match top.apart(p, foot.distance) {
                [part, raised] if part > 0.0 => foot.distance * part / raised,
                _ => return f64::INFINITY,
            },
            None => foot.distance - over,
        };
        let lowered = lowered.max(self.level.min(foot.distance));
        let at = foot.point + lowered * foot.outward;
        let Some(part) = self.part.near.foot(at) else {
            return f64::INFINITY;
        };
        if side <= 0.0 {
            return part.distance;
        }
        // aside, not over what faces away from the body
        let aside = 1.0 - part.outward.dot(foot.outward).powi(2);
        let beyond = part.distance - side * aside.max(0.0).sqrt();
        // metal beyond the part is laid around what grows, not all over the body that the part leaves as it is: beside a place of the part
        // that is out of the body, and around where it comes out
        let below = self.foot.foot(foot.point + self.level * foot.outward);
        let beside = below.map_or(f64::INFINITY, |b| b.distance.abs());
        let covered = self.level - self.field.body.distance(part.point);
        let beyond = beyond.max(covered.min(beside - side));
        if beyond > 0.0 || part.distance <= 0.0 {
            return beyond;
        }
        // and beside the part on the same level: above its last edge there is nothing to lie beside
        let way = part.outward.reject_from_normalized(foot.outward);
        let inwards = -side * way.normalize_or_zero();
        let within = |n: u32| {
            self.part
                .distance(at + f64::from(n) / f64::from(ASIDE) * inwards)
        };
        let level = (1..=ASIDE).map(within).fold(f64::INFINITY, f64::min);
        beyond.max(level)
    }
}

/// Whether a part begins on a body, to within half a layer of `height` mm, or reaches into it.
pub fn touches(part: &Mesh, body: &Mesh, height: f64) -> bool {
    touching(part, &Shape::new([body]), height).is_ok()
}

/// Whether the part begins on the body, to within half a layer.
fn touching(part: &Mesh, body: &Shape, height: f64) -> Result<(), OntoError> {
    let near = 0.5 * height;
    let told = |p: DVec3| (body.distance(p), p);
    let vertices = part.vertices.iter().map(|&p| told(p));
    let nearest = vertices.min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((gap, at)) = nearest.filter(|(gap, _)| *gap > near) else {
        return Ok(());
    };
    // a part that passes through a body may have no corner near it
    let touches = |t: usize| {
        let corners = part.corners(t);
        (0..3).any(|n| {
            let (a, b) = (corners[n], corners[(n + 1) % 3]);
            let (length, mut along) = (a.distance(b), 0.0);
            while along < length {
                let (far, _) = told(a + along / length * (b - a));
                if far <= near {
                    return true;
                }
                // nothing of the body is nearer than that
                along += far;
            }
            false
        })
    };
    if (0..part.triangles.len()).any(touches) {
        return Ok(());
    }
    Err(OntoError::Apart { gap, at })
}

/// How many layers between body and top, which are so far from each other at the nearest and the farthest place, mm: what keeps both within
/// the thicknesses that can be laid, mm, and of those what comes nearest to layers `height` mm high.
fn layer_count([least, greatest]: [f64; 2], height: f64, [thinnest, thickest]: [f64; 2]) -> u32 {
    let usual = (least * greatest).sqrt() / height;
    let beyond = |n: f64| {
        let [thin, thick] = [least / n, greatest / n];
        (thick / thickest).max(thinnest / thin).max(1.0)
    };
    let most = (2.0 * greatest / height).ceil().clamp(1.0, MOST_LAYERS) as u32;
    let better = |a: &u32, b: &u32| {
        let [a, b] = [f64::from(*a), f64::from(*b)];
        let far = |n: f64| (n / usual).ln().abs();
        beyond(a)
            .total_cmp(&beyond(b))
            .then(far(a).total_cmp(&far(b)))
    };
    (1..=most).min_by(better).unwrap_or(1)
}

/// The ends of even steps from 0 to 1.
fn even(count: usize) -> Vec<f64> {
    (0..=count).map(|k| k as f64 / count as f64).collect()
}

/// Shares between which layers have the same thickness in the mean, where the whole way is as far as `thick` says over even steps.
fn evened(thick: &[f64], count: usize) -> Vec<f64> {
    let total: f64 = thick.iter().sum();
    let mut shares = vec![0.0];
    let (mut step, mut below) = (0, 0.0);
    for k in 1..count {
        let wanted = total * k as f64 / count as f64;
        while step + 1 < thick.len() && below + thick[step] < wanted {
            below += thick[step];
            step += 1;
        }
        let own = thick.get(step).copied().unwrap_or(0.0);
        let within = if own > 0.0 {
            (wanted - below) / own
        } else {
            0.0
        };
        shares.push((step as f64 + within) / thick.len().max(1) as f64);
    }
    shares.push(1.0);
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Thinnest and thickest layer that can be laid, mm.
    const ABLE: [f64; 2] = [1.0, 4.0];

    #[test]
    fn as_many_layers_as_keep_both_ends_within_what_can_be_laid() {
        // layers of 2 mm in the geometric mean
        assert_eq!(layer_count([8.0, 8.0], 2.0, ABLE), 4);
        assert_eq!(layer_count([8.0, 18.0], 2.0, ABLE), 6);
        // 1 to 4 mm can be laid: five layers of 4.8 mm could not
        assert_eq!(layer_count([6.0, 24.0], 2.0, ABLE), 6);
        // of heights that are asked for what can be laid comes first
        assert_eq!(layer_count([8.0, 8.0], 0.5, ABLE), 8);
        // beyond any number, as much too thin as too thick
        assert_eq!(layer_count([3.0, 48.0], 2.0, ABLE), 6);
        assert_eq!(layer_count([0.1, 0.2], 2.0, ABLE), 1);
    }

    #[test]
    fn shares_are_cut_where_layers_have_one_thickness() {
        assert_eq!(evened(&[3.0, 3.0], 2), [0.0, 0.5, 1.0]);
        // 4, 2, 2 mm of the way, of which each layer gets 8/3
        let shares = evened(&[4.0, 2.0, 2.0], 3);
        assert!((shares[1] * 3.0 * 4.0 - 8.0 / 3.0).abs() < 1e-12);
        assert!(
            (shares[2] - (1.0 + 2.0 / 3.0) / 3.0).abs() < 1e-12,
            "{shares:?}"
        );
        assert_eq!(evened(&[5.0], 1), [0.0, 1.0]);
        assert_eq!(evened(&[3.0, 3.0, 3.0], 2), [0.0, 0.5, 1.0]);
    }
}
