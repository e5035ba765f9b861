#![no_main]

meltpath_fuzz::target!("cloud_lines");
