//! A layer as another layer: its number and the names of its passes.

use std::collections::HashMap;

use crate::layer::Layer;
use crate::vocabulary::PassId;

impl Layer {
    /// Gives a layer another number and its passes other names, one for each. What lies beside a pass is looked for among the old names.
    pub fn rename(&mut self, number: u32, names: &[PassId]) {
        let entries = self.entries.iter_mut().zip(names);
        let new: HashMap<PassId, PassId> = entries
            .map(|(entry, &name)| (std::mem::replace(&mut entry.head.id, name), name))
            .collect();
        for (_, beside) in &mut self.neighbours {
            if let Some(&name) = new.get(&beside.pass) {
                beside.pass = name;
                beside.layer = number;
            }
        }
        self.number = number;
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec3;

    use super::*;
    use crate::vocabulary::{Neighbour, PassHead, Role, Side};

    fn head(id: u32) -> PassHead {
        PassHead {
            id: PassId(id),
            role: Role::Fill,
            ..PassHead::default()
        }
    }

    #[test]
    fn a_layer_of_another_number_keeps_its_passes_and_what_lies_beside_them() {
        let mut layer = Layer::new(3, 0.0);
        layer.polyline(head(7), [DVec3::ZERO, DVec3::X]);
        layer.polyline(head(9), [DVec3::Y, DVec3::X + DVec3::Y]);
        let beside = |pass, layer| Neighbour {
            from: 0.0,
            to: 1.0,
            side: Side::Left,
            pass: PassId(pass),
            distance: 1.0,
            layer,
        };
        // one of its own layer, and one of another
        layer.set_neighbours(vec![(0, beside(9, 3)), (1, beside(4, 2))]);
        layer.rename(5, &[PassId(20), PassId(21)]);
        let ids: Vec<_> = layer.passes().map(|p| (p.layer, p.head.id.0)).collect();
        assert_eq!(ids, [(5, 20), (5, 21)]);
        let neighbours: Vec<_> = layer.passes().flat_map(|p| p.neighbours()).collect();
        assert_eq!(neighbours, [&beside(21, 5), &beside(4, 2)]);
    }
}
