//! The friction of an axis in a head's file: its law, and how well it is known.

use crate::axis::friction::{Drag, Friction};
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

/// How well the friction of an axis is known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KnownDrag {
    /// The least and the most, every range of the file at its end; none where the file tells no range.
    pub ends: Option<[Drag; 2]>,
    /// The dotted names of what is a guess by its own source, without a range.
    pub guesses: Vec<String>,
}

/// The keys of an axis that say what holds it.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrictionKeys<'a> {
    pub(super) viscous: &'a Setting<Ranged<Viscous>>,
    pub(super) coulomb: &'a Setting<Ranged<Torque>>,
    pub(super) bias: &'a Setting<Ranged<Torque>>,
    pub(super) law: &'a Setting<Option<FrictionTable>>,
}

impl FrictionKeys<'_> {
    /// The bias is of the printed law alone; LuGre's stiction is what sliding falls from.
    pub(super) fn check(self) -> Option<Problem> {
        let Self {
            bias, law, coulomb, ..
        } = self;
        if let Some(FrictionTable::Lugre(f)) = &**law
            && f.stiction.0 < coulomb.0
        {
            let message = format!("{} lies below {}", f.stiction.name, coulomb.name);
            let help = format!(
                "what holds at rest is no less than what holds sliding: is it what it holds beyond {}? add that, then",
                coulomb.name
            );
            return Some(f.stiction.problem(message).help(help));
        }
        let biased = bias.0 != 0.0 || bias.ends() != [0.0; 2];
        let problem = || {
            let message = format!("{} is of the Coulomb law alone", bias.name);
            bias.problem(message).help(format!(
                "write 0 N·m there, without a range, or leave out [{}]",
                law.name
            ))
        };
        (law.is_some() && biased).then(problem)
    }

    fn of(self, of: Of) -> Drag {
        let (coulomb, bias) = (of.number(self.coulomb), of.number(self.bias));
        let dry = match &**self.law {
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
        let viscous = of.number(self.viscous);
        Drag { dry, viscous }
    }

    /// What holds the axis, by the values of its file.
    pub(super) fn drag(self) -> Drag {
        self.of(Of::Value)
    }

    /// How well that is known.
    pub(super) fn known(self) -> KnownDrag {
        fn guessed<Q: Quantity>(figure: &Setting<Ranged<Q>>) -> Option<&String> {
            figure.is_bare_guess().then_some(&figure.name)
        }
        let stiction = self.law.as_ref().map(|law| match law {
            FrictionTable::Karnopp(f) => &f.stiction,
            FrictionTable::Lugre(f) => &f.stiction,
        });
        let torques = [Some(self.coulomb), Some(self.bias), stiction];
        let torques = torques.into_iter().flatten();
        let ranged = torques.clone().any(|f| f.range.is_some()) || self.viscous.range.is_some();
        let guesses = torques.filter_map(guessed).chain(guessed(self.viscous));
        KnownDrag {
            ends: ranged.then(|| [self.of(Of::Least), self.of(Of::Most)]),
            guesses: guesses.cloned().collect(),
        }
    }
}
