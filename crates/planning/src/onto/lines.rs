//! The beads of one layer: contours at their distance from its rim, lines inside them, parallel on the surface.

use meltpath_geometry::Mesh;
use meltpath_geometry::level::{pieces, rims};
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_geometry::segments::Segments;
use meltpath_geometry::sheet::{Sheet, SheetError, SheetLine};

use super::chain::{Line, chained};
use super::{OntoError, OntoSettings};

/// Steps in which lines are followed to the rim of what they fill, of a stepover.
const STEPS: f64 = 0.1;
/// Outermost lines lie inside what they fill by this share of a stepover: on its border they would be shreds.
const WITHIN: f64 = 0.02;

/// The beads of a layer, in the order in which they are laid: of each piece first the lines, then the contours from inside out, so that no
/// line is laid between finished contours.
pub(super) fn beads(
    sheet: &Sheet,
    direction: f64,
    settings: &OntoSettings,
) -> Result<Vec<Vec<DVec3>>, OntoError> {
    let mut all = Vec::new();
    for mesh in pieces(sheet.mesh()) {
        let sheet = Sheet::new(&mesh, settings.stepover)?;
        all.extend(of_piece(&sheet, direction, settings)?);
    }
    Ok(all)
}

fn of_piece(
    sheet: &Sheet,
    direction: f64,
    settings: &OntoSettings,
) -> Result<Vec<Vec<DVec3>>, OntoError> {
    let OntoSettings {
        stepover, inset, ..
    } = *settings;
    let rims = rims(sheet.mesh());
    let near = Segments::new(rims.iter().map(Vec::as_slice), stepover);
    let inner = inset + f64::from(settings.contours) * stepover;
    let farthest = inner + 2.0 * stepover;
    // a layer without a rim goes around the body
    let rim = |p: DVec3| near.nearest(p, farthest).map_or(farthest, |n| n.distance);
    let filled = Filled {
        sheet,
        depth: &|p| rim(p) - inner,
        stepover,
    };
    let mut beads = filled.lines(direction, settings.chord_error)?;
    for k in (0..settings.contours).rev() {
        let level = inset + f64::from(k) * stepover;
        let lines = sheet.level_lines(|p| rim(p) - level);
        let long = |line: &Vec<DVec3>| length(line) > stepover;
        beads.extend(lines.iter().map(positions).filter(long));
    }
    Ok(beads)
}

fn positions(line: &SheetLine) -> Vec<DVec3> {
    line.points.iter().map(|p| p.0).collect()
}

fn length(line: &[DVec3]) -> f64 {
    line.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// What lines fill: a surface, as far as a depth is above zero.
struct Filled<'a> {
    sheet: &'a Sheet,
    depth: &'a dyn Fn(DVec3) -> f64,
    stepover: f64,
}

/// Lines to one side of the middle of what they fill, each at one distance more.
struct Side {
    lines: Vec<Vec<Vec<DVec3>>>,
}

