//! Track and positioner along a program that was read.

use meltpath_robot::cell::External;
use meltpath_toolpath::{Pass, Toolpath};

use crate::waam::program::by_joints;
use crate::waam::settings::Settings;

/// Where track and positioner stand along a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Axes {
    /// Where it starts.
    pub start: External,
    /// At the end of each command.
    pub ends: Vec<External>,
}

impl Axes {
    /// Where they stand at the end of a command; where the program starts without one.
    pub(in crate::waam) fn at(&self, command: Option<u32>) -> External {
        let end = command.and_then(|c| self.ends.get(c as usize));
        end.copied().unwrap_or(self.start)
    }
}

/// Where the robot's track and positioner stand at the ends of the moves; nothing where the program does not say as many axes.
pub(super) fn external(toolpath: &Toolpath, settings: &Settings) -> Option<Axes> {
    let cell = settings.robot.as_ref()?;
    let at = |pass: &Pass<'_>, i: usize| {
        let said: Option<Vec<f64>> = pass.external(i).collect();
        by_joints::external(cell, &said?)
    };
    let start = at(&toolpath.passes().next()?, 0)?;
    let passes = toolpath.passes();
    let ends = passes.flat_map(|p| (1..p.points.len()).map(move |i| at(&p, i)));
    Some(Axes {
        start,
        ends: ends.collect::<Option<Vec<_>>>()?,
    })
}

/// Whether an external axis moves along beads or between them, beside the first `slides` ones, which carry the arm.
pub(super) fn turns(toolpath: &Toolpath, slides: usize) -> bool {
    let beads = toolpath.passes().filter(|p| p.head.role.deposits());
    let points = beads.flat_map(|p| {
        (0..p.points.len()).map(move |i| p.external(i).skip(slides).collect::<Vec<_>>())
    });
    let mut said = points.filter(|axes| axes.iter().any(Option::is_some));
    said.next()
        .is_some_and(|first| said.any(|axes| axes != first))
}
