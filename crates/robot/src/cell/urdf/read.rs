//! Reads the joints of a URDF as they are written.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::error::{JointFault, UrdfError};

/// mm a metre, in which URDFs write.
pub(super) const MILLIMETRES: f64 = 1000.0;

/// More joints than this no robot has.
const MOST: usize = 1000;

/// How a joint moves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum JointType {
    Revolute,
    Continuous,
    Prismatic,
    Fixed,
    /// What no arm has.
    Other(String),
}

impl JointType {
    fn of(word: String) -> Self {
        match word.as_str() {
            "revolute" => JointType::Revolute,
            "continuous" => JointType::Continuous,
            "prismatic" => JointType::Prismatic,
            "fixed" => JointType::Fixed,
            _ => JointType::Other(word),
        }
    }
}

/// A joint as written, m and rad.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub(super) name: String,
    /// Where it begins.
    pub(super) line: usize,
    pub(super) kind: JointType,
    pub(super) parent: String,
    pub(super) child: String,
    pub(super) xyz: DVec3,
    pub(super) rpy: DVec3,
    pub(super) axis: Option<DVec3>,
    pub(super) low: Option<f64>,
    pub(super) high: Option<f64>,
    pub(super) speed: Option<f64>,
    /// Where its controller is told to stay within, lower and upper.
    pub(super) soft: [Option<f64>; 2],
    /// The joint that it follows.
    pub(super) mimics: Option<String>,
}

impl Joint {
    pub(super) fn turns(&self) -> bool {
        matches!(self.kind, JointType::Revolute | JointType::Continuous)
    }

    pub(super) fn moves(&self) -> bool {
        self.kind != JointType::Fixed
    }

    /// Its frame in that of the joint before, mm.
    pub(super) fn pose(&self) -> Pose {
        Pose::from_wpr(self.xyz * MILLIMETRES, self.rpy)
    }

    pub(super) fn wrong(&self, fault: JointFault) -> UrdfError {
        UrdfError::Joint {
            joint: self.name.clone(),
            line: self.line,
            fault,
        }
    }

    fn not_numbers(&self, what: &'static str, text: &str, needed: &'static str) -> UrdfError {
        UrdfError::Number {
            joint: self.name.clone(),
            line: self.line,
            what,
            text: text.to_owned(),
            needed,
        }
    }

    fn three(&self, what: &'static str, text: &str) -> Result<DVec3, UrdfError> {
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(finite).collect();
        let three = numbers.and_then(|n| <[f64; 3]>::try_from(n).ok());
        let wrong = || self.not_numbers(what, text, "three numbers are");
        three.map(DVec3::from_array).ok_or_else(wrong)
    }

    /// A number of an element, where it is written.
    fn number(&self, e: &BytesStart<'_>, what: &'static str) -> Result<Option<f64>, UrdfError> {
        let read = |text: String| {
            finite(&text).ok_or_else(|| self.not_numbers(what, &text, "a number is"))
        };
        attribute(e, what).map(read).transpose()
    }

    /// Takes what stands within it.
    fn take(&mut self, tag: &str, e: &BytesStart<'_>) -> Result<(), UrdfError> {
        match tag {
            "origin" => {
                if let Some(xyz) = attribute(e, "xyz") {
                    self.xyz = self.three("xyz", &xyz)?;
                }
                if let Some(rpy) = attribute(e, "rpy") {
                    self.rpy = self.three("rpy", &rpy)?;
                }
            }
            "axis" => {
                let xyz = attribute(e, "xyz").unwrap_or_default();
                self.axis = Some(self.three("axis", &xyz)?);
            }
            "parent" => self.parent = attribute(e, "link").unwrap_or_default(),
            "child" => self.child = attribute(e, "link").unwrap_or_default(),
            "limit" => {
                self.low = self.number(e, "lower")?;
                self.high = self.number(e, "upper")?;
                self.speed = self.number(e, "velocity")?;
            }
            "safety_controller" => {
                self.soft = [
                    self.number(e, "soft_lower_limit")?,
                    self.number(e, "soft_upper_limit")?,
                ];
                // both zero is what ROS takes where none is written
                if self.soft == [Some(0.0); 2] {
                    self.soft = [None; 2];
                }
            }
            "mimic" => self.mimics = Some(attribute(e, "joint").unwrap_or_default()),
            _ => {}
        }
        Ok(())
    }
}

