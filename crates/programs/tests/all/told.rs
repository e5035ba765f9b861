//! What tests of programs share: short programs, read and executed, and what a reading tells of its moves.

use std::fmt::Write as _;

use meltpath_base::Reporter;
use meltpath_geometry::math::DVec3;
use meltpath_programs::{
    Control, ExecutionSettings, Parsed, Program, ProgramError, Reading, Refusal, fanuc_ls,
    read_toolpath,
};
use meltpath_toolpath::{Channel, Move};

/// A move as a toolpath and its program tell it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Told {
    pub(crate) shape: Move,
    pub(crate) to: DVec3,
    pub(crate) axis: DVec3,
    pub(crate) speed: Option<f64>,
    pub(crate) wire_feed: Option<f64>,
    pub(crate) burns: bool,
    pub(crate) layer: u32,
    /// Of its layer, counted from 1.
    pub(crate) bead: u32,
    pub(crate) control: Control,
}

/// Every move that is no wait, in order.
pub(crate) fn motions(reading: &Reading) -> Vec<Told> {
    let moves = reading.toolpath.passes();
    let moves = moves.flat_map(|p| (0..p.move_count()).map(move |i| (p, i)));
    let told = moves.zip(&reading.controls).map(|((p, i), control)| Told {
        shape: p.move_at(i),
        to: p.points[i + 1],
        axis: p.axis(i + 1).unwrap(),
        speed: p.value(Channel::Speed, i),
        wire_feed: p.value(Channel::WireFeed, i),
        burns: p.head.role.deposits(),
        layer: p.layer,
        bead: p.head.bead + 1,
        control: *control,
    });
    told.filter(|t| !matches!(t.shape, Move::Spot { .. }))
        .collect()
}

pub(crate) fn parsed(text: &str) -> Parsed {
    fanuc_ls::parse(text).unwrap()
}

pub(crate) fn read(
    programs: &[Program],
    settings: &ExecutionSettings,
    reporter: &Reporter,
) -> Result<Reading, ProgramError> {
    let reading = read_toolpath(programs, settings, 1000.0, reporter)?;
    for layer in &reading.toolpath.layers {
        layer.sanity_check().unwrap();
    }
    Ok(reading)
}

pub(crate) fn execute(programs: &[Program]) -> Result<Reading, Refusal> {
    read(programs, &ExecutionSettings::default(), &Reporter::new()).map_err(|e| e.why)
}

/// A program with these instructions, and point 1 to 3 in frames 1.
pub(crate) fn program(name: &str, lines: &[&str]) -> Program {
    let mut text = format!("/PROG {name}\n/MN\n");
    for (i, line) in lines.iter().enumerate() {
        writeln!(text, "{:4}:{line} ;", i + 1).unwrap();
    }
    text += "/POS\n";
    for i in 1..=3 {
        write!(text, "P[{i}]{{\n GP1:\n UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = {i} mm, Y = 0 mm, Z = 0 mm, W = 180 deg, P = 0 deg, R = 0 deg\n}};\n"
        ).unwrap();
    }
    text += "P[4]{\n GP1:\n UF : 1, UT : 1,\n J1= 0 deg, J2= 0 deg\n};\n/END\n";
    parsed(&text).program
}
