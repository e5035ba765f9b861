//! What a robot file takes from the URDF that it names.

use std::path::Path;

use meltpath_base::settings::{Problem, Setting};
use meltpath_geometry::Pose;

use super::bodies::{Bodies, bodies, moved};
use super::error::UrdfError;
use super::mesh::{Named, find};
use super::stand;
use super::way::{Movable, arm};
use super::written::{guessed, toml};
use crate::cell::file::CellFile;
use crate::kinematics::Chain;

/// What a URDF tells a robot file.
#[derive(Debug)]
pub(in crate::cell) struct Taken {
    /// As it is named.
    name: String,
    text: String,
    /// Where it lies.
    pub(in crate::cell) named: Named,
    /// Its arm, joints and base as a robot file.
    pub(in crate::cell) toml: String,
    /// Keys of its joints that are guesses.
    guesses: Vec<&'static str>,
}

impl Taken {
    /// The URDF called `name` in `folder`.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub(in crate::cell) fn of(name: &str, folder: &Path) -> Result<Self, String> {
        let named = find(name, folder).map_err(|looked| {
            let first = looked.first().map(|p| p.display().to_string());
            format!("it is not there: {}", first.unwrap_or_default())
        })?;
        let text = std::fs::read_to_string(&named.file).map_err(|e| e.to_string())?;
        if text.contains("xacro:") {
            return Err("it is a macro file: make the URDF with `xacro FILE`".to_owned());
        }
        let arm = arm(&text).map_err(|e| e.to_string())?;
        let guesses = guessed(&arm.joints);
        let toml = toml(&stand::upright(arm), name);
        Ok(Taken {
            name: name.to_owned(),
            text,
            named,
            toml,
            guesses,
        })
    }

    /// The bodies of its links, in the frames of the joints of a chain that moves as its arm does.
    pub(in crate::cell) fn bodies(&self, chain: &Chain) -> Result<Bodies, UrdfError> {
        let mut arm = arm(&self.text)?;
        let carried = std::mem::take(&mut arm.carried);
        let arm = stand::upright(arm);
        let folder = self.named.file.parent().unwrap_or(Path::new(""));
        let mut found = bodies(&self.text, folder, carried)?;
        let of_file = at_zero(&arm.joints);
        let of_chain = chain.frames(&[]);
        let base_from_root = arm.root_from_base.inverse();
        moved(&mut found.hulls, |link| {
            let Some(joint) = usize::from(link).checked_sub(1) else {
                return base_from_root;
            };
            match (of_chain.get(joint), of_file.get(joint)) {
                (Some(chain), Some(file)) => chain.inverse().then(*file),
                _ => Pose::IDENTITY,
            }
        });
        Ok(found)
    }

    /// Keeps apart in a file what it says itself and what is taken: what the URDF tells is not written beside it, and what is written has a source.
    pub(in crate::cell) fn over(&self, file: &mut CellFile, problems: &mut Vec<Problem>) {
        let taken = file.urdf.span.clone();
        let is_own = |span: &Option<std::ops::Range<usize>>| span.is_some() && *span != taken;
        macro_rules! told {
            ($($key:expr),*) => { $(
                if is_own(&$key.span) {
                    problems.push(beside(&$key, &self.name));
                }
            )* };
        }
        let (arm, joints) = (&file.arm, &file.joints);
        told!(
            arm.kind,
            arm.shoulder_height,
            arm.shoulder_forward,
            arm.arm_aside,
            arm.upper_arm,
            arm.forearm_above_elbow,
            arm.forearm,
            arm.wrist_aside,
            arm.wrist_offset,
            arm.flange,
            arm.axes,
            joints.zero,
            joints.directions
        );
        let own = [
            ("low", is_own(&joints.low.span)),
            ("high", is_own(&joints.high.span)),
            ("speed", is_own(&joints.speed.span)),
            ("acceleration", is_own(&joints.acceleration.span)),
            ("elbow_shows", is_own(&joints.elbow_shows.span)),
        ];
        let written: Vec<&str> = own.iter().filter(|k| k.1).map(|k| k.0).collect();
        let written = written.join(", ");
        let joints = &mut file.joints.value;
        if is_own(&joints.source.span) {
            let says = format!("{}; {written}: {}", self.name, joints.source.value);
            joints.source.value = says;
        } else if !written.is_empty() {
            let message = format!(
                "joints.source is missing: {} does not say {written} so",
                self.name
            );
            let problem = file.urdf.problem(message);
            problems.push(problem.help("write source in [joints], and who says these numbers"));
        }
        for guess in &self.guesses {
            let measured = own.iter().any(|(key, own)| *own && key == guess);
            let known = joints.guesses.iter().any(|g| g == guess);
            if measured && !is_own(&joints.guesses.span) {
                joints.guesses.value.retain(|g| g != guess);
            } else if !measured && !known {
                joints.guesses.value.push((*guess).to_owned());
            }
        }
    }
}

/// A key that is written beside the URDF that tells it.
fn beside<T>(key: &Setting<T>, urdf: &str) -> Problem {
    let message = format!("{} is written, and {urdf} tells it", key.name);
    key.problem(message).help(
        "take one of both out: to write the arm yourself, `meltpath inspect FILE.urdf` prints it as a robot file",
    )
}

/// The frames of the joints in the base, all at zero.
fn at_zero(joints: &[Movable]) -> Vec<Pose> {
    let mut base_from_joint = Pose::IDENTITY;
    let next = |j: &Movable| {
        base_from_joint = base_from_joint.then(j.parent_from_joint);
        base_from_joint
    };
    joints.iter().map(next).collect()
}
