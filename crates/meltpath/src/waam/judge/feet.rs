//! Whether flat beads that lie side by side are near enough to fuse at their feet: no heat is simulated, so distances tell it.
//!
//! Source: Rouchon 2022, § 4.2: beads of a ratio of wire feed to travel speed of 5 left holes where they lay farther apart than 0.70 widths.

use std::collections::HashMap;

use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_deposition::stepover::{FLAT_BEAD_RATIO, FUSION_LIMIT, fusion_at_risk};
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec2;
use meltpath_robot::command::{Command, Kind, Source};

use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Samples of a bead, per width.
const SAMPLES: f64 = 4.0;
/// Beads farther apart than this, bead widths, stand alone.
const REACH: f64 = 1.3;
/// Cosine of the angle up to which beads run beside each other.
const BESIDE: f64 = 0.9;
/// Way along a bead, in distances across, beyond which it lies beside itself.
const OWN_WAY: f64 = 3.0;
/// Share of a layer's bead that may be so, %: turning points, short stretches that were made quicker.
const SHARE: f64 = 10.0;

/// A short piece of bead.
struct Piece {
    at: DVec2,
    along: DVec2,
    /// Which bead of the program, and how far along it, mm.
    bead: usize,
    way: f64,
    length: f64,
    /// Wire feed over travel speed.
    ratio: f64,
    /// Width of the bead, mm.
    width: f64,
    command: usize,
}

/// The pieces of beads of each layer, by layer.
fn pieces(commands: &Commands, settings: &Settings) -> Vec<(u32, Vec<Piece>)> {
    let step = settings.bead.width.value / SAMPLES;
    let mut layers: Vec<(u32, Vec<Piece>)> = Vec::new();
    let (mut from, mut burns, mut bead, mut way) = (commands.start.position, false, 0, 0.0);
    let mut known = ([0.0; 2], 0.0);
    let numbered = commands.commands.iter().zip(&commands.layer_of_command);
    for (number, (command, layer)) in numbered.enumerate() {
        let Command {
            kind,
            target,
            source,
            speed,
            ..
        } = command;
        if matches!(kind, Kind::Wait { .. }) {
            continue;
        }
        if let Source::On { wire_feed } = source {
            let set = [wire_feed / settings.feed_factor(), *speed];
            if set != known.0 {
                known = (set, settings.map.bead(set[0], set[1]).width.value);
            }
            if !burns {
                (bead, way) = (bead + 1, 0.0);
            }
            let arc = match *kind {
                Kind::Arc { via } => Arc::through(from, via, *target),
                _ => None,
            };
            let at = |t: f64| {
                arc.map_or(from.lerp(*target, t), |arc| arc.at(t))
                    .truncate()
            };
            let length = arc.map_or(from.distance(*target), |arc| arc.length());
            let count = (length / step).ceil().max(1.0);
            if layers.last().is_none_or(|(last, _)| last != layer) {
                layers.push((*layer, Vec::new()));
            }
            if let Some((_, pieces)) = layers.last_mut() {
                pieces.extend((0..count as usize).map(|k| {
                    let share = |of: f64| at((k as f64 + of) / count);
                    Piece {
                        at: share(0.5),
                        along: (share(1.0) - share(0.0)).normalize_or_zero(),
                        bead,
                        way: way + (k as f64 + 0.5) / count * length,
                        length: length / count,
                        ratio: set[0] / set[1],
                        width: known.1,
                        command: number,
                    }
                }));
            }
            way += length;
        }
        burns = matches!(source, Source::On { .. });
        from = *target;
    }
    layers
}

/// Pieces by the squares of a grid.
type Squares<'a> = HashMap<[i64; 2], Vec<&'a Piece>>;

/// The farther of the nearest beads on both sides of a piece, mm; `None` where it stands alone.
fn beside(piece: &Piece, squares: &Squares<'_>, side: f64) -> Option<f64> {
    let reach = REACH * piece.width;
    let [x, y] = square(piece.at, side);
    let mut nearest = [f64::INFINITY; 2];
    let round = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
    for other in round.filter_map(|key| squares.get(&key)).flatten() {
        let off = other.at - piece.at;
        let across = piece.along.perp_dot(off);
        let is_next =
            other.bead == piece.bead && (other.way - piece.way).abs() < OWN_WAY * off.length();
        let runs_beside = piece.along.dot(other.along).abs() > BESIDE
            && piece.along.dot(off).abs() <= piece.length.max(other.length);
        if runs_beside && !is_next && across.abs() <= reach {
            let side = &mut nearest[usize::from(across < 0.0)];
            *side = side.min(across.abs());
        }
    }
    nearest
        .into_iter()
        .filter(|d| d.is_finite())
        .reduce(f64::max)
}

fn square(at: DVec2, side: f64) -> [i64; 2] {
    (at / side).floor().to_array().map(|k| k as i64)
}

/// Flat beads of which more than a tenth of a layer lies farther beside another than they fuse; `None` where none do.
pub(in crate::waam) fn check(commands: &Commands, settings: &Settings) -> Option<Check> {
    let mut worst: Option<(f64, u32, &Piece, f64)> = None;
    let layers = pieces(commands, settings);
    for (layer, pieces) in &layers {
        if pieces.iter().all(|p| p.ratio >= FLAT_BEAD_RATIO) {
            continue;
        }
        // the widest bead sees as far as any
        let side = REACH * pieces.iter().map(|p| p.width).fold(0.0, f64::max);
        let mut squares = Squares::new();
        for piece in pieces {
            let key = square(piece.at, side);
            squares.entry(key).or_default().push(piece);
        }
        let apart = |piece: &Piece| {
            let flat = piece.ratio < FLAT_BEAD_RATIO;
            let apart = flat.then(|| beside(piece, &squares, side))?? / piece.width;
            fusion_at_risk(piece.ratio, apart).then_some(apart)
        };
        let of: Vec<(&Piece, f64)> = pieces.iter().filter_map(|p| Some((p, apart(p)?))).collect();
        let whole: f64 = pieces.iter().map(|p| p.length).sum();
        let share = 100.0 * of.iter().map(|(p, _)| p.length).sum::<f64>() / whole;
        let farthest = of.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((piece, apart)) = farthest
            && worst.is_none_or(|(most, ..)| share > most)
        {
            worst = Some((share, *layer, piece, apart));
        }
    }
    let (share, layer, piece, apart) = worst.filter(|(share, ..)| *share > SHARE)?;
    let place = Place {
        layer: Some(layer),
        bead: commands
            .bead_of_command
            .get(piece.command)
            .copied()
            .flatten(),
        ..Place::at(
            piece
                .at
                .extend(commands.commands[piece.command].target.z)
                .to_array(),
        )
    };
    let check = Check::judge(
        "feet",
        "flat beads too far beside each other to fuse at their feet, share of a layer",
        Measure::exact(share, "%"),
        Limit::AtMost(SHARE),
    );
    let reason = format!(
        "ratio of wire feed to travel speed {:.1}, {apart:.2} widths apart; below {FLAT_BEAD_RATIO} beads farther apart than {FUSION_LIMIT:.2} widths left holes, and fusion is not simulated",
        piece.ratio
    );
    let check = Check {
        status: Status::CannotSay,
        reason,
        ..check
    };
    Some(check.at(place).remedy(
        "fill.stepover = \"0.70 w\" or less, a slower travel speed, or a trial cut through the metal",
    ))
}
