//! What lies beside, under and over a tile that takes a step: on its own level, a coarser or a finer one, quicker or slower.

use super::Level;
use super::beneath::Under;
use super::conduct::{First, Side};
use super::pace::Rate;
use super::tile::{Class, SIDES, Shown, Tile};
use super::tree::{Tree, parts};

/// The level whose tiles step, as others of its tiles see it, with those above and below.
pub(super) struct Around<'a> {
    pub(super) tree: &'a Tree,
    pub(super) level: usize,
    pub(super) class: Class,
    /// See [`Levels::advance`].
    pub(super) tick: u32,
    pub(super) coarser: Option<&'a Level>,
    pub(super) rates: &'a [Rate; 2],
    pub(super) index: &'a [u32],
    pub(super) shown: &'a [Shown],
    pub(super) finer: Option<&'a Level>,
    pub(super) held: Option<f32>,
}

/// Planes of a tile: those below the next finer level's lowest, or the others.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Deep,
    High,
}

impl<'a> Around<'a> {
    fn place(&self, level: usize, at: [usize; 2]) -> usize {
        at[1] * self.tree.size(level)[0] + at[0]
    }

    /// What lies beside a part of a tile on side `s`; nothing flows to what sleeps.
    fn side(&self, at: [usize; 2], s: usize, part: Part) -> Side<'a> {
        let (tree, level) = (self.tree, self.level);
        let Some(there) = tree.beside(level, at, SIDES[s]) else {
            return self.held.map_or(Side::Closed, Side::Held);
        };
        if !tree.is_there(level, there) {
            let half = if s < 2 { at[1] % 2 } else { at[0] % 2 };
            let place = self.place(level.saturating_sub(1), there.map(|t| t / 2));
            let shown = self.coarser.and_then(|c| awake(&c.shown, &c.index, place));
            return shown.map_or(Side::Closed, |shown| Side::Coarser(shown, half));
        }
        if part == Part::High && tree.is_divided(level, there) {
            // the two parts that touch, the lower one first; they look here from the opposite side
            let gave = |half: usize| {
                let [x, y] = there.map(|t| 2 * t);
                let part = match s {
                    0 => [x + 1, y + half],
                    1 => [x, y + half],
                    2 => [x + half, y + 1],
                    _ => [x + half, y],
                };
                given(&self.finer_tile(part)?.out[s ^ 1])
            };
            return Side::Finer([gave(0), gave(1)]);
        }
        let shown = awake(self.shown, self.index, self.place(level, there));
        match (self.class, shown) {
            (_, None) => Side::Closed,
            (Class::Quick, Some(shown)) if shown.class == Class::Slow => Side::Slower(shown),
            (Class::Slow, Some(shown)) if shown.class == Class::Quick => Side::Quicker,
            (_, Some(shown)) => Side::Same(shown),
        }
    }

    /// Whether what takes this tile's heat only at the end of its own longer step begins one with this step: beside, and below.
    pub(super) fn first(&self, at: [usize; 2], base: usize) -> First {
        let begins = |rate: &Rate| self.tick.is_multiple_of(rate.ticks);
        let of_coarser = |at: [usize; 2]| {
            let coarser = self.coarser?;
            let n = coarser.index[self.place(self.level - 1, at.map(|t| t / 2))];
            let shown = coarser.shown.get(n as usize)?;
            Some(begins(&coarser.rates[shown.class as usize]))
        };
        let beside = |s: usize| {
            let there = self.tree.beside(self.level, at, SIDES[s]);
            let coarser = there.filter(|there| !self.tree.is_there(self.level, *there));
            let begins = match coarser {
                Some(there) => of_coarser(there),
                None => Some(begins(&self.rates[Class::Slow as usize])),
            };
            begins.unwrap_or(true)
        };
        let below = base > 0 && of_coarser(at).unwrap_or(true);
        First {
            beside: [beside(0), beside(1), beside(2), beside(3)],
            below,
        }
    }

    /// What lies beside a tile below the next finer level's lowest plane, where it goes so deep, and above.
    pub(super) fn sides(&self, at: [usize; 2], deep: bool) -> [[Side<'a>; 4]; 2] {
        let of = |part| {
            let side = |s| self.side(at, s, part);
            [side(0), side(1), side(2), side(3)]
        };
        let high = of(Part::High);
        [if deep { of(Part::Deep) } else { high }, high]
    }

    /// What lies under a tile whose lowest plane is `base`.
    pub(super) fn under(&self, at: [usize; 2], base: usize) -> Under<'a> {
        if base == 0 {
            return self.held.map_or(Under::Closed, Under::Held);
        }
        let place = self.place(self.level.saturating_sub(1), at.map(|t| t / 2));
        let trunk = self.coarser.and_then(|c| awake(&c.shown, &c.index, place));
        trunk.map_or(Under::Closed, |shown| {
            Under::Trunk(shown, at.map(|t| t % 2))
        })
    }

    /// What the finer tiles on a trunk gave it.
    pub(super) fn over(&self, at: [usize; 2]) -> [Option<&'a [f32]>; 4] {
        if !self.tree.is_divided(self.level, at) {
            return [None; 4];
        }
        parts(at).map(|part| given(&self.finer_tile(part)?.down))
    }

    /// A tile of the next finer level, if it is there and awake.
    fn finer_tile(&self, at: [usize; 2]) -> Option<&'a Tile> {
        let finer = self.finer?;
        let n = finer.index[self.place(self.level + 1, at)] as usize;
        finer.tiles.get(n).filter(|_| !finer.shown[n].asleep)
    }
}

/// Slow tiles get what quick ones beside gave them, and give the boxes back when called again.
pub(super) fn exchange_boxes(tree: &Tree, level: usize, own: &mut Level) {
    let width = tree.size(level)[0];
    for a in 0..own.tiles.len() {
        if own.shown[a].class != Class::Slow || own.shown[a].asleep {
            continue;
        }
        for (s, way) in SIDES.iter().enumerate() {
            let Some([x, y]) = tree.beside(level, own.tiles[a].at, *way) else {
                continue;
            };
            let b = own.index[y * width + x] as usize;
            let Some(shown) = own.shown.get(b) else {
                continue;
            };
            if shown.class == Class::Quick && !shown.asleep {
                let given = std::mem::take(&mut own.tiles[b].out[s ^ 1]);
                let was = std::mem::replace(&mut own.tiles[a].inbox[s], given);
                own.tiles[b].out[s ^ 1] = was;
            }
        }
    }
}

/// What a tile shows, if it is there and awake.
fn awake<'a>(shown: &'a [Shown], index: &[u32], place: usize) -> Option<&'a Shown> {
    shown.get(index[place] as usize).filter(|s| !s.asleep)
}

/// What was given, where anything could be.
fn given(heat: &[f32]) -> Option<&[f32]> {
    (!heat.is_empty()).then_some(heat)
}
