//! Why a toolpath cannot become a program.

use meltpath_toolpath::{Event, PassPlace};

/// Why a toolpath cannot become a program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// A pass cannot be executed.
    #[error("{pass}: {what} is {value}, but must be {wanted}")]
    Pass {
        /// Which.
        pass: PassPlace,
        /// What is wrong.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// Something happens within a pass that the toolpath does not tell.
    #[error(
        "{pass}: {event:?} is not among the weaves of the toolpath; write it whole, or leave the event out"
    )]
    Event {
        /// Which.
        pass: PassPlace,
        /// What happens.
        event: Event,
    },
    /// A weave that has no words.
    #[error("{pass}: {what} cannot be written for {dialect}: {remedy}")]
    Weave {
        /// Which.
        pass: PassPlace,
        /// What has no words.
        what: &'static str,
        /// The dialect.
        dialect: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// More wire feeds than schedules.
    #[error(
        "the toolpath needs more wire feeds than this cell has weld schedules for, from {pass} on ({available}, those of them that its file lists with another wire feed left out): use fewer different wire feeds, list theirs as [[program.schedule]], or raise arc.schedules in the cell file"
    )]
    Schedules {
        /// Schedules of the cell.
        available: u32,
        /// First pass without a schedule.
        pass: PassPlace,
    },
    /// No schedule of the cell sets a wire feed.
    #[error(
        "no weld schedule of the cell sets the {} m/min of {pass}: list what the controller is given for it as [[program.schedule]] of the cell file (number, wire_feed, values){}",
        shown_feed(*.wire_feed), listed(.known)
    )]
    NoSchedule {
        /// Programmed wire feed speed, mm/s.
        wire_feed: f64,
        /// Those that the cell lists, mm/s.
        known: Vec<f64>,
        /// First pass without a schedule.
        pass: PassPlace,
    },
    /// The values of a schedule contradict its wire feed.
    #[error(
        "weld schedule {number} of the cell sets {} m/min, but its values are not what arc_values says, or say another wire feed: write one value for each of arc_values", shown_feed(*.wire_feed)
    )]
    Values {
        /// Its number.
        number: u32,
        /// Its wire feed, mm/s.
        wire_feed: f64,
    },
    /// A value of the cell that its controller does not take.
    #[error("program.{key} of the cell is {text}, but for {dialect} must be {wanted}")]
    Word {
        /// Which.
        key: &'static str,
        /// Its value, as it is written.
        text: String,
        /// The dialect.
        dialect: &'static str,
        /// What it must be.
        wanted: &'static str,
    },
    /// A positioner and a robot that both hold the part.
    #[error(
        "a positioner is to turn the part that the robot holds: leave external axes out of the plan, or [program.positioner] out of the cell file"
    )]
    TurnsWhatIsHeld,
    /// The cell does not say what a dialect needs.
    #[error(
        "the cell file does not say {what}, which programs for {dialect} need: write program.{key}"
    )]
    Cell {
        /// What.
        what: &'static str,
        /// The dialect.
        dialect: &'static str,
        /// The key.
        key: &'static str,
    },
    /// The bead to begin with is not there.
    #[error(
        "there is no bead {bead} in layer {layer}: {}", there(*.beads, *.layers)
    )]
    NoBead {
        /// Layer asked for.
        layer: u32,
        /// Bead asked for, from 1.
        bead: u32,
        /// Beads of that layer.
        beads: u32,
        /// First and last layer of the plan.
        layers: (u32, u32),
    },
    /// Nobody says when a service is due.
    #[error(
        "the cell's service {0} says neither after how many beads nor after how much arc time it is called: write beads or arc_time"
    )]
    Service(String),
    /// A controller for which no words for a positioner are written.
    #[error(
        "the toolpath turns the part by external axes, and programs for {0} that move them with the arm are not written: write them for FANUC, KUKA, ABB or Yaskawa, or let the part lie still"
    )]
    Positioner(&'static str),
    /// A controller for which no words for a track are written.
    #[error(
        "the toolpath moves the arm along a track, and programs for {0} that tell it are not written: {1}; write them for FANUC, KUKA, ABB or Yaskawa with a user frame that stands, or let the track rest (machine.external)"
    )]
    Track(&'static str, &'static str),
    /// Nothing to do.
    #[error("the toolpath has no pass: check the part's size, its place and the layer height")]
    Empty,
}

fn shown_feed(feed: f64) -> String {
    format!("{:.2}", feed * 0.06)
}

fn there(beads: u32, (first, last): (u32, u32)) -> String {
    match beads {
        0 => format!("the plan has layers {first} to {last}; beads count from 1"),
        n => format!("this layer has {n}, counted from 1"),
    }
}

fn listed(known: &[f64]) -> String {
    let feeds: Vec<String> = known.iter().map(|f| shown_feed(*f)).collect();
    if feeds.is_empty() {
        return "; it lists none".to_owned();
    }
    format!("; it lists {} m/min", feeds.join(", "))
}
