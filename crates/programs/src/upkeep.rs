//! What a cell does between beads: torch cleaning and wire cut by calls of its own programs, the wait for a layer that cools, and how
//! programs are cut into files. Keys of the `[program]` table of a cell file.

use meltpath_base::{Time, choice, table};

choice! {
    /// How programs are cut into files.
    pub enum Split {
        Limits "limits" => "Where the limits of a program are reached.",
        Layer "layer" => "At each layer, under a main program that shows the layer; at the limits of a program too.",
    }
}

table! {
    /// A call between two beads, such as a torch cleaning or a wire cut. Counted from the start of the program, and from the last call.
    pub struct Service {
        /// The program of the cell that is called, the arc off and the torch at travel height.
        call: String => required;
        /// After so many beads.
        beads: u32 where within(1.0, 1e6) => none("not by beads");
        /// After so much time with the arc on.
        arc_time: Time where up_to(86_400.0) => none("not by time");
    }

    /// The digital input that is on once a layer is cool enough, such as that of a pyrometer.
    pub struct Cooled {
        /// Its number: FANUC's `DI`, KUKA's `$IN`, Yaskawa's `IN#`, standard inputs of a Universal Robot.
        input: u32 where within(0.0, 1e5) => none("needed for controllers that number inputs");
        /// Its name, on ABB and Stäubli.
        name: String => none("needed for controllers that name inputs");
    }
}
