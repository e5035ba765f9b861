//! The arm of a URDF (the robot description of ROS) as the text of a robot file, and what a robot file that names one takes from it.

mod bodies;
mod error;
mod links;
mod mesh;
mod read;
mod stand;
mod taken;
mod way;
mod wrist;
mod written;

pub use error::{JointFault, LinkFault, UrdfError};
pub use mesh::Named;
pub(super) use taken::Taken;

/// The text of a robot file that says what a URDF says of its arm.
///
/// # Errors
/// [`UrdfError`] with what is wrong.
pub fn from_urdf(text: &str) -> Result<String, UrdfError> {
    let toml = written::toml(&stand::upright(way::arm(text)?), "its URDF");
    // what is printed is to be read again
    match super::read(&toml) {
        Ok(_) => Ok(toml),
        Err(problems) => Err(UrdfError::Unsound(problems.to_string())),
    }
}
