#![no_main]

meltpath_fuzz::target!("pool");
