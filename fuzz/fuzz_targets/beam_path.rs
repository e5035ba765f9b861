#![no_main]

meltpath_fuzz::target!("beam_path");
