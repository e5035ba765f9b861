//! A robot program, whatever its dialect: instructions in order and the table of taught positions.
//!
//! Numbers are as files hold them: mm and degrees, speeds in the unit written.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_base::choice;
use meltpath_toolpath::Weave;

use crate::acceleration::Acceleration;
pub use crate::arc_word::{ArcAction, ArcLine, ArcStyle, ArcValue, ArcWord, Unsaid};
use crate::held::Holds;
use crate::modal::{Modal, SetSpeed};
use crate::said_frames::SaidFrames;

choice! {
    /// Languages of controllers.
    pub enum Dialect {
        FanucLs "fanuc-ls" => "FANUC TP, text form (`.ls`).",
        Krl "kuka-krl" => "KUKA KRL (`.src` with `.dat`), arc by ArcTech.",
        Rapid "abb-rapid" => "ABB RAPID (`.mod`), arc by ArcWare.",
        UrScript "ur-script" => "Universal Robots script (`.script`), arc by lines of your own.",
        Inform "yaskawa-inform" => "Yaskawa INFORM (`.JBI`), arc by condition files.",
        Val3 "staubli-val3" => "Stäubli VAL3 (a project: `.pjx`, `.pgx`, `.dtx`), arc by lines of your own.",
    }
}

/// The word of a move along a path whose joints go at a small share of their speeds: the share follows, %.
pub(crate) const JOINTS_AT: &str = "joints at ";

/// The word of a move that goes with a positioner: FANUC's own, and what stands here for a Yaskawa's `SMOVL`.
pub(crate) const COORDINATED: &str = "COORD";

/// One program.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// What it is written in.
    pub dialect: Dialect,
    /// Name on the controller.
    pub name: String,
    /// What follows the name, such as `Macro`.
    pub kind: String,
    /// Header, in order.
    pub attributes: Vec<Attribute>,
    /// Lines of the application header, verbatim.
    pub application: Vec<String>,
    /// The instructions; the controller numbers them from 1.
    pub instructions: Vec<Instruction>,
    /// Taught positions.
    pub positions: Vec<Position>,
    /// Sections that no one here reads, verbatim.
    pub sections: Vec<Section>,
    /// Line in its file of each instruction, from 1; empty where the controller numbers instructions.
    pub lines: Vec<u32>,
    /// Each instruction as its file writes it; empty where its text is the one written here.
    pub texts: Vec<String>,
    /// Kept lines that have to do with those that switch the arc, by their index.
    pub arc_lines: BTreeMap<usize, ArcLine>,
    /// Kept lines that shape no metal by the kinds of what they name, by their index.
    pub passes: BTreeSet<usize>,
    /// What instructions do to beads beside their own words, by their index.
    pub unsaid: BTreeMap<usize, Vec<Unsaid>>,
    /// Where it says that its frames lie.
    pub said_frames: SaidFrames,
    /// What its lines set for the moves to come, whichever program makes them.
    pub modal: Modal,
}

impl Default for Program {
    fn default() -> Self {
        Program {
            dialect: Dialect::FanucLs,
            name: String::new(),
            kind: String::new(),
            attributes: Vec::new(),
            application: Vec::new(),
            instructions: Vec::new(),
            positions: Vec::new(),
            sections: Vec::new(),
            lines: Vec::new(),
            texts: Vec::new(),
            arc_lines: BTreeMap::new(),
            passes: BTreeSet::new(),
            unsaid: BTreeMap::new(),
            said_frames: SaidFrames::default(),
            modal: Modal::default(),
        }
    }
}

/// An entry of the header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attribute {
    /// Name.
    pub key: String,
    /// Value, empty where none is written.
    pub value: String,
}

/// A section kept as it was.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Name without its slash, with what follows it on its line.
    pub name: String,
    /// Lines.
    pub lines: Vec<String>,
}

