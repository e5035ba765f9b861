//! Why a figure of the judge decides nothing, and what ends that.

use meltpath_base::{Check, Status};
use meltpath_melt_strategy::judgement::Variant;

use crate::ebm::judge::JudgedPath;
use crate::job::ebm::ChecksTable;

/// Why a figure decides nothing, and what ends that.
pub(super) struct Doubt {
    pub(super) reason: String,
    pub(super) remedy: String,
}

impl Doubt {
    /// A check that this leaves undecided, where it does not fail.
    pub(super) fn on(&self, check: Check) -> Check {
        if check.status == Status::Fail {
            return check.because(&self.reason);
        }
        let told = check.remedy.clone().filter(|told| !told.is_empty());
        let remedy = match told {
            Some(told) if told.contains(&self.remedy) => told,
            Some(told) => format!("{told}; {}", self.remedy),
            None => self.remedy.clone(),
        };
        Check {
            status: check.status.max(Status::CannotSay),
            ..check
        }
        .because(&self.reason)
        .remedy(remedy)
    }
}

/// The first run besides the one as set in whose cells nothing of the section lies.
pub(super) fn empty(path: &JudgedPath) -> Option<Variant> {
    let runs = path.runs.iter();
    let mut empty = runs.filter(|run| run.tally.voxels == 0);
    empty.next().map(|run| run.variant)
}

/// The run in which something of the section melts, where nothing does as set.
pub(super) fn melts_otherwise(path: &JudgedPath) -> Option<Variant> {
    let (set, others) = path.runs.split_first()?;
    if set.tally.molten() > 0 {
        return None;
    }
    let melts = others.iter().filter(|run| run.tally.molten() > 0);
    melts.map(|run| run.variant).min_by_key(|v| v.is_of_power())
}

/// Where cells are too coarse for distances of the rim.
pub(super) fn coarse(path: &JudgedPath, limits: &ChecksTable) -> Option<Doubt> {
    let (cell, rim) = (path.runs[0].resolution.cell, limits.rim.0);
    // without a rim, against what may melt farthest
    let least = if rim > 0.0 { rim } else { limits.farthest.0 };
    (least > 0.0 && cell > least * (1.0 + 1e-9)).then(|| Doubt {
        reason: format!(
            "cells of {:.0} µm are larger than the {:.0} µm from the contour that they would have to show",
            1e3 * cell,
            1e3 * least
        ),
        remedy: "finer cells (judge.cell)".to_owned(),
    })
}