impl Filled<'_> {
    /// Zigzags of lines that fill the width evenly, at most by half a line more or less than a stepover apart.
    fn lines(&self, direction: f64, chord_error: f64) -> Result<Vec<Vec<DVec3>>, OntoError> {
        let inside = |p: &DVec3| (self.depth)(*p) >= 0.0;
        let all = self.sheet.mesh().vertices.iter().copied();
        let mut inner: Vec<DVec3> = all.filter(inside).collect();
        // what is filled ends between vertices
        let border = self.sheet.level_lines(|p| (self.depth)(p));
        inner.extend(border.iter().flat_map(positions));
        let Some(across) = across(self.sheet.mesh(), direction).filter(|_| !inner.is_empty())
        else {
            return Ok(Vec::new());
        };
        let middle = inner.iter().sum::<DVec3>() / inner.len() as f64;
        let at = middle.dot(across);
        let [ahead, back] = [across, -across].map(|u| {
            let side = self.side(u, u.dot(middle), self.stepover, chord_error)?;
            Ok::<f64, OntoError>(self.extent(&side, u, u.dot(middle), &inner))
        });
        let (ahead, back) = (ahead?, back?);
        let width = (ahead + back) * (1.0 - WITHIN);
        let gaps = (width / self.stepover).round();
        let spacing = if gaps > 0.0 {
            width / gaps
        } else {
            self.stepover
        };
        let centre = at + 0.5 * (ahead - back);
        // an even number of gaps has a line in the middle
        let even = gaps as u64 % 2 == 0;
        let off = if even { 0.0 } else { 0.5 * spacing };
        let on_side = (0.5 * (gaps - if even { 0.0 } else { 1.0 })) as usize;
        let side = |u: DVec3, sense: f64| -> Result<Vec<Vec<Vec<DVec3>>>, OntoError> {
            let side = self.side(u, sense * centre + off, spacing, chord_error)?;
            Ok(side.lines.into_iter().take(on_side + 1).collect())
        };
        let mut rows = side(-across, -1.0)?;
        rows.reverse();
        let other = side(across, 1.0)?;
        rows.extend(other.into_iter().skip(usize::from(even)));
        let mut clipped: Vec<Line> = Vec::new();
        for (row, lines) in rows.iter().enumerate() {
            let pieces = lines.iter().flat_map(|line| self.clipped(line));
            let long = pieces.filter(|p| length(p) > 0.5 * self.stepover);
            clipped.extend(long.map(|points| Line { row, points }));
        }
        let free = |a: DVec3, b: DVec3| (self.depth)(a.midpoint(b)) > -0.5 * self.stepover;
        Ok(chained(clipped, 1.6 * spacing, free))
    }

    /// The line at which `u` is `from`, and those beyond it, `spacing` mm apart on the surface.
    fn side(&self, u: DVec3, from: f64, spacing: f64, chord_error: f64) -> Result<Side, OntoError> {
        let field = |p: DVec3| p.dot(u) - from;
        let base = self.sheet.level_lines(field);
        let mut lines = vec![base.iter().map(positions).collect()];
        match self.sheet.fronts(field, spacing, chord_error) {
            Ok(fronts) => lines.extend(fronts.fronts.iter().map(|f| {
                let line = f.lines.iter();
                line.map(|l| l.points.iter().map(|p| p.position).collect())
                    .collect()
            })),
            // nothing lies on that side
            Err(SheetError::NoBase { .. } | SheetError::Behind { .. }) => {}
            Err(e) => return Err(e.into()),
        }
        Ok(Side { lines })
    }

    /// How far what is filled reaches beyond the first line of a side, mm over the surface.
    fn extent(&self, side: &Side, u: DVec3, from: f64, inner: &[DVec3]) -> f64 {
        let all = side.lines.iter().enumerate();
        let rows: Vec<(usize, &Vec<DVec3>)> = all
            .flat_map(|(row, lines)| lines.iter().map(move |l| (row, l)))
            .collect();
        let near = Segments::new(rows.iter().map(|r| r.1.as_slice()), self.stepover);
        let far = |p: &DVec3| {
            let n = near.nearest(*p, 3.0 * self.stepover)?;
            let row = rows.get(n.line as usize)?.0 as f64;
            let beyond = (*p - n.point).dot(u).signum() * n.distance;
            (p.dot(u) > from).then_some(row * self.stepover + beyond)
        };
        inner.iter().filter_map(far).fold(0.0, f64::max)
    }

    /// The pieces of a line that lie in what is filled.
    fn clipped(&self, line: &[DVec3]) -> Vec<Vec<DVec3>> {
        let mut pieces = Vec::new();
        let mut piece: Vec<DVec3> = Vec::new();
        let inside = |p: DVec3| (self.depth)(p) >= 0.0;
        let border = |mut a: DVec3, mut b: DVec3| {
            for _ in 0..40 {
                let m = a.midpoint(b);
                if inside(m) { a = m } else { b = m }
            }
            a
        };
        let mut close = |piece: &mut Vec<DVec3>| {
            if piece.len() > 1 {
                pieces.push(std::mem::take(piece));
            }
            piece.clear();
        };
        piece.extend(line.first().copied().filter(|p| inside(*p)));
        for pair in line.windows(2) {
            let steps = (pair[0].distance(pair[1]) / (STEPS * self.stepover))
                .ceil()
                .max(1.0);
            let mut before = pair[0];
            for i in 1..=steps as u32 {
                let p = pair[0].lerp(pair[1], f64::from(i) / steps);
                match (inside(before), inside(p)) {
                    (true, false) => {
                        piece.push(border(before, p));
                        close(&mut piece);
                    }
                    (false, true) => piece.push(border(p, before)),
                    _ => {}
                }
                before = p;
            }
            if inside(before) && piece.last() != Some(&before) {
                piece.push(before);
            }
        }
        close(&mut piece);
        pieces
    }
}

/// The direction across lines that run at an angle about the mean normal from the direction of x; `None` of a surface that closes.
fn across(mesh: &Mesh, angle: f64) -> Option<DVec3> {
    let area = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        (b - a).cross(c - a)
    };
    let sum: DVec3 = (0..mesh.triangles.len()).map(area).sum();
    let normal = (sum.length() > 1e-3 * 2.0 * mesh.area()).then(|| sum.normalize())?;
    // on a face that shows along x, from the direction of y
    let reference = if normal.x.abs() < 0.99 {
        DVec3::X
    } else {
        DVec3::Y
    };
    let along = reference.reject_from(normal).normalize();
    Some(normal.cross(DQuat::from_axis_angle(normal, angle) * along))
}