pub(super) fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|n: &f64| n.is_finite())
}

pub(super) fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = element.try_get_attribute(name).ok()??;
    Some(found.value.into_owned())
}

/// The line of a text in which each of ever greater places lies.
pub(super) struct Lines<'a> {
    text: &'a str,
    counted: usize,
    line: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn of_text(text: &'a str) -> Self {
        Lines {
            text,
            counted: 0,
            line: 1,
        }
    }

    pub(super) fn of(&mut self, place: u64) -> usize {
        let to = usize::try_from(place).unwrap_or(usize::MAX);
        let to = to.clamp(self.counted, self.text.len());
        // places lie between characters
        let between = self.text.get(self.counted..to).unwrap_or_default();
        self.line += between.matches('\n').count();
        self.counted = to;
        self.line
    }
}

/// All joints of a file, and its robot's name.
pub(super) fn joints(text: &str) -> Result<(String, Vec<Joint>), UrdfError> {
    let mut reader = Reader::from_str(text);
    let mut lines = Lines::of_text(text);
    let (mut name, mut ended) = (None, false);
    let mut joints = Vec::new();
    let mut current: Option<Joint> = None;
    loop {
        let line = lines.of(reader.buffer_position());
        let event = reader.read_event();
        let event = event.map_err(|e| UrdfError::Broken(e.to_string()))?;
        match &event {
            Event::Eof => break,
            Event::End(e) if e.name().as_ref() == "joint" => joints.extend(current.take()),
            Event::End(e) if e.name().as_ref() == "robot" => ended = true,
            Event::Start(e) | Event::Empty(e) => {
                let tag = e.name();
                if tag.as_ref() == "robot" {
                    name = attribute(e, "name");
                } else if tag.as_ref() == "joint" {
                    // joints of transmissions have no type: they only name one
                    current = attribute(e, "type").map(|kind| begun(e, kind, line));
                } else if let Some(joint) = &mut current {
                    joint.take(tag.as_ref(), e)?;
                }
            }
            _ => {}
        }
    }
    let Some(name) = name else {
        return Err(UrdfError::Broken("it has no <robot name=…>".to_owned()));
    };
    if !ended {
        let line = text.lines().count();
        return Err(UrdfError::CutOff { line });
    }
    sound(&joints)?;
    Ok((name, joints))
}

fn begun(e: &BytesStart<'_>, kind: String, line: usize) -> Joint {
    Joint {
        name: attribute(e, "name").unwrap_or_default(),
        line,
        kind: JointType::of(kind),
        parent: String::new(),
        child: String::new(),
        xyz: DVec3::ZERO,
        rpy: DVec3::ZERO,
        axis: None,
        low: None,
        high: None,
        speed: None,
        soft: [None; 2],
        mimics: None,
    }
}

/// Not more joints than can be, each with a name of its own.
fn sound(joints: &[Joint]) -> Result<(), UrdfError> {
    if joints.len() > MOST {
        let many = format!("it has {} joints, more than any arm", joints.len());
        return Err(UrdfError::Broken(many));
    }
    let mut known: BTreeMap<&str, usize> = BTreeMap::new();
    for joint in joints {
        if let Some(first) = known.insert(&joint.name, joint.line) {
            return Err(UrdfError::Twice {
                joint: joint.name.clone(),
                lines: [first, joint.line],
            });
        }
    }
    Ok(())
}
