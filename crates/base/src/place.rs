//! Where something was found: in the part, in a program, in a file.

use serde::{Deserialize, Serialize};

/// Where something was found. Every part is optional; positions are mm in the part frame.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Position, mm, part frame.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub position: Option<[f64; 3]>,
    /// Layer, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub layer: Option<u32>,
    /// Bead of that layer, counted from 1 in the order in which they are laid.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub bead: Option<u32>,
    /// File, and line in it counted from 1.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub file: Option<String>,
    /// Line, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub line: Option<u32>,
}

impl Place {
    /// A position in the part frame, mm.
    pub fn at(position: [f64; 3]) -> Self {
        Place {
            position: Some(position),
            ..Place::default()
        }
    }

    /// A layer, counted from 1.
    pub fn layer(layer: u32) -> Self {
        Place {
            layer: Some(layer),
            ..Place::default()
        }
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut parts = Vec::new();
        if let Some(file) = &self.file {
            parts.push(file.clone());
        }
        if let Some(line) = self.line {
            parts.push(format!("line {line}"));
        }
        if let Some(layer) = self.layer {
            parts.push(format!("layer {layer}"));
        }
        if let Some(bead) = self.bead {
            parts.push(format!("bead {bead}"));
        }
        if let Some([x, y, z]) = self.position {
            // the build plane lies at 0.0, not at -0.0
            let [x, y, z] = [x, y, z].map(|v| (10.0 * v).round() / 10.0 + 0.0);
            parts.push(format!("x {x:.1}, y {y:.1}, z {z:.1} mm"));
        }
        write!(f, "{}", parts.join(", "))
    }
}
