#![no_main]

meltpath_fuzz::target!("val3");