/// One instruction.
#[derive(Debug, Clone, PartialEq)]
pub enum Instruction {
    /// A move.
    Motion(MotionInstruction),
    /// Arc on or off, on a line of its own.
    Arc(ArcWord),
    /// Weaving begins, or ends, for the moves to come; of dialects that tell it with their moves.
    Weave(Option<Weave>),
    /// Waits, s.
    Wait(f64),
    /// Selects a user frame.
    UserFrame(u32),
    /// Selects a tool frame.
    ToolFrame(u32),
    /// What the robot holds from here on. Positions are those of the torch in the part, whoever holds which.
    Holds(Holds),
    /// Runs another program.
    Call {
        /// Its name.
        program: String,
        /// What stands between the parentheses; empty without.
        arguments: String,
    },
    /// Says something to people.
    Comment {
        /// How it is written.
        mark: CommentMark,
        /// The text.
        text: String,
    },
    /// A place to jump to.
    Label {
        /// Number.
        number: u32,
        /// Its comment.
        comment: Option<String>,
    },
    /// Jumps to a label.
    Jump(u32),
    /// Returns to the caller.
    End,
    /// Nothing.
    Blank,
    /// Anything else, verbatim.
    Raw(String),
}

/// How a comment is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommentMark {
    /// `!text`
    Remark,
    /// `//instruction`: an instruction switched off.
    SwitchedOff,
    /// `--eg:text`: a comment in one of the controller's languages.
    Language,
}

/// A move.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionInstruction {
    /// How.
    pub kind: MotionKind,
    /// Where to.
    pub target: PositionRef,
    /// How fast.
    pub speed: Speed,
    /// How it ends.
    pub termination: Termination,
    /// What the arc does at its end.
    pub arc: Option<ArcWord>,
    /// Further words of the line, verbatim.
    pub extra: Vec<String>,
    /// How quickly it gains its speed, where the program says it.
    pub acceleration: Option<Acceleration>,
    /// How fast it turns the tool at the most, °/s, where the program says it.
    pub turns: Option<f64>,
}

/// From here on a limit of turning limits nothing, °/s: that of all speeds that ABB predefines, which no wrist comes to.
const ANY_TURN: f64 = 500.0;

impl MotionInstruction {
    /// The tool turns at most so fast, °/s.
    pub(crate) fn turns_at_most(&mut self, limit: Option<f64>) {
        self.turns = limit.filter(|limit| *limit < ANY_TURN);
    }

    /// A move that switches nothing and says nothing else.
    pub(crate) fn plain(
        kind: MotionKind,
        target: PositionRef,
        speed: Speed,
        termination: Termination,
    ) -> Self {
        MotionInstruction {
            kind,
            target,
            speed,
            termination,
            arc: None,
            extra: Vec::new(),
            acceleration: None,
            turns: None,
        }
    }
}

/// How a move goes.
#[derive(Debug, Clone, PartialEq)]
pub enum MotionKind {
    /// By the joints: the path is the robot's business.
    Joint,
    /// Straight.
    Linear,
    /// On the circle through the last position, `via` and the target.
    Circular {
        /// The point on the way.
        via: PositionRef,
    },
    /// On the circle through three consecutive targets of such moves.
    CircleArc,
}

/// What a move refers to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PositionRef {
    /// An entry of the position table.
    Point {
        /// Its number.
        index: u32,
        /// Its comment on this line.
        comment: Option<String>,
    },
    /// Something that only the controller knows, verbatim: a position register, an indirect index.
    Unresolved(String),
}

impl PositionRef {
    /// The point `index` without comment.
    pub fn point(index: u32) -> Self {
        PositionRef::Point {
            index,
            comment: None,
        }
    }
}

/// The speed of a move.
#[derive(Debug, Clone, PartialEq)]
pub enum Speed {
    /// A number.
    Value {
        /// In `unit`.
        value: f64,
        /// Unit.
        unit: SpeedUnit,
    },
    /// The content of a register.
    Register {
        /// Its number.
        number: u32,
        /// Unit of the content.
        unit: SpeedUnit,
    },
    /// The speed of the active weld schedule.
    Weld,
    /// As fast as the robot can.
    Maximum,
    /// One that is not known here, in the program's words.
    Other(String),
}

impl Speed {
    /// Along the path, mm/s.
    pub(crate) fn path(value: f64) -> Self {
        Speed::Value {
            value,
            unit: SpeedUnit::MillimetrePerSecond,
        }
    }

    /// As a line has set it, while the weld data that are on say `weld`, mm/s.
    pub(crate) fn set(set: &SetSpeed, weld: Option<f64>) -> Self {
        match set {
            SetSpeed::Path(speed) => Speed::path(*speed),
            SetSpeed::Weld => weld.map_or(Speed::Weld, Speed::path),
            SetSpeed::Other(words) => Speed::Other(words.clone()),
        }
    }

