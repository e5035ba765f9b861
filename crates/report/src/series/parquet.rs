//! Apache Parquet, as much as a flat series needs: required columns of doubles, 64-bit integers and text, gzip pages, one row
//! group per block. pandas, Polars, DuckDB and pyarrow read it. The `parquet` crate writes it, as it reads measured records.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, GzipLevel, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};

use super::{Column, Kind, SeriesError, Values, check};

/// Writes a series as Parquet. Blocks of 10^4 to 10^6 rows are a good size.
pub struct ParquetWriter<'w> {
    out: &'w mut dyn Write,
    columns: Vec<Column>,
    /// Holds at most the row group that is being written.
    file: SerializedFileWriter<Vec<u8>>,
}

impl<'w> ParquetWriter<'w> {
    /// Begins the file.
    ///
    /// # Errors
    /// [`SeriesError::Io`].
    pub fn new(out: &'w mut dyn Write, columns: Vec<Column>) -> Result<Self, SeriesError> {
        // the fastest level: halves a motion record
        let level = GzipLevel::try_new(1).map_err(failed)?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::GZIP(level))
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None)
            .set_created_by(concat!("meltpath version ", env!("CARGO_PKG_VERSION")).to_owned())
            .build();
        let schema = schema(&columns).map_err(failed)?;
        let file = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties));
        Ok(ParquetWriter {
            out,
            columns,
            file: file.map_err(failed)?,
        })
    }

    /// Writes rows as one row group; an empty block writes nothing.
    ///
    /// # Errors
    /// A block that does not match the head, before anything of it is written; [`SeriesError::Io`].
    pub fn block(&mut self, block: &[Values<'_>]) -> Result<(), SeriesError> {
        if check(&self.columns, block)? == 0 {
            return Ok(());
        }
        row_group(&mut self.file, block).map_err(failed)?;
        self.file.flush()?;
        Ok(self.out.write_all(&std::mem::take(self.file.inner_mut()))?)
    }

    /// Writes the footer, without which the file is none.
    ///
    /// # Errors
    /// [`SeriesError::Io`].
    pub fn finish(self) -> Result<(), SeriesError> {
        self.out
            .write_all(&self.file.into_inner().map_err(failed)?)?;
        Ok(self.out.flush()?)
    }
}

fn failed(error: ParquetError) -> SeriesError {
    SeriesError::Io(io::Error::other(error))
}

fn schema(columns: &[Column]) -> Result<TypePtr, ParquetError> {
    let field = |column: &Column| {
        let (physical, converted) = match column.kind {
            Kind::Float => (Physical::DOUBLE, ConvertedType::NONE),
            Kind::Integer => (Physical::INT64, ConvertedType::NONE),
            Kind::Text => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
        };
        let built = Type::primitive_type_builder(&column.title(), physical)
            .with_repetition(Repetition::REQUIRED)
            .with_converted_type(converted)
            .build();
        Ok(Arc::new(built?))
    };
    let fields = columns
        .iter()
        .map(field)
        .collect::<Result<Vec<_>, ParquetError>>()?;
    let root = Type::group_type_builder("series").with_fields(fields);
    Ok(Arc::new(root.build()?))
}

fn row_group(
    file: &mut SerializedFileWriter<Vec<u8>>,
    block: &[Values<'_>],
) -> Result<(), ParquetError> {
    let mut group = file.next_row_group()?;
    for values in block {
        let Some(mut column) = group.next_column()? else {
            break;
        };
        match (column.untyped(), values) {
            (ColumnWriter::DoubleColumnWriter(c), Values::Float(v)) => {
                c.write_batch(v, None, None)?
            }
            (ColumnWriter::Int64ColumnWriter(c), Values::Integer(v)) => {
                c.write_batch(v, None, None)?
            }
            (ColumnWriter::ByteArrayColumnWriter(c), Values::Text(v)) => {
                let texts: Vec<ByteArray> = v.iter().map(|t| t.as_str().into()).collect();
                c.write_batch(&texts, None, None)?
            }
            _ => return Err(ParquetError::General("a block unlike its head".to_owned())),
        };
        column.close()?;
    }
    group.close()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    #[test]
    fn what_is_written_is_read_block_by_block() {
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
        let file = reader(&out);
        assert_eq!(file.num_row_groups(), 3);
        let rows: Vec<_> = file
            .get_row_iter(None)
            .unwrap()
            .map(Result::unwrap)
            .collect();
        let names: Vec<&String> = rows[0].get_column_iter().map(|c| c.0).collect();
        assert_eq!(names, ["time_s", "layer", "note"]);
        let values: Vec<&Field> = rows[4].get_column_iter().map(|c| c.1).collect();
        assert_eq!(
            values,
            [
                &Field::Double(0.5),
                &Field::Long(2),
                &Field::Str("é".to_owned())
            ]
        );
        let last: Vec<&Field> = rows[5].get_column_iter().map(|c| c.1).collect();
        assert!(matches!(last[0], Field::Double(v) if v.is_nan()));
        assert_eq!(last[1], &Field::Long(-1));
    }

    fn reader(bytes: &[u8]) -> SerializedFileReader<std::fs::File> {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        SerializedFileReader::new(file).unwrap()
    }

    #[test]
    fn blocks_that_do_not_fit_write_nothing() {
        let mut out = Vec::new();
        let mut writer =
            ParquetWriter::new(&mut out, vec![Column::new("t", "s", Kind::Float)]).unwrap();
        assert!(writer.block(&[Values::Integer(&[1])]).is_err());
        writer.block(&[Values::Float(&[])]).unwrap();
        writer.finish().unwrap();
        assert_eq!(reader(&out).metadata().file_metadata().num_rows(), 0);
    }
}
