//! Numbers made small enough to travel inside an HTML page: 16-bit quantisation, differences, byte planes,
//! raw DEFLATE, base64. The viewer undoes it; the error is at most half a step, and the step is stated.
//!
//! Sources: RFC 1951 (DEFLATE), RFC 4648 (base64).

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::DeflateEncoder;

/// Code that stands for "no value"; codes below it are values.
pub const NO_VALUE: u16 = u16::MAX;

/// Greatest code of a value.
const TOP: u16 = NO_VALUE - 1;

/// A linear map from codes `0..=65534` to values: `value = lo + step · code`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiser {
    /// Value of code 0.
    pub lo: f64,
    /// Difference between neighbouring codes; 0 where all values are equal.
    pub step: f64,
}

impl Quantiser {
    /// The finest map that covers every finite value of `values`; covers 0 alone when there is none.
    pub fn covering(values: impl IntoIterator<Item = f64>) -> Self {
        let (lo, hi) = values
            .into_iter()
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| {
                (lo.min(v), hi.max(v))
            });
        Self::between(lo, hi)
    }

    /// The map of `lo..=hi`; covers 0 alone when the interval is empty.
    pub fn between(lo: f64, hi: f64) -> Self {
        if lo <= hi {
            // halves first: the difference of two huge values may overflow
            let step = (hi / f64::from(TOP)) - (lo / f64::from(TOP));
            Quantiser { lo, step }
        } else {
            Quantiser { lo: 0.0, step: 0.0 }
        }
    }

    /// The nearest code; [`NO_VALUE`] for a value that is not finite. Values outside the map are clamped to it.
    ///
    /// ```
    /// use meltpath_report::packing::{NO_VALUE, Quantiser};
    /// let q = Quantiser::between(0.0, 65.534);
    /// assert_eq!(q.code(1.0), 1000);
    /// assert_eq!(q.code(f64::NAN), NO_VALUE);
    /// ```
    pub fn code(&self, value: f64) -> u16 {
        if !value.is_finite() {
            return NO_VALUE;
        }
        if self.step <= 0.0 {
            return 0;
        }
        let code = ((value - self.lo) / self.step).round();
        code.clamp(0.0, f64::from(TOP)) as u16
    }

    /// The value of a code; NaN for [`NO_VALUE`].
    pub fn value(&self, code: u16) -> f64 {
        if code == NO_VALUE {
            f64::NAN
        } else {
            self.lo + self.step * f64::from(code)
        }
    }
}

/// Wrapping difference as an unsigned number that is small for small differences of either sign.
fn zigzag16(difference: u16) -> u16 {
    let signed = difference.cast_signed();
    (signed.wrapping_shl(1) ^ (signed >> 15)).cast_unsigned()
}

fn zigzag32(difference: u32) -> u32 {
    let signed = difference.cast_signed();
    (signed.wrapping_shl(1) ^ (signed >> 31)).cast_unsigned()
}

/// Packs 16-bit codes, each as the difference from the code `stride` places before it.
///
/// `stride` is the number of interleaved components, or the size of a frame when frames follow one another.
/// Layout before DEFLATE: all low bytes, then all high bytes, of the zigzag differences.
///
/// ```
/// let text = meltpath_report::packing::pack_codes(&[7, 7, 7, 8], 1);
/// assert!(text.bytes().all(|b| b.is_ascii_alphanumeric() || b"+/=".contains(&b)));
/// ```
pub fn pack_codes(codes: &[u16], stride: usize) -> String {
    let stride = stride.max(1);
    let mut planes = vec![0; 2 * codes.len()];
    let (low, high) = planes.split_at_mut(codes.len());
    for (i, &code) in codes.iter().enumerate() {
        let before = if i < stride { 0 } else { codes[i - stride] };
        let [l, h] = zigzag16(code.wrapping_sub(before)).to_le_bytes();
        low[i] = l;
        high[i] = h;
    }
    deflated_base64(&planes)
}

/// Packs 32-bit indices, each as the difference from the index `stride` places before it, in four byte planes.
pub fn pack_indices(indices: &[u32], stride: usize) -> String {
    let stride = stride.max(1);
    let n = indices.len();
    let mut planes = vec![0; 4 * n];
    for (i, &index) in indices.iter().enumerate() {
        let before = if i < stride { 0 } else { indices[i - stride] };
        let bytes = zigzag32(index.wrapping_sub(before)).to_le_bytes();
        for (plane, byte) in bytes.into_iter().enumerate() {
            planes[plane * n + i] = byte;
        }
    }
    deflated_base64(&planes)
}

fn deflated_base64(bytes: &[u8]) -> String {
    base64(&deflate(bytes))
}

