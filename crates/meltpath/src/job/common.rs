//! What jobs of every process share: which process, the part and how it stands, the plate, what the build must cover.

use std::ops::Deref;

use meltpath_base::quantity::Quantity;
use meltpath_base::settings::{Json, Kind, Many, Node, Place, Problem, Reader, Value};
use meltpath_base::{Length, choice, table};

table! {
    /// Which process the job is for.
    pub struct ProcessTable {
        /// The process; it selects the tables of the rest of the file.
        kind: ProcessKind => required;
    }

    /// The plate the part is built on.
    pub struct SubstrateTable {
        /// Length and width of the plate.
        size: [Length; 2] where up_to(1e5) => none("the part with 25 mm around it");
        /// Height of its top in the user frame of a program that other software wrote; plans begin at 0.
        height: Length where within(-1e4, 1e4) => none("0 mm");
        /// Thickness of the plate. Under the body of [onto] and under a cylinder that a surface begins on there is a plate where [substrate] is written, else none.
        thickness: Length where up_to(1e4) => default("20 mm", "the plate of Rouchon 2022, p. 38");
    }

    /// What the build must cover. Lack is judged against the finished part, excess against part + allowance.
    pub struct TargetTable {
        /// Metal beyond the finished part, for machining.
        allowance: Length where within(0.0, 1e3) => default("2 mm", "usual machining stock of a wire-arc blank; left out, 3 mm where the plan is expected to fail with it");
        /// Metal over faces that look up.
        allowance_top: Length where within(0.0, 1e3) => computed("the allowance, or more where the least stock, lower edges and one standard uncertainty of the growth need it");
    }
}

choice! {
    /// The processes.
    pub enum ProcessKind {
        Waam "waam" => "Wire and arc by robot.",
        Ebm "ebm" => "Powder bed by electron beam.",
        Lpbf "lpbf" => "Laser powder bed: the scan head.",
    }

    /// Forms in which a plan is written for other software.
    pub enum ToolpathForm {
        ThreeMf "3mf" => "A 3MF package by the toolpath extension 1.0 (release candidate).",
    }

    /// The unit of part files that carry none (STL).
    pub enum PartUnit {
        Millimetre "mm" => "Millimetres.",
        Centimetre "cm" => "Centimetres.",
        Metre "m" => "Metres.",
        Inch "in" => "Inches.",
    }
}

impl PartUnit {
    /// Millimetres per unit.
    pub fn millimetres(self) -> f64 {
        match self {
            PartUnit::Millimetre => 1.0,
            PartUnit::Centimetre => 10.0,
            PartUnit::Metre => 1000.0,
            PartUnit::Inch => 25.4,
        }
    }
}

/// A direction of the part file: a vector of any length but zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction(
    /// Its components.
    pub [f64; 3],
);

impl Value for Direction {
    const KIND: Kind = <[f64; 3]>::KIND;

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        let vector = <[f64; 3]>::read(node, place, reader)?;
        if vector == [0.0; 3] {
            let problem = Problem::new(format!("{} has no direction", place.name));
            reader.wrong(
                node,
                problem.help("give a vector of the part file, such as [0.0, 0.0, 1.0]"),
            );
            return None;
        }
        Some(Direction(vector))
    }

    fn json(&self) -> Json {
        self.0.json()
    }
}

/// One value, or a list of which the last one repeats.
#[derive(Debug, Clone, PartialEq)]
pub struct OneOrMany<T>(
    /// The values, one or more.
    pub Vec<T>,
);

impl<T> Deref for OneOrMany<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T: Quantity + Value> Value for OneOrMany<T> {
    const KIND: Kind = Kind::Either(&T::KIND, &Many::<T, 1>::KIND);

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        if node.get_ref().is_array() {
            Many::<T, 1>::read(node, place, reader).map(|many| OneOrMany(many.0))
        } else {
            T::read(node, place, reader).map(|one| OneOrMany(vec![one]))
        }
    }

    fn json(&self) -> Json {
        self.0.json()
    }
}
