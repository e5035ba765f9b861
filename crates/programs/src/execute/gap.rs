//! Lines that shape metal and are not simulated: which, why, and what to do about each.

use crate::held::Holds;

/// A line that shapes metal and that was not simulated as the controller would execute it.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// Program.
    pub program: String,
    /// Instruction number, or the line of the file, from 1.
    pub line: u32,
    /// The instruction in the words of its dialect.
    pub text: String,
    /// Why it was not simulated.
    pub why: Missing,
}

/// Why a line that shapes metal was not simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Missing {
    /// Weaving of which it is not known what it is.
    #[error("what this weaving is is not known: beads are laid as if the torch did not weave")]
    Weave,
    /// Weaving by numbers that no robot weaves with.
    #[error(
        "this weaving is none that robots make ({0}): beads are laid as if the torch did not weave"
    )]
    WeaveBeyond(String),
    /// A position that only the controller knows.
    #[error("the position {0} is known to the controller only: the move is left out")]
    Position(String),
    /// A position register that nothing sets to what is known: its name, and what it hangs on that nobody tells.
    #[error(
        "{name} hangs on {}, which the program does not set and the cell file does not tell: the move is left out",
        .untold.join(", ")
    )]
    Register {
        /// The register.
        name: String,
        /// What it hangs on.
        untold: Vec<String>,
    },
    /// A position of a bead of which only the joints are told, or nothing.
    #[error("{0} {1}: the move is left out")]
    JointPosition(String, NoPose),
    /// A joint move with the arc on.
    #[error(
        "the arc burns along a joint move, whose path is the robot's business: the move is left out"
    )]
    JointBead,
    /// A word that changes where a move goes.
    #[error("the place of this move is changed by {0}: the move is left out")]
    Offset(String),
    /// A circular move whose points tell no circle.
    #[error(
        "the points of this circular move tell no circle ({0}): it is laid as if it were straight"
    )]
    Circle(&'static str),
    /// A further motion group that stands elsewhere than at zero.
    #[error("motion group {0} moves the part or the robot, and only group 1 is simulated")]
    Positioner(u32),
    /// An external axis of the robot's group moves between the points of beads.
    #[error(
        "an external axis of the robot moves from here on, and whether it moves the part is not known"
    )]
    ExternalAxes,
    /// A bead laid with a positioner that moves, or of which it is not known where it stands.
    #[error("this bead is coordinated with a positioner that is not known to stand still at zero")]
    Coordinated,
    /// A bead in other frames than those before it.
    #[error(
        "this bead is in user frame {0} with tool frame {1}, those before it are in others: how the frames lie to each other is not known"
    )]
    Frames(String, String),
    /// A move of a bead that goes from some frames into others.
    #[error(
        "this bead goes from user frame {} with tool frame {} into user frame {} with tool frame {}: how the frames lie to each other is not known",
        .0[0], .0[1], .1[0], .1[1]
    )]
    Across([String; 2], [String; 2]),
    /// A bead that begins where a move ended that was left out, or before any move.
    #[error("where this bead begins is not known: the move to its start is not told")]
    Begins,
    /// A move along which the robot holds something else than along the first bead.
    #[error(
        "the robot holds {here} along this move, and {beads} along the first bead: the move is left out"
    )]
    HeldOtherwise {
        /// Along this move.
        here: Holds,
        /// Along the first bead.
        beads: Holds,
    },
    /// Tool and work object of a move that no controller moves by.
    #[error("by robhold of its tool and its work object the robot holds {0} along this move")]
    Holds(Holds),
    /// A program that does not say what the robot holds is run after one that said that the torch stands, or otherwise.
    #[error(
        "what the robot holds here was set by another program, and this one is read as if it held {0}"
    )]
    HoldsUnsaid(Holds),
    /// A program that was not given.
    #[error("program {0} is called, but was not given")]
    Call(String),
    /// A program that runs on the way of a move.
    #[error("{0} runs a program on the way of this move, which is not followed")]
    OnTheWay(String),
    /// An arc word whose setting of the source is not known.
    #[error("which wire feed {0} sets is not known")]
    Schedule(String),
    /// An arc word whose schedule comments tell otherwise, or not for its procedure: the word, and why.
    #[error("which wire feed {0} sets is not known: {1}")]
    ScheduleSaid(String, String),
    /// An end of the arc of which it is not known how much metal it lays in the crater.
    #[error("how long {0} stands on the crater, or what it feeds there, is not known")]
    Crater(String),
    /// The arc stands on the crater with values of which it is not known what they feed.
    #[error("what is fed while the arc stands on the crater ({0}) is not known")]
    CraterFeed(String),
    /// The source works in a mode of which the cell says nothing.
    #[error(
        "the source works in the mode {0} here, which is not the cell's: what feed and bead that gives is not known"
    )]
    Mode(String),
    /// The arm may be elsewhere after a call that is passed over.
    #[error(
        "where {0}, which is passed over, leaves the torch is not known, nor the way on from there"
    )]
    Returns(String),
    /// What data say of the begin or the end of a bead.
    #[error("the bead begins or ends otherwise than it is laid here: {0}")]
    Phase(String),
    /// A move without arc words between those that have them.
    #[error("whether the arc burns along {0} between the moves that start and end it is not known")]
    PlainMove(&'static str),
    /// The arc is switched off where it is off: the program that starts it was not given, or a bead is missing.
    #[error("the arc ends here, but it is off: what was to be laid before is not known")]
    ArcOff,
    /// The arc is still on at the end.
    #[error("the program ends with the arc on: the bead ends with its last move here")]
    ArcLeftOn,
    /// The speed of a bead is the content of a register that nothing sets, or that of an unknown weld schedule.
    #[error("the speed {0} of this bead is not known")]
    Speed(String),
    /// A smoothing that is not known.
    #[error("how {0} ends a move is not known")]
    Termination(String),
    /// Corners are rounded, and nobody says what their distance means for the motion.
    #[error("how this controller moves round corners that it rounds is not known")]
    Blend,
    /// A corner of a bead that is rounded farther than the corner model reaches: from which distance on, and how far it reaches, mm.
    #[error(
        "the path is left {0} mm before this corner of a bead, and the corner model of the cell reaches to {1} mm (program.blend): the corner is laid sharper than it is"
    )]
    Zone(f64, f64),
    /// A wait of unknown length with the arc on.
    #[error("the arc burns in place for a time that is not known")]
    WaitWithArc,
    /// A jump or a call of a job that hangs on what is not known.
    #[error(
        "whether {0} is executed, or where it leads, hangs on values that are not known here: what follows is executed as if it were not there"
    )]
    Jump(String),
    /// The program ends here where a condition holds that is not followed.
    #[error("{0} ends the program here where its condition holds, which is not followed")]
    MayEnd(String),
    /// An output that may set the welding source.
    #[error("{0} may set the welding source")]
    Output(String),
    /// A frame or a limit of the motion that is changed.
    #[error("{0} changes frames or motion of what follows")]
    Setting(String),
    /// Joints of a bead's move may go at a small share of their speeds alone.
    #[error(
        "joints go at {0} % of their speeds along this bead: whether they keep its speed is not known"
    )]
    SlowJoints(f64),
    /// Lines that begin as those of the arc do, and go on otherwise.
    #[error(
        "the lines before are those that switch the arc, and {0} is not how they go on: whether the arc burns is not known"
    )]
    ArcLines(String),
    /// A line that may set an output of those lines.
    #[error(
        "{0} may set an output by which the cell file's lines switch the arc: whether the arc burns is not known"
    )]
    ArcOutput(String),
    /// A bead gains its speed over a way that its metal shows, or may do so.
    #[error(
        "{0} is not followed along this bead: it begins and ends too slowly, with too much metal"
    )]
    Acceleration(String),
    /// The tool is turned otherwise at the ends of a move, and the controller leads it between them.
    #[error(
        "the controller leads the wrist along this move ({0}), and the tool is not known to be turned at its end as at its begin: how it is turned between them is not followed"
    )]
    Turns(String),
    /// A move along which the tool is turned by what is not followed.
    #[error("how the tool is turned along this move and at its end ({0}) is not followed")]
    Turned(String),
    /// A point of the part goes straight to a torch that stands while the part turns: the torch goes beside the line over the part.
    #[error(
        "a point of the part goes straight to the torch while the part turns ({0}), so that the torch leaves the line over the part: that is not followed"
    )]
    Bends(String),
    /// A word of a bead's move that is not known.
    #[error("what {0} does to this bead is not known")]
    Word(String),
    /// What the profile of a toolpath says and is not simulated, or does not say.
    #[error("{0}")]
    Profile(String),
    /// A variable that is set to what is not known here.
    #[error(
        "{0} sets a variable to what is not known here: arguments of a routine, and data that other lines set, are not followed"
    )]
    Value(String),
    /// An instruction that is not known.
    #[error("{0} is not an instruction that is known here")]
    Unknown(String),
}

