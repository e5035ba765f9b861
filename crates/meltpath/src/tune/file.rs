//! The tuning file as a person writes it, and what of it does not go together.

use meltpath_base::settings::{File, Many, Problem, broken};
use meltpath_base::{Angle, AngularSpeed, Current, Frequency, Ratio, Time, choice, table};

/// The longest loop delay beyond the head's own that is served or drawn, s: a loop is looked at sample by sample, and each of them is a state.
const LATEST: f64 = 1e-3;

table! {
    /// The control of a scan head's axes: designed, compared, exported.
    pub struct TuneFile {
        /// Head: a name in `data/scan-heads`, or a TOML file of your own.
        head: String => required;
        /// The axes that are tuned.
        axes: Many<AxisName, 1> => default(["x", "y"], "both mirrors");
        /// Motors in place of the head's, by axis: files with the lines that `meltpath identify` prints.
        motor: Motors => default({}, "the head's");
        /// The step-by-step synthesis and its refinement.
        cascade: CascadeTable => default({}, "as fast as the head's file says");
        /// H-infinity: three weights, by their templates, or a bandwidth.
        h_infinity as "h-infinity": HInfinityTable => default({}, "as fast as the cascade");
        /// The search for a controller that serves a spread of motors.
        robust: RobustTable => default({}, "a production's spread");
        /// The signal on which controllers are compared, and how far motors scatter.
        compare: CompareTable => default({}, "a multi-step and forty motors");
        /// Which controller leaves, and in which form.
        export: ExportTable => default({}, "the best, in second-order sections");
    }

    /// Motors in place of the head's.
    pub struct Motors {
        /// Of X.
        x: File => none("the head's");
        /// Of Y.
        y: File => none("the head's");
        /// Of Z.
        z: File => none("the head's");
    }

    /// The step-by-step synthesis and its refinement.
    pub struct CascadeTable {
        /// Times of the first maximum of the step responses of current, speed and position.
        first_maximum: [Time; 3] where positive => computed("the head's file, else as fast as the head's own loops");
        /// Phase margins of current, speed and position.
        margin: [Angle; 3] where positive => default(["65 deg", "65 deg", "75 deg"], "Rasoanarivo 2020, § 2.2.2.2");
        /// Whether and how a swarm refines the gains.
        refine: RefineTable => default({}, "on the simulated axis");
    }

    /// Whether and how a swarm refines the gains.
    pub struct RefineTable {
        /// What the gains are refined for.
        on: RefineOn => default("tracking", "least error of the simulated axis");
        /// The record (`.csv`, `.parquet`, `.mat`) of a multi-step: channels `set-point` and `angle`.
        record: File => none("no record");
        /// Its mapping.
        mapping: File => none("no record");
        /// How much bandwidth and stiffness feedback alone may lose on the simulated axis.
        slower: Ratio where within(0.0, 0.99) => default("10 %", "no less than the rule from first maximum to crossover leaves open");
        /// Particles of the swarm.
        particles: usize => default(20, "twice the unknowns and more");
        /// Moves of each.
        iterations: usize => default(40, "a few seconds");
    }

    /// H-infinity: three weights, by their templates, or a bandwidth.
    pub struct HInfinityTable {
        /// Moves the thesis' weights to this bandwidth.
        bandwidth: Frequency where positive => computed("that of the position loop");
        /// Template of the sensitivity (W1).
        sensitivity: TemplateTable => none("from the bandwidth");
        /// Template from set-point to current, in A per degree (W2).
        command: TemplateTable => none("from the bandwidth");
        /// Template, with the first, of the response to a disturbance (W3).
        disturbance: TemplateTable => none("from the bandwidth");
        /// Most nearly cancelling pairs that are removed.
        pairs: usize => none("the design's own number");
    }

    /// A template: gain at rest, gain far above, and where it crosses one.
    pub struct TemplateTable {
        /// Gain at rest.
        low: f64 => required;
        /// Gain far above.
        high: f64 => required;
        /// Where it is one.
        crossover: Frequency => required;
    }

    /// The search for a controller that serves a spread of motors.
    pub struct RobustTable {
        /// How far the modes may move to either side; `"0 %"` for no search.
        mode_shift: Ratio where within(0.0, 0.9) => default("10 %", "a mode moves by some percent with temperature, mounting and mirror");
        /// The longest loop delay that is served, beyond the head's own.
        delay: Time where within(0.0, LATEST) => computed("half a sample");
        /// Distance to the critical point kept everywhere.
        modulus_margin: f64 where within(0.01, 0.99) => default(0.5, "the usual distance");
        /// Largest gain of the closed loop, which is 1 at rest.
        resonance: f64 where within(1.0, 100.0) => default(1.5, "3.5 dB");
        /// States of the controller.
        order: usize where within(3.0, 50.0) => default(5, "integrator, lead and a broad notch");
        /// Particles of the swarm.
        particles: usize => default(16, "twice the unknowns");
        /// Moves of each.
        iterations: usize => default(20, "some seconds");
    }

    /// The signal on which controllers are compared, and how far motors scatter.
    pub struct CompareTable {
        /// First amplitude of the multi-step.
        amplitude: Angle where positive => computed("90 % of the travel");
        /// Number of amplitudes, each half of the one before.
        levels: u32 => default(10, "down to a thousandth");
        /// Speed between steps.
        slope: AngularSpeed where positive => default("1150 deg/s", "the source's");
        /// Time at each step.
        hold: Time where positive => default("0.06 s", "the source's");
        /// Scattered motors, 0 for none.
        draws: usize => default(40, "a few seconds");
        /// Scatter of the resistance.
        resistance: Ratio where not_negative => default("20 %", "a production's spread, a guess");
        /// Scatter of the inertia.
        inertia: Ratio where not_negative => default("5 %", "a production's spread, a guess");
        /// Scatter of the modes' frequencies.
        modes: Ratio where not_negative => default("5 %", "a production's spread, a guess");
        /// Longest additional delay.
        delay: Time where within(0.0, LATEST) => computed("half a sample");
        /// Largest standard deviation of the sensor's noise.
        noise: Angle where not_negative => default("0.0005 deg", "a fiftieth of the accuracy of a laboratory head");
        /// Seed.
        seed: u64 => default(1, "any");
    }

    /// Which controller leaves, and in which form.
    pub struct ExportTable {
        /// Which controller.
        controller: Choice => none("the robust one where it was found, else H-infinity");
        /// The form.
        form: ExportForm => default("sections", "what drives take");
        /// How numbers are held on the drive.
        word: WordName => default("single", "what drives have");
        /// Bits after the point of coefficients and of signals, for fixed words.
        bits: [u32; 2] => default([22, 22], "half of the range is left for sums");
        /// Current at which the law's output is cut. What feed-forward adds comes after; the sum is cut at the drive's peak current.
        limit: Current where positive => none("the drive's peak current");
        /// What the states do meanwhile.
        anti_windup: Windup => default("conditioned", "no overshoot after a cut");
        /// The controller acts once in so many samples of the head.
        every: u32 where within(1.0, 1e6) => default(1, "every sample of the head");
    }
}

