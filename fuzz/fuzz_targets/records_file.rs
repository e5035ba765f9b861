#![no_main]

meltpath_fuzz::target!("records_file");
