#![no_main]

meltpath_fuzz::target!("record_mat");
