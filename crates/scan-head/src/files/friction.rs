//! The friction of an axis in a head's file: its law, and how well it is known.

use crate::axis::friction::{Drag, Friction};
use crate::files::axis::AxisTable;
use crate::files::figure::{Stiffness, Torque, Viscous};
use meltpath_base::quantity::Quantity;
use meltpath_base::settings::{
    Json, Kind, Node, Place, Problem, Ranged, Reader, Setting, Sourced, Value,
};
use meltpath_base::{AngularSpeed, choice, table};

table! {
    /// T_P as stiction: at rest up to T_C + T_P.
    pub struct KarnoppTable {
        /// The law.
        kind: FrictionKind => required;
        /// Stiction.
        stiction: Ranged<Torque> where not_negative => required;
        /// Speed below which the rotor rests.
        rest: Sourced<AngularSpeed> where positive => required;
    }

    /// Bristles.
    pub struct LugreTable {
        /// The law.
        kind: FrictionKind => required;
        /// Stiction.
        stiction: Ranged<Torque> where not_negative => required;
        /// Stribeck speed.
        stribeck: Sourced<AngularSpeed> where positive => required;
        /// Stiffness of the bristles.
        stiffness: Sourced<Stiffness> where positive => required;
        /// Damping of the bristles.
        damping: Sourced<Viscous> where not_negative => required;
    }
}

choice! {
    /// Laws of friction beyond the printed one.
    pub enum FrictionKind {
        Karnopp "karnopp" => "Karnopp's.",
        Lugre "lugre" => "LuGre's.",
    }
}

/// Friction beyond the printed law of `coulomb` and `bias`, which is zero then.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "read once and taken apart")]
pub enum FrictionTable {
    /// Karnopp's law.
    Karnopp(KarnoppTable),
    /// LuGre's law.
    Lugre(LugreTable),
}

impl Value for FrictionTable {
    const KIND: Kind = Kind::OneOf {
        by: "kind",
        tables: &[("karnopp", KarnoppTable::KIND), ("lugre", LugreTable::KIND)],
    };

    fn read(node: &Node<'_>, place: &Place<'_>, reader: &mut Reader) -> Option<Self> {
        match reader.chosen(node, place, "kind")? {
            FrictionKind::Karnopp => KarnoppTable::read(node, place, reader).map(Self::Karnopp),
            FrictionKind::Lugre => LugreTable::read(node, place, reader).map(Self::Lugre),
        }
    }

    fn json(&self) -> Json {
        Json::Null
    }
}

/// The bias is of the printed law alone.
pub(super) fn check(axis: &Setting<Option<AxisTable>>) -> Option<Problem> {
    let axis = axis.as_ref()?;
    let biased = axis.bias.0 != 0.0 || axis.bias.ends() != [0.0; 2];
    let both = axis.friction.is_some() && biased;
    let problem = || {
        let message = format!("{} is of the Coulomb law alone", axis.bias.name);
        let name = &axis.friction.name;
        axis.bias
            .problem(message)
            .help(format!("write 0 N·m there, or leave out [{name}]"))
    };
    both.then(problem)
}

/// Which value of a figure that is known as a range.
#[derive(Debug, Clone, Copy)]
enum Of {
    Value,
    Least,
    Most,
}

impl Of {
    fn number<Q: Quantity>(self, figure: &Ranged<Q>) -> f64 {
        let [least, most] = figure.ends();
        match self {
            Of::Value => figure.value.number(),
            Of::Least => least,
            Of::Most => most,
        }
    }
}

fn drag_of(t: &AxisTable, of: Of) -> Drag {
    let (coulomb, bias) = (of.number(&t.coulomb), of.number(&t.bias));
    let dry = match &*t.friction {
        None => Friction::Coulomb { coulomb, bias },
        Some(FrictionTable::Karnopp(f)) => Friction::Karnopp {
            coulomb,
            stiction: of.number(&f.stiction),
            rest: f.rest.0,
        },
        Some(FrictionTable::Lugre(f)) => Friction::LuGre {
            coulomb,
            stiction: of.number(&f.stiction),
            stribeck: f.stribeck.0,
            stiffness: f.stiffness.0,
            damping: f.damping.0,
        },
    };
    let viscous = of.number(&t.viscous);
    Drag { dry, viscous }
}

/// What holds an axis, by the values of its file.
pub(super) fn drag(t: &AxisTable) -> Drag {
    drag_of(t, Of::Value)
}

/// How well the friction of an axis is known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KnownDrag {
    /// The least and the most, every range of the file at its end; none where the file tells no range.
    pub ends: Option<[Drag; 2]>,
    /// The dotted names of what is a guess by its own source, without a range.
    pub guesses: Vec<String>,
}

/// How well the friction of an axis is known by its table.
pub(super) fn known(t: &AxisTable) -> KnownDrag {
    fn guessed<Q: Quantity>(figure: &Setting<Ranged<Q>>) -> Option<&String> {
        figure.is_bare_guess().then_some(&figure.name)
    }
    let (coulomb, bias) = (&t.coulomb, &t.bias);
    let stiction = t.friction.as_ref().map(|law| match law {
        FrictionTable::Karnopp(f) => &f.stiction,
        FrictionTable::Lugre(f) => &f.stiction,
    });
    let torques = [Some(coulomb), Some(bias), stiction].into_iter().flatten();
    let ranged = torques.clone().any(|f| f.range.is_some()) || t.viscous.range.is_some();
    let guesses = torques.filter_map(guessed).chain(guessed(&t.viscous));
    KnownDrag {
        ends: ranged.then(|| [drag_of(t, Of::Least), drag_of(t, Of::Most)]),
        guesses: guesses.cloned().collect(),
    }
}
