//! What mends a plan that is expected to fail: other settings, tried on the same part, each planned, driven and judged as the job's own.
//! The plan takes them itself where the job leaves their keys out; else `doctor` tells them.

use std::path::Path;

use meltpath_base::settings::{Json, Setting, Value};
use meltpath_base::{
    Check, Fact, Length, Observer, Origin, Provenance, Quiet, Ratio, Reporter, Resolved,
};
use rayon::prelude::*;

use crate::job::waam::{FillOrder, FillStrategy, Spacing};
use crate::job::{WaamJob, Written};
use crate::stages::part::Part;
use crate::waam::error::WaamError;
use crate::waam::judge::doubt;
use crate::waam::loaded::Loaded;
use crate::waam::plan::foretell::{self, Built, build};
use crate::waam::plan::planned::{Planned, planned};
use crate::waam::settings::{Settings, resolve};

/// Settings that may be chosen; `None` leaves one as it is.
#[derive(Debug, Clone, Copy, Default)]
struct Change {
    strategy: Option<FillStrategy>,
    order: Option<FillOrder>,
    spacing: Option<Spacing>,
    /// Over the stepover.
    reversal: Option<f64>,
    smoothing: Option<f64>,
    /// At least so much beside the part, mm.
    allowance: Option<f64>,
}

const KEEP: Change = Change {
    strategy: None,
    order: None,
    spacing: None,
    reversal: None,
    smoothing: None,
    allowance: None,
};
const ZIGZAG: Change = Change {
    strategy: Some(FillStrategy::Zigzag),
    ..FARTHER_TURNS
};
const RASTER: Change = strategy(FillStrategy::Raster);
const EXACT: Change = Change {
    spacing: Some(Spacing::Exact),
    ..KEEP
};
/// A pile at a turn is often one place: turns a little farther or nearer leave it.
const LITTLE_FARTHER_TURNS: Change = reversal(0.4);
const FARTHER_TURNS: Change = reversal(0.5);
const NEARER_TURNS: Change = reversal(0.2);
const SHARPER: Change = smoothing(0.25);
const SHARPEST: Change = smoothing(0.0);
const MORE: Change = Change {
    allowance: Some(3.0),
    ..KEEP
};
/// Beads whose distance is kept leave up to one of them out at a flank.
const EXACT_AND_MORE: Change = Change {
    spacing: Some(Spacing::Exact),
    allowance: Some(3.0),
    ..FARTHER_TURNS
};

/// What `doctor` tries, the gentlest first: other ways to fill, then corners that are cut less, which takes longer, then more metal.
const ALL: [Change; 13] = [
    Change {
        order: Some(FillOrder::OutsideIn),
        ..KEEP
    },
    ZIGZAG,
    strategy(FillStrategy::Hybrid),
    strategy(FillStrategy::Contour),
    RASTER,
    EXACT,
    LITTLE_FARTHER_TURNS,
    FARTHER_TURNS,
    NEARER_TURNS,
    SHARPER,
    SHARPEST,
    MORE,
    EXACT_AND_MORE,
];
/// What a plan tries by itself, two at a time: where most beads have neighbours, how they are laid beside one another; where most stand alone,
/// how corners are cut.
const OF_FILLED: [Change; 8] = [
    ZIGZAG,
    EXACT,
    LITTLE_FARTHER_TURNS,
    FARTHER_TURNS,
    NEARER_TURNS,
    EXACT_AND_MORE,
    RASTER,
    MORE,
];
const OF_WALLS: [Change; 2] = [SHARPER, MORE];

/// More checks than these are many.
const MANY: usize = 2;

const fn reversal(reversal: f64) -> Change {
    Change {
        reversal: Some(reversal),
        ..KEEP
    }
}

const fn smoothing(smoothing: f64) -> Change {
    Change {
        smoothing: Some(smoothing),
        ..KEEP
    }
}

const fn strategy(strategy: FillStrategy) -> Change {
    Change {
        strategy: Some(strategy),
        ..KEEP
    }
}

/// Writes settings into a job as if it said them.
struct Writer<'a> {
    provenance: &'a mut Provenance,
    why: &'a str,
    /// What was written, as a job writes it.
    words: Vec<String>,
    /// Whether the job says none of it.
    open: bool,
}

impl Writer<'_> {
    fn put<T>(&mut self, key: &mut Setting<T>, value: T, told: Json) {
        self.open &= !key.is_written();
        self.words.push(format!("{} = {told}", key.name));
        let told = Resolved::new(told, Origin::Computed(self.why.to_owned()));
        self.provenance.parameter(&key.name, &told);
        key.value = value;
    }

    fn put_plain<T: Value>(&mut self, key: &mut Setting<T>, value: Option<T>) {
        if let Some(value) = value {
            let told = value.json();
            self.put(key, value, told);
        }
    }
}

