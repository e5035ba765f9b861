//! What programs do, as a toolpath: passes with the arc on, the travels between them, and of each move what a controller's program
//! alone says.

use meltpath_base::Reporter;
use meltpath_geometry::Pose;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{
    Channel, Event, Layer, Move, PassHead, PassId, PassWriter, Profile, Role, Toolpath,
};

use crate::execute::{
    Executed, ExecutedKind, ExecutedMotion, ExecutedSpeed, ExecutionSettings, Gap, ProgramError,
    execution_order,
};
use crate::held::Holds;
use crate::program::Program;

/// Heights closer than this are one layer, mm.
const SAME_HEIGHT: f64 = 0.5;

/// What programs do.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The passes: fills with the arc on, travels without it; waits are spots. Each begins where the one before ended, the first where
    /// the program's first move leads to: where the robot comes from is not in the program. Layers and passes are those that comments
    /// tell (`Layer n`, `Pass n`; pass 0 where none does), else layers are the heights at which metal is laid; layers never fall. Positions are those of
    /// the user frame, mm; external axes are those of the robot's group, then those of further groups. A wire feed is said where the weld schedule is known.
    pub toolpath: Toolpath,
    /// What the program alone says, one entry a move, in the order of the passes.
    pub controls: Vec<Control>,
    /// Program and instruction of the position at which the first pass begins.
    pub start_line: (u32, u32),
    /// User and tool frame of that position.
    pub start_frames: (u32, u32),
    /// Travels that are left out, as it is not known where they lead.
    pub left_out: Vec<Gap>,
    /// Lines that shape metal and were not simulated, each once, in the order of execution.
    pub gaps: Vec<Gap>,
}

/// What a controller's program alone says of a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Which way the tool takes.
    pub way: Way,
    /// Smoothing at the end, 0 to 1; `None` stops (FINE).
    pub smoothing: Option<f64>,
    /// User and tool frame; zeros for a wait.
    pub frames: (u32, u32),
    /// What the robot holds; nothing where the program does not say it, for places that are given by joints, and for a wait.
    pub holds: Option<Holds>,
    /// Index of the program.
    pub program: u32,
    /// Instruction number, from 1.
    pub line: u32,
}

/// Which way the tool takes to its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// That of the toolpath.
    Path,
    /// By the joints: its path is the robot's business.
    Joint,
}

/// Executes `programs`, the first of which is the main one, without a robot. `joint_speed` is that of the tool point in a joint move
/// at 100 %, mm/s.
///
/// # Errors
/// [`ProgramError`] with program and instruction number.
pub fn read_toolpath(
    programs: &[Program],
    settings: &ExecutionSettings,
    joint_speed: f64,
    reporter: &Reporter,
) -> Result<Reading, ProgramError> {
    let execution = execution_order(programs, settings, reporter)?;
    let mut steps = execution.steps;
    let profile = |name: &str| Profile {
        name: name.to_owned(),
        ..Profile::default()
    };
    let toolpath = Toolpath {
        build: programs
            .first()
            .map_or_else(String::new, |p| p.name.clone()),
        profiles: vec![profile("bead"), profile("travel")],
        weaves: execution.weaves,
        ..Toolpath::default()
    };
    let mut reading = Reading {
        toolpath,
        controls: Vec::with_capacity(steps.len()),
        start_line: (0, 0),
        start_frames: (0, 0),
        left_out: execution.left_out,
        gaps: execution.gaps,
    };
    let first = steps.iter().position(|s| matches!(s, Executed::Motion(_)));
    let Some(Executed::Motion(start)) = first.map(|first| steps.remove(first)) else {
        return Ok(reading);
    };
    reading.start_line = (start.program, start.line);
    reading.start_frames = start.frames;
    let layers = layers(&steps, start.target.position.z);
    let mut writer = Writer {
        reading: &mut reading,
        here: start.target,
        external: start.external,
        bead: start.bead.unwrap_or(0),
        passes: 0,
        open: None,
        weave: None,
    };
    for (step, layer) in steps.iter().zip(layers) {
        match step {
            Executed::Motion(m) => {
                let feed = m.arc.and_then(|arc| arc.wire_feed);
                writer.motion(m, layer, feed, joint_speed);
            }
            Executed::Wait {
                time,
                arc,
                program,
                line,
            } => {
                let control = Control {
                    way: Way::Path,
                    smoothing: None,
                    frames: (0, 0),
                    holds: None,
                    program: *program,
                    line: *line,
                };
                let to = writer.here;
                let said = Said {
                    shape: Move::Spot { time: *time },
                    burns: arc.is_some(),
                    layer,
                    speed: None,
                    feed: arc.and_then(|arc| arc.wire_feed),
                    weave: None,
                };
                let external = writer.external.clone();
                writer.go(to, external, said, control);
            }
        }
    }
    Ok(reading)
}

/// What the toolpath says of a move.
#[derive(Clone, Copy)]
struct Said {
    shape: Move,
    burns: bool,
    layer: u32,
    speed: Option<f64>,
    feed: Option<f64>,
    weave: Option<u32>,
}

