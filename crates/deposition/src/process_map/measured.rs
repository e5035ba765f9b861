//! From measured beads to a law: every form is tried, beads are left out, and the form that errs least on them is taken.

use std::ops::Range;

use meltpath_base::Reporter;
use meltpath_base::settings::{Problem, Problems};

use super::file::{MapFile, MapKind, Size};
use super::grid::GridPart;
use super::import::{MeasuredBead, Oddity, bead_of_wall, excess, oddities};
use super::kriging::{Fit, Form, Sample};
use super::region::Region;
use super::{Fitted, Grid, Law, M_PER_MIN, Tried};
use crate::consumable::Wire;

/// Travel speeds at which a wall's law is read as beads.
const SPEEDS: u32 = 5;

/// Beads of a map at most: laws through them take the cube of their number.
const MOST: usize = 400;

/// The beads of a map's file, each with the measurement it belongs to.
pub(super) struct Measured {
    beads: Vec<MeasuredBead>,
    groups: Vec<usize>,
    grid: Option<Result<Grid, (GridPart, String)>>,
    /// η·S_f, mm².
    per_ratio: f64,
    /// Those of walls: their metal balances, as their widths are made of it.
    walls: Range<usize>,
}

impl Measured {
    /// What a file measured, where `factor` times the programmed wire is fed.
    pub(super) fn of(map: &MapFile, factor: f64, wire: &Wire) -> Self {
        let per_ratio = map.efficiency.0 * wire.section();
        let mut measured = Measured {
            beads: Vec::new(),
            groups: Vec::new(),
            grid: grid(map),
            per_ratio,
            walls: 0..0,
        };
        if let Some(table) = &*map.beads {
            for (n, row) in table.rows.iter().enumerate() {
                let feeds = table.measured_feed.as_ref();
                measured.beads.push(MeasuredBead {
                    wire_feed: row[0],
                    fed: feeds.map_or(factor * row[0], |feeds| feeds[n]),
                    travel_speed: row[1],
                    width: row[2],
                    height: row[3],
                });
            }
            measured.groups.extend(0..table.rows.len());
        }
        let first = measured.beads.len();
        let range = map.validity.travel_speed.map(|v| v.0);
        for (n, row) in map.walls.iter().flat_map(|w| w.rows.iter()).enumerate() {
            for k in 0..SPEEDS {
                let share = f64::from(k) / f64::from(SPEEDS - 1);
                let speed = range[0] * (range[1] / range[0]).powf(share);
                let (wire_feed, travel_speed) = (row[0], speed / M_PER_MIN);
                let layer = (row[1] * speed.ln() + row[2]).exp();
                let area = per_ratio * factor * wire_feed / travel_speed;
                let (width, height) = bead_of_wall(layer, area);
                measured.beads.push(MeasuredBead {
                    wire_feed,
                    fed: factor * wire_feed,
                    travel_speed,
                    width,
                    height,
                });
                measured.groups.push(first + n);
            }
        }
        measured.walls = first..measured.beads.len();
        if let Some(Ok(grid)) = &measured.grid {
            let nodes = grid.beads(factor);
            let first = measured.groups.last().map_or(0, |g| g + 1);
            measured.groups.extend(first..first + nodes.len());
            measured.beads.extend(nodes);
        }
        measured
    }

    /// Refuses what is odd about the beads, unless the file accepts it: then it is a warning. `area` is the relative standard uncertainty of the
    /// metal that is fed.
    ///
    /// # Errors
    /// The grid that is none, and what is odd.
    pub(super) fn check(
        &self,
        file: &str,
        map: &MapFile,
        (wire, area): (&Wire, f64),
        reporter: &Reporter,
    ) -> Result<(), Problems> {
        if let (Some(Err((part, told))), Some(table)) = (&self.grid, &*map.grid) {
            let problem = match part {
                GridPart::WireFeed => table.wire_feed.problem(told),
                GridPart::TravelSpeed => table.travel_speed.problem(told),
                GridPart::Width => table.width.problem(told),
                GridPart::Height => table.height.problem(told),
            };
            return Err(problem.into());
        }
        let odd = oddities(&self.beads, self.per_ratio).into_iter();
        let mut odd: Vec<(Oddity, String, String)> = odd
            .map(|(oddity, message)| (oddity, message, "mend the rows".to_owned()))
            .collect();
        odd.extend(self.excess(map, (wire, area)));
        let mut problems = Vec::new();
        for (oddity, message, mend) in odd {
            if map.accept.contains(&oddity) {
                let code = match oddity {
                    Oddity::MassBalance => "beads-mass-balance",
                    Oddity::TallerThanWide => "beads-taller-than-wide",
                    Oddity::MoreThanFed => "beads-more-than-fed",
                };
                reporter.warn(code, format!("{file}: {message}"), "look at these rows");
                continue;
            }
            let problem = if map.beads.is_some() {
                map.beads.problem(message)
            } else if map.walls.is_some() {
                map.walls.problem(message)
            } else {
                map.grid.problem(message)
            };
            let word = oddity.word();
            problems.push(problem.help(format!(
                "{mend}; or, where they are meant so, write accept = [\"{word}\"]"
            )));
        }
        if problems.is_empty() {
            Ok(())
        } else {
            Err(problems.into())
        }
    }

    /// What the beads hold together beyond what was fed, and what may be wrong.
    fn excess(
        &self,
        map: &MapFile,
        (wire, area): (&Wire, f64),
    ) -> Option<(Oddity, String, String)> {
        let of_walls = |n: &usize| self.walls.contains(n);
        let weighed = (0..self.beads.len()).filter(|n| !of_walls(n));
        let weighed: Vec<MeasuredBead> = weighed.map(|n| self.beads[n]).collect();
        let stays = map.efficiency.uncertainty.unwrap_or(0.0) / map.efficiency.0;
        let found = excess(&weighed, self.per_ratio, area.hypot(stays))?;
        let feeds = map
            .beads
            .as_ref()
            .is_some_and(|b| b.measured_feed.is_some());
        let mend = found.remedy(wire.diameter.0, feeds);
        Some((Oddity::MoreThanFed, found.told(weighed.len()), mend))
    }

