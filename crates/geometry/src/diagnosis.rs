//! What is wrong with a mesh: counts and places of each kind of defect.

mod intersect;
mod measure;
mod nesting;

use std::fmt;
use std::ops::ControlFlow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use meltpath_base::{Cancelled, Observer, Place, Reporter};

use crate::{
    Mesh,
    bvh::Bvh,
    math::DVec3,
    topology::{HalfEdge, NO_SHELL, Shells, edges, half_edges, is_degenerate, rims, shells},
};
pub(crate) use measure::{majorities, measure};
pub(crate) use nesting::parents;

/// Places kept per kind of defect.
pub const PLACES: usize = 16;

/// Leaves of the hierarchy looked at between two reports of progress.
const LEAVES_AT_ONCE: usize = 4096;

/// Loose edges among which T-junctions are sought.
const LOOSE_EDGES: usize = 50_000;

/// Kinds of defects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Defect {
    /// Vertices that are not finite points; nothing else is looked at when there are any.
    NotFinite,
    /// Triangles that name a vertex twice.
    Degenerate,
    /// Triangles with three vertices and no area.
    ZeroArea,
    /// Triangles that repeat another one (in either sense).
    Duplicate,
    /// Edges with one triangle only.
    LooseEdge,
    /// Loops of loose edges.
    Hole,
    /// Edges with more than two triangles.
    NonManifoldEdge,
    /// Triangles that run against most of their shell.
    ReversedTriangle,
    /// Edges around which no consistent sense exists.
    OneSided,
    /// Closed shells with their inside out (and not cavities of a shell around them).
    InsideOutShell,
    /// Shells that are tiny against the part.
    StrayShell,
    /// Pairs of triangles that pass through each other or overlap.
    Intersection,
    /// Vertices that lie within a loose edge.
    TJunction,
}

impl Defect {
    /// What it is, in the plural, for messages.
    fn describe(self) -> &'static str {
        match self {
            Defect::NotFinite => "vertices that are not finite points",
            Defect::Degenerate => "triangles that name a vertex twice",
            Defect::ZeroArea => "triangles without area",
            Defect::Duplicate => "duplicate triangles",
            Defect::LooseEdge => "loose edges (one triangle only)",
            Defect::Hole => "holes (loops of loose edges)",
            Defect::NonManifoldEdge => "edges with more than two triangles",
            Defect::ReversedTriangle => "triangles with reversed normals",
            Defect::OneSided => "edges of a one-sided surface",
            Defect::InsideOutShell => "shells with their inside out",
            Defect::StrayShell => "stray shells, tiny against the part",
            Defect::Intersection => "pairs of intersecting triangles",
            Defect::TJunction => "vertices within a loose edge (T-junctions)",
        }
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.describe())
    }
}

/// One kind of defect: how many and where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What.
    pub defect: Defect,
    /// How many.
    pub count: u64,
    /// Where the first of them are, mm; at most [`PLACES`].
    pub places: Vec<DVec3>,
}

/// A connected piece of surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shell {
    /// Its triangles.
    pub triangles: u64,
    /// Area, mm².
    pub area: f64,
    /// Signed volume once its triangles agree with their majority, mm³; meaningful when closed.
    pub volume: f64,
    /// Whether it has no loose edge.
    pub closed: bool,
    /// Lower corner of its bounds, mm.
    pub lo: DVec3,
    /// Upper corner of its bounds, mm.
    pub hi: DVec3,
    /// The smallest closed shell around it.
    pub inside: Option<u32>,
}

/// What was looked for, and the limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisOptions {
    /// Shells whose bounds' diagonal is below this fraction of the part's are stray.
    pub stray: f64,
    /// A vertex this near to a loose edge lies on it, mm.
    pub t_junction: f64,
    /// Whether intersections are looked for (the longest part of the work).
    pub intersections: Intersections,
}

/// Whether intersecting triangles are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Intersections {
    /// Yes.
    Find,
    /// No.
    Skip,
}

impl Default for DiagnosisOptions {
    fn default() -> Self {
        DiagnosisOptions {
            stray: 0.01,
            t_junction: 1e-3,
            intersections: Intersections::Find,
        }
    }
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Number of vertices.
    pub vertices: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Area, mm².
    pub area: f64,
    /// Signed volume as the triangles stand, mm³.
    pub volume: f64,
    /// Connected pieces, numbered by their first triangle.
    pub shells: Vec<Shell>,
    /// Defects, in the order of [`Defect`]; none with a count of zero.
    pub findings: Vec<Finding>,
    /// Places where too many triangles meet for all their pairs to be compared: intersections there may be more than were found.
    pub crowded: u64,
}

impl Diagnosis {
    /// How many defects of a kind there are.
    pub fn count(&self, defect: Defect) -> u64 {
        let finding = self.findings.iter().find(|f| f.defect == defect);
        finding.map_or(0, |f| f.count)
    }

