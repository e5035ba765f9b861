//! Writes a report with invented numbers, and the files beside it, into a folder: to look at the report itself.
//!
//! `cargo run -p meltpath-report --example demo -- FOLDER`

#[path = "../tests/all/demo.rs"]
mod demo;

use std::path::PathBuf;

use meltpath_base::output::OutputFolder;
use meltpath_report::html::write_html;
use meltpath_report::series::csv::CsvWriter;
use meltpath_report::series::parquet::ParquetWriter;
use meltpath_report::series::{Column, Kind, Values};
use meltpath_report::vtk;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args_os()
        .nth(1)
        .map(PathBuf::from)
        .ok_or("say where: demo FOLDER [STEP_MM]")?;
    let step = std::env::args().nth(2).map_or(Ok(0.5), |s| s.parse())?;
    let report = demo::report(step);
    let folder = OutputFolder::create(&path)?;
    let other = |e: &dyn std::fmt::Display| std::io::Error::other(e.to_string());
    folder.write("report.html", |w| {
        write_html(w, &report).map_err(|e| other(&e))
    })?;
    let [beads, travels] = demo::lines(step);
    folder.write("paraview/path.vtp", |w| {
        vtk::write_lines(w, &beads).map_err(|e| other(&e))
    })?;
    folder.write("paraview/travels.vtp", |w| {
        vtk::write_lines(w, &travels).map_err(|e| other(&e))
    })?;
    let grid = demo::grid(1.0);
    let mut steps = Vec::new();
    for layer in 1..=demo::LAYERS {
        let [height, error] = demo::surface(&grid, layer);
        let fields =
            [("height", &height), ("height error", &error)].map(|(name, values)| vtk::Field {
                name,
                unit: "mm",
                values: vtk::Values::Float64(values),
            });
        let name = format!("layers/{layer:03}.vti");
        folder.write(&format!("paraview/{name}"), |w| {
            vtk::write_height_image(w, &grid, 0.0, &fields).map_err(|e| other(&e))
        })?;
        steps.push((f64::from(layer), name));
    }
    folder.write("paraview/layers.pvd", |w| vtk::write_collection(w, &steps))?;
    let head = vec![
        Column::new("time", "s", Kind::Float),
        Column::new("speed", "mm/s", Kind::Float),
        Column::new("point", "", Kind::Integer),
    ];
    let column = |i: usize| -> Vec<f64> {
        beads.scalars[i]
            .values
            .iter()
            .map(|&v| f64::from(v))
            .collect()
    };
    let (speed, time) = (column(0), column(1));
    let point: Vec<i64> = (0..).take(time.len()).collect();
    let block = [
        Values::Float(&time),
        Values::Float(&speed),
        Values::Integer(&point),
    ];
    folder.write("series/motion.csv", |w| {
        let mut csv = CsvWriter::new(w, head.clone()).map_err(|e| other(&e))?;
        csv.block(&block)
            .and_then(|()| csv.finish())
            .map_err(|e| other(&e))
    })?;
    folder.write("series/motion.parquet", |w| {
        let mut parquet = ParquetWriter::new(w, head).map_err(|e| other(&e))?;
        parquet
            .block(&block)
            .and_then(|()| parquet.finish())
            .map_err(|e| other(&e))
    })?;
    folder.commit()?;
    Ok(())
}
