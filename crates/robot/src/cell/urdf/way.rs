//! Follows the joints of a URDF from the root to the flange, and refuses what no arm has.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::bodies::{Carried, carried};
use super::error::{JointFault, UrdfError};
use super::read::{Joint, JointType, joints};
use crate::cell::file::FASTEST;
use crate::cell::sound::{LONGEST, MOST_TURNS};

/// An arm: six turning joints one after the other.
pub(super) struct UrdfArm {
    pub(super) name: String,
    /// The arm's base in the file's root: the fixed joints before the first that turns.
    pub(super) root_from_base: Pose,
    pub(super) joints: Vec<Movable>,
    /// The flange in the frame of the last joint.
    pub(super) last_from_flange: Pose,
    /// The link that is the flange.
    pub(super) flange: String,
    /// The links on it, and those that move by joints beside it.
    pub(super) carried: (Vec<Carried>, Vec<String>),
}

/// A turning joint, with the fixed ones before it in its place; mm and rad.
#[derive(Debug, Clone)]
pub(super) struct Movable {
    pub(super) name: String,
    pub(super) parent_from_joint: Pose,
    pub(super) axis: DVec3,
    pub(super) low: f64,
    pub(super) high: f64,
    /// Whether the file calls it continuous: then limits are ours.
    pub(super) end: End,
    /// The limits beyond narrower ones of its `<safety_controller>`, which are taken.
    pub(super) hard: Option<(f64, f64)>,
    /// Nothing where the file says none.
    pub(super) speed: Option<f64>,
}

/// Where the turning of a joint ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// At the limits of the file.
    AtLimits,
    /// Nowhere.
    Nowhere,
}

/// The arm of a file: of the ways from its root the one with the most turning joints.
pub(super) fn arm(text: &str) -> Result<UrdfArm, UrdfError> {
    let (name, joints) = joints(text)?;
    let (root, way) = from_root(&joints)?;
    if let Some(slides) = way.iter().find(|j| j.kind == JointType::Prismatic) {
        return Err(slides.wrong(JointFault::Slides));
    }
    for joint in &way {
        if let JointType::Other(kind) = &joint.kind {
            return Err(joint.wrong(JointFault::Kind(kind.clone())));
        }
    }
    let found = way.iter().filter(|j| j.turns()).count();
    if found != 6 {
        return Err(UrdfError::Joints { found });
    }
    let mut root_from_base = Pose::IDENTITY;
    let mut movable = Vec::new();
    let mut fixed = Pose::IDENTITY;
    for joint in &way {
        placed(joint)?;
        // what carries the arm may stand anywhere in a hall
        if joint.turns() || !movable.is_empty() {
            near(joint)?;
        }
        if !joint.turns() {
            fixed = fixed.then(joint.pose());
            continue;
        }
        // what stands fixed before the first joint carries the arm
        if movable.is_empty() {
            root_from_base = std::mem::replace(&mut fixed, Pose::IDENTITY);
        }
        movable.push(turning(joint, fixed.then(joint.pose()))?);
        fixed = Pose::IDENTITY;
    }
    let carried = carried(root, &joints, &way);
    Ok(UrdfArm {
        name,
        root_from_base,
        joints: movable,
        last_from_flange: fixed,
        flange: way.last().map_or(String::new(), |j| j.child.clone()),
        carried,
    })
}

/// The root, and the joints from there to the flange.
fn from_root(joints: &[Joint]) -> Result<(&str, Vec<&Joint>), UrdfError> {
    let mut of_parent: BTreeMap<&str, Vec<&Joint>> = BTreeMap::new();
    let mut of_child: BTreeMap<&str, &Joint> = BTreeMap::new();
    for joint in joints {
        of_parent.entry(&joint.parent).or_default().push(joint);
        if of_child.insert(&joint.child, joint).is_some() || joint.parent == joint.child {
            return Err(UrdfError::Loop(joint.child.clone()));
        }
    }
    let parents = joints.iter().map(|j| j.parent.as_str());
    let roots: Vec<&str> = parents.filter(|l| !of_child.contains_key(l)).collect();
    let Some(&root) = roots.first() else {
        return Err(match joints.first() {
            Some(joint) => UrdfError::Loop(joint.child.clone()),
            None => UrdfError::Broken("it has no joints".to_owned()),
        });
    };
    if let Some(other) = roots.into_iter().find(|link| *link != root) {
        return Err(UrdfError::Roots([root, other].map(str::to_owned)));
    }
    // what the root does not lead to goes round in a circle
    let mut open = vec![root];
    while let Some(link) = open.pop() {
        of_child.remove(link);
        open.extend(of_parent.get(link).into_iter().flatten().map(|j| &*j.child));
    }
    match of_child.keys().next() {
        Some(link) => Err(UrdfError::Loop((*link).to_owned())),
        None => Ok((root, longest(&of_parent, root))),
    }
}