fn deflate(bytes: &[u8]) -> Vec<u8> {
    let write = || -> io::Result<Vec<u8>> {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::new(6));
        encoder.write_all(bytes)?;
        encoder.finish()
    };
    // writing to a vector has no way to fail; an empty stream would show as an empty view, not as a crash
    write().unwrap_or_default()
}

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Base64 with padding, RFC 4648 section 4.
///
/// ```
/// assert_eq!(meltpath_report::packing::base64(b"foobar"), "Zm9vYmFy");
/// assert_eq!(meltpath_report::packing::base64(b"fo"), "Zm8=");
/// ```
pub fn base64(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let mut group = [0_u8; 3];
        group[..chunk.len()].copy_from_slice(chunk);
        let bits = u32::from(group[0]) << 16 | u32::from(group[1]) << 8 | u32::from(group[2]);
        for place in 0..4 {
            if place <= chunk.len() {
                let digit = (bits >> (18 - 6 * place)) & 63;
                text.push(char::from(ALPHABET[digit as usize]));
            } else {
                text.push('=');
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use proptest::prelude::*;

    use super::*;

    fn unbase64(text: &str) -> Vec<u8> {
        let mut bytes = Vec::new();
        for group in text.as_bytes().chunks(4) {
            let kept = group.iter().filter(|&&b| b != b'=').count();
            let bits = group.iter().fold(0_u32, |bits, &b| {
                let digit = ALPHABET.iter().position(|&a| a == b).unwrap_or(0);
                bits << 6 | digit as u32
            });
            bytes.extend_from_slice(&bits.to_be_bytes()[1..kept]);
        }
        bytes
    }

    fn inflate(text: &str) -> Vec<u8> {
        let mut bytes = Vec::new();
        flate2::read::DeflateDecoder::new(&unbase64(text)[..])
            .read_to_end(&mut bytes)
            .unwrap();
        bytes
    }

    /// What the viewer does.
    fn unpack_codes(text: &str, stride: usize) -> Vec<u16> {
        let planes = inflate(text);
        let n = planes.len() / 2;
        let mut codes = vec![0_u16; n];
        for i in 0..n {
            let z = u16::from_le_bytes([planes[i], planes[n + i]]);
            let d = (z >> 1) ^ (z & 1).wrapping_neg();
            let before = if i < stride { 0 } else { codes[i - stride] };
            codes[i] = before.wrapping_add(d);
        }
        codes
    }

    fn unpack_indices(text: &str, stride: usize) -> Vec<u32> {
        let planes = inflate(text);
        let n = planes.len() / 4;
        let mut indices = vec![0_u32; n];
        for i in 0..n {
            let z = u32::from_le_bytes([0, 1, 2, 3].map(|p| planes[p * n + i]));
            let d = (z >> 1) ^ (z & 1).wrapping_neg();
            let before = if i < stride { 0 } else { indices[i - stride] };
            indices[i] = before.wrapping_add(d);
        }
        indices
    }

    proptest! {
        #[test]
        fn base64_comes_back(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let text = base64(&bytes);
            prop_assert_eq!(text.len() % 4, 0);
            prop_assert_eq!(unbase64(&text), bytes);
        }

        #[test]
        fn codes_come_back(codes in prop::collection::vec(any::<u16>(), 0..400), stride in 1..9_usize) {
            prop_assert_eq!(unpack_codes(&pack_codes(&codes, stride), stride), codes);
        }

        #[test]
        fn indices_come_back(indices in prop::collection::vec(any::<u32>(), 0..300)) {
            prop_assert_eq!(unpack_indices(&pack_indices(&indices, 3), 3), indices);
        }

        #[test]
        fn quantisation_errs_by_half_a_step(values in prop::collection::vec(-1e6..1e6_f64, 1..100)) {
            let q = Quantiser::covering(values.iter().copied());
            for v in values {
                let back = q.value(q.code(v));
                // half a step, and the rounding of the map itself
                prop_assert!((back - v).abs() <= 0.5 * q.step + 1e-9, "{v} came back as {back}, step {}", q.step);
            }
        }
    }

    #[test]
    fn extremes_neither_overflow_nor_leave_the_map() {
        let q = Quantiser::covering([f64::MIN, f64::MAX, f64::NAN, f64::INFINITY]);
        assert!(q.step.is_finite());
        assert_eq!(q.code(f64::MIN), 0);
        assert_eq!(q.code(f64::MAX), TOP);
        assert_eq!(q.code(f64::NEG_INFINITY), NO_VALUE);
        assert_eq!(Quantiser::covering([]).code(5.0), 0);
        assert_eq!(Quantiser::covering([3.0, 3.0]).value(0), 3.0);
    }

    #[test]
    fn frames_that_repeat_cost_next_to_nothing() {
        // noise, which does not compress by itself
        let frame: Vec<u16> = (1..=10_000_u64)
            .map(|i| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_pow(3) >> 41) as u16)
            .collect();
        let frames: Vec<u16> = frame.iter().cycle().take(250_000).copied().collect();
        let one = pack_codes(&frame, frame.len()).len();
        let twenty_five = pack_codes(&frames, frame.len()).len();
        assert!(
            twenty_five < one + one / 10,
            "{twenty_five} bytes for 25 equal frames, {one} for one"
        );
    }
}
