#![no_main]

meltpath_fuzz::target!("process_map");
