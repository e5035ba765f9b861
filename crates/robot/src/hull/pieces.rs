//! A mesh as the hulls of pieces of it: together they hold all of it, and hardly more.

use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::sight::Sight;
use rayon::prelude::*;

use super::Hull;
use super::cut::Piece;
use super::excess::{Excess, excess};

/// A mesh as convex bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces {
    /// The hull of all of it.
    pub whole: Hull,
    /// Hulls of its pieces; none where the whole will do.
    pub pieces: Vec<Hull>,
    /// How far these, or the whole, stand beyond the mesh.
    pub excess: Excess,
}

impl From<Hull> for Pieces {
    /// What is convex: but for the radius around its points, if it has many, its hull is the body.
    fn from(whole: Hull) -> Self {
        let beyond = if whole.points().len() > 1 {
            whole.radius()
        } else {
            0.0
        };
        Pieces {
            whole,
            pieces: Vec::new(),
            excess: Excess {
                most: beyond,
                ..Excess::default()
            },
        }
    }
}

/// How fine a mesh is split.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fineness {
    /// A piece whose hull stands beyond the mesh no farther than this is not split, mm.
    pub beyond: f64,
    /// The most pieces.
    pub most: usize,
}

impl Default for Fineness {
    /// What links of a robot are split into.
    fn default() -> Self {
        Fineness {
            beyond: 4.0,
            most: 24,
        }
    }
}

/// Places that are looked at to learn whether a piece is to be split, and in the end to learn how far it stands beyond the mesh.
const TO_SPLIT: usize = 600;
const TO_TELL: usize = 2500;

/// A piece and its hull.
struct Part {
    piece: Piece,
    hull: Hull,
    excess: Excess,
}

impl Pieces {
    /// Of a mesh with finite vertices; nothing of one without a triangle. Whatever lies on a triangle or is closed in by them lies in one of the hulls,
    /// however the triangles are turned, open at their rims or stacked into each other.
    ///
    /// It is split by planes, the worst piece first, each where the hulls of both sides take up least room.
    pub fn of(mesh: &Mesh, fineness: Fineness) -> Option<Self> {
        let triangles: Vec<[DVec3; 3]> =
            (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let sight = Sight::new(mesh);
        let whole = Part::of(Piece::all(triangles), &sight, fineness)?;
        let hull = whole.hull.clone();
        let (mut open, mut done) = (vec![whole], Vec::new());
        while open.len() + done.len() < fineness.most
            && let Some(worst) = worst(&open)
        {
            if open[worst].excess.least <= fineness.beyond {
                break;
            }
            let part = open.swap_remove(worst);
            let Some(cut) = part.piece.best(part.excess.place) else {
                done.push(part);
                continue;
            };
            let both = part.piece.both(cut, &sight);
            let parts = both.into_par_iter().map(|p| Part::of(p, &sight, fineness));
            open.extend(parts.collect::<Vec<_>>().into_iter().flatten());
        }
        done.extend(open);
        let told: Vec<Excess> = done.par_iter().map(|p| p.told(&sight, fineness)).collect();
        let excess = told.into_iter().reduce(Excess::or).unwrap_or_default();
        let pieces = if done.len() > 1 {
            done.into_iter().map(|p| p.hull).collect()
        } else {
            Vec::new()
        };
        Some(Pieces {
            whole: hull,
            pieces,
            excess,
        })
    }
}

/// The number of the part that stands farthest beyond the mesh, the first of equal ones.
fn worst(parts: &[Part]) -> Option<usize> {
    let far = |i: &usize| parts[*i].excess.least;
    (0..parts.len()).reduce(|best, i| if far(&i) > far(&best) { i } else { best })
}

impl Part {
    fn of(piece: Piece, sight: &Sight, fineness: Fineness) -> Option<Self> {
        let hull = Hull::of(&piece.points())?;
        let excess = excess(hull.points(), sight, fineness.beyond, TO_SPLIT);
        Some(Part {
            piece,
            hull,
            excess,
        })
    }

