//! Slicing of triangle meshes by parallel planes in any direction.
//!
//! Contract. Heights are measured along the plan's normal. A vertex at or above a plane counts as above it,
//! a vertex below it as below: none is ever "on" it. A triangle is cut when it has vertices on both sides, and
//! then exactly two of its edges are. The section at h is therefore the limit of sections from below: a facet
//! that lies in the plane adds nothing by itself, a plane through the very top gives the top's section, a plane
//! through the very bottom gives nothing. On a closed, consistently oriented mesh every loop closes, whatever
//! lies on the planes.
//!
//! Each edge is cut once, by the same formula from both of its triangles, and loops are chained by edges, not
//! by coordinates. Contours have the solid on their left seen against the normal: outer rings counter-clockwise,
//! holes clockwise; regions follow the non-zero rule, so that overlapping solids give their union.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use meltpath_base::{Cancelled, Observer, Place, Reporter};

use super::{
    chain::{Chainer, Gap, Segment, join},
    nesting::nest,
    simplify::simplify,
};
use crate::{
    Mesh, Plane,
    boolean::PlanarError,
    math::{DVec2, DVec3},
    region::Region,
};

/// Cuts (triangle, plane) listed at a time: bounds the working memory at 256 MB.
const CUTS_AT_ONCE: u64 = 1 << 26;

/// Places named in one warning.
const NAMED_PLACES: usize = 5;

/// Where and how to slice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SlicePlan {
    /// The plane of height 0; heights go along its normal, contours have its axes.
    pub base: Plane,
    /// Heights of the planes, mm, strictly increasing.
    pub heights: Vec<f64>,
    /// Contour points this near to the straight line between their neighbours are merged, mm; with 0 only those inside flat faces.
    pub collinear: f64,
    /// Open contours (holes of the mesh) are closed over gaps up to this, mm, and told.
    pub join: f64,
}

impl SlicePlan {
    /// Planes at `heights` over `base`, collinear points merged within 1e-6 mm, gaps up to 0.1 mm closed.
    pub fn new(base: Plane, heights: Vec<f64>) -> Self {
        SlicePlan {
            base,
            heights,
            collinear: 1e-6,
            join: 0.1,
        }
    }
}

/// The section of a shape by one surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Slice {
    /// The plane; contours are in its local coordinates.
    pub surface: Plane,
    /// Height over the plan's base plane, mm.
    pub height: f64,
    /// What is solid there.
    pub regions: Vec<Region>,
}

impl Slice {
    /// Solid area, mm².
    pub fn area(&self) -> f64 {
        self.regions.iter().map(Region::area).sum()
    }
}

/// Why a mesh could not be sliced.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SliceError {
    /// The stage was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Heights are not finite and strictly increasing.
    #[error(
        "slice height {index} (counted from 1) is {height} mm: heights must be finite and increase"
    )]
    Heights {
        /// Which height, counted from 1.
        index: usize,
        /// Its value, mm.
        height: f64,
    },
    /// The plane's axes are not two perpendicular unit vectors.
    #[error("the slicing plane's normal and x axis are not perpendicular unit vectors")]
    Frame,
    /// A tolerance is negative or not a number.
    #[error("the slicing tolerance `{name}` is {value} mm: it must be zero or more")]
    Tolerance {
        /// Which one.
        name: &'static str,
        /// Its value, mm.
        value: f64,
    },
    /// A vertex is not a finite point.
    #[error("vertex {vertex} of the mesh is not a finite point: repair or export the part again")]
    Vertex {
        /// Vertex, counted from 0.
        vertex: usize,
    },
    /// Contours that touch could not be united.
    #[error("slice at {height} mm: the union of its contours failed: {source}")]
    Union {
        /// Height of the slice, mm.
        height: f64,
        /// Why.
        source: PlanarError,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} of the mesh names a vertex that does not exist")]
    Index {
        /// Triangle, counted from 0.
        triangle: usize,
    },
}