/// What of an arm's motion a line leaves open that was not simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Open {
    /// Nothing: it is about the source.
    Nothing,
    /// How fast beads are driven, or which moves are beads.
    Speeds,
    /// Moves beside those that were followed, or how their corners go.
    Moves,
    /// Where every move goes: frames, tool, axes, or anything else.
    Places,
}

/// Which of X, Y, Z, W, P, R a position lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lacking(pub [bool; 6]);

impl std::fmt::Display for Lacking {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names = ["X", "Y", "Z", "W", "P", "R"].into_iter().zip(self.0);
        let names: Vec<&str> = names.filter(|(_, l)| *l).map(|(n, _)| n).collect();
        f.write_str(&names.join(", "))
    }
}

/// Why it is not known where a position lies of which no coordinates are told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoPose {
    /// It says nothing that can be read.
    #[error("is not taught")]
    Untaught,
    /// It tells a place, and lacks some of its components.
    #[error("lacks {0}")]
    Lacks(Lacking),
    /// It tells a place without saying how the arm stands there.
    #[error("has no CONFIG, without which a FANUC takes no place")]
    NoConfig,
    /// It is told in other units than this dialect's.
    #[error("is told in another unit than mm and deg")]
    Unit,
    /// Nobody says which arm has these joints.
    #[error("is given by joints, and no robot is named")]
    NoRobot,
    /// The arm that is named does not count its joints as this controller does.
    #[error("is given by joints, and the robot that is named is another maker's")]
    OtherMaker,
    /// It says other axes than the robot has.
    #[error("is given by other axes than those of the robot's file")]
    Axes,
}

