//! What a moving beam melts through: the highest temperature on a plane below the build plane, and the pool along the path.
//!
//! A layer of powder is joined to what lies below it where the metal was liquid at the depth of its lower face. The
//! semi-analytic engine tells that along paths of metres; which places stay cold tells where lines lie too far apart, where
//! corners are cut and where the beam came on too late. Conduction only: where the surface boils and the vapour digs a
//! keyhole the true depth is greater, see [`boiling_number`].

use meltpath_base::Observer;

use crate::material::Material;
use crate::material::medium::Medium;
use crate::pool::MeltPool;
use crate::pool::moving_source::{MovingSource, MovingSourceError};

meltpath_base::passes_on! {
    /// Why nothing was melted.
    pub enum FusionError {
        /// The engine.
        Engine(MovingSourceError),
        /// Stopped from outside.
        Cancelled(meltpath_base::Cancelled);

        /// The map.
        #[error(
            "a map of {width:.3} x {height:.3} mm in cells of {cell:.4} mm has too many cells, or none: choose larger cells"
        )]
        Map {
            /// Its size, mm.
            width: f64,
            /// Its size, mm.
            height: f64,
            /// Edge of a cell, mm.
            cell: f64,
        },
    }
}

/// Highest temperature so far at the centres of square cells, on a plane below the build plane.
#[derive(Debug, Clone, PartialEq)]
pub struct FusionMap {
    /// Lower left corner, mm.
    pub origin: [f64; 2],
    /// Edge of a cell, mm.
    pub cell: f64,
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// Depth of the plane below the build plane, mm.
    pub depth: f64,
    /// Highest temperature, K; rows of x, the lowest y first.
    pub highest: Vec<f32>,
}

impl FusionMap {
    /// Cells in a map at most.
    pub const LARGEST: f64 = 4e7;

    /// A map that covers the rectangle from `low` to `high` (mm), everywhere at `ambient` K.
    ///
    /// # Errors
    /// [`FusionError::Map`].
    pub fn covering(
        low: [f64; 2],
        high: [f64; 2],
        cell: f64,
        depth: f64,
        ambient: f64,
    ) -> Result<Self, FusionError> {
        let size = [high[0] - low[0], high[1] - low[1]];
        let counts = size.map(|s| (s / cell - 1e-9).ceil().max(1.0));
        if !(cell > 0.0 && counts[0] * counts[1] <= Self::LARGEST && size.iter().all(|s| *s >= 0.0))
        {
            return Err(FusionError::Map {
                width: size[0],
                height: size[1],
                cell,
            });
        }
        let cells = counts.map(|c| c as usize);
        Ok(FusionMap {
            origin: low,
            cell,
            cells,
            depth,
            highest: vec![ambient as f32; cells[0] * cells[1]],
        })
    }

    /// Centre of a cell, mm.
    pub fn centre(&self, n: usize) -> [f64; 2] {
        let at = |k: usize, axis: usize| self.origin[axis] + (k as f64 + 0.5) * self.cell;
        [at(n % self.cells[0], 0), at(n / self.cells[0], 1)]
    }

    /// Cells that became hotter than `kelvin`.
    pub fn hotter(&self, kelvin: f64) -> impl Iterator<Item = bool> + '_ {
        self.highest.iter().map(move |t| f64::from(*t) > kelvin)
    }

    /// The cells along one axis that an interval touches.
    fn range(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let at = |x: f64| (x - self.origin[axis]) / self.cell;
        let end = self.cells[axis] as f64;
        (at(low).floor().clamp(0.0, end) as usize)..(at(high).ceil().clamp(0.0, end) as usize)
    }
}

/// The pool at a place of the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TracePoint {
    /// When, s.
    pub time: f64,
    /// Where the beam was, mm.
    pub place: [f64; 2],
    /// The pool.
    pub pool: MeltPool,
}

/// How finely a path is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Following {
    /// Distance along the path from one look at the plane to the next, mm.
    pub step: f64,
    /// Looks at the plane from one measured pool to the next.
    pub per_pool: usize,
}

