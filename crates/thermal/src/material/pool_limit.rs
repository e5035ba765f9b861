//! Where a pool of conduction ends: vapour pushes the melt aside.

use crate::material::Material;

/// Hotter than any melt, K: where a limit is looked for no more.
const HOTTEST: f64 = 6000.0;

/// What a pool of conduction may reach: where it ends, vapour pushes the melt aside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoolLimit {
    /// Temperature at which the recoil of vapour equals the pressure of the curved surface, K.
    pub kelvin: f64,
    /// That pressure, Pa.
    pub pressure: f64,
}

/// Where the recoil of the vapour exceeds the pressure `2γ/r` that holds a surface curved by the beam's radius, mm, in a gas at
/// `ambient` Pa. None where the material tells no vapour or no surface tension.
pub fn pool_limit(material: &Material, radius: f64, ambient: f64) -> Option<PoolLimit> {
    let (vapour, tension) = (
        material.evaporation.as_ref()?,
        material.surface_tension.as_ref()?,
    );
    let holds = |kelvin: f64| 2.0 * tension.at(kelvin).max(0.0) / (1e-3 * radius);
    let (mut low, mut high) = (material.liquidus, HOTTEST);
    while high - low > 1e-3 {
        let kelvin = 0.5 * (low + high);
        if vapour.recoil(kelvin, ambient) < holds(kelvin) {
            low = kelvin;
        } else {
            high = kelvin;
        }
    }
    Some(PoolLimit {
        kelvin: low,
        pressure: holds(low),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::CELSIUS;
    use crate::material::tests::titanium;

    /// Pure titanium, radius 0.2 mm: near 3000 °C. The alloy gives way earlier, a narrow beam and a gas around let it go hotter.
    #[test]
    fn a_pool_ends_where_recoil_passes_the_curved_surface() {
        let alloy = titanium();
        let of = |m: &Material, radius: f64, ambient: f64| {
            pool_limit(m, radius, ambient).unwrap().kelvin - CELSIUS
        };
        let wide = of(&alloy, 0.2068, 0.2);
        let mut pure = alloy.clone();
        if let Some(vapour) = &mut pure.evaporation {
            vapour.components.truncate(1);
            vapour.components[0].share = 1.0;
        }
        let of_titanium = of(&pure, 0.2, 0.2);
        assert!((of_titanium - 2962.0).abs() < 1.0, "{of_titanium}");
        assert!((wide - 2895.0).abs() < 1.0, "{wide}");
        assert!(of(&alloy, 0.05, 0.2) > wide + 200.0);
        assert!(of(&alloy, 0.2068, 1e5) > wide + 200.0);
        let at = pool_limit(&alloy, 0.2068, 0.2).unwrap();
        let recoil = alloy.evaporation.as_ref().unwrap().recoil(at.kelvin, 0.2);
        assert!((recoil / at.pressure - 1.0).abs() < 1e-4);
        let unknown = Material {
            surface_tension: None,
            ..alloy
        };
        assert_eq!(pool_limit(&unknown, 0.2, 0.2), None);
    }
}
