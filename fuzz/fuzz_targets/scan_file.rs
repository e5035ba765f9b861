#![no_main]

meltpath_fuzz::target!("scan_file");
