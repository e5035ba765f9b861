//! A layer as a head executes it.

use crate::head::error::HeadError;
use crate::head::vector::ScanJob;

/// A layer as a head executes it, in the plane of the field: the platform goes down, the focus stays.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// The number of its first vector in the whole job, from 0.
    pub first: u32,
    /// Its number.
    pub number: u32,
    /// Its height, mm.
    pub height: f64,
    /// Its vectors, from where the layer before ended.
    pub job: ScanJob,
}

/// The layers of a job, first executed first, one after the other.
pub type Layers<'a> = Box<dyn Iterator<Item = Result<Prepared, HeadError>> + Send + 'a>;

impl Prepared {
    /// The whole of a job.
    pub fn of(job: ScanJob) -> Self {
        Prepared {
            first: 0,
            number: 1,
            height: 0.0,
            job,
        }
    }

    /// The number of the first vector after it.
    pub fn end(&self) -> u32 {
        self.first + self.job.vectors.len() as u32
    }
}

/// A job as the only layer of another.
pub fn alone(job: &ScanJob) -> Layers<'static> {
    Box::new(std::iter::once(Ok(Prepared::of(job.clone()))))
}
