//! What ArcTech on a KUKA is given: the `[program.krl]` table of a cell file.

use meltpath_base::{Time, choice, table};

choice! {
    /// What the amplitude of a weave is.
    pub enum WeaveAmplitude {
        Side "side" => "From the path to one side.",
        Across "across" => "From one side to the other.",
    }
}

impl WeaveAmplitude {
    /// How many of ArcTech's millimetres one to one side is.
    pub(super) fn per_side(self) -> f64 {
        match self {
            WeaveAmplitude::Side => 1.0,
            WeaveAmplitude::Across => 2.0,
        }
    }
}

table! {
    /// ArcTech's names and times; what its channels hold stands in the schedules.
    pub struct KrlWords {
        /// Who says so: the project of the cell.
        source: String => required;
        /// The job mode of ArcTech's project (`JobModeId`).
        job_mode: String => required;
        /// The parameter set by which the arc is struck.
        strike_set: String => default("Set1", "ArcTech's first");
        /// The parameter set by which metal is laid.
        weld_set: String => default("Set2", "ArcTech's second");
        /// The parameter set by which the crater is filled.
        crater_set: String => default("Set3", "ArcTech's third");
        /// Gas before the arc.
        preflow: Time where within(0.0, 60.0) => default("0 s", "the source sees to it");
        /// How long the arc stands at the start.
        start_time: Time where within(0.0, 60.0) => default("0 s", "it moves at once");
        /// How long the arc stands at the end.
        crater_time: Time where within(0.0, 60.0) => default("0 s", "it ends at once");
        /// What ArcTech takes the amplitude of a weave for.
        weave_amplitude: WeaveAmplitude => none("needed where beads are woven, and to simulate weaves of other programs");
        /// Gas after the arc.
        postflow: Time where within(0.0, 60.0) => default("0 s", "the source sees to it");
    }
}
