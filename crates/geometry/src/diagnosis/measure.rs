//! Shells measured: which sense most of their triangles have, area, volume, bounds.

use super::Shell;
use crate::Mesh;
use crate::math::DVec3;
use crate::topology::{NO_SHELL, Shells};

/// For each shell, whether most of its triangles run against its first one.
pub(crate) fn majorities(pieces: &Shells) -> Vec<bool> {
    let mut votes = vec![0_i64; pieces.count];
    for (&shell, &against) in pieces.shell.iter().zip(&pieces.against) {
        if shell != NO_SHELL {
            votes[shell as usize] += if against { 1 } else { -1 };
        }
    }
    votes.into_iter().map(|v| v > 0).collect()
}

/// Size, area and volume of each shell, its triangles taken in their majority's sense.
pub(crate) fn measure(
    mesh: &Mesh,
    pieces: &Shells,
    majority: &[bool],
    closed: &[bool],
) -> Vec<Shell> {
    let mut made: Vec<Shell> = closed
        .iter()
        .map(|&closed| Shell {
            triangles: 0,
            area: 0.0,
            volume: 0.0,
            closed,
            lo: DVec3::INFINITY,
            hi: DVec3::NEG_INFINITY,
            inside: None,
        })
        .collect();
    let origin = mesh
        .bounds()
        .map_or(DVec3::ZERO, |(lo, hi)| 0.5 * (lo + hi));
    for t in 0..mesh.triangles.len() {
        let Some(shell) = made.get_mut(pieces.shell[t] as usize) else {
            continue;
        };
        let [a, b, c] = mesh.corners(t).map(|p| p - origin);
        let volume = a.dot(b.cross(c)) / 6.0;
        shell.triangles += 1;
        shell.area += 0.5 * (b - a).cross(c - a).length();
        shell.volume += if pieces.against[t] == majority[pieces.shell[t] as usize] {
            volume
        } else {
            -volume
        };
        for p in mesh.corners(t) {
            shell.lo = shell.lo.min(p);
            shell.hi = shell.hi.max(p);
        }
    }
    made
}
