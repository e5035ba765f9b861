//! What was found in a log.

use std::collections::BTreeSet;
use std::path::PathBuf;

use meltpath_base::Verdict;
use meltpath_robot::identification::fit::Filters;
use meltpath_robot::identification::{Aligned, Comparison, Event, Fitted, Log, Seen};

use super::file::Told;
use super::path::Driven;

/// What was found in a log.
#[derive(Debug)]
pub struct Found {
    /// The file, resolved.
    pub told: Told,
    /// The path.
    pub driven: Driven,
    /// The log, mm and s.
    pub log: Log,
    /// How it lies on the path.
    pub aligned: Aligned,
    /// What was fitted.
    pub fitted: Fitted,
    /// The filters, with what is known of each.
    pub filters: Filters,
    /// Log and model beside each other.
    pub compared: Comparison,
    /// Commands at whose ends corners were held back.
    pub held: BTreeSet<usize>,
    /// As checks.
    pub verdict: Verdict,
    /// The `[motion]` of the cell, where the model describes the controller.
    pub motion: Option<String>,
    /// The folder of the report.
    pub folder: PathBuf,
}

impl Found {
    /// Whether an event was held back from the fit.
    pub fn unseen(&self, event: &Event) -> bool {
        matches!(event.seen, Seen::Corner { .. }) && self.held.contains(&event.command)
    }

    /// Its corners alone.
    pub fn corners(&self) -> impl Iterator<Item = &Event> {
        let all = self.compared.events.iter();
        all.filter(|e| matches!(e.seen, Seen::Corner { .. }))
    }

    /// The slowest and the fastest programmed speed at its corners, mm/s.
    pub fn speeds(&self) -> [f64; 2] {
        self.corners().fold([f64::INFINITY, 0.0], |[low, high], e| {
            [e.speed.min(low), e.speed.max(high)]
        })
    }

    /// What is left over the noise of the log.
    pub fn over_noise(&self) -> f64 {
        self.fitted.rms / self.compared.noise.max(1e-9)
    }

    /// Smoothing of a corner in words: per cent, and the distance where the path tells distances.
    pub fn smoothing(&self, smoothing: usize) -> String {
        let share = self.driven.path.smoothings.get(smoothing).copied();
        let share = share.unwrap_or(f64::NAN);
        match self.driven.blend {
            Some(blend) => format!("{:.0} % ({:.2} mm)", 100.0 * share, share * blend),
            None => format!("{:.0} %", 100.0 * share),
        }
    }

    /// Where an event stands in the program.
    pub fn line(&self, event: &Event) -> (String, u32) {
        let line = self.driven.lines.get(event.command).cloned();
        line.unwrap_or_default()
    }
}
