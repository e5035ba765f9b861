//! The constants of a circuit, from a file.

use meltpath_base::settings::{self, Datum, Problem, Problems};
use meltpath_base::{Length, Speed, Voltage, quantity, table};

use super::circuit::Circuit;
use crate::consumable::Wire;

quantity!(
    /// Wire melted per current, mm³/(A s) inside.
    MeltingByCurrent, "melting by current", "mm3/(A s)",
    [("mm3/(A s)", 1.0), ("m3/(A s)", 1e9)]
);
quantity!(
    /// Wire melted by the heat of a resistance, mm³/(A² s Ω) inside.
    MeltingByResistance, "melting by resistance", "mm3/(A2 s Ohm)",
    [("mm3/(A2 s Ohm)", 1.0), ("m3/(A2 s Ohm)", 1e9)]
);
quantity!(
    /// A resistance per length, Ω/mm inside.
    ResistancePerLength, "resistance per length", "Ohm/mm",
    [("Ohm/mm", 1.0), ("Ohm/m", 1e-3)]
);
quantity!(
    /// A resistance, Ω inside.
    Resistance, "resistance", "Ohm",
    [("Ohm", 1.0), ("mOhm", 1e-3)]
);
quantity!(
    /// A voltage per length, V/mm inside.
    VoltageSlope, "voltage per length", "V/mm",
    [("V/mm", 1.0), ("V/m", 1e-3)]
);
quantity!(
    /// An inductance, H inside.
    Inductance, "inductance", "H",
    [("H", 1.0), ("mH", 1e-3)]
);

table! {
    /// The circuit of source, stick-out and arc of a wire, gas and mode (Rouchon 2022, § 4.5.2).
    pub struct CircuitFile {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Identifier: `wire-mode-gas` where it ships.
        id: String => required;
        /// Wire it holds for.
        wire: String => required;
        /// Gas it holds for.
        gas: String => required;
        /// Transfer mode it holds for.
        mode: String => required;
        /// Wire melted per current in the arc, C₁.
        melting_by_current: Datum<MeltingByCurrent> where positive => required;
        /// Wire melted by the heat of its own resistance, C₂.
        melting_by_resistance: Datum<MeltingByResistance> where positive => required;
        /// Resistance of the stick-out per length, ρ.
        resistance_per_length: Datum<ResistancePerLength> where positive => required;
        /// Resistance of the arc, R_a.
        arc_resistance: Datum<Resistance> where not_negative => required;
        /// Resistance of the source and its leads, R_s.
        source_resistance: Datum<Resistance> where not_negative => required;
        /// Voltage per length of the arc, E_a.
        arc_field: Datum<VoltageSlope> where positive => required;
        /// Voltage of an arc of no length without current, V₀.
        arc_voltage: Datum<Voltage> => required;
        /// Inductance of the source, L_s.
        inductance: Datum<Inductance> where positive => required;
        /// Least and greatest contact tube distance at which it was fitted.
        distance: Datum<[Length; 2]> where positive => required;
        /// Least and greatest wire feed at which it was fitted.
        wire_feed: Datum<[Speed; 2]> where positive => required;
    }
}

impl CircuitFile {
    /// Reads a file.
    ///
    /// # Errors
    /// Everything wrong, with its place in the file.
    pub fn parse(text: &str) -> Result<Self, Problems> {
        settings::parse(text, |file: &Self| {
            let rises = |[low, high]: [f64; 2], problem: Problem| (high <= low).then_some(problem);
            let told = |name: &str| format!("{name} must rise: the least and then the greatest");
            let distance = file.distance.map(|d| d.0);
            let feed = file.wire_feed.map(|v| v.0);
            let problems = [
                rises(distance, file.distance.problem(told("distance"))),
                rises(feed, file.wire_feed.problem(told("wire_feed"))),
            ];
            problems.into_iter().flatten().collect()
        })
    }

    /// The circuit with a wire.
    pub fn circuit(&self, wire: &Wire) -> Circuit {
        Circuit {
            melting_by_current: self.melting_by_current.0,
            melting_by_resistance: self.melting_by_resistance.0,
            resistance_per_length: self.resistance_per_length.0,
            arc_resistance: self.arc_resistance.0,
            source_resistance: self.source_resistance.0,
            arc_field: self.arc_field.0,
            arc_voltage: self.arc_voltage.0,
            inductance: self.inductance.0,
            wire_section: wire.section(),
        }
    }

    /// Whether feed (mm/s) and distance (mm) lie where it was fitted, a tenth of the feed and half a millimetre beyond at most.
    pub fn covers(&self, feed: f64, distance: f64) -> bool {
        let [near, far] = self.distance.map(|d| d.0);
        let [slow, fast] = self.wire_feed.map(|v| v.0);
        let distances = near - 0.5..=far + 0.5;
        distances.contains(&distance) && (0.9 * slow..=1.1 * fast).contains(&feed)
    }
}
