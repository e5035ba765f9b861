//! What a simulated run amounts to: times, and how the tool passed the end of each command.

use serde::{Deserialize, Serialize};

use crate::command::{Command, Kind, Source};

/// How one command went.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CommandRecord {
    /// The command's number, as given.
    pub id: u32,
    /// Instant at which the tool passed on to this command, s.
    pub start: f64,
    /// Instant at which it passed on to the next, s.
    pub end: f64,
    /// Lowest speed at the passage from this command to the next, mm/s; 0 at stops.
    pub passage_speed: f64,
    /// Distance from the programmed end point to the path, mm.
    pub deviation: f64,
}

/// Times of a run and the record of each command.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// From the first start to the last stop, s.
    pub total_time: f64,
    /// With the arc on, s.
    pub arc_time: f64,
    /// Waiting without arc, s.
    pub pause_time: f64,
    /// Moving without arc, s.
    pub travel_time: f64,
    /// Wire fed, mm.
    pub wire: f64,
    /// Samples given to the sink.
    pub samples: u64,
    /// The commands, in order.
    pub commands: Vec<CommandRecord>,
}

impl Summary {
    /// Counts the time that a command takes, s, and the wire that it feeds.
    pub(crate) fn spend(&mut self, command: &Command, duration: f64) {
        match (command.source, command.kind) {
            (Source::On { wire_feed }, _) => {
                self.arc_time += duration;
                self.wire += duration * wire_feed;
            }
            (Source::Off, Kind::Wait { .. }) => self.pause_time += duration,
            (Source::Off, _) => self.travel_time += duration,
        }
    }
}
