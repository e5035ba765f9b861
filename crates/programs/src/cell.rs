//! How programs of a cell look: the `[program]` table of a cell file.

use std::collections::BTreeMap;

use meltpath_base::{Angle, Frequency, Length, Ratio, Speed, Time, choice, table};
use meltpath_toolpath::{Weave, WeaveShape};

use crate::execute::{ExecutionSettings, ToldOutput, ToldPosition, WeldSettings};
use crate::inform::InformWords;
use crate::krl::KrlWords;
use crate::positioner::Positioner;
use crate::program::{ArcAction, ArcStyle, ArcValue, ArcWord, Dialect, SpeedUnit};
use crate::rapid::RapidWords;
use crate::track::Track;
use crate::upkeep::{Cooled, Service, Split};
use crate::ur_script::ScriptWords;
use crate::val3::Val3Words;

table! {
    /// Frames, words, speeds and limits of the programs of one cell.
    pub struct CellProgramming {
        /// Who says so.
        source: String => required;
        /// What the controller reads.
        dialect: Dialect => default("fanuc-ls", "FANUC");
        /// FANUC: owner in the header.
        owner: String => default("MNEDITOR", "the usual one");
        /// FANUC: motion groups in the header.
        default_group: String => default("1,*,*,*,*", "the robot alone");
        /// FANUC: lines of the application header.
        application: Vec<String> => default([], "none");
        /// User frame: the part.
        user_frame: u32 => required;
        /// Tool frame: the torch, its centre point at the wire tip at the nominal contact-tube distance.
        tool_frame: u32 => required;
        /// FANUC: configuration of the arm, written into every position where no robot is named.
        config: String => default("N U T, 0, 0, 0", "no flip, up, in front");
        /// Orientation of the tool when its axis is the build direction.
        orientation: Orientation => required;
        /// Nominal distance from contact tube to work (CTWD).
        contact_tube_distance: Length where positive => required;
        /// FANUC: words for the arc.
        arc: ArcWords => default({ style = "arc", procedure = 1, first_schedule = 1, schedules = 32 }, "schedules 1 to 32");
        /// What the weld schedules of the controller set. Programs of others are simulated with these; programs for controllers other than FANUC's are written with them.
        schedules as "schedule": Vec<WeldSchedule> => default([], "programs of others say it, or it is not known");
        /// What the values of an arc word mean, in order, where they are more than a schedule: FANUC's brackets, KUKA's channels, the first values of ABB's arcdata, the places of a template.
        arc_values: Vec<ArcValue> => default([], "a schedule, or a procedure and a schedule");
        /// What the weave schedules of the controller set.
        weaves as "weave": Vec<WeaveSchedule> => default([], "programs of others say it, or it is not known");
        /// Registers that programs of others read before they set them.
        registers: Vec<Register> => default([], "none is known");
        /// FANUC: position registers that programs of others read before they set them, as the pendant shows them: by place, or by joints.
        position_registers as "position_register": Vec<PositionRegister> => default([], "none is known");
        /// Inputs, outputs and flags that decide what programs of others do.
        signals as "signal": Vec<Signal> => default([], "none is known");
        /// FANUC, ABB: what group and analog outputs (`GO`, `AO`, `SetGO`, `SetAO`) set the welding source to, in programs of others.
        outputs as "output": Vec<SourceOutput> => default([], "none is known: where one is set, the metal is not known");
        /// Programs of the cell that lay no metal, such as a torch cleaning: calls to them are passed over.
        passed_over: Vec<String> => default([], "none");
        /// Those of `passed_over` and of the services that leave the torch where they are called: they do not move the arm, or bring it back
        /// there. Of others it is not known how the arm goes on.
        returning: Vec<String> => default([], "the way on from a call is not known");
        /// FANUC: unit of speeds along the path.
        speed_unit: PathSpeedUnit => required;
        /// Decimals of these speeds.
        speed_decimals: u32 where within(0.0, 3.0) => required;
        /// Speed of travels.
        travel_speed: Speed where up_to(FASTEST) => required;
        /// Speed down to an arc start.
        approach_speed: Speed where up_to(FASTEST) => required;
        /// Joint speed of the first move.
        first_move: Ratio where within(0.01, 1.0) => required;
        /// Height of travels above the highest planned surface so far; between beads whose torch leans by more than 45° in one direction, how far beyond all
        /// beads along the torch they go.
        clearance: Length where up_to(FASTEST) => required;
        /// Height over the start of a bead, along the torch, from which the wire goes down at the approach speed; travels go as far.
        approach_height: Length where up_to(FASTEST) => none("from the height of travels");
        /// Height over the end of a bead, along the torch, up to which the wire is drawn back at the approach speed.
        retract_height: Length where up_to(FASTEST) => none("it leaves at travel speed");
        /// What is called between beads: a torch cleaning, a wire cut. The calls are passed over where programs are simulated.
        services as "service": Vec<Service> => default([], "nothing");
        /// What tells that a layer has cooled, for jobs with `layers.until = "cooled"`.
        cooled: Cooled => none("layers follow each other after their pause");
        /// What turns the part while metal is laid. FANUC, KUKA, ABB and Yaskawa move it together with the arm.
        positioner: Positioner => none("the part lies still");
        /// What carries the arm along while metal is laid. FANUC, KUKA, ABB and Yaskawa tell it with each position.
        track: Track => none("the arm stands still");
        /// Smoothing of travels.
        travel_smoothing: Ratio where within(0.0, 1.0) => required;
        /// Longest name, 8 or 32 on most controllers.
        name_length: usize where within(8.0, 255.0) => required;
        /// Most instructions in one program.
        lines_per_program: usize where within(50.0, 1e9) => required;
        /// Most positions in one program.
        points_per_program: usize where within(20.0, 1e9) => required;
        /// How programs are cut into files; scripts and projects stay whole.
        split: Split => default("limits", "as few programs as the limits allow");
        /// Most bytes in one file of a program.
        bytes_per_file: usize where within(1000.0, 1e12) => none("no limit");
        /// Shortest time of a move that the controller plans without slowing down; shorter ones are told.
        shortest_move: Time where within(0.0, 10.0) => none("the interpolation cycle that the maker's controllers have, a guess: 2 to 12 ms");
        /// Other controllers than FANUC's: the distance before a corner at which they leave a path that is smoothed in full.
        blend: Length where up_to(FASTEST) => none("needed for programs of these controllers");
        /// What a KUKA needs.
        krl: KrlWords => none("needed for kuka-krl");
        /// What an ABB needs.
        rapid: RapidWords => none("needed for abb-rapid");
        /// What a Universal Robot needs.
        script: ScriptWords => none("needed for ur-script");
        /// What a Yaskawa needs.
        inform: InformWords => none("needed for yaskawa-inform");
        /// What a Stäubli needs.
        val3: Val3Words => none("needed for staubli-val3");
    }

    /// A weld schedule of the controller.
    pub struct WeldSchedule {
        /// Its number.
        number: u32 => required;
        /// The weld procedure it belongs to.
        procedure: u32 => none("any");
        /// Programmed wire feed speed.
        wire_feed: Speed where up_to(FASTEST) => required;
        /// Meaning of `WELD_SPEED` with it.
        travel_speed: Speed where up_to(FASTEST) => none("not known");
        /// How long the torch stands on the crater where the arc ends at its wire feed: where a FANUC's `Arc End` calls it, and where other programs leave it to the controller.
        crater_time: Time where within(0.0, 60.0) => none("no time is simulated, and a note tells so");
        /// What the controller is given for it, in the order of `arc_values`.
        values: Vec<f64> => default([], "its number");
    }

    /// A weave schedule of the controller.
    pub struct WeaveSchedule {
        /// Its number.
        number: u32 => required;
        /// How the torch swings.
        shape: WeaveShape => required;
        /// Swings a second, without the dwells.
        frequency: Frequency where within(0.6, 126.0) => required;
        /// From the path to one side.
        amplitude: Length where up_to(50.0) => required;
        /// How long the torch stays on the left while it goes on.
        dwell_left: Time where within(0.0, 10.0) => default("0 s", "it turns at once");
        /// How long the torch stays on the right while it goes on.
        dwell_right: Time where within(0.0, 10.0) => default("0 s", "it turns at once");
    }

    /// A numeric register of a FANUC, or a variable of a Yaskawa.
    pub struct Register {
        /// What the controller calls it: `R` of a FANUC, `B`, `I`, `D` or `R` of a Yaskawa.
        name: String => default("R", "a register R");
        /// Its number.
        number: u32 => required;
        /// Its content.
        value: f64 => required;
    }

    /// A position register of the controller. What is not written of a place is not known.
    pub struct PositionRegister {
        /// Its number.
        number: u32 => required;
        /// X of the tool in the user frame.
        x: Length where within(-1e6, 1e6) => none("not known");
        /// Y.
        y: Length where within(-1e6, 1e6) => none("not known");
        /// Z.
        z: Length where within(-1e6, 1e6) => none("not known");
        /// W: about the fixed x axis, first.
        w: Angle => none("not known");
        /// P: about the fixed y axis, second.
        p: Angle => none("not known");
        /// R: about the fixed z axis, last.
        r: Angle => none("not known");
        /// The user frame that it is told in; a move to it in another one is refused.
        user_frame: u32 => none("any: it counts in the frame that is selected, as on the controller");
        /// The tool frame that it is told in; a move to it with another one is refused.
        tool_frame: u32 => none("any: it counts with the frame that is selected, as on the controller");
        /// The joints, as the controller shows them, where it holds these. They count before a place that is written beside them.
        joints: [Angle; 6] => none("it holds a place");
    }

    /// What an output sets the welding source to.
    pub struct SourceOutput {
        /// Its name: `GO` or `AO` of a FANUC, what an ABB calls it.
        name: String => required;
        /// Its number; an ABB's outputs have none.
        number: u32 => none("it has a name alone");
        /// The value that this entry is about. An entry that names its value goes before one that does not.
        value: f64 => none("every value that no other entry of the output names");
        /// The weld schedule that the source then works by, from the line on, until another line sets the source.
        schedule: u32 => none("it shapes no metal");
    }

    /// An input, an output or a flag of the controller.
    pub struct Signal {
        /// Its name, such as `DI` or `F`.
        name: String => required;
        /// Its number.
        number: u32 => required;
        /// Its state.
        state: SignalState => required;
    }

    /// W, P, R.
    pub struct Orientation {
        /// About the fixed x axis, first.
        w: Angle => required;
        /// About the fixed y axis, second.
        p: Angle => required;
        /// About the fixed z axis, last.
        r: Angle => required;
    }

    /// How the arc is written.
    pub struct ArcWords {
        /// The controller's words.
        style: ArcStyle => required;
        /// Weld procedure, for `weld`.
        procedure: u32 => required;
        /// Schedule of the first wire feed of a program that no `schedule` of the file sets; further ones take the next that none sets.
        first_schedule: u32 => required;
        /// How many schedules the controller has from the first one on.
        schedules: u32 where within(1.0, 1e6) => required;
    }
}

