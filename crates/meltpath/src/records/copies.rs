//! Records that are one: a copy beside its original at another distance shows that nothing changes with the distance.

use meltpath_perception::arc::steady::Piece;

use super::found::Recorded;

/// Whether two records hold the same voltages and currents, sample by sample as far as pieces tell it.
fn are_one(a: &[Piece], b: &[Piece]) -> bool {
    let same = |(p, q): (&Piece, &Piece)| {
        let both = p.voltage.iter().chain(&p.current);
        let both = both.zip(q.voltage.iter().chain(&q.current));
        both.into_iter().all(|(x, y)| x.total_cmp(y).is_eq())
    };
    a.len() == b.len() && a.iter().zip(b).all(same)
}

/// Whether anything in a record changes: what a display shows of a steady arc may well be the same twice.
fn changes(pieces: &[Piece]) -> bool {
    let differ = |[_, least, greatest]: [f64; 3]| greatest > least;
    pieces
        .iter()
        .any(|p| differ(p.voltage) || differ(p.current))
        || pieces.windows(2).any(|w| w[0].current != w[1].current)
}

/// Why records that hold the same samples cannot be used, each in a sentence.
pub(super) fn copied(beads: &[Recorded]) -> Vec<String> {
    let mut told = Vec::new();
    for (n, bead) in beads.iter().enumerate() {
        let one = |other: &&Recorded| changes(&bead.pieces) && are_one(&other.pieces, &bead.pieces);
        if let Some(other) = beads[..n].iter().find(one) {
            told.push(format!(
                "{} and {} hold the same samples: no two beads do. Name the file of each bead, or leave one out",
                other.setting.file, bead.setting.file
            ));
        }
    }
    told
}
