//! The process map that measured beads make.

use std::fmt::Write;

use meltpath_base::{Check, Status};
use toml::Value;

use super::file::{Scan, Setting};
use super::found::Measured;

/// Least beads of a map: one more than the simplest law has numbers.
const BEADS: usize = 4;
/// mm/s of a m/min.
const M_PER_MIN: f64 = 1000.0 / 60.0;

/// Why beads make no map.
#[derive(Debug, Clone, PartialEq)]
pub struct NoMap {
    /// In words.
    pub(super) told: String,
    /// What to do.
    pub(super) remedy: &'static str,
}

/// The file of a process map with the beads of a scan.
///
/// # Errors
/// [`NoMap`].
pub(super) fn of(scan: &Scan, beads: &[Measured], checks: &[Check]) -> Result<String, NoMap> {
    let no = |told: String, remedy| Err(NoMap { told, remedy });
    let (Some(wire), Some([gas, mode])) = (&scan.wire, &scan.process) else {
        let remedy = "write wire, gas and mode for one";
        return no(
            "the file does not tell wire, gas and mode".to_owned(),
            remedy,
        );
    };
    let all: Option<Vec<(&Measured, Setting)>> =
        beads.iter().map(|b| Some((b, b.setting?))).collect();
    let Some(all) = all else {
        let remedy = "write a [[bead]] with wire_feed and travel_speed for each";
        return no("the settings of the beads are not told".to_owned(), remedy);
    };
    if all.len() < BEADS {
        let told = format!("{} beads show nothing of a law's errors", all.len());
        return no(told, "nine beads are a good beginning, four the least");
    }
    let kept: Vec<f64> = beads.iter().filter_map(|b| Some(b.kept(0.0)?[0])).collect();
    let mean = kept.iter().sum::<f64>() / kept.len() as f64;
    let squares: f64 = kept.iter().map(|k| (k - mean).powi(2)).sum();
    let sigma = (squares / (kept.len() as f64 - 1.0)).sqrt();
    let measured: Option<Vec<f64>> = all.iter().map(|(_, s)| s.measured_feed).collect();
    let bad = |c: &&Check| matches!(c.status, Status::Fail | Status::CannotSay);
    if let Some(failed) = checks.iter().find(bad) {
        let told = match failed.status {
            Status::Fail => format!("a check of the beads fails ({})", failed.id),
            _ => format!("the scan does not show enough ({})", failed.id),
        };
        return no(told, "mend what it tells first");
    }
    let word = |text: &str| Value::String(text.to_owned()).to_string();
    let source = format!("source = {}, page = \"scan\"", word(&scan.name));
    let range = |of: &dyn Fn(&Setting) -> f64| {
        let values = all.iter().map(|(_, s)| of(s) / M_PER_MIN);
        let [low, high] = values.fold([f64::INFINITY, 0.0], |[low, high], v| {
            [f64::min(low, v), f64::max(high, v)]
        });
        format!("[\"{low:.4} m/min\", \"{high:.4} m/min\"]")
    };
    let mut text = format!(
        "# Written by `meltpath measure` from {} beads. Name it in a job: [waam] map = \"map.toml\".\nschema = 1\nid = {}\nwire = {}\ngas = {}\nmode = {}\nkind = \"best\"\n",
        all.len(),
        word(&format!("{}-{mode}-{gas}-measured", *wire.id)),
        word(&wire.id),
        word(gas),
        word(mode),
    );
    // writing into a string does not fail
    let figure = |value: f64, note: &str| {
        format!(
            "{{ value = {value:.4}, unit = \"1\", uncertainty = {sigma:.4}, {source}, note = \"{note}\" }}"
        )
    };
    let _ = if measured.is_some() {
        let note = "area of the sections over the wire that was measured";
        writeln!(text, "efficiency = {}", figure(mean.min(1.0), note))
    } else {
        let note = "area of the sections over the wire that was set: what is lost is in it";
        writeln!(
            text,
            "efficiency = {{ value = 1.0, unit = \"1\", {source}, note = \"assumed: the feed was not measured\" }}\nfeed_factor = {}\nassumed = [\"all that is fed stays in the bead: the wire feed was not measured\"]",
            figure(mean, note)
        )
    };
    let _ = write!(
        text,
        "\n[validity]\nwire_feed = {}\ntravel_speed = {}\nsource = {}\npage = \"scan\"\n\n[beads]\nsource = {}\npage = \"scan\"\n",
        range(&|s| s.wire_feed),
        range(&|s| s.travel_speed),
        word(&scan.name),
        word(&scan.name),
    );
    if let Some(measured) = measured {
        let told: Vec<String> = measured
            .iter()
            .map(|v| format!("{:.4}", v / M_PER_MIN))
            .collect();
        let _ = writeln!(text, "measured_feed = [{}]", told.join(", "));
    }
    text += "rows = [\n  # wire feed that was set, travel speed (m/min), width, height (mm)\n";
    for (bead, setting) in all {
        let [feed, travel] = [setting.wire_feed, setting.travel_speed].map(|v| v / M_PER_MIN);
        let _ = writeln!(
            text,
            "  [{feed:.4}, {travel:.4}, {:.3}, {:.3}],",
            bead.width[0], bead.height[0]
        );
    }
    text += "]\n";
    Ok(text)
}
