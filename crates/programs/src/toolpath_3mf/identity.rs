//! Identifiers made of what they name: the same content has the same one.

use meltpath_base::provenance::sha256;

/// The UUID (version 8, RFC 9562) of a text.
pub(super) fn uuid(text: &str) -> String {
    // reading from memory does not fail
    let hash = sha256(&mut text.as_bytes()).unwrap_or_default();
    let digit = |i: usize| hash.get(i..=i).unwrap_or("0");
    let variant = match digit(16) {
        "0" | "4" | "8" | "c" => "8",
        "1" | "5" | "9" | "d" => "9",
        "2" | "6" | "a" | "e" => "a",
        _ => "b",
    };
    let part = |range: std::ops::Range<usize>| range.map(digit).collect::<String>();
    format!(
        "{}-{}-8{}-{variant}{}-{}",
        part(0..8),
        part(8..12),
        part(13..16),
        part(17..20),
        part(20..32)
    )
}