struct Writer<'a> {
    reading: &'a mut Reading,
    here: Pose,
    external: Vec<f64>,
    /// Bead that a comment told last, counted from 1.
    bead: u32,
    /// Passes begun so far.
    passes: u32,
    /// Layer, arc and bead of the pass being written.
    open: Option<(u32, bool, u32)>,
    /// The weave that the pass being written says last.
    weave: Option<u32>,
}

impl Writer<'_> {
    fn motion(&mut self, m: &ExecutedMotion, layer: u32, feed: Option<f64>, joint_speed: f64) {
        let shape = match m.kind {
            ExecutedKind::Joint | ExecutedKind::Linear => Move::Line,
            ExecutedKind::Circular { via } => Move::Arc { via },
        };
        let length = length(shape, self.here.position, m.target.position);
        let speed = match m.speed {
            ExecutedSpeed::Path(v) => v,
            ExecutedSpeed::Joint(share) => share * joint_speed,
            ExecutedSpeed::Duration(t) if length > 1e-9 => length / t,
            // a pure rotation: its path speed has no meaning, the machine model times the rotation itself
            ExecutedSpeed::Duration(_) | ExecutedSpeed::Rotation(_) => joint_speed,
        };
        self.bead = m.bead.unwrap_or(self.bead);
        let control = Control {
            way: match m.kind {
                ExecutedKind::Joint => Way::Joint,
                ExecutedKind::Linear | ExecutedKind::Circular { .. } => Way::Path,
            },
            smoothing: m.smoothing,
            frames: m.frames,
            holds: m.holds,
            program: m.program,
            line: m.line,
        };
        let said = Said {
            shape,
            burns: m.arc.is_some(),
            layer,
            speed: Some(speed),
            feed,
            weave: m.weave,
        };
        self.go(m.target, m.external.clone(), said, control);
    }

    fn go(&mut self, to: Pose, external: Vec<f64>, said: Said, control: Control) {
        let layers = &mut self.reading.toolpath.layers;
        if layers.last().is_none_or(|l| l.number != said.layer) {
            layers.push(Layer::new(said.layer, 0.0));
            self.open = None;
        }
        let Some(layer) = layers.last_mut() else {
            return;
        };
        let key = (said.layer, said.burns, self.bead);
        if self.open != Some(key) {
            let (role, profile) = if said.burns {
                (Role::Fill, 0)
            } else {
                (Role::Travel, 1)
            };
            self.passes += 1;
            let head = PassHead {
                id: PassId(self.passes),
                bead: self.bead.saturating_sub(1),
                role,
                profile,
                ..PassHead::default()
            };
            let mut pass = layer.begin(head, self.here.position);
            stand(&mut pass, &self.here, &self.external);
            self.open = Some(key);
            self.weave = None;
        }
        if let Some(mut pass) = layer.resume() {
            let waits = matches!(said.shape, Move::Spot { .. });
            if !waits && said.weave != self.weave {
                self.weave = said.weave;
                pass.event(Event::Weave(said.weave.unwrap_or(0)));
            }
            pass.go(said.shape, to.position);
            stand(&mut pass, &to, &external);
            for (channel, value) in [(Channel::Speed, said.speed), (Channel::WireFeed, said.feed)] {
                if let Some(value) = value {
                    pass.set(channel, value);
                }
            }
        }
        self.reading.controls.push(control);
        (self.here, self.external) = (to, external);
    }
}

/// How the machine stands at the last point of a pass.
fn stand(pass: &mut PassWriter<'_>, pose: &Pose, external: &[f64]) {
    pass.axis(pose.tool_axis()).turn(pose.turn());
    for (axis, value) in external.iter().enumerate() {
        pass.external(axis, *value);
    }
}

/// Length of a move, mm.
fn length(shape: Move, from: DVec3, to: DVec3) -> f64 {
    let arc = match shape {
        Move::Arc { via } => Arc::through(from, via, to),
        Move::Line | Move::Spot { .. } => None,
    };
    arc.map_or_else(|| from.distance(to), |a| a.length())
}

/// Highest number of a layer: what reports tell apart.
const LAYERS: u32 = 0x7fff;

/// A move that lays metal.
struct Laid {
    step: usize,
    /// Bead, counted from 0: from where the arc is struck to where it ends.
    bead: usize,
    /// Height at its end and, of the two ends, the lower, mm.
    end: f64,
    lower: f64,
    told: Option<u32>,
}

fn laid(steps: &[Executed], start: f64) -> Vec<Laid> {
    let (mut z, mut bead, mut burnt) = (start, 0, false);
    let mut all = Vec::new();
    for (step, executed) in steps.iter().enumerate() {
        let Executed::Motion(m) = executed else {
            continue;
        };
        let from = std::mem::replace(&mut z, m.target.position.z);
        let burns = m.arc.is_some();
        bead += usize::from(burns && !burnt);
        burnt = burns;
        if burns {
            all.push(Laid {
                step,
                bead: bead - 1,
                end: z,
                lower: from.min(z),
                told: m.layer,
            });
        }
    }
    all
}

