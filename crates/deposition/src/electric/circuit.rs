//! The circuit of source, stick-out and arc. Source: Rouchon 2022, § 4.5.2, equations 4.1 to 4.7, after Planckaert and Naidu.
//!
//! Equation 4.7 is printed with R_l where it needs R_a: ρ l_s is R_l already (equation 4.3).

use meltpath_numerics::halving::root;

/// Longest step of the integration, s: a tenth of the time in which the circuit that ships settles.
const STEP: f64 = 1e-3;
/// Halvings that leave no number between the ends.
const HALVINGS: u32 = 200;
/// 1 − 1/√2: with it the method is stable for processes of any speed, which it takes as settled.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

/// Source, stick-out and arc: mean values, no droplets.
///
/// - Lengths mm, speeds mm/s, V, A, Ω, H.
/// - Assumed: the stick-out is the whole wire below the contact tube, of one resistance per length; the arc's voltage is linear in
///   current and length; metal melts at once.
/// - Validity: around the currents and distances its constants were fitted at; not for ignition, nor within a cycle of transfer.
/// - Source: Rouchon 2022, equations 4.1 to 4.7.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circuit {
    /// Wire melted by the current in the arc, C₁, mm³/(A s).
    pub melting_by_current: f64,
    /// Wire melted by the heat of its own resistance, C₂, mm³/(A² s Ω).
    pub melting_by_resistance: f64,
    /// Resistance of the stick-out, ρ, Ω/mm.
    pub resistance_per_length: f64,
    /// Resistance of the arc, R_a, Ω.
    pub arc_resistance: f64,
    /// Resistance of the source and its leads, R_s, Ω.
    pub source_resistance: f64,
    /// Voltage per length of the arc, E_a, V/mm.
    pub arc_field: f64,
    /// Voltage of an arc of no length without current, V₀, V.
    pub arc_voltage: f64,
    /// Inductance of the source, L_s, H.
    pub inductance: f64,
    /// Section of the wire, mm².
    pub wire_section: f64,
}

/// What is given to the circuit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Given {
    /// Wire feed, mm/s.
    pub feed: f64,
    /// Voltage of the source, V.
    pub voltage: f64,
    /// Contact tube to work distance, mm.
    pub distance: f64,
}

/// The state of the circuit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Wire below the contact tube, mm.
    pub stick_out: f64,
    /// Current, A.
    pub current: f64,
}

/// Why no arc burns steadily.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoArc {
    /// The arc would be longer than the distance.
    #[error("the voltage is too high for this feed: the arc burns back to the contact tube")]
    BurnsBack,
    /// The wire reaches the work.
    #[error("the voltage is too low for this feed: the wire reaches the work without melting")]
    Stubs,
    /// The equations hold no more.
    #[error(
        "feed, voltage or distance are not positive, or the current would be beyond what the circuit's equations hold for"
    )]
    Outside,
}

impl Circuit {
    /// The feed that melts, mm/s, at a current (A) and a stick-out (mm). Equation 4.4.
    pub fn feed(&self, current: f64, stick_out: f64) -> f64 {
        let heat = self.melting_by_resistance * self.resistance_per_length * stick_out * current;
        (heat + self.melting_by_current) * current / self.wire_section
    }

    /// The current, A, that melts a feed (mm/s) at a stick-out (mm). Equation 4.4.
    pub fn current(&self, feed: f64, stick_out: f64) -> f64 {
        let rate = self.wire_section * feed;
        let heat = self.melting_by_resistance * self.resistance_per_length * stick_out;
        let linear = self.melting_by_current;
        2.0 * rate / (linear + (linear * linear + 4.0 * heat * rate).sqrt())
    }

    /// The voltage of the source, V, at rest. Equations 4.1 to 4.3.
    pub fn voltage(&self, arc: Arc, distance: f64) -> f64 {
        let wire = self.resistance_per_length * arc.stick_out;
        let resistance = wire + self.arc_resistance + self.source_resistance;
        resistance * arc.current + self.arc_voltage + self.arc_field * (distance - arc.stick_out)
    }

    /// The contact tube distance, mm, at which this current flows at rest; `None` where the current alone melts more than is fed.
    pub fn distance(&self, feed: f64, voltage: f64, current: f64) -> Option<f64> {
        let heat = self.melting_by_resistance * self.resistance_per_length * current * current;
        let stick_out = (self.wire_section * feed - self.melting_by_current * current) / heat;
        let arc = Arc { stick_out, current };
        let length = (voltage - self.voltage(arc, stick_out)) / self.arc_field;
        (stick_out > 0.0 && length > 0.0).then_some(stick_out + length)
    }

