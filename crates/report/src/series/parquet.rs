//! Apache Parquet, as much as a flat series needs: required columns of doubles, 64-bit integers and text, plain
//! encoding, gzip pages, one row group per block. pandas, Polars, DuckDB and pyarrow read it.
//!
//! Source: Apache Parquet format 2.x, `parquet.thrift` and Encodings.md. Own writer: the `parquet` crate takes 50 s of
//! build on two cores for the same bytes.

#![expect(
    clippy::cast_possible_wrap,
    reason = "the format's sizes are signed; a page is checked to stay below 2 GiB and a file is far below 2^63"
)]

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::GzEncoder;
use rayon::prelude::*;

use super::thrift::{Struct, structure};
use super::{Column, Kind, SeriesError, Values, check};

const MAGIC: &[u8; 4] = b"PAR1";
const INT64: i32 = 2;
const DOUBLE: i32 = 5;
const BYTE_ARRAY: i32 = 6;
const PLAIN: i32 = 0;
const RLE: i32 = 3;
const GZIP: i32 = 2;
const DATA_PAGE: i32 = 0;
const REQUIRED: i32 = 0;
const UTF8: i32 = 0;

fn physical(kind: Kind) -> i32 {
    match kind {
        Kind::Float => DOUBLE,
        Kind::Integer => INT64,
        Kind::Text => BYTE_ARRAY,
    }
}

/// One column of one row group as written.
struct Chunk {
    offset: u64,
    rows: i64,
    /// Page header and data, before and after compression.
    plain: i64,
    packed: i64,
}

struct RowGroup {
    rows: i64,
    chunks: Vec<Chunk>,
}

/// Writes a series as Parquet. Blocks of 10^4 to 10^6 rows are a good size.
pub struct ParquetWriter<'w> {
    out: &'w mut dyn Write,
    columns: Vec<Column>,
    groups: Vec<RowGroup>,
    position: u64,
}

impl<'w> ParquetWriter<'w> {
    /// Begins the file.
    ///
    /// # Errors
    /// [`SeriesError::Io`].
    pub fn new(out: &'w mut dyn Write, columns: Vec<Column>) -> Result<Self, SeriesError> {
        out.write_all(MAGIC)?;
        Ok(ParquetWriter {
            out,
            columns,
            groups: Vec::new(),
            position: MAGIC.len() as u64,
        })
    }

