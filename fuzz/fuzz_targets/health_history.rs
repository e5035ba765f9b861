#![no_main]

meltpath_fuzz::target!("health_history");
