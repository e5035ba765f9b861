//! A body and the parts that grow out of it one after the other: what is asked, and what each of them stands on.

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Union;
use meltpath_geometry::math::DVec3;
use meltpath_planning::surface::SurfacePass;

/// A body and what is to grow out of it, in the build.
#[derive(Debug, Clone)]
pub(crate) struct OntoMeshes {
    /// As it is now.
    pub body: Mesh,
    /// In the order in which they are built.
    pub parts: Vec<OntoPart>,
}

/// A part that grows out of a body.
#[derive(Debug, Clone)]
pub struct OntoPart {
    /// Its file's name.
    pub name: String,
    /// As it is to be, or what is to be added alone.
    pub mesh: Mesh,
    /// The faces that are its top, where they are named.
    pub top: Option<Mesh>,
}

/// A body with the parts that grow out of it as they are planned.
#[derive(Debug, Clone)]
pub struct Pieces {
    /// As it is now.
    pub body: Mesh,
    /// In the order in which they are built.
    pub pieces: Vec<Piece>,
}

/// A part as it is planned.
#[derive(Debug, Clone)]
pub struct Piece {
    /// The part.
    pub part: OntoPart,
    /// Numbers of what it grows out of: 0 the body, then the pieces from 1 on.
    pub on: Vec<usize>,
    /// What its layers fill, where others may grow out of it.
    pub built: Option<Mesh>,
    /// The number of its first layer.
    pub first: u32,
    /// How high what it grows out of was itself built along its own growth, mm, at most.
    pub below: f64,
}

impl Pieces {
    /// All that stands there before the piece, numbered from 0, is laid: the body, and what the pieces before fill, with their numbers.
    pub fn before(&self, piece: usize) -> impl Iterator<Item = (usize, &Mesh)> {
        let pieces = self.pieces.iter().take(piece).map(|p| p.built.as_ref());
        let all = std::iter::once(Some(&self.body)).chain(pieces);
        all.enumerate().filter_map(|(i, mesh)| Some((i, mesh?)))
    }

    /// What a piece grows out of.
    pub fn under(&self, piece: &Piece) -> Vec<&Mesh> {
        let before = self.before(self.pieces.len());
        let on = before.filter(|(i, _)| piece.on.contains(i));
        on.map(|(_, mesh)| mesh).collect()
    }

    /// How high what a piece grows out of was built along the growth of its first layer, mm: its heights are as uncertain.
    pub(super) fn below(&self, piece: &Piece, first: &[SurfacePass]) -> f64 {
        let under = Union::new(self.under(piece));
        let ground = |piece: &Piece| Union::new(self.under(piece));
        let grounds: Vec<Union> = self.pieces.iter().map(ground).collect();
        let high = |from: DVec3, growth: DVec3| {
            let (mesh, _) = under.nearest(from)?;
            let on = piece.on.get(mesh)?.checked_sub(1)?;
            let foot = grounds.get(on)?.foot(from)?;
            let all = self.pieces[on].below + foot.distance.max(0.0);
            Some(all * growth.dot(foot.outward).abs())
        };
        let points = first.iter().flat_map(|pass| &pass.points);
        points
            .filter_map(|p| high(p.from?, p.growth))
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::shapes;
    use meltpath_planning::surface::SurfacePoint;

    use super::*;

    fn cuboid(low: [f64; 3], high: [f64; 3]) -> Mesh {
        shapes::cuboid(DVec3::from_array(low), DVec3::from_array(high))
    }

    fn piece(mesh: &Mesh, on: &[usize], below: f64) -> Piece {
        Piece {
            part: OntoPart {
                name: String::new(),
                mesh: mesh.clone(),
                top: None,
            },
            on: on.to_vec(),
            built: Some(mesh.clone()),
            first: 1,
            below,
        }
    }

    /// A pass of one point.
    fn from(place: [f64; 3], growth: DVec3) -> SurfacePass {
        let position = DVec3::from_array(place);
        SurfacePass {
            number: 1,
            points: vec![SurfacePoint {
                position,
                normal: DVec3::Y,
                growth,
                from: Some(position),
            }],
        }
    }

    /// On a trunk of 30 the heights of what goes on upwards are those of 30 and more; out of its flank they begin anew, and halfway between
    /// they are half of that.
    #[test]
    fn heights_add_up_as_far_as_directions_agree() {
        let plate = cuboid([-50.0, -50.0, -10.0], [50.0, 50.0, 0.0]);
        let trunk = cuboid([-10.0, -10.0, -1.0], [10.0, 10.0, 30.0]);
        let pieces = Pieces {
            body: plate,
            pieces: vec![piece(&trunk, &[0], 0.0)],
        };
        let next = piece(&Mesh::default(), &[1], 0.0);
        let below = |place, growth| pieces.below(&next, &[from(place, growth)]);
        assert_eq!(below([0.0, 0.0, 30.0], DVec3::Z), 30.0);
        let leaning = DVec3::new(3.0_f64.sqrt(), 0.0, 1.0) / 2.0;
        assert!((below([0.0, 0.0, 30.0], leaning) - 15.0).abs() < 1e-12);
        // of the flank the nearest place of the plate is as far down, and its growth stands across
        assert!(below([10.0, 0.0, 20.0], DVec3::X).abs() < 1e-12);
        // out of the plate nothing is below
        let other = piece(&Mesh::default(), &[0], 0.0);
        assert_eq!(
            pieces.below(&other, &[from([30.0, 0.0, 0.0], DVec3::Z)]),
            0.0
        );
        // and a third piece has all that is below the second
        let cap = cuboid([-10.0, -10.0, 29.0], [10.0, 10.0, 45.0]);
        let mut three = pieces.clone();
        three.pieces.push(piece(&cap, &[1], 30.0));
        let last = piece(&Mesh::default(), &[2], 0.0);
        let high = three.below(&last, &[from([0.0, 0.0, 45.0], DVec3::Z)]);
        assert!((high - 45.0).abs() < 1e-12, "{high}");
    }
}