choice! {
    /// States of a signal.
    pub enum SignalState {
        On "on" => "On.",
        Off "off" => "Off.",
    }

    /// Units of speeds along a path.
    pub enum PathSpeedUnit {
        CentimetrePerMinute "cm/min" => "Centimetres per minute.",
        MillimetrePerSecond "mm/sec" => "Millimetres per second.",
    }
}

impl From<PathSpeedUnit> for SpeedUnit {
    fn from(unit: PathSpeedUnit) -> Self {
        match unit {
            PathSpeedUnit::CentimetrePerMinute => SpeedUnit::CentimetrePerMinute,
            PathSpeedUnit::MillimetrePerSecond => SpeedUnit::MillimetrePerSecond,
        }
    }
}

impl WeaveSchedule {
    pub(crate) fn weave(&self) -> Weave {
        Weave {
            shape: *self.shape,
            frequency: self.frequency.0 / std::f64::consts::TAU,
            amplitude: self.amplitude.0,
            dwell: [self.dwell_left.0, self.dwell_right.0],
        }
    }
}

impl PositionRegister {
    /// What execution knows of it.
    fn told(&self) -> ToldPosition {
        let degrees = |a: &Angle| (a.0.to_degrees() * 1e9).round() / 1e9;
        let places = [*self.x, *self.y, *self.z].map(|v| v.map(|v| v.0));
        let turns = [*self.w, *self.p, *self.r].map(|a| a.as_ref().map(degrees));
        let ([x, y, z], [w, p, r]) = (places, turns);
        ToldPosition {
            elements: [x, y, z, w, p, r],
            joints: self.joints.map(|joints| joints.each_ref().map(degrees)),
            frames: (*self.user_frame, *self.tool_frame),
        }
    }
}

