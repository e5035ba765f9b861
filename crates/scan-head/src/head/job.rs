//! What a head makes of the layers of a toolpath: the speeds, powers, waits, jumps and sky-writing of a recipe, vector by vector.
//!
//! Source: Rasoanarivo 2020, § 2.5.2 and 2.6; sky-writing: ours.

use std::borrow::Cow;

use crate::head::error::HeadError;
use crate::head::prepared::{Layers, Prepared};
use crate::head::recipe::Recipe;
use crate::head::vector::{ScanJob, ScanJobError, Vector};
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Channel, Layer, Pass, Role};

/// The layers of a toolpath, first executed first, as they come from memory or from a file.
pub type Planned<'a> = Box<dyn Iterator<Item = Result<Cow<'a, Layer>, HeadError>> + Send + 'a>;

/// Prepares layers for a head, one after the other. A layer that says its jumps is executed as it says, from the values of its
/// channels and, where they say nothing, of the recipe; a first jump that goes nowhere says where the head stands. Between the passes
/// of any other layer the recipe jumps, contours go by their role and everything else that melts as fill, and moves without length are
/// left out. What the last vector of a layer waits hangs on what comes next: two layers are held at a time.
///
/// # Errors
/// [`ScanJobError`] where the recipe has no sense.
pub fn prepare_layers<'a>(
    layers: Planned<'a>,
    recipe: &'a Recipe,
) -> Result<Layers<'a>, ScanJobError> {
    recipe.check()?;
    let mut layers = layers.fuse();
    let mut builder = JobBuilder::new(recipe);
    Ok(Box::new(std::iter::from_fn(move || {
        loop {
            match layers.next() {
                Some(Ok(layer)) => {
                    if let Some(before) = builder.layer(&layer) {
                        return Some(Ok(before));
                    }
                }
                Some(Err(e)) => return Some(Err(e)),
                None => return builder.now.take().map(Ok),
            }
        }
    })))
}

/// Layers as one job for a head, as [`prepare_layers`] makes it.
///
/// # Errors
/// [`HeadError::Job`] where nothing is marked, or a vector or the recipe has no sense.
pub fn prepare(layers: &[Layer], recipe: &Recipe) -> Result<ScanJob, HeadError> {
    let planned = layers.iter().map(|l| Ok(Cow::Borrowed(l)));
    let mut whole: Option<ScanJob> = None;
    for layer in prepare_layers(Box::new(planned), recipe)? {
        let job = layer?.job;
        match &mut whole {
            Some(whole) => whole.vectors.extend(job.vectors),
            None => whole = Some(job),
        }
    }
    let whole = whole.ok_or(ScanJobError::Empty)?;
    whole.check()?;
    Ok(whole)
}

/// Builds layers move by move, with the waits and the sky-writing of a recipe.
struct JobBuilder<'a> {
    recipe: &'a Recipe,
    /// The layer that is built, and the one before it, which waits for its last wait.
    now: Option<Prepared>,
    before: Option<Prepared>,
    /// Where the head stands now, mm.
    at: DVec3,
    block: u32,
    /// Whether the last vector's wait was given with it.
    own_wait: bool,
}

impl<'a> JobBuilder<'a> {
    fn new(recipe: &'a Recipe) -> Self {
        JobBuilder {
            recipe,
            now: None,
            before: None,
            at: DVec3::ZERO,
            block: 0,
            own_wait: false,
        }
    }

    /// Adds a layer; the one before it comes back, complete.
    fn layer(&mut self, layer: &Layer) -> Option<Prepared> {
        let first = layer.passes().find(|p| p.move_count() > 0);
        let start = first.map_or(DVec3::ZERO, |p| p.points[0]);
        self.before = self.now.take();
        if self.before.is_none() {
            self.at = start;
        }
        self.now = Some(Prepared {
            first: self.before.as_ref().map_or(0, Prepared::end),
            number: layer.number,
            height: layer.height,
            job: ScanJob {
                start: self.at,
                vectors: Vec::new(),
            },
        });
        if layer.has(Role::Jump) {
            self.said(layer);
        } else {
            // even where it stands there already: light never lasts from layer to layer
            if self.before.is_some() {
                self.vector(Role::Jump, start, Given::default());
            }
            self.planned(layer);
        }
        if let Some(now) = &mut self.now {
            now.job.vectors.shrink_to_fit();
        }
        self.before.take()
    }