/// What went on in one slice besides its regions.
#[derive(Debug, Default)]
struct Notes {
    joined: usize,
    widest: f64,
    joined_at: Option<DVec2>,
    open: Vec<Gap>,
    united: bool,
    absorbed: usize,
}

/// Cuts a mesh by the planes of a plan; one slice per height, in their order, the same bits on any number of
/// threads. See the module's contract for what happens on the planes.
///
/// Warns and goes on: `slice-gap-closed` (gaps of the mesh up to `plan.join`), `slice-contour-open` (wider
/// gaps: the contour is left out, with its place), `slice-contours-united` (contours cross or touch: several
/// solids), `slice-solid-in-solid` (a closed solid inside another).
///
/// # Errors
/// A plan that makes no sense, coordinates that are not finite, triangles without vertices, cancellation.
///
/// ```
/// use meltpath_base::{Reporter, Silent};
/// use meltpath_geometry::{Plane, section::{SlicePlan, slice}, shapes::{extrude, ring}};
/// let part = extrude(&[ring(20.0, 15.0, 64)], 10.0);
/// let plan = SlicePlan::new(Plane::horizontal(0.0), vec![1.0, 5.0, 10.0]);
/// let slices = slice(&part, &plan, &Reporter::new(), &Silent).unwrap();
/// assert_eq!(slices[2].regions[0].holes.len(), 1);
/// assert!((slices[0].area() * 10.0 - part.volume()).abs() < 1e-6);
/// ```
pub fn slice(
    mesh: &Mesh,
    plan: &SlicePlan,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<Slice>, SliceError> {
    check(mesh, plan)?;
    observer.stage("slice", plan.heights.len() as u64);
    let heights = &plan.heights;
    let local: Vec<DVec3> = mesh
        .vertices
        .par_iter()
        .map(|&p| plan.base.to_local(p))
        .collect();
    // the planes that cut each triangle: above its lowest vertex, up to and with its highest
    let spans: Vec<(u32, u32)> = mesh
        .triangles
        .par_iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| local[v as usize].z);
            let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
            let first = heights.partition_point(|&h| h <= lo);
            let past = first + heights[first..].partition_point(|&h| h <= hi);
            (first as u32, past as u32)
        })
        .collect();
    let counts = cuts_per_plane(&spans, heights.len());

    let mut slices = Vec::with_capacity(heights.len());
    let mut notes = Vec::with_capacity(heights.len());
    let mut first = 0;
    while first < heights.len() {
        observer.check()?;
        let mut past = first;
        let mut total = 0;
        while past < heights.len() && (past == first || total + counts[past] <= CUTS_AT_ONCE) {
            total += counts[past];
            past += 1;
        }
        let (starts, cuts) = triangles_per_plane(&spans, &counts, first..past);
        let made: Vec<(Slice, Notes)> = (first..past)
            .into_par_iter()
            .map_init(Chainer::default, |chainer, plane| {
                observer.check()?;
                let range = starts[plane - first]..starts[plane - first + 1];
                let made = one_plane(mesh, &local, plan, heights[plane], &cuts[range], chainer)?;
                observer.advance(1);
                Ok(made)
            })
            .collect::<Result<_, SliceError>>()?;
        for (slice, note) in made {
            slices.push(slice);
            notes.push(note);
        }
        first = past;
    }
    report(&slices, &notes, reporter);
    Ok(slices)
}

