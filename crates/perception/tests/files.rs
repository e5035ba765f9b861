//! The same record through every kind of file.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

use std::fs;
use std::path::Path;

use meltpath_base::Reporter;
use meltpath_perception::{Mapping, RecordError, read, table};
use meltpath_report::series::parquet::ParquetWriter;
use meltpath_report::series::{Column, Kind, Values};

const ROWS: usize = 500;

/// Time in s, voltage in V, encoder counts.
fn columns() -> [Vec<f64>; 3] {
    let t = |i: usize| 5e-5 * i as f64;
    [
        (0..ROWS).map(t).collect(),
        (0..ROWS)
            .map(|i| if i % 7 < 3 { 0.5 } else { -0.5 })
            .collect(),
        (0..ROWS)
            .map(|i| (1000.0 + 300.0 * (20.0 * t(i)).sin()).round())
            .collect(),
    ]
}

fn mapping() -> Mapping {
    Mapping::parse(
        "map.toml",
        "time = { column = \"t\", unit = \"s\" }\n[channels.voltage]\ncolumn = \"U\"\nunit = \"V\"\n\
         [channels.angle]\ncolumn = \"n\"\nunit = \"mrad\"\nscale = 0.1\noffset = 1000\n",
    )
    .unwrap()
}

/// A MAT file of level 5, little endian, uncompressed, with one column vector of doubles for each name; a row vector where the name
/// begins with `row`.
fn mat(variables: &[(&str, &[f64])]) -> Vec<u8> {
    let mut out = b"MATLAB 5.0 MAT-file, made by a test".to_vec();
    out.resize(124, b' ');
    out.extend([0x00, 0x01, b'I', b'M']);
    let element = |kind: u32, data: &[u8]| {
        let mut e = kind.to_le_bytes().to_vec();
        e.extend((data.len() as u32).to_le_bytes());
        e.extend(data);
        e.resize(e.len().next_multiple_of(8), 0);
        e
    };
    for (name, values) in variables {
        let mut body = element(6, &[6, 0, 0, 0, 0, 0, 0, 0]);
        let mut size = [i32::try_from(values.len()).unwrap(), 1];
        if name.starts_with("row") {
            size.reverse();
        }
        let size: Vec<u8> = size.iter().flat_map(|v| v.to_le_bytes()).collect();
        body.extend(element(5, &size));
        body.extend(element(1, name.as_bytes()));
        let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        body.extend(element(9, &data));
        out.extend(element(14, &body));
    }
    out
}

fn write_all(folder: &Path) {
    let [t, u, n] = columns();
    let names = || {
        vec![
            Column::new("t", "", Kind::Float),
            Column::new("U", "", Kind::Float),
            Column::new("n", "", Kind::Float),
        ]
    };
    let block = [Values::Float(&t), Values::Float(&u), Values::Float(&n)];
    let mut out = Vec::new();
    let mut parquet = ParquetWriter::new(&mut out, names()).unwrap();
    parquet.block(&block).unwrap();
    parquet.finish().unwrap();
    fs::write(folder.join("r.parquet"), out).unwrap();
    let mut text = String::from("# from a bench\nt;U;n\n");
    for i in 0..ROWS {
        let line = format!("{:e};{};{}\n", t[i], u[i], n[i]);
        text += &line.replace('.', ",");
    }
    fs::write(folder.join("r.csv"), text).unwrap();
    fs::write(
        folder.join("r.mat"),
        mat(&[("t", &t), ("U", &u), ("n", &n)]),
    )
    .unwrap();
}

#[test]
fn one_record_in_three_kinds_of_file() {
    let folder = tempfile::tempdir().unwrap();
    write_all(folder.path());
    let reporter = Reporter::new();
    let records: Vec<_> = ["r.csv", "r.parquet", "r.mat"]
        .iter()
        .map(|f| read(&folder.path().join(f), &mapping(), &reporter).unwrap())
        .collect();
    assert_eq!(records[0].len(), ROWS);
    assert!((records[0].period - 5e-5).abs() < 1e-15);
    assert_eq!(records[0], records[1]);
    assert_eq!(records[1], records[2]);
    assert!(
        records[0]
            .channel("angle")
            .unwrap()
            .iter()
            .all(|a| a.abs() <= 0.0301)
    );
    assert!(reporter.warnings().is_empty(), "{:?}", reporter.warnings());
}