choice! {
    /// An axis of the head.
    pub enum AxisName {
        X "x" => "The first mirror.",
        Y "y" => "The second mirror.",
        Z "z" => "The dynamic focus.",
    }

    /// What gains are refined for.
    pub enum RefineOn {
        Tracking "tracking" =>
            "Least error of the simulated axis, friction and limits included, on the multi-step without pre-filter.",
        Record "record" => "Least difference to a recorded angle: the model's gains become those of the real drive.",
        Nothing "nothing" => "Not at all.",
    }

    /// Which controller leaves.
    pub enum Choice {
        Cascade "cascade" => "The gains of the cascade, refined where they were.",
        HInfinity "h-infinity" => "The H-infinity controller of the three weights.",
        Robust "robust" => "The one found for the spread of motors.",
    }

    /// In which form.
    pub enum ExportForm {
        Sections "sections" => "Second-order sections.",
        StateSpace "state-space" => "State space.",
    }

    /// How numbers are held on the drive.
    pub enum WordName {
        Double "double" => "Double precision.",
        Single "single" => "Single precision.",
        Fixed "fixed" => "32-bit integers.",
    }

    /// What the states do while the output is cut.
    pub enum Windup {
        None "none" => "They run on.",
        Conditioned "conditioned" => "They follow the output that went out.",
    }
}

impl AxisName {
    /// Its letter in files.
    pub fn letter(self) -> char {
        match self {
            AxisName::X => 'x',
            AxisName::Y => 'y',
            AxisName::Z => 'z',
        }
    }
}

impl TuneFile {
    /// Values that do not go together.
    pub fn check(&self) -> Vec<Problem> {
        let (refine, h, e) = (&self.cascade.refine, &self.h_infinity, &self.export);
        let files = [&refine.record, &refine.mapping];
        let on_record = *refine.on == RefineOn::Record;
        let named = files.into_iter().find(|f| f.is_written());
        let templates = [
            h.sensitivity.is_written(),
            h.command.is_written(),
            h.disturbance.is_written(),
        ];
        let axes = &self.axes;
        let again = (1..axes.len()).find(|n| axes[..*n].contains(&axes[*n]));
        let letter = again.map_or(' ', |n| axes[n].letter());
        broken([
            (
                again.is_some(),
                axes.problem(format!("axes names {letter} twice"))
                    .help("name each axis once"),
            ),
            (
                on_record && files.iter().any(|f| !f.is_written()),
                refine
                    .on
                    .problem("cascade.refine.on = \"record\" needs cascade.refine.record and cascade.refine.mapping"),
            ),
            (
                !on_record && named.is_some(),
                Problem::new("a record is refined on with on = \"record\"").at(named.and_then(|f| f.span.clone())),
            ),
            (
                templates.contains(&true) && templates.contains(&false),
                h.problem("give all three templates of [h-infinity], sensitivity, command and disturbance, or a bandwidth"),
            ),
            (
                e.bits.is_written() && *e.word != WordName::Fixed,
                e.bits.problem("export.bits are those of a fixed word: word = \"fixed\""),
            ),
            (
                *e.controller == Some(Choice::Robust) && self.robust.mode_shift.0 == 0.0,
                e.controller
                    .problem("export.controller = \"robust\", but robust.mode_shift = \"0 %\" asks for no search"),
            ),
        ])
    }
}
