//! What the head is asked to do: mark and jump vectors with their speeds, powers and waits, and the recipe they follow.
//!
//! Source: Rasoanarivo 2020, § 2.5.2 and 2.6; sky-writing: ours.

use crate::head::recipe::Recipe;
use crate::head::vector::{ScanJob, ScanJobError, Vector, VectorKind};
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Channel, Layer, Pass, Role};

/// Builds a job move by move, with the waits and the sky-writing of a recipe.
#[derive(Debug)]
pub struct JobBuilder<'a> {
    recipe: &'a Recipe,
    job: ScanJob,
    block: u32,
    /// Whether the last vector's wait was given with it.
    own_wait: bool,
}

impl<'a> JobBuilder<'a> {
    /// From rest at `start`, mm.
    pub fn new(recipe: &'a Recipe, start: DVec3) -> Self {
        JobBuilder {
            recipe,
            job: ScanJob {
                start,
                vectors: Vec::new(),
            },
            block: 0,
            own_wait: false,
        }
    }

    /// Number of vectors so far.
    pub fn count(&self) -> usize {
        self.job.vectors.len()
    }

    /// Where the head stands now, mm.
    pub fn at(&self) -> DVec3 {
        self.job.vectors.last().map_or(self.job.start, |v| v.end)
    }

    /// The number that the next vectors bear.
    pub fn block(&mut self, block: u32) {
        self.block = block;
    }

    fn push(&mut self, kind: VectorKind, end: DVec3, speed: f64, power: f64) {
        let r = self.recipe;
        let own = std::mem::take(&mut self.own_wait);
        if let Some(last) = self.job.vectors.last_mut()
            && !own
        {
            last.wait = match (last.kind, kind) {
                (a, b) if a.is_mark() && b.is_mark() => r.polygon_wait,
                (a, VectorKind::Jump | VectorKind::Connection) if a.is_mark() => r.mark_wait,
                (VectorKind::Jump, VectorKind::Run) => r.jump_wait,
                (VectorKind::Jump | VectorKind::Connection, b) if b.is_mark() => r.jump_wait,
                _ => 0.0,
            };
        }
        self.job.vectors.push(Vector {
            kind,
            end,
            speed,
            power,
            wait: 0.0,
            block: self.block,
        });
    }

    /// Jumps, laser off; nothing where it stands there already. `between_contours` chooses the jump's speed.
    pub fn jump(&mut self, end: DVec3, jump: Jump) {
        if end != self.at() {
            let (kind, speed) = match jump {
                Jump::BetweenContours => (VectorKind::Jump, self.recipe.contour_jump_speed),
                Jump::ToFill => (VectorKind::Jump, self.recipe.fill_jump_speed),
                Jump::BetweenLines => (VectorKind::Connection, self.recipe.fill_jump_speed),
            };
            self.push(kind, end, speed, 0.0);
        }
    }

    /// Marks along a contour.
    pub fn contour(&mut self, end: DVec3) {
        self.push(
            VectorKind::Contour,
            end,
            self.recipe.contour_speed,
            self.recipe.contour_power,
        );
    }

    /// A vector as given; what is not given comes from the recipe.
    pub fn vector(&mut self, kind: VectorKind, end: DVec3, given: Given) {
        let r = self.recipe;
        let speed = given.speed.unwrap_or(match kind {
            VectorKind::Contour => r.contour_speed,
            VectorKind::Fill | VectorKind::Run => r.fill_speed,
            VectorKind::Jump | VectorKind::Connection => r.fill_jump_speed,
        });
        let power = match kind {
            VectorKind::Contour => given.power.unwrap_or(r.contour_power),
            VectorKind::Fill => given.power.unwrap_or(r.fill_power),
            _ => 0.0,
        };
        self.push(kind, end, speed, power);
        if let (Some(wait), Some(last)) = (given.wait, self.job.vectors.last_mut()) {
            last.wait = wait;
            self.own_wait = true;
        }
    }

    /// Marks a line of a fill from `start`, reached by a jump of the given kind, with sky-writing where the recipe has it.
    pub fn line(&mut self, start: DVec3, end: DVec3, jump: Jump) {
        let (speed, power) = (self.recipe.fill_speed, self.recipe.fill_power);
        self.line_at(start, end, jump, speed, power);
    }

    /// The same at a speed and power of its own.
    fn line_at(&mut self, start: DVec3, end: DVec3, jump: Jump, speed: f64, power: f64) {
        let along = (end - start).normalize_or_zero() * speed;
        let Some(sky) = self.recipe.sky_writing else {
            self.jump(start, jump);
            self.push(VectorKind::Fill, end, speed, power);
            return;
        };
        self.jump(start - along * sky.run_in, jump);
        self.push(VectorKind::Run, start, speed, 0.0);
        self.push(VectorKind::Fill, end, speed, power);
        self.push(VectorKind::Run, end + along * sky.run_out, speed, 0.0);
    }

