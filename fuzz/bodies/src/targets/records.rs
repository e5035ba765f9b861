//! Records and tables: CSV, MAT, Parquet.

use meltpath::compare::samples;
use meltpath_base::Reporter;
use meltpath_perception::{Mapping, table};
use meltpath_report::series::parquet::ParquetWriter;
use meltpath_report::series::{Column, Kind, Values};

use super::{Target, in_file};
use crate::mutate::Form;

/// Tables as CSV.
pub(super) const CSV: Target = Target {
    name: "record_csv",
    form: Form::Text,
    seeds: || {
        vec![
            b"t,U,angle\n0,0.5,1\n5e-5,-0.5,2\n1e-4,,3\n".to_vec(),
            b"# bench 3\n0,0;1,5\n0,1;-1,5\n0,2;2,5\n".to_vec(),
            b"t\tU\n0\t1\n1\t\"2\"\n".to_vec(),
        ]
    },
    body: |bytes| {
        let Ok(text) = std::str::from_utf8(bytes) else {
            return;
        };
        if let Ok(read) = table::csv(text) {
            let rows = read.rows();
            assert!(read.columns.iter().all(|c| c.1.len() >= rows));
        }
        in_file(bytes, ".csv", record);
    },
};

/// The whole way of a record: read, mapped, examined.
fn record(path: &std::path::Path) {
    let mapping =
        "time = { column = \"t\", unit = \"s\" }\n[channels.voltage]\ncolumn = 2\nunit = \"V\"\n";
    let mapping = Mapping::parse("fuzz.toml", mapping).unwrap();
    if let Ok(record) = meltpath_perception::read(path, &mapping, &Reporter::new()) {
        assert!(record.period > 0.0);
    }
}

/// A MAT file of level 5 with `arrays` of doubles, uncompressed (MathWorks, MAT-File Format, 2019).
fn mat(arrays: &[(&str, &[f64])]) -> Vec<u8> {
    let mut file = format!("{:<124}", "MATLAB 5.0 MAT-file").into_bytes();
    file.extend([0x00, 0x01, b'I', b'M']);
    let element = |kind: u32, data: &[u8]| {
        let mut bytes = kind.to_le_bytes().to_vec();
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    for (name, values) in arrays {
        let size: Vec<u8> = [i32::try_from(values.len()).unwrap_or(i32::MAX), 1]
            .iter()
            .flat_map(|n| n.to_le_bytes())
            .collect();
        let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let body = [
            element(6, &[6, 0, 0, 0, 0, 0, 0, 0]),
            element(5, &size),
            element(1, name.as_bytes()),
            element(9, &data),
        ];
        file.extend(element(14, &body.concat()));
    }
    file
}

/// MAT files.
pub(super) const MAT: Target = Target {
    name: "record_mat",
    form: Form::Binary,
    seeds: || {
        vec![mat(&[
            ("t", &[0.0, 0.1, 0.2, 0.3]),
            ("U", &[1.0, -1.0, 1.0, 2.0]),
        ])]
    },
    body: |bytes| in_file(bytes, ".mat", record),
};

fn parquet() -> Vec<u8> {
    let mut out = Vec::new();
    let columns = vec![
        Column::new("t", "", Kind::Float),
        Column::new("U", "", Kind::Float),
        Column::new("layer", "", Kind::Integer),
        Column::new("note", "", Kind::Text),
    ];
    let mut writer = ParquetWriter::new(&mut out, columns).unwrap();
    let notes = ["a", "b", "", "d"].map(str::to_owned);
    for _ in 0..2 {
        writer
            .block(&[
                Values::Float(&[0.0, 0.1, 0.2, 0.3]),
                Values::Float(&[1.0, f64::NAN, -1.0, 2.0]),
                Values::Integer(&[1, 1, 2, 2]),
                Values::Text(&notes),
            ])
            .unwrap();
    }
    writer.finish().unwrap();
    out
}

/// Parquet tables.
pub(super) const PARQUET: Target = Target {
    name: "record_parquet",
    form: Form::Binary,
    seeds: || vec![parquet()],
    body: |bytes| in_file(bytes, ".parquet", record),
};

/// Tables of temperatures to compare with.
pub(super) const SAMPLES: Target = Target {
    name: "samples",
    form: Form::Text,
    seeds: || {
        vec![
            b"x [mm],y [mm],z [mm],t [s],T [K]\n0,0,0,0,300\n1,0,-0.1,0.5,1200.5\n".to_vec(),
            "x,y,z,t,T_max [\u{b0}C],time_molten [ms]\n0,0,0,1,1800,2\n"
                .as_bytes()
                .to_vec(),
        ]
    },
    body: |bytes| {
        in_file(bytes, ".csv", |path| {
            let _ = samples::of_any_layer(path, &Reporter::new());
        });
    },
};
