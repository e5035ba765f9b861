//! Layer heights: from the growth of the beads that fill each layer, up to what covers the part however the build grows.

use std::ops::Range;

use meltpath_base::quantity::Auto;
use meltpath_base::{Observer, Origin, Reporter, Resolved};
use meltpath_deposition::assembly::{self, AssemblyBead, AssemblyError, Growth};
use meltpath_geometry::Region;
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::stroke;
use meltpath_geometry::section::{LastLayer, LayerHeight, LayerSpan, layers};
use meltpath_planning::nominal_length;
use meltpath_toolpath::{Layer, Pass};
use rayon::prelude::*;

use crate::stages::part::Part;
use crate::waam::plan::cover::{PlanStageError, covered, cut, fill, no_bead, single_share};
use crate::waam::plan::laid;
use crate::waam::settings::Settings;
use crate::waam::settings::bead::FREE_EDGE;

/// Most heights at which the growth model looks.
const MOST_PROBES: usize = 60;
/// Most pairs of layers that are driven for it.
const MOST_DRIVEN: usize = 8;
/// Layers whose beads are as long and grow as much but for this share are driven alike.
const ALIKE: f64 = 0.01;
/// Depth of the groove between two beads, bead heights: parabolas 0.738 widths apart meet at half their height, and level.
const GROOVE: f64 = 0.25;
/// Part of a layer by which the build may stay below its target.
const SHORT: f64 = 0.2;
/// Heights this near to one another are one, mm.
const SLIVER: f64 = 1e-3;

/// Layers from the plate up.
pub(in crate::waam) struct LaidOut {
    pub(in crate::waam) layers: Vec<LayerSpan>,
    /// Their mean height, mm.
    pub(in crate::waam) height: Resolved<f64>,
    /// What they lay over faces that look up, mm.
    pub(in crate::waam) over: Resolved<f64>,
    /// How much lower than the layer below is planned to stand the wire's tip runs, from the second layer on, mm.
    pub(in crate::waam) lowered: f64,
}

impl LaidOut {
    /// Where the wire's tip runs in each layer, mm.
    pub(in crate::waam) fn torch_heights(&self) -> Vec<f64> {
        let mut heights: Vec<f64> = self
            .layers
            .iter()
            .map(|l| l.bottom - self.lowered)
            .collect();
        // the plate is where it is
        if let (Some(first), Some(layer)) = (heights.first_mut(), self.layers.first()) {
            *first = layer.bottom;
        }
        heights
    }
}