    /// How far it stands beyond the mesh, with the radius of its hull.
    fn told(&self, sight: &Sight, fineness: Fineness) -> Excess {
        let found = excess(self.hull.points(), sight, 0.25 * fineness.beyond, TO_TELL);
        Excess {
            most: found.most + self.hull.radius(),
            ..found
        }
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::{DQuat, DVec2};
    use meltpath_geometry::shapes::{cuboid, extrude, revolve, ring, sheet};
    use meltpath_numerics::random::Random;
    use proptest::prelude::*;

    use super::*;

    const FINE: Fineness = Fineness {
        beyond: 1.0,
        most: 12,
    };

    fn of(mesh: &Mesh) -> Pieces {
        Pieces::of(mesh, FINE).unwrap()
    }

    fn hulls(pieces: &Pieces) -> &[Hull] {
        if pieces.pieces.is_empty() {
            std::slice::from_ref(&pieces.whole)
        } else {
            &pieces.pieces
        }
    }

    /// How far a point lies out of all hulls, mm.
    fn out(pieces: &Pieces, p: DVec3) -> f64 {
        let off = |h: &Hull| h.beyond(p) - h.radius();
        hulls(pieces).iter().map(off).fold(f64::INFINITY, f64::min)
    }

    fn bar(low: [f64; 3], high: [f64; 3]) -> Mesh {
        cuboid(low.into(), high.into())
    }

    /// A bridge of 20 mm with two tines of 100 mm, 60 mm apart.
    fn fork() -> Mesh {
        let mut all = bar([-40.0, -10.0, 0.0], [40.0, 10.0, 20.0]);
        all.add(&bar([-40.0, -10.0, 20.0], [-30.0, 10.0, 120.0]));
        all.add(&bar([30.0, -10.0, 20.0], [40.0, 10.0, 120.0]));
        all
    }

    fn turned(mut mesh: Mesh, turn: DQuat, by: DVec3) -> Mesh {
        mesh.vertices.iter_mut().for_each(|v| *v = turn * *v + by);
        mesh
    }

    /// A point of a triangle.
    fn on([a, b, c]: [DVec3; 3], random: &mut Random) -> DVec3 {
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (u, v)
        };
        a + u * (b - a) + v * (c - a)
    }

