#![no_main]

meltpath_fuzz::target!("ur_script");
