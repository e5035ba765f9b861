//! Why a URDF gives no robot file.

use std::path::PathBuf;

/// Why a URDF gives no robot file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UrdfError {
    /// It is not read.
    #[error("not a URDF: {0}")]
    Broken(String),
    /// It ends before its robot does.
    #[error(
        "it ends in line {line}, before </robot>: the file is cut off; copy it or make it anew"
    )]
    CutOff {
        /// Its last line.
        line: usize,
    },
    /// A joint says something that is no number.
    #[error("joint \"{joint}\" in line {line}: {what} is \"{text}\"; {needed} needed")]
    Number {
        /// The joint.
        joint: String,
        /// Where it begins.
        line: usize,
        /// What of it.
        what: &'static str,
        /// What is written.
        text: String,
        /// How many numbers are.
        needed: &'static str,
    },
    /// Two joints of one name.
    #[error(
        "joint \"{joint}\" stands in line {} and again in line {}: give each joint a name of its own", .lines[0], .lines[1]
    )]
    Twice {
        /// The name.
        joint: String,
        /// Where both begin.
        lines: [usize; 2],
    },
    /// Links that hang on two joints, or on themselves.
    #[error(
        "link \"{0}\" hangs on more than one joint, or on itself: loops are not arms; take all but one of the joints that lead to it out"
    )]
    Loop(String),
    /// Links that nothing carries beside the root.
    #[error(
        "links \"{}\" and \"{}\" both hang on nothing: a robot has one root; join them by a fixed joint, or take one with all it carries out", .0[0], .0[1]
    )]
    Roots([String; 2]),
    /// Not six turning joints in a row.
    #[error(
        "{found} turning joints stand one after the other, an arm has six: make others fixed, or take them out; a positioner and a track are written as [positioner] and [track] of the robot file"
    )]
    Joints {
        /// How many there are.
        found: usize,
    },
    /// A joint of the arm that is no arm's, or that says too little.
    #[error("joint \"{joint}\" in line {line}: {fault}")]
    Joint {
        /// The joint.
        joint: String,
        /// Where it begins.
        line: usize,
        /// What is wrong with it.
        fault: JointFault,
    },
    /// A shape of a link that cannot be taken.
    #[error("link \"{link}\", its shape in line {line}: {fault}")]
    Link {
        /// The link.
        link: String,
        /// Where the shape begins.
        line: usize,
        /// What is wrong with it.
        fault: LinkFault,
    },
    /// What was understood makes no robot file.
    #[error("its numbers make no arm: {0}")]
    Unsound(String),
}

/// What is wrong with a joint of an arm, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum JointFault {
    /// It slides.
    #[error(
        "it slides, and an arm's six joints turn: take it out of the URDF, and write a track as [track] of the robot file"
    )]
    Slides,
    /// It moves otherwise.
    #[error(
        "its type is \"{0}\": along an arm joints are revolute, continuous or fixed; make it one of them"
    )]
    Kind(String),
    /// It follows another joint.
    #[error(
        "it is coupled: <mimic> lets it follow joint \"{0}\", and then the arm has not six joints of its own. Take <mimic> out if the controller moves it by itself; where the controller only shows the third joint against the level, as FANUC does, write elbow_shows = \"level\" in [joints] of the robot file"
    )]
    Coupled(String),
    /// No limits of a joint that has some.
    #[error(
        "it is revolute and says no {0}: write <limit lower=\"…\" upper=\"…\" velocity=\"…\"/> in rad from the data sheet; a joint that turns without end is of the type \"continuous\""
    )]
    NoLimit(&'static str),
    /// Limits the other way round, or equal.
    #[error(
        "its limits go from {low} to {high} rad: lower must be below upper; take both from the data sheet"
    )]
    Order {
        /// The lower one, rad.
        low: f64,
        /// The upper one, rad.
        high: f64,
    },
    /// Soft limits that leave nothing.
    #[error(
        "with the soft limits of its <safety_controller> it goes from {low} to {high} rad: soft_lower_limit must be below soft_upper_limit, and both within the limits"
    )]
    Soft {
        /// The lower one of what is left, rad.
        low: f64,
        /// The upper one, rad.
        high: f64,
    },
    /// Limits beyond those of any arm.
    #[error(
        "its limits go from {low} to {high}, which are rad and more than ten turns: are degrees written?"
    )]
    Far {
        /// The lower one, rad.
        low: f64,
        /// The upper one, rad.
        high: f64,
    },
    /// A speed beyond that of any arm.
    #[error("its velocity is {0}, which is rad/s: are degrees per second written?")]
    Fast(f64),
    /// An axis of no length.
    #[error("its axis is 0 0 0, which has no direction: write for example <axis xyz=\"0 0 1\"/>")]
    Axis,
    /// A place beyond any arm's.
    #[error(
        "it lies {0} m from the joint before: no arm has a link longer than 10 m; URDFs are in metres, are millimetres written?"
    )]
    Long(f64),
    /// Angles beyond a turn.
    #[error("its rpy has {0}, which is rad and more than a turn: are degrees written?")]
    Turned(f64),
}

/// What is wrong with a shape of a link, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinkFault {
    /// A number that is none, or no size.
    #[error("{what} is \"{text}\": numbers in metres are needed, sizes above zero")]
    Number {
        /// What of it.
        what: &'static str,
        /// What is written.
        text: String,
    },
    /// A mesh in a format that is not read.
    #[error(
        "the mesh \"{file}\" is no STL, and no other format is read: convert it to STL (Blender, MeshLab, FreeCAD), or write the radii of the links as links of [shapes] in the robot file"
    )]
    Format {
        /// As it is named.
        file: String,
    },
    /// A mesh that is not there.
    #[error(
        "the mesh \"{file}\" is not there; looked for were {}. Put it there, or write the radii of the links as links of [shapes] in the robot file",
        .looked.iter().take(4).map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
    )]
    Missing {
        /// As it is named.
        file: String,
        /// Where it was looked for.
        looked: Vec<PathBuf>,
    },
    /// A shape without a triangle.
    #[error("the mesh {what} has no triangle with a size: write it anew, or take the shape out")]
    Empty {
        /// As it is called.
        what: String,
    },
    /// A mesh that cannot be read.
    #[error("the mesh {} cannot be taken: {what}", .file.display())]
    Mesh {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
}