fn check(mesh: &Mesh, plan: &SlicePlan) -> Result<(), SliceError> {
    let mut before = f64::NEG_INFINITY;
    for (i, &height) in plan.heights.iter().enumerate() {
        if !height.is_finite() || height <= before {
            return Err(SliceError::Heights {
                index: i + 1,
                height,
            });
        }
        before = height;
    }
    let (n, x) = (plan.base.normal, plan.base.x);
    let sound = n.is_normalized() && x.is_normalized() && n.dot(x).abs() < 1e-6;
    if !(sound && plan.base.origin.is_finite()) {
        return Err(SliceError::Frame);
    }
    for (name, value) in [("collinear", plan.collinear), ("join", plan.join)] {
        if !(value.is_finite() && value >= 0.0) {
            return Err(SliceError::Tolerance { name, value });
        }
    }
    if let Some(vertex) = mesh.vertices.iter().position(|p| !p.is_finite()) {
        return Err(SliceError::Vertex { vertex });
    }
    let count = mesh.vertices.len();
    let bad = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= count);
    if let Some(triangle) = mesh.triangles.iter().position(bad) {
        return Err(SliceError::Index { triangle });
    }
    Ok(())
}

/// How many triangles each plane cuts.
fn cuts_per_plane(spans: &[(u32, u32)], planes: usize) -> Vec<u64> {
    let mut change = vec![0_i64; planes + 1];
    for &(first, past) in spans {
        change[first as usize] += 1;
        change[past as usize] -= 1;
    }
    let mut now = 0;
    change[..planes]
        .iter()
        .map(|c| {
            now += c;
            now.unsigned_abs()
        })
        .collect()
}

/// The triangles cut by each plane of a range, in mesh order: plane k owns `cuts[starts[k]..starts[k + 1]]`.
fn triangles_per_plane(
    spans: &[(u32, u32)],
    counts: &[u64],
    planes: std::ops::Range<usize>,
) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0];
    let mut total = 0;
    for &count in &counts[planes.clone()] {
        total += count as usize;
        starts.push(total);
    }
    let mut cursor = starts.clone();
    let mut cuts = vec![0; total];
    for (triangle, &(first, past)) in spans.iter().enumerate() {
        let first = (first as usize).max(planes.start);
        let past = (past as usize).min(planes.end);
        for plane in first..past {
            let at = &mut cursor[plane - planes.start];
            cuts[*at] = triangle as u32;
            *at += 1;
        }
    }
    (starts, cuts)
}

/// Where the plane at `height` cuts the edge between two vertices on either side of it.
fn cut(local: &[DVec3], edge: u64, height: f64) -> DVec2 {
    let (a, b) = (local[(edge >> 32) as usize], local[edge as u32 as usize]);
    let (below, above) = if a.z < height { (a, b) } else { (b, a) };
    if above.z == height {
        return above.truncate();
    }
    let t = (height - below.z) / (above.z - below.z);
    let (below, above) = (below.truncate(), above.truncate());
    // not the mean of both with weights: an upright edge is cut at the same place, to the bit, at every height
    below + (above - below) * t
}

/// Along the lines in which level planes cut a triangle, the solid on the left; as long as the triangle is large.
fn level_line([a, b, c]: [DVec3; 3]) -> DVec2 {
    let normal = (b - a).cross(c - a);
    DVec2::new(-normal.y, normal.x)
}

/// Slices one plane.
fn one_plane(
    mesh: &Mesh,
    local: &[DVec3],
    plan: &SlicePlan,
    height: f64,
    triangles: &[u32],
    chainer: &mut Chainer,
) -> Result<(Slice, Notes), SliceError> {
    chainer.segments.clear();
    for &t in triangles {
        let v = mesh.triangles[t as usize];
        let above = v.map(|v| local[v as usize].z >= height);
        // seen from outside, the solid's left is where the triangle's boundary comes down
        let (mut from, mut to) = (0, 0);
        for k in 0..3 {
            let next = (k + 1) % 3;
            let edge = (u64::from(v[k].min(v[next])) << 32) | u64::from(v[k].max(v[next]));
            match (above[k], above[next]) {
                (true, false) => from = edge,
                (false, true) => to = edge,
                _ => {}
            }
        }
        chainer.segments.push(Segment {
            from,
            to,
            start: cut(local, from, height),
            along: level_line(v.map(|v| local[v as usize])),
        });
    }
    let (mut loops, open) = chainer.chain();
    let mut notes = Notes::default();
    if !open.is_empty() {
        let chains: Vec<Vec<DVec2>> = open
            .into_iter()
            .map(|mut chain| {
                chain.points.push(cut(local, chain.last_edge, height));
                chain.points
            })
            .collect();
        let joined = join(&chains, plan.join);
        notes.joined = joined.rings.len();
        notes.widest = joined.widest;
        notes.joined_at = joined.place;
        notes.open = joined.open;
        loops.extend(joined.rings);
    }
    for ring in &mut loops {
        simplify(ring, plan.collinear);
    }
    loops.retain(|ring| ring.len() >= 3);
    let nested = nest(&loops).map_err(|source| SliceError::Union { height, source })?;
    notes.united = nested.united;
    notes.absorbed = nested.absorbed;
    let surface = Plane {
        origin: plan.base.origin + plan.base.normal * height,
        ..plan.base
    };
    let slice = Slice {
        surface,
        height,
        regions: nested.regions,
    };
    Ok((slice, notes))
}

