//! Job files: short, strict TOML in which everything not written has a stated default.
//!
//! `process.kind` selects the schema; tables that every process shares are in this file, those of one process in
//! their own. Unknown keys and bare numbers where a unit is needed are errors with their place in the file.

pub mod ebm;
pub mod lpbf;
pub mod waam;

use std::ops::Range;
use std::path::{Path, PathBuf};

use meltpath_base::quantity::{Auto, NotNegative, Positive};
use meltpath_base::{Length, Time};
use serde::{Deserialize, Serialize};

pub use ebm::EbmJob;
pub use lpbf::LpbfJob;
pub use waam::WaamJob;

/// The largest job file that is read.
const MAX_JOB_BYTES: u64 = 1 << 20;

/// A job of any process.
#[derive(Debug, Clone, PartialEq)]
pub enum Job {
    /// Wire-arc deposition by robot.
    Waam(Box<WaamJob>),
    /// Powder bed by electron beam.
    Ebm(Box<EbmJob>),
    /// Laser powder bed: the scan head.
    Lpbf(Box<LpbfJob>),
}

/// Why a job file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The file cannot be read.
    #[error("cannot read the job file {}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Something written in the file is wrong.
    #[error("{message}")]
    Text {
        /// The file.
        path: PathBuf,
        /// The whole text of the file, to show the place in.
        text: String,
        /// The byte range concerned, where known.
        span: Option<Range<usize>>,
        /// What is wrong.
        message: String,
        /// What to write instead, where known.
        help: Option<String>,
    },
}

/// A finding inside the job's text, before the file's name is joined to it.
#[derive(Debug, Clone, PartialEq)]
pub struct TextError {
    /// The byte range concerned, where known.
    pub span: Option<Range<usize>>,
    /// What is wrong.
    pub message: String,
    /// What to write instead, where known.
    pub help: Option<String>,
}

/// `[process]`: which process the job is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessTable {
    /// The process; selects the schema of the rest of the file.
    pub kind: ProcessKind,
}

/// The processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProcessKind {
    /// Wire and arc by robot.
    Waam,
    /// Powder bed by electron beam.
    Ebm,
    /// Laser powder bed: the scan head.
    Lpbf,
}

/// The unit of part files that carry none (STL).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum PartUnit {
    /// Millimetres.
    #[default]
    #[serde(rename = "mm")]
    Millimetre,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetre,
    /// Metres.
    #[serde(rename = "m")]
    Metre,
    /// Inches.
    #[serde(rename = "in")]
    Inch,
}

impl PartUnit {
    /// Millimetres per unit.
    pub fn millimetres(self) -> f64 {
        match self {
            PartUnit::Millimetre => 1.0,
            PartUnit::Centimetre => 10.0,
            PartUnit::Metre => 1000.0,
            PartUnit::Inch => 25.4,
        }
    }
}

/// `[layers]`: how the part is cut.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LayersTable {
    /// Layer height: `"auto"` from the growth model, one height, or a list of heights (the last one repeats).
    pub height: Auto<LayerHeights>,
    /// Build this many layers instead of as many as the part needs.
    pub count: Option<u32>,
    /// Pause after each layer; default none.
    pub pause: Option<NotNegative<Time>>,
}

/// One layer height or a list of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerHeights(
    /// The heights from the first layer on, all above zero; the last one repeats.
    pub Vec<Positive<Length>>,
);

struct HeightsVisitor;

impl<'de> serde::de::Visitor<'de> for HeightsVisitor {
    type Value = LayerHeights;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "\"auto\", a height such as \"1.6 mm\", or a list of heights"
        )
    }
    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<LayerHeights, E> {
        Positive::deserialize(serde::de::value::StrDeserializer::new(text))
            .map(|h| LayerHeights(vec![h]))
    }
    fn visit_f64<E: serde::de::Error>(self, v: f64) -> Result<LayerHeights, E> {
        Positive::deserialize(serde::de::value::F64Deserializer::new(v))
            .map(|h| LayerHeights(vec![h]))
    }
    fn visit_i64<E: serde::de::Error>(self, v: i64) -> Result<LayerHeights, E> {
        Positive::deserialize(serde::de::value::I64Deserializer::new(v))
            .map(|h| LayerHeights(vec![h]))
    }
    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<LayerHeights, A::Error> {
        let mut heights = Vec::new();
        while let Some(h) = seq.next_element()? {
            heights.push(h);
        }
        if heights.is_empty() {
            return Err(serde::de::Error::custom(
                "a list of layer heights needs at least one height",
            ));
        }
        Ok(LayerHeights(heights))
    }
}

