//! The words of the extension: namespaces, kinds of toolpaths, what this project adds under its own namespace.

use meltpath_toolpath::Role;

/// Which version of the specification is read and written.
pub const VERSION: &str = "1.0 (release candidate)";
/// How names of packages with a toolpath end, without the dot in front.
pub const EXTENSION: &str = "build.3mf";
/// Namespace of the extension.
pub(super) const TOOLPATH: &str = "http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03";
/// That of earlier drafts, which is read as the same.
pub(super) const DRAFT: &str = "http://schemas.microsoft.com/3dmanufacturing/toolpath/2019/05";
/// Relationship type from the model to its layers.
pub(super) const LAYER_RELATION: &str =
    "http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03/layer";
/// That of earlier drafts.
pub(super) const DRAFT_RELATION: &str =
    "http://schemas.microsoft.com/3dmanufacturing/2019/05/toolpath";
/// Namespace of what this project says beside the words of the specification; never required, so others pass it over.
///
/// On profiles `wirefeed` (mm/s) and `smoothing` (0 to 1: how much corners of beads are smoothed, of what the controller can); on segments `role` (`contour`, `fill`, `skin`, `support`) and `part` (number of the part in the plan); on layers
/// `number`; on points `arc`: two numbers, how many lines lead to the
/// point that an arc goes through, and how many up to here stand for that arc.
pub const NAMESPACE: &str = "https://github.com/meltpath/meltpath/3mf/1";

/// One device unit of the files that are written, mm: of beads as programs hold it, so that both say the same; of a beam's marks.
pub(super) const BEAD_STEP: f64 = 1e-3;
pub(super) const MARK_STEP: f64 = 1e-4;
/// Distance between an arc and the lines in its place, mm: of beads, and of a beam's marks.
pub(super) const BEAD_CHORD: f64 = 1e-2;
pub(super) const MARK_CHORD: f64 = 5e-4;

/// What a toolpath's points say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Lines in planes, layer by layer.
    Planar,
    /// Lines in space.
    ThreeAxis,
    /// Lines in space, with the orientation of the tool.
    SixAxis,
}

impl Kind {
    /// As files say it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Planar => "planar",
            Kind::ThreeAxis => "3axis",
            Kind::SixAxis => "6axis",
        }
    }

    pub(super) fn of(name: Option<&str>) -> Option<Kind> {
        match name {
            None | Some("planar") => Some(Kind::Planar),
            Some("3axis") => Some(Kind::ThreeAxis),
            Some("6axis") => Some(Kind::SixAxis),
            Some(_) => None,
        }
    }
}

/// What segments are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    Loop,
    Polyline,
    Hatch,
    Spatial,
    Oriented,
}

impl Form {
    pub(super) const ALL: [(Form, &str, Kind); 5] = [
        (Form::Loop, "loop", Kind::Planar),
        (Form::Polyline, "polyline", Kind::Planar),
        (Form::Hatch, "hatch", Kind::Planar),
        (Form::Spatial, "polyline3d", Kind::ThreeAxis),
        (Form::Oriented, "polyline6d", Kind::SixAxis),
    ];

    pub(super) fn of(name: &str) -> Option<(Form, Kind)> {
        let found = Form::ALL.into_iter().find(|(_, n, _)| *n == name)?;
        Some((found.0, found.2))
    }

    /// Fewest points, or lines of a hatch.
    pub(super) fn least(self) -> usize {
        match self {
            Form::Hatch => 1,
            Form::Polyline | Form::Spatial | Form::Oriented => 2,
            Form::Loop => 3,
        }
    }
}

/// The words of roles under this project's namespace.
pub(super) const ROLES: [(Role, &str); 4] = [
    (Role::Contour, "contour"),
    (Role::Fill, "fill"),
    (Role::Skin, "skin"),
    (Role::Support, "support"),
];

/// The word of a role that deposits.
pub(super) fn role_word(role: Role) -> &'static str {
    let known = ROLES.iter().find(|(r, _)| *r == role);
    known.map_or("fill", |(_, word)| word)
}