    /// Stick-out and current at rest.
    ///
    /// A longer stick-out takes less current to melt the same feed and leaves less arc, so the voltage falls with it as long as the current
    /// is below E_a/ρ: one answer at most, found by halving.
    ///
    /// ```
    /// use meltpath_deposition::consumable::Wire;
    /// use meltpath_deposition::electric::{circuit::Given, file::CircuitFile};
    /// let file = CircuitFile::parse(meltpath_data::electric::X90_IG_1_0_CMT_M14.text).unwrap();
    /// let circuit = file.circuit(&Wire::builtin("x90-ig-1.0").unwrap());
    /// let given = Given { feed: 10.10e3 / 60.0, voltage: 16.65, distance: 15.0 };
    /// assert!((circuit.at_rest(given).unwrap().current - 190.0).abs() < 1.0);
    /// ```
    ///
    /// # Errors
    /// [`NoArc`].
    pub fn at_rest(&self, given: Given) -> Result<Arc, NoArc> {
        let Given {
            feed,
            voltage,
            distance,
        } = given;
        let arc = |stick_out: f64| Arc {
            stick_out,
            current: self.current(feed, stick_out),
        };
        let most = self.arc_field / self.resistance_per_length;
        let positive = feed > 0.0 && voltage > 0.0 && distance > 0.0;
        if !positive
            || arc(0.0)
                .current
                .partial_cmp(&most)
                .is_none_or(std::cmp::Ordering::is_ge)
        {
            return Err(NoArc::Outside);
        }
        let below = |stick_out: f64| self.voltage(arc(stick_out), distance) < voltage;
        if below(0.0) {
            return Err(NoArc::BurnsBack);
        }
        if !below(distance) {
            return Err(NoArc::Stubs);
        }
        Ok(arc(root([0.0, distance], HALVINGS, below)))
    }

    /// How the state changes: mm/s and A/s. Equations 4.6 and 4.7.
    fn rates(&self, arc: Arc, given: Given) -> [f64; 2] {
        [
            given.feed - self.feed(arc.current, arc.stick_out),
            (given.voltage - self.voltage(arc, given.distance)) / self.inductance,
        ]
    }

    /// The state after `time` s of the same given values.
    ///
    /// Two linearly implicit stages of second order, stable for any inductance (ROS2: Verwer, Spee, Blom and Hundsdorfer 1999), in steps of
    /// a millisecond. The wire ends between contact tube and work; a current never turns round.
    #[must_use]
    pub fn after(&self, arc: Arc, given: Given, time: f64) -> Arc {
        let steps = (time / STEP).ceil().max(1.0);
        let mut now = arc;
        for _ in 0..steps as u64 {
            now = self.step(now, given, time / steps);
        }
        now
    }

