//! Marks over places that others of their layer have heated just before: how warm these still are.
//!
//! What a line leaves is the heat of a Gaussian drawn along it at once on a half space (Carslaw and Jaeger 1959, chapter X): so long after it
//! passed a place beside it, that place is warmer by
//! `P/(v · 2πk √(t (t + t₀))) · exp(−d²/(4α(t + t₀))) · ½ [erf(s/r) + erf((L − s)/r)]` with `r = √(4α(t + t₀))`, `t₀ = σ²/(2α)` and
//! `σ` a quarter of the spot; the lines before one another are summed. What lies beside them, and the light itself, are left aside.

use libm::erf;
use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_geometry::math::DVec3;
use meltpath_scan_head::head::vector::{ScanJob, Vector};
use meltpath_scan_head::measures::marks_again::{DrawnMark, MarksAgain, Passed};
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::material::medium::Medium;
use meltpath_thermal::pool::keyhole::FULL_KEYHOLE;

use super::boiling::{Boiling, by_law, raised, status};
use super::settings::HeatSettings;

const REMEDY: &str = "export each line once, or let the place cool: other marks between, or a wait before it is drawn again";
/// A keyhole number that is greater by less than this factor is not told.
const ALIKE: f64 = 1.05;
/// A mark this soon after another one over the same place, in times that the spot takes to spread, is one with it, s/s.
const SOONEST: f64 = 0.1;

/// A place that is marked again while it is warm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warm {
    /// The place, mm.
    pub place: [f64; 2],
    /// In which layer, where layers are marked.
    pub layer: Option<u32>,
    /// Marks over it, this one too.
    pub marks: usize,
    /// Time since the last one before, s.
    pub ago: f64,
    /// How warm it still is, K.
    pub bed: f64,
    /// What a steady mark does on a bed as warm; `None` where the material tells no boiling point.
    pub boiling: Option<Boiling>,
}

/// By how much an earlier mark still warms a place, K; a spot of that diameter, mm, of which a share of the power becomes heat.
fn left(medium: &Medium, spot: f64, share: f64, passed: &Passed) -> f64 {
    let sigma = 0.25 * spot;
    let spreads = sigma * sigma / (2.0 * medium.diffusivity);
    let time = passed.ago.max(SOONEST * spreads);
    let square = 4.0 * medium.diffusivity * (time + spreads);
    let reach = square.sqrt();
    let [a, b] = passed.mark.ends;
    let length = a.distance(b);
    let line = share * passed.mark.power / passed.mark.speed;
    let along = 0.5 * (erf(passed.along / reach) + erf((length - passed.along) / reach));
    let near = (-passed.aside * passed.aside / square).exp();
    let cooled = std::f64::consts::TAU * medium.conductivity * (time * (time + spreads)).sqrt();
    line / cooled * near * along
}

/// Places that are marked again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WarmPlaces {
    /// The warmest.
    pub warmest: Warm,
    /// The one whose mark is nearest to boiling; the warmest where the material tells no boiling point.
    pub hottest: Warm,
}

impl Warm {
    /// What keyholes on it are worth: laws are those of steady marks, and hold on beds that are solid.
    fn status(&self, solidus: f64) -> Option<Status> {
        let boiling = self.boiling.as_ref()?;
        let open = self.bed >= solidus || by_law(boiling) >= FULL_KEYHOLE;
        Some(if open {
            Status::CannotSay
        } else {
            status(boiling)
        })
    }
}

/// Looks through layers for the places that are marked again.
pub(super) struct Warmest<'a> {
    settings: &'a HeatSettings,
    /// Bed, power, power over the root of the speed and over the speed of the hottest: with less of all nothing boils more.
    known: [f64; 4],
    pub(super) found: Option<WarmPlaces>,
}

impl<'a> Warmest<'a> {
    pub(super) fn new(settings: &'a HeatSettings) -> Self {
        Warmest {
            settings,
            known: [0.0; 4],
            found: None,
        }
    }

    /// Looks at the marks of a layer.
    pub(super) fn take(&mut self, job: &ScanJob, layer: Option<u32>) {
        let mut marks = MarksAgain::new(self.settings.spot);
        let mut time = 0.0;
        for (i, v) in job.vectors.iter().enumerate() {
            let ends = [job.start_of(i), v.end].map(DVec3::truncate);
            if v.kind.deposits() && v.speed > 0.0 {
                let mark = DrawnMark {
                    ends,
                    begin: time,
                    speed: v.speed,
                    power: v.power,
                };
                marks.take(mark, |place| {
                    let warm = self.warm(place.at.to_array(), layer, place.before);
                    self.judge(warm, v);
                });
            }
            if v.speed > 0.0 {
                time += job.length_of(i) / v.speed;
            }
            time += v.wait;
        }
    }

    /// The place as it is when it is drawn again.
    fn warm(&self, place: [f64; 2], layer: Option<u32>, before: &[Passed]) -> Warm {
        let settings = self.settings;
        let each = before
            .iter()
            .map(|p| left(&settings.medium, settings.spot, settings.absorptivity, p));
        Warm {
            place,
            layer,
            marks: 1 + before.len(),
            ago: before.iter().map(|p| p.ago).fold(f64::INFINITY, f64::min),
            bed: settings.medium.ambient + each.sum::<f64>(),
            boiling: None,
        }
    }

