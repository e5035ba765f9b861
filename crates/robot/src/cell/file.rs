//! The file of a robot cell as it is written: every table with where its numbers come from.

use meltpath_base::settings::{File, Many};
use meltpath_base::{
    Angle, AngularAcceleration, AngularSpeed, Length, Speed, choice, quantity, table,
};

use super::layout::{Arrangement, Maker};

/// No arm turns a joint faster, rad/s: three times the last axes of the fastest that are sold.
pub(super) const FASTEST: f64 = 10.0 * std::f64::consts::TAU;
/// No arm speeds a joint up more, rad/s²: ten times what small and fast ones do.
const QUICKEST: f64 = 1e5_f64.to_radians();

quantity!(
    /// How fast a speed of sliding changes, mm/s² inside.
    TrackAcceleration, "acceleration", "mm/s²",
    [("m/s²", 1e3), ("mm/s²", 1.0)]
);

choice! {
    /// What an arm is made of, which decides how its joint values are found.
    pub enum ArmKind {
        SphericalWrist "spherical-wrist" =>
            "Second and third axis parallel, the last three through one point: every way to hold a pose is known.",
        OffsetWrist "offset-wrist" =>
            "Second to fourth axis parallel, as Universal Robots have them: every way to hold a pose is known.",
        Axes "axes" => "Any six axes, one after the other: ways are searched, and not all need be found.",
    }

    /// How a joint counts.
    pub enum Direction {
        With "+" => "As the arm's description says: leaning forward, and by the right hand about the arm stretched upright.",
        Against "-" => "The other way.",
    }

    /// What the controller shows as the third joint.
    pub enum ElbowShows {
        Joint "joint" => "The angle between forearm and upper arm.",
        Level "level" => "The angle of the forearm to the level, as FANUC does: it changes with the second joint.",
    }
}

/// Tables of a robot's file that a URDF may say in its place, whole or key by key.
pub const FROM_URDF: [&str; 2] = ["arm", "joints"];