/// Refuses angles that are no rad.
fn placed(joint: &Joint) -> Result<(), UrdfError> {
    let most = joint.rpy.abs().max_element();
    // files carry a turn with few digits
    if most > TAU + 0.01 {
        return Err(joint.wrong(JointFault::Turned(most)));
    }
    Ok(())
}

/// Refuses a link longer than any arm's.
fn near(joint: &Joint) -> Result<(), UrdfError> {
    let far = joint.pose().position.length();
    if far > LONGEST {
        return Err(joint.wrong(JointFault::Long(far / 1000.0)));
    }
    Ok(())
}

/// A turning joint at its place.
fn turning(joint: &Joint, parent_from_joint: Pose) -> Result<Movable, UrdfError> {
    if let Some(other) = &joint.mimics {
        return Err(joint.wrong(JointFault::Coupled(other.clone())));
    }
    let axis = joint.axis.unwrap_or(DVec3::X).try_normalize();
    let axis = axis.ok_or_else(|| joint.wrong(JointFault::Axis))?;
    let (low, high, end) = if joint.kind == JointType::Continuous {
        (-TAU, TAU, End::Nowhere)
    } else {
        let (low, high) = limits(joint)?;
        (low, high, End::AtLimits)
    };
    let hard = (low, high);
    let (low, high) = narrowed(joint, hard)?;
    // a continuous joint that is told both ends has them
    let end = if low > hard.0 && high < hard.1 {
        End::AtLimits
    } else {
        end
    };
    // some files write 0 where they do not know
    let speed = joint.speed.filter(|s| *s > 0.0);
    if let Some(fast) = speed.filter(|s| *s > FASTEST) {
        return Err(joint.wrong(JointFault::Fast(fast)));
    }
    Ok(Movable {
        name: joint.name.clone(),
        parent_from_joint,
        axis,
        low,
        high,
        end,
        hard: ((low, high) != hard).then_some(hard),
        speed,
    })
}

/// The limits of a joint that has some, rad.
fn limits(joint: &Joint) -> Result<(f64, f64), UrdfError> {
    let (low, high) = match (joint.low, joint.high) {
        (Some(low), Some(high)) => (low, high),
        (None, None) => return Err(joint.wrong(JointFault::NoLimit("limits"))),
        (None, _) => return Err(joint.wrong(JointFault::NoLimit("lower limit"))),
        (_, None) => return Err(joint.wrong(JointFault::NoLimit("upper limit"))),
    };
    if low >= high {
        return Err(joint.wrong(JointFault::Order { low, high }));
    }
    if low.abs().max(high.abs()) > MOST_TURNS * TAU {
        return Err(joint.wrong(JointFault::Far { low, high }));
    }
    Ok((low, high))
}

/// Limits as the joint's own controller narrows them, rad.
fn narrowed(joint: &Joint, (low, high): (f64, f64)) -> Result<(f64, f64), UrdfError> {
    let [soft_low, soft_high] = joint.soft;
    let (low, high) = (
        soft_low.map_or(low, |soft| soft.max(low)),
        soft_high.map_or(high, |soft| soft.min(high)),
    );
    if low >= high {
        return Err(joint.wrong(JointFault::Soft { low, high }));
    }
    Ok((low, high))
}

/// The joints from a link on along the way with the most that turn; of ways alike the one that ends at `tool0`, the flange of ROS,
/// else the longest.
fn longest<'a>(of_parent: &BTreeMap<&str, Vec<&'a Joint>>, link: &str) -> Vec<&'a Joint> {
    let mut best: Vec<&Joint> = Vec::new();
    // links hang on one joint each and do not turn back: the depth is at most their number
    for joint in of_parent.get(link).into_iter().flatten() {
        let mut way = vec![*joint];
        way.extend(longest(of_parent, &joint.child));
        let rank = |way: &[&Joint]| {
            let turning = way.iter().filter(|j| j.turns()).count();
            let tool = way.last().is_some_and(|j| j.child.ends_with("tool0"));
            (turning, tool, way.len())
        };
        if rank(&way) > rank(&best) {
            best = way;
        }
    }
    best
}
