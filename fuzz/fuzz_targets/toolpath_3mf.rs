#![no_main]

meltpath_fuzz::target!("toolpath_3mf");