    /// Whether the mesh is one or more closed, consistently outward solids that do not intersect. Triangles
    /// without area and stray shells do no harm.
    pub fn is_sound(&self) -> bool {
        self.findings
            .iter()
            .all(|f| matches!(f.defect, Defect::ZeroArea | Defect::StrayShell))
    }

    /// One warning per kind of defect (`mesh-` and its name), with the first place.
    pub fn warn(&self, reporter: &Reporter) {
        for finding in &self.findings {
            let (code, remedy) = match finding.defect {
                Defect::NotFinite => ("mesh-not-finite", "export the part again"),
                Defect::Degenerate => ("mesh-degenerate", ""),
                Defect::ZeroArea => ("mesh-zero-area", ""),
                Defect::Duplicate => ("mesh-duplicate", "repair drops them"),
                Defect::LooseEdge => ("mesh-loose-edge", "repair welds near edges"),
                Defect::Hole => ("mesh-hole", "repair fills small ones"),
                Defect::NonManifoldEdge => (
                    "mesh-non-manifold",
                    "unite solids that share faces or edges in the part file",
                ),
                Defect::ReversedTriangle => ("mesh-reversed", "repair turns them"),
                Defect::OneSided => ("mesh-one-sided", "export the part as a solid"),
                Defect::InsideOutShell => ("mesh-inside-out", "repair turns them"),
                Defect::StrayShell => ("mesh-stray-shell", "repair drops them"),
                Defect::Intersection => (
                    "mesh-intersection",
                    "slicing takes the union; unite the solids in the part file if this is not meant",
                ),
                Defect::TJunction => ("mesh-t-junction", "export the part again as one solid"),
            };
            let message = format!("the mesh has {} {}", finding.count, finding.defect);
            let place = Place {
                position: finding.places.first().map(DVec3::to_array),
                ..Place::default()
            };
            reporter.warn_at(code, message, place, remedy);
        }
        if self.crowded > 0 {
            reporter.warn(
                "mesh-crowded",
                format!(
                    "at {} places more triangles meet than are compared with each other: some of their intersections may not be found",
                    self.crowded
                ),
                "export the part again with fewer triangles that meet in a point",
            );
        }
    }
}

/// Collects findings of one kind.
struct Collector {
    finding: Finding,
}

impl Collector {
    fn new(defect: Defect) -> Self {
        Collector {
            finding: Finding {
                defect,
                count: 0,
                places: Vec::new(),
            },
        }
    }

    fn add(&mut self, place: DVec3) {
        self.finding.count += 1;
        if self.finding.places.len() < PLACES {
            self.finding.places.push(place);
        }
    }

    fn into(self, findings: &mut Vec<Finding>) {
        if self.finding.count > 0 {
            findings.push(self.finding);
        }
    }
}

/// Examines a mesh. Triangle indices must be valid (readers see to it); coordinates may be anything.
///
/// The result has the same bits on any number of threads.
///
/// # Errors
/// Cancellation only.
///
/// ```
/// use meltpath_base::Silent;
/// use meltpath_geometry::{diagnosis::{Defect, diagnose}, shapes::thin_wall};
/// let mut wall = thin_wall(100.0, 7.0, 30.0);
/// assert!(diagnose(&wall, &Default::default(), &Silent).unwrap().is_sound());
/// wall.triangles.pop();
/// assert_eq!(diagnose(&wall, &Default::default(), &Silent).unwrap().count(Defect::Hole), 1);
/// ```
pub fn diagnose(
    mesh: &Mesh,
    options: &DiagnosisOptions,
    observer: &dyn Observer,
) -> Result<Diagnosis, Cancelled> {
    observer.stage("examine mesh", 0);
    let mut findings = Vec::new();
    let mut diagnosis = Diagnosis {
        vertices: mesh.vertices.len() as u64,
        triangles: mesh.triangles.len() as u64,
        area: 0.0,
        volume: 0.0,
        shells: Vec::new(),
        findings: Vec::new(),
        crowded: 0,
    };
    let mut wrong = Collector::new(Defect::NotFinite);
    for p in mesh.vertices.iter().filter(|p| !p.is_finite()) {
        // places are kept finite: they go to JSON
        wrong.add(DVec3::select(p.is_finite_mask(), *p, DVec3::ZERO));
    }
    if wrong.finding.count > 0 {
        wrong.into(&mut findings);
        diagnosis.findings = findings;
        return Ok(diagnosis);
    }
    diagnosis.area = mesh.area();
    diagnosis.volume = mesh.volume();
    triangles_alone(mesh, &mut findings);
    observer.check()?;

    let sorted = half_edges(mesh);
    let pieces = shells(mesh, &sorted);
    let open = borders(mesh, &sorted, &pieces, &mut findings);
    drop(sorted);
    observer.check()?;

    let majority = majorities(&pieces);
    senses(mesh, &pieces, &majority, &mut findings);
    let bvh = Bvh::new(mesh);
    diagnosis.shells = measure(mesh, &pieces, &majority, &open.closed);
    let inside = parents(mesh, &bvh, &pieces, &diagnosis.shells);
    for (shell, parent) in diagnosis.shells.iter_mut().zip(inside) {
        shell.inside = parent;
    }
    let whole = mesh.bounds().map_or(0.0, |(lo, hi)| (hi - lo).length());
    shells_alone(&diagnosis.shells, options.stray * whole, &mut findings);
    if options.intersections == Intersections::Find {
        let (found, crowded) = intersections(mesh, &bvh, observer)?;
        found.into(&mut findings);
        diagnosis.crowded = crowded;
    }
    t_junctions(mesh, &open.loose, options.t_junction).into(&mut findings);
    diagnosis.findings = findings;
    Ok(diagnosis)
}