impl Orientation {
    pub(crate) fn degrees(&self) -> [f64; 3] {
        [*self.w, *self.p, *self.r].map(|a| (a.0.to_degrees() * 1e9).round() / 1e9)
    }
}

impl WeldSchedule {
    /// What stands in an arc word for it.
    pub(crate) fn arguments(&self) -> String {
        if self.values.is_empty() {
            return self.number.to_string();
        }
        let values: Vec<String> = self.values.iter().map(ToString::to_string).collect();
        values.join(",")
    }
}

impl ArcWords {
    /// The word for a schedule.
    pub fn word(&self, action: ArcAction, schedule: u32) -> ArcWord {
        ArcWord {
            action,
            style: *self.style,
            arguments: match *self.style {
                ArcStyle::Arc => schedule.to_string(),
                ArcStyle::Weld => format!("{},{schedule}", *self.procedure),
            },
        }
    }
}

/// Fastest speed, mm/s, and greatest clearance, mm, that a cell has.
const FASTEST: f64 = 1e3;

impl CellProgramming {
    /// What schedules set, by the value of theirs that calls them; nothing for their numbers, where these are others, and for what calls
    /// several that differ.
    fn called(
        &self,
        set: impl Fn(&WeldSchedule) -> WeldSettings,
    ) -> BTreeMap<u32, Option<WeldSettings>> {
        let means = |m: &ArcValue| *m == ArcValue::Schedule;
        let Some(place) = self.arc_values.iter().position(means) else {
            return BTreeMap::new();
        };
        let value = |s: &WeldSchedule| {
            let value = *s.values.get(place)?;
            (value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value))
                .then_some(value as u32)
        };
        let mut called = BTreeMap::new();
        for schedule in self.schedules.iter() {
            if let Some(value) = value(schedule) {
                let found = Some(set(schedule));
                let known = called.entry(value).or_insert(found);
                *known = known.filter(|k| Some(*k) == found);
            }
        }
        for schedule in self.schedules.iter().filter(|s| value(s).is_some()) {
            called.entry(*schedule.number).or_insert(None);
        }
        called
    }

    /// Position registers by their numbers; of one that is told twice, in two ways, nothing is known.
    fn told_positions(&self) -> BTreeMap<u32, ToldPosition> {
        let mut positions = BTreeMap::new();
        for register in self.position_registers.iter() {
            let told = register.told();
            let known = positions
                .entry(*register.number)
                .or_insert_with(|| told.clone());
            if *known != told {
                *known = ToldPosition::default();
            }
        }
        positions
    }

    /// What the controller knows and programs of others do not say; `assumed_speed` (mm/s) stands for speeds that nothing says.
    pub fn execution(&self, assumed_speed: f64) -> ExecutionSettings {
        let set = |s: &WeldSchedule| WeldSettings {
            wire_feed: s.wire_feed.0,
            speed: s.travel_speed.map(|v| v.0),
            crater: s.crater_time.map(|t| t.0),
        };
        let capital = |name: &String| name.to_ascii_uppercase();
        ExecutionSettings {
            registers: self
                .registers
                .iter()
                .filter(|r| r.name.eq_ignore_ascii_case("R"))
                .map(|r| (*r.number, *r.value))
                .collect(),
            variables: self
                .registers
                .iter()
                .map(|r| ((capital(&r.name), *r.number), *r.value))
                .collect(),
            positions: self.told_positions(),
            outputs: self
                .outputs
                .iter()
                .map(|o| ToldOutput {
                    name: capital(&o.name),
                    number: *o.number,
                    value: *o.value,
                    schedule: *o.schedule,
                })
                .collect(),
            signals: self
                .signals
                .iter()
                .map(|s| ((capital(&s.name), *s.number), *s.state == SignalState::On))
                .collect(),
            schedules: self
                .schedules
                .iter()
                .map(|s| ((*s.procedure, *s.number), set(s)))
                .collect(),
            called: self.called(set),
            arc_values: self.arc_values.value.clone(),
            weaves: self.weaves.iter().map(|w| (*w.number, w.weave())).collect(),
            assumed_speed,
            passed_over: self
                .passed_over
                .iter()
                .chain(self.services.iter().map(|s| &*s.call))
                .map(capital)
                .collect(),
            returning: self.returning.iter().map(capital).collect(),
            blend: self.blend.map(|b| b.0),
            positioner: self.positioner.as_ref().map(Positioner::turning),
            slides: self.track.as_ref().map_or(0, Track::slides),
            ..ExecutionSettings::default()
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use meltpath_base::settings;

    use super::*;

    /// The programming of the shipped cell.
    pub(crate) fn arcmate() -> CellProgramming {
        let text = meltpath_data::cells::ARCMATE_120IC.text;
        settings::peek(text, &["program"]).unwrap().unwrap()
    }

    #[test]
    fn the_shipped_cell_is_sound() {
        assert_eq!(arcmate().orientation.degrees(), [180.0, 0.0, 0.0]);
    }

    #[test]
    fn unsound_tables_are_refused_by_name() {
        let refused = |from: &str, to: &str| {
            let text = meltpath_data::cells::ARCMATE_120IC.text;
            assert!(text.contains(from), "{from}");
            let text = text.replace(from, to);
            let problems = settings::peek::<CellProgramming>(&text, &["program"]).unwrap_err();
            assert_eq!(problems.0.len(), 1);
            problems.to_string()
        };
        for (from, to, told) in [
            (
                "travel_speed = \"6 m/min\"",
                "travel_speed = \"0 m/min\"",
                "program.travel_speed is 0 m/min: it must be above 0 m/min, at most 60 m/min",
            ),
            (
                "\"cm/min\"",
                "\"%\"",
                "program.speed_unit is one of \"cm/min\", \"mm/sec\"",
            ),
            (
                "lines_per_program = 5000",
                "lines_per_program = 3",
                "program.lines_per_program is 3: it must be 50 to",
            ),
            (
                "clearance = \"20 mm\"",
                "clearance = \"20,5 mm\"",
                "write \"20.5 mm\"",
            ),
            (
                "first_move = \"20 %\"",
                "first_move = \"120 %\"",
                "it must be 1 % to 100 %",
            ),
        ] {
            let found = refused(from, to);
            assert!(found.contains(told), "{found}");
        }
    }

    #[test]
    fn registers_and_outputs_are_told_by_tables() {
        let text = meltpath_data::cells::ARCMATE_120IC.text;
        let told = |more: &str| {
            let text = format!("{text}\n{more}");
            let cell: CellProgramming = settings::peek(&text, &["program"]).unwrap().unwrap();
            cell.execution(10.0)
        };
        let place = "[[program.position_register]]\nnumber = 90\nx = \"1 cm\"\nr = \"-90 deg\"\nuser_frame = 2\n";
        let known = told(&format!(
            "{place}[[program.position_register]]\nnumber = 4\njoints = [\"0 deg\", \"10 deg\", \"0 deg\", \"0 deg\", \"-90 deg\", \"0 deg\"]\n\
             [[program.output]]\nname = \"GO\"\nnumber = 2\nvalue = 3\nschedule = 1\n"
        ));
        let ninety = &known.positions[&90];
        let elements = [Some(10.0), None, None, None, None, Some(-90.0)];
        assert_eq!(
            (ninety.elements, ninety.frames),
            (elements, (Some(2), None))
        );
        assert_eq!(known.positions[&4].joints.unwrap()[4], -90.0);
        assert_eq!(
            (known.outputs[0].number, known.outputs[0].value),
            (Some(2), Some(3.0))
        );
        // one that is told in two ways is not known
        let twice = told(&format!("{place}{}", place.replace("1 cm", "2 cm")));
        assert_eq!(twice.positions[&90], ToldPosition::default());
    }

    #[test]
    fn weld_words_carry_their_procedure() {
        let mut arc = arcmate().arc;
        arc.style.value = ArcStyle::Weld;
        assert_eq!(arc.word(ArcAction::End, 3).to_string(), "Weld End[1,3]");
    }
}
