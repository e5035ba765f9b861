//! The marked path as a series of a file, written while the head runs: memory does not grow with the job.

use std::io;
use std::sync::mpsc::{SyncSender, sync_channel};

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_report::series::csv::CsvWriter;
use meltpath_report::series::parquet::ParquetWriter;
use meltpath_report::series::{Column, Kind, SeriesError, Values};
use meltpath_toolpath::{MotionBlock, MotionSink};

use crate::job::lpbf::MotionForm;

/// Rows written at once.
const ROWS: usize = 1 << 16;
/// Blocks that may wait to be written.
const WAITING: usize = 16;

/// Sends blocks to the thread that writes.
struct Post(SyncSender<MotionBlock>);

impl MotionSink for Post {
    fn block(&mut self, block: &MotionBlock) {
        // where writing failed nobody listens any more; the writer tells why
        let _ = self.0.send(block.clone());
    }
}

/// Runs `run` with a sink that goes into the file `name` of the folder, `.csv` or `.parquet` added.
pub(super) fn write_while<R: Send>(
    folder: &OutputFolder,
    name: &str,
    form: MotionForm,
    run: impl FnOnce(&mut (dyn MotionSink + Send)) -> R + Send,
) -> Result<R, OutputError> {
    let (to, from) = sync_channel(WAITING);
    std::thread::scope(|scope| {
        let running = scope.spawn(move || run(&mut Post(to)));
        let blocks = from.into_iter();
        let written = match form {
            MotionForm::Csv => folder.write(&format!("{name}.csv"), |w| csv(w, blocks)),
            MotionForm::Parquet => folder.write(&format!("{name}.parquet"), |w| parquet(w, blocks)),
        };
        let outcome = match running.join() {
            Ok(outcome) => outcome,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        written.map(|()| outcome)
    })
}

fn columns() -> Vec<Column> {
    [
        ("time", "s", Kind::Float),
        ("x", "mm", Kind::Float),
        ("y", "mm", Kind::Float),
        ("z", "mm", Kind::Float),
        ("speed", "mm/s", Kind::Float),
        ("power", "W", Kind::Float),
        ("vector", "", Kind::Integer),
    ]
    .map(|(name, unit, kind)| Column::new(name, unit, kind))
    .to_vec()
}

/// Rows that wait to be written.
#[derive(Default)]
struct Rows {
    floats: [Vec<f64>; 6],
    vector: Vec<i64>,
}

impl Rows {
    fn add(&mut self, block: &MotionBlock) {
        for i in 0..block.len() {
            let at = block.position[i];
            let values = [
                block.time(i),
                at.x,
                at.y,
                at.z,
                block.speed[i],
                block.power[i],
            ];
            for (column, value) in self.floats.iter_mut().zip(values) {
                column.push(value);
            }
            self.vector.push(i64::from(block.command[i]));
        }
    }

    fn values(&self) -> Vec<Values<'_>> {
        let mut all: Vec<_> = self.floats.iter().map(|c| Values::Float(c)).collect();
        all.push(Values::Integer(&self.vector));
        all
    }

    fn clear(&mut self) {
        for column in &mut self.floats {
            column.clear();
        }
        self.vector.clear();
    }
}

fn told(error: SeriesError) -> io::Error {
    match error {
        SeriesError::Io(e) => e,
        other => io::Error::other(other),
    }
}

fn each(
    blocks: impl Iterator<Item = MotionBlock>,
    mut write: impl FnMut(&[Values<'_>]) -> Result<(), SeriesError>,
) -> io::Result<()> {
    let mut rows = Rows::default();
    for block in blocks {
        rows.add(&block);
        if rows.vector.len() >= ROWS {
            write(&rows.values()).map_err(told)?;
            rows.clear();
        }
    }
    write(&rows.values()).map_err(told)
}

fn csv(w: &mut dyn io::Write, blocks: impl Iterator<Item = MotionBlock>) -> io::Result<()> {
    let mut file = CsvWriter::new(w, columns()).map_err(told)?;
    each(blocks, |rows| file.block(rows))?;
    file.finish().map_err(told)
}

fn parquet(w: &mut dyn io::Write, blocks: impl Iterator<Item = MotionBlock>) -> io::Result<()> {
    let mut file = ParquetWriter::new(w, columns()).map_err(told)?;
    each(blocks, |rows| file.block(rows))?;
    file.finish().map_err(told)
}
