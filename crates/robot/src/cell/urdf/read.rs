//! Reads links and joints, and follows them from the root to the flange.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::error::UrdfError;

/// mm a metre, in which URDFs write.
const MILLIMETRES: f64 = 1000.0;

/// More joints than this no robot has.
const MOST: usize = 1000;

/// An arm: six turning joints one after the other.
pub(super) struct UrdfArm {
    pub(super) name: String,
    pub(super) joints: Vec<Movable>,
    /// The flange in the frame of the last joint.
    pub(super) last_from_flange: Pose,
    pub(super) flange: String,
}

/// A turning joint, with the fixed ones before it in its place.
#[derive(Debug, Clone)]
pub(super) struct Movable {
    pub(super) parent_from_joint: Pose,
    pub(super) axis: DVec3,
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) speed: f64,
}

/// A joint as written.
#[derive(Debug, Clone, Default)]
struct Joint {
    name: String,
    kind: String,
    parent: String,
    child: String,
    xyz: DVec3,
    rpy: DVec3,
    axis: Option<DVec3>,
    low: f64,
    high: f64,
    speed: f64,
}

impl Joint {
    fn turns(&self) -> bool {
        matches!(self.kind.as_str(), "revolute" | "continuous")
    }

    fn pose(&self) -> Pose {
        Pose::from_wpr(self.xyz * MILLIMETRES, self.rpy)
    }
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = element.try_get_attribute(name).ok()??;
    Some(found.value.into_owned())
}

fn three(joint: &str, what: &'static str, text: &str) -> Result<DVec3, UrdfError> {
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map_while(|n| n.parse().ok())
        .collect();
    let finite = numbers.iter().all(|n| n.is_finite());
    match <[f64; 3]>::try_from(numbers) {
        Ok(numbers) if finite => Ok(DVec3::from_array(numbers)),
        _ => Err(UrdfError::Number {
            joint: joint.to_owned(),
            what,
            text: text.to_owned(),
        }),
    }
}

/// All joints of a file, and its robot's name.
fn joints(text: &str) -> Result<(String, Vec<Joint>), UrdfError> {
    let mut reader = Reader::from_str(text);
    let mut name = None;
    let mut joints = Vec::new();
    let mut current: Option<Joint> = None;
    loop {
        let event = reader.read_event();
        let event = event.map_err(|e| UrdfError::Broken(e.to_string()))?;
        match &event {
            Event::Eof => break,
            Event::End(e) if e.name().as_ref() == "joint" => joints.extend(current.take()),
            Event::Start(e) | Event::Empty(e) => {
                let tag = e.name();
                if tag.as_ref() == "robot" {
                    name = attribute(e, "name");
                } else if tag.as_ref() == "joint" {
                    // joints of transmissions have no type: they only name one
                    current = attribute(e, "type").map(|kind| Joint {
                        name: attribute(e, "name").unwrap_or_default(),
                        kind,
                        ..Joint::default()
                    });
                } else if let Some(joint) = &mut current {
                    within(tag.as_ref(), e, joint)?;
                }
            }
            _ => {}
        }
    }
    match name {
        Some(name) => Ok((name, joints)),
        None => Err(UrdfError::Broken("it has no <robot name=…>".to_owned())),
    }
}

/// What stands within a joint.
fn within(tag: &str, e: &BytesStart<'_>, joint: &mut Joint) -> Result<(), UrdfError> {
    let number = |name: &str| attribute(e, name).and_then(|n| n.parse::<f64>().ok());
    match tag {
        "origin" => {
            if let Some(xyz) = attribute(e, "xyz") {
                joint.xyz = three(&joint.name, "xyz", &xyz)?;
            }
            if let Some(rpy) = attribute(e, "rpy") {
                joint.rpy = three(&joint.name, "rpy", &rpy)?;
            }
        }
        "axis" => {
            let xyz = attribute(e, "xyz").unwrap_or_default();
            joint.axis = Some(three(&joint.name, "axis", &xyz)?);
        }
        "parent" => joint.parent = attribute(e, "link").unwrap_or_default(),
        "child" => joint.child = attribute(e, "link").unwrap_or_default(),
        "limit" => {
            joint.low = number("lower").unwrap_or(0.0);
            joint.high = number("upper").unwrap_or(0.0);
            joint.speed = number("velocity").unwrap_or(0.0);
        }
        _ => {}
    }
    Ok(())
}

/// The arm of a file: of the ways from its root the one with the most turning joints.
pub(super) fn arm(text: &str) -> Result<UrdfArm, UrdfError> {
    let (name, joints) = joints(text)?;
    if joints.len() > MOST {
        let many = format!("it has {} joints, more than any arm", joints.len());
        return Err(UrdfError::Broken(many));
    }
    let mut of_parent: BTreeMap<&str, Vec<&Joint>> = BTreeMap::new();
    let mut of_child: BTreeMap<&str, &Joint> = BTreeMap::new();
    for joint in &joints {
        of_parent.entry(&joint.parent).or_default().push(joint);
        if of_child.insert(&joint.child, joint).is_some() || joint.parent == joint.child {
            return Err(UrdfError::Loop(joint.child.clone()));
        }
    }
    let root = joints
        .iter()
        .find(|j| !of_child.contains_key(j.parent.as_str()));
    let Some(root) = root else {
        return Err(match joints.first() {
            Some(joint) => UrdfError::Loop(joint.child.clone()),
            None => UrdfError::Broken("it has no joints".to_owned()),
        });
    };
    let way = longest(&of_parent, &root.parent);
    let count = way.iter().filter(|j| j.turns()).count();
    let slides = way.iter().any(|j| j.kind == "prismatic");
    if count != 6 || slides {
        let other = if slides {
            ", and none that slides: write a track as [track]"
        } else {
            ""
        };
        return Err(UrdfError::Joints {
            found: count,
            other,
        });
    }
    let mut movable = Vec::new();
    let mut fixed = Pose::IDENTITY;
    for joint in &way {
        fixed = fixed.then(joint.pose());
        if !joint.turns() {
            continue;
        }
        let unlimited = joint.kind == "continuous" || joint.low == joint.high;
        let turn = std::f64::consts::TAU;
        let (low, high) = if unlimited {
            (-turn, turn)
        } else {
            (joint.low, joint.high)
        };
        movable.push(Movable {
            parent_from_joint: fixed,
            axis: joint.axis.unwrap_or(DVec3::X).normalize_or(DVec3::X),
            low,
            high,
            speed: joint.speed,
        });
        fixed = Pose::IDENTITY;
    }
    Ok(UrdfArm {
        name,
        joints: movable,
        last_from_flange: fixed,
        flange: way.last().map_or(String::new(), |j| j.child.clone()),
    })
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
