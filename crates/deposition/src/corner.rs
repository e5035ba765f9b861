//! Volumes of a bead at a corner by definition: what was meant there, what is laid twice, what is missing, and what more than meant is made of.
//! Source: Rouchon 2022, §3.4.3, eq. 3.6-3.9; the identity of the parts and the moment of any section are ours.

use meltpath_geometry::math::DVec2;

/// How far before and behind the corner volumes are taken along the path, mm: the source's.
pub const REACH: f64 = 20.0;

/// The bead that is meant at a corner: its section drawn along both legs, and turned about the corner on the outside.
///
/// The corner is the origin, the path comes along x from the negative side and turns by `angle` (rad, left positive).
#[derive(Debug, Clone, Copy)]
pub struct Target<F> {
    /// Turn of the path, rad, left positive.
    pub angle: f64,
    /// Height of the section at a distance from its middle, mm; left of the path positive.
    pub section: F,
    /// Farthest from its middle that it reaches, mm.
    pub half_width: f64,
}

/// Heights at a place, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heights {
    /// Of the section along the first leg and along the second, each ending at the corner.
    pub legs: [f64; 2],
    /// Of the section turned about the corner, on its outside.
    pub outside: f64,
}

impl Heights {
    /// That of what is meant.
    pub fn target(&self) -> f64 {
        self.legs[0].max(self.legs[1]).max(self.outside)
    }

    /// That of what is laid twice.
    pub fn twice(&self) -> f64 {
        self.legs[0].min(self.legs[1])
    }
}

/// What a corner adds to and takes from a bead, mm³.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fold {
    /// Missing on the outside when sections are drawn along the legs.
    pub lacunar: f64,
    /// Laid twice on the inside.
    pub redundant: f64,
}

impl Fold {
    /// Of a parabola `width` wide and `height` high at a turn of `angle` rad: eq. 3.7 and 3.8.
    ///
    /// Valid while (width/2)·tan(angle/2) is within [`REACH`].
    ///
    /// ```
    /// use meltpath_deposition::corner::Fold;
    /// let fold = Fold::of_parabola(std::f64::consts::FRAC_PI_2, 7.2, 2.0);
    /// assert!((fold.lacunar - 10.18).abs() < 0.01 && (fold.geometric() - 2.78).abs() < 0.01);
    /// ```
    pub fn of_parabola(angle: f64, width: f64, height: f64) -> Self {
        Fold::of_moments(angle, [height * width * width / 16.0; 2])
    }

    /// Of first moments about the middle, mm³: of the half of the section on the inside of the turn and of that on its outside.
    pub fn of_moments(angle: f64, [inside, outside]: [f64; 2]) -> Self {
        Fold {
            lacunar: angle.abs() * outside,
            redundant: 2.0 * (0.5 * angle.abs()).tan() * inside,
        }
    }

    /// What folding adds: redundant less lacunar.
    pub fn geometric(&self) -> f64 {
        self.redundant - self.lacunar
    }
}

impl<F: Fn(f64) -> f64> Target<F> {
    /// Heights at a place.
    pub fn at(&self, p: DVec2) -> Heights {
        let along = DVec2::from_angle(self.angle);
        let (on_first, on_second) = (p.x <= 0.0, p.dot(along) >= 0.0);
        let across = [p.y, along.perp_dot(p)];
        let leg = |on: bool, v: f64| {
            if on && v.abs() <= self.half_width {
                (self.section)(v).max(0.0)
            } else {
                0.0
            }
        };
        let legs = [leg(on_first, across[0]), leg(on_second, across[1])];
        let distance = p.length();
        let beyond = !on_first && !on_second && distance <= self.half_width;
        let side = -self.angle.signum();
        Heights {
            legs,
            outside: if beyond {
                (self.section)(side * distance).max(0.0)
            } else {
                0.0
            },
        }
    }

    /// First moments of its halves about its middle: on the inside of the turn and on the outside, mm³.
    pub fn moments(&self) -> [f64; 2] {
        const PARTS: u32 = 2000;
        let step = self.half_width / f64::from(PARTS);
        let inside = self.angle.signum();
        [inside, -inside].map(|side| {
            let of = |k: u32| {
                let v = (f64::from(k) + 0.5) * step;
                (self.section)(side * v).max(0.0) * v * step
            };
            (0..PARTS).map(of).sum()
        })
    }