    /// A share of what joints can do, %.
    pub(crate) fn share(value: f64) -> Self {
        Speed::Value {
            value,
            unit: SpeedUnit::Percent,
        }
    }

    /// The number, where it is given in this unit.
    pub(crate) fn given_in(&self, wanted: SpeedUnit) -> Option<f64> {
        match self {
            Speed::Value { value, unit } if *unit == wanted => Some(*value),
            _ => None,
        }
    }
}

/// Units of speeds, and of durations where a move is given its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpeedUnit {
    /// mm/s.
    MillimetrePerSecond,
    /// cm/min.
    CentimetrePerMinute,
    /// in/min.
    InchPerMinute,
    /// °/s.
    DegreePerSecond,
    /// Share of the robot's joint speed, %.
    Percent,
    /// Duration, s.
    Second,
    /// Duration, ms.
    Millisecond,
}

impl SpeedUnit {
    /// Every unit, longest symbol first.
    pub const ALL: [SpeedUnit; 7] = [
        SpeedUnit::InchPerMinute,
        SpeedUnit::DegreePerSecond,
        SpeedUnit::MillimetrePerSecond,
        SpeedUnit::CentimetrePerMinute,
        SpeedUnit::Millisecond,
        SpeedUnit::Second,
        SpeedUnit::Percent,
    ];

    /// As programs write it.
    pub fn symbol(self) -> &'static str {
        match self {
            SpeedUnit::MillimetrePerSecond => "mm/sec",
            SpeedUnit::CentimetrePerMinute => "cm/min",
            SpeedUnit::InchPerMinute => "inch/min",
            SpeedUnit::DegreePerSecond => "deg/sec",
            SpeedUnit::Percent => "%",
            SpeedUnit::Second => "sec",
            SpeedUnit::Millisecond => "msec",
        }
    }
}

/// How a move ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Termination {
    /// Stops.
    Fine,
    /// Goes on smoothly, 0 to 100.
    Cnt(u8),
    /// Smoothing from a register.
    CntRegister(u32),
    /// Leaves the path at this distance before its end, mm, and joins the next.
    Blend(f64),
    /// Another word, verbatim.
    Other(String),
}

/// The word of a KUKA that rounds a corner by the distance that is set.
pub(crate) const BY_DISTANCE: &str = "C_DIS";

impl Termination {
    /// By [`BY_DISTANCE`], which leaves the path at this distance, mm, where it is known.
    pub(crate) fn rounded(distance: Option<f64>) -> Self {
        match distance.filter(|distance| *distance > 0.0) {
            Some(distance) => Termination::Blend(distance),
            None => Termination::Other(BY_DISTANCE.to_owned()),
        }
    }
}

/// A taught position.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// Number.
    pub index: u32,
    /// Its comment.
    pub comment: Option<String>,
    /// One entry a motion group.
    pub groups: Vec<Group>,
}

impl Position {
    /// Where the robot itself stands.
    pub(crate) fn robot(&self) -> Option<&Group> {
        self.groups.iter().find(|g| g.number == 1)
    }

    /// Its name on the controller, `P` and its number where nobody named it.
    pub(crate) fn name(&self) -> String {
        let named = self.comment.clone();
        named.unwrap_or_else(|| format!("P{}", self.index))
    }
}

/// Where one motion group stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Group number; 1 is the robot.
    pub number: u32,
    /// User frame, where it is a number.
    pub frame: Option<u32>,
    /// Tool frame, where it is a number.
    pub tool: Option<u32>,
    /// The coordinates.
    pub coordinates: Coordinates,
}

/// Coordinates of a group.
#[derive(Debug, Clone, PartialEq)]
pub enum Coordinates {
    /// Tool in user frame.
    Cartesian {
        /// Configuration of the arm, verbatim.
        config: String,
        /// X, Y, Z, mm.
        xyz: [f64; 3],
        /// W, P, R, degrees.
        wpr_degrees: [f64; 3],
        /// External axes.
        external: Vec<Axis>,
    },
    /// Joint values.
    Joint(Vec<Axis>),
    /// What no one here reads, verbatim: an untaught position, for example.
    Unread(String),
}

