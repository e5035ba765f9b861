//! A record: channels sampled at one constant rate, in the units of the house.

use serde::{Deserialize, Serialize};

use crate::error::RecordError;

/// Channels sampled together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Time between samples, s.
    pub period: f64,
    /// The channels, by name in order of the alphabet; all of one length.
    pub channels: Vec<Channel>,
}

/// One measured quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// What it is.
    pub name: String,
    /// Unit of the samples: V, A, rad, mm, mm/s or 1.
    pub unit: String,
    /// One value a sample.
    pub samples: Vec<f64>,
}

impl Record {
    /// Samples in each channel.
    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |c| c.samples.len())
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The samples of a channel.
    ///
    /// # Errors
    /// [`RecordError::Channel`] listing those there are.
    pub fn channel(&self, name: &str) -> Result<&[f64], RecordError> {
        self.channels
            .iter()
            .find(|c| c.name == name)
            .map(|c| c.samples.as_slice())
            .ok_or_else(|| RecordError::Channel {
                name: name.to_owned(),
                known: listed(self.channels.iter().map(|c| c.name.as_str())),
            })
    }
}

pub(crate) fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names
        .map(|n| format!("\"{n}\""))
        .collect::<Vec<_>>()
        .join(", ")
}
