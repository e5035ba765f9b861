//! Why programs cannot be executed here, and what to do.

/// Why programs cannot be executed here.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{program}, line {line}: {why}{}; {}", also(.untold), .why.remedy())]
pub struct ProgramError {
    /// Program.
    pub program: String,
    /// Instruction number, from 1.
    pub line: u32,
    /// What is wrong.
    pub why: Refusal,
    /// Where a condition is not known: all registers and signals that conditions of the programs hang on and nobody tells.
    pub untold: Vec<String>,
}

/// What else has to be told, in words.
fn also(untold: &[String]) -> String {
    if untold.is_empty() {
        return String::new();
    }
    let names = untold.join(", ");
    format!("; all that conditions of these programs hang on and nobody tells: {names}")
}

/// What is wrong with an instruction.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// There is nothing to execute.
    #[error("there is no program")]
    NoProgram,
    /// A program does not end.
    #[error("the program does not end ({0})")]
    Loop(String),
    /// What comes next depends on a value that is not known.
    #[error("what comes next depends on values that are not known here ({0})")]
    Condition(String),
    /// A block without its other end.
    #[error("the block that begins or ends here has no other end")]
    Unpaired,
    /// A jump to nowhere.
    #[error("there is no LBL[{0}]")]
    Label(u32),
    /// No frame selected.
    #[error("a move comes before any {0}")]
    NoFrame(&'static str),
    /// A position of another frame.
    #[error("{name} was taught in {what} {taught}, but {selected} is selected")]
    OtherFrame {
        /// What its controller calls the position.
        name: String,
        /// `user frame` or `tool frame`.
        what: &'static str,
        /// The position's.
        taught: u32,
        /// The selected one.
        selected: u32,
    },
    /// No such position.
    #[error("P[{0}] is not in /POS")]
    NoPosition(u32),
    /// A position that no robot reaches.
    #[error("P[{0}] lies more than a kilometre from the origin of its frame")]
    Far(u32),
    /// A speed that has no meaning for this move, or that no robot has.
    #[error("the speed is not one of this kind of move, or none that a robot has")]
    Speed,
    /// A wait that never ends.
    #[error("a wait of {0} s, more than a day")]
    Wait(f64),
}

impl Refusal {
    /// What to do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Refusal::NoProgram => "give at least one",
            Refusal::Loop(_) => "export one round of the program, without the loop around it",
            Refusal::Condition(_) => {
                "give the registers and signals in the cell file (registers, [[program.position_register]], [[program.signal]]), or export the path without the surrounding logic"
            }
            Refusal::Unpaired => "pair IF … THEN with ENDIF, FOR with ENDFOR, WHILE with ENDWHILE",
            Refusal::Label(_) => "correct the jump or add the label",
            Refusal::NoFrame(_) => {
                "select both before the first move: of a FANUC UFRAME_NUM and UTOOL_NUM; of a KUKA $BASE and $TOOL, as BASE_DATA[n] and TOOL_DATA[n] or written out in numbers with X, Y, Z, A, B, C"
            }
            Refusal::OtherFrame { .. } => "select the frame the position was taught in",
            Refusal::Far(_) => "correct its coordinates, in mm",
            Refusal::NoPosition(_) => "export the program with its positions",
            Refusal::Wait(_) => "write the time that is meant, in seconds",
            Refusal::Speed => {
                "use a speed that the robot has, in mm/sec, cm/min or inch/min for L, C and A moves, % or a time for J moves"
            }
        }
    }
}