/// A named axis value.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name, such as `J1` or `E1`.
    pub name: String,
    /// Value in `unit`.
    pub value: f64,
    /// `deg` or `mm`.
    pub unit: String,
}

impl Axis {
    /// The joints of an arm by their numbers, degrees.
    pub fn joints(angles: impl IntoIterator<Item = f64>) -> Vec<Axis> {
        let axis = |(value, number): (f64, u32)| Axis {
            name: format!("J{number}"),
            value,
            unit: "deg".to_owned(),
        };
        angles.into_iter().zip(1..).map(axis).collect()
    }

    /// The six joints of an arm, deg as its controller shows them, and the axes beyond them; nothing where they are no such joints.
    pub fn of_arm(axes: &[Axis]) -> Option<([f64; 6], &[Axis])> {
        let (arm, beyond) = axes.split_at_checked(6)?;
        let numbered = |(axis, number): (&Axis, u32)| {
            let letter = axis.name.strip_suffix(&number.to_string())?;
            let turns = axis.unit.eq_ignore_ascii_case("deg") && matches!(letter, "J" | "A");
            turns.then_some(axis.value)
        };
        let angles: Option<Vec<f64>> = arm.iter().zip(1..).map(numbered).collect();
        Some((angles?.try_into().ok()?, beyond))
    }
}

impl Dialect {
    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Dialect::FanucLs => "FANUC",
            Dialect::Krl => "KUKA KRL",
            Dialect::Rapid => "ABB RAPID",
            Dialect::UrScript => "URScript",
            Dialect::Inform => "Yaskawa INFORM",
            Dialect::Val3 => "Stäubli VAL3",
        }
    }

    /// Whether axes that turn the part are a group of their own, which goes with the arm by a word of the move.
    pub(crate) fn tells_stations_apart(self) -> bool {
        matches!(self, Dialect::FanucLs | Dialect::Inform)
    }

    /// Whether each move names the frames that it is in, so that no other line selects them.
    pub(crate) fn moves_name_frames(self) -> bool {
        matches!(self, Dialect::Rapid | Dialect::Inform | Dialect::Val3)
    }
}

/// Header entries that name a tool and a user frame: this, a space, the number.
pub(crate) const TOOL: &str = "TOOL";
/// See [`TOOL`].
pub(crate) const USER_FRAME: &str = "WOBJ";

impl Program {
    /// Names of user and tool frame by their numbers, which are the program's own: those of its header, else the numbers.
    pub fn frame_names(&self, (frame, tool): (u32, u32)) -> [String; 2] {
        [(USER_FRAME, frame), (TOOL, tool)].map(|(what, number)| {
            let name = self.attribute(&format!("{what} {number}"));
            name.map_or_else(|| number.to_string(), str::to_lowercase)
        })
    }

    /// Names a tool or a user frame in the header, once.
    pub(crate) fn name_frame(&mut self, what: &str, number: u32, name: &str) {
        let key = format!("{what} {number}");
        if self.attribute(&key).is_none() {
            self.attributes.push(Attribute {
                key,
                value: name.to_owned(),
            });
        }
    }

    /// The value of a header entry.
    pub fn attribute(&self, key: &str) -> Option<&str> {
        let found = self
            .attributes
            .iter()
            .find(|a| a.key.eq_ignore_ascii_case(key));
        found.map(|a| a.value.as_str())
    }

    /// The number by which people find instruction `number` (from 1): its line in the file where the controller numbers none.
    pub fn line_of(&self, number: u32) -> u32 {
        let at = (number as usize).checked_sub(1);
        let line = at.and_then(|i| self.lines.get(i));
        line.copied().unwrap_or(number)
    }

    /// What the dialect calls a position.
    pub(crate) fn name_of(&self, index: u32) -> String {
        let named = || {
            let position = self.positions.iter().find(|p| p.index == index);
            position.and_then(|p| p.comment.clone())
        };
        match self.dialect {
            Dialect::FanucLs => format!("P[{index}]"),
            // a name that only numbers is not kept
            Dialect::Krl | Dialect::Rapid => named().unwrap_or_else(|| format!("P{index}")),
            Dialect::UrScript | Dialect::Inform | Dialect::Val3 => {
                named().unwrap_or_else(|| "the place of this move".to_owned())
            }
        }
    }
}
