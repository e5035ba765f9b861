//! Layers that go from a body to the top of a part are as thick as the place has them: how thick where, and whether that can be laid.

use meltpath_base::{Check, Limit, Measure, Place};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::Segments;
use meltpath_planning::Paces;
use meltpath_planning::surface::{SurfacePass, distribution};

use crate::waam::settings::Settings;
use crate::waam::settings::bead::PER_MINUTE;

/// How slow and how fast a bead may be laid for the thickness of its layer, shares of its own speed: width goes about with the third root of the
/// speed, so that beads are 0.8 to 1.3 times as wide, and lie 0.6 to 0.9 of their width apart. Ours.
const SLOWEST: f64 = 0.5;
const FASTEST: f64 = 2.0;

/// The speeds that a bead of `nominal` speed may take, of which the map knows beads from the slowest to the fastest, mm/s.
pub(super) fn thickness_paces(nominal: f64, [slowest, fastest]: [f64; 2]) -> Paces {
    Paces {
        nominal,
        slowest: (slowest / nominal).clamp(SLOWEST, 1.0),
        fastest: (fastest / nominal).clamp(1.0, FASTEST),
    }
}

/// How thick layers are planned where, and between what they can be laid.
#[derive(Debug)]
pub struct Thickness {
    layers: Vec<Layer>,
    /// Of each layer from the first on the least and the greatest thickness that can be laid, mm; the last one repeats.
    able: Vec<[f64; 2]>,
    /// The speeds that lay them.
    paces: Paces,
    /// How far from a bead its thickness is known, mm.
    width: f64,
}

/// The moves of a layer, each a line of its own along what it is laid on.
#[derive(Debug)]
struct Layer {
    number: u32,
    moves: Segments,
    ends: Vec<[(DVec3, f64); 2]>,
}

impl Thickness {
    /// Of the beads of layers in their order, as wide as `width`, mm.
    pub(super) fn new(
        passes: &[SurfacePass],
        able: Vec<[f64; 2]>,
        paces: Paces,
        width: f64,
    ) -> Self {
        let layer = |group: &[SurfacePass]| {
            let pairs = group.iter().flat_map(|pass| pass.points.windows(2));
            let ends: Vec<[(DVec3, f64); 2]> = pairs
                .map(|pair| {
                    [&pair[0], &pair[1]].map(|p| {
                        let from = p.from.unwrap_or(p.position);
                        (from, p.spacing().unwrap_or(0.0))
                    })
                })
                .collect();
            let lines: Vec<[DVec3; 2]> = ends.iter().map(|e| [e[0].0, e[1].0]).collect();
            Layer {
                number: group[0].number,
                moves: Segments::new(lines.iter().map(|line| &line[..]), width),
                ends,
            }
        };
        Thickness {
            layers: passes
                .chunk_by(|a, b| a.number == b.number)
                .map(layer)
                .collect(),
            able,
            paces,
            width,
        }
    }

    /// How thick a layer is planned where the wire's tip is, mm; `None` away from its beads.
    pub(super) fn at(&self, number: u32, tip: DVec3) -> Option<f64> {
        let layer = self.layers.iter().find(|l| l.number == number)?;
        let near = layer.moves.nearest(tip, self.width)?;
        let [(from, thick), (to, other)] = *layer.ends.get(near.line as usize)?;
        let way = from.distance(to);
        let share = if way > 0.0 {
            (from.distance(near.point) / way).min(1.0)
        } else {
            0.0
        };
        Some(thick + share * (other - thick))
    }

    fn able(&self, number: u32) -> Option<[f64; 2]> {
        let index = number.saturating_sub(1) as usize;
        self.able.get(index).or(self.able.last()).copied()
    }

    /// Whether there are speeds for every thickness; `None` of no bead.
    pub(super) fn check(&self, passes: &[SurfacePass], settings: &Settings) -> Option<Check> {
        let beyond = |pass: &SurfacePass, i: usize| {
            let thick = pass.points.get(i)?.spacing()?;
            let [thinnest, thickest] = self.able(pass.number)?;
            Some((thick / thickest).max(thinnest / thick) - 1.0)
        };
        let worst = distribution(passes, beyond)?.greatest;
        let all = distribution(passes, |pass, i| pass.points.get(i)?.spacing())?;
        let [thinnest, thickest] = self.able(worst.pass)?;
        let per_minute = |share: f64| share * self.paces.nominal * PER_MINUTE;
        let [slowest, fastest] = [self.paces.slowest, self.paces.fastest].map(per_minute);
        let check = Check::judge(
            "thickness",
            "thickness of layers beyond what travel speeds lay, share of it",
            Measure::exact(100.0 * worst.value.max(0.0), "%"),
            Limit::AtMost(0.0),
        );
        let reason = format!(
            "{:.2} to {:.2} mm thick in {} layers, a ratio of {:.2}; {fastest:.2} to {slowest:.2} m/min lay {thinnest:.2} to {thickest:.2} mm",
            all.least.value,
            all.greatest.value,
            self.layers.len(),
            all.greatest.value / all.least.value,
        );
        let place = Place {
            layer: Some(worst.pass),
            ..Place::at(worst.position.to_array())
        };
        let ratio = all.greatest.value / all.least.value;
        let remedy = self.remedy(ratio, settings.map.validity.travel_speed);
        Some(check.because(&reason).at(place).remedy(&remedy))
    }

    /// What mends layers whose thickest place is `ratio` times their thinnest, where beads are known from a slowest to a fastest speed, m/min: one that
    /// can be laid slower and faster, at one layer more or less than fits best.
    fn remedy(&self, ratio: f64, (slowest, fastest): (f64, f64)) -> String {
        let count = self.layers.len().max(1) as f64;
        let needed = ratio * (count + 1.0) / count;
        if needed <= (FASTEST / SLOWEST).min(fastest / slowest) {
            let speed = fastest / (SLOWEST * needed);
            format!(
                "a waam.bead that travels at {speed:.2} m/min at most: it can be laid faster and slower; or another layers.height"
            )
        } else {
            "leave onto.top out, for layers at one distance from the body; or divide the part, and lay its thick end first, with a top of its own".to_owned()
        }
    }
}
