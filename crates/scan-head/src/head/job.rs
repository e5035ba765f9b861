//! What the head is asked to do: mark and jump vectors with their speeds, powers and waits, and the recipe they follow.
//!
//! Source: Rasoanarivo 2020, § 2.5.2 and 2.6; sky-writing: ours.

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Pass, Role, Toolpath};
use serde::{Deserialize, Serialize};

use crate::measures::energy::PowerLaw;

/// Why a job cannot be executed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScanJobError {
    /// A vector with a value that has no sense.
    #[error("vector {index}: {what} is {value}, but must be {wanted}")]
    Vector {
        /// Position in the job, from 0.
        index: usize,
        /// Which of its values.
        what: &'static str,
        /// That value.
        value: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// A recipe or plate with a value that has no sense.
    #[error("{what} is {value}, but must be {wanted}")]
    Value {
        /// Which value.
        what: &'static str,
        /// That value.
        value: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// Nothing to do.
    #[error("the job has no mark vector")]
    Empty,
}

/// What a vector is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VectorKind {
    /// Marks a contour.
    Contour,
    /// Marks a line of a fill.
    Fill,
    /// Goes elsewhere, laser off.
    Jump,
    /// Goes from one line of a fill to the next, laser off.
    Connection,
    /// Runs up to or out of a line at its speed, laser off (sky-writing).
    Run,
}

impl VectorKind {
    /// Whether the laser marks.
    pub fn is_mark(self) -> bool {
        matches!(self, VectorKind::Contour | VectorKind::Fill)
    }
}

/// A straight move from where the last one ended, and a wait at its end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Vector {
    /// What it is for.
    pub kind: VectorKind,
    /// Where it ends: x and y in the plane, z the height of the focus, mm.
    pub end: DVec3,
    /// Speed, mm/s.
    pub speed: f64,
    /// Laser power, W; 0 where the laser is off.
    pub power: f64,
    /// Wait at its end, s.
    pub wait: f64,
    /// The caller's number of the part or square it belongs to.
    pub block: u32,
}

/// A job for the head.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanJob {
    /// Where the head stands at first, mm.
    pub start: DVec3,
    /// The vectors, first executed first.
    pub vectors: Vec<Vector>,
}

/// Delays of the laser against the commanded marks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct LaserDelays {
    /// From the start of a chain of marks to laser on, s.
    pub on: f64,
    /// From its end to laser off, s.
    pub off: f64,
}

/// Run-up and run-out of fill lines, so that they are marked at constant speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SkyWriting {
    /// Time at the line's speed before the line, s.
    pub run_in: f64,
    /// Time at the line's speed after it, s.
    pub run_out: f64,
}

/// Speeds, powers, waits and delays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Name for people.
    pub name: String,
    /// Speed of contour marks, mm/s.
    pub contour_speed: f64,
    /// Speed of fill marks, mm/s.
    pub fill_speed: f64,
    /// Speed of jumps between contours, mm/s.
    pub contour_jump_speed: f64,
    /// Speed of jumps between contour and fill, and from part to part, mm/s.
    pub fill_jump_speed: f64,
    /// Power on contours, W.
    pub contour_power: f64,
    /// Power on fills, W.
    pub fill_power: f64,
    /// Wait after a jump, before a mark, s.
    pub jump_wait: f64,
    /// Wait after a mark, before a jump, s.
    pub mark_wait: f64,
    /// Wait between two marks of a chain, laser on, s.
    pub polygon_wait: f64,
    /// Delays of the laser.
    pub delays: LaserDelays,
    /// What the power follows.
    pub power_law: PowerLaw,
    /// Sky-writing of fill lines; lines have no waits then.
    pub sky_writing: Option<SkyWriting>,
}

impl Recipe {
    /// Checks every value.
    ///
    /// # Errors
    /// [`ScanJobError::Value`].
    pub fn check(&self) -> Result<(), ScanJobError> {
        let fail = |what, value, wanted| {
            Err(ScanJobError::Value {
                what,
                value,
                wanted,
            })
        };
        for (what, value) in [
            ("the contour speed", self.contour_speed),
            ("the fill speed", self.fill_speed),
            (
                "the speed of jumps between contours",
                self.contour_jump_speed,
            ),
            ("the speed of jumps to and from fills", self.fill_jump_speed),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return fail(what, value, "positive and finite (mm/s)");
            }
        }
        for (what, value) in [
            ("the contour power", self.contour_power),
            ("the fill power", self.fill_power),
            (
                "the least power with speed",
                match self.power_law {
                    PowerLaw::Constant => 0.0,
                    PowerLaw::WithSpeed { least } => least,
                },
            ),
            ("the wait after jumps", self.jump_wait),
            ("the wait after marks", self.mark_wait),
            ("the wait between marks", self.polygon_wait),
            ("the laser-on delay", self.delays.on),
            ("the laser-off delay", self.delays.off),
            (
                "the run-up of sky-writing",
                self.sky_writing.map_or(0.0, |s| s.run_in),
            ),
            (
                "the run-out of sky-writing",
                self.sky_writing.map_or(0.0, |s| s.run_out),
            ),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return fail(what, value, "finite and not negative");
            }
        }
        if let PowerLaw::WithSpeed { least } = self.power_law
            && least > self.contour_power.min(self.fill_power)
        {
            return fail(
                "the least power with speed",
                least,
                "at most the power of the marks (W)",
            );
        }
        Ok(())
    }
}

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

