//! Which shell lies inside which: by rays that count crossings.

use rayon::prelude::*;

use super::Shell;
use crate::{
    Mesh,
    bvh::{Bvh, meets},
    math::DVec3,
    topology::{NO_SHELL, Shells},
};

/// A direction that no designed part is aligned with, so that rays meet triangles and not edges.
const DIRECTION: DVec3 = DVec3::new(0.316_227_9, 0.141_421_7, 0.938_083_3);

/// For each shell, the smallest closed shell around it.
///
/// One ray is sent from the middle of each shell's first triangle; shells that intersect nest by that point.
pub(crate) fn parents(
    mesh: &Mesh,
    bvh: &Bvh,
    pieces: &Shells,
    shells: &[Shell],
) -> Vec<Option<u32>> {
    if shells.len() < 2 {
        return vec![None; shells.len()];
    }
    let mut first = vec![usize::MAX; shells.len()];
    for (t, &shell) in pieces.shell.iter().enumerate().rev() {
        if shell != NO_SHELL {
            first[shell as usize] = t;
        }
    }
    let direction = DIRECTION.normalize();
    first
        .par_iter()
        .enumerate()
        .map(|(own, &t)| {
            let origin = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
            let mut crossed: Vec<u32> = Vec::new();
            bvh.along_ray(origin, direction, |other| {
                let shell = pieces.shell[other as usize];
                if shell != NO_SHELL
                    && shell as usize != own
                    && shells[shell as usize].closed
                    && meets(&mesh.corners(other as usize), origin, direction)
                {
                    crossed.push(shell);
                }
            });
            crossed.sort_unstable();
            crossed
                .chunk_by(|a, b| a == b)
                .filter(|hits| hits.len() % 2 == 1)
                .map(|hits| hits[0])
                .min_by(|&a, &b| {
                    let volume = |s: u32| shells[s as usize].volume.abs();
                    volume(a).total_cmp(&volume(b)).then(a.cmp(&b))
                })
        })
        .collect()
}
