//! The moments of a build that decide about its robot: where something comes nearest to what it may not do, and the end.

use meltpath_geometry::math::DVec3;
use meltpath_robot::collision::{Body, Closest};
use meltpath_robot::posture::{Least, Margins, REACH};

use crate::waam::drive::axes::axis;

/// A moment that decides.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KeyMoment {
    /// What its picture is called, without its ending.
    pub(crate) name: &'static str,
    /// What it is.
    pub(crate) title: &'static str,
    /// The check or fact that tells its value.
    pub(crate) id: &'static str,
    /// The value in words.
    pub(crate) value: String,
    /// The command and the wire's tip in the part, mm; nothing for the end of the build.
    pub(crate) place: Option<(u32, DVec3)>,
    /// The bodies that it is about.
    pub(crate) bodies: Vec<Body>,
}

/// The link that a joint of the arm moves, from 0.
fn link(joint: usize) -> Vec<Body> {
    let number = u8::try_from(joint + 1).ok().filter(|n| *n <= 6);
    number.map(Body::Link).into_iter().collect()
}

/// The pair that comes nearest.
pub(in crate::waam) fn clearance(closest: &Closest) -> KeyMoment {
    let [a, b] = closest.bodies;
    KeyMoment {
        name: "clearance",
        title: "Tightest clearance",
        id: "collision",
        value: format!("{:.1} mm between {a} and {b}", closest.distance),
        place: Some((closest.command, closest.position)),
        bodies: vec![a, b],
    }
}

/// The joint that comes nearest to a limit.
pub(in crate::waam) fn joint_limit(least: &Least) -> KeyMoment {
    KeyMoment {
        name: "joint-limit",
        title: "Nearest joint limit",
        id: "reach",
        value: format!(
            "{} is {:.1} deg from its limit",
            axis(least.joint),
            least.value.to_degrees()
        ),
        place: Some((least.command, least.position)),
        bodies: link(least.joint),
    }
}

/// The axis that goes at the greatest share of what it can.
pub(in crate::waam) fn fastest(most: &Least) -> KeyMoment {
    KeyMoment {
        name: "axis-speed",
        title: "Fastest axis along a bead",
        id: "joint-speed",
        value: format!(
            "{} at {:.1} % of what it can do",
            axis(most.joint),
            100.0 * most.value
        ),
        place: Some((most.command, most.position)),
        bodies: link(most.joint),
    }
}

/// The singularity that the arm comes nearest to.
pub(in crate::waam) fn singularity(margins: &Margins) -> Option<KeyMoment> {
    let moment = |least: Least, id, value: String, bodies| KeyMoment {
        name: "singularity",
        title: "Nearest singularity",
        id,
        value,
        place: Some((least.command, least.position)),
        bodies,
    };
    let degrees = |l: Least| l.value.to_degrees();
    let wrist = margins.wrist.map(|l| {
        let words = format!("J5 is {:.1} deg from the wrist's axes in line", degrees(l));
        (l.value, moment(l, "singular-wrist", words, link(4)))
    });
    let elbow = margins.elbow.map(|l| {
        let words = format!("the elbow is {:.1} deg from the stretched arm", degrees(l));
        (l.value, moment(l, "singular-elbow", words, link(2)))
    });
    let shoulder = margins.shoulder.map(|l| {
        let words = format!("the wrist is {:.0} mm from the first axis", l.value);
        let room = l.value / REACH;
        (room, moment(l, "singular-shoulder", words, link(3)))
    });
    let all = [wrist, elbow, shoulder].into_iter().flatten();
    let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map(|(_, moment)| moment)
}

/// The end of the build.
pub(in crate::waam) fn end() -> KeyMoment {
    KeyMoment {
        name: "end",
        title: "End of the build",
        id: "time-total",
        value: String::new(),
        place: None,
        bodies: Vec::new(),
    }
}
