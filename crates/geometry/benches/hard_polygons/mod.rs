//! Polygons that are hard to offset: stars with rough wavy boundaries and wavy holes, near-touching, many vertices.
//! Included by the criterion benchmark and by `bench/offset`.

/// A closed ring of points, mm.
pub(crate) type Points = Vec<(f64, f64)>;

/// A small linear congruential generator (Knuth's MMIX constants): the same polygons everywhere.
struct Noise(u64);

impl Noise {
    /// Uniform in -1..1.
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

fn wavy(centre: (f64, f64), radius: f64, lobes: f64, n: usize, noise: &mut Noise) -> Points {
    (0..n)
        .map(|i| {
            let t = std::f64::consts::TAU * i as f64 / n as f64;
            let wave = 0.25 * (lobes * t).sin() + 0.06 * (7.3 * lobes * t).cos();
            let r = radius * (1.0 + wave) + 0.4 * noise.next();
            (centre.0 + r * t.cos(), centre.1 + r * t.sin())
        })
        .collect()
}

/// `count` stars of `n` vertices, each with six holes of `n / 12` vertices: rings, outer first (counter-clockwise),
/// holes clockwise.
pub(crate) fn stars(count: usize, n: usize) -> Vec<Vec<Points>> {
    let mut noise = Noise(7);
    (0..count)
        .map(|k| {
            let centre = (260.0 * (k % 8) as f64, 260.0 * (k / 8) as f64);
            let mut rings = vec![wavy(centre, 100.0, 9.0 + (k % 5) as f64, n, &mut noise)];
            for h in 0..6 {
                let a = std::f64::consts::TAU * (f64::from(h) + 0.3) / 6.0;
                let at = (centre.0 + 42.0 * a.cos(), centre.1 + 42.0 * a.sin());
                let mut hole = wavy(at, 13.0, 5.0, n / 12, &mut noise);
                hole.reverse();
                rings.push(hole);
            }
            rings
        })
        .collect()
}

/// The benchmark's set: 28 stars of 3,000 vertices and 1,500 in their holes, 126,000 in all.
pub(crate) fn hard_set() -> Vec<Vec<Points>> {
    stars(28, 3_000)
}