/// Draws the engine's whole path, keeps the highest temperatures on the plane of `map`, and measures the pool on the way. After the
/// beam has gone off the heat it left is followed until it has reached the plane.
///
/// The pool is looked for round the beam; what is liquid elsewhere was seen when the beam was there.
///
/// # Errors
/// [`FusionError`]: a body that melts throughout, cancellation.
///
/// ```
/// use meltpath_base::Silent;
/// use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
/// use meltpath_thermal::pool::fusion::{Following, FusionMap, follow};
/// use meltpath_thermal::pool::history::Memory;
/// use meltpath_thermal::material::medium::{Body, Medium};
/// use meltpath_thermal::pool::moving_source::MovingSource;
/// use meltpath_thermal::solver::source::Depth;
/// # let text = meltpath_data::materials::IN625_LASER.text;
/// # let alloy = meltpath_thermal::material::file::read(text, Default::default()).unwrap();
/// let medium = Medium::effective(&alloy, 293.15, Body::HalfSpace).unwrap();
/// let start = BeamPoint::start(195.0, 0.1);
/// let path = BeamPath::along(&[[0.0, 0.0], [1.0, 0.0]], 800.0, start).unwrap();
/// let beam = Beam { efficiency: 0.33, depth: Depth::Surface };
/// let mut engine = MovingSource::new(medium, path, beam, Memory::Folded).unwrap();
/// let mut map = FusionMap::covering([-0.1, -0.1], [1.1, 0.1], 0.01, 0.02, 293.15).unwrap();
/// let following = Following { step: 0.04, per_pool: 4 };
/// let trace = follow(&mut engine, alloy.liquidus, &mut map, following, &Silent).unwrap();
/// assert!(trace.last().unwrap().pool.width > 0.1);
/// let area = map.hotter(alloy.liquidus).filter(|m| *m).count() as f64 * 1e-4; // mm²
/// assert!((0.06..0.12).contains(&area), "{area}");
/// ```
pub fn follow(
    engine: &mut MovingSource,
    liquidus: f64,
    map: &mut FusionMap,
    following: Following,
    observer: &dyn Observer,
) -> Result<Vec<TracePoint>, FusionError> {
    let looks = looks(engine, map.depth, following.step);
    observer.stage("follow the melt pool", looks.len() as u64);
    let ambient = engine.medium().ambient;
    let mut trace = Vec::new();
    for (n, look) in looks.iter().enumerate() {
        if n % 64 == 0 {
            observer.check()?;
            observer.advance(if n == 0 { 0 } else { 64 });
        }
        engine.advance(look.time)?;
        if look.lit && n % following.per_pool.max(1) == 0 {
            trace.push(TracePoint {
                time: look.time,
                place: look.place,
                pool: engine.measure(liquidus)?.pool,
            });
        }
        let (sheet, sums) = engine.plane(look.place, look.direction, map.depth);
        let corners = sheet.corners();
        let bounds = |axis: usize| {
            let all = corners.map(|c| c[axis]);
            (
                all.into_iter().fold(f64::INFINITY, f64::min),
                all.into_iter().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        let ((x0, x1), (y0, y1)) = (bounds(0), bounds(1));
        for j in map.range(1, y0, y1) {
            for i in map.range(0, x0, x1) {
                let cell = j * map.cells[0] + i;
                if let Some(rise) = sheet.rise(&sums, map.centre(cell)) {
                    let kelvin = (ambient + rise) as f32;
                    map.highest[cell] = map.highest[cell].max(kelvin);
                }
            }
        }
    }
    Ok(trace)
}

/// A moment at which the plane is looked at.
#[derive(Debug, Clone, Copy)]
struct Look {
    time: f64,
    /// Where the beam is, or was last when it was on, mm.
    place: [f64; 2],
    /// Its travel, of length 1.
    direction: [f64; 2],
    lit: bool,
}

/// Times that heat takes to the plane after which a lit beam is looked at that went less than a step.
const STANDS: f64 = 10.0;

/// Moments a `step` of travel apart while the beam is on, and some after it has gone off.
fn looks(engine: &MovingSource, depth: f64, step: f64) -> Vec<Look> {
    // heat from the surface is at its hottest at depth z after z²/(2α)
    let reach = depth * depth / (2.0 * engine.medium().diffusivity);
    let mut looks: Vec<Look> = Vec::new();
    let mut since = 0.0;
    let after = |looks: &mut Vec<Look>, next: f64| {
        if let Some(&last) = looks.last().filter(|l| l.lit) {
            for share in [0.5, 1.0] {
                let time = last.time + share * reach;
                if time < next {
                    looks.push(Look {
                        time,
                        lit: false,
                        ..last
                    });
                }
            }
        }
    };
    for pair in engine.path().points().windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let length = dx.hypot(dy);
        if !a.is_on() {
            if looks.last().is_some_and(|l| l.lit) {
                after(&mut looks, f64::INFINITY);
            }
            since = step;
            continue;
        }
        while looks.last().is_some_and(|l| !l.lit && l.time > a.time) {
            looks.pop();
        }
        if length == 0.0 {
            // a beam that stands heats what is below it until it goes on
            let direction = looks.last().map_or([1.0, 0.0], |l| l.direction);
            looks.push(Look {
                time: b.time,
                place: [a.x, a.y],
                direction,
                lit: true,
            });
            since = 0.0;
            continue;
        }
        let direction = [dx / length, dy / length];
        // so slow that it all but stands: as mirrors settle while they wait
        if looks
            .last()
            .is_some_and(|l| l.lit && b.time - l.time > STANDS * reach)
        {
            since = f64::max(since, step - length);
        }
        let mut at = step - since;
        while at <= length {
            let share = (at / length).max(0.0);
            looks.push(Look {
                time: a.time + share * (b.time - a.time),
                place: [a.x + share * dx, a.y + share * dy],
                direction,
                lit: true,
            });
            at += step;
        }
        since = length - (at - step);
    }
    after(&mut looks, f64::INFINITY);
    looks
}

/// The source's plates, K.
const ROOM: f64 = 293.15;

/// Power absorbed over what a flat surface can conduct away before it boils: the normalised enthalpy of King et al. 2014
/// (Journal of Materials Processing Technology 214, after Hann et al. 2011),
/// `ΔH/h_s = P/(π h_s √(D v a³))` with `h_s` the heat to the melting point and `a` the beam's radius (two standard
/// deviations), divided by its threshold `π T_b/T_m`. Well below 1 heat is conducted away from a nearly flat surface; from 1 on
/// the surface boils and a keyhole forms. Theirs are plates at room temperature, and so are the properties here. On a bed at `T_0` the
/// beam has less left to heat before it boils: the number is greater as `(T_b − T_room)/(T_b − T_0)`, which is ours. Power absorbed in W, speed in mm/s, diameter (four standard deviations) in mm; none where
/// the material has no boiling point.
///
/// ```
/// # let text = meltpath_data::materials::IN625_LASER.text;
/// # let alloy = meltpath_thermal::material::file::read(text, Default::default()).unwrap();
/// use meltpath_thermal::pool::fusion::boiling_number;
/// use meltpath_thermal::material::medium::{Body, Medium};
/// let medium = Medium::effective(&alloy, 293.15, Body::HalfSpace).unwrap();
/// // 150 W, 400 mm/s, 100 µm: the track that its authors call near keyholing (Lane et al. 2020, case A)
/// let number = boiling_number(&alloy, &medium, 0.33 * 150.0, 400.0, 0.1).unwrap();
/// assert!((0.7..1.3).contains(&number), "{number}");
/// // on a bed of 1100 °C, 1600 K are left of 2700 to where this alloy boils
/// let hot = Medium { ambient: 1373.15, ..medium };
/// let hot = boiling_number(&alloy, &hot, 0.33 * 150.0, 400.0, 0.1).unwrap();
/// assert!((1.5..1.9).contains(&(hot / number)), "{hot}");
/// ```
pub fn boiling_number(
    material: &Material,
    medium: &Medium,
    absorbed: f64,
    speed: f64,
    diameter: f64,
) -> Option<f64> {
    let boiling = material.evaporation.as_ref()?.components.first()?.boiling;
    // without the latent heat, as the source has it
    let latent = 1e-9 * material.density(material.solidus) * material.latent;
    let cold = Medium::effective(material, ROOM, medium.body).ok()?;
    let melting = cold.heat_capacity() * (material.liquidus - ROOM) - latent;
    let radius = 0.5 * diameter;
    let spread = (cold.diffusivity * speed * radius.powi(3)).sqrt();
    let enthalpy = absorbed / (std::f64::consts::PI * melting * spread);
    let left = (boiling - ROOM) / (boiling - medium.ambient).max(1.0);
    Some(left * enthalpy * material.liquidus / (std::f64::consts::PI * boiling))
}

/// By how much a Gaussian spot of `diameter` mm (four standard deviations) that stands for `time` s and of which `absorbed` W become
/// heat warms its middle, K, on a half space: `P/(√(2π) k w) · (2/π) arctan(√(2αt)/σ)` with `w = 2σ` (Carslaw and Jaeger 1959,
/// chapter X, point sources of the surface summed over spot and time). Conduction only; what stays for ever warms it by
/// `P/(√(2π) k w)`.
///
/// ```
/// # let text = meltpath_data::materials::IN625_LASER.text;
/// # let alloy = meltpath_thermal::material::file::read(text, Default::default()).unwrap();
/// use meltpath_thermal::material::medium::{Body, Medium};
/// use meltpath_thermal::pool::fusion::standing_rise;
/// let medium = Medium::effective(&alloy, 293.15, Body::HalfSpace).unwrap();
/// let ever = 60.0 / (2.0 * std::f64::consts::PI).sqrt() / medium.conductivity / 0.05;
/// assert!((standing_rise(&medium, 60.0, 0.1, 1e9) / ever - 1.0).abs() < 1e-4);
/// // at first as if nothing flowed off: twice the flux times √(t/(π k ρc))
/// let (time, flux) = (1e-7_f64, 60.0 / (2.0 * std::f64::consts::PI * 0.025_f64.powi(2)));
/// let early = 2.0 * flux / medium.conductivity * (medium.diffusivity * time / std::f64::consts::PI).sqrt();
/// assert!((standing_rise(&medium, 60.0, 0.1, time) / early - 1.0).abs() < 0.01);
/// ```
pub fn standing_rise(medium: &Medium, absorbed: f64, diameter: f64, time: f64) -> f64 {
    use std::f64::consts::{FRAC_2_PI, TAU};
    let sigma = 0.25 * diameter;
    let ever = absorbed / (TAU.sqrt() * medium.conductivity * 2.0 * sigma);
    ever * FRAC_2_PI * ((2.0 * medium.diffusivity * time.max(0.0)).sqrt() / sigma).atan()
}