pub(in crate::waam) fn lay_out(
    part: &Part,
    part_top: f64,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<LaidOut, PlanStageError> {
    let (mut made, origin, over, lowered) = match &settings.heights {
        Auto::Value(list) => {
            let list: Vec<f64> = list.iter().map(|h| h.0).collect();
            let height = |i: usize| list.get(i).or(list.last()).copied().unwrap_or(0.0);
            let mean = list.iter().sum::<f64>() / list.len().max(1) as f64;
            let over = over_faces(part_top, mean, 0.0, settings);
            let (goal, last) = match settings.count {
                // so many, whatever the part's height
                Some(count) => ((0..count as usize).map(height).sum(), LastLayer::Full),
                None => (part_top + over.value, LastLayer::Adapted),
            };
            let made = layers(0.0, goal, &LayerHeight::PerLayer(list), last)?;
            (made, Origin::Job, over, 0.0)
        }
        Auto::Auto => {
            let (growth, single) = growth(part, part_top, settings, observer)?;
            let mean = growth.iter().map(|g| g.1).sum::<f64>() / growth.len() as f64;
            let over = over_faces(part_top, mean, single, settings);
            let origin = "growth, layer by layer: metal of a layer, as the source feeds it at its contact tube distance, over the area its beads share, free edges 0.45 widths outside the axis (Rouchon 2022, § 4.4)";
            let lowered = lowered(single, settings);
            let feed = [settings.ctwd, settings.ctwd - lowered].map(|d| settings.feed_at(d));
            let made = grown_layers(&growth, feed, part_top + over.value);
            (made, Origin::Computed(origin.to_owned()), over, lowered)
        }
    };
    if let Some(count) = settings.count {
        made.truncate(count as usize);
    }
    let mean = made.last().map_or(0.0, |l| l.top) / made.len().max(1) as f64;
    let sigma = mean * settings.growth_error(0.0).share;
    let height = Resolved::new(mean, origin.clone());
    let height = if origin == Origin::Job {
        height
    } else {
        height.with_sigma(sigma)
    };
    Ok(LaidOut {
        layers: made,
        height,
        over,
        lowered,
    })
}

/// Where the part is cut for a layer of a build that is to reach `goal`, mm: in its middle; the last one, of which only a part is wanted, no
/// higher than there is something to cover.
pub(in crate::waam) fn cut_at(layer: &LayerSpan, goal: f64) -> f64 {
    let middle = layer.at(0.5);
    let wanted = goal - layer.bottom > SHORT * (layer.top - layer.bottom);
    if wanted {
        middle.min(goal - SLIVER)
    } else {
        middle
    }
}

/// How much lower the torch has to stand over a layer than over a plate, mm: edges and grooves of the layer lie lower than its middle, and
/// over them too the contact tube must not be farther than the wire feed is known. `single`: the share of beads without a neighbour.
fn lowered(single: f64, settings: &Settings) -> f64 {
    let Some(known) = settings.map.feed_response.as_ref() else {
        return 0.0;
    };
    let lag =
        (1.0 - single) * edge_lag(settings).unwrap_or(0.0) + GROOVE * settings.bead.height.value;
    let farthest = known.greatest.0.min(settings.limits.ctwd_max);
    (settings.ctwd + lag - farthest).clamp(0.0, lag)
}

/// How much lower than the middle of a layer its edges lie, mm; `None` where the assembly of sections does not tell.
fn edge_lag(settings: &Settings) -> Option<f64> {
    assembled(settings, EDGE_BEADS).ok().map(|g| g.edge_lag)
}

/// Metal over faces that look up, mm: as written; else what leaves the least stock on the highest of them where edges lie
/// lower than the middle, the last layer ends short of its target, and the build grows one standard uncertainty less than
/// predicted. Never less than over sides. `height` is the mean layer's, `single` the share of beads without a neighbour.
pub(in crate::waam) fn over_faces(
    part_top: f64,
    height: f64,
    single: f64,
    settings: &Settings,
) -> Resolved<f64> {
    if let Some(written) = settings.allowance_top {
        return Resolved::new(written, Origin::Job);
    }
    // the crown of a single bead, the edges of many
    let crown = settings.bead.height.value;
    let edges = edge_lag(settings).unwrap_or(0.5 * height);
    let lag = single * crown + (1.0 - single) * (edges + GROOVE * crown);
    let least = settings.limits.stock_min.max(0.0) + settings.cell_size + lag + SHORT * height;
    let doubt = settings.growth_error(single).at(part_top + least);
    Resolved::new(
        settings.allowance.max(least + doubt),
        Origin::Computed(format!(
            "least stock, a cell of the simulation, edges and crowns {lag:.1} mm lower than the middle, one standard uncertainty of {doubt:.1} mm at {part_top:.0} mm"
        )),
    )
}

/// Beads across a strip whose middle does not see its edges.
pub(in crate::waam) const EDGE_BEADS: usize = 6;
/// Layers in which the edges of a wall install themselves (Rouchon 2022, § 4.3).
pub(in crate::waam) const ASSEMBLED: u32 = 5;

/// Growth of walls of `beads` beads across by the assembly of sections.
pub(in crate::waam) fn assembled(
    settings: &Settings,
    beads: usize,
) -> Result<Growth, AssemblyError> {
    let bead = AssemblyBead {
        width: settings.bead.width.value,
        height: settings.bead.height.value,
    };
    assembly::growth(bead, beads, settings.stepover.value, ASSEMBLED)
}

/// The height to which a layer of beads grows, mm: their metal over the area that they share; `None` of none.
///
/// # Errors
/// [`PlanarError`].
pub(in crate::waam) fn grown(
    path: &Layer,
    settings: &Settings,
) -> Result<Option<f64>, PlanarError> {
    let flat =
        |p: Pass<'_>| -> Vec<DVec2> { p.flatten(0.05).0.iter().map(|v| v.truncate()).collect() };
    let lines: Vec<Vec<DVec2>> = path.passes().map(flat).collect();
    let speed = settings.bead.travel_speed;
    let laid: f64 = path.passes().map(|p| nominal_length(&p, speed)).sum();
    let metal = laid * settings.bead.area.value;
    let shared = stroke(&lines, FREE_EDGE * settings.bead.width.value, 0.05)?;
    let area: f64 = shared.iter().map(Region::area).sum();
    Ok((area > 0.0).then(|| metal / area))
}

/// How much layers grow, over the height of the part: the metal of a layer over the area that its beads share, at a number of
/// heights (mm, growth in mm); and the share of bead length without a neighbour.
fn growth(
    part: &Part,
    part_top: f64,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<(Vec<(f64, f64)>, f64), PlanStageError> {
    let quiet = Reporter::new();
    let count = (part_top / settings.bead.height.value)
        .ceil()
        .clamp(1.0, MOST_PROBES as f64) as usize;
    let heights: Vec<f64> = (0..count)
        .map(|i| (i as f64 + 0.5) / count as f64 * part_top)
        .collect();
    let regions = covered(
        &cut(
            part,
            part_top,
            settings.least_over(),
            &heights,
            &quiet,
            observer,
        )?,
        settings,
    )?;
    let plans = fill(&heights, &regions, settings, &quiet, observer)?;
    let paths: Vec<&Layer> = plans.iter().map(|p| &p.path).collect();
    let mut grows: Vec<Option<f64>> = paths
        .iter()
        .map(|path| grown(path, settings))
        .collect::<Result<_, _>>()?;
    as_driven(&mut grows, &paths, settings, observer)?;
    let known = heights.into_iter().zip(grows);
    let grown: Vec<(f64, f64)> = known
        .filter_map(|(height, grows)| Some((height, grows?)))
        .collect();
    if grown.is_empty() {
        return Err(no_bead(part, settings));
    }
    let single = single_share(plans.iter().flat_map(|p| p.path.passes()));
    Ok((grown, single))
}

/// Makes the growth of layers that lie by their lines that of layers as the controller drives them. Some are driven, each with the one above it,
/// whose beads go another way; the others follow the pair that is most like them.
fn as_driven(
    grows: &mut [Option<f64>],
    paths: &[&Layer],
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<(), PlanStageError> {
    let lines: Vec<ByLines> = grows
        .iter()
        .zip(paths)
        .map(|(grows, path)| ByLines {
            grows: grows.unwrap_or(0.0),
            length: path.passes().map(|p| p.length()).sum(),
        })
        .collect();
    let pairs = unlike(&lines);
    let share = |pair: &Range<usize>| {
        // what no program can be made of, or no bead is in, stays as its lines say
        let Some(laid) = laid::laid(&paths[pair.clone()], settings, observer) else {
            return Ok(None);
        };
        let driven: f64 = laid::heights(&laid, settings)?.iter().flatten().sum();
        let by_lines: f64 = lines[pair.clone()].iter().map(|l| l.grows).sum();
        let known = driven > 0.0 && by_lines > 0.0;
        Ok(known.then(|| (pair.clone(), driven / by_lines)))
    };
    let shares = pairs.par_iter().map(share);
    let shares: Vec<Option<(Range<usize>, f64)>> = shares.collect::<Result<_, PlanarError>>()?;
    observer.check()?;
    for (grows, layer) in grows.iter_mut().zip(&lines) {
        let known = shares.iter().flatten();
        let most_like = known.min_by(|(a, _), (b, _)| {
            let unlike = |pair: &Range<usize>| layer.unlike(&lines[pair.clone()]);
            unlike(a).total_cmp(&unlike(b))
        });
        if let (Some(grows), Some((_, share))) = (grows, most_like) {
            *grows *= share;
        }
    }
    Ok(())
}

/// A layer by its lines.
struct ByLines {
    /// Its growth, mm; 0 of no bead.
    grows: f64,
    /// Length of its beads, mm.
    length: f64,
}

impl ByLines {
    /// How far it differs from the most like of some layers: the greater share by which growth and length do.
    fn unlike(&self, others: &[ByLines]) -> f64 {
        let share = |a: f64, b: f64| (a - b).abs() / a.max(b).max(f64::MIN_POSITIVE);
        let from = |o: &ByLines| share(self.grows, o.grows).max(share(self.length, o.length));
        others.iter().map(from).fold(f64::INFINITY, f64::min)
    }
}

/// Pairs of layers, one over the other, of which every layer is like one, as far as [`MOST_DRIVEN`] allow.
fn unlike(lines: &[ByLines]) -> Vec<Range<usize>> {
    let mut pairs: Vec<Range<usize>> = Vec::new();
    for (i, layer) in lines.iter().enumerate() {
        let is_new = pairs
            .iter()
            .all(|p| layer.unlike(&lines[p.clone()]) > ALIKE);
        if layer.grows > 0.0 && is_new {
            let first = i.min(lines.len().saturating_sub(2));
            pairs.push(first..(first + 2).min(lines.len()));
        }
    }
    let kept = pairs.len().min(MOST_DRIVEN);
    (0..kept)
        .map(|k| pairs[k * pairs.len() / kept].clone())
        .collect()
}

/// Layers that follow the growth, up to `top`; `feed`: the share of the reference's wire that the first layer gets, and each further one.
fn grown_layers(growth: &[(f64, f64)], feed: [f64; 2], top: f64) -> Vec<LayerSpan> {
    let mut layers: Vec<LayerSpan> = Vec::new();
    let mut bottom = 0.0;
    loop {
        // each layer as the nearest height at which the growth is known
        let nearest = growth
            .iter()
            .min_by(|a, b| (a.0 - bottom).abs().total_cmp(&(b.0 - bottom).abs()));
        let Some((_, height)) = nearest else {
            return layers;
        };
        let height = height * feed[usize::from(!layers.is_empty())];
        if top - bottom <= SHORT * height && !layers.is_empty() {
            return layers;
        }
        layers.push(LayerSpan {
            bottom,
            top: bottom + height,
        });
        bottom += height;
    }
}