fn centre(mesh: &Mesh, triangle: usize) -> DVec3 {
    mesh.corners(triangle).iter().sum::<DVec3>() / 3.0
}

/// The middle of an edge, given by its key.
fn middle(mesh: &Mesh, key: u64) -> DVec3 {
    let (a, b) = ((key >> 32) as usize, key as u32 as usize);
    0.5 * (mesh.vertices[a] + mesh.vertices[b])
}

/// What is wrong with triangles by themselves: degenerate, without area, repeated.
fn triangles_alone(mesh: &Mesh, findings: &mut Vec<Finding>) {
    let (mut degenerate, mut flat) = (
        Collector::new(Defect::Degenerate),
        Collector::new(Defect::ZeroArea),
    );
    for (t, &v) in mesh.triangles.iter().enumerate() {
        if is_degenerate(v) {
            degenerate.add(centre(mesh, t));
        } else {
            let [a, b, c] = mesh.corners(t);
            let longest = (b - a)
                .length_squared()
                .max((c - a).length_squared())
                .max((c - b).length_squared());
            if (b - a).cross(c - a).length() <= 1e-14 * longest {
                flat.add(centre(mesh, t));
            }
        }
    }
    degenerate.into(findings);
    flat.into(findings);
    let mut duplicate = Collector::new(Defect::Duplicate);
    for t in duplicates(mesh)
        .into_iter()
        .flat_map(|g| g.into_iter().skip(1))
    {
        duplicate.add(centre(mesh, t as usize));
    }
    duplicate.into(findings);
}

/// Where a mesh is open.
struct Open {
    /// Keys of edges with one triangle.
    loose: Vec<u64>,
    /// Whether each shell is closed.
    closed: Vec<bool>,
}

/// Edges with one triangle or more than two, and the holes that loose edges make.
fn borders(mesh: &Mesh, sorted: &[HalfEdge], pieces: &Shells, findings: &mut Vec<Finding>) -> Open {
    let (mut loose, mut crowded) = (
        Collector::new(Defect::LooseEdge),
        Collector::new(Defect::NonManifoldEdge),
    );
    let mut open = Open {
        loose: Vec::new(),
        closed: vec![true; pieces.count],
    };
    for edge in edges(sorted) {
        match edge {
            [only] => {
                loose.add(middle(mesh, only.key));
                open.loose.push(only.key);
                open.closed[pieces.shell[only.triangle() as usize] as usize] = false;
            }
            [_, _] => {}
            _ => crowded.add(middle(mesh, edge[0].key)),
        }
    }
    loose.into(findings);
    let mut holes = Collector::new(Defect::Hole);
    for rim in rims(mesh, sorted) {
        let sum: DVec3 = rim.iter().map(|&v| mesh.vertices[v as usize]).sum();
        holes.add(sum / rim.len() as f64);
    }
    holes.into(findings);
    crowded.into(findings);
    open
}

/// Triangles against the sense of their shell, and edges round which there is none.
fn senses(mesh: &Mesh, pieces: &Shells, majority: &[bool], findings: &mut Vec<Finding>) {
    let mut reversed = Collector::new(Defect::ReversedTriangle);
    for t in 0..mesh.triangles.len() {
        let shell = pieces.shell[t];
        if shell != NO_SHELL && pieces.against[t] != majority[shell as usize] {
            reversed.add(centre(mesh, t));
        }
    }
    reversed.into(findings);
    let mut one_sided = Collector::new(Defect::OneSided);
    for &key in &pieces.one_sided {
        one_sided.add(middle(mesh, key));
    }
    one_sided.into(findings);
}

