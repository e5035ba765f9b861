//! The three ways to declare: tables with their keys, choices with their words, quantities with their units.

/// Declares tables of settings: each key with its type, range, fallback and sentence.
///
/// A key reads `name: Type where RANGE => FALLBACK;`, its docstring being its sentence. RANGE (may be left out) is one of the
/// functions of [`Bounds`](crate::settings::Bounds); FALLBACK is `required`, `default(VALUE, "reason")` with the value as a TOML
/// file has it, `computed("relation")`, or `none("what that means")`. `name as "other"` where files use another name.
#[macro_export]
macro_rules! table {
    ($(
        $(#[doc = $doc:literal])*
        pub struct $name:ident {
            $(
                $(#[doc = $text:literal])*
                $field:ident $(as $key:literal)? : $type:ty $(where $range:ident $(($($bound:expr),+))?)?
                    => $how:ident $(($($argument:tt)*))?;
            )*
        }
    )*) => {$(
        $(#[doc = $doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $(
                $(#[doc = $text])*
                pub $field: $crate::setting_type!($how $type),
            )*
        }

        impl $crate::settings::Value for $name {
            const KIND: $crate::settings::Kind = $crate::settings::Kind::Table($crate::settings::Table {
                text: concat!($($doc),*),
                keys: &[$($crate::settings::Key {
                    name: [$($key,)? stringify!($field)][0],
                    text: concat!($($text),*),
                    kind: <$type as $crate::settings::Value>::KIND,
                    bounds: [
                        $($crate::settings::Bounds::$range($($($bound),+)?),)?
                        $crate::settings::Bounds::any(),
                    ][0],
                    fallback: $crate::fallback!($how $(($($argument)*))?),
                }),*],
            });

            fn read(
                node: &$crate::settings::Node<'_>,
                place: &$crate::settings::Place<'_>,
                reader: &mut $crate::settings::Reader,
            ) -> Option<Self> {
                let mut keys = $crate::settings::Keys::open::<Self>(node, place, reader)?;
                $(let $field = keys.$how(reader);)*
                Some($name { $($field: $field?),* })
            }

            fn json(&self) -> $crate::settings::Json {
                $crate::settings::Json::Null
            }
        }

        impl $name {
            /// Whether the file says anything of it.
            pub fn says_something(&self) -> bool {
                [$(self.$field.is_written()),*].contains(&true)
            }
        }
    )*};
}

/// The type of a field: a key without a default may be absent.
#[doc(hidden)]
#[macro_export]
macro_rules! setting_type {
    (required $type:ty) => { $crate::settings::Setting<$type> };
    (default $type:ty) => { $crate::settings::Setting<$type> };
    (computed $type:ty) => { $crate::settings::Setting<Option<$type>> };
    (none $type:ty) => { $crate::settings::Setting<Option<$type>> };
}

/// The fallback of a key, as data.
#[doc(hidden)]
#[macro_export]
macro_rules! fallback {
    (required) => {
        $crate::settings::Fallback::Required
    };
    (default($value:tt, $why:literal)) => {
        $crate::settings::Fallback::Default {
            toml: stringify!($value),
            why: $why,
        }
    };
    (computed($relation:literal)) => {
        $crate::settings::Fallback::Computed($relation)
    };
    (none($meaning:literal)) => {
        $crate::settings::Fallback::None($meaning)
    };
}

/// Declares a choice: each variant with its word in files and what it means.
///
/// ```
/// meltpath_base::choice! {
///     /// What lies below.
///     pub enum Ground {
///         Metal "metal" => "Dense metal.",
///         Powder "powder" => "Powder.",
///     }
/// }
/// assert_eq!(Ground::Powder.word(), "powder");
/// ```
#[macro_export]
macro_rules! choice {
    ($(
        $(#[doc = $doc:literal])*
        pub enum $name:ident {
            $( $variant:ident $word:literal => $text:literal ),+ $(,)?
        }
    )*) => {$(
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $name {
            $( #[doc = $text] $variant, )+
        }

        impl $name {
            /// Every one, in the order of their declaration.
            pub const ALL: [Self; [$($word),+].len()] = [$($name::$variant),+];

            /// The one of a word.
            pub fn from_word(word: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|one| one.word() == word)
            }

            /// The word in files.
            pub const fn word(self) -> &'static str {
                match self {
                    $( $name::$variant => $word, )+
                }
            }
        }

        impl $crate::settings::Serialize for $name {
            fn serialize<S: $crate::settings::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                to.serialize_str(self.word())
            }
        }

        impl $crate::settings::Value for $name {
            const KIND: $crate::settings::Kind = $crate::settings::Kind::Choice(&[
                $( $crate::settings::Word { word: $word, text: $text } ),+
            ]);

            fn read(
                node: &$crate::settings::Node<'_>,
                place: &$crate::settings::Place<'_>,
                reader: &mut $crate::settings::Reader,
            ) -> Option<Self> {
                reader.word(node, place, &Self::ALL.map($name::word)).map(|n| Self::ALL[n])
            }

            fn json(&self) -> $crate::settings::Json {
                self.word().into()
            }
        }
    )*};
}

/// Declares a dimension: a type around its number in internal units, what it is, and the units that files may use, the usual one
/// first. They differ in nothing else.
///
/// ```
/// meltpath_base::quantity!(
///     /// A mass of gas, g inside.
///     Mass, "mass", "g", [("g", 1.0), ("kg", 1e3)]
/// );
/// assert_eq!(Mass::parse("2 kg").unwrap(), Mass(2000.0));
/// ```
#[macro_export]
macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $what:literal, $internal:literal, [$(($symbol:literal, $factor:expr $(, $more:ident = $value:expr)?)),+]) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
        pub struct $name(
            #[doc = concat!("The value in ", $internal, ".")]
            pub f64,
        );

        impl $name {
            /// The units that files may use; the first is the one values are written back in.
            pub const UNITS: &'static [$crate::quantity::Unit] = &[$($crate::quantity::Unit {
                $($more: $value,)?
                ..$crate::quantity::Unit::new($symbol, $factor)
            }),+];

            /// Reads a number with a unit.
            ///
            /// # Errors
            /// `QuantityError`, naming what was written and the accepted units.
            pub fn parse(text: &str) -> Result<Self, $crate::quantity::QuantityError> {
                $crate::quantity::parse(text, $what, Self::UNITS).map($name)
            }
        }

        impl $crate::quantity::Quantity for $name {
            const WHAT: &'static str = $what;
            const UNITS: &'static [$crate::quantity::Unit] = Self::UNITS;

            fn from_number(number: f64) -> Self {
                $name(number)
            }

            fn number(self) -> f64 {
                self.0
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(&Self::UNITS[0].show(self.0))
            }
        }

        impl $crate::settings::Serialize for $name {
            fn serialize<S: $crate::settings::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                s.collect_str(self)
            }
        }

        impl $crate::settings::Value for $name {
            const KIND: $crate::settings::Kind = $crate::settings::Kind::Quantity {
                what: $what,
                units: Self::UNITS,
            };

            fn read(
                node: &$crate::settings::Node<'_>,
                place: &$crate::settings::Place<'_>,
                reader: &mut $crate::settings::Reader,
            ) -> Option<Self> {
                $crate::settings::quantity(node, place, reader)
            }

            fn json(&self) -> $crate::settings::Json {
                self.to_string().into()
            }
        }
    };
}