    fn step(&self, arc: Arc, given: Given, time: f64) -> Arc {
        let Arc { stick_out, current } = arc;
        let melt = self.melting_by_resistance * self.resistance_per_length;
        let wire = self.resistance_per_length;
        let total = self.arc_resistance + self.source_resistance + wire * stick_out;
        let scale = GAMMA * time;
        // 1 − γ h J
        let [a, b] = [
            1.0 + scale * melt * current * current / self.wire_section,
            scale * (2.0 * melt * current * stick_out + self.melting_by_current)
                / self.wire_section,
        ];
        let [c, d] = [
            -scale * (self.arc_field - wire * current) / self.inductance,
            1.0 + scale * total / self.inductance,
        ];
        let determinant = a * d - b * c;
        let solve =
            |[x, y]: [f64; 2]| [(d * x - b * y) / determinant, (a * y - c * x) / determinant];
        let moved = |[l, i]: [f64; 2]| Arc {
            stick_out: (stick_out + time * l).clamp(0.0, given.distance),
            current: (current + time * i).max(0.0),
        };
        let first = solve(self.rates(arc, given));
        let there = self.rates(moved(first), given);
        let second = solve([there[0] - 2.0 * first[0], there[1] - 2.0 * first[1]]);
        moved([
            1.5 * first[0] + 0.5 * second[0],
            1.5 * first[1] + 0.5 * second[1],
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::consumable::Wire;
    use crate::electric::file::CircuitFile;

    const M_PER_MIN: f64 = 1000.0 / 60.0;

    fn circuit() -> Circuit {
        let text = meltpath_data::electric::X90_IG_1_0_CMT_M14.text;
        let wire = Wire::builtin("x90-ig-1.0").unwrap();
        CircuitFile::parse(text).unwrap().circuit(&wire)
    }

    /// Layers 1 and 22 of the thin wall, table 4.4.
    const LAYERS: [([f64; 3], f64); 2] =
        [([10.10, 16.65, 15.0], 190.0), ([8.13, 15.17, 5.47], 205.0)];

    fn given([feed, voltage, distance]: [f64; 3]) -> Given {
        let feed = feed * M_PER_MIN;
        Given {
            feed,
            voltage,
            distance,
        }
    }

    #[test]
    fn waam_ac41_currents_at_rest_and_how_they_settle() {
        let circuit = circuit();
        for (layer, current) in LAYERS {
            let given = given(layer);
            let rest = circuit.at_rest(given).unwrap();
            assert!((rest.current - current).abs() < 1.0, "{rest:?}");
            let back = circuit.distance(given.feed, given.voltage, rest.current);
            assert!((back.unwrap() - given.distance).abs() < 1e-6);
            // from a quarter of the stick-out and twice the current
            let cold = Arc {
                stick_out: 0.25 * rest.stick_out,
                current: 2.0 * rest.current,
            };
            let settled = circuit.after(cold, given, 0.3);
            assert!((settled.current - rest.current).abs() < 0.1, "{settled:?}");
            assert!((settled.stick_out - rest.stick_out).abs() < 0.01);
        }
    }

    #[test]
    fn waam_ac42_three_trends_of_the_stabilisers() {
        let circuit = circuit();
        let [feed, _, distance] = LAYERS[0].0;
        let feed = feed * M_PER_MIN;
        let rest = circuit.at_rest(given(LAYERS[0].0)).unwrap();
        let voltage = |arc, distance| circuit.voltage(arc, distance);
        // both stabilisers off, an arc of 2 mm, the tube 2 mm farther: the current falls
        let held = circuit.current(feed, distance + 2.0 - 2.0);
        assert!(
            (held / 182.0 - 1.0).abs() < 0.01 && held < rest.current,
            "{held}"
        );
        // the current held: the feed rises
        let fed = circuit.feed(190.0, distance + 2.0 - 2.0) / M_PER_MIN;
        assert!((fed / 10.73 - 1.0).abs() < 0.01, "{fed}");
        // a shorter arc, 1 for 2 mm: current and voltage fall
        let arc = |length: f64| Arc {
            stick_out: distance - length,
            current: circuit.current(feed, distance - length),
        };
        assert!((arc(1.0).current / 186.0 - 1.0).abs() < 0.01);
        assert!(arc(1.0).current < arc(2.0).current);
        assert!(voltage(arc(1.0), distance) < voltage(arc(2.0), distance));
    }

    #[test]
    fn no_arc_is_told_apart() {
        let circuit = circuit();
        let of = |layer| circuit.at_rest(given(layer)).unwrap_err();
        assert_eq!(of([10.1, 60.0, 15.0]), NoArc::BurnsBack);
        assert_eq!(of([10.1, 8.0, 15.0]), NoArc::Stubs);
        for outside in [[0.0, 16.0, 15.0], [10.0, f64::NAN, 15.0], [1e6, 16.0, 15.0]] {
            assert_eq!(of(outside), NoArc::Outside, "{outside:?}");
        }
    }

    /// Steps of a millisecond against steps of a microsecond; with a hundredth of the inductance, which is a hundred times as stiff, too.
    #[test]
    fn long_steps_come_out_as_short_ones() {
        for inductance in [3.5e-4, 3.5e-6] {
            let circuit = Circuit {
                inductance,
                ..circuit()
            };
            let rest = circuit.at_rest(given(LAYERS[0].0)).unwrap();
            let (mut fine, mut coarse) = (rest, rest);
            let farther = Given {
                distance: 16.0,
                ..given(LAYERS[0].0)
            };
            for k in 0..20 {
                coarse = circuit.after(coarse, farther, 0.01);
                for _ in 0..10_000 {
                    fine = circuit.step(fine, farther, 1e-6);
                }
                let off = (coarse.current - fine.current).abs();
                assert!(off < 0.5, "{k}: {off}");
            }
        }
    }

    proptest::proptest! {
        #[test]
        fn rest_is_where_nothing_changes(feed in 2.0..16.0f64, voltage in 10.0..30.0f64, distance in 4.0..30.0f64) {
            let circuit = circuit();
            let given = given([feed, voltage, distance]);
            if let Ok(rest) = circuit.at_rest(given) {
                let [length, current] = circuit.rates(rest, given);
                proptest::prop_assert!(length.abs() < 1e-6 * given.feed && current.abs() * circuit.inductance < 1e-9);
                let later = circuit.after(rest, given, 0.5);
                proptest::prop_assert!((later.current - rest.current).abs() < 1e-3);
            }
        }
    }
}