impl Change {
    /// The job with the change in it, `why` as its reason; how a job writes it, and whether the job leaves all of its keys out.
    fn of(self, job: &Written<WaamJob>, why: &str) -> (Written<WaamJob>, String, bool) {
        let mut other = job.clone();
        let Written { tables, provenance } = &mut other;
        let mut writer = Writer {
            provenance,
            why,
            words: Vec::new(),
            open: true,
        };
        let fill = &mut tables.fill.value;
        writer.put_plain(&mut fill.strategy, self.strategy);
        if let Some(order) = self.order {
            writer.put(&mut fill.order, Some(order), order.json());
        }
        writer.put_plain(&mut fill.spacing, self.spacing);
        if let Some(reversal) = self.reversal.map(Ratio) {
            writer.put(&mut fill.reversal, Some(reversal), reversal.json());
        }
        let smoothing = self.smoothing.map(Ratio);
        writer.put_plain(&mut tables.machine.value.smoothing, smoothing);
        let allowance = &mut tables.target.value.allowance;
        let more = self.allowance.map(|a| Length(a.max(allowance.0)));
        writer.put_plain(allowance, more);
        let (words, open) = (writer.words.join(" and "), writer.open);
        (other, words, open)
    }
}

/// A plan with what it builds.
pub(in crate::waam) struct Foretold {
    pub(in crate::waam) planned: Planned,
    pub(in crate::waam) built: Built,
    /// The checks that it fails or leaves undecided.
    pub(in crate::waam) checks: Vec<Check>,
    /// What was chosen of what the job leaves out, and why.
    pub(in crate::waam) chosen: Option<Fact>,
}

impl Foretold {
    /// What was chosen, in a line.
    pub(in crate::waam) fn choice(&self) -> Option<String> {
        let fact = self.chosen.as_ref()?;
        Some(format!("{}: {}", fact.title, fact.reason))
    }

    /// What was chosen, and a line for each check that is expected to fail or to be undecided.
    pub(in crate::waam) fn lines(&self) -> Vec<String> {
        let checks = foretell::lines(&self.checks);
        self.choice().into_iter().chain(checks).collect()
    }
}

/// Whether a job leaves a key out that a plan may choose.
pub(in crate::waam) fn leaves_open(job: &Written<WaamJob>) -> bool {
    let mut all = OF_FILLED.iter().chain(&OF_WALLS);
    all.any(|change| change.of(job, "").2)
}

