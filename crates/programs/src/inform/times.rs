//! Times in the lines that switch the arc: `ARCON AC=160 AVP=90 T=0.50` stands when the arc is struck, `ARCOF AC=160 AVP=80 T=0.50` on the crater.

use crate::scan::{duration, strip_prefix, strip_word};

/// How long the torch stands with the arc on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stands {
    /// How long, s.
    pub(super) time: f64,
    /// The line has values of its own, such as a current.
    pub(super) valued: bool,
    /// The line.
    pub(super) text: String,
}

/// How long a line makes the torch stand where it switches the arc; nothing where it is another, or says no time above zero.
pub(super) fn of(line: &str) -> Option<Stands> {
    let rest = ["ARCON", "ARCOF"]
        .iter()
        .find_map(|word| strip_word(line.trim(), word))?;
    let mut words = rest.split_whitespace();
    let time = words.clone().find_map(|w| duration(strip_prefix(w, "T=")?));
    let valued = words.any(|w| strip_prefix(w, "T=").is_none());
    let time = time.filter(|time| *time > 0.0)?;
    Some(Stands {
        time,
        valued,
        text: line.trim().to_owned(),
    })
}