impl ScanJob {
    /// Checks every vector.
    ///
    /// # Errors
    /// [`ScanJobError`].
    pub fn check(&self) -> Result<(), ScanJobError> {
        if !self.vectors.iter().any(|v| v.kind.is_mark()) {
            return Err(ScanJobError::Empty);
        }
        for (index, v) in self.vectors.iter().enumerate() {
            let fail = |what, value, wanted| {
                Err(ScanJobError::Vector {
                    index,
                    what,
                    value,
                    wanted,
                })
            };
            if !v.end.is_finite() {
                return fail("the end", v.end.length(), "finite");
            }
            if !(v.speed > 0.0 && v.speed.is_finite()) {
                return fail("the speed", v.speed, "positive and finite (mm/s)");
            }
            if !(v.power >= 0.0 && v.power.is_finite()) {
                return fail("the power", v.power, "finite and not negative (W)");
            }
            if !(v.wait >= 0.0 && v.wait.is_finite()) {
                return fail("the wait", v.wait, "finite and not negative (s)");
            }
        }
        Ok(())
    }

    /// Where vector `i` starts, mm.
    pub fn start_of(&self, i: usize) -> DVec3 {
        if i == 0 {
            self.start
        } else {
            self.vectors[i - 1].end
        }
    }

    /// Length of vector `i`, mm.
    pub fn length_of(&self, i: usize) -> f64 {
        self.start_of(i).distance(self.vectors[i].end)
    }

    /// Length of all vectors of a kind, mm.
    pub fn length(&self, kind: VectorKind) -> f64 {
        (0..self.vectors.len())
            .filter(|&i| self.vectors[i].kind == kind)
            .map(|i| self.length_of(i))
            .sum()
    }

    /// Duration without the rounding of vectors to whole samples, s.
    pub fn duration(&self) -> f64 {
        (0..self.vectors.len())
            .map(|i| self.length_of(i) / self.vectors[i].speed + self.vectors[i].wait)
            .sum()
    }

    /// The first mark's start, mm.
    pub fn first_mark(&self) -> DVec3 {
        let first = self.vectors.iter().position(|v| v.kind.is_mark());
        first.map_or(self.start, |i| self.start_of(i))
    }

    /// The vectors of a range as a job of their own, from rest where the first one starts.
    #[must_use]
    pub fn slice(&self, range: std::ops::Range<usize>) -> ScanJob {
        ScanJob {
            start: self.start_of(range.start),
            vectors: self.vectors.get(range).unwrap_or_default().to_vec(),
        }
    }

    /// The job of planned passes.
    ///
    /// # Errors
    /// [`ScanJobError`].
    pub fn from_toolpath(toolpath: &Toolpath, recipe: &Recipe) -> Result<Self, ScanJobError> {
        let start = marked(toolpath).next().map_or(DVec3::ZERO, |p| p.points[0]);
        let mut builder = JobBuilder::new(recipe, start);
        builder.passes(toolpath);
        builder.finish()
    }
}

/// The passes that mark.
fn marked(toolpath: &Toolpath) -> impl Iterator<Item = &Pass> {
    toolpath
        .passes
        .iter()
        .filter(|p| p.role != Role::Travel && p.points.len() > 1)
}

impl JobBuilder<'_> {
    /// Adds planned passes: contours by role, everything else as fill; channels of speed and power override the recipe. A jump
    /// from a fill to a fill of the same part is a connection; moves without length are left out.
    pub fn passes(&mut self, toolpath: &Toolpath) {
        /// Chords of arcs stay this close, mm: below the encoder of any head.
        const CHORD: f64 = 5e-4;
        let mut before: Option<(bool, u32)> = None;
        for pass in marked(toolpath) {
            self.block(pass.tag.part);
            let contour = pass.role == Role::Contour;
            let jump = match before {
                Some((true, _)) if contour => Jump::BetweenContours,
                Some((false, part)) if !contour && part == pass.tag.part => Jump::BetweenLines,
                _ => Jump::ToFill,
            };
            before = Some((contour, pass.tag.part));
            let (kind, speed, power) = if contour {
                (
                    VectorKind::Contour,
                    self.recipe.contour_speed,
                    self.recipe.contour_power,
                )
            } else {
                (
                    VectorKind::Fill,
                    self.recipe.fill_speed,
                    self.recipe.fill_power,
                )
            };
            let channel = |c: &Option<Vec<f64>>, i: usize, default| {
                c.as_ref()
                    .and_then(|c| c.get(i).copied())
                    .unwrap_or(default)
            };
            if !contour && pass.moves.len() == 1 && pass.arc(0).is_none() {
                let (from, to) = (pass.points[0], pass.points[1]);
                if from != to {
                    let (speed, power) = (
                        channel(&pass.channels.speed, 0, speed),
                        channel(&pass.channels.power, 0, power),
                    );
                    self.line_at(from, to, jump, speed, power);
                }
                continue;
            }
            self.jump(pass.points[0], jump);
            for i in 0..pass.moves.len() {
                let speed = channel(&pass.channels.speed, i, speed);
                let power = channel(&pass.channels.power, i, power);
                if let Some(arc) = pass.arc(i) {
                    let n = arc.chords(CHORD);
                    for k in 1..n {
                        self.push(kind, arc.at(k as f64 / n as f64), speed, power);
                    }
                }
                if pass.points[i + 1] != self.at() {
                    self.push(kind, pass.points[i + 1], speed, power);
                }
            }
        }
    }
}