/// Plans `part`. Where the plan is expected to fail, and another setting that the job leaves out leaves nothing to fail, that one is
/// taken: `loaded` has it then.
///
/// # Errors
/// [`WaamError`] for whatever keeps the job from being planned, or when cancelled.
pub(in crate::waam) fn settle(
    loaded: &mut Loaded,
    part: &Part,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Foretold, WaamError> {
    let settings = &loaded.settings;
    let own = Reporter::new();
    let plain = planned(&loaded.name, part, settings, &own, observer)?;
    let built = build(part, &plain, settings, (&own, observer))?;
    let checks = built.undecided();
    // no way to fill holds a wall that leans, nor says how a controller goes round corners or how wide a woven bead is
    let doubted = plain.plan.lean.is_some()
        || settings.weave.is_some()
        || doubt::of_corners(settings.judged(), settings).is_some();
    let mended = if checks.is_empty() || doubted || !checks.iter().all(may_be_mended) {
        None
    } else {
        choose(loaded, part, (&plain, &checks), observer)?
    };
    let Some(other) = mended else {
        reporter.absorb(own);
        return Ok(Foretold {
            planned: plain,
            built,
            checks,
            chosen: None,
        });
    };
    reporter.absorb(other.reporter);
    loaded.settings = other.settings;
    let chosen = Fact::words(
        "chosen",
        "chosen by the plan, as the job leaves it open",
        &format!("{}: {}", other.words, reason(&checks)),
    );
    Ok(Foretold {
        planned: other.planned,
        built: other.built,
        checks: other.left,
        chosen: Some(chosen),
    })
}

/// Whether beads laid otherwise may mend a check: it has a figure, and one of the metal.
fn may_be_mended(check: &Check) -> bool {
    check.value.is_some()
        && !matches!(
            check.id.as_str(),
            "range" | "plate" | "standing" | "overhang"
        )
}

fn reason(checks: &[Check]) -> String {
    let ids: Vec<&str> = checks.iter().map(|c| c.id.as_str()).collect();
    format!("with the default {} was expected to fail", ids.join(", "))
}

/// The first of the settings left out with which nothing is expected to fail.
fn choose(
    loaded: &Loaded,
    part: &Part,
    (plain, checks): (&Planned, &[Check]),
    observer: &dyn Observer,
) -> Result<Option<Tried>, WaamError> {
    let candidates = if plain.plan.single > 0.5 {
        &OF_WALLS[..]
    } else {
        &OF_FILLED
    };
    observer.stage("choose settings", candidates.len() as u64);
    let why = format!("chosen by the plan: {}", reason(checks));
    // two at a time, however many threads there are; of a plan that fails in many ways one setting seldom mends all
    let pairs = if checks.len() > MANY { 1 } else { 4 };
    for pair in candidates.chunks(2).take(pairs) {
        let tried: Vec<Tried> = pair
            .par_iter()
            .filter_map(|change| {
                let (job, words, open) = change.of(&loaded.job, &why);
                open.then(|| attempt(loaded, part, (&job, words), observer))?
            })
            .collect();
        observer.check()?;
        if let Some(first) = tried.into_iter().find(|t| t.left.is_empty()) {
            return Ok(Some(first));
        }
    }
    Ok(None)
}

/// Other settings with their plan, and what it is expected to fail.
struct Tried {
    words: String,
    settings: Settings,
    planned: Planned,
    built: Built,
    left: Vec<Check>,
    reporter: Reporter,
}

/// A plan with other settings; `None` where nothing changes, or where nothing can be planned with them: that mends nothing.
fn attempt(
    loaded: &Loaded,
    part: &Part,
    (job, words): (&Written<WaamJob>, String),
    observer: &dyn Observer,
) -> Option<Tried> {
    let quiet = Quiet(observer);
    let changed = job.tables != loaded.job.tables && observer.check().is_ok();
    let tried = changed.then(|| {
        let settings = resolved(loaded, job)?;
        let reporter = Reporter::new();
        let planned = planned(&loaded.name, part, &settings, &reporter, &quiet).ok()?;
        let built = build(part, &planned, &settings, (&reporter, &quiet)).ok()?;
        Some(Tried {
            words,
            settings,
            planned,
            left: built.undecided(),
            built,
            reporter,
        })
    });
    observer.advance(1);
    tried?
}

/// The job's settings with a change in it; `None` where it makes no sense.
fn resolved(loaded: &Loaded, job: &Written<WaamJob>) -> Option<Settings> {
    let folder = loaded.path.parent().unwrap_or(Path::new(""));
    // what is to be told of the job was told when it was read
    resolve(job, folder, &Reporter::new()).ok()
}

/// The settings that a plan of the job may have been made with: as the job stands, then what a plan chooses by itself, as a job writes it.
pub(in crate::waam) fn ways(loaded: &Loaded) -> impl Iterator<Item = (Settings, Option<String>)> {
    let plain = std::iter::once((loaded.settings.clone(), None));
    let others = OF_FILLED.iter().chain(&OF_WALLS).filter_map(|change| {
        let (job, words, open) = change.of(&loaded.job, "chosen by the plan of the program");
        let changed = open && job.tables != loaded.job.tables;
        let settings = changed.then(|| resolved(loaded, &job))??;
        Some((settings, Some(words)))
    });
    plain.chain(others)
}

/// Tells which other setting leaves nothing that is expected to fail, else the one that leaves least of what is now, `foretold`.
///
/// # Errors
/// [`WaamError`] when cancelled.
pub(in crate::waam) fn mend(
    loaded: &Loaded,
    part: &Part,
    foretold: &[Check],
    observer: &dyn Observer,
) -> Result<String, WaamError> {
    observer.stage("try other settings", ALL.len() as u64);
    let tried: Vec<(String, Vec<Check>)> = ALL
        .par_iter()
        .filter_map(|change| {
            let (job, words, _) = change.of(&loaded.job, "");
            let tried = attempt(loaded, part, (&job, words), observer)?;
            Some((tried.words, tried.left))
        })
        .collect();
    observer.check()?;
    let best = tried.iter().min_by_key(|(_, left)| left.len());
    Ok(match best {
        Some((words, left)) if left.is_empty() => {
            format!("foretold: with {words} no check is expected to fail")
        }
        Some((words, left)) if left.len() < foretold.len() => {
            let ids: Vec<&str> = left.iter().map(|c| c.id.as_str()).collect();
            format!(
                "foretold: of {} other settings, tried one at a time, {words} leaves least: {}",
                tried.len(),
                ids.join(", ")
            )
        }
        _ => format!(
            "foretold: none of {} other settings, tried one at a time, mends any of it",
            tried.len()
        ),
    })
}
