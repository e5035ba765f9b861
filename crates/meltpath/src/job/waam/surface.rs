//! The tables of a wall along a surface.

use meltpath_base::settings::File;
use meltpath_base::{Angle, Length, choice, table};

use crate::job::common::Direction;

table! {
    /// A wall one bead thick along a surface in space.
    pub struct SurfaceTable {
        /// The faces of a STEP file that are the surface, by the numbers that `meltpath inspect` shows.
        faces: Vec<u32> => none("the whole surface of the file, which must be open");
        /// What the wall stands on.
        base: SurfaceBaseTable => default({}, "a plane under the surface");
        /// How passes follow one another.
        strategy: SurfaceStrategyChoice => default("distance", "every bead on the nearest metal, evenly thick");
        /// Whether passes are beads of their own.
        passes: SurfacePasses => default("each", "any surface has them");
        /// Travel speeds along passes.
        speeds: SurfaceSpeeds => computed("\"constant\": every place of a bead grows alike; along a spiral \"adapted\", as it begins and ends on a ramp");
        /// What a pass grows at the bead's own travel speed, where speeds follow the distance: measured on a wall, or as a run of one finds it.
        grows: Length where up_to(100.0) => computed("the metal of a bead over the 0.9 widths that a pass shares");
        /// Where the torch points from.
        torch: SurfaceTorch => default("half", "between wall and build direction (Campocasso 2017)");
        /// Directions from the part towards the torch at places, with torch = "field": a CSV file of x, y, z in mm, in the coordinates of the part
        /// file, and the direction's three components.
        field: File => none("torch is no field");
        /// Greatest lean of the torch against the vertical; beyond it the torch is turned back.
        tilt: Angle where within(0.0, std::f64::consts::PI) => none("no bound");
        /// Angle by which the wire points ahead along the travel: above zero it pushes, below zero it drags.
        lead: Angle where within(-1.0, 1.0) => default("0 deg", "the wire along the torch's rule");
    }

    /// What a wall on a surface stands on, in the coordinates of the part file.
    pub struct SurfaceBaseTable {
        /// A point of the plane, or of the axis of a cylinder or a body of revolution.
        origin: [Length; 3] => none("the lowest place of the surface along the direction");
        /// The plane's normal, towards which the wall grows, or the axis.
        direction: Direction => none("the build direction");
        /// Radius of a cylinder, away from whose axis the wall grows.
        radius: Length where up_to(100_000.0) => none("a plane");
        /// Profile of a body of revolution away from which the wall grows: how far along the axis from the origin, ever farther, and the
        /// radius there; straight between, flat at both ends.
        profile: Vec<[Length; 2]> => none("a plane");
    }
}

choice! {
    /// How passes follow one another on a surface.
    pub enum SurfaceStrategyChoice {
        Distance "distance" => "At the layer height from the nearest place of the pass before.",
        ParameterDistance "parameter-distance" =>
            "On one face: at the layer height from the point of the same parameter (Campocasso 2017, eq. 3).",
        Parameter "parameter" => "On one face: lines of one parameter, the widest place of each at the layer height.",
        Planes "planes" => "Parallel planes, evenly spaced along the build direction.",
    }

    /// Whether passes on a surface are beads of their own.
    pub enum SurfacePasses {
        Each "each" => "An arc start each; closed ones each begin at another place.",
        Spiral "spiral" =>
            "One bead that winds up from pass to pass round a closed wall: the arc is struck once. Its first turn rises from the base, its \
             last one ends level.",
    }

    /// Travel speeds along passes on a surface.
    pub enum SurfaceSpeeds {
        Constant "constant" => "One speed for every bead.",
        Adapted "adapted" =>
            "Slower where the pass before is farther away, faster where it is nearer (half to twice the travel speed), so that the bead \
             fills the distance.",
    }

    /// Where the torch points from, along a wall.
    pub enum SurfaceTorch {
        Tangent "tangent" => "Along the wall, in the direction in which it grows.",
        Half "half" => "Halfway between that and the direction in which the build begins.",
        Fixed "fixed" => "Along the direction in which the build begins.",
        Field "field" => "As a file of your own says (`field`).",
    }
}