    /// Writes rows as one row group; an empty block writes nothing.
    ///
    /// # Errors
    /// A block that does not match the head, before anything of it is written; [`SeriesError::Io`].
    pub fn block(&mut self, block: &[Values<'_>]) -> Result<(), SeriesError> {
        let rows = check(&self.columns, block)? as i64;
        if rows == 0 {
            return Ok(());
        }
        let pages: Vec<(usize, Vec<u8>)> = block.par_iter().map(page).collect::<io::Result<_>>()?;
        let mut chunks = Vec::with_capacity(pages.len());
        for (plain, packed) in pages {
            let mut header = Vec::new();
            structure(&mut header, |page| {
                page.i32(1, DATA_PAGE);
                page.i32(2, plain as i32);
                page.i32(3, packed.len() as i32);
                page.structure(5, |data| {
                    data.i32(1, rows as i32);
                    data.i32(2, PLAIN);
                    data.i32(3, RLE);
                    data.i32(4, RLE);
                });
            });
            self.out.write_all(&header)?;
            self.out.write_all(&packed)?;
            chunks.push(Chunk {
                offset: self.position,
                rows,
                plain: (header.len() + plain) as i64,
                packed: (header.len() + packed.len()) as i64,
            });
            self.position += (header.len() + packed.len()) as u64;
        }
        self.groups.push(RowGroup { rows, chunks });
        Ok(())
    }

    /// Writes the footer, without which the file is none.
    ///
    /// # Errors
    /// [`SeriesError::Io`].
    pub fn finish(self) -> Result<(), SeriesError> {
        let mut footer = Vec::new();
        structure(&mut footer, |file| self.metadata(file));
        self.out.write_all(&footer)?;
        self.out.write_all(&(footer.len() as u32).to_le_bytes())?;
        self.out.write_all(MAGIC)?;
        Ok(self.out.flush()?)
    }

    fn metadata(&self, file: &mut Struct<'_>) {
        file.i32(1, 1);
        // the root of the schema is an element of its own
        let elements: Vec<Option<&Column>> = std::iter::once(None)
            .chain(self.columns.iter().map(Some))
            .collect();
        file.structures(2, &elements, |element, column| match column {
            None => {
                element.string(4, "series");
                element.i32(5, self.columns.len() as i32);
            }
            Some(column) => {
                element.i32(1, physical(column.kind));
                element.i32(3, REQUIRED);
                element.string(4, &column.title());
                if column.kind == Kind::Text {
                    element.i32(6, UTF8);
                }
            }
        });
        file.i64(3, self.groups.iter().map(|g| g.rows).sum());
        file.structures(4, &self.groups, |group, data| {
            let described: Vec<(&Column, &Chunk)> = self.columns.iter().zip(&data.chunks).collect();
            group.structures(1, &described, |chunk, &(column, written)| {
                chunk.i64(2, written.offset as i64);
                chunk.structure(3, |meta| {
                    meta.i32(1, physical(column.kind));
                    meta.enums(2, &[PLAIN, RLE]);
                    meta.strings(3, &[&column.title()]);
                    meta.i32(4, GZIP);
                    meta.i64(5, written.rows);
                    meta.i64(6, written.plain);
                    meta.i64(7, written.packed);
                    meta.i64(9, written.offset as i64);
                });
            });
            group.i64(2, data.chunks.iter().map(|c| c.plain).sum());
            group.i64(3, data.rows);
        });
        file.string(6, concat!("meltpath version ", env!("CARGO_PKG_VERSION")));
    }
}

/// Size of the plain values and the compressed page.
fn page(values: &Values<'_>) -> io::Result<(usize, Vec<u8>)> {
    let mut plain = Vec::with_capacity(8 * values.len());
    match values {
        Values::Float(v) => v
            .iter()
            .for_each(|x| plain.extend_from_slice(&x.to_le_bytes())),
        Values::Integer(v) => v
            .iter()
            .for_each(|x| plain.extend_from_slice(&x.to_le_bytes())),
        Values::Text(v) => {
            for text in *v {
                plain.extend_from_slice(&(text.len() as u32).to_le_bytes());
                plain.extend_from_slice(text.as_bytes());
            }
        }
    }
    if plain.len() > i32::MAX as usize {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "a Parquet page holds at most 2 GiB: write smaller blocks",
        ));
    }
    // the fastest level: halves a motion record at several hundred MB/s
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(&plain)?;
    Ok((plain.len(), encoder.finish()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_begins_and_ends_as_the_format_says() {
        let mut out = Vec::new();
        let head = vec![
            Column::new("time", "s", Kind::Float),
            Column::new("layer", "", Kind::Integer),
            Column::new("note", "", Kind::Text),
        ];
        let mut writer = ParquetWriter::new(&mut out, head).unwrap();
        for layer in 0..3 {
            let notes = [String::from("é"), String::new()];
            writer
                .block(&[
                    Values::Float(&[0.5, f64::NAN]),
                    Values::Integer(&[layer, -1]),
                    Values::Text(&notes),
                ])
                .unwrap();
        }
        writer.finish().unwrap();
        assert_eq!(&out[..4], MAGIC);
        assert_eq!(&out[out.len() - 4..], MAGIC);
        let footer =
            u32::from_le_bytes(out[out.len() - 8..out.len() - 4].try_into().unwrap()) as usize;
        let metadata = &out[out.len() - 8 - footer..out.len() - 8];
        // version 1, then the list of four schema elements
        assert_eq!(&metadata[..4], [0x15, 2, 0x19, 0x4c]);
        assert_eq!(metadata.last(), Some(&0));
    }

    #[test]
    fn blocks_that_do_not_fit_write_nothing() {
        let mut out = Vec::new();
        let mut writer =
            ParquetWriter::new(&mut out, vec![Column::new("t", "s", Kind::Float)]).unwrap();
        assert!(writer.block(&[Values::Integer(&[1])]).is_err());
        assert_eq!(writer.position, 4);
    }
}