/// Tells what happened, once per kind.
fn report(slices: &[Slice], notes: &[Notes], reporter: &Reporter) {
    let place = |k: usize, p: DVec2| Place {
        layer: u32::try_from(k + 1).ok(),
        ..Place::at(slices[k].surface.from_local(p).to_array())
    };
    let with = |wanted: &dyn Fn(&Notes) -> bool| -> Vec<usize> {
        (0..notes.len()).filter(|&k| wanted(&notes[k])).collect()
    };

    let joined = with(&|n| n.joined > 0);
    if let Some(&worst) = joined
        .iter()
        .max_by(|&&a, &&b| notes[a].widest.total_cmp(&notes[b].widest).then(b.cmp(&a)))
    {
        let message = format!(
            "the mesh has cracks: contours were closed over gaps up to {:.4} mm in {} of {} slices",
            notes[worst].widest,
            joined.len(),
            notes.len()
        );
        let at = notes[worst].joined_at.unwrap_or_default();
        reporter.warn_at(
            "slice-gap-closed",
            message,
            place(worst, at),
            "repair the mesh (weld, fill holes)",
        );
    }
    let open = with(&|n| !n.open.is_empty());
    for (told, &k) in open.iter().take(NAMED_PLACES).enumerate() {
        let Some(gap) = notes[k]
            .open
            .iter()
            .copied()
            .reduce(|a, b| if b.width > a.width { b } else { a })
        else {
            continue;
        };
        let rest = if told == 0 {
            let all: usize = notes.iter().map(|n| n.open.len()).sum();
            format!(" ({all} such contours in {} slices)", open.len())
        } else {
            String::new()
        };
        reporter.warn_at(
            "slice-contour-open",
            format!(
                "slice at {:.4} mm: a contour is open over {:.4} mm and was left out{rest}",
                slices[k].height, gap.width
            ),
            place(k, gap.end),
            "repair the mesh (fill holes, orient normals) or export the part as a closed solid",
        );
    }
    let tell = |code: &str, which: &[usize], [what, done]: [&str; 2], remedy: &str| {
        if let Some(&k) = which.first() {
            reporter.push(meltpath_base::Warning {
                code: code.to_owned(),
                message: format!("{what} in {} of {} slices{done}", which.len(), notes.len()),
                place: u32::try_from(k + 1).ok().map(Place::layer),
                remedy: Some(remedy.to_owned()),
            });
        }
    };
    let united = [
        "contours cross or touch",
        " (solids that intersect?): their union was taken",
    ];
    tell(
        "slice-contours-united",
        &with(&|n| n.united),
        united,
        "unite the solids in the part file if this is not meant",
    );
    let absorbed = [
        "a solid lies wholly inside another",
        ": the inner one was ignored",
    ];
    tell(
        "slice-solid-in-solid",
        &with(&|n| n.absorbed > 0),
        absorbed,
        "turn the inner shell's normals if it is meant as a cavity",
    );
}