    /// The job.
    ///
    /// # Errors
    /// [`ScanJobError`] where it marks nothing or has a vector without sense.
    pub fn finish(self) -> Result<ScanJob, ScanJobError> {
        self.recipe.check()?;
        self.job.check()?;
        Ok(self.job)
    }
}

/// Values of a vector that replace the recipe's.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Given {
    /// Speed, mm/s.
    pub speed: Option<f64>,
    /// Power of a mark, W.
    pub power: Option<f64>,
    /// Wait at its end, s.
    pub wait: Option<f64>,
}

/// Where a jump goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Jump {
    /// From contour to contour.
    BetweenContours,
    /// Between contour and fill, or from part to part.
    ToFill,
    /// From one line of a fill to the next.
    BetweenLines,
}

/// Whether the laser marks along a pass.
fn marks(pass: &Pass<'_>) -> bool {
    pass.head.role.deposits() && pass.move_count() > 0
}

/// Chords of arcs stay this close, mm: below the encoder of any head.
const CHORD: f64 = 5e-4;

/// The ends of the vectors that make move `i` of a pass: chords where it is an arc.
fn ends(pass: &Pass<'_>, i: usize) -> impl Iterator<Item = DVec3> {
    let arc = pass.arc(i);
    let n = arc.as_ref().map_or(1, |a| a.chords(CHORD).max(1));
    let inner = (1..n).filter_map(move |k| Some(arc.as_ref()?.at(k as f64 / n as f64)));
    inner.chain([pass.points[i + 1]])
}

impl JobBuilder<'_> {
    /// Adds the passes of a layer. A layer that says its jumps is executed as it says, from the values of its channels and, where
    /// they say nothing, of the recipe; a first jump that goes nowhere says where the head stands. Between the passes of any other
    /// layer the recipe jumps.
    pub fn layer(&mut self, layer: &Layer) {
        if layer.has(Role::Jump) {
            self.said(layer);
        } else {
            self.planned(layer);
        }
    }

    /// Adds the passes of a layer that says its jumps.
    fn said(&mut self, layer: &Layer) {
        for (number, pass) in layer.passes().enumerate() {
            self.block(pass.head.part);
            let kind = match pass.head.role {
                Role::Contour | Role::Skin => VectorKind::Contour,
                Role::Fill | Role::Support => VectorKind::Fill,
                Role::Jump | Role::Travel => VectorKind::Jump,
                Role::Connection => VectorKind::Connection,
                Role::Run => VectorKind::Run,
            };
            // it stands there already
            let stands = number == 0 && self.count() == 0 && pass.points.get(1) == Some(&self.at());
            for i in usize::from(stands)..pass.move_count() {
                let given = Given {
                    speed: pass.value(Channel::Speed, i),
                    power: pass.value(Channel::Power, i),
                    wait: pass.value(Channel::Dwell, i),
                };
                for end in ends(&pass, i) {
                    let wait = given.wait.filter(|_| end == pass.points[i + 1]);
                    self.vector(kind, end, Given { wait, ..given });
                }
            }
        }
    }

    /// Adds planned passes: contours by role, everything else as fill; channels of speed and power override the recipe. A jump
    /// from a fill to a fill of the same part is a connection; moves without length are left out.
    fn planned(&mut self, layer: &Layer) {
        let mut before: Option<(bool, u32)> = None;
        for pass in layer.passes().filter(marks) {
            let part = pass.head.part;
            self.block(part);
            let contour = pass.head.role == Role::Contour;
            let jump = match before {
                Some((true, _)) if contour => Jump::BetweenContours,
                Some((false, last)) if !contour && last == part => Jump::BetweenLines,
                _ => Jump::ToFill,
            };
            before = Some((contour, part));
            let r = self.recipe;
            let (kind, speed, power) = if contour {
                (VectorKind::Contour, r.contour_speed, r.contour_power)
            } else {
                (VectorKind::Fill, r.fill_speed, r.fill_power)
            };
            let values = |i: usize| {
                (
                    pass.value(Channel::Speed, i).unwrap_or(speed),
                    pass.value(Channel::Power, i).unwrap_or(power),
                )
            };
            if !contour && pass.move_count() == 1 && pass.arc(0).is_none() {
                let (from, to) = (pass.points[0], pass.points[1]);
                if from != to {
                    let (speed, power) = values(0);
                    self.line_at(from, to, jump, speed, power);
                }
                continue;
            }
            self.jump(pass.points[0], jump);
            for i in 0..pass.move_count() {
                let (speed, power) = values(i);
                for end in ends(&pass, i) {
                    if end != self.at() {
                        self.push(kind, end, speed, power);
                    }
                }
            }
        }
    }
}