    /// Keeps the place of a mark where it is worse.
    fn judge(&mut self, warm: Warm, v: &Vector) {
        let strengths = [
            warm.bed,
            v.power,
            v.power / v.speed.sqrt(),
            v.power / v.speed,
        ];
        let mut all = strengths.iter().zip(&self.known);
        if all.all(|(here, known)| here <= known) {
            return;
        }
        let bed = warm.bed.min(self.settings.material.solidus);
        let end = (warm.place, warm.layer);
        let boiling = Boiling::on_bed(self.settings, bed, v.kind, [v.power, v.speed], end);
        let warm = Warm { boiling, ..warm };
        let Some(found) = &mut self.found else {
            self.known = strengths;
            self.found = Some(WarmPlaces {
                warmest: warm,
                hottest: warm,
            });
            return;
        };
        if warm.bed > found.warmest.bed {
            found.warmest = warm;
        }
        let rank = |w: &Warm| (w.boiling.map_or(0.0, |b| b.number), w.bed);
        if rank(&warm) > rank(&found.hottest) {
            self.known = strengths;
            found.hottest = warm;
        }
    }
}

/// How warm places are that are marked again; nothing where none is. Where one is not solid yet its marks are one pool, of which the laws of
/// single marks say nothing.
pub(in crate::lpbf) fn check(
    settings: &HeatSettings,
    number: usize,
    recipe: &str,
    places: Option<&WarmPlaces>,
) -> Option<Check> {
    let warm = places?.warmest;
    let celsius = |kelvin: f64| Measure {
        sigma: None,
        ..Measure::exact(kelvin - CELSIUS, "°C")
    };
    let solidus = settings.material.solidus;
    let check = Check::judge(
        &format!("again-{number}"),
        &format!("{recipe}: how warm a place is when it is marked again"),
        celsius(warm.bed),
        Limit::AtMost(solidus - CELSIUS),
    );
    let check = check.because(&words(&warm)).at(place(&warm));
    if check.status == Status::Pass {
        return Some(check);
    }
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    let why = "it is not solid yet: one pool, of which the laws of single marks say nothing, nor how deep it gets";
    Some(check.because(why).remedy(REMEDY))
}

fn words(warm: &Warm) -> String {
    format!(
        "{} marks go over it, this one {} ms after the one before",
        warm.marks,
        significant(1e3 * warm.ago, 3)
    )
}

fn place(warm: &Warm) -> Place {
    let [x, y] = warm.place;
    Place {
        layer: warm.layer,
        ..Place::at([x, y, 0.0])
    }
}

/// The check of keyholes, with what marks do on places that are warm.
pub(super) fn on_warm(check: Check, settings: &HeatSettings, warm: &Warm) -> Check {
    let Some(boiling) = &warm.boiling else {
        return check;
    };
    let number = by_law(boiling);
    let status = warm
        .status(settings.material.solidus)
        .unwrap_or(check.status);
    let alike = |v: &Measure| number <= ALIKE * v.value;
    if status <= check.status && check.value.as_ref().is_some_and(alike) {
        return check;
    }
    let molten = warm.bed >= settings.material.solidus;
    let least = if molten { "at least " } else { "" };
    let told = format!(
        "that is on a cold bed: {}, on {:.0} °C that the earlier ones left: keyhole number {least}{number:.1}, boiling number {least}{:.1}, by laws of steady marks",
        words(warm),
        warm.bed - CELSIUS,
        boiling.number
    );
    raised(check, (status, number), &told, (place(warm), REMEDY))
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec2;
    use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
    use meltpath_thermal::material::file::{Readings, read};
    use meltpath_thermal::material::medium::Body;
    use meltpath_thermal::pool::history::Memory;
    use meltpath_thermal::pool::moving_source::MovingSource;
    use meltpath_thermal::solver::source::Depth;

    /// A line cools as the engine that draws melt pools has it cool.
    #[test]
    fn a_line_cools_as_in_the_engine() {
        let text = meltpath_data::materials::IN625_LASER.text;
        let alloy = read(text, Readings::default()).unwrap();
        let medium = Medium::effective(&alloy, 293.15, Body::HalfSpace).unwrap();
        let (power, speed, spot, length) = (200.0, 800.0, 0.1, 0.6);
        for wait in [0.2e-3, 1e-3, 5e-3] {
            let after = length / speed + wait;
            let point = |time, x, power| BeamPoint {
                time,
                x,
                y: 0.0,
                power,
                spot,
            };
            let ways = [
                point(0.0, 0.0, power),
                point(length / speed, length, 0.0),
                point(1.0, length, 0.0),
            ];
            let path = BeamPath::new(ways.to_vec()).unwrap();
            let beam = Beam {
                efficiency: 0.33,
                depth: Depth::Surface,
            };
            let mut engine = MovingSource::new(medium, path, beam, Memory::Full).unwrap();
            engine.advance(after).unwrap();
            let rise = engine.temperature(DVec3::new(0.3, 0.0, 0.0)) - medium.ambient;
            let passed = Passed {
                mark: DrawnMark {
                    ends: [DVec2::ZERO, DVec2::new(length, 0.0)],
                    begin: 0.0,
                    speed,
                    power,
                },
                along: 0.3,
                aside: 0.0,
                ago: after - 0.3 / speed,
                parallel: true,
            };
            let told = left(&medium, spot, 0.33, &passed);
            assert!((told / rise - 1.0).abs() < 0.1, "{wait}: {told} {rise}");
        }
    }
}
