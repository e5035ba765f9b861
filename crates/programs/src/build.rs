//! From a toolpath to programs: travels, approaches, arc words, speeds, comments, pauses.
//!
//! For each bead: along a travel at clearance above the highest surface so far (the highest point of any bead so far and of the next,
//! plus its expected height), down to the start, FINE and arc on there; the bead with the job's smoothing; FINE and arc off at its end;
//! up again. Between beads on a flank, whose torch leans by more than 45°, it draws back along the torch instead. All these are linear moves, so that the simulation knows their path; the first move alone is a joint move. Travel passes
//! of the toolpath are followed without arc. The comments `Layer n` and `Pass n` tell what follows, to people and to
//! [`crate::read_toolpath`].

mod between;
mod check;
mod coordination;
mod error;
mod flank;
mod partial;
mod pieces;
mod service;
mod steps;
mod travel;
mod weaving;
mod wording;

use std::collections::{BTreeMap, BTreeSet};

use meltpath_base::{Ratio, Reporter};
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Channel, Move, Pass, Profile, Toolpath};

use crate::assembly::{Assembly, comment};
use crate::cell::CellProgramming;
use crate::held::Standing;
use coordination::Coordination;
pub use coordination::{check_axes, tell};
pub use error::BuildError;
use flank::Flanks;
use partial::before;
pub use partial::{Restart, dry_run, laid_from};
use service::Upkeep;
use steps::MOST_AXES;
pub use wording::check_cell;
use wording::{RESOLUTION, SHORTEST_WAIT, Wording};

use crate::orientation::{axis_of_wpr, wpr_of_axis};
use crate::program::{
    ArcAction, ArcWord, COORDINATED, Dialect, Instruction, MotionInstruction, MotionKind,
    PositionRef, Program, Speed, Termination,
};
use crate::spacing::Spacing;

/// What happens after each layer.
#[derive(Debug, Clone, PartialEq)]
pub enum Pause {
    /// Nothing.
    None,
    /// Waits, s.
    Wait(f64),
    /// Calls a program of the cell, which cools, measures or asks.
    Call(String),
    /// Waits, s, and then for the cell's input that tells that the layer has cooled.
    Cooled(f64),
}

/// What the job says about its programs.
#[derive(Debug, Clone, PartialEq)]
pub struct BuildSettings {
    /// What to call them.
    pub name: String,
    /// Comment in the header.
    pub comment: String,
    /// What to write them for.
    pub dialect: Dialect,
    /// Smoothing inside a bead (FANUC CNT).
    pub smoothing: Ratio,
    /// After each layer.
    pub pause: Pause,
    /// The bead to begin with; `None` lays all. What was laid before it is taken to stand, and the schedules keep their numbers.
    pub from: Option<Restart>,
    /// What the names of programs tell besides, such as `DRY`; empty for programs of the whole.
    pub variant: String,
    /// Where everything stands while the robot holds the part; nothing where it holds the torch.
    pub standing: Option<Standing>,
}

/// A weld schedule that the operator sets on the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    /// Its number.
    pub number: u32,
    /// Programmed wire feed speed, mm/s.
    pub wire_feed: f64,
}

/// Programs with the schedules they refer to.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// The programs, main first.
    pub programs: Vec<Program>,
    /// The schedules.
    pub schedules: Vec<Schedule>,
}

