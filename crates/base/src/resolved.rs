//! A parameter after resolution: its value, where it came from, how well it is known.

use serde::{Deserialize, Serialize};

/// Where a value came from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind", content = "what")]
pub enum Origin {
    /// Written in the job by its author.
    Job,
    /// Not written: the stated default, with the reason for it.
    Default(String),
    /// Taken from a data file: which entry, and that entry's source.
    Data(String),
    /// Computed from other values: by which relation.
    Computed(String),
}

/// A value with its origin and its standard uncertainty in the value's own units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Resolved<T> {
    /// The value.
    pub value: T,
    /// Where it came from.
    pub origin: Origin,
    /// One standard deviation, where known.
    pub sigma: Option<T>,
}

impl<T> Resolved<T> {
    /// A value from `origin` whose uncertainty is not known.
    pub fn new(value: T, origin: Origin) -> Self {
        Resolved {
            value,
            origin,
            sigma: None,
        }
    }

    /// The same value with a standard uncertainty.
    #[must_use]
    pub fn with_sigma(self, sigma: T) -> Self {
        Resolved {
            sigma: Some(sigma),
            ..self
        }
    }
}
