//! Seeded random numbers with the same stream on every machine and in every version.
//!
//! xoshiro256++ seeded by splitmix64: D. Blackman, S. Vigna, "Scrambled linear pseudorandom number generators", ACM Trans.
//! Math. Software 47 (2021).

/// A stream of random numbers.
///
/// ```
/// use meltpath_numerics::random::Random;
/// let (mut a, mut b) = (Random::new(7), Random::new(7));
/// assert_eq!(a.unit(), b.unit());
/// ```
#[derive(Debug, Clone)]
pub struct Random {
    state: [u64; 4],
}

impl Random {
    /// The stream that belongs to a seed.
    pub fn new(seed: u64) -> Self {
        let mut x = seed;
        let mut next = || {
            x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = x;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        Random {
            state: [next(), next(), next(), next()],
        }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        let s = &mut self.state;
        let out = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        out
    }

    /// Evenly spread in 0..1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Evenly spread in `low..high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Normal, mean 0, deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// xoshiro256++ from the first numbers of SplitMix64, as their authors' programs give them for the seed 0.
    #[test]
    fn the_sequence_is_the_published_one() {
        let mut random = Random::new(0);
        let state = [
            0xe220_a839_7b1d_cdaf,
            0x6e78_9e6a_a1b9_65f4,
            0x06c4_5d18_8009_454f,
            0xf88b_b8a8_724c_81ec,
        ];
        assert_eq!(random.state, state);
        assert_eq!(random.bits(), 0x5317_5d61_490b_23df);
        // with other states: 2^23 + 2 of [1, 0, 0, 1]
        let mut random = Random {
            state: [1, 0, 0, 1],
        };
        assert_eq!(random.bits(), (2 << 23) + 1);
    }

    #[test]
    fn between_two_numbers() {
        let mut r = Random::new(1);
        let drawn: Vec<f64> = (0..1000).map(|_| r.between(-2.0, 3.0)).collect();
        assert!(drawn.iter().all(|x| (-2.0..3.0).contains(x)));
        assert!((drawn.iter().sum::<f64>() / 1000.0 - 0.5).abs() < 0.2);
    }

    #[test]
    fn moments() {
        let mut r = Random::new(1);
        let n = 200_000;
        let (mut sum, mut square) = (0.0, 0.0);
        for _ in 0..n {
            let x = r.normal();
            sum += x;
            square += x * x;
        }
        assert!((sum / f64::from(n)).abs() < 0.01);
        assert!((square / f64::from(n) - 1.0).abs() < 0.02);
    }
}