/// Makes the programs of a toolpath.
///
/// # Errors
/// [`BuildError`] where the toolpath is empty or lacks the bead to begin with, a pass is not finite or has no speed, or the cell is unsound.
pub fn build(
    toolpath: &Toolpath,
    cell: &CellProgramming,
    settings: &BuildSettings,
    reporter: &Reporter,
) -> Result<Built, BuildError> {
    if toolpath.pass_count() == 0 {
        return Err(BuildError::Empty);
    }
    let wording = Wording::new(cell, settings.dialect)?;
    if let Pause::Cooled(_) = settings.pause {
        wording.until_cooled()?;
    }
    let title = (settings.name.as_str(), settings.variant.as_str());
    let coordination = Coordination::of(toolpath, cell, settings.dialect)?;
    let turns = coordination
        .as_ref()
        .is_some_and(|c| c.positioner.is_some());
    if turns && settings.standing.is_some() {
        return Err(BuildError::TurnsWhatIsHeld);
    }
    let mut builder = Builder {
        toolpath,
        cell,
        wording,
        settings,
        reporter,
        assembly: Assembly::new(cell, settings.dialect, title, &settings.comment)
            .coordinated(
                coordination
                    .as_ref()
                    .map_or((None, None), |c| (c.track, c.positioner)),
            )
            .standing(settings.standing),
        coordination,
        schedules: Vec::new(),
        told: BTreeSet::new(),
        needed: Vec::new(),
        upkeep: Upkeep::new(cell)?,
        spacing: Spacing::new(cell, settings.dialect),
        layer: None,
        highest: f64::NEG_INFINITY,
        flanks: Flanks::of(toolpath),
        flank: None,
        place: None,
        weave: 0,
        beads: BTreeMap::new(),
    };
    let skipped = settings.from.map_or(Ok(0), |at| before(toolpath, at))?;
    let passes = toolpath.layers.iter();
    let passes = passes.flat_map(|layer| layer.passes().map(|pass| (layer.height, pass)));
    let mut passes = passes.enumerate().peekable();
    let ends = |pass: &Pass<'_>, i: usize| Some((pass.head.id, *pass.points.get(i)?));
    let mut before = None;
    while let Some((i, (height, pass))) = passes.next() {
        let begin = ends(&pass, 0);
        let end = ends(&pass, pass.points.len() - 1);
        let next = passes.peek().and_then(|(_, (_, next))| ends(next, 0));
        let joined = Joined {
            to_last: i > skipped && begin == before,
            to_next: end == next,
        };
        before = end;
        builder.check(&pass)?;
        builder.count_schedules(&pass)?;
        builder.count_bead(&pass);
        if i < skipped {
            builder.stands(&pass, height);
        } else {
            builder.pass(&pass, height, joined);
        }
    }
    builder.spacing.tell(reporter);
    Ok(Built {
        programs: builder.assembly.finish(),
        schedules: builder.schedules,
    })
}

/// A point of a pass as the program will hold it.
#[derive(Clone, Copy)]
struct Point {
    position: DVec3,
    wpr: [f64; 3],
    /// Track and positioner's axes, mm and deg.
    axes: [f64; MOST_AXES],
}

struct Builder<'a> {
    toolpath: &'a Toolpath,
    cell: &'a CellProgramming,
    wording: Wording<'a>,
    settings: &'a BuildSettings,
    reporter: &'a Reporter,
    assembly: Assembly<'a>,
    /// What moves with the arm, where something does.
    coordination: Option<Coordination<'a>>,
    schedules: Vec<Schedule>,
    /// Numbers of those that a comment tells.
    told: BTreeSet<u32>,
    /// What the cell does between beads.
    upkeep: Upkeep,
    /// Moves too short for the controller.
    spacing: Spacing,
    /// The schedules that all passes need, so far.
    needed: Vec<Schedule>,
    layer: Option<u32>,
    /// Highest surface so far, mm.
    highest: f64,
    /// Metal and layers on flanks.
    flanks: Flanks,
    /// The direction out of the flank that the tool is beyond all metal of.
    flank: Option<DVec3>,
    /// Where the tool is.
    place: Option<Point>,
    /// The weave that is on, by its number in the toolpath; 0 for none.
    weave: u32,
    /// Beads of each layer so far.
    beads: BTreeMap<u32, u32>,
}

impl Point {
    fn at_height(self, z: f64) -> Point {
        let position = self.position.with_z(z);
        Point { position, ..self }
    }

    /// So far back along the torch, mm.
    fn drawn_back(self, distance: f64) -> Point {
        let position = self.position + distance * axis_of_wpr(self.wpr);
        let position = rounded(position, 0.0);
        Point { position, ..self }
    }
}

/// Whether a pass goes on from the one before and into the next, with the arc on: they have one identifier, and the one begins where the other
/// ends.
#[derive(Clone, Copy)]
struct Joined {
    to_last: bool,
    to_next: bool,
}

