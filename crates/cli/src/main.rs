//! The command line of meltpath.

fn main() {}
