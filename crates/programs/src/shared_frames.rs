//! Frames that several programs share: the controller's tables, which one sets for another, and the robot's own frame.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_geometry::Pose;

use crate::held::Holds;
use crate::krl;
use crate::program::{Dialect, Instruction, Program, USER_FRAME};
use crate::said_frames::{Changed, SetFrame, WRITTEN_OUT, Which, written_out};
use crate::ur_script::BASE;

/// Where the controller's tables are set by one program for another: a frame that all set alike, before anything is called, lies there for all; of any other it is
/// told that nobody follows which value holds.
pub fn agree(programs: &mut [Program]) {
    number_alike(programs);
    let entries: Vec<Set> = programs.iter().enumerate().flat_map(sets).collect();
    let names: Vec<String> = programs.iter().map(|p| p.name.clone()).collect();
    let all: BTreeSet<Entry> = entries.iter().map(Set::entry).collect();
    for (i, program) in programs.iter_mut().enumerate() {
        for entry in &all {
            let set: Vec<&Set> = entries.iter().filter(|set| set.entry() == *entry).collect();
            let said = program.said_frames.of(entry.0).contains_key(&entry.1);
            let Some(first) = set.first().filter(|_| uses(program, *entry)) else {
                continue;
            };
            let same = set.iter().all(|set| set.frame.pose == first.frame.pose);
            let mut others = set.iter().filter(|set| set.program != i);
            let unknown = match same {
                true => others.find(|set| !set.early),
                // one that sets it itself knows which
                false if said => others.next(),
                false => others
                    .next()
                    .or(set.first().filter(|_| selects(program, *entry))),
            };
            if let Some(set) = unknown {
                program.said_frames.changed.push(Changed {
                    program: names.get(set.program).cloned().unwrap_or_default(),
                    line: set.frame.line,
                    text: set.frame.text.clone(),
                });
            } else if same && !said {
                let known = program.said_frames.of_mut(entry.0);
                known.insert(entry.1, first.frame.pose);
            }
        }
    }
}

/// An entry of the controller's tables.
type Entry = (Which, u32);

/// An entry that a program sets.
struct Set {
    /// The program's number, from 0.
    program: usize,
    frame: SetFrame,
    /// It does so before it calls another.
    early: bool,
}

impl Set {
    fn entry(&self) -> Entry {
        (self.frame.which, self.frame.number)
    }
}

fn sets((i, program): (usize, &Program)) -> Vec<Set> {
    let calls = |instruction: &Instruction| matches!(instruction, Instruction::Call { .. });
    let first = program.instructions.iter().position(calls);
    let early = |at: Option<usize>| at.zip(first).is_none_or(|(at, first)| at < first);
    let all = program.said_frames.set.iter();
    let set = all.map(|frame| Set {
        program: i,
        frame: frame.clone(),
        early: early(frame.at),
    });
    set.collect()
}

/// Frames that programs write out have one number in all of them, as what is selected stays so in programs that are called, and behind them.
fn number_alike(programs: &mut [Program]) {
    for which in [Which::User, Which::Tool] {
        let mut all = BTreeMap::new();
        let mut renamed = Vec::new();
        for program in programs.iter() {
            let own = program.said_frames.of(which).range(WRITTEN_OUT..);
            let own = own.map(|(n, pose)| (*n, written_out(&mut all, *pose)));
            renamed.push(own.collect::<BTreeMap<u32, u32>>());
        }
        for (program, renamed) in programs.iter_mut().zip(&renamed) {
            let known = program.said_frames.of_mut(which);
            known.retain(|n, _| *n < WRITTEN_OUT);
            known.extend(all.clone());
            for instruction in &mut program.instructions {
                let ((Instruction::UserFrame(n), Which::User)
                | (Instruction::ToolFrame(n), Which::Tool)) = (instruction, which)
                else {
                    continue;
                };
                *n = renamed.get(n).copied().unwrap_or(*n);
            }
            for own in program.modal.own.values_mut() {
                if let Some(n) = own.frame_mut(which) {
                    *n = renamed.get(n).copied().unwrap_or(*n);
                }
            }
        }
    }
}

/// The frames of a kind that a program selects.
fn selected(program: &Program, which: Which) -> impl Iterator<Item = u32> {
    let lines = program.instructions.iter();
    let lines = lines.filter_map(move |i| match (i, which) {
        (Instruction::UserFrame(n), Which::User) | (Instruction::ToolFrame(n), Which::Tool) => {
            Some(*n)
        }
        _ => None,
    });
    lines.chain(program.modal.own_frames(which))
}