/// Shells inside out, and shells smaller than `stray` mm.
fn shells_alone(shells: &[Shell], stray: f64, findings: &mut Vec<Finding>) {
    let (mut turned, mut strays) = (
        Collector::new(Defect::InsideOutShell),
        Collector::new(Defect::StrayShell),
    );
    for shell in shells {
        let place = 0.5 * (shell.lo + shell.hi);
        if shell.closed && shell.inside.is_none() && shell.volume < 0.0 {
            turned.add(place);
        }
        if (shell.hi - shell.lo).length() < stray {
            strays.add(place);
        }
    }
    turned.into(findings);
    strays.into(findings);
}

/// Groups of triangles on the same three vertices, each group in mesh order; only groups of two and more.
pub(crate) fn duplicates(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut keyed: Vec<([u32; 3], u32)> = mesh
        .triangles
        .iter()
        .enumerate()
        .filter(|(_, v)| !is_degenerate(**v))
        .map(|(t, v)| {
            let mut key = *v;
            key.sort_unstable();
            (key, t as u32)
        })
        .collect();
    keyed.par_sort_unstable();
    keyed
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|g| g.len() > 1)
        .map(|g| g.iter().map(|(_, t)| *t).collect())
        .collect()
}

/// Pairs that are compared of the leaves between two reports of progress, and of one leaf at least and at most.
const PAIRS: usize = 6_000_000;
const PAIRS_OF_LEAF: (usize, usize) = (512, 32_768);

/// Pairs of triangles that intersect, and how many leaves had more pairs than are compared: where thousands of triangles meet in a
/// point every pair of them is one.
fn intersections(
    mesh: &Mesh,
    bvh: &Bvh,
    observer: &dyn Observer,
) -> Result<(Collector, u64), Cancelled> {
    let leaves = bvh.filled_leaves();
    observer.stage("find intersections", leaves as u64);
    let mut all = Collector::new(Defect::Intersection);
    let chunks: Vec<usize> = (0..leaves).step_by(LEAVES_AT_ONCE).collect();
    let found: Vec<(Collector, u64)> = chunks
        .into_par_iter()
        .map(|first| {
            observer.check()?;
            let (mut own, mut crowded) = (Collector::new(Defect::Intersection), 0);
            let past = (first + LEAVES_AT_ONCE).min(leaves);
            let mut budget = PAIRS;
            for leaf in first..past {
                let most = budget.clamp(PAIRS_OF_LEAF.0, PAIRS_OF_LEAF.1);
                let mut left = most;
                let ended = bvh.pairs_from(mesh, leaf, |a, b| {
                    if left == 0 {
                        return ControlFlow::Break(());
                    }
                    left -= 1;
                    if intersect::triangles_intersect(mesh, a, b) {
                        let (ta, tb) = (mesh.corners(a as usize), mesh.corners(b as usize));
                        own.add((ta.iter().sum::<DVec3>() + tb.iter().sum::<DVec3>()) / 6.0);
                    }
                    ControlFlow::Continue(())
                });
                crowded += u64::from(ended.is_break());
                budget = budget.saturating_sub(most - left);
            }
            observer.advance((past - first) as u64);
            Ok((own, crowded))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut crowded = 0;
    for (own, more) in found {
        crowded += more;
        all.finding.count += own.finding.count;
        let room = PLACES - all.finding.places.len();
        all.finding
            .places
            .extend(own.finding.places.into_iter().take(room));
    }
    Ok((all, crowded))
}

/// Vertices of loose edges that lie within another loose edge: a hint, not sought among more than
/// [`LOOSE_EDGES`] (a mesh of loose triangles says nothing by its junctions).
fn t_junctions(mesh: &Mesh, loose: &[u64], tolerance: f64) -> Collector {
    let mut found = Collector::new(Defect::TJunction);
    if loose.len() > LOOSE_EDGES {
        return found;
    }
    let ends = |key: u64| ((key >> 32) as u32, key as u32);
    let at = |v: u32| mesh.vertices[v as usize];
    let mut rim: Vec<u32> = loose
        .iter()
        .flat_map(|&k| <[u32; 2]>::from(ends(k)))
        .collect();
    rim.sort_unstable();
    rim.dedup();
    rim.sort_by(|&a, &b| at(a).x.total_cmp(&at(b).x).then(a.cmp(&b)));
    for &key in loose {
        let (a, b) = ends(key);
        let (p, q) = (at(a), at(b));
        let first = rim.partition_point(|&v| at(v).x < p.x.min(q.x) - tolerance);
        for &v in &rim[first..] {
            let r = at(v);
            if r.x > p.x.max(q.x) + tolerance {
                break;
            }
            if v == a || v == b {
                continue;
            }
            let d = q - p;
            let t = (r - p).dot(d) / d.length_squared();
            let within = t > 0.0
                && t < 1.0
                && r.distance(p + d * t) <= tolerance
                && r.distance(p) > tolerance
                && r.distance(q) > tolerance;
            if within {
                found.add(r);
            }
        }
    }
    found
}