/// One thing to do along a pass.
enum Step {
    /// Move number `index` of the pass.
    Move {
        index: usize,
        via: Option<Point>,
        to: Point,
    },
    /// Stay, s.
    Wait(f64),
}

/// The move of a step that moves.
fn moved(step: &Step) -> Option<usize> {
    match step {
        Step::Move { index, .. } => Some(*index),
        Step::Wait(_) => None,
    }
}

/// A position as the program's digits hold it, mm.
fn rounded(position: DVec3, height: f64) -> DVec3 {
    ((position + DVec3::Z * height) / RESOLUTION).round() * RESOLUTION
}

impl Builder<'_> {
    /// The profile of a pass that was checked.
    fn profile(&self, pass: &Pass<'_>) -> &Profile {
        &self.toolpath.profiles[usize::from(pass.head.profile)]
    }

    /// The number of the schedule that sets a wire feed.
    fn numbered(&mut self, wire_feed: f64) -> u32 {
        // `count_schedules` has made sure that the cell has enough of them
        let known = self.schedules.iter().find(|s| s.wire_feed == wire_feed);
        if let Some(schedule) = known {
            return schedule.number;
        }
        let taken = |n: u32| self.schedules.iter().any(|s| s.number == n);
        let number = self.wording.number(wire_feed, taken).unwrap_or(0);
        self.schedules.push(Schedule { number, wire_feed });
        number
    }

    /// The same, told where it comes first.
    fn schedule(&mut self, wire_feed: f64) -> u32 {
        let number = self.numbered(wire_feed);
        if self.told.insert(number) {
            self.assembly.push(comment(&format!(
                "Schedule {number} WFS {:.2} m/min",
                wire_feed * 0.06
            )));
        }
        number
    }

    fn motion(
        &mut self,
        kind: MotionKind,
        point: Point,
        speed: Speed,
        termination: Termination,
        arc: Option<ArcWord>,
    ) {
        let plain = self.plain(kind, point, speed, termination);
        self.assembly
            .push(Instruction::Motion(MotionInstruction { arc, ..plain }));
    }

    /// A move that switches nothing.
    fn plain(
        &mut self,
        kind: MotionKind,
        point: Point,
        speed: Speed,
        termination: Termination,
    ) -> MotionInstruction {
        let target = self.target(point);
        self.place = Some(point);
        let extra = match (&self.coordination, &kind, self.settings.dialect) {
            (
                Some(Coordination {
                    positioner: Some(_),
                    ..
                }),
                MotionKind::Linear | MotionKind::Circular { .. },
                dialect,
            ) if dialect.tells_stations_apart() => vec![COORDINATED.to_owned()],
            _ => Vec::new(),
        };
        MotionInstruction {
            extra,
            ..MotionInstruction::plain(kind, target, speed, termination)
        }
    }

    /// A move by a path, in as many pieces as the controller needs.
    fn along(
        &mut self,
        (via, to): (Option<Point>, Point),
        speed: &Speed,
        termination: Termination,
        arc: Option<ArcWord>,
    ) {
        let mut pieces = self.pieces(via, to);
        let last = pieces.pop().unwrap_or((via, to));
        let kind = |builder: &mut Self, via: Option<Point>| {
            via.map_or(MotionKind::Linear, |v| MotionKind::Circular {
                via: builder.target(v),
            })
        };
        for (via, end) in pieces {
            let kind = kind(self, via);
            let smoothed = self.wording.smoothed(self.settings.smoothing);
            self.motion(kind, end, speed.clone(), smoothed, None);
        }
        let kind = kind(self, last.0);
        self.motion(kind, last.1, speed.clone(), termination, arc);
    }

    /// The axes beside the arm at a point of a pass, mm and deg; zeros where none moves.
    fn axes_at(&self, pass: &Pass<'_>, i: usize) -> [f64; MOST_AXES] {
        let told = self.coordination.as_ref();
        told.map_or([0.0; MOST_AXES], |c| c.steps.at(pass, i))
    }

    /// The same halfway along move `index`.
    fn axes_between(&self, pass: &Pass<'_>, index: usize) -> [f64; MOST_AXES] {
        let ends = [index, index + 1].map(|i| self.axes_at(pass, i));
        let told = self.coordination.as_ref();
        told.map_or(ends[0], |c| c.steps.halfway(ends[0], ends[1]))
    }

    /// The position of a point, with the axes that move with the arm.
    fn target(&mut self, point: Point) -> PositionRef {
        let Some(coordination) = &self.coordination else {
            return self.assembly.point(point.position, point.wpr, &[]);
        };
        let (position, wpr) = coordination.told(point.position, point.wpr, &point.axes);
        let axes = point.axes.get(..coordination.count());
        self.assembly.point(position, wpr, axes.unwrap_or_default())
    }

    fn line(&mut self, point: Point, speed: f64, termination: Termination, arc: Option<ArcWord>) {
        let speed = self.wording.speed(speed);
        self.along((None, point), &speed, termination, arc);
    }

    /// The points of a pass whose layer lies `height` mm over the part's z = 0.
    fn points(&self, pass: &Pass<'_>, height: f64) -> Vec<Point> {
        let default = self.cell.orientation.degrees();
        let at = |(i, &position): (usize, &DVec3)| Point {
            position: rounded(position, height),
            wpr: pass
                .axis(i)
                .map_or(default, |axis| wpr_of_axis(default, axis)),
            axes: self.axes_at(pass, i),
        };
        pass.points.iter().enumerate().map(at).collect()
    }

    fn feed(&self, pass: &Pass<'_>, index: usize) -> f64 {
        let said = pass.value(Channel::WireFeed, index);
        said.unwrap_or(self.profile(pass).wire_feed)
    }

    /// What to do along a pass, moves below the program's digits left out.
    fn steps(&self, pass: &Pass<'_>, points: &[Point], height: f64) -> Vec<Step> {
        let mut steps = Vec::new();
        let wait = |steps: &mut Vec<Step>, seconds: f64| {
            if seconds > 0.0 && seconds.is_finite() {
                // controllers wait in hundredths of a second
                let hundredths = (seconds / SHORTEST_WAIT).round().max(1.0);
                steps.push(Step::Wait(hundredths * SHORTEST_WAIT));
            }
        };
        let Some(mut from) = points.first().map(|p| p.position) else {
            return steps;
        };
        for (index, pair) in points.windows(2).enumerate() {
            let to = pair[1];
            let shape = pass.move_at(index);
            let via = match shape {
                Move::Arc { via } => {
                    let position = rounded(via, height);
                    let middle = 0.5 * (from + to.position);
                    // what the program's digits make of a flat arc is a line
                    let round = Arc::through(from, position, to.position)
                        .filter(|_| middle.distance(position) > 2.0 * RESOLUTION);
                    round.map(|_| Point {
                        position,
                        wpr: self.between(pass, index),
                        axes: self.axes_between(pass, index),
                    })
                }
                Move::Line | Move::Spot { .. } => None,
            };
            if via.is_some() || from.distance(to.position) >= 0.5 * RESOLUTION {
                steps.push(Step::Move { index, via, to });
                from = to.position;
            }
            if let Move::Spot { time } = shape {
                wait(&mut steps, time);
            }
            let dwell = pass.value(Channel::Dwell, index);
            wait(&mut steps, dwell.unwrap_or(self.profile(pass).dwell));
        }
        steps
    }

    /// Orientation halfway along move `index`.
    fn between(&self, pass: &Pass<'_>, index: usize) -> [f64; 3] {
        let default = self.cell.orientation.degrees();
        match (pass.axis(index), pass.axis(index + 1)) {
            (Some(a), Some(b)) => wpr_of_axis(default, a.normalize_or(a) + b.normalize_or(b)),
            _ => default,
        }
    }

    /// Executes the steps of a pass from its start; with `schedule` the arc is on and goes off at the end, where the pass does not go on.
    fn follow(
        &mut self,
        pass: &Pass<'_>,
        steps: &[Step],
        (mut schedule, goes_on): (Option<u32>, bool),
    ) {
        let profile_speed = self.profile(pass).speed;
        for (k, step) in steps.iter().enumerate() {
            if !self.assembly.takes(4, 4) {
                self.assembly.cut();
                if schedule.is_some() {
                    self.reporter.warn(
                        "pass-cut",
                        format!(
                            "{} is longer than a program of this cell: it goes on in the next, arc on",
                            pass.place()
                        ),
                        "raise lines_per_program and points_per_program in the cell file if the controller allows",
                    );
                }
            }
            if pass.head.role.deposits() {
                self.swing(pass, &steps[k..]);
            }
            let next = steps.get(k + 1);
            let stops = match next {
                Some(step) => moved(step).is_none(),
                None => !goes_on,
            };
            let arc = match (schedule, steps[k + 1..].iter().find_map(moved)) {
                (Some(current), Some(index)) => {
                    let feed = self.feed(pass, index);
                    let coming = self.schedule(feed);
                    schedule = Some(coming);
                    (coming != current).then(|| self.wording.word(ArcAction::Start, coming))
                }
                (Some(current), None) if next.is_none() && !goes_on => {
                    schedule = None;
                    Some(self.wording.word(ArcAction::End, current))
                }
                _ => None,
            };
            match *step {
                Step::Move { index, via, to } => {
                    let stops = stops || (arc.is_some() && self.wording.stands_for_arc());
                    let termination = match (stops, pass.head.role.deposits()) {
                        (true, _) => Termination::Fine,
                        (false, false) => self.wording.smoothed(*self.cell.travel_smoothing),
                        (false, true) => self.wording.smoothed(self.settings.smoothing),
                    };
                    let speed = pass.value(Channel::Speed, index).unwrap_or(profile_speed);
                    let speed = self.wording.speed(speed);
                    self.along((via, to), &speed, termination, arc);
                }
                Step::Wait(seconds) => {
                    self.assembly.push(Instruction::Wait(seconds));
                    if let Some(word) = arc {
                        self.assembly.push(Instruction::Arc(word));
                    }
                }
            }
        }
    }

    /// A checked pass of a layer that lies `height` mm over the part's z = 0.
    fn pass(&mut self, pass: &Pass<'_>, height: f64, joined: Joined) {
        let points = self.points(pass, height);
        // a pass has a point
        let start = points[0];
        let top = highest(&points);
        let steps = self.steps(pass, &points, height);
        if steps.is_empty() {
            self.reporter.warn(
                "pass-too-short",
                format!(
                    "{} is shorter than a program's digits: left out",
                    pass.place()
                ),
                "",
            );
            return;
        }
        if joined.to_last {
            self.goes_on(pass, (&points, &steps), joined.to_next);
            return;
        }
        let due = if pass.head.role.deposits() {
            self.due()
        } else {
            Vec::new()
        };
        let (lines, points_of_bead) = (steps.len() * 2 + 12 + due.len(), steps.len() * 2 + 4);
        let way = self.flanks.way(pass.layer);
        let heights = [*self.cell.approach_height, *self.cell.retract_height];
        let more = heights.iter().flatten().count() + usize::from(way.is_some());
        if !self.assembly.takes(lines, points_of_bead + more) {
            self.assembly.cut();
        }
        // the travel to a bead clears what it will be, too: the nozzle is wider than the wire
        self.highest = self.highest.max(top);
        self.flanks.lay(pass.layer, places(&points), 0.0);
        self.layer(pass.layer, due);
        self.assembly.push(comment(&self.name(pass)));
        if pass.head.role.deposits() {
            let first = steps.iter().find_map(moved).unwrap_or(0);
            let feed = self.feed(pass, first);
            let schedule = self.schedule(feed);
            let on = self.wording.word(ArcAction::Start, schedule);
            self.strike(start, way, on);
            self.follow(pass, &steps, (Some(schedule), joined.to_next));
            self.laid(pass, &points, joined.to_next);
        } else {
            self.follow(pass, &steps, (None, false));
        }
    }
}

/// Where some points are, mm.
fn places(points: &[Point]) -> impl Iterator<Item = DVec3> {
    points.iter().map(|p| p.position)
}

/// The highest of some points, mm.
fn highest(points: &[Point]) -> f64 {
    let heights = points.iter().map(|p| p.position.z);
    heights.fold(f64::NEG_INFINITY, f64::max)
}
