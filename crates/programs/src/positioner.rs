//! A positioner that turns the part while metal is laid: its axes, and how the part turns with them. A key of the `[program]` table of
//! a cell file.

use meltpath_base::{Length, choice, table};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

choice! {
    /// What lies still in the user frame of a coordinated program.
    pub enum UserFrame {
        Part "part" => "The part: the frame turns with the table.",
        Base "base" => "The arm's base: the table turns in the frame. The axes say where they lie.",
    }
}

table! {
    /// Axes that turn the part, moved together with the arm.
    pub struct Positioner {
        /// Who says so: the controller's calibration of arm and positioner.
        source: String => required;
        /// The axes, the one that carries the others first.
        axes as "axis": Vec<PositionerAxis> => required;
        /// FANUC and Yaskawa: what lies still in the user frame that positions are told in; a Yaskawa's is the base. KUKA's and ABB's frames turn with the part.
        user_frame: UserFrame => none("needed for fanuc-ls and yaskawa-inform");
        /// FANUC: its motion group.
        group: u32 where within(2.0, 8.0) => default(2, "the first beside the arm");
        /// KUKA: its number among the machines (`MACHINE_DEF`).
        machine: u32 where within(2.0, 16.0) => default(2, "the first beside the arm");
        /// ABB: its mechanical unit. The work object names it, too (`ufmec`).
        unit: String => none("needed for abb-rapid");
    }

    /// A rotary axis of a positioner.
    pub struct PositionerAxis {
        /// A point of the axis in the user frame, all axes at zero.
        origin: [Length; 3] => none("needed where the table turns in the user frame");
        /// The direction about which it turns the part the right-handed way, all axes at zero.
        direction: [f64; 3] => none("needed where the table turns in the user frame");
        /// Yaskawa: pulses a degree, below zero where they count against the direction; a parameter of the controller.
        pulses_per_degree: f64 where within(-1e7, 1e7) => none("needed for yaskawa-inform");
    }
}

/// An axis where all stand at zero: a point of it, mm, and its unit direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// A point of it, mm.
    pub origin: DVec3,
    /// Its unit direction.
    pub direction: DVec3,
}

/// A positioner, as far as programs are executed with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Turning {
    /// How many axes it has.
    pub(crate) count: usize,
    /// It is known what lies still in a FANUC's or a Yaskawa's user frame.
    pub(crate) told: bool,
    /// Its motion group on a FANUC, and what stands for it of a Yaskawa's station.
    pub(crate) group: u32,
    /// Its number among the machines of a KUKA.
    pub(crate) machine: u32,
    /// The axes, where the table turns in the frame that positions are told in.
    pub lines: Option<Vec<Line>>,
}

impl Positioner {
    /// The axes, where they say where they lie.
    pub(crate) fn lines(&self) -> Option<Vec<Line>> {
        let line = |axis: &PositionerAxis| {
            let direction = DVec3::from_array((*axis.direction)?).try_normalize()?;
            let origin = DVec3::from_array((*axis.origin)?.map(|l| l.0));
            Some(Line { origin, direction })
        };
        self.axes.iter().map(line).collect()
    }

    /// What execution knows of it.
    pub fn turning(&self) -> Turning {
        let stands = *self.user_frame == Some(UserFrame::Base);
        let lines = self.lines().filter(|_| stands);
        Turning {
            count: self.axes.len(),
            told: self.user_frame.is_some() && (lines.is_some() || !stands),
            group: *self.group,
            machine: *self.machine,
            lines,
        }
    }
}

/// Where a pose of the part lies once the axes are turned by `angles`, rad.
pub(crate) fn turned(lines: &[Line], angles: &[f64], pose: Pose) -> Pose {
    let turn = |pose: Pose, (line, angle): (&Line, &f64)| {
        let by = DQuat::from_axis_angle(line.direction, *angle);
        Pose {
            position: line.origin + by * (pose.position - line.origin),
            orientation: (by * pose.orientation).normalize(),
        }
    };
    // the last axis carries the part
    lines.iter().zip(angles).rev().fold(pose, turn)
}

/// The pose of the part that lies at `pose` once the axes are turned by `angles`, rad.
pub(crate) fn turned_back(lines: &[Line], angles: &[f64], pose: Pose) -> Pose {
    let turn = |pose: Pose, (line, angle): (&Line, &f64)| {
        let by = DQuat::from_axis_angle(line.direction, -*angle);
        Pose {
            position: line.origin + by * (pose.position - line.origin),
            orientation: (by * pose.orientation).normalize(),
        }
    };
    lines.iter().zip(angles).fold(pose, turn)
}