impl NoPose {
    /// What to do about it.
    fn remedy(self) -> &'static str {
        match self {
            NoPose::Untaught => "teach the position, and export the program again",
            NoPose::Lacks(_) => {
                "write all of X, Y, Z in mm and W, P, R in deg, or export the program again from the controller"
            }
            NoPose::NoConfig => {
                "write the CONFIG of the position (CONFIG : 'N U T, 0, 0, 0',), or export the program again from the controller"
            }
            NoPose::Unit => "write X, Y, Z in mm and W, P, R in deg, as the controller does",
            NoPose::NoRobot => {
                "name the arm in the job (machine.robot), or give the position by place and orientation"
            }
            NoPose::OtherMaker => {
                "name an arm of this controller's maker in the job (machine.robot; `maker` of the robot's file)"
            }
            NoPose::Axes => {
                "six joints in degrees are read, and as many further axes as the robot's file has: write its [track] or [positioner]"
            }
        }
    }
}

const TURN_EVENLY: &str = "let the controller turn the tool evenly to what is taught ($ORI_TYPE=#VAR and $CIRC_TYPE=#BASE, no Wjnt, SingArea\\Off, mode=0), or teach the same orientation at both ends";
const TELL_CLOSER: &str = "tell points that lie closer where the part turns, or turn the part in a joint move in the air: halves of a move leave it by a quarter";
const LAY_ALONG_PATHS: &str =
    "lay the bead by a move along a path (L, C, LIN, MoveL), or end the arc before the joint move";
const WELD_IN_THE_MODE: &str = "weld in the mode of the cell file (program.krl.job_mode), whose beads were measured, or simulate with the cell file and the process map of that mode";
const BRING_IT_BACK: &str = "let it leave the torch where it was called, and list it in program.returning of the cell file; or put its file beside the program";
const THREE_POINTS: &str =
    "give three points of a circle that are apart; a full circle takes two moves";