    /// Bars and no more, wherever it stands; the hull of all fills what is between the tines.
    #[test]
    fn a_fork_is_its_bars() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 0.7);
        for turn in [DQuat::IDENTITY, turn] {
            let by = DVec3::new(5.0, -3.0, 40.0);
            let pieces = of(&turned(fork(), turn, by));
            assert!(
                (3..=4).contains(&pieces.pieces.len()),
                "{:?}",
                pieces.excess
            );
            assert!(pieces.excess.most < 0.5, "{:?}", pieces.excess);
            let gap = turn * DVec3::new(0.0, 0.0, 70.0) + by;
            assert!(
                (out(&pieces, gap) - 30.0).abs() < 0.01,
                "{}",
                out(&pieces, gap)
            );
            assert_eq!(pieces.whole.beyond(gap), 0.0);
        }
        let whole = Pieces::of(
            &fork(),
            Fineness {
                beyond: 2.0,
                most: 1,
            },
        );
        // half the way between the tines
        let Excess { least, most, .. } = whole.unwrap().excess;
        assert!(least <= 30.0 && least > 26.0 && (30.0..33.5).contains(&most));
    }

    /// A thick block with a deep notch is cut where nothing of its skin is: its inside stays full.
    #[test]
    fn cells_within_a_solid_are_full() {
        let mut random = Random::new(6);
        let pieces = of(&extrude(&[ring(200.0, 60.0, 12)], 200.0));
        assert_eq!(pieces.pieces.len(), FINE.most);
        for _ in 0..4000 {
            let angle = random.between(0.0, std::f64::consts::TAU);
            // within the flat sides of the outline
            let far = random.between(61.0, 200.0 * 0.965);
            let p = DVec3::new(
                far * angle.cos(),
                far * angle.sin(),
                random.between(0.0, 200.0),
            );
            assert!(out(&pieces, p) < 1e-6, "{p} {}", out(&pieces, p));
        }
        assert!(out(&pieces, DVec3::new(0.0, 0.0, 100.0)) > 20.0);
    }

    /// The same pieces on one thread and on many; small, flat and no meshes.
    #[test]
    fn pieces_are_the_same_anywhere() {
        let ring = extrude(&[ring(80.0, 60.0, 90)], 20.0);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let [one, many] = [alone.unwrap().install(|| of(&ring)), of(&ring)];
        assert_eq!(one, many);
        assert!(many.excess.most < 20.0 && many.excess.least > 1.0);
        assert!(Pieces::of(&Mesh::default(), FINE).is_none());
        let corner = Mesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]],
        };
        let flat = of(&corner);
        assert!(
            flat.pieces.is_empty() && flat.excess.most < 1e-3,
            "{flat:?}"
        );
        let point = Mesh {
            triangles: vec![[0, 0, 0]],
            ..corner
        };
        assert_eq!(of(&point).whole.points(), [DVec3::ZERO]);
    }

    /// No place of a hull is farther from what it stands for than is told.
    #[test]
    fn the_excess_is_no_less_than_it_is() {
        let mut random = Random::new(12);
        let coarse = Fineness {
            beyond: 8.0,
            most: 2,
        };
        let star = [
            [0.0, 0.0],
            [60.0, 10.0],
            [30.0, 40.0],
            [70.0, 90.0],
            [0.0, 60.0],
        ];
        for mesh in [fork(), revolve(&star.map(DVec2::from), 24)] {
            let pieces = Pieces::of(&mesh, coarse).unwrap();
            let sight = Sight::new(&mesh);
            let mut far = 0.0_f64;
            for hull in hulls(&pieces) {
                for _ in 0..3000 {
                    // on its skin: from a point within as far as it goes
                    let way = DVec3::from_array(std::array::from_fn(|_| random.normal()));
                    let [mut low, mut high] = [0.0, 400.0];
                    let centre = hull.points().iter().sum::<DVec3>() / hull.points().len() as f64;
                    let at = |t: f64| centre + t * way.normalize_or(DVec3::X);
                    while high - low > 1e-6 {
                        let middle = f64::midpoint(low, high);
                        if hull.beyond(at(middle)) > 0.0 {
                            high = middle;
                        } else {
                            low = middle;
                        }
                    }
                    if !sight.is_inside(at(low)) {
                        far = far.max(sight.nearest(at(low)).unwrap().1);
                    }
                }
            }
            let Excess { least, most, .. } = pieces.excess;
            assert!(far <= most + 1e-3, "{far} {:?}", pieces.excess);
            assert!(
                far > 0.7 * most && least <= most,
                "{far} {:?}",
                pieces.excess
            );
        }
    }

    fn boxes() -> impl Strategy<Value = Vec<([f64; 3], [f64; 3], [f64; 3])>> {
        let size = prop::array::uniform3(0.0..120.0_f64);
        let place = prop::array::uniform3(-80.0..80.0_f64);
        let turn = prop::array::uniform3(-3.0..3.0_f64);
        prop::collection::vec((size, place, turn), 1..5)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]
        /// Of boxes that reach into each other, flat ones among them, triangles turned and left out; of closed ones the inside, too.
        #[test]
        fn hulls_hold_the_mesh(boxes in boxes(), seed in 0..1000_u64, holes in 0..4_u32) {
            let mut random = Random::new(seed);
            let wave = |i: f64, k: f64| {
                let [x, y] = [30.0 * i, 30.0 * k];
                DVec3::new(x, y, 20.0 * (0.05 * x).sin())
            };
            let mut mesh = sheet(6, 3, |i, k| (i, k) == (2, 1), wave);
            let mut inside = Vec::new();
            for (size, place, [x, y, z]) in boxes {
                let size = DVec3::from(size);
                // a part of them without thickness
                let size = if size.z < 20.0 { size.with_z(0.0) } else { size };
                let turn = DQuat::from_scaled_axis(DVec3::new(x, y, z));
                let solid = turned(cuboid(DVec3::ZERO, size), turn, DVec3::from(place));
                for _ in 0..100 {
                    let share = DVec3::from_array(std::array::from_fn(|_| random.unit()));
                    inside.push(turn * (share * size) + DVec3::from(place));
                }
                mesh.add(&solid);
            }
            if holes > 0 {
                inside.clear();
            }
            for _ in 0..3 * holes {
                let at = (random.unit() * mesh.triangles.len() as f64) as usize;
                mesh.triangles.swap_remove(at);
                let at = (random.unit() * mesh.triangles.len() as f64) as usize;
                mesh.triangles[at].swap(0, 1);
            }
            let pieces = of(&mesh);
            for t in 0..mesh.triangles.len() {
                let corners = mesh.corners(t);
                for _ in 0..20 {
                    inside.push(on(corners, &mut random));
                }
                inside.extend(corners);
            }
            for p in inside {
                prop_assert!(out(&pieces, p) < 1e-6, "{} {}", p, out(&pieces, p));
            }
        }
    }
}