    /// The laws of one form through the beads.
    fn fitted(&self, form: Form) -> Option<Fitted> {
        if self.beads.len() > MOST {
            return None;
        }
        let samples = |size: fn(&MeasuredBead) -> f64| -> Vec<Sample> {
            let beads = self.beads.iter().zip(&self.groups);
            beads
                .map(|(b, group)| Sample::of(b, *group, size(b)))
                .collect()
        };
        Some(Fitted {
            width: Fit::new(form, &samples(|b| b.width))?,
            height: Fit::new(form, &samples(|b| b.height))?,
        })
    }

    /// Where the beads lie.
    pub(super) fn region(&self) -> Option<Region> {
        Region::of(&self.beads)
    }

    /// How many measurements there are: rows, walls or nodes.
    fn count(&self) -> usize {
        let mut groups = self.groups.clone();
        groups.dedup();
        groups.len()
    }
}

/// The grid of a file.
fn grid(map: &MapFile) -> Option<Result<Grid, (GridPart, String)>> {
    let g = map.grid.as_ref()?;
    let (feeds, travels) = (g.wire_feed.value.clone(), g.travel_speed.value.clone());
    let uneven = [(&g.width, GridPart::Width), (&g.height, GridPart::Height)]
        .into_iter()
        .find(|(rows, _)| rows.iter().any(|row| row.len() != travels.len()));
    if let Some((_, part)) = uneven {
        let told = "a row for each wire feed has a size for each travel speed".to_owned();
        return Some(Err((part, told)));
    }
    let sizes = |rows: &[Vec<Size>]| rows.iter().flatten().map(|s| s.0).collect();
    Some(Grid::new(feeds, travels, sizes(&g.width), sizes(&g.height)))
}

/// The law of a map, and what leaving beads out says of each form that was tried, the one taken first.
///
/// # Errors
/// Too few beads for any form that the kind allows.
pub(super) fn law(map: &MapFile, measured: &Measured) -> Result<(Law, Vec<Tried>), Problems> {
    if let Some(w) = &*map.width
        && *map.kind == MapKind::PowerLaw
    {
        let law = Law::PowerLaw {
            coefficient: w.coefficient.0,
            feed_exponent: w.feed_exponent.0,
            travel_exponent: w.travel_exponent.0,
        };
        return Ok((law, Vec::new()));
    }
    let forms: &[Form] = match *map.kind {
        MapKind::PowerLaw => &[Form::PowerLaw],
        MapKind::Surface => &[Form::Quadratic],
        MapKind::GaussianProcess => &[Form::GaussianProcess],
        MapKind::Grid => &[],
        MapKind::Best => &Form::ALL,
    };
    let mut laws: Vec<(Law, Tried)> = Vec::new();
    for form in forms {
        if let Some(fitted) = measured.fitted(*form) {
            let tried = Tried {
                form: form.words(),
                left_out: [fitted.width.left_out, fitted.height.left_out],
            };
            laws.push((Law::Fitted(Box::new(fitted)), tried));
        }
    }
    if let (MapKind::Grid | MapKind::Best, Some(Ok(grid))) = (*map.kind, &measured.grid) {
        match grid.left_out() {
            Some(left_out) => laws.push((
                Law::Grid(grid.clone()),
                Tried {
                    form: "grid",
                    left_out,
                },
            )),
            None if *map.kind == MapKind::Grid && map.relative_sigma.is_some() => {
                return Ok((Law::Grid(grid.clone()), Vec::new()));
            }
            None => {}
        }
    }
    laws.sort_by(|a, b| {
        let error = |t: &Tried| t.left_out[0].hypot(t.left_out[1]);
        error(&a.1).total_cmp(&error(&b.1))
    });
    let tried: Vec<Tried> = laws.iter().map(|(_, tried)| *tried).collect();
    match laws.into_iter().next() {
        Some((law, _)) => Ok((law, tried)),
        None => Err(too_few(map, measured, forms).into()),
    }
}

/// Why no law could be laid through the beads.
fn too_few(map: &MapFile, measured: &Measured, forms: &[Form]) -> Problem {
    let count = measured.count();
    let Some(least) = forms.iter().map(|f| f.coefficients()).min() else {
        let problem = map
            .grid
            .problem("a grid of two by two nodes does not show how well it predicts");
        return problem
            .help("add a table [relative_sigma], or measure three speeds or more along an axis");
    };
    let message = if measured.beads.len() > MOST {
        format!(
            "{} beads are more than the {MOST} of which a law is made",
            measured.beads.len()
        )
    } else if count <= least {
        format!(
            "{count} measurements for the {least} numbers of a law: there must be more, or nothing tells how well it predicts"
        )
    } else {
        "the settings of the beads do not span the law: vary wire feed and travel speed, each three times or more".to_owned()
    };
    let fewer = match *map.kind {
        MapKind::Surface | MapKind::GaussianProcess => "; kind = \"power-law\" needs four",
        _ => "",
    };
    let help = if measured.beads.len() > MOST {
        "write the means of repeated beads".to_owned()
    } else {
        format!("measure more beads{fewer}")
    };
    if map.beads.is_some() {
        map.beads.problem(message).help(help)
    } else if map.walls.is_some() {
        map.walls.problem(message).help(help)
    } else {
        map.grid.problem(message).help(help)
    }
}