const TELL_PLACES: &str = "give the position in the program by place and orientation, its offset included; variables that it names must be set from numbers in the routine that moves, before it does; what a FANUC's register PR[n] holds is told in the cell file ([[program.position_register]])";

const LIST_WEAVE: &str = "list the weave in the cell file ([[program.weave]]: number, shape, frequency, amplitude); sine, triangle and circle are simulated, of KUKA (with program.krl.weave_amplitude) and ABB zigzags without dwells, height and angle";
const WEAVE_AS_ROBOTS: &str = "write frequency, amplitude and dwells of the weave in the program as they are on the controller, with their units";
const TELL_VARIABLES: &str = "tell the variables that decide in the cell file (registers: name, number, value), or export the path without the jump";
const TAKE_OUT_OR_NAME: &str = "take the line out if it does not change the beads, or write the moves that it makes; where it calls what lays no metal, name that in passed_over of the cell file";
const TAKE_OUT: &str =
    "take the line out if it does not change the beads, or write the moves that it makes";
const TELL_REGISTERS: &str = "tell in the cell file what they hold before the program starts ([[program.position_register]]: number, x, y, z, w, p, r or joints; registers: number, value), or give the position in /POS";

impl Missing {
    /// What it leaves open of the arm's motion.
    pub fn open(&self) -> Open {
        match self {
            Missing::Schedule(_)
            | Missing::ScheduleSaid(..)
            | Missing::Mode(_)
            | Missing::Crater(_)
            | Missing::CraterFeed(_)
            | Missing::WaitWithArc
            | Missing::Output(_) => Open::Nothing,
            Missing::Profile(_)
            | Missing::Phase(_)
            | Missing::PlainMove(_)
            | Missing::ArcOff
            | Missing::ArcLeftOn
            | Missing::ArcLines(_)
            | Missing::ArcOutput(_)
            | Missing::Speed(_)
            | Missing::SlowJoints(_)
            | Missing::Acceleration(_) => Open::Speeds,
            Missing::Weave
            | Missing::WeaveBeyond(_)
            | Missing::Position(_)
            | Missing::Register { .. }
            | Missing::Circle(_)
            | Missing::Begins
            | Missing::JointPosition(..)
            | Missing::JointBead
            | Missing::Offset(_)
            | Missing::OnTheWay(_)
            | Missing::Returns(_)
            | Missing::Turns(_)
            | Missing::Bends(_)
            | Missing::Termination(_)
            | Missing::Blend
            | Missing::Zone(..) => Open::Moves,
            Missing::Positioner(_)
            | Missing::ExternalAxes
            | Missing::Coordinated
            | Missing::Frames(..)
            | Missing::Across(..)
            | Missing::HeldOtherwise { .. }
            | Missing::Holds(_)
            | Missing::HoldsUnsaid(_)
            | Missing::Call(_)
            | Missing::Jump(_)
            | Missing::MayEnd(_)
            | Missing::Setting(_)
            | Missing::Turned(_)
            | Missing::Word(_)
            | Missing::Value(_)
            | Missing::Unknown(_) => Open::Places,
        }
    }