impl<'de> Deserialize<'de> for LayerHeights {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_any(HeightsVisitor)
    }
}

/// `[substrate]`: the plate the part is built on.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SubstrateTable {
    /// Length and width of the plate; default the part with 25 mm around it.
    pub size: Option<[Positive<Length>; 2]>,
    /// Thickness of the plate; default 20 mm.
    pub thickness: Option<Positive<Length>>,
}

/// `[target]`: what the build must cover.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TargetTable {
    /// Metal beyond the finished part, for machining; default 2 mm. Lack is judged against the finished part, excess
    /// against part + allowance.
    pub allowance: Option<NotNegative<Length>>,
    /// Metal over faces that look up; default: the allowance. More of it covers a build that grows less than the process
    /// map says.
    pub allowance_top: Option<NotNegative<Length>>,
}

/// Reads a job's text.
///
/// # Errors
/// [`TextError`] with the place and what to write.
///
/// ```
/// let error = meltpath::job::parse("part = \"a.stl\"\n[process]\nkind = \"waam\"\n[waam]\nwire = \"x90-ig-1.0\"\nspeed = 3\n").unwrap_err();
/// assert!(error.message.contains("speed"));
/// assert!(error.span.is_some());
/// ```
pub fn parse(text: &str) -> Result<Job, TextError> {
    #[derive(Deserialize)]
    struct Head {
        process: Option<toml::Spanned<HeadProcess>>,
    }
    #[derive(Deserialize)]
    struct HeadProcess {
        kind: Option<ProcessKind>,
    }
    let head: Head = toml::from_str(text).map_err(|e| text_error(&e))?;
    let missing = |span| TextError {
        span,
        message: "the job does not say which process it is for".to_owned(),
        help: Some("add\n[process]\nkind = \"waam\"".to_owned()),
    };
    let process = head.process.ok_or_else(|| missing(None))?;
    let span = process.span();
    match process
        .into_inner()
        .kind
        .ok_or_else(|| missing(Some(span)))?
    {
        ProcessKind::Waam => {
            let job: WaamJob = toml::from_str(text).map_err(|e| text_error(&e))?;
            job.check()?;
            Ok(Job::Waam(Box::new(job)))
        }
        ProcessKind::Ebm => {
            let job: EbmJob = toml::from_str(text).map_err(|e| text_error(&e))?;
            job.check()?;
            Ok(Job::Ebm(Box::new(job)))
        }
        ProcessKind::Lpbf => {
            let job: LpbfJob = toml::from_str(text).map_err(|e| text_error(&e))?;
            job.check()?;
            Ok(Job::Lpbf(Box::new(job)))
        }
    }
}

/// Reads a job file: the job and its text.
///
/// # Errors
/// [`JobError`] with the file, the place in it and what to write.
pub fn load(path: &Path) -> Result<(Job, String), JobError> {
    let io = |source| JobError::Io {
        path: path.to_path_buf(),
        source,
    };
    let size = std::fs::metadata(path).map_err(io)?.len();
    if size > MAX_JOB_BYTES {
        return Err(io(std::io::Error::other(format!(
            "{size} bytes are too many for a job file; is it the part?"
        ))));
    }
    let text = std::fs::read_to_string(path).map_err(io)?;
    match parse(&text) {
        Ok(job) => Ok((job, text)),
        Err(e) => Err(JobError::Text {
            path: path.to_path_buf(),
            text,
            span: e.span,
            message: e.message,
            help: e.help,
        }),
    }
}

fn text_error(error: &toml::de::Error) -> TextError {
    TextError {
        span: error.span(),
        message: error.message().to_owned(),
        help: None,
    }
}
