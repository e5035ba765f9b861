//! Time to write a page and its files: a million segments whose speed and time carry noise, as a simulated motion does.

#![allow(clippy::unwrap_used, reason = "a bench that fails should stop")]

#[path = "../tests/all/demo.rs"]
mod demo;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use meltpath_report::html::{Report, write_html};
use meltpath_report::series::csv::CsvWriter;
use meltpath_report::series::parquet::ParquetWriter;
use meltpath_report::series::{Column, Kind, Values};
use meltpath_report::vtk::write_lines;

/// The demo with a million points that scatter by up to 20 µm, and a speed that scatters by up to 0.1 mm/s.
fn noisy() -> Report {
    let mut report = demo::report(0.00846);
    let mut seed = 1_u64;
    let mut noise = move || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f64 / f64::from(1 << 24) - 0.5
    };
    for set in report.scene.iter_mut().flat_map(|s| &mut s.lines) {
        for p in &mut set.points {
            p.x += 0.04 * noise();
            p.y += 0.04 * noise();
        }
        for v in set.scalars.iter_mut().flat_map(|s| &mut s.values) {
            *v += 0.2 * noise() as f32;
        }
    }
    report
}

fn writing(c: &mut Criterion) {
    let report = noisy();
    let mut size = Vec::new();
    let mut group = c.benchmark_group("a million segments");
    group.sample_size(10);
    group.bench_function("html", |b| {
        b.iter(|| {
            size.clear();
            write_html(&mut size, black_box(&report)).unwrap();
            size.len()
        });
    });
    let beads = &demo::lines(0.00846)[0];
    group.bench_function("vtp", |b| {
        b.iter(|| {
            size.clear();
            write_lines(&mut size, black_box(beads)).unwrap();
        });
    });
    let columns = vec![
        Column::new("time", "s", Kind::Float),
        Column::new("speed", "mm/s", Kind::Float),
    ];
    let wide = |i: usize| -> Vec<f64> {
        beads.scalars[i]
            .values
            .iter()
            .map(|&v| f64::from(v))
            .collect()
    };
    let (speed, time) = (wide(0), wide(1));
    let block = [Values::Float(&time), Values::Float(&speed)];
    group.bench_function("csv", |b| {
        b.iter(|| {
            size.clear();
            let mut csv = CsvWriter::new(&mut size, columns.clone()).unwrap();
            csv.block(&block).unwrap();
            csv.finish().unwrap();
        });
    });
    group.bench_function("parquet", |b| {
        b.iter(|| {
            size.clear();
            let mut parquet = ParquetWriter::new(&mut size, columns.clone()).unwrap();
            parquet.block(&block).unwrap();
            parquet.finish().unwrap();
        });
    });
    group.finish();
}

criterion_group!(benches, writing);
criterion_main!(benches);
