//! Layers that go from a body to the top of a part are as thick as the place has them: how thick where, and whether that can be laid.

use meltpath_base::{Check, Limit, Measure, Place};
use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::Segments;
use meltpath_planning::Paces;
use meltpath_planning::surface::{Pace, SurfacePass, distribution};

use crate::waam::settings::Settings;
use crate::waam::settings::bead::PER_MINUTE;

/// How slow and how fast a bead may be laid for the thickness of its layer, shares of its own speed: width goes about with the third root of the
/// speed, so that beads are 0.8 to 1.3 times as wide, and lie 0.6 to 0.9 of their width apart. Ours.
const SLOWEST: f64 = 0.5;
const FASTEST: f64 = 2.0;
/// The width of a bead that goes with more than this power of its section leaves its height as it is.
const WIDEST: f64 = 0.9;

/// The speeds that a bead of `nominal` speed may take, of which the map knows beads from the slowest to the fastest, mm/s.
pub(super) fn thickness_paces(nominal: f64, [slowest, fastest]: [f64; 2]) -> Paces {
    Paces {
        nominal,
        slowest: (slowest / nominal).clamp(SLOWEST, 1.0),
        fastest: (fastest / nominal).clamp(1.0, FASTEST),
    }
}

/// The slowest and the fastest speed that the process map knows, mm/s.
pub(super) fn known_speeds(settings: &Settings) -> [f64; 2] {
    let (slowest, fastest) = settings.map.validity.travel_speed;
    [slowest, fastest].map(|v| v / PER_MINUTE)
}

/// How speeds of a wall follow the distance between its passes, of which one grows to `grown` mm at the bead's own speed: those at which its
/// beads keep their shape and of which the process map knows.
pub(super) fn wall_pace(grown: f64, settings: &Settings) -> Pace {
    let (bead, known) = (&settings.bead, known_speeds(settings));
    Pace {
        grown,
        power: 1.0 / (1.0 - settings.bead_model.width_exponent.clamp(0.0, WIDEST)),
        paces: thickness_paces(bead.travel_speed, known),
        known,
        shortest: 0.5 * bead.width.value,
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
    kind: Thick,
}

/// What is as thick as its place has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Thick {
    /// Filled layers from a body to a top.
    Filled,
    /// Passes of a wall, at their layer height, mm.
    Wall { height: f64 },
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
        (able, paces): (Vec<[f64; 2]>, Paces),
        width: f64,
        kind: Thick,
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
            kind,
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
        let outside = distribution(passes, |pass, i| {
            Some(f64::from(u8::from(beyond(pass, i)? > 0.0)))
        });
        let reason = match outside {
            Some(share) if worst.value > 0.0 => {
                format!(
                    "{reason}; {:.0} % of the length is beyond them",
                    100.0 * share.mean
                )
            }
            _ => reason,
        };
        let place = Place {
            layer: Some(worst.pass),
            ..Place::at(worst.position.to_array())
        };
        let remedy = self.remedy(
            [all.least.value, all.greatest.value],
            [thinnest, thickest],
            settings.map.validity.travel_speed,
        );
        Some(check.because(&reason).at(place).remedy(&remedy))
    }

    /// What mends layers from `thin` to `thick`, mm, where speeds lay `able`, and beads are known from a slowest to a fastest speed, m/min: one that
    /// can be laid slower and faster, at one layer more or less than fits best; of a wall another distance between its passes.
    fn remedy(
        &self,
        [thin, thick]: [f64; 2],
        able: [f64; 2],
        (slowest, fastest): (f64, f64),
    ) -> String {
        let count = self.layers.len().max(1) as f64;
        let ratio = thick / thin;
        match self.kind {
            Thick::Wall { height } if ratio <= able[1] / able[0] => {
                let middle = ((able[0] * able[1]) / (thin * thick)).sqrt();
                format!("layers.height = \"{:.2} mm\"", height * middle)
            }
            Thick::Wall { .. } => "layers.height = \"auto\"; a waam.bead in the middle of the speeds of the process map; or surface.strategy = \"distance\"".to_owned(),
            Thick::Filled => {
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
    }
}
