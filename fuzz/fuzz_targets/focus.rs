#![no_main]

meltpath_fuzz::target!("focus");