    /// What the corner adds and takes.
    pub fn fold(&self) -> Fold {
        Fold::of_moments(self.angle, self.moments())
    }
}

/// How a torch passed a corner: from [`REACH`] before it to as far behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// How long it took, s.
    pub time: f64,
    /// How long its way was, mm.
    pub length: f64,
}

impl Passage {
    /// At one speed through the corner itself.
    pub fn steady(travel_speed: f64) -> Self {
        Passage {
            time: 2.0 * REACH / travel_speed,
            length: 2.0 * REACH,
        }
    }

    /// Of samples of time (s) and place (mm, in the frame of [`Target`]) where the path turns by `angle`; none where they do not come
    /// so far on both legs.
    pub fn of(samples: &[(f64, DVec2)], angle: f64) -> Option<Self> {
        let second = DVec2::from_angle(angle);
        let into = |p: DVec2| p.x + REACH;
        let out = |p: DVec2| p.dot(second) - REACH;
        let first = samples
            .windows(2)
            .position(|w| into(w[0].1) <= 0.0 && into(w[1].1) > 0.0)?;
        let last = first
            + samples[first..]
                .windows(2)
                .position(|w| out(w[0].1) < 0.0 && out(w[1].1) >= 0.0)?;
        let between = |w: &[(f64, DVec2)], of: &dyn Fn(DVec2) -> f64| {
            let [a, b] = [of(w[0].1), of(w[1].1)];
            let share = a / (a - b);
            (
                w[0].0 + share * (w[1].0 - w[0].0),
                w[0].1.lerp(w[1].1, share),
            )
        };
        let start = between(&samples[first..first + 2], &into);
        let end = between(&samples[last..last + 2], &out);
        let mut length = 0.0;
        let mut at = start.1;
        for (_, p) in &samples[first + 1..=last] {
            length += at.distance(*p);
            at = *p;
        }
        Some(Passage {
            time: end.0 - start.0,
            length: length + at.distance(end.1),
        })
    }

    /// What slowing down adds where `area` mm² are laid at `travel_speed` mm/s: fed at a steady rate, less what its way takes.
    pub fn kinematic(&self, area: f64, travel_speed: f64) -> f64 {
        area * (travel_speed * self.time - self.length)
    }
}

/// Volumes of a bead within [`REACH`] of a corner, mm³, as the source defines them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Above the plate.
    pub measured: f64,
    /// Of the wire that was fed there, where it is known.
    pub wire: Option<f64>,
    /// The mean section drawn along the path that was meant.
    pub nominal: f64,
    /// The mean section drawn along the way of the torch.
    pub path: f64,
    /// What folding adds and takes.
    pub fold: Fold,
}

impl Balance {
    /// The volume that was meant: eq. 3.9.
    pub fn target(&self) -> f64 {
        self.nominal - self.fold.redundant + self.fold.lacunar
    }

    /// More than was meant: kinematic less chord plus geometric part.
    pub fn accumulation(&self) -> f64 {
        self.measured - self.target()
    }

    /// What the torch's slowing down and all that is not told apart add.
    pub fn kinematic(&self) -> f64 {
        self.measured - self.path
    }

    /// What the torch's shorter way saves.
    pub fn chord(&self) -> f64 {
        self.nominal - self.path
    }

    /// What folding adds.
    pub fn geometric(&self) -> f64 {
        self.fold.geometric()
    }

    /// What of the wire is not in the bead.
    pub fn losses(&self) -> Option<f64> {
        Some(self.wire? - self.measured)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::Section;
    use meltpath_numerics::random::Random;

    /// Lacunar and redundant volume of a target summed over cells.
    fn on_a_grid<F: Fn(f64) -> f64>(target: &Target<F>, cell: f64) -> Fold {
        let count = (REACH / cell) as i32;
        let (mut lacunar, mut redundant) = (0.0, 0.0);
        for i in -count..count {
            for j in -count..count {
                // turned, so that faces of legs run along no row of cells
                let turned = DVec2::from_angle(0.3);
                let p = turned.rotate(cell * DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5));
                let heights = target.at(p);
                lacunar += heights.outside * cell * cell;
                redundant += heights.twice() * cell * cell;
            }
        }
        Fold { lacunar, redundant }
    }