#[test]
fn columns_without_names_are_numbered_and_empty_variables_left_out() {
    let table = table::csv("0;1,5;2\n1;-1,5;3\n").unwrap();
    let columns = [("1", [0.0, 1.0]), ("2", [1.5, -1.5]), ("3", [2.0, 3.0])];
    assert_eq!(
        table.columns,
        columns.map(|(n, v)| (n.to_owned(), v.to_vec()))
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.mat");
    let variables: [(&str, &[f64]); 3] = [("none", &[]), ("u", &[1.0, 2.0]), ("row", &[3.0, 4.0])];
    fs::write(&path, mat(&variables)).unwrap();
    let found = table::read(&path).unwrap();
    let columns = [("u", [1.0, 2.0]), ("row", [3.0, 4.0])];
    assert_eq!(
        found.columns,
        columns.map(|(n, v)| (n.to_owned(), v.to_vec()))
    );
}

/// Whole numbers and numbers that are not there, as pandas writes them.
#[test]
fn parquet_of_whole_numbers_and_of_gaps() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.parquet");
    let mut out = Vec::new();
    let names = vec![
        Column::new("n", "", Kind::Integer),
        Column::new("u", "", Kind::Float),
    ];
    let mut parquet = ParquetWriter::new(&mut out, names).unwrap();
    let block = [
        Values::Integer(&[7, -2, 1 << 40]),
        Values::Float(&[0.5, f64::NAN, 2.0]),
    ];
    parquet.block(&block).unwrap();
    parquet.finish().unwrap();
    fs::write(&path, out).unwrap();
    let found = table::read(&path).unwrap();
    assert_eq!(
        found.columns[0].1,
        [7.0, -2.0, f64::from(1 << 20) * f64::from(1 << 20)]
    );
    let u = &found.columns[1].1;
    assert!(u[0] == 0.5 && u[1].is_nan() && u[2] == 2.0, "{u:?}");
}

/// Times with a gap, and a sample time that is not theirs.
#[test]
fn times_that_do_not_hold_are_told_with_place_and_size() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.csv");
    let write = |times: &[f64]| {
        let rows: Vec<String> = times.iter().map(|t| format!("{t},1\n")).collect();
        fs::write(&path, format!("t,u\n{}", rows.concat())).unwrap();
    };
    let map = |stated: &str| {
        let text = format!(
            "{stated}time = {{ column = \"t\", unit = \"s\" }}\n[channels.u]\ncolumn = \"u\"\nunit = \"V\"\n"
        );
        Mapping::parse("m", &text).unwrap()
    };
    write(&[0.0, 0.5, 1.0, 1.5, 4.0, 4.5]);
    match read(&path, &map(""), &Reporter::new()) {
        Err(RecordError::Gap {
            row, step, usual, ..
        }) => assert_eq!((row, step, usual), (4, 2.5, 0.5)),
        other => panic!("{other:?}"),
    }
    write(&[0.0, 0.5, 1.0, 1.5]);
    let record = read(&path, &map("sample_time = \"0.5 s\"\n"), &Reporter::new()).unwrap();
    assert!((record.period - 0.5).abs() < 1e-12 && !record.is_empty());
    match read(&path, &map("sample_time = \"0.1 s\"\n"), &Reporter::new()) {
        Err(RecordError::Sampling { found, stated, .. }) => {
            assert!((found - 0.5).abs() < 1e-12 && (stated - 0.1).abs() < 1e-12);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn files_that_are_no_records_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_all(folder.path());
    let at = |name: &str| folder.path().join(name);
    fs::write(at("words.csv"), "t,U,n\n0,1,2\n1,two,3\n").unwrap();
    fs::write(at("empty.csv"), "").unwrap();
    fs::write(at("ragged.csv"), "t,U,n\n0,1,2\n1,2\n").unwrap();
    fs::write(at("other.csv"), "a,b\n0,1\n").unwrap();
    fs::write(at("new.mat"), "MATLAB 7.3 MAT-file").unwrap();
    fs::write(at("r.xls"), "x").unwrap();
    let cut = fs::read(at("r.parquet")).unwrap();
    fs::write(at("cut.parquet"), &cut[..cut.len() / 2]).unwrap();
    for (file, word) in [
        ("words.csv", "line 3, column \"U\""),
        ("empty.csv", "empty"),
        ("ragged.csv", "cannot read"),
        ("other.csv", "\"a\", \"b\""),
        ("new.mat", "-v7"),
        ("r.xls", ".parquet"),
        ("cut.parquet", "cannot read"),
        ("absent.csv", "cannot read"),
    ] {
        let error = read(&at(file), &mapping(), &Reporter::new()).unwrap_err();
        assert!(error.to_string().contains(word), "{file}: {error}");
    }
    let rows = Mapping::parse(
        "m",
        "rows = [1, 501]\nsample_time = \"1 s\"\n[channels.u]\ncolumn = 2\nunit = \"V\"\n",
    )
    .unwrap();
    let error = read(&at("r.csv"), &rows, &Reporter::new()).unwrap_err();
    assert!(
        matches!(error, RecordError::Rows { rows: ROWS, .. }),
        "{error}"
    );
}
