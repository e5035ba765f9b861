//! How much nearer links come as the hulls that stand for them than as they are.

use meltpath_base::Check;
use meltpath_robot::cell::{Cell, Links};
use meltpath_robot::collision::{Body, Closest};

/// What is nearer by less is as near, mm.
const SAME: f64 = 0.5;

/// Adds to a check of the pair that comes nearest how far its links' hulls stand beyond their meshes, where that may be why it comes so near:
/// nearer than that, or nearer than is wanted.
pub(super) fn hulls(check: Check, worst: &Closest, wanted: f64, cell: &Cell) -> Check {
    let beyond = worst.bodies.map(|body| (body, beyond(cell, body)));
    let all: f64 = beyond.iter().map(|b| b.1).sum();
    if worst.distance > wanted.max(all) || all < SAME {
        return check;
    }
    beyond
        .into_iter()
        .filter(|(_, mm)| *mm >= SAME)
        .fold(check, |check, (body, mm)| {
            check.because(&format!(
                "{body} is held as the hulls of pieces of its shapes, which stand up to {mm:.1} mm beyond it: so much more room there may be"
            ))
        })
}

/// How far the hulls of a link stand beyond its shapes at most, mm.
fn beyond(cell: &Cell, body: Body) -> f64 {
    let links = cell.shapes.as_ref().map(|s| &s.links);
    let (Some(Links::Hulls(hulls)), Body::Link(link)) = (links, body) else {
        return 0.0;
    };
    let of = hulls.iter().filter(|h| h.link == link);
    of.map(|h| h.excess.most).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use meltpath_base::{Limit, Measure};
    use meltpath_data::{find, robots};
    use meltpath_geometry::math::DVec3;
    use meltpath_geometry::shapes::{extrude, ring};
    use meltpath_robot::cell::{self, LinkHull};
    use meltpath_robot::hull::{Fineness, Pieces};

    use super::*;

    /// Of a ring in one hull, which fills its hole: told where the least distance is below what it fills, and of no other body.
    #[test]
    fn what_hulls_add_is_told_where_it_may_matter() {
        let text = find(robots::ALL, "abb-irb2600-12-185").unwrap().text;
        let mut cell = cell::read(text).unwrap();
        let mesh = extrude(&[ring(90.0, 60.0, 60)], 20.0);
        let one = Fineness {
            beyond: 4.0,
            most: 1,
        };
        let taken = Pieces::of(&mesh, one).unwrap();
        let excess = taken.excess.most;
        assert!((50.0..70.0).contains(&excess), "{excess}");
        let link = LinkHull {
            link: 5,
            hull: taken.whole,
            pieces: taken.pieces,
            excess: taken.excess,
            mesh,
            of: String::new(),
        };
        cell.shapes.as_mut().unwrap().links = Links::Hulls(Arc::from([link]));
        let told = |body: Body, distance: f64| {
            let worst = Closest {
                bodies: [body, Body::Metal],
                distance,
                command: 0,
                position: DVec3::ZERO,
            };
            let measure = Measure::exact(distance, "mm");
            let check = Check::judge("collision", "", measure, Limit::AtLeast(2.0));
            hulls(check, &worst, 2.0, &cell).reason
        };
        let reason = told(Body::Link(5), 1.0);
        let wanted = format!(
            "link 5 is held as the hulls of pieces of its shapes, which stand up to {excess:.1} mm"
        );
        assert!(reason.contains(&wanted), "{reason}");
        assert!(told(Body::Link(5), 40.0).contains("link 5"));
        for (body, distance) in [
            (Body::Link(5), 80.0),
            (Body::Link(4), 1.0),
            (Body::Nozzle, 1.0),
        ] {
            assert_eq!(told(body, distance), "", "{body} {distance}");
        }
    }
}
