//! The verbs of moves: how each goes, and what the arc does at its end.

/// What the arc does at a move.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Stage {
    Start,
    Goes,
    End,
}

/// How a move goes.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Path {
    Joint,
    Straight,
    Round,
}

impl Path {
    /// The word of a move without arc.
    pub(super) fn plain(self) -> &'static str {
        match self {
            Path::Joint => "MoveJ",
            Path::Straight => "MoveL",
            Path::Round => "MoveC",
        }
    }
}

/// A verb: how the move goes, and the arc.
pub(super) fn verb(name: &str) -> Option<(Path, Option<Stage>)> {
    Some(match name.to_ascii_uppercase().as_str() {
        "MOVEJ" | "MOVEABSJ" => (Path::Joint, None),
        "MOVEL" => (Path::Straight, None),
        "MOVEC" => (Path::Round, None),
        "ARCLSTART" => (Path::Straight, Some(Stage::Start)),
        "ARCL" => (Path::Straight, Some(Stage::Goes)),
        "ARCLEND" => (Path::Straight, Some(Stage::End)),
        "ARCCSTART" => (Path::Round, Some(Stage::Start)),
        "ARCC" => (Path::Round, Some(Stage::Goes)),
        "ARCCEND" => (Path::Round, Some(Stage::End)),
        _ => return None,
    })
}
