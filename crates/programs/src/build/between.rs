//! What happens between beads: pauses, calls of the cell, what stands already.

use meltpath_base::Place;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Channel, Move, Pass};

use super::wording::SHORTEST_WAIT;
use super::{Builder, Pause, Point, Step, highest, moved, places};
use crate::assembly::comment;
use crate::program::Instruction;
use crate::upkeep::Split;

impl Builder<'_> {
    /// Takes in a pass that was laid already.
    pub(super) fn stands(&mut self, pass: &Pass<'_>, height: f64) {
        let points = self.points(pass, height);
        let steps = self.steps(pass, &points, height);
        if steps.is_empty() {
            return;
        }
        let grown = if pass.head.role.deposits() {
            for index in steps.iter().filter_map(moved) {
                let feed = self.feed(pass, index);
                self.numbered(feed);
            }
            self.growth(pass)
        } else {
            0.0
        };
        self.highest = self.highest.max(highest(&points) + grown);
        self.flanks.lay(pass.layer, places(&points), grown);
    }

    /// The calls of the cell that are due before a bead. The torch comes back from them by a joint move.
    pub(super) fn due(&mut self) -> Vec<Instruction> {
        let calls = self.upkeep.due(self.cell);
        if !calls.is_empty() {
            self.place = None;
        }
        calls.into_iter().map(called).collect()
    }

    /// Counts a bead that was laid.
    pub(super) fn count(&mut self, pass: &Pass<'_>) {
        let time: f64 = (0..pass.move_count()).map(|i| self.time(pass, i)).sum();
        self.upkeep.count(time);
        for i in 0..pass.move_count() {
            if matches!(pass.move_at(i), Move::Spot { .. }) {
                continue;
            }
            let (length, speed) = (pass.move_length(i), self.speed(pass, i));
            self.spacing.count(length, speed, || Place {
                position: pass.points.get(i).map(DVec3::to_array),
                layer: Some(pass.layer),
                ..Place::default()
            });
        }
    }

    pub(super) fn count_bead(&mut self, pass: &Pass<'_>) {
        if pass.head.role.deposits() {
            *self.beads.entry(pass.layer).or_default() += 1;
        }
    }

    /// The pass as people count: the last bead counted, as a restart names it.
    pub(super) fn name(&self, pass: &Pass<'_>) -> String {
        match self.beads.get(&pass.layer) {
            Some(bead) if pass.head.role.deposits() => format!("Layer {} bead {bead}", pass.layer),
            _ => format!("Layer {} travel", pass.layer),
        }
    }

    /// What a pass grows over its path, mm.
    pub(super) fn growth(&self, pass: &Pass<'_>) -> f64 {
        self.profile(pass).height.max(0.0)
    }

    fn speed(&self, pass: &Pass<'_>, i: usize) -> f64 {
        let said = pass.value(Channel::Speed, i);
        said.unwrap_or(self.profile(pass).speed)
    }

    /// Time of a move, with what it waits, s.
    fn time(&self, pass: &Pass<'_>, i: usize) -> f64 {
        let stays = match pass.move_at(i) {
            Move::Spot { time } => time,
            Move::Line | Move::Arc { .. } => 0.0,
        };
        let dwell = pass.value(Channel::Dwell, i);
        let dwell = dwell.unwrap_or(self.profile(pass).dwell);
        pass.move_length(i) / self.speed(pass, i) + stays + dwell
    }

    /// A pass that begins where the one before ended, with the arc on: people are told its layer, and nothing else happens between the two.
    pub(super) fn goes_on(
        &mut self,
        pass: &Pass<'_>,
        (points, steps): (&[Point], &[Step]),
        goes_on: bool,
    ) {
        self.layer = Some(pass.layer);
        self.assembly
            .push(comment(&format!("Layer {}", pass.layer)));
        self.assembly.push(comment(&self.name(pass)));
        let first = steps.iter().find_map(moved).unwrap_or(0);
        let feed = self.feed(pass, first);
        let schedule = self.schedule(feed);
        self.follow(pass, steps, (Some(schedule), goes_on));
        self.laid(pass, points, goes_on);
    }

    /// Takes in the metal of a pass, and leaves it where it does not go on.
    pub(super) fn laid(&mut self, pass: &Pass<'_>, points: &[Point], goes_on: bool) {
        let growth = self.growth(pass);
        self.highest = self.highest.max(highest(points) + growth);
        self.flanks.lay(pass.layer, places(points), growth);
        if !goes_on {
            self.set_weave(0);
            self.leave(self.flanks.way(pass.layer));
        }
        self.count(pass);
    }

    /// Goes on to a layer, where it is another: what is due, the pause, and what tells people the layer.
    pub(super) fn layer(&mut self, layer: u32, mut due: Vec<Instruction>) {
        if self.layer != Some(layer) {
            if self.layer.is_some() {
                due.extend(self.pause());
            }
            if *self.cell.split == Split::Layer {
                due.push(self.wording.shown(&format!("Layer {layer}")));
                self.assembly.layer(layer, std::mem::take(&mut due));
            }
            due.push(comment(&format!("Layer {layer}")));
            self.layer = Some(layer);
        }
        for instruction in due {
            self.assembly.push(instruction);
        }
    }

    fn pause(&self) -> Vec<Instruction> {
        let wait = |seconds: f64| (seconds >= SHORTEST_WAIT).then_some(Instruction::Wait(seconds));
        match &self.settings.pause {
            Pause::None => Vec::new(),
            Pause::Wait(seconds) => wait(*seconds).into_iter().collect(),
            Pause::Call(program) => vec![called(program.clone())],
            Pause::Cooled(seconds) => {
                // a controller that runs ahead of its arm stops there
                let wait = wait(seconds.max(SHORTEST_WAIT));
                // `build` has found the words
                let input = self.wording.until_cooled().unwrap_or_default();
                wait.into_iter().chain(input).collect()
            }
        }
    }
}

fn called(program: String) -> Instruction {
    Instruction::Call {
        program,
        arguments: String::new(),
    }
}