/// Whether a program selects an entry by its own number.
fn selects(program: &Program, (which, number): Entry) -> bool {
    selected(program, which).any(|n| n == number)
}

/// Whether moves of a program may be made in an entry: it selects it, sets it, or moves in what the one that calls it has selected.
fn uses(program: &Program, entry: Entry) -> bool {
    let sets = program.said_frames.set.iter();
    let mut sets = sets.map(|set| (set.which, set.number));
    let inherits = selected(program, entry.0).next().is_none();
    inherits || selects(program, entry) || sets.any(|set| set == entry)
}

/// The number of the frame in which moves are told that lie in the robot's own, where no frame of the controller is known to lie there.
const OF_PART: u32 = 1000;

/// The user frames of a program that are the robot's own: `UFRAME_NUM=0`, `$WORLD`, `wobj0`, `///POSTYPE BASE`, a script's plain poses; as far as moves
/// are in them.
pub fn own_frames(program: &Program) -> Vec<u32> {
    let of_positions = program.positions.iter().flat_map(|p| &p.groups);
    let of_positions = of_positions.filter_map(|g| g.frame);
    let selected = selected(program, Which::User);
    let all: BTreeSet<u32> = of_positions.chain(selected).collect();
    all.into_iter().filter(|n| is_own(program, *n)).collect()
}

/// Whether a user frame of a program is the robot's own, be it selected there or in what calls it.
pub fn is_own(program: &Program, number: u32) -> bool {
    let said = program.said_frames.user.get(&number);
    let named = |name: &str| program.frame_names((number, 0))[0] == name;
    match program.dialect {
        Dialect::FanucLs | Dialect::Inform => number == 0 && said.is_none(),
        Dialect::Krl => number == 0 || (number >= WRITTEN_OUT && said == Some(&Pose::IDENTITY)),
        Dialect::Rapid => named("wobj0"),
        Dialect::UrScript => number == BASE,
        Dialect::Val3 => named("world"),
    }
}

/// Tells the moves of a program that lie in its user frame `own` in that of the part, which is called `name` there: `part` and `own_frame` are where the part's and
/// the robot's own frame lie in the arm's base.
pub fn tell_in_part(program: &mut Program, own: u32, name: &str, [part, own_frame]: [Pose; 2]) {
    let numbered = name.parse::<u32>().ok();
    let listed = program.said_frames.user.keys().copied();
    let mut listed = listed.filter(|n| program.frame_names((*n, 0))[0] == name);
    let number = numbered.or_else(|| listed.next()).unwrap_or(OF_PART);
    if number == OF_PART {
        program.said_frames.user.insert(OF_PART, part);
        program.name_frame(USER_FRAME, OF_PART, name);
    }
    let shift = part.inverse().then(own_frame);
    program.said_frames.told_in.insert(own, (number, shift));
}

/// Tells the moves of a program in its user frame that is called `name`, as far as it says in numbers how that and theirs lie: a torch on the robot, and a part that no
/// machine moves.
pub fn tell_in_named(program: &mut Program, name: &str) {
    let holds = program.instructions.iter();
    let stands = holds.filter_map(|i| match i {
        Instruction::Holds(holds) => Some(*holds),
        _ => None,
    });
    if stands.into_iter().any(|holds| holds != Holds::Torch) || krl::is_coupled(program) {
        return;
    }
    let listed = program.said_frames.user.iter();
    let mut listed = listed.filter(|(n, _)| program.frame_names((**n, 0))[0] == name);
    let (number, part) = match listed.next() {
        Some((number, pose)) => (*number, *pose),
        None => match program.said_frames.declared.get(name) {
            Some(pose) => (OF_PART, *pose),
            None => return,
        },
    };
    if number == OF_PART {
        program.said_frames.user.insert(OF_PART, part);
        program.name_frame(USER_FRAME, OF_PART, name);
    }
    let said = &mut program.said_frames;
    let others = said.user.iter().filter(|(n, _)| **n != number);
    let told: Vec<(u32, Pose)> = others
        .map(|(n, pose)| (*n, part.inverse().then(*pose)))
        .collect();
    for (other, shift) in told {
        said.told_in.entry(other).or_insert((number, shift));
    }
}