    /// The last vector, of whichever layer.
    fn last(&mut self) -> Option<&mut Vector> {
        let now = self.now.iter_mut().filter(|l| !l.job.vectors.is_empty());
        let layer = now.chain(&mut self.before).next()?;
        layer.job.vectors.last_mut()
    }

    fn push(&mut self, kind: Role, end: DVec3, speed: f64, power: f64) {
        let r = self.recipe;
        let own = std::mem::take(&mut self.own_wait);
        if let Some(last) = self.last()
            && !own
        {
            last.wait = match (last.kind, kind) {
                (a, b) if a.deposits() && b.deposits() => r.polygon_wait,
                (a, Role::Jump | Role::Connection) if a.deposits() => r.mark_wait,
                (Role::Jump, Role::Run) => r.jump_wait,
                (Role::Jump | Role::Connection, b) if b.deposits() => r.jump_wait,
                _ => 0.0,
            };
        }
        self.at = end;
        let block = self.block;
        if let Some(now) = &mut self.now {
            now.job.vectors.push(Vector {
                kind,
                end,
                speed,
                power,
                wait: 0.0,
                block,
            });
        }
    }

    /// Jumps, laser off; nothing where it stands there already. `between_contours` chooses the jump's speed.
    fn jump(&mut self, end: DVec3, jump: Jump) {
        if end != self.at {
            let (kind, speed) = match jump {
                Jump::BetweenContours => (Role::Jump, self.recipe.contour_jump_speed),
                Jump::ToFill => (Role::Jump, self.recipe.fill_jump_speed),
                Jump::BetweenLines => (Role::Connection, self.recipe.fill_jump_speed),
            };
            self.push(kind, end, speed, 0.0);
        }
    }

    /// A vector as given; what is not given comes from the recipe.
    fn vector(&mut self, kind: Role, end: DVec3, given: Given) {
        let r = self.recipe;
        let speed = given.speed.unwrap_or(match kind {
            Role::Contour => r.contour_speed,
            Role::Fill | Role::Run => r.fill_speed,
            _ => r.fill_jump_speed,
        });
        let power = match kind {
            Role::Contour => given.power.unwrap_or(r.contour_power),
            Role::Fill => given.power.unwrap_or(r.fill_power),
            _ => 0.0,
        };
        self.push(kind, end, speed, power);
        if let (Some(wait), Some(last)) = (given.wait, self.last()) {
            last.wait = wait;
            self.own_wait = true;
        }
    }

    /// Marks a line of a fill from `start`, reached by a jump of the given kind, with sky-writing where the recipe has it.
    fn line_at(&mut self, start: DVec3, end: DVec3, jump: Jump, speed: f64, power: f64) {
        let along = (end - start).normalize_or_zero() * speed;
        let Some(sky) = self.recipe.sky_writing else {
            self.jump(start, jump);
            self.push(Role::Fill, end, speed, power);
            return;
        };
        self.jump(start - along * sky.run_in, jump);
        self.push(Role::Run, start, speed, 0.0);
        self.push(Role::Fill, end, speed, power);
        self.push(Role::Run, end + along * sky.run_out, speed, 0.0);
    }
}

/// Values of a vector that replace the recipe's.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Given {
    /// Speed, mm/s.
    speed: Option<f64>,
    /// Power of a mark, W.
    power: Option<f64>,
    /// Wait at its end, s.
    wait: Option<f64>,
}

/// Where a jump goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Jump {
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
    /// Adds the passes of a layer that says its jumps.
    fn said(&mut self, layer: &Layer) {
        for (number, pass) in layer.passes().enumerate() {
            self.block = pass.head.part;
            let kind = match pass.head.role {
                Role::Skin => Role::Contour,
                Role::Support => Role::Fill,
                Role::Travel => Role::Jump,
                same => same,
            };
            // it stands there already
            let stands =
                number == 0 && self.last().is_none() && pass.points.get(1) == Some(&self.at);
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
            self.block = part;
            let contour = pass.head.role == Role::Contour;
            let jump = match before {
                Some((true, _)) if contour => Jump::BetweenContours,
                Some((false, last)) if !contour && last == part => Jump::BetweenLines,
                _ => Jump::ToFill,
            };
            before = Some((contour, part));
            let r = self.recipe;
            let (kind, speed, power) = if contour {
                (Role::Contour, r.contour_speed, r.contour_power)
            } else {
                (Role::Fill, r.fill_speed, r.fill_power)
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
                    if end != self.at {
                        self.push(kind, end, speed, power);
                    }
                }
            }
        }
    }
}
