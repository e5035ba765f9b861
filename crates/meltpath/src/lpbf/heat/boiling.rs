//! How near marks bring the surface to boiling, and the keyholes that they dig.

use std::collections::HashSet;

use meltpath_base::{Check, Measure, Place, Status};
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_thermal::beam::BeamPoint;
use meltpath_thermal::material::medium::Medium;
use meltpath_thermal::pool::fusion::boiling_number;
use meltpath_thermal::pool::keyhole::{Beyond, FULL_KEYHOLE, Keyhole, Laser, Mode, keyhole};
use meltpath_toolpath::Role;

use super::settings::HeatSettings;

/// Boiling number from which vapour deepens the pool noticeably, and from which a keyhole forms.
pub(super) const BOILING: [f64; 2] = [0.5, 1.0];

/// Boiling numbers of a kind of marks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Boiling {
    /// Of which marks.
    pub kind: Role,
    /// The greatest.
    pub number: f64,
    /// The keyhole there, by scaling, or why nothing is said of it.
    pub keyhole: Result<Keyhole, Beyond>,
    /// Where the mark ends of which that is told, mm.
    pub end: [f64; 2],
    /// In which layer, where layers are marked.
    pub layer: Option<u32>,
}

impl Boiling {
    /// Of marks of a power, W, and speed, mm/s, that end at a place of a layer; `None` where the material tells no boiling point.
    pub(super) fn of(
        settings: &HeatSettings,
        kind: Role,
        strength: [f64; 2],
        end: ([f64; 2], Option<u32>),
    ) -> Option<Boiling> {
        Boiling::on_bed(settings, settings.medium.ambient, kind, strength, end)
    }

    /// The same on a bed of another temperature, K.
    pub(super) fn on_bed(
        settings: &HeatSettings,
        ambient: f64,
        kind: Role,
        [power, speed]: [f64; 2],
        (end, layer): ([f64; 2], Option<u32>),
    ) -> Option<Boiling> {
        let material = &settings.material;
        let medium = Medium {
            ambient,
            ..settings.medium
        };
        let absorbed = settings.absorptivity * power;
        let number = boiling_number(material, &medium, absorbed, speed, settings.spot)?;
        let laser = Laser {
            power,
            speed,
            spot: settings.spot,
            flat: settings.absorptivity,
        };
        Some(Boiling {
            kind,
            number,
            keyhole: keyhole(material, ambient, laser),
            end,
            layer,
        })
    }
}

/// The keyhole number, by the law alone where that was not measured.
pub(super) fn by_law(boiling: &Boiling) -> f64 {
    match &boiling.keyhole {
        Ok(told) => told.number,
        Err(beyond) => beyond.number,
    }
}

/// A check of keyholes with what a worse course of the same marks comes to: told where that is worth no more, else judged by its number, at its
/// place.
pub(super) fn raised(
    check: Check,
    (status, number): (Status, f64),
    told: &str,
    (place, remedy): (Place, &str),
) -> Check {
    if status <= check.status {
        return check.because(told);
    }
    let value = Measure {
        sigma: None,
        ..Measure::exact(number, "")
    };
    let check = Check {
        status,
        value: Some(value),
        ..check
    };
    check.because(told).at(place).remedy(remedy)
}

/// What a keyhole is worth, pores and all.
pub(super) fn status(boiling: &Boiling) -> Status {
    match &boiling.keyhole {
        Ok(told) if told.mode == Mode::Keyhole => Status::Warn,
        // two laws that disagree
        Ok(_) if boiling.number > BOILING[1] => Status::Warn,
        Ok(_) => Status::Pass,
        Err(beyond) if beyond.number >= FULL_KEYHOLE => Status::CannotSay,
        Err(_) if boiling.number <= BOILING[0] => Status::Pass,
        Err(_) => Status::Warn,
    }
}

/// Whether a way drawn with light brings the surface near boiling, so that vapour deepens its pool.
pub(super) fn vapour(settings: &HeatSettings, [from, to]: [&BeamPoint; 2]) -> bool {
    let speed = (to.x - from.x).hypot(to.y - from.y) / (to.time - from.time);
    let strength = [from.power, speed];
    // a beam that stands is judged by itself
    let moves = speed > 0.0 && speed.is_finite();
    let boiling = moves.then(|| Boiling::of(settings, Role::Fill, strength, ([0.0; 2], None)));
    boiling.flatten().is_some_and(|b| b.number > BOILING[0])
}

/// The hottest marks of some layers, by both laws.
pub(super) struct Hottest<'a> {
    settings: &'a HeatSettings,
    /// Lasers that were looked at: kind, power, speed.
    known: HashSet<(bool, u64, u64)>,
    /// What is told: of each kind of marks one or two.
    pub(super) found: Vec<Boiling>,
}

impl<'a> Hottest<'a> {
    pub(super) fn new(settings: &'a HeatSettings) -> Self {
        Hottest {
            settings,
            known: HashSet::new(),
            found: Vec::new(),
        }
    }

    /// Looks at the marks of a layer.
    pub(super) fn take(&mut self, job: &ScanJob, layer: Option<u32>) {
        for v in job.vectors.iter().filter(|v| v.speed > 0.0) {
            let fill = match v.kind {
                Role::Contour => false,
                Role::Fill => true,
                _ => continue,
            };
            if !self
                .known
                .insert((fill, v.power.to_bits(), v.speed.to_bits()))
            {
                continue;
            }
            let end = ([v.end.x, v.end.y], layer);
            let found = Boiling::of(self.settings, v.kind, [v.power, v.speed], end);
            self.found.extend(found);
            self.found = kept(&self.found);
        }
    }
}

/// Of each kind of marks the one nearest to boiling, and the one whose keyhole is the worst where that is another.
fn kept(all: &[Boiling]) -> Vec<Boiling> {
    let mut kept: Vec<Boiling> = Vec::new();
    for kind in [Role::Contour, Role::Fill] {
        // of equals the first
        let of = || all.iter().rev().filter(move |b| b.kind == kind);
        let near = of().max_by(|a, b| a.number.total_cmp(&b.number));
        let worst = of().max_by(|a, b| {
            let by_status = status(a).cmp(&status(b));
            by_status.then(by_law(a).total_cmp(&by_law(b)))
        });
        kept.extend(near.copied());
        kept.extend(worst.filter(|worst| near != Some(worst)).copied());
    }
    kept
}

/// The hottest marks of one layer.
pub(super) fn hottest(
    settings: &HeatSettings,
    (job, layer): (&ScanJob, Option<u32>),
) -> Vec<Boiling> {
    let mut found = Hottest::new(settings);
    found.take(job, layer);
    found.found
}