/// The layer of each step; they never fall. Those that comments tell count where all that is laid has one; else heights at which metal
/// is laid. Where these would fall (a bead that goes up and down, one stack after another) a bead has the layer of its lowest
/// point, and another begins with each bead that lies at another height. Travels and waits belong to the layer that was worked on
/// last, those before the first bead to its layer: an arc that is struck or ends during one of them must find its layer.
fn layers(steps: &[Executed], start: f64) -> Vec<u32> {
    let laid = laid(steps, start);
    let told: Option<Vec<u32>> = laid.iter().map(|l| l.told).collect();
    let told = told.filter(|all| all.iter().all(|layer| *layer <= LAYERS));
    let risen = |layers: &Vec<u32>| layers.is_sorted();
    let of_laid = told
        .filter(risen)
        .or_else(|| Some(levels(laid.iter().map(|l| l.end))).filter(risen))
        .unwrap_or_else(|| layers_of_beads(&laid));
    let mut layer = of_laid.first().copied().unwrap_or(1);
    let mut known = laid.iter().zip(of_laid).peekable();
    (0..steps.len())
        .map(|step| {
            if let Some((_, of_step)) = known.next_if(|(l, _)| l.step == step) {
                layer = of_step.min(LAYERS);
            }
            layer
        })
        .collect()
}

/// A layer for each change of height from bead to bead.
fn layers_of_beads(laid: &[Laid]) -> Vec<u32> {
    let beads = laid.chunk_by(|a, b| a.bead == b.bead);
    let lowest = beads
        .clone()
        .map(|moves| moves.iter().map(|l| l.lower).fold(f64::INFINITY, f64::min));
    let (mut layer, mut last) = (0, None);
    let mut all = Vec::with_capacity(laid.len());
    for (moves, level) in beads.zip(levels(lowest)) {
        layer += u32::from(last.replace(level) != Some(level));
        all.resize(all.len() + moves.len(), layer);
    }
    all
}

/// The number of each height among the distinct ones, from 1.
fn levels(z: impl Iterator<Item = f64> + Clone) -> Vec<u32> {
    let heights = heights(z.clone());
    z.map(|z| heights.partition_point(|h| *h <= z + 1e-9) as u32)
        .collect()
}

/// The distinct heights, from the plate up; those closer than half a millimetre are one.
fn heights(z: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut z: Vec<f64> = z.collect();
    z.sort_unstable_by(f64::total_cmp);
    let mut levels: Vec<f64> = Vec::new();
    for z in z {
        if levels.last().is_none_or(|last| z - last > SAME_HEIGHT) {
            levels.push(z);
        }
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::execute::Source;

    fn told(z: f64, arc: Option<Source>, layer: Option<u32>) -> Executed {
        Executed::Motion(ExecutedMotion {
            kind: ExecutedKind::Linear,
            target: Pose::from_wpr(DVec3::new(10.0, 0.0, z), DVec3::ZERO),
            external: Vec::new(),
            speed: ExecutedSpeed::Path(12.5),
            turns: None,
            smoothing: None,
            arc,
            weave: None,
            frames: (1, 1),
            holds: None,
            layer,
            bead: None,
            program: 0,
            line: 1,
        })
    }

    fn at(z: f64, arc: Option<Source>) -> Executed {
        told(z, arc, None)
    }

    #[test]
    fn layers_never_fall() {
        let on = Some(Source::default());
        // a weld line over a hump, and a second on it
        let hump = [0.0, 2.0, 5.0, 2.0, 0.0].map(|z| at(z, on));
        let second = [1.6, 3.6, 6.6, 3.6, 1.6].map(|z| at(z, on));
        let up = [at(30.0, None), at(1.6, None)];
        let steps: Vec<Executed> = [&hump[..], &up, &second].concat();
        assert_eq!(layers(&steps, 0.0), [vec![1; 7], vec![2; 5]].concat());
        // one stack of beads after another, told and not
        for said in [[1, 2, 1, 2].map(Some), [None; 4]] {
            let beads = [0.0, 1.6, 0.0, 1.6].iter().zip(said);
            let steps: Vec<Executed> = beads
                .flat_map(|(z, said)| [told(*z, on, said), at(20.0, None)])
                .collect();
            let wanted: Vec<u32> = (1..=4).flat_map(|n| [n; 2]).collect();
            assert_eq!(layers(&steps, 30.0), wanted);
        }
        // a number that no report shows
        assert_eq!(layers(&[told(0.0, on, Some(70_000))], 0.0), [1]);
        // one arc from layer to layer
        let spiral = [0.0, 0.2, 0.8, 1.0, 1.6].map(|z| at(z, on));
        assert_eq!(layers(&spiral, 0.0), [1, 1, 2, 2, 3]);
    }

    #[test]
    fn layers_follow_the_height_of_the_deposit() {
        let on = Some(Source::default());
        let steps = [
            at(30.0, None),
            at(0.0, on),
            at(0.0004, on),
            at(30.0, None),
            at(1.7, on),
            at(3.4, on),
        ];
        assert_eq!(layers(&steps, 30.0), [1, 1, 1, 1, 2, 3]);
    }
}
