//! Why a URDF gives no robot file.

/// Why a URDF gives no robot file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UrdfError {
    /// It is not read.
    #[error("not a URDF: {0}")]
    Broken(String),
    /// A joint says something that is no number.
    #[error("joint \"{joint}\": {what} is \"{text}\"; three numbers are needed")]
    Number {
        /// The joint.
        joint: String,
        /// What of it.
        what: &'static str,
        /// What is written.
        text: String,
    },
    /// Links that hang on two joints, or on themselves.
    #[error("link \"{0}\" hangs on more than one joint, or on itself: loops are not arms")]
    Loop(String),
    /// Not six turning joints in a row.
    #[error("{found} turning joints stand one after the other, an arm has six{other}")]
    Joints {
        /// How many there are.
        found: usize,
        /// What stands among them.
        other: &'static str,
    },
    /// A flange that no file can say.
    #[error(
        "the arm has no spherical wrist, and its flange \"{0}\" is turned against its last joint: give the flange the last joint's direction"
    )]
    Flange(String),
}