table! {
    /// A robot cell: an arm, and what stands around it.
    pub struct CellFile {
        /// What people call it.
        name: String => required;
        /// Who made the robot.
        maker: Maker => default("other", "no words for configurations");
        /// What the robot holds.
        arrangement: Arrangement => default("torch-on-robot", "the usual one");
        /// Its URDF, which tells the arm, its joints, what carries it, and the shapes of its links, beside this file. Of `[arm]` and `[joints]` what it does not tell is written here: speeds, accelerations, narrower limits, `elbow_shows`, the flange's frame.
        urdf: File => none("the arm is written here");
        /// The arm.
        arm: ArmTable => required;
        /// Its joints, the first at the base.
        joints: JointsTable => required;
        /// Where the arm's base stands: in the world, or on the track's carriage.
        base: FrameTable => default({}, "in the origin of the world");
        /// A track that carries the arm.
        track: TrackTable => none("the arm stands still");
        /// A positioner that carries the table.
        positioner: PositionerTable => none("the table stands still");
        /// Where the torch ends: in the flange, or in the world where the robot holds the part.
        torch: TorchTable => default({}, "the flange itself");
        /// Where the table lies: in the world, or on the positioner's last axis.
        table: FrameTable => default({}, "in the origin of what carries it");
        /// Shapes of torch, arm and table.
        shapes: ShapesTable => none("collisions are not checked");
        /// Where the part lies: on the table, or in the flange where the robot holds it.
        part: FrameTable => default({}, "in the origin of what carries it");
    }

    /// An arm. Of a spherical wrist: stretched upright, forward is x and up is z.
    pub struct ArmTable {
        /// What it is made of.
        kind: ArmKind => default("spherical-wrist", "most arms");
        /// Who says so: data sheet, drawing, page.
        source: String => required;
        /// Which of this table's keys are guesses.
        guesses: Vec<String> => default([], "everything is from the source");
        /// From the base up to the second axis.
        shoulder_height: Length => none("needed for both closed kinds");
        /// From the first axis forward to the second.
        shoulder_forward: Length => none("0 mm");
        /// From the first axis to the side (along y) where the wrist moves.
        arm_aside: Length => none("0 mm");
        /// The upper arm, from the second axis to the third.
        upper_arm: Length where positive => none("needed for both closed kinds");
        /// How far the forearm's axis lies above the elbow when the forearm is level.
        forearm_above_elbow: Length => none("0 mm");
        /// The forearm: from the elbow to the centre of the wrist, or of an offset wrist from the third axis to the fourth.
        forearm: Length where positive => none("needed for both closed kinds");
        /// Of an offset wrist: from the first axis to the side, to the fifth axis (d4).
        wrist_aside: Length => none("needed for an offset wrist");
        /// Of an offset wrist: from the fourth axis to the sixth (d5).
        wrist_offset: Length => none("needed for an offset wrist");
        /// From the centre of the wrist (of an offset wrist: from the fifth axis) to the flange.
        flange: Length where not_negative => none("needed for both closed kinds");
        /// From there on to the flange's frame: x, y, z of the last axis's frame, which of closed kinds has its z out along the axis.
        flange_offset: [Length; 3] => default(["0 mm", "0 mm", "0 mm"], "none");
        /// How the flange's frame is turned there: W, P, R about the fixed x, y, z.
        flange_angles: [Angle; 3] => default(["0 deg", "0 deg", "0 deg"], "as the last axis's frame; of closed kinds its z then points out along the axis, as pendants have it");
        /// The six axes of any other arm.
        axes: Vec<AxisTable> => default([], "of a closed kind there are none");
    }

    /// One axis of an arm or of a positioner, in the frame of the axis before it.
    pub struct AxisTable {
        /// Where it lies: x, y, z.
        position: [Length; 3] where within(-1e5, 1e5) => default(["0 mm", "0 mm", "0 mm"], "where the one before lies");
        /// How its frame is turned: W, P, R about the fixed x, y, z.
        angles: [Angle; 3] => default(["0 deg", "0 deg", "0 deg"], "as the one before");
        /// The axis in its own frame; positive angles turn about it by the right hand.
        axis: [f64; 3] => required;
    }

    /// The joints of an arm, six of each.
    pub struct JointsTable {
        /// Who says so.
        source: String => required;
        /// Which of this table's keys are guesses.
        guesses: Vec<String> => default([], "everything is from the source");
        /// The least values, as the controller shows them.
        low: [Angle; 6] => required;
        /// The greatest values, as the controller shows them.
        high: [Angle; 6] => required;
        /// The greatest speeds.
        speed: [AngularSpeed; 6] where up_to(FASTEST) => none("not known: speeds are not checked");
        /// The greatest accelerations.
        acceleration: [AngularAcceleration; 6] where up_to(QUICKEST) => none("not known: accelerations are not checked");
        /// Of a spherical wrist: the angle from the arm stretched upright at which the controller shows zero.
        zero: [Angle; 6] => none("0 deg each");
        /// Of a spherical wrist: how each joint counts.
        directions: [Direction; 6] => none("+ each");
        /// What the controller shows as the third joint.
        elbow_shows: ElbowShows => default("joint", "all but FANUC");
    }

    /// Where a frame lies.
    pub struct FrameTable {
        /// Its origin: x, y, z.
        position: [Length; 3] where within(-1e5, 1e5) => default(["0 mm", "0 mm", "0 mm"], "the origin");
        /// How it is turned: W, P, R about the fixed x, y, z.
        angles: [Angle; 3] => default(["0 deg", "0 deg", "0 deg"], "not turned");
        /// In place of the angles: its x, y and z axis, as a calibration gives them. They must make a rigid frame.
        axes: [[f64; 3]; 3] => none("the angles hold");
        /// In place of position and angles: points of the frame that the wire's tip touched, where the pendant shows them in the arm's base, track and positioner at zero. Its origin, one along x, one in the xy plane on the side of +y; further ones in that plane tell how well. Of `[base]` they are points of the world, or of the track's carriage.
        touched: Many<[Length; 3], 3, 12> => none("position and angles hold");
        /// Who says so.
        source: String => none("nobody: a guess");
    }

    /// A torch.
    pub struct TorchTable {
        /// Where its contact tube ends: x, y, z.
        position: [Length; 3] where within(-1e5, 1e5) => default(["0 mm", "0 mm", "0 mm"], "the origin");
        /// How it is turned: W, P, R about the fixed x, y, z; its z points along the wire towards the work.
        angles: [Angle; 3] => default(["0 deg", "0 deg", "0 deg"], "not turned");
        /// Length of the wire beyond the contact tube.
        wire: Length where within(0.0, 200.0) => default("15 mm", "the usual distance of the contact tube");
        /// Who says so.
        source: String => none("nobody: a guess");
    }

    /// Shapes: each body as a line with a radius around it.
    pub struct ShapesTable {
        /// Who says so.
        source: String => none("nobody: a guess");
        /// Radius of each link around the line from its joint to the next, the last to the flange.
        links: [Length; 6] where up_to(1000.0) => none("the shapes of the URDF, each as its convex hull; needed where there is none");
        /// Radius of the torch around the line from the flange to its nozzle.
        torch: Length where up_to(500.0) => required;
        /// Length and radius of the nozzle, which ends with the contact tube.
        nozzle: [Length; 2] where up_to(1000.0) => required;
        /// Size of the table along its x and y, its origin in the middle.
        table: [Length; 2] where up_to(1e5) => none("not known: the table is not checked");
        /// How deep the table is below its top, with all that turns beneath it where a positioner carries it. What carries the positioner
        /// is not checked.
        table_thickness: Length where up_to(1e4) => none("2000 mm of a table that stands: it reaches the floor; 100 mm of one on a positioner: a guess, told in the verdict");
    }

    /// A track.
    pub struct TrackTable {
        /// Who says so.
        source: String => required;
        /// Where it begins, in the world.
        position: [Length; 3] where within(-1e5, 1e5) => default(["0 mm", "0 mm", "0 mm"], "the origin");
        /// The way it goes, in the world.
        axis: [f64; 3] => required;
        /// The least position.
        low: Length where within(-1e6, 1e6) => required;
        /// The greatest position.
        high: Length where within(-1e6, 1e6) => required;
        /// The greatest speed.
        speed: Speed where up_to(2e4) => none("not known: speeds are not checked");
        /// The greatest acceleration.
        acceleration: TrackAcceleration where up_to(1e5) => none("not known: accelerations are not checked");
    }

    /// A positioner of one or two axes, the first in the world.
    pub struct PositionerTable {
        /// Who says so.
        source: String => required;
        /// Which of this table's keys are guesses.
        guesses: Vec<String> => default([], "everything is from the source");
        /// Its axes.
        axes: Many<AxisTable, 1, 2> => required;
        /// The least angles.
        low: Many<Angle, 1, 2> => required;
        /// The greatest angles.
        high: Many<Angle, 1, 2> => required;
        /// The greatest speeds.
        speed: Many<AngularSpeed, 1, 2> where up_to(FASTEST) => none("not known: speeds are not checked");
        /// The greatest accelerations.
        acceleration: Many<AngularAcceleration, 1, 2> where up_to(QUICKEST) => none("not known: accelerations are not checked");
    }
}