    #[test]
    fn waam_ac25_volumes_of_a_corner_by_definition() {
        for (degrees, lacunar, redundant, geometric) in [
            (45.0, 5.089, 5.368, 0.279),
            (90.0, 10.18, 12.96, 2.78),
            (135.0, 15.27, 31.29, 16.02),
        ] {
            let angle = f64::to_radians(degrees);
            let fold = Fold::of_parabola(angle, 7.2, 2.0);
            for (ours, of_source) in [
                (fold.lacunar, lacunar),
                (fold.redundant, redundant),
                (fold.geometric(), geometric),
            ] {
                assert!((ours / of_source - 1.0).abs() < 2e-3, "{ours} {of_source}");
            }
            for turn in [angle, -angle] {
                let section = |v: f64| Section::Parabola.at(v, 7.2, 2.0);
                let target = Target {
                    angle: turn,
                    section,
                    half_width: 3.6,
                };
                let grid = on_a_grid(&target, 0.02);
                for (cells, exact) in [
                    (grid.lacunar, fold.lacunar),
                    (grid.redundant, fold.redundant),
                    (target.fold().lacunar, fold.lacunar),
                    (target.fold().redundant, fold.redundant),
                ] {
                    assert!(
                        (cells / exact - 1.0).abs() < 5e-3,
                        "{turn}: {cells} {exact}"
                    );
                }
            }
            // the target is no more than what is drawn along the path
            assert!(fold.geometric() >= 0.0);
        }
    }

    /// Sections that are no parabolas, and one that leans.
    #[test]
    fn any_section_folds_as_its_moments_say() {
        for shape in [Section::Arc, Section::SemiEllipse, Section::Cosine] {
            let leaning = |v: f64| shape.at(v, 7.0, 2.0) * (1.0 + 0.05 * v);
            for degrees in [60.0, -120.0] {
                let target = Target {
                    angle: f64::to_radians(degrees),
                    section: leaning,
                    half_width: 3.5,
                };
                let (cells, moments) = (on_a_grid(&target, 0.02), target.fold());
                assert!((cells.lacunar / moments.lacunar - 1.0).abs() < 5e-3);
                // min of both legs: of a section that leans the two sides of the bisector differ by nothing, both are insides
                assert!(
                    (cells.redundant / moments.redundant - 1.0).abs() < 5e-3,
                    "{shape:?} {degrees}: {cells:?} {moments:?}"
                );
            }
        }
    }

    #[test]
    fn waam_ac26_an_accumulation_is_the_sum_of_its_parts() {
        let mut random = Random::new(26);
        for _ in 0..1000 {
            let angle = random.between(-2.9, 2.9);
            let (area, shorter) = (random.between(3.0, 20.0), random.between(0.0, 1.0));
            let balance = Balance {
                measured: random.between(100.0, 900.0),
                wire: Some(random.between(100.0, 900.0)),
                nominal: area * 2.0 * REACH,
                path: area * (2.0 * REACH - shorter),
                fold: Fold::of_parabola(angle, random.between(3.0, 12.0), random.between(0.5, 4.0)),
            };
            let parts = balance.kinematic() - balance.chord() + balance.geometric();
            assert!((balance.accumulation() - parts).abs() < 1e-9);
            // chord and geometric part have their signs, and both vanish with the angle
            assert!(balance.chord() >= 0.0 && balance.geometric() >= 0.0);
        }
        let small = Fold::of_parabola(1e-3, 7.2, 2.0);
        assert!(small.geometric() < 1e-8);
    }

    #[test]
    fn a_torch_that_never_comes_so_far_passes_nothing() {
        let way = |end: f64| -> Vec<(f64, DVec2)> {
            let leg = |k: i32| {
                let s = f64::from(k) - 30.0;
                (
                    f64::from(k),
                    if s < 0.0 { DVec2::X * s } else { DVec2::Y * s },
                )
            };
            (0..=60)
                .map(leg)
                .filter(|(t, _)| *t - 30.0 <= end)
                .collect()
        };
        let angle = std::f64::consts::FRAC_PI_2;
        assert_eq!(Passage::of(&way(19.0), angle), None);
        let full = Passage::of(&way(30.0), angle).unwrap();
        assert!((full.time - 40.0).abs() < 1e-9 && (full.length - 40.0).abs() < 1e-9);
        assert!(full.kinematic(9.0, 1.0).abs() < 1e-9);
        assert_eq!(Passage::steady(1.0), full);
    }
}