    /// What to do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Missing::Weave => LIST_WEAVE,
            Missing::WeaveBeyond(_) => WEAVE_AS_ROBOTS,
            Missing::JointPosition(_, why) => why.remedy(),
            Missing::JointBead => LAY_ALONG_PATHS,
            Missing::Position(_) | Missing::Offset(_) => TELL_PLACES,
            Missing::Register { .. } => TELL_REGISTERS,
            Missing::Circle(_) => THREE_POINTS,
            Missing::Positioner(_) | Missing::Coordinated => {
                "tell the positioner in the cell file ([program.positioner]; with its COORD on every move of a bead), or export the part of the program in which it stands at zero"
            }
            Missing::ExternalAxes => {
                "tell a track that carries the arm in the cell file ([program.track]), or simulate the beads that are laid with the external axes at one place by themselves"
            }
            Missing::Frames(..) => "simulate the beads of each frame by themselves",
            Missing::Across(..) => {
                "tell the place where the arc is struck in the frames of the bead, and all places of a bead in the same user frame and tool"
            }
            Missing::Begins => {
                "tell the place where the arc is struck by place and orientation, in a move before the arc starts"
            }
            Missing::HeldOtherwise { .. } => {
                "simulate the beads that are laid with the torch on the robot, and those that are laid with the part on it, by themselves"
            }
            Missing::Holds(_) => {
                "write TRUE for what the robot holds and FALSE for what stands: one of tooldata and wobjdata each"
            }
            Missing::HoldsUnsaid(_) => {
                "set $IPO_MODE in each program that moves: #TCP where the torch stands, #BASE where the robot holds it"
            }
            Missing::Call(_) => {
                "put its file beside the program, or name it in passed_over of the cell file if it lays no metal"
            }
            Missing::OnTheWay(_) => {
                "name the program in passed_over of the cell file if it lays no metal, or call it where the torch stops"
            }
            Missing::Schedule(_) => {
                "list the weld schedule in the cell file ([[program.schedule]]: number, wire_feed, travel_speed), or what the numbers mean (arc_values)"
            }
            Missing::ScheduleSaid(..) => {
                "list what it sets in the cell file ([[program.schedule]]: number, procedure, wire_feed), or leave one comment of each schedule and one procedure"
            }
            Missing::Crater(_) => {
                "list the schedule with its crater_time in the cell file ([[program.schedule]]), or write time and values as arc_values says them (Arc End[1,7.0,18.5,0.5s]); 0.0s fills no crater"
            }
            Missing::CraterFeed(_) => {
                "end the arc with a time alone, at what burns, or without one"
            }
            Missing::Mode(_) => WELD_IN_THE_MODE,
            Missing::Returns(_) => BRING_IT_BACK,
            Missing::PlainMove(_) => {
                "write ArcL or ArcC where the arc burns, and end it before where it does not"
            }
            Missing::Phase(_) => {
                "set it to zero in the data that the weld names, or simulate the program without it"
            }
            Missing::ArcOff | Missing::ArcLeftOn => {
                "pair each start of the arc with one end, or run the program that calls this one"
            }
            Missing::Speed(_) => {
                "write the speed out, set the register in the program, or give it in the cell file (registers, [[program.schedule]])"
            }
            Missing::Termination(_) => {
                "say how the move ends in words of its dialect: that it stops, or how far it is smoothed"
            }
            Missing::Blend => {
                "tell the distance of full smoothing in the cell file (program.blend), identified with [motion] on this controller"
            }
            Missing::Zone(..) => {
                "let beads leave their corners no farther than program.blend of the cell file, or identify [motion] and program.blend with corners that are rounded so"
            }
            Missing::WaitWithArc => "write the time, or end the arc before the wait",
            Missing::Output(_) => {
                "tell in the cell file what it sets ([[program.output]]: name, number, value, and the schedule that it calls, or none where it shapes no metal)"
            }
            Missing::Profile(_) => {
                "say speed (depositionspeed) and wire feed (mp:wirefeed) at each profile and nothing else that shapes beads; the job's bead stands in for what is not said"
            }
            Missing::Acceleration(_) => {
                "leave beads the controller's usual acceleration, or one that reaches their speed within a tenth of the bead's width"
            }
            Missing::SlowJoints(_) => {
                "raise vel of the movement descriptor; tmax says the speed along the path"
            }
            Missing::ArcLines(_) | Missing::ArcOutput(_) => {
                "write the lines out as the cell file has them (arc_start, arc_end), with numbers in the places of values"
            }
            Missing::MayEnd(_) => {
                "take the condition out, and simulate what the program does with it and without it"
            }
            Missing::Turns(_) | Missing::Turned(_) => TURN_EVENLY,
            Missing::Bends(_) => TELL_CLOSER,
            Missing::Value(_) => {
                "write the numbers in their places, or set the variable in the routine that moves, from numbers"
            }
            Missing::Jump(_) => TELL_VARIABLES,
            Missing::Unknown(_) => TAKE_OUT_OR_NAME,
            Missing::Setting(_) | Missing::Word(_) => TAKE_OUT,
        }
    }
}
